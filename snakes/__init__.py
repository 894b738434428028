"""Active contours that pull a posed face to the lines of a sketch (the thesis, chapter 3)."""

from .alignment import align, align_box, align_landmarks, ink_box, parse_box
from .engraving import DEEPEST, PROFILES, WIDEST, engrave
from .fit import Fit, fit_offsets, head_box
from .identity import fit_identity
from .strokes import carvable, unmatched_strokes
from .tweakables import WORKING_SIZE, Tweakables, describe

__all__ = [
    "DEEPEST",
    "PROFILES",
    "WIDEST",
    "WORKING_SIZE",
    "Fit",
    "Tweakables",
    "align",
    "align_box",
    "align_landmarks",
    "carvable",
    "describe",
    "engrave",
    "fit_identity",
    "fit_offsets",
    "head_box",
    "ink_box",
    "parse_box",
    "unmatched_strokes",
]
