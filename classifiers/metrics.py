"""How good a yes/no detector is, and how honest its probabilities are: plain numpy on (n,) arrays.

In all of them `truth` holds 1 (yes), 0 (no) or nan (not counted), `probability` 0..1 and `logit`
any number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TEMPERATURES = np.exp(np.linspace(np.log(0.2), np.log(8), 200))


def counted(truth: NDArray, *others: NDArray) -> tuple[NDArray, ...]:
    """Only the samples whose truth is known."""
    known = ~np.isnan(truth)
    return (truth[known] > 0.5, *(other[known] for other in others))


def sigmoid(logit: NDArray) -> NDArray[np.float64]:
    """The softmax of two logits depends on their difference alone: 1 / (1 + exp(-difference))."""
    logit = np.clip(np.asarray(logit, float), -60, 60)
    return 1 / (1 + np.exp(-logit))


def auc(truth: NDArray, score: NDArray) -> float:
    """Area under the ROC curve: how often a yes scores above a no (Mann-Whitney, ties half)."""
    yes, score = counted(truth, score)
    if yes.all() or not yes.any():
        return float("nan")
    _, place, count = np.unique(score, return_inverse=True, return_counts=True)
    rank = (np.cumsum(count) - (count - 1) / 2)[place]  # mean rank of equal scores, from 1
    n = int(yes.sum())
    return float((rank[yes].sum() - n * (n + 1) / 2) / (n * (len(yes) - n)))


def confusion(truth: NDArray, predicted: NDArray) -> tuple[int, int, int, int]:
    """True positives, false positives, true negatives, false negatives."""
    yes, said = counted(truth, np.asarray(predicted, bool))
    return (
        int((yes & said).sum()),
        int((~yes & said).sum()),
        int((~yes & ~said).sum()),
        int((yes & ~said).sum()),
    )


def rates(truth: NDArray, predicted: NDArray) -> dict[str, float]:
    """accuracy, balanced_accuracy (mean of the hit rates of yes and no), f1."""
    tp, fp, tn, fn = confusion(truth, predicted)
    with np.errstate(invalid="ignore"):
        hits = np.divide(
            [tp, tn],
            [tp + fn, tn + fp],
            out=np.full(2, np.nan),
            where=np.array([tp + fn, tn + fp]) > 0,
        )
    return {
        "accuracy": (tp + tn) / max(tp + fp + tn + fn, 1),
        "balanced_accuracy": float(np.mean(hits)),
        "f1": 2 * tp / max(2 * tp + fp + fn, 1),
    }


def best_threshold(truth: NDArray, probability: NDArray) -> float:
    """The threshold with the highest F1; of equal ones the highest.

    F1 and not balanced accuracy: actions are rare, and an expression that is full of false alarms
    disturbs an artist more than a faint action overlooked. In the middle of the gap between two
    samples; 0.5 if the truth is all yes or all no.
    """
    yes, probability = counted(truth, probability)
    if not len(yes) or yes.all() or not yes.any():
        return 0.5
    order = np.argsort(probability)
    yes, probability = yes[order], probability[order]
    # Cutting before sample k calls k, k+1, ... yes.
    hits = yes.sum() - np.concatenate([[0], np.cumsum(yes)])
    called = len(yes) - np.arange(len(yes) + 1)
    edges = np.concatenate([[0.0], (probability[1:] + probability[:-1]) / 2, [1.0]])
    usable = np.concatenate([[True], probability[1:] > probability[:-1], [True]])
    f1 = np.where(usable, 2 * hits / (called + yes.sum()), -1)
    return float(edges[np.flatnonzero(f1 == f1.max())[-1]])


def calibration_error(truth: NDArray, probability: NDArray, bins: int = 15) -> float:
    """Expected calibration error: |how often it is yes - how probable it was said to be|, averaged.

    Over equal bins of the probability of yes (Naeini et al. 2015, AAAI).
    """
    yes, probability = counted(truth, probability)
    if not len(yes):
        return float("nan")
    place = np.minimum((probability * bins).astype(int), bins - 1)
    gap = np.bincount(place, yes, bins) - np.bincount(place, probability, bins)
    return float(np.abs(gap).sum() / len(yes))


def best_temperature(truth: NDArray, logit: NDArray) -> float:
    """The T whose sigmoid(logit / T) has the lowest cross-entropy (Guo et al. 2017, ICML)."""
    yes, logit = counted(truth, logit)
    if not len(yes):
        return 1.0
    signed = np.where(yes, -logit, logit)  # cross-entropy of one sample: log(1 + exp(signed / T))
    loss = np.logaddexp(0, signed[None] / TEMPERATURES[:, None]).mean(axis=1)
    return float(TEMPERATURES[int(np.argmin(loss))])
