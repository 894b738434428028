"""Movements of surface points, against faces posed with a little more of each parameter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facs_rig import CONTROL_NAMES, IDENTITY, FaceParameters, load_rig
from facs_rig.derivatives import STEP, identity_slopes, movements, slopes, surface_points
from facs_rig.identity import target_weights

FACE = FaceParameters(
    {"smile": 3.0, "jaw_open": 2.0, "frontalis": 4.0}, {"age": 0.4, "nose_length": 0.3}
)


@pytest.fixture(scope="module")
def spots():
    """(triangles' corners (k, 3), weights (k, 3)) of points all over the face."""
    rng = np.random.default_rng(4)
    rig = load_rig()
    chosen = rng.integers(0, len(rig.triangles), 300)
    return rig.triangles[chosen], rng.dirichlet([1, 1, 1], len(chosen))


def places(spots, parameters):
    corners, weights = spots
    return np.einsum("kc,kcd->kd", weights, load_rig().shape(parameters)[corners])


def test_points_are_the_sum_of_what_moves_them(spots):
    rig = load_rig()
    points = surface_points(rig, *spots)
    there = points.neutral + np.tensordot(target_weights(FACE.identity), points.identity, axes=1)
    there = there + np.tensordot(rig.key_values(FACE), points.keys, axes=1)
    np.testing.assert_allclose(there, places(spots, FACE), atol=1e-6)
    some = points.at(slice(3, 7))
    np.testing.assert_array_equal(some.keys, points.keys[:, 3:7])


@pytest.mark.parametrize("name", ["nose_length", "jaw_width", "gender", "age", "weight", "asian"])
def test_identity_moves_points_as_posing_does(spots, name):
    """The mean of both ways: a feature's two ends are targets of their own."""
    rig, step = load_rig(), 0.02
    (moves,) = movements(surface_points(rig, *spots), slopes(rig, FACE, [name], []))
    here = FACE.identity.get(name, next(f.default for f in IDENTITY if f.name == name))
    less, more = (
        places(spots, replace(FACE, identity={**FACE.identity, name: here + way}))
        for way in (-step, step)
    )
    assert np.abs(more - less).max() > 1e-5
    np.testing.assert_allclose(2 * step * moves, more - less, atol=0.1 * np.abs(more - less).max())


@pytest.mark.parametrize("name", ["smile", "frontalis", "jaw_open", "blink", "squint"])
def test_controls_move_points_as_posing_does(spots, name):
    rig, step = load_rig(), 0.04
    (moves,) = movements(surface_points(rig, *spots), slopes(rig, FACE, [], [name]))
    more = replace(FACE, aus={**FACE.aus, name: FACE.aus.get(name, 0.0) + step})
    moved = places(spots, more) - places(spots, FACE)
    assert np.abs(moved).max() > 1e-6
    np.testing.assert_allclose(step * moves, moved, atol=0.1 * np.abs(moved).max())


def test_at_the_ends_of_their_range_parameters_still_have_a_slope(spots):
    rig = load_rig()
    face = FaceParameters({"smile": 10.0}, {"age": 1.0, "gender": 0.0, "nose_length": -1.0})
    identity = [f.name for f in IDENTITY if f.name != "wrinkles"]
    moves = movements(surface_points(rig, *spots), slopes(rig, face, identity, CONTROL_NAMES))
    assert moves.shape == (len(identity) + len(CONTROL_NAMES), 300, 3)
    assert np.isfinite(moves).all()
    for name in ("age", "gender", "nose_length"):
        assert np.abs(moves[identity.index(name)]).max() > 1e-4
    assert np.abs(moves[len(identity) + CONTROL_NAMES.index("smile")]).max() > 1e-4


def test_nothing_asked_nothing_moves(spots):
    rig = load_rig()
    points = surface_points(rig, *spots)
    assert movements(points, slopes(rig, FACE, [], [])).shape == (0, 300, 3)
    with pytest.raises(ValueError, match="weights"):
        surface_points(rig, spots[0], spots[1][:, :2])


def test_slopes_of_the_targets_weights_are_those_of_the_weights():
    """Features are written out by hand for speed: against differences of target_weights."""
    identity = {"age": 0.3, "nose_length": 0.4, "jaw_width": -0.02, "chin_width": -1.0}
    names = [f.name for f in IDENTITY if f.name != "wrinkles"]
    found = identity_slopes(identity, names)
    for name, slope in zip(names, found, strict=True):
        feature = next(f for f in IDENTITY if f.name == name)
        here = identity.get(name, feature.default)
        low, high = max(here - STEP, feature.minimum), min(here + STEP, feature.maximum)
        less, more = (target_weights({**identity, name: value}) for value in (low, high))
        np.testing.assert_allclose(slope, (more - less) / (high - low), atol=1e-5)
