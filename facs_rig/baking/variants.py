"""The variants of keys, by which people differ in what they do (see facs_rig.motions)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..keys import Key
from ..moves import packed

CAGE_STEP = 2.0**-17  # metres: people's ways are known to 4 micrometres
SKIN_STEP = 2.0**-19  # metres: and their grooves to one


@dataclass(frozen=True)
class Variant:
    """moves : (M, 3) of the cage or (n, 3) of the fine skin, metres that a person who has all of
    it differs by from the default person when the key called `parent` is at 1"""

    name: str
    parent: str
    moves: NDArray[np.float64]
    mirrored: bool = False


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
        "skin_variants_mirrored": np.array([v.mirrored for v in skin], dtype=bool),
    }
    row: dict[int, int] = {}  # what several share, or the mirror image of, is kept once
    rows = [row.setdefault(id(v.moves), len(row)) for v in skin]
    arrays["skin_variants_row"] = np.array(rows, dtype=np.int32)
    kept = {id(v.moves): v.moves for v in skin}
    for kind, moves, count, step in (
        ("cage", [v.moves for v in cage], shapes[0], CAGE_STEP),
        ("skin", list(kept.values()), shapes[1], SKIN_STEP),
    ):
        stack = np.array([move @ upright for move in moves]).reshape(len(moves), count, 3)
        arrays |= packed(f"{kind}_variants", stack, step)
    return arrays
