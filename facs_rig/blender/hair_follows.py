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
CURVES_MARK = "facs_hair_curves"  # property of the object with its strands, if it has any
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


def curves_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The strands that hang on a face as hair curves; None if there are none."""
    return next((child for child in face.children if is_curves(child)), None)


def is_curves(candidate: bpy.types.Object) -> bool:
    """Whether this object is the strands of a face."""
    return candidate.type == "CURVES" and CURVES_MARK in candidate


def parts_of(face: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects that the hair of a face is."""
    return [part for part in (hair_of(face), curves_of(face)) if part is not None]


def hat_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The hat that hangs on a face's armature; None if there is none."""
    armature = armature_of(face)
    if armature is None:
        return None
    return next((child for child in armature.children if is_hat(child)), None)


def is_hat(candidate: bpy.types.Object) -> bool:
    """Whether this object is the hat of a face."""
    return candidate.type == "MESH" and HAT_MARK in candidate


def carried_by(face: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects that hair and hat of a face are, which its head carries."""
    hat = hat_of(face)
    return [*parts_of(face), *([] if hat is None else [hat])]


def check_hair(face: bpy.types.Object) -> None:
    """InputError, one sentence, if the hair or the hat of a face cannot be written."""
    for part in carried_by(face):
        if _is_others(part):
            raise InputError(
                f"'{part.name}' is linked from another file; make it and its mesh local"
            )
    check_free(face)


def check_free(face: bpy.types.Object) -> None:
    """InputError, one sentence, if hair or hat of a face is being edited: it could not follow."""
    for part in carried_by(face):
        if part.mode != "OBJECT":
            raise InputError(f"'{part.name}' is being edited; go to Object Mode first")


def follow_person(
    face: bpy.types.Object,
    rig: FaceRig,
    before: Mapping[str, float],
    after: Mapping[str, float],
    identity_in_keys: bool = False,
) -> None:
    """Take hair and hat of a face from one person to another, as they are: what was edited stays
    edited.

    Their keys keep their offsets. What is linked from another file stays where it is.
    rig : the full one      before, after : identity parameter -> value
    identity_in_keys : whether shape keys make the face the other person, and not its basis
    """
    for part in carried_by(face):
        if dict(before) == dict(after) or _is_others(part):
            continue
        # Keys that move the skin take strands along that are attached to it.
        if part.type != "CURVES" or not identity_in_keys:
            _take_along(part.data, rig, before, after)


def _take_along(
    data: bpy.types.ID,
    rig: FaceRig,
    before: Mapping[str, float],
    after: Mapping[str, float],
) -> None:
    blocks = getattr(data, "shape_keys", None)
    now = read_key(blocks.reference_key) if blocks else read_points(data)
    if not len(now):
        return
    core = from_blender(now)
    rest, who = _rest_of(data, len(now)), _rests_on(data)
    bound = None
    if rest is not None and who is not None:
        bound = bind(rest, rig, who)
        if np.abs(bound.points(rig.neutral(before)) - core).max() > UNTOUCHED:
            bound = None
    if bound is None:
        bound = bind(core, rig, before)
        write_rest(data, core, before)
    points = to_blender(bound.points(rig.neutral(after)))
    for block in blocks.key_blocks if blocks else ():
        write_key(block, read_key(block) + (points - now))
    write_points(data, points)
    if blocks:
        blocks.update_tag()


def _is_others(part: bpy.types.Object) -> bool:
    """Whether hair belongs to another file."""
    data = part.data
    return bool(part.library or part.override_library or data.library or data.override_library)


def _rest_of(data: bpy.types.ID, count: int) -> NDArray[np.float32] | None:
    """(count, 3) metres, core axes, where the hair was put; None if that is not known."""
    layer = _rest_layer(data)
    if layer is None or len(layer.data) != count:
        return None
    out = np.empty((count, 3), dtype=np.float32)
    layer.data.foreach_get("vector", out.reshape(-1))
    return from_blender(out)


def _rests_on(data: bpy.types.ID) -> dict[str, float] | None:
    """The person that it was put on; None if nobody knows."""
    try:
        who = {name: float(value) for name, value in json.loads(data[RESTS_ON]).items()}
        check_identity(who)
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    return who


def write_rest(data: bpy.types.ID, points: NDArray, identity: Mapping[str, float]) -> None:
    """Note where the vertices are: (n, 3) metres, core axes, on this person."""
    layer = _rest_layer(data)
    if layer is None and REST in data.attributes:  # somebody else's
        data.attributes.remove(data.attributes[REST])
    if layer is None:
        data.attributes.new(REST, "FLOAT_VECTOR", "POINT")
    flat = np.ascontiguousarray(to_blender(points)).reshape(-1)
    data.attributes[REST].data.foreach_set("vector", flat)
    data[RESTS_ON] = json.dumps(dict(identity))


def _rest_layer(data: bpy.types.ID) -> bpy.types.Attribute | None:
    layer = data.attributes.get(REST)
    if layer is None or (layer.domain, layer.data_type) != ("POINT", "FLOAT_VECTOR"):
        return None
    return layer


def read_points(data: bpy.types.ID) -> NDArray[np.float32]:
    """(n, 3) where the vertices of a mesh, or the points of curves, are."""
    if isinstance(data, bpy.types.Mesh):
        layer, field = data.vertices, "co"
    elif not len(data.points):
        return np.empty((0, 3), dtype=np.float32)
    else:
        layer, field = data.position_data, "vector"
    out = np.empty((len(layer), 3), dtype=np.float32)
    layer.foreach_get(field, out.reshape(-1))
    return out


def write_points(data: bpy.types.ID, points: NDArray) -> None:
    """Put them there: (n, 3), Blender's axes."""
    if isinstance(data, bpy.types.Mesh):
        write_places(data, points)
        data.update()
        return
    flat = np.ascontiguousarray(points, np.float32).reshape(-1)
    data.position_data.foreach_set("vector", flat)
    data.update_tag()
