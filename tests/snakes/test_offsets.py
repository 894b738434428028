"""Fall-off curves, proportional edit, mirror and smoothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakes.offsets import (
    falloff,
    merge_handles,
    proportional_edit,
    reach_of,
    smoothing_matrix,
    symmetrise,
)
from snakes.tweakables import CURVES

HALF = {
    "smooth": 0.5,
    "sphere": np.sqrt(0.75),
    "root": np.sqrt(0.5),
    "inverse_square": 0.75,
    "sharp": 0.25,
    "linear": 0.5,
    "constant": 1.0,
}


@pytest.mark.parametrize("curve", CURVES)
def test_curves_at_the_handle_half_way_and_at_the_reach(curve):
    weights = falloff(np.array([0.0, 0.5, 1.0, 1.7]), curve)
    assert weights == pytest.approx([1.0, HALF[curve], 0.0, 0.0])


@pytest.mark.parametrize("curve", CURVES)
@given(at=st.lists(st.floats(0, 2), min_size=2, max_size=20))
def test_curves_never_rise_and_stay_between_0_and_1(curve, at):
    weights = falloff(np.sort(at), curve)
    assert np.all(np.diff(weights) <= 1e-12)
    assert weights.min() >= 0.0 and weights.max() <= 1.0


def test_an_unknown_curve_is_refused():
    with pytest.raises(ValueError, match="soft select curve is one of"):
        falloff(0.5, "cubic")


def line(n=101):
    """Vertices along x, a millimetre apart."""
    return np.stack([np.arange(n) * 1e-3, np.zeros(n), np.zeros(n)], axis=1)


def test_without_handles_nothing_moves():
    offsets, weights = proportional_edit(line(), np.zeros(0, int), np.zeros((0, 3)), 0.01)
    assert not offsets.any() and not weights.any()


@pytest.mark.parametrize("curve", CURVES)
def test_one_handle_moves_by_its_fall_off(curve):
    move = np.array([[0.0, 2e-3, 1e-3]])
    offsets, weights = proportional_edit(line(), np.array([50]), move, 0.01, curve)
    expected = falloff(np.abs(np.arange(101) - 50) / 10, curve)
    # At the very edge of the reach rounding decides a step.
    inside = np.abs(np.arange(101) - 50) != 10
    assert np.allclose(weights[inside], expected[inside])
    assert np.allclose(offsets[inside], expected[inside, None] * move)


def test_equal_handles_do_not_pile_up():
    handles = np.arange(40, 61)
    moves = np.tile([0.0, 1e-3, 0.0], (len(handles), 1))
    offsets, _ = proportional_edit(line(), handles, moves, 0.01)
    assert np.allclose(offsets[handles], moves)
    assert offsets[:, 1].max() <= 1e-3 + 1e-12
    # Beyond the last handle it falls off as from that handle alone.
    assert offsets[65, 1] == pytest.approx(0.5e-3)


def test_opposite_handles_cancel_between_them():
    moves = np.array([[0, 1e-3, 0], [0, -1e-3, 0]])
    offsets, _ = proportional_edit(line(), np.array([45, 55]), moves, 0.01)
    assert offsets[50] == pytest.approx([0, 0, 0], abs=1e-12)


@given(
    handles=st.lists(st.integers(0, 100), min_size=1, max_size=15, unique=True),
    seed=st.integers(0, 1000),
)
def test_no_vertex_moves_farther_than_the_farthest_handle(handles, seed):
    rng = np.random.default_rng(seed)
    moves = rng.normal(size=(len(handles), 3)) * 1e-3
    reach = rng.uniform(2e-3, 4e-2, len(handles))
    offsets, weights = proportional_edit(line(), np.array(handles), moves, reach)
    assert np.linalg.norm(offsets, axis=1).max() <= np.linalg.norm(moves, axis=1).max() + 1e-12
    assert 0.0 <= weights.min() and weights.max() <= 1.0 + 1e-12


def test_great_moves_reach_far_enough_not_to_fold_the_skin():
    moves = np.array([[0.0, 0.0, 0.0], [3e-2, 0.0, 0.0]])
    reach = reach_of(moves, 0.01)
    assert reach[0] == 0.01 and reach[1] > 0.03
    vertices = line(1001)
    offsets, _ = proportional_edit(vertices, np.array([500]), moves[1:], reach[1:])
    assert np.all(np.diff((vertices + offsets)[:, 0]) > 0)


def test_mirroring_symmetrical_offsets_changes_nothing(ball, rng):
    raw = rng.normal(size=(ball.n_vertices, 3))
    once = symmetrise(raw, ball.mirror)
    assert np.allclose(symmetrise(once, ball.mirror), once)
    flipped = once[ball.mirror] * [-1, 1, 1]
    assert np.allclose(flipped, once)
    assert not np.allclose(once, raw)


def test_the_unseen_side_follows_the_seen_one(ball):
    offsets = np.zeros((ball.n_vertices, 3))
    weights = np.zeros(ball.n_vertices)
    here = int(np.argmax(ball.vertices[:, 0]))
    there = int(ball.mirror[here])
    offsets[here], weights[here] = [1.0, 2.0, 3.0], 1.0
    result = symmetrise(offsets, ball.mirror, weights)
    assert np.allclose(result[here], [1, 2, 3]) and np.allclose(result[there], [-1, 2, 3])
    plain = symmetrise(offsets, ball.mirror)
    assert np.allclose(plain[here], [0.5, 1, 1.5])


def test_smoothing_keeps_what_is_constant_and_calms_the_rest(ball, rng):
    smoother = smoothing_matrix(ball.triangles, ball.n_vertices)
    assert np.allclose(smoother @ np.ones(ball.n_vertices), 1.0)
    noise = rng.normal(size=ball.n_vertices)
    assert (smoother @ noise).std() < 0.8 * noise.std()


def test_near_handles_are_merged_to_their_mean_and_far_ones_stay(rng):
    cluster = rng.uniform(0.1, 0.4, (10, 3)) * 1e-3  # within a cell of a quarter of 8 mm
    points = np.concatenate([cluster, [[0.05, 0.0, 0.0]]])
    moves = rng.normal(size=(11, 3)) * 1e-4
    chosen, merged, reach = merge_handles(points, moves, np.full(11, 8e-3))
    assert len(chosen) == 2 and 10 in chosen
    first = int(np.flatnonzero(chosen != 10)[0])
    assert np.allclose(merged[first], moves[:10].mean(axis=0))
    assert np.allclose(merged[1 - first], moves[10])
    assert np.allclose(reach, 8e-3)
