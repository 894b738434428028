"""What a drawing may look like: the pen, the hand and the page, as numbers that are stored with it.

A `Style` says everything that turns strokes into a picture, its own seed for grain and noise
included. It is made of a look (how lines are drawn) and a paper (what became of the page).
`STYLES` holds one typical style of each look for the command line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace

from facs_rig.common.errors import InputError
from facs_rig.common.settings import check_settings, setting
from facs_rig.parameters import nearest

MOST_TILT = 0.08


@dataclass(frozen=True)
class Style:
    """How strokes are drawn; sampled with the face and stored with it. Lengths are pixels.

    width : full-strength line        fading : 0 equal width, 1 width follows strength
    wobble : slow deviation of the hand        passes : how often each line is drawn
    dropout : share of the short strokes left out        layers : surface strokes that are drawn

    look : the kind of drawing, for people who read it
    pressure : how much strength comes and goes along a line
    taper : 1 ends run out to nothing        overshoot : most that a line runs on beyond its end
    pull : length that the hand draws at one go, 0 any; longer lines are pieced together
    breaks : share of a line that is gaps        nib : above 0 a flat pen, thinner in one direction
    tone : darkness that one stroke leaves, 1 black        pale : 1 tone follows strength
    grain : 1 the tooth of the paper shows through
    hatching : 0 none, 1 half of the face in shade        light : degrees round from above
    graphite : how dark the shade on the face is, 0 none        smudge : 0 the tooth of the paper
    shows in it, 1 it is rubbed smooth
    construction : tone of the lines that help to draw, 0 none
    paper : tone of the page, 1 white        noise : standard deviation of a scanner's grain
    shadow : how much darker the darkest part of the page is lit        blur : sigma
    tilt : how much the page leans aside and back, a share of its size (see `paper.tilt_matrix`)
    seed : of grain and noise

    Raises InputError for a number out of its range.
    """

    width: float = setting(1.6, minimum=0.2, maximum=12)
    fading: float = setting(0.6, minimum=0, maximum=1)
    wobble: float = setting(0.0, minimum=0, maximum=4)
    passes: int = setting(1, minimum=1, maximum=6)
    dropout: float = setting(0.0, minimum=0, maximum=1)
    layers: tuple[str, ...] = ("brow", "iris", "pupil", "lip")
    look: str = "ink"
    pressure: float = setting(0.0, minimum=0, maximum=1)
    taper: float = setting(0.0, minimum=0, maximum=1)
    overshoot: float = setting(0.0, minimum=0, maximum=30)
    pull: float = setting(0.0, minimum=0, maximum=400)
    breaks: float = setting(0.0, minimum=0, maximum=0.6)
    nib: float = setting(0.0, minimum=0, maximum=0.9)
    tone: float = setting(1.0, minimum=0.2, maximum=1)
    pale: float = setting(0.0, minimum=0, maximum=1)
    grain: float = setting(0.0, minimum=0, maximum=1)
    hatching: float = setting(0.0, minimum=0, maximum=1)
    light: float = setting(-40.0, minimum=-180, maximum=180)
    graphite: float = setting(0.0, minimum=0, maximum=1)
    smudge: float = setting(0.5, minimum=0, maximum=1)
    construction: float = setting(0.0, minimum=0, maximum=1)
    paper: float = setting(1.0, minimum=0.75, maximum=1)
    noise: float = setting(0.0, minimum=0, maximum=0.1)
    shadow: float = setting(0.0, minimum=0, maximum=0.5)
    blur: float = setting(0.0, minimum=0, maximum=2)
    tilt: tuple[float, float] = (0.0, 0.0)
    seed: int = 0

    def __post_init__(self) -> None:
        check_settings(self, "a style's ")
        if len(self.tilt) != 2 or not max(map(abs, self.tilt)) <= MOST_TILT:
            raise InputError(
                f"a style's tilt must be two numbers of at most {MOST_TILT:g}, got {self.tilt}"
            )

    def to_json(self) -> dict:
        """All fields, as JSON knows them."""
        return {**asdict(self), "layers": list(self.layers), "tilt": list(self.tilt)}

    @classmethod
    def from_json(cls, stored: Mapping) -> Style:
        """The style of `to_json`; what an older file does not say is as it was then.

        Raises InputError for a field that no style has.
        """
        known = tuple(field.name for field in fields(cls))
        for name in stored:
            if name not in known:
                raise InputError(f"a style has no '{name}'{nearest(name, known)}")
        tuples = {name: tuple(stored[name]) for name in ("layers", "tilt") if name in stored}
        return cls(**{**stored, **tuples})


# One typical style of each look, by the name that the command line knows it by.
STYLES: dict[str, Style] = {
    "ink": Style(),
    "technical": Style(look="technical", width=1.2, fading=0.0),
    "brush": Style(look="brush", width=3.0, fading=0.6, pressure=0.6, taper=1.0, nib=0.3),
    "pencil": Style(
        look="pencil", width=1.9, fading=0.35, wobble=0.5, passes=2, pressure=0.4, taper=0.6,
        overshoot=3, pull=90, tone=0.62, pale=0.6, grain=0.7, hatching=0.5, construction=0.4,
    ),
    "rough": Style(
        look="rough", width=1.3, fading=0.3, wobble=1.3, passes=3, pressure=0.5, taper=0.8,
        overshoot=8, pull=55, tone=0.75, pale=0.4, grain=0.3, construction=0.4,
    ),
    "broken": Style(look="broken", width=1.5, fading=0.5, wobble=0.4, taper=0.6, breaks=0.2),
    "hatched": Style(look="hatched", width=1.3, fading=0.4, wobble=0.3, taper=0.7, hatching=0.8),
    "shaded": Style(
        look="pencil", width=1.7, fading=0.4, wobble=0.4, passes=2, pressure=0.4, taper=0.6,
        overshoot=2, pull=90, tone=0.7, pale=0.5, grain=0.6, graphite=0.8, smudge=0.5,
    ),
    "marker": Style(look="marker", width=3.0, fading=0.3, wobble=0.5, nib=0.35, tone=0.8),
    "ballpoint": Style(
        look="ballpoint", width=1.2, fading=0.15, wobble=0.7, passes=2, pressure=0.5, overshoot=3,
        pull=120, tone=0.72, pale=0.5, grain=0.15, hatching=0.4,
    ),
    "scan": Style(
        look="pencil", width=1.9, fading=0.35, wobble=0.5, passes=2, pressure=0.4, taper=0.6,
        overshoot=3, tone=0.7, pale=0.6, grain=0.7, paper=0.93, noise=0.02, blur=0.3,
    ),
    "photo": Style(
        look="rough", width=1.6, fading=0.3, wobble=0.9, passes=2, pressure=0.5, taper=0.7,
        overshoot=5, pull=70, tone=0.8, pale=0.4, grain=0.4, paper=0.88, noise=0.015, shadow=0.25,
        blur=0.5, tilt=(0.04, -0.03),
    ),
}  # fmt: skip


def style_named(name: str, **changes: object) -> Style:
    """The style of STYLES with this name, with some fields changed; InputError for another name."""
    if name not in STYLES:
        raise InputError(f"there is no style '{name}'{nearest(name, tuple(STYLES))}")
    return replace(STYLES[name], **changes)  # type: ignore[arg-type]
