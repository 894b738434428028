"""What happens to a page of ink: it is bent, its lines wear, it is torn off, it is spoiled.

Pages are uint8 (h, w), 0 = paper and 255 = black, crops float32 (s, s), 0..1.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image

Ink = NDArray[np.uint8]
Floats = NDArray[np.float32]


def turned_and_bent(ink: Ink, points: NDArray, rng: Generator) -> tuple[Ink, NDArray, float]:
    """A page (h, w) turned about its middle by some degrees and bent like a loose drawing.

    Returns the page, the points (m, 2) px moved along, and the turn in radians, clockwise.
    """
    height, width = ink.shape
    turn = float(np.radians(np.clip(rng.normal(0, 5), -14, 14)))
    cells = int(rng.integers(3, 7))
    bend = rng.normal(0, rng.uniform(0, 0.007) * height, (cells + 1, cells + 1, 2))
    u = np.linspace(0, width, cells + 1).round()
    v = np.linspace(0, height, cells + 1).round()
    centre = np.array([width / 2, height / 2])
    c, s = np.cos(turn), np.sin(turn)
    back = np.array([[c, s], [-s, c]])  # from the new page to the old one
    grid = np.stack(np.meshgrid(u, v), axis=-1)
    source = (grid - centre) @ back.T + centre + bend
    quads = []
    for i in range(cells):
        for j in range(cells):
            corner = source[i, j], source[i + 1, j], source[i + 1, j + 1], source[i, j + 1]
            box = (int(u[j]), int(v[i]), int(u[j + 1]), int(v[i + 1]))
            quads.append((box, tuple(np.concatenate(corner))))
    image = Image.fromarray(ink).transform(
        (width, height), Image.Transform.MESH, quads, Image.Resampling.BILINEAR
    )
    moved = (points - centre) @ back + centre
    # Where the bend is b, the new page shows the old page's point p + R b: undo it, once is enough.
    shift = _bilinear(bend, moved[:, 0] / width * cells, moved[:, 1] / height * cells)
    return np.array(image), moved - shift @ back, turn


def _bilinear(grid: NDArray, u: NDArray, v: NDArray) -> NDArray:
    j = np.clip(u.astype(int), 0, grid.shape[1] - 2)
    i = np.clip(v.astype(int), 0, grid.shape[0] - 2)
    a, b = np.clip(u - j, 0, 1)[:, None], np.clip(v - i, 0, 1)[:, None]
    return (
        grid[i, j] * (1 - a) * (1 - b)
        + grid[i, j + 1] * a * (1 - b)
        + grid[i + 1, j] * (1 - a) * b
        + grid[i + 1, j + 1] * a * b
    )


def thicker(ink: Ink) -> Ink:
    """Lines one pixel thicker, to the right and downwards."""
    out = ink.copy()
    np.maximum(out[:, 1:], ink[:, :-1], out=out[:, 1:])
    np.maximum(out[1:], out[:-1].copy(), out=out[1:])
    return out


def thinner(ink: Ink) -> Ink:
    """Lines one pixel thinner; as they are if that would cost most of them."""
    out = ink.copy()
    np.minimum(out[:, 1:], ink[:, :-1], out=out[:, 1:])
    np.minimum(out[1:], out[:-1].copy(), out=out[1:])
    return out if out.sum(dtype=np.int64) > 0.3 * ink.sum(dtype=np.int64) else ink


def worn(ink: Ink, rng: Generator) -> Ink:
    """Line weight changed, lines interrupted, small patches erased."""
    chance = rng.random(5)
    size = (ink.shape[1], ink.shape[0])
    if chance[0] < 0.15:
        ink = thicker(ink)
    elif chance[0] < 0.5:
        ink = thinner(ink)
    if chance[1] < 0.25:  # interruptions: small holes all over the page
        cells = int(rng.integers(40, 110))
        kept = (rng.random((cells, cells)) > rng.uniform(0.01, 0.08)).astype(np.uint8)
        holes = Image.fromarray(kept * 255).resize(size, Image.Resampling.NEAREST)
        ink = ink & np.array(holes)
    if chance[2] < 0.3:  # light and heavy pressure
        pressure = Image.fromarray(rng.integers(60, 256, (4, 4), np.uint8))
        factor = np.array(pressure.resize(size, Image.Resampling.BICUBIC))
        ink = (ink * (factor / np.float32(255))).astype(np.uint8)
    if chance[3] < 0.25:
        ink = ink.copy()
        for _ in range(int(rng.integers(1, 5))):
            v, u = (int(rng.integers(0, n)) for n in ink.shape)
            h, w = rng.integers(3, 14, 2)
            ink[v : v + h, u : u + w] = 0
    if chance[4] < 0.2:  # scanned in black and white
        ink = ((ink > rng.integers(50, 150)) * np.uint8(255)).astype(np.uint8)
    return ink


def cut_off(ink: Floats, rng: Generator) -> Floats:
    """A drawing that runs off the paper: nothing on one side of it (s, s)."""
    side = int(rng.integers(4))
    ink = np.rot90(ink, side).copy()
    ink[: int(rng.uniform(0.05, 0.3) * len(ink))] = 0
    return np.rot90(ink, -side)


def spoiled(ink: Floats, rng: Generator) -> Floats:
    """The paper: blur, grain, tone, specks. ink (s, s) 0..1 -> the same."""
    chance = rng.random(5)
    if chance[0] < 0.25:
        for _ in range(1 if chance[0] < 0.18 else 2):
            padded = np.pad(ink, 1)
            rows = padded[:-2] + 2 * padded[1:-1] + padded[2:]
            ink = (rows[:, :-2] + 2 * rows[:, 1:-1] + rows[:, 2:]) / np.float32(16)
    if chance[1] < 0.3:
        ink = np.power(ink, np.float32(rng.uniform(0.6, 1.6)))
    if chance[2] < 0.2:
        grain = rng.standard_normal(ink.shape, np.float32)
        ink = ink + grain * np.float32(rng.uniform(0.01, 0.05))
    if chance[3] < 0.15:
        slope = np.linspace(-1, 1, ink.shape[0], dtype=np.float32)
        tone = rng.normal(0, 0.03, 3)
        ink = ink + np.float32(abs(tone[0])) + np.float32(tone[1]) * slope
        ink = ink + (np.float32(tone[2]) * slope)[:, None]
    if chance[4] < 0.1:
        v, u = rng.integers(0, ink.shape[0], (2, int(rng.integers(1, 40))))
        ink = ink.copy()
        ink[v, u] = rng.random(len(u), np.float32)
    return np.clip(ink, 0, 1)
