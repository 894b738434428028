"""Open mouths as comics draw them: one bold shape, larger than the sitter's mouth, without lips.

Where teeth meet they are a grid, or white blocks in black; the lips' landmarks go where the shape
has them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS

from .artist import Artist
from .canvas import Canvas
from .shapes import Points
from .sitter import Sitter

LEAST = 0.4  # units: no such mouth is drawn narrower, before it is made wider
ROOM = (0.06, 0.09, 0.74)  # of nose to chin: free above, free below, and the tallest mouth
STRETCHED = 0.5  # of its width, how much taller than the jaw opens it a mouth is drawn at most
BENDS = 0.25  # of its width, the most that a mouth bends
THIN = 0.6  # lips that nobody draws are so thick as those of the sitter
ROUND = {"oval": 2.2, "box": 5.0, "bean": 2.8, "trapezoid": 4.0, "crescent": 2.3}
TAPER = 0.3  # how much narrower a trapezoid is on one side
UPPER = ("lip_peak", "lip_upper", "lip_top", "lip_inner_top", "lip_inner_upper")
LOWER = ("lip_lower", "lip_bottom", "lip_inner_bottom", "lip_inner_lower")


@dataclass(frozen=True)
class Grin:
    """The rims of a mouth by a shape, from the picture's left to its right.

    upper, lower : (k, 2) pixels, at the same places across        moved : landmarks (m, 2) -> where
    they are with the lips on these rims
    """

    upper: Points
    lower: Points
    before: tuple[Points, Points]

    @classmethod
    def of(cls, sitter: Sitter, artist: Artist, upper: Points, lower: Points) -> Grin:
        """Instead of rims (k, 2) that are apart."""
        count = len(upper)
        across, width = _across(upper)
        down = np.array([-across[1], across[0]])
        gap = float(((lower - upper) @ down).max())
        middle = (upper[0] + upper[-1]) / 2
        line = (upper + lower)[count // 2] / 2
        bends = float((line - middle) @ down) / width
        narrow = LEAST * sitter.unit * np.sqrt(max(1 - sitter.turn**2, 0.2))
        wide = artist.grin_wide * max(width, narrow)
        tall = max(gap, min(artist.grin_tall * wide, gap + STRETCHED * wide))
        # Between nose and chin, whatever is drawn.
        nose, chin = (float((sitter.mark(n) - middle) @ down) for n in ("nose_base", "chin"))
        room = max(chin - nose, 1e-6)
        tall = min(tall, ROOM[2] * room)
        x = -np.cos(np.linspace(0, np.pi, count))
        top, bottom = _heights(artist, x, bends)
        bend = np.clip(bends, -BENDS, BENDS) * wide * (1 - x**2)
        high, low = bend - tall * top, bend + tall * bottom
        place = float((line - middle) @ down) - float(high.min() + low.max()) / 2
        place += max(nose + ROOM[0] * room - (place + high.min()), 0.0)
        place -= max(place + low.max() - (chin - ROOM[1] * room), 0.0)
        taper = TAPER * np.tanh(8 * artist.grin_tilt) if artist.grin == "trapezoid" else 0.0
        wider = [
            1 + taper * top / max(top.max(), 1e-6),
            1 - taper * bottom / max(bottom.max(), 1e-6),
        ]
        c, s = np.cos(artist.grin_tilt), np.sin(artist.grin_tilt)
        right, along = c * across + s * down, c * down - s * across
        origin = middle + artist.grin_aside * wide * across + place * down
        rims = [
            origin + (wide / 2 * x * own)[:, None] * right + v[:, None] * along
            for own, v in zip(wider, (high, low), strict=True)
        ]
        return cls(rims[0], rims[1], (upper, lower))

    def moved(self, points: NDArray) -> Points:
        """The face's landmarks (m, 2) with those of the lips on these rims."""
        old, new = self.before, (self.upper, self.lower)
        across, width = _across(old[0])
        down = np.array([-across[1], across[0]])
        share = np.clip((points - old[0][0]) @ across / width, 0, 1)
        out = points.copy()
        for k, name in enumerate(LANDMARKS):
            if name.startswith(UPPER + LOWER):
                edge = int(name.startswith(LOWER))
                rim = _at(old[edge], share[k])
                off = float((points[k] - rim) @ down)
                out[k] = _at(new[edge], share[k]) + THIN * off * down
            elif name.startswith("mouth_"):
                out[k] = (_at(new[0], share[k]) + _at(new[1], share[k])) / 2
        return out


def _across(rim: NDArray) -> tuple[NDArray, float]:
    """The way across a mouth, a unit vector, and its width."""
    way = rim[-1] - rim[0]
    width = max(float(np.hypot(*way)), 1e-6)
    return way / width, width


def _at(rim: NDArray, share: float) -> Points:
    """(2,) the point of a rim (k, 2) a share of the way across."""
    across, width = _across(rim)
    far = (rim - rim[0]) @ across / width
    return np.array([np.interp(share, far, rim[:, axis]) for axis in (0, 1)])


def _heights(artist: Artist, x: NDArray, bends: float) -> tuple[NDArray, NDArray]:
    """How far above and below its middle a shape reaches at places x (k,) from -1 to 1, in its
    height. bends : how far its middle is below its corners, in its width"""
    power = ROUND[artist.grin]
    side = np.clip(1 - np.abs(x) ** power, 0, 1) ** (1 / power)
    if artist.grin == "crescent":
        flat = 0.06 * (1 - x**2)
        return (side, flat) if bends < -0.02 else (flat, side)
    if artist.grin == "bean":
        side = side * (1 + 0.25 * np.sign(artist.grin_aside) * x)
    return 0.5 * side, 0.5 * side


def draw_grid(canvas: Canvas, upper: Points, lower: Points, bold: float) -> None:
    """Teeth that meet: a line where they do, and lines between them."""
    rng, x = canvas.rng, np.linspace(0.02, 0.98, 15)
    thin = bold * rng.uniform(0.4, 0.9)
    if rng.random() < 0.85:
        share = rng.uniform(0.4, 0.6)
        line = [(1 - share) * _at(upper, t) + share * _at(lower, t) for t in x]
        canvas.line("mouth", np.array(line), thin)
    count = int(rng.integers(2, 9))
    for t in (np.arange(count) + rng.uniform(0.4, 0.6)) / count + rng.normal(0, 0.012, count):
        ends = np.stack([_at(upper, t), _at(lower, t)])
        canvas.line("mouth", np.stack([ends[0], ends.mean(axis=0), ends[1]]), thin, loose=0.5)


def draw_blocks(canvas: Canvas, upper: Points, lower: Points, meet: bool) -> None:
    """White teeth with gaps in a black mouth. meet : those of a shut jaw"""
    rng = canvas.rng
    for rim, other in ((upper, lower), (lower, upper)):
        count = int(rng.integers(1, 6)) if meet or rim is upper or rng.random() < 0.6 else 0
        long = 0.5 if meet else rng.uniform(0.25, 0.42)
        begin, end = rng.uniform(0.08, 0.25), rng.uniform(0.75, 0.92)
        for k in range(count):
            gap = rng.uniform(0.06, 0.3)
            ends = begin + (end - begin) * (k + np.array([gap, 1 - gap])) / count
            roots = np.array([_at(rim, t) for t in ends])
            tips = np.array([(1 - long) * _at(rim, t) + long * _at(other, t) for t in ends])
            canvas.cover(np.concatenate([roots, tips[::-1]]))
    canvas.blacken(np.concatenate([upper, lower[::-1]]), kind="mouth")
