"""The shipped detector: a drawing in, the expression out. numpy and ONNX Runtime, nothing else."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .labels import ACTIVE, FULL, mirror_order, resolve_sides
from .metrics import sigmoid
from .preprocess import (
    Floats,
    area_resample,
    as_page,
    bounding_landmarks,
    even_ink,
    face_box,
    ink_box,
)

WEIGHTS = Path(__file__).parent / "weights"
DESCRIPTION = "model.json"
FORMAT = 1
THREADS = 2
ANGLES = ("yaw", "pitch", "roll")


@dataclass(frozen=True)
class Detection:
    """What a drawing shows. All mappings go by the names of the controls that can be detected.

    probabilities : how probable it is that each control is active, calibrated, 0..1
    active : probability above the control's own threshold, after the rule of left and right
    intensities : 0 if not active, else 1..5        head : yaw, pitch, roll in radians
    landmarks : name -> (u, v) pixels of the drawing     face_probability : that there is a face
    """

    probabilities: dict[str, float]
    active: dict[str, bool]
    intensities: dict[str, float]
    head: tuple[float, float, float]
    landmarks: dict[str, tuple[float, float]]
    face_probability: float

    def expression(self) -> dict[str, float]:
        """The active controls at their intensity, ready for `FaceParameters(aus=...)`."""
        return {name: self.intensities[name] for name, active in self.active.items() if active}

    def to_json(self) -> dict[str, Any]:
        """The expression and the head's angles in degrees, as commands and reports write them."""
        angles = np.degrees(self.head)
        return {
            "aus": {
                name: {
                    "probability": round(float(probability), 4),
                    "active": bool(self.active[name]),
                    "intensity": round(float(self.intensities[name]), 3),
                }
                for name, probability in self.probabilities.items()
            },
            "head": {n: round(float(a), 2) for n, a in zip(ANGLES, angles, strict=True)},
        }


@dataclass(frozen=True)
class Reading:
    """The networks' raw answer: logits (k,) yes minus no, intensities (k,) 0..5, angles (3,) rad,
    landmarks (m, 2) px of the page, logit of a face."""

    logits: NDArray[np.float64]
    intensities: NDArray[np.float64]
    angles: NDArray[np.float64]
    landmarks: NDArray[np.float64]
    face: float


class Detector:
    """The networks of a weights folder. Make one with `load_detector()`.

    `model` is the folder's description: names, input size, thresholds, temperatures, provenance of
    the training data and the figures measured on drawings that were held out.
    """

    def __init__(self, folder: Path, threads: int = THREADS) -> None:
        self.model = read_description(folder)
        self.aus: tuple[str, ...] = tuple(self.model["aus"])
        self.landmarks: tuple[str, ...] = tuple(self.model["landmarks"])
        self.size = int(self.model["size"])
        self._au_mirror = mirror_order(self.aus)
        self._landmark_mirror = mirror_order(self.landmarks)
        bounding = bounding_landmarks(self.landmarks)
        self._bounding = np.array([self.landmarks.index(name) for name in bounding])
        self._temperatures = np.array([self.model["temperatures"][name] for name in self.aus])
        self._thresholds = {name: float(self.model["thresholds"][name]) for name in self.aus}
        self._face_temperature = float(self.model["face_temperature"])
        self._session = open_session(folder / self.model["weights"], self.model["sha256"], threads)

    def detect(self, drawing: NDArray) -> Detection:
        """Read a drawing (h, w) float, 1 = paper and 0 = ink.

        Raises ValueError for another shape, dtype or range. A blank page gives a detection with a
        face probability near 0: the caller decides what to make of it.
        """
        return self.interpret(self.read(as_page(drawing)))

    def interpret(self, reading: Reading) -> Detection:
        """The networks' answer as probabilities, decisions and intensities."""
        probability = sigmoid(reading.logits / self._temperatures)
        probabilities = dict(zip(self.aus, probability.tolist(), strict=True))
        strong = {
            name: float(np.clip(value, ACTIVE, FULL))
            if probabilities[name] >= self._thresholds[name]
            else 0.0
            for name, value in zip(self.aus, reading.intensities, strict=True)
        }
        intensities = settle(likelier_side(strong, probabilities))
        yaw, pitch, roll = reading.angles.tolist()
        return Detection(
            probabilities=probabilities,
            active={name: value > 0 for name, value in intensities.items()},
            intensities=intensities,
            head=(yaw, pitch, roll),
            landmarks={
                name: (float(u), float(v))
                for name, (u, v) in zip(self.landmarks, reading.landmarks, strict=True)
            },
            face_probability=float(sigmoid(np.array(reading.face / self._face_temperature))),
        )

    def read(self, page: Floats) -> Reading:
        """Two looks at a page of ink (h, w): at all of it, then at the face found there.

        The second look is taken together with its mirror image and the two are averaged, so that a
        mirrored drawing gives the mirrored answer.
        """
        whole = ink_box(page)
        first = self.look(area_resample(page, whole, self.size)[None])
        found = whole.to_page(first.landmarks[0])
        near = face_box(found[self._bounding])
        if near.width < 0.1 * whole.width:  # all landmarks in one spot: there is no face to look at
            near = whole
        second = self.look_both_ways(area_resample(page, near, self.size))
        return Reading(
            second.logits[0],
            second.intensities[0],
            second.angles[0],
            near.to_page(second.landmarks[0]),
            float(first.face[0] + second.face[0]) / 2,
        )

    def look(self, crops: Floats) -> Answers:
        """Run the networks on crops (b, size, size) of ink; landmarks come in crop units."""
        ink = np.stack([even_ink(crop) for crop in crops])[:, None]
        units, landmarks, angles, face = self._session.run(None, {"ink": ink})[:4]
        return Answers(
            units[:, :, 1] - units[:, :, 0],
            units[:, :, 2] * FULL,
            angles,
            landmarks[:, :, :2],
            face,
        )

    def look_both_ways(self, crop: Floats) -> Answers:
        """Mean of a crop's (size, size) answers and of its mirror image's, mirrored back."""
        a = self.look(np.stack([crop, crop[:, ::-1]]))
        flipped = a.landmarks[1, self._landmark_mirror] * (-1, 1) + (1, 0)
        return Answers(
            (a.logits[:1] + a.logits[1:, self._au_mirror]) / 2,
            (a.intensities[:1] + a.intensities[1:, self._au_mirror]) / 2,
            (a.angles[:1] + a.angles[1:] * (-1, 1, -1)) / 2,
            (a.landmarks[:1] + flipped[None]) / 2,
            (a.face[:1] + a.face[1:]) / 2,
        )


@dataclass(frozen=True)
class Answers:
    """Raw outputs for b crops: logits and intensities (b, k), angles (b, 3), landmarks (b, m, 2),
    face (b,); units as in `Reading`, landmarks in crop units."""

    logits: NDArray
    intensities: NDArray
    angles: NDArray
    landmarks: NDArray
    face: NDArray


def likelier_side(
    intensities: dict[str, float], probabilities: dict[str, float]
) -> dict[str, float]:
    """Of a left and a right control that are both active keep the likelier, if one is in doubt.

    By the rule of left and right never both are, so that two that are says which side is uncertain;
    unless both are more likely than not, which is a symmetric action seen twice.
    """
    kept = dict(intensities)
    for left in intensities:
        right = left.removesuffix("_left") + "_right"
        if left.endswith("_left") and right in kept and kept[left] and kept[right]:
            doubtful = min(left, right, key=probabilities.__getitem__)
            if probabilities[doubtful] < 0.5:
                kept[doubtful] = 0.0
    return kept


def settle(intensities: dict[str, float]) -> dict[str, float]:
    """The rule of left and right on detected intensities (0 = not active).

    What both sides share belongs to the symmetric control and the rest to its side
    (`labels.resolve_sides`); no side is carried beyond a full natural activation by the sum of the
    two, and what is left of a side under `ACTIVE` is dropped. Idempotent.
    """
    settled = resolve_sides(intensities)
    for name in intensities:
        for side in (f"{name}_left", f"{name}_right"):
            if side in settled:
                settled[name] = min(settled[name], FULL)
                rest = min(settled[side], FULL - settled[name])
                settled[side] = rest if rest >= ACTIVE else 0.0
    return settled


def read_description(folder: Path) -> dict[str, Any]:
    """model.json of a weights folder; ValueError names the file if it is missing or damaged."""
    path = Path(folder) / DESCRIPTION
    try:
        model = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ValueError(
            f"{path} is missing: install the package again, or train with `sketch2face train`."
        ) from None
    except ValueError:
        raise ValueError(f"{path} is damaged: install the package again.") from None
    if model.get("format") != FORMAT:
        raise ValueError(
            f"{path} has format {model.get('format')}, this version reads {FORMAT}: weights and"
            " program must come from the same release."
        )
    return model


def open_session(path: Path, sha256: str, threads: int):
    """ONNX Runtime on a weights file; ValueError names it if its checksum is not the known one."""
    try:
        weights = path.read_bytes()
    except OSError:
        raise ValueError(f"{path} cannot be read: install the package again.") from None
    if hashlib.sha256(weights).hexdigest() != sha256:
        raise ValueError(f"{path} is damaged or of another version: install the package again.")
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # Waiting threads sleep: the host (Blender) has better use for the cores.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    return onnxruntime.InferenceSession(weights, options, providers=["CPUExecutionProvider"])


@lru_cache(maxsize=4)
def load_detector(folder: Path = WEIGHTS) -> Detector:
    """The shipped detector, or that of another weights folder; loaded once."""
    return Detector(Path(folder))
