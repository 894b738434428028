"""Moving the skin around the vertices that the drawing pulls (thesis, chapter 3, step 7).

The thesis moves one vertex after the other with Maya's soft selection, so that movements pile up
where vertices are dense. Here all movements act at once: a vertex takes the weighted mean of the
movements that reach it, times the greatest of their weights. A single movement falls off from
its handles just as in Blender's proportional editing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix, diags, identity
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .geodesic import surface_distances
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

SLACK = 2.0
"""Patch of a selection on the surface, as a multiple of the reach.

Half way between two handles Blender's distance over the surface falls short of the true one."""

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
    vertices: NDArray[np.floating],
    handles: NDArray[np.integer],
    moves: NDArray[np.floating],
    reach: NDArray[np.floating],
    *,
    triangles: NDArray[np.integer] | None = None,
) -> tuple[NDArray[np.integer], NDArray[np.float64], NDArray[np.float64]]:
    """Let one handle stand for all that lie within a small part of their common reach.

    Neighbouring pixels pull almost the same skin by almost the same amount; where a movement
    reaches far, one handle for each MERGED of its reach moves the skin as they all do together.

    Parameters
    ----------
    vertices : (n, 3) float, metres
    handles : (k,) int; moves : (k, 3) float, metres; reach : (k,) metres
    triangles : (t, 3) int, optional
        With them only handles that hang together within their cell are merged.

    Returns
    -------
    handles : (m,) int, those that stay, the nearest to the middle of their cell
    moves : (m, 3) and reach : (m,), metres, the means over the cells
    """
    points = vertices[handles]
    octave = np.floor(np.log2(np.maximum(reach, 1e-9)) + 0.5)
    key = np.zeros((len(handles), 4))
    key[:, 0] = octave
    for step in np.unique(octave):
        group = octave == step
        cell = np.floor(vertices / (MERGED * 2.0**step))
        key[group, 1:] = cell[handles[group]]
        if triangles is not None:
            key[group, 1] = _patches(cell, triangles)[handles[group]]
    _, owner, counts = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    owner = owner.ravel()
    share = csr_matrix((1.0 / counts[owner], (owner, np.arange(len(owner)))))
    away = np.linalg.norm(points - (share @ points)[owner], axis=1)
    order = np.lexsort((away, owner))
    first = np.concatenate([[0], np.cumsum(counts)])[:-1]
    return handles[order[first]], share @ moves, share @ reach


def _patches(cell: NDArray[np.floating], triangles: NDArray[np.integer]) -> NDArray[np.integer]:
    """(n,) int, the same for vertices that edges within one cell connect; cell : (n, 3)."""
    a, b = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    within = (cell[a] == cell[b]).all(axis=1)
    edges = coo_matrix((np.ones(within.sum()), (a[within], b[within])), shape=(len(cell),) * 2)
    return connected_components(edges, directed=False)[1]


def proportional_edit(
    vertices: NDArray[np.floating],
    handles: NDArray[np.integer],
    moves: NDArray[np.floating],
    reach: NDArray[np.floating] | float,
    curve: str = "linear",
    *,
    triangles: NDArray[np.integer] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move handles and, with them, what lies around them, as Blender's proportional editing does.

    Handles that make the same move over the same reach are one selection: as in Blender its
    weight goes by the distance to the nearest of them. Where different selections meet, the
    offset is the weighted mean of their moves times the greatest weight.

    Parameters
    ----------
    vertices : (n, 3) float, metres
    handles : (k,) int, indices of the vertices that move, each at most once
    moves : (k, 3) float, metres
    reach : (k,) or one float, metres
        Distance at which a handle's influence has fallen to 0.
    curve : one of CURVES
    triangles : (t, 3) int, optional
        With them distance runs over the surface (Blender's Connected Only; see geodesic.py for
        how near the two are), so that a lip does not move the other lip. Without them it is
        Euclidean.

    Returns
    -------
    offsets : (n, 3) float64, metres
    weights : (n,) float64
        The greatest weight: 1 at the handles, 0 where nothing reaches.

    Raises ValueError for an unknown curve, a reach that is not above 0, and triangles of vertices
    that do not exist.
    """
    n = len(vertices)
    if len(handles) == 0:
        return np.zeros((n, 3)), np.zeros(n)
    radius = np.broadcast_to(np.asarray(reach, dtype=np.float64), (len(handles),))
    if not (radius > 0.0).all():
        raise ValueError(f"The reach of a handle is above 0 m, not {radius.min():g} m.")
    selections, owner = np.unique(np.column_stack([moves, radius]), axis=0, return_inverse=True)
    owner = owner.ravel()
    within = selections[:, 3]
    if triangles is not None:
        within = within * np.where(np.bincount(owner) > 1, SLACK, 1.0)
    rows, columns, apart = _pairs(vertices, handles, owner, within)
    if triangles is not None:
        sources = np.isin(columns * n + rows, owner * n + handles)
        apart = surface_distances(vertices, triangles, rows, columns, sources)
    weight = falloff(apart / selections[columns, 3], curve)
    share = csr_matrix((weight, (rows, columns)), shape=(n, len(selections)))
    total = np.asarray(share.sum(axis=1)).ravel()
    nearest = share.max(axis=1).toarray().ravel()
    mean = share @ selections[:, :3] / np.maximum(total, 1e-12)[:, None]
    return mean * nearest[:, None], nearest


def _pairs(
    vertices: NDArray[np.floating],
    handles: NDArray[np.integer],
    owner: NDArray[np.integer],
    radius: NDArray[np.float64],
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Vertex, selection and distance of all pairs within the selection's radius.

    owner : (k,) int, the selection of each handle; radius : (s,) metres. Returns three (p,)
    arrays, sorted by selection, then by vertex, with the distance to the nearest handle.
    """
    tree = cKDTree(vertices)
    # Handles of similar radius are searched together.
    octave = np.ceil(np.log2(radius / radius.min())).astype(np.intp)[owner]
    found: list[tuple[NDArray[np.intp], ...]] = []
    for step in np.unique(octave):
        group = np.flatnonzero(octave == step)
        pairs = cKDTree(vertices[handles[group]]).sparse_distance_matrix(
            tree, float(radius[owner[group]].max()), output_type="ndarray"
        )
        column = owner[group[pairs["i"]]]
        inside = pairs["v"] <= radius[column]
        found.append((pairs["j"][inside], column[inside], pairs["v"][inside]))
    rows, columns, apart = (np.concatenate(part) for part in zip(*found, strict=True))
    order = np.lexsort((apart, rows, columns))
    rows, columns, apart = rows[order], columns[order], apart[order]
    nearest = (np.diff(rows, prepend=-1) != 0) | (np.diff(columns, prepend=-1) != 0)
    return rows[nearest], columns[nearest], apart[nearest]


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
