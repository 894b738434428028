"""Figures against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers.training import metrics


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


def balanced(truth, said):
    return metrics.rates(truth, said)["balanced_accuracy"]


def test_the_threshold_for_even_evidence_has_the_best_balanced_accuracy(rng):
    truth = (rng.random(40000) < 0.1).astype(float)
    logit = rng.normal(2 * truth - 1, 1)  # log of the likelihoods' ratio: twice the value
    probability = metrics.sigmoid(2 * logit + np.log(0.1 / 0.9))
    even = balanced(truth, probability >= metrics.threshold(truth, 1.0))
    best = max(balanced(truth, probability >= t) for t in np.linspace(0.005, 0.6, 200))
    assert even == pytest.approx(best, abs=0.003)
    assert metrics.threshold(truth, 1.0) == pytest.approx(truth.mean())


def test_more_evidence_means_fewer_false_alarms(rng):
    truth = (rng.random(20000) < 0.1).astype(float)
    probability = metrics.sigmoid(2 * rng.normal(2 * truth - 1, 1) + np.log(0.1 / 0.9))
    alarms = [
        np.mean(probability[truth == 0] >= metrics.threshold(truth, evidence))
        for evidence in (1.0, 2.0, 3.0, 5.0)
    ]
    assert np.all(np.diff(alarms) < -0.01)
    # where the ratio of likelihoods is 3, the probability is 3 times the odds of the base rate
    share = truth.mean()
    odds = 3 * share / (1 - share)
    assert metrics.threshold(truth, 3.0) == pytest.approx(odds / (1 + odds))
    for one_kind in (np.zeros(5), np.ones(5), np.full(5, np.nan)):
        assert metrics.threshold(one_kind, 3.0) == 0.5


def test_temperature_takes_overconfidence_away(rng):
    logit = rng.normal(0, 2, 20000)
    truth = (rng.random(20000) < metrics.sigmoid(logit)).astype(float)
    assert metrics.best_temperature(truth, logit * 3) == pytest.approx(3, rel=0.06)
    honest = metrics.calibration_error(truth, metrics.sigmoid(logit))
    boastful = metrics.calibration_error(truth, metrics.sigmoid(logit * 3))
    assert honest < 0.01 < 0.05 < boastful


def test_platt_mends_a_slope_and_a_shift(rng):
    logit = rng.normal(0, 2, 20000)
    truth = (rng.random(20000) < metrics.sigmoid(logit)).astype(float)
    truth[:100] = np.nan
    temperature, offset = metrics.platt(truth, 3 * logit + 4)
    assert temperature == pytest.approx(3, rel=0.06) and offset == pytest.approx(-4 / 3, abs=0.06)
    mended = metrics.calibration_error(
        truth, metrics.sigmoid((3 * logit + 4) / temperature + offset)
    )
    one = metrics.best_temperature(truth, 3 * logit + 4)
    assert mended < 0.01 < metrics.calibration_error(truth, metrics.sigmoid((3 * logit + 4) / one))


def test_platt_is_the_least_cross_entropy(rng):
    """Against a search by another method, with Platt's own targets."""
    from scipy.optimize import minimize

    truth = (rng.random(300) < 0.3).astype(float)
    logit = rng.normal(3 * truth - 4, 2)
    yes, no = truth.sum(), (truth == 0).sum()
    target = np.where(truth == 1, (yes + 1) / (yes + 2), 1 / (no + 2))

    def loss(weights):
        z = weights[0] * logit + weights[1]
        return np.sum(np.logaddexp(0, z) - target * z)

    found = minimize(loss, (1.0, 0.0), method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-9})
    temperature, offset = metrics.platt(truth, logit)
    assert (1 / temperature, offset) == pytest.approx(tuple(found.x), abs=1e-4)


def test_platt_stays_finite_where_nothing_is_in_doubt(rng):
    logit = np.concatenate([rng.uniform(1, 9, 50), rng.uniform(-9, -1, 200)])
    truth = (logit > 0).astype(float)
    temperature, offset = metrics.platt(truth, 100 * logit)
    assert metrics.TEMPERATURES[0] <= temperature <= metrics.TEMPERATURES[-1] + 1e-9
    assert np.isfinite(offset)
    probability = metrics.sigmoid(100 * logit / temperature + offset)
    assert np.all((probability > 0.5) == (truth == 1))
    # a detector that is wrong throughout must not be turned around: it then says the base rate
    temperature, offset = metrics.platt(1 - truth, logit)
    assert temperature == pytest.approx(metrics.TEMPERATURES[-1])
    assert metrics.platt(np.ones(4), logit[:4]) == (1.0, 0.0)
