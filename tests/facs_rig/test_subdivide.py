"""Catmull-Clark subdivision, against its known limits."""

import numpy as np
import pytest

from facs_rig.evenness import mirror_images
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


def sphere(steps=2):
    """The vertices of a cube subdivided, on their sphere, and its quads."""
    vertices, quads = CUBE, QUADS
    for _ in range(steps):
        matrix, quads, *_ = catmull_clark(quads, len(vertices))
        vertices = matrix @ vertices
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), quads


def mirror_of(vertices):
    apart = np.linalg.norm(vertices[:, None] - vertices * [-1, 1, 1], axis=2)
    assert apart.min(axis=0).max() < 1e-9
    return apart.argmin(axis=0)


def graded(level, quads):
    """Levels raised until neighbours differ by one at most."""
    near = (quads[:, None, :, None] == quads[None, :, None, :]).any(axis=3).sum(axis=2) == 2
    while True:
        least = np.where(near, level[None] - 1, 0).max(axis=1)
        if (least <= level).all():
            return level
        level = np.maximum(level, least)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_what_lies_between_coarse_and_fine_quads_is_quads(seed, symmetric):
    vertices, quads = sphere()
    rng = np.random.default_rng(seed)
    level = rng.choice(4, len(quads), p=[0.75, 0.1, 0.1, 0.05])
    mirror = mirror_of(vertices) if symmetric else None
    if symmetric:
        level = np.maximum(level, level[mirror_images(quads, mirror)])
    level = graded(level, quads)
    fine = refine(quads, len(vertices), level, mirror)
    assert (np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices))) == 4).all()
    edges = np.stack(
        [fine.polygon_vertices.reshape(-1, 4), np.roll(fine.polygon_vertices.reshape(-1, 4), -1, 1)]
    ).reshape(2, -1)
    assert len(np.unique(edges, axis=1).T) == edges.shape[1]  # every directed edge once ...
    assert set(map(tuple, edges.T)) == set(map(tuple, edges[::-1].T))  # ... and its opposite
    if symmetric:
        there = mirror_of(fine.matrix @ vertices)
        mirror_images(fine.polygon_vertices.reshape(-1, 4), there)  # raises if it is not


def test_places_in_the_cages_quads_are_where_the_corners_come_to_lie():
    """On a flat grid subdivision moves nothing: bilinear places are the vertices themselves."""
    n = 5
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    vertices = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    quads = np.stack([a, a + 1, a + n + 1, a + n], axis=1)
    level = np.zeros(len(quads), dtype=int)
    level[[5, 10]] = 2, 1
    fine = refine(quads, n * n, graded(level, quads))
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    corners = vertices[quads[np.repeat(fine.source, sizes)]]
    s, t = fine.places.T
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
    bilinear = np.einsum("ck,ckd->cd", weights, corners)
    inner = (bilinear > 1).all(axis=1) & (bilinear < n - 2).all(axis=1)  # the rim pulls the rest
    assert inner.sum() > 30
    got = (fine.matrix @ vertices)[fine.polygon_vertices]
    np.testing.assert_allclose(got[inner], bilinear[inner], atol=1e-5)


def test_a_mesh_that_is_no_mirror_image_of_itself_is_refused():
    vertices, quads = sphere(1)
    mirror = mirror_of(vertices)
    with pytest.raises(ValueError, match="mirror image"):
        mirror_images(quads[1:], mirror)


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
