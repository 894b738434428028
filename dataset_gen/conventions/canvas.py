"""A page that is drawn on from front to back: what is drawn first hides what comes later."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from facs_rig.common.polylines import Polylines, spread

from ..linework.marks import drift
from ..linework.strokes import Stroke, runs
from .shapes import Points

STEP = 1.0  # pixels between the points in which lines are cut
SHORTEST = 2.0  # pixels: pieces of cut lines that are shorter are left out
BEND = 45.0  # pixels, about, between the bends of a loose hand
SPACING = 0.8  # of a stroke's width, between the strokes that blacken an area


@dataclass(frozen=True)
class Line:
    """One line as it was drawn, whole. time : how many things covered the page before it."""

    points: Points
    strength: NDArray
    seen: NDArray
    kind: str
    width: float
    loose: float
    time: int
    within: bool


class Canvas:
    """Collects strokes and knows what covers what. Lengths are pixels.

    width, height : of the page;  pen : width of a full line;  loose : how far lines are off
    regions : name -> the outlines (k, 2) of what was marked as such
    """

    def __init__(
        self, width: int, height: int, pen: float, loose: float, rng: np.random.Generator
    ) -> None:
        self.width, self.height, self.pen, self.loose, self.rng = width, height, pen, loose, rng
        self._lines: list[Line] = []
        self._done: list[Stroke] = []
        self._time = 1
        self._covered = np.zeros((height, width), np.int32)  # when each pixel was, 0 never
        self._within = np.ones((height, width), bool)
        self.regions: dict[str, list[Points]] = {}

    # --- what hides ---

    def cover(self, outline: NDArray) -> None:
        """What is drawn from now on is hidden within this outline (k, 2)."""
        self._time += 1
        self._covered[self.area(outline) & (self._covered == 0)] = self._time

    def bound(self, outline: NDArray) -> None:
        """Lines that are drawn `within` lie in this outline (k, 2) alone."""
        self._within = self.area(outline)

    def mark(self, name: str, outline: NDArray) -> None:
        """Say what lies within an outline (k, 2)."""
        self.regions.setdefault(name, []).append(np.asarray(outline, float))

    def area(self, outline: NDArray) -> NDArray[np.bool_]:
        """(height, width) which pixels an outline (k, 2) holds."""
        mask = Image.new("1", (self.width, self.height))
        # Pillow's pixel k is centred on k, ours on k + 0.5.
        corners = (np.asarray(outline, float) - 0.5).ravel().tolist()
        ImageDraw.Draw(mask).polygon(corners, fill=1)
        return np.asarray(mask)

    def inside(self, area: NDArray, points: NDArray) -> NDArray[np.bool_]:
        """(k,) which points lie in an `area`."""
        return self._at(area, points).astype(bool)

    def _at(self, values: NDArray, points: NDArray) -> NDArray:
        """(k,) what pixels hold at points (k, 2), 0 off the page."""
        u, v = np.floor(points).astype(np.int64).T
        on_page = (u >= 0) & (u < self.width) & (v >= 0) & (v < self.height)
        cell = np.where(on_page, v * self.width + u, 0)
        return np.where(on_page, values.ravel()[cell], 0)

    # --- what is drawn ---

    def line(
        self,
        kind: str,
        points: NDArray,
        width: float = 1.0,
        strength: NDArray | float = 1.0,
        seen: NDArray | None = None,
        loose: float = 1.0,
        within: bool = False,
    ) -> None:
        """A line (k, 2), drawn where it is not covered.

        seen : (k,) bool, where it may be seen along it;  within : whether only in what is bound
        """
        points = np.asarray(points, float)
        if len(points) > 1:
            strength = np.zeros(len(points)) + strength
            shown = np.ones(len(points)) if seen is None else np.asarray(seen, float)
            self._lines.append(
                Line(points, strength, shown, kind, width, loose, self._time, within)
            )

    def fill(self, outline: NDArray, kind: str = "fill", loose: float = 0.5) -> None:
        """A small black shape in front of all else: its outline (k, 2) and what it holds."""
        outline = np.asarray(outline, float)
        if len(outline) < 3 or self._at(self._covered, outline.mean(axis=0)[None])[0]:
            return
        outline = outline + 0.7 * loose * self.loose * self.rng.normal(size=2)
        outline = np.concatenate([outline, outline[:1]])
        self._done.append(Stroke(outline, np.ones(len(outline)), kind, 0.6))

    def strokes(self) -> list[Stroke]:
        """All that was drawn and can be seen."""
        if not self._lines:
            return self._done
        lines = Polylines.of([line.points for line in self._lines])
        line, along, starts = spread(lines.length, STEP)
        strength, seen = (
            np.concatenate([getattr(own, name) for own in self._lines])
            for name in ("strength", "seen")
        )
        points, strength, seen = lines.at(line, along, strength, seen)
        time, within, loose = (
            np.array([getattr(own, name) for own in self._lines])[line]
            for name in ("time", "within", "loose")
        )
        if self.loose:
            size = self.loose * loose[:, None]
            bend = drift(lines.length, line, along, BEND, 2, self.rng)
            off = self.rng.normal(size=(len(self._lines), 2))[line]
            points = points + size * (0.7 * off + 0.6 * bend)
        covered = self._at(self._covered, points)
        shown = (seen > 0.5) & ((covered == 0) | (covered > time))
        shown &= ~within | self._at(self._within, points).astype(bool)
        first, last = runs(shown, line)
        out = []
        for a, b in zip(first.tolist(), (last + 1).tolist(), strict=True):
            own = self._lines[line[a]]
            if b - a > SHORTEST / STEP or (a == starts[line[a]] and b == starts[line[a] + 1]):
                out.append(Stroke(points[a:b], strength[a:b], own.kind, own.width))
        return self._done + [stroke for stroke in out if len(stroke.points) > 1]

    def blacken(
        self,
        outline: NDArray,
        angle: float = 0.6,
        sparse: float = 1.0,
        kind: str = "mass",
        strength: float = 1.0,
        within: bool = False,
        area: NDArray | None = None,
    ) -> None:
        """Fill what is not covered of an outline (k, 2) with strokes side by side.

        sparse : 1 they close up, above they leave paper between them;  angle : radians
        within, area : whether only in what is bound, or in such pixels (height, width)
        """
        mask = self.area(outline) & (self._covered == 0)
        if within:
            mask &= self._within
        if area is not None:
            mask &= area
        v, u = np.nonzero(mask)
        if len(u) < 4:
            return
        step = max(1.6, SPACING * self.pen) if sparse <= 1 else max(1.6, self.pen) * sparse
        width = 1.9 * step / self.pen if sparse <= 1 else 0.8
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        middle = np.array([u.mean(), v.mean()])
        cells = np.stack([u, v], axis=1) + 0.5 - middle
        p = np.arange((cells @ along).min() - 1, (cells @ along).max() + 1, 1.0)
        q = np.arange((cells @ across).min() - 1, (cells @ across).max() + 1, step)
        if sparse > 1:
            q = q + self.rng.normal(0, 0.15 * step, len(q))
        place = middle + q[:, None, None] * across + p[None, :, None] * along
        inside = self._at(mask, place.reshape(-1, 2)).reshape(len(q), len(p))
        runs = np.zeros((len(q), len(p) + 2), np.int8)
        runs[:, 1:-1] = inside
        edges = np.flatnonzero(np.diff(runs.ravel()))
        row, begin = np.divmod(edges[::2], len(p) + 2)
        size = edges[1::2] - edges[::2]
        for r, a, n in zip(row.tolist(), begin.tolist(), size.tolist(), strict=True):
            if n > 1:
                ends = place[r, [a, a + n // 2, a + n - 1]]
                self._done.append(Stroke(ends, np.full(3, strength), kind, width))
