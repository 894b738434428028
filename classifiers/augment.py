"""From a generated drawing to something a person might have put on paper: online, numpy and PIL.

One call makes one training example: turn and bend the page, wear off lines, let an artist add hair,
glasses, a collar …, crop it as the first or the second look of the detector would, spoil the paper,
mirror it. The labels follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image

from . import scribbles
from .labels import Targets, mirror_order, rotated_in_picture
from .negatives import faceless
from .preprocess import Crop, area_resample, bounding_landmarks, even_ink, face_box, ink_box
from .scribbles import Frame, Pen

Ink = NDArray[np.uint8]
Floats = NDArray[np.float32]

NEAR, FAR, NO_FACE = 0, 1, 2
SHARES = (0.68, 0.20, 0.12)  # of examples: second look, first look, no face
PAD = 32  # px of paper added around a drawing, for hair that reaches over its edge


@dataclass(frozen=True)
class Example:
    """What the networks see and should answer; with no face only `ink` and `kind` mean anything.

    ink : (size, size) float32     landmarks : (m, 2) in crop units      angles : radians
    """

    ink: Floats
    kind: int
    active: Floats
    intensity: Floats
    angles: Floats
    landmarks: Floats


@dataclass(frozen=True)
class Names:
    """The names behind the columns of the targets, and what depends on them alone."""

    aus: tuple[str, ...]
    landmarks: tuple[str, ...]
    au_mirror: NDArray[np.intp]
    landmark_mirror: NDArray[np.intp]
    bounding: NDArray[np.intp]
    folded: NDArray[np.intp]  # the units that deepen the nasolabial folds

    @classmethod
    def of(cls, aus: Sequence[str], landmarks: Sequence[str]) -> Names:
        bounding = [list(landmarks).index(name) for name in bounding_landmarks(landmarks)]
        folded = [
            i for i, name in enumerate(aus) if name in ("smile", "sneer", "nasolabial_deepen")
        ]
        return cls(
            tuple(aus),
            tuple(landmarks),
            mirror_order(aus),
            mirror_order(landmarks),
            np.array(bounding, np.intp),
            np.array(folded, np.intp),
        )


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


def decorated(ink: Ink, points: NDArray, names: Names, folds: bool, rng: Generator) -> Ink:
    """What an artist might add; `folds`: the expression deepens the nasolabial folds."""
    image = Image.fromarray(ink)
    pen = Pen(image, Frame.of(points, names.landmarks))
    chance = rng.random(8)
    if folds and chance[0] < 0.3:
        scribbles.cheek_folds(pen, rng, int(rng.integers(1, 5)))
    elif chance[0] < 0.06:
        scribbles.cheek_folds(pen, rng, 1)
    if chance[1] < 0.07:
        scribbles.beard(pen, rng)
    if chance[2] < 0.2:
        scribbles.hatching(pen, rng)
        if chance[2] < 0.06:
            scribbles.hatching(pen, rng)
    if chance[3] < 0.3:
        scribbles.shoulders(pen, rng)
    if chance[4] < 0.08:
        scribbles.glasses(pen, rng)
    if chance[5] < 0.6:
        scribbles.hair(Pen(image, pen.frame.skull()), rng)
    return np.array(image)


def second_look(points: NDArray, rng: Generator) -> Crop:
    """The face's box, as far off as the first look's landmarks may be, with other proportions."""
    box = face_box(points)
    stretch = float(np.exp(rng.uniform(-0.12, 0.12) / 2))
    scale = float(np.exp(rng.normal(0.03, 0.07)))
    width, height = box.width * scale * stretch, box.height * scale / stretch
    centre_u = box.left + box.width * (0.5 + rng.normal(0, 0.03))
    centre_v = box.top + box.height * (0.5 + rng.normal(0, 0.03))
    return Crop(centre_u - width / 2, centre_v - height / 2, width, height)


def first_look(ink: Ink, points: NDArray, rng: Generator) -> Crop:
    """The box of all ink, or a rectangle in which the face takes a smaller part, somewhere."""
    box = face_box(points)
    if rng.random() < 0.4:
        around = ink_box(ink.astype(np.float32))
        if around.width > 0.8 * box.width:
            return around
    side = box.width / rng.uniform(0.35, 1.0)
    stretch = float(np.exp(rng.uniform(-0.12, 0.12) / 2))
    width, height = side * stretch, side / stretch
    spare = np.array([width, height]) - box.width
    offset = spare * rng.uniform(0, 1, 2)
    return Crop(box.left - offset[0], box.top - offset[1], width, height)


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


def mirrored(example: Example, names: Names) -> Example:
    """The same in a mirror: left and right exchanged everywhere. Twice is the identity."""
    landmarks = example.landmarks[names.landmark_mirror] * (-1, 1) + (1, 0)
    return Example(
        np.ascontiguousarray(example.ink[:, ::-1]),
        example.kind,
        example.active[names.au_mirror],
        example.intensity[names.au_mirror],
        (example.angles * (-1, 1, -1)).astype(np.float32),
        landmarks.astype(np.float32),
    )


def artistic_page(
    drawing: Ink, points: NDArray, folds: bool, names: Names, rng: Generator
) -> tuple[Ink, NDArray, float]:
    """A drawing as an artist's page: ink (h + 2 PAD, w + 2 PAD) uint8, its points, the turn (rad).

    drawing : (h, w) uint8, 255 = paper;  points : (m, 2) px.
    """
    ink = np.pad(255 - drawing, PAD)
    points = points + PAD
    turn = 0.0
    if rng.random() < 0.5:
        ink, points, turn = turned_and_bent(ink, points, rng)
    ink = worn(ink, rng)
    return decorated(ink, points, names, folds, rng), points, turn


def example(
    drawing: Ink,
    targets: Targets,
    row: int,
    names: Names,
    size: int,
    rng: Generator,
    kind: int | None = None,
) -> Example:
    """One training example from drawing (h, w) uint8, 255 = paper, and row `row` of the targets.

    kind : NEAR, FAR or NO_FACE; drawn by SHARES if not given.
    """
    if kind is None:
        kind = int(rng.choice(3, p=SHARES))
    active, intensity, angles = targets.active[row], targets.intensity[row], targets.angles[row]
    points = targets.landmarks[row]
    if kind == NO_FACE:
        ink = worn(faceless(rng, np.uint8(255) - drawing), rng)
        crop = (
            ink_box(ink.astype(np.float32))
            if rng.random() < 0.6
            else Crop.square(
                rng.uniform(0.3, 0.7, 2) * ink.shape[0], ink.shape[0] * rng.uniform(0.4, 1.2)
            )
        )
    else:
        folds = bool(np.any(intensity[names.folded] >= 1.5))
        ink, page_points, turn = artistic_page(drawing, points, folds, names, rng)
        bounds = page_points[names.bounding]
        crop = second_look(bounds, rng) if kind == NEAR else first_look(ink, bounds, rng)
        points = crop.to_crop(page_points).astype(np.float32)
        if turn:
            angles = np.array(rotated_in_picture(angles, turn), np.float32)
    small = area_resample(ink, crop, size) / np.float32(255)
    small = even_ink(spoiled(small, rng))
    made = Example(small, kind, active, intensity, angles, points)
    return mirrored(made, names) if rng.random() < 0.5 else made
