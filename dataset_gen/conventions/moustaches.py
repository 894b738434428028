"""Moustaches by an artist's conventions: from a thin line to what hangs past the mouth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .artist import Artist
from .beards import beside_mouth, hairs, room
from .canvas import Canvas
from .mouth import Mouth
from .patches import COLUMNS, Patch, scalloped, ticks
from .shapes import even, smooth
from .sitter import Sitter

Range = tuple[float, float]


@dataclass(frozen=True)
class Form:
    """thick : of the way from lip to nose        over, drop : units that its ends are beyond and
    below the corners of the mouth        gap : of its width that the middle is bare
    ways : odds of how it is drawn
    """

    thick: Range
    over: Range
    drop: Range
    gap: Range
    ways: dict[str, float]


FORMS = {
    "line": Form((0.3, 0.5), (0.0, 0.12), (-0.03, 0.06), (0, 0), {"line": 1}),
    "hairs": Form((0.35, 0.7), (0.0, 0.12), (-0.03, 0.08), (0, 0.05), {"hairs": 1}),
    "black": Form((0.35, 0.75), (0.0, 0.14), (-0.03, 0.1), (0, 0), {"black": 1}),
    "pencil": Form((0.14, 0.24), (-0.06, 0.05), (-0.02, 0.04), (0, 0.12), {"line": 1, "dense": 1}),
    "brush": Form((0.6, 0.95), (0.0, 0.15), (0.0, 0.14), (0, 0), {"dense": 3, "mass": 1}),
    "horseshoe": Form((0.4, 0.75), (0.04, 0.1), (0.04, 0.1), (0, 0.04),
                      {"dense": 2, "hairs": 2, "mass": 1}),
    "handlebar": Form((0.35, 0.6), (0.1, 0.28), (-0.24, -0.02), (0, 0.05),
                      {"dense": 2, "mass": 1, "outline": 0.5}),
    "halves": Form((0.3, 0.65), (-0.02, 0.12), (-0.02, 0.1), (0.1, 0.24),
                   {"dense": 1, "hairs": 2, "mass": 1}),
    "few": Form((0.3, 0.65), (-0.03, 0.1), (-0.02, 0.08), (0, 0.2), {"few": 1}),
    "white": Form((0.5, 0.95), (0.02, 0.2), (0.0, 0.2), (0, 0.04), {"outline": 1}),
}  # fmt: skip
COVER = {"hairs": (0.25, 0.6), "dense": (0.7, 1.7), "mass": (0.3, 0.8)}


def draw_moustache(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    if artist.moustache == "none":
        return
    rng, form, mouth = canvas.rng, FORMS[artist.moustache], Mouth(sitter, artist)
    halves = _grown(sitter, mouth, form, rng)
    names = tuple(form.ways)
    odds = np.array([form.ways[name] for name in names])
    way = str(rng.choice(names, p=odds / odds.sum()))
    legs = []
    if artist.moustache == "horseshoe":
        legs = beside_mouth(sitter, mouth, rng, rng.uniform(0.35, 1.0))
    for patch in [*halves, *legs]:
        canvas.mark("beard", patch.outline)
    for patch in halves:
        _draw(canvas, sitter, patch, way)
    for patch in legs:
        cover = rng.uniform(*COVER["dense" if way == "mass" else way])
        hairs(canvas, sitter, patch, cover, 0.08 * sitter.unit, 1.0, 1.0, 0.2, 0.0)


def _grown(sitter: Sitter, mouth: Mouth, form: Form, rng: np.random.Generator) -> list[Patch]:
    """The whole of it, or its halves, from the picture's left to its right."""
    lip, unit = mouth.outer_upper, sitter.unit
    up = sitter.mark("nose_base") - lip[20]
    over, drop = rng.uniform(*form.over), rng.uniform(*form.drop) + rng.uniform(-0.02, 0.02, 2)
    ends = [
        lip[k]
        + unit * (side * min(over, room(sitter, lip[k], side)) * sitter.right + d * sitter.down)
        for k, side, d in ((0, -1, drop[0]), (-1, 1, drop[1]))
    ]
    # A thin one lies on the lip or halfway to the nose.
    thick = rng.uniform(*form.thick)
    lift = rng.uniform(0.05, max(0.1, min(0.4, 0.75 - thick)))
    hem = smooth(np.stack([ends[0], *(lip[[6, 13, 20, 27, 34]] + lift * up), ends[1]]), COLUMNS)
    t = np.linspace(-1, 1, COLUMNS)
    dent = rng.uniform(0, 0.4) * np.exp(-((t / 0.15) ** 2))
    profile = (1 - np.abs(t) ** rng.uniform(1.8, 5)) ** 0.7 * (1 - dent)
    top = hem + (thick * profile)[:, None] * up
    gap = rng.uniform(*form.gap)
    if gap < 0.05:
        return [Patch(hem, top)]
    return [Patch.between(top[own], hem[own]) for own in (t < -gap, t > gap)]


def _draw(canvas: Canvas, sitter: Sitter, patch: Patch, way: str) -> None:
    rng = canvas.rng
    if way == "line":
        for _ in range(int(rng.integers(1, 4))):
            share = rng.uniform(0.3, 0.7)
            line = share * patch.high + (1 - share) * patch.low
            canvas.line("beard", line, rng.uniform(0.9, 1.8))
    elif way == "black":
        canvas.fill(patch.outline)
    elif way == "outline":
        count, size = int(rng.integers(5, 14)), rng.uniform(0.01, 0.035) * sitter.unit
        # Down from the line that runs from the picture's left to its right is to its right.
        canvas.line("beard", scalloped(patch.low, size, count, 1.0), 0.9)
        canvas.line("beard", even(patch.high, 30), 0.9)
        _combed(canvas, sitter, patch, int(rng.choice([0, 4, 9])), 0.6)
    elif way == "few":
        _combed(canvas, sitter, patch, int(rng.integers(5, 14)), 0.9)
    else:
        if way == "mass":
            canvas.blacken(patch.outline, rng.uniform(1.2, 1.9), 1.0)
        size = float(np.clip(patch.tall.mean(), 3, None))
        cover = rng.uniform(*COVER[way])
        _combed(canvas, sitter, patch, patch.covered(canvas, cover, 0.8 * size, 0.85), 0.85)


def _combed(canvas: Canvas, sitter: Sitter, patch: Patch, count: int, width: float) -> None:
    """Hairs that fall from the middle to either side, the more the farther off."""
    rng = canvas.rng
    if not count:
        return
    across, up = patch.scattered(rng, count, rng.uniform(0.8, 1.4))
    t = np.clip(across, 0.02, 0.98)
    rim = patch.at(np.clip(t + 0.02, 0, 1), up) - patch.at(t - 0.02, up)
    rim /= np.maximum(np.hypot(*rim.T), 1e-6)[:, None]
    roots = patch.at(across, up)
    middle = (Mouth(sitter).line.mean(axis=0) - sitter.origin) @ sitter.right
    side = ((roots - sitter.origin) @ sitter.right - middle) / (0.3 * sitter.unit)
    lean = np.clip(rng.uniform(0.5, 2.5) * side, -2.5, 2.5) + 0.15 * rng.normal(size=count)
    ways = sitter.down + lean[:, None] * rim
    ways /= np.hypot(*ways.T)[:, None]
    tall = np.hypot(*(patch.at(across, np.ones(count)) - patch.at(across, np.zeros(count))).T)
    long = np.maximum(rng.uniform(0.4, 1.0, count) * tall, 0.03 * sitter.unit)
    roots = roots - (0.7 * (1 - up) * long)[:, None] * ways
    ticks(canvas, "beard", roots, long[:, None] * ways, width, rng.uniform(0.7, 1, count),
          rng.normal(0, 0.08))  # fmt: skip
