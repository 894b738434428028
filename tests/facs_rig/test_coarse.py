"""The face with fewer triangles: the same face, closed, and seen the same."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.coarse import coarse_rig
from facs_rig.mesh import triangle_normals, vertex_normals
from snakes.model_lines import face_contours

FACES = (
    FaceParameters(),
    FaceParameters(
        {"smile": 6.0, "frontalis": 5.0, "jaw_open": 3.0, "wince": 4.0},
        {"gender": 0.8, "age": 0.7, "nose_length": 0.6},
        head=(0.3, -0.1, 0.1), neck=(0.1, 0.05, 0.0), gaze=(0.2, -0.1),
    ),
)  # fmt: skip


@pytest.fixture(scope="module")
def rigs():
    rig = load_rig()
    return rig, coarse_rig(rig)


@pytest.mark.parametrize("face", FACES)
def test_its_vertices_lie_where_the_whole_face_has_them(rigs, face):
    fine, coarse = rigs
    posed, few = fine.pose(face), coarse.pose(face)
    away, at = cKDTree(fine.pose(FACES[0])).query(coarse.pose(FACES[0]))
    assert away.max() == pytest.approx(0, abs=1e-7) and len(np.unique(at)) == len(at)
    assert np.abs(posed[at] - few).max() < 1e-6
    assert np.abs(posed[fine.landmarks] - few[coarse.landmarks]).max() < 1e-6
    assert len(coarse.landmarks) == len(LANDMARKS)
    for name in fine.strokes:
        assert (
            np.abs(fine.stroke_points(posed, name) - coarse.stroke_points(few, name)).max() < 1e-6
        )


def test_it_is_closed_has_a_quarter_of_the_triangles_and_none_of_them_twice(rigs):
    fine, coarse = rigs
    triangles = coarse.triangles
    assert len(triangles) < 0.28 * len(fine.triangles)
    assert len(np.unique(np.sort(triangles, axis=1), axis=0)) == len(triangles)
    ends = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    uses = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)[1]
    assert uses.max() == 2 and (uses == 1).mean() < 0.005  # the rim of the neck and of the eyes
    posed = coarse.pose(FACES[0]).astype(float)
    flat = triangle_normals(posed, triangles)
    smooth = vertex_normals(posed, triangles)[triangles].mean(axis=1)
    assert ((flat * smooth).sum(axis=1) < 0).mean() < 0.01  # nothing folds over


@pytest.mark.parametrize("face", FACES)
def test_its_outlines_are_those_of_the_whole_face(rigs, face):
    posed = rigs[0].pose(face)
    camera = Camera.framing(posed, 512, 512)
    lines = [face_contours(rig, rig.pose(face), camera).lines.points for rig in rigs]
    there, back = (cKDTree(one).query(other)[0] for one, other in (lines, lines[::-1]))
    # The points of each stand 3 to 4 pixels apart, and an ear has many small lines.
    assert np.mean(there < 3) > 0.93 and np.mean(back < 3) > 0.9


def test_what_is_cached_of_the_whole_face_is_not_taken_over(rigs):
    fine, coarse = rigs
    assert fine.neutral().shape == (fine.n_vertices, 3)
    assert coarse.neutral().shape == (coarse.n_vertices, 3)
    assert coarse is coarse_rig(fine)


def test_the_plain_face_cannot_be_written_to(rigs):
    with pytest.raises(ValueError, match="read-only"):
        rigs[0].neutral()[0] = 1.0
    assert rigs[0].neutral({"age": 0.5}).flags.writeable
