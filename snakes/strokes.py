"""Which strokes that have no place on the face are carved into it.

A stroke of a drawing to which no line of the fitted face answers is carved when

* most of it lies on visible skin of the front of the face, from the chin to the hairline;
* most of it does not run along the brows, eyes and lips, which every face has, but across or off;
* most of it does not lie on a line that the fitted face shows anyway, as the side of the nose;
* it is not one of a crowd: hatching, hair and shade are many strokes close together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facs_rig import LANDMARKS, Camera, FaceRig
from facs_rig.common.polylines import arc_lengths, resampled

from .contours import head_box
from .deltas import on_line
from .mapping import pixels_to_skin
from .render import expression_render
from .tweakables import WORKING_SIZE

__all__ = ["carvable"]

MOST = 0.5
"""What is called most of a stroke, a share of its length."""
STEP = 0.001
"""Metres between the points at which a stroke is judged."""
ABOVE, BELOW, BESIDE = 0.01, 0.005, 0.001
"""Metres from the landmark on the forehead up to the hairline, from that on the chin down, from
those on the temples outward. The hairline is half an ellipse over the brows, and a low one."""
FEATURE, ALONG = 0.008, 0.7
"""Metres from a line of brows, irises or lips, and the least cosine of the angle to it, that make
another line its own: the lids are those of the iris."""
CROWD_REACH, CROWD = 0.015, 0.08
"""Metres of strokes without a place around a point, within a circle of this radius, from which on
they are a crowd: lines 9 mm apart over a wide area. Worry lines are 10 mm apart."""
CROWD_STEP = 0.008
"""Metres; a stroke that keeps this close to a crowd belongs to it, as the last lines of hair do."""


def carvable(
    strokes: Sequence[NDArray[np.floating]],
    rig: FaceRig,
    posed: NDArray[np.floating],
    camera: Camera,
) -> list[NDArray[np.floating]]:
    """Those of the strokes without a place that are carved, by the module's rule.

    strokes : each (k, 2) float, (u, v) pixels of the camera;  posed : (n, 3) float, metres
    """
    even = [_even(line / camera.scale) for line in strokes]
    if not even:
        return []
    points = np.concatenate(even)
    owner = np.repeat(np.arange(len(even)), [len(line) for line in even])
    seen, corners, _ = pixels_to_skin(points * camera.scale, rig, posed, camera)
    on_face = seen & _front(rig)[corners].all(axis=1)
    features = [camera.project(rig.stroke_points(posed, name)) / camera.scale
                for name in rig.strokes]  # fmt: skip
    nearest = cKDTree(np.concatenate(features)).query(points, distance_upper_bound=FEATURE)[1]
    ways = np.concatenate([*map(_directions, features), np.zeros((1, 2))])[nearest]
    own = np.concatenate([*map(_directions, even)])
    off = np.abs(np.einsum("kd,kd->k", ways, own)) < ALONG
    own_place = on_face & off & ~_shown(points * camera.scale, rig, posed, camera)
    wanted = np.bincount(owner, own_place) > MOST * np.bincount(owner)
    crowded = _crowded(points, owner)
    return [line for line, use in zip(strokes, wanted & ~crowded, strict=True) if use]


def _shown(
    pixels: NDArray[np.floating], rig: FaceRig, posed: NDArray[np.floating], camera: Camera
) -> NDArray[np.bool_]:
    """(k,) whether the face itself has a dark line at pixels (k, 2) of the camera.

    Or right beside them: a groove that is lit from the front is dark on both its walls.
    """
    box = head_box(posed, camera)
    left, top, right, bottom = box
    small = camera.cropped(box.left, box.top, box.right, box.bottom, *WORKING_SIZE)
    cell = np.array([(right - left) / small.width, (bottom - top) / small.height])
    lines, places = expression_render(rig, posed, small).lines, (pixels - [left, top]) / cell
    beside = [places + step for step in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))]
    return np.any([on_line(lines, there) for there in beside], axis=0)


def _directions(line: NDArray[np.floating]) -> NDArray[np.float64]:
    """Unit vectors (k, 2) along a line (k, 2); 0 for a single point."""
    if len(line) < 2:
        return np.zeros((len(line), 2))
    way = np.gradient(line, axis=0)
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)


def _crowded(points: NDArray[np.float64], owner: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which strokes are hatching, hair or shade; owner : (p,) the stroke of each point (p, 2)."""
    counts = np.bincount(owner)
    around = cKDTree(points).query_ball_point(points, CROWD_REACH, return_length=True) * STEP
    crowded = np.bincount(owner, around) > CROWD * counts
    while crowded.any():
        near = cKDTree(points[crowded[owner]]).query(points, distance_upper_bound=CROWD_STEP)[0]
        more = np.bincount(owner, np.isfinite(near)) > MOST * counts
        if not (more & ~crowded).any():
            break
        crowded |= more
    return crowded


def _front(rig: FaceRig) -> NDArray[np.bool_]:
    """(n,) the front of the face, from the chin to the hairline and from temple to temple."""
    upright = rig.neutral()
    forehead, chin, brow, temple, cheek = (
        upright[rig.landmarks[LANDMARKS.index(name)]]
        for name in ("forehead", "chin", "brow_peak_left", "temple_left", "jawline_1_left")
    )
    x, y, z = upright.T
    top = forehead[1] + ABOVE - brow[1]
    high = np.clip((y - brow[1]) / top, 0.0, 1.0)
    half = np.where(high > 0, temple[0] + BESIDE, cheek[0]) * np.sqrt(1 - high**2)
    return rig.parts["skin"] & (np.abs(x) < half) & (y > chin[1] - BELOW) & (z > cheek[2])


def _even(line: NDArray[np.floating]) -> NDArray[np.float64]:
    """Points of a line (k, 2) in metres, a STEP apart, each in the middle of its piece."""
    way = arc_lengths(line)
    count = max(1, round(way[-1] / STEP))
    return resampled(line, way, (np.arange(count) + 0.5) / count * way[-1])
