"""Makes a face in Blender another person's, in place: its object, animation and place stay.

What the rig knows is written anew: the basis, the keys of the rig and ARKit's, "Fitted", the
joints. What was sculpted into these keys by hand goes; keys that the artist added stay, with the
same offsets against the basis or whichever key they are relative to. Hair follows as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import from_blender, joints_move, to_blender
from facs_rig.blender.arrays import BULK, corners_of, read_key, write_key, write_places
from facs_rig.blender.hair_follows import check_free, follow_person
from facs_rig.blender.keys import add_fitted, moved, replace_fitted
from facs_rig.blender.pose import (
    armature_of,
    check_face,
    has_identity_keys,
    identity_of,
    refresh,
    rig_of,
    set_identity,
    write_identity,
)
from facs_rig.blender.steps import Steps, finish, sliced
from facs_rig.common.errors import InputError
from facs_rig.controls import ARKIT_NAMES
from facs_rig.fitted_keys import FITTED, FITTED_REGIONS, FittedKey, offsets_at
from facs_rig.identity import IDENTITY_KEYS, check_identity
from facs_rig.levels import kept_by, keys_kept_by
from facs_rig.mesh import is_shape
from facs_rig.rig import FaceRig

SLICE = 0.08  # seconds; older Blenders write a face in several of these, newer ones in one


def reshape(
    face: bpy.types.Object,
    rig: FaceRig,
    identity: Mapping[str, float],
    offsets: NDArray | None = None,
    fitted: Sequence[FittedKey] = (),
) -> None:
    """Give a face another identity and other fitted offsets; what it does stays.

    Parameters
    ----------
    rig : the full one, whatever the face's level of detail.
    face : as `check_face` wants it, in Object Mode, with an identity that is baked or in keys.
    identity : parameter -> value, see facs_rig.IDENTITY (missing is the default).
    offsets : (n, 3) float, metres, upright head frame, core axes, of the full rig's vertices or of
        those of the face's own level: the key "Fitted", which is made if the face has none. None
        leaves "Fitted" as it is, zeros empty it. How far the key is on is the artist's: 1 if it is
        made here, else as it was.
    fitted : what of the offsets goes with actions, in the place of what the face has of this kind

    Then the evaluated mesh is `rig.pose` of this identity, these offsets and whatever the face
    does, as after `build_face`. Raises InputError, one sentence, with nothing changed: for bad
    values and shapes, and for faces that are edited, linked, of another topology, or without a
    key or hidden bone that has to be moved. Undo is the caller's.
    """
    finish(reshape_steps(face, rig, identity, offsets, fitted))


def reshape_steps(
    face: bpy.types.Object,
    rig: FaceRig,
    identity: Mapping[str, float],
    offsets: NDArray | None = None,
    fitted: Sequence[FittedKey] = (),
) -> Steps[None]:
    """`reshape` in slices of some 80 ms.

    The first slice checks and computes. From Blender 4.1 on it also writes, all at once; before,
    keys take 3 ms each and the face is in between until the last slice. A generator that is
    closed meanwhile writes the rest at once, so that no face stays half another's.
    """
    return sliced(_reshape(face, rig, identity, offsets, fitted), SLICE)


def fitted_offsets(face: bpy.types.Object) -> NDArray[np.float32] | None:
    """(n, 3) metres, core axes: the offsets in the fitted keys; None if there is no "Fitted".

    As they were given to `build_face` or `reshape`, however far the keys are on.
    """
    keys = face.data.shape_keys
    if keys is None or FITTED not in keys.key_blocks:
        return None
    names = [name for name in (FITTED, *FITTED_REGIONS.values()) if name in keys.key_blocks]
    basis = read_key(keys.reference_key)
    moves = [read_key(keys.key_blocks[name]) - basis for name in names]
    return from_blender(np.sum(moves, axis=0))


def _reshape(
    face: bpy.types.Object,
    rig: FaceRig,
    identity: Mapping[str, float],
    offsets: NDArray | None,
    fitted: Sequence[FittedKey],
) -> Steps[None]:
    """The units of `reshape_steps`."""
    check_identity(identity)
    whole, rig = rig, rig_of(face, rig)
    if offsets is not None:
        offsets = kept_by(rig, np.asarray(offsets, dtype=np.float32))
        offsets = is_shape(offsets, (rig.n_vertices, 3), "offsets")
        if not np.isfinite(offsets).all():
            raise InputError("offsets must be finite numbers")
        fitted = keys_kept_by(rig, fitted)
    _check_shape(face, rig, writes=offsets is not None)
    baked = not has_identity_keys(face)
    basis = read_key(face.data.shape_keys.reference_key)
    neutral = to_blender(rig.neutral(identity)) if baked else basis
    ours = _deltas(face, rig, identity) if baked else {}
    if offsets is not None:
        ours[FITTED] = offsets_at(offsets, fitted, {})
    theirs = _carried(face, neutral if baked else None, ours)
    if offsets is not None:
        theirs = {name: at for name, at in theirs.items() if name not in FITTED_REGIONS.values()}
    writes = _write(face, whole, identity, neutral, ours, theirs, fitted)
    try:
        for _ in writes:
            if not BULK:
                yield
    except GeneratorExit:
        finish(writes)
        raise


def _check_shape(face: bpy.types.Object, rig: FaceRig, writes: bool) -> None:
    """InputError, one sentence, if the face's shape cannot be written.

    writes : keys, too, which a library override cannot; the values of identity keys it can
    """
    check_face(face)
    mesh = face.data
    fixed = mesh.override_library and (writes or not has_identity_keys(face))
    if face.library or mesh.library or fixed:
        raise InputError(f"'{face.name}' is linked from another file; make it and its mesh local")
    if face.mode != "OBJECT":
        raise InputError(f"'{face.name}' is being edited; go to Object Mode first")
    check_free(face)
    blocks = mesh.shape_keys.key_blocks
    for name in (*(key.name for key in rig.keys), *_identity_keys(face)):
        if name not in blocks:
            raise InputError(f"'{face.name}' has lost its shape key '{name}'; add a new face")
    counts = {len(mesh.vertices), *(len(block.data) for block in blocks)}
    if counts != {rig.n_vertices} or not np.array_equal(corners_of(mesh), rig.polygon_vertices):
        raise InputError(
            f"the mesh of '{face.name}' has other vertices or polygons than it was made with; add "
            "a new face"
        )
    armature = armature_of(face)
    if armature is not None and not joints_move(armature):
        raise InputError(
            f"the bones of '{face.name}' cannot follow another person's joints: an older version "
            "made them, or some were removed; add a new face"
        )


def _identity_keys(face: bpy.types.Object) -> tuple[str, ...]:
    """The identity keys that the face must have: all if it has any, else none."""
    blocks = face.data.shape_keys.key_blocks
    return IDENTITY_KEYS if any(name in blocks for name in IDENTITY_KEYS) else ()


def _deltas(
    face: bpy.types.Object, rig: FaceRig, identity: Mapping[str, float]
) -> dict[str, NDArray[np.float32]]:
    """Key that the rig knows -> a person's offsets against the basis, (n, 3) metres, core axes."""
    moves = rig.key_deltas_of(identity)
    out = {key.name: delta for key, delta in zip(rig.keys, moves, strict=True)}
    if all(name in face.data.shape_keys.key_blocks for name in ARKIT_NAMES):
        out |= dict(zip(ARKIT_NAMES, rig.arkit_deltas_of(identity), strict=True))
    return out


def _carried(
    face: bpy.types.Object,
    neutral: NDArray[np.float32] | None,
    ours: Mapping[str, NDArray[np.float32]],
) -> dict[str, NDArray[np.float32]]:
    """Key that is not `ours` -> where its points (n, 3) come to lie, if they move.

    They keep their offsets, to the last bit where these are zero, against the key that theirs is
    relative to (or the basis, where keys are relative to each other in a circle).
    neutral : (n, 3) metres, Blender's axes, where the basis comes to lie; None if it stays
    """
    blocks, basis = face.data.shape_keys.key_blocks, face.data.shape_keys.reference_key
    places: dict[str, NDArray[np.float32] | None] = {basis.name: neutral}
    stand = read_key(basis) if neutral is None else neutral

    def place(name: str, below: tuple[str, ...] = ()) -> NDArray[np.float32] | None:
        if name not in places:
            places[name] = moved(stand, ours[name]) if name in ours else carried(name, below)
        return places[name]

    def carried(name: str, below: tuple[str, ...]) -> NDArray[np.float32] | None:
        under, below = blocks[name].relative_key.name, (*below, name)
        if under in below:
            under = basis.name
        along = place(under, below)
        if along is None:
            return None
        return along + (read_key(blocks[name]) - read_key(blocks[under]))

    others = [block.name for block in blocks if block.name not in ours and block != basis]
    return {name: points for name in others if (points := place(name)) is not None}


def _write(
    face: bpy.types.Object,
    rig: FaceRig,
    identity: Mapping[str, float],
    neutral: NDArray[np.float32],
    ours: Mapping[str, NDArray[np.float32]],
    theirs: Mapping[str, NDArray[np.float32]],
    fitted: Sequence[FittedKey],
) -> Steps[None]:
    """Write what was computed, a key at a time. Keys are found by name: see `reshape_steps`.

    rig : the full one
    """
    if has_identity_keys(face):
        set_identity(face, rig, identity)
    else:
        follow_person(face, rig, identity_of(face), identity)
        write_identity(face, rig_of(face, rig), identity)
        write_places(face.data, neutral)
        write_key(face.data.shape_keys.reference_key, neutral)
    yield
    if FITTED in ours:
        if FITTED not in face.data.shape_keys.key_blocks:
            add_fitted(face, neutral, ours[FITTED], ())
        replace_fitted(face, neutral, fitted)
        yield
    for name, delta in ours.items():
        write_key(face.data.shape_keys.key_blocks[name], moved(neutral, delta))
        yield
    for name, points in theirs.items():
        write_key(face.data.shape_keys.key_blocks[name], points)
        yield
    face.data.update()
    face.data.shape_keys.update_tag()
    refresh(face)
