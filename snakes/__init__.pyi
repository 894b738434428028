from .alignment import align, align_box, align_landmarks, ink_box
from .contours import head_box
from .engraving import engrave
from .fit import Fit, fit_offsets
from .line_fit import LineFit, fit_lines, unmatched_lines
from .lines import HEAD, Lines, SurfaceLines, centre_lines, polylines
from .model_lines import face_contours, face_lines
from .shape import Observations, PinsApart
from .strokes import carvable
from .tweakables import (
    DEEPEST,
    LINE_TWEAKABLES,
    LINES_ALONE,
    PROFILES,
    WIDEST,
    WORKING_SIZE,
    Tweakables,
    describe,
)

__all__ = [
    "DEEPEST",
    "HEAD",
    "LINES_ALONE",
    "LINE_TWEAKABLES",
    "PROFILES",
    "WIDEST",
    "WORKING_SIZE",
    "Observations",
    "Fit",
    "LineFit",
    "Lines",
    "PinsApart",
    "SurfaceLines",
    "Tweakables",
    "align",
    "align_box",
    "align_landmarks",
    "carvable",
    "centre_lines",
    "describe",
    "engrave",
    "face_contours",
    "face_lines",
    "fit_lines",
    "fit_offsets",
    "head_box",
    "ink_box",
    "polylines",
    "unmatched_lines",
]
