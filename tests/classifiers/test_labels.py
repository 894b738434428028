"""Left and right."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from classifiers.conflicts import shared
from classifiers.labels import (
    ACTIVE,
    FULL,
    mirror_order,
    mirrored_name,
    resolve_sides,
)
from facs_rig import CONTROL_NAMES, LANDMARKS, TWELVE

GRIMACES = ("grimace", "grimace_left", "grimace_right")
intensity = st.floats(0, 10)
detected = st.one_of(st.just(0.0), st.floats(ACTIVE, FULL))


def sides(aus):
    return aus["grimace"] + aus["grimace_left"], aus["grimace"] + aus["grimace_right"]


@given(intensity, intensity, intensity)
def test_the_common_part_goes_to_the_symmetric_control_and_the_rest_to_its_side(both, left, right):
    before = dict(zip(GRIMACES, (both, left, right), strict=True))
    after = resolve_sides(before)
    assert sides(after) == pytest.approx(sides(before))
    assert min(after["grimace_left"], after["grimace_right"]) == 0
    assert min(after.values()) >= 0
    assert resolve_sides(after) == after


def test_one_grimace_said_in_two_ways_is_one():
    a = resolve_sides({"grimace": 2.0, "grimace_left": 3.0, "grimace_right": 0.0})
    b = resolve_sides({"grimace": 0.0, "grimace_left": 5.0, "grimace_right": 2.0})
    assert a == b == {"grimace": 2.0, "grimace_left": 3.0, "grimace_right": 0.0}


@given(detected, detected, detected)
def test_detected_grimaces_never_stack(both, left, right):
    found = shared(dict(zip(GRIMACES, (both, left, right), strict=True)))
    assert max(sides(found)) <= FULL + 1e-9
    assert found["grimace_left"] == 0 or found["grimace_right"] == 0
    assert all(value == 0 or ACTIVE <= value <= FULL for value in found.values())
    assert shared(found) == found
    if left and right:
        assert found["grimace"] >= min(left, right)


def test_mirroring_names_twice_is_the_identity():
    for names in (TWELVE, LANDMARKS, CONTROL_NAMES):
        order = mirror_order(names)
        np.testing.assert_array_equal(order[order], np.arange(len(names)))
        assert any(order != np.arange(len(names)))
    assert mirrored_name("grimace_left") == "grimace_right"
    assert mirrored_name("smile") == "smile"
    with pytest.raises(ValueError, match="no counterpart"):
        mirror_order(["smile", "smile_left"])
