"""Drawings of the face with the parameters that made them: the data set."""

from .ink import ink
from .lines import DETAILS, Stroke, draw_strokes
from .marks import loosen, stroke_lists, stroke_of
from .page import Page, draw_page
from .style import STYLES, Style, sample_style, style_named

__all__ = [
    "DETAILS", "STYLES", "Page", "Stroke", "Style", "draw_page", "draw_strokes", "ink", "loosen",
    "sample_style", "stroke_lists", "stroke_of", "style_named",
]  # fmt: skip
