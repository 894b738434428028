"""What artists add to a face: hair, glasses, collars, beards, hatching, folds, whole features.

The generator draws bald heads with clean lines; people do not. Everything here is drawn onto a page
of ink (a PIL image of mode L, 0 = paper, 255 = black) in the frame of the face, in which the eyes'
middle is (0, 0), the chin (0, 1), x to the image's right; so the length unit is eyes to chin.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.interpolate import CubicSpline

BLACK, PAPER = 255, 0
FRONTAL = 0.65  # of the wider eye; a narrower other one is half hidden
HALF_WIDTH = 0.68  # of a head, in eyes-to-chin units
CROWN = -1.08


# Landmarks around each feature, in the order in which a pen goes.
OUTLINES = {
    "lips": (
        "mouth_corner_right", "lip_upper_outer_right", "lip_peak_right", "lip_top",
        "lip_peak_left", "lip_upper_outer_left", "mouth_corner_left", "lip_lower_outer_left",
        "lip_lower_inner_left", "lip_bottom", "lip_lower_inner_right", "lip_lower_outer_right",
    ),
    "mouth": (
        "mouth_corner_right", "lip_inner_upper_right", "lip_inner_top", "lip_inner_upper_left",
        "mouth_corner_left",
    ),
    **{
        f"eye_{side}": tuple(
            f"eye_{place}_{side}"
            for place in (
                "outer", "top_outer", "top", "top_inner", "inner", "bottom_inner", "bottom",
                "bottom_outer",
            )
        )
        for side in ("left", "right")
    },
}  # fmt: skip


@dataclass(frozen=True)
class Frame:
    """Where a face lies on the page. `points` are its landmarks (m, 2) px, `places` name -> row."""

    origin: NDArray[np.float64]
    right: NDArray[np.float64]
    down: NDArray[np.float64]
    unit: float
    points: NDArray[np.float64]
    places: dict[str, int]

    @classmethod
    def of(cls, points: NDArray, names: Sequence[str]) -> Frame:
        """From landmarks; needs some named eye…, and one named chin."""
        eyes = [i for i, name in enumerate(names) if "eye" in name.split("_")]
        chin = [i for i, name in enumerate(names) if "chin" in name.split("_")]
        if not eyes or not chin:
            raise ValueError("The landmarks must name the eyes and the chin.")
        origin = np.mean(points[eyes], axis=0)
        down = np.mean(points[chin], axis=0) - origin
        unit = max(float(np.hypot(*down)), 1.0)
        down = down / unit
        places = {name: i for i, name in enumerate(names)}
        return cls(origin, np.array([down[1], -down[0]]), down, unit, points, places)

    def moved(self, x: float) -> Frame:
        """The same frame with its origin at (x, 0)."""
        return replace(self, origin=self.origin + x * self.unit * self.right)

    def skull(self) -> Frame:
        """The frame in the middle of the skull, which a turned head leaves behind its eyes."""
        sides = [i for name, i in self.places.items() if {"temple", "jaw"} & set(name.split("_"))]
        return self.moved(float(self.local(self.points[sides])[:, 0].mean())) if sides else self

    def page(self, x: NDArray, y: NDArray) -> NDArray[np.float64]:
        """Frame coordinates -> pixels (..., 2)."""
        x, y = np.broadcast_arrays(x, y)
        return (
            self.origin
            + x[..., None] * self.unit * self.right
            + y[..., None] * self.unit * self.down
        )

    def local(self, points: NDArray) -> NDArray[np.float64]:
        """Pixels (..., 2) -> frame coordinates (..., 2)."""
        offset = (np.asarray(points, float) - self.origin) / self.unit
        return np.stack([offset @ self.right, offset @ self.down], axis=-1)

    def landmark(self, name: str) -> NDArray[np.float64]:
        return self.local(self.points[self.places[name]])


class Pen:
    """Draws polylines given in a frame."""

    def __init__(self, image: Image.Image, frame: Frame) -> None:
        self.draw, self.frame = ImageDraw.Draw(image), frame

    def lines(self, x: NDArray, y: NDArray, width: int = 1, ink: int = BLACK) -> None:
        """x, y : (strokes, points) or (points,) in frame coordinates."""
        for stroke in np.atleast_3d(self.frame.page(np.atleast_2d(x), np.atleast_2d(y))):
            self.draw.line(stroke.ravel().tolist(), fill=ink, width=width)


def _wobble(rng: Generator, strokes: int, k: int, amount: float) -> NDArray:
    """Smooth random offsets (strokes, k): a hand's looseness, or waves in hair."""
    t = np.linspace(0, 1, k)
    total = np.zeros((strokes, k))
    for cycles in (1, 2.3, 4.1):
        phase = rng.uniform(0, 2 * np.pi, (strokes, 1))
        total += np.sin(2 * np.pi * cycles * t + phase) * rng.normal(
            0, amount / cycles**0.7, (strokes, 1)
        )
    return total


def _sides(rng: Generator) -> list[int]:
    return [-1, 1] if rng.random() < 0.85 else [int(rng.choice([-1, 1]))]


def long_hair(pen: Pen, rng: Generator) -> None:
    """Masses of strands from a parting over the temples down to chin or chest."""
    reach = rng.uniform(0.7, 2.3)
    waves = rng.uniform(0.01, 0.09)
    spread = rng.uniform(0.15, 0.6)
    parting = rng.normal(0, 0.25)
    inward = rng.uniform(0.0, 0.14)  # how far the mass comes over the cheek's edge
    k = 14
    t = np.linspace(0, 1, k)
    for side in _sides(rng):
        n = int(rng.integers(8, 70))
        outward = rng.uniform(-inward, spread, (n, 1))
        start_y = (
            rng.uniform(CROWN - 0.15, -0.55, (n, 1))
            if rng.random() < 0.3
            else CROWN - 0.1 * rng.random((n, 1))
        )
        end = np.maximum(rng.uniform(0.5, 1.0, (n, 1)) * reach, 0.2)
        # A quarter turn over the skull, then hanging down.
        turn = np.clip(t / 0.35, 0, 1)
        x = parting + (side * (HALF_WIDTH + outward) - parting) * np.sin(turn * np.pi / 2)
        y = (
            start_y
            + (0 - start_y) * (1 - np.cos(turn * np.pi / 2))
            + end * np.clip((t - 0.3) / 0.7, 0, 1)
        )
        x = (
            x
            + side * spread * 0.5 * np.clip(t - 0.4, 0, 1)
            + _wobble(rng, n, k, waves) * np.clip(t * 3, 0, 1)
        )
        skip = rng.random((n, 1)) < 0.3  # some strands are only drawn below the ear
        first = 6 if skip.mean() > 0.5 else int(rng.integers(0, 3))
        _mass(pen, rng, x[:, first:], y[:, first:])


def _mass(pen: Pen, rng: Generator, x: NDArray, y: NDArray) -> None:
    """Draw strands; sometimes the mass hides what is behind it."""
    width = int(rng.choice([1, 1, 1, 2]))
    if rng.random() < 0.45:
        hide = rng.random(len(x)) < 0.5
        pen.lines(x[hide], y[hide], width=int(0.06 * pen.frame.unit) + 1, ink=PAPER)
    pen.lines(x, y, width)
    if rng.random() < 0.25:
        pen.lines(x[: len(x) // 3], y[: len(x) // 3], width + 1)


def side_scribble(pen: Pen, rng: Generator) -> None:
    """Crossing zigzag strokes beside the face, as somebody fills in hair in a hurry."""
    for side in _sides(rng):
        n, k = int(rng.integers(4, 28)), int(rng.integers(4, 12))
        top, bottom = rng.uniform(-0.9, -0.2), rng.uniform(0.5, 1.9)
        middle = side * (HALF_WIDTH + rng.uniform(0.05, 0.35))
        x = middle + rng.normal(0, rng.uniform(0.06, 0.2), (n, k))
        y = rng.uniform(top, bottom, (n, 1)) + np.cumsum(rng.normal(0.05, 0.12, (n, k)), axis=1)
        pen.lines(x, np.clip(y, top - 0.2, bottom + 0.2), int(rng.choice([1, 1, 2])))


def top_hair(pen: Pen, rng: Generator) -> None:
    """Strokes combed from a parting to the temples, some over the forehead's edge."""
    parting = rng.uniform(-0.4, 0.4)
    low = rng.uniform(-0.55, -0.25)
    for side in (-1, 1):
        n, k = int(rng.integers(5, 40)), 9
        t = np.linspace(0, 1, k)
        x0 = parting + rng.normal(0, 0.08, (n, 1))
        y0 = rng.uniform(CROWN - 0.12, CROWN + 0.25, (n, 1))
        x1 = side * rng.uniform(0.4, HALF_WIDTH + 0.15, (n, 1))
        y1 = low + rng.uniform(-0.35, 0.15, (n, 1))
        x = x0 + (x1 - x0) * t**0.8 + _wobble(rng, n, k, 0.015)
        y = y0 + (y1 - y0) * t**1.8 + _wobble(rng, n, k, 0.015)
        _mass(pen, rng, x, y)


def fringe(pen: Pen, rng: Generator) -> None:
    """Strands falling over the forehead: upright strokes, unlike worry lines."""
    n, k = int(rng.integers(8, 40)), 6
    t = np.linspace(0, 1, k)
    x0 = rng.uniform(-0.6, 0.6, (n, 1))
    length = rng.uniform(0.25, 0.7) * rng.uniform(0.7, 1, (n, 1))
    lean = rng.normal(0, 0.25)
    x = x0 * (1 - 0.1 * t) + lean * t**2 * 0.6 + _wobble(rng, n, k, 0.02)
    y = CROWN + 0.1 + 0.1 * np.abs(x0) + length * t
    _mass(pen, rng, x, y)


def short_hair(pen: Pen, rng: Generator) -> None:
    """Short strokes standing around the skull."""
    n, k = int(rng.integers(25, 110)), 4
    angle = rng.uniform(-1.75, 1.75, (n, 1))
    inner = rng.uniform(0.82, 1.0, (n, 1))
    length = rng.uniform(0.08, 0.3) * rng.uniform(0.5, 1, (n, 1))
    lean = rng.normal(0, 0.5) + rng.normal(0, 0.15, (n, 1))
    t = np.linspace(0, 1, k)
    radius = inner + length * t
    a = angle + lean * length * t * 1.5
    x = np.sin(a) * radius * (HALF_WIDTH + 0.06)
    y = -0.05 - np.cos(a) * radius * (0.05 - CROWN)
    pen.lines(x, y, int(rng.choice([1, 1, 2])))


def curls(pen: Pen, rng: Generator) -> None:
    """Loops all around the skull."""
    n, k = int(rng.integers(15, 70)), 12
    angle = rng.uniform(-2.0, 2.0, (n, 1))
    radius = rng.uniform(0.9, 1.35, (n, 1))
    turn = np.linspace(0, rng.uniform(5, 14), k)
    size = rng.uniform(0.03, 0.12, (n, 1)) * rng.choice([-1, 1], (n, 1))
    x = np.sin(angle) * radius * HALF_WIDTH + size * np.cos(turn + angle)
    y = -0.05 + np.cos(angle) * radius * CROWN + np.abs(size) * np.sin(turn) + turn * 0.01
    pen.lines(x, y, 1)


def outline_hair(pen: Pen, rng: Generator) -> None:
    """A hairstyle as a few long lines: its outer shape and perhaps the hairline."""
    k = 16
    t = np.linspace(0, 1, k)
    reach, lift, flare = rng.uniform(0.1, 1.8), rng.uniform(0.05, 0.3), rng.uniform(0, 0.5)
    for _ in range(int(rng.integers(1, 4))):
        for side in (-1, 1):
            a = np.clip(t / 0.5, 0, 1) * np.pi / 2
            x = side * (HALF_WIDTH + lift * 0.8 + flare * np.clip(t - 0.5, 0, 1)) * np.sin(a)
            y = (CROWN - lift) * np.cos(a) + reach * np.clip((t - 0.5) / 0.5, 0, 1)
            x = x + _wobble(rng, 1, k, 0.03)[0]
            pen.lines(x, y + _wobble(rng, 1, k, 0.02)[0], int(rng.choice([1, 1, 2, 3])))
        lift += rng.normal(0, 0.05)
    if rng.random() < 0.6:
        a = np.linspace(-1.35, 1.35, k)
        height = rng.uniform(-0.85, -0.6)
        pen.lines(np.sin(a) * 0.62, np.cos(a) * height - 0.05 + _wobble(rng, 1, k, 0.03)[0], 1)


def hat(pen: Pen, rng: Generator) -> None:
    """A cap or a hat over the forehead's upper edge."""
    brim, wide, tall = rng.uniform(-0.75, -0.5), rng.uniform(0.75, 1.2), rng.uniform(0.5, 0.9)
    x = np.linspace(-1, 1, 13)
    arch = brim - 0.1 * (1 - x**2) * rng.uniform(-1, 1.5)
    outline_x = np.array([-0.72, -0.7, -0.5, 0, 0.5, 0.7, 0.72])
    outline_y = brim - tall * np.array([0, 0.5, 0.9, 1, 0.9, 0.5, 0])
    shape = np.concatenate(
        [pen.frame.page(outline_x, outline_y), pen.frame.page(x * 0.75, arch)[::-1]]
    )
    pen.draw.polygon(shape.ravel().tolist(), fill=PAPER)
    pen.lines(outline_x, outline_y, 2)
    pen.lines(x * wide, arch, int(rng.choice([1, 2, 3])))


# How often each is drawn, on women and on men: it is by hair that people tell them apart.
HAIR: tuple[tuple[Callable[[Pen, Generator], None], float, float], ...] = (
    (long_hair, 6.0, 0.8),
    (side_scribble, 2.0, 0.8),
    (top_hair, 2.0, 3.5),
    (fringe, 1.2, 0.8),
    (short_hair, 0.6, 3.5),
    (curls, 0.8, 0.8),
    (outline_hair, 1.8, 1.4),
    (hat, 0.3, 0.7),
)


def hair(pen: Pen, rng: Generator, man: float = 0.5) -> None:
    """One to three kinds of hair on top of each other; `man`: as men have it, 0..1."""
    weights = np.array([(1 - man) * woman + man * his for _, woman, his in HAIR])
    count = int(rng.choice([1, 2, 3], p=[0.35, 0.4, 0.25]))
    for i in rng.choice(len(HAIR), count, replace=False, p=weights / weights.sum()):
        HAIR[i][0](pen, rng)


def glasses(pen: Pen, rng: Generator) -> None:
    """Two rims, round or nearly square, with a bridge and temples."""
    centres = []
    for side in ("left", "right"):
        own = [
            i
            for name, i in pen.frame.places.items()
            if side in name.split("_") and {"eye", "pupil"} & set(name.split("_"))
        ]
        if own:
            centres.append(pen.frame.local(pen.frame.points[own]).mean(axis=0))
    if len(centres) < 2:
        return
    width, height = rng.uniform(0.2, 0.3), rng.uniform(0.13, 0.24)
    power = rng.uniform(0.4, 1)
    angle = np.linspace(0, 2 * np.pi, 25)
    c, s = np.cos(angle), np.sin(angle)
    thick = int(rng.choice([1, 2, 3]))
    drop = rng.uniform(-0.02, 0.06)
    for x, y in centres:
        pen.lines(
            x + width * np.sign(c) * np.abs(c) ** power,
            y + drop + height * np.sign(s) * np.abs(s) ** power,
            thick,
        )
    (ax, ay), (bx, by) = sorted(map(tuple, centres))
    pen.lines(
        np.array([ax + width, (ax + bx) / 2, bx - width]),
        np.array([ay, (ay + by) / 2 - 0.04, by]),
        thick,
    )
    for x, y, sign in ((ax, ay, -1), (bx, by, 1)):
        pen.lines(np.array([x + sign * width, sign * HALF_WIDTH]), np.array([y, y - 0.03]), thick)


def shoulders(pen: Pen, rng: Generator) -> None:
    """Neck, shoulders and perhaps a collar."""
    t = np.linspace(0, 1, 9)
    neck, slope, wide = rng.uniform(0.35, 0.5), rng.uniform(0.2, 0.6), rng.uniform(1.0, 2.0)
    base = rng.uniform(1.45, 1.8)
    for side in (-1, 1):
        x = side * (neck + (wide - neck) * t**1.3)
        y = base + slope * t**0.7 + _wobble(rng, 1, 9, 0.02)[0]
        pen.lines(x, y, int(rng.choice([1, 2])))
        pen.lines(side * (neck + 0.05 * t[::-1]), 0.8 + (base - 0.8) * t)
        if rng.random() < 0.4:
            pen.lines(
                side * np.array([neck, 0.08, neck + 0.15, neck]),
                base + np.array([-0.15, 0.35, 0.3, 0.0]),
            )


def beard(pen: Pen, rng: Generator) -> None:
    """Stubble or a beard along the jaw, perhaps a moustache: many short strokes."""
    n = int(rng.integers(30, 130))
    angle = rng.uniform(-1.5, 1.5, n)
    radius = rng.uniform(0.72, 1.05, n)
    x0, y0 = np.sin(angle) * radius * 0.62, 0.12 + np.cos(angle) * radius * 0.88
    if rng.random() < 0.4:
        m = n // 4
        x0[:m], y0[:m] = rng.normal(0, 0.13, m), 0.5 + rng.normal(0, 0.02, m)
    length = rng.uniform(0.03, 0.12)
    dx, dy = rng.normal(0, 0.3, n) * length, rng.uniform(0.5, 1, n) * length
    pen.lines(np.stack([x0, x0 + dx], 1), np.stack([y0, y0 + dy], 1))


def hatching(pen: Pen, rng: Generator) -> None:
    """Shading: parallel strokes on cheek, temple, forehead, beside the nose or on the neck."""
    n = int(rng.integers(5, 22))
    side = int(rng.choice([-1, 1]))
    places = [(0.45, 0.35), (0.55, -0.2), (0.3, -0.75), (0.2, 0.2), (0.3, 1.15), (0.5, 0.6)]
    cx, cy = places[int(rng.integers(len(places)))]
    direction = rng.uniform(0.5, 2.6)  # never level: that would be a crease of the forehead
    gap, length = rng.uniform(0.02, 0.05), rng.uniform(0.08, 0.35)
    across = (np.arange(n) - n / 2) * gap
    c, s = np.cos(direction), np.sin(direction)
    half = length * rng.uniform(0.6, 1, n) / 2
    x = side * cx - across * s + np.stack([-half, half]) * c
    y = cy + across * c + np.stack([-half, half]) * s
    pen.lines(x.T, y.T)
    if rng.random() < 0.3:
        pen.lines(x[::-1].T, y.T)


def cheek_folds(pen: Pen, rng: Generator, width: int) -> None:
    """Nasolabial folds as artists draw them: heavy strokes from the nose past the mouth."""
    spread, crossed = rng.uniform(0.28, 0.42), rng.random() < 0.25
    t = np.linspace(0, 1, 6)
    for side in (-1, 1):
        for _ in range(int(rng.choice([1, 1, 2, 4]))):
            shift = rng.normal(0, 0.015)
            start = rng.uniform(0, 0.3)
            u = start + (1 - start) * t
            x = side * (0.2 + (spread - 0.2) * np.sin(u * np.pi / 2) + shift)
            pen.lines(x, 0.38 + 0.34 * u + shift, width)
            if crossed:
                pen.lines(
                    side * (spread + np.array([-0.12, 0.1]) + shift),
                    0.52 + np.array([0.08, -0.08]),
                    width,
                )


def _curve(pen: Pen, names: Sequence[str], rng: Generator, loose: float, closed: bool) -> NDArray:
    """A smooth line (k, 2) through landmarks, as far off them as a loose hand is."""
    points = np.array([pen.frame.landmark(name) for name in names])
    points += rng.normal(0, loose, points.shape)
    if closed:
        points = np.concatenate([points, points[:1]])
    ends = "periodic" if closed else "natural"
    t = np.linspace(0, len(points) - 1, 4 * len(points))
    return CubicSpline(np.arange(len(points)), points, bc_type=ends)(t)


def features(pen: Pen, rng: Generator) -> None:
    """Nose, lips, eyes and brows as people draw them from memory: one outline each.

    A program draws a nose where its surface turns away; people draw both its sides from the brows
    down, the lips as two closed shapes, and brows as outlines. Only for faces seen from the front,
    on which all of it is to be seen.
    """
    places = pen.frame.places
    if not {name for names in OUTLINES.values() for name in names} <= set(places):
        return
    eyes = [
        np.hypot(*(pen.frame.landmark(f"eye_outer_{s}") - pen.frame.landmark(f"eye_inner_{s}")))
        for s in ("left", "right")
    ]
    if min(eyes) < FRONTAL * max(eyes):
        return
    loose, thick = rng.uniform(0.002, 0.012), int(rng.choice([1, 1, 2]))
    drawn = rng.random(len(OUTLINES)) < 0.45
    for (part, names), wanted in zip(OUTLINES.items(), drawn, strict=True):
        if wanted:
            closed = part in ("lips", "eye_left", "eye_right")
            x, y = _curve(pen, names, rng, loose, closed).T
            pen.lines(x, y, thick)
    if rng.random() < 0.4:
        _nose_sides(pen, rng, thick)
    if rng.random() < 0.3:
        _brow_outlines(pen, rng)


def _nose_sides(pen: Pen, rng: Generator, thick: int) -> None:
    """The sides of a nose, from the brows or from its middle down around the wings."""
    root, tip = pen.frame.landmark("nose_root"), pen.frame.landmark("nose_tip")
    top, narrow, t = rng.uniform(-0.1, 0.6), rng.uniform(0.35, 0.75), np.linspace(0, 1, 8)
    for side in ("left", "right"):
        wing, nostril = (pen.frame.landmark(f"{n}_{side}") for n in ("nose_wing", "nostril"))
        bridge = root + top * (tip - root) + (narrow * (wing - tip)[0], 0)
        bulge = np.sin(np.pi * t)[:, None] * (wing - tip) * rng.uniform(-0.3, 0.15)
        line = bridge + (wing - bridge) * (t**1.5)[:, None] + bulge * (1, 0)
        line = np.concatenate([line, nostril[None]]) + rng.normal(0, 0.006, (9, 2))
        pen.lines(line[:, 0], line[:, 1], thick)
        if rng.random() < 0.5:
            x, y = (nostril + rng.normal(0, 0.012, (5, 2))).T
            pen.lines(x, y, thick + 1)


def _brow_outlines(pen: Pen, rng: Generator) -> None:
    """Brows as closed shapes, thick at the nose and pointed at the temple."""
    full = rng.uniform(0.02, 0.07)
    for side in ("left", "right"):
        names = [f"brow_{n}_{side}" for n in ("inner", "inner_half", "peak", "outer_half", "outer")]
        line = _curve(pen, names, rng, 0.004, closed=False)
        away = full * np.linspace(1, 0.1, len(line)) ** 0.7
        for sign in (-1, 1):
            pen.lines(line[:, 0], line[:, 1] + sign * away / 2)
