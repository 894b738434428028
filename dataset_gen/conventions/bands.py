"""What is worn on hair and leaves most of it to be seen: ribbons, bows, wreaths, headbands."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .crown import tail, worn
from .cut import STEPS, Hair
from .flow import mix
from .patches import Patch
from .shapes import Points, ellipse, normals, smooth, wave
from .sitter import Sitter
from .textures import CLOTH, WOOL, material, texture

# Of each: the share of the way from hairline to crown at which it crosses the middle of the head,
# and half its width in units.
LIES = {"band": ((0.0, 0.9), (0.05, 0.1)), "headband": ((-0.3, 0.7), (0.08, 0.18)),
        "wreath": ((-0.1, 0.6), (0.02, 0.06)), "bow": ((0.05, 0.9), (0.05, 0.15))}  # fmt: skip
# Knots around a loop of a bow in its own lengths, outward and upward: round, and as a leaf.
LOOPS = (
    ((0.0, 0.1), (0.4, 0.42), (0.85, 0.55), (1.05, 0.25), (0.8, -0.1), (0.4, -0.15), (0.0, -0.1)),
    ((0.0, 0.1), (0.35, 0.4), (0.75, 0.6), (1.1, 0.75), (0.95, 0.25), (0.5, -0.05), (0.0, -0.1)),
)


def draw_band(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """What lies on the hair from one side of the head to the other, and what is tied to it."""
    if artist.hat not in LIES:
        return
    rng = canvas.rng
    high, wide = LIES[artist.hat]
    t = np.linspace(0, 1, 41)
    first, last = np.array([0, STEPS - 1]) + rng.uniform(-1, 9, 2) * (1, -1)
    up = 1 - (1 - rng.uniform(*high)) * np.sin(np.pi * t) ** rng.uniform(0.35, 0.9)
    up = up + rng.normal(0, 0.12) * (t - 0.5)
    line = smooth(mix(hair, np.clip(first + (last - first) * t, 0, STEPS - 1), up)[::4], 41)
    half = rng.uniform(*wide) * sitter.unit * (0.4 + 0.6 * np.sin(np.pi * t) ** 0.5)
    away = normals(line) * half[:, None]
    band = Patch(line + away, line - away)
    if artist.hat == "wreath":
        _blossoms(canvas, sitter, line)
    elif artist.hat == "bow":
        draw_bow(canvas, sitter, artist, band.at(rng.uniform(0.15, 0.85), 0.5))
    if artist.hat == "headband" and rng.random() < 0.2:
        draw_bow(canvas, sitter, artist, band.at(rng.uniform(0.2, 0.8), 0.5))
    if artist.hat in ("headband", "bow") and rng.random() < 0.6:
        odds = WOOL if artist.hat == "headband" else CLOTH
        texture(canvas, sitter, band, material(rng, artist, odds))
    if artist.hat == "band":  # too narrow to be told as a hat
        canvas.line("hat", band.low, 1.0)
        canvas.line("hat", band.high, 1.0)
        canvas.cover(band.outline)
    else:
        worn(canvas, np.concatenate([band.outline, band.outline[:1]]))


def draw_bow(canvas: Canvas, sitter: Sitter, artist: Artist, place: Points) -> None:
    """A knot at a place (2,), two loops that stand up from it, and perhaps two ends."""
    rng = canvas.rng
    size = rng.uniform(0.25, 0.6) * sitter.unit
    loop = np.array(LOOPS[int(rng.integers(len(LOOPS)))])
    rise, slim = rng.uniform(-0.2, 0.5), rng.uniform(0.6, 1.2)
    turn = rng.normal(0, 0.25)
    out = np.cos(turn) * sitter.right + np.sin(turn) * sitter.down
    above = np.sin(turn) * sitter.right - np.cos(turn) * sitter.down
    wide, tall = size * rng.uniform(0.14, 0.26, 2)
    knot = ellipse(place, wide, tall, turn, 19)
    worn(canvas, knot, 0.9)
    black = artist.finish == "black" and rng.random() < 0.3
    folds = int(rng.integers(0, 5))
    for side in (-1, 1):
        x, y = (loop + 0.05 * rng.normal(size=loop.shape)).T
        y = slim * y + rise * x
        outline = place + size * (side * x[:, None] * out + y[:, None] * above)
        shape = smooth(outline, 33)
        if black:
            canvas.blacken(shape, float(rng.uniform(0, 3)))
        for share in rng.uniform(-0.6, 0.6, folds):
            far = rng.uniform(0.3, 0.75)
            tip = size * (side * far * out + (rise * far + 0.25 * share + 0.12) * above)
            canvas.line("hat", smooth(np.stack([place, place + 0.5 * tip, place + tip]), 9), 0.7)
        worn(canvas, shape)
    if rng.random() < 0.35:
        for side in (-1, 1):
            foot = place + size * (rng.uniform(0.3, 0.8) * side * out - rng.uniform(0.5, 1) * above)
            worn(canvas, tail(place, foot, rng.uniform(0.05, 0.1), sitter, 0.03 * side).outline)


def _blossoms(canvas: Canvas, sitter: Sitter, line: Points) -> None:
    """Flowers, leaves or both along a line (k, 2), those in front first."""
    rng = canvas.rng
    size = rng.uniform(0.09, 0.22)
    many = int(np.clip(rng.uniform(2.2, 3.4) / size, 9, 30))
    leaves, petals = rng.choice([0.0, 0.3, 0.6, 1.0]), int(rng.integers(4, 9))
    turn, t = np.linspace(0, 2 * np.pi, 33), np.linspace(-1, 1, 17)
    ways = normals(line)
    for share in rng.permutation(np.linspace(0.02, 0.98, many)):
        k = round(share * (len(line) - 1))
        r = size * sitter.unit * rng.uniform(0.7, 1.2) * (0.75 + 0.25 * np.sin(np.pi * share))
        place = line[k] + 0.4 * r * rng.normal() * ways[k]
        if rng.random() < leaves:
            along = rng.uniform(-1, 1) * ways[k] + rng.choice([-1, 1]) * sitter.right
            along /= np.linalg.norm(along)
            tip = place + r * t[:, None] * along
            wide = 0.4 * r * (1 - t**2)[:, None] * np.array([-along[1], along[0]])
            canvas.line("hat", tip, 0.6)
            worn(canvas, np.concatenate([tip + wide, (tip - wide)[::-1]]), 0.9)
            continue
        far = r * (1 + 0.22 * np.cos(petals * turn) + 0.1 * wave(rng, 1, 33, 1)[0])
        far[-1] = far[0]
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        flower = place + far[:, None] * ring
        canvas.line("hat", place + 0.3 * r * ring[::3], 0.7)
        for a in rng.uniform(0, 2 * np.pi, int(rng.integers(0, petals + 1))):
            way = np.array([np.cos(a), np.sin(a)])
            canvas.line("hat", place + r * np.array([[0.35], [0.6], [0.85]]) * way, 0.6)
        worn(canvas, flower, 0.9)
