"""A person's own creases: which of the grooves a face may have (facs_rig.grooves) this one has.

For each family of creases, such as worry lines, a person has six parameters from -1 to 1, 0 for
the default person: how deep they are (-1 none), how many, where, how long, how much they fork and
break, and how much deeper, longer and more they are on the face's left than on its right.
`crease_seed` lets every single line deviate from these as it will, 0 none of them.

They are what a person creases by: how strongly is up to the expression, `wrinkles` and age. Folds
that an old face has at rest follow them too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from .grooves import CREASES, LINES, PLAIN, WAYS, names_of

# Family -> its label, and its groups of lines.
FAMILIES: dict[str, tuple[str, tuple[str, ...]]] = {
    "worry": ("Worry lines", ("worry", "worry_centre", "worry_side")),
    "glabella": ("Frown lines", ("glabella",)),
    "crow": ("Crow's feet", ("crow_down", "crow_up", "under_eye")),
    "bunny": ("Nose creases", ("bunny",)),
    "nasolabial": ("Smile folds", ("nasal", "nasolabial", "smile_fold")),
    "corner": ("Mouth creases", ("corner_pinch", "corner_fold", "marionette")),
    "chin": ("Chin creases", ("chin_boss",)),
    "lip": ("Lip creases", ("lip_radial",)),
}
# Trait -> its label. The order is that of the columns below.
TRAITS = {"depth": "depth", "number": "number", "place": "place", "length": "length",
          "branching": "branching", "skew": "left deeper"}  # fmt: skip
SEED, SEEDS = "crease_seed", 9999
SIDES = ("left", "right")

AGE_DEEPENS = 0.7
DEEPER = 0.6  # how much deeper creases of depth 1 are than those of depth 0
# No line is deeper than this many times the default person's, whatever age and wrinkles make of it.
DEEPEST = 3.5
SOFT = 0.25  # of `number`, over which a line comes
SKEWED = 0.6  # how much deeper, of the depth, creases of skew 1 are on one side
SKEWED_TRAITS = 0.3  # of number and length
# How far a line deviates by itself, at most: of depth (a share), number, place, length, branching.
DEVIATION = np.array([0.4, 0.4, 0.7, 0.8, 0.7])
# How much people differ in each of TRAITS: standard deviations.
SPREAD = np.array([0.5, 0.55, 0.5, 0.5, 0.5, 0.3])


def parameter_names() -> tuple[str, ...]:
    """All parameters of a person's creases, in the order of families and traits, and the seed."""
    return (*(f"{family}_{trait}" for family in FAMILIES for trait in TRAITS), SEED)


PARAMETERS = parameter_names()
_FAMILY_OF = {group: k for k, (_, groups) in enumerate(FAMILIES.values()) for group in groups}
_GROUP_LINES = [(group, line) for group, lines in LINES.items() for line in lines]
_FAMILY = np.array([_FAMILY_OF[group] for group, _ in _GROUP_LINES])  # (lines,)
_SINCE = np.array([line.since for _, line in _GROUP_LINES])
_HAS = np.array([[way in line.ways for way in WAYS[1:]] for _, line in _GROUP_LINES])
# Of (lines, ways, sides): which there are, and their names in the asset.
_THERE = np.repeat(np.insert(_HAS, 0, True, axis=1)[:, :, None], 2, axis=2)
GROOVES = tuple(
    f"{name} {side}" for group in LINES for name, _, _ in names_of(group) for side in SIDES
)
_DEFAULT = ((np.arange(len(WAYS)) == WAYS.index(PLAIN)) * (_SINCE <= 0)[:, None])[:, :, None]


def crease_gain(known: Mapping[str, float]) -> float:
    """How deep the expression's creases are: 1 in the plain young face, deeper with age."""
    return (1 + AGE_DEEPENS * known.get("age", 0.0)) * (1 + known.get("wrinkles", 0.0))


def groove_weights(identity: Mapping[str, float]) -> dict[str, float]:
    """How much more of each groove a person has than the default person, by GROOVES; empty for
    the default person's creases. A groove that only the default person has is taken away: -1."""
    own = tuple(float(identity.get(name, 0.0)) for name in PARAMETERS)
    if not any(own):
        return {}
    weights = _amounts(own, round(max(crease_gain(identity), 1e-6), 6)) - _DEFAULT
    return dict(zip(GROOVES, weights[_THERE].tolist(), strict=True))


@lru_cache(maxsize=256)
def _amounts(own: tuple[float, ...], gain: float) -> NDArray[np.float64]:
    """(lines, ways, sides) how much of each groove there is, 1 at the default person's depth."""
    traits = np.array(own[:-1]).reshape(len(FAMILIES), len(TRAITS))[_FAMILY][:, :, None]
    depth, number, place, length, branching, skew = np.moveaxis(traits, 1, 0)  # (lines, 1)
    free = _deviations(round(own[-1]))
    left = np.array([1.0, -1.0]) * skew  # (lines, 2)
    more = number + free[1] + SKEWED_TRAITS * left
    there = np.clip((more - _SINCE[:, None]) / SOFT + 0.5, 0, 1)
    deep = np.where(depth < 0, 1 + depth, 1 + DEEPER * depth) * (1 + free[0]) * (1 + SKEWED * left)
    place = place + free[2]
    length = length + free[3] + SKEWED_TRAITS * left
    wanted = np.stack([place, -place, -length, length, branching + free[4]], axis=1)
    wanted = np.clip(wanted, 0, 1) * _HAS[:, :, None]
    # A line is mostly one of its ways: a mixture is several faint lines side by side.
    wanted = np.concatenate([1 - wanted.max(axis=1, keepdims=True), wanted], axis=1) ** 3
    share = wanted / wanted.sum(axis=1, keepdims=True)
    return np.minimum(deep * there, DEEPEST / gain)[:, None] * share


@lru_cache(maxsize=256)
def _deviations(seed: int) -> NDArray[np.float64]:
    """(5, lines, 2) how far each line on each side deviates by itself; none for seed 0."""
    if seed == 0:
        return np.zeros((len(DEVIATION), len(_SINCE), 2))
    free = np.random.default_rng(seed).random((len(DEVIATION), len(_SINCE), 2))
    return DEVIATION[:, None, None] * (2 * free - 1)


def line_depths(identity: Mapping[str, float]) -> dict[str, float]:
    """How deep each of the default person's lines (grooves.CREASES) is on this one, whatever its
    way: `{group}_{number}_{side}` -> 1 as on the default person, 0 not there."""
    own = tuple(float(identity.get(name, 0.0)) for name in PARAMETERS)
    deep = _amounts(own, round(max(crease_gain(identity), 1e-6), 6)).sum(axis=1)
    names = [f"{group}_{k}" for group, creases in CREASES.items() for k in range(len(creases))]
    found = zip(names, deep[_SINCE <= 0], strict=True)
    return {f"{name}_{side}": float(x) for name, two in found
            for side, x in zip(SIDES, two, strict=True)}  # fmt: skip


def drawn_creases(rng: np.random.Generator, share: float = 1.0) -> dict[str, float]:
    """Identity parameters of somebody's creases, from hardly any to deep ones.

    share : the odds that a family has any crease at all
    """
    drawn: dict[str, float] = {}
    for family in FAMILIES:
        any_at_all = rng.random() < share
        values = np.clip(rng.normal(0, SPREAD), -1, 1).round(3)
        values[0] = max(values[0], -0.9) if any_at_all else -1.0
        found = dict(zip((f"{family}_{trait}" for trait in TRAITS), values.tolist(), strict=True))
        drawn |= found if any_at_all else {f"{family}_depth": -1.0}
    return {**drawn, SEED: float(rng.integers(1, SEEDS + 1))}


# --- folds at rest --------------------------------------------------------------------------------

# Folds that an old face has without any expression: name -> its family, the groups whose default
# lines they are, and their depth as a share of theirs.
REST: dict[str, tuple[str, tuple[str, ...], float]] = {
    "worry": ("worry", ("worry",), 0.35),
    "glabella": ("glabella", ("glabella",), 0.35),
    "crow": ("crow", ("crow_down", "crow_up", "under_eye"), 0.45),
    "nasolabial": ("nasolabial", ("nasolabial",), 0.75),
    "marionette": ("corner", ("marionette",), 0.7),
}
REST_AGE = 0.3  # from which age on: 45 years


def _rest(name: str, side: str, known: Mapping[str, float]) -> float:
    """How deep a fold is at rest: 1 in a very old face."""
    old = min(max((known.get("age", 0.0) - REST_AGE) / (1 - REST_AGE), 0.0), 1.0)
    old *= known.get("age_shows", 1.0) * (1 + known.get("wrinkles", 0.0))
    if old == 0:
        return 0.0
    depth, skew = (known.get(f"{REST[name][0]}_{trait}", 0.0) for trait in ("depth", "skew"))
    deep = 1 + depth if depth < 0 else 1 + DEEPER * depth
    return float(old * deep * (1 + SKEWED * (skew if side == "left" else -skew)))


# Name -> its weight for a person, all of whose parameters are given (see identity.DETAILS).
REST_FOLDS: dict[str, Callable[[Mapping[str, float]], float]] = {
    f"rest {name} {side}": partial(_rest, name, side) for name in REST for side in SIDES
}
