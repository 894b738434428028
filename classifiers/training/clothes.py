"""Clothes on a page of the training, which are no hair however they are inked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from facs_rig import LANDMARKS

from .scribbles import Frame


def dressed(
    ink: NDArray, marks: NDArray, kept: NDArray[np.bool_], rng: np.random.Generator
) -> NDArray[np.uint8]:
    """A page (h, w) uint8 with clothes below the neck that are inked as hair is: black, grey, in
    strokes one way or both.

    marks : (m, 2) the landmarks      kept : (h, w) what lies over them
    """
    frame = Frame.of(marks, LANDMARKS)
    neck, dip, slope = rng.uniform(0.3, 0.6), rng.uniform(0, 0.7), rng.uniform(0.1, 0.6)
    base, wide = rng.uniform(1.05, 1.5), rng.uniform(0.9, 2.4)
    x = np.array([-wide, -neck, 0, neck, wide, 1.1 * wide, -1.1 * wide])
    y = np.array([base + slope, base, base + dip, base, base + slope, 6, 6])
    height, width = ink.shape
    page = Image.new("1", (width, height))
    ImageDraw.Draw(page).polygon(frame.page(x, y).ravel().tolist(), fill=1)
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
    dark = rng.integers(40, 160) if kind < 0.15 else rng.integers(130, 256)
    return np.where(np.asarray(page) & lines & ~kept, np.maximum(ink, dark), ink).astype(np.uint8)
