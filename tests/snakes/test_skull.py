"""Where hair hides the skull, and where it ends."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from snakes.lines import HEAD, Lines
from snakes.model_lines import face_lines
from snakes.shape import Observations, fit_shape
from snakes.skull import beyond_hair, skull_triangles, under_hair

NONE = Lines(np.zeros((0, 2)), np.zeros((0, 2)))
PLAIN = FaceParameters({}, {"gender": 0.9, "jaw_width": 0.7})


@pytest.fixture(scope="module")
def face():
    """(rig, camera, the lines of a face's outline)."""
    rig = load_rig()
    posed = rig.pose(PLAIN)
    camera = Camera.framing(posed, 400, 400)
    return rig, camera, face_lines(rig, posed, camera, kinds=("contour",), step=2.0)


def test_hair_is_more_than_one_line_over_the_skull(face):
    rig, camera, model = face
    points, over = model.lines.points, skull_triangles(rig)[model.triangle]
    head = HEAD * camera.scale[0]
    assert 0.1 < over.mean() < 0.6
    plain = under_hair(model.lines, points, over, head)
    marks = camera.project(rig.pose(PLAIN)[rig.landmarks])
    brows = min(marks[LANDMARKS.index(f"brow_peak_{side}")][1] for side in ("left", "right"))
    # Lower, where the ears begin, there are other lines.
    above = over & (points[:, 1] < brows - 0.04 * head)
    assert above.sum() > 0.7 * over.sum() and (plain & above).sum() < 0.1 * above.sum()
    strands = [model.lines.points + (0, -k) for k in range(0, 9, 3)]
    wisps = Lines(np.concatenate(strands), np.tile(model.lines.along, (3, 1)))
    assert under_hair(wisps, points, over, head).sum() > 0.9 * over.sum()
    left = points[:, 0] < 200
    beside = Lines(wisps.points[wisps.points[:, 0] < 200], wisps.along[wisps.points[:, 0] < 200])
    half = Lines(*(np.concatenate([getattr(a, n) for a in (model.lines, beside)])
                   for n in ("points", "along")))  # fmt: skip
    found = under_hair(half, points, over, head)
    assert found[left & over].mean() > 0.8 and found[~left & over].mean() < 0.3
    assert not under_hair(NONE, points, over, head).any()
    assert not under_hair(wisps, points, np.zeros(len(over), bool), head).any()


def test_hair_that_was_seen_hides_the_skull_beside_it(face):
    rig, camera, model = face
    points, over = model.lines.points, skull_triangles(rig)[model.triangle]
    head = HEAD * camera.scale[0]
    plain = under_hair(model.lines, points, over, head)

    def mane(at):  # all over the left of the picture
        return at[:, 0] < 200

    found = under_hair(model.lines, points, over, head, mane)
    middle = np.abs(points[:, 0] - 200) < 0.07 * head
    assert found[over & (points[:, 0] < 200)].all()
    right = over & (points[:, 0] > 200) & ~middle
    assert (found == plain)[right].all() and not found[~over].any()


def crown(camera, height, width=0.35):
    """(k, 2) hair that ends so far above a head's middle, both in heads."""
    turns = np.linspace(-0.8 * np.pi, -0.2 * np.pi, 200)
    head = HEAD * camera.scale[0]
    arc = np.stack([width * np.cos(turns), height * np.sin(turns)], axis=1)
    return camera.project(np.zeros(3)) + head * arc


def test_a_skull_ends_where_hair_ends(face):
    rig, camera, model = face
    low, high = crown(camera, 0.45), crown(camera, 3.0, 3.0)
    out, inward = beyond_hair(model, rig, camera, low[:0], low)
    assert skull_triangles(rig)[model.triangle[out]].all() and len(out) > 10
    moved = model.lines.points[out] + inward
    ends = np.linalg.norm(moved[:, None] - low, axis=2).min(axis=1)
    assert ends.max() < 0.06 * HEAD * camera.scale[0]  # a sector's most
    middle = camera.project(np.zeros(3))
    far = np.linalg.norm(model.lines.points[out] - middle, axis=1)
    assert (np.linalg.norm(moved - middle, axis=1) < far).all()
    # Not where something else is drawn outside, nor inside of the hair, nor where there is none.
    for drawn, mane in ((high, low), (low[:0], high), (low, low[:0]), (low, None)):
        assert not len(beyond_hair(model, rig, camera, drawn, mane)[0])


def test_hair_that_leaves_the_page_ends_nowhere(face):
    rig, camera, model = face
    edge = np.stack([np.linspace(100, 300, 200), np.full(200, 0.5)], axis=1)
    assert not len(beyond_hair(model, rig, camera, edge[:0], edge)[0])


def test_a_head_is_no_taller_than_its_hair(face):
    rig, camera, _ = face
    low = crown(camera, 0.42, 0.3)

    def top(mane):
        seen = Observations({}, {}, mane=mane)
        found, eye = fit_shape(Lines(low + 1000, low), rig, PLAIN, camera, seen)
        return eye.project(rig.pose(found))[:, 1].min()

    assert top(low) > top(None) + 3
