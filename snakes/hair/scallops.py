"""Curls that the outline tells: hair whose edge goes in and out in round bumps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import ConvexHull

__all__ = ["is_scalloped", "scallops"]

FINER = 2
"""Times as fine as the cells an outline is looked at."""
OUTER, EARS = 0.07, 0.65
"""Heads inside the convex hull of hair to which its outer edge lies, and the share of its height
below which that may be an ear's."""
BALL, NEEDLE = 0.06, 0.018
"""Radii in heads: what a ball that rolls outside does not reach lies between bumps, and what a ball
that rolls inside does not is a tip."""
DEEP, LONG = 0.006, 0.008
"""Heads that a valley is deep, and a tip long, to count."""
MANY, HOLLOW, POINTED = 2.8, 0.00095, 0.13
"""Valleys to a head of outline, and square heads of them, from which on it is scalloped, and tips
to a valley from which on it is jagged."""
SHORT = 0.6
"""Heads of outer edge of which there is no less: what few of them show is chance."""


def is_scalloped(valleys: float, hollow: float, tips: float) -> bool:
    """Whether an edge with these `scallops` has round bumps, and not the tips of straight hair."""
    return valleys >= MANY and hollow >= HOLLOW and tips < POINTED * valleys


def scallops(ink: NDArray, region: NDArray, rows: int) -> tuple[float, float, float]:
    """What there is to a head of the outer edge of a region (h, w) bool: valleys between bumps,
    square heads of them, and tips. Curls have round bumps with valleys between them, straight hair
    has tips.

    ink : (h, w) 0..1, which says where the edge is to less than a cell;  rows : cells to a head

    By openings and closings with discs (Serra 1982, "Image analysis and mathematical morphology").
    """
    shape, outer = _edge(ink, region, rows)
    unit = FINER * rows
    length = max(outer.sum() / unit, SHORT)
    away = ndimage.distance_transform_edt
    closed = away(away(~shape) <= BALL * unit) > BALL * unit
    near = ndimage.binary_dilation(outer, iterations=2)
    valleys, hollow = _pieces(closed & ~shape, away(closed), near, DEEP * unit)
    opened = away(~(away(shape) > NEEDLE * unit)) <= NEEDLE * unit
    tips, _ = _pieces(shape & ~opened, away(~opened), near, LONG * unit)
    return valleys / length, hollow / unit**2 / length, tips / length


def _edge(ink: NDArray, region: NDArray, rows: int) -> tuple[NDArray, NDArray]:
    """The shape of the largest piece of a region, finer by FINER and to its ink, and the part of
    its edge that is the outline of the hair: not that along the face or the page's edge, and not
    the ears'."""
    around = tuple(
        slice(max(at.start - 8, 0), at.stop + 8)
        for at in ndimage.find_objects(region.astype(np.uint8))[0]
    )
    wide = ndimage.binary_dilation(region[around], iterations=2)
    core = ndimage.binary_erosion(region[around], iterations=2)
    soft = np.where(core, 1.0, np.where(wide, ink[around], 0.0))
    room = round(2 * BALL * rows)
    soft = np.pad(ndimage.gaussian_filter(soft, 0.6), room)
    fine = ndimage.zoom(soft, FINER, order=1, grid_mode=True, mode="grid-constant")
    label, count = ndimage.label(ndimage.binary_fill_holes(fine > 0.42))
    shape = label == 1 + np.bincount(label.ravel(), minlength=count + 2)[1:].argmax()
    v, u = np.nonzero(shape & ~ndimage.binary_erosion(shape))
    if not len(v) or not np.ptp(v) or not np.ptp(u):  # specks have no hull
        return shape, np.zeros(shape.shape, dtype=bool)
    edge = np.stack([u, v], axis=1)
    lines = ConvexHull(edge).equations
    inside = -(edge @ lines[:, :2].T + lines[:, 2]).max(axis=1)
    low = v.min() + EARS * (v.max() - v.min())
    outer = np.zeros(shape.shape, dtype=bool)
    kept = (inside < OUTER * FINER * rows) & (v < low)
    outer[v[kept], u[kept]] = True
    # The page's edge is none of the hair's.
    inner = np.zeros(ink.shape, dtype=bool)
    inner[2:-2, 2:-2] = True
    inner = np.pad(inner[around], room)
    outer &= inner.repeat(FINER, axis=0).repeat(FINER, axis=1)
    end = round(low) + FINER * room  # what lies lower touches no outer edge
    return shape[:end], outer[:end]


def _pieces(part: NDArray, depth: NDArray, near: NDArray, least: float) -> tuple[int, float]:
    """How many pieces of a part (h, w) are at an edge and deep, and how large all of these are."""
    label, count = ndimage.label(part)
    if not count:
        return 0, 0.0
    which = np.arange(1, count + 1)
    deep = ndimage.maximum(depth, label, which) > least
    deep &= ndimage.maximum(near, label, which) > 0
    size = np.bincount(label.ravel(), minlength=count + 1)[1:]
    return int(deep.sum()), float(size[deep].sum())
