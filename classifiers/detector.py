"""The shipped detector: a drawing in, the expression out. numpy and ONNX Runtime, nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box
from facs_rig.common.errors import InputError
from facs_rig.common.images import area_resample

from .conflicts import resolve
from .detection import CLOSE, Detection
from .finding import Face, echo, faces_on, squared, widened
from .head import WHO, head_reader
from .labels import ACTIVE, FULL, mirror_order
from .mask import Mask
from .mouth import mouth_reader
from .plausible import (
    BETTER,
    HIDDEN,
    LIKELY,
    NOSE_FRAME,
    expected_error,
    nose_ink,
    trouble,
    turned,
    upright,
)
from .preprocess import (
    WIDER,
    Floats,
    as_page,
    bounding_landmarks,
    even_ink,
    face_box,
    ink_square,
)
from .runtime import DESCRIPTION, FORMAT, THREADS, WEIGHTS, Answers, Runtime, sigmoid

__all__ = [
    "DESCRIPTION", "FORMAT", "WEIGHTS", "Detection", "Detector", "Reading", "load_detector",
    "together",
]  # fmt: skip

LEAST_FACE = 0.5  # from here on there is a face
# The second look sees a little more than the box that the first one found.
ROOM = 1.08
# Landmarks that lie in one spot say nothing of where the face is: their box must be at least this
# share of what was looked at. All the ink may hold a small face, a face's box holds that face.
LEAST_OF_INK, LEAST_OF_BOX = 0.1, 0.5
# The finder is less sure of heads that fill what is looked at, and where hair, a hat or a bow is as
# large as the face it may find none, or take them for part of it. Where the landmarks of a reading
# are off by more than this share of its box, the page is looked at from so many times as far.
# What is then at most so large beside what was read before has shed what hid it. Chosen by 1,200
# generated drawings with bold lines and tall dark hair.
DOUBT, FARTHER, BARED = 0.033, (1.6, 2.0, 2.5), 0.8
# A head that is rolled further than this is looked at again in a crop that is turned with it, for
# the networks know rolls of some degrees alone; of larger ones they tell too little, hence rounds.
LEVEL, ROUNDS = np.radians(6), 4
# How else the page is looked at if no face is seen so surely (a logit) as upright ones are, and how
# much more of it: each turn finds the faces that are rolled by about as much. A reading of a turned
# page must be surer by some logits, as most faces are upright.
TURNS, SURE, AROUND, SURER = (np.radians(45), np.radians(-45)), 9.0, 1.2, 1.0
TRIES = 3  # boxes that the third look is given, if it sees no face in the first


@dataclass(frozen=True)
class Reading:
    """The networks' raw answer for a page; lengths in its pixels.

    logits : (k,) yes minus no      intensities : (k,) 0..5      angles : (3,) radians
    landmarks : (m, 2)      spreads : (m,) their expected errors      face : logit of a face
    box : what the last look saw, turned as the face is
    others : further faces on the page, largest first
    apart : mean distance between the landmarks of the last look and of its mirror image, crop units
    nose : see `plausible.nose_ink`
    person : (p, 2) mean and log of the spread of each parameter of the person, see `together`
    mask : where face, hair and beard are, of networks that tell
    """

    logits: NDArray[np.float64]
    intensities: NDArray[np.float64]
    angles: NDArray[np.float64]
    landmarks: NDArray[np.float64]
    spreads: NDArray[np.float64]
    face: float
    box: Box
    others: tuple[Face, ...] = ()
    apart: float = 0.0
    nose: float = 1.0
    person: NDArray = field(default_factory=lambda: np.zeros((0, 2)))
    mask: Mask | None = field(default=None, compare=False)


class Detector:
    """The networks of a weights folder. Make one with `load_detector()`.

    `model` is the folder's description: names, input size, thresholds, temperatures, provenance of
    the training data and the figures measured on drawings that were held out.
    """

    def __init__(self, folder: Path, threads: int = THREADS) -> None:
        self._networks = Runtime(folder, threads)
        self._mouth, self._head = mouth_reader(folder, threads), head_reader(folder, threads)
        self.model = self._networks.model
        self.aus: tuple[str, ...] = tuple(self.model["aus"])
        self.landmarks: tuple[str, ...] = tuple(self.model["landmarks"])
        self.person: tuple[str, ...] = tuple(self.model.get("person", ()))
        self.size = int(self.model["size"])
        self._au_mirror = mirror_order(self.aus)
        self._landmark_mirror = mirror_order(self.landmarks)
        bounding = bounding_landmarks(self.landmarks)
        self._bounding = np.array([self.landmarks.index(name) for name in bounding])
        self._nose_frame = np.array([self.landmarks.index(name) for name in NOSE_FRAME])
        self._temperatures = np.array([self.model["temperatures"][name] for name in self.aus])
        offsets = self.model.get("offsets", {})
        self._offsets = np.array([offsets.get(name, 0.0) for name in self.aus])
        self._thresholds = {name: float(self.model["thresholds"][name]) for name in self.aus}
        self._face_temperature = float(self.model["face_temperature"])

    def detect(self, drawing: NDArray, head: Box | None = None) -> Detection:
        """Read a drawing (h, w) float, 1 = paper and 0 = ink.

        head : where to look for the face, in its pixels, instead of wherever there is ink; what is
        there is read whatever it looks like

        A drawing that lies on its side or upside down is turned: see `turn` of the detection.
        Raises InputError for another shape, dtype or range. A page without a face gives a detection
        with a `trouble`: the caller decides what to make of it.
        """
        page = as_page(drawing)
        turn, reading = upright(self, page, head)
        found = self.interpret(reading, turn, placed=head is not None)
        return found if found.trouble else self._closer(found, turned(page, turn), reading.box.turn)

    def _closer(self, found: Detection, page: Floats, turn: float) -> Detection:
        """With what the smaller networks say of a face's mouth and head, if there are any."""
        if self._mouth:
            found = replace(found, mouth=self._mouth.read(page, found.landmarks, turn))
        if self._head:
            head = self._head.read(page, found.landmarks, turn)
            mask = head.mask
            if found.mask:
                # Hats are hard to tell from hair: two looks err less than one. Beards that people
                # draw are told better by the look at the face, which has seen more of them.
                mask = mask.agreed(found.mask, "hat").agreed(found.mask, "beard", 1.0)
            found = replace(found, mask=mask, person=_told_besides(found.person, head.person))
        return found

    def interpret(self, reading: Reading, turn: int = 0, placed: bool = False) -> Detection:
        """The networks' answer as probabilities, decisions and intensities.

        placed : somebody has said that there is a face, and where
        """
        why = "" if placed else trouble(reading)
        probability = sigmoid(self.log_odds(reading.logits))
        probabilities = dict(zip(self.aus, probability.tolist(), strict=True))
        strong = {
            name: float(np.clip(value, ACTIVE, FULL))
            if not why and probabilities[name] >= self._thresholds[name]
            else 0.0
            for name, value in zip(self.aus, reading.intensities, strict=True)
        }
        intensities = resolve(strong, probabilities)
        yaw, pitch, roll = reading.angles.tolist()
        face = float(sigmoid(np.array(reading.face / self._face_temperature)))
        upright = reading.box.to_units(reading.landmarks[self._bounding])[:, 1]
        height = float(np.ptp(upright)) * reading.box.height
        # What the spread is learnt as is the mean of a distance: it is distributed exponentially.
        close = 1 - np.exp(-CLOSE * height / np.maximum(reading.spreads, 1e-9))
        return Detection(
            probabilities=probabilities,
            active={name: value > 0 for name, value in intensities.items()},
            intensities=intensities,
            head=(yaw, pitch, roll),
            landmarks={
                name: (float(u), float(v))
                for name, (u, v) in zip(self.landmarks, reading.landmarks, strict=True)
            },
            confidences=dict(zip(self.landmarks, close.tolist(), strict=True)),
            faces=(Face(reading.box, face), *reading.others)
            if face >= LEAST_FACE and not why
            else (),
            face_probability=face,
            turn=turn,
            trouble=why,
            person=self._person(reading.person),
            mask=reading.mask,
        )

    def _person(self, told: NDArray) -> dict[str, tuple[float, float]]:
        """Of each parameter what is believed and its spread, as is true of held-out drawings."""
        if not len(told):
            return {}
        spread = np.exp(told[:, 1]) * self.model.get("person_spreads", np.ones(len(told)))
        return {
            name: (float(mean), float(off))
            for name, mean, off in zip(self.person, told[:, 0], spread, strict=True)
        }

    def log_odds(self, logits: NDArray) -> NDArray[np.float64]:
        """Calibrated, of raw logits (..., k)."""
        return logits / self._temperatures + self._offsets

    def read(
        self, page: Floats, head: Box | None = None, turns: Sequence[float] = TURNS,
        farther: Sequence[float] = FARTHER,
    ) -> Reading:  # fmt: skip
        """Three looks at a page of ink (h, w), and one more for who is drawn.

        The first at all of it, or at the given `head`, finds the faces. The second at the box of
        the largest finds its landmarks, and so a better box, and is taken again in a turned box
        until the face is upright in it; if no face was found, the first look is taken for it. The
        third, at that box, reads the face. A box that the third look sees no face in is given up
        for the next smaller one, and in the end for all the ink. Where the landmarks are in doubt,
        the same is done `farther` off, unless it was told where to look; where the face is, with
        the page turned by `turns`, radians; the surest reading counts. The person is read from
        face, hair and shoulders as well.
        """
        whole = ink_square(page) if head is None else squared(head)
        reading = self._read(page, whole)
        near = reading.box.width  # hair and hats make a face larger than it is, never smaller
        for factor in farther if head is None else ():
            if expected_error(reading) <= DOUBT:
                break
            other = self._read(page, widened(whole, factor))
            if other.box.width <= near and surer(other, reading):
                reading = other
        for turn in turns:
            if reading.face > SURE:
                break
            turned = self._read(page, replace(widened(whole, AROUND), turn=turn))
            known = expected_error(turned) <= LIKELY  # a profile is a face at a slant to many
            if known and turned.face > reading.face + SURER:
                reading = turned
        if not self.person:
            return reading
        box = widened(reading.box, WIDER)
        around = self.look_both_ways(area_resample(page, box, self.size))
        return replace(
            reading,
            person=together(reading.person, around.person[0]),
            mask=Mask(box, sigmoid(around.regions[0])) if around.regions.size else None,
        )

    def _read(self, page: Floats, whole: Box) -> Reading:
        """The three looks at a crop of the page, which may be turned."""
        first = self.look(area_resample(page, whole, self.size)[None])
        faces = faces_on(first.found[0], whole)
        for face in faces[:TRIES]:
            faces = [other for other in faces if other is not face]
            second, room = self._upright(page, widened(face.box, ROOM))
            box = self._face_in(second, room, LEAST_OF_BOX) or widened(room, 1 / ROOM)
            crop = area_resample(page, box, self.size)
            third = self.look_both_ways(crop)
            if third.face[0] > 0:
                break
        else:
            box = self._face_in(first, whole, LEAST_OF_INK) or whole
            crop = area_resample(page, box, self.size)
            third = self.look_both_ways(crop)
        angles = third.angles[0] + (0, 0, box.turn)
        angles[2] = (angles[2] + np.pi) % (2 * np.pi) - np.pi
        return Reading(
            third.logits[0],
            third.intensities[0],
            angles,
            box.to_pixels(third.landmarks[0]),
            np.exp(third.spreads[0].astype(float)) * box.width,
            float(first.face[0] + third.face[0]) / 2,
            box,
            tuple(other for other in faces if not echo(other.box, box)),
            float(third.apart),
            nose_ink(crop, third.landmarks[0, self._nose_frame]),
            third.person[0].astype(float),
        )

    def _upright(self, page: Floats, room: Box) -> tuple[Answers, Box]:
        """The second look: at a box, turned until the face in it is upright; and that box."""
        seen = self.look(area_resample(page, room, self.size)[None])
        for _ in range(ROUNDS):
            roll = float(seen.angles[0, 2])
            if abs(roll) < LEVEL:
                break
            room = replace(room, turn=room.turn + roll)
            seen = self.look(area_resample(page, room, self.size)[None])
        return seen, room

    def _face_in(self, seen: Answers, crop: Box, least: float) -> Box | None:
        """The box of the landmarks that were seen in a crop, unless they are all in one spot."""
        flat = replace(crop, turn=0.0)
        box = face_box(flat.to_pixels(seen.landmarks[0, self._bounding]))
        middle = crop.to_pixels(flat.to_units(np.array(box.middle)))
        if box.width < least * crop.width:
            return None
        return Box.square(middle, box.width, crop.turn)

    def look(self, crops: Floats) -> Answers:
        """Run the networks on crops (b, size, size) of ink; lengths come in crop units."""
        return self.run(np.stack([even_ink(crop) for crop in crops]))

    def run(self, ink: Floats) -> Answers:
        """The same for ink that is as dark as the networks know it."""
        return self._networks.run(ink)

    def look_both_ways(self, crop: Floats) -> Answers:
        """Mean of a crop's (size, size) answers and of its mirror image's, mirrored back.

        A mirrored crop gives the mirrored answer. `found` is that of the crop alone; `apart` says
        how far the two differ in the landmarks.
        """
        a = self.look(np.stack([crop, crop[:, ::-1]]))
        flipped = a.landmarks[1, self._landmark_mirror] * (-1, 1) + (1, 0)
        return Answers(
            (a.logits[:1] + a.logits[1:, self._au_mirror]) / 2,
            (a.intensities[:1] + a.intensities[1:, self._au_mirror]) / 2,
            (a.angles[:1] + a.angles[1:] * (-1, 1, -1)) / 2,
            (a.landmarks[:1] + flipped[None]) / 2,
            (a.spreads[:1] + a.spreads[1:, self._landmark_mirror]) / 2,
            (a.face[:1] + a.face[1:]) / 2,
            a.found[:1],
            float(np.linalg.norm(a.landmarks[0] - flipped, axis=1).mean()),
            a.person.mean(axis=0, keepdims=True),
            (a.regions[:1] + a.regions[1:, :, :, ::-1]) / 2,
        )


def surer(other: Reading, reading: Reading) -> bool:
    """Whether a reading from farther off is of the same face and knows better where its landmarks
    are.

    What was no face stays none, unless it was taken with what hides it and is one without much
    doubt, as must be one on a page that is turned (`plausible.upright`).
    """
    if trouble(other):
        return False
    error, before = expected_error(other), expected_error(reading)
    if trouble(reading):
        bared = trouble(reading) == HIDDEN and other.box.width <= BARED * reading.box.width
        return bared and error <= min(BETTER * before, LIKELY)
    return error < before and echo(other.box, reading.box)


def together(*looks: NDArray) -> NDArray[np.float64]:
    """What several looks say of a person, (p, 2) mean and log of the spread, as one.

    Each counts by its precision; the precision of all is the mean of theirs, since looks at one
    drawing err together.
    """
    means, spreads = np.stack(looks, axis=-1).astype(float).swapaxes(0, 1)
    precision = np.exp(-2 * spreads)
    mean = (precision * means).sum(axis=-1) / precision.sum(axis=-1)
    return np.stack([mean, -0.5 * np.log(precision.mean(axis=-1))], axis=-1)


def _told_besides(
    person: dict[str, tuple[float, float]], look: NDArray
) -> dict[str, tuple[float, float]]:
    """What is believed of a person with one more look at WHO, (p, 2) mean and log of the spread."""
    believed = dict(person)
    for name, told in zip(WHO, look, strict=True):
        if name in person:
            mean, spread = person[name]
            told = together(told[None], np.array([[mean, np.log(spread)]]))[0]
        believed[name] = float(told[0]), float(np.exp(told[1]))
    return believed


def load_detector(folder: Path = WEIGHTS, threads: int = THREADS) -> Detector:
    """The shipped detector, or that of another weights folder; loaded once for each number of
    `threads` that ONNX Runtime may use.

    Raises InputError, one sentence, for weights that cannot be used or less than one thread.
    """
    if threads < 1:
        raise InputError(f"The detector runs on at least one thread, not {threads}.")
    return _loaded(Path(folder), threads)


# A function of its own: lru_cache would tell a default from the same value that was named.
@lru_cache(maxsize=4)
def _loaded(folder: Path, threads: int) -> Detector:
    return Detector(folder, threads)
