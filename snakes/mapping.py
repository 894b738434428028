"""Which vertex each pixel of the render belongs to (thesis, chapter 3, step 6).

The mapping is made once, before anything moves: remaking it while vertices move leads, as the
thesis found, to undesirable results.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facs_rig import Camera, FaceRig, rasterise
from facs_rig.anatomy import UNDRAWN_PARTS
from facs_rig.raster import barycentric

__all__ = ["pixels_to_skin", "pixels_to_vertices", "world_moves"]

CANDIDATES = 12
"""How many of the vertices around a pixel compete for it."""
FINE = 0.0005
"""Metres: the pixels of the picture in which the skin under a place is looked up."""
MOST_PIXELS = 2000
"""The longest side of that picture."""


def pixels_to_vertices(
    pixels: NDArray[np.integer],
    vertices: NDArray[np.floating],
    candidates: NDArray[np.bool_],
    camera: Camera,
    low_depth_preference: float = 0.0,
    reach: float = 2.0,
) -> NDArray[np.intp]:
    """Find the vertex of each pixel.

    Parameters
    ----------
    pixels : (k, 2) int, column and row in the camera's picture
    vertices : (n, 3) float, metres, posed
    candidates : (n,) bool, the vertices that may be chosen: the visible skin
    low_depth_preference : 0..1
        0 takes the vertex that projects nearest to the centre of the pixel; 1 takes, of the dozen
        nearest within `reach`, the one nearest to the viewer (z high, the thesis' low depth);
        values between weigh the two, each scaled to the range of those that compete.
    reach : pixels
        A vertex that projects farther than this from the pixel's centre is never taken.

    Returns
    -------
    (k,) intp, vertex indices, -1 where no candidate is near
    """
    chosen = np.full(len(pixels), -1, dtype=np.intp)
    indices = np.flatnonzero(candidates)
    if len(indices) == 0 or len(pixels) == 0:
        return chosen
    k = min(CANDIDATES, len(indices))
    tree = cKDTree(camera.project(vertices[indices]))
    away, near = tree.query(np.asarray(pixels) + 0.5, k=k, distance_upper_bound=reach)
    away, near = away.reshape(len(pixels), k), near.reshape(len(pixels), k)
    here = near < len(indices)
    depth = vertices[indices[np.minimum(near, len(indices) - 1)], 2].astype(np.float64)
    front = np.where(here, depth, -np.inf).max(axis=1, keepdims=True)
    behind = np.where(here & np.isfinite(front), np.maximum(front, -1e9) - depth, 0.0)
    behind = behind / np.maximum(behind.max(axis=1, keepdims=True), 1e-9)
    score = (1.0 - low_depth_preference) * away / reach + low_depth_preference * behind
    score = np.where(here, score, np.inf)
    best = score.argmin(axis=1)
    rows = np.arange(len(pixels))
    found = here[rows, best]
    chosen[found] = indices[near[rows, best][found]]
    return chosen


def pixels_to_skin(
    pixels: NDArray[np.floating],
    rig: FaceRig,
    posed: NDArray[np.floating],
    camera: Camera,
) -> tuple[NDArray[np.bool_], NDArray[np.intp], NDArray[np.float64]]:
    """Find what skin is seen at places of a picture; brows and lashes hide nothing.

    Parameters
    ----------
    pixels : (k, 2) float, (u, v) in the camera's picture, also beyond its border
    posed : (n, 3) float, metres

    Returns
    -------
    seen : (k,) bool, whether the skin is what is seen there
    corners : (k, 3) intp, the vertices of its triangle, 0 where it is not seen
    weights : (k, 3) float64, barycentric in the picture, 0 to 1, 0 where it is not seen
    """
    pixels = np.asarray(pixels, dtype=np.float64)
    seen = np.zeros(len(pixels), dtype=bool)
    corners = np.zeros((len(pixels), 3), dtype=np.intp)
    weights = np.zeros((len(pixels), 3))
    if len(pixels) == 0:
        return seen, corners, weights
    head = camera.project(posed)
    cell = FINE * np.array(camera.scale)
    low = np.maximum(pixels.min(axis=0), head.min(axis=0)) - 2 * cell
    high = np.minimum(pixels.max(axis=0), head.max(axis=0)) + 2 * cell
    if np.any(high <= low):
        return seen, corners, weights
    width, height = np.clip(np.ceil((high - low) / cell), 1, MOST_PIXELS).astype(int).tolist()
    fine = camera.cropped(low[0], low[1], high[0], high[1], width, height)
    hair = np.any([rig.parts[part] for part in UNDRAWN_PARTS], axis=0)
    triangles = rig.triangles[~hair[rig.triangles].any(axis=1)]
    owner = rasterise(posed, triangles, fine).triangle
    u, v = ((pixels - low) * ([width, height] / (high - low))).T
    inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
    under = np.full(len(pixels), -1)
    under[inside] = owner[v[inside].astype(np.intp), u[inside].astype(np.intp)]
    seen = (under >= 0) & rig.parts["skin"][triangles[under, 0]]
    corners[seen] = triangles[under[seen]]
    # A place beside its pixel's centre may lie a little outside the triangle that is seen there.
    near = np.clip(barycentric(posed, triangles, fine, under[seen], u[seen], v[seen]), 0.0, 1.0)
    weights[seen] = near / near.sum(axis=1, keepdims=True)
    return seen, corners, weights


def world_moves(
    deltas: NDArray[np.floating], points: NDArray[np.floating], camera: Camera
) -> NDArray[np.float64]:
    """Turn deltas in pixels into movements in metres, parallel to the picture.

    deltas : (k, 2) as (u, v) pixels; points : (k, 3) metres, the vertices that are to move.
    Returns (k, 3) metres, z 0. With perspective a pixel is wider on a point that is farther away.
    """
    wide = camera.relative_depth(np.asarray(points, dtype=np.float64))
    moves = np.zeros((len(deltas), 3))
    moves[:, 0] = deltas[:, 0] * wide / camera.scale[0]
    moves[:, 1] = -deltas[:, 1] * wide / camera.scale[1]
    return moves
