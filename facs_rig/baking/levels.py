"""Levels of detail: which of the fine face's vertices the lighter ones keep, and their polygons.

A level's polygons are given by their corners' places on the texture (see facs_rig.uv), which say
what the vertices are, too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from ..anatomy import HAIR_PARTS, PART_NAMES
from ..common.ties import ascending, first_least, first_most
from ..subdivide import Refined, refine, sides_of
from ..uv import TextureMap
from .collapse import collapse
from .uv import carried_uv

ACROSS = 1e-6  # metres from the middle at which a quad lies across it
GAME_QUADS = 2940  # without hairs
# How much a metre of error matters in games: where keys move the skin by so much, around eyes and
# mouth within these distances in metres, and where little is seen of it.
MOVING, MOST_MOVING = 3.0, 0.006
EYES, EYES_WITHIN = 5.0, 0.022
LIPS, LIPS_WITHIN = 2.5, 0.030
LITTLE = {"teeth": 0.4, "tongue": 0.3, "gums": 0.05, "bust": 0.02}
SHOWN = 0.02  # metres behind the foremost tooth; what is farther back, games leave out
# Skin that looks at an eyeball or the teeth and is as near: the sockets, and the mouth's cavity.
SOCKET, CAVITY, INWARD = 0.025, 0.06, 0.5
HIDDEN, IN_MOUTH, MOST = 0.02, 0.15, 100.0
CARDS = {"lashes": 8, "brows": 10}  # of a lid's lashes, of a brow


def level_arrays(
    source: tuple[NDArray, NDArray, NDArray],
    mirror: NDArray,
    fine: Refined,
    coarse: tuple[NDArray, NDArray],
    polygons: tuple[NDArray, NDArray],
    texture: TextureMap,
    face: tuple[NDArray, NDArray, NDArray, NDArray, NDArray],
) -> dict[str, NDArray]:
    """What the asset keeps of the levels `medium` and `game`.

    source : quads (f, 4) of the cage, level (f,) of each, places (f, 4, 2) of their corners
    mirror : (m,) of the cage      fine : its refinement
    coarse : quads (k, 4) of what else is solid, before its refinement, and places of their corners
    polygons, texture : of the whole mesh, hairs behind the refinement
    face : vertices (n, 3) in metres, part, mirror, how far keys move each, (n,), and
    its normal (n, 3)
    """
    quads, level, quad_uv = source
    hairs = list(_hairs(polygons, face[1]))
    few = refine(quads, len(mirror), without_tips(np.maximum(level - 1, 0), quads), mirror)
    at = np.searchsorted(fine.number, few.number[few.polygon_vertices]).astype(np.int32)
    medium = texture.nearest(at, carried_uv(quad_uv, few)).reshape(-1, 4)
    others = texture.nearest(coarse[0].ravel(), coarse[1].reshape(-1, 2)).reshape(-1, 4)
    medium = np.concatenate([medium, others])
    cage = np.searchsorted(fine.number, quads).astype(np.int32)
    corners = texture.nearest(cage.ravel(), quad_uv.reshape(-1, 2)).reshape(-1, 4)
    corners = np.concatenate([corners, _shown(others, texture, face[0], face[1])])
    game = _game_quads(corners, texture, *face)
    blades = [polygon for hair in hairs for polygon in hair.blade()]
    return {
        **_arrays("medium", [*medium.tolist(), *_facing(blades, face[0])]),
        **_arrays("game", [*game.tolist(), *_cards(hairs, *face[:3])]),
    }


def _shown(
    corners: NDArray, texture: TextureMap, vertices: NDArray, part: NDArray
) -> NDArray[np.int32]:
    """Those of the quads (k, 4), by their corners' places, that are not of a molar."""
    quads = texture.vertices[corners]
    n = len(vertices)
    joined = sp.csr_matrix(
        (np.ones(quads.size), (quads.ravel(), np.roll(quads, 1, axis=1).ravel())), shape=(n, n)
    )
    piece = connected_components(joined, directed=False)[1][quads[:, 0]]
    depth = np.bincount(piece, vertices[quads, 2].mean(axis=1)) / np.maximum(np.bincount(piece), 1)
    teeth = part[quads[:, 0]] == PART_NAMES.index("teeth")
    return corners[~teeth | (depth[piece] > vertices[quads[teeth], 2].max() - SHOWN)]


def _arrays(name: str, polygons: list[list[int]]) -> dict[str, NDArray]:
    starts = np.cumsum([0] + [len(polygon) for polygon in polygons[:-1]])
    corners = [corner for polygon in polygons for corner in polygon]
    return {
        f"level_{name}_corners": np.array(corners, dtype=np.int32),
        f"level_{name}_starts": starts.astype(np.int32),
    }


# --- skin, eyes, teeth and tongue -----------------------------------------------------------------


def without_tips(level: NDArray, quads: NDArray) -> NDArray[np.int64]:
    """Levels of quads, lowered while a quad has three neighbours that are coarser than itself.

    Such a quad adds more polygons around it, for coarse and fine to meet, than it has itself.
    """
    edge = sides_of(quads)[1]
    order = np.argsort(edge, axis=None, kind="stable")
    last = np.cumsum(np.bincount(edge.ravel())) - 1
    first = np.append(0, last[:-1] + 1)
    pair = np.stack([order[first], order[last]])[:, edge] // 4  # a quad at a rim stands for both
    beside = pair.sum(axis=0) - np.arange(len(quads))[:, None]
    rim = beside == np.arange(len(quads))[:, None]
    while True:
        as_fine = (level[beside] >= level[:, None]) & ~rim
        tips = (as_fine.sum(axis=1) <= 1) & (level > 0)
        if not tips.any():
            return level
        level = level - tips


def _game_quads(
    corners: NDArray,
    texture: TextureMap,
    vertices: NDArray,
    part: NDArray,
    mirror: NDArray,
    moving: NDArray,
    normals: NDArray,
) -> NDArray[np.int64]:
    """(GAME_QUADS, 4) corners of the cage's quads (f, 4), thinned out on the left and mirrored."""
    owner = texture.vertices
    quads = owner[corners]
    middle = vertices[quads][:, :, 0].mean(axis=1)
    left, image = np.flatnonzero(middle > ACROSS), mirror[quads]
    # Each place on the left, and the one that its mirror image has.
    ordered = np.sort(quads, axis=1)
    sides = np.concatenate([ordered, np.sort(image[left], axis=1)])
    number = np.unique(sides, axis=0, return_inverse=True)[1].ravel()
    quad_of = np.empty(number.max() + 1, dtype=int)
    quad_of[number[: len(quads)]] = np.arange(len(quads))
    other = quad_of[number[len(quads) :]]
    across = np.zeros(len(owner), dtype=np.int64)
    for k in range(4):
        same = quads[other] == image[left][:, k : k + 1]
        across[corners[left, k]] = corners[other][same]
    weight = _weights(vertices, part, moving, normals)[owner]
    across_middle = corners[np.abs(middle) <= ACROSS]  # these stay
    count = (GAME_QUADS - len(across_middle)) // 2
    kept = collapse(vertices[owner], texture.points, owner, corners[left], count, weight)
    return np.concatenate([across_middle, kept, across[kept][:, [0, 3, 2, 1]]])


def _weights(
    vertices: NDArray, part: NDArray, moving: NDArray, normals: NDArray
) -> NDArray[np.float64]:
    """(n,) how much a metre of error matters at a vertex."""
    skin, eyes, teeth = (part == PART_NAMES.index(name) for name in ("skin", "eyes", "teeth"))
    balls = [vertices[eyes & (sign * vertices[:, 0] > 0)].mean(axis=0) for sign in (1, -1)]
    from_eye = np.min([np.linalg.norm(vertices - ball, axis=1) for ball in balls], axis=0)
    lips = vertices[teeth].mean(axis=0)
    lips[2] = vertices[teeth, 2].max() + 0.005
    from_lips = np.linalg.norm((vertices - lips) / [1.3, 1, 1], axis=1)
    out = 1 + MOVING * np.minimum(moving / MOST_MOVING, 1)
    out *= 1 + EYES * np.exp(-((from_eye / EYES_WITHIN) ** 2))
    out *= 1 + LIPS * np.exp(-((from_lips / LIPS_WITHIN) ** 2))
    for name, share in LITTLE.items():
        out[part == PART_NAMES.index(name)] = share
    for centre, reach, share in ((balls[0], SOCKET, HIDDEN), (balls[1], SOCKET, HIDDEN),
                                 (vertices[teeth].mean(axis=0), CAVITY, IN_MOUTH)):  # fmt: skip
        toward = centre - vertices
        away = np.linalg.norm(toward, axis=1)
        out[skin & (away < reach) & ((normals * toward).sum(axis=1) > INWARD * away)] = share
    out[eyes] = MOST
    return out


# --- hairs ----------------------------------------------------------------------------------------


class _Hair:
    """One blade. vertices : section after section of `width` vertices, the tip behind them"""

    def __init__(self, vertices: NDArray, width: int, part: int) -> None:
        self.part, self.tip = part, int(vertices[-1])
        self.sections = vertices[:-1].reshape(-1, width)[:, [0, width // 2]].tolist()

    @property
    def root(self) -> int:
        return int(self.sections[0][0])

    def blade(self) -> list[list[int]]:
        """A flat one of two polygons at most: its root, its middle if it has one, and its tip."""
        (a, b), *rest = self.sections
        if len(rest) < 3:
            return [[a, self.tip, b]]
        c, d = rest[len(rest) // 2]
        return [[a, c, d, b], [c, self.tip, d]]


def _hairs(polygons: tuple[NDArray, NDArray], part: NDArray) -> Iterator[_Hair]:
    """The hairs of a mesh, in their order."""
    flat, starts = polygons
    after = np.arange(1, len(flat) + 1)
    after[np.append(starts[1:], len(flat)) - 1] = starts
    n = len(part)
    joined = sp.csr_matrix((np.ones(len(flat)), (flat, flat[after])), shape=(n, n))
    label = connected_components(joined, directed=False)[1]
    hairy = np.flatnonzero(np.isin(part, [PART_NAMES.index(name) for name in HAIR_PARTS]))
    ends = np.flatnonzero(np.diff(label[hairy])) + 1
    sizes = np.diff(np.append(starts, len(flat)))
    tips = np.bincount(flat[starts[sizes == 3][:, None] + np.arange(3)].ravel(), minlength=n)
    for vertices in np.split(hairy, ends):
        yield _Hair(vertices, max(2, int(tips[vertices[-1]])), int(part[vertices[0]]))


def _cards(hairs: list[_Hair], vertices: NDArray, part: NDArray, mirror: NDArray):
    """Lashes and brows as strips of a few quads, from roots to tips; left, then mirrored."""
    out = []
    lashes, brows = (
        [h for h in hairs if h.part == PART_NAMES.index(name) and vertices[h.root, 0] > 0]
        for name in ("lashes", "brows")
    )
    rises = vertices[[h.tip for h in lashes], 1] > vertices[[h.root for h in lashes], 1]
    eye = vertices[[h.root for h in lashes], 1].mean()
    upper = np.array([vertices[h.root, 1] > eye if up == down else up
                      for h, up, down in zip(lashes, rises, ~rises, strict=True)])  # fmt: skip
    for lid in (upper, ~upper):
        own = [h for h, mine in zip(lashes, lid, strict=True) if mine]
        order = ascending(vertices[[h.root for h in own], 0])
        picked = order[np.linspace(0, len(order) - 1, CARDS["lashes"] + 1).round().astype(int)]
        row = [own[k] for k in picked]
        out += [[a.root, b.root, b.tip, a.tip] for a, b in zip(row, row[1:], strict=False)]
    # Where hairs stand off the skin most, so that the strip does not sink into it.
    ends = np.array([v for h in brows for v in (h.tip, *sum(h.sections[1:], []))])
    x, y = vertices[ends, :2].T
    stations = np.linspace(x.min(), x.max(), CARDS["brows"] + 1)
    reach = (stations[1] - stations[0]) / 2
    edges = []
    for station in stations:
        near = ends[np.abs(x - station) <= reach]
        height = vertices[near, 1]
        edges.append((int(near[first_least(height)]), int(near[first_most(height)])))
    out += [[a, c, d, b] for (a, b), (c, d) in zip(edges, edges[1:], strict=False)]
    out = _facing(out, vertices)
    return [*out, *(mirror[polygon][::-1].tolist() for polygon in out)]


def _facing(polygons: list[list[int]], vertices: NDArray) -> list[list[int]]:
    """Polygons, turned where needed so that they are seen from the front."""
    x, y, _ = vertices.T
    out = []
    for polygon in polygons:
        after = [*polygon[1:], polygon[0]]
        area = (x[polygon] * y[after] - x[after] * y[polygon]).sum()
        out.append(polygon if area > 0 else polygon[::-1])
    return out
