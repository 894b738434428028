"""The distance between lines, against drawings whose answer is known."""

import numpy as np
import pytest

from addon import measure
from addon.measure import contour_error, ruler
from facs_rig import Camera


def page(rows, size=100):
    drawing = np.ones((size, size), np.float32)
    for row in rows:
        drawing[row, 10:90] = 0.0
    return drawing


@pytest.fixture
def line_model(monkeypatch):
    """A 'face' that is drawn as one horizontal line, at the height that stands for its vertices."""

    def lines(rig, posed, camera):
        u = np.arange(10.5, 90, 0.5)
        points = np.column_stack([u, np.full_like(u, float(posed))])
        left, top = -np.array(camera.centre) / camera.scale
        return (points - [left, top]) * camera.scale

    monkeypatch.setattr(measure, "model_lines", lines)


CAMERA = Camera(100, 100, (1.0, 1.0), (0.0, 0.0))
BOX = (0, 0, 100, 100)


@pytest.mark.parametrize("shift", [0, 3, 7])
def test_a_shifted_line_is_as_far_as_it_was_shifted(line_model, shift):
    r = ruler(page([40]), BOX, reach=15)
    assert contour_error(r, None, 40.5 + shift, CAMERA) == pytest.approx(shift, abs=0.3)


def test_distance_is_cut_at_the_reach(line_model):
    r = ruler(page([40]), BOX, reach=5)
    assert contour_error(r, None, 80.5, CAMERA) == pytest.approx(5)


def test_a_line_without_counterpart_counts_the_same_wherever_the_face_is(line_model):
    """Half of the sketch is hair far away: it adds its cut distance, no more."""
    r = ruler(page([40, 95]), BOX, reach=10)
    near, off = (contour_error(r, None, y, CAMERA) for y in (40.5, 44.5))
    assert near == pytest.approx((0 + 5) / 2, abs=0.2)
    assert off == pytest.approx((4 + 7) / 2, abs=0.3)


def test_large_pages_are_measured_in_their_own_pixels(line_model):
    drawing = np.repeat(np.repeat(page([40, 41], 100), 16, axis=0), 16, axis=1)
    camera = Camera(1600, 1600, (16.0, 16.0), (0.0, 0.0))
    r = ruler(drawing, (0, 0, 1600, 1600), reach=240)
    assert r.cell == 4
    assert contour_error(r, None, 46.0, camera) == pytest.approx(5 * 16, abs=8)


def test_nothing_to_measure_is_the_reach(line_model):
    assert contour_error(ruler(page([]), BOX, 7), None, 40.5, CAMERA) == 7
