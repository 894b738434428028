"""Lines on a mesh: where a field on its vertices is zero, or largest; chained into polylines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .curvature import ready
from .kernels import kernels
from .topology import Topology


@dataclass(frozen=True)
class Crossings:
    """Where lines cross the edges of a mesh; a point on an edge belongs to both its triangles.

    edge : (p,) int32        start, end : (p,) int32, its vertices
    share : (p,) how near the point is to `end`        segments : (s, 2) pairs of points
    """

    edge: NDArray
    start: NDArray
    end: NDArray
    share: NDArray
    segments: NDArray

    def of(self, value: NDArray) -> NDArray:
        """A field (n,) or (n, c) of the vertices at the crossings."""
        share = self.share if value.ndim == 1 else self.share[:, None]
        return value[self.start] + share * (value[self.end] - value[self.start])


@dataclass(frozen=True)
class MeshLines:
    """Lines on a mesh, one after another.

    starts : (lines + 1,) places of their first points
    triangle : (m,) int32, the triangle in which a line goes on from each point (at its last
    point: from which it comes), and weights : (m, 3), the point's barycentric weights there
    """

    starts: NDArray
    triangle: NDArray
    weights: NDArray

    def of(self, value: NDArray, triangles: NDArray) -> NDArray:
        """A field (n,) or (n, c) of the vertices at the points."""
        values = ready(value.reshape(len(value), -1))
        out = kernels().mixed(triangles, self.triangle, self.weights, values)
        return out.reshape(-1, *value.shape[1:])


def zero_set(topology: Topology, value: NDArray, chosen: NDArray | None = None) -> Crossings:
    """Where `value` (n,), linear on each triangle, is zero.

    chosen : (t,) bool, the triangles that are looked at. Neighbouring triangles share the point
    on their common edge.
    """
    value = ready(value)
    pairs = kernels().sign_changes(
        topology.triangles, topology.triangle_edges, _chosen(topology, chosen), value
    )
    edge, segments = kernels().number(pairs, len(topology.edges))
    start, end = topology.edges[edge].T
    share = value[start] / (value[start] - value[end])
    return Crossings(edge, start, end, share, segments)


def crest(
    topology: Topology, vertices: NDArray, rise: NDArray, chosen: NDArray | None = None
) -> Crossings:
    """Where a field is largest along the direction in which it is asked to be.

    rise : (n, 3) its derivative along that direction, as a vector (see `curvature.rise`): zero on
    the line, and on both sides of it pointing to it. The tests are those of Ohtake, Belyaev,
    Seidel 2004, "Ridge-Valley Lines on Meshes via Implicit Surface Fitting".
    """
    rise = ready(rise)
    pairs = kernels().turns(
        topology.triangles, topology.triangle_edges, _chosen(topology, chosen), rise,
        ready(vertices),
    )  # fmt: skip
    edge, segments = kernels().number(pairs, len(topology.edges))
    start, end = topology.edges[edge].T
    one, other = (np.sqrt(np.einsum("nd,nd->n", rise[p], rise[p])) for p in (start, end))
    return Crossings(edge, start, end, one / (one + other), segments)


def _chosen(topology: Topology, chosen: NDArray | None) -> NDArray[np.bool_]:
    if chosen is None:
        return np.ones(len(topology.triangles), dtype=bool)
    return ready(chosen, np.bool_)


def chains(segments: NDArray) -> tuple[NDArray, NDArray]:
    """Chain segments (s, 2) of point numbers into polylines, in linear time.

    Returns the points (m,) of one line after another, and (lines + 1,) where each starts. Every
    segment is used once; lines run from loose end to loose end, closed ones repeat their first
    point.
    """
    ends = ready(segments, np.int32).ravel()
    count = int(ends.max(initial=-1)) + 1
    places = np.argsort(ends, kind="stable").astype(np.int32)
    first = np.zeros(count + 1, dtype=np.int32)
    np.cumsum(np.bincount(ends, minlength=count), out=first[1:])
    line = np.zeros(len(ends), dtype=np.int32)
    starts = np.zeros(len(segments) + 1, dtype=np.int32)
    used = np.zeros(len(segments), dtype=bool)
    lines = kernels().chain(ends, first, places, used, line, starts)
    starts = starts[: lines + 1]
    return line[: starts[-1]], starts


def traced(
    topology: Topology, found: Crossings, pixels: NDArray, longest: float, kept: NDArray
) -> MeshLines:
    """The lines through crossings, with points at most `longest` pixels apart.

    pixels : (p, 2) of the crossings;  kept : (s,) bool, the segments to use
    """
    line, starts = chains(found.segments[kept])
    triangle = topology.between(found.edge[line], found.edge[line[_partners(starts)]])
    share, start, end = found.share[line], found.start[line], found.end[line]

    def weights(places: NDArray, owner: NDArray) -> NDArray:
        at = start[places], end[places], share[places]
        return kernels().edge_weights(topology.triangles, owner, *at)

    return _finer(starts, triangle, weights, pixels[line], longest)


def rim(topology: Topology, pixels: NDArray, longest: float, kept: NDArray) -> MeshLines:
    """The lines along edges that have but one triangle, of the triangles kept (t,).

    pixels : (n, 2) of the vertices
    """
    lonely = topology.edge_triangles[:, 1] < 0
    edges = np.flatnonzero(lonely & kept[topology.edge_triangles[:, 0]])
    line, starts = chains(topology.edges[edges])
    step = np.sort(np.stack([line, line[_partners(starts)]], axis=1), axis=1)
    base = len(pixels)
    keys = topology.edges[edges].astype(np.int64) @ (base, 1)  # in order, as the edges are
    found = np.searchsorted(keys, step.astype(np.int64) @ (base, 1))

    def weights(places: NDArray, triangle: NDArray) -> NDArray:
        return (topology.triangles[triangle] == line[places, None]).astype(float)

    owner = topology.edge_triangles[edges[found], 0]
    return _finer(starts, owner, weights, pixels[line], longest)


def _partners(starts: NDArray) -> NDArray:
    """For every point of lines the next one; for the last of a line the one before it."""
    out = np.arange(1, starts[-1] + 1)
    out[starts[1:] - 1] -= 2
    return out


def _finer(
    starts: NDArray,
    triangle: NDArray,
    weights: Callable[[NDArray, NDArray], NDArray],
    pixels: NDArray,
    longest: float,
) -> MeshLines:
    """Lines with points at most `longest` pixels apart.

    weights : of the points (k,) in triangles (k,), both given as numbers
    """
    count = len(pixels)
    after = np.minimum(np.arange(count) + 1, count - 1)
    step = pixels[after] - pixels
    parts = np.maximum(np.ceil(np.hypot(step[:, 0], step[:, 1]) / longest), 1).astype(np.int64)
    parts[starts[1:] - 1] = 1
    which = np.repeat(np.arange(count), parts)
    first = np.concatenate([[0], np.cumsum(parts)])
    share = ((np.arange(len(which)) - first[which]) / parts[which])[:, None]
    owner = triangle[which]
    mixed = (1 - share) * weights(which, owner) + share * weights(after[which], owner)
    return MeshLines(first[starts], owner, mixed)
