"""The tables of controls and identity parameters."""

from collections import Counter

import numpy as np
import pytest

from facs_rig import CONTROL_NAMES, CONTROLS, IDENTITY, TWELVE
from facs_rig.identity import FEATURES, macro_targets, target_weights

# Rows of the thesis' table of face actions: muscle group's AUs, a-d variants written out.
THESIS_UNITS = {
    "1", "2", "4", "6", "44", "9", "10", "12", "14", "15", "16", "17", "18", "20", "22a", "22b",
    "22c", "28a", "28b", "28c", "24a", "24b", "24c", "26a", "26b", "26c", "26d", "5",
}  # fmt: skip


def test_forty_seven_controls_in_the_thesis_three_regions():
    assert len(CONTROLS) == len(set(CONTROL_NAMES)) == 47
    assert Counter(c.region for c in CONTROLS) == {"upper": 12, "mid": 11, "lower": 24}


def test_every_action_of_the_thesis_table_is_there():
    assert {unit for c in CONTROLS for unit in c.aus} >= THESIS_UNITS


def test_the_twelve_that_are_detected_are_controls_with_creases():
    assert len(TWELVE) == 12
    by_name = {c.name: c for c in CONTROLS}
    assert all(by_name[name].creases for name in TWELVE)


def test_one_sided_controls_come_in_pairs_with_a_symmetric_one():
    for c in CONTROLS:
        if c.side == "both" or c.name.startswith("jaw_"):
            continue
        stem, side = c.name.rsplit("_", 1)
        assert side == c.side
        assert {stem, f"{stem}_left", f"{stem}_right"} <= set(CONTROL_NAMES)


def test_at_least_thirty_features_besides_gender_age_ethnicity_weight():
    names = [f.name for f in IDENTITY]
    assert len(names) == len(set(names))
    assert {"gender", "age", "weight", "african", "asian", "caucasian"} <= set(names)
    assert len(FEATURES) >= 30


@pytest.mark.parametrize("gender", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("age", [-1.0, -0.4, 0.0, 0.7])
@pytest.mark.parametrize("weight", [-1.0, 0.4])
def test_macro_weights_are_shares(gender, age, weight):
    weights = target_weights({"gender": gender, "age": age, "weight": weight, "asian": 0.9})
    macro = weights[: len(macro_targets())]
    assert (macro >= 0).all()
    assert macro[:18].sum() == pytest.approx(1)  # gender x age x ethnicity
    assert macro[18:36].sum() == pytest.approx(1)  # gender x age x weight


def test_a_feature_uses_one_of_its_two_ends():
    up, down = (target_weights({"nose_hump": v}) - target_weights({}) for v in (0.5, -0.5))
    assert np.count_nonzero(up) == np.count_nonzero(down) == 1
    assert up.max() == down.max() == 0.5


def test_unknown_identity_is_named():
    with pytest.raises(ValueError, match="no identity parameter 'nose_ring'"):
        target_weights({"nose_ring": 1.0})
