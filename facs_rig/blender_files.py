"""Files that Blender's own exporters write: FBX, and faces that move."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender_arrays import write_key
from facs_rig.blender_keys import BASIS


def add_moves(
    thing: bpy.types.Object, points: NDArray[np.float32], moves: Mapping[str, NDArray[np.float32]]
) -> None:
    """Give a mesh object without shape keys one for each move (n, 3), at rest and not driven.

    points : (n, 3) where its vertices are, metres, Blender's axes
    """
    if not moves:
        return
    thing.shape_key_add(name=BASIS, from_mix=False)
    for name, move in moves.items():
        block = thing.shape_key_add(name=name, from_mix=False)
        write_key(block, points + move)
        block.value = 0.0


def write_still_fbx(path: Path, face: bpy.types.Object) -> None:
    """Write one object of the current view layer to an .fbx, as y up and in metres."""
    _select_alone(face)
    bpy.ops.export_scene.fbx(
        filepath=str(path),
        use_selection=True,
        object_types={"MESH"},
        apply_scale_options="FBX_SCALE_ALL",  # metres, said in the file, and no scaled object
        bake_space_transform=True,  # y up in the vertices themselves
        mesh_smooth_type="OFF",
        bake_anim=False,
    )


def _select_alone(*things: bpy.types.Object) -> None:
    for other in bpy.context.selected_objects:
        other.select_set(False)
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]
