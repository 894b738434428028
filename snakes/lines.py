"""Lines as points with directions: those of a drawing, those of a face, and which answer which."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, distance_transform_edt, maximum_filter
from scipy.spatial import cKDTree
from skimage.morphology import skeletonize

from facs_rig.common.box import Box

from .contours import binarise, working_drawing

__all__ = [
    "HEAD", "Lines", "SurfaceLines", "centre_lines", "directions", "nearest_lines", "paths",
    "polylines", "spacing",
]  # fmt: skip

HEAD = 0.24
"""Metres from chin to crown: the unit in which distances are weighed."""
HEIGHT = 320
"""Rows in which the head's box is looked at."""
NEIGHBOURS = 9
"""Points of a line whose spread says where it runs."""
AROUND = 4.0
"""Cells within which they lie."""
PEN = 0.4
"""Of the half widths of all ink along its ridges, the one that is a line's."""
FILLED = 2.2
"""Ink that is so many times as wide as a line is filled."""


@dataclass(frozen=True)
class Lines:
    """Points all along lines.

    points : (k, 2) float64, pixels (u, v)      along : (k, 2) float64, unit, either way
    border : (k,) bool or None, of a drawing the outlines of what is filled, of a face the borders
    of its lips. These never answer one another: what is filled is the mouth, and ends at its rims
    """

    points: NDArray[np.float64]
    along: NDArray[np.float64]
    border: NDArray[np.bool_] | None = None

    @cached_property
    def spacing(self) -> float:
        """See `spacing`; of a drawing's lines it is asked for again and again."""
        return spacing(self.points)

    def some(self, which: NDArray) -> Lines:
        """Some of the points: (k,) bool, or their numbers."""
        border = None if self.border is None else self.border[which]
        return Lines(self.points[which], self.along[which], border)


@dataclass(frozen=True)
class SurfaceLines:
    """Lines of a posed face as a camera sees them.

    lines : k points, one line behind another      starts : (lines + 1,) where each begins
    triangle : (k,) int, weights : (k, 3), where on the surface they lie
    kinds : (lines,) str, what each line is
    """

    lines: Lines
    starts: NDArray[np.intp]
    triangle: NDArray[np.intp]
    weights: NDArray[np.float64]
    kinds: NDArray[np.str_]

    def without(self, kinds: Collection[str]) -> Lines:
        """The points of all lines but those of some kinds."""
        kept = np.repeat(~np.isin(self.kinds, list(kinds)), np.diff(self.starts))
        return self.lines.some(kept)


def centre_lines(drawing: NDArray[np.floating], box: Box) -> Lines:
    """The middle of every stroke of a drawing (h, w; 1 is paper) within a box, a point a cell.

    box : pixels of the drawing; it is looked at in HEIGHT rows, at most its own.
    """
    high = max(box.height, 1.0)
    cell = max(high / HEIGHT, 1.0)
    size = max(int(box.width / cell), 1), max(int(high / cell), 1)
    ink = np.pad(binarise(working_drawing(drawing, box, size)), 1)
    middle, outline = _middles(ink)
    v, u = np.nonzero((middle | outline)[1:-1, 1:-1])
    cells = np.array([box.width / size[0], high / size[1]])
    points = np.stack([u, v], axis=1) + 0.5
    border = outline[1:-1, 1:-1][v, u]
    return Lines(points * cells + [box.left, box.top], directions(points), border)


def _middles(ink: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """The middle of every stroke, one cell wide, and the outlines of what is filled.

    A black mouth has a middle, too, but nobody drew it: its rims are what was drawn, and they lie
    half a stroke inside of the black.
    """
    middle = skeletonize(ink)
    nothing = np.zeros_like(ink)
    if not middle.any():
        return middle, nothing
    deep = distance_transform_edt(ink)
    # Unlike thinned ink, ridges are the same however the page lies.
    ridge = ink & (deep == maximum_filter(deep, 3))
    pen = float(np.quantile(deep[ridge], PEN))
    wide = max(FILLED * pen, pen + AROUND)  # so that its outline has a direction everywhere
    core = deep > wide
    if not core.any():
        return middle, nothing
    filled = ink & (distance_transform_edt(~core) <= wide + 1)
    inner = filled & (deep > pen)
    return middle & ~filled, inner & ~binary_erosion(inner)


def directions(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Where lines run at their points (k, 2), in cells: unit vectors (k, 2), either way.

    The direction in which the nearest points spread most; a lone point runs sideways.
    """
    if len(points) < 2:
        return np.tile([1.0, 0.0], (len(points), 1))
    k = min(NEIGHBOURS, len(points))
    tree = cKDTree(points)
    away, near = tree.query(points, k=k, distance_upper_bound=AROUND)
    here = np.isfinite(away)
    offset = np.where(here[..., None], points[np.minimum(near, len(points) - 1)], np.nan)
    offset = np.nan_to_num(offset - np.nanmean(offset, axis=1, keepdims=True))
    a, b = (offset[..., 0] ** 2).sum(axis=1), (offset[..., 1] ** 2).sum(axis=1)
    c = (offset[..., 0] * offset[..., 1]).sum(axis=1)
    angle = 0.5 * np.arctan2(2 * c, a - b)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def paths(points: NDArray[np.floating], apart: float) -> list[NDArray[np.intp]]:
    """The points (k, 2) of lines in order, a path for each stretch between ends and crossings.

    apart : pixels, farther from each other points are no neighbours. Paths of one point are left
    out; a ring is opened somewhere.
    """
    if len(points) < 2:
        return []
    pairs = cKDTree(points).query_pairs(apart, output_type="ndarray")
    plain = np.bincount(pairs.ravel(), minlength=len(points)) <= 2
    pairs = pairs[plain[pairs].all(axis=1)]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    degree = np.bincount(both[:, 0], minlength=len(points))
    first = np.cumsum(degree) - degree
    near = np.append(both[:, 1], -1)
    ahead = near[np.where(degree > 0, first, -1)].tolist()
    back = near[np.where(degree > 1, first + 1, -1)].tolist()
    left = np.ones(len(points), dtype=bool)
    found = []
    for start in [*np.flatnonzero(degree == 1), *np.flatnonzero(degree == 2)]:
        if left[start]:
            order = _walk(ahead, back, int(start))
            left[order] = False
            found.append(order)
    return sorted(found, key=min)


def _walk(ahead: list[int], back: list[int], start: int) -> NDArray[np.intp]:
    """The points of a path from its end `start` on, or of a ring all the way round.

    ahead, back : for each point the two beside it, -1 where there is none
    """
    order, before, here = [start], -1, start
    while True:
        following = back[here] if ahead[here] == before else ahead[here]
        if following in (-1, start):
            return np.array(order)
        order.append(following)
        before, here = here, following


def polylines(lines: Lines, tolerance: float = 0.5) -> list[NDArray[np.float64]]:
    """Lines as few-cornered polylines (k, 2) that stay within `tolerance` pixels of them.

    Douglas & Peucker 1973, "Algorithms for the reduction of the number of points".
    """
    ordered = paths(lines.points, 1.6 * lines.spacing)
    return [few_cornered(lines.points[path], tolerance) for path in ordered]


def few_cornered(line: NDArray[np.floating], tolerance: float) -> NDArray[np.float64]:
    """The points of a polyline (k, 2) that are enough to stay within `tolerance` of all."""
    kept = np.zeros(len(line), dtype=bool)
    kept[[0, -1]] = True
    open_ = [(0, len(line) - 1)]
    while open_:
        first, last = open_.pop()
        if last - first < 2:
            continue
        chord, inner = line[last] - line[first], line[first + 1 : last] - line[first]
        along = np.clip(inner @ chord / max(chord @ chord, 1e-12), 0.0, 1.0)
        away = np.linalg.norm(inner - along[:, None] * chord, axis=1)
        farthest = int(away.argmax())
        if away[farthest] > tolerance:
            corner = first + 1 + farthest
            kept[corner] = True
            open_ += [(first, corner), (corner, last)]
    return line[kept]


def spacing(points: NDArray[np.floating]) -> float:
    """The usual distance between neighbouring points (k, 2) of lines; 0 for less than two."""
    if len(points) < 2:
        return 0.0
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))


def nearest_lines(
    among: Lines, of: Lines, turn: float, reach: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """For each point of some lines (k) the one `among` others that lies and runs most like it.

    Distance counts in pixels, and a right angle between the two as `turn` pixels (directional
    chamfer matching: Liu, Tuzel, Veeraraghavan, Chellappa 2010, "Fast Directional Chamfer
    Matching", CVPR). Returns (k,) int, -1 where none is within `reach`, and (k,) that distance.
    """
    if not len(among.points) or not len(of.points):
        return np.full(len(of.points), -1), np.full(len(of.points), np.inf)
    if among.border is not None and of.border is not None and among.border.any():
        pair, away = nearest_lines(replace(among, border=None), of, turn, reach)
        lips, left = np.flatnonzero(of.border), np.flatnonzero(~among.border)
        asking = replace(of.some(lips), border=None)
        near, far = nearest_lines(among.some(left), asking, turn, reach)
        pair[lips], away[lips] = np.where(near >= 0, np.append(left, -1)[near], -1), far
        return pair, away
    tree = cKDTree(_placed(among, turn))
    away, near = tree.query(_placed(of, turn), distance_upper_bound=reach)
    return np.where(np.isfinite(away), near, -1), away


def _placed(lines: Lines, turn: float) -> NDArray[np.float64]:
    """(k, 4) place and doubled angle, so that both ways along a line are the same."""
    x, y = lines.along.T
    doubled = np.stack([x * x - y * y, 2 * x * y], axis=1)
    return np.concatenate([lines.points, turn / 2 * doubled], axis=1)
