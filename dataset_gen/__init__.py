"""Drawings of the face with the parameters that made them: the data set."""

from .ink import Style, ink, loosen, sample_style
from .lines import DETAILS, Stroke, draw_strokes

__all__ = ["DETAILS", "Stroke", "Style", "draw_strokes", "ink", "loosen", "sample_style"]
