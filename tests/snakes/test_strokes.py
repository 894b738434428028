"""Which strokes without a place on the face are carved into it."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import LANDMARKS, Camera, FaceParameters, landmark_points, load_rig
from facs_rig.anatomy import smooth_curve
from facs_rig.baking.creases import CREASES
from snakes import carvable

SIZE = 600


@pytest.fixture(scope="module")
def face():
    """The rig, its posed vertices, a camera, and its landmarks in pixels."""
    rig = load_rig()
    posed = rig.pose(FaceParameters())
    camera = Camera.framing(posed, SIZE, SIZE, 0.05)
    places = {k: camera.project(v) for k, v in landmark_points(rig, posed).items()}
    return rig, posed, camera, places


def between(a, b, count=40):
    return np.linspace(a, b, count)


def scar(places):
    """A line across the left cheek, where the face is plain."""
    return between(places["cheekbone_left"] + [-25, 5], places["mouth_corner_left"] + [35, -10])


def test_a_scar_is_carved_and_one_over_the_brow_and_the_eye_too(face):
    rig, posed, camera, places = face
    over = between(places["brow_peak_left"] - [0, 40], places["eye_bottom_left"] + [2, 45])
    lines = [scar(places), over]
    assert len(carvable(lines, rig, posed, camera)) == 2
    assert carvable([], rig, posed, camera) == []


def test_what_every_face_has_is_not_carved(face):
    rig, posed, camera, places = face
    brow = camera.project(rig.stroke_points(posed, "brow_upper_left")) - [0, 6]
    lip = camera.project(rig.stroke_points(posed, "lip_lower")) + [0, 5]
    assert carvable([brow, lip], rig, posed, camera) == []


def test_a_line_that_the_face_shows_anyway_is_not_carved(face):
    """A worry line lies where raised brows crease the forehead."""
    rig, rest, *_ = face
    worried = rig.pose(FaceParameters({"frontalis": 5.0}))
    camera = Camera.framing(worried, SIZE, SIZE, 0.05)
    (crease,) = (smooth_curve(c.points, 40) for c in CREASES["worry"][1:2])
    eyes = rest[rig.landmarks[LANDMARKS.index("pupil_left")]] * [0, 1, 0]
    line = camera.project(np.column_stack([0.01 * crease, np.zeros(40)]) + eyes)
    assert len(carvable([line], rig, rest, camera)) == 1
    assert carvable([line], rig, worried, camera) == []


def test_hair_and_what_lies_off_the_face_is_not_carved(face):
    rig, posed, camera, places = face
    crown = between(places["forehead"] + [-40, -45], places["forehead"] + [40, -45])
    side = between(places["temple_left"] + [45, -60], places["temple_left"] + [45, 60])
    neck = between(places["chin"] + [-20, 60], places["chin"] + [20, 60])
    beside = np.array([[5.0, 5.0], [5.0, 200.0]])
    assert carvable([crown, side, neck, beside], rig, posed, camera) == []


def test_hatching_is_a_crowd_and_a_few_wrinkles_are_none(face):
    rig, posed, camera, places = face
    middle = places["forehead"] + [0, 20]
    pixel = camera.scale[0] * 1e-3  # of a millimetre

    def parallel(count, gap):
        rise = (np.arange(count) - count / 2) * gap * pixel
        return [between(middle + [-25 * pixel, y], middle + [25 * pixel, y]) for y in rise]

    assert len(carvable(parallel(3, 10.0), rig, posed, camera)) == 3
    assert carvable(parallel(9, 4.0), rig, posed, camera) == []
