"""Movements of a cage as the asset keeps them: of the vertices that move, and no others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray


def dense(arrays: Mapping[str, NDArray], name: str, n: int) -> NDArray[np.float32]:
    """(rows, 3n) from a list of moved vertices and their displacements."""
    index, delta, starts = (arrays[f"{name}_{k}"] for k in ("index", "delta", "starts"))
    out = np.zeros((len(starts) - 1, n, 3), dtype=np.float32)
    out[np.repeat(np.arange(len(out)), np.diff(starts)), index] = delta
    return out.reshape(len(out), -1)


def compressed(
    arrays: Mapping[str, NDArray], name: str
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Vertices (u,) that any row moves, and the rows' displacements of these (rows, 3u)."""
    used, at = np.unique(arrays[f"{name}_index"], return_inverse=True)
    return used, dense({**arrays, f"{name}_index": at}, name, len(used))
