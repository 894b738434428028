"""A posed face is brought to the lines of a sketch: by its own lines, or as in the thesis."""

from .alignment import align, align_box, align_landmarks, ink_box, parse_box
from .engraving import DEEPEST, PROFILES, WIDEST, engrave
from .fit import Fit, fit_offsets, head_box
from .line_fit import LINE_TWEAKABLES, LineFit, fit_lines, unmatched_lines
from .lines import Lines, SurfaceLines, centre_lines
from .shape import HEAD, Evidence
from .strokes import carvable
from .tweakables import WORKING_SIZE, Tweakables, describe

__all__ = [
    "DEEPEST",
    "HEAD",
    "LINE_TWEAKABLES",
    "PROFILES",
    "WIDEST",
    "WORKING_SIZE",
    "Evidence",
    "Fit",
    "LineFit",
    "Lines",
    "SurfaceLines",
    "Tweakables",
    "align",
    "align_box",
    "align_landmarks",
    "carvable",
    "centre_lines",
    "describe",
    "engrave",
    "fit_lines",
    "fit_offsets",
    "head_box",
    "ink_box",
    "parse_box",
    "unmatched_lines",
]
