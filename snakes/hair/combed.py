"""Which way short hair goes: whether it lies or stands up, and to which side it is combed then."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig.hair.cut import ANGLES

from .sight import RAYS, Outline, Sight

__all__ = ["combed"]

BAND, ABOVE, ASIDE = (0.012, 0.04), np.radians(75), np.radians(23)
"""Metres inside the outline of hair, beyond the line that this is, and radians from straight up,
where strokes say whether hair stands; and from where on they are at a side of the head."""
LIES, STANDS = -0.25, 0.1
"""Cosine of twice the angle between strokes and the way out of the head, 1 where they run so, on
the side where it is less: the mean of the most uneven hair that lies, and from which on all of it
stands up. Hatching has one direction, and does not run out of the head on both sides."""
FRONT, OPEN = np.radians(30), 0.38
"""Radians from the front, and the height of a hairline there under which hair falls over the
forehead."""
SWEPT, MOST = 0.3, np.radians(50)
"""How far hair stands that is swept from a forehead, and radians from straight back that it is
swept to a side at most: farther it lies."""


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
    sides = turn < -ASIDE, turn > ASIDE
    if min(weight[side].sum() for side in sides) < 1:
        return 0.0, None
    along = page.strokes.along[v, u]
    lean = np.arctan2(along @ right, along @ sight.up) - turn
    out = weight * np.exp(2j * lean)
    least = min(float(out[side].real.sum() / weight[side].sum()) for side in sides)
    stand = float(np.clip((least - LIES) / (STANDS - LIES), 0, 1))
    front = np.abs((ANGLES + np.pi) % (2 * np.pi) - np.pi) < FRONT
    sweep = float(np.angle(out.sum())) / 2
    if stand < SWEPT or abs(sweep) > MOST or np.median(edge[front]) < OPEN:
        return stand, None
    return stand, sweep
