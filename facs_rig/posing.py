"""Posing many faces at once: the same sums and rotations as FaceRig, on stacks of small cages.

Refinement is linear and its rows sum to one, so it commutes with rotations: heads are turned as
cages, and only the skin of the neck, which follows in part, and the eyes are turned by themselves.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

ROWS = 512  # of the refinement matrix at a time: what they give stays in the processor's cache


def with_creases(matrix: sp.csr_matrix, at: NDArray) -> sp.csr_matrix:
    """The refinement (n, m) with a column more for each creased vertex.

    at : (u,) vertices that creases move; their displacements stand behind the cage's vertices
    """
    n, u = matrix.shape[0], len(at)
    creases = sp.csr_matrix((np.ones(u, dtype=np.float32), (at, np.arange(u))), shape=(n, u))
    return sp.hstack([matrix, creases]).tocsr()


def row_blocks(matrix: sp.csr_matrix) -> list[sp.csr_matrix]:
    """The matrix in blocks of ROWS rows, which are quicker for many faces and slower for one."""
    return [matrix[k : k + ROWS] for k in range(0, matrix.shape[0], ROWS)]


def refine_many(
    blocks: list[sp.csr_matrix],
    *cages: NDArray,
    by_axis: bool = False,
    out: NDArray[np.float32] | None = None,
) -> NDArray[np.float32]:
    """(b, n, 3) fine faces of cages (b, m, 3), and crease displacements (b, u, 3) behind them.

    by_axis : whether all x of a face lie together in memory, then all y, then all z
    out : (b, n, 3) where they go, instead of memory of their own
    """
    count = len(cages[0])
    flat = np.empty((sum(c.shape[1] for c in cages), count, 3), dtype=np.float32)
    start = 0
    for cage in cages:
        _swap(cage, flat[start : start + cage.shape[1]])
        start += cage.shape[1]
    flat = flat.reshape(-1, 3 * count)
    n = sum(b.shape[0] for b in blocks)
    if out is None and by_axis:
        out = np.empty((count, 3, n), dtype=np.float32).transpose(0, 2, 1)
    elif out is None:
        out = np.empty((count, n, 3), dtype=np.float32)
    start = 0
    for block in blocks:
        stop = start + block.shape[0]
        _swap((block @ flat).reshape(-1, count, 3), out[:, start:stop])
        start = stop
    return out


def _swap(points: NDArray, out: NDArray) -> None:
    """Points (j, k, 3) into `out` (k, j, 3): of many faces axis by axis, for numpy is slow in
    threes."""
    if 1 in points.shape[:2]:
        out[:] = points.swapaxes(0, 1)
        return
    for axis in range(3):
        out[..., axis] = points[..., axis].T


def turned(points: NDArray, rotations: NDArray, pivots: NDArray | None = None) -> NDArray:
    """Points (b, k, 3) turned by rotations (b, 3, 3) about pivots (b, 3), or the origin."""
    back = rotations.transpose(0, 2, 1)
    out = points @ back
    if pivots is not None:
        out += (pivots - (pivots[:, None] @ back)[:, 0])[:, None]
    return out


def blended(
    points: NDArray, weights: NDArray, rotations: NDArray, pivots: NDArray
) -> NDArray[np.float32]:
    """Like `turned`, each point following by its weight (k,) (linear blend skinning)."""
    share = weights[None, :, None]
    return points + share * (turned(points, rotations, pivots) - points)


def spanning(shapes: NDArray, directions: int = 200) -> NDArray[np.intp]:
    """Vertices that lie farthest out in any of many directions in any of the shapes (s, n, 3)."""
    place = np.arange(directions) + 0.5  # a Fibonacci lattice on the sphere
    z, turn = 1 - 2 * place / directions, np.pi * (1 + np.sqrt(5)) * place
    flat = np.sqrt(1 - z * z)
    toward = np.stack([flat * np.cos(turn), flat * np.sin(turn), z]).astype(shapes.dtype)
    return np.unique(np.concatenate([(shape @ toward).argmax(axis=0) for shape in shapes]))
