"""From a generated drawing to something a person might have put on paper: online, numpy and PIL.

One call makes one training example: turn and bend the page, wear off lines, let an artist add hair,
glasses, a collar …, crop it as the first or the second look of the detector would, spoil the paper,
mirror it. The labels follow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from PIL import Image

from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from ..finding import widened
from ..labels import REGIONS, mirror_order
from ..preprocess import STRIDE, WIDER, bounding_landmarks, even_ink, face_box, ink_square
from . import scribbles
from .negatives import faceless
from .paper import cut_off, spoiled, turned_and_bent, worn
from .regions import Outlines
from .scribbles import Frame, Pen
from .targets import Targets, manly, rotated_in_picture
from .toning import toned

Ink = NDArray[np.uint8]
Floats = NDArray[np.float32]

NEAR, MID, FAR, NO_FACE, WIDE = 0, 1, 2, 3, 4
# Of examples: third look, second look, first look, no face, the look at hair and shoulders.
SHARES = (0.68, 0.08, 0.10, 0.08, 0.06)
PAD = 32  # px of paper added around a drawing, for hair that reaches over its edge
MOST_FACES = 4  # on one page
CROWDS = 0.35  # of first looks, those with more than one face
SMALLEST = 0.2  # a face's box as a share of the page that is looked at first
CUT = 0.08  # of pages, those whose edge cuts the face
TONED = 0.25  # of the others, those that are shaded
AS_DRAWN = 0.3  # of pages, those to which nothing is done: the generator has styles of its own


@dataclass(frozen=True)
class Example:
    """What the networks see and should answer; with no face all but `ink` and `kind` is idle.

    ink : (size, size) float32     landmarks : (m, 2) in crop units      angles : radians
    boxes : (MOST_FACES, 3) of each face's box u, v of the middle and the side, crop units, or nan
    person : (p,) who it is, see `labels.PERSON`, or nan
    regions : (r, 2 c, 2 c) how much of each half cell is of each of `labels.REGIONS`, or nan
    """

    ink: Floats
    kind: int
    active: Floats
    intensity: Floats
    angles: Floats
    landmarks: Floats
    boxes: Floats
    person: Floats
    regions: Floats


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


def decorated(
    ink: Ink,
    points: NDArray,
    names: Names,
    folds: bool,
    man: float,
    rng: Generator,
    bald: bool = True,
) -> Ink:
    """What an artist might add; `folds`: the expression deepens the nasolabial folds; `man`: how
    much of a man is drawn, 0..1; `bald`: there is no hair yet."""
    image = Image.fromarray(ink)
    pen = Pen(image, Frame.of(points, names.landmarks))
    chance = rng.random(8)
    if chance[6] < 0.3:
        scribbles.features(pen, rng)
    if folds and chance[0] < 0.3:
        scribbles.cheek_folds(pen, rng, int(rng.integers(1, 5)))
    elif chance[0] < 0.3:  # older faces have them at rest
        scribbles.cheek_folds(pen, rng, int(rng.integers(1, 3)))
    if bald and chance[1] < 0.14 * man:
        scribbles.beard(pen, rng)
    if chance[2] < 0.2:
        scribbles.hatching(pen, rng)
        if chance[2] < 0.06:
            scribbles.hatching(pen, rng)
    if chance[3] < 0.3:
        scribbles.shoulders(pen, rng)
    if chance[4] < 0.08:
        scribbles.glasses(pen, rng)
    if bald and chance[5] < 0.6:
        scribbles.hair(Pen(image, pen.frame.skull()), rng, man)
    ink = np.array(image)
    return toned(ink, pen.frame.skull(), rng) if chance[7] < TONED else ink


def jittered(points: NDArray, spread: float, rng: Generator) -> Box:
    """The face's box, as far off as the look before may be (`spread` 1: landmarks), stretched."""
    box = face_box(points)
    stretch = float(np.exp(rng.uniform(-0.12, 0.12) / 2))
    scale = float(np.exp(rng.normal(0.03 * spread, 0.07 * spread)))
    width, height = box.width * scale * stretch, box.height * scale / stretch
    centre_u = box.left + box.width * (0.5 + rng.normal(0, 0.03 * spread))
    centre_v = box.top + box.height * (0.5 + rng.normal(0, 0.03 * spread))
    return Box.at(centre_u - width / 2, centre_v - height / 2, width, height)


def first_look(ink: Ink, points: NDArray, rng: Generator) -> Box:
    """The box of all ink, or a rectangle in which the face takes a smaller part, somewhere."""
    box = face_box(points)
    if rng.random() < 0.4:
        around = ink_square(ink.astype(np.float32))
        if around.width > 0.8 * box.width:
            return around
    side = box.width / float(np.exp(rng.uniform(np.log(SMALLEST), 0)))
    stretch = float(np.exp(rng.uniform(-0.12, 0.12) / 2))
    width, height = side * stretch, side / stretch
    offset = np.array([width, height]) * rng.uniform(0, 1, 2) - box.width / 2
    offset = np.clip(offset, -0.15 * box.width, np.array([width, height]) - 0.85 * box.width)
    return Box.at(box.left - offset[0], box.top - offset[1], width, height)


def crowd(
    ink: Ink, box: Box, another: Callable[[], tuple[Ink, NDArray]], rng: Generator
) -> tuple[Ink, NDArray, list[Box]]:
    """Other, smaller faces beside that of a page: the larger page, the shift (2,), their boxes.

    box : of the face on the page;  another : a drawing (h, w), 255 = paper, and the points (m, 2)
    that bound its face
    """
    height, width = ink.shape
    large = int(height * rng.uniform(1.0, 1.9)), int(width * rng.uniform(1.3, 2.2))
    page = np.zeros(large, np.uint8)
    shift = (rng.uniform(0, 1, 2) * (page.shape[1] - width, page.shape[0] - height)).astype(int)
    page[shift[1] : shift[1] + height, shift[0] : shift[0] + width] = ink
    taken = [Box.at(box.left + shift[0], box.top + shift[1], box.width, box.height)]
    for _ in range(int(rng.integers(1, MOST_FACES))):
        drawing, points = another()
        own = face_box(points)
        scale = rng.uniform(0.35, 0.9) * box.width / own.width
        size = max(int(drawing.shape[1] * scale), 8), max(int(drawing.shape[0] * scale), 8)
        resized = Image.fromarray(drawing).resize(size, Image.Resampling.BOX)
        small = np.uint8(255) - np.array(resized, np.uint8)
        for _ in range(8):  # places until one keeps clear of the faces that are there
            u, v = (rng.uniform(-0.2, 1, 2) * page.shape[::-1]).astype(int)
            there = Box.at(own.left * scale + u, own.top * scale + v, *(own.width * scale,) * 2)
            inside = there.within(page.shape)
            if inside and all(there.apart(other) for other in taken):
                lay_on(page, small, u, v)
                taken.append(there)
                break
    return page, shift, taken[1:]


def lay_on(page: Ink, ink: Ink, left: int, top: int) -> None:
    """Draw ink (h, w) on a page at a place that may reach over its edges."""
    height, width = ink.shape
    u, v = max(left, 0), max(top, 0)
    right, bottom = min(left + width, page.shape[1]), min(top + height, page.shape[0])
    if right > u and bottom > v:
        part = page[v:bottom, u:right]
        np.maximum(part, ink[v - top : bottom - top, u - left : right - left], out=part)


def mirrored(example: Example, names: Names) -> Example:
    """The same in a mirror: left and right exchanged everywhere. Twice is the identity."""
    landmarks = example.landmarks[names.landmark_mirror] * (-1, 1) + (1, 0)
    boxes = example.boxes * (-1, 1, 1) + (1, 0, 0)
    return Example(
        np.ascontiguousarray(example.ink[:, ::-1]),
        example.kind,
        example.active[names.au_mirror],
        example.intensity[names.au_mirror],
        (example.angles * (-1, 1, -1)).astype(np.float32),
        landmarks.astype(np.float32),
        boxes.astype(np.float32),
        example.person,
        np.ascontiguousarray(example.regions[:, :, ::-1]),
    )


def artistic_page(
    drawing: Ink,
    points: NDArray,
    folds: bool,
    man: float,
    names: Names,
    rng: Generator,
    bald: bool = True,
) -> tuple[Ink, NDArray, float]:
    """A drawing as an artist's page: ink (h + 2 PAD, w + 2 PAD) uint8, its points, the turn (rad).

    drawing : (h, w) uint8, 255 = paper;  points : (m, 2) px, the landmarks and whatever else is to
    move along;  folds, man, bald : see `decorated`.
    """
    ink = np.pad(255 - drawing, PAD)
    points = points + PAD
    turn = 0.0
    if rng.random() < AS_DRAWN:
        return ink, points, turn
    if rng.random() < 0.5:
        ink, points, turn = turned_and_bent(ink, points, rng)
    ink = worn(ink, rng)
    return decorated(ink, points, names, folds, man, rng, bald), points, turn


def example(
    drawing: Ink,
    targets: Targets,
    row: int,
    names: Names,
    size: int,
    rng: Generator,
    kind: int | None = None,
    another: Callable[[Generator], tuple[Ink, NDArray]] | None = None,
    flip: bool | None = None,
    shares: Sequence[float] = SHARES,
    outlines: Outlines | None = None,
) -> Example:
    """One training example from drawing (h, w) uint8, 255 = paper, and row `row` of the targets.

    kind : NEAR, MID, FAR, NO_FACE or WIDE; drawn by `shares` if not given.
    another : some other drawing and its landmarks, for pages with several faces
    flip : whether it is mirrored; by lot if not given
    outlines : of what lies where on the drawing, if that is known
    """
    if kind is None:
        kind = int(rng.choice(len(shares), p=shares))
    active, intensity, angles = targets.active[row], targets.intensity[row], targets.angles[row]
    points = targets.landmarks[row]
    boxes = np.full((MOST_FACES, 3), np.nan)
    cells = 2 * size // STRIDE
    regions = np.full((len(REGIONS), cells, cells), np.nan, np.float32)
    if kind == NO_FACE:
        ink = worn(faceless(rng, np.uint8(255) - drawing), rng)
        crop = (
            ink_square(ink.astype(np.float32))
            if rng.random() < 0.6
            else Box.square(
                rng.uniform(0.3, 0.7, 2) * ink.shape[0], ink.shape[0] * rng.uniform(0.4, 1.2)
            )
        )
    else:
        folds = bool(np.any(intensity[names.folded] >= 1.5))
        man = manly(targets.person[row])
        if outlines and not outlines.haired and rng.random() < 0.5:
            outlines = None  # a bald head is given hair, of which nothing is told
        if outlines:
            points = np.concatenate([points, outlines.points])
        ink, page_points, turn = artistic_page(
            drawing, points, folds, man, names, rng, bald=outlines is None
        )
        page_points, moved = np.split(page_points, [len(names.landmarks)])
        bounds = page_points[names.bounding]
        others: list[Box] = []
        if kind == FAR and another and rng.random() < CROWDS:

            def stranger() -> tuple[Ink, NDArray]:
                picture, places = another(rng)
                return picture, places[names.bounding]

            ink, shift, others = crowd(ink, face_box(bounds), stranger, rng)
            bounds, page_points = bounds + shift, page_points + shift
            crop = ink_square(ink.astype(np.float32))
        elif kind == FAR:
            crop = first_look(ink, bounds, rng)
        elif kind == WIDE:
            room = WIDER * float(np.exp(rng.normal(0, 0.1)))
            crop = widened(jittered(bounds, 1.0, rng), room)
        else:
            crop = jittered(bounds, 1.0 if kind == NEAR else 2.5, rng)
        points = crop.to_units(page_points).astype(np.float32)
        if outlines and kind in (NEAR, WIDE):
            regions = outlines.mask(moved, crop, cells)
        for k, box in enumerate([face_box(bounds), *others]):
            middle = crop.to_units(np.array([box.left + box.width / 2, box.top + box.height / 2]))
            boxes[k] = *middle, box.width / np.sqrt(crop.width * crop.height)
        if turn:
            angles = np.array(rotated_in_picture(angles, turn), np.float32)
    small = area_resample(ink, crop, size) / np.float32(255)
    if rng.random() < CUT:
        small = cut_off(small, rng)
    if rng.random() > AS_DRAWN:
        small = spoiled(small, rng)
    small = even_ink(small)
    made = Example(
        small, kind, active, intensity, angles, points, boxes.astype(np.float32),
        targets.person[row], regions,
    )  # fmt: skip
    flip = rng.random() < 0.5 if flip is None else flip
    return mirrored(made, names) if flip else made
