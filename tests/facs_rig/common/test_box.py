"""The rectangle of a picture that everything crops, measures and places with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facs_rig.common.box import Box
from facs_rig.common.errors import InputError

PLACES = st.floats(-500, 500)
SIDES = st.floats(0.5, 800)
TURNS = st.floats(-4, 4)


@given(PLACES, PLACES, SIDES, SIDES, TURNS)
def test_pixels_to_shares_and_back(left, top, width, height, turn):
    box = Box(left, top, left + width, top + height, turn)
    points = np.array([[0, 0], [0.25, 1.5], [-3, 0.5]])
    assert box.to_units(box.to_pixels(points)) == pytest.approx(points, abs=1e-9)
    assert box.to_pixels(np.array([0.5, 0.5])) == pytest.approx(np.array(box.middle), abs=1e-9)


def test_turned_clockwise_as_the_picture_is_seen():
    box = Box.square((10, 20), 4, turn=np.pi / 2)
    right = box.to_pixels(np.array([1.0, 0.5]))  # the middle of the right side comes to lie below
    assert right == pytest.approx(np.array([10, 22]))


@given(st.lists(st.tuples(PLACES, PLACES), min_size=1, max_size=9))
def test_around_points_and_nothing_more(points):
    box = Box.around(np.array(points))
    assert tuple(box) == (*np.min(points, axis=0), *np.max(points, axis=0))


def test_a_box_said_is_read_again():
    box = Box(1, -2.5, 30, 4)
    assert Box.parse(str(box)) == box
    assert Box.parse(" 1, 2 ,3,4") == Box(1, 2, 3, 4)


@pytest.mark.parametrize(
    "text", ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1,2,inf,4", "nan,0,1,1", "3,2,1,4", "1,4,3,4"]
)
def test_no_box(text):
    with pytest.raises(InputError, match="^The head's box"):
        Box.parse(text, "The head's box")


@pytest.mark.parametrize("box", [Box(0, 0, 0, 0), Box(3, 0, 2, 9)])
def test_an_empty_box_is_refused(box):
    with pytest.raises(InputError, match="is empty"):
        box.checked()


@pytest.mark.parametrize("side", [float("nan"), float("inf")])
def test_a_box_without_an_end_is_refused(side):
    with pytest.raises(InputError, match="given as left,top,right,bottom"):
        Box(0, 0, side, 1).checked()


def test_room_on_every_side():
    assert tuple(Box(0, 0, 10, 20).grown(0.1)) == (-1, -2, 11, 22)


def test_on_a_page_and_apart():
    assert Box(0, 0, 8, 6).within((6, 8))
    assert not Box(0, 0, 8, 6).within((8, 6))
    assert Box(0, 0, 2, 2).apart(Box(2, 0, 4, 2))
    assert not Box(0, 0, 2, 2).apart(Box(1, 1, 4, 4))
