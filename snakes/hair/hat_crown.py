"""A hat's crown blown up from its outline on a page.

How wide a crown is drawn at each level says how wide it is there from every side: each level is the
ring that the head is at the rim, grown or shrunk to the drawn width, and shifted as the drawing's
middle is (a surface of revolution, but for a ring that is no circle; after Igarashi, Matsuoka,
Tanaka 1999, who inflate outlines). What is seen is met exactly; what is not seen is as tall, and
tapers alike, so that a hat looks the same kind of hat from every side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from facs_rig.hair.cut import ANGLES
from facs_rig.hair.hat import ways_of
from facs_rig.hair.head import Head

from .sight import Sight, direction

__all__ = ["inflated", "is_cut", "without_juts"]

LEVEL, EVEN = 0.003, 2.5
"""Metres from a level to the next, and levels over which the outline is evened."""
ABOVE = (0.008, 0.03)
"""Metres above the rim between which a crown is as wide as at its rim."""
HALF, LOWER = 1.12, 0.45
"""Times the width at this share of a crown's height that it is wide below at most: a dome is 1.12
times as wide at its rim, and what juts out farther is a brim or a peak."""
NARROWEST, FOOT = 0.045, 0.85
"""Metres that a crown is wide at its top at least, and share of its width half the way down that it
has at its foot at least."""
SHALLOW = 0.045
"""Metres that a crown is high below which all of it is as wide as it is."""
FLARES = 1.04
"""Times the width at the rim that it is seen from the side at most, however it flares in front: a
flat cap hangs over at its sides, not behind."""
CUT = 0.6
"""Share of its greatest width that a crown is wide where the page's upper edge cuts it off."""
OVER = 0.022
"""Metres that a crown which the page's upper edge cuts off is higher than the skull."""
REACH, STEP = 0.42, 0.0025
"""Metres from the head's middle within which a crown is looked for, and from place to place."""
WIDEST = 2.2
"""Times the head's width that a crown is wide at most."""


def is_cut(hat: NDArray[np.bool_]) -> bool:
    """Whether a page's upper edge cuts a region off: it is about as wide there as it is at all."""
    wide = hat.sum(axis=1)
    first = int((wide > 0).argmax())
    return bool(wide[first : first + 3].max() > CUT * wide.max())


def without_juts(sight: Sight, edge: NDArray) -> NDArray[np.bool_]:
    """(h, w) a crown's region without what juts out of its foot farther than a dome does."""
    seen = _outline(sight, edge)
    hat = sight.page.hair
    if seen is None or np.ptp(seen.levels) < SHALLOW:
        return hat
    left, right = seen.bounds()
    v, u = np.nonzero(hat)
    x, y = sight.metres(np.stack([u, v], axis=1)).T
    y = y / _upright(sight)
    low, high = (np.interp(y, seen.levels, side) for side in (left, right))
    foot = y < seen.levels[0] + LOWER * (seen.levels[-1] - seen.levels[0])
    out = np.zeros(hat.shape, dtype=bool)
    out[v, u] = ~foot | ((x >= low) & (x <= high))
    return out


def _upright(sight: Sight) -> float:
    return max(float(sight.directions[1, 1]), 0.3)


def _outline(sight: Sight, edge: NDArray) -> _Outline | None:
    """The outline above where the rim is at its sides."""
    axes, head = sight.directions, sight.head
    aside = np.array([axes[0, 0], axes[0, 2]])
    metres = head.metres(edge)
    ring = head.levels(head.axis, ANGLES, metres)[:, None] * direction(ANGLES)
    rim = metres - (head.middle[1] - head.eyes[1])
    return _Outline.of(sight, _upright(sight), float(np.average(rim, weights=(ring @ aside) ** 4)))


def inflated(sight: Sight, edge: NDArray, steps: int) -> NDArray[np.float64] | None:
    """(48, steps) metres that a crown stands off the skin as in `Hat.thick`, or None where nothing
    of it is seen above its rim.

    sight : of the crown's region;  edge : (48,) heights of the rim
    """
    head = sight.head
    axes = sight.directions
    right = np.array([axes[0, 0], axes[0, 2]])
    aside = right / max(np.linalg.norm(right), 1e-6)
    deep = np.array([-aside[1], aside[0]])
    ring = head.levels(head.axis, ANGLES, head.metres(edge))[:, None] * direction(ANGLES)
    seen = _outline(sight, edge)
    if seen is None:
        return None
    across = ring @ aside
    wide, shift = _grown(seen, across.min(), across.max())
    at_rim = wide[seen.at_rim(ABOVE)]
    begin = float(np.median(at_rim)) if at_rim.size else float(wide[0])
    # As far off the head in front and behind as at its sides, or as far in as it tapers there.
    half, long = np.ptp(across) / 2, np.ptp(ring @ deep) / 2
    skull = head.levels(head.axis, ANGLES[:, None], seen.levels + head.middle[1] - head.eyes[1])
    skull = skull[..., None] * direction(ANGLES)[:, None]
    beside, before = (np.ptp(skull @ way, axis=0) / 2 for way in (aside, deep))
    off = np.maximum(wide * half - beside, 0)
    at_foot = 1 + (begin - 1) * half / long
    depth = np.maximum(at_foot * wide / begin, (before + off) / long)
    depth = np.minimum(depth, FLARES * at_foot)

    ways = ways_of(head, edge, ANGLES, np.linspace(0, 1, steps))
    far = np.arange(STEP, REACH, STEP)
    places = far[:, None, None, None] * ways
    level = (places[..., 1] - seen.levels[0]) / LEVEL
    index = np.clip(np.rint(level).astype(int), 0, len(seen.levels) - 1)
    flat = places[..., [0, 2]]
    x = (flat @ aside - shift[index]) / wide[index]
    z = flat @ deep / depth[index]
    azimuth = np.arctan2(x * aside[0] + z * deep[0], x * aside[1] + z * deep[1])
    radius = np.interp(azimuth, ANGLES, np.hypot(*ring.T), period=2 * np.pi)
    inside = (np.hypot(x, z) <= radius) & (level <= len(seen.levels) - 0.5)
    out = len(far) - inside[::-1].argmax(axis=0)
    reached = np.where(inside.any(axis=0), far[np.minimum(out - 1, len(far) - 1)], 0.0)
    return reached - head.rays(head.covered, ways)


@dataclass(frozen=True)
class _Outline:
    """levels : (n,) metres above the head's middle, rising;  left, right : (n,) metres on the page
    there;  rim : metres, where its sides end"""

    levels: NDArray[np.float64]
    left: NDArray[np.float64]
    right: NDArray[np.float64]
    rim: float

    @classmethod
    def of(cls, sight: Sight, upright: float, rim: float) -> _Outline | None:
        v, u = np.nonzero(sight.page.hair)
        x, y = sight.metres(np.stack([u, v], axis=1)).T
        y = y / upright
        first, last = rim, float(y.max())
        if last - first < 3 * LEVEL:
            return None
        levels = np.arange(first, last + LEVEL / 2, LEVEL)
        k = np.rint((y - first) / LEVEL).astype(int)
        left, right = np.full(len(levels), np.inf), np.full(len(levels), -np.inf)
        ok = (k >= 0) & (k < len(levels))
        np.minimum.at(left, k[ok], x[ok])
        np.maximum.at(right, k[ok], x[ok])
        # What is narrow above the crown is a button or a stray line; what is narrow at its foot is
        # where the rim rises to one side.
        wide = np.where(np.isfinite(left), right - left, 0.0)
        known = wide > NARROWEST
        if known.sum() < 3:
            return None
        last = np.flatnonzero(known)[-1] + 1
        levels, left, right = levels[:last], left[:last], right[:last]
        known, wide = known[:last], wide[:last]
        half = len(levels) // 2
        foot = np.median(wide[half // 2 : half + 1])
        known[:half] &= wide[:half] > FOOT * foot
        left, right = (np.interp(levels, levels[known], side[known]) for side in (left, right))
        whole = cls(levels, left, right, rim)
        return whole._closed(sight.head) if is_cut(sight.page.hair) else whole

    def _closed(self, head: Head) -> _Outline:
        """With a top above the page's upper edge, where that cuts it off below the skull's."""
        last = self.levels[-1]
        top = head.eyes[1] + head.above - head.middle[1] + OVER
        more = np.arange(last + LEVEL, top, LEVEL)
        share = np.sqrt(np.clip(1 - ((more - last) / max(top - last, LEVEL)) ** 2, 0, 1))
        left, right = self.left[-1], self.right[-1]
        middle, half = (left + right) / 2, (right - left) / 2
        return _Outline(
            np.concatenate([self.levels, more]),
            np.concatenate([self.left, middle - half * share]),
            np.concatenate([self.right, middle + half * share]),
            self.rim,
        )

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """`left` and `right` without what juts out at the foot."""
        half = min(int(LOWER * len(self.levels)), len(self.levels) - 1)
        near = slice(max(half - 2, 0), half + 3)
        middle = float(np.median((self.left + self.right)[near])) / 2
        sides = []
        for side, line in ((-1, self.left), (1, self.right)):
            out = side * (line - middle)
            out[:half] = np.minimum(out[:half], HALF * np.median(out[near]))
            sides.append(middle + side * out)
        return sides[0], sides[1]

    def at_rim(self, above: tuple[float, float]) -> NDArray[np.bool_]:
        up = self.levels - self.rim
        return (up >= above[0]) & (up <= above[1])


def _grown(seen: _Outline, low: float, high: float) -> tuple[NDArray, NDArray]:
    """(n,) times that the ring is wide at each level, and metres that it is shifted.

    low, high : metres, where the ring itself ends on the page
    """
    left, right = (gaussian_filter1d(side, EVEN, mode="nearest") for side in seen.bounds())
    wide = np.clip((right - left) / (high - low), 0.02, WIDEST)
    shift = (left + right) / 2 - (low + high) / 2 * wide
    return wide, shift
