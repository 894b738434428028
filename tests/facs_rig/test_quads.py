"""The mesh as riggers work on it: quads, none of them folded, in loops around eyes and mouth."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import landmark_points, load_rig
from facs_rig.anatomy import HAIR_PARTS, PART_NAMES
from facs_rig.levels import at_level
from facs_rig.paint import _inside

MESHES = ("full", "medium")


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def quads_of(rig):
    """(q, 4) the quads, and (t,) the parts of the triangles."""
    flat, starts = rig.polygon_vertices, rig.polygon_starts
    sizes = np.diff(np.append(starts, len(flat)))
    assert set(np.unique(sizes)) <= {3, 4}
    quads = flat[starts[sizes == 4][:, None] + np.arange(4)]
    return quads, rig.vertex_part[flat[starts[sizes == 3]]]


@pytest.mark.parametrize("mesh", MESHES)
def test_all_but_the_tips_of_hairs_are_quads(rig, mesh):
    rig = at_level(rig, mesh)
    quads, of_triangles = quads_of(rig)
    assert np.isin(of_triangles, [PART_NAMES.index(name) for name in HAIR_PARTS]).all()
    assert len(of_triangles) < 2000 < len(quads)


@pytest.mark.parametrize("mesh", MESHES)
def test_no_quad_is_folded_or_without_area(rig, mesh):
    """Each corner turns the same way as the quad, and none is straight but for a degree."""
    rig = at_level(rig, mesh)
    quads, _ = quads_of(rig)
    quads = quads[rig.vertex_part[quads[:, 0]] == PART_NAMES.index("skin")]
    corner = rig.neutral().astype(float)[quads]
    ahead = np.roll(corner, -1, axis=1) - corner
    normals = np.cross(np.roll(ahead, 1, axis=1), ahead)
    whole = normals.sum(axis=1, keepdims=True)
    length, size = (np.linalg.norm(n, axis=2) for n in (normals, whole))
    assert ((normals * whole).sum(axis=2) > 0.2 * length * size).all()
    sides = np.linalg.norm(ahead, axis=2)
    assert (length > np.sin(np.radians(1)) * sides * np.roll(sides, 1, axis=1)).all()
    assert sides.min() > 5e-6


def closed_loops(quads):
    """Edge loops that come back to themselves: the vertices of each.

    Where four quads meet, a loop goes on along the edge that has no quad with its last one.
    """
    after = np.roll(quads, -1, axis=1)
    ends = np.sort(np.stack([quads, after], axis=2).reshape(-1, 2), axis=1)
    edges, of_quad, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    of_quad = of_quad.reshape(-1, 4)
    around: dict[int, set[int]] = {}
    for k, pair in enumerate(edges.tolist()):
        for vertex in pair:
            around.setdefault(vertex, set()).add(k)
    beside: dict[tuple[int, int], set[int]] = {}
    for vertex, one, other in zip(
        quads.ravel().tolist(),
        of_quad.ravel().tolist(),
        np.roll(of_quad, 1, axis=1).ravel().tolist(),
        strict=True,
    ):
        beside.setdefault((vertex, one), set()).add(other)
        beside.setdefault((vertex, other), set()).add(one)
    rim = set(edges[uses == 1].ravel().tolist())
    seen: set[int] = set()
    for start in range(len(edges)):
        if start in seen:
            continue
        edge, vertex = start, int(edges[start, 1])
        walked, passed = [start], [vertex]
        while len(around[vertex]) == 4 and vertex not in rim:
            (edge,) = around[vertex] - {edge} - beside[vertex, edge]
            if edge == start:
                yield passed
                break
            vertex = int(edges[edge].sum()) - vertex
            walked.append(edge)
            passed.append(vertex)
        seen |= set(walked)  # whether it came back or not


@pytest.mark.parametrize(("mesh", "lids", "lips"), [("full", 10, 8), ("medium", 4, 3)])
def test_closed_edge_loops_lie_around_lids_and_lips(rig, mesh, lids, lips):
    """As many as the source has; the innermost is the rim itself, and the others widen."""
    rig = at_level(rig, mesh)
    quads, _ = quads_of(rig)
    quads = quads[rig.vertex_part[quads[:, 0]] == PART_NAMES.index("skin")]
    vertices = rig.neutral().astype(float)
    place = landmark_points(rig, vertices)
    loops = [vertices[loop] for loop in closed_loops(quads)]
    mouth = (place["lip_inner_top"] + place["lip_inner_bottom"]) / 2

    def around(centre, reach):
        near = [loop for loop in loops if np.linalg.norm(loop - centre, axis=1).max() < reach]
        return [loop for loop in near if _inside(centre[None, :2], loop[:, :2])[0]]

    for side in ("left", "right"):
        found = around(place[f"pupil_{side}"], 0.05)
        assert len(found) >= lids
        width = np.linalg.norm(place[f"eye_outer_{side}"] - place[f"eye_inner_{side}"])
        assert min(np.ptp(loop[:, 0]) for loop in found) < width  # as near as the rim of the lids
    found = around(mouth, 0.06)
    assert len(found) >= lips
    width = np.linalg.norm(place["mouth_corner_left"] - place["mouth_corner_right"])
    assert min(np.ptp(loop[:, 0]) for loop in found) < width
