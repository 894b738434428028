"""Which strokes of a drawing have no place on the face, and which of them are carved into it.

The snakes run round the drawn lines in a small picture, and often a part of a stroke finds
something to hold on to. So the strokes are looked up again in the drawing itself, as whole lines
along the middle of their ink, and one has no place when most of it is unmatched. It is carved when

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
from skimage.morphology import skeletonize

from facs_rig import LANDMARKS, Camera, FaceRig

from .contours import Box, binarise, working_drawing
from .deltas import on_line
from .fit import head_box
from .mapping import pixels_to_skin
from .render import expression_render
from .tweakables import WORKING_SIZE

__all__ = ["carvable", "centre_lines", "unmatched_strokes"]

HEIGHT = 800
"""Pixels of the head's box in which strokes are looked up: a good third of a millimetre each."""
MOST = 0.5
"""What is called most of a stroke, a share of its length."""
SHORTEST = 0.008
"""Metres; what is shorter is a dot or a hair of a brow or a beard."""
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
LOOK_BACK = 6
"""Pixels along a line that say where it is heading."""
SHARPEST = -0.3
"""Cosine of the turn at which one stroke ends and another begins."""


def unmatched_strokes(
    drawing: NDArray[np.floating],
    unmatched: Sequence[NDArray[np.floating]],
    posed: NDArray[np.floating],
    camera: Camera,
) -> list[NDArray[np.float64]]:
    """The strokes that are for the most part unmatched, whole, along the middle of their ink.

    Parameters
    ----------
    drawing : (h, w) float, 1 is paper, 0 is ink
    unmatched : polylines (k, 2) float, pixels of the drawing, as in snakes.Fit
    posed : (n, 3) float, metres, the face on the drawing
    camera : of the drawing's pixels

    Returns
    -------
    list of (k, 2) float64, (u, v) in pixels of the drawing
    """
    if not len(unmatched):
        return []
    box = head_box(posed, camera)
    cell = max((box[2] - box[0]) / WORKING_SIZE[0], (box[3] - box[1]) / WORKING_SIZE[1])
    known = cKDTree(np.concatenate(list(unmatched)))
    return [
        line
        for line in centre_lines(drawing, box)
        if _length(line / camera.scale) >= SHORTEST
        and np.isfinite(known.query(line, distance_upper_bound=cell)[0]).mean() > MOST
    ]


def centre_lines(drawing: NDArray[np.floating], box: Box) -> list[NDArray[np.float64]]:
    """The strokes of a drawing within a box, along the middle of their ink.

    The ink is thinned to lines of one pixel (Zhang and Suen 1984, as scikit-image has it), which
    are walked from their ends, straight on where they cross. A closed line repeats its first point.

    Returns a list of (k, 2) float64, (u, v) in pixels of the drawing (h, w; 1 is paper).
    """
    left, top, right, bottom = box
    height = HEIGHT
    width = max(1, round(height * (right - left) / (bottom - top)))
    pen = skeletonize(binarise(working_drawing(drawing, box, (width, height))))
    cell = np.array([(right - left) / width, (bottom - top) / height])
    return [(np.array(path)[:, ::-1] + 0.5) * cell + [left, top] for path in _walks(pen)]


def _walks(pen: NDArray[np.bool_]) -> list[list[tuple[int, int]]]:
    """Paths of (row, column) along lines of one pixel, each pixel in one path."""
    around = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c]
    left = {(int(r), int(c)) for r, c in zip(*np.nonzero(pen), strict=True)}

    def next_to(at: tuple[int, int]) -> list[tuple[int, int]]:
        return [near for r, c in around if (near := (at[0] + r, at[1] + c)) in left]

    paths = []
    # Ends first, so that an open line is walked in one go; what then is left are loops.
    for start in sorted(left, key=lambda at: (len(next_to(at)) != 1, at)):
        if start not in left:
            continue
        left.discard(start)
        path = [start]
        while ahead := next_to(path[-1]):
            here, before = path[-1], path[-min(LOOK_BACK, len(path))]
            heading = (here[0] - before[0], here[1] - before[1])
            turns = [_cosine(heading, (r - here[0], c - here[1])) for r, c in ahead]
            best = max(range(len(ahead)), key=turns.__getitem__)
            if turns[best] < SHARPEST:
                break
            left.discard(ahead[best])
            path.append(ahead[best])
        if len(path) > LOOK_BACK and max(abs(path[-1][k] - start[k]) for k in (0, 1)) == 1:
            path.append(start)
        paths.append(path)
    return [path for path in paths if len(path) > 1]


def _cosine(a: tuple[int, int], b: tuple[int, int]) -> float:
    """Of the angle between two directions; 1 when one of them has no length."""
    size = float(np.hypot(*a) * np.hypot(*b))
    return (a[0] * b[0] + a[1] * b[1]) / size if size else 1.0


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
    small = camera.cropped(*box, *WORKING_SIZE)
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
    lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(1, round(along[-1] / STEP))
    at = (np.arange(count) + 0.5) / count * along[-1]
    return np.column_stack([np.interp(at, along, column) for column in np.asarray(line).T])


def _length(line: NDArray[np.floating]) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
