"""Hairs of the face as thin tapered blades: what lashes and brows share.

A hair's vertices are rows over the cage's vertices that sum to one, like the rows of the refined
skin, so that every control, helper and identity moves hairs without a word about hair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..common.ties import ascending, first_least

MM = 1e-3


@dataclass(frozen=True)
class Hairs:
    """matrix : sparse (h, cage) rows of the hairs' vertices
    polygon_vertices, polygon_starts : of hair vertices, flat, with the start of each
    part : index into PART_NAMES
    stands_on : sparse (h, n) rows of the refined vertices under each that creases move, or None
    """

    matrix: sp.csr_matrix
    polygon_vertices: NDArray[np.int64]
    polygon_starts: NDArray[np.int64]
    part: int
    stands_on: sp.csr_matrix | None = None


def both_sides(left: sp.csr_matrix, flat, starts, mirror: NDArray, part: int) -> Hairs:
    """Hairs of the face's left and their mirror image."""
    sizes = np.diff(np.append(starts, len(flat)))
    turned = np.concatenate([flat[a : a + n][::-1] for a, n in zip(starts, sizes, strict=True)])
    right = left[:, mirror]
    return Hairs(
        sp.vstack([left, right]).tocsr(),
        np.concatenate([flat, turned + left.shape[0]]),
        np.concatenate([starts, starts + len(flat)]),
        part,
    )


def mirror_cage(cage: NDArray) -> NDArray[np.int64]:
    """(m,) each cage vertex's mirror image; ValueError if the cage is not symmetric."""
    distance, index = cKDTree(cage).query(cage * [-1, 1, 1])
    twice = index[index] != np.arange(len(cage))
    if distance.max() > 1e-3 or twice.any():
        raise ValueError(f"the cage is not symmetric: a vertex is {distance.max():.2g} m off")
    return index


def tubes(rings: list[tuple[int, int]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Polygons of blades with (rings, corners) each: quads between rings, then a pointed tip."""
    polygons, base = [], 0
    for count, corners in rings:
        for r in range(count):
            for c in range(corners):
                a, b = base + r * corners + c, base + r * corners + (c + 1) % corners
                if r + 1 < count:
                    polygons.append([a, b, b + corners, a + corners])
                else:
                    polygons.append([a, b, base + count * corners])
        base += count * corners + 1
    starts = np.concatenate([[0], np.cumsum([len(p) for p in polygons])[:-1]])
    return np.array([v for p in polygons for v in p]), starts


def scale_to_one(rows: sp.spmatrix, cage: NDArray) -> sp.csr_matrix:
    """Rows that give vectors, scaled so that these have length one on the default face."""
    return sp.diags(1 / np.linalg.norm(rows @ cage, axis=1)) @ rows


def rows_at(rows: sp.csr_matrix, index: NDArray, weight: NDArray) -> sp.csr_matrix:
    """Rows (k, m) of surface points: weights (k, 3) of the vertices `index` (k, 3)."""
    return sum(sp.diags(weight[:, c]) @ rows[index[:, c]] for c in range(index.shape[1])).tocsr()


def closest_on_skin(
    points: NDArray, skin: NDArray, triangles: NDArray, near: int = 24
) -> tuple[NDArray, NDArray, NDArray]:
    """Closest surface points: vertex indices (k, 3), weights (k, 3), places (k, 3).

    Looks at the `near` triangles whose centres are nearest.
    """
    from trimesh.triangles import closest_point, points_to_barycentric

    tree = cKDTree(skin[triangles].mean(axis=1))
    candidates = np.sort(tree.query(points, near)[1], axis=1)
    corner = skin[triangles[candidates.ravel()]]
    found = closest_point(corner, np.repeat(points, near, axis=0)).reshape(len(points), near, 3)
    best = first_least(np.linalg.norm(found - points[:, None], axis=2), axis=1)
    k = np.arange(len(points))
    owner, place = candidates[k, best], found[k, best]
    weight = np.clip(points_to_barycentric(skin[triangles[owner]], place), 0, 1)
    return triangles[owner], weight / weight.sum(axis=1, keepdims=True), place


def add_hairs(
    matrix: sp.csr_matrix, polygons: tuple[NDArray, NDArray], vertex_part: NDArray, hairs: Hairs
) -> tuple[sp.csr_matrix, tuple[NDArray[np.int32], NDArray[np.int32]], NDArray[np.uint8]]:
    """The refined mesh (matrix, flat polygons with their starts, parts) with hairs behind it."""
    n, flat = matrix.shape[0], polygons[0]
    return (
        sp.vstack([matrix, hairs.matrix]).tocsr(),
        (
            np.concatenate([flat, hairs.polygon_vertices + n]).astype(np.int32),
            np.concatenate([polygons[1], hairs.polygon_starts + len(flat)]).astype(np.int32),
        ),
        np.append(vertex_part, np.full(hairs.matrix.shape[0], hairs.part)).astype(np.uint8),
    )


def carry_hairs(displacements: NDArray, hairs: Sequence[Hairs]) -> None:
    """Move hairs with what they stand on, in place.

    displacements : (n, 3) of the refined mesh with the `hairs` behind it, in their order
    """
    first = len(displacements) - sum(hair.matrix.shape[0] for hair in hairs)
    for hair in hairs:
        last = first + hair.matrix.shape[0]
        if hair.stands_on is not None:
            displacements[first:last] = hair.stands_on @ displacements[: hair.stands_on.shape[1]]
        first = last


def head_axes(cage: NDArray, skin: NDArray) -> sp.csr_matrix:
    """Rows (3, m) that sum to zero and give the axes x, y and z on the default face.

    They are made of far points of the skull that no expression moves, so that a vector of a
    millimetre stays one, and grows and turns with the head. skin : the cage's skin vertices.
    """
    upper = skin[cage[skin, 1] > cage[skin, 1].max() - 0.09]  # above the ears
    groups = [upper[ascending(-cage[upper] @ way)[:6]]
              for way in np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1)])]  # fmt: skip
    points = sp.vstack([mean_row(group, len(cage)) for group in groups])
    solve = np.linalg.inv(np.column_stack([points @ cage, np.ones(4)]))
    return sp.csr_matrix(solve[:3]) @ points


def mean_row(vertices: NDArray, m: int) -> sp.csr_matrix:
    """(1, m) row of the vertices' mean."""
    k = len(vertices)
    return sp.csr_matrix((np.full(k, 1 / k), (np.zeros(k, dtype=int), vertices)), shape=(1, m))
