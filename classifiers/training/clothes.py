"""Clothes on a page of the training, which are no hair however they are inked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from facs_rig import LANDMARKS

from .scribbles import Frame

COLLARS = 0.5  # of clothes, those that stand up beside the neck


def dressed(
    ink: NDArray, marks: NDArray, kept: NDArray[np.bool_], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """A page (h, w) uint8 with clothes below the neck that are inked as hair is: black, grey, in
    strokes one way or both; with edges and folds, or with those alone.

    marks : (m, 2) the landmarks      kept : (h, w) what lies over them
    """
    frame = Frame.of(marks, LANDMARKS)
    neck, dip, slope = rng.uniform(0.3, 0.6), rng.uniform(0, 0.7), rng.uniform(0.1, 0.6)
    base, wide = rng.uniform(1.05, 1.5), rng.uniform(0.9, 2.4)
    x = np.array([-wide, -neck, 0, neck, wide, 1.1 * wide, -1.1 * wide])
    y = np.array([base + slope, base, base + dip, base, base + slope, 6, 6])
    height, width = ink.shape
    page = Image.new("1", (width, height))
    pen = ImageDraw.Draw(page)
    pen.polygon(frame.page(x, y).ravel().tolist(), fill=1)
    edges = [frame.page(x[:5], y[:5])]
    if rng.random() < COLLARS:
        for side in (-1, 1):
            out, high = rng.uniform(0.02, 0.4), rng.uniform(0.1, 0.55)
            flap = side * np.array([neck, neck + 0.3 * out, neck + out, neck + 2 * out, neck])
            at = frame.page(flap, base + np.array([-high, -high, -0.3 * high, 0.5, 0.6]))
            pen.polygon(at.ravel().tolist(), fill=1)
            edges.append(at)
    for _ in range(int(rng.integers(0, 9))):  # folds
        begin = np.array([rng.uniform(-wide, wide), base + rng.uniform(0.1, 1.0)])
        way = begin + rng.normal(0, (0.15, 0.4), 2) + (0, 0.3)
        edges.append(frame.page(*np.linspace(begin, way, 6).T))
    gap, share = rng.uniform(0.03, 0.12) * frame.unit, rng.uniform(0.25, 0.7)
    noise = gaussian_filter(rng.normal(size=(2, height, width)), (0, 0.15 * frame.unit, 3))
    noise /= max(float(noise.std()), 1e-9)
    v, u = np.mgrid[:height, :width] + rng.uniform(0, 0.5) * gap * noise
    lean = rng.uniform(0, np.pi)
    kind = rng.random()
    ways = [lean, lean + rng.uniform(1, 2)] if kind > 0.75 else [lean]
    lines = np.zeros(ink.shape, dtype=bool)
    for way in ways:
        lines |= (u * np.cos(way) + v * np.sin(way)) / max(gap, 2.0) % 1 < share
    if kind < 0.3:
        lines[:] = True
    drawn = np.asarray(page) & lines & (rng.random() < 0.75)
    if rng.random() < 0.6 or not drawn.any():
        drawn = drawn | _outlined(edges, ink.shape, max(1, round(0.02 * frame.unit)))
    dark = rng.integers(40, 160) if kind < 0.15 else rng.integers(130, 256)
    return np.where(drawn & ~kept, np.maximum(ink, dark), ink).astype(np.uint8)


def _outlined(lines: list[NDArray], shape: tuple[int, ...], thick: int) -> NDArray[np.bool_]:
    page = Image.new("1", (shape[1], shape[0]))
    for line in lines:
        ImageDraw.Draw(page).line(line.ravel().tolist(), fill=1, width=thick)
    return np.asarray(page)
