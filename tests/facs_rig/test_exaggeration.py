"""Caricatures: what is special of a face, so many times, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facs_rig import FaceParameters
from facs_rig.exaggeration import exaggerated
from facs_rig.identity import BY_NAME

WHO = {"gender": 0.9, "age": 0.5, "nose_length": 0.4, "jaw_width": -0.3, "ear_size": 0.9,
       "asym_jaw": 0.2}  # fmt: skip


def face():
    offsets = np.random.default_rng(0).normal(0, 1e-3, (20, 3)).astype(np.float32)
    return FaceParameters({"smile": 3.0, "jaw_open": 8.0}, WHO, (0.1, 0.0, 0.0)), offsets


def test_as_it_is_nothing_changes():
    parameters, offsets = face()
    same, still = exaggerated(parameters, offsets, 1.0)
    assert same == parameters and still is offsets


def test_none_of_it_is_a_plain_face_of_the_same_sex_and_age():
    parameters, offsets = exaggerated(*face(), 0.0)
    assert not offsets.any() and not any(parameters.aus.values())
    assert parameters.identity["gender"] == 0.9 and parameters.identity["age"] == 0.5
    assert parameters.identity["nose_length"] == 0.0 and parameters.head == (0.1, 0.0, 0.0)


@given(much=st.floats(0, 3))
def test_it_grows_in_proportion_and_no_further_than_a_face_can(much):
    before, offsets = face()
    after, moved = exaggerated(before, offsets, much)
    np.testing.assert_allclose(moved, much * offsets, rtol=1e-5)
    assert moved.dtype == offsets.dtype
    assert after.aus["smile"] == pytest.approx(3 * much)
    assert after.aus["jaw_open"] == pytest.approx(min(8 * much, 10))
    assert after.identity["nose_length"] == pytest.approx(0.4 * much)
    for name, value in after.identity.items():
        low, high = BY_NAME[name].span
        assert low <= value <= high
