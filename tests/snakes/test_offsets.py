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
    chosen, merged, reach = merge_handles(points, np.arange(11), moves, np.full(11, 8e-3))
    assert len(chosen) == 2 and 10 in chosen
    first = int(np.flatnonzero(chosen != 10)[0])
    assert np.allclose(merged[first], moves[:10].mean(axis=0))
    assert np.allclose(merged[1 - first], moves[10])
    assert np.allclose(reach, 8e-3)


def lips(n=41):
    """Two strips of skin over one another, a millimetre apart, joined at their last column.

    Returns vertices (2 * 3 * n, 3) in metres, triangles, and the vertex in the middle of either
    strip that is nearest to the other.
    """
    x, y = np.meshgrid(np.arange(n) * 1e-3, np.arange(3) * 1e-3)
    lower = np.stack([x.ravel(), -y.ravel() - 5e-4, np.zeros(3 * n)], axis=1)
    index = np.arange(6 * n).reshape(6, n)  # rows 0..2 lower, 3..5 upper
    quads = [(row, column) for row in (0, 1, 3, 4) for column in range(n - 1)]
    triangles = []
    for row, column in quads:
        a, b = index[row, column], index[row, column + 1]
        c, d = index[row + 1, column + 1], index[row + 1, column]
        triangles += [(a, b, c), (a, c, d)]
    corner = [
        (index[0, -2], index[0, -1], index[3, -1]),
        (index[0, -2], index[3, -1], index[3, -2]),
    ]
    vertices = np.concatenate([lower, lower * [1, -1, 1]])
    return vertices, np.array(triangles + corner), int(index[0, n // 2]), int(index[3, n // 2])


def test_on_the_surface_a_lip_does_not_pull_the_other_lip():
    vertices, triangles, below, above = lips()
    move = np.array([[0.0, -1e-3, 0.0]])
    near, _ = proportional_edit(vertices, np.array([below]), move, 0.01)
    over, weights = proportional_edit(vertices, np.array([below]), move, 0.01, triangles=triangles)
    assert near[above, 1] < -0.8e-3
    assert not over[above].any() and weights[above] == 0.0
    own = slice(0, len(vertices) // 2)
    assert np.allclose(over[own], near[own])  # flat: over the skin is straight
    # At the corner of the mouth there is a way round, 20 mm there and 20 mm back.
    far, _ = proportional_edit(vertices, np.array([below]), move, 0.05, triangles=triangles)
    assert far[above, 1] == pytest.approx(-1e-3 * (1 - 40 / 50), abs=0.1e-3)


def test_handles_of_two_lips_are_not_merged():
    vertices, triangles, below, above = lips()
    handles = np.array([below, below + 1, above, above + 1])
    moves = np.array([[0, -1e-3, 0]] * 2 + [[0, 1e-3, 0]] * 2)
    vertices = vertices + [0.0, 1e-3, 0.0]  # into one cell
    together, _, _ = merge_handles(vertices, handles, moves, np.full(4, 0.02))
    connected, mean, _ = merge_handles(
        vertices, handles, moves, np.full(4, 0.02), triangles=triangles
    )
    assert len(together) == 1
    assert len(connected) == 2 and sorted(mean[:, 1]) == pytest.approx([-1e-3, 1e-3])


def test_opposite_moves_meet_half_way_round_a_ball(ball):
    """Distance over a sphere is the arc: two poles that move apart leave the equator at rest."""
    poles = np.array([ball.n_vertices - 2, ball.n_vertices - 1])
    moves = np.array([[0, 1e-2, 0], [0, -1e-2, 0]])
    radius = np.linalg.norm(ball.vertices[0])
    offsets, weights = proportional_edit(
        ball.vertices, poles, moves, np.pi * radius, triangles=ball.triangles
    )
    height = ball.vertices[:, 1] / radius
    arc = np.arccos(np.abs(height))
    assert np.allclose(weights, 1 - arc / np.pi, atol=2e-3)
    assert np.abs(offsets[np.abs(height) < 0.01]).max() < 1e-4


def test_bad_input_to_the_proportional_edit_gives_one_sentence():
    one, move = np.array([0]), np.array([[0.0, 1e-3, 0.0]])
    with pytest.raises(ValueError, match=r"^The reach of a handle is above 0 m, not -0.01 m\.$"):
        proportional_edit(line(), one, move, -0.01)
    with pytest.raises(ValueError, match=r"^The triangles name vertices outside 0 to 100\.$"):
        proportional_edit(line(), one, move, 0.01, triangles=np.array([[0, 1, 101]]))
    with pytest.raises(
        ValueError, match=r"^The triangles have the shape \(t, 3\), not \(1, 4\)\.$"
    ):
        proportional_edit(line(), one, move, 0.01, triangles=np.array([[0, 1, 2, 3]]))
