"""The weights by which beards are found, and how they are fitted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from snakes.hair import beard_weights
from tests.benchmarks.refit_beard import TEXT, logistic, threshold, write


def test_weights_that_made_the_answers_are_found_again():
    rng = np.random.default_rng(0)
    rows, fixed = rng.normal(size=(20_000, 2)) * (1, 5), rng.normal(size=20_000)
    truth = np.array([1.5, -0.4, 0.7])
    odds = rows @ truth[:2] + truth[2] + fixed
    wanted = rng.uniform(size=len(odds)) < 1 / (1 + np.exp(-odds))
    found = logistic(rows, wanted, np.ones(len(rows)), fixed)
    assert found == pytest.approx(truth, abs=0.1)


@pytest.mark.parametrize("law", ["normal", "exponential", "uniform"])
def test_as_many_are_above_the_threshold_as_are_wanted(law):
    rng = np.random.default_rng(1)
    limits = [threshold(getattr(rng, law)(size=250), 0.01) for _ in range(40)]
    above = (getattr(rng, law)(size=100_000)[:, None] > limits).mean()
    assert above == pytest.approx(0.01, abs=0.004)


def test_the_module_that_is_written_is_the_one_that_is_read(tmp_path):
    names = [name for name in vars(beard_weights) if name.isupper()]
    kept = {name: np.array(getattr(beard_weights, name)) for name in names}
    write(kept, tmp_path / "weights.py")
    assert (tmp_path / "weights.py").read_text() == Path(beard_weights.__file__).read_text()
    assert len(names) == TEXT.count(" = ")
