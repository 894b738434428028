"""Where the camera stands: landmarks, ink, or a box given by hand."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.common.box import Box
from snakes import align, align_landmarks, ink_box
from snakes.alignment import head_mask

CAMERA = Camera(640, 480, (1800.0, 1800.0), (333.0, 250.0))


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def blank():
    return np.ones((480, 640), dtype=np.float32)


def test_exact_landmarks_give_the_exact_camera(rig):
    parameters = FaceParameters(head=(0.2, -0.1, 0.15))
    model = rig.pose(parameters)[rig.landmarks]
    found = align_landmarks(CAMERA.project(model), model, (640, 480))
    assert found.scale == pytest.approx(CAMERA.scale, rel=1e-5)
    assert found.centre == pytest.approx(CAMERA.centre, abs=1e-2)
    assert (found.width, found.height) == (640, 480)


def test_a_few_landmarks_in_the_wrong_place_do_no_harm(rig, rng):
    model = rig.pose(FaceParameters())[rig.landmarks]
    points = CAMERA.project(model).astype(float)
    wrong = rng.choice(len(points), len(points) // 6, replace=False)
    points[wrong] += rng.uniform(80, 200, (len(wrong), 2))
    found = align_landmarks(points, model, (640, 480))
    assert np.abs(found.project(model) - CAMERA.project(model)).max() < 1.0


def test_landmarks_upside_down_are_refused(rig):
    model = rig.pose(FaceParameters())[rig.landmarks]
    upside_down = 600.0 - CAMERA.project(model)
    with pytest.raises(ValueError, match="upright"):
        align_landmarks(upside_down, model, (640, 480))
    with pytest.raises(ValueError, match="two or more"):
        align_landmarks(upside_down[:1], model[:1], (640, 480))


def test_landmarks_by_name_and_a_box_overrides_them(rig):
    parameters = FaceParameters()
    model = rig.pose(parameters)[rig.landmarks]
    named = dict(zip(LANDMARKS, CAMERA.project(model).tolist(), strict=True))
    named["of another program"] = (0.0, 0.0)
    found = align(blank(), rig, parameters, named)
    assert found.scale == pytest.approx(CAMERA.scale, rel=1e-4)
    boxed = align(blank(), rig, parameters, named, "100,50,300,330")
    pixels = boxed.project(rig.pose(parameters)[head_mask(rig, rig.pose(parameters))])
    middle = (pixels.min(axis=0) + pixels.max(axis=0)) / 2
    assert middle == pytest.approx([200, 190], abs=0.01)
    assert boxed.scale[0] == boxed.scale[1]
    extent = np.ptp(pixels, axis=0)
    # One scale for both axes: one side a little over the box, the other a little under.
    assert (extent - [200, 280]).min() <= 0 <= (extent - [200, 280]).max()


@pytest.mark.parametrize("neck", [True, False])
def test_the_ink_alone_places_the_face(rig, neck):
    vertices = rig.pose(FaceParameters())
    shown = rig.parts["skin"] if neck else head_mask(rig, vertices)
    camera = Camera(640, 480, (1200.0, 1200.0), (320.0, 240.0))
    drawing = blank()
    columns, rows = np.floor(camera.project(vertices[shown])).astype(int).T
    drawing[rows, columns] = 0.0
    found = align(drawing, rig, FaceParameters())
    assert found.scale == pytest.approx(camera.scale, rel=0.03)
    assert found.centre == pytest.approx(camera.centre, abs=6)


def test_a_blank_sketch_has_no_box():
    with pytest.raises(ValueError, match="blank"):
        ink_box(blank())


def test_stray_dots_do_not_widen_the_box():
    drawing = blank()
    drawing[100:300, 200] = drawing[100:300, 400] = 0.0
    drawing[100, 200:400] = drawing[300, 200:401] = 0.0
    drawing[5, 5] = 0.0
    assert tuple(ink_box(drawing)) == pytest.approx((200, 100, 401, 301), abs=2)


@pytest.mark.parametrize("text", ["", "1,2,3", "a,b,c,d", "10,10,5,20", "1,2,3,nan", "1,2,3,4,5"])
def test_a_bad_box_gives_one_sentence(text):
    with pytest.raises(ValueError, match="The head's box") as failure:
        Box.parse(text, "The head's box")
    assert str(failure.value).endswith(".") and "\n" not in str(failure.value)


def test_a_box_is_read():
    assert tuple(Box.parse(" 10, 20,30.5 ,40")) == (10.0, 20.0, 30.5, 40.0)
