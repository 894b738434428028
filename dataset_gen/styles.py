"""Styles at random: any look on any paper, as often as people draw so."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from facs_rig.common.errors import InputError
from facs_rig.parameters import nearest

from .linework.style import Style

HAIR, HAIR_ODDS = ("hair_short", "hair_bob", "hair_long", "hair_bun"), 0.3
LAYER_ODDS = {"brow": 0.85, "iris": 0.8, "pupil": 0.6, "lip": 0.65,
              "brow_hair": 0.15, "lash": 0.25, "lip_line": 0.25, "hairline": 0.1}  # fmt: skip
DROPOUTS = (0.0, 0.05, 0.15)
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
GRAPHITE_ODDS = {"pencil": 0.45, "rough": 0.25, "ballpoint": 0.1, "marker": 0.1, "brush": 0.1}
PAPERS: dict[str, tuple[float, Ranges]] = {
    "white": (0.70, {}),
    "toned": (0.06, {"paper": (0.78, 0.97)}),
    "scan": (0.14, {"paper": (0.9, 1), "noise": (0.005, 0.03), "blur": (0, 0.6)}),
    "photo": (0.10, {"paper": (0.78, 0.97), "noise": (0.005, 0.025), "shadow": (0.05, 0.3),
                     "blur": (0.2, 0.8)}),
}  # fmt: skip


def sample_style(
    rng: np.random.Generator,
    look: str | None = None,
    paper: str | None = None,
    shaded: bool = True,
) -> Style:
    """A random style: any look on any paper by their odds, or those that are named.

    look : of LOOKS;  paper : of PAPERS;  shaded : whether some have graphite in their shade

    Raises InputError for another name.
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
    if shaded and rng.random() < GRAPHITE_ODDS.get(look, 0):
        values["graphite"] = round(float(rng.uniform(0.2, 1)), 4)
        values["smudge"] = round(float(rng.random()), 4)
        values.setdefault("light", round(float(rng.choice([-1, 1]) * rng.uniform(20, 80)), 2))
    if paper == "photo":
        lean = rng.uniform(-0.05, 0.05, 2)
        values["tilt"] = (round(float(lean[0]), 4), round(float(lean[1]), 4))
    return Style(
        **values, look=look, layers=tuple(layers), dropout=float(rng.choice(DROPOUTS)),
        seed=int(rng.integers(2**31)),
    )  # fmt: skip


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
        raise InputError(f"there is no {what} '{name}'{nearest(name, tuple(table))}")
    return name
