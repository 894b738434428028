"""Teeth, gums and tongue: their shapes on the default face, as coarse cages that are subdivided.

Lengths are in millimetres from the head's joint, in the source's frame: x to the face's own left,
y up, z forward. Each tooth is a box of rings about its long axis, wide where it meets its
neighbour and narrow at the gum; neighbours overlap a little, so that between them there is a
groove and no slit, and a line drawing shows a row of teeth and not its gaps. What carries the
shapes is said in facs_rig.baking.mouth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from ..common.polylines import arc_lengths
from ..subdivide import catmull_clark

OVERLAP = 1.06  # of a tooth's width, so that it reaches into its neighbours


@dataclass(frozen=True)
class Tooth:
    """Width along the arch, height of the crown, thickness at the gum and at the edge; how far
    the edge's middle stands out beyond its ends (a canine's tip; negative: a molar's hollow)."""

    width: float
    height: float
    thick: float
    edge: float
    tip: float = 0.0


@dataclass(frozen=True)
class Arch:
    """One row of teeth.

    outline : (x, z) of the outer faces' line on the face's left, from the middle backwards
    edge : y of the teeth's edges along it, as (x, y)
    up : 1 where crowns point down, -1 where they point up;  lean : how far a crown's root lies
    behind its edge, as a share of its height, in front and at the back
    gum : how far the gum reaches beyond the crowns, in front and at the back
    """

    teeth: tuple[Tooth, ...]
    outline: tuple[tuple[float, float], ...]
    edge: tuple[tuple[float, float], ...]
    up: float
    lean: tuple[float, float]
    gum: tuple[float, float]


# Widths and heights after Wheeler's Dental Anatomy, a little shorter: the gum covers the rest.
UPPER = Arch(
    (Tooth(8.4, 10.3, 7.0, 2.0), Tooth(6.6, 9.2, 6.2, 1.9), Tooth(7.5, 10.0, 7.6, 2.2, 0.9),
     Tooth(6.8, 8.2, 8.6, 5.6, 0.5), Tooth(6.7, 7.4, 8.6, 5.8, 0.2),
     Tooth(9.8, 6.9, 10.4, 8.0, -0.3), Tooth(9.2, 6.4, 10.2, 7.8, -0.3)),
    ((0.0, 95.0), (8.0, 93.6), (15.0, 89.4), (20.2, 82.6), (24.0, 74.0), (27.2, 63.5),
     (29.4, 52.0), (30.4, 40.0)),
    ((0.0, -31.9), (8.0, -31.7), (16.0, -31.0), (22.0, -29.6), (30.0, -28.4)),
    up=1.0, lean=(0.07, -0.05), gum=(7.5, 5.0),
)  # fmt: skip
LOWER = Arch(
    (Tooth(5.3, 8.8, 5.8, 1.8), Tooth(5.8, 8.9, 6.0, 1.8), Tooth(6.8, 9.6, 7.2, 2.1, 0.8),
     Tooth(6.9, 8.2, 7.6, 4.6, 0.5), Tooth(7.0, 7.4, 8.0, 5.4, 0.2),
     Tooth(10.6, 6.4, 9.6, 7.4, -0.3), Tooth(10.0, 6.0, 9.4, 7.2, -0.3)),
    ((0.0, 91.4), (6.0, 90.3), (12.0, 86.6), (17.0, 80.2), (21.0, 71.8), (24.6, 61.5),
     (27.0, 50.5), (28.2, 40.0)),
    ((0.0, -29.0), (8.0, -29.2), (16.0, -29.5), (22.0, -29.2), (30.0, -28.2)),
    up=-1.0, lean=(0.06, 0.1), gum=(3.0, 2.5),
)  # fmt: skip

# Rings of a crown from the root to the edge: share of the height, of the width, of the thickness
# between gum (0) and edge (1), how far the ring's middle stands forward (share of the thickness).
RINGS = ((-0.22, 0.66, 0.0, -0.10), (0.05, 0.74, 0.0, 0.0), (0.45, 0.97, 0.30, 0.05),
         (0.80, 1.0, 0.80, 0.04), (1.0, 0.90, 1.0, 0.0))  # fmt: skip
SQUARE = 0.80  # y of a ring's corners against its sides, which subdivision rounds


@dataclass(frozen=True)
class Cage:
    """A shape to be subdivided once: points (k, 3) in millimetres, quads (f, 4), and where their
    corners lie (f, 4, 2) on a chart of their own, in quads, from 0 up."""

    points: NDArray
    quads: NDArray
    chart: NDArray

    def fine(self) -> tuple[sp.csr_matrix, NDArray[np.int64], NDArray[np.float64]]:
        """Rows (n, k) over the points, the quads of the subdivided surface, and their chart."""
        matrix, quads, _, _ = catmull_clark(self.quads, len(self.points))
        ahead, behind = (self.chart + np.roll(self.chart, step, axis=1) for step in (-1, 1))
        centre = np.broadcast_to(self.chart.mean(axis=1, keepdims=True), self.chart.shape)
        chart = np.stack([self.chart, ahead / 2, centre, behind / 2], axis=2)
        return matrix, quads, chart.reshape(-1, 4, 2)


GAP = 0.5  # quads between shapes that share a chart


def joined(cages: list[Cage]) -> Cage:
    """Shapes as one, side by side on the chart."""
    starts = np.cumsum([0] + [len(cage.points) for cage in cages])
    quads = [cage.quads + start for cage, start in zip(cages, starts[:-1], strict=True)]
    places = np.cumsum([0.0] + [cage.chart[..., 0].max() + GAP for cage in cages])
    charts = [cage.chart + (x, 0.0) for cage, x in zip(cages, places[:-1], strict=True)]
    points = np.concatenate([cage.points for cage in cages])
    return Cage(points, np.concatenate(quads), np.concatenate(charts))


def mirrored(cage: Cage) -> Cage:
    chart = cage.chart[:, ::-1] * (-1, 1) + (cage.chart[..., 0].max(), 0)
    return Cage(cage.points * [-1, 1, 1], cage.quads[:, ::-1], chart)


def _turned(cage: Cage) -> Cage:
    """The same surface, seen from its other side."""
    chart = cage.chart[:, ::-1] * (-1, 1) + (cage.chart[..., 0].max(), 0)
    return Cage(cage.points, cage.quads[:, ::-1], chart)


def _sheet(rows: int, columns: int) -> tuple[list[list[int]], list[list[tuple[int, int]]]]:
    """Quads between `rows` rings of `columns` points, the last joined to the first; the chart."""
    quads, chart = [], []
    for r in range(rows - 1):
        for c in range(columns):
            a, b = columns * r + c, columns * r + (c + 1) % columns
            quads.append([a, b, b + columns, a + columns])
            chart.append(_square(c, r))
    return quads, chart


def _tube(rows: int, columns: int) -> tuple[list[list[int]], list[list[tuple[int, int]]]]:
    """A sheet whose first and last ring, of an even number of points, are closed by quads."""
    quads, chart = _sheet(rows, columns)
    base = (rows - 1) * columns
    for c in range(columns // 2 - 1):
        d = columns - 1 - c
        quads.append([base + c, base + c + 1, base + d - 1, base + d])
        quads.append([c + 1, c, d, d - 1])
        chart += [_square(4 * c, rows), _square(4 * c + 2, rows)]
    return quads, chart


def _square(x: int, y: int) -> list[tuple[int, int]]:
    return [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]


class Line:
    """The outer line of an arch, by the distance along it from the middle."""

    def __init__(self, arch: Arch) -> None:
        half = np.array(arch.outline)
        whole = np.concatenate([half[:0:-1] * [-1, 1], half])
        x = CubicSpline(np.arange(len(whole)), whole)(np.linspace(0, len(whole) - 1, 801))
        s = arc_lengths(x)
        self._place = CubicSpline(s - s[-1] / 2, x)
        self.length = s[-1] / 2
        self._edge = PchipInterpolator(*np.array(arch.edge).T, extrapolate=True)
        self._arch = arch

    def at(self, s: NDArray | float) -> tuple[NDArray, NDArray, NDArray]:
        """Points of the edges' line (..., 3), directions along it and outwards (..., 3)."""
        x, z = np.moveaxis(self._place(s), -1, 0)
        dx, dz = np.moveaxis(self._place(s, 1), -1, 0)
        length = np.hypot(dx, dz)
        zero = 0 * x
        along = np.stack([dx / length, zero, dz / length], axis=-1)
        out = np.stack([-dz / length, zero, dx / length], axis=-1)
        return np.stack([x, self._edge(np.abs(x)), z], axis=-1), along, out

    def lean(self, s: NDArray | float) -> NDArray:
        share = np.clip(np.abs(s) / self.length, 0, 1)
        return np.interp(share, (0, 1), self._arch.lean)


def places(arch: Arch) -> NDArray[np.float64]:
    """(teeth,) the middle of each tooth along the line, on the face's left."""
    widths = np.array([tooth.width for tooth in arch.teeth])
    return np.cumsum(widths) - widths / 2


def crown(tooth: Tooth, s: float, line: Line, up: float) -> Cage:
    """One tooth at s along the line: rings of six corners, closed at both ends."""
    edge, along, out = line.at(s)
    axis = np.array([0.0, up, 0.0]) - line.lean(s) * out
    points = []
    for share, wide, thin, forward in RINGS:
        w = tooth.width * wide * OVERLAP / 2
        d = tooth.thick + (tooth.edge - tooth.thick) * thin
        middle = edge + axis * tooth.height * (1 - share) - out * (tooth.thick / 2)
        middle = middle + out * forward * tooth.thick
        middle = middle + out * (tooth.thick - d) * 0.30  # an edge is nearer to the outer face
        bend = tooth.tip * share**4
        for a, b in ((1.0, SQUARE), (0.0, 1.1), (-1.0, SQUARE),
                     (-1.0, -SQUARE), (0.0, -1.1), (1.0, -SQUARE)):  # fmt: skip
            tip = -up * bend * (1 - abs(a)) * np.array([0.0, 1.0, 0.0])
            points.append(middle + along * a * w + out * b * d / 2 + tip)
    quads, chart = _sheet(len(RINGS), 6)
    last = 6 * (len(RINGS) - 1)
    quads += [[last, last + 1, last + 4, last + 5], [last + 1, last + 2, last + 3, last + 4]]
    quads += [[1, 0, 5, 4], [2, 1, 4, 3]]
    chart += [_square(x, len(RINGS)) for x in (0, 2, 4, 6)]
    made = Cage(np.array(points), np.array(quads), np.array(chart, dtype=float))
    return made if up > 0 else _turned(made)


def gum(arch: Arch, line: Line) -> Cage:
    """The gum of one arch: a ribbon over its roots, from the lips' side to the tongue's, whose
    margin is a scallop around each tooth."""
    middle = places(arch)
    ends = np.cumsum([tooth.width for tooth in arch.teeth])
    s = np.concatenate([[0.0], np.sort(np.concatenate([middle, ends])), [ends[-1] + 3.0]])
    height = np.array([tooth.height for tooth in arch.teeth])
    thick = np.array([tooth.thick for tooth in arch.teeth])
    high = np.interp(s, middle, height)
    deep = np.interp(s, middle, thick)
    at_gap = np.ones(len(s), dtype=bool)
    at_gap[np.searchsorted(s, middle)] = False
    margin = high * np.where(at_gap, 0.52, 0.90)  # from the edge to where the gum begins
    s, high, deep, margin = (np.concatenate([sign * v[:0:-1], v]) for sign, v in
                             ((-1, s), (1, high), (1, deep), (1, margin)))  # fmt: skip
    edge, _, out = line.at(s)
    share = np.clip(np.abs(s) / line.length, 0, 1)
    beyond = np.interp(share, (0, 1), arch.gum)
    axis = np.array([0.0, arch.up, 0.0]) - line.lean(s)[:, None] * out
    gap = np.concatenate([at_gap[:0:-1], at_gap])
    swell = np.where(gap, -0.5, 0.35)
    rows = []
    for up, aside in (
        (high + beyond, 0.2 + 0 * s),  # on the lips' side, deep in the vestibule
        (high + 0.45 * beyond, 0.9 + 0 * s),
        (margin + 0.9, swell + 0.25),
        (margin - 0.3, swell - 0.9),
        (margin + 0.4, -deep / 2),  # over the roots, between the teeth
        (margin - 0.3, -deep - swell + 0.6),
        (margin + 1.2, -deep - swell - 0.5),
        (high + 0.45 * beyond, -deep - 1.0),
        (high + beyond, -deep - 2.0),
        (high + beyond, -deep / 2),
    ):
        rows.append(edge + axis * np.asarray(up)[:, None] + out * np.asarray(aside)[:, None])
    points = np.stack(rows, axis=1)  # (stations, profile, 3)
    k, n = points.shape[:2]
    quads, chart = _tube(k, n)
    made = Cage(points.reshape(-1, 3), np.array(quads), np.array(chart, dtype=float))
    return _turned(made) if arch.up < 0 else made


def row(arch: Arch) -> tuple[Cage, Cage]:
    """The teeth and the gum of an arch, both sides."""
    line = Line(arch)
    left = joined([crown(tooth, s, line, arch.up)
                   for tooth, s in zip(arch.teeth, places(arch), strict=True)])  # fmt: skip
    return joined([left, mirrored(left)]), gum(arch, line)


# --- the tongue ---

# Along the tongue, from the root to the tip: z and y of its middle, half-width, half-height.
TONGUE = (
    (22.0, -52.0, 14.0, 8.0), (30.0, -45.0, 16.5, 8.0), (42.0, -40.0, 17.4, 7.0),
    (54.0, -37.4, 17.0, 6.2), (65.0, -36.0, 15.8, 5.6), (74.0, -35.2, 13.4, 4.8),
    (79.5, -34.8, 10.4, 4.0), (82.6, -34.6, 6.6, 2.9), (83.8, -34.5, 3.0, 1.4),
)  # fmt: skip
FURROW = 1.0  # millimetres that the tongue's back is hollow along its middle
SIDES = 10


def tongue() -> tuple[Cage, NDArray[np.float64]]:
    """The tongue's cage, and (k,) how far along the tongue each of its points is: 0 at the root,
    1 at the tip."""
    table = np.array(TONGUE)
    middle = np.column_stack([0 * table[:, 0], table[:, 1], table[:, 0]])
    way = np.gradient(middle, axis=0)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    rise = np.cross(way, [1.0, 0.0, 0.0])  # perpendicular to the way, upwards
    turn = 2 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
    points = []
    for centre, up, (_, _, wide, high) in zip(middle, rise, table, strict=True):
        x = wide * np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** 0.8
        y = high * np.sin(turn)
        y -= FURROW * np.exp(-((x / 5) ** 2)) * (np.sin(turn) > 0) * (high / 7)
        points.append(centre + np.stack([x, 0 * x, 0 * x], 1) + y[:, None] * up)
    rings = len(points)
    along = np.repeat(arc_lengths(middle) / arc_lengths(middle)[-1], SIDES)
    quads, chart = _tube(rings, SIDES)
    return Cage(np.concatenate(points), np.array(quads), np.array(chart, dtype=float)), along
