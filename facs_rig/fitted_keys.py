"""What a drawing shows of a face beyond person and actions: at rest, and with its expression.

The fitted offsets of a face are all that its lines ask for beyond what the parameters give. Some of
it is the person's and stays at rest; the rest belongs to the actions that were drawn, which nobody
does just as the rig does, and comes and goes with them: one key for each region of the face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .controls import MAX_INTENSITY, REGIONS
from .mesh import is_shape

__all__ = ["FITTED", "FITTED_REGIONS", "FittedKey", "offsets_at"]

FITTED = "Fitted"
"""The key of what stays at rest; no other goes on farther than it."""
FITTED_REGIONS = {region: f"{FITTED}_{region}" for region in REGIONS}
"""Region of the controls -> the name of the key that comes and goes with its drawn actions."""
DIGITS = 4


@dataclass(frozen=True)
class FittedKey:
    """A shape key that is fully on when the actions of a drawing are as strong as there.

    name : of FITTED_REGIONS
    offsets : (n, 3) float32, metres, head upright, when fully on
    shares : control -> how much of the key it brings, in all 1
    drawn : the same controls -> the intensity from which on it brings all that, above 0
    """

    name: str
    offsets: NDArray[np.float32]
    shares: Mapping[str, float]
    drawn: Mapping[str, float]

    def value(self, aus: Mapping[str, float]) -> float:
        """How far these intensities turn it on, 0..1."""
        return sum(
            share * min(aus.get(name, 0.0) / self.drawn[name], 1.0)
            for name, share in self.shares.items()
        )

    @property
    def expression(self) -> str:
        """The same in Blender's driver language (see facs_rig.keys).

        An action brings as much as it is stronger than drawn, but no more than the key FITTED is
        on, and so much when it is at its most: a caricature, which takes FITTED and all actions
        further, takes what goes with them just as far.
        """
        return "+".join(
            f"{share:.{DIGITS}f}*min(max({name}/{self.drawn[name]:.{DIGITS}f},"
            f"{name}*{FITTED}/{MAX_INTENSITY:g}),{FITTED})"
            for name, share in self.shares.items()
        )

    def exaggerated(self, much: float) -> FittedKey:
        """The key of a face whose actions and offsets are `much` times as large; much > 0."""
        drawn = {name: min(much * value, MAX_INTENSITY) for name, value in self.drawn.items()}
        return replace(self, offsets=np.float32(much) * self.offsets, drawn=drawn)


def offsets_at(
    offsets: NDArray[np.floating], keys: Sequence[FittedKey], aus: Mapping[str, float]
) -> NDArray[np.floating]:
    """The offsets (n, 3) that a fitted face has with other intensities than those drawn.

    offsets : (n, 3) metres, as drawn, where all keys are on
    """
    out = offsets
    for key in keys:
        is_shape(key.offsets, np.shape(offsets), key.name)
        if off := 1.0 - key.value(aus):
            out = out - np.float32(off) * key.offsets
    return out
