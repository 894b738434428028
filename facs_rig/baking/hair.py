"""Heads of hair for drawings: a shell over the skull, its edge in locks, a few strands on it.

Directions on the head are an angle around it from the front to the face's own left, and a height
in centimetres above the eyes. A style says where its edge runs, whether the hair lies on the head
or hangs from its widest place, and how thick it is; from the parting down to the edge it is
combed in columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from ..anatomy import smooth_curve
from ..common.ties import nearest
from ..curves import Curves, as_arrays
from .strands import closest_on_skin

CM = 0.01
CENTRE = (3.5, -6.6)  # height above the eyes of the head's widest place, and z of its middle (cm)
MIDDLE = np.array([0.0, *CENTRE])
CAP = 2.8  # height above the eyes: hair moves with the skull above brows and ears
CANDIDATES = 60  # triangles that a ray is tested against
COLUMNS, ROWS = 132, 26
CLEAR = 0.25  # centimetres that hair keeps from what it covers
# Where hair begins to grow, from the forehead's middle around the ear to the nape.
HAIRLINE = ((0, 6.7), (14, 6.9), (27, 6.7), (36, 5.6), (42, 4.0), (50, 2.4), (62, 1.2), (70, -0.6),
            (76, -1.6), (82, 0.2), (88, 2.7), (100, 3.0), (112, 2.2), (122, -1.0), (132, -4.2),
            (150, -5.8), (180, -6.2))  # fmt: skip


@dataclass(frozen=True)
class Style:
    """One head of hair; lengths in centimetres, angles in degrees.

    edge : (angle, height) from the front to the back on the left; the right is its mirror image
    thick : in front, on top, at the sides, behind
    hangs : whether hair falls from the widest place, else it follows the head
    part : x of the parting, or None for hair combed from the front backwards
    locks : how many locks the edge has on each side;  depth : how far their tips go
    flare : outward run of hanging hair at two thirds of its length and at its end
    ball : centre (x, height, z from the middle of the head) and radius of a bun, or None
    """

    edge: tuple[tuple[float, float], ...]
    thick: tuple[float, float, float, float]
    hangs: bool = False
    part: float | None = 0.0
    locks: int = 12
    depth: float = 0.5
    flare: tuple[float, float] = (0.0, 0.0)
    ball: tuple[float, float, float, float] | None = None
    strands: int = 5


STYLES: dict[str, Style] = {
    "short": Style(
        ((0, 6.2), (14, 6.5), (27, 6.3), *HAIRLINE[3:]), (2.2, 1.7, 0.8, 0.9), part=2.6,
        locks=13, depth=0.6, strands=6,
    ),
    "bob": Style(
        ((0, 5.9), (12, 5.3), (22, 4.2), (30, 2.6), (37, 0.0), (42, -3.0), (46, -6.0), (50, -8.2),
         (60, -8.8), (80, -8.6), (110, -8.2), (180, -7.6)), (1.4, 1.6, 1.3, 1.6), hangs=True,
        part=2.0, locks=9, depth=0.5, flare=(0.9, -0.2), strands=6,
    ),
    "long": Style(
        ((0, 6.6), (14, 6.2), (25, 5.2), (34, 3.0), (41, 0.0), (47, -4.0), (52, -9.0), (56, -14.5),
         (66, -16.5), (90, -17.0), (130, -17.0), (180, -17.0)), (1.1, 1.4, 1.2, 1.4), hangs=True,
        part=0.0, locks=8, depth=0.9, flare=(0.6, 1.6), strands=7,
    ),
    "bun": Style(
        HAIRLINE, (0.5, 0.7, 0.45, 0.6), part=None, locks=10, depth=0.12,
        ball=(0.0, 11.4, -6.0, 3.4), strands=6,
    ),
}  # fmt: skip


class Head:
    """The head that hair is put on, in centimetres from the middle between the eyes.

    vertices : (n, 3) metres, upright;  triangles : (t, 3), the skin's
    """

    def __init__(self, vertices: NDArray, triangles: NDArray, eyes_middle: NDArray) -> None:
        self.eyes = eyes_middle
        self.points = (vertices - eyes_middle) / CM
        self.skin, self.triangles = np.unique(triangles), triangles
        corners = self.points[triangles]
        middle = corners.mean(axis=1)
        outer = (middle[:, 1] > -17) & (np.linalg.norm(middle - [0, 0, CENTRE[1]], axis=1) > 5.5)
        self.corners = corners[outer]
        self.cap = self.skin[self.points[self.skin, 1] > CAP]
        self.from_middle = cKDTree(_unit(middle[outer] - MIDDLE))
        self.from_axis = cKDTree(_unrolled(middle[outer]))

    def hit(self, way: NDArray) -> NDArray[np.float64]:
        """(k,) distance from the head's middle to the farthest skin along unit ways (k, 3)."""
        near = self.from_middle.query(way, CANDIDATES)[1]
        return _farthest(self.corners[near], np.broadcast_to(MIDDLE, way.shape), way)

    def around(self, angle: NDArray, height: NDArray) -> NDArray[np.float64]:
        """(k, 3) the skin at angles (degrees) and heights, seen from the head's upright axis."""
        way = level(angle)
        origin = np.stack([0 * height, height, np.full(len(height), CENTRE[1])], axis=1)
        near = self.from_axis.query(_unrolled(origin + way), CANDIDATES)[1]
        return origin + _farthest(self.corners[near], origin, way)[:, None] * way

    def bind_to_triangles(self, points: NDArray) -> tuple[NDArray, NDArray]:
        """Indices and weights (k, 3) of the skin nearest to points (k, 3, centimetres)."""
        return closest_on_skin(points, self.points, self.triangles)[:2]

    def bind(self, points: NDArray) -> tuple[NDArray, NDArray]:
        """Vertex of the skull (k,) that each point (k, 3, centimetres) hangs from, and the way
        from it in metres."""
        near = self.cap[nearest(self.points[self.cap], points)]
        return near, (points - self.points[near]) * CM


def _unit(ways: NDArray) -> NDArray[np.float64]:
    return ways / np.linalg.norm(ways, axis=-1, keepdims=True)


def _unrolled(points: NDArray) -> NDArray[np.float64]:
    """(k, 3) points on a cylinder about the head's upright axis: direction and height."""
    flat = _unit((points - MIDDLE)[:, [0, 2]])
    return np.column_stack([8 * flat, points[:, 1]])


def _farthest(corners: NDArray, origin: NDArray, way: NDArray) -> NDArray[np.float64]:
    """(k,) distance along each ray to the last of its candidate triangles (k, c, 3, 3).

    Moeller and Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection". A ray that
    misses all of them goes as far as the centre of the first.
    """
    a = corners[:, :, 0]
    e1, e2 = corners[:, :, 1] - a, corners[:, :, 2] - a
    p = np.cross(way[:, None], e2)
    det = np.einsum("kci,kci->kc", e1, p)
    det = np.where(np.abs(det) < 1e-12, np.inf, det)
    s = origin[:, None] - a
    u = np.einsum("kci,kci->kc", s, p) / det
    q = np.cross(s, e1)
    v = np.einsum("kci,ki->kc", q, way) / det
    t = np.einsum("kci,kci->kc", e2, q) / det
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 0)
    nearest = np.linalg.norm(corners[:, 0].mean(axis=1) - origin, axis=1)
    return np.where(inside.any(axis=1), np.where(inside, t, 0).max(axis=1), nearest)


def level(angle: NDArray) -> NDArray[np.float64]:
    """(k, 3) level directions at angles (k,) in degrees from the front to the face's left."""
    turn = np.radians(angle)
    return np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)


def hairline(head: Head) -> NDArray[np.float64]:
    """(k, 3) centimetres: the line from sideburn to sideburn on which hair begins."""
    front = np.array([p for p in HAIRLINE if p[0] <= 76], dtype=float)
    both = np.concatenate([front[:0:-1] * [-1, 1], front])
    both = smooth_curve(both * [0.12, 1], 90) / [0.12, 1]  # a degree is about 0.12 cm
    return head.around(*both.T)


def comb(style: Style, head: Head) -> tuple[NDArray, NDArray]:
    """The shell of a style: points (columns, rows, 3) in centimetres from parting to edge, and
    the columns between two locks."""
    left = np.array(style.edge, dtype=float)
    both = np.concatenate([left[::-1] * [-1, 1], left[1:]]) if left[0, 0] == 0 else left
    both = smooth_curve(both * [0.12, 1], COLUMNS) / [0.12, 1]
    angle, height = both.T
    run = np.linspace(0, 2 * style.locks, COLUMNS)
    phase = run % 1.0
    tips = style.depth * (np.sin(np.pi * phase) ** 0.6 - 0.5)
    grown = height - tips * np.where(np.arange(COLUMNS) % (COLUMNS - 1) == 0, 0, 1)
    notches = np.flatnonzero(np.diff(np.floor(run)) > 0)
    low = CENTRE[0]
    end = head.around(angle, grown)
    starts = _parting(style, head, angle)
    rows = np.linspace(0, 1, ROWS)
    way = end - MIDDLE
    if style.hangs:
        way = np.where((grown < low)[:, None], level(angle), way)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    shell = np.empty((COLUMNS, ROWS, 3))
    for k in range(COLUMNS):
        fall = max(low - grown[k], 0.0) if style.hangs else 0.0
        arc = np.arccos(np.clip(starts[k] @ way[k], -1, 1)) * 9.0
        length = arc + fall
        along = rows * length
        ways = _slerp(starts[k], way[k], np.clip(along / max(arc, 1e-6), 0, 1))
        radius = head.hit(ways)
        dense = _thickness(style, ways) * _ease_in(rows, along, fall > 0)
        points = MIDDLE + (radius + dense)[:, None] * ways
        drop = np.maximum(along - arc, 0)
        hanging = drop > 0
        if hanging.any():
            points[hanging] = _hanging(style, head, angle[k], drop[hanging], way[k])
        shell[k] = points
    smooth = gaussian_filter(shell, (1.2, 1.2, 0), mode="nearest")
    smooth[:, -1] = shell[:, -1]
    smooth[:, 0] = (smooth[:, 0] + smooth[::-1, 0]) / 2  # both sides meet at the parting
    return smooth, notches


def _parting(style: Style, head: Head, angle: NDArray) -> NDArray[np.float64]:
    """(columns, 3) unit directions from the head's middle where each column begins."""
    if style.part is None:  # all hair runs to one place, from the front backwards
        x, y, z, _ = style.ball or (0.0, 11.0, -2.0, 0.0)
        target = np.array([x, y - CENTRE[0], z])
        return np.repeat(target[None] / np.linalg.norm(target), len(angle), axis=0)
    t = np.clip(np.abs(angle) / 125.0, 0, 1)
    front = np.array([style.part, 4.2, 7.4])
    crown = np.array([0.3 * style.part, 7.0, -4.5])
    middle = np.array([0.8 * style.part, 7.8, 1.5])
    t = t[:, None]
    way = (1 - t) ** 2 * front + 2 * t * (1 - t) * middle + t**2 * crown
    return way / np.linalg.norm(way, axis=1, keepdims=True)


def _slerp(a: NDArray, b: NDArray, t: NDArray) -> NDArray[np.float64]:
    """(k, 3) unit directions from a to b."""
    turn = np.arccos(np.clip(a @ b, -1, 1))
    if turn < 1e-6:
        return np.repeat(a[None], len(t), axis=0)
    return (np.sin((1 - t) * turn)[:, None] * a + np.sin(t * turn)[:, None] * b) / np.sin(turn)


def _thickness(style: Style, ways: NDArray) -> NDArray[np.float64]:
    """(k,) centimetres of hair in unit directions (k, 3)."""
    front, top, side, behind = style.thick
    up = np.clip(ways[:, 1], 0, 1) ** 2
    ahead, back = (np.clip(sign * ways[:, 2], 0, 1) ** 2 for sign in (1, -1))
    beside = ways[:, 0] ** 2
    total = up + ahead + back + beside
    return (up * top + ahead * front + back * behind + beside * side) / total


def _ease_in(rows: NDArray, along: NDArray, falls: bool) -> NDArray[np.float64]:
    """Hair rises from the parting, and lies down toward an edge on the skin."""
    rise = np.clip(0.85 + along / 12.0, 0, 1)
    return rise if falls else rise * (1 - 0.7 * np.clip((rows - 0.72) / 0.28, 0, 1) ** 2)


def _hanging(style: Style, head: Head, angle, drop, way) -> NDArray[np.float64]:
    """(k, 3) places of hair that has fallen by `drop` (k,) from the head's widest place."""
    height = CENTRE[0] - drop
    across = np.full(len(drop), angle)
    radius = head.hit(way[None])[0] + _thickness(style, way[None])[0]
    skin = head.around(across, np.maximum(height, -11.0))
    local = np.hypot(skin[:, 0], skin[:, 2] - CENTRE[1]) + CLEAR
    t = drop / (CENTRE[0] - min(height for _, height in style.edge))
    third, end = style.flare
    bend = (3 * end - 4.5 * third) * t**2 + (4.5 * third - 2 * end) * t  # through both
    out = radius + bend * np.minimum(1, 3 * t)
    ear = np.exp(-(((np.abs(angle) - 92) / 22) ** 2) - (((height + 0.5) / 3.5) ** 2))
    out = np.maximum(np.maximum(out, np.where(height > -8, local, 0)), out + 0.6 * ear)
    out = out - 0.05 * np.clip((np.abs(angle) - 120) / 60, 0, 1) * drop
    points = out[:, None] * level(across)
    return points + np.stack([0 * height, height, np.full(len(height), CENTRE[1])], axis=1)


def hair_curves(style: Style, head: Head, frame: tuple[NDArray, NDArray]) -> Curves:
    """A style as a layer: the shell's surface, its edge, and strands from the notches up."""
    shell, notches = comb(style, head)
    points, number = shell.reshape(-1, 3), np.arange(COLUMNS * ROWS).reshape(COLUMNS, ROWS)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    quads = np.stack([a, d, c, b], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    lines = [(number[:, -1], np.ones(COLUMNS), 1.0)]
    if style.part is not None:
        front = number[np.abs(np.linspace(-1, 1, COLUMNS)) < 0.75, 0]
        lines.append((front, np.linspace(1, 0.2, len(front)), 0.8))
    rng = np.random.default_rng(len(notches))
    for k in notches:
        reach = int(rng.integers(ROWS // 3, ROWS - 2))
        line = number[k, ::-1][:reach]
        lines.append((line, np.linspace(1, 0.15, len(line)), 0.8))
    for k in np.linspace(0, COLUMNS - 1, style.strands * 4 + 2).astype(int)[1:-1]:
        low = int(rng.integers(1, ROWS // 4))
        line = number[k, low : low + int(rng.integers(ROWS // 4, ROWS // 2))]
        lines.append((line, np.linspace(0.9, 0.1, len(line)), 0.7))
    if style.ball is not None:
        extra, more, ring = _bun(style.ball, len(points))
        points = np.concatenate([points, extra])
        triangles = np.concatenate([triangles, more])
        lines += ring
    near, lift = head.bind(points)
    weight = np.zeros((len(points), 3))
    weight[:, 0] = 1
    return as_arrays(
        index=np.repeat(near[:, None], 3, axis=1), weight=weight, lift=lift,
        places=np.concatenate([line for line, _, _ in lines]),
        starts=np.cumsum([0, *(len(line) for line, _, _ in lines[:-1])]),
        strength=np.concatenate([strength for _, strength, _ in lines]),
        width=np.array([width for _, _, width in lines]), triangles=triangles,
        anchors=frame[0], axes=frame[1],
    )  # fmt: skip


def _bun(ball: tuple[float, float, float, float], first: int):
    """Points (k, 3), triangles and strands of a ball of hair, numbered from `first`."""
    x, y, z, radius = ball
    turns, tilts = 24, 13
    turn, tilt = np.meshgrid(np.linspace(0, 2 * np.pi, turns, endpoint=False),
                             np.linspace(0, np.pi, tilts), indexing="ij")  # fmt: skip
    ways = np.stack([np.sin(tilt) * np.sin(turn), np.cos(tilt), np.sin(tilt) * np.cos(turn)], -1)
    points = (ways * radius * [1.0, 0.82, 1.0]).reshape(-1, 3) + [x, y, z + CENTRE[1]]
    number = first + np.arange(turns * tilts).reshape(turns, tilts)
    a, d = number, np.roll(number, -1, axis=0)
    quads = np.stack([a[:, :-1], a[:, 1:], d[:, 1:], d[:, :-1]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    lines = []
    for k, (begin, end) in zip((-5, -2, 1, 4), ((2, 9), (3, 11), (2, 8), (4, 10)), strict=True):
        line = np.array([number[(k + (s - begin) // 2) % turns, s] for s in range(begin, end)])
        lines.append((line, np.linspace(1, 0.2, len(line)), 0.8))
    return points, triangles, lines
