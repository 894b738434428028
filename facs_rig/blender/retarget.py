"""An expression on any mesh in Blender: the shape keys that its names stand for, set and keyed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from facs_rig.blender.pose import check_face, is_face, key_pose, pose_of, set_pose
from facs_rig.common.errors import InputError
from facs_rig.controls import CONTROL_NAMES
from facs_rig.conventions import CONVENTIONS
from facs_rig.parameters import FaceParameters
from facs_rig.retarget import Recognised, recognise, retarget, unshown


@dataclass(frozen=True)
class Worn:
    """What became of an expression on one mesh.

    label : of the convention      keys : how many shape keys were set, those at rest included
    unshown : active controls that none of these keys shows
    driven : keys that something else moves, left alone
    """

    label: str
    keys: int
    unshown: tuple[str, ...]
    driven: tuple[str, ...] = ()


def check_wearer(mesh: bpy.types.Object) -> Recognised | None:
    """What is known of a mesh's shape keys; None for our own faces, which have sliders instead.

    InputError, one sentence, for a mesh that cannot wear an expression: without shape keys or with
    unknown names, linked from another file, with every key driven.
    """
    keys = mesh.data.shape_keys
    if not is_face(mesh) and (keys is None or len(keys.key_blocks) < 2):
        raise InputError(f"'{mesh.name}' has no shape keys")
    library = mesh.library if is_face(mesh) else keys.library
    if library is not None:
        raise InputError(
            f"'{mesh.name}' is linked from '{bpy.path.basename(library.filepath)}': make it local, "
            "or make a library override of it and of its mesh"
        )
    if is_face(mesh):
        check_face(mesh)
        return None
    try:
        known = recognise(block.name for block in keys.key_blocks[1:])
    except InputError as error:
        raise InputError(f"'{mesh.name}' cannot wear an expression: {error}") from None
    if not set(known.found.values()) - _driven(keys):
        raise InputError(
            f"every shape key of '{mesh.name}' is driven by something else; pose that, or remove "
            "the drivers"
        )
    return known


def wear(
    mesh: bpy.types.Object,
    parameters: FaceParameters,
    *,
    frame: float | None = None,
    turn: bool = False,
) -> Worn:
    """Let a mesh do what `parameters` say; with `frame` keyframes are inserted there.

    Keys of the mesh's convention that the expression does not need come to rest; other keys stay.
    With `turn` a face of ours turns its head and neck too. Errors as `check_wearer` has them.
    """
    known = check_wearer(mesh)
    if known is None:
        pose = replace(parameters, gaze=pose_of(mesh).gaze)
        set_pose(mesh, pose, turn=turn)
        if frame is not None:
            key_pose(mesh, frame, turn=turn)
        return Worn(CONVENTIONS["ours"].label, len(CONTROL_NAMES), ())
    keys = mesh.data.shape_keys
    driven = _driven(keys)
    free = {key: name for key, name in known.found.items() if name not in driven}
    values = retarget(parameters.aus, known.convention.name)
    for key, name in free.items():
        block = keys.key_blocks[name]
        block.value = values[key]
        if frame is not None:
            block.keyframe_insert("value", frame=frame, group="Expression")
    return Worn(
        known.convention.label,
        len(free),
        unshown(parameters.aus, known.convention, free),
        tuple(name for name in known.found.values() if name in driven),
    )


def _driven(keys: bpy.types.Key) -> set[str]:
    """Names of the shape keys whose values have drivers."""
    drivers = keys.animation_data.drivers if keys.animation_data else ()
    paths = {curve.data_path for curve in drivers}
    return {block.name for block in keys.key_blocks if block.path_from_id("value") in paths}
