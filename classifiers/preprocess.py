"""From a page to the square that the networks see, and back; for training and detection alike.

A page is a drawing as *ink*: float32 (h, w), 0 = paper and 1 = black (drawings elsewhere in the
project are the other way round, 1 = paper). Off the page there is no ink.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

Floats = NDArray[np.float32]

# The second look: the landmarks' box from chin to forehead, and a little more, since they are only
# found to a few hundredths of it.
FACE_MARGIN = 1.12
# Who is drawn is told by hair and shoulders, too: so much more than the face is looked at for that.
WIDER = 1.8
PAGE_MARGIN = 1.06
TYPICAL_INK = 0.6
LARGE = 512
STRIDE = 16  # pixels of that square to a side of the cells in which the networks answer


def as_page(drawing: NDArray) -> Floats:
    """Check a drawing (h, w) with 1 = paper, 0 = black, and return it as ink (h, w) float32.

    Raises ValueError for other shapes, for other than floats and for values outside 0..1.
    """
    array = np.asarray(drawing)
    if array.ndim != 2 or 0 in array.shape:
        raise ValueError(
            f"A drawing must be a grey image (h, w) with at least one pixel, not {array.shape}."
        )
    if not np.issubdtype(array.dtype, np.floating):
        raise ValueError(
            f"A drawing must hold floats from 0 (ink) to 1 (paper), not {array.dtype}:"
            " divide by the largest value."
        )
    low, high = float(array.min()), float(array.max())
    if not (low >= -0.01 and high <= 1.01):
        raise ValueError(
            f"A drawing's values must lie between 0 (ink) and 1 (paper), not {low:g} to {high:g}."
        )
    ink = np.subtract(1, array, dtype=np.float32, casting="same_kind")
    return np.clip(ink, 0, 1, out=ink)  # in place: pages may be large


def even_ink(ink: Floats) -> Floats:
    """Scale ink so that its typical line is `TYPICAL_INK` dark: pencil and felt pen look alike.

    Typical is the ink's mean weighted by itself, so that the amount of paper does not matter. What
    is nearly blank stays nearly blank.
    """
    total = float(ink.sum())
    if total <= 0:
        return ink
    typical = float(np.square(ink).sum()) / total
    return np.minimum(ink * (TYPICAL_INK / max(typical, 0.08)), 1).astype(np.float32)


def ink_square(ink: Floats) -> Box:
    """The square around all the ink of a page, with a margin; around the page if it is blank.

    Specks do not count: a thousandth of the ink may lie beyond each side.
    """
    height, width = ink.shape
    cell_v = cell_u = 1.0
    if max(height, width) > LARGE:  # the box of a large page need not be known to the pixel
        ink = area_resample(ink, Box.at(0, 0, width, height), LARGE)
        cell_v, cell_u = height / LARGE, width / LARGE
    strong = ink * (ink > 0.25 * float(ink.max()))
    total = float(strong.sum())
    if total <= 0:
        return Box.square((width / 2, height / 2), max(width, height))
    ends = []
    for axis, cell in ((0, cell_u), (1, cell_v)):
        share = np.cumsum(strong.sum(axis=axis, dtype=np.float64)) / total
        low, high = np.searchsorted(share, (0.001, 0.999))
        ends.append((cell * float(low), cell * float(min(high + 1, len(share)))))
    (left, right), (top, bottom) = ends
    side = max(right - left, bottom - top) * PAGE_MARGIN
    return Box.square(((left + right) / 2, (top + bottom) / 2), side)


def face_box(points: NDArray) -> Box:
    """The square of the second look, in page pixels.

    points : (m, 2) the landmarks named by `bounding_landmarks`, page pixels. From chin to forehead
    and from jaw to jaw: hair, hats, neck and shoulders stay outside as far as a square allows.
    """
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    side = max(float(np.max(high - low)), 1.0) * FACE_MARGIN
    return Box.square((low + high) / 2, side)


def bounding_landmarks(names: Iterable[str]) -> list[str]:
    """Those landmarks that bound a face whatever is on the head: no crown, no neck."""
    return [name for name in names if not {"crown", "neck"} & set(name.split("_"))]


def points_of(
    landmarks: Mapping[str, Iterable[float]], names: Iterable[str]
) -> NDArray[np.float64]:
    """(m, 2) array of the named landmarks."""
    return np.array([tuple(landmarks[name]) for name in names], float)
