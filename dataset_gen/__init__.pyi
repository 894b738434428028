from .linework import (
    DETAILS,
    STYLES,
    Stroke,
    Style,
    draw_strokes,
    ink,
    loosen,
    stroke_lists,
    stroke_of,
    style_named,
)
from .page import Page, draw_page
from .styles import sample_style

__all__ = [
    "DETAILS", "STYLES", "Page", "Stroke", "Style", "draw_page", "draw_strokes", "ink", "loosen",
    "sample_style", "stroke_lists", "stroke_of", "style_named",
]  # fmt: skip
