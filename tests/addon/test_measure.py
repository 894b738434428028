"""The lines of a face, and their distance from drawings whose answer is known."""

import numpy as np
import pytest

from addon.measure import contour_error, ruler, without_hair
from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.common.box import Box
from snakes import face_lines


def page(rows, size=100):
    drawing = np.ones((size, size), np.float32)
    for row in rows:
        drawing[row, 10:90] = 0.0
    return drawing


def line(height, scale=1.0):
    """Points all along a horizontal line, as the lines of a face are given."""
    u = np.arange(10.5, 90, 0.5)
    return scale * np.column_stack([u, np.full_like(u, height)])


BOX = Box(0, 0, 100, 100)


@pytest.mark.parametrize("shift", [0, 3, 7])
def test_a_shifted_line_is_as_far_as_it_was_shifted(shift):
    r = ruler(page([40]), BOX, reach=15)
    assert contour_error(r, line(40.5 + shift)) == pytest.approx(shift, abs=0.3)


def test_distance_is_cut_at_the_reach():
    r = ruler(page([40]), BOX, reach=5)
    assert contour_error(r, line(80.5)) == pytest.approx(5)


def test_a_line_without_counterpart_counts_the_same_wherever_the_face_is():
    """Half of the sketch is hair far away: it adds its cut distance, no more."""
    r = ruler(page([40, 95]), BOX, reach=10)
    near, off = (contour_error(r, line(y)) for y in (40.5, 44.5))
    assert near == pytest.approx((0 + 5) / 2, abs=0.2)
    assert off == pytest.approx((4 + 7) / 2, abs=0.3)


def test_hair_is_no_line_of_a_face():
    bare = ruler(page([40]), BOX, reach=10)
    hairy = ruler(page([40, 60, 95]), BOX, reach=10)
    found = without_hair(hairy, lambda points: points[:, 1] > 50)
    assert (found.lines == bare.lines).all() and hairy.lines.sum() > bare.lines.sum()
    for y in (42.5, 58.5):
        assert contour_error(found, line(y)) == pytest.approx(contour_error(bare, line(y)))


def test_large_pages_are_measured_in_their_own_pixels():
    drawing = np.repeat(np.repeat(page([40, 41], 100), 16, axis=0), 16, axis=1)
    r = ruler(drawing, Box(0, 0, 1600, 1600), reach=240)
    assert r.cell == 4
    assert contour_error(r, line(46.0, 16)) == pytest.approx(5 * 16, abs=8)


def test_nothing_to_measure_is_the_reach():
    assert contour_error(ruler(page([]), BOX, 7), line(40.5)) == 7


@pytest.mark.parametrize("step", [1.0, 4.0])
def test_the_lines_of_a_face_lie_on_its_surface_and_follow_each_other(step):
    rig = load_rig()
    posed = rig.pose(FaceParameters({"smile": 4.0}, head=(0.3, 0.1, 0.0)))
    camera = Camera.framing(posed, 300, 300)
    found = face_lines(rig, posed, camera, step=step)
    points, along = found.lines.points, found.lines.along
    assert found.starts[0] == 0 and found.starts[-1] == len(points) == len(found.triangle)
    corners = posed[rig.triangles[found.triangle]]
    surface = camera.project(np.einsum("kc,kcd->kd", found.weights, corners))
    assert np.abs(surface - points).max() < 0.6  # hidden parts are looked for just above the skin
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1, atol=1e-6)
    for a, b in zip(found.starts[:-1], found.starts[1:], strict=True):
        steps = np.diff(points[a:b], axis=0)
        far = np.linalg.norm(steps, axis=1)
        assert (far < step + 3).all()  # painted lines have points of their own
        if len(far) > 3:
            assert np.median(np.einsum("kd,kd->k", steps / far[:, None], along[a : b - 1])) > 0.9
