"""What is not skin follows the skin: eyeballs stay round, lashes stick to lids, teeth stay put."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facs_rig import FaceRig

__all__ = ["carry_parts"]

LID_SHARE = 0.3
"""Skin within this fraction of an eyeball's radius from its surface belongs to its lids."""


def carry_parts(
    rig: FaceRig, vertices: NDArray[np.floating], offsets: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Offsets for every vertex, made from those of the skin.

    Each eyeball moves as a whole by the mean offset of the lid skin around it, lashes take the
    offset of the nearest skin, and teeth do not move.

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
    tree = cKDTree(vertices[skin])
    lashes = np.flatnonzero(rig.parts["lashes"])
    if len(lashes):
        result[lashes] = offsets[skin[tree.query(vertices[lashes])[1]]]
    for eye in eyeballs(rig):
        centre = (vertices[eye].min(axis=0) + vertices[eye].max(axis=0)) / 2
        radius = np.linalg.norm(vertices[eye] - centre, axis=1).max()
        lids = tree.query_ball_point(centre, radius * (1.0 + LID_SHARE))
        if lids:
            result[eye] = offsets[skin[lids]].mean(axis=0)
    return result


def eyeballs(rig: FaceRig) -> list[NDArray[np.intp]]:
    """Vertex indices of the eyeballs: the eye part on either side of the upright face."""
    eyes = rig.parts["eyes"]
    side = rig.neutral()[:, 0] > 0
    found = [np.flatnonzero(eyes & side), np.flatnonzero(eyes & ~side)]
    return [eye for eye in found if len(eye)]
