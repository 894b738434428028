"""The identities: the cage without them and what each of their targets moves it by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..identity import ETHNICITIES, FEATURES, macro_targets, target_weights
from .makehuman import Source

# The targets of gender, age and ethnicity come first. They are whole faces: base and one of them.
WHOLE_FACES = len(ETHNICITIES) * 4
# The source's teeth shine through the corners of closed lips, and hide behind the upper lip.
TEETH_NARROWER, TEETH_BACK = 0.8, 0.0025  # share; metres
UPPER_TEETH_DOWN, LOWER_TEETH_DOWN = 0.005, 0.003  # metres


@dataclass(frozen=True)
class People:
    """base : (M, 3) metres;  deltas : (targets, M, 3), changed in place while baking."""

    base: NDArray
    deltas: NDArray

    @property
    def plain(self) -> NDArray[np.float64]:
        """(M, 3) the default face."""
        default: NDArray[np.float64] = np.tensordot(target_weights({}), self.deltas, axes=1)
        return self.base + default


def read_people(source: Source) -> People:
    """All identity targets, in the order of `identity.target_weights`."""
    ends = [end for f in FEATURES for end in zip((f.low, f.high), f.reach, strict=True)]
    targets = [*((name, 1.0) for name in macro_targets()), *ends]
    base = source.cage.copy()
    teeth = np.flatnonzero(source.is_part("teeth"))
    middle = (base[teeth, 1].max() + base[teeth, 1].min()) / 2  # between the two rows
    down = np.where(base[teeth, 1] > middle, UPPER_TEETH_DOWN, LOWER_TEETH_DOWN)
    base[teeth] *= (TEETH_NARROWER, 1, 1)
    base[teeth] -= np.column_stack([0 * down, down, 0 * down + TEETH_BACK])
    return People(base, np.stack([reach * source.target(name) for name, reach in targets]))
