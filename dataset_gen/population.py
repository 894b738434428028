"""Random people: who is drawn, in the scheme `people`.

Of all ages from six to ninety, evenly but for children, of all sexes and origins; what belongs
together in a face goes together (a large nose is large everywhere, heavy people have full cheeks);
left is a little unlike right; most do things in ways of their own, and crease in their own way or
not at all; and some are no portraits but stylised.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig.actions import drawn_actions
from facs_rig.folds import drawn_creases
from facs_rig.identity import ASYMMETRY, BROWS, BY_NAME, ETHNICITIES, FEATURES
from facs_rig.looks import drawn_looks
from facs_rig.macros import ADULT, CHILD, OLD, age_of
from facs_rig.stylised import drawn_style

GROWN = 18.0  # years
CHILDREN = 0.2  # share of people from six to GROWN; the others are evenly old
OWN_WAYS = 0.85  # share of people who do not do everything in the mean way
STYLISED = 0.2
# Of faces: without any crease, with those of some groups alone; the others have all.
CREASELESS, SOME_CREASES = 1 / 3, 1 / 3
SOME = 0.5  # of the groups of creases, where a face has but some
UNLIKE = 0.2  # standard deviation of what makes left unlike right
FEATURE, PLAIN = 0.35, 0.4  # standard deviation of a feature; share of features that are plain

# Features that vary together, and how much (the correlation of two of them).
TOGETHER: tuple[tuple[float, tuple[str, ...]], ...] = (
    (0.5, ("nose_length", "nose_depth", "ear_size")),
    (0.6, ("nose_width", "nostril_width", "nose_tip_width")),
    (0.6, ("upper_lip", "lower_lip", "lip_volume")),
    (0.5, ("jaw_width", "chin_width", "head_width")),
    (0.5, ("cheek_volume", "head_fat", "neck_girth")),
    (0.4, ("eye_size", "eye_opening")),
    (0.4, ("head_height", "forehead_height", "chin_height")),
)
# How much of a feature goes with a person's weight, and with being a man rather than a woman.
WITH_WEIGHT = {"cheek_volume": 0.3, "head_fat": 0.35, "neck_girth": 0.4, "cheek_hollow": -0.25}
WITH_SEX = {"jaw_width": 0.2, "brow_depth": 0.25, "chin_height": 0.15, "neck_girth": 0.25,
            "upper_lip": -0.15, "lower_lip": -0.15, "eye_size": -0.15}  # fmt: skip


def sample_person(rng: np.random.Generator) -> dict[str, float]:
    """The identity parameters of a random person.

    Each part is drawn from a generator of its own, so that one that changes leaves the others.
    """
    body, shape, ways, folds, style, look = (
        np.random.default_rng(seed) for seed in rng.integers(2**63, size=6)
    )
    who = _body(body)
    who |= _features(shape, who)
    if ways.random() < OWN_WAYS:
        who |= drawn_actions(ways)
    if style.random() < STYLISED:
        who |= drawn_style(style)
    who |= drawn_looks(look, who)
    kind = folds.random()
    if kind < CREASELESS:
        who["wrinkles"] = -1.0
    else:
        who |= drawn_creases(folds, SOME if kind < CREASELESS + SOME_CREASES else 1.0)
    return {name: round(float(value), 4) for name, value in who.items()}


def _body(rng: np.random.Generator) -> dict[str, float]:
    """Sex, age, weight, muscle and origin."""
    gender = rng.beta(0.4, 0.4)
    young = rng.random() < CHILDREN
    years = rng.uniform(CHILD, GROWN) if young else rng.uniform(GROWN, OLD)
    grown = np.clip((years - CHILD) / (ADULT - CHILD), 0, 1)
    shares = rng.dirichlet([0.5, 0.5, 0.5])
    strength = rng.normal(0.25 * (2 * gender - 1) - 0.3 * max(age_of(years), 0), 0.4)
    return {
        "gender": gender,
        "age": age_of(years),
        "weight": _within("weight", rng.normal(0.1 * grown, 0.42)),
        "muscle": _within("muscle", grown * strength),
        **dict(zip(ETHNICITIES, shares, strict=True)),
        "wrinkles": _within("wrinkles", rng.normal(0, 0.25)),
    }


def _features(rng: np.random.Generator, who: dict[str, float]) -> dict[str, float]:
    """Features, brows, and what makes left unlike right."""
    place = {feature.name: k for k, feature in enumerate(FEATURES)}
    values = rng.standard_normal(len(FEATURES))
    shared = rng.standard_normal(len(TOGETHER))
    varied = rng.random(len(FEATURES)) >= PLAIN
    for (likeness, names), common in zip(TOGETHER, shared, strict=True):
        at = [place[name] for name in names]
        values[at] = np.sqrt(likeness) * common + np.sqrt(1 - likeness) * values[at]
        varied[at] = varied[at[0]]
    values = FEATURE * values * varied
    grown = 1 + min(who["age"], 0.0)  # children have less of it
    for with_what, amount in ((WITH_WEIGHT, who["weight"]), (WITH_SEX, 2 * who["gender"] - 1)):
        for name, share in with_what.items():
            values[place[name]] += share * grown * amount
    unlike = UNLIKE * rng.lognormal(0, 0.5) * rng.standard_normal(len(ASYMMETRY))
    brows = 0.45 * rng.standard_normal(len(BROWS))
    parts: tuple[tuple[tuple, NDArray], ...] = (
        (FEATURES, values), (ASYMMETRY, unlike), (BROWS, brows)
    )  # fmt: skip
    found = {
        f.name: _within(f.name, x) for table, xs in parts for f, x in zip(table, xs, strict=True)
    }
    return {name: value for name, value in found.items() if value}


def _within(name: str, value: float) -> float:
    """A value inside a parameter's human range."""
    feature = BY_NAME[name]
    return float(np.clip(value, feature.minimum, feature.maximum))
