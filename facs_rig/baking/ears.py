"""Ears with a tragus, its counterpart and a canal, which the source's ears lack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Bump:
    """What is raised or sunk. Millimetres, on the ear of the face's left.

    at : (y, z) its middle, seen from the side      reach : over which it fades, along y and z
    move : how far it goes along x (out), y and z
    """

    at: tuple[float, float]
    reach: tuple[float, float]
    move: tuple[float, float, float]


BUMPS: tuple[Bump, ...] = (
    Bump((12.4, 5.4), (2.8, 2.2), (-6.5, 0.0, 2.5)),  # the canal
    Bump((12.4, 9.6), (3.6, 2.2), (3.4, 0.0, -4.6)),  # the tragus before it
    Bump((5.6, 4.0), (2.2, 2.6), (2.2, 1.6, 0.0)),  # its counterpart below
)
OUTER = 0.055  # metres from the middle: nothing of the skull itself is moved


def sculpted_ears(points: NDArray) -> NDArray[np.float64]:
    """(m, 3) metres to move skin vertices (m, 3) by, from the head's joint and upright."""
    x, y, z = (1e3 * points).T
    out = np.zeros_like(points)
    for bump in BUMPS:
        far = ((y - bump.at[0]) / bump.reach[0]) ** 2 + ((z - bump.at[1]) / bump.reach[1]) ** 2
        out += np.exp(-0.5 * far)[:, None] * np.array(bump.move)
    ear = np.clip((np.abs(x) - 1e3 * OUTER) / 4, 0, 1)
    return 1e-3 * ear[:, None] * out * np.stack([np.sign(x), 0 * x + 1, 0 * x + 1], axis=1)
