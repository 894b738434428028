"""Beards, moustaches and stubble as light meshes on any person of the rig.

A `Beard` is one beard as a few numbers on a chart of the lower face (`chart`), `beard_mesh` the
hairs that it makes on a person, and `follow` what makes each hair go with the skin that it grows
from, whatever the face does.
"""
