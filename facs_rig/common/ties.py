"""Decisions that come out alike on every processor.

The last bits of a sum depend on the processor. On a symmetric head much is equal but for these
bits: the two sides of a face, the rings of an eyeball, a place on the edge of two triangles. So
what differs by less than SAME counts as equal, and of equals the one with the lowest index is
taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAME = 1e-12  # of metres and shares: rounding leaves 1e-15, and the source is given to 1e-6
AMONG = 8  # points that may be equally near


def first_least(values: NDArray, axis: int | None = None) -> NDArray[np.intp]:
    """Index of the smallest value, along an axis or of all; the first of equals."""
    least = np.min(values, axis=axis, keepdims=True)
    return np.asarray(np.argmax(values <= least + SAME, axis=axis))


def first_most(values: NDArray, axis: int | None = None) -> NDArray[np.intp]:
    """Index of the largest value, along an axis or of all; the first of equals."""
    return first_least(-values, axis)


def ascending(values: NDArray) -> NDArray[np.intp]:
    """The indices (n,) that sort values (n,); equals stay in their order."""
    order = np.argsort(values, kind="stable")
    rank = np.empty(len(values), np.intp)
    rank[order] = np.cumsum(np.diff(values[order], prepend=values[order[:1]]) > SAME)
    return np.argsort(rank, kind="stable")


def nearest(points: NDArray, places: NDArray) -> NDArray[np.intp]:
    """(k,) index of the point (n, d) nearest to each place (k, d)."""
    from scipy.spatial import cKDTree  # heavy, and only baking asks

    among = np.arange(1, min(AMONG, len(points)) + 1)
    found = np.sort(cKDTree(points).query(places, among)[1], axis=1)
    away = np.linalg.norm(points[found] - places[:, None], axis=2)
    return np.asarray(found[np.arange(len(places)), first_least(away, axis=1)])
