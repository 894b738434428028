"""From a drawing to the contours that become snakes (thesis, chapter 3, step 3).

The drawing is cropped to the head and brought to 91 x 200 pixels, turned into black and white,
its gaps are closed and its lines thinned, and marching squares gives the contours.

Marching squares goes round a line, it does not follow it: a drawn stroke becomes one closed loop
at about half a pixel from its ink, up one side and down the other, and a drawn ring becomes two
loops. The thesis runs those loops as they are, and so do we: the two sides of a stroke land on the
same line of the render, where their deltas are averaged and half a pixel either way cancels out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter
from skimage.filters import threshold_otsu
from skimage.measure import find_contours, perimeter
from skimage.morphology import closing, thin

from facs_rig import Camera
from facs_rig.common.box import Box
from facs_rig.common.errors import InputError
from facs_rig.common.images import area_resample
from facs_rig.common.polylines import line_length

from .tweakables import WORKING_SIZE

__all__ = [
    "binarise",
    "cut_at_corners",
    "find_lines",
    "head_box",
    "working_drawing",
]

SHORTEST = 6.0
"""Loops shorter than this many pixels go round a speck, not round a line."""
CORNER_REACH = 3
"""How many points before and after a point say how sharply the contour turns there."""
CORNER_COSINE = -0.2
"""Cosine of the turn from which on it is a corner (a little more than a right angle)."""

MARGIN = 0.06
"""Room around the projected face, as a fraction of its width and height."""


def head_box(posed: NDArray[np.floating], camera: Camera) -> Box:
    """The crop: the box around the projected face (n, 3) and some room, in the camera's pixels.

    Raises ValueError when the face is outside the camera's picture.
    """
    pixels = camera.project(posed)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    if (high < 0).any() or low[0] > camera.width or low[1] > camera.height:
        raise InputError("The face is outside the sketch; check the alignment.")
    return Box.around(pixels).grown(MARGIN)


def working_drawing(
    drawing: NDArray[np.floating], box: Box, size: tuple[int, int] = WORKING_SIZE
) -> NDArray[np.float32]:
    """Crop a drawing to `box` and bring it to the working size without losing thin lines.

    A line that is thinner than a pixel of the working image would fade when its pixels are
    averaged, so the ink is first spread (a minimum filter) until its lines are about as wide as
    such a pixel; lines that are wider already stay as they are.

    Parameters
    ----------
    drawing : (h, w) float
        1 is paper, 0 is ink.
    box : in pixels of the drawing
        May reach beyond the drawing; there is paper outside.
    size : (width, height) of the result in pixels

    Returns
    -------
    (height, width) float32, 1 is paper, 0 is ink
    """
    image = _checked(drawing)
    width, height = size
    cell_u, cell_v = box.width / width, box.height / height
    line = _line_width(image)
    spread = (_odd(cell_v - line + 1.0), _odd(cell_u - line + 1.0))
    if max(spread) > 1:
        image = minimum_filter(image, size=spread, mode="constant", cval=1.0)
    return area_resample(image, box, size, outside=1.0)


def binarise(drawing: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Where a drawing (1 is paper, 0 is ink) has ink, by Otsu's threshold; (h, w) bool.

    Otsu, "A threshold selection method from gray-level histograms", 1979. A picture of one single
    grey has no ink.
    """
    image = _checked(drawing)
    if float(np.ptp(image)) < 1e-3:
        return np.zeros(image.shape, dtype=bool)
    return image < threshold_otsu(image)


def find_lines(
    drawing: NDArray[np.floating], gap_closing: int = 2, thinning_iterations: int = 1
) -> list[NDArray[np.float64]]:
    """Find the contours of the lines of a drawing.

    Gaps are closed with a square of side `gap_closing` pixels, `thinning_iterations` layers are
    peeled off (Guo and Hall's parallel thinning, as scikit-image has it), and marching squares
    runs round what is left.

    Parameters
    ----------
    drawing : (h, w) float
        1 is paper, 0 is ink.

    Returns
    -------
    list of (k, 2) float64
        Closed loops as (u, v), pixel centres at .5, the first point repeated as the last.
    """
    ink = binarise(drawing)
    # Paper around the picture, so that loops close and nothing happens at the border.
    rim = gap_closing + 1
    ink = np.pad(ink, rim)
    if gap_closing > 1:
        ink = closing(ink, np.ones((gap_closing, gap_closing), dtype=bool))
    if thinning_iterations > 0:
        ink = thin(ink, max_num_iter=thinning_iterations)
    # "high": pixels that touch at a corner only, as a thinned slanting line has them, are one line.
    loops = find_contours(ink.astype(np.float64), 0.5, fully_connected="high")
    lines = [loop[:, ::-1] - rim + 0.5 for loop in loops]
    return [line for line in lines if line_length(line) >= SHORTEST]


def cut_at_corners(line: NDArray[np.float64], shortest: int = 5) -> list[NDArray[np.float64]]:
    """Cut a contour (k, 2) where it turns back or bends sharply, as at the tips of a stroke.

    A loop round a stroke would otherwise pull itself together lengthwise, and where strokes touch,
    one long loop would stretch across the face from one feature to the next. Returns the pieces of
    at least `shortest` points; a closed loop is opened at its first corner.
    """
    closed = len(line) > 1 and bool(np.allclose(line[0], line[-1]))
    points = line[:-1] if closed else line
    n = len(points)
    if n < 4 * CORNER_REACH:
        return [line] if len(line) >= shortest else []
    here = np.arange(n)
    before = points - points[(here - CORNER_REACH) % n]
    after = points[(here + CORNER_REACH) % n] - points
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    bend = np.einsum("ij,ij->i", before, after) / np.maximum(lengths, 1e-9)
    if not closed:
        bend[:CORNER_REACH] = bend[-CORNER_REACH:] = 1.0
    window = np.stack([np.roll(bend, k) for k in range(-CORNER_REACH, CORNER_REACH + 1)])
    corners = np.flatnonzero((bend < CORNER_COSINE) & (bend <= window.min(axis=0)))
    if len(corners) == 0:
        return [line] if len(line) >= shortest else []
    if closed:
        points = np.roll(points, -corners[0], axis=0)
        points = np.concatenate([points, points[:1]])
        corners = corners[1:] - corners[0]
    pieces = np.split(points, corners)
    # Neighbouring pieces share their corner, so that nothing of the line is lost.
    pieces = [
        np.concatenate([piece, following[:1]])
        for piece, following in zip(pieces, [*pieces[1:], points[:0]], strict=True)
    ]
    return [piece for piece in pieces if len(piece) >= shortest]


def _line_width(image: NDArray[np.float32]) -> float:
    """Typical width of the drawn lines in pixels: twice the inked area over its perimeter."""
    ink = np.pad(image < 0.5, 1)
    around = float(perimeter(ink, neighborhood=8)) if ink.any() else 0.0
    # `perimeter` runs through the centres of the border pixels, which a line of one pixel has once.
    return max(1.0, 2.0 * float(ink.sum()) / around) if around > 0 else 1.0


def _odd(width: float) -> int:
    """The nearest odd whole number, at least 1 (an even window would shift the lines)."""
    return max(1, 2 * round((width - 1.0) / 2.0) + 1)


def _checked(drawing: NDArray[np.floating]) -> NDArray[np.float32]:
    image = np.asarray(drawing, dtype=np.float32)
    if image.ndim != 2 or image.size == 0:
        raise ValueError(
            f"A drawing is a grey picture of shape (height, width), not one of shape {image.shape}."
        )
    return image
