"""Polylines: one as an array of points, or many in flat arrays for one numpy call on all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Polylines", "arc_lengths", "line_length", "resampled", "spread"]


def arc_lengths(points: NDArray) -> NDArray[np.float64]:
    """(k,) the length of a line (k, d) up to each of its points, from 0."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def line_length(points: NDArray) -> float:
    """Of a line (k, d), in its own units; 0 for less than two points."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def resampled(values: NDArray, way: NDArray, at: NDArray) -> NDArray[np.float64]:
    """(m, d) what a line has at the lengths `at` (m,), linear between its points.

    values : (k, d), of each point;  way : (k,) from `arc_lengths`
    """
    return np.column_stack([np.interp(at, way, column) for column in np.asarray(values).T])


@dataclass(frozen=True)
class Polylines:
    """n polylines behind each other.

    points : (N, 2) float64        starts : (n + 1,) int, line k is points[starts[k]:starts[k + 1]]
    along : (N,) length from the line's own beginning        length : (n,)
    """

    points: NDArray[np.float64]
    starts: NDArray[np.int64]
    along: NDArray[np.float64]
    length: NDArray[np.float64]

    @classmethod
    def of(cls, lines: Sequence[NDArray]) -> Polylines:
        """From at least one array (k, 2) each, of at least one point each."""
        starts = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
        return cls.joined(np.concatenate(lines).astype(np.float64, copy=False), starts)

    @classmethod
    def joined(cls, points: NDArray, starts: NDArray) -> Polylines:
        """From points (N, 2) that are flat already."""
        step = np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T)
        step[starts[:-1]] = 0
        along = np.cumsum(step)
        along -= np.repeat(along[starts[:-1]], np.diff(starts))
        return cls(points, starts, along, along[starts[1:] - 1])

    @property
    def line(self) -> NDArray[np.int64]:
        """(N,) the number of the line that each point belongs to."""
        return np.repeat(np.arange(len(self.length)), np.diff(self.starts))

    def at(self, line: NDArray, along: NDArray, *values: NDArray) -> tuple[NDArray, ...]:
        """Points (m, 2) and values (N,) interpolated at lengths (m,) along lines (m,).

        Lengths beyond a line's ends give its ends.
        """
        # All lines behind each other on one axis, with room between, make one interpolation of it.
        origin = np.concatenate([[0], np.cumsum(self.length + 1.0)])
        axis = self.along + np.repeat(origin[:-1], np.diff(self.starts))
        where = origin[line] + np.clip(along, 0, self.length[line])
        u, v = (np.interp(where, axis, self.points[:, k]) for k in (0, 1))
        return np.stack([u, v], axis=1), *(np.interp(where, axis, value) for value in values)


def spread(length: NDArray, step: float | NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Even places along lines of `length` (n,): at most `step` apart, both ends among them.

    step : one for all, or (n,).

    Returns the line of each place (m,), its length along the line (m,), and starts (n + 1,).
    """
    count = np.maximum(np.ceil(length / step), 1).astype(np.int64)
    starts = np.concatenate([[0], np.cumsum(count + 1)])
    line = np.repeat(np.arange(len(length)), count + 1)
    place = np.arange(starts[-1]) - starts[:-1][line]
    return line, place * (length / count)[line], starts
