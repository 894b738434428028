"""From logits to decisions: what the exported networks need beside their weights."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..detector import Reading
from . import metrics
from .targets import Targets

# A unit is called active where what is seen is so many times as likely with it as without. 1 gives
# the highest balanced accuracy, and a face full of actions that nobody drew; 3 has a third of those
# false alarms, for one or two points of balanced accuracy. See docs/detectors.md.
LIKELIHOOD_RATIO = 3.0
# But never where it is clearly less likely than not: of a rare action that is hard to see, three
# times a little is little, and a face wears whatever is called active.
LEAST = 0.3


def calibrate(
    aus: Sequence[str], readings: Sequence[Reading], targets: Targets, faceless_logits: NDArray
) -> dict[str, Any]:
    """What makes probabilities and decisions of the units' logits, and a probability of the face's.

    The probability of a unit is sigmoid(logit / temperature + offset), from `metrics.platt`, and
    its threshold follows from `LIKELIHOOD_RATIO` and `LEAST`; that of a face is sigmoid(logit /
    temperature).
    """
    logits = np.array([reading.logits for reading in readings])
    fits = {name: metrics.platt(targets.active[:, k], logits[:, k]) for k, name in enumerate(aus)}
    faces = np.array([reading.face for reading in readings])
    truth = np.concatenate([np.ones(len(faces)), np.zeros(len(faceless_logits))])
    face_temperature = metrics.best_temperature(truth, np.concatenate([faces, faceless_logits]))
    return {
        "temperatures": {name: temperature for name, (temperature, _) in fits.items()},
        "offsets": {name: offset for name, (_, offset) in fits.items()},
        "thresholds": {
            name: max(LEAST, metrics.threshold(targets.active[:, k], LIKELIHOOD_RATIO))
            for k, name in enumerate(aus)
        },
        "evidence": LIKELIHOOD_RATIO,
        "least": LEAST,
        "face_temperature": max(face_temperature, 0.5),
    }


def person_spreads(readings: Sequence[Reading], targets: Targets) -> list[float]:
    """(p,) what the spreads of the person's parameters are to be multiplied by to be true."""
    person = np.array([reading.person for reading in readings])
    off = (person[:, :, 0] - targets.person) / np.exp(person[:, :, 1])
    known = ~np.isnan(off)
    mean = np.where(known, np.square(np.nan_to_num(off)), 0).sum(axis=0)
    return np.sqrt(mean / np.maximum(known.sum(axis=0), 1)).clip(0.1, 10).tolist()
