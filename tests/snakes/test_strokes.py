"""Which strokes of a drawing have no place on the face, and which are carved."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw

from facs_rig import LANDMARKS, Camera, FaceParameters, landmark_points, load_rig
from facs_rig.anatomy import smooth_curve
from facs_rig.baking.creases import CREASES
from snakes import carvable, unmatched_strokes
from snakes.strokes import centre_lines

SIZE = 600
BOX = (0.0, 0.0, 400.0, 400.0)


def page(*lines, size=400, width=3):
    """A drawing (size, size) of polylines."""
    image = Image.new("L", (size, size), 255)
    draw = ImageDraw.Draw(image)
    for line in lines:
        draw.line([tuple(point) for point in line], fill=0, width=width)
    return np.asarray(image, dtype=np.float32) / 255


def length(line):
    return np.linalg.norm(np.diff(line, axis=0), axis=1).sum()


def test_a_stroke_is_one_line_along_the_middle_of_its_ink():
    *spurs, line = sorted(centre_lines(page([(50, 80), (350, 200)], width=7), BOX), key=length)
    assert all(length(spur) < 8 for spur in spurs)  # the corners of its blunt ends
    assert length(line) == pytest.approx(np.hypot(300, 120), rel=0.09)  # in stairs
    off = np.abs((line - [50, 80]) @ np.array([-120, 300]) / np.hypot(300, 120))
    assert off[10:-10].max() < 1.5


def test_crossing_strokes_go_straight_on():
    lines = centre_lines(page([(50, 60), (350, 340)], [(60, 330), (340, 70)]), BOX)
    longest = max(lines, key=length)
    assert length(longest) > 390  # one of the two, whole
    assert np.ptp(longest, axis=0).min() > 250


def test_a_ring_is_closed_and_a_blank_page_empty():
    turn = np.linspace(0, 2 * np.pi, 80)
    ring = 200 + 100 * np.column_stack([np.cos(turn), np.sin(turn)])
    (line,) = centre_lines(page(ring), BOX)
    assert (line[0] == line[-1]).all() and length(line) == pytest.approx(628, rel=0.08)
    assert centre_lines(np.ones((400, 400)), BOX) == []


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


def test_a_stroke_counts_as_whole_when_most_of_it_is_unmatched(face):
    _, posed, camera, places = face
    line = scar(places)
    drawing = page(line, size=SIZE)
    most, little = line[:28], line[:10]
    (found,) = unmatched_strokes(drawing, [most], posed, camera)
    assert length(found) == pytest.approx(length(line), rel=0.1)
    assert unmatched_strokes(drawing, [little], posed, camera) == []
    assert unmatched_strokes(drawing, [], posed, camera) == []


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
