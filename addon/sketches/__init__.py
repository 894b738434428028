"""Sketches to try the program with, drawn by hand: the SVG is the original, the PNG its picture."""
