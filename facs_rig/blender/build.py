"""Builds the Blender object of a face: mesh, sliders that drive shape keys, bones.

The object does in Blender what `FaceRig.pose` does in numpy. The basis is the neutral face; each
of `rig.keys` is a shape key, driven by its own expression from properties of the mesh object (see
facs_rig.blender.keys); "Fitted" adds the offsets of the strokes; bones turn neck, head and eyes
like the rig (see facs_rig.blender.armature). So the evaluated mesh equals `rig.pose` (tests hold
it to 1e-5 m), and every slider and bone stays live. facs_rig.blender.pose reads and sets them,
facs_rig.blender.reshape makes a face another person's.

Only the modules `facs_rig.blender.build*` need bpy.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import (
    HEAD,
    NECK,
    bind,
    drive_eyes,
    drive_jaw,
    jaw_motions,
    make_armature,
    metre,
    skin_weights,
    to_blender,
    turn_bone,
)
from facs_rig.blender.arrays import make_mesh, write_places
from facs_rig.blender.keys import BASIS, add_keys, add_properties, driver_texts
from facs_rig.blender.materials import add_materials, paint_of, starts_of
from facs_rig.blender.pose import DETAIL, MARK, VERSION, set_identity, write_identity
from facs_rig.blender.steps import Steps, finish, sliced
from facs_rig.fitted_keys import FITTED, FittedKey
from facs_rig.mesh import is_shape
from facs_rig.parameters import FaceParameters, intensities
from facs_rig.rig import FaceRig

__all__ = [
    "BASIS", "FITTED", "build_face", "build_steps", "build_when", "paint_of", "prepare",
    "set_identity", "to_blender",
]  # fmt: skip

Known = tuple[FaceParameters, "NDArray | None", Sequence[FittedKey]]
"""What a face does and who it is, its fitted offsets, and what of them goes with its actions."""
_VALID: weakref.WeakSet[FaceRig] = weakref.WeakSet()  # rigs whose polygons Blender has checked


def build_face(
    name: str,
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
    fitted: Sequence[FittedKey] = (),
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
    rig, parameters : the face, at any level of detail (facs_rig.levels);
        `aus` and `gaze` set the sliders, `head` and `neck` the bones.
    offsets : (n, 3) float, metres, upright head frame, core axes; becomes the key "Fitted".
    fitted : what of the offsets goes with the drawn actions, in driven keys of its own.
    collection : where the objects are linked; the scene's own if None.
    location : units of the scene, Blender axes; where the head's pivot comes to lie.
        The armature is scaled so that a metre of the face is a metre of the scene (`metre`).
    identity_keys : the basis is the default face, and the identity is in shape keys that
        `set_identity` changes; otherwise it is baked into the basis.
    arkit : add the 52 shape keys with ARKit's names (0 to 1, not driven: for live capture).

    Raises ValueError if `offsets` has another shape than the rig's vertices, and for unknown
    names or bad values in `parameters`. After an error nothing is left in the file.
    """
    return finish(
        build_steps(
            name, rig, parameters, offsets, fitted, collection=collection, location=location,
            identity_keys=identity_keys, arkit=arkit,
        )
    )  # fmt: skip


def build_steps(
    name: str,
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
    fitted: Sequence[FittedKey] = (),
    *,
    collection: bpy.types.Collection | None = None,
    location: tuple[float, float, float] = (0.0, 0.0, 0.0),
    identity_keys: bool = False,
    arkit: bool = False,
) -> Steps[bpy.types.Object]:
    """`build_face` in slices of some 25 ms; what the generator returns is the mesh object.

    Objects come into `collection` with the last slice alone, so that Blender evaluates no half of
    a face. Nothing is left in the file if the generator is closed before that, nor after an
    error. Between slices the file may not be undone or exchanged: then the next one raises a
    ReferenceError. The first face of a rig takes longer, unless `prepare` was called before.
    """
    known = (parameters, offsets, fitted)
    return sliced(_build(name, rig, lambda: known, collection, location, identity_keys, arkit))


def build_when(
    name: str,
    rig: FaceRig,
    known: Callable[[], Known | None],
    *,
    collection: bpy.types.Collection | None = None,
    location: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Steps[bpy.types.Object]:
    """`build_steps` for a face whose shape is still being found: mesh, bones and skin come first.

    known : asked then, once a slice or oftener, until it answers with (parameters, offsets, fitted)
        rather than None; what it raises ends the building and leaves nothing.

    The first slice makes the bones, which takes an operator: start no thread before it is over
    (see `blender_armature`).
    """
    return sliced(_build(name, rig, known, collection, location, False, False))


def prepare(rig: FaceRig, *, identity_keys: bool = False, arkit: bool = False) -> None:
    """Compute what all faces of a rig share. Without bpy: meant for a thread beside Blender's."""
    paint_of(rig)
    skin_weights(rig)
    jaw_motions(rig, arkit)  # and with them rig.key_deltas and arkit_deltas
    for key in rig.keys:
        driver_texts(key.name, key.expression)
    if identity_keys:
        rig.identity_deltas  # noqa: B018  (computed when first read)


def _build(
    name: str,
    rig: FaceRig,
    known: Callable[[], Known | None],
    collection: bpy.types.Collection | None,
    location: tuple[float, float, float],
    identity_keys: bool,
    arkit: bool,
) -> Steps[bpy.types.Object]:
    """The units of `build_steps` and `build_when`."""
    points = to_blender(rig.neutral())
    collection = collection or bpy.context.scene.collection
    made: list[bpy.types.ID] = []
    try:
        armature = make_armature(f"{name} Rig", rig, made)
        yield
        mesh = make_mesh(name, points, rig.polygon_vertices.astype(np.int32), starts_of(rig))
        made.append(mesh)
        yield
        mesh.update(calc_edges=True)
        yield
        if rig not in _VALID:
            if mesh.validate():
                raise RuntimeError("the rig's polygons are not a valid mesh")
            _VALID.add(rig)
            yield
        yield from add_materials(mesh, rig, made)
        face = bpy.data.objects.new(name, mesh)
        made.append(face)
        yield from bind(face, armature, rig)
        while (shape := known()) is None:
            yield
        parameters, offsets, fitted = shape
        if offsets is not None:
            is_shape(offsets, (rig.n_vertices, 3), "offsets")
        intensities(parameters.aus)
        if not identity_keys:
            points = to_blender(rig.neutral(parameters.identity))
            write_places(mesh, points)
        add_properties(face, rig, parameters)
        yield
        whose = {} if identity_keys else parameters.identity
        yield from add_keys(
            face, rig, points, whose, offsets, fitted, identity_keys=identity_keys, arkit=arkit
        )
        drive_eyes(face, armature)
        drive_jaw(face, armature, rig)
        yield
        for bone, angles in ((NECK, parameters.neck), (HEAD, parameters.head)):
            turn_bone(armature.pose.bones[bone], angles)
        armature.location = location
        armature.scale = (metre(bpy.context.scene),) * 3
        face.parent = armature
        face[MARK], face[DETAIL] = VERSION, rig.level
        become = set_identity if identity_keys else write_identity
        become(face, rig, parameters.identity)
        for thing in (face, armature):
            collection.objects.link(thing)
    except BaseException:
        bpy.data.batch_remove([thing for thing in made[::-1] if _is_there(thing)])
        raise
    return face


def _is_there(thing: bpy.types.ID) -> bool:
    """Whether Blender still has it: an undo or another file may have taken it away."""
    try:
        return bool(thing.name)
    except ReferenceError:
        return False
