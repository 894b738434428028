"""Deltas per pixel, their selection, and the mapping between pixels and vertices."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import Camera
from snakes.deltas import PixelDeltas, consistent, direct, on_line, pixel_deltas, runs
from snakes.mapping import pixels_to_vertices, world_moves

SIZE = (91, 200)


def test_deltas_on_the_same_pixel_are_averaged():
    contours = np.array([[10.0, 20.0], [14.0, 22.0], [50.5, 60.5]])
    snakes = np.array([[12.1, 21.9], [12.9, 21.1], [50.5, 60.5]])
    found, used = pixel_deltas(contours, snakes, SIZE, 15.0)
    assert used.all()
    assert found.pixels.tolist() == [[12, 21], [50, 60]]
    assert found.counts.tolist() == [2, 1]
    assert found.deltas[0] == pytest.approx([-0.5, -0.5])  # input minus output
    assert found.deltas[1] == pytest.approx([0, 0])


def test_deltas_beyond_the_max_and_off_the_picture_are_left_out():
    contours = np.array([[10.0, 20.0], [10.0, 20.0], [2.0, 2.0]])
    snakes = np.array([[24.9, 20.5], [26.0, 20.5], [-0.5, 2.0]])
    found, used = pixel_deltas(contours, snakes, SIZE, 15.0)
    assert used.tolist() == [True, False, False]
    assert found.pixels.tolist() == [[24, 20]]


def test_no_points_give_no_deltas():
    found, used = pixel_deltas(np.zeros((0, 2)), np.zeros((0, 2)), SIZE, 15.0)
    assert len(found.pixels) == len(used) == 0
    assert consistent(found).shape == (0,)


def test_a_point_that_passed_a_nearer_line_is_not_direct():
    near = np.stack([np.full(10, 20.0), np.arange(10.0)], axis=1)
    far = near + [10.0, 0.0]
    contours = np.concatenate([near, far])
    snakes = np.concatenate([near + [2.0, 0.0], near + [2.0, 0.0]])  # both land on the near side
    assert direct(contours, snakes).tolist() == [True] * 10 + [False] * 10


def test_a_point_rests_on_a_line_or_on_nothing():
    render = np.full((60, 60), 0.6)
    render[:, 30] = 0.2
    found = on_line(render, np.array([[30.5, 30.0], [10.0, 30.0]]))
    assert found.tolist() == [True, False]


def test_a_delta_against_all_its_neighbours_is_rejected():
    pixels = np.stack([np.arange(20), np.full(20, 50)], axis=1)
    deltas = np.tile([1.0, -2.0], (20, 1))
    deltas[7] = [9.0, 6.0]
    found = PixelDeltas(pixels, deltas, np.ones(20, dtype=int))
    assert np.flatnonzero(~consistent(found)).tolist() == [7]


def test_runs():
    assert runs(np.array([0, 1, 1, 0, 1, 0], bool)) == [slice(1, 3), slice(4, 5)]
    assert runs(np.array([0, 1, 1, 0, 1, 0], bool), 2) == [slice(1, 3)]
    assert runs(np.zeros(0, bool)) == []


@pytest.fixture
def steep():
    """Vertices that all project into one pixel, the farther from its centre the nearer."""
    camera = Camera(10, 10, (1000.0, 1000.0), (5.0, 5.0))
    vertices = np.array([[0.5e-3, -0.5e-3, 0.0], [1.0e-3, -0.5e-3, 0.01], [1.5e-3, -0.5e-3, 0.03]])
    return camera, vertices


def test_low_depth_preference_trades_nearness_for_depth(steep):
    camera, vertices = steep
    pixel, everyone = np.array([[5, 5]]), np.ones(3, dtype=bool)
    chosen = [
        int(pixels_to_vertices(pixel, vertices, everyone, camera, preference)[0])
        for preference in (0.0, 1.0)
    ]
    assert chosen == [0, 2]
    hidden = np.array([False, True, False])
    assert pixels_to_vertices(pixel, vertices, hidden, camera, 0.0).tolist() == [1]


def test_a_pixel_without_a_vertex_near_it_has_none(steep):
    camera, vertices = steep
    pixels = np.array([[0, 0], [5, 5]])
    nobody = np.zeros(3, dtype=bool)
    assert pixels_to_vertices(pixels, vertices, ~nobody, camera).tolist() == [-1, 0]
    assert pixels_to_vertices(pixels, vertices, nobody, camera).tolist() == [-1, -1]


@pytest.mark.parametrize("distance", [np.inf, 0.8])
def test_world_moves_move_the_projection_by_the_deltas(rng, distance):
    camera = Camera(91, 200, (400.0, 700.0), (45.0, 110.0), distance)
    points = rng.normal(size=(20, 3)) * 0.1
    deltas = rng.normal(size=(20, 2)) * 5
    moves = world_moves(deltas, points, camera)
    assert np.allclose(camera.project(points + moves) - camera.project(points), deltas)
    assert not moves[:, 2].any()
