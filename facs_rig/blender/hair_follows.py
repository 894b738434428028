"""Hair in Blender as whoever changes a face has to know it: found, checked, taken along.

facs_rig.blender.hair makes it and takes it away.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import armature_of, from_blender, to_blender
from facs_rig.blender.arrays import read_key, write_key, write_places
from facs_rig.common.errors import InputError
from facs_rig.hair.follow import bind
from facs_rig.identity import check_identity
from facs_rig.rig import FaceRig

MARK = "facs_hair"  # property of the hair object: version of its make-up
HAT_MARK = "facs_hat"  # the same of a hat
VERSION = 1
# Where each vertex was when the hair was last put on or edited, and on whom, as text: whatever
# persons come and go meanwhile, it is bound there, so that nothing adds up.
REST, RESTS_ON = "rest", "facs_hair_person"
UNTOUCHED = 2e-5  # metres: hair that is nearer to where it was put was not edited


def hair_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The hair that hangs on a face's armature; None if there is none."""
    armature = armature_of(face)
    if armature is None:
        return None
    return next((child for child in armature.children if is_hair(child)), None)


def is_hair(candidate: bpy.types.Object) -> bool:
    """Whether this object is the hair of a face."""
    return candidate.type == "MESH" and MARK in candidate


def hat_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The hat that hangs on a face's armature; None if there is none."""
    armature = armature_of(face)
    if armature is None:
        return None
    return next((child for child in armature.children if is_hat(child)), None)


def is_hat(candidate: bpy.types.Object) -> bool:
    """Whether this object is the hat of a face."""
    return candidate.type == "MESH" and HAT_MARK in candidate


def worn_by(face: bpy.types.Object) -> list[bpy.types.Object]:
    """Hair and hat of a face, those that there are."""
    return [thing for thing in (hair_of(face), hat_of(face)) if thing is not None]


def check_hair(face: bpy.types.Object) -> None:
    """InputError, one sentence, if the hair or the hat of a face cannot be written."""
    for thing in worn_by(face):
        if _is_others(thing):
            raise InputError(
                f"'{thing.name}' is linked from another file; make it and its mesh local"
            )
    check_free(face)


def check_free(face: bpy.types.Object) -> None:
    """InputError, one sentence, if hair or hat of a face is being edited: it could not follow."""
    for thing in worn_by(face):
        if thing.mode != "OBJECT":
            raise InputError(f"'{thing.name}' is being edited; go to Object Mode first")


def follow_person(
    face: bpy.types.Object,
    rig: FaceRig,
    before: Mapping[str, float],
    after: Mapping[str, float],
) -> None:
    """Take hair and hat of a face from one person to another, as they are: what was edited stays
    edited.

    Their keys keep their offsets. What is linked from another file stays where it is.
    rig : the full one      before, after : identity parameter -> value
    """
    if dict(before) == dict(after):
        return
    for thing in worn_by(face):
        if not _is_others(thing) and len(thing.data.vertices):
            _follow(thing.data, rig, before, after)


def _follow(
    mesh: bpy.types.Mesh, rig: FaceRig, before: Mapping[str, float], after: Mapping[str, float]
) -> None:
    """Take the mesh of hair or of a hat from one person to another."""
    blocks = mesh.shape_keys
    now = read_key(blocks.reference_key) if blocks else _places(mesh)
    core = from_blender(now)
    rest, who = _rest_of(mesh, len(now)), _rests_on(mesh)
    bound = None
    if rest is not None and who is not None:
        bound = bind(rest, rig, who)
        if np.abs(bound.points(rig.neutral(before)) - core).max() > UNTOUCHED:
            bound = None
    if bound is None:
        bound = bind(core, rig, before)
        write_rest(mesh, core, before)
    points = to_blender(bound.points(rig.neutral(after)))
    for block in blocks.key_blocks if blocks else ():
        write_key(block, read_key(block) + (points - now))
    write_places(mesh, points)
    mesh.update()
    if blocks:
        blocks.update_tag()


def _is_others(hair: bpy.types.Object) -> bool:
    """Whether the hair's mesh belongs to another file."""
    mesh = hair.data
    return bool(hair.library or hair.override_library or mesh.library or mesh.override_library)


def _rest_of(mesh: bpy.types.Mesh, count: int) -> NDArray[np.float32] | None:
    """(count, 3) metres, core axes, where the hair was put; None if that is not known."""
    layer = _rest_layer(mesh)
    if layer is None or len(layer.data) != count:
        return None
    out = np.empty((count, 3), dtype=np.float32)
    layer.data.foreach_get("vector", out.reshape(-1))
    return from_blender(out)


def _rests_on(mesh: bpy.types.Mesh) -> dict[str, float] | None:
    """The person that it was put on; None if nobody knows."""
    try:
        who = {name: float(value) for name, value in json.loads(mesh[RESTS_ON]).items()}
        check_identity(who)
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    return who


def write_rest(mesh: bpy.types.Mesh, points: NDArray, identity: Mapping[str, float]) -> None:
    """Note where the vertices are: (n, 3) metres, core axes, on this person."""
    layer = _rest_layer(mesh)
    if layer is None and REST in mesh.attributes:  # somebody else's
        mesh.attributes.remove(mesh.attributes[REST])
    if layer is None:
        mesh.attributes.new(REST, "FLOAT_VECTOR", "POINT")
    flat = np.ascontiguousarray(to_blender(points)).reshape(-1)
    mesh.attributes[REST].data.foreach_set("vector", flat)
    mesh[RESTS_ON] = json.dumps(dict(identity))


def _rest_layer(mesh: bpy.types.Mesh) -> bpy.types.Attribute | None:
    layer = mesh.attributes.get(REST)
    if layer is None or (layer.domain, layer.data_type) != ("POINT", "FLOAT_VECTOR"):
        return None
    return layer


def _places(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    out = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", out.reshape(-1))
    return out
