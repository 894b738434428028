"""Distance over a surface, measured as Blender's proportional editing does with Connected Only.

Blender lets a front run over the mesh: the vertices next to a selected one are as far as their
edge is long, and from there on the distance at the third corner of a triangle follows from those
at the other two, as if straight from a source in the triangle's plane ("Dart Throwing on
Surfaces", EGSR 2009, section 7). Where that source does not see the corner through the side
between the two, the way along one of the edges counts. The function in Blender's source is
``transform_convert_mesh_connectivity_distance``.

On a grid of right-angled triangles, flat or rolled up, the two are the same but for rounding.
Where triangles are obtuse it matters which of its neighbours reaches a corner first. Blender goes
by the order in which the mesh keeps its edges; here the front moves on by half an edge at a time,
nearest first, for many selections together. On crumpled grids, triangles of all shapes, the two
differ by up to half an edge and by a hundredth of an edge in the mean (a test in tests/blender
says so). Blender crosses a quad in one step; on crumpled quads that makes up to an edge of
difference to their triangles. Loose edges lead nowhere here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["surface_distances"]

BLOCK = 50_000
"""How many pairs of vertex and selection are worked on together; bounds the memory."""
STEP = 0.5
"""How far the front moves at a time, as a share of the mean edge: small steps go back less often,
great ones take more triangles together."""
LEAST_GAIN = 1e-7
"""A way that is shorter by less than this fraction is no news; Blender's floats know no less."""


@dataclass(frozen=True)
class _Corners:
    """The corners of all triangles, sorted by vertex; seen from each lies the opposite side.

    first : (n + 1,) int, where the corners of each vertex begin
    a, b : (c,) int, the two ends of the side
    next_a, next_b : (c,) int, the corners of the same triangle at these ends
    to_a, to_b : (c,) metres, how far away the ends are
    side : (c,) metres, the length of the side
    x, y : (c,) metres, the corner along the side from a, and beside it
    """

    first: NDArray[np.intp]
    a: NDArray[np.intp]
    b: NDArray[np.intp]
    next_a: NDArray[np.intp]
    next_b: NDArray[np.intp]
    to_a: NDArray[np.float64]
    to_b: NDArray[np.float64]
    side: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]


def surface_distances(
    vertices: NDArray[np.floating],
    triangles: NDArray[np.integer],
    rows: NDArray[np.integer],
    columns: NDArray[np.integer],
    sources: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Measure how far vertices are from selections of vertices, over the surface.

    Each selection has its own patch of vertices, which its ways do not leave.

    Parameters
    ----------
    vertices : (n, 3) float, metres
    triangles : (t, 3) int
    rows, columns : (p,) int
        Vertex and selection of each pair to measure, sorted by selection, then by vertex, no
        pair twice.
    sources : (p,) bool
        The pairs of which the vertex is selected.

    Returns
    -------
    (p,) float64, metres
        0 at the sources, infinite where no way leads.

    Raises ValueError when a triangle names a vertex that does not exist.
    """
    corners = _corners(np.asarray(vertices, dtype=np.float64), np.asarray(triangles))
    result = np.empty(len(rows))
    ends = np.flatnonzero(np.diff(columns, append=-1)) + 1
    start = 0
    while start < len(rows):
        # As many whole selections as fit into a block, one at least.
        fitting = ends[(ends > start) & (ends <= start + BLOCK)]
        stop = int(fitting[-1]) if len(fitting) else int(ends[ends > start][0])
        part = slice(start, stop)
        result[part] = _spread(corners, rows[part], columns[part], sources[part])
        start = stop
    return result


def _corners(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> _Corners:
    n = len(vertices)
    if triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(f"The triangles have the shape (t, 3), not {triangles.shape}.")
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= n):
        raise ValueError(f"The triangles name vertices outside 0 to {n - 1}.")
    tip, a, b = (np.roll(triangles, -k, axis=1).ravel().astype(np.intp) for k in range(3))
    order = np.argsort(tip, kind="stable")
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    # Corner 3 t + k is that of triangle t at its k-th vertex.
    following = np.arange(len(order)).reshape(-1, 3)
    next_a, next_b = (place[np.roll(following, -k, axis=1).ravel()[order]] for k in (1, 2))
    tip, a, b = tip[order], a[order], b[order]
    along, out = vertices[b] - vertices[a], vertices[tip] - vertices[a]
    side = np.linalg.norm(along, axis=1)
    to_a = np.linalg.norm(out, axis=1)
    # A side of no length has no direction: the corner then lies beside it.
    x = np.einsum("ij,ij->i", along, out) / np.maximum(side, 1e-30)
    return _Corners(
        first=np.concatenate([[0], np.cumsum(np.bincount(tip, minlength=n))]),
        a=a,
        b=b,
        next_a=next_a,
        next_b=next_b,
        to_a=to_a,
        to_b=np.linalg.norm(vertices[tip] - vertices[b], axis=1),
        side=side,
        x=x,
        y=np.sqrt(np.maximum(to_a**2 - x**2, 0.0)),
    )


def _spread(
    corners: _Corners,
    rows: NDArray[np.integer],
    columns: NDArray[np.integer],
    sources: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """surface_distances for one block of pairs."""
    n = len(corners.first) - 1
    count = np.diff(corners.first)[rows]
    start = np.cumsum(count) - count
    tip, corner = _ranges(corners.first[rows], count)
    key = columns.astype(np.int64) * n + rows
    base = columns[tip].astype(np.int64) * n
    a, b = (np.searchsorted(key, base + end[corner]) for end in (corners.a, corners.b))
    a, b = (np.minimum(place, len(key) - 1) for place in (a, b))
    inside = (key[a] == base + corners.a[corner]) & (key[b] == base + corners.b[corner])
    # Where the other two corners of the same triangle stand in these lists.
    next_a = start[a] + corners.next_a[corner] - corners.first[corners.a[corner]]
    next_b = start[b] + corners.next_b[corner] - corners.first[corners.b[corner]]

    distance = np.where(sources, 0.0, np.inf)
    beside = np.minimum(distance[a] + corners.to_a[corner], distance[b] + corners.to_b[corner])
    np.minimum.at(distance, tip[inside], beside[inside])
    news = np.isfinite(distance)
    step = STEP * float(corners.side.mean()) if len(corners.side) else 0.0
    while news.any():
        waiting = np.flatnonzero(news)
        front = waiting[distance[waiting] <= distance[waiting].min() + step]
        news[front] = False
        _, around = _ranges(start[front], count[front])
        around = around[inside[around]]
        ready = np.concatenate([next_a[around], next_b[around]])
        before = distance[tip[ready]]
        nearer = np.maximum(distance[a[ready]], distance[b[ready]]) < before
        ready, before = ready[nearer], before[nearer]
        way = _across(corners, corner[ready], distance[a[ready]], distance[b[ready]])
        np.minimum.at(distance, tip[ready], way)
        news[tip[ready[way < before * (1.0 - LEAST_GAIN)]]] = True
    return distance


def _ranges(
    first: NDArray[np.integer], count: NDArray[np.integer]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Owner and value of all members of the ranges that begin at `first` and count `count`."""
    owner = np.repeat(np.arange(len(first)), count)
    return owner, np.arange(len(owner)) + np.repeat(first + count - np.cumsum(count), count)


def _across(
    corners: _Corners,
    corner: NDArray[np.intp],
    from_a: NDArray[np.float64],
    from_b: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The distance at corners that follows from those at the ends of the opposite sides."""
    side, x, y = corners.side[corner], corners.x[corner], corners.y[corner]
    # The source lies at (foot, -depth) where the side runs from (0, 0) to (side, 0).
    foot = 0.5 * (side + (from_a**2 - from_b**2) / np.maximum(side, 1e-30))
    squared = from_a**2 - foot**2
    depth = np.sqrt(np.maximum(squared, 0.0))
    crossing = foot + depth * (x - foot) / np.maximum(y + depth, 1e-30)
    seen = (from_a > 0) & (from_b > 0) & (squared > 0) & (crossing >= 0) & (crossing <= side)
    edges = np.minimum(from_a + corners.to_a[corner], from_b + corners.to_b[corner])
    return np.where(seen, np.hypot(x - foot, y + depth), edges)
