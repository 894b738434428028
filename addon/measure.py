"""The lines of a face, and how far they lie from the lines of a sketch, in pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from dataset_gen import draw_strokes
from facs_rig import Camera, FaceRig
from snakes import HEAD, Lines, SurfaceLines, unmatched_lines

INNER = ("suggestive", "valley")  # kinds of lines that one drawing shows and another does not
EVERY = ("contour", *INNER)
SPACING = 0.008  # of the head's height, between the points of lines that are fitted
HEIGHT = 400  # pixels in which the box of the head is measured, at most
LAYERS = ("brow", "iris", "lip")  # what is painted on a face that is measured
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Ruler:
    """A sketch made ready to be compared with many faces.

    box : (left, top, right, bottom), pixels of the drawing, that is measured in
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

    box : (left, top, right, bottom), pixels;  reach : pixels.
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
        (left, top, right, bottom), lines, distance_transform_edt(~lines), cell, reach / cell
    )


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


def face_lines(
    rig: FaceRig,
    posed: NDArray,
    camera: Camera,
    kinds: tuple[str, ...] = ("contour", "suggestive"),
    detail: int = 1,
    step: float = 1.0,
) -> SurfaceLines:
    """The visible lines of a posed face (n, 3): of these kinds, and LAYERS.

    step : pixels between the points of a line
    """
    found: list[tuple] = []
    for stroke in draw_strokes(rig, posed, camera, detail, LAYERS, kinds):
        if stroke.surface is None:
            continue
        steps = np.linalg.norm(np.diff(stroke.points, axis=0), axis=1)
        way = np.concatenate([[0], np.cumsum(steps)])
        at = np.unique(np.searchsorted(way, np.arange(0, way[-1], step)))
        ahead = np.gradient(stroke.points, axis=0)[at]
        ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
        triangle, weights = (part[at] for part in stroke.surface)
        found.append((stroke.points[at], ahead, triangle, weights, stroke.kind))
    if not found:
        nothing = np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, np.intp), np.zeros((0, 3))
        points, along, triangle, weights = nothing
    else:
        points, along, triangle, weights = (
            np.concatenate(part) for part in list(zip(*found, strict=True))[:4]
        )
    starts = np.cumsum([0, *(len(line[0]) for line in found)])
    kinds_of = np.array([line[4] for line in found], dtype=str)
    return SurfaceLines(Lines(points, along), starts, triangle, weights, kinds_of)


def contours(rig: FaceRig, posed: NDArray, camera: Camera) -> SurfaceLines:
    """The lines that nearly every drawing has: outlines, brows, irises, lips.

    They are drawn in pixels half as large as their points are apart.
    """
    step = max(SPACING * HEAD * camera.scale[0], 1.0)
    pixel = max(step / 2, 1.0)
    coarse = replace(
        camera,
        width=math.ceil(camera.width / pixel),
        height=math.ceil(camera.height / pixel),
        scale=(camera.scale[0] / pixel, camera.scale[1] / pixel),
        centre=(camera.centre[0] / pixel, camera.centre[1] / pixel),
    )
    found = face_lines(rig, posed, coarse, kinds=("contour",), step=step / pixel)
    return replace(found, lines=Lines(found.lines.points * pixel, found.lines.along))


@dataclass(frozen=True)
class Comparison:
    """A fitted face held against its sketch: worked out when it is asked for, once.

    drawing : (h, w), 1 is paper      drawn : its lines
    box, reach : as for `ruler`
    fitted : (n, 3) metres, the fitted face, and `camera`, that of the drawing
    template : (n, 3), the face before anything was read from the drawing, and its own camera
    before : lines of the face as it does what was read, before its skin was moved
    seconds : what was worked out -> how long it took
    """

    drawing: NDArray
    drawn: Lines
    box: Box
    reach: float
    rig: FaceRig
    fitted: NDArray
    camera: Camera
    template: tuple[NDArray, Camera]
    before: Lines
    seconds: dict[str, float] = field(default_factory=dict)

    @cached_property
    def errors(self) -> dict[str, float]:
        """template, expression, fitted -> `contour_error`, pixels of the drawing."""
        after = self._lines.without(INNER)
        start = perf_counter()
        measured = ruler(self.drawing, self.box, self.reach)
        template = contours(self.rig, *self.template).lines
        lines = {"template": template, "expression": self.before, "fitted": after}
        found = {name: contour_error(measured, line.points) for name, line in lines.items()}
        self.seconds["errors"] = perf_counter() - start
        return found

    @cached_property
    def unmatched(self) -> list[NDArray[np.float64]]:
        """What of the drawing has no place on the face; (k, 2) pixels of the drawing each."""
        lines = self._lines.lines
        start = perf_counter()
        found = unmatched_lines(self.drawn, lines, self.camera)
        self.seconds["unmatched"] = perf_counter() - start
        return found

    @cached_property
    def _lines(self) -> SurfaceLines:
        """All lines of the fitted face, as many kinds as can be drawn."""
        start = perf_counter()
        found = face_lines(self.rig, self.fitted, self.camera, kinds=EVERY, detail=2)
        self.seconds["lines"] = perf_counter() - start
        return found
