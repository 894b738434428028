"""Laying the face over the sketch: where the camera has to stand (thesis, chapter 3, step 2).

The thesis asks the user to align the two by hand. Here the landmarks that were found in the sketch
do it, or the extent of its ink, or a box given by hand. The head's turn is a parameter of the rig,
so all that is left is one scale and a shift.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label

from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.coarse import coarse_rig
from facs_rig.common.box import Box
from facs_rig.common.errors import InputError

from .contours import binarise

__all__ = ["align", "align_box", "align_landmarks", "head_mask", "ink_box"]

HEADS = "The head's box"
ROUNDS = 20
SPECK = 0.02
"""A mark shorter than this share of the drawing's longer side is no line of the face."""


def align(
    drawing: NDArray[np.floating],
    rig: FaceRig,
    parameters: FaceParameters,
    landmarks: Mapping[str, tuple[float, float]] | None = None,
    box: Box | str | None = None,
) -> Camera:
    """Place an orthographic camera so that the posed face covers the face of the sketch.

    Parameters
    ----------
    drawing : (h, w) float, 1 is paper, 0 is ink
    landmarks : name -> (u, v) in pixels of the drawing, optional
        Names as in facs_rig.LANDMARKS; at least three make an alignment.
    box : in pixels, or as the text 'left,top,right,bottom', optional
        Where the head is, from crown to chin and side to side; overrides everything else.

    Without box and landmarks the extent of the ink is used. Raises ValueError when the box is not
    usable or when there is no ink.
    """
    height, width = drawing.shape
    known = [name for name in (landmarks or {}) if name in LANDMARKS]
    if box is None and landmarks is not None and len(known) >= 3:
        points = np.array([landmarks[name] for name in known], dtype=np.float64)
        coarse = coarse_rig(rig)  # which has the same landmarks
        model = coarse.pose(parameters)[[_vertex(coarse, name) for name in known]]
        return align_landmarks(points, model, (width, height))
    vertices = rig.pose(parameters)
    if box is not None:
        wanted = Box.parse(box, HEADS) if isinstance(box, str) else Box(*box).checked(HEADS)
        return align_box(wanted, vertices[head_mask(rig, vertices)], (width, height))
    wanted = ink_box(drawing)
    # A sketch may or may not show the neck: take what has the more similar proportions.
    skin = rig.parts["skin"]
    choices = [vertices[head_mask(rig, vertices)], vertices[skin]]
    proportion = math.log(wanted.width / wanted.height)
    off = [abs(math.log(np.ptp(some[:, 0]) / np.ptp(some[:, 1])) - proportion) for some in choices]
    return align_box(wanted, choices[int(np.argmin(off))], (width, height))


def align_landmarks(
    points: NDArray[np.floating],
    model: NDArray[np.floating],
    size: tuple[int, int],
    keep: float = 0.8,
) -> Camera:
    """Scale and shift that bring the model's landmarks onto those of the sketch.

    Least trimmed squares (Rousseeuw, "Least median of squares regression", 1984) by concentration
    steps: the share `keep` of the landmarks that fits best decides, so that a few that were found
    in the wrong place do no harm.

    Parameters
    ----------
    points : (m, 2) float, (u, v) pixels of the sketch
    model : (m, 3) float, metres, the posed landmarks
    size : (width, height) of the sketch

    Raises ValueError with fewer than two pairs, or when they allow no upright face of any size.
    """
    points = np.asarray(points, dtype=np.float64)
    flat = np.asarray(model, dtype=np.float64)[:, :2] * np.array([1.0, -1.0])
    if points.shape != flat.shape or len(points) < 2:
        raise ValueError(
            f"An alignment needs two or more landmarks in both shapes, got {points.shape} and "
            f"{np.shape(model)}."
        )
    number = max(2, math.ceil(keep * len(points)))
    # Start from the medians, which a minority of wrong landmarks cannot drag away.
    centre, middle = np.median(flat, axis=0), np.median(points, axis=0)
    spread = np.median(np.linalg.norm(flat - centre, axis=1))
    scale = np.median(np.linalg.norm(points - middle, axis=1)) / max(spread, 1e-9)
    shift = middle - scale * centre
    for _ in range(ROUNDS):
        errors = np.linalg.norm(scale * flat + shift - points, axis=1)
        best = np.argsort(errors, kind="stable")[:number]
        source, target = flat[best], points[best]
        source_mean, target_mean = source.mean(axis=0), target.mean(axis=0)
        spread = ((source - source_mean) ** 2).sum()
        before = scale
        scale = ((source - source_mean) * (target - target_mean)).sum() / max(spread, 1e-12)
        shift = target_mean - scale * source_mean
        if abs(scale - before) < 1e-9 * abs(scale):
            break
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(
            "The landmarks of the sketch do not form an upright face; give the head's box by hand."
        )
    return Camera(size[0], size[1], (float(scale),) * 2, (float(shift[0]), float(shift[1])))


def align_box(box: Box, vertices: NDArray[np.floating], size: tuple[int, int]) -> Camera:
    """Camera in which `vertices` (n, 3) fill `box` as well as one scale for both axes allows.

    The centres of the two boxes meet and the scale is the one with the least squared difference
    of their widths and heights.
    """
    low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
    extent = high - low
    wanted = np.array([box.width, box.height])
    scale = float((extent * wanted).sum() / (extent**2).sum())
    middle = (low + high) / 2
    centre = np.array(box.middle) - scale * middle * [1.0, -1.0]
    return Camera(size[0], size[1], (scale, scale), (float(centre[0]), float(centre[1])))


def head_mask(rig: FaceRig, vertices: NDArray[np.floating]) -> NDArray[np.bool_]:
    """The skin of the head without the neck, all that lies above the chin when upright; (n,) bool.

    vertices : (n, 3) posed; only their number is checked, the chin is that of the neutral face.
    """
    upright = rig.neutral()
    if len(vertices) != len(upright):
        raise ValueError(f"The rig has {len(upright)} vertices, not {len(vertices)}.")
    return rig.parts["skin"] & (upright[:, 1] >= upright[_vertex(rig, "chin"), 1])


def ink_box(drawing: NDArray[np.floating]) -> Box:
    """The box that holds the ink, without specks of dust.

    Raises ValueError when the drawing (h, w; 1 is paper) has no ink.
    """
    marks, _ = label(binarise(drawing), structure=np.ones((3, 3)))
    extents = np.array([(v.start, v.stop, u.start, u.stop) for v, u in find_objects(marks)])
    if len(extents) == 0:
        raise InputError("The sketch is blank; draw the lines of a face on it.")
    longest = np.maximum(extents[:, 1] - extents[:, 0], extents[:, 3] - extents[:, 2])
    lines = extents[longest >= min(SPECK * max(drawing.shape), longest.max())]
    left, right = lines[:, 2].min(), lines[:, 3].max()
    return Box(float(left), float(lines[:, 0].min()), float(right), float(lines[:, 1].max()))


def _vertex(rig: FaceRig, landmark: str) -> int:
    return int(rig.landmarks[LANDMARKS.index(landmark)])
