"""A cut takes what it can use and says in a sentence what it cannot."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facs_rig.common.errors import InputError
from facs_rig.hair.cut import ANGLES, AZIMUTHS, Ball, Cut, from_json, mirrored, to_json
from facs_rig.hair.presets import PRESETS, preset

EDGE, THICK = np.full(AZIMUTHS, 0.4), np.full((AZIMUTHS, 4), 0.01)
LINE = np.array([[np.pi, 0.5, 0.0], [np.pi, 0.0, 0.03]])


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ({"edge": EDGE[:-1]}, "48 numbers, got 47"),
        ({"edge": np.where(ANGLES > 3, np.nan, EDGE)}, "finite numbers, but holds nan"),
        ({"edge": EDGE + 1}, "below the crown, got 1.4"),
        ({"top": EDGE[1:]}, "48 numbers, got 47"),
        ({"top": EDGE + 0.6}, "top must lie below the crown, got 1$"),
        ({"thick": THICK.T}, "48 x n numbers, got 4 x 48"),
        ({"thick": THICK[:, :1]}, "at least two steps"),
        ({"thick": THICK * np.inf}, "finite numbers, but holds inf"),
        ({"curl": 1.5}, "curl must be from 0 to 1, got 1.5"),
        ({"wave": np.nan}, "wave must be from 0 to 1, got nan"),
        ({"colour": -0.1}, "colour must be from 0 to 1"),
        ({"stand": -0.5}, "stand must be from 0 to 1, got -0.5"),
        ({"sweep": np.nan}, "sweep must be within a quarter turn, got nan"),
        ({"part": 2.0}, "part must be within a quarter turn, got 2.0"),
    ],
)
def test_a_cut_that_cannot_be(bad, said):
    with pytest.raises(InputError, match=said):
        Cut(**{"edge": EDGE, "thick": THICK} | bad)


@pytest.mark.parametrize(
    ("line", "radius", "said"),
    [
        (LINE[:, :2], [0.01, 0.01], "n x 3 numbers, got 2 x 2"),
        (LINE[:1], [0.01], "at least two places"),
        (LINE, [0.01], "2 numbers, got 1"),
        (LINE, [0.01, 0.0], "radius must be positive, got 0 m"),
    ],
)
def test_a_ball_that_cannot_be(line, radius, said):
    with pytest.raises(InputError, match=said):
        Ball(line, np.array(radius))


def test_there_is_no_such_preset():
    with pytest.raises(InputError, match="no hair 'mullet'; choose one of bald_rim"):
        preset("mullet")


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_alike_on_both_sides_but_for_the_parting(name):
    cut = preset(name)
    other = mirrored(cut)
    assert np.allclose(other.edge, cut.edge)
    assert np.allclose(other.thick, cut.thick)


@given(st.lists(st.floats(-2, 0.9), min_size=AZIMUTHS, max_size=AZIMUTHS), st.floats(-1.5, 1.5))
def test_a_mirror_in_a_mirror_changes_nothing(edge, part):
    cut = Cut(np.array(edge), THICK, part, balls=(Ball(LINE, np.full(2, 0.01)),))
    twice = mirrored(mirrored(cut))
    assert np.array_equal(twice.edge, cut.edge)
    assert twice.part == cut.part
    assert np.array_equal(twice.balls[0].line, cut.balls[0].line)
    k = 5  # the place as far to the right has what was to the left
    assert mirrored(cut).edge[k] == cut.edge[AZIMUTHS - k]


def test_a_cut_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        preset("bob").edge[0] = 1


def test_how_hair_stands_is_kept_and_mirrored():
    cut = replace(preset("crop"), stand=0.7, sweep=0.4)
    again = from_json(to_json(cut))
    assert (again.stand, again.sweep) == (0.7, 0.4)
    assert (mirrored(cut).stand, mirrored(cut).sweep) == (0.7, -0.4)


def test_hair_that_lies_is_kept_as_it_was_before():
    """Files of hair without these two are read, and written, as they were."""
    kept = json.loads(to_json(preset("bob")))
    assert not {"stand", "sweep"} & set(kept)
    assert from_json(json.dumps(kept)).stand == 0
    assert from_json(json.dumps(kept)).sweep is None
