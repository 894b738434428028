"""The names that a drawing is labelled with: when a control is active, and left and right.

Left and right. A control with a left and a right version can say one thing in two ways: a grimace
of 2 on top of a left one of 3 is drawn exactly as a right one of 2 beside a left one of 5. One rule
everywhere, in the labels and in what is detected (`resolve_sides`): **what both sides share belongs
to the symmetric control, the rest to its side**, so that at most two of the three are ever active
and none is counted twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from facs_rig.identity import ETHNICITIES, FEATURES

FULL = 5.0  # a full natural activation; intensities are detected from 0 to this
ACTIVE = 1.0  # from here on a control counts as active; between 0 and this it is neither
# What is told of the person: parameters of identity that a mirrored drawing has as well.
PERSON = ("gender", "age", "weight", *ETHNICITIES, *(feature.name for feature in FEATURES))
# What of a drawing is told apart, coarsely; a hat counts as the hair that it hides, and besides.
REGIONS = ("face", "hair", "beard", "hat")


def resolve_sides(aus: Mapping[str, float]) -> dict[str, float]:
    """Apply the rule of left and right to every control that has all three versions.

    aus : control name -> intensity. -> the same names; of NAME, NAME_left and NAME_right the sum on
    each side is kept, the common part stands in NAME and at least one side is 0. Idempotent.
    """
    resolved = dict(aus)
    for name in aus:
        left, right = f"{name}_left", f"{name}_right"
        if left in aus and right in aus:
            common = min(aus[left], aus[right])
            resolved[name] = aus[name] + common
            resolved[left], resolved[right] = aus[left] - common, aus[right] - common
    return resolved


def mirrored_name(name: str) -> str:
    """The name of the same thing in a mirrored drawing: left and right exchanged."""
    swap = {"left": "right", "right": "left", "l": "r", "r": "l"}
    return "_".join(swap.get(word, word) for word in name.split("_"))


def mirror_order(names: Sequence[str]) -> NDArray[np.intp]:
    """Index (n,) such that values[index] are those of the mirrored drawing.

    Raises ValueError if a name has a side but its counterpart is missing.
    """
    places = {name: i for i, name in enumerate(names)}
    for name in names:
        if mirrored_name(name) not in places:
            raise ValueError(
                f"{name} has no counterpart {mirrored_name(name)}: name both sides or neither."
            )
    return np.array([places[mirrored_name(name)] for name in names], np.intp)
