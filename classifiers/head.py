"""A closer look at the head: where face, hair, beard and hat are, to a few pixels.

The networks that read a face say of cells a sixteenth of their square wide what lies there, as well
as they know it from the face. Another network looks at the whole head, with what hangs from it and
what is worn on it, in a crop around the landmarks that they have found, and answers in finer cells:
the same trunk, whose earlier, finer layers are heard as well on the way back to the page
(Ronneberger, Fischer, Brox 2015, "U-Net", MICCAI).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from .labels import REGIONS
from .mask import Mask
from .preprocess import Floats, bounding_landmarks, even_ink, points_of
from .runtime import open_beside, sigmoid

NAME = "head"
"""Of the files beside the detector's."""
SIDE, LOWER = 2.6, 0.1
"""Of the height from chin to forehead or from jaw to jaw, whichever is more: what is looked at, and
how far its middle lies below the face's; hair hangs further down than it stands up."""
SIZE = 160
"""Pixels to a side of the crop."""
CELLS = 80
"""Cells to a side of the answer."""
FARTHER, HIGHER = 1.3, 0.12
"""How much larger the crop is in which tall hair or a tall hat is looked at again, and how much
higher, of the first crop's side."""
TALL = 4
"""Cells of the uppermost row that are hair or hat, from which on there may be more above."""
WHO = ("gender", "age")
"""Of identity, what hair and beard tell as well as the face."""


@dataclass(frozen=True, eq=False)
class Head:
    """mask : what lies where      person : of WHO the mean and the log of the spread, (p, 2)"""

    mask: Mask
    person: NDArray[np.float64]


def head_box(landmarks: Mapping[str, tuple[float, float]], turn: float = 0.0) -> Box:
    """What is looked at, of a face's landmarks in pixels; turn : radians, of the face's crop."""
    bounds = points_of(landmarks, bounding_landmarks(landmarks))
    flat = Box.square(bounds.mean(axis=0), 1.0, turn)
    upright = flat.to_units(bounds)
    low, high = upright.min(axis=0), upright.max(axis=0)
    side = max(float((high - low).max()), 1.0)
    middle = flat.to_pixels((low + high) / 2 + (0, LOWER * side))
    return Box.square(middle, SIDE * side, turn)


class HeadReader:
    """The network of a file beside the detector's."""

    def __init__(self, session: Any) -> None:
        self._session = session

    def read(self, page: Floats, landmarks: Mapping[str, tuple[float, float]], turn: float) -> Head:
        """The head of a face with these landmarks on a page of ink (h, w), in its pixels: the mean
        of a crop's answer and of its mirror image's, mirrored back."""
        box = head_box(landmarks, turn)
        mask, person = self._look(page, box)
        worn = mask.shares[[REGIONS.index(name) for name in ("hair", "hat")], 0].max(axis=0) > 0.5
        u = (np.arange(CELLS) + 0.5) / CELLS
        above = box.to_pixels(np.stack([u, np.zeros(CELLS)], axis=1))
        on_page = ((above > 0) & (above < page.shape[::-1])).all(axis=1)
        if (worn & on_page).sum() >= TALL:
            middle = box.to_pixels(np.array([[0.5, 0.5 - HIGHER]]))[0]
            far, _ = self._look(page, Box.square(middle, FARTHER * box.width, turn))
            mask = mask.amid(far, round(FARTHER * CELLS))
        return Head(mask, person)

    def _look(self, page: Floats, box: Box) -> tuple[Mask, NDArray[np.float64]]:
        """What a square of the page shows, and who."""
        crop = even_ink(area_resample(page, box, SIZE))
        both = np.stack([crop, crop[:, ::-1]])[:, None]
        logits, who = self._session.run(["regions", "who"], {"ink": both})
        mask = Mask(box, sigmoid((logits[0] + logits[1, :, :, ::-1]) / 2))
        return mask, who.mean(axis=0).astype(float)


def head_reader(folder: Path, threads: int) -> HeadReader | None:
    """The reader of a weights folder; None of one whose networks were trained without."""
    session = open_beside(folder, NAME, threads, regions=list(REGIONS), size=SIZE)
    return HeadReader(session) if session else None
