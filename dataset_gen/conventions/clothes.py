"""What is worn on the shoulders, by lines alone, or dark: hatched, in strokes like hair, black."""

from __future__ import annotations

import numpy as np

from .artist import Artist, lot
from .canvas import Canvas
from .mop import bent
from .shapes import Points, smooth
from .sitter import Sitter

# How often it is dark, by what is worn, and by who draws it.
DARK = {"slope": 0.25, "crew": 0.3, "v": 0.3, "shirt": 0.35, "suit": 0.65}
DARKER = {"portrait": 1.0, "comic": 1.0, "cartoon": 0.5, "naive": 0.4}
BUNDLES, EACH = 60, 6  # of strokes on cloth, and strokes in each, at most


def draw_clothes(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """Shoulders from the neck's foot to the page's edge, and what is worn on them."""
    if artist.clothes == "none":
        return
    rng, at = canvas.rng, sitter.at
    feet = sitter.local(sitter.neck[:, -1])
    base = float(feet[:, 1].mean()) - rng.uniform(0.0, 0.2)
    middle = float(feet[:, 0].mean())
    slope, wide = rng.uniform(0.15, 0.5), rng.uniform(0.75, 1.15)
    dark = rng.random() < DARK[artist.clothes] * DARKER[artist.manner]
    shoulders = []
    for foot, side in zip(feet, (-1, 1), strict=True):
        x = foot[0] + side * wide * np.array([0.0, 0.06, 0.3, 0.85, 1.12, 1.22])
        y = base + np.array(
            [-0.2, -0.02, 0.1 + 0.3 * slope, 0.2 + slope, 0.42 + slope, 1.2 + slope]
        )
        shoulders.append(smooth(at(x, y), 30))
        canvas.line("clothes", shoulders[-1], 1.0)
    left, right = feet[0, 0], feet[1, 0]
    neckline = at(np.array([left, right]), base + np.array([0.0, 0.0]))
    lapels: list[Points] = []
    if artist.clothes == "crew":
        t = np.linspace(0, 1, 14)
        x = left + (right - left) * t
        for drop in (0.16, 0.25):
            dip = np.sin(np.pi * t) * drop
            neckline = at(x + (t - 0.5) * drop * 0.6, base + dip)
            canvas.line("clothes", neckline, 0.9)
    elif artist.clothes == "v":
        deep = rng.uniform(0.4, 0.8)
        neckline = at(np.array([left, middle, right]), base + deep * np.array([0, 1.0, 0]))
        for foot in (left, right):
            canvas.line("clothes", at(np.array([foot, (foot + middle) / 2, middle]),
                                      base + deep * np.array([0, 0.55, 1.0])), 0.9)  # fmt: skip
    elif artist.clothes in ("shirt", "suit"):
        for foot, side in ((left, -1), (right, 1)):
            x = np.array(
                [
                    foot,
                    foot - 0.02 * side,
                    middle + 0.12 * side,
                    middle + 0.42 * side,
                    foot + 0.22 * side,
                ]
            )
            y = base + np.array([-0.12, 0.0, 0.34, 0.36, 0.02])
            collar = at(x, y)
            canvas.line("clothes", collar, 0.9)
            if artist.clothes == "shirt" and dark and rng.random() < 0.5:
                _darkened(canvas, sitter, collar, *_cloth(rng, artist))
            canvas.cover(collar)
        canvas.line("clothes", at(np.array([middle, middle]), base + np.array([0.3, 1.4])), 0.7)
        if artist.clothes == "suit":
            for side in (-1, 1):
                x = middle + side * np.array([0.42, 0.75, 0.6, 0.5, 0.12])
                y = base + np.array([0.12, 0.5, 0.62, 0.72, 1.5])
                canvas.line("clothes", at(x, y), 0.9)
                lapels.append(at(x, y))
            tie = at(middle + np.array([-0.09, 0.09, 0.06, 0.15, 0.0, -0.15, -0.06]),
                     base + np.array([0.32, 0.32, 0.5, 1.3, 1.5, 1.3, 0.5]))  # fmt: skip
            if rng.random() < 0.5:
                canvas.blacken(tie, 1.2, 1.0 if artist.finish == "black" else 2.2)
            canvas.line("clothes", np.concatenate([tie, tie[:1]]), 0.8)
    if dark:
        _dark(canvas, sitter, artist, shoulders, neckline, lapels)


def _dark(
    canvas: Canvas, sitter: Sitter, artist: Artist, shoulders: list[Points], neckline: Points,
    lapels: list[Points],
) -> None:  # fmt: skip
    """All of it below the neckline, or a jacket whose lapels may be of another tone."""
    left, right = shoulders
    rng = canvas.rng
    how, lean = _cloth(rng, artist)
    if not lapels:
        outline = np.concatenate([left[::-1], neckline, right])
        _darkened(canvas, sitter, outline, how, lean)
        return
    mirrored, apart, filled = rng.random() < 0.6, rng.random() < 0.6, rng.random() < 0.7
    other = _cloth(rng, artist)
    for shoulder, lapel in zip(shoulders, lapels, strict=True):
        if apart:  # from the neck to the lapel's point and down its inner edge
            own = np.concatenate([shoulder[8:9], lapel])
            if filled:
                _darkened(canvas, sitter, own, *other)
            canvas.cover(own)
        low = lapel[-1:] + 0.6 * sitter.unit * sitter.down
        _darkened(canvas, sitter, np.concatenate([shoulder[8:], low, lapel[::-1]]), how, lean)
        if mirrored:
            lean = np.pi - lean


def _cloth(rng: np.random.Generator, artist: Artist) -> tuple[str, float]:
    """How cloth is made dark, and the way of its strokes in radians."""
    odds = {"hatch": 1.0, "bundles": 1.0, "black": 3.0 * (artist.finish == "black") + 0.1}
    return lot(rng, odds), float(rng.uniform(0, np.pi))


def _darkened(canvas: Canvas, sitter: Sitter, outline: Points, how: str, lean: float) -> None:
    """Cloth within an outline (k, 2), of a `_cloth`: hatched, perhaps crossed, and so on."""
    rng = canvas.rng
    if how == "black":
        canvas.blacken(outline, lean)
        return
    if how == "hatch":
        sparse = float(rng.uniform(1.3, 3.5))
        canvas.blacken(outline, lean, sparse, "clothes", float(rng.uniform(0.6, 1.0)))
        if rng.random() < 0.3:
            canvas.blacken(outline, lean + float(rng.uniform(0.5, 1.5)), sparse, "clothes", 0.8)
        return
    area = canvas.area(outline)
    v, u = np.nonzero(area)
    if len(u) < 4:
        return
    long, gap = sitter.unit * rng.uniform(0.25, 0.9), max(1.8 * canvas.pen, 0.03 * sitter.unit)
    many = int(np.clip(rng.uniform(0.6, 2.0) * len(u) / (long * gap * EACH), 3, BUNDLES))
    k = rng.integers(0, len(u), many)
    width, turn, spread = rng.uniform(0.7, 1.4), rng.normal(0, 0.6), rng.uniform(0.05, 0.4)
    way = np.repeat(lean + spread * rng.normal(size=many), EACH)
    off = np.tile(np.arange(EACH) - EACH / 2, many) * gap
    places = np.repeat(np.stack([u[k], v[k]], axis=1) + 0.5, EACH, axis=0)
    places = places + off[:, None] * np.stack([-np.sin(way), np.cos(way)], axis=1)
    n = len(places)
    lines = bent(places, way, long * rng.uniform(0.6, 1.2, n), turn * rng.uniform(0.5, 1.5, n),
                 np.zeros(n), 16)  # fmt: skip
    fade = np.linspace(1, 0.6, 16)
    for line in lines:
        canvas.line("clothes", line, width, fade, canvas.inside(area, line), loose=0.3)
