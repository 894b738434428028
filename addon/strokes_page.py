"""Pen strokes that are lines and not yet pixels become a page that the pipeline reads.

They are drawn where the pen went, as wide as it was pressed; whoever takes a picture of them
instead has ground, tilt and everything else in sight to guess away again.
`dataset_gen.linework.ink` draws, and says why it needs no library for that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dataset_gen.linework.ink import lay
from facs_rig.common.errors import InputError
from facs_rig.common.polylines import Polylines, spread

__all__ = ["PenStroke", "page_of_strokes", "plane_of"]

AXIS = np.cos(np.radians(10.0))
"""A normal whose cosine with an axis of the world is at least that is meant to be it."""
SEEN_FROM = np.array([0.5, -1.0, 0.25])
"""A drawing is seen from the front, the right or above rather than from behind, the left or below.
Blender's axes: its front view is from -y, its right view from +x, its top view from +z."""
FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
ON_A_LINE = 1e-4
"""Points that spread so much less across than along lie on a line."""
THINNEST = 1.5
"""Pixels: thinner lines fade, and are lost when the page is read."""
THICKEST = 1 / 100
"""Of the page's longest side: thicker lines fill the features of a face."""
STEP = 2.0, 8.0
"""Pixels between the places at which a line is drawn, as it is wide."""


@dataclass(frozen=True)
class PenStroke:
    """One line of the pen. A single point is a dot; a ring ends where it began.

    points : (k, 2) metres in the plane of the drawing, x right, y up
    widths : (k,) metres from edge to edge, or one for all      opacity : the same, 0..1
    """

    points: NDArray[np.floating]
    widths: NDArray[np.floating] | float
    opacity: NDArray[np.floating] | float = 1.0


def plane_of(points: NDArray[np.floating], name: str = "The drawing") -> NDArray[np.float64]:
    """The plane in which strokes were drawn: unit rows (3, 3) right, up and toward the viewer.

    points : (n, 3), of all strokes, Blender's axes      name : what a message calls them

    ``points @ plane_of(points)[:2].T`` are their places (x, y) in it. Its normal is the direction
    in which they spread least; near an axis of the world it is that axis, so that strokes which
    follow a surface do not turn the drawing. Up is the world's up as it appears in the plane, +y on
    the floor. Points on a line, and less than three, are seen from the front.

    Raises InputError, one sentence, for coordinates that are not finite.
    """
    points = _finite(np.asarray(points, np.float64).reshape(-1, 3), name)
    if len(points) < 3:
        return FRONT.copy()
    _, size, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if size[1] <= ON_A_LINE * size[0]:
        return FRONT.copy()
    toward = directions[2]
    axis = np.argmax(np.abs(toward))
    if abs(toward[axis]) >= AXIS:
        toward = np.eye(3)[axis]
    if toward @ SEEN_FROM < 0:
        toward = -toward
    above = np.eye(3)[1 if toward[2] == 1 else 2]
    right = np.cross(above, toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def page_of_strokes(
    strokes: Sequence[PenStroke],
    size: int = 1024,
    margin: float = 0.06,
    name: str = "The drawing",
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """A page that strokes fill, but for a margin.

    size : pixels of its longest side      margin : around the strokes, a share of that side
    name : what a message calls the drawing

    Returns the page (h, w), 1 = paper and 0 = ink, and to_plane (2, 3): a pixel's place in the
    plane, metres (x, y), is ``to_plane @ (u, v, 1)``, pixel centres at .5. Lines are as wide as
    the pen's, but not under THINNEST nor over THICKEST. Transparent strokes do not count.

    Raises InputError, one sentence, if nothing is drawn or a number is not finite.
    """
    if size < 1 or not 0 <= margin < 0.5:
        raise ValueError(f"A page of {size} pixels cannot have a margin of {margin:g} of them.")
    strokes = [stroke for stroke in strokes if len(stroke.points) and np.any(stroke.opacity)]
    if not strokes:
        raise InputError(f"{name} has no strokes that can be seen; draw a face first.")
    lines = Polylines.of([np.asarray(stroke.points, np.float64) for stroke in strokes])
    points = _finite(lines.points, name)
    widths = _finite(_each([stroke.widths for stroke in strokes], lines), name)
    opacity = _finite(_each([stroke.opacity for stroke in strokes], lines), name)

    low, high = points.min(axis=0), points.max(axis=0)
    middle, extent = (low + high) / 2, high - low
    room = size * (1 - 2 * margin)
    if extent.max() > 0:
        scale = room / extent.max()
    else:  # a dot, which has no size but its width
        scale = size * THICKEST / max(widths.max(), 1e-9)
    # What is whole but for rounding must not become a pixel more.
    shape = np.maximum(np.ceil(extent * scale + 2 * margin * size - 1e-6), 1)
    centre = shape / 2
    pixels = centre + (points - middle) * scale * (1, -1)
    width, height = shape.astype(int).tolist()

    thick = np.clip(widths * scale, THINNEST, max(size * THICKEST, THINNEST))
    lines = Polylines.joined(pixels, lines.starts)
    usual = np.add.reduceat(thick, lines.starts[:-1]) / np.diff(lines.starts)
    line, along, starts = spread(lines.length, np.clip(usual, *STEP))
    places, thick, tone = lines.at(line, along, thick, np.clip(opacity, 0, 1))
    ink = np.zeros((1, height, width), np.float32)
    lay(ink, places, thick / 2, tone, starts, np.zeros(len(strokes), int))

    to_plane = np.array([[1 / scale, 0, 0], [0, -1 / scale, 0]])
    to_plane[:, 2] = middle - to_plane[:, :2] @ centre
    return 1 - ink[0], to_plane


def _each(values: Sequence[ArrayLike], lines: Polylines) -> NDArray[np.float64]:
    """(N,) the value at each point of lines, from (k,) or one for each of them."""
    counts = np.diff(lines.starts).tolist()
    whole = [np.broadcast_to(value, count) for value, count in zip(values, counts, strict=True)]
    return np.concatenate(whole).astype(np.float64)


def _finite(values: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    if not np.isfinite(values).all():
        raise InputError(
            f"{name} has points that are nowhere (not finite numbers); erase their strokes and "
            "draw them again."
        )
    return values
