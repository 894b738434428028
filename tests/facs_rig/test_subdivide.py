"""Catmull-Clark subdivision, against its known limits."""

import numpy as np
import pytest

from facs_rig.subdivide import catmull_clark, refine, triangulate

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


def test_one_step_on_a_cube():
    """Face points 1, edge points 3/4, vertex points 5/9: by hand from the rules."""
    matrix, quads, edges, _ = catmull_clark(QUADS, 8)
    fine = matrix @ CUBE
    assert len(fine) == 8 + 12 + 6
    assert len(quads) == 24
    np.testing.assert_allclose(np.abs(fine[:8]), 5 / 9)
    edge_points = np.sort(np.abs(fine[8:20]), axis=1)
    np.testing.assert_allclose(edge_points, np.tile([0, 0.75, 0.75], (12, 1)), atol=1e-12)
    np.testing.assert_allclose(np.abs(fine[20:]).max(axis=1), 1)
    assert len(edges) == 12


def test_rows_are_affine():
    matrix, *_ = catmull_clark(QUADS, 8)
    np.testing.assert_allclose(np.asarray(matrix.sum(axis=1)).ravel(), 1)


def test_a_flat_grid_stays_flat_and_its_rim_straight():
    n = 4
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)]).astype(float)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    quads = np.stack([a, a + 1, a + n + 1, a + n], axis=1)
    fine = catmull_clark(quads, n * n)[0] @ vertices
    assert np.abs(fine[:, 2]).max() == 0
    assert fine[:, 0].min() == 0
    assert fine[:, 0].max() == 3


@pytest.mark.parametrize("levels", [[0, 0, 0, 0, 0, 0], [1, 0, 0, 2, 0, 0], [3, 1, 0, 2, 1, 1]])
def test_adaptive_refinement_leaves_no_crack(levels):
    fine = refine(QUADS, 8, np.array(levels))
    triangles = triangulate(fine.polygon_vertices, fine.polygon_starts)
    directed = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    forward = {tuple(e) for e in directed.tolist()}
    assert len(forward) == len(directed)  # every directed edge once ...
    assert {(b, a) for a, b in forward} == forward  # ... and its opposite in the neighbour
    assert set(fine.source) == set(range(6))


def test_uniform_refinement_is_plain_subdivision():
    fine = refine(QUADS, 8, np.full(6, 2))
    one, quads, *_ = catmull_clark(QUADS, 8)
    two, _, *_ = catmull_clark(quads, one.shape[0])
    expected = (two @ one) @ CUBE
    got = fine.matrix @ CUBE
    assert len(got) == len(expected)
    np.testing.assert_allclose(
        got[np.lexsort(got.round(5).T)], expected[np.lexsort(expected.round(5).T)], atol=1e-6
    )
