"""Small plane geometry for drawing: smooth curves through points, ellipses, offsets, noise."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def smooth(points: NDArray, count: int = 24, closed: bool = False) -> Points:
    """`count` points of a Catmull-Rom spline through points (k, 2)."""
    return _spline(len(points), count, closed) @ np.asarray(points, float)


@lru_cache(maxsize=512)
def _spline(size: int, count: int, closed: bool) -> NDArray[np.float64]:
    """(count, size) what each point of a spline takes of the points that it goes through."""
    points = np.eye(size)
    if closed:
        knots = np.concatenate([points[-1:], points, points[:2]])
        t = np.linspace(0, size, count)
    else:
        first, last = 2 * points[0] - points[1], 2 * points[-1] - points[-2]
        knots = np.concatenate([first[None], points, last[None]])
        t = np.linspace(0, size - 1, count)
    k = np.minimum(t.astype(int), len(knots) - 4)
    f = (t - k)[:, None]
    a, b, c, d = (knots[k + j] for j in range(4))
    return 0.5 * (
        2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f**2 + (3 * b - a - 3 * c + d) * f**3
    )


def part(line: NDArray, begin: float, end: float) -> Points:
    """From one share of a line's points (k, 2) to another; at least two points."""
    t = np.linspace(begin * (len(line) - 1), end * (len(line) - 1), max(len(line), 6))
    k = np.clip(t.astype(int), 0, len(line) - 2)
    f = (t - k)[:, None]
    return line[k] * (1 - f) + line[k + 1] * f


def even(line: NDArray, count: int) -> Points:
    """`count` points along a line (k, 2), evenly by length."""
    way = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.linspace(0, way[-1], count)
    return np.stack([np.interp(at, way, line[:, k]) for k in (0, 1)], axis=1)


def ellipse(centre: NDArray, rx: float, ry: float, turn: float = 0.0, count: int = 25) -> Points:
    """A closed ellipse (count, 2); turn in radians."""
    t = np.linspace(0, 2 * np.pi, count)
    return arc(centre, rx, ry, t, turn)


def arc(centre: NDArray, rx: float, ry: float, t: NDArray, turn: float = 0.0) -> Points:
    """The part of an ellipse at angles t (k,), from the right and downward."""
    x, y = rx * np.cos(t), ry * np.sin(t)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([centre[0] + c * x - s * y, centre[1] + s * x + c * y], axis=1)


def normals(line: NDArray) -> Points:
    """Unit vectors (k, 2) to the right of a line's way on the page, where v runs down."""
    way = np.gradient(line, axis=0)
    way /= np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)[:, None]
    return np.stack([-way[:, 1], way[:, 0]], axis=1)


def ribbon(line: NDArray, half: NDArray | float) -> Points:
    """The closed outline of a line with a half-width (k,) along it."""
    away = normals(line) * np.reshape(half, (-1, 1))
    return np.concatenate([line + away, (line - away)[::-1], (line + away)[:1]])


def wave(rng: np.random.Generator, lines: int, count: int, cycles: float = 1.0) -> Points:
    """Smooth noise (lines, count), about -1 to 1: what hair and hands do."""
    t = np.linspace(0, 1, count)
    total = np.zeros((lines, count))
    for octave in (1.0, 2.3, 4.1):
        phase = rng.uniform(0, 2 * np.pi, (lines, 1))
        size = rng.normal(0, 0.55 / octave**0.7, (lines, 1))
        total += size * np.sin(2 * np.pi * cycles * octave * t + phase)
    return total
