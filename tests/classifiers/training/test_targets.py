"""The way from records to targets."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers.labels import FULL
from classifiers.training.targets import encode, rotated_in_picture
from facs_rig import CONTROL_NAMES, LANDMARKS, TWELVE
from facs_rig.rotation import rotation


def test_turning_the_picture_is_a_rotation_about_the_line_of_sight(rng):
    for _ in range(20):
        angles, turn = rng.normal(0, 0.5, 3), rng.normal(0, 0.4)
        expected = rotation((0, 0, turn)) @ rotation(angles)
        np.testing.assert_allclose(rotation(rotated_in_picture(angles, turn)), expected, atol=1e-9)


def record(**aus):
    return {
        "aus": dict.fromkeys(CONTROL_NAMES, 0.0) | aus,
        "head": {"yaw": 90.0, "pitch": -45.0, "roll": 0.0},
        "landmarks": {name: [i, 2 * i] for i, name in enumerate(LANDMARKS)},
        "index": 3,
    }


def test_records_become_targets():
    targets = encode([record(smile=7.0, sneer=0.5, grimace_left=3.0)], TWELVE, LANDMARKS)
    column = {name: k for k, name in enumerate(TWELVE)}
    assert targets.active[0, column["smile"]] == 1
    assert targets.intensity[0, column["smile"]] == FULL
    assert np.isnan(targets.active[0, column["sneer"]])
    assert targets.active[0, column["grimace_left"]] == 1
    assert targets.active[0, column["grimace"]] == 0
    np.testing.assert_allclose(targets.angles[0], [np.pi / 2, -np.pi / 4, 0], atol=1e-6)
    assert targets.landmarks[0, 5].tolist() == [5, 10]


def test_a_record_that_lacks_something_is_named():
    broken = record()
    del broken["aus"]["smile"]
    with pytest.raises(ValueError, match="Drawing 3 .*'smile'"):
        encode([broken], TWELVE, LANDMARKS)


def test_what_a_convention_hides_is_neither_yes_nor_no_and_landmarks_are_where_they_were_drawn():
    drawn = record(smile=4.0, squint=4.0)
    drawn["hidden"] = ["squint", "wince", "no control"]
    drawn["drawn_landmarks"] = {name: [u + 1, v] for name, (u, v) in drawn["landmarks"].items()}
    targets = encode([drawn, record(squint=4.0)], TWELVE, LANDMARKS)
    squint, wince, smile = (TWELVE.index(name) for name in ("squint", "wince", "smile"))
    assert np.isnan(targets.active[0, [squint, wince]]).all()
    assert targets.active[0, smile] == 1
    assert targets.active[1, [squint, wince]].tolist() == [1, 0]
    np.testing.assert_array_equal(targets.landmarks[0] - targets.landmarks[1], [[1, 0]] * 81)
