"""Caricature: somebody's features, expression and skin taken further from the plain face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .controls import MAX_INTENSITY
from .identity import ASYMMETRY, FEATURES
from .parameters import FaceParameters

__all__ = ["exaggerated"]


def exaggerated(
    parameters: FaceParameters, offsets: NDArray[np.floating], much: float
) -> tuple[FaceParameters, NDArray[np.floating]]:
    """A face whose difference from a plain one of its sex, age and origin is `much` times as large.

    offsets : (n, 3) metres, of its skin;  much : 0 is the plain face at rest, 1 as it is, 2 twice
    as much of everything (Brennan 1985, "Caricature Generator", Leonardo 18: the difference from
    the mean, scaled)

    Features go as far as those of stylised people, actions to the most that a face can do.
    """
    if much == 1:
        return parameters, offsets
    identity = dict(parameters.identity)
    for feature in (*FEATURES, *ASYMMETRY):
        if feature.name in identity:
            low, high = feature.span
            identity[feature.name] = float(np.clip(much * identity[feature.name], low, high))
    aus = {name: min(much * value, MAX_INTENSITY) for name, value in parameters.aus.items()}
    return replace(parameters, identity=identity, aus=aus), offsets * offsets.dtype.type(much)
