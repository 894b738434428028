"""Sex, age, weight, muscle and origin as weights of whole-face targets: who a face is at large.

Faces of the source at three ages are blended, six years, 25 and 90. What these lack lies over them,
sculpted: how old faces sag, what tells men from women and heavy people from thin ones; how much of
that is seen is up to `age_shows`, `sex_shows` and `weight_shows`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

ETHNICITIES = ("african", "asian", "caucasian")
SEXES = ("female", "male")
AGES = ("young", "old", "six")
WEIGHTS = ("min", "average", "max")
CHILD, ADULT, OLD = 6.0, 25.0, 90.0  # years at -1, 0 and 1
STAGES = (60, 75, 90)  # years at which signs of age are sculpted; they begin at BEGINS
BEGINS = 42.0
_REACHED = np.arange(len(STAGES) + 1.0)
# What may be higher, or farther aside, on one side of the face: `asym_...`.
SIDES = ("brows", "eyes", "cheeks", "nose", "nostrils", "mouth", "lips", "jaw", "ears")
MUSCLES = ("female-muscle", "male-muscle", "male-slight")
# Targets of gender, age and ethnicity come first. They are whole faces: base and one of them.
WHOLE_FACES = len(ETHNICITIES) * len(SEXES) * len(AGES)


def years(age: float) -> float:
    """The age in years that `age` from -1 to 1 stands for: 6 at -1, 25 at 0, 90 at 1."""
    return ADULT + age * (OLD - ADULT if age > 0 else ADULT - CHILD)


def age_of(years: float) -> float:
    """The inverse of `years`."""
    return (years - ADULT) / (OLD - ADULT if years > ADULT else ADULT - CHILD)


def childhood(age: float) -> float:
    """How much of a six-year-old there is in a face, 0..1.

    Faces grow fast at first: at twelve half of what a child of six lacks is there, at 16 four
    fifths (heights of the face in Farkas 1994, "Anthropometry of the Head and Face").
    """
    return min(age, 0.0) ** 2


def aged(age: float) -> NDArray[np.float64]:
    """(3,) weights of the faces sculpted at STAGES: one of them, or two in between."""
    reached = np.interp(years(age), (BEGINS, *STAGES), _REACHED)
    return np.maximum(1 - np.abs(reached - _REACHED[1:]), 0.0)


def macro_targets() -> tuple[str, ...]:
    """Names of the targets of sex, age, ethnicity, weight and muscle, in the order of
    `macro_weights`."""
    names = [f"macrodetails/{e}-{g}-{a}" for e in ETHNICITIES for g in SEXES for a in AGES]
    names += [
        f"macrodetails/universal-{g}-{a}-averagemuscle-{w}weight"
        for g in SEXES
        for a in AGES
        for w in WEIGHTS
    ]
    names += [f"macrodetails/{name}" for name in MUSCLES]
    names += [f"aging/aged-{stage}" for stage in STAGES]
    names += [f"sex/more-{g}" for g in SEXES]
    names += ["weight/thin", "weight/heavy"]
    return tuple(names)


def macro_weights(p: Mapping[str, float]) -> NDArray[np.float64]:
    """Weights of `macro_targets` for identity parameters, all of them given.

    Products, as in MakeHuman: each corner of gender x age x ethnicity (and gender x age x weight)
    has the product of its shares.
    """
    child = childhood(p["age"])
    old = max(p["age"], 0.0)
    sex = (1 - p["gender"], p["gender"])
    age = (1 - old - child, old, child)
    heavy = p["weight"]
    weight = (max(-heavy, 0), 1 - abs(heavy), max(heavy, 0))
    shares = np.array([max(p[e], 0.0) for e in ETHNICITIES])
    shares = shares / shares.sum() if shares.sum() > 0 else np.full(3, 1 / 3)
    strong, slight = ((1 - child) * max(sign * p["muscle"], 0) for sign in (1, -1))
    grown = (1 - child) * p["sex_shows"]
    out = [s * g * a for s in shares for g in sex for a in age]
    out += [g * a * w for g in sex for a in age for w in weight]
    out += [sex[0] * strong, sex[1] * strong, sex[1] * slight]
    out += list(p["age_shows"] * aged(p["age"]))
    out += [grown * max(g - h, 0) for g, h in (sex, sex[::-1])]
    out += [(1 - child / 2) * p["weight_shows"] * weight[k] for k in (0, 2)]
    return np.array(out)


def _thick(p: Mapping[str, float]) -> float:
    return p["brow_thickness"] + 0.4 * _manly(p) - 0.45 * childhood(p["age"])


def _dense(p: Mapping[str, float]) -> float:
    sparse = 0.5 * childhood(p["age"]) - 0.3 * _old(p) * min(_manly(p), 0)
    return p["brow_density"] + 0.15 * _manly(p) - sparse


def _arched(p: Mapping[str, float]) -> float:
    return p["brow_arch"] - 0.3 * _manly(p)


def _manly(p: Mapping[str, float]) -> float:
    return (1 - childhood(p["age"])) * p["sex_shows"] * (2 * p["gender"] - 1)


def _old(p: Mapping[str, float]) -> float:
    return p["age_shows"] * float(aged(p["age"]) @ (0.4, 0.75, 1.0))


# How much of each shape of brows a person has (see baking.brows), given all parameters: men's are
# thicker than women's, old men's bushy, old women's sparse, children's thin and faint.
BROW_DETAILS: dict[str, Callable[[Mapping[str, float]], float]] = {
    "brow thin": lambda p: max(-_thick(p), 0.0),
    "brow thick": lambda p: max(_thick(p), 0.0),
    "brow sparse": lambda p: max(-_dense(p), 0.0),
    "brow dense": lambda p: max(_dense(p), 0.0),
    "brow bushy": lambda p: p["brow_bushiness"] + _old(p) * max(_manly(p), 0.0),
    "brow straight": lambda p: max(-_arched(p), 0.0),
    "brow arched": lambda p: max(_arched(p), 0.0),
    "brow short": lambda p: max(-p["brow_length"], 0.0),
    "brow long": lambda p: max(p["brow_length"], 0.0),
}


def drawn_person(rng: np.random.Generator) -> dict[str, float]:
    """Who somebody is beyond sex, origin and features: of any age, more or less marked by it, with
    brows of his own and a face whose sides differ a little.

    Of a hundred people 15 are under twelve, 15 under twenty, 40 under fifty and 30 older.
    """
    ages = np.interp(rng.random(), (0, 0.15, 0.3, 0.7, 1), (CHILD, 12, 20, 50, OLD))
    out = {"age": age_of(float(ages)), "muscle": np.clip(rng.normal(0, 0.4), -1, 1)}
    out |= {name: 1 - 0.6 * rng.random() ** 2 for name in ("age_shows", "sex_shows")}
    shapes = ("brow_thickness", "brow_density", "brow_arch", "brow_length")
    out |= {name: np.clip(rng.normal(0, 0.35), -1, 1) for name in shapes}
    out["brow_bushiness"] = max(rng.normal(-0.3, 0.3), 0)
    out |= {f"asym_{name}": np.clip(rng.normal(0, 0.2), -1, 1) for name in SIDES}
    return {name: round(float(value), 4) for name, value in out.items()}
