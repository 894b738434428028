"""Expressions as people draw them: what faces do together when somebody feels something.

Actions by lot hardly ever make a face that anybody would draw: half of all drawn faces rest or
smile. The combinations are those of Ekman, Friesen, Hager 2002, "FACS Investigator's Guide"
(chapter 12, emotions and their major variants), and a few that are no emotions: a wink, a kiss,
sleep, doubt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from facs_rig import CONTROL_NAMES, FULL_INTENSITY

MOST = 1.2 * FULL_INTENSITY
BESIDE = 0.15  # share of faces that do something else as well
SIDES = ("left", "right")


@dataclass(frozen=True)
class Part:
    """What a feeling may do to a face.

    control : its name, `{side}` for either; least, most : its intensity, evenly between;
    share : of the faces with the feeling that do it
    """

    control: str
    least: float
    most: float
    share: float = 1.0


FEELINGS: dict[str, tuple[float, tuple[Part, ...]]] = {
    # name -> how often it is drawn beside the others, and what it does
    "rest": (20, ()),
    "smile": (18, (Part("smile", 1.5, MOST), Part("outer_squint", 1, 5, 0.5),
                   Part("squint", 1, 4, 0.2), Part("jaw_open", 1, 2.5, 0.25))),
    "laugh": (9, (Part("smile", 3.5, MOST), Part("jaw_open", 2.5, MOST),
                  Part("outer_squint", 2, MOST, 0.7), Part("blink", 3, 5, 0.35),
                  Part("sneer", 1, 3, 0.2))),
    "smirk": (4, (Part("smile_{side}", 2, MOST), Part("frontalis_{side}", 2, 5, 0.25),
                  Part("squint", 1, 3, 0.25))),
    "sadness": (6, (Part("medialis_frontalis", 2, MOST), Part("frown", 1.5, MOST),
                    Part("brow_furrow", 1, 4, 0.5), Part("shrug", 1, 4, 0.4),
                    Part("blink", 1.5, 5, 0.3))),
    "weeping": (3, (Part("medialis_frontalis", 2, MOST), Part("brow_furrow", 2, 5),
                    Part("squint", 2, MOST, 0.6), Part("blink", 3, 5, 0.4),
                    Part("grimace", 1.5, 5, 0.6), Part("frown", 2, MOST, 0.7),
                    Part("jaw_open", 1.5, 5, 0.6))),
    "anger": (6, (Part("brow_furrow", 2.5, MOST), Part("lid_raise", 1, 5, 0.4),
                  Part("squint", 1, 4, 0.3), Part("lip_lock", 1.5, 5, 0.35),
                  Part("frown", 1.5, MOST, 0.5), Part("nostril_flare", 1.5, 5, 0.3))),
    "rage": (4, (Part("brow_furrow", 3.5, MOST), Part("lid_raise", 1.5, MOST, 0.5),
                 Part("sneer", 1.5, MOST, 0.6), Part("jaw_open", 2, MOST, 0.8),
                 Part("lower_lip_depress", 1.5, MOST, 0.5), Part("grimace", 1.5, 5, 0.5),
                 Part("wince", 1, 5, 0.4))),
    "surprise": (5, (Part("frontalis", 2, MOST), Part("lid_raise", 1.5, MOST),
                     Part("jaw_open", 1.5, MOST, 0.85))),
    "fear": (4, (Part("frontalis", 1.5, 5, 0.7), Part("medialis_frontalis", 1.5, 5, 0.6),
                 Part("brow_furrow", 1, 4, 0.7), Part("lid_raise", 2, MOST),
                 Part("grimace", 1.5, MOST, 0.7), Part("jaw_open", 1, 4, 0.5))),
    "disgust": (4, (Part("wince", 2, MOST, 0.8), Part("sneer", 2, MOST, 0.7),
                    Part("brow_furrow", 1, 4, 0.4), Part("squint", 1, 4, 0.4),
                    Part("shrug", 1, 4, 0.4), Part("frown", 1, 4, 0.4))),
    "worry": (4, (Part("medialis_frontalis", 1.5, 5), Part("brow_furrow", 1, 4, 0.6),
                  Part("frown", 1, 4, 0.5), Part("lip_lock", 1, 3, 0.2))),
    "doubt": (3, (Part("frontalis_{side}", 2, MOST), Part("brow_furrow", 1, 3, 0.4),
                  Part("frown", 1, 4, 0.4), Part("pucker", 1, 4, 0.2))),
    "thought": (3, (Part("brow_furrow", 1, 4), Part("lip_lock", 1, 4, 0.4),
                    Part("squint", 1, 3, 0.3))),
    "sleep": (3, (Part("blink", 4.5, 5.5), Part("smile", 1, 3, 0.3), Part("jaw_open", 1, 3, 0.1))),
    "tiredness": (2, (Part("blink", 1.5, 3.5), Part("frown", 1, 3, 0.3))),
    "wink": (1, (Part("blink_{side}", 4, 5.5), Part("smile", 1.5, 5, 0.7))),
    "kiss": (1, (Part("purse", 2.5, MOST), Part("blink", 3.5, 5, 0.4))),
}  # fmt: skip


def sample_feeling(rng: np.random.Generator) -> dict[str, float]:
    """What a face does that feels something, by lot: control -> intensity."""
    odds = np.array([often for often, _ in FEELINGS.values()], dtype=float)
    parts = tuple(FEELINGS.values())[rng.choice(len(odds), p=odds / odds.sum())][1]
    side = SIDES[rng.integers(2)]
    aus: dict[str, float] = {}
    for part in parts:
        if rng.random() < part.share:
            aus[part.control.format(side=side)] = float(rng.uniform(part.least, part.most))
    if aus and rng.random() < BESIDE:
        other = CONTROL_NAMES[rng.integers(len(CONTROL_NAMES))]
        aus.setdefault(other, float(rng.uniform(1.0, MOST)))
    return aus
