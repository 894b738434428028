"""How to fit: what an artist may say, and which of it can be meant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from facs_rig import CONTROL_NAMES, LANDMARKS, MAX_INTENSITY
from facs_rig.common.box import Box
from facs_rig.common.errors import InputError
from facs_rig.common.settings import check_settings, setting
from facs_rig.hair.mesh import KINDS
from facs_rig.parameters import nearest
from snakes import DEEPEST, PROFILES, WIDEST, Tweakables

METHODS = ("lines", "shape", "thesis")
# What becomes of the strokes that have no place on the face.
UNMATCHED = ("ignore", "engrave", "emboss")
# What is made of drawn hair: a surface with locks on it, that surface alone, strands over a thinner
# one (for a .blend alone), or nothing.
HAIR = (*KINDS, "ignore")
# And of a drawn beard: hairs on the skin, or nothing.
BEARD = ("hairs", "ignore")
MOST_EXAGGERATED = 3.0


@dataclass(frozen=True)
class FitOptions:
    """How to fit; the defaults need no help from anybody.

    tweakables : the thesis' table          align : the head's box 'left,top,right,bottom' in
    pixels of the sketch, instead of the landmarks that the detector finds
    pins : landmark -> (u, v) pixels of the sketch where it is, instead of where it was found
    expression : control -> intensity 0..10 that the artist has decided, 0 is off; the fit keeps to
    it, whatever the detector or the lines say
    method : 'lines' brings the face's lines to the drawing's; 'shape' finds the same person and
    expression and leaves the skin alone, quick and smooth; 'thesis' lets the drawing's contours
    slide over the shaded face, with all the tweakables of its table (chapter 3)
    exaggerate : how much of what makes the person and the expression is shown: 1 as drawn, less for
    plainer, more for a caricature
    hair, beard : one of HAIR and of BEARD; the thesis' method makes none
    strokes : one of UNMATCHED, for the strokes that have no place on the face (snakes.strokes says
    which of them); stroke_depth, stroke_width in mm, stroke_profile : see snakes.engrave

    Raises InputError, one sentence, for a value that cannot be used.
    """

    tweakables: Tweakables = field(default_factory=Tweakables)
    align: Box | str | None = None
    pins: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    expression: Mapping[str, float] = field(default_factory=dict)
    method: str = setting("lines", "The method", choices=METHODS)
    exaggerate: float = setting(
        1.0,
        "Exaggerate",
        "How much of the drawn person and expression is shown: 0 a plain face, 1 all, 1.5 more",
        "",
        0.0,
        MOST_EXAGGERATED,
    )
    hair: str = setting(
        "locks", "Hair", "What is made of drawn hair; curves are for a .blend", choices=HAIR
    )
    beard: str = setting("hairs", "Beard", "What is made of a drawn beard", choices=BEARD)
    strokes: str = setting("ignore", "Unmatched strokes", choices=UNMATCHED)
    stroke_depth: float = setting(
        1.2,
        "Depth",
        "How deep a stroke is carved, or how high it is raised",
        "mm",
        above=0.0,
        maximum=1000 * DEEPEST,
    )
    stroke_width: float = setting(
        4.0,
        "Width",
        "How wide a carved stroke is; wider where the mesh is coarse",
        "mm",
        above=0.0,
        maximum=1000 * WIDEST,
    )
    stroke_profile: str = setting("crease", "The stroke profile", choices=tuple(PROFILES))

    def __post_init__(self) -> None:
        check_settings(self)
        for name, place in self.pins.items():
            if name not in LANDMARKS:
                hint = nearest(name, LANDMARKS) or "."
                raise InputError(f"There is no landmark '{name}'{hint}")
            if len(place) != 2 or not all(map(math.isfinite, place)):
                raise InputError(f"The pin of {name} is a place u,v in pixels, not {place}.")
        for name, intensity in self.expression.items():
            if name not in CONTROL_NAMES:
                hint = nearest(name, CONTROL_NAMES) or "; `sketch2face rig --list` shows all."
                raise InputError(f"There is no control '{name}'{hint}")
            if not 0 <= intensity <= MAX_INTENSITY:  # not-a-number fails both
                raise InputError(
                    f"The intensity of {name} is at least 0 and at most {MAX_INTENSITY:g}, "
                    f"not {intensity:g}."
                )
