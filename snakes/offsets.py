"""Moving the skin around the vertices that the drawing pulls (thesis, chapter 3, step 7).

The thesis moves one vertex after the other with Maya's soft selection, so that movements pile up
where vertices are dense. Here all movements act at once: a vertex takes Σ w δ / max(1, Σ w) over
the handles that reach it, their weighted mean where they overlap and a single handle's fall-off
where it stands alone.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags, identity
from scipy.spatial import cKDTree

from .tweakables import CURVES

__all__ = [
    "falloff",
    "merge_handles",
    "proportional_edit",
    "reach_of",
    "smoothing_matrix",
    "symmetrise",
]

STEEPEST = 0.15
"""Greatest change of the movement per length of skin; from 1 on the skin would fold over."""

MERGED = 0.25
"""Side, as a fraction of the reach, of the cells within which handles are merged."""

_FALLOFFS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "smooth": lambda t: t * t * (3.0 - 2.0 * t),
    "sphere": lambda t: np.sqrt(t * (2.0 - t)),
    "root": np.sqrt,
    "inverse_square": lambda t: t * (2.0 - t),
    "sharp": lambda t: t * t,
    "linear": lambda t: t,
    "constant": lambda t: (t > 0.0).astype(np.float64),
}


def falloff(distance: NDArray[np.floating] | float, curve: str) -> NDArray[np.float64]:
    """Weight at a distance, 1 at 0 and 0 from 1 on, by the curves of Blender's proportional edit.

    distance : any shape, as a fraction of the reach. Raises ValueError for an unknown curve.
    """
    if curve not in _FALLOFFS:
        raise ValueError(f"The soft select curve is one of {', '.join(CURVES)}, not {curve!r}.")
    return _FALLOFFS[curve](np.clip(1.0 - np.asarray(distance, dtype=np.float64), 0.0, 1.0))


def reach_of(moves: NDArray[np.floating], distance: float) -> NDArray[np.float64]:
    """How far each handle reaches: `distance`, or farther if the skin would fold over otherwise.

    moves : (k, 3) metres; distance in metres. Returns (k,) metres. A handle that moves 3 cm with
    a reach of 1 cm would turn the skin around it inside out; its reach grows to 20 cm.
    """
    return np.maximum(distance, np.linalg.norm(moves, axis=1) / STEEPEST)


def merge_handles(
    points: NDArray[np.floating], moves: NDArray[np.floating], reach: NDArray[np.floating]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Let one handle stand for all that lie within a small part of their common reach.

    Neighbouring pixels pull almost the same skin by almost the same amount; where a movement
    reaches far, one handle for each MERGED of its reach moves the skin as they all do together.

    Parameters
    ----------
    points, moves : (k, 3) float, metres; reach : (k,) metres

    Returns
    -------
    chosen : (m,) int, indices of the handles that stay, the nearest to the middle of their cell
    moves : (m, 3) and reach : (m,), metres, the means over the cells
    """
    octave = np.floor(np.log2(np.maximum(reach, 1e-9)) + 0.5)
    cell = np.floor(points / (MERGED * 2.0**octave)[:, None])
    key = np.concatenate([octave[:, None], cell], axis=1)
    _, owner, counts = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    owner = owner.ravel()
    share = csr_matrix((1.0 / counts[owner], (owner, np.arange(len(owner)))))
    away = np.linalg.norm(points - (share @ points)[owner], axis=1)
    order = np.lexsort((away, owner))
    first = np.concatenate([[0], np.cumsum(counts)])[:-1]
    return order[first], share @ moves, share @ reach


def proportional_edit(
    vertices: NDArray[np.floating],
    handles: NDArray[np.integer],
    moves: NDArray[np.floating],
    reach: NDArray[np.floating] | float,
    curve: str = "linear",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move handles and, with them, what lies around them.

    Parameters
    ----------
    vertices : (n, 3) float, metres
    handles : (k,) int, indices of the vertices that move, each at most once
    moves : (k, 3) float, metres
    reach : (k,) or one float, metres
        Euclidean distance at which a handle's influence has fallen to 0.
    curve : one of CURVES

    Returns
    -------
    offsets : (n, 3) float64, metres
    weights : (n,) float64
        Sum of the handles' weights: 0 where nothing reaches.
    """
    n = len(vertices)
    if len(handles) == 0:
        return np.zeros((n, 3)), np.zeros(n)
    radius = np.broadcast_to(np.asarray(reach, dtype=np.float64), (len(handles),))
    rows, columns, apart = _pairs(vertices, handles, radius)
    weight = falloff(apart / radius[columns], curve)
    share = csr_matrix((weight, (rows, columns)), shape=(n, len(handles)))
    total = np.asarray(share.sum(axis=1)).ravel()
    nearest = share.max(axis=1).toarray().ravel()
    mean = share @ np.asarray(moves, dtype=np.float64) / np.maximum(total, 1e-12)[:, None]
    return mean * nearest[:, None], nearest


def _pairs(
    vertices: NDArray[np.floating], handles: NDArray[np.integer], radius: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Vertex, handle and distance of all pairs within the handle's radius; three (p,) arrays."""
    tree = cKDTree(vertices)
    # Handles of similar radius are searched together.
    octave = np.ceil(np.log2(radius / radius.min())).astype(np.intp)
    found: list[tuple[NDArray[np.intp], ...]] = []
    for step in np.unique(octave):
        group = np.flatnonzero(octave == step)
        pairs = cKDTree(vertices[handles[group]]).sparse_distance_matrix(
            tree, float(radius[group].max()), output_type="ndarray"
        )
        column = group[pairs["i"]]
        inside = pairs["v"] <= radius[column]
        found.append((pairs["j"][inside], column[inside], pairs["v"][inside]))
    rows, columns, apart = (np.concatenate(part) for part in zip(*found, strict=True))
    return rows, columns, apart


def smoothing_matrix(triangles: NDArray[np.integer], n: int) -> csr_matrix:
    """(n, n) sparse: each vertex takes the mean of itself (a half) and its neighbours (a half)."""
    a, b = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    rows, columns = np.concatenate([a, b]), np.concatenate([b, a])
    edges = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    edges.data[:] = 1.0
    degree = np.maximum(np.asarray(edges.sum(axis=1)).ravel(), 1.0)
    return (0.5 * (identity(n) + diags(1.0 / degree) @ edges)).tocsr()


def symmetrise(
    offsets: NDArray[np.floating],
    mirror: NDArray[np.integer],
    weights: NDArray[np.floating] | None = None,
) -> NDArray[np.floating]:
    """Make offsets symmetrical: each vertex takes the mean of its own and its mirrored partner's.

    Parameters
    ----------
    offsets : (n, 3) float, metres, in the frame of the upright head, x to the side
    mirror : (n,) int, index of each vertex' partner
    weights : (n,) float, optional
        How much each side knows. Where one side was never seen it follows the other; without
        weights both sides count the same.
    """
    flipped = offsets[mirror] * np.array([-1.0, 1.0, 1.0], dtype=offsets.dtype)
    if weights is None:
        return (offsets + flipped) / 2
    own, partner = weights[:, None], weights[mirror][:, None]
    total = own + partner
    known = total > 0
    share = np.where(known, own / np.where(known, total, 1.0), 0.5).astype(offsets.dtype)
    return share * offsets + (1 - share) * flipped
