"""How a person's own keys differ from the default person's: how much of each variant is in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from .actions import action_weights
from .folds import groove_weights

# What asks an identity how much it has of the variants that it knows, by their names.
SOURCES: tuple[Callable[[Mapping[str, float]], Mapping[str, float]], ...] = (
    action_weights,
    groove_weights,
)


def variant_weights(identity: Mapping[str, float], names: Sequence[str]) -> NDArray[np.float64]:
    """(names,) how much of each variant a person has; 0 all over for the default person."""
    found: dict[str, float] = {}
    for source in SOURCES:
        found |= source(identity)
    if not found:
        return np.zeros(len(names))
    return np.array([found.get(name, 0.0) for name in names])
