"""The lines that a posed face shows, with the places on its surface where they lie."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dataset_gen.linework.lines import draw_strokes
from facs_rig import Camera, FaceRig
from facs_rig.common.polylines import arc_lengths

from .lines import HEAD, Lines, SurfaceLines

__all__ = ["EVERY", "INNER", "face_contours", "face_lines"]

INNER = ("suggestive", "valley")
"""Kinds of lines that one drawing shows and another does not."""
EVERY = ("contour", *INNER)
SPACING = 0.008
"""Between the points of lines that are fitted, as a share of the head."""
LAYERS = ("brow", "iris", "lip")
"""What is painted on a face that is fitted or measured."""


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
        way = arc_lengths(stroke.points)
        at = np.unique(np.searchsorted(way, np.arange(0, way[-1], step)))
        ahead = _along(stroke.points, way, at, step)
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
    lips = np.repeat(kinds_of == "lip", np.diff(starts))
    return SurfaceLines(Lines(points, along, lips), starts, triangle, weights, kinds_of)


def _along(line: NDArray, way: NDArray, at: NDArray, step: float) -> NDArray[np.float64]:
    """(k, 2) from half a step before the points `at` of a line to half a step behind them: where
    an outline folds back, neighbours a fraction of a pixel apart run anywhere.

    way : (m,) pixels to each of the line's points (m, 2)
    """
    before, behind = way[at] - step / 2, way[at] + step / 2
    there = [np.interp(behind, way, axis) - np.interp(before, way, axis) for axis in line.T]
    return np.stack(there, axis=1)


def face_contours(rig: FaceRig, posed: NDArray, camera: Camera) -> SurfaceLines:
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
    return replace(found, lines=replace(found.lines, points=found.lines.points * pixel))
