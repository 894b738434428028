"""Lashes: blades that grow from the edge of the lids' skin.

They leave it in the directions of the source's lash sheets (a grid from root to tip along each
lid), which are dropped, and turn with the lids as the sheets do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..anatomy import PART_NAMES
from ..common.polylines import arc_lengths
from ..common.ties import ascending
from ..mesh import vertex_normals
from .strands import (
    MM,
    Hairs,
    both_sides,
    closest_on_skin,
    mean_row,
    mirror_cage,
    rows_at,
    scale_to_one,
    tubes,
)

SEED = 20
SECTIONS = 3  # of a lash between root and tip, with three corners each


@dataclass(frozen=True)
class LashRow:
    """Lashes of one lid; lengths and widths in millimetres, along the lid from nose to temple.

    span : shares of the lid between which lashes grow
    length, lean : at the inner end, a third, two thirds and the outer end; lean is the sideways
    run of a lash as a share of its length
    reach : share of the length that goes straight off the lid before the lash bends
    curl : how far it goes on bending where the sheet ends
    droop : how far the tip goes down for each metre that the eye closes, beside turning
    width, line : thickness of a lash and of the dark line in which they grow
    """

    count: int
    span: tuple[float, float]
    length: tuple[float, float, float, float]
    lean: tuple[float, float, float, float]
    reach: float
    curl: float
    droop: float
    width: float
    line: float


UPPER = LashRow(
    46, (0.04, 0.985), (2.8, 6.0, 7.6, 6.0), (-0.40, -0.05, 0.30, 0.75), 0.45, 0.4, 0.34, 0.34, 0.45
)
LOWER = LashRow(
    26, (0.16, 0.97), (1.5, 2.5, 3.4, 3.0), (-0.25, 0.00, 0.25, 0.60), 0.50, 0.0, 0.0, 0.24, 0.0
)
STOPS = (0.0, 0.35, 0.7, 1.0)
EDGE_FACES = 0.55  # z of the skin's normal where lashes grow
STEADY = (0.3, 0.6)  # beyond these shares of the lid, lashes turn as they do there


def lashes(
    cage: NDArray, quads: NDArray, part: NDArray, skin_rows: sp.csr_matrix, triangles: NDArray
) -> Hairs:
    """The lashes of all four lids.

    cage : (m, 3) metres of the default face;  quads : (f, 4), part : (f,) of the cage;
    skin_rows : sparse (n, m), triangles : (t, 3) into its rows, the refined skin.
    """
    sheets = _sheets(quads[part == PART_NAMES.index("lashes")], cage)
    ball = np.unique(quads[part == PART_NAMES.index("eyes")])
    ball = ball[cage[ball, 0] > 0]
    lids = Lids(cage, skin_rows, triangles, ball)
    rng = np.random.default_rng(SEED)
    rows, rings = [], []
    for sheet, row in zip(sheets, (LOWER, UPPER), strict=True):
        lid, blades = _lash_rows(sheet, row, lids, rng)
        rows.append(lid)
        rings += blades
    left = sp.vstack(rows).tocsr()
    flat, starts = tubes(rings)
    return both_sides(left, flat, starts, mirror_cage(cage), PART_NAMES.index("lashes"))


def lash_lines(first: int) -> tuple[list, list, list]:
    """Lines for drawing, for lashes from vertex `first` on, each with indices and weights (k, 3):
    the upper lids' edges, the upper lashes, the lower lashes."""
    edges: list[tuple[NDArray, NDArray]] = []
    uppers: list[tuple[NDArray, NDArray]] = []
    lowers: list[tuple[NDArray, NDArray]] = []
    base = first
    for _ in range(2):
        for row, lines in ((LOWER, lowers), (UPPER, uppers)):
            for _ in range(row.count):
                lines.append(_middle_line(base, SECTIONS))
                base += 3 * SECTIONS + 1
            if row.line:
                edges.append(_middle_line(base, row.count))
                base += 3 * row.count + 1
    return edges, uppers, lowers


def _middle_line(base: int, sections: int) -> tuple[NDArray, NDArray]:
    corners = base + np.arange(3 * sections).reshape(-1, 3)
    index = np.concatenate([corners, np.full((1, 3), base + 3 * sections)])
    return index, np.full(index.shape, 1 / 3)


class Lids:
    """What lashes grow on: the cage (m, 3), the refined skin as rows over it, the left eyeball.

    `closing` gives rows of vectors that are zero on the default face, and go down by how far the
    eye closes: the opening between the lids against the height of the ball.
    """

    def __init__(self, cage: NDArray, rows: sp.csr_matrix, triangles: NDArray, ball: NDArray):
        self.cage, self.rows, self.triangles = cage, rows, triangles
        self.skin = rows @ cage
        self.normals = vertex_normals(self.skin, triangles)
        down = ball[ascending(-cage[ball, 1])]
        self.height = mean_row(down[:8], len(cage)) - mean_row(down[-8:], len(cage))
        self.edges: list[sp.csr_matrix] = []  # middle of the lower lid's edge, then the upper's

    def closing(self, count: int) -> sp.csr_matrix:
        opening = self.edges[1] - self.edges[0]
        share = (opening @ self.cage)[0, 1] / (self.height @ self.cage)[0, 1]
        return sp.csr_matrix(np.ones((count, 1))) @ (opening - share * self.height)


# --- the sheets ---


def _sheets(quads: NDArray, cage: NDArray) -> list[NDArray]:
    """Lower and upper lash sheet of the face's left as grids (along the lid, root to tip).

    Along the lid vertices go from the nose outwards.
    """
    left = quads[(cage[quads][:, :, 0] > 0).all(axis=1)]
    grids = []
    while len(left):
        members = {int(left[0, 0])}
        while True:
            touching = np.isin(left, list(members)).any(axis=1)
            more = set(left[touching].ravel().tolist())
            if more == members:
                break
            members = more
        grids.append(_grid(left[touching], cage))
        left = left[~touching]
    return sorted(grids, key=lambda grid: cage[grid][:, :, 1].mean())


def _grid(quads: NDArray, cage: NDArray) -> NDArray[np.int64]:
    """Vertices of a rectangular sheet of quads as (along, across), see `_sheets`."""
    vertex, uses = np.unique(quads, return_counts=True)
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    rim: dict[int, list[int]] = {}
    for a, b in edges[count == 1].tolist():
        rim.setdefault(a, []).append(b)
        rim.setdefault(b, []).append(a)
    corners = set(vertex[uses == 1].tolist())
    sides = []
    for start in sorted(corners):
        for ahead in rim[start]:
            side = [start, ahead]
            while side[-1] not in corners:
                side.append(next(p for p in rim[side[-1]] if p != side[-2]))
            sides.append(side)
    longest = max(len(side) for side in sides)
    root = min((s for s in sides if len(s) == longest), key=lambda s: cage[s][:, 2].mean())
    if cage[root[0], 0] > cage[root[-1], 0]:
        root = root[::-1]
    rows, left = [root], [set(q) for q in quads.tolist()]
    ring = {frozenset(q): q for q in quads.tolist()}
    while left:
        row = rows[-1]
        beyond: list[int] = []
        for a, b in zip(row, row[1:], strict=False):
            quad = next(q for q in left if a in q and b in q)
            left.remove(quad)
            order = ring[frozenset(quad)]
            k = order.index(a)
            near = [order[(k + 1) % 4], order[k - 1]]
            after_a = near[0] if near[1] == b else near[1]
            after_b = (quad - {a, b, after_a}).pop()
            beyond = (beyond or [after_a]) + [after_b]
        rows.append(beyond)
    return np.array(rows).T


def _catmull_rom(t: NDArray, n: int) -> NDArray[np.float64]:
    """Weights (k, n) of n values at 0, 1, … of which a Catmull-Rom curve is drawn, at t (k,).

    Beyond the ends the curve goes on straight.
    """
    k = np.clip(np.floor(t).astype(int), 0, n - 2)
    s = np.clip(t - k, 0, 1)
    over = (t - k) - s
    w = np.stack([-s / 2 + s**2 - s**3 / 2, 1 - 2.5 * s**2 + 1.5 * s**3,
                  s / 2 + 2 * s**2 - 1.5 * s**3, (s**3 - s**2) / 2], axis=1)  # fmt: skip
    out = np.zeros((len(t), n))
    rows = np.arange(len(t))
    for step in range(4):
        at = k + step - 1
        low, high = at < 0, at > n - 1
        inner = ~(low | high)
        np.add.at(out, (rows[inner], at[inner]), w[inner, step])
        for outside, end, inward in ((low, 0, 1), (high, n - 1, n - 2)):  # reflected: 2 p0 - p1
            np.add.at(out, (rows[outside], end), 2 * w[outside, step])
            np.add.at(out, (rows[outside], inward), -w[outside, step])
    first, last = over < 0, over > 0
    out[first, 0] -= over[first]
    out[first, 1] += over[first]
    out[last, n - 1] += over[last]
    out[last, n - 2] -= over[last]
    return out


def _on_sheet(sheet: NDArray, u: NDArray, v: NDArray, m: int) -> sp.csr_matrix:
    """Rows (k, m) of the sheet's points at u along the lid and v from root to tip (k,)."""
    a, b = _catmull_rom(u, sheet.shape[0]), _catmull_rom(v, sheet.shape[1])
    weights = (a[:, :, None] * b[:, None, :]).reshape(len(u), -1)
    return sp.csr_matrix(weights) @ sp.csr_matrix(
        (np.ones(sheet.size), (np.arange(sheet.size), sheet.ravel())), shape=(sheet.size, m)
    )


# --- lashes ---


def _lash_rows(
    sheet: NDArray, lash: LashRow, lids: Lids, rng: np.random.Generator
) -> tuple[sp.csr_matrix, list[tuple[int, int]]]:
    """Rows of one lid's lashes, and (rings, corners) of each blade."""
    cage, skin, triangles = lids.cage, lids.skin, lids.triangles
    m, across = len(cage), sheet.shape[1] - 1
    k = lash.count
    along = np.linspace(*lash.span, k) + rng.uniform(-0.3, 0.3, k) / k
    middle = cage[sheet[:, across // 2]]
    s = arc_lengths(middle)
    u = np.interp(along, s / s[-1], np.arange(len(s)))

    # The root: where the lid's edge turns to the front, evened out along the lid.
    fine = np.linspace(0.05, 0.85, 81) * across
    edge = np.empty(k)
    for i in range(k):
        points = _on_sheet(sheet, np.full(81, u[i]), fine, m) @ cage
        corners, weight, _ = closest_on_skin(points, skin, triangles)
        front = np.einsum("kc,kc->k", weight, lids.normals[corners][:, :, 2]) > EDGE_FACES
        edge[i] = fine[np.argmax(front)] if front.any() else fine[-1]
    edge = np.clip(np.polynomial.Polynomial.fit(along, edge, 4)(along), fine[0], fine[-1])
    start = _on_sheet(sheet, u, edge, m)
    index, weight, _ = closest_on_skin(start @ cage, skin, triangles)
    root = rows_at(lids.rows, index, weight)
    lids.edges.append(sp.csr_matrix(root[k // 2 - 2 : k // 2 + 3].mean(axis=0)))

    # Directions are taken straight ahead, at the same x and off the corners of the eye: the lids
    # turn about that axis, and so lashes turn with them as they are.
    x = (start @ cage)[:, 0]
    x = np.clip(x, *np.interp(STEADY, along, x))
    ways = [
        _on_sheet(sheet, _same_x(sheet, cage, x, v), v, m)
        for v in (np.zeros(k), np.full(k, across / 2), np.full(k, float(across)))
    ]
    inner = np.clip(u, *np.interp(STEADY, along, u))
    side = _on_sheet(sheet, inner + 1.5, edge, m) - _on_sheet(sheet, inner - 1.5, edge, m)
    first, second = ways[1] - ways[0], ways[2] - ways[1]
    one, two, bent, aside = (
        scale_to_one(rows, cage) for rows in (first, second, second - first, side)
    )
    tip_way = scale_to_one(two + lash.curl * bent, cage)

    length = MM * np.interp(along, STOPS, lash.length) * rng.uniform(0.86, 1.06, k)
    length[1::3] *= 0.86
    lean = np.interp(along, STOPS, lash.lean) + rng.normal(0, 0.07, k)
    lean += np.choose(np.arange(k) % 3, (0.06, 0.0, -0.06))  # tips stand together in threes
    p0 = root
    p1 = p0 + sp.diags(lash.reach * length) @ one + sp.diags(0.3 * length * lean) @ aside
    p2 = p1 + sp.diags((1 - lash.reach) * length) @ tip_way + sp.diags(0.7 * length * lean) @ aside
    if lash.droop:
        fall = lids.closing(k)
        grown = length / length.max() * lash.droop
        p1, p2 = p1 + sp.diags(0.3 * grown) @ fall, p2 + sp.diags(grown) @ fall

    width = MM * lash.width * np.interp(along, STOPS, (0.75, 1.0, 1.1, 0.9))
    blocks = []
    for t, share in ((0.0, 1.0), (0.4, 0.8), (0.75, 0.45)):
        centre = (1 - t) ** 2 * p0 + 2 * t * (1 - t) * p1 + t**2 * p2
        blocks += _ring(centre, sp.diags(width * share / 2), aside, bent)
    blocks.append(p2)
    order = np.arange(len(blocks) * k).reshape(len(blocks), k).T.ravel()
    rows, blades = sp.vstack(blocks).tocsr()[order], [(SECTIONS, 3)] * k
    if lash.line:
        way = np.argsort(along)
        taper = np.minimum(1, 4 * np.minimum(along, 1 - along) + 0.25)
        line = _ring(p0, sp.diags(-MM * lash.line / 2 * taper), one, bent)
        order = np.arange(3 * k).reshape(3, k)[:, way].T.ravel()
        rows = sp.vstack([rows, sp.vstack(line).tocsr()[order], p0[way[-1:]]])
        blades.append((k, 3))
    return rows.tocsr(), blades


def _ring(centre, size, across, depth) -> list[sp.spmatrix]:
    """Rows of the three corners of a blade's section around each centre."""
    corners = ((-1.0, -0.5), (1.0, -0.5), (0.0, 1.0))
    return [centre + a * (size @ across) + b * (size @ depth) for a, b in corners]


def _same_x(sheet: NDArray, cage: NDArray, x: NDArray, v: NDArray) -> NDArray[np.float64]:
    """Place u along the sheet at which its line at v from the root passes x, for each of (k,)."""
    at = _catmull_rom(v, sheet.shape[1]) @ cage[sheet][:, :, 0].T  # (k, along)
    steps = np.arange(sheet.shape[0])
    return np.array([np.interp(x[i], np.maximum.accumulate(at[i]), steps) for i in range(len(x))])
