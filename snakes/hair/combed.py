"""Which way short hair goes: whether it lies or stands up, and to which side it is combed then."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig.hair.cut import ANGLES

from .sight import RAYS, Outline, Sight

__all__ = ["combed"]

BAND, ABOVE = (0.012, 0.04), np.radians(75)
"""Metres inside the outline of hair, beyond the line that this is, and radians from straight up,
where strokes say whether hair stands."""
LIES, STANDS = -0.05, 0.45
"""Cosine of twice the angle between strokes and the way out of the head, 1 where they run so: the
mean of the most uneven hair that lies, and from which on all of it stands up."""
FRONT, OPEN, SWEPT = np.radians(30), 0.38, 0.3
"""Radians from the front, the height of a hairline there under which hair falls over the forehead,
and how far hair stands that is combed away from it."""
MOST = np.radians(60)
"""Radians from straight back that it is combed to a side."""


def combed(sight: Sight, outline: Outline, edge: NDArray) -> tuple[float, float | None]:
    """How far hair stands, 0 to 1, and in radians where it is swept from a forehead, as in `Cut`.

    outline : of the region;  edge : (48,) heights where hair ends

    At the outline of the head hair that lies runs along it, and hair that stands runs out of it;
    what leans there to a side is combed to it.
    """
    page = sight.page
    v, u = np.nonzero(page.hair)
    right = np.array([-sight.up[1], sight.up[0]])
    away = np.stack([u, v], axis=1) - sight.middle
    far = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
    turn = np.arctan2(away @ right, away @ sight.up)
    ray = np.clip(np.floor((turn / np.pi + 0.5) * RAYS), 0, RAYS - 1).astype(np.intp)
    inside = outline.far[ray] - far / sight.unit
    near = (np.abs(turn) < ABOVE) & (inside > BAND[0]) & (inside < BAND[1])
    weight = page.strokes.coherence[v, u] * near
    if weight.sum() < 1:
        return 0.0, None
    along = page.strokes.along[v, u]
    lean = np.arctan2(along @ right, along @ sight.up) - turn
    mean = complex((weight * np.exp(2j * lean)).sum() / weight.sum())
    stand = float(np.clip((mean.real - LIES) / (STANDS - LIES), 0, 1))
    front = np.abs((ANGLES + np.pi) % (2 * np.pi) - np.pi) < FRONT
    if stand < SWEPT or np.median(edge[front]) < OPEN:
        return stand, None
    return stand, float(np.clip(np.angle(mean) / 2, -MOST, MOST))
