"""A beard on its way to files: as Blender shows it, with the moves of its face."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy

from facs_rig.beard.mesh import NAME
from facs_rig.blender.armature import armature_of, to_blender
from facs_rig.blender.arrays import make_mesh, read_key, write_key, write_map
from facs_rig.blender.armature import drive
from facs_rig.blender.beard import beard_of, bound_of
from facs_rig.blender.hair import MAP
from facs_rig.blender.hair_files import worn_object
from facs_rig.shape import Shape, Worn


def shown_beard(face: bpy.types.Object) -> tuple[Worn, ...]:
    """The beard of a face in the world, as `hair_files.shown_hair` has hair."""
    beard = beard_of(face)
    if beard is None or (face.visible_get() and not beard.visible_get()):
        return ()
    return worn_object(beard, NAME)


def moving(face: bpy.types.Object, shape: Shape) -> Shape:
    """The shape with the moves of its beard, where it has moves and the face its own vertices."""
    beard = beard_of(face)
    bound = bound_of(beard) if beard is not None and shape.moves else None
    if bound is None or max(bound.index.max(), bound.anchors.max()) >= len(shape.points):
        return shape
    worn = tuple(
        replace(thing, moves=bound.moves(shape.points, shape.moves))
        if thing.name == NAME and len(thing.points) == len(bound.root) else thing
        for thing in shape.worn
    )  # fmt: skip
    return replace(shape, worn=worn)
