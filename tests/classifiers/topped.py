"""Heads under tall dark hair with a bow in it, in bold lines: harder than what was learnt from."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from addon.drawing import normalise
from dataset_gen.generate import make_sample

SEED = 73_600_001
SIZE, PAPER = 320, 160  # px of the drawing, and of the paper that is added around it


def topped(index: int) -> tuple[np.ndarray, dict[str, tuple[float, float]]]:
    """A page (h, w), 1 = paper, on which a head by conventions has a mass of hair as large as its
    face, that ends where its ink ends; and where its landmarks are drawn, pixels."""
    rng = np.random.default_rng([SEED, index])
    picture, record = make_sample(SEED, index, SIZE, "people", "conventions")
    page = np.pad(normalise(picture), PAPER, constant_values=1)
    marks = {name: np.array(at) + PAPER for name, at in record["drawn_landmarks"].items()}
    bold = Image.fromarray(np.rint(255 * page).astype(np.uint8)).filter(ImageFilter.MinFilter(5))
    pen = ImageDraw.Draw(bold)

    up = marks["forehead"] - marks["chin"]
    height = float(np.linalg.norm(up))
    across = np.array([-up[1], up[0]])
    top = marks["forehead"] + 0.25 * up

    def shape(*corners: tuple[float, float], tone: int = 0) -> None:
        """A polygon; its corners are shares of the face's height, from the top of the skull."""
        pen.polygon([tuple(top + u * across + v * up) for u, v in corners], fill=tone)

    def lobe(u: float, v: float, wide: float, tall: float) -> None:
        t = np.linspace(0, 2 * np.pi, 60)
        curls = 1 + 0.04 * np.cos(14 * t)
        shape(*zip(u + wide * curls * np.cos(t), v + tall * curls * np.sin(t), strict=True))

    lobe(0, -0.05, rng.uniform(0.5, 0.65), rng.uniform(0.25, 0.35))
    lobe(rng.normal(0, 0.2), rng.uniform(0.15, 0.35), rng.uniform(0.3, 0.4), 0.3)
    shape((-0.55, -0.15), (0.45, 0.0), (0.45, 0.1), (-0.55, -0.05), tone=255)
    for side in (-1, 1):
        shape((0.3, 0.05), (0.3 + 0.22 * side, 0.25), (0.3 + 0.25 * side, 0.03), tone=255)
    # Cut off below the chin, so that the head fills the page.
    low = np.argwhere(np.asarray(bold) < 128).min(axis=0)
    high = np.argwhere(np.asarray(bold) < 128).max(axis=0) + 1
    high[0] = min(high[0], marks["chin"][1] + rng.uniform(0.12, 0.4) * height)
    drawing = np.asarray(bold)[low[0] : high[0], low[1] : high[1]] / np.float32(255)
    return drawing, {name: tuple(at - low[::-1]) for name, at in marks.items()}
