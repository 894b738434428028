"""The fine mesh: the source's head given what it lacks, refined, with mouth and hairs on it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..anatomy import LANDMARK_POINTS, LOOK_DOWN, PART_NAMES
from ..common.ties import first_least
from ..rotation import rotation
from ..subdivide import Refined, refine, triangulate
from .brows import brows
from .bust import as_fine, cut_ring, levelled
from .creases import refinement_levels
from .ears import sculpted_ears
from .eyes import round_rows
from .lashes import lashes
from .levels import without_tips
from .makehuman import JOINTS, Source
from .mouth import Frames, mouth_parts
from .people import People
from .strands import Hairs, add_hairs, mirror_cage
from .uv import carried_uv, hair_uv

# Entries of the refinement below this are what is left where numbers cancel, 1e-15 and less, and
# which of them are exactly zero is up to the processor; the smallest that mean anything are 1e-10.
NOISE = 1e-12

GUIDES = ("teeth", "tongue", "lashes")  # parts of the source that only guide what stands for them
INSIDE = ("teeth", "gums", "tongue")  # the mouth's own parts


@dataclass(frozen=True)
class Mesh:
    """The fine mesh: vertices are `matrix` (n, m) times those of the cage.

    polygons : vertices of quads and triangles, flat, and the start of each;  part : (n,) uint8
    uv : (c, 2) where each of their corners lies on a texture
    """

    matrix: sp.csr_matrix
    polygons: tuple[NDArray, NDArray]
    part: NDArray
    uv: NDArray

    @property
    def triangles(self) -> NDArray[np.int32]:
        return triangulate(*self.polygons)

    @property
    def skin(self) -> NDArray[np.bool_]:
        return self.part == PART_NAMES.index("skin")


def sculpt(source: Source, people: People) -> None:
    """Give everybody, in place, what the source lacks: canals of the ears, an even cut."""
    m = source.size
    upright = rotation((0.0, LOOK_DOWN, 0.0)).T
    own = np.flatnonzero(source.is_part("skin"))
    points = (people.plain[:m] - people.plain[m + JOINTS.index("head")]) @ upright
    ring = cut_ring(points, source.quads[source.quad_part == PART_NAMES.index("skin")])
    moves = sculpted_ears(points) + levelled(points, ring)
    people.base[own] += moves[own] @ upright.T
    first = source.foot.shape[1]
    people.base[first:m] = source.foot @ people.base[:first]


def detailed_cage(source: Source, plain: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """The cage's quads (f, 4), how often each is subdivided (f,) where the plain face (M, 3) needs
    it, and their places on the texture (f, 4, 2); lash sheets only guide lashes."""
    level = refinement_levels(plain[: source.size], source.quads, source.quad_part)
    solid = ~np.isin(source.quad_part, [PART_NAMES.index(name) for name in GUIDES])
    quads = source.quads[solid]
    level = without_tips(level[solid], quads)
    skin = source.quad_part[solid] == PART_NAMES.index("skin")
    level = as_fine(level, plain[: source.size], quads, skin, source.foot.shape[1])
    return quads, level, source.quad_uv[solid]


def refined(
    source: Source, plain: NDArray, cage: tuple[NDArray, NDArray, NDArray]
) -> tuple[Mesh, Refined]:
    """The cage refined, see `detailed_cage`."""
    quads, level, quad_uv = cage
    solid = ~np.isin(source.quad_part, [PART_NAMES.index(name) for name in GUIDES])
    fine = refine(quads, source.size, level, mirror_cage(plain[: source.size]))
    part = np.zeros(fine.matrix.shape[0], dtype=np.uint8)
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    part[fine.polygon_vertices] = np.repeat(source.quad_part[solid][fine.source], sizes)
    polygons = fine.polygon_vertices, fine.polygon_starts
    uv = carried_uv(quad_uv, fine)
    return Mesh(round_rows(source, plain, fine.matrix, part), polygons, part, uv), fine


def with_parts(
    source: Source, plain: NDArray, mesh: Mesh, frames: Frames
) -> tuple[Mesh, tuple[NDArray, NDArray], tuple[Hairs, ...]]:
    """The mesh with teeth, gums and tongue, and with lashes and brows grown on it; the quads (k, 4)
    of the mouth's parts a step before and the places of their corners (k, 4, 2); the hairs."""
    m = source.size
    skin = mesh.triangles[mesh.skin[mesh.triangles[:, 0]]]
    hairs = (
        lashes(plain[:m], source.quads, source.quad_part, mesh.matrix, skin),
        brows(plain[:m], mesh.matrix, skin, plain[m + 2 : m + 4].mean(axis=0)),
    )
    coarse = []
    for part in mouth_parts(frames, m):
        coarse.append((len(mesh.part) + part.coarse, part.coarse_uv))
        mesh = grown(mesh, part.fine, part.uv)
    for hair in hairs:
        mesh = grown(mesh, hair, hair_uv(hair))
    mesh = replace(mesh, matrix=without_noise(mesh.matrix))
    quads, places = (np.concatenate(some) for some in zip(*coarse, strict=True))
    return mesh, (quads, places), hairs


def grown(mesh: Mesh, part: Hairs, uv: NDArray) -> Mesh:
    """The mesh with what is bound to the cage beside the skin; uv : (c, 2) of its corners."""
    more = add_hairs(mesh.matrix, mesh.polygons, mesh.part, part)
    return Mesh(*more, np.concatenate([mesh.uv, uv]))


def without_noise(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """The matrix without its entries below NOISE, each row in the order of its columns: alike on
    all processors."""
    kept = matrix.copy()
    kept.data[np.abs(kept.data) < NOISE] = 0
    kept.eliminate_zeros()
    kept.sort_indices()
    return kept


def follow_weights(source: Source, mesh: Mesh) -> NDArray[np.float64]:
    """(n, 2) how far each vertex follows head and neck; what is in the skull follows fully."""
    weights = np.round(np.clip(mesh.matrix @ source.skin_weights(), 0, 1), 5)
    weights[np.isin(mesh.part, [PART_NAMES.index(p) for p in ("eyes", *INSIDE)])] = 1
    return weights


def mirror_vertices(vertices: NDArray, part: NDArray) -> NDArray[np.int32]:
    """Index (n,) of each vertex's mirror image; raises ValueError if the mesh is not symmetric."""
    places = np.column_stack([vertices, part * 1.0])
    distance, index = cKDTree(places).query(places * [-1, 1, 1, 1])
    if distance.max() > 5e-4 or np.any(index[index] != np.arange(len(index))):
        raise ValueError(f"the mesh is not symmetric: a vertex is {distance.max():.2g} m off")
    return index.astype(np.int32)


def landmark_vertices(vertices, normals, part, eyes_middle) -> NDArray[np.int32]:
    """Vertex index of each landmark: the nearest to its place in the table, seen from the front."""
    out = []
    for part_name, point in LANDMARK_POINTS.values():
        candidates = np.flatnonzero((part == PART_NAMES.index(part_name)) & (normals[:, 2] > -0.2))
        place = np.array(point) * 0.01 + eyes_middle[: len(point)]
        offset = vertices[candidates, : len(point)] - place
        near = np.linalg.norm(offset, axis=1) - (
            0.3 * vertices[candidates, 2] if len(point) == 2 else 0
        )
        out.append(candidates[first_least(near)])
    return np.array(out, dtype=np.int32)
