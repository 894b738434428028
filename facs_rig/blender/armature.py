"""The bones of Blender's face: neck, head, jaw and eyes, where the rig has its joints.

The rig turns the eyes first, then the head, then the neck, each about a joint that moves with the
identity. Bones turn about their own head, so three of them get hidden company:

- `head_alone` turns as the head does without the neck, for skin that follows the head fully but
  the neck in part (Blender blends transforms side by side, the rig one after the other).
- `eye_left_gaze`, `eye_right_gaze` are driven by the properties gaze_yaw and gaze_pitch of the
  face; `eye_left` and `eye_right`, their children, are free for the artist.
- The bones rest where the default face has its joints. For another identity a bone `..._at` (or
  the gaze bone) goes to the new place, and a bone `..._skin` under the turning one goes back by
  the same way, so that what it carries is turned about the new place and not moved there.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from facs_rig.blender.steps import Steps
from facs_rig.common.derived import derived
from facs_rig.controls import ARKIT_NAMES
from facs_rig.rig import FaceRig
from facs_rig.rotation import rotation

ROOT, NECK, HEAD, HEAD_ALONE, JAW = "root", "neck", "head", "head_alone", "jaw"
EYES = ("eye_left", "eye_right")
TURNED = (HEAD, NECK, *EYES)  # what the artist may turn
# What takes a joint to its place, and what takes the skin back: joint -> bones.
_PLACED: dict[str, tuple[str, str | None]] = {
    NECK: ("neck_at", "neck_skin"),
    JAW: ("jaw_at", None),
    **{eye: (f"{eye}_gaze", f"{eye}_skin") for eye in EYES},
}
# `facs_rig.rotation` rolls, then pitches, then yaws; in the axes of an upright bone that is
# (pitch, yaw, -roll) in this order.
ORDER = "ZXY"
JAW_CONTROLS = ("jaw_open", "jaw_left", "jaw_right", "jaw_forward")
JAW_ARKIT = ("jawOpen", "jawLeft", "jawRight", "jawForward")


def to_blender(points: NDArray) -> NDArray[np.float32]:
    """Core axes (y up, z to the viewer) to Blender's (z up, facing -y): (x, y, z) -> (x, -z, y)."""
    points = np.asarray(points, dtype=np.float32)
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def from_blender(points: NDArray) -> NDArray[np.float32]:
    """The inverse of `to_blender`."""
    points = np.asarray(points, dtype=np.float32)
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


@dataclass(frozen=True)
class _Bone:
    """A bone to make. `joint` names its place; forward ones look out of the face, others up."""

    name: str
    parent: str | None
    joint: str
    length: float
    forward: bool = False
    deforms: bool = False
    hidden: bool = False


def _skeleton(rig: FaceRig) -> list[_Bone]:
    """All bones, parents first. Lengths are for the eye and the hand alone."""
    crown, nose = rig.neutral()[:, 1:].max(axis=0).tolist()
    jaw = nose - float(rig.joints()[JAW][2])
    bones = [
        _Bone(ROOT, None, NECK, 0.05, deforms=True, hidden=True),
        _Bone("neck_at", None, NECK, 0.03, hidden=True),
        _Bone(NECK, "neck_at", NECK, 0.09),
        _Bone("neck_skin", NECK, NECK, 0.02, deforms=True, hidden=True),
        _Bone(HEAD, "neck_skin", HEAD, crown + 0.05, deforms=True),  # out of the crown
        _Bone(HEAD_ALONE, None, HEAD, 0.05, deforms=True, hidden=True),
        _Bone("jaw_at", HEAD, JAW, 0.02, forward=True, hidden=True),
        _Bone(JAW, "jaw_at", JAW, jaw, forward=True),
    ]
    for eye in EYES:
        bones += [
            _Bone(f"{eye}_gaze", HEAD, eye, 0.03, forward=True, hidden=True),
            _Bone(eye, f"{eye}_gaze", eye, 0.06, forward=True),
            _Bone(f"{eye}_skin", eye, eye, 0.01, forward=True, deforms=True, hidden=True),
        ]
    return bones


def _local(vector: NDArray, forward: bool) -> tuple[float, float, float]:
    """A core vector in the axes of a bone: upright bones have the core's own."""
    x, y, z = (float(v) for v in vector)
    return (-x, z, y) if forward else (x, y, z)


def make_armature(name: str, rig: FaceRig, made: list[bpy.types.ID]) -> bpy.types.Object:
    """The armature object of a face, upright, at the default face's joints, linked nowhere.

    What is made is added to `made`. Needs Object Mode.
    """
    bones = _skeleton(rig)
    data = bpy.data.armatures.new(name)
    made.append(data)
    armature = bpy.data.objects.new(name, data)
    made.append(armature)
    data.display_type = "STICK"
    _edit_bones(armature, bones, rig.joints())
    for bone in bones:
        posed = armature.pose.bones[bone.name]
        posed.rotation_mode = "XYZ" if bone.forward else ORDER
        posed.lock_location = (True, True, True)
        posed.bone.use_deform = bone.deforms
        _hide(posed, bone.hidden)
    copy = armature.pose.bones[HEAD_ALONE].constraints.new("COPY_ROTATION")
    copy.target, copy.subtarget = armature, HEAD
    copy.owner_space = copy.target_space = "LOCAL"
    armature.pose.bones[JAW].lock_rotation = (True, True, True)  # its sliders move it
    return armature


def layer_of(context) -> bpy.types.ViewLayer:
    """The view layer to work in: the context's or, where a script has put another scene into the
    context and left the layer as it was, the first of that scene."""
    scene, layer = context.scene, context.view_layer
    return layer if layer is not None and layer.id_data == scene else scene.view_layers[0]


def metre(scene: bpy.types.Scene) -> float:
    """How many units of the scene are a metre, so that a head is as tall as a head there.

    Feet and inches are Blender's own affair: only the scale of its units counts, and without units
    a metre is 1.
    """
    units = scene.unit_settings
    return 1.0 if units.system == "NONE" else 1.0 / units.scale_length


def _edit_bones(armature: bpy.types.Object, bones: list[_Bone], joints: Mapping) -> None:
    """Make the bones, which Blender allows in Edit Mode alone.

    For that the armature must be seen: it lies in the scene's own collection for the while,
    whatever the artist's collection shows.
    """
    scene, layer = bpy.context.scene, layer_of(bpy.context)
    root, before = scene.collection, layer.objects.active
    root.objects.link(armature)
    layer.objects.active = armature
    try:
        _set_mode(armature, layer, "EDIT")
        for bone in bones:
            made = armature.data.edit_bones.new(bone.name)
            place = Vector(to_blender(joints[bone.joint]).tolist())
            along, aside = Vector((0.0, -1.0, 0.0)), Vector((0.0, 0.0, 1.0))
            made.head = place
            made.tail = place + bone.length * (along if bone.forward else aside)
            made.align_roll(aside if bone.forward else along)
            if bone.parent is not None:
                made.parent = armature.data.edit_bones[bone.parent]
    finally:
        _set_mode(armature, layer, "OBJECT")
        layer.objects.active = before
        root.objects.unlink(armature)


def _set_mode(armature: bpy.types.Object, layer: bpy.types.ViewLayer, mode: str) -> None:
    """Change the mode of a view layer's active object.

    Operators let go of Python's lock, and what `temp_override` says is looked up in Python's memory
    without it where another thread has it, which crashes Blender: so no override without need.
    """
    there = {"scene": layer.id_data, "view_layer": layer, "active_object": armature,
             "object": armature}  # fmt: skip
    seen = bpy.context.active_object == armature and bpy.context.view_layer == layer
    with contextlib.nullcontext() if seen else bpy.context.temp_override(**there):
        bpy.ops.object.mode_set(mode=mode)


def _hide(bone: bpy.types.PoseBone, hidden: bool) -> None:
    if hasattr(bone, "hide"):  # from Blender 5.0 the posed bone has a visibility of its own
        bone.hide = hidden
    bone.bone.hide = hidden


# --- skin ---


def bind(face: bpy.types.Object, armature: bpy.types.Object, rig: FaceRig) -> Steps[None]:
    """Give the face the rig's weights and the armature modifier that uses them.

    Pauses after each bone.
    """
    for name, (whole, partly) in skin_weights(rig).items():
        group = face.vertex_groups.new(name=name)
        group.add(whole, 1.0, "REPLACE")
        # One by one: the few thousand weights are nearly all different.
        for vertex, weight in partly:
            group.add((vertex,), weight, "REPLACE")
        yield
    modifier = face.modifiers.new("Head, Neck and Eyes", "ARMATURE")
    modifier.object = armature


def armature_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The armature that turns the face; None if it was taken away."""
    for modifier in face.modifiers:
        if modifier.type == "ARMATURE" and modifier.object is not None:
            return modifier.object
    return None


@derived
def skin_weights(rig: FaceRig) -> dict[str, tuple[list[int], list[tuple[int, float]]]]:
    """Bone -> the vertices that follow it fully, and (vertex, weight) of those that do in part."""
    head, neck = np.asarray(rig.weights, dtype=float).T
    weights = {
        ROOT: (1 - head) * (1 - neck),
        "neck_skin": (1 - head) * neck,
        HEAD: head * neck,
        HEAD_ALONE: head * (1 - neck),
    }
    eyes = rig.parts["eyes"]
    if not (rig.weights[eyes] == 1).all():
        raise RuntimeError("the eyes must follow the head and the neck fully")
    weights[HEAD] = np.where(eyes, 0.0, weights[HEAD])
    left = rig.neutral()[:, 0] > 0
    for eye, side in zip(EYES, (left, ~left), strict=True):
        weights[f"{eye}_skin"] = (eyes & side).astype(float)
    out = {}
    for name, values in weights.items():
        whole = values > 1 - 1e-7
        partly = np.flatnonzero((values > 1e-7) & ~whole)
        pairs = list(zip(partly.tolist(), values[partly].tolist(), strict=True))
        out[name] = np.flatnonzero(whole).tolist(), pairs
    return out


# --- what moves the bones ---


def drive(
    fcurve: bpy.types.FCurve, expression: str, variables: Mapping[str, tuple[bpy.types.ID, str]]
) -> None:
    """Let an expression move what `fcurve` (from `driver_add`) belongs to.

    variables : name in the expression -> (object or shape keys, path of the property).
    Raises RuntimeError where Blender would have to run Python for the expression: it does so only
    for trusted files, and slowly.
    """
    driver = fcurve.driver
    driver.type = "SCRIPTED"
    for name, (owner, path) in variables.items():
        variable = driver.variables.new()
        variable.name, variable.type = name, "SINGLE_PROP"
        target = variable.targets[0]
        target.id_type = "KEY" if isinstance(owner, bpy.types.Key) else "OBJECT"
        target.id, target.data_path = owner, path
    driver.expression = expression
    if driver.expression != expression or not driver.is_simple_expression:
        raise RuntimeError(f"Blender does not take the driver expression '{expression}'")


def drive_eyes(face: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Both gaze bones follow the face's properties gaze_yaw and gaze_pitch (degrees)."""
    for eye in EYES:
        bone = armature.pose.bones[f"{eye}_gaze"]
        for axis, text, name in ((0, "-radians(gaze)", "gaze_pitch"),
                                 (2, "radians(gaze)", "gaze_yaw")):  # fmt: skip
            curve = bone.driver_add("rotation_euler", axis)
            drive(curve, text, {"gaze": (face, f'["{name}"]')})
        bone.lock_rotation = (True, True, True)


def drive_jaw(face: bpy.types.Object, armature: bpy.types.Object, rig: FaceRig) -> None:
    """The jaw bone follows the jaw's sliders (and ARKit keys, if any) as the lower teeth do.

    The keys move the skin, the bone carries what the artist hangs on it. Turn and path are linear
    in the sliders, like the keys.
    """
    blocks = face.data.shape_keys
    sources: list[tuple[str, bpy.types.ID, str]] = [
        (f"{letter}*0.2", face, f'["{name}"]')
        for letter, name in zip("abcd", JAW_CONTROLS, strict=True)
    ]
    arkit = set(JAW_ARKIT) <= set(blocks.key_blocks.keys())
    if arkit:
        for letter, name in zip("efgh", JAW_ARKIT, strict=True):
            sources.append((letter, blocks, f'key_blocks["{name}"].value'))
    jaw = armature.pose.bones[JAW]
    motions = jaw_motions(rig, arkit)
    for path, amounts in (("rotation_euler", motions[:, 0]), ("location", motions[:, 1])):
        for axis in range(3):
            used = np.flatnonzero(np.abs(amounts[:, axis]) > 1e-5)
            if not len(used):
                continue
            terms = [f"{amounts[k, axis]:.5f}*{sources[k][0]}" for k in used]
            variables = {sources[k][0][0]: sources[k][1:3] for k in used}
            drive(jaw.driver_add(path, axis), "+".join(terms), variables)


@lru_cache(maxsize=2)
def jaw_motions(rig: FaceRig, arkit: bool) -> NDArray[np.float64]:
    """(4 or 8, 2, 3) turn (radians) and path (metres) of the jaw, in its bone's axes, by each of
    JAW_CONTROLS and, with `arkit`, JAW_ARKIT at 1."""
    names = [key.name for key in rig.keys]
    deltas = [rig.key_deltas[names.index(name)] for name in JAW_CONTROLS]
    if arkit:
        deltas += [rig.arkit_deltas[ARKIT_NAMES.index(name)] for name in JAW_ARKIT]
    teeth = rig.parts["teeth"]
    places = rig.neutral()[teeth] - rig.joints()[JAW]
    motions = [_rigid(places, delta[teeth]) for delta in deltas]
    return np.array([[_local(part, forward=True) for part in motion] for motion in motions])


def _rigid(points: NDArray, moves: NDArray) -> tuple[NDArray, NDArray]:
    """Rotation vector (radians) about the origin, then translation, of the points that move.

    The best rigid motion by Kabsch's method, over the points that move half as far as the
    farthest one: the teeth of the upper jaw stay.
    """
    length = np.linalg.norm(moves, axis=1)
    if not length.any():
        return np.zeros(3), np.zeros(3)
    moving = length > 0.5 * length.max()
    start, end = points[moving].astype(float), (points + moves)[moving].astype(float)
    middle, target = start.mean(axis=0), end.mean(axis=0)
    u, _, vt = np.linalg.svd((start - middle).T @ (end - target))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    turn = vt.T @ flip @ u.T
    axis, angle = Matrix(turn.tolist()).to_quaternion().to_axis_angle()
    return np.array(axis) * angle, target - turn @ middle


def joints_move(armature: bpy.types.Object) -> bool:
    """Whether `place_joints` finds its bones: those that baked faces once lacked."""
    names = {name for pair in _PLACED.values() for name in pair if name}
    return names <= set(armature.pose.bones.keys())


def place_joints(armature: bpy.types.Object, rig: FaceRig, identity: Mapping[str, float]) -> None:
    """Move the joints of a face to where this identity has them."""
    bones = armature.pose.bones
    rest, places = rig.joints(), rig.joints(identity)
    for joint, (there, back) in _PLACED.items():
        shift = np.array(_local(places[joint] - rest[joint], forward=joint != NECK))
        bones[there].location = shift.tolist()
        if back is not None:
            bones[back].location = (-shift).tolist()


def turn_bone(bone: bpy.types.PoseBone, angles: tuple[float, float, float]) -> None:
    """Turn an upright bone by the rig's yaw, pitch, roll (radians), in whatever mode it is."""
    yaw, pitch, roll = angles
    if bone.rotation_mode == ORDER:
        bone.rotation_euler = (pitch, yaw, -roll)
        return
    turned = Matrix(rotation(angles).tolist())
    if bone.rotation_mode == "QUATERNION":
        bone.rotation_quaternion = turned.to_quaternion()
    elif bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turned.to_quaternion().to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
    else:
        bone.rotation_euler = turned.to_euler(bone.rotation_mode)


def turn_of(bone: bpy.types.PoseBone) -> tuple[float, float, float]:
    """Yaw, pitch, roll in radians of an upright bone against its rest."""
    if bone.rotation_mode == ORDER:
        pitch, yaw, back = bone.rotation_euler
    else:
        pitch, yaw, back = bone.matrix_basis.to_3x3().to_euler(ORDER)
    return float(yaw), float(pitch), 0.0 - float(back)
