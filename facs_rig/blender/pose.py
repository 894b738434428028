"""Reads and sets what a face in Blender does: its sliders, bones and identity.

A face is a mesh object with the property `facs_face`, which holds the version of its make-up and
stays through saving, renaming and appending.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import (
    EYES,
    HEAD,
    NECK,
    TURNED,
    armature_of,
    joints_move,
    place_joints,
    turn_bone,
    turn_of,
)
from facs_rig.blender.arrays import read_key, write_key
from facs_rig.blender.hair_follows import check_free, follow_person
from facs_rig.blender.keys import GAZE, moved
from facs_rig.blender.materials import write_looks
from facs_rig.common.errors import InputError
from facs_rig.controls import ARKIT_NAMES, CONTROL_NAMES
from facs_rig.identity import IDENTITY, IDENTITY_KEYS, STYLES, check_identity, target_weights
from facs_rig.keys import PROPERTIES
from facs_rig.levels import FULL, at_level
from facs_rig.parameters import FaceParameters, intensities
from facs_rig.rig import FaceRig

# The same as text: a library override keeps a text, but no group of values.
WHO_TEXT = "facs_identity_text"
MARK = "facs_face"  # property of the mesh object: version of its make-up
VERSION = 1
DETAIL = "facs_detail"  # property of the mesh object: its level, see facs_rig.levels
_KEYED = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
SPAN = "facs_keyed"  # property of the armature: keyed where the sliders' keyframes begin and end
WHO = "facs_identity"  # property of the mesh object: identity parameter -> value, if no default


def is_face(candidate: bpy.types.Object) -> bool:
    """Whether this object is a face, of whatever version."""
    return candidate.type == "MESH" and MARK in candidate


def rig_of(face: bpy.types.Object, rig: FaceRig) -> FaceRig:
    """The full rig at the face's own level of detail; InputError if a newer one made it."""
    return at_level(rig, str(face.get(DETAIL, FULL)))


def check_face(face: bpy.types.Object) -> None:
    """InputError, one sentence, if the face is of a newer make-up or lost a part it needs."""
    version = face.get(MARK)
    if not isinstance(version, int) or version < 1:
        raise InputError(f"'{face.name}' is not a face that Sketch to Face made")
    if version > VERSION:
        raise InputError(
            f"'{face.name}' was made by a newer version of Sketch to Face; update the add-on"
        )
    for name in (*CONTROL_NAMES, *PROPERTIES):
        if not isinstance(face.get(name), int | float):
            raise InputError(f"'{face.name}' has lost its slider '{name}'; add a new face")
    if face.data.shape_keys is None:
        raise InputError(f"'{face.name}' has lost its shape keys; add a new face")
    mover = mover_of(face)
    if mover is None:
        raise InputError(
            f"the face that '{face.name}' was a linked duplicate of is gone; press Make "
            "Independent to give it its own sliders"
        )
    if mover != face:
        raise InputError(
            f"'{face.name}' is a linked duplicate, which moves with the sliders of "
            f"'{mover.name}'; press Make Independent to give it its own"
        )


def mover_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The object whose sliders move the keys of `face`; None if it is gone.

    That is the face itself, unless it shares or copied its keys: Blender's linked duplicate
    (Alt-D) has the drivers of its original, which read the original's sliders. The face itself,
    too, where no key is driven at all.
    """
    keys = face.data.shape_keys
    found, lost = None, False
    for curve in keys.animation_data.drivers if keys and keys.animation_data else ():
        for target in targets_of(curve):
            if target.id == face:
                return face
            lost = lost or target.id is None
            if found is None and isinstance(target.id, bpy.types.Object) and is_face(target.id):
                found = target.id
    return found or (None if lost else face)


def targets_of(curve: bpy.types.FCurve) -> Iterator[bpy.types.DriverTarget]:
    """What a driver reads."""
    for variable in curve.driver.variables:
        yield from variable.targets


def _turning(face: bpy.types.Object) -> dict[str, bpy.types.PoseBone]:
    """The bones that the artist may turn, those that are there."""
    armature = armature_of(face)
    bones = armature.pose.bones if armature is not None else {}
    return {name: bones[name] for name in TURNED if name in bones}


def pose_of(face: bpy.types.Object) -> FaceParameters:
    """What the face does and who it is. See `check_face` for errors."""
    check_face(face)
    bones = _turning(face)
    turns = {name: turn_of(bones[name]) if name in bones else (0.0, 0.0, 0.0)
             for name in (HEAD, NECK)}  # fmt: skip
    yaw, pitch = (float(np.radians(face[name])) for name in GAZE)
    aus = {name: float(face[name]) for name in CONTROL_NAMES if face[name]}
    return FaceParameters(aus, identity_of(face), turns[HEAD], turns[NECK], (yaw, pitch))


def set_pose(face: bpy.types.Object, parameters: FaceParameters, *, turn: bool = True) -> None:
    """Let the face do what `parameters` say: sliders and gaze and, with `turn`, head and neck.

    The identity stays (see `set_identity`), and so does what was done to an eye's bone by hand.
    Raises InputError, with nothing changed, as `check_face` and for unknown controls.
    """
    check_face(face)
    values = dict(zip(CONTROL_NAMES, intensities(parameters.aus).tolist(), strict=True))
    # The exact values, not their 32-bit neighbours: 4.4 stays 4.4 in the sidebar.
    values |= {name: float(value) for name, value in parameters.aus.items()}
    values |= dict(zip(GAZE, np.degrees(parameters.gaze).tolist(), strict=True))
    for name, value in values.items():
        face[name] = value
    bones = _turning(face) if turn else {}
    for name, angles in ((HEAD, parameters.head), (NECK, parameters.neck)):
        if name in bones:
            turn_bone(bones[name], angles)
    refresh(face)


def key_pose(face: bpy.types.Object, frame: float, *, turn: bool = True) -> None:
    """Keyframe every slider, the gaze and, with `turn`, head and neck. Errors: `check_face`."""
    check_face(face)
    for name in (*CONTROL_NAMES, *GAZE):
        face.keyframe_insert(f'["{name}"]', frame=frame, group="Expression")
    bones = _turning(face) if turn else {}
    for name in (HEAD, NECK):
        if name in bones:
            path = _KEYED.get(bones[name].rotation_mode, "rotation_euler")
            bones[name].keyframe_insert(path, frame=frame, group=name)
    show_keys_to_exporters(face)


def animated_range(thing: bpy.types.ID) -> tuple[float, float] | None:
    """First and last frame of what an object's or shape keys' own keyframes and strips move."""
    data = thing.animation_data
    spans = [tuple(strip_range) for strip_range in _spans(data)] if data is not None else []
    return (min(s for s, _ in spans), max(e for _, e in spans)) if spans else None


def _spans(data: bpy.types.AnimData):
    if data.action is not None:
        yield data.action.frame_range
    for track in data.nla_tracks:
        for strip in track.strips:
            yield strip.frame_start, strip.frame_end


def show_keys_to_exporters(face: bpy.types.Object) -> None:
    """Let Blender's glTF exporter see how long the sliders of a face are animated.

    In its default mode it writes the values of driven shape keys over the frames of the
    armature's action, and looks at no other. So the armature gets a property that stands still
    with keyframes where those of the sliders begin and end, unless its own reach as far. Without
    an armature the shape keys have it.
    """
    wanted = animated_range(face)
    holder = armature_of(face) or face.data.shape_keys
    if wanted is None or holder is None or holder.library is not None:
        return
    there = animated_range(holder)
    for frame in wanted:
        if there is None or not there[0] <= frame <= there[1]:
            holder[SPAN] = 0.0
            holder.keyframe_insert(f'["{SPAN}"]', frame=frame, group="Expression")


def straighten_eyes(face: bpy.types.Object) -> None:
    """Take back what was done to the eyes' bones by hand: both look where the gaze does."""
    for name, bone in _turning(face).items():
        if name in EYES:
            turn_bone(bone, (0.0, 0.0, 0.0))
    refresh(face)


def refresh(face: bpy.types.Object) -> None:
    """Tell Blender that properties of the face changed: it does not watch them by itself."""
    face.update_tag()
    armature = armature_of(face)
    if armature is not None:
        armature.update_tag()


# --- identity ---


def has_identity_keys(face: bpy.types.Object) -> bool:
    """Whether the face's identity is in shape keys rather than in its basis."""
    return face.data.shape_keys is not None and all(
        name in face.data.shape_keys.key_blocks for name in IDENTITY_KEYS
    )


def identity_of(face: bpy.types.Object) -> dict[str, float]:
    """Identity parameters of a face, without those at their default.

    Empty, too, for a baked face of a file from before these were remembered.
    """
    if face.override_library is not None and isinstance(face.get(WHO_TEXT), str):
        return {name: float(value) for name, value in json.loads(face[WHO_TEXT]).items()}
    stored = face.get(WHO)
    return {} if stored is None else {name: float(value) for name, value in stored.items()}


def identity_values(identity: Mapping[str, float]) -> dict[str, float]:
    """Value of each identity key: its target's weight as against the default face's."""
    weights = target_weights(identity) - target_weights({})
    return dict(zip(IDENTITY_KEYS, weights.tolist(), strict=True))


def set_identity(face: bpy.types.Object, rig: FaceRig, identity: Mapping[str, float]) -> None:
    """Make a face with identity keys another person: its keys, crease_gain, lid_rest and joints.

    Where the person acts or folds in another way, the rig's keys are written anew (what was
    sculpted into these by hand goes). Raises InputError, with nothing changed, for parameters that
    `facs_rig.IDENTITY` does not have or allow, for a face whose identity is baked, and for one
    whose keys cannot be written and would have to be.
    """
    check_identity(identity)
    check_free(face)
    whole, rig = rig, rig_of(face, rig)
    if not has_identity_keys(face):
        raise InputError(
            f"'{face.name}' has no identity keys: who it is was settled when it was made"
        )
    blocks = face.data.shape_keys.key_blocks
    before, after = (rig.motions.who([who]) for who in (identity_of(face), identity))
    if before.stylised or after.stylised or not before.same_keys(after):
        _write_own_keys(face, rig, identity)
    for name, value in identity_values(identity).items():
        if abs(blocks[name].value - value) > 1e-7:
            blocks[name].value = value
    follow_person(face, whole, identity_of(face), identity, identity_in_keys=True)
    write_identity(face, rig, identity)


def _write_own_keys(face: bpy.types.Object, rig: FaceRig, identity: Mapping[str, float]) -> None:
    """Write the rig's keys as this person has them."""
    mesh = face.data
    if mesh.library or mesh.override_library:
        raise InputError(
            f"'{face.name}' is linked from another file, where its keys cannot become another "
            "person's; make it and its mesh local"
        )
    basis = read_key(mesh.shape_keys.reference_key)
    blocks = mesh.shape_keys.key_blocks
    own = dict(zip((key.name for key in rig.keys), rig.key_deltas_of(identity), strict=True))
    own |= _styles_of(rig, identity)
    if all(name in blocks for name in ARKIT_NAMES):
        own |= dict(zip(ARKIT_NAMES, rig.arkit_deltas_of(identity), strict=True))
    for name, delta in own.items():
        write_key(blocks[name], moved(basis, delta))
    mesh.update()
    mesh.shape_keys.update_tag()


def _styles_of(rig: FaceRig, identity: Mapping[str, float]) -> dict[str, NDArray]:
    """Key of a stylised feature -> its offsets (n, 3). Keys only add up: what more a person's
    features do where space was stretched is in the key that is farthest on."""
    weights = target_weights(identity)
    moves = {IDENTITY_KEYS[k]: rig.identity_deltas[k] for k in range(*STYLES.indices(len(weights)))}
    strongest = STYLES.start + int(np.abs(weights[STYLES]).argmax())
    if weights[strongest]:
        name = IDENTITY_KEYS[strongest]
        moves[name] = moves[name] + rig.stretched(identity) / weights[strongest]
    return moves


def write_identity(face: bpy.types.Object, rig: FaceRig, identity: Mapping[str, float]) -> None:
    """All of a person but the shape: crease_gain, lid_rest, the joints, and that it is known."""
    values = check_identity(identity)
    for name, value in rig.scalars(identity).items():
        face[name] = float(value)
    write_looks(face, values)
    known = {f.name: values[f.name] for f in IDENTITY if values[f.name] != f.default}
    face[WHO_TEXT] = json.dumps(known)
    if face.override_library is None:
        face[WHO] = known
        face.property_overridable_library_set(f'["{WHO_TEXT}"]', True)
    armature = armature_of(face)
    if armature is not None and joints_move(armature):
        place_joints(armature, rig, identity)
    refresh(face)
