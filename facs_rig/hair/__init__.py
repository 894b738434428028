"""Heads of hair as light meshes on any person of the rig.

A `Cut` is one head of hair as a few parameters, `shell` the closed surface that it makes on a
person, `locks` the ribbons on it, and `bind` what makes both follow the skull.
"""
