"""The lines of a posed face: found on its shape, cut by what hides them, drawn in ink on a page.

    strokes = draw_strokes(rig, rig.pose(parameters), camera)   # polylines, in pixels
    picture = ink(loosen(strokes, style, rng), width, height, style)

Every fit and every overlay needs this; the data set is made with it.
"""

from .ink import coverage, ink, lay
from .lines import DETAILS, draw_strokes
from .marks import loosen, stroke_lists, stroke_of
from .strokes import Stroke
from .style import STYLES, Style, style_named

__all__ = [
    "DETAILS", "STYLES", "Stroke", "Style", "coverage", "draw_strokes", "ink", "lay", "loosen",
    "stroke_lists", "stroke_of", "style_named",
]  # fmt: skip
