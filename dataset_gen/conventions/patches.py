"""Patches of skin between two lines, and the short strokes that hatch shade and hair on them."""

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
    """Skin between two lines (COLUMNS, 2) px, both from the same side to the other."""

    top: Points
    hem: Points

    @classmethod
    def between(cls, top: NDArray, hem: NDArray) -> Patch:
        """Between two lines of any number of points."""
        return cls(even(np.asarray(top, float), COLUMNS), even(np.asarray(hem, float), COLUMNS))

    @property
    def outline(self) -> Points:
        """(2 * COLUMNS, 2)"""
        return np.concatenate([self.top, self.hem[::-1]])

    @property
    def size(self) -> float:
        """Square pixels."""
        x, y = self.outline.T
        return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))

    def at(self, across: NDArray, depth: NDArray) -> Points:
        """(n, 2) places at shares (n,) of the way from side to side, and from top to hem."""
        k = np.clip(across * (COLUMNS - 1), 0, COLUMNS - 1.001)
        whole, rest = k.astype(int), (k % 1)[:, None]
        top, hem = (
            line[whole] * (1 - rest) + line[whole + 1] * rest for line in (self.top, self.hem)
        )
        return top + depth[:, None] * (hem - top)

    def scattered(
        self, rng: np.random.Generator, count: int, low: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places (count,), (count,) on the patch by lot, as many on a pixel wherever it is.

        low : 1 evenly from top to hem, above more of them at the hem, below at the top
        """
        tall = np.hypot(*(self.hem - self.top).T)
        wide = np.hypot(*np.gradient((self.hem + self.top) / 2, axis=0).T)
        share = np.cumsum(tall * wide + 1e-9)
        column = np.interp(rng.uniform(0, share[-1], count), share, np.linspace(0, 1, COLUMNS))
        return column, 1 - rng.uniform(0, 1, count) ** low

    def covered(self, canvas: Canvas, cover: float, length: float, width: float) -> int:
        """How many strokes of such a length (px) and width (of the pen's) have `cover` times the
        area of the patch, at most MOST."""
        return int(min(MOST, 1 + cover * self.size / max(canvas.pen * width * length, 1.0)))


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
    """Long strokes from side to side of a patch, each a piece of the way, nearer to its hem."""
    rng = canvas.rng
    swing = 0.08 * wave(rng, count, 16)
    for k in range(count):
        a, b = np.sort(rng.uniform(0, 1, 2))
        a, b = max(0.0, a - 0.12), min(1.0, b + 0.12)
        t = np.linspace(a, b, 16)
        depth = np.clip(1 - rng.uniform(0, 1) ** 1.6 + swing[k], 0, 1)
        line = patch.at(t, depth)
        canvas.line(kind, line, width, strength * rng.uniform(0.6, 1), loose=0.5, within=within)


def scalloped(line: NDArray, size: float, count: int, way: float = 1.0) -> Points:
    """A line (k, 2) in `count` arcs that stand off it by `size` px, as locks and curls are drawn.

    way : 1 to the right of the line's way on the page, -1 to its left
    """
    line = even(line, 12 * count + 1)
    t = np.linspace(0, count, len(line)) % 1
    return line + way * size * np.sin(np.pi * t)[:, None] ** 0.7 * normals(line)
