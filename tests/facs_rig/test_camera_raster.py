"""The camera and the rasteriser, against closed forms."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from facs_rig import Camera, rasterise, shade, visible

finite = st.floats(-0.3, 0.3)
cameras = st.builds(
    Camera,
    width=st.integers(1, 400),
    height=st.integers(1, 400),
    scale=st.tuples(st.floats(100, 4000), st.floats(100, 4000)),
    centre=st.tuples(st.floats(-50, 450), st.floats(-50, 450)),
    distance=st.one_of(st.just(float("inf")), st.floats(0.5, 5)),
)


@settings(deadline=None)
@given(cameras, st.lists(st.tuples(finite, finite, finite), min_size=1, max_size=5))
def test_the_matrix_projects_as_project_does(camera, points):
    points = np.array(points)
    image = np.column_stack([points, np.ones(len(points))]) @ camera.matrix().T
    np.testing.assert_allclose(
        image[:, :2] / image[:, 2:], camera.project(points), atol=1e-6, rtol=1e-9
    )


@settings(deadline=None)
@given(cameras, st.floats(-20, 100), st.floats(-20, 100), st.floats(1, 300), st.floats(1, 300))
def test_a_cropped_camera_sees_the_crop(camera, left, top, w, h):
    crop = camera.cropped(left, top, left + w, top + h, 91, 200)
    points = np.array([[0.01, -0.02, 0.05], [-0.1, 0.1, 0.0]])
    expected = (camera.project(points) - [left, top]) * [91 / w, 200 / h]
    np.testing.assert_allclose(crop.project(points), expected, rtol=1e-6, atol=1e-5)


def test_orthographic_last_row():
    assert Camera(10, 10, (2.0, 3.0), (5, 5)).matrix()[2].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize("distance", [np.inf, 0.5])
def test_what_is_farther_away_is_drawn_smaller(distance):
    """By as much as its distance from the eye is that of the origin."""
    camera = Camera(100, 100, (200.0, 200.0), (50.0, 50.0), distance)
    ends = np.array([[0.0, 0, -0.1], [0.02, 0, -0.1], [0.0, 0, 0.1], [0.02, 0, 0.1]])
    wide = np.diff(camera.project(ends)[:, 0])[::2]
    np.testing.assert_allclose(camera.relative_depth(ends)[::2], 200 * 0.02 / wide)
    eye = np.array([0, 0, min(distance, 1e9)])
    away = np.abs(eye - ends)[:, 2] / eye[2]
    np.testing.assert_allclose(camera.relative_depth(ends), away)


def test_framing_keeps_all_points_inside():
    points = np.random.default_rng(1).normal(size=(50, 3)) * 0.1
    for distance in (np.inf, 1.0):
        camera = Camera.framing(points, 300, 200, 0.1, distance)
        pixels = camera.project(points)
        assert (pixels >= 19.99).all()
        assert (pixels <= [280.01, 180.01]).all()
        assert camera.scale[0] == camera.scale[1]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [({"width": 0}, "at least 1x1"), ({"scale": (1.0, 0.0)}, "must be positive")],
)
def test_impossible_cameras_are_refused(change, sentence):
    values = {"width": 5, "height": 5, "scale": (1.0, 1.0), "centre": (0.0, 0.0), **change}
    with pytest.raises(ValueError, match=sentence):
        Camera(**values)


@pytest.fixture(scope="module")
def sphere():
    mesh = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_depth_of_a_sphere(sphere):
    vertices, triangles = sphere
    camera = Camera(120, 100, (450.0, 450.0), (61.3, 48.7))
    depth = rasterise(vertices, triangles, camera).depth
    v, u = np.mgrid[:100, :120] + 0.5
    r2 = ((u - 61.3) / 450) ** 2 + ((v - 48.7) / 450) ** 2
    inside, outside = r2 < 0.098**2, r2 > 0.1**2
    assert np.isneginf(depth[outside]).all()
    np.testing.assert_allclose(depth[inside], np.sqrt(0.01 - r2[inside]), atol=4e-4)


def test_every_pixel_of_a_closed_patch_is_covered_once():
    """Shared edges leave no hole: a fine grid of triangles covers each pixel of its square."""
    n = 24
    grid = np.linspace(-1, 1, n)
    x, y = np.meshgrid(grid, grid)
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)])
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate(
        [np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)]
    )
    buffers = rasterise(vertices, triangles, Camera(64, 64, (31.7, 31.7), (32.0, 32.0)))
    assert (buffers.triangle[1:-1, 1:-1] >= 0).all()


def test_large_pictures_are_drawn_in_parts(sphere, monkeypatch):
    vertices, triangles = sphere
    camera = Camera(120, 100, (450.0, 450.0), (61.3, 48.7))
    whole = rasterise(vertices, triangles, camera)
    monkeypatch.setattr("facs_rig.raster.PAIRS_AT_ONCE", 5_000)
    parts = rasterise(vertices, triangles, camera)
    np.testing.assert_array_equal(whole.depth, parts.depth)
    np.testing.assert_array_equal(whole.triangle >= 0, parts.triangle >= 0)


def test_headlight_shading_of_a_sphere(sphere):
    vertices, triangles = sphere
    camera = Camera(101, 101, (450.0, 450.0), (50.5, 50.5))
    image = shade(vertices, triangles, camera)
    assert image[0, 0] == 1.0
    assert image[50, 50] == pytest.approx(1.0, abs=1e-3)
    r = 30 / 450 / 0.1
    assert image[50, 80] == pytest.approx(np.sqrt(1 - r * r), abs=5e-3)


def test_the_far_side_is_hidden(sphere):
    vertices, triangles = sphere
    camera = Camera(200, 200, (900.0, 900.0), (100.0, 100.0))
    seen = visible(vertices, camera, rasterise(vertices, triangles, camera))
    assert seen[vertices[:, 2] > 0.02].all()
    assert not seen[vertices[:, 2] < -0.02].any()


def test_off_the_picture_is_not_seen(sphere):
    vertices, triangles = sphere
    camera = Camera(50, 50, (900.0, 900.0), (-300.0, 25.0))
    buffers = rasterise(vertices, triangles, camera)
    assert (buffers.triangle == -1).all()
    assert not visible(vertices, camera, buffers).any()
