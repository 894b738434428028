"""What a drawing may look like: the pen, the hand and the page, as numbers that are stored with it.

A `Style` says everything that turns strokes into a picture, its own seed for grain and noise
included. It is made of a look (how lines are drawn) and a paper (what became of the page);
`sample_style` draws both at random, `STYLES` holds one typical style of each look for the
command line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace

import numpy as np

from facs_rig.parameters import nearest

HAIR, HAIR_ODDS = ("hair_short", "hair_bob", "hair_long", "hair_bun"), 0.3
LAYER_ODDS = {"brow": 0.85, "iris": 0.8, "pupil": 0.6, "lip": 0.65,
              "brow_hair": 0.15, "lash": 0.25, "lip_line": 0.25, "hairline": 0.1}  # fmt: skip
DROPOUTS = (0.0, 0.05, 0.15)
# Least and most of every number of a style.
RANGES: dict[str, tuple[float, float]] = {
    "width": (0.2, 12), "fading": (0, 1), "wobble": (0, 4), "passes": (1, 6), "dropout": (0, 1),
    "pressure": (0, 1), "taper": (0, 1), "overshoot": (0, 30), "pull": (0, 400),
    "breaks": (0, 0.6), "nib": (0, 0.9), "tone": (0.2, 1), "pale": (0, 1), "grain": (0, 1),
    "hatching": (0, 1), "light": (-180, 180), "construction": (0, 1),
    "paper": (0.75, 1), "noise": (0, 0.1), "shadow": (0, 0.5), "blur": (0, 2),
}  # fmt: skip
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
    construction : tone of the lines that help to draw, 0 none
    paper : tone of the page, 1 white        noise : standard deviation of a scanner's grain
    shadow : how much darker the darkest part of the page is lit        blur : sigma
    tilt : how much the page leans aside and back, a share of its size (see `paper.tilt_matrix`)
    seed : of grain and noise

    Raises ValueError for a number out of its range (RANGES).
    """

    width: float = 1.6
    fading: float = 0.6
    wobble: float = 0.0
    passes: int = 1
    dropout: float = 0.0
    layers: tuple[str, ...] = ("brow", "iris", "pupil", "lip")
    look: str = "ink"
    pressure: float = 0.0
    taper: float = 0.0
    overshoot: float = 0.0
    pull: float = 0.0
    breaks: float = 0.0
    nib: float = 0.0
    tone: float = 1.0
    pale: float = 0.0
    grain: float = 0.0
    hatching: float = 0.0
    light: float = -40.0
    construction: float = 0.0
    paper: float = 1.0
    noise: float = 0.0
    shadow: float = 0.0
    blur: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)
    seed: int = 0

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"a style's {name} must be {low:g} to {high:g}, got {value:g}")
        if len(self.tilt) != 2 or not max(map(abs, self.tilt)) <= MOST_TILT:
            raise ValueError(
                f"a style's tilt must be two numbers of at most {MOST_TILT:g}, got {self.tilt}"
            )

    def to_json(self) -> dict:
        """All fields, as JSON knows them."""
        return {**asdict(self), "layers": list(self.layers), "tilt": list(self.tilt)}

    @classmethod
    def from_json(cls, stored: Mapping) -> Style:
        """The style of `to_json`; what an older file does not say is as it was then.

        Raises ValueError for a field that no style has.
        """
        known = tuple(field.name for field in fields(cls))
        for name in stored:
            if name not in known:
                raise ValueError(f"a style has no '{name}'{nearest(name, known)}")
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

Ranges = dict[str, tuple[float, float]]
# How often each look is drawn, and between which numbers; a field that is missing is the default.
LOOKS: dict[str, tuple[float, Ranges]] = {
    "ink": (0.22, {"width": (1.0, 2.8), "fading": (0, 0.8), "taper": (0, 1)}),
    "technical": (0.10, {"width": (0.9, 2.2), "fading": (0, 0)}),
    "brush": (0.08, {"width": (2.0, 3.6), "fading": (0.4, 0.8), "wobble": (0, 0.7),
                     "pressure": (0.3, 0.8), "taper": (0.7, 1), "nib": (0, 0.5)}),
    "pencil": (0.20, {"width": (1.4, 2.6), "fading": (0.1, 0.6), "wobble": (0, 0.9),
                      "passes": (1, 2), "pressure": (0.2, 0.6), "taper": (0.2, 0.8),
                      "overshoot": (0, 5), "pull": (50, 160), "tone": (0.5, 0.85),
                      "pale": (0.3, 0.7), "grain": (0.4, 0.9)}),
    "rough": (0.15, {"width": (1.0, 2.0), "fading": (0, 0.6), "wobble": (0.6, 1.6),
                     "passes": (2, 3), "pressure": (0.2, 0.7), "taper": (0.3, 1),
                     "overshoot": (2, 10), "pull": (35, 110), "tone": (0.6, 1.0),
                     "pale": (0, 0.5), "grain": (0, 0.5)}),
    "broken": (0.06, {"width": (1.0, 2.4), "fading": (0, 0.7), "wobble": (0, 0.9),
                      "taper": (0.2, 1), "breaks": (0.05, 0.25)}),
    "marker": (0.09, {"width": (2.4, 3.6), "fading": (0.1, 0.5), "wobble": (0, 0.9),
                      "nib": (0, 0.6), "tone": (0.7, 1.0)}),
    "ballpoint": (0.10, {"width": (0.9, 1.5), "fading": (0, 0.3), "wobble": (0.3, 1.1),
                         "passes": (1, 2), "pressure": (0.2, 0.6), "overshoot": (0, 5),
                         "pull": (60, 200), "tone": (0.6, 0.85), "pale": (0.2, 0.6),
                         "grain": (0, 0.3)}),
}  # fmt: skip
HATCHING_ODDS = {"pencil": 0.35, "rough": 0.15, "ballpoint": 0.3, "ink": 0.12, "broken": 0.1}
CONSTRUCTION_ODDS = {"pencil": 0.25, "rough": 0.35, "ballpoint": 0.1}
PAPERS: dict[str, tuple[float, Ranges]] = {
    "white": (0.70, {}),
    "toned": (0.06, {"paper": (0.78, 0.97)}),
    "scan": (0.14, {"paper": (0.9, 1), "noise": (0.005, 0.03), "blur": (0, 0.6)}),
    "photo": (0.10, {"paper": (0.78, 0.97), "noise": (0.005, 0.025), "shadow": (0.05, 0.3),
                     "blur": (0.2, 0.8)}),
}  # fmt: skip


def sample_style(
    rng: np.random.Generator, look: str | None = None, paper: str | None = None
) -> Style:
    """A random style: any look on any paper by their odds, or those that are named.

    look : of LOOKS;  paper : of PAPERS. Raises ValueError for another name.
    """
    layers = [layer for layer, p in LAYER_ODDS.items() if rng.random() < p]
    if rng.random() < HAIR_ODDS:
        layers.append(str(rng.choice(HAIR)))
    look = _chosen(LOOKS, look, "look", rng)
    paper = _chosen(PAPERS, paper, "paper", rng)
    values: dict = {}
    for name, (low, high) in {**LOOKS[look][1], **PAPERS[paper][1]}.items():
        whole = name == "passes"
        values[name] = int(rng.integers(int(low), int(high) + 1)) if whole else (
            round(float(rng.uniform(low, high)), 4))  # fmt: skip
    if rng.random() < HATCHING_ODDS.get(look, 0):
        values["hatching"] = round(float(rng.uniform(0.2, 0.9)), 4)
        values["light"] = round(float(rng.choice([-1, 1]) * rng.uniform(20, 80)), 2)
    if rng.random() < CONSTRUCTION_ODDS.get(look, 0):
        values["construction"] = round(float(rng.uniform(0.2, 0.5)), 4)
    if paper == "photo":
        lean = rng.uniform(-0.05, 0.05, 2)
        values["tilt"] = (round(float(lean[0]), 4), round(float(lean[1]), 4))
    return Style(
        **values, look=look, layers=tuple(layers), dropout=float(rng.choice(DROPOUTS)),
        seed=int(rng.integers(2**31)),
    )  # fmt: skip


def style_named(name: str, **changes: object) -> Style:
    """The style of STYLES with this name, with some fields changed; ValueError for another name."""
    if name not in STYLES:
        raise ValueError(f"there is no style '{name}'{nearest(name, tuple(STYLES))}")
    return replace(STYLES[name], **changes)  # type: ignore[arg-type]


def _chosen(
    table: Mapping[str, tuple[float, Ranges]],
    name: str | None,
    what: str,
    rng: np.random.Generator,
) -> str:
    if name is None:
        odds = np.array([share for share, _ in table.values()])
        return str(rng.choice(list(table), p=odds / odds.sum()))
    if name not in table:
        raise ValueError(f"there is no {what} '{name}'{nearest(name, tuple(table))}")
    return name
