"""Where hair lies by an artist's conventions: between an inner and an outer line, and falls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .shapes import Points, part, smooth, wave
from .sitter import RAYS, Sitter

# Of the skull's radius: how far each cut stands off, times the artist's volume.
STANDS = {"receding": 0.25, "crop": 0.25, "short": 0.7, "swept": 1.1, "fringe": 0.8, "bob": 1.0,
          "long": 1.0, "bun": 0.35, "tail": 0.35, "afro": 2.4, "tufts": 0.6, "bald": 0.0,
          "rim": 0.35, "quiff": 1.0, "flat": 1.4, "shorn": 0.12}  # fmt: skip
LONG = ("bob", "long")
BARE = ("bald", "rim")  # the top of the skull is seen
GATHERED = ("bun", "tail")
STEPS = 48


@dataclass(frozen=True)
class Hair:
    """Hair on the page: between an inner and an outer line over the head (STEPS, 2), from the
    picture's left to its right, and on down beside the face.

    falls : outer and inner line of what hangs down at the left and at the right, or None
    tips : the lower end of each, from its outer line to its inner one
    """

    inner: Points
    outer: Points
    falls: tuple[tuple[Points, Points] | None, tuple[Points, Points] | None] = (None, None)
    tips: tuple[Points, ...] = ()

    def between(self, begin: float, end: float) -> Hair:
        """From one share of the way over the head to another, without what hangs down."""
        inner, outer = (smooth(part(line, begin, end), STEPS) for line in (self.inner, self.outer))
        return Hair(inner, outer)

    def shape(self) -> Points:
        """The outline of all of it."""
        left, right = self.falls
        line = [self.outer]
        if right:
            line += [right[0], self.tips[1], right[1][::-1]]
        line.append(self.inner[::-1])
        if left:
            line += [left[1], self.tips[0][::-1], left[0][::-1]]
        return np.concatenate(line)


def cut_hair(canvas: Canvas, sitter: Sitter, artist: Artist) -> Hair:
    """Where this artist's hair lies on this head."""
    rng, cut = canvas.rng, artist.cut
    centre = sitter.face.mean(axis=0)
    reach = (0.25 if cut in LONG else 0.3 if cut in ("afro", "rim") else 0.275) * RAYS
    rays = np.linspace(-reach, reach, STEPS)
    angle = 2 * np.pi * rays / RAYS
    face, head = (_radius(line, centre, rays) for line in (sitter.face, sitter.head))
    top = np.cos(np.clip(angle, -np.pi / 2, np.pi / 2)) ** 0.7
    sides = rng.uniform(0.2, 0.9)
    stand = STANDS[cut] * artist.volume * (sides + (1 - sides) * top) * sitter.unit
    if cut == "afro":
        stand = STANDS[cut] * artist.volume * sitter.unit * (0.7 + 0.3 * top) + 0.05 * sitter.unit
    elif cut in ("quiff", "shorn"):
        # It stands up above the forehead, more at one side, or is too short to stand off.
        high = np.exp(-(((angle - rng.normal(0, 0.25)) / rng.uniform(0.3, 0.6)) ** 2))
        risen = rng.uniform(1.0, 3.0) * high * (cut == "quiff")
        stand = STANDS[cut] * artist.volume * sitter.unit * (rng.uniform(0.1, 0.5) + risen)
    if artist.crowned:
        stand = 0.15 * stand  # pressed down
    outer = np.maximum(head, face) + stand + 0.015 * sitter.unit
    inner = np.minimum(face, head)
    if cut == "rim":
        # From the crown's sides it comes forward to the temples.
        grown = np.clip((np.abs(angle) - rng.uniform(0.6, 1.2)) / rng.uniform(0.15, 0.7), 0, 1)
        outer = np.maximum(head, face) + grown * (stand + 0.015 * sitter.unit)
        inner = outer - grown * np.maximum(outer - inner * rng.uniform(0.88, 1.03), 0)
    elif cut == "receding":
        inner = inner * (1 + 0.28 * np.exp(-((np.abs(angle) - 0.45) ** 2) / 0.07))
        inner = np.minimum(inner, outer - 0.02 * sitter.unit)
    elif cut in LONG:  # it hangs over the temples, more to one side of the parting
        over = (rng.uniform(0, 0.2, 2) * _roomy(sitter))[(angle > 0.6 * artist.parting).astype(int)]
        inner = inner * (1 - over * np.clip(np.abs(angle - 0.6 * artist.parting), 0, 1))
    ways = np.sin(angle)[:, None] * sitter.right - np.cos(angle)[:, None] * sitter.down
    inner_line, outer_line = (centre + r[:, None] * ways for r in (inner, outer))
    if cut == "flat":
        outer_line = _flattened(outer_line, head[STEPS // 2] / sitter.unit, sitter, rng)
    if cut in LONG:
        # It hangs straight down from where it is widest.
        x, y = sitter.local(outer_line).T
        half = STEPS // 2
        x[half:] = np.maximum.accumulate(x[half:])
        x[:half] = np.minimum.accumulate(x[:half][::-1])[::-1]
        outer_line = sitter.at(x, y)
        falls = _falls(sitter, artist, inner_line, outer_line, rng)
        hang = rng.uniform(0.03, 0.16) * sitter.unit
        tips = tuple(_tips(sitter, fall, hang, rng) for fall in falls)
        return Hair(inner_line, outer_line, falls, tips)
    return Hair(inner_line, outer_line)


def _flattened(outer: Points, skull: float, sitter: Sitter, rng: np.random.Generator) -> Points:
    """An outer line that is cut level above the skull, with corners; skull : units, its height."""
    x, y = sitter.local(outer).T
    level = y.min() + rng.uniform(0.1, 0.6) * (np.ptp(y) - skull) * (np.ptp(y) > skull)
    level = level + rng.normal(0, 0.05) * x
    square = rng.uniform(0.6, 0.92)
    side = rng.uniform(0.85, 1.0) * np.abs(x - x.mean()).max()
    corner = (np.abs(x - x.mean()) > 0.45 * side) & (y < level + 0.35 * skull)
    wide = x.mean() + np.sign(x - x.mean()) * np.maximum(np.abs(x - x.mean()), square * side)
    return sitter.at(np.where(corner, wide, x), np.maximum(y, level))


def _tips(
    sitter: Sitter, fall: tuple[Points, Points], hang: float, rng: np.random.Generator
) -> Points:
    """The lower end of what hangs down: round, or in points."""
    t = np.linspace(0, 1, 13)
    line = fall[0][-1] + t[:, None] * (fall[1][-1] - fall[0][-1])
    low = np.sin(np.pi * t) * hang
    if rng.random() < 0.5:
        low = low + hang * np.abs(wave(rng, 1, 13, 2.5)[0]) * (t > 0) * (t < 1)
    return line + low[:, None] * sitter.down


def _roomy(sitter: Sitter) -> NDArray[np.float64]:
    """(2,) how much of the cheek at the picture's left and right hair may hide: none far away."""
    far = np.array([-sitter.turn, sitter.turn])
    return np.clip(1 - 3 * far, 0, 1)


def _radius(line: Points, centre: Points, rays: NDArray) -> NDArray:
    return np.interp(rays, np.arange(RAYS + 1), np.linalg.norm(
        np.concatenate([line, line[:1]]) - centre, axis=1), period=RAYS)  # fmt: skip


def _falls(
    sitter: Sitter, artist: Artist, inner: Points, outer: Points, rng: np.random.Generator
) -> tuple[tuple[Points, Points], tuple[Points, Points]]:
    """What hangs beside the face: lines from the ends of inner and outer down to the tips."""
    flare, curl = rng.uniform(0.0, 0.35), rng.normal(0, 0.14)
    under, waves = rng.uniform(0.35, 0.9), rng.choice([0.0, 0.015, 0.04]) * sitter.unit
    sides = []
    for side, k in ((-1, 0), (1, -1)):
        (ix, iy), (ox, oy) = (sitter.local(line[k]) * [side, 1] for line in (inner, outer))
        ox = max(ox, ix + 0.1)
        end = max(artist.reach + rng.normal(0, 0.05), iy + 0.4)
        jaw = min(ix, 0.68) - rng.uniform(0, 0.08) * _roomy(sitter)[k]
        outside = [(ox, oy), (ox + 0.35 * flare, oy + 0.2 * (end - oy)),
                   (ox + flare, oy + 0.65 * (end - oy)), (ox + flare + curl, end)]  # fmt: skip
        inside = [(ix, iy), (jaw, iy + 0.45 * (min(end, 0.9) - iy)), (jaw + 0.02, min(end, 0.9)),
                  (jaw + (under - 0.6) * np.clip(end - 0.9, 0.05, 1), end - 0.05)]  # fmt: skip
        if end < 1.0:
            inside = [*inside[:2], (jaw + 0.05 + 0.5 * curl, end - 0.03)]
        lines = []
        for knots in (outside, inside):
            x, y = smooth(np.array(knots), 26).T
            swing = waves * wave(rng, 1, 26, 1.5)[0] * np.linspace(0, 1, 26)
            lines.append(sitter.at(side * x, y) + swing[:, None] * sitter.right)
        sides.append((lines[0], lines[1]))
    return sides[0], sides[1]
