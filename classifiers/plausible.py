"""Whether what was read is a face, and which way up the page stands.

The networks call much a face that is none: a smiley, a profile, a face upside down. What they
cannot feign is that they know where its landmarks are: their own expected errors are small, the
crop and its mirror image agree, and there is a nose between the eyes and the mouth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from .finding import squared
from .preprocess import Floats, ink_square

if TYPE_CHECKING:
    from .detector import Detector, Reading

# Why what was read is no face.
NO_FACE, NO_NOSE, HIDDEN = "no face", "no nose", "hidden"
# Lengths as shares of the box that was read. Measured on 1,000 generated drawings: upright ones
# have expected errors of 0.011 to 0.02 (95 %), upside down of 0.03 to 0.1, on their sides more.
CERTAIN = 0.02  # expected error of the landmarks: no need to look whether the page lies
SURE = 0.033  # a page is turned for a face that is as sure as this, though there is another in it
LIKELY = 0.045  # and for this if there is none as it lies
FALLEN = np.radians(60)  # a head that is rolled further lies on a page that lies
BETTER = 0.8  # of the expected error as it lies: what a turn must come down to
FARTHEST = 0.04  # between the landmarks of a crop and of its mirror image: those of a face
# Mean ink between eyes and mouth, of the darkest in the crop: a nose of a few strokes has more.
LEAST_NOSE = 0.015
# Where that is: from the eyes' middle to the mouth's, and of the eyes' distance to either side.
NOSE_FROM, NOSE_TO, NOSE_ASIDE = 0.2, 0.75, 0.3
NOSE_FRAME = ("pupil_left", "pupil_right", "mouth_corner_left", "mouth_corner_right")


def expected_error(reading: Reading) -> float:
    """Of the landmarks of a reading: their geometric mean, as a share of the box that was read."""
    return float(np.exp(np.log(np.maximum(reading.spreads, 1e-9)).mean()) / reading.box.width)


def trouble(reading: Reading) -> str:
    """Why a reading is of no face that can be used; empty if it is one."""
    if reading.face < 0:
        return NO_FACE
    if expected_error(reading) <= SURE:
        return ""
    if reading.apart > FARTHEST:
        return HIDDEN
    if reading.nose < LEAST_NOSE:
        return NO_NOSE
    return ""


def nose_ink(crop: Floats, frame: NDArray) -> float:
    """Mean ink where a face has its nose, relative to the darkest of the crop, 0..1.

    crop : (s, s) ink     frame : (4, 2) the landmarks of NOSE_FRAME, crop units
    """
    pupils, corners = frame[:2], frame[2:]
    eyes, mouth = pupils.mean(axis=0), corners.mean(axis=0)
    axes = np.stack([pupils[0] - pupils[1], mouth - eyes], axis=1)
    if abs(np.linalg.det(axes)) < 1e-4:  # all in one spot, or in a row
        return 0.0
    middle = (np.arange(len(crop)) + 0.5) / len(crop)
    places = np.stack(np.meshgrid(middle, middle), axis=-1) - eyes
    aside, down = np.moveaxis(places @ np.linalg.inv(axes).T, -1, 0)
    here = (np.abs(aside) < NOSE_ASIDE) & (down > NOSE_FROM) & (down < NOSE_TO)
    darkest = max(float(np.quantile(crop, 0.995)), 0.1)
    return float(np.minimum(crop[here] / darkest, 1).mean()) if here.any() else 0.0


def upright(detector: Detector, page: Floats, head: Box | None = None) -> tuple[int, Reading]:
    """The quarter turns anticlockwise (`np.rot90`) that stand a page of ink (h, w) upright, and
    what is read then. head : where to look, in pixels of the page as it lies

    As it lies unless another turn is clearly better: most drawings are handed in upright, and of
    those most are read so well that nothing else is looked at.
    """

    def read(turn: int) -> Reading:
        box = None if head is None else turned_crop(head, page.shape, turn)
        return detector.read(turned(page, turn), box, turns=(), farther=())

    as_it_lies = detector.read(page, head)
    error = expected_error(as_it_lies)
    roll = float(as_it_lies.angles[2])
    if abs(roll) > FALLEN and not trouble(as_it_lies):  # the detector has levelled it by itself
        turn = 1 if roll > 0 else 3
        reading = read(turn)
        if not trouble(reading) and expected_error(reading) <= max(error, CERTAIN):
            return turn, reading
    if error <= CERTAIN and not trouble(as_it_lies):
        return 0, as_it_lies
    best = (0, as_it_lies)
    least = min(BETTER * error, LIKELY if trouble(as_it_lies) else SURE)
    for turn in _worth_reading(detector, page, head):
        reading = read(turn)
        error = expected_error(reading)
        if error <= least and not trouble(reading):
            best, least = (turn, reading), error
    return best


def _worth_reading(detector: Detector, page: Floats, head: Box | None) -> Sequence[int]:
    """The turns in which a first look sees a face, the surest first."""
    whole = ink_square(page) if head is None else squared(head)
    crop = area_resample(page, whole, detector.size)
    faces = detector.look(np.stack([np.rot90(crop, turn) for turn in (1, 2, 3)])).face
    return [int(k) + 1 for k in np.argsort(-faces, kind="stable") if faces[k] > 0]


def turned(page: Floats, turn: int) -> Floats:
    """A page, or a drawing, turned by so many quarter turns anticlockwise."""
    return np.ascontiguousarray(np.rot90(page, turn))


def turned_crop(crop: Box, shape: Sequence[int], turn: int) -> Box:
    """Where a rectangle of a page (h, w) lies once the page is turned."""
    (height, width), box = shape, crop
    for _ in range(turn % 4):
        box = Box.at(box.top, width - box.left - box.width, box.height, box.width)
        height, width = width, height
    return box
