"""The line around a head that most speaks for, and that does not go up and down for nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["steadiest"]


def steadiest(
    score: NDArray[np.floating],
    heights: NDArray[np.floating],
    base: NDArray[np.floating],
    stiffness: float,
) -> NDArray[np.intp]:
    """(n,) the rows of the closed line through a table that scores most, less what movement costs.

    score : (n, k) of each row at each of n azimuths;  heights : (k,) of the rows
    base : (n,) heights that a line may follow for nothing;  stiffness : of score for a unit of
        height by which it moves otherwise from one azimuth to the next

    By dynamic programming, as Amini, Weymouth and Jain (1990, "Using dynamic programming for
    solving variational problems in vision", PAMI) do it for active contours; movement costs what it
    is long, so that steps stay steps and narrow notches go. Going around twice closes the line.
    """
    count = len(score)
    away = heights[:, None] - heights[None, :]
    best = np.zeros(score.shape[1])
    came = np.zeros((2 * count, score.shape[1]), dtype=np.intp)
    for step in range(2 * count):
        a = step % count
        moved = best[None, :] - stiffness * np.abs(away - (base[a] - base[a - 1]))
        came[step] = moved.argmax(axis=1)
        best = score[a] + np.take_along_axis(moved, came[step][:, None], axis=1)[:, 0]
        best = best - best.max()
    rows = np.empty(2 * count, dtype=np.intp)
    rows[-1] = best.argmax()
    for step in range(2 * count - 1, 0, -1):
        rows[step - 1] = came[step, rows[step]]
    # What is in the middle knows of both its ends.
    middle = rows[count // 2 : count // 2 + count]
    return np.roll(middle, count // 2)
