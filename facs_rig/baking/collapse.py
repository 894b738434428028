"""Fewer quads: a mesh of quads thinned out by collapsing diagonals, so that quads are left.

Where a corner of a quad is drawn onto the opposite one, that quad goes, and its neighbours close
the gap. After Tarini, Pietroni, Cignoni, Panozzo and Puppo 2010, "Practical quad mesh
simplification", with the error of Garland and Heckbert 1997, "Surface simplification using quadric
error metrics". Vertices that are left stay where they are.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

MOST = 6  # quads around a vertex
UPRIGHT, FLAT = 0.3, 0.15  # cosine of a quad's corners with what it was, and with its own normal
SEEN = 0.5  # weight of what is seen: what is hidden may turn as it likes
THIN = 0.1  # sine of a quad's sharpest corner
EVEN = 3e-4  # how much the length of a diagonal counts, so that even parts thin out evenly
STEP = 1e-3  # costs count as equal if their logarithms differ by less: alike on all processors


def collapse(
    vertices: NDArray,
    places: NDArray,
    vertex: NDArray,
    quads: NDArray,
    count: int,
    weight: NDArray,
) -> NDArray[np.int64]:
    """(count, 4) of the quads (f, 4), more only where no other can go; rims stay as they are.

    vertices : (n, 3) metres      places : (n, 2) theirs on a texture
    vertex : (n,) which of them are one vertex that a seam of the texture cuts in several
    weight : (n,) how much a metre of error matters at a vertex
    """
    mesh = _Mesh(np.asarray(vertices, float), places, vertex, np.asarray(quads), weight)
    queue: list[tuple[int, int, int, int]] = []

    def offer(quad: int) -> None:
        for k in range(4):
            cost = mesh.cost(quad, k)
            if cost is not None:
                heapq.heappush(queue, (cost, quad, k, mesh.version[quad]))

    for quad in range(len(quads)):
        offer(quad)
    while queue and len(mesh.quads) > count:
        _, quad, k, version = heapq.heappop(queue)
        if quad in mesh.quads and version == mesh.version[quad] and mesh.fits(quad, k):
            for other in mesh.go(quad, k):
                offer(other)
    return np.array([mesh.quads[i] for i in sorted(mesh.quads)])


class _Mesh:
    def __init__(
        self,
        vertices: NDArray,
        places: NDArray,
        vertex: NDArray,
        quads: NDArray,
        weight: NDArray,
    ) -> None:
        self.vertex = vertex.tolist()
        self.places = [tuple(place) for place in places.tolist()]
        self.vertices = [tuple(place) for place in vertices.tolist()]
        self.weight = weight.tolist()
        self.quads: dict[int, list[int]] = dict(enumerate(quads.tolist()))
        self.around: dict[int, set[int]] = {}
        for number, quad in self.quads.items():
            for corner in quad:
                self.around.setdefault(corner, set()).add(number)
        self.version = [0] * len(quads)
        ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        edges, uses = np.unique(ends, axis=0, return_counts=True)
        rim = np.zeros(len(vertices), dtype=bool)
        rim[edges[uses == 1]] = True
        self.rim = rim.tolist()
        self.errors = self._quadrics(quads, weight)

    def _quadrics(self, quads: NDArray, weight: NDArray) -> list[list[float]]:
        """For each vertex what `_error` sums: squared distances from the planes around it."""
        corners = np.array(self.vertices)[quads]
        out = np.zeros((len(self.vertices), 4, 4))
        for k in range(4):
            a, b, c = (corners[:, j % 4] for j in (k - 1, k, k + 1))
            normal = np.cross(b - a, c - b)
            area = np.linalg.norm(normal, axis=1)
            normal /= np.maximum(area, 1e-20)[:, None]
            plane = np.column_stack([normal, -(normal * b).sum(axis=1)])
            matrix = area[:, None, None] * plane[:, :, None] * plane[:, None, :]
            np.add.at(out, quads[:, k], matrix)
        out *= weight[:, None, None]
        rows, columns = np.triu_indices(4)
        return (out[:, rows, columns] * np.where(rows == columns, 1.0, 2.0)).tolist()

    def cost(self, number: int, k: int) -> int | None:
        """What it costs to draw corner k onto the opposite one; None where corner k stays."""
        quad = self.quads[number]
        gone, left = quad[k], quad[(k + 2) % 4]
        if self.rim[gone]:
            return None
        here, (x, y, z) = self.vertices[gone], self.vertices[left]
        terms = (x * x, x * y, x * z, x, y * y, y * z, y, z * z, z, 1.0)
        error = sum(q * term for q, term in zip(self.errors[gone], terms, strict=True))
        length = (x - here[0]) ** 2 + (y - here[1]) ** 2 + (z - here[2]) ** 2
        error = max(error, 0.0) + EVEN * self.weight[gone] * length * length
        return round(math.log(error + 1e-18) / STEP)

    def fits(self, number: int, k: int) -> bool:
        """Whether the mesh stays one of sound quads."""
        quad = self.quads[number]
        gone, one, left, other = (quad[(k + j) % 4] for j in range(4))
        moved = self.around[gone] - {number}
        if moved & self.around[left]:
            return False  # a neighbour would lose two corners
        for side in (one, other):
            least = 2 if self.rim[side] else 4
            if len(self.around[side]) < least:
                return False
        if len(moved) + len(self.around[left]) - 1 > MOST + 2 * (self.weight[gone] < SEEN):
            return False
        among, held = ({self.vertex[v] for v in self._beside(end)} for end in (gone, left))
        if (among & held) - {self.vertex[v] for v in (one, other)}:
            return False  # two edges would become one, here or beyond a seam
        if self.rim[left] and any(self.rim[v] for v in self._beside(gone) - {one, left, other}):
            return False  # nor with one beyond the rim, where that is the middle
        return all(self._sound(quad, gone, left) for quad in (self.quads[i] for i in moved))

    def _beside(self, vertex: int) -> set[int]:
        """The vertices that share an edge with one, or a quad."""
        return {v for i in self.around[vertex] for v in self.quads[i]} - {vertex}

    def _sound(self, quad: list[int], gone: int, left: int) -> bool:
        """Whether a quad stays upright and flat, no corner of it becomes thin, and it is not
        turned over on the texture."""
        after = [left if v == gone else v for v in quad]
        before = [sum(axis) for axis in zip(*(n for n, _ in self._corners(quad)), strict=True)]
        normals = list(self._corners(after))
        own = [sum(axis) for axis in zip(*(n for n, _ in normals), strict=True)]
        means = [(own, FLAT)] if self.weight[gone] < SEEN else [(own, FLAT), (before, UPRIGHT)]
        for normal, sides in normals:
            length = math.hypot(*normal)
            if length <= THIN * sides:
                return False
            for mean, least in means:
                along = sum(a * b for a, b in zip(normal, mean, strict=True))
                if along <= least * length * math.hypot(*mean):
                    return False
        return min(self._areas(after)) > 0 or min(self._areas(quad)) <= 0

    def _areas(self, quad: list[int]) -> Iterator[float]:
        """Twice the area on the texture of the two triangles that a quad is drawn as."""
        p = [self.places[v] for v in quad]
        for (ax, ay), (bx, by), (cx, cy) in ((p[0], p[1], p[2]), (p[0], p[2], p[3])):
            yield (bx - ax) * (cy - by) - (by - ay) * (cx - bx)

    def _corners(self, quad: list[int]) -> Iterator[tuple[tuple[float, float, float], float]]:
        """The normal at each corner and the product of the two sides that meet there."""
        points = [self.vertices[v] for v in quad]
        for (ax, ay, az), (bx, by, bz), (cx, cy, cz) in zip(
            points[-1:] + points[:-1], points, points[1:] + points[:1], strict=True
        ):
            ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - bx, cy - by, cz - bz
            normal = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            yield normal, math.hypot(ux, uy, uz) * math.hypot(vx, vy, vz)

    def go(self, number: int, k: int) -> set[int]:
        """Draw corner k onto the opposite one; the quads that have changed."""
        quad = self.quads.pop(number)
        gone, left = quad[k], quad[(k + 2) % 4]
        for vertex in quad:
            self.around[vertex].discard(number)
        for i in self.around.pop(gone):
            self.quads[i] = [left if v == gone else v for v in self.quads[i]]
            self.around[left].add(i)
        both = zip(self.errors[left], self.errors[gone], strict=True)
        self.errors[left] = [a + b for a, b in both]
        near = {i for v in {*quad, *self._beside(left)} - {gone} for i in self.around[v]}
        for i in near:
            self.version[i] += 1
        return near
