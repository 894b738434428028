"""Pages without a face, so that the networks can say that there is none."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from .scribbles import BLACK, Frame, Pen, curls, long_hair, shoulders, side_scribble, top_hair

SIZE = 256

# Photographs in scikit-image's own data in which no face, of man or cat, can be seen.
PHOTOGRAPHS = (
    "brick", "coffee", "coins", "grass", "gravel", "hubble_deep_field", "moon", "page", "rocket",
    "text", "immunohistochemistry", "cell", "colorwheel",
)  # fmt: skip

Ink = NDArray[np.uint8]


def _blank() -> tuple[Image.Image, ImageDraw.ImageDraw]:
    image = Image.new("L", (SIZE, SIZE), 0)
    return image, ImageDraw.Draw(image)


def scribble(rng: Generator) -> Ink:
    """Loose random curves."""
    image, draw = _blank()
    for _ in range(int(rng.integers(1, 25))):
        steps = np.cumsum(rng.normal(0, rng.uniform(3, 18), (int(rng.integers(3, 40)), 2)), axis=0)
        points = rng.uniform(20, SIZE - 20, 2) + np.cumsum(steps * 0.3, axis=0)
        draw.line(points.ravel().tolist(), fill=BLACK, width=int(rng.integers(1, 4)))
    return np.array(image)


def shapes(rng: Generator) -> Ink:
    """Circles, boxes, polygons: also an empty oval, which is not a face yet."""
    image, draw = _blank()
    for _ in range(int(rng.integers(1, 9))):
        centre, half = rng.uniform(40, SIZE - 40, 2), rng.uniform(8, 110, 2)
        low, high = (centre - half).tolist(), (centre + half).tolist()
        width = int(rng.integers(1, 5))
        kind = rng.integers(4)
        if kind == 0:
            draw.ellipse(low + high, outline=BLACK, width=width)
        elif kind == 1:
            draw.rectangle(low + high, outline=BLACK, width=width)
        elif kind == 2:
            draw.line(low + high, fill=BLACK, width=width)
        else:
            angle = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(3, 8))))
            corner = centre + half[0] * np.stack([np.cos(angle), np.sin(angle)], 1)
            draw.polygon(corner.ravel().tolist(), outline=BLACK)
    return np.array(image)


def writing(rng: Generator) -> Ink:
    """Lines of handwriting-like loops."""
    image, draw = _blank()
    size = rng.uniform(4, 14)
    y = rng.uniform(10, 60)
    while y < SIZE - 10 and rng.random() < 0.95:
        x, end = rng.uniform(5, 40), rng.uniform(140, SIZE - 5)
        while x < end:
            k = int(rng.integers(6, 40))
            t = np.arange(k)
            u = x + t * size * 0.18
            v = y + size * 0.5 * np.sin(t * rng.uniform(0.9, 1.6)) * rng.uniform(0.4, 1, k)
            draw.line(np.stack([u, v], 1).ravel().tolist(), fill=BLACK, width=1)
            x = u[-1] + size
        y += size * rng.uniform(1.8, 3)
    return np.array(image)


def grid(rng: Generator) -> Ink:
    """Ruled and squared paper, brickwork, staves."""
    image, draw = _blank()
    gap = rng.uniform(6, 50)
    for k in range(int(SIZE / gap) + 1):
        at = k * gap + rng.normal(0, 0.5)
        draw.line([0, at, SIZE, at + rng.normal(0, 1)], fill=BLACK, width=1)
        if gap > 12:
            draw.line([at, 0, at + rng.normal(0, 1), SIZE], fill=BLACK, width=1)
    return np.array(image.rotate(rng.normal(0, 8)))


def noise(rng: Generator) -> Ink:
    """Grain or blotches."""
    cells = int(rng.choice([8, 32, 128, SIZE]))
    values = rng.random((cells, cells)) ** rng.uniform(1, 12)
    return np.array(Image.fromarray((values * 255).astype(np.uint8)).resize((SIZE, SIZE), 3))


def nearly_blank(rng: Generator) -> Ink:
    """Dust, a single stroke, a shadow."""
    page = np.zeros((SIZE, SIZE), np.uint8)
    spots = rng.integers(0, SIZE, (int(rng.integers(0, 30)), 2))
    page[spots[:, 0], spots[:, 1]] = rng.integers(30, 255, len(spots))
    if rng.random() < 0.4:
        page |= (np.linspace(0, rng.uniform(10, 90), SIZE)[None] * np.ones((SIZE, 1))).astype(
            np.uint8
        )
    image = Image.fromarray(page)
    if rng.random() < 0.5:
        ends = rng.uniform(0, SIZE, 4).tolist()
        ImageDraw.Draw(image).line(ends, fill=BLACK, width=int(rng.integers(1, 6)))
    return np.array(image)


def sign(rng: Generator) -> Ink:
    """A round sign with eyes and a mouth and nothing else: who draws a person draws more."""
    image, draw = _blank()
    unit, width = rng.uniform(45, 110), int(rng.integers(2, 8))
    lean, tall = np.radians(rng.normal(0, 6)), np.exp(rng.normal(0, 0.08))
    turn = np.array([[np.cos(lean), np.sin(lean)], [-np.sin(lean), np.cos(lean)]])
    middle = SIZE / 2 + rng.normal(0, 8, 2)

    def oval(u: float, v: float, a: float, b: float, start: float, end: float) -> list[float]:
        t = np.radians(np.linspace(start, end, 40))
        points = np.stack([u + a * np.cos(t), tall * (v + b * np.sin(t))], 1) @ turn
        return (middle + unit * points + rng.normal(0, 0.5, (40, 2))).ravel().tolist()

    if rng.random() < 0.9:
        draw.line(oval(0, 0, 1, 1, 0, 360 + rng.uniform(0, 20)), fill=BLACK, width=width)
    apart, high, size = rng.uniform(0.22, 0.48), rng.uniform(0.1, 0.4), rng.uniform(0.05, 0.2)
    kind = rng.integers(5)
    for side in (-1, 1):
        if kind == 0:
            draw.polygon(oval(side * apart, -high, size, size, 0, 360), fill=BLACK)
        elif kind == 1:
            draw.polygon(oval(side * apart, -high, 0.5 * size, 1.3 * size, 0, 360), fill=BLACK)
        elif kind == 2:
            draw.line(oval(side * apart, -high, size, 1.4 * size, 0, 360), fill=BLACK, width=width)
            if rng.random() < 0.6:
                pupil = oval(side * apart, -high, 0.4 * size, 0.4 * size, 0, 360)
                draw.polygon(pupil, fill=BLACK)
        else:  # arcs upward or downward
            ends = (180, 360) if kind == 3 else (0, 180)
            draw.line(oval(side * apart, -high, size, size, *ends), fill=BLACK, width=width)
    wide, deep, low = rng.uniform(0.25, 0.65), rng.uniform(0.05, 0.5), rng.uniform(0.05, 0.45)
    ends = (10, 170) if rng.random() < 0.7 else (190, 350)
    draw.line(oval(0, low, wide, deep, *ends), fill=BLACK, width=width)
    if rng.random() < 0.3:  # an open mouth
        draw.line(oval(0, low, wide, 0.02, 0, 180), fill=BLACK, width=width)
    return np.array(image)


def hair_alone(rng: Generator) -> Ink:
    """Hair and shoulders, but nobody in between."""
    image, _ = _blank()
    unit = rng.uniform(40, 80)
    centre = np.array([128.0, 110.0]) + rng.normal(0, 12, 2)
    frame = Frame(centre, np.array([1.0, 0]), np.array([0, 1.0]), unit, np.zeros((0, 2)), {})
    pen = Pen(image, frame)
    parts = (long_hair, side_scribble, top_hair, curls, shoulders)
    for i in rng.choice(len(parts), int(rng.integers(1, 4)), replace=False):
        parts[i](pen, rng)
    return np.array(image)


@lru_cache(maxsize=1)
def _photographs() -> list[NDArray[np.uint8]]:
    """Grey photographs; none where scikit-image or its files are missing."""
    try:
        from skimage import data
    except ImportError:
        return []
    folder = data.__path__[0]
    found = []
    for name in PHOTOGRAPHS:
        for extension in ("png", "jpg"):
            try:
                picture = Image.open(f"{folder}/{name}.{extension}").convert("L")
            except OSError:
                continue
            picture.thumbnail((700, 700))
            found.append(np.array(picture))
    return found


def photograph(rng: Generator) -> Ink:
    """A piece of a photograph: in grey, cut to black and white, or its edges."""
    photographs = _photographs()
    if not photographs:
        return noise(rng)
    photo = photographs[int(rng.integers(len(photographs)))]
    side = int(rng.uniform(0.35, 1) * min(photo.shape))
    top, left = (int(rng.integers(0, n - side + 1)) for n in photo.shape)
    piece = Image.fromarray(photo[top : top + side, left : left + side]).resize((SIZE, SIZE))
    grey = np.array(piece.rotate(90 * int(rng.integers(4)))).astype(np.float32)
    kind = rng.integers(3)
    if kind == 0:
        ink = grey if rng.random() < 0.5 else 255 - grey
        ink = (ink - ink.min()) / max(float(np.ptp(ink)), 1) * 255
    elif kind == 1:
        ink = (grey < np.quantile(grey, rng.uniform(0.1, 0.6))) * 255.0
    else:
        gradient = np.hypot(*np.gradient(grey))
        ink = (gradient > np.quantile(gradient, rng.uniform(0.8, 0.97))) * 255.0
    return ink.astype(np.uint8)


def torn_face(drawing: Ink, rng: Generator) -> Ink:
    """A drawing's own lines, its tiles shuffled: face-like strokes that make no face."""
    tiles = int(rng.choice([4, 8]))
    side = min(drawing.shape) // tiles
    pieces = drawing[: side * tiles, : side * tiles].reshape(tiles, side, tiles, side)
    pieces = pieces.transpose(0, 2, 1, 3).reshape(tiles * tiles, side, side)
    pieces = pieces[rng.permutation(len(pieces))]
    return (
        pieces.reshape(tiles, tiles, side, side)
        .transpose(0, 2, 1, 3)
        .reshape(side * tiles, side * tiles)
    )


KINDS: tuple[tuple[Callable[[Generator], Ink], float], ...] = (
    (scribble, 2.0),
    (shapes, 2.0),
    (writing, 1.5),
    (grid, 1.0),
    (noise, 0.7),
    (nearly_blank, 1.0),
    (hair_alone, 2.0),
    (sign, 2.0),
    (photograph, 3.0),
)


def faceless(rng: Generator, drawing: Ink | None = None) -> Ink:
    """A page without a face: ink (256, 256) uint8, 255 = black; some from a `drawing`'s ink."""
    if drawing is not None and rng.random() < 0.2:
        return torn_face(drawing, rng)
    weights = np.array([weight for _, weight in KINDS])
    return KINDS[int(rng.choice(len(KINDS), p=weights / weights.sum()))][0](rng)
