"""The variants of keys, by which people differ in what they do (see facs_rig.motions)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..keys import Key
from ..moves import FINEST, packed

CAGE_STEP = 2.0**-17  # metres: people's ways are known to 4 micrometres


@dataclass(frozen=True)
class Variant:
    """moves : (M, 3) of the cage or (n, 3) of the fine skin, metres that a person who has all of
    it differs by from the default person when the key called `parent` is at 1"""

    name: str
    parent: str
    moves: NDArray[np.float64]


def variant_arrays(
    keys: Sequence[Key],
    cage: Sequence[Variant],
    skin: Sequence[Variant],
    shapes: tuple[int, int],
    upright: NDArray,
) -> dict[str, NDArray]:
    """The asset's arrays of the variants.

    keys : all of the rig's;  shapes : (M, n), vertices of cage and fine mesh;
    upright : (3, 3) to the rig's frame
    """
    number = {key.name: k for k, key in enumerate(keys)}
    arrays = {
        "variant_names": np.array([v.name for v in (*cage, *skin)], dtype=str),
        "variant_parents": np.array([number[v.parent] for v in (*cage, *skin)], dtype=np.int32),
    }
    kinds = ("cage", cage, shapes[0], CAGE_STEP), ("skin", skin, shapes[1], FINEST)
    for kind, variants, count, step in kinds:
        moves = [v.moves @ upright for v in variants]
        arrays |= packed(f"{kind}_variants", np.array(moves).reshape(len(moves), count, 3), step)
    return arrays
