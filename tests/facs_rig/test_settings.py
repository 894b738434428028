"""Settings: fields that say what they are called and which values they take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from facs_rig.common.errors import InputError
from facs_rig.common.settings import check_settings, describe, setting, settings_of


@dataclass
class Pen:
    """Two numbers, a choice, a switch, and a field that is no setting."""

    width: float = setting(1.0, "Width", "How wide it is", "mm", above=0.0, maximum=5.0)
    passes: int = setting(1, minimum=1, maximum=6)
    kind: str = setting("ink", "Kind", choices=("ink", "lead"))
    wet: bool = setting(False, "Wet")
    owner: str = "nobody"

    def __post_init__(self) -> None:
        check_settings(self, "a pen's ")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"width": 0.0}, "Width (width) is more than 0 and at most 5 mm, not 0."),
        ({"width": 6}, "Width (width) is more than 0 and at most 5 mm, not 6."),
        ({"width": float("nan")}, "Width (width) is a number, not nan."),
        ({"width": "much"}, "Width (width) is a number, not 'much'."),
        ({"width": True}, "Width (width) is a number, not True."),
        ({"passes": 7}, "a pen's passes lies between 1 and 6, not at 7."),
        ({"passes": 1.5}, "a pen's passes is a whole number, not 1.5."),
        ({"kind": "chalk"}, "Kind (kind) is one of ink, lead, not 'chalk'."),
        ({"wet": 1}, "Wet (wet) is either true or false, not 1."),
    ],
)
def test_a_value_that_a_setting_does_not_take_is_one_sentence(change, sentence):
    with pytest.raises(InputError) as caught:
        Pen(**change)
    assert str(caught.value) == sentence


def test_numbers_of_numpy_are_numbers_and_other_fields_are_anything():
    pen = Pen(width=np.float32(0.5), passes=np.int64(6), owner=7)
    assert pen.width == 0.5 and pen.passes == 6


def test_settings_are_told_in_their_order_with_defaults():
    assert list(settings_of(Pen)) == ["width", "passes", "kind", "wet"]
    told = [(name, kind, default) for name, kind, default, _ in describe(Pen)]
    assert told == [("width", float, 1.0), ("passes", int, 1), ("kind", str, "ink"),
                    ("wet", bool, False)]  # fmt: skip
