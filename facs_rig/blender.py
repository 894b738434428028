"""Builds the Blender object of a face: mesh, one shape key per control, a head that turns.

The only module of this package that needs bpy. The object does in Blender what `FaceRig.pose`
does in numpy: the basis is the neutral face, a key at value 1 is its control at full natural
activation (intensity 5), "Fitted" adds the offsets of the strokes, and two bones turn neck and
head by linear blending, like the rig. So the evaluated mesh equals `rig.pose` (tests hold it to
1e-5 m), and every slider and bone stays live.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from facs_rig import CONTROLS, FULL_INTENSITY, FaceParameters, FaceRig
from facs_rig.paint import MATERIAL_NAMES, MATERIALS, materials_at
from facs_rig.rotation import rotation

FITTED = "Fitted"
BASIS = "Basis"

HEAD, NECK, ROOT, HEAD_ALONE = "head", "neck", "root", "head_alone"


def to_blender(points: NDArray) -> NDArray[np.float32]:
    """Core axes (y up, z to the viewer) to Blender's (z up, facing -y): (x, y, z) -> (x, -z, y)."""
    points = np.asarray(points, dtype=np.float32)
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def build_face(
    name: str,
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
    *,
    collection: bpy.types.Collection | None = None,
    location: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> bpy.types.Object:
    """Make the object of a posed face and its armature; return the mesh object.

    Parameters
    ----------
    name : of the object, its mesh and (with " Rig") its armature.
    rig, parameters : the face; `parameters.aus` set the sliders, `head` and `neck` the bones.
    offsets : (n, 3) float, metres, upright head frame, core axes; becomes the key "Fitted".
    collection : where the objects are linked; the scene's own if None.
    location : metres, Blender axes; where the head's pivot comes to lie.

    Raises ValueError if `offsets` has another shape than the rig's vertices.
    """
    if offsets is not None and np.shape(offsets) != (rig.n_vertices, 3):
        raise ValueError(
            f"offsets must have the shape {(rig.n_vertices, 3)}, got {np.shape(offsets)}"
        )
    collection = collection or bpy.context.scene.collection
    neutral = rig.neutral(parameters.identity)
    mesh = _mesh(name, rig, to_blender(neutral))
    face = bpy.data.objects.new(name, mesh)
    collection.objects.link(face)
    _materials(mesh, rig, neutral)
    _shape_keys(face, rig, parameters, to_blender(neutral), offsets)
    armature = _armature(f"{name} Rig", rig, parameters, neutral, collection)
    armature.location = location
    face.parent = armature
    _bind(face, armature, rig)
    return face


def _mesh(name: str, rig: FaceRig, vertices: NDArray[np.float32]) -> bpy.types.Mesh:
    corners = np.ascontiguousarray(rig.polygon_vertices, dtype=np.int32)
    starts = _starts(rig)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.loops.add(len(corners))
    mesh.polygons.add(len(starts))
    mesh.vertices.foreach_set("co", vertices.ravel())
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.foreach_set("loop_start", starts)
    if bpy.app.version < (4, 0, 0):  # later versions work it out from the starts
        totals = np.diff(np.append(starts, len(corners))).astype(np.int32)
        mesh.polygons.foreach_set("loop_total", totals)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(starts), dtype=bool))
    mesh.update(calc_edges=True)
    if mesh.validate():
        raise RuntimeError("the rig's polygons are not a valid mesh")
    return mesh


def _material(part: str) -> bpy.types.Material:
    """The material of a part; faces share it, and what the artist changed stays changed."""
    name = f"Face {part.capitalize()}"
    found = bpy.data.materials.get(name)
    if found is not None:
        return found
    colour, roughness = MATERIALS[part]
    material = bpy.data.materials.new(name)
    material.diffuse_color = colour
    material.roughness = roughness
    if material.node_tree is None:  # Blender 5 makes the nodes itself
        material.use_nodes = True
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = colour
    shader.inputs["Roughness"].default_value = roughness
    return material


def _starts(rig: FaceRig) -> NDArray[np.int32]:
    """First corner of each polygon, without a closing end."""
    starts = np.ascontiguousarray(rig.polygon_starts, dtype=np.int32)
    return starts[starts < len(rig.polygon_vertices)]


def _materials(mesh: bpy.types.Mesh, rig: FaceRig, neutral: NDArray[np.float32]) -> None:
    corners, starts = np.asarray(rig.polygon_vertices), _starts(rig)
    counts = np.diff(np.append(starts, len(corners)))[:, None]
    centres = np.add.reduceat(neutral[corners], starts, axis=0) / counts
    part = rig.vertex_part[corners[starts]]
    for name in MATERIAL_NAMES:
        mesh.materials.append(_material(name))
    mesh.polygons.foreach_set("material_index", materials_at(rig, neutral, centres, part))


def _add_key(face: bpy.types.Object, name: str, points: NDArray, value: float) -> None:
    key = face.shape_key_add(name=name, from_mix=False)
    points_of = key.points if hasattr(key, "points") else key.data  # `points` is faster, from 4.1
    points_of.foreach_set("co", np.ascontiguousarray(points, dtype=np.float32).ravel())
    key.slider_min, key.slider_max = 0.0, 2.0
    key.value = value


def _shape_keys(
    face: bpy.types.Object,
    rig: FaceRig,
    parameters: FaceParameters,
    neutral: NDArray[np.float32],
    offsets: NDArray | None,
) -> None:
    face.shape_key_add(name=BASIS, from_mix=False)
    for control, delta in zip(CONTROLS, rig.control_deltas, strict=True):
        value = parameters.aus.get(control.name, 0.0) / FULL_INTENSITY
        _add_key(face, control.name, neutral + to_blender(delta), value)
    if offsets is not None:
        _add_key(face, FITTED, neutral + to_blender(offsets), 1.0)


def _armature(
    name: str,
    rig: FaceRig,
    parameters: FaceParameters,
    neutral: NDArray[np.float32],
    collection: bpy.types.Collection,
) -> bpy.types.Object:
    """Bones where the rig has its joints, turned as `parameters` say.

    The rig turns the head first and then the neck, each blended with its own weights. A vertex
    that follows the head fully but the neck in part needs a bone that turns as the head does
    without the neck: `head_alone`, hidden, copies the head's own rotation.
    """
    joints = {
        ROOT: rig.joints(parameters.identity)["neck"],
        NECK: rig.joints(parameters.identity)["neck"],
        HEAD: np.zeros(3),
        HEAD_ALONE: np.zeros(3),
    }
    crown = float(neutral[:, 1].max())
    ends = {
        ROOT: joints[ROOT] + (0.0, -0.05, 0.0),
        NECK: np.zeros(3),
        HEAD: np.array([0.0, crown + 0.05, 0.0]),  # looks out of the crown, to be seen and taken
        HEAD_ALONE: np.array([0.0, 0.05, 0.0]),
    }
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    collection.objects.link(armature)
    armature.data.display_type = "STICK"
    layer = bpy.context.view_layer
    before = layer.objects.active
    layer.objects.active = armature  # bones can be made in Edit Mode alone
    bpy.ops.object.mode_set(mode="EDIT")
    for bone_name in joints:
        bone = armature.data.edit_bones.new(bone_name)
        bone.head = to_blender(joints[bone_name]).tolist()
        bone.tail = to_blender(ends[bone_name]).tolist()
    armature.data.edit_bones[HEAD].parent = armature.data.edit_bones[NECK]
    bpy.ops.object.mode_set(mode="OBJECT")
    layer.objects.active = before

    copy = armature.pose.bones[HEAD_ALONE].constraints.new("COPY_ROTATION")
    copy.target, copy.subtarget = armature, HEAD
    copy.owner_space = copy.target_space = "LOCAL"
    for bone_name in (ROOT, HEAD_ALONE):
        armature.data.bones[bone_name].hide = True
    for bone_name, angles in ((NECK, parameters.neck), (HEAD, parameters.head)):
        _turn_bone(armature.pose.bones[bone_name], angles)
    return armature


def _turn_bone(bone: bpy.types.PoseBone, angles: tuple[float, float, float]) -> None:
    """Turn a bone by the rig's yaw, pitch, roll (radians)."""
    turned = to_blender(to_blender(rotation(angles)).T).T  # C R Cᵀ: the same in Blender's axes
    rest = bone.bone.matrix_local.to_3x3()
    bone.rotation_mode = "QUATERNION"
    bone.rotation_quaternion = (rest.inverted() @ Matrix(turned.tolist()) @ rest).to_quaternion()


def _bind(face: bpy.types.Object, armature: bpy.types.Object, rig: FaceRig) -> None:
    """Give the face the rig's weights and the armature modifier that uses them."""
    head, neck = np.asarray(rig.weights, dtype=float).T
    weights = {
        ROOT: (1 - head) * (1 - neck),
        NECK: (1 - head) * neck,
        HEAD: head * neck,
        HEAD_ALONE: head * (1 - neck),
    }
    for name, values in weights.items():
        group = face.vertex_groups.new(name=name)
        whole = values > 1 - 1e-7
        group.add(np.flatnonzero(whole).tolist(), 1.0, "REPLACE")
        for vertex in np.flatnonzero((values > 1e-7) & ~whole).tolist():
            group.add((vertex,), values[vertex], "REPLACE")
    modifier = face.modifiers.new("Head and Neck", "ARMATURE")
    modifier.object = armature
