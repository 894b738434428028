"""Lines of a drawing as points, and which of them answer which."""

from __future__ import annotations

import numpy as np
import pytest
from skimage.measure import approximate_polygon

from facs_rig.common.box import Box
from snakes.lines import (
    Lines,
    centre_lines,
    directions,
    few_cornered,
    nearest_lines,
    paths,
    spacing,
)


def circle(radius, n=200, centre=(0.0, 0.0)):
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    points = np.array(centre) + radius * np.stack([np.cos(t), np.sin(t)], axis=1)
    return Lines(points, np.stack([-np.sin(t), np.cos(t)], axis=1))


@pytest.mark.parametrize("width", [2, 6, 12])
def test_the_middle_of_a_drawn_ellipse(scene, width):
    """However thick the pen was: within a pixel of the curve, and along it."""
    found = centre_lines(scene.ellipse(120, 80, width), Box(50, 50, 350, 350))
    u, v = (found.points - 200).T
    t = np.arctan2(v / 80, u / 120)
    on = np.stack([120 * np.cos(t), 80 * np.sin(t)], axis=1)
    assert len(found.points) > 350
    assert np.abs(found.points - 200 - on).max() < 1.6
    tangent = np.stack([-120 * np.sin(t), 80 * np.cos(t)], axis=1)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    assert np.abs(np.einsum("kd,kd->k", tangent, found.along)).min() > 0.8


@pytest.mark.parametrize("height", [160, 90])
def test_of_what_is_filled_the_outline_is_a_line(height):
    """A black mouth on a page of lines, half a stroke inside its edge, where a line around it has
    its middle; nobody drew the middle of the black."""
    v, u = np.mgrid[:400, :400] + 0.5
    paper = np.ones((400, 400))
    paper[((u - 200) / 120) ** 2 + ((v - 200) / (height / 2)) ** 2 < 1] = 0.0
    for row in range(20, 400, 45):
        paper[row : row + 6, 20:70] = 0.0
    found = centre_lines(paper, Box(0, 0, 400, 400))
    filled = found.points[found.border]
    assert found.border.sum() > 300
    x, y = (filled - 200).T
    inside = 1 - np.sqrt((x / 120) ** 2 + (y / (height / 2)) ** 2)
    assert (inside > 0).all() and inside.max() * height / 2 < 9
    assert (np.abs(found.points[~found.border][:, 0] - 200) > 100).all()


def test_the_borders_of_lips_answer_no_outline_of_what_is_filled():
    drawn = circle(20)
    filled = Lines(drawn.points, drawn.along, np.arange(200) < 100)
    face = Lines(drawn.points, drawn.along, np.ones(200, bool))
    pair, away = nearest_lines(filled, face, turn=2.0, reach=3.0)
    assert (pair[102:198] == np.arange(102, 198)).all()
    assert (pair[10:90] == -1).all() and np.isinf(away[10:90]).all()
    rims = Lines(drawn.points, drawn.along, np.zeros(200, bool))
    for lines in (rims, drawn):  # all else does
        assert (nearest_lines(filled, lines, turn=2.0, reach=3.0)[0] == np.arange(200)).all()


def test_a_large_page_is_looked_at_in_its_own_pixels(scene):
    small = scene.ellipse(120, 80)
    large = np.repeat(np.repeat(small, 4, axis=0), 4, axis=1)
    a = centre_lines(small, Box(50, 50, 350, 350)).points
    b = centre_lines(large, Box(200, 200, 1400, 1400)).points / 4
    assert np.abs(np.sort(a, axis=0)[[0, -1]] - np.sort(b, axis=0)[[0, -1]]).max() < 1.5


def test_a_blank_page_has_no_lines():
    found = centre_lines(np.ones((60, 80)), Box(0, 0, 80, 60))
    assert found.points.shape == found.along.shape == (0, 2)
    assert paths(found.points, 2.0) == [] and spacing(found.points) == 0.0


def test_directions_of_few_points():
    assert directions(np.array([[3.0, 4.0]])).tolist() == [[1.0, 0.0]]
    up = directions(np.array([[3.0, 4.0], [3.0, 5.0]]))
    assert np.abs(up[:, 1]).min() > 0.999


def test_a_line_is_answered_by_one_that_runs_like_it():
    """Of a nearer line across and a farther one along, the latter."""
    n = 41
    t = np.linspace(-20, 20, n)
    right, down = np.tile([1.0, 0.0], (n, 1)), np.tile([0.0, 1.0], (n, 1))
    drawn = Lines(
        np.concatenate([np.column_stack([t, np.full(n, 4.0)]), np.column_stack([np.zeros(n), t])]),
        np.concatenate([right, down]),
    )
    asked = Lines(np.array([[0.5, 0.0]]), np.array([[1.0, 0.0]]))
    pair, away = nearest_lines(drawn, asked, turn=10.0, reach=12.0)
    assert pair[0] < n and away[0] == pytest.approx(np.hypot(4, 0.5), abs=0.1)
    assert nearest_lines(drawn, asked, turn=0.0, reach=12.0)[0][0] >= n
    assert nearest_lines(drawn, asked, turn=10.0, reach=3.0)[0][0] == -1
    back = Lines(asked.points, -asked.along)  # which way a line was drawn does not matter
    assert nearest_lines(drawn, back, turn=10.0, reach=12.0)[0][0] == pair[0]


def test_without_lines_nothing_answers():
    none = Lines(np.zeros((0, 2)), np.zeros((0, 2)))
    pair, away = nearest_lines(none, circle(5.0), 1.0, 1.0)
    assert (pair == -1).all() and np.isinf(away).all()
    assert len(nearest_lines(circle(5.0), none, 1.0, 1.0)[0]) == 0


def test_paths_follow_lines_from_end_to_end_and_stop_at_crossings():
    rng = np.random.default_rng(1)
    line = np.column_stack([np.arange(30.0), np.zeros(30)])
    ring = circle(10.0, 62, (60.0, 0.0)).points
    t = np.concatenate([
        np.column_stack([np.arange(-8.0, 9), np.full(17, 40.0)]),
        np.column_stack([np.zeros(8), np.arange(41.0, 49)]),
    ])  # fmt: skip
    points = np.concatenate([line, ring, t])
    order = rng.permutation(len(points))
    found = paths(points[order], apart=1.3)
    lengths = sorted(len(path) for path in found)
    assert 30 in lengths and 62 in lengths
    assert len(found) == 5  # three arms of the T
    for path in found:
        steps = np.linalg.norm(np.diff(points[order][path], axis=0), axis=1)
        assert steps.max() < 1.3
        assert len(np.unique(path)) == len(path)


@pytest.mark.parametrize("tolerance", [0.2, 0.5, 3.0])
def test_few_corners_are_those_of_scikit_image(rng_lines, tolerance):
    for line in rng_lines:
        wanted = approximate_polygon(line, tolerance)
        np.testing.assert_array_equal(few_cornered(line, tolerance), wanted)


@pytest.fixture
def rng_lines():
    """Walks on the grid, as the middle of strokes is, and a straight line."""
    rng = np.random.default_rng(0)
    walks = [np.cumsum(rng.integers(-1, 2, (n, 2)), axis=0).astype(float) for n in (2, 3, 40, 300)]
    return [*walks, np.stack([np.arange(9.0), 2 * np.arange(9.0)], axis=1)]
