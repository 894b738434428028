"""From a page to the square that the networks see, and back; for training and detection alike.

A page is a drawing as *ink*: float32 (h, w), 0 = paper and 1 = black (drawings elsewhere in the
project are the other way round, 1 = paper). Off the page there is no ink.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

# The second look: the landmarks' box from chin to forehead, and a little more, since they are only
# found to a few hundredths of it.
FACE_MARGIN = 1.12
PAGE_MARGIN = 1.06
TYPICAL_INK = 0.6
BLOCK = 16
LARGE = 512
FINE = 2  # samples along each side of a cell of a turned crop


@dataclass(frozen=True)
class Crop:
    """A rectangle of the page, in its pixels (u right, v down, pixel centres at .5).

    turn : radians, clockwise on the page, about its middle; left and top are as if it were 0
    """

    left: float
    top: float
    width: float
    height: float
    turn: float = 0.0

    @property
    def middle(self) -> tuple[float, float]:
        """In page pixels, however it is turned."""
        return self.left + self.width / 2, self.top + self.height / 2

    def to_crop(self, points: NDArray) -> NDArray[np.float64]:
        """Page pixels (..., 2) -> crop units (..., 2), 0..1 inside."""
        points = _about(np.asarray(points, float), self.middle, -self.turn)
        return (points - (self.left, self.top)) / (self.width, self.height)

    def to_page(self, points: NDArray) -> NDArray[np.float64]:
        """Crop units (..., 2) -> page pixels (..., 2)."""
        flat = np.asarray(points, float) * (self.width, self.height) + (self.left, self.top)
        return _about(flat, self.middle, self.turn)

    def within(self, shape: tuple[int, ...]) -> bool:
        """Whether the rectangle lies on a page (h, w) whole."""
        right, bottom = self.left + self.width, self.top + self.height
        return self.left >= 0 and self.top >= 0 and right <= shape[1] and bottom <= shape[0]

    def apart(self, other: Crop) -> bool:
        """Whether two rectangles share nothing."""
        return (
            self.left >= other.left + other.width
            or other.left >= self.left + self.width
            or self.top >= other.top + other.height
            or other.top >= self.top + self.height
        )

    @classmethod
    def square(cls, centre: Iterable[float], side: float, turn: float = 0.0) -> Crop:
        u, v = centre
        return cls(u - side / 2, v - side / 2, side, side, turn)


def _about(points: NDArray, middle: tuple[float, float], turn: float) -> NDArray[np.float64]:
    """Points (..., 2) of the page, turned clockwise about another."""
    if not turn:
        return points
    c, s = np.cos(turn), np.sin(turn)
    return (points - middle) @ np.array([[c, s], [-s, c]]) + middle


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


def area_resample(ink: NDArray, crop: Crop, size: int) -> Floats:
    """The mean ink in each cell of a size x size grid over the crop: (size, size) float32.

    Exact for any real rectangle: a pixel counts with the area that it shares with the cell, and
    what lies off the page counts as paper. Linear in the ink. A crop that is turned is sampled at
    some points in each cell.
    """
    if crop.turn:
        return _turned(ink, crop, size)
    columns = slice(
        int(np.clip(np.floor(crop.left), 0, ink.shape[1])),
        int(np.clip(np.ceil(crop.left + crop.width), 0, ink.shape[1])),
    )
    part = _average(ink[:, columns], crop.top, crop.height, size)
    return np.ascontiguousarray(_average(part.T, crop.left - columns.start, crop.width, size).T)


def _turned(ink: NDArray, crop: Crop, size: int) -> Floats:
    """`area_resample` of a turned crop: of the upright square around it, then between its cells."""
    cells = FINE * size
    side = float(np.hypot(crop.width, crop.height))
    around = Crop.square(crop.middle, side * (1 + 2 / cells))
    count = int(np.ceil(cells * around.width / max(crop.width, crop.height)))
    fine = area_resample(ink, around, count)
    grid = (np.arange(cells) + 0.5) / cells
    points = np.stack(np.broadcast_arrays(grid[None, :], grid[:, None]), axis=-1)
    place = around.to_crop(crop.to_page(points)).astype(np.float32) * count - np.float32(0.5)
    first = np.clip(np.floor(place).astype(np.intp), 0, count - 2)
    u, v = np.moveaxis((place - first).astype(np.float32), -1, 0)
    at, flat = first[..., 1] * count + first[..., 0], fine.ravel()
    above = (1 - u) * flat[at] + u * flat[at + 1]
    below = (1 - u) * flat[at + count] + u * flat[at + count + 1]
    every = (1 - v) * above + v * below
    return np.ascontiguousarray(every.reshape(size, FINE, size, FINE).mean(axis=(1, 3)))


def _average(ink: NDArray, start: float, length: float, size: int) -> Floats:
    """Mean over `size` equal cells along the first axis: (n, w) -> (size, w).

    A product with the shares of each pixel in each cell, in blocks of cells so that large pages are
    not multiplied with zeros.
    """
    out = np.zeros((size, ink.shape[1]), np.float32)
    edges = start + length / size * np.arange(size + 1)
    for i in range(0, size, BLOCK):
        low, high = edges[i : i + BLOCK + 1][:-1, None], edges[i + 1 : i + BLOCK + 1][:, None]
        first = int(np.clip(np.floor(low[0, 0]), 0, len(ink)))
        last = int(np.clip(np.ceil(high[-1, 0]), first, len(ink)))
        if last > first:
            pixel = np.arange(first, last)
            share = np.minimum(pixel + 1, high) - np.maximum(pixel, low)
            share = (np.maximum(share, 0) / (high - low)).astype(np.float32)
            out[i : i + BLOCK] = share @ ink[first:last].astype(np.float32, copy=False)
    return out


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


def ink_box(ink: Floats) -> Crop:
    """The square around all the ink of a page, with a margin; around the page if it is blank.

    Specks do not count: a thousandth of the ink may lie beyond each side.
    """
    height, width = ink.shape
    cell_v = cell_u = 1.0
    if max(height, width) > LARGE:  # the box of a large page need not be known to the pixel
        ink = area_resample(ink, Crop(0, 0, width, height), LARGE)
        cell_v, cell_u = height / LARGE, width / LARGE
    strong = ink * (ink > 0.25 * float(ink.max()))
    total = float(strong.sum())
    if total <= 0:
        return Crop.square((width / 2, height / 2), max(width, height))
    ends = []
    for axis, cell in ((0, cell_u), (1, cell_v)):
        share = np.cumsum(strong.sum(axis=axis, dtype=np.float64)) / total
        low, high = np.searchsorted(share, (0.001, 0.999))
        ends.append((cell * float(low), cell * float(min(high + 1, len(share)))))
    (left, right), (top, bottom) = ends
    side = max(right - left, bottom - top) * PAGE_MARGIN
    return Crop.square(((left + right) / 2, (top + bottom) / 2), side)


def face_box(points: NDArray) -> Crop:
    """The square of the second look, in page pixels.

    points : (m, 2) the landmarks named by `bounding_landmarks`, page pixels. From chin to forehead
    and from jaw to jaw: hair, hats, neck and shoulders stay outside as far as a square allows.
    """
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    side = max(float(np.max(high - low)), 1.0) * FACE_MARGIN
    return Crop.square((low + high) / 2, side)


def bounding_landmarks(names: Iterable[str]) -> list[str]:
    """Those landmarks that bound a face whatever is on the head: no crown, no neck."""
    return [name for name in names if not {"crown", "neck"} & set(name.split("_"))]


def points_of(
    landmarks: Mapping[str, Iterable[float]], names: Iterable[str]
) -> NDArray[np.float64]:
    """(m, 2) array of the named landmarks."""
    return np.array([tuple(landmarks[name]) for name in names], float)
