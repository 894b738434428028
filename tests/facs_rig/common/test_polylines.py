"""Lengths and even points along lines."""

import numpy as np
import pytest

from facs_rig.common.polylines import Polylines, arc_lengths, line_length, resampled, spread

SQUARE = np.array([[0.0, 0], [3, 0], [3, 4], [0, 4]])


def test_lengths_in_any_dimension():
    assert arc_lengths(SQUARE).tolist() == [0, 3, 7, 10]
    assert line_length(SQUARE) == 10
    assert line_length(np.array([[1.0, 2, 2], [0, 0, 0]])) == 3
    assert line_length(np.array([[5.0, 5]])) == 0


def test_even_points_lie_on_the_line():
    found = resampled(SQUARE, arc_lengths(SQUARE), np.array([0, 1.5, 5, 10]))
    assert found == pytest.approx(np.array([[0, 0], [1.5, 0], [3, 2], [0, 4]]))


def test_many_lines_at_once_are_as_one_by_one():
    rng = np.random.default_rng(5)
    lines = [rng.random((k, 2)) for k in (2, 7, 3)]
    every = Polylines.of(lines)
    assert every.length == pytest.approx([line_length(line) for line in lines])
    line, along, starts = spread(every.length, 0.1)
    (points,) = every.at(line, along)
    for k, one in enumerate(lines):
        own = slice(starts[k], starts[k + 1])
        assert points[own] == pytest.approx(resampled(one, arc_lengths(one), along[own]))
        assert np.diff(along[own]).max() <= 0.1 + 1e-12
