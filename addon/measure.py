"""How far the lines of a face lie from those of a sketch, in pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from addon.strategies import Fitted
from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.common.box import Box
from snakes import (
    WORKING_SIZE,
    Lines,
    SurfaceLines,
    centre_lines,
    face_contours,
    face_lines,
    head_box,
    unmatched_lines,
)
from snakes.model_lines import EVERY, INNER

HEIGHT = 400  # pixels in which the box of the head is measured, at most


@dataclass(frozen=True)
class Ruler:
    """A sketch made ready to be compared with many faces.

    box : pixels of the drawing, that is measured in
    lines : (h, w) bool, the sketch's lines there, a cell wide
    distance : (h, w) cells to the nearest of them       cell : pixels of the drawing per cell
    reach : cells at which every distance is cut
    """

    box: Box
    lines: NDArray[np.bool_]
    distance: NDArray[np.float64]
    cell: float
    reach: float


def ruler(drawing: NDArray, box: Box, reach: float) -> Ruler:
    """Prepare a drawing (h, w; 1 is paper) for `contour_error` within `box`.

    box : pixels;  reach : pixels.
    """
    left, top, right, bottom = (int(round(x)) for x in box)
    size = np.array([max(bottom - top, 2), max(right - left, 2)])
    cell = max(1.0, size[0] / HEIGHT)
    h, w = np.ceil(size / cell).astype(int)
    from skimage.filters import threshold_otsu
    from skimage.morphology import skeletonize
    from skimage.transform import resize

    page = np.ones(size, dtype=np.float32)
    y0, x0 = max(top, 0), max(left, 0)
    part = drawing[y0 : max(bottom, 0), x0 : max(right, 0)]
    page[y0 - top : y0 - top + part.shape[0], x0 - left : x0 - left + part.shape[1]] = part
    if cell > 1:
        page = resize(page, (h, w), order=1, anti_aliasing=True)
    lines = np.zeros(page.shape, dtype=bool)
    if page.max() > page.min():
        lines = skeletonize(page < threshold_otsu(page))
    return Ruler(
        Box(left, top, right, bottom), lines, distance_transform_edt(~lines), cell, reach / cell
    )


def without_hair(ruler: Ruler, hair: Callable[[NDArray], NDArray]) -> Ruler:
    """A ruler that knows no lines where hair is; hair : see Comparison."""
    row, column = np.nonzero(ruler.lines)
    left, top, right, bottom = ruler.box
    size = np.array(ruler.lines.shape[::-1])
    cell = np.array([right - left, bottom - top]) / size
    places = (np.stack([column, row], axis=1) + 0.5) * cell + (left, top)
    lines = ruler.lines.copy()
    lines[row, column] = ~hair(places)
    return replace(ruler, lines=lines, distance=distance_transform_edt(~lines))


def contour_error(ruler: Ruler, points: NDArray) -> float:
    """Mean distance, in pixels of the drawing, between a face's lines and the sketch's.

    A symmetric chamfer distance (Barrow, Tenenbaum, Bolles, Wolf 1977): from each to the other,
    every distance cut at the ruler's reach, so that a line without any counterpart (hair, a hat)
    counts as much and no more wherever the face lies. The reach where either has no lines.

    points : (k, 2) pixels of the drawing, all along the lines of the face.
    """
    h, w = ruler.lines.shape
    left, top, right, bottom = ruler.box
    cells = np.array([w / (right - left), h / (bottom - top)])
    col, row = np.floor((points - (left, top)) * cells).astype(np.int64).T
    inside = (col >= 0) & (col < w) & (row >= 0) & (row < h)
    drawn = np.zeros((h, w), dtype=bool)
    drawn[row[inside], col[inside]] = True
    if not drawn.any() or not ruler.lines.any():
        return ruler.reach * ruler.cell
    to_sketch = np.minimum(ruler.distance[row[inside], col[inside]], ruler.reach).mean()
    to_model = np.minimum(distance_transform_edt(~drawn)[ruler.lines], ruler.reach).mean()
    return float(to_sketch + to_model) / 2 * ruler.cell


@dataclass(frozen=True)
class Comparison:
    """A fitted face held against its sketch: worked out when it is asked for, once.

    drawing : (h, w), 1 is paper      fitted : the face that a method has found
    template : the face before anything but its head's turn was read from the drawing
    place : finds the camera for a face, as the fit's was found before it began
    hair : (k, 2) pixels -> (k,) whether hair is drawn there, or None: no line of it is a face's
    max_delta : as Tweakables has it; every distance is cut there
    beside : (k, 2) pixels -> (k,) whether the face's hair has no place there, or None without hair
    seconds : what was worked out -> how long it took
    """

    drawing: NDArray
    rig: FaceRig
    fitted: Fitted
    template: FaceParameters
    place: Callable[[FaceParameters], Camera]
    hair: Callable[[NDArray], NDArray] | None
    max_delta: float
    beside: Callable[[NDArray], NDArray] | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @cached_property
    def errors(self) -> dict[str, float]:
        """template, expression, fitted -> `contour_error`, pixels of the drawing, beside hair."""
        after = self._lines.without(INNER)
        start = perf_counter()
        template = self.rig.pose(self.template), self.place(self.template)
        box = head_box(*template)
        reach = self.max_delta * box.height / WORKING_SIZE[1]
        measured = ruler(self.drawing, box, reach)
        if self.hair is not None:
            measured = without_hair(measured, self.hair)
        lines = {
            "template": face_contours(self.rig, *template).lines,
            "expression": self._model,
            "fitted": after,
        }
        found = {name: contour_error(measured, self._bare(line)) for name, line in lines.items()}
        self.seconds["errors"] = perf_counter() - start
        return found

    def _bare(self, lines: Lines) -> NDArray[np.float64]:
        """The points of a face's lines that no hair hides."""
        points = lines.points
        return points if self.hair is None else points[~self.hair(points)]

    @cached_property
    def unmatched(self) -> list[NDArray[np.float64]]:
        """What of the drawing has no place on the face; (k, 2) pixels of the drawing each."""
        lines = self._lines.lines
        start = perf_counter()
        drawn = self.drawn
        if self.beside is not None and len(drawn.points):
            drawn = drawn.some(self.beside(drawn.points))
        found = unmatched_lines(drawn, lines, self.fitted.camera)
        self.seconds["unmatched"] = perf_counter() - start
        return found

    @cached_property
    def drawn(self) -> Lines:
        """The middle of every stroke within the head's box."""
        known = self.fitted.drawn
        return centre_lines(self.drawing, self.fitted.box) if known is None else known

    @property
    def _model(self) -> Lines:
        """The lines of the face as it does what was read, before its skin was moved."""
        fitted = self.fitted
        if fitted.model is not None:
            return fitted.model
        return face_contours(self.rig, self.rig.pose(fitted.parameters), fitted.camera).lines

    @cached_property
    def _lines(self) -> SurfaceLines:
        """All lines of the fitted face, as many kinds as can be drawn."""
        start = perf_counter()
        vertices, camera = self.fitted.vertices, self.fitted.camera
        found = face_lines(self.rig, vertices, camera, kinds=EVERY, detail=2)
        self.seconds["lines"] = perf_counter() - start
        return found
