"""What moves in its own way: eyeballs stay round, hairs stick to the skin, teeth stay put, the
skull has no small shapes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from facs_rig import LANDMARKS, FaceRig
from facs_rig.anatomy import UNDRAWN_PARTS
from facs_rig.common.derived import derived

from .offsets import smoothing_matrix

__all__ = [
    "carry_parts", "even_skull", "keep_lids_on_eyes", "skin_smoother", "skin_triangles", "unfold",
]  # fmt: skip

LID_SHARE = 0.3
"""Skin within this fraction of an eyeball's radius from its surface belongs to its lids."""
SKULL_FROM, SKULL_BLEND = 0.015, 0.03
"""Metres above the brows at which the skull begins, and over which it takes over."""
SLIVER = 0.002
"""Of the usual area: whether a triangle so small has turned over is chance, and nobody sees it."""
UNFOLDINGS = 40
"""How often offsets around a triangle that turns over are averaged."""
SKULL_SMOOTHINGS = 200
"""How often offsets over the skull are averaged: over some centimetres on its coarse mesh."""


def carry_parts(
    rig: FaceRig, vertices: NDArray[np.floating], offsets: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Offsets for every vertex, made from those of the skin.

    Each eyeball moves as a whole by the mean offset of the lid skin around it, lashes and brows
    take the offset of the skin that is nearest at rest, and teeth do not move.

    Parameters
    ----------
    vertices : (n, 3) float, metres, the face before the offsets
    offsets : (n, 3) float, metres; only those of the skin are read

    Returns
    -------
    (n, 3) float64, metres
    """
    result = np.zeros(offsets.shape)
    skin = np.flatnonzero(rig.parts["skin"])
    result[skin] = offsets[skin]
    if len(skin) == 0:
        return result
    hair, roots = _hair_roots(rig)
    result[hair] = offsets[roots]
    for eye in eyeballs(rig):
        centre = (vertices[eye].min(axis=0) + vertices[eye].max(axis=0)) / 2
        radius = np.linalg.norm(vertices[eye] - centre, axis=1).max()
        lids = np.linalg.norm(vertices[skin] - centre, axis=1) < radius * (1.0 + LID_SHARE)
        if lids.any():
            result[eye] = offsets[skin[lids]].mean(axis=0)
    return result


@derived
def _hair_roots(rig: FaceRig) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Vertices of lashes and brows, and the skin's vertex nearest to each on the face at rest."""
    hair = np.flatnonzero(np.any([rig.parts[part] for part in UNDRAWN_PARTS], axis=0))
    skin = np.flatnonzero(rig.parts["skin"])
    if not len(hair):
        return hair, hair
    upright = rig.neutral()
    return hair, skin[cKDTree(upright[skin]).query(upright[hair])[1]]


def keep_lids_on_eyes(
    rig: FaceRig, vertices: NDArray[np.floating], offsets: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Offsets with which lids lie as far from their eyeball as before, wherever they have slid.

    vertices : (n, 3) float, metres, the face before the offsets
    offsets : (n, 3) float, metres; those of an eyeball move it as a whole
    """
    result = np.array(offsets, dtype=np.float64)
    skin = np.flatnonzero(rig.parts["skin"])
    for eye in eyeballs(rig):
        before = (vertices[eye].min(axis=0) + vertices[eye].max(axis=0)) / 2
        radius = np.linalg.norm(vertices[eye] - before, axis=1).max()
        after = before + offsets[eye].mean(axis=0)
        away = np.linalg.norm(vertices[skin] - before, axis=1)
        near = away < (1.0 + LID_SHARE) * radius
        lids, away = skin[near], away[near]
        share = np.clip((1.0 + LID_SHARE - away / radius) / (LID_SHARE / 2), 0.0, 1.0)
        moved = vertices[lids] + result[lids] - after
        now = np.linalg.norm(moved, axis=1)
        kept = moved * (away / np.maximum(now, 1e-9))[:, None]
        result[lids] += share[:, None] * (kept - moved)
    return result


def even_skull(
    rig: FaceRig, smoother: csr_matrix, offsets: NDArray[np.floating]
) -> NDArray[np.floating]:
    """Offsets of the skin with those over the skull made broad.

    The skull has no small shapes: what pulls a dent into it is hair, a parting, a hat's brim.
    From the brows upward the offsets turn into the solution of repeated averaging, so that only
    the size and the broad outline of the head follow the lines.

    Parameters
    ----------
    smoother : (s, s) sparse, averages each skin vertex with its neighbours
    offsets : (s, 3) float, metres, of the skin's vertices
    """
    skin = rig.parts["skin"]
    upright = rig.neutral()
    brow = upright[rig.landmarks[LANDMARKS.index("brow_peak_left")], 1]
    share = np.clip((upright[skin, 1] - brow - SKULL_FROM) / SKULL_BLEND, 0.0, 1.0)
    skull = share > 0
    inner, rim = smoother[skull][:, skull], smoother[skull][:, ~skull] @ offsets[~skull]
    broad = offsets[skull]
    for _ in range(SKULL_SMOOTHINGS):
        broad = inner @ broad + rim
    result = offsets.copy()
    result[skull] += share[skull, None] * (broad - result[skull])
    return result


def unfold(
    rig: FaceRig,
    smoother: csr_matrix,
    vertices: NDArray[np.floating],
    offsets: NDArray[np.floating],
) -> NDArray[np.floating]:
    """Offsets that turn no triangle of the skin over: averaged around those that do, else none.

    smoother : (s, s) sparse, averages each skin vertex with its neighbours
    vertices : (n, 3) float, metres, the face before the offsets (n, 3)
    """
    skin = np.flatnonzero(rig.parts["skin"])
    triangles = skin_triangles(rig)  # numbered within the skin
    before = _normals(vertices[skin], triangles)
    size = np.linalg.norm(before, axis=1)
    real = size > SLIVER * np.median(size)
    result = np.array(offsets, dtype=np.float64)
    for _ in range(UNFOLDINGS):
        turned = (
            np.einsum("ij,ij->i", before, _normals(vertices[skin] + result[skin], triangles)) <= 0
        )
        turned &= real
        if not turned.any():
            return result
        hot = np.zeros(len(skin))
        hot[triangles[turned].ravel()] = 1.0
        around = smoother @ (smoother @ hot) > 0
        own = result[skin]
        own[around] = (smoother @ own)[around]
        result[skin] = own
    return np.zeros_like(result)


def _normals(vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    axes = [np.ascontiguousarray(axis, dtype=np.float64) for axis in vertices.T]
    a, b, c = ([axis[triangles[:, k]] for axis in axes] for k in range(3))
    u, v = ([at - one for at, one in zip(ends, a, strict=True)] for ends in (b, c))
    return np.stack([u[i] * v[j] - u[j] * v[i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


@derived
def eyeballs(rig: FaceRig) -> list[NDArray[np.intp]]:
    """Vertex indices of the eyeballs: the eye part on either side of the upright face."""
    eyes = rig.parts["eyes"]
    side = rig.neutral()[:, 0] > 0
    found = [np.flatnonzero(eyes & side), np.flatnonzero(eyes & ~side)]
    return [eye for eye in found if len(eye)]


@derived
def skin_triangles(rig: FaceRig) -> NDArray[np.intp]:
    """The triangles of the skin, which number its vertices alone."""
    skin = rig.parts["skin"]
    place = np.cumsum(skin) - 1
    return place[rig.triangles[skin[rig.triangles].all(axis=1)]]


@derived
def skin_smoother(rig: FaceRig) -> csr_matrix:
    """The smoothing matrix of the skin vertices alone."""
    return smoothing_matrix(skin_triangles(rig), int(rig.parts["skin"].sum()))
