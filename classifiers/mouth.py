"""A closer look at the mouth: where its lips and their rims are drawn, and whether it is open.

The networks see a whole face in a square of some hundred pixels, in which a row of teeth is two
pixels high, and answer which actions a face does; how far apart its lips are drawn they tell badly.
A small network of its own looks at the mouth alone, in the crop that they have found (a cascade:
Sun, Wang, Tang 2013, "Deep Convolutional Network Cascade for Facial Point Detection", CVPR).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from .labels import mirror_order
from .preprocess import Floats, bounding_landmarks, even_ink, points_of
from .runtime import open_beside, sigmoid

NAME = "mouth"
"""Of the files beside the detector's."""
MOUTH = tuple(name for name in LANDMARKS if name.startswith(("lip_", "mouth_")))
"""The landmarks that it tells."""
MIRROR = mirror_order(MOUTH)
SIDE = 0.62
"""Of the height from chin to forehead or from jaw to jaw, whichever is more: what is looked at."""
NEAREST, ROOM = 0.8, 1.35
"""Of that, what is looked at again around the mouth that was found, and in mouths, where that is
more: small ones are seen larger, and none is cut off."""
SIZE = 80
"""Pixels to a side of the crop."""
RIMS = (
    ("lip_inner_upper_right", "lip_inner_lower_right"),
    ("lip_inner_top", "lip_inner_bottom"),
    ("lip_inner_upper_left", "lip_inner_lower_left"),
)
"""The upper rim and the lower one, from right to left."""
OPEN = 0.03
"""Of the same height, the mean distance of the rims from which on a mouth is open: of lips that
meet it is 0.014, for the landmarks lie on them."""


@dataclass(frozen=True)
class Mouth:
    """A mouth as it is drawn.

    landmarks : of MOUTH -> (u, v) pixels      spreads : of MOUTH -> their expected error, pixels
    opened : how probable it is that it is open, 0..1
    meets : if it is, how probable it is that its teeth meet, so that the jaw is shut
    """

    landmarks: dict[str, tuple[float, float]]
    spreads: dict[str, float]
    opened: float
    meets: float = 0.0


def mouth_box(landmarks: Mapping[str, tuple[float, float]], turn: float = 0.0) -> Box:
    """What is looked at, of a face's landmarks in pixels; turn : radians, of the face's crop."""
    bounds = points_of(landmarks, bounding_landmarks(landmarks))
    upright = Box.square(bounds.mean(axis=0), 1.0, turn).to_units(bounds)
    side = float(np.ptp(upright, axis=0).max())
    return Box.square(points_of(landmarks, MOUTH).mean(axis=0), max(SIDE * side, 1.0), turn)


class MouthReader:
    """The network of a file beside the detector's."""

    def __init__(self, session: Any) -> None:
        self._session = session

    def read(
        self, page: Floats, landmarks: Mapping[str, tuple[float, float]], turn: float
    ) -> Mouth:
        """The mouth on a page of ink (h, w), of a face with these landmarks, in its pixels: after a
        look at where they have it, by another at where it is."""
        box = mouth_box(landmarks, turn)
        found = self._look(page, box)[0][:, :2]
        extent = float(np.ptp(found, axis=0).max())
        side = box.width * float(np.clip(ROOM * extent, NEAREST, 1.0))
        box = Box.square(box.to_pixels(found).mean(axis=0), side, turn)
        places, opened, meets = self._look(page, box)
        points = box.to_pixels(places[:, :2]).tolist()
        return Mouth(
            {name: (u, v) for name, (u, v) in zip(MOUTH, points, strict=True)},
            dict(zip(MOUTH, (np.exp(places[:, 2]) * box.width).tolist(), strict=True)),
            opened,
            meets,
        )

    def _look(self, page: Floats, box: Box) -> tuple[NDArray[np.float64], float, float]:
        """Of a crop and its mirror image, landmarks (m, 3) in crop units with the log of their
        expected error, and how probable it is that the mouth is open, and that teeth meet."""
        crop = even_ink(area_resample(page, box, SIZE))
        both = np.stack([crop, crop[:, ::-1]])[:, None]
        places, opened, meets = self._session.run(None, {"ink": both})
        flipped = places[1, MIRROR] * (-1, 1, 1) + (1, 0, 0)
        mean = (places[0] + flipped) / 2
        return mean, float(sigmoid(opened.mean())), float(sigmoid(meets.mean()))


def mouth_reader(folder: Path, threads: int) -> MouthReader | None:
    """The reader of a weights folder; None of one whose networks were trained without."""
    session = open_beside(folder, NAME, threads, landmarks=list(MOUTH), size=SIZE)
    return MouthReader(session) if session else None


def opening(landmarks: NDArray) -> NDArray[np.float64]:
    """(...,) mean distance of the rims of mouths with landmarks (..., m, 2) of MOUTH."""
    upper, lower = (landmarks[..., [MOUTH.index(pair[k]) for pair in RIMS], :] for k in (0, 1))
    return np.linalg.norm(lower - upper, axis=-1).mean(axis=-1)
