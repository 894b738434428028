"""Faces that share their data: whose sliders move the keys, and copies that stand alone.

Blender's linked duplicate (Alt-D) shares mesh and shape keys with its original, and with them the
drivers, which read the sliders of the original; its own move nothing. The same is left where a
copy of the data was made by hand.
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from facs_rig.blender.beard import beard_of
from facs_rig.blender.hair_follows import curves_of, hair_of, hat_of
from facs_rig.blender.keys import GAZE
from facs_rig.blender.pose import (
    MARK,
    armature_of,
    is_face,
    mover_of,
    refresh,
    targets_of,
)
from facs_rig.controls import CONTROL_NAMES
from facs_rig.keys import PROPERTIES

SLIDERS = (*CONTROL_NAMES, *PROPERTIES)


def shown_with(face: bpy.types.Object) -> str:
    """Name of the other face whose sliders move this one; empty if its own do, or none."""
    mover = mover_of(face)
    return "" if mover is None or mover == face else mover.name


def stand_alone(face: bpy.types.Object) -> None:
    """Give a face keys of its own that follow its own sliders; what it shows stays.

    Its armature, too, if that also carries another face, with hair of its own.
    """
    mover = mover_of(face) or face
    ids: dict[bpy.types.ID, bpy.types.ID] = {mover: face}
    for name in SLIDERS:
        if name in mover:
            face[name] = mover[name]
    if face.data.users > 1 or face.data.library is not None:
        old = face.data
        face.data = old.copy()
        ids[old.shape_keys] = face.data.shape_keys
    armature, beard = armature_of(face), beard_of(face)
    if beard is not None and beard.data.users > 1:
        beard.data = beard.data.copy()
    if armature is not None and _carries_another(armature, face):
        twin = armature.copy()
        for collection in face.users_collection:
            collection.objects.link(twin)
        ids[armature] = twin
        _copy_hair(face, twin)
        if beard is not None:  # it goes with this face alone
            beard.parent = twin
    else:
        for thing in (hair_of(face), hat_of(face)):
            if thing is not None and thing.data.users > 1:
                thing.data = thing.data.copy()
    _own_curves(face, mover)
    _exchange(face, ids)
    refresh(face)


def twin_of(face: bpy.types.Object) -> tuple[bpy.types.Object, bpy.types.Object | None]:
    """A copy of a face, and of its armature, that nothing but its own sliders and bones move.

    It stands in the world where the face stands, does what that does, and is linked nowhere:
    keyframes, and drivers and constraints of the artist's on its sliders, are left out.
    """
    mover = mover_of(face) or face
    twin, old = face.copy(), face.data
    twin.data = old.copy()
    ids: dict[bpy.types.ID, bpy.types.ID] = {mover: twin, face: twin}
    if old.shape_keys is not None:
        ids[old.shape_keys] = twin.data.shape_keys
    for name in SLIDERS:
        if name in mover:
            twin[name] = mover[name]
    armature = armature_of(face)
    bones = armature.copy() if armature is not None else None
    if bones is not None:
        ids[armature] = bones
    _exchange(twin, ids)
    pairs = (
        [(twin, face)] if bones is None or armature is None else [(bones, armature), (twin, face)]
    )
    for thing, original in pairs:
        _let_go(thing)
        if thing.parent is None or thing.parent != bones:
            there = original.matrix_world.copy()
            thing.parent = None
            thing.matrix_world = there
    if twin.data.shape_keys is not None:
        _still(twin.data.shape_keys)
    if MARK in twin:
        del twin[MARK]  # nobody shall take it for a face to work on
    return twin, bones


def discard(*things: bpy.types.Object | None) -> None:
    """Remove the objects of `twin_of`, and the mesh that only they have."""
    rest = [thing for thing in things if thing is not None]
    meshes = [thing.data for thing in rest if thing.type == "MESH"]
    bpy.data.batch_remove(rest)
    for mesh in meshes:
        if not mesh.users:
            bpy.data.meshes.remove(mesh)  # one by one: before 4.0 a batch leaves the shape keys


def _copy_hair(face: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Hang copies of a face's hair and hat on another armature."""
    for thing in (hair_of(face), hat_of(face)):
        if thing is None:
            continue
        twin = thing.copy()
        twin.data = thing.data.copy()
        twin.parent = armature
        twin.matrix_parent_inverse = thing.matrix_parent_inverse.copy()
        for modifier in twin.modifiers:
            if modifier.type == "ARMATURE" and modifier.object == armature_of(thing):
                modifier.object = armature
        for collection in thing.users_collection:
            collection.objects.link(twin)


def _own_curves(face: bpy.types.Object, mover: bpy.types.Object) -> None:
    """Strands of a face's hair that grow on it, and not on the one whose sliders moved it."""
    own, theirs = curves_of(face), curves_of(mover)
    if own is None:
        if theirs is None or hair_of(face) is None:
            return
        own = theirs.copy()
        own.parent = face
        for collection in face.users_collection:
            collection.objects.link(own)
    if own.data.users > 1:
        own.data = own.data.copy()
    own.data.surface = face
    face.add_rest_position_attribute = True


def _carries_another(armature: bpy.types.Object, face: bpy.types.Object) -> bool:
    return any(
        other != face and is_face(other) and armature_of(other) == armature
        for other in bpy.data.objects
    )


def _exchange(face: bpy.types.Object, ids: Mapping[bpy.types.ID, bpy.types.ID]) -> None:
    """Let what moves a face refer to what `ids` has instead: drivers, modifiers, constraints."""
    armature = armature_of(face)
    bones = ids.get(armature, armature)
    for modifier in face.modifiers:
        if modifier.type == "ARMATURE" and modifier.object in ids:
            modifier.object = ids[modifier.object]
    if face.parent in ids:
        inverse = face.matrix_parent_inverse.copy()
        face.parent = ids[face.parent]
        face.matrix_parent_inverse = inverse
    for bone in bones.pose.bones if bones is not None else ():
        for constraint in bone.constraints:
            if getattr(constraint, "target", None) in ids:
                constraint.target = ids[constraint.target]
    for thing in (face, face.data.shape_keys, bones):
        for curve in _drivers(thing):
            for target in targets_of(curve):
                if target.id in ids:
                    target.id = ids[target.id]
                elif target.id is None and target.data_path.startswith('["'):
                    target.id_type, target.id = "OBJECT", face  # of an original that is gone


def _drivers(thing: bpy.types.ID | None):
    data = thing.animation_data if thing is not None else None
    return data.drivers if data is not None else ()


def _still(thing: bpy.types.ID) -> None:
    """Nothing of it is keyframed any more; drivers stay."""
    data = thing.animation_data
    if data is None:
        return
    data.action = None
    for track in list(data.nla_tracks):
        data.nla_tracks.remove(track)


def _let_go(thing: bpy.types.Object) -> None:
    """Nothing but its own sliders moves an object or its bones any more."""
    _still(thing)
    for constraint in list(thing.constraints):
        thing.constraints.remove(constraint)
    for curve in list(_drivers(thing)):
        path = curve.data_path
        slider = path.startswith('["') and path[2:-2] in (*CONTROL_NAMES, *GAZE)
        if slider or not path.startswith(('["', "pose.")):
            thing.animation_data.drivers.remove(curve)
