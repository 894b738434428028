"""Movements as the asset keeps them: of what moves, and no others, as whole numbers of a step.

A row's displacements are int16 multiples of a power of two that fits its largest, a half to some
micrometres: half the size of single precision, and exact in it. Indices are kept as differences.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

FINEST = 2.0**-21  # metres: no movement needs to be known to half of that
LARGEST = 32767  # of an int16


def packed(name: str, stack: NDArray, finest: float = FINEST) -> dict[str, NDArray]:
    """Rows (k, n, 3) in metres as arrays `name_index`, `name_delta`, `name_step`, `name_starts`.

    finest : metres, a power of two, the least step
    """
    most = np.abs(stack).max(axis=(1, 2), initial=FINEST)
    step = np.maximum(2.0 ** np.ceil(np.log2(most / LARGEST)), finest)
    whole = np.round(stack / step[:, None, None]).astype(np.int16)
    moved = [np.flatnonzero(row.any(axis=1)) for row in whole]
    none: NDArray = np.zeros((0, 3), np.int16)
    delta = np.concatenate([none, *(row[at] for row, at in zip(whole, moved, strict=True))])
    gaps = [np.diff(at, prepend=0) for at in moved]
    return {
        f"{name}_index": np.concatenate([np.zeros(0), *gaps]).astype(np.int32),
        f"{name}_delta": np.ascontiguousarray(delta.T),
        f"{name}_step": step.astype(np.float32),
        f"{name}_starts": np.cumsum([0, *map(len, moved)]).astype(np.int32),
    }


def unpacked(
    arrays: Mapping[str, NDArray], name: str
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """Row (e,) and index (e,) of each entry, and its displacement (e, 3) in metres."""
    starts, step = arrays[f"{name}_starts"], arrays[f"{name}_step"]
    row = np.repeat(np.arange(len(step)), np.diff(starts))
    total = np.cumsum(arrays[f"{name}_index"], dtype=np.intp)
    before = np.concatenate([[0], total])[starts[:-1]]
    delta = arrays[f"{name}_delta"].T * step[row, None]
    return row, total - before[row], delta.astype(np.float32)


def dense(arrays: Mapping[str, NDArray], name: str, n: int) -> NDArray[np.float32]:
    """(rows, 3n) of movements of n vertices."""
    row, index, delta = unpacked(arrays, name)
    out = np.zeros((len(arrays[f"{name}_step"]), n, 3), dtype=np.float32)
    out[row, index] = delta
    return out.reshape(len(out), 3 * n)


Entries = tuple[int, NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]


def entries(arrays: Mapping[str, NDArray], name: str) -> Entries:
    """How many rows, and what `unpacked` gives."""
    return len(arrays[f"{name}_step"]), *unpacked(arrays, name)


def shared(arrays: Mapping[str, NDArray], name: str, mirror: NDArray) -> Entries:
    """Entries of rows `name_row`, or of their mirror images where `name_mirrored`.

    mirror : (n,) the vertex on the other side of each
    """
    row, flip = arrays[f"{name}_row"], arrays[f"{name}_mirrored"]
    starts = arrays[f"{name}_starts"].astype(np.intp)
    count = np.diff(starts)[row]
    which = np.repeat(np.arange(len(row)), count)
    at = np.arange(len(which)) + np.repeat(starts[row] - np.cumsum(count) + count, count)
    _, index, delta = unpacked(arrays, name)
    index, delta, over = index[at], delta[at], flip[which]
    index[over] = mirror[index[over]]
    delta[over, 0] *= -1
    return len(row), which, index, delta


def compressed(
    found: Sequence[Entries],
) -> tuple[NDArray[np.intp], list[sp.csr_matrix]]:
    """Vertices (u,) that any row of these moves, and sparse displacements of them (rows, 3u)."""
    used, at = np.unique(np.concatenate([index for _, _, index, _ in found]), return_inverse=True)
    cuts = np.cumsum([len(index) for _, _, index, _ in found])[:-1]
    return used, [
        sparse_rows(row, place, delta, (count, len(used)))
        for (count, row, _, delta), place in zip(found, np.split(at, cuts), strict=True)
    ]


def sparse(arrays: Mapping[str, NDArray], name: str, n: int) -> sp.csr_matrix:
    """Sparse (rows, 3n) of movements of n vertices."""
    row, index, delta = unpacked(arrays, name)
    return sparse_rows(row, index, delta, (len(arrays[f"{name}_step"]), n))


def sparse_rows(
    row: NDArray, index: NDArray, delta: NDArray, shape: tuple[int, int]
) -> sp.csr_matrix:
    """(rows, 3n) of displacements (e, 3) at rows (e,) and vertices (e,); shape : (rows, n)."""
    columns = 3 * index[:, None] + np.arange(3)
    entries = (delta.ravel(), (row.repeat(3), columns.ravel()))
    return sp.csr_matrix(entries, shape=(shape[0], 3 * shape[1]))
