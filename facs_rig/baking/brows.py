"""Brows as hairs: thin ribbons that lie on the skin between the brow's lower and upper edge.

They stand up at the inner end, turn outwards along the brow, and lie along it at the tail; those
from below slant up and those from above slant down, so that they meet along the brow's ridge.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..anatomy import BROW_LOWER, BROW_UPPER, PART_NAMES, bind_from_front, smooth_curve
from ..common.ties import ascending, first_least, nearest
from ..mesh import vertex_normals
from .strands import MM, Hairs, both_sides, head_axes, mirror_cage, rows_at

SEED = 21
COUNT, ROWS = 120, 5  # hairs of a brow, and the rows between its edges in which they grow
# Along the brow, from the nose outwards:
STOPS = (0.0, 0.10, 0.25, 0.5, 0.75, 1.0)
FROM_BELOW = (84.0, 74.0, 55.0, 33.0, 17.0, 6.0)  # degrees above the brow's own direction
FROM_ABOVE = (72.0, 48.0, 14.0, -7.0, -13.0, -6.0)
LENGTH = (4.6, 6.0, 8.0, 8.8, 7.5, 4.5)  # millimetres
WIDTH = 0.27  # millimetres at the root
OVER = 0.35  # millimetres that hairs may stand over the brow's edge
# A hair's sections: where along it, width as a share, millimetres above the skin.
SECTIONS = ((0.0, 1.0, 0.15), (0.4, 0.9, 0.45), (0.75, 0.6, 0.45))
TIP_LIFT = 0.35
# What people's brows can be (see `brow_details`): breadths as shares of the plain one; one hair of
# KEPT stays in the sparsest, and the others sink by BURIED metres into the skin.
THIN, THICK = 0.42, 1.85
KEPT, BURIED = 3, 0.0012
BUSHY = 0.9  # millimetres that tips of bushy hairs stand off
NEAR = 10  # vertices of hairs that the point of an edge is bound to three of

LIFT = MM * np.tile([*np.repeat([s[2] for s in SECTIONS], 2), TIP_LIFT], COUNT)


def brows(cage: NDArray, rows: sp.csr_matrix, triangles: NDArray, eyes_middle: NDArray) -> Hairs:
    """The hairs of both brows.

    cage : (m, 3) metres of the default face;  rows : sparse (n, m), the refined mesh;
    triangles : (t, 3) its skin;  eyes_middle : (3,) between the eyeballs' centres
    """
    skin = rows @ cage
    index, weight = _bound(hair_places(), skin, triangles, eyes_middle)
    normals = np.einsum("kc,kcd->kd", weight, vertex_normals(skin, triangles)[index])
    axes = head_axes(cage, np.unique(rows[np.unique(triangles)].indices))
    left = rows_at(rows, index, weight) + sp.csr_matrix(LIFT[:, None] * normals) @ axes
    flat, starts = _ribbons(COUNT, len(SECTIONS))
    hairs = both_sides(left.tocsr(), flat, starts, mirror_cage(cage), PART_NAMES.index("brows"))
    return replace(hairs, stands_on=_on_both_sides(index, weight, skin))


def hair_places() -> NDArray[np.float64]:
    """(COUNT * 7, 2) the vertices of the left brow's hairs, centimetres seen from the front."""
    rng = np.random.default_rng(SEED)
    return np.concatenate([_outline(*hair, rng) for hair in _roots(rng)])


def _bound(
    places: NDArray, skin: NDArray, triangles: NDArray, eyes_middle: NDArray
) -> tuple[NDArray, NDArray]:
    """Vertices and weights (k, 3) of the skin (n, 3) at places (k, 2) in centimetres."""
    allowed = np.zeros(len(skin), dtype=bool)
    allowed[triangles] = True
    return bind_from_front(0.01 * places + eyes_middle[:2], skin, triangles, allowed)


def brow_details(
    skin: NDArray, triangles: NDArray, eyes_middle: NDArray
) -> dict[str, NDArray[np.float64]]:
    """Name of a detail (see identity.DETAILS) -> (2 h, 3) metres that it moves both brows' hairs.

    skin : (n, 3) the default face without hairs, triangles : (t, 3) of it
    """
    places = hair_places()
    normals = vertex_normals(skin, triangles)

    def stand(places: NDArray, lift: NDArray) -> NDArray:
        index, weight = _bound(places, skin, triangles, eyes_middle)
        on, up = (np.einsum("kc,kcd->kd", weight, field[index]) for field in (skin, normals))
        return on + lift[:, None] * up

    rest = stand(places, LIFT)
    out = {}
    for name, (shaped, lift) in _shapes(places).items():
        left = stand(shaped, lift) - rest
        out[name] = np.concatenate([left, left * (-1, 1, 1)])
    return out


def _shapes(places: NDArray) -> dict[str, tuple[NDArray, NDArray]]:
    """Name of a detail -> places (k, 2) of hair vertices in centimetres, metres above the skin."""
    lower, upper = _edges()
    middle = (lower + upper) / 2
    along = np.array([first_least(np.abs(middle[:, 0] - x)) for x in places[:, 0]])
    axis, share = middle[along], along / 199
    hairs = places.reshape(COUNT, -1, 2)
    roots, centre = hairs[:, :2].mean(axis=1, keepdims=True), _middle_lines(hairs)
    rng = np.random.default_rng(SEED + 1)
    reach = np.array([*np.repeat([s[0] for s in SECTIONS], 2), 1.0])
    tip = np.clip((reach - 0.4) / 0.6, 0, 1)[None, :, None]  # bushes grow at their ends
    wild = rng.uniform(0.2, 1.0, (COUNT, 1, 1)) * tip
    stray = hairs + 0.25 * wild * (hairs - roots + [0.1, -0.05])
    fallen = np.arange(COUNT) % KEPT != 0
    sparse, sunk = hairs.copy(), LIFT.reshape(COUNT, -1).copy()
    sparse[fallen] = roots[fallen]
    sunk[fallen] = -BURIED
    bow = np.sin(np.pi * share**0.8)[:, None] - 0.75  # up at the peak, down at the ends
    tail = np.maximum(share - 0.35, 0)[:, None] * [1.0, -0.25]
    arch = bow * [0.0, 0.3]
    return {
        "brow thin": (axis + THIN * (places - axis), LIFT),
        "brow thick": (axis + THICK * (places - axis), LIFT),
        "brow sparse": (sparse.reshape(-1, 2), sunk.ravel()),
        "brow dense": ((centre + 2.0 * (hairs - centre)).reshape(-1, 2), LIFT),
        "brow bushy": (stray.reshape(-1, 2), LIFT + (wild[:, :, 0] * BUSHY * MM).ravel()),
        "brow straight": (places - arch, LIFT),
        "brow arched": (places + arch, LIFT),
        "brow short": (places - 0.9 * tail, LIFT),
        "brow long": (places + 0.7 * tail, LIFT),
    }


def _middle_lines(hairs: NDArray) -> NDArray[np.float64]:
    """(COUNT, 7, 2) the middle of each vertex's section; the tip is its own."""
    out = hairs.copy()
    for s in range(len(SECTIONS)):
        out[:, 2 * s : 2 * s + 2] = hairs[:, 2 * s : 2 * s + 2].mean(axis=1, keepdims=True)
    return out


def brow_edges(first: int) -> dict[str, tuple[NDArray, NDArray]]:
    """Lower and upper edge of each brow, bound to its hairs, so that they follow its shape:
    name -> vertices and weights (16, 3), for hairs from vertex `first` on.

    To the roots of hairs that never fall out: these do not stray, and lie close to the skin.
    """
    places = hair_places()
    per = len(places) // COUNT
    kept = np.flatnonzero((np.arange(COUNT) % KEPT == 0).repeat(per))
    roots = kept[kept % per < 2]
    out = {}
    for edge, points in (("lower", BROW_LOWER), ("upper", BROW_UPPER)):
        curve = smooth_curve(np.array(points), 16)
        found = [_triple(place, places, roots) for place in curve[:-1]]
        found.append(_triple(curve[-1], places, kept))  # no root lies as far out as the tail's end
        index, weight = (np.array(part) for part in zip(*found, strict=True))
        for k, side in enumerate(("left", "right")):
            out[f"brow_{edge}_{side}"] = first + k * len(places) + index, weight
    return out


def _triple(place: NDArray, places: NDArray, kept: NDArray) -> tuple[NDArray, NDArray]:
    """Three of the vertices `kept` near a place, and the weights that make them it."""
    near = kept[ascending(np.hypot(*(places[kept] - place).T))[:NEAR]]
    triples = np.array(list(combinations(near, 3)))
    a, b, c = (places[triples[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    weight = np.stack([np.cross(b - place, c - place), np.cross(c - place, a - place)], axis=1)
    weight = weight / np.where(np.abs(area) > 1e-4, area, np.inf)[:, None]
    weight = np.column_stack([weight, 1 - weight.sum(axis=1)])
    far = np.abs(weight).sum(axis=1) + 1e3 * (np.abs(area) <= 1e-4)
    best = first_least(far)
    return triples[best], weight[best]


def _on_both_sides(index: NDArray, weight: NDArray, skin: NDArray) -> sp.csr_matrix:
    """Rows (2 h, n) of the skin under hairs (h, 3) of the left and their mirror images."""
    mirrored = nearest(skin, skin * [-1, 1, 1])[index]
    rows = np.arange(2 * len(index)).repeat(3)
    columns = np.concatenate([index, mirrored]).ravel()
    return sp.csr_matrix((np.tile(weight.ravel(), 2), (rows, columns)), (2 * len(index), len(skin)))


def _edges() -> tuple[NDArray, NDArray]:
    """Lower and upper edge (200, 2) of the left brow, centimetres."""
    lower, upper = (smooth_curve(np.array(points), 200) for points in (BROW_LOWER, BROW_UPPER))
    return lower, upper


def _roots(rng: np.random.Generator) -> list[tuple[float, float]]:
    """(along, across) of each root, 0..1 from the nose outwards and from the lower edge up."""
    lower, upper = _edges()
    breadth = np.linalg.norm(upper - lower, axis=1) + 0.12
    share = np.concatenate([[0], np.cumsum(breadth[1:])])
    out = []
    for k in range(COUNT):
        row = k % ROWS
        at = (k + 0.5 + rng.uniform(-1.2, 1.2)) / COUNT
        along = float(np.interp(np.clip(at, 0, 1), share / share[-1], np.linspace(0, 1, 200)))
        across = (row + rng.uniform(0.1, 0.7)) / ROWS
        along = max(0.95 * along, 0.07 * (across - 0.3)) + rng.uniform(0, 0.012)  # a rounded end
        out.append((float(along), float(across)))
    return out


def _outline(along: float, across: float, rng: np.random.Generator) -> NDArray:
    """(7, 2) right and left side of each section of one hair and its tip, centimetres."""
    lower, upper = _edges()
    middle = (lower + upper) / 2
    k = int(along * 199)
    root = lower[k] + across * (upper[k] - lower[k])
    below, above = (np.interp(along, STOPS, a) for a in (FROM_BELOW, FROM_ABOVE))
    spread = 6 + 8 * max(0.0, 1 - 8 * along)
    slant = np.radians(below + across * (above - below) + rng.normal(0, spread))
    length = float(0.1 * np.interp(along, STOPS, LENGTH) * rng.uniform(0.8, 1.1))
    tangent = np.gradient(middle, axis=0)
    heading = np.arctan2(tangent[:, 1], tangent[:, 0])

    def path(length: float) -> tuple[NDArray, NDArray]:
        points, angles, place = [root], [], root
        for step in range(12):
            near = first_least(np.abs(middle[:, 0] - place[0]))
            angle = heading[near] + slant * (1.25 - 0.55 * step / 11)
            place = place + length / 12 * np.array([np.cos(angle), np.sin(angle)])
            points.append(place)
            angles.append(angle)
        return np.array(points), np.array([*angles, angles[-1]])

    points, angles = path(length)
    for _ in range(12):  # no longer than to the upper edge
        top = np.interp(points[-1, 0], upper[:, 0], upper[:, 1])
        bottom = np.interp(points[-1, 0], lower[:, 0], lower[:, 1])
        if bottom - 0.1 * OVER < points[-1, 1] < top + 0.1 * OVER:
            break
        length *= 0.9
        points, angles = path(length)
    out = []
    for at, width, _ in SECTIONS:
        step = round(at * 12)
        normal = np.array([-np.sin(angles[step]), np.cos(angles[step])])
        out += [points[step] - s * 0.05 * WIDTH * width * normal for s in (1, -1)]
    return np.array([*out, points[-1]])


def _ribbons(count: int, sections: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Polygons of hairs with sections of two vertices each (right, left) and a tip."""
    polygons = []
    for base in np.arange(count) * (2 * sections + 1):
        for s in range(sections):
            r, left = base + 2 * s, base + 2 * s + 1
            polygons.append([r, r + 2, left + 2, left] if s + 1 < sections else [r, left + 1, left])
    starts = np.concatenate([[0], np.cumsum([len(p) for p in polygons])[:-1]])
    return np.array([v for p in polygons for v in p]), starts


def brow_lines(first: int) -> list[tuple[NDArray, NDArray]]:
    """Indices and weights (k, 3) of every hair's middle line, for hairs from vertex `first` on."""
    out = []
    for base in first + np.arange(2 * COUNT) * (2 * len(SECTIONS) + 1):
        sides = base + 2 * np.arange(len(SECTIONS))
        tip = base + 2 * len(SECTIONS)
        index = np.array([*((r, r + 1, r) for r in sides), (tip, tip, tip)])
        out.append((index, np.tile([0.5, 0.5, 0.0], (len(index), 1))))
    return out
