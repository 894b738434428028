"""One finished drawing of a posed face: its strokes, drawn by a hand, on a page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera, FaceRig

from .linework.ink import ink
from .linework.marks import loosen
from .linework.paper import through, tilt_matrix
from .linework.strokes import Stroke
from .linework.style import Style
from .shading import construction, hatches
from .tone import graphite, tilted

if TYPE_CHECKING:
    from .hair_area import Area


@dataclass(frozen=True)
class Page:
    """A drawing: what it looks like, and what was drawn.

    picture : (h, w) uint8, 0 ink and 255 white        strokes : every mark, in its pixels
    matrix : (3, 3) homography from the camera's pixels to the picture's, for landmarks
    """

    picture: NDArray[np.uint8]
    strokes: list[Stroke]
    matrix: NDArray[np.float64]


def draw_page(
    strokes: Iterable[Stroke],
    rig: FaceRig,
    vertices: NDArray,
    camera: Camera,
    style: Style,
    rng: np.random.Generator,
    hair: Area | None = None,
) -> Page:
    """A face's strokes, from either engine, as a drawing of this style in the camera's pixels.

    vertices : (n, 3) metres, the posed face, for the hatches, shade and lines that the style adds.
    hair : what lies over it
    """
    covered = None if hair is None else hair.mask
    marks = construction(rig, vertices, camera) if style.construction else []
    marks += hatches(rig, vertices, camera, style, rng, covered)
    matrix = tilt_matrix(style, camera.width, camera.height)
    drawn = loosen([*marks, *strokes], style, rng)
    tone = graphite(rig, vertices, camera, style, hair)
    if any(style.tilt):
        drawn = [replace(stroke, points=through(matrix, stroke.points)) for stroke in drawn]
        tone = None if tone is None else tilted(tone, matrix)
    return Page(ink(drawn, camera.width, camera.height, style, tone), drawn, matrix)
