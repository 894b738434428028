"""What is seen on cloth, wool and felt: hatching that follows it, ribs, patterns, shade, black."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from .artist import Artist, lot
from .canvas import Canvas
from .patches import Patch
from .shapes import ellipse, normals, smooth
from .sitter import Sitter

Odds = Mapping[str, float]
WOOL = {"plain": 2.5, "wool": 3.5, "ribs": 2.5, "locks": 0.7, "hatch": 1.0, "pattern": 1.2,
        "shade": 0.7, "black": 1.0}  # fmt: skip
CLOTH = {"plain": 3.0, "wool": 0.8, "ribs": 0.3, "locks": 2.0, "hatch": 1.5, "pattern": 1.5,
         "shade": 1.0, "black": 1.0}  # fmt: skip
FELT = {"plain": 4.0, "wool": 0.9, "ribs": 0.4, "hatch": 1.5, "shade": 1.5, "black": 1.2}
BARE = {"cartoon": 2.0, "naive": 1.5}  # how much oftener these leave it white
BLACK = 0.2  # how often who does not fill hair with black fills a hat, of those who do


def material(rng: np.random.Generator, artist: Artist, odds: Odds) -> str:
    """One of TEXTURES or plain, by lot; odds : WOOL, CLOTH or FELT."""
    odds = dict(odds)
    odds["plain"] *= BARE.get(artist.manner, 1.0)
    odds["black"] *= 3.0 if artist.finish == "black" else BLACK
    return lot(rng, odds)


def texture(canvas: Canvas, sitter: Sitter, patch: Patch, name: str) -> None:
    """Of a `material`."""
    if name != "plain":
        TEXTURES[name](canvas, sitter, patch)


def wool(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Short strokes in rows along it, in layers that cross, denser at one side or at both."""
    rng = canvas.rng
    dark, aside = rng.uniform(0.35, 1.0), rng.choice([-1.0, 0.0, 1.0])
    width, loose, sides = rng.uniform(0.6, 1.4), rng.uniform(0.2, 0.5), rng.uniform(0, 1.2)
    for _ in range(int(rng.choice([1, 1, 2, 3]))):
        lean, size = rng.normal(0, 0.06), rng.uniform(0.08, 0.4)
        rows = np.linspace(0.0, 0.95, int(rng.integers(3, 9)))
        many = int(rng.integers(14, 50))
        up, across = (g.ravel() for g in np.meshgrid(rows, np.linspace(0.01, 0.99, many)))
        kept = rng.random(len(up)) < 0.6 + 0.8 * aside * (across - 0.5) + sides * (
            np.abs(across - 0.5) - 0.25
        )
        up, across = up[kept], across[kept] + 0.01 * rng.normal(size=kept.sum())
        high = np.minimum(up + size * rng.uniform(0.5, 1.2, len(up)), 1.0)
        bow = 0.02 * sitter.unit * rng.normal(size=(len(up), 1)) * sitter.right
        ends = patch.at(across, up), patch.at(across + lean, high)
        middle = patch.at(across + lean / 2, (up + high) / 2) + bow
        for line in np.stack([ends[0], middle, ends[1]], axis=1):
            canvas.line("hat", smooth(line, 8), width, dark, loose=loose)


def ribs(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Lines from one edge to the other, single, in pairs, or thick."""
    rng = canvas.rng
    pair = (0.0, 0.3) if rng.random() < 0.35 else (0.0,)
    width, dark = rng.uniform(0.6, 1.6), rng.uniform(0.5, 1.0)
    many, short = int(rng.integers(8, 60)), rng.uniform(0.0, 0.35)
    for k in np.arange(many) + 0.5:
        for own in pair:
            begin, end = short * rng.random() * 0.5, 1 - short * rng.random()
            up = np.linspace(begin, end, 12)
            canvas.line("hat", patch.at((k + own) / many, up), width, dark, loose=0.3)


def locks(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Long strokes from side to side, in bundles as those of hair: folds of cloth."""
    rng = canvas.rng
    t, width = np.linspace(0, 1, 18), rng.uniform(0.6, 1.3)
    thick = np.linalg.norm(patch.at(t, 1.0) - patch.at(t, 0.0), axis=1).mean() / sitter.unit
    for _ in range(int(rng.integers(2, 4 + 10 * min(thick, 1.5)))):
        place, rise = rng.uniform(0, 1), rng.normal(0, 0.15)
        begin = rng.uniform(-0.2, 0.8)
        for _ in range(int(rng.integers(1, 6))):
            first = begin + 0.08 * rng.normal()
            across = first + rng.uniform(0.15, 0.6) * t
            up = np.clip(place + 0.06 * rng.normal() + rise * (t - 0.5), 0, 1)
            inside = (across > 0) & (across < 1)
            fade = np.linspace(1, rng.uniform(0.3, 1), 18)
            canvas.line("hat", patch.at(across, up), width, fade, seen=inside, loose=0.4)


def hatch(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Straight strokes over all of it, perhaps crossed."""
    rng = canvas.rng
    lean, gap = float(rng.uniform(0, np.pi)), float(rng.uniform(1.6, 5))
    dark = float(rng.uniform(0.3, 0.9))
    canvas.blacken(patch.outline, lean, gap, "hat", dark)
    if rng.random() < 0.35:
        canvas.blacken(patch.outline, lean + float(rng.uniform(0.5, 1.6)), gap, "hat", dark)


def pattern(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Dots, stripes or zigzags in rows."""
    rng = canvas.rng
    kind, rows = int(rng.integers(3)), rng.uniform(0.1, 0.9, int(rng.integers(1, 5)))
    size = rng.uniform(0.015, 0.05) * sitter.unit
    if kind == 0:
        for up in np.linspace(0.12, 0.9, int(rng.integers(2, 7))):
            for across in np.arange(0.05, 1, rng.uniform(0.06, 0.16)) + rng.uniform(0, 0.05):
                canvas.line("hat", ellipse(patch.at(across, up), size, size, count=9), 0.8)
        return
    t = np.linspace(0, 1, 80)
    saw = rng.uniform(0.04, 0.12) * (2 * np.abs((t * rng.uniform(6, 20)) % 1 - 0.5) - 0.5)
    for up in rows:
        for apart in (0.0, 0.05):
            line = patch.at(t, np.clip(up + apart + saw * (kind == 2), 0, 1))
            canvas.line("hat", line, 0.8)


def shade(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Darker along its upper edge, as round things are."""
    rng = canvas.rng
    away = normals(patch.high) * sitter.unit * rng.uniform(0.1, 0.25)
    middle = patch.low.mean(axis=0)
    inner = min(
        (patch.high + away, patch.high - away),
        key=lambda line: float(np.linalg.norm(line.mean(axis=0) - middle)),
    )
    edge = np.concatenate([patch.high, inner[::-1]])
    canvas.blacken(edge, float(rng.uniform(0, np.pi)), float(rng.uniform(1.5, 3)), "hat", 0.7)


def black(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Filled; folds or seams may stay white."""
    rng = canvas.rng
    if rng.random() < 0.4:
        half = rng.uniform(0.01, 0.03)
        for across in rng.uniform(0.15, 0.85, int(rng.integers(1, 4))):
            up = np.linspace(0.05, 0.9, 12)
            wide = half * np.sin(np.linspace(0, np.pi, 12))
            sides = [patch.at(across - wide, up), patch.at(across + wide, up)[::-1]]
            canvas.cover(np.concatenate(sides))
    canvas.blacken(patch.outline, float(rng.uniform(-0.5, 0.8)))


TEXTURES: dict[str, Callable[[Canvas, Sitter, Patch], None]] = {
    "wool": wool, "ribs": ribs, "locks": locks, "hatch": hatch, "pattern": pattern,
    "shade": shade, "black": black,
}  # fmt: skip
