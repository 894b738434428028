"""Figures against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers import metrics


def test_auc_is_the_share_of_pairs_in_order(rng):
    truth = (rng.random(60) < 0.4).astype(float)
    score = np.round(rng.normal(truth, 1), 1)  # rounded, so that there are ties
    pairs = score[truth == 1][:, None] - score[truth == 0][None]
    expected = np.mean((pairs > 0) + 0.5 * (pairs == 0))
    assert metrics.auc(truth, score) == pytest.approx(expected)
    truth[:5] = np.nan
    assert metrics.auc(truth, score) == pytest.approx(metrics.auc(truth[5:], score[5:]))
    assert np.isnan(metrics.auc(np.ones(4), score[:4]))


def test_rates():
    truth = np.array([1, 1, 1, 0, 0, np.nan])
    said = np.array([1, 1, 0, 1, 0, 1], bool)
    found = metrics.rates(truth, said)
    assert found["accuracy"] == pytest.approx(3 / 5)
    assert found["balanced_accuracy"] == pytest.approx((2 / 3 + 1 / 2) / 2)
    assert found["f1"] == pytest.approx(4 / 6)


def test_the_best_threshold_is_as_good_as_any(rng):
    truth = (rng.random(200) < 0.2).astype(float)
    probability = metrics.sigmoid(rng.normal(2 * truth - 1, 1))

    def f1(threshold):
        return metrics.rates(truth, probability >= threshold)["f1"]

    best = metrics.best_threshold(truth, probability)
    assert f1(best) == pytest.approx(max(f1(t) for t in np.linspace(0, 1, 2001)))
    assert metrics.best_threshold(np.zeros(5), probability[:5]) == 0.5


def test_temperature_takes_overconfidence_away(rng):
    logit = rng.normal(0, 2, 20000)
    truth = (rng.random(20000) < metrics.sigmoid(logit)).astype(float)
    assert metrics.best_temperature(truth, logit * 3) == pytest.approx(3, rel=0.06)
    honest = metrics.calibration_error(truth, metrics.sigmoid(logit))
    boastful = metrics.calibration_error(truth, metrics.sigmoid(logit * 3))
    assert honest < 0.01 < 0.05 < boastful
