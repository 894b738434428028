"""One expression, said once: what becomes of detected controls that cannot all be meant.

The networks answer for each control by itself, so that one line may be told in two ways. Three
rules, in this order:

1. **Sides.** Of a left and a right version that are both active the less likely yields, if it is
   less likely than not: the action is one-sided. Otherwise it is one action seen on both sides,
   and what both sides share belongs to the symmetric control, the rest to its side
   (`labels.resolve_sides`), as in the labels of the training.
2. **Opposites.** Of two actions that pull one part in contrary directions only the likelier stays.
3. **Rivals.** Of two actions that are drawn with the same lines the less likely yields, if it is
   less likely than not: one explanation where one is enough.

Rules 2 and 3 go from the likeliest control down: each stays unless one that stayed excludes it, so
that nothing yields to what has itself yielded. The order of the names never matters, a mirrored
detection is settled to the mirrored result, and settling twice changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import groupby

from .labels import ACTIVE, FULL, resolve_sides

DOUBTFUL = 0.5  # below this a control is less likely than not

# Versions of a control; two versions concern the same part unless they name different ones.
VERSIONS = ("", "_left", "_right", "_upper", "_lower")

OPPOSITES = (
    ("lid_raise", "blink"),  # lids wide open, lids shut
    ("cheek_puff", "cheek_suck"),
    ("nostril_flare", "nostril_compress"),
    ("jaw_left", "jaw_right"),
    ("lip_lock", "jaw_open"),  # lips pressed together, mouth open
    ("lip_lock", "lip_loosen"),  # pressed together, funnelled apart
    ("lip_tighten", "lip_loosen"),  # rolled in, turned out
    ("shrug", "lower_lip_depress"),  # lower lip pushed up, pulled down
)

RIVALS = (
    ("frontalis", "medialis_frontalis"),  # worry lines: across the forehead, in its middle
    ("frontalis", "outer_frontalis"),
    ("wince", "sneer"),  # folds beside the nose and the wings
    ("sneer", "nasolabial_deepen"),  # the same fold, from its top or in its middle
    ("pucker", "purse"),  # short lines around a narrowed mouth
    ("lip_lock", "lip_tighten"),  # lips that are a single line
    # One lip, or both.
    ("lip_loosen", "lip_loosen_upper"),
    ("lip_loosen", "lip_loosen_lower"),
    ("lip_lock", "lip_lock_upper"),
    ("lip_lock", "lip_lock_lower"),
    ("lip_tighten", "lip_tighten_upper"),
    ("lip_tighten", "lip_tighten_lower"),
)

Pairs = frozenset[frozenset[str]]


def _pairs(table: Iterable[tuple[str, str]]) -> Pairs:
    """All versions of the table's pairs that concern the same part of the face."""
    return frozenset(
        frozenset((one + a, other + b))
        for one, other in table
        for a in VERSIONS
        for b in VERSIONS
        if a == b or not (a and b)
    )


_OPPOSITES, _RIVALS = _pairs(OPPOSITES), _pairs(RIVALS)


def resolve(
    intensities: Mapping[str, float], probabilities: Mapping[str, float]
) -> dict[str, float]:
    """Apply the three rules to a detection.

    intensities : control name -> 0 if it is not active, else `ACTIVE` to `FULL`
    probabilities : the same names -> how probable it is that the control is active, 0..1

    -> the same names with what is left of their intensities. Nothing becomes active that was not,
    except a symmetric control whose two sides were.
    """
    settled = shared(one_sided(intensities, probabilities))
    kept = likeliest([name for name in settled if settled[name]], beliefs(probabilities))
    return {name: value if name in kept else 0.0 for name, value in settled.items()}


def one_sided(
    intensities: Mapping[str, float], probabilities: Mapping[str, float]
) -> dict[str, float]:
    """Of a left and a right control that are both active keep the likelier, if one is in doubt.

    Where both are as likely as each other both stay, however doubtful.
    """
    kept = dict(intensities)
    for left, right in _sides(intensities):
        if kept[left] and kept[right] and probabilities[left] != probabilities[right]:
            doubtful = min(left, right, key=probabilities.__getitem__)
            if probabilities[doubtful] < DOUBTFUL:
                kept[doubtful] = 0.0
    return kept


def shared(intensities: Mapping[str, float]) -> dict[str, float]:
    """What both sides share to the symmetric control, the rest to its side.

    No side is carried beyond a full natural activation by the sum of the two, and what is left of
    a side under `ACTIVE` is dropped.
    """
    settled = resolve_sides(intensities)
    for left, right in _sides(intensities):
        name = left.removesuffix("_left")
        if name in settled:
            settled[name] = min(settled[name], FULL)
            for side in (left, right):
                rest = min(settled[side], FULL - settled[name])
                settled[side] = rest if rest >= ACTIVE else 0.0
    return settled


def beliefs(probabilities: Mapping[str, float]) -> dict[str, float]:
    """How likely each control is, where both sides of one speak for it as well."""
    believed = dict(probabilities)
    for left, right in _sides(probabilities):
        name = left.removesuffix("_left")
        if name in believed:
            both = min(probabilities[left], probabilities[right])
            believed[name] = max(believed[name], both)
    return believed


def likeliest(active: Iterable[str], probabilities: Mapping[str, float]) -> set[str]:
    """Those of the active controls that no likelier opposite or rival excludes.

    Opposites that are exactly as likely as each other cancel out.
    """
    kept: list[str] = []
    order = sorted(active, key=probabilities.__getitem__, reverse=True)
    for probability, group in groupby(order, probabilities.__getitem__):
        excluding = _OPPOSITES | _RIVALS if probability < DOUBTFUL else _OPPOSITES
        equals = [n for n in group if not any(frozenset((n, k)) in excluding for k in kept)]
        kept += [n for n in equals if not any(frozenset((n, e)) in _OPPOSITES for e in equals)]
    return set(kept)


def _sides(names: Iterable[str]) -> list[tuple[str, str]]:
    """The pairs NAME_left, NAME_right of which both are there and one is not the other's contrary.

    The jaw goes to one side or the other: it has no symmetric version and is left to rule 2.
    """
    there = set(names)
    lefts = sorted(name for name in there if name.endswith("_left"))
    pairs = [(left, left.removesuffix("_left") + "_right") for left in lefts]
    return [pair for pair in pairs if pair[1] in there and frozenset(pair) not in _OPPOSITES]
