"""The table of tweakable values: the thesis' defaults, and one sentence for each bad value."""

from __future__ import annotations

import pytest

from snakes import WORKING_SIZE, Tweakables, describe

THESIS = {
    "gap_closing": 2,
    "thinning_iterations": 1,
    "snake_type": "free",
    "smoothness": 1.0,
    "time_stepping": 2.0,
    "max_step": 1.0,
    "max_iterations": 3000,
    "convergence": 0.1,
    "brightness_weight": -5.0,
    "edge_weight": 1.0,
    "max_delta": 15.0,
    "low_depth_preference": 0.0,
    "soft_select_distance": 1.0,
    "soft_select_curve": "linear",
    "symmetry": 0.8,
    "mirror": False,
}
BEYOND = {"soft_select_connected": False}
"""Not in the thesis' table; off, so that the defaults do what the thesis does."""


def test_the_defaults_are_those_of_the_thesis():
    assert {name: default for name, _, default, _ in describe()} == THESIS | BEYOND
    assert WORKING_SIZE == (91, 200)


def test_every_tweakable_describes_itself():
    for name, kind, default, about in describe():
        assert about["label"] and about["help"], name
        if kind in (int, float):
            assert about["minimum"] <= default <= about["maximum"], name
        if kind is str:
            assert default in about["choices"], name


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gap_closing", 0),
        ("gap_closing", 2.5),
        ("thinning_iterations", -1),
        ("snake_type", "loose"),
        ("smoothness", float("nan")),
        ("smoothness", "much"),
        ("time_stepping", 0),
        ("max_step", -1.0),
        ("max_iterations", 0),
        ("convergence", 0.0),
        ("max_delta", float("inf")),
        ("low_depth_preference", 1.5),
        ("soft_select_distance", 0.0),
        ("soft_select_curve", "cubic"),
        ("soft_select_connected", "yes"),
        ("symmetry", 1.1),
        ("mirror", 1),
        ("edge_weight", True),
    ],
)
def test_a_bad_value_gives_one_sentence_that_names_it(name, value):
    with pytest.raises(ValueError, match=name) as failure:
        Tweakables(**{name: value})
    text = str(failure.value)
    assert text.endswith(".") and "\n" not in text and ". " not in text


def test_a_whole_number_will_do_for_a_fraction():
    assert Tweakables(max_delta=10, smoothness=2).max_delta == 10
