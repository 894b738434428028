"""Builds the Blender object of a face: mesh, sliders that drive shape keys, bones.

The object does in Blender what `FaceRig.pose` does in numpy. The basis is the neutral face; each
of `rig.keys` is a shape key, driven by its own expression from properties of the mesh object (see
facs_rig.blender_keys); "Fitted" adds the offsets of the strokes; bones turn neck, head and eyes
like the rig (see facs_rig.blender_armature). So the evaluated mesh equals `rig.pose` (tests hold
it to 1e-5 m), and every slider and bone stays live. facs_rig.blender_pose reads and sets them.

Only the modules `facs_rig.blender*` need bpy.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender_armature import (
    HEAD,
    NECK,
    bind,
    drive_eyes,
    drive_jaw,
    make_armature,
    to_blender,
    turn_bone,
)
from facs_rig.blender_keys import BASIS, FITTED, add_keys, add_properties
from facs_rig.blender_materials import add_materials, starts_of
from facs_rig.blender_pose import MARK, VERSION, set_identity
from facs_rig.parameters import FaceParameters, intensities
from facs_rig.rig import FaceRig

__all__ = ["BASIS", "FITTED", "build_face", "set_identity", "to_blender"]


def build_face(
    name: str,
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
    *,
    collection: bpy.types.Collection | None = None,
    location: tuple[float, float, float] = (0.0, 0.0, 0.0),
    identity_keys: bool = False,
    arkit: bool = False,
) -> bpy.types.Object:
    """Make the object of a posed face and its armature; return the mesh object.

    Parameters
    ----------
    name : of the object, its mesh and (with " Rig") its armature.
    rig, parameters : the face; `aus` and `gaze` set the sliders, `head` and `neck` the bones.
    offsets : (n, 3) float, metres, upright head frame, core axes; becomes the key "Fitted".
    collection : where the objects are linked; the scene's own if None.
    location : metres, Blender axes; where the head's pivot comes to lie.
    identity_keys : the basis is the default face, and the identity is in shape keys that
        `set_identity` changes; otherwise it is baked into the basis.
    arkit : add the 52 shape keys with ARKit's names (0 to 1, not driven: for live capture).

    Raises ValueError if `offsets` has another shape than the rig's vertices, and for unknown
    names or bad values in `parameters`. After an error nothing is left in the file.
    """
    if offsets is not None and np.shape(offsets) != (rig.n_vertices, 3):
        raise ValueError(
            f"offsets must have the shape {(rig.n_vertices, 3)}, got {np.shape(offsets)}"
        )
    intensities(parameters.aus)
    neutral = rig.neutral(parameters.identity)
    if identity_keys:
        neutral = rig.neutral()
    collection = collection or bpy.context.scene.collection
    made: list[bpy.types.ID] = []
    try:
        mesh = _mesh(name, rig, to_blender(neutral), made)
        add_materials(mesh, rig, neutral, made)
        face = bpy.data.objects.new(name, mesh)
        made.append(face)
        collection.objects.link(face)
        add_properties(face, rig, parameters)
        add_keys(face, rig, to_blender(neutral), offsets, identity_keys=identity_keys, arkit=arkit)
        built_for = {} if identity_keys else parameters.identity
        armature = make_armature(
            f"{name} Rig", rig, built_for, collection, made, movable=identity_keys
        )
        bind(face, armature, rig)
        drive_eyes(face, armature)
        drive_jaw(face, armature, rig)
        for bone, angles in ((NECK, parameters.neck), (HEAD, parameters.head)):
            turn_bone(armature.pose.bones[bone], angles)
        armature.location = location
        face.parent = armature
        face[MARK] = VERSION
        if identity_keys:
            set_identity(face, rig, parameters.identity)
    except BaseException:
        bpy.data.batch_remove(made[::-1])
        raise
    return face


def _mesh(
    name: str, rig: FaceRig, vertices: NDArray[np.float32], made: list[bpy.types.ID]
) -> bpy.types.Mesh:
    corners = np.ascontiguousarray(rig.polygon_vertices, dtype=np.int32)
    starts = starts_of(rig)
    mesh = bpy.data.meshes.new(name)
    made.append(mesh)
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
