"""Patches between two lines, and the short strokes that hatch shade and hair on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .canvas import Canvas
from .shapes import Points, even, normals, wave

COLUMNS = 60  # of a patch, from side to side
MOST = 900  # strokes on a patch
TAPER = np.array([0.8, 1.0, 0.5])  # how strong a short stroke is along it


@dataclass(frozen=True)
class Patch:
    """What lies between two lines (k, 2) px that run from the same side to the other: skin that is
    hatched or hairy, a crown between its rim over the forehead and its dome, a fold, a band."""

    low: Points
    high: Points

    @classmethod
    def between(cls, high: NDArray, low: NDArray) -> Patch:
        """Between two lines of any numbers of points, now COLUMNS, evenly along each."""
        return cls(*(even(np.asarray(line, float), COLUMNS) for line in (low, high)))

    @property
    def outline(self) -> Points:
        """(k, 2)"""
        return np.concatenate([self.high, self.low[::-1]])

    @property
    def size(self) -> float:
        """Square pixels."""
        x, y = self.outline.T
        return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))

    @property
    def tall(self) -> NDArray[np.float64]:
        """(k,) pixels from low to high, of lines of as many points."""
        return np.hypot(*(self.high - self.low).T)

    def at(self, across: NDArray | float, up: NDArray | float) -> Points:
        """Places (..., 2): a share of the way from side to side, and from low to high."""
        low, high = (_share_of(line, np.clip(across, 0, 1)) for line in (self.low, self.high))
        return low + np.asarray(up, float)[..., None] * (high - low)

    def strip(self, left: tuple[float, float], right: tuple[float, float], bow: float) -> Patch:
        """A part of it from side to side, between so much `up` at the left and at the right."""
        t = np.linspace(0, 1, 25)
        low, high = (
            np.clip(left[k] + (right[k] - left[k]) * t + bow * np.sin(np.pi * t), 0, 1)
            for k in (0, 1)
        )
        return Patch(self.at(t, low), self.at(t, high))

    def scattered(
        self, rng: np.random.Generator, count: int, low: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places (count,), (count,) for `at` by lot, as many on a pixel wherever it is, of lines of
        as many points.

        low : 1 evenly from low to high, above more of them below, else above
        """
        wide = np.hypot(*np.gradient((self.low + self.high) / 2, axis=0).T)
        share = np.cumsum(self.tall * wide + 1e-9)
        columns = np.linspace(0, 1, len(share))
        across = np.interp(rng.uniform(0, share[-1], count), share, columns)
        return across, rng.uniform(0, 1, count) ** low

    def covered(self, canvas: Canvas, cover: float, length: float, width: float) -> int:
        """How many strokes of such a length (px) and width (of the pen's) have `cover` times the
        area of the patch, at most MOST."""
        return int(min(MOST, 1 + cover * self.size / max(canvas.pen * width * length, 1.0)))


def _share_of(line: Points, share: NDArray | float) -> Points:
    """Points (..., 2) of a line (k, 2), a share of its points from its beginning."""
    k = np.arange(len(line))
    place = np.asarray(share, float) * (len(line) - 1)
    return np.stack([np.interp(place, k, line[:, c]) for c in (0, 1)], axis=-1)


def ticks(
    canvas: Canvas,
    kind: str,
    roots: NDArray,
    ways: NDArray,
    width: float = 0.8,
    strength: NDArray | float = 1.0,
    bow: NDArray | float = 0.0,
    within: bool = False,
) -> None:
    """Short strokes from roots (n, 2) along ways (n, 2), px.

    strength, bow : (n,) or for all; bow is how far they bend aside, as a share of their length
    """
    strength, bow = (np.zeros(len(roots)) + value for value in (strength, bow))
    aside = np.stack([-ways[:, 1], ways[:, 0]], axis=1) * bow[:, None]
    lines = np.stack([roots, roots + 0.5 * ways + aside, roots + ways], axis=1)
    for line, strong in zip(lines, strength.tolist(), strict=True):
        canvas.line(kind, line, width, strong * TAPER, loose=0.0, within=within)


def along(
    canvas: Canvas,
    kind: str,
    patch: Patch,
    count: int,
    width: float = 0.8,
    strength: float = 1.0,
    within: bool = False,
) -> None:
    """Long strokes from side to side of a patch, each a piece of the way, most of them low."""
    rng = canvas.rng
    swing = 0.08 * wave(rng, count, 16)
    for k in range(count):
        a, b = np.sort(rng.uniform(0, 1, 2))
        a, b = max(0.0, a - 0.12), min(1.0, b + 0.12)
        t = np.linspace(a, b, 16)
        line = patch.at(t, np.clip(rng.uniform(0, 1) ** 1.6 - swing[k], 0, 1))
        canvas.line(kind, line, width, strength * rng.uniform(0.6, 1), loose=0.5, within=within)


def scalloped(line: NDArray, size: float, count: int, way: float = 1.0) -> Points:
    """A line (k, 2) in `count` arcs that stand off it by `size` px, as locks and curls are drawn.

    way : 1 to the right of the line's way on the page, -1 to its left
    """
    line = even(line, 12 * count + 1)
    t = np.linspace(0, count, len(line)) % 1
    return line + way * size * np.sin(np.pi * t)[:, None] ** 0.7 * normals(line)
