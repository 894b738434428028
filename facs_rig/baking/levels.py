"""Levels of detail: which of the fine face's vertices the lighter ones keep, and their polygons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..subdivide import Refined, refine, sides_of


def medium_polygons(
    quads: NDArray, level: NDArray, mirror: NDArray, fine: Refined
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The polygons of the refinement of one step before, flat, with the start of each.

    quads : (f, 4) of the cage      level : (f,) of `fine`, what became of them
    Their vertices are those of the fine mesh, by its numbers.
    """
    few = refine(quads, len(mirror), without_tips(np.maximum(level - 1, 0), quads), mirror)
    at = np.searchsorted(fine.number, few.number[few.polygon_vertices])
    return at.astype(np.int32), few.polygon_starts


def without_tips(level: NDArray, quads: NDArray) -> NDArray[np.int64]:
    """Levels of quads, lowered while a quad has three neighbours that are coarser than itself.

    Such a quad adds more polygons around it, for coarse and fine to meet, than it has itself.
    """
    edge = sides_of(quads)[1]
    order = np.argsort(edge, axis=None, kind="stable")
    last = np.cumsum(np.bincount(edge.ravel())) - 1
    first = np.append(0, last[:-1] + 1)
    pair = np.stack([order[first], order[last]])[:, edge] // 4  # a quad at a rim stands for both
    beside = pair.sum(axis=0) - np.arange(len(quads))[:, None]
    rim = beside == np.arange(len(quads))[:, None]
    while True:
        as_fine = (level[beside] >= level[:, None]) & ~rim
        tips = (as_fine.sum(axis=1) <= 1) & (level > 0)
        if not tips.any():
            return level
        level = level - tips
