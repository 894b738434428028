"""A beard on its way to files: as Blender shows it, with the moves of its face."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy

from facs_rig.beard.mesh import NAME
from facs_rig.blender.armature import HEAD, armature_of, drive, from_blender, to_blender
from facs_rig.blender.arrays import read_key, write_places
from facs_rig.blender.beard import beard_of, bound_of
from facs_rig.blender.hair_files import worn_object
from facs_rig.blender.keys import BASIS, add_key
from facs_rig.blender.twin import discard
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


@contextmanager
def keyed(face: bpy.types.Object) -> Iterator[bpy.types.Object | None]:
    """While it lasts, a beard with shape keys and a bone in the place of its nodes, which Blender's
    exporters of animation know; None where a face shows no beard, or another mesh than it had."""
    beard, armature, keys = beard_of(face), armature_of(face), face.data.shape_keys
    bound = bound_of(beard) if beard is not None and beard.visible_get() else None
    if beard is None or armature is None or keys is None or bound is None:
        yield None
        return
    rest = from_blender(read_key(keys.reference_key))
    if max(bound.index.max(), bound.anchors.max()) >= len(rest):
        yield None
        return
    moves = {
        block.name: from_blender(read_key(block)) - rest
        for block in keys.key_blocks if block != keys.reference_key
    }  # fmt: skip
    points = to_blender(bound.points(rest))
    twin, name = beard.copy(), beard.name
    twin.data = beard.data.copy()
    try:
        twin.modifiers.clear()
        beard.name, twin.name = f"{name} (nodes)", name
        write_places(twin.data, points)
        twin.shape_key_add(name=BASIS, from_mix=False)
        for key, move in bound.moves(rest, moves).items():
            block = add_key(twin, key, points + to_blender(move), -10.0, 10.0)
            path = f'key_blocks["{key}"].value'
            drive(block.driver_add("value"), "value", {"value": (keys, path)})
        write_places(twin.data, points)
        twin.vertex_groups.new(name=HEAD).add(range(len(points)), 1.0, "REPLACE")
        twin.modifiers.new("Head", "ARMATURE").object = armature
        for home in beard.users_collection:
            home.objects.link(twin)
        yield twin
    finally:
        discard(twin)
        beard.name = name
