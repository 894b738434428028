"""Catmull-Clark subdivision as a matrix, refined only where a face needs it.

Subdivision is linear in the cage, so a fine mesh is `matrix @ cage`, for the cage itself and for
every blendshape of it alike. Refinement is adaptive: every cage quad has its own level, and quads
next to finer ones are cut into smaller quads that meet these, so that no crack can open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .evenness import even_splits, mirror_images


@dataclass(frozen=True)
class Refined:
    """matrix : sparse (n, cage); polygons: quads and triangles, flat with the start of each;
    source : (p,) cage quad from which each polygon came; places : (c, 2) where each corner lies in
    that quad, whose own corners are SQUARE; number : (n,) of each vertex in the deepest mesh, alike
    at all levels of one cage."""

    matrix: sp.csr_matrix
    polygon_vertices: NDArray[np.int32]
    polygon_starts: NDArray[np.int32]
    source: NDArray[np.int32]
    places: NDArray[np.float64]
    number: NDArray[np.int64]


SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


def sides_of(quads: NDArray) -> tuple[NDArray, NDArray]:
    """Unique edges (e, 2) and the edge (f, 4) between corner k and k + 1 of each quad."""
    ends = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    edges, index = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    return edges, index.reshape(-1, 4)


def catmull_clark(quads: NDArray, n: int) -> tuple[sp.csr_matrix, NDArray, NDArray, NDArray]:
    """One step: matrix (n + e + f, n), new quads (4f, 4), edges (e, 2), quads' edges (f, 4).

    Vertices keep their numbers, edge points and face points follow. Rules: Catmull and Clark
    1978, "Recursively generated B-spline surfaces on arbitrary topological meshes"; boundary
    edges are cubic B-splines. The children of quad i are rows 4i to 4i + 3.
    """
    f = len(quads)
    edges, quad_edges = sides_of(quads)
    e = len(edges)
    face = sp.csr_matrix(
        (np.full(4 * f, 0.25), (np.repeat(np.arange(f), 4), quads.ravel())), shape=(f, n)
    )
    mid = sp.csr_matrix(
        (np.full(2 * e, 0.5), (np.repeat(np.arange(e), 2), edges.ravel())), shape=(e, n)
    )
    edge_of_face = sp.csr_matrix(
        (np.ones(4 * f), (quad_edges.ravel(), np.repeat(np.arange(f), 4))), shape=(e, f)
    )
    sharing = np.asarray(edge_of_face.sum(axis=1)).ravel()
    boundary = sharing < 2
    inner = sp.diags((~boundary).astype(float))
    edge = (
        inner @ (0.5 * mid + 0.25 * (edge_of_face @ face)) + sp.diags(boundary.astype(float)) @ mid
    )

    at_face = sp.csr_matrix(
        (np.ones(4 * f), (quads.ravel(), np.repeat(np.arange(f), 4))), shape=(n, f)
    )
    at_edge = sp.csr_matrix(
        (np.ones(2 * e), (edges.ravel(), np.repeat(np.arange(e), 2))), shape=(n, e)
    )
    valence = np.asarray(at_face.sum(axis=1)).ravel()
    on_boundary = np.asarray(at_edge @ boundary.astype(float)).ravel() > 0
    k = np.maximum(valence, 1)
    n_edges = np.maximum(np.asarray(at_edge.sum(axis=1)).ravel(), 1)
    smooth = (
        sp.diags(1 / k**2) @ (at_face @ face)
        + sp.diags(2 / (k * n_edges)) @ (at_edge @ mid)
        + sp.diags((k - 3) / k)
    )
    rim = 0.5 * sp.identity(n) + 0.25 * (at_edge @ sp.diags(boundary.astype(float)) @ mid)
    vertex = (
        sp.diags((~on_boundary).astype(float)) @ smooth + sp.diags(on_boundary.astype(float)) @ rim
    )
    matrix = sp.vstack([vertex, edge, face]).tocsr()

    e_at = n + quad_edges
    centre = n + e + np.arange(f)
    children = np.stack(
        [
            np.stack([quads[:, c], e_at[:, c], centre, e_at[:, (c + 3) % 4]], axis=1)
            for c in range(4)
        ],
        axis=1,
    ).reshape(-1, 4)
    return matrix, children, edges, quad_edges


def refine(quads: NDArray, n: int, level: NDArray, mirror: NDArray | None = None) -> Refined:
    """Subdivide each cage quad (f, 4) `level` (f,) times, 0 upwards, without cracks.

    mirror : (n,) mirror image of each cage vertex, of a mesh that shall stay symmetric

    Where levels change by one, there are quads alone, but for a region without a rim that has an
    odd number of finer sides around it.
    """
    depth = int(level.max())
    matrices = [sp.identity(n, format="csr")]
    meshes = [np.asarray(quads, dtype=np.int64)]
    edge_tables, quad_edge_tables = [], []
    for _ in range(depth):
        step, children, edges, quad_edges = catmull_clark(meshes[-1], matrices[-1].shape[0])
        matrices.append((step @ matrices[-1]).tocsr())
        meshes.append(children)
        edge_tables.append(edges)
        quad_edge_tables.append(quad_edges)
    split = _splits(meshes, edge_tables, quad_edge_tables, level, mirror)
    child_edge = [_child_edges(edge_tables, s, matrices[s].shape[0]) for s in range(depth - 1)]

    def along(s: int, edge: int, a: int) -> list[tuple[int, float]]:
        """Vertices on the edge of step s seen from its end a, and how far along they lie, without
        the far end."""
        if s >= depth or not split[s][edge]:
            return [(a, 0.0)]
        middle = matrices[s].shape[0] + edge
        if s + 1 >= depth:
            return [(a, 0.0), (middle, 0.5)]
        ends = edge_tables[s][edge]
        b = ends[0] + ends[1] - a
        first = along(s + 1, child_edge[s][(edge, a)], a)
        second = along(s + 1, child_edge[s][(edge, b)], middle)
        return [(v, t / 2) for v, t in first] + [(v, 0.5 + t / 2) for v, t in second]

    polygons: list[list[int]] = []
    source: list[int] = []
    places: list[NDArray] = []
    squares = SQUARE[None]  # of the quads that each cage quad has at this step
    for s in range(depth + 1):
        leaf = np.flatnonzero(np.repeat(level, 4**s) == s)
        for i in leaf:
            quad, square = meshes[s][i].tolist(), squares[i % 4**s]
            if s == depth:
                sides, centre = [[(v, 0.0)] for v in quad], -1
            else:
                sides = [along(s, quad_edge_tables[s][i, c], quad[c]) for c in range(4)]
                centre = matrices[s].shape[0] + len(edge_tables[s]) + i
            at = {centre: square.mean(axis=0)}
            for c, side in enumerate(sides):
                way = square[(c + 1) % 4] - square[c]
                at |= {v: square[c] + t * way for v, t in side}
            cut = _cut([[v for v, _ in side] for side in sides], centre)
            polygons += cut
            source += [i // 4**s] * len(cut)
            places += [at[v] for polygon in cut for v in polygon]
        squares = _quartered(squares)
    flat = np.array([v for p in polygons for v in p], dtype=np.int64)
    used, flat = np.unique(flat, return_inverse=True)
    matrix = _rows_at_depth(matrices, used, meshes, depth)
    sizes = np.array([len(p) for p in polygons])
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    return Refined(
        matrix,
        flat.astype(np.int32),
        starts.astype(np.int32),
        np.array(source, dtype=np.int32),
        np.array(places),
        used,
    )


def _quartered(squares: NDArray) -> NDArray[np.float64]:
    """The children (4k, 4, 2) of squares (k, 4, 2), in the order of `catmull_clark`."""
    after, before = np.roll(squares, -1, axis=1), np.roll(squares, 1, axis=1)
    centre = np.broadcast_to((squares[:, :1] + squares[:, 2:3]) / 2, squares.shape)
    children = [squares, (squares + after) / 2, centre, (squares + before) / 2]
    return np.stack(children, axis=2).reshape(-1, 4, 2)


def _splits(
    meshes: list[NDArray],
    edge_tables: list[NDArray],
    quad_edge_tables: list[NDArray],
    level: NDArray,
    mirror: NDArray | None,
) -> list[NDArray[np.bool_]]:
    """Which edges of each step are split: where a neighbour has children, or to even a rim."""
    split = []
    for s, (edges, quad_edges) in enumerate(zip(edge_tables, quad_edge_tables, strict=True)):
        edge_split = np.zeros(len(edges), dtype=bool)
        edge_split[quad_edges[np.repeat(level, 4**s) > s].ravel()] = True
        split.append(edge_split)
    for s, (edges, quad_edges) in enumerate(zip(edge_tables, quad_edge_tables, strict=True)):
        images = np.arange(len(meshes[s])), np.arange(len(edges))
        if mirror is not None:
            images = mirror_images(meshes[s], mirror), mirror_images(edges, mirror)
            n = len(mirror)
            mirror = np.concatenate([mirror, n + images[1], n + len(edges) + images[0]])
        whole = np.flatnonzero(np.repeat(level, 4**s) == s)
        odd = split[s][quad_edges[whole]].sum(axis=1) % 2 == 1
        split[s][even_splits(quad_edges, whole, odd, split[s], images)] = True
    return split


def _cut(sides: list[list[int]], centre: int) -> list[list[int]]:
    """The polygons of a quad whose sides are split: vertices of each side without its far end.

    Two opposite splits make two quads; else the quads, and perhaps a triangle, lie around `centre`.
    """
    ring = [v for side in sides for v in side]
    size = len(ring)
    if size == 4:
        return [ring]
    lengths = [len(side) for side in sides]
    if lengths in ([1, 2, 1, 2], [2, 1, 2, 1]):
        k = lengths.index(2)
        ring = ring[k:] + ring[:k]
        return [[ring[0], ring[1], ring[4], ring[5]], ring[1:5]]
    corners = {side[0] for side in sides}
    # Where a corner is the middle of a quad's outer border, none of its angles is straight.
    shift = max((0, 1), key=lambda k: sum(v in corners for v in ring[k + 1 :: 2]))
    ring = ring[shift:] + ring[: shift + 1]
    return [[centre, *ring[k : min(k + 3, size + 1)]] for k in range(0, size, 2)]


def _child_edges(edge_tables: list[NDArray], s: int, n: int) -> dict[tuple[int, int], int]:
    """(edge of step s, its end) -> the edge of step s + 1 from that end to the edge point."""
    edges = edge_tables[s + 1]
    number = {(int(a), int(b)): k for k, (a, b) in enumerate(edges)}
    table = {}
    for k, (a, b) in enumerate(edge_tables[s]):
        for end in (int(a), int(b)):
            found = number.get((min(end, n + k), max(end, n + k)))
            if found is not None:
                table[(k, end)] = found
    return table


def _rows_at_depth(matrices, used, meshes, depth) -> sp.csr_matrix:
    """Rows of the deepest matrix: a vertex keeps its number in all steps after its own.

    All vertices take their place in the deepest mesh, so that coarse and fine leaves meet.
    """
    return matrices[depth][used].tocsr().astype(np.float32)


def triangulate(polygon_vertices: NDArray, polygon_starts: NDArray) -> NDArray[np.int32]:
    """Triangles (t, 3) of quads and triangles; a quad gives two neighbouring ones."""
    sizes = np.diff(np.append(polygon_starts, len(polygon_vertices)))
    fans = []
    for size in np.unique(sizes):
        ring = polygon_vertices[polygon_starts[sizes == size][:, None] + np.arange(size)]
        order = np.flatnonzero(sizes == size)
        for k in range(1, size - 1):
            fans.append((order, ring[:, [0, k, k + 1]]))
    order = np.concatenate([o for o, _ in fans])
    triangles = np.concatenate([t for _, t in fans])
    return triangles[np.argsort(order, kind="stable")].astype(np.int32)
