"""How good a yes/no detector is, and how honest its probabilities are: plain numpy on (n,) arrays.

In all of them `truth` holds 1 (yes), 0 (no) or nan (not counted), `probability` 0..1 and `logit`
any number.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..runtime import sigmoid

TEMPERATURES = np.exp(np.linspace(np.log(0.2), np.log(8), 200))


def counted(truth: NDArray, *others: NDArray) -> tuple[NDArray, ...]:
    """Only the samples whose truth is known."""
    known = ~np.isnan(truth)
    return (truth[known] > 0.5, *(other[known] for other in others))


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


def threshold(truth: NDArray, evidence: float) -> float:
    """The probability from which a calibrated detector says yes; 0.5 if the truth is all one kind.

    What is seen must be `evidence` times as likely with the action as without it (the test of
    Neyman & Pearson 1933). With 1 the balanced accuracy is the highest; with more each false alarm
    that is saved costs the least of it. It needs only the share of yes, which few samples tell.
    """
    (yes,) = counted(truth)
    if not len(yes) or yes.all() or not yes.any():
        return 0.5
    share = float(yes.mean())
    return evidence * share / (1 - share + evidence * share)


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


def platt(truth: NDArray, logit: NDArray) -> tuple[float, float]:
    """Temperature T and offset b whose sigmoid(logit / T + b) has the lowest cross-entropy.

    Platt 1999, "Probabilistic Outputs for Support Vector Machines": a logistic regression on one
    number, by Newton's method. The truth is drawn toward its doubt as if one more sample of each
    kind had been seen, so that what is told apart without a fault does not become certain. (1, 0)
    if the truth is all yes or all no. A slope that is not positive, or beyond `TEMPERATURES`,
    becomes the nearest that is allowed, with its own best offset.
    """
    yes, logit = counted(truth, logit)
    if not len(yes) or yes.all() or not yes.any():
        return 1.0, 0.0
    target = np.where(yes, (yes.sum() + 1) / (yes.sum() + 2), 1 / ((~yes).sum() + 2))
    slope, offset = _logistic(np.stack([logit, np.ones_like(logit)]), target)
    allowed = float(np.clip(slope, 1 / TEMPERATURES[-1], 1 / TEMPERATURES[0]))
    if allowed != slope:
        (offset,) = _logistic(np.ones((1, len(logit))), target, allowed * logit)
    return 1 / allowed, float(offset)


def _logistic(columns: NDArray, target: NDArray, fixed: NDArray | float = 0.0) -> NDArray:
    """The weights (k,) of columns (k, n) whose sigmoid(fixed + weights @ columns) fits target."""

    def loss(weights: NDArray) -> float:
        logit = fixed + weights @ columns
        return float((np.logaddexp(0, logit) - target * logit).sum())

    weights = np.zeros(len(columns))
    best = loss(weights)
    for _ in range(100):
        said = sigmoid(fixed + weights @ columns)
        curvature = (columns * np.maximum(said * (1 - said), 1e-9)) @ columns.T
        step = np.linalg.solve(curvature, columns @ (target - said))
        while loss(weights + step) > best and np.abs(step).max() > 1e-9:
            step = step / 2
        weights = weights + step
        best = loss(weights)
        if np.abs(step).max() < 1e-9:
            break
    return weights
