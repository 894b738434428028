"""The face with about a quarter of its triangles, for what does not need its finest shape.

Subdivision gives new vertices higher numbers than those between which they stand. So a vertex that
has a neighbour of a lower number merges into it, and what is left is the mesh of one step before,
closed wherever the fine one is. Vertices of the cage stay, and those that carry strokes; all stay
where the fine face has them.
"""

from __future__ import annotations

import copy
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .anatomy import HAIR_PARTS, PART_NAMES
from .common.derived import derived, forget
from .rig import FaceRig


@derived
def coarse_rig(rig: FaceRig) -> FaceRig:
    """The same face with fewer vertices and about a quarter of the triangles, without hairs.

    It takes the same parameters; its vertices lie where this one has them, and its landmarks and
    strokes are the same. There is nothing to mirror and no other curve on it.
    """
    matrix, part = rig._matrix, rig.vertex_part
    carriers = [index[weight != 0] for index, weight in rig.strokes.values()]
    polygons = rig.polygon_vertices, rig.polygon_starts
    fine = merged(polygons, rig.triangles, part, matrix, np.concatenate(carriers))
    at = np.unique(np.concatenate([fine.ravel(), rig.landmarks, *carriers]))
    number = np.zeros(rig.n_vertices, dtype=np.int32)
    number[at] = np.arange(len(at))

    new = copy.copy(rig)
    cached = {name for name, value in vars(type(rig)).items() if isinstance(value, cached_property)}
    for name in cached & set(vars(new)):
        delattr(new, name)
    forget(new)
    skin_at = rig.motions.skin_at
    kept = np.isin(skin_at, at)
    new.motions = rig.motions.at_skin(kept, number[skin_at[kept]].astype(np.intp))
    new._matrix, new.n_vertices = matrix[at], len(at)
    new.triangles = number[fine]
    new.polygon_vertices = new.triangles.ravel()
    new.polygon_starts = np.arange(0, new.triangles.size, 3, dtype=np.int32)
    new.vertex_part, new.landmarks = part[at], number[rig.landmarks]
    new.mirror, new.curves = np.arange(len(at), dtype=np.int32), {}
    del new.texture  # nobody paints on it
    new.strokes = {name: (number[index], w) for name, (index, w) in rig.strokes.items()}
    new.place(rig.weights[at])
    return new


def merged(
    polygons: tuple[NDArray, NDArray],
    triangles: NDArray,
    part: NDArray,
    matrix: sp.csr_matrix,
    kept: NDArray,
) -> NDArray[np.intp]:
    """The triangles (s, 3) of the coarse mesh, by the numbers of the fine one's vertices.

    polygons : flat, with the start of each      triangles : (t, 3), made of them
    part : (n,) index into PART_NAMES; hairs are left out      matrix : (n, m) refinement
    kept : (k,) vertices that stay
    """
    into = _lowest_neighbours(*polygons, len(part))
    caged = _of_cage(matrix)
    into[:caged] = np.arange(caged)
    into[kept] = kept
    while (into[into] != into).any():
        into = into[into]
    hair = [PART_NAMES.index(name) for name in HAIR_PARTS]
    found = into[triangles[~np.isin(part[triangles[:, 0]], hair)]]
    a, b, c = found.T
    return found[(a != b) & (b != c) & (c != a)]


def _lowest_neighbours(flat: NDArray, starts: NDArray, count: int) -> NDArray[np.intp]:
    """For each vertex the lowest number among itself and those that an edge joins to it."""
    after = np.arange(1, len(flat) + 1)
    after[np.append(starts[1:], len(flat)) - 1] = starts
    ends = np.sort(np.stack([flat, flat[after]]), axis=0)
    order = np.argsort(-ends[0], kind="stable")  # the lowest is written last
    out = np.arange(count)
    out[ends[1][order]] = ends[0][order]
    return out


def _of_cage(matrix: sp.csr_matrix) -> int:
    """How many vertices the cage itself has in the fine mesh: those that come first.

    Each follows a vertex of the cage most, the next one a later of them; with the first point of an
    edge that begins anew.
    """
    rows = matrix[: matrix.shape[1]]
    most = np.maximum.reduceat(rows.data, rows.indptr[:-1])
    row = np.repeat(np.arange(len(most)), np.diff(rows.indptr))
    top = np.flatnonzero(rows.data == most[row])
    first = rows.indices[top[np.searchsorted(row[top], np.arange(len(most)))]]
    return 1 + int(np.argmax(np.diff(first) <= 0))
