"""What a detector answers to drawings: ours and others that are compared with it alike."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..detector import Detector, Reading
from ..preprocess import Floats, as_page


@dataclass(frozen=True)
class Answers:
    """What was answered to n drawings; nan where a detector says nothing of a thing.

    probability, active, intensity : (n, k), the last 0..5 as if the unit were active
    angles : (n, 3) radians      landmarks : (n, m, 2) pixels of the drawing
    confidence : (n, m) how probable a landmark is within `CLOSE`      face : (n,) probability
    person : (n, p) of the parameters that PERSON names; none if nothing is said of them
    """

    probability: NDArray[np.float64]
    active: NDArray[np.bool_]
    intensity: NDArray[np.float64]
    angles: NDArray[np.float64]
    landmarks: NDArray[np.float64]
    confidence: NDArray[np.float64]
    face: NDArray[np.float64]
    person: NDArray[np.float64]

    def take(self, index: NDArray) -> Answers:
        return Answers(**{name: values[index] for name, values in vars(self).items()})


Row = tuple[Sequence[float], Sequence[bool], NDArray, Sequence[float], Any, Sequence[float], float,
            Sequence[float]]  # fmt: skip


class Reader(Protocol):
    """Whatever can be evaluated: a page of ink (h, w) in, a row of each field of Answers out."""

    @property
    def aus(self) -> tuple[str, ...]: ...

    @property
    def landmarks(self) -> tuple[str, ...]: ...

    @property
    def about(self) -> dict[str, Any]:
        """Which networks these are, as the figures name them."""
        ...

    def row(self, page: Floats) -> Row: ...


@dataclass(frozen=True)
class DetectorReader:
    """The detector, with all that it decides."""

    detector: Detector

    @property
    def aus(self) -> tuple[str, ...]:
        return self.detector.aus

    @property
    def landmarks(self) -> tuple[str, ...]:
        return self.detector.landmarks

    @property
    def about(self) -> dict[str, Any]:
        return {"networks": "detector", "sha256": self.detector.model["sha256"]}

    def row(self, page: Floats) -> Row:
        return self.answer(self.detector.read(page))

    def answer(self, reading: Reading) -> Row:
        said = self.detector.interpret(reading)
        return (
            list(said.probabilities.values()),
            list(said.active.values()),
            reading.intensities,
            said.head,
            reading.landmarks,
            list(said.confidences.values()),
            said.face_probability,
            reading.person[:, 0].tolist(),
        )


def stacked(rows: Sequence[Row]) -> Answers:
    return Answers(*(np.array(column) for column in zip(*rows, strict=True)))


def pages_of(drawings: Iterable[NDArray[np.uint8]]) -> Iterator[Floats]:
    """uint8 drawings (h, w), 255 = paper, as pages of ink."""
    return (as_page(drawing / np.float32(255)) for drawing in drawings)


def read_all(detector: Detector, pages: Iterable[Floats]) -> list[Reading]:
    return [detector.read(page) for page in pages]
