"""Files that Blender's own exporters write: FBX, and faces that move."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import to_blender
from facs_rig.blender.arrays import write_key, write_places
from facs_rig.blender.beard_files import keyed
from facs_rig.blender.hair_files import hair_object, held_by_files
from facs_rig.blender.hair_follows import hat_of
from facs_rig.blender.keys import BASIS
from facs_rig.blender.pose import animated_range, armature_of, mover_of
from facs_rig.blender.shape import staged
from facs_rig.blender.twin import discard
from facs_rig.common.errors import InputError
from facs_rig.shape import Shape


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


def write_still_fbx(path: Path, *things: bpy.types.Object) -> None:
    """Write objects of the current view layer to an .fbx, as y up and in metres."""
    _select_alone(*things)
    _still_fbx(path)


def _still_fbx(path: Path) -> None:
    bpy.ops.export_scene.fbx(
        filepath=str(path),
        use_selection=True,
        object_types={"MESH"},
        apply_scale_options="FBX_SCALE_ALL",  # metres, said in the file, and no scaled object
        bake_space_transform=True,  # y up in the vertices themselves
        mesh_smooth_type="OFF",
        bake_anim=False,
    )


def write_shown_fbx(path: Path, name: str, face: bpy.types.Object, shape: Shape) -> None:
    """Write a face as it is shown, with its materials and a shape key for each move, and what it
    wears.

    name : of the object in the file
    """
    with staged(face) as (twin, layer):
        graph = layer.depsgraph
        mesh = bpy.data.meshes.new_from_object(
            twin.evaluated_get(graph), preserve_all_data_layers=True, depsgraph=graph
        )
    thing = bpy.data.objects.new(name, mesh)
    worn = [hair_object(part, f"{name} {part.name}") for part in shape.worn]
    try:
        points = to_blender(shape.points)
        write_places(mesh, points)
        moves = {name: to_blender(move) for name, move in shape.moves.items()}
        add_moves(thing, points, moves)
        mesh.update()
        for own, part in zip(worn, shape.worn, strict=True):
            moves = {name: to_blender(move) for name, move in part.moves.items()}
            add_moves(own, to_blender(part.points), moves)
        with _selected(bpy.context.scene.collection, thing, *worn):
            _still_fbx(path)
    finally:
        materials = [part.data.materials[0] for part in worn]
        discard(thing, *worn)
        bpy.data.batch_remove(materials)


def span_of(face: bpy.types.Object) -> tuple[int, int] | None:
    """First and last frame that anything of a face is animated at; None if nothing is."""
    mover = mover_of(face) or face
    things = (face, mover, face.data.shape_keys, armature_of(face), armature_of(mover))
    spans = [span for thing in things if thing is not None and (span := animated_range(thing))]
    if not spans:
        return None
    return math.floor(min(s for s, _ in spans)), math.ceil(max(e for _, e in spans))


def not_moving(face: bpy.types.Object) -> list[str]:
    """Names of the modifiers that a file with animation leaves out: shape keys and bones it has."""
    return [m.name for m in face.modifiers if m.type != "ARMATURE" and m.show_viewport]


def write_moving(path: Path, face: bpy.types.Object) -> None:
    """Write face, bones and all that moves them to a .glb or .fbx: an animation of every frame.

    The base is the neutral face; its keys have the names of the rig's, and their values move as
    the sliders make them. InputError, one sentence, for a face that does not move or is hidden.
    """
    span = span_of(face)
    if span is None:
        raise InputError(f"nothing of '{face.name}' is animated")
    armature, scene = armature_of(face), bpy.context.scene
    things = [thing for thing in (face, armature) if thing is not None]
    for thing in things:
        if not thing.visible_get():
            raise InputError(
                f"'{thing.name}' is hidden, and Blender exports what is shown: show it first"
            )
    was = scene.frame_start, scene.frame_end, scene.frame_current
    try:
        scene.frame_start, scene.frame_end = span
        hat = hat_of(face)
        if hat is not None and hat.visible_get():
            things.append(hat)
        with (
            held_by_files(face) as hair,
            keyed(face) as beard,
            _selected(None, *things, *(thing for thing in (hair, beard) if thing is not None)),
        ):
            write = _moving_glb if path.suffix.lower() == ".glb" else _moving_fbx
            write(str(path))
    finally:
        scene.frame_start, scene.frame_end = was[:2]
        scene.frame_set(was[2])


def _moving_glb(path: str) -> None:
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    wanted = {
        "export_animation_mode": "SCENE",  # as it is played: strips, drivers and all, in one clip
        "export_anim_scene_split_object": False,
        "export_nla_strips": False,  # before 3.6 that did it
        "export_frame_range": True,
        "export_force_sampling": True,
        "export_morph": True,
        "export_skins": True,
        "export_optimize_animation_size": False,
    }
    bpy.ops.export_scene.gltf(
        filepath=path,
        export_format="GLB",
        use_selection=True,
        export_animations=True,
        **{name: value for name, value in wanted.items() if name in known},
    )


def _moving_fbx(path: str) -> None:
    bpy.ops.export_scene.fbx(
        filepath=path,
        use_selection=True,
        object_types={"MESH", "ARMATURE"},
        add_leaf_bones=False,
        use_mesh_modifiers=False,  # or its shape keys would go
        mesh_smooth_type="OFF",
        bake_anim=True,
        bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False,
        bake_anim_force_startend_keying=True,
        bake_anim_simplify_factor=0.0,
    )


@contextmanager
def _selected(home: bpy.types.Collection | None, *things: bpy.types.Object) -> Iterator[None]:
    """While it lasts these alone are selected, and they are linked to `home`."""
    layer = bpy.context.view_layer
    before, active = list(bpy.context.selected_objects), layer.objects.active
    if home is not None:
        for thing in things:
            home.objects.link(thing)
    _select_alone(*things)
    try:
        yield
    finally:
        for thing in things:
            thing.select_set(False)
        for thing in before:
            thing.select_set(True)
        layer.objects.active = active


def _select_alone(*things: bpy.types.Object) -> None:
    for other in bpy.context.selected_objects:
        other.select_set(False)
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]
