"""Where the skull is hidden under hair, and how large it can be there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facs_rig import LANDMARKS, Camera, FaceRig
from facs_rig.common.derived import derived

from .lines import HEAD, Lines, SurfaceLines

__all__ = ["beyond_hair", "skull_triangles", "under_hair"]

AROUND, CROWD, ROUND = 0.06, 1.4, 8
"""Within this share of the head one line is as long as across; so many times that are hair. In so
many directions it is looked for there."""
SECTORS = 48
"""In so many directions from a head's middle the outermost hair is looked for."""
CROPPED = 0.02
"""Hair so near the page's edge goes on beyond it, as a share of the head."""


def under_hair(
    drawn: Lines,
    points: NDArray[np.floating],
    over: NDArray[np.bool_],
    head: float,
    hair: Callable[[NDArray], NDArray] | None = None,
) -> NDArray[np.bool_]:
    """Which points (k, 2) of a face's lines lie over the skull, and at or among hair.

    That is near where it was seen, or among more than one drawn line.

    over : (k,) bool, those over the skull;  head : pixels from chin to crown
    hair : see Observations
    """
    found = np.zeros(len(points), dtype=bool)
    if over.any() and len(drawn.points):
        reach = AROUND * head
        count = cKDTree(drawn.points).query_ball_point(points[over], reach, return_length=True)
        found[over] = count * drawn.spacing > CROWD * 2 * reach  # one line is as long
    if over.any() and hair is not None:
        turns = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
        ring = AROUND * head * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        about = points[over][:, None] + np.vstack([ring, np.zeros(2)])
        found[over] |= hair(about.reshape(-1, 2)).reshape(-1, ROUND + 1).any(axis=1)
    return found


@derived
def skull_triangles(rig: FaceRig) -> NDArray[np.bool_]:
    """(t,) which triangles lie above the forehead, or behind the temples and above the ears."""
    middle = rig.neutral()[rig.triangles].mean(axis=1)
    marks = dict(zip(LANDMARKS, rig.neutral()[rig.landmarks], strict=True))
    above = middle[:, 1] > marks["temple_left"][1]
    behind = (middle[:, 2] < marks["temple_left"][2]) & (middle[:, 1] > marks["eye_outer_left"][1])
    return above | behind


def beyond_hair(
    model: SurfaceLines,
    rig: FaceRig,
    camera: Camera,
    drawn: NDArray[np.floating],
    mane: NDArray[np.floating] | None,
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Which points of a face's lines are of the skull and lie beyond all that is drawn, at hair.

    drawn, mane : (k, 2) pixels of lines of the face, and of hair or None
    Returns (m,) their numbers and (m, 2) how far and where each lies from there, in pixels.
    """
    out = np.flatnonzero(skull_triangles(rig)[model.triangle])
    if mane is None or not len(mane) or not len(out):
        return np.empty(0, dtype=np.intp), np.empty((0, 2))
    middle = camera.project(np.zeros(3))
    page, near = np.array([camera.width, camera.height]), CROPPED * HEAD * camera.scale[0]
    ink = np.concatenate([mane, drawn])
    inside = ((ink > near) & (ink < page - near)).all(axis=1)
    sector, far, _ = _polar(ink, middle)
    edge = np.full(SECTORS, -np.inf)
    np.maximum.at(edge, sector, np.where(inside, far, np.inf))
    hairy = np.bincount(sector[: len(mane)], minlength=SECTORS) > 0
    sector, far, ray = _polar(model.lines.points[out], middle)
    beyond = hairy[sector] & np.isfinite(edge[sector]) & (far > edge[sector])
    return out[beyond], ((edge[sector] - far)[:, None] * ray)[beyond]


def _polar(
    points: NDArray[np.floating], middle: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Of points (k, 2): in which of SECTORS around a middle, how far from it, and unit rays."""
    ray = points - middle
    far = np.maximum(np.linalg.norm(ray, axis=1), 1e-9)
    sector = np.floor(np.arctan2(ray[:, 1], ray[:, 0]) / (2 * np.pi) * SECTORS).astype(np.intp)
    return sector % SECTORS, far, ray / far[:, None]
