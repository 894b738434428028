"""Sculpting the head: makes data/head.npz of the source data. Posing needs nothing of it."""
