"""Drawing to contours: thin lines survive, circles keep their radius, specks go."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig.common.box import Box
from snakes.contours import (
    binarise,
    cut_at_corners,
    find_lines,
    working_drawing,
)


@pytest.mark.parametrize("size", [400, 1200])
@pytest.mark.parametrize("width", [1, 2])
def test_a_thin_line_survives_a_great_reduction(size, width):
    drawing = np.ones((size, size), dtype=np.float32)
    row = size // 3
    drawing[row : row + width, size // 10 : size - size // 10] = 0.0
    lines = find_lines(working_drawing(drawing, Box(0, 0, size, size)))
    assert len(lines) == 1  # one line without gaps
    middle = (lines[0].min(axis=0) + lines[0].max(axis=0)) / 2
    # Thinning a line two pixels thick keeps one of them: half a pixel, and half of a cell cut.
    assert middle == pytest.approx([91 / 2, 200 * (row + width / 2) / size], abs=0.75)
    assert np.ptp(lines[0][:, 0]) == pytest.approx(0.8 * 91, abs=2.0)


@pytest.mark.parametrize("radius", [20.0, 33.3])
def test_the_contours_of_a_circle_have_its_radius(scene, radius):
    drawing = scene.ellipse(radius, radius, size=100)
    lines = find_lines(drawing)
    assert len(lines) == 2  # marching squares goes round the line: outside and inside
    found = [np.linalg.norm(line - 50.0, axis=1).mean() for line in lines]
    assert np.mean(found) == pytest.approx(radius, abs=0.5)
    assert abs(found[0] - found[1]) < 3.0
    assert all(np.allclose(line[0], line[-1]) for line in lines)


def test_a_circle_is_found_where_it_is_in_the_working_image(scene):
    drawing = scene.ellipse(130, 130)
    points = np.concatenate(find_lines(working_drawing(drawing, Box(20, 20, 380, 380))))
    in_drawing = points * [360 / 91, 360 / 200] + 20
    radius = np.linalg.norm(in_drawing - 200, axis=1)
    assert radius.mean() == pytest.approx(130, abs=360 / 91 / 2)


def test_a_small_gap_is_closed():
    drawing = np.ones((40, 60), dtype=np.float32)
    drawing[20, 10:30] = drawing[20, 31:50] = 0.0
    assert len(find_lines(drawing, gap_closing=1)) == 2
    assert len(find_lines(drawing, gap_closing=2)) == 1


def test_thinning_takes_layers_off():
    drawing = np.ones((60, 60), dtype=np.float32)
    drawing[20:29, 10:50] = 0.0
    heights = [np.ptp(find_lines(drawing, 1, iterations)[0][:, 1]) for iterations in (0, 1, 3, 50)]
    assert heights[0] == pytest.approx(9.0)
    assert heights == sorted(heights, reverse=True)
    assert heights[-1] == pytest.approx(1.0)


def test_dust_is_left_out_and_paper_has_no_lines():
    drawing = np.ones((50, 50), dtype=np.float32)
    assert find_lines(drawing) == []
    drawing[25, 25] = 0.0
    drawing[10, 5:45] = 0.0
    assert len(find_lines(drawing)) == 1


def test_grey_lines_on_grey_paper_are_ink():
    drawing = np.full((30, 30), 0.8, dtype=np.float32)
    drawing[15, 5:25] = 0.4
    assert binarise(drawing).sum() == 20
    assert not binarise(np.full((5, 5), 0.3)).any()


def test_a_colour_picture_is_refused():
    with pytest.raises(ValueError, match="grey picture"):
        find_lines(np.ones((5, 5, 3)))


def test_a_stroke_is_cut_at_its_tips_and_a_circle_is_not(scene):
    drawing = np.ones((40, 60), dtype=np.float32)
    drawing[20, 10:50] = 0.0
    (loop,) = find_lines(drawing)
    pieces = cut_at_corners(loop)
    assert len(pieces) == 2
    assert all(abs(piece[0, 0] - piece[-1, 0]) > 35 for piece in pieces)  # tip to tip
    circle = find_lines(scene.ellipse(30, 30, size=100))[0]
    assert [len(piece) for piece in cut_at_corners(circle)] == [len(circle)]
