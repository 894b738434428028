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
    normals = rng.normal(0, 1, (k, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    places = rng.normal(0, 0.02, (k, 3))
    return places, normals, rng.normal(0, 0.003, k), rng.uniform(1e-3, 3e-3, k)


@pytest.mark.parametrize("symmetry", [0.0, 0.7, 1.0])
def test_it_is_the_conditional_mean_of_the_joint_distribution(symmetry):
    """Movements at all places as one normal vector, of which a part is observed.

    A movement that is alike on both sides is a random one f plus its mirror image: a f(x) + b M
    f(M x) with a² + b² = 1 and 2 a b = symmetry.
    """
    places, normals, moves, errors = known(0)
    at = np.random.default_rng(1).normal(0, 0.02, (5, 3))
    every = np.concatenate([places, at])
    both = np.concatenate([every, every * (-1, 1, 1)])
    apart = np.linalg.norm(both[:, None] - both[None], axis=2)
    free = np.kron(SIZE**2 * np.exp(-0.5 * (apart / LENGTH) ** 2), np.eye(3))
    angle = np.arcsin(symmetry) / 2
    mirror = np.kron(np.eye(len(every)), np.diag([-1.0, 1, 1]))
    mix = np.hstack([np.cos(angle) * np.eye(3 * len(every)), np.sin(angle) * mirror])
    joint = mix @ free @ mix.T
    seen = np.zeros((len(places), 3 * len(every)))
    for k, normal in enumerate(normals):
        seen[k, 3 * k : 3 * k + 3] = normal
    gain = joint @ seen.T @ np.linalg.inv(seen @ joint @ seen.T + np.diag(errors**2))
    expected = (gain @ moves).reshape(-1, 3)[len(places) :]
    found = smooth_field(places, normals, moves, errors, at, LENGTH, SIZE, symmetry)
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_the_other_side_goes_along_unless_its_own_lines_say_otherwise():
    left, right = np.array([[0.04, 0.0, 0.0]]), np.array([[-0.04, 0.0, 0.0]])
    out = np.array([[0.6, 0.8, 0.0]])
    told = (np.array([0.002]), np.array([1e-7]))
    alone = smooth_field(left, out, *told, right, LENGTH, SIZE)
    assert np.abs(alone).max() < 1e-8
    along = smooth_field(left, out, *told, right, LENGTH, SIZE, 0.9)
    np.testing.assert_allclose(along, 0.9 * 0.002 * out * (-1, 1, 1), atol=1e-7)
    both = np.concatenate([left, right]), np.concatenate([out, out * (-1, 1, 1)])
    still = smooth_field(*both, np.array([0.002, 0.0]), np.full(2, 1e-7), right, LENGTH, SIZE, 0.9)
    assert np.abs(still).max() < 1e-7


@given(seed=st.integers(0, 500))
def test_half_the_movements_half_the_field(seed):
    places, normals, moves, errors = known(seed)
    whole = smooth_field(places, normals, moves, errors, places, LENGTH, SIZE)
    half = smooth_field(places, normals, moves / 2, errors, places, LENGTH, SIZE)
    np.testing.assert_allclose(half, whole / 2, atol=1e-8)


def test_what_is_known_exactly_is_kept_and_dies_away():
    place, normal = np.array([[0.0, 0.0, 0.0]]), np.array([[0.6, 0.8, 0.0]])
    at = np.array([[0.0, 0, 0], [0.012, 0, 0], [0.06, 0, 0]])
    found = smooth_field(place, normal, np.array([0.002]), np.array([1e-7]), at, LENGTH, SIZE)
    np.testing.assert_allclose(found[0], 0.002 * normal[0], atol=1e-8)
    np.testing.assert_allclose(found[1], np.exp(-0.5) * found[0], atol=1e-8)
    assert np.abs(found[2]).max() < 1e-7


def test_dense_lines_do_not_pile_up():
    """A hundred points in one spot that say the same say it once."""
    places = np.random.default_rng(2).normal(0, 1e-4, (100, 3))
    normals = np.tile([1.0, 0.0, 0.0], (100, 1))
    found = smooth_field(
        places, normals, np.full(100, 0.003), np.full(100, 1e-3), places, LENGTH, SIZE
    )
    assert np.abs(found[:, 0] - 0.003).max() < 3e-5 and np.abs(found[:, 1:]).max() < 1e-9


def test_two_lines_that_cross_tell_the_whole_movement():
    places = np.zeros((2, 3))
    normals = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0]])
    movement = np.array([0.001, -0.002, 0.0])
    found = smooth_field(
        places, normals, normals @ movement, np.full(2, 1e-6), places[:1], LENGTH, SIZE
    )
    np.testing.assert_allclose(found[0], movement, atol=1e-6)


def test_nothing_known_nothing_moves_and_errors_must_be_possible():
    none = np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0)
    assert not smooth_field(*none, np.zeros((4, 3)), LENGTH, SIZE).any()
    places, normals, moves, errors = known(3)
    with pytest.raises(ValueError, match="error above 0"):
        smooth_field(places, normals, moves, 0 * errors, places, LENGTH, SIZE)
