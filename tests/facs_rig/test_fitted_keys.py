"""Keys of what a drawing shows with its actions: the same value in numpy and in Blender's text."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facs_rig.controls import CONTROL_NAMES, CONTROLS, MAX_INTENSITY, REGIONS
from facs_rig.fitted_keys import FITTED, FITTED_REGIONS, FittedKey, offsets_at
from facs_rig.keys import Key, compile_keys

OFFSETS = np.random.default_rng(0).normal(0, 0.003, (2, 5, 3)).astype(np.float32)
BROWS = FittedKey(FITTED_REGIONS["upper"], OFFSETS[0], {"brow_furrow": 1.0}, {"brow_furrow": 2.5})
MOUTH = FittedKey(
    FITTED_REGIONS["lower"], OFFSETS[1], {"smile": 0.7, "jaw_open": 0.3},
    {"smile": 4.0, "jaw_open": 1.0},
)  # fmt: skip
DRAWN = {"brow_furrow": 2.5, "smile": 4.0, "jaw_open": 1.0}


def by_text(key: FittedKey, aus, fitted: float = 1.0) -> float:
    """What the expression gives where the key FITTED is so far on."""
    values = compile_keys([Key(FITTED, f"{fitted}"), Key(key.name, key.expression)])
    return float(values(dict.fromkeys(CONTROL_NAMES, 0.0) | aus)[1])


def test_every_region_has_a_key_that_blender_can_name():
    assert set(FITTED_REGIONS) == {control.region for control in CONTROLS} == set(REGIONS)
    assert all(name.isidentifier() for name in FITTED_REGIONS.values())


@settings(deadline=None, max_examples=60)
@given(st.fixed_dictionaries({name: st.floats(0, MAX_INTENSITY) for name in DRAWN}))
def test_numpy_and_the_driver_agree_and_stay_between_off_and_on(aus):
    for key in (BROWS, MOUTH):
        assert by_text(key, aus) == pytest.approx(key.value(aus), abs=1e-3)
        assert 0 <= key.value(aus) <= 1


@pytest.mark.parametrize("fitted", [0.0, 0.4, 1.0, 2.0])
def test_no_key_goes_on_farther_than_fitted(fitted):
    assert by_text(MOUTH, dict.fromkeys(DRAWN, MAX_INTENSITY), fitted) == pytest.approx(fitted)
    assert by_text(MOUTH, {}, fitted) == 0


def test_as_drawn_all_is_there_and_at_rest_what_stays():
    whole = OFFSETS.sum(axis=0) + 0.001
    keys = (BROWS, MOUTH)
    assert np.array_equal(offsets_at(whole, keys, DRAWN), whole)
    assert np.allclose(offsets_at(whole, keys, {}), 0.001, atol=1e-8)
    smiling = offsets_at(whole, keys, {"smile": 4.0})
    assert np.allclose(smiling, 0.001 + 0.7 * OFFSETS[1], atol=1e-8)
    assert offsets_at(whole, (), {}) is whole


def test_other_actions_leave_a_region_alone():
    assert BROWS.value({"smile": 9.0}) == 0
    assert MOUTH.value({"brow_furrow": 9.0}) == 0


@pytest.mark.parametrize("much", [0.5, 1.5, 3.0])
def test_of_a_caricature_all_is_on_as_it_is_drawn(much):
    key = MOUTH.exaggerated(much)
    aus = {name: min(much * value, MAX_INTENSITY) for name, value in DRAWN.items()}
    assert key.value(aus) == pytest.approx(1)
    assert np.allclose(key.offsets, much * MOUTH.offsets)


def test_offsets_of_another_mesh_are_refused():
    with pytest.raises(ValueError, match="Fitted_upper must have the shape"):
        offsets_at(np.zeros((4, 3), np.float32), (BROWS,), {})
