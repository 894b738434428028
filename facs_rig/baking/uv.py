"""Where the head lies on a texture: the source's own map, carried through cropping and refinement.

It is the map of MakeHuman's base mesh, so skins that are painted for it fit. Inside a quad of the
cage it is bilinear, so that no island can come to lie on another, and a texture fits the face at
every level of detail. Hairs have strips of their own: along a hair from root to tip, all hairs of a
part on top of each other.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import breadth_first_order, connected_components

from ..anatomy import PART_NAMES
from ..subdivide import Refined
from ..uv import texture_map
from .strands import Hairs

# Free of skin on the map: (left, bottom), (width, height) of the strip that hairs share.
STRIPS = {
    PART_NAMES.index("lashes"): ((0.02, 0.70), (0.04, 0.20)),
    PART_NAMES.index("brows"): ((0.08, 0.70), (0.04, 0.20)),
}
STEPS = 65535  # of the stored places across the texture


def carried_uv(quad_uv: NDArray, fine: Refined) -> NDArray[np.float64]:
    """(c, 2) place on the texture of each corner of the refined polygons; quad_uv : (f, 4, 2)."""
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    corners = quad_uv[np.repeat(fine.source, sizes)]
    s, t = fine.places[:, :1], fine.places[:, 1:]
    below = corners[:, 0] + s * (corners[:, 1] - corners[:, 0])
    above = corners[:, 3] + s * (corners[:, 2] - corners[:, 3])
    return below + t * (above - below)


def hair_uv(hairs: Hairs) -> NDArray[np.float64]:
    """(c, 2) place on the texture of each corner of the hairs: across, and along to the tip.

    A hair's tip is the last of its vertices, and all that is as many edges from it goes across.
    """
    flat, starts = hairs.polygon_vertices, hairs.polygon_starts
    n = hairs.matrix.shape[0]
    after = np.arange(1, len(flat) + 1)
    after[np.append(starts[1:], len(flat)) - 1] = starts
    edges = sp.csr_matrix((np.ones(len(flat)), (flat, flat[after])), shape=(n, n))
    count, hair = connected_components(edges, directed=False)
    tips = np.zeros(count, dtype=int)
    np.maximum.at(tips, hair, np.arange(n))
    tip = sp.csr_matrix((np.ones(count), (np.full(count, n), tips)), shape=(n + 1, n + 1))
    edges.resize((n + 1, n + 1))
    order, before = breadth_first_order(edges + tip, n, directed=False)
    steps = np.zeros(n + 1)
    for vertex in order[1:]:
        steps[vertex] = steps[before[vertex]] + 1
    steps = steps[:n] - 1
    longest = np.zeros(count)
    np.maximum.at(longest, hair, steps)
    section = np.lexsort((np.arange(n), steps, hair))
    first = np.ones(n, dtype=bool)
    first[1:] = (np.diff(hair[section]) != 0) | (np.diff(steps[section]) != 0)
    run = np.cumsum(first) - 1
    width = np.bincount(run)
    rank = np.empty(n)
    rank[section] = np.where(
        width[run] > 1,
        (np.arange(n) - np.flatnonzero(first)[run]) / np.maximum(width[run] - 1, 1),
        0.5,
    )
    corner, size = (np.array(part) for part in STRIPS[hairs.part])
    places = np.stack([rank, 1 - steps / longest[hair]], axis=1)
    return (corner + size * places)[flat]


def uv_arrays(uv: NDArray, polygon_vertices: NDArray, n: int) -> dict[str, NDArray]:
    """What of the corners' places (c, 2) on n vertices the asset keeps, for `facs_rig.uv.read_uv`.

    Every vertex has a place; corners at seams have others, behind them.
    """
    texture = texture_map(uv, polygon_vertices, n)
    seams = np.flatnonzero(texture.corners != polygon_vertices)
    return {
        "uv_points": np.round(texture.points * STEPS).astype(np.uint16),
        "uv_seams": seams.astype(np.int32),
        "uv_seam_points": texture.corners[seams],
    }
