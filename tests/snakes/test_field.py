"""The smooth movement of the skin, against the textbook formula written out in full."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakes.field import smooth_field

LENGTH, SIZE = 0.012, 0.004


def known(seed, k=12):
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0, 2 * np.pi, k)
    normals = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    places = rng.normal(0, 0.02, (k, 3))
    return places, normals, rng.normal(0, 0.003, k), rng.uniform(1e-3, 3e-3, k)


def test_it_is_the_conditional_mean_of_the_joint_distribution():
    """Movements in u and v at all places as one normal vector, of which a part is observed."""
    places, normals, moves, errors = known(0)
    at = np.random.default_rng(1).normal(0, 0.02, (5, 3))
    every = np.concatenate([places, at])
    apart = np.linalg.norm(every[:, None] - every[None], axis=2)
    bell = SIZE**2 * np.exp(-0.5 * (apart / LENGTH) ** 2)
    joint = np.kron(bell, np.eye(2))  # u and v of each place, one place behind another
    seen = np.zeros((len(places), 2 * len(every)))
    for k, normal in enumerate(normals):
        seen[k, 2 * k : 2 * k + 2] = normal
    gain = joint @ seen.T @ np.linalg.inv(seen @ joint @ seen.T + np.diag(errors**2))
    expected = (gain @ moves).reshape(-1, 2)[len(places) :]
    found = smooth_field(places, normals, moves, errors, at, LENGTH, SIZE)
    np.testing.assert_allclose(found, expected, atol=1e-8)


@given(seed=st.integers(0, 500))
def test_half_the_movements_half_the_field(seed):
    places, normals, moves, errors = known(seed)
    whole = smooth_field(places, normals, moves, errors, places, LENGTH, SIZE)
    half = smooth_field(places, normals, moves / 2, errors, places, LENGTH, SIZE)
    np.testing.assert_allclose(half, whole / 2, atol=1e-8)


def test_what_is_known_exactly_is_kept_and_dies_away():
    place, normal = np.array([[0.0, 0.0, 0.0]]), np.array([[0.6, 0.8]])
    at = np.array([[0.0, 0, 0], [0.012, 0, 0], [0.06, 0, 0]])
    found = smooth_field(place, normal, np.array([0.002]), np.array([1e-7]), at, LENGTH, SIZE)
    np.testing.assert_allclose(found[0], 0.002 * normal[0], atol=1e-8)
    np.testing.assert_allclose(found[1], np.exp(-0.5) * found[0], atol=1e-8)
    assert np.abs(found[2]).max() < 1e-7


def test_dense_lines_do_not_pile_up():
    """A hundred points in one spot that say the same say it once."""
    places = np.random.default_rng(2).normal(0, 1e-4, (100, 3))
    normals = np.tile([1.0, 0.0], (100, 1))
    found = smooth_field(
        places, normals, np.full(100, 0.003), np.full(100, 1e-3), places, LENGTH, SIZE
    )
    assert np.abs(found[:, 0] - 0.003).max() < 3e-5 and np.abs(found[:, 1]).max() < 1e-9


def test_two_lines_that_cross_tell_the_whole_movement():
    places = np.zeros((2, 3))
    normals = np.array([[1.0, 0.0], [0.6, 0.8]])
    movement = np.array([0.001, -0.002])
    found = smooth_field(
        places, normals, normals @ movement, np.full(2, 1e-6), places[:1], LENGTH, SIZE
    )
    np.testing.assert_allclose(found[0], movement, atol=1e-6)


def test_nothing_known_nothing_moves_and_errors_must_be_possible():
    none = np.zeros((0, 3)), np.zeros((0, 2)), np.zeros(0), np.zeros(0)
    assert not smooth_field(*none, np.zeros((4, 3)), LENGTH, SIZE).any()
    places, normals, moves, errors = known(3)
    with pytest.raises(ValueError, match="error above 0"):
        smooth_field(places, normals, moves, 0 * errors, places, LENGTH, SIZE)
