"""Where a surface lies on a texture; see facs_rig.baking.uv for what the face's own map is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

SAME_PLACE = 1e-6  # of the texture's width: what is nearer is no seam but rounding


@dataclass(frozen=True)
class TextureMap:
    """Places on a texture, 0..1, u to the right and v up, and who has them.

    points : (k, 2) float; a vertex has one place, or several where the map has a seam
    vertices : (k,) int32, the vertex at each place; the first n are the vertices in their order
    corners : (c,) int32, the place of each corner of the polygons
    """

    points: NDArray[np.floating]
    vertices: NDArray[np.int32]
    corners: NDArray[np.int32]

    @cached_property
    def uv(self) -> NDArray[np.floating]:
        """(c, 2) the place of each corner of the polygons."""
        return self.points[self.corners]

    def nearest(self, vertices: NDArray, points: NDArray) -> NDArray[np.int32]:
        """(k,) of the places that each of `vertices` (k,) has, that nearest to `points` (k, 2).

        For a coarser mesh of some of the vertices: a corner keeps to its side of a seam.
        """
        out = np.array(vertices, dtype=np.int32)
        best = np.abs(self.points[out] - points).sum(axis=1)
        n = int(self.vertices.max()) + 1
        left = np.arange(n, len(self.points))
        while len(left):  # one more place of each vertex a round
            own, first = np.unique(self.vertices[left], return_index=True)
            other = np.full(n, -1)
            other[own] = left[first]
            number = other[vertices]
            far = np.abs(self.points[number] - points).sum(axis=1)
            nearer = (number >= 0) & (far < best)
            out[nearer], best[nearer] = number[nearer], far[nearer]
            left = np.delete(left, first)
        return out


def texture_map(uv: NDArray, polygon_vertices: NDArray, n: int) -> TextureMap:
    """The map of n vertices whose polygons' corners (c,) lie at `uv` (c, 2)."""
    vertex = np.asarray(polygon_vertices, dtype=np.int64)
    points, owners, number = np.zeros((n, 2), uv.dtype), [np.arange(n)], vertex.astype(np.int32)
    found, first = np.unique(vertex, return_index=True)
    points[found] = uv[first]
    left = np.arange(len(vertex))
    while len(left := left[np.abs(uv[left] - points[number[left]]).max(axis=1) > SAME_PLACE]):
        found, first = np.unique(vertex[left], return_index=True)
        number[left] = len(points) + np.searchsorted(found, vertex[left])
        points = np.concatenate([points, uv[left[first]]])
        owners.append(found)
    return TextureMap(points, np.concatenate(owners).astype(np.int32), number)


def read_uv(arrays: Mapping[str, NDArray]) -> TextureMap:
    """The map of the asset's polygons."""
    polygon_vertices, seams = arrays["polygon_vertices"], arrays["uv_seams"]
    stored = arrays["uv_points"]
    points = stored.astype(np.float32) / np.iinfo(stored.dtype).max
    corners = np.array(polygon_vertices, dtype=np.int32)
    vertices = np.arange(len(points), dtype=np.int32)
    vertices[arrays["uv_seam_points"]] = corners[seams]
    corners[seams] = arrays["uv_seam_points"]
    return TextureMap(points, vertices, corners)
