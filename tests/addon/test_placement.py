"""Where the artist says that things are: what can be meant is taken, and the rest refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.drawing import load_drawing
from addon.pipeline import FitOptions, fit
from addon.placement import camera_for, head_in
from addon.sketches.render import FOLDER as SKETCHES
from facs_rig import LANDMARKS, FaceParameters, load_rig
from facs_rig.common.errors import InputError
from snakes import HEAD, shape
from snakes.shape import ROOM
from tests.nightly import at_night

SKETCH = SKETCHES / "smiling_woman.png"  # 768 x 768, the head from about 150,80 to 620,640


@pytest.fixture(scope="module")
def drawing():
    return load_drawing(SKETCH)


@pytest.fixture(scope="module")
def plain():
    return fit(SKETCH)


BOXES = {
    "2000,2000,3000,3000": "lies mostly outside the sketch, which has 768×768 pixels",
    "-3000,-3000,-2000,-2000": "lies mostly outside",
    "-1e9,-1e9,1e9,1e9": "lies mostly outside",
    "1e300,2,3e300,500": "lies mostly outside",
    "600,0,1200,600": "lies mostly outside",
    "0,0,1,1": "is too small: a face needs at least 32×32 pixels",
    "0,0,768,1": "is too small",
    "0,0,31,600": "is too small",
    "300,0,340,768": "is no head's: it is 40 pixels wide and 768 high",
    "0,0,40,40": "There is nothing drawn in the head's box '0,0,40,40'",
    "200,0,100,300": "is empty",
    "100,100,100,300": "is empty",
    "1,2,3": "left,top,right,bottom",
    "nan,0,100,100": "left,top,right,bottom",
    "0,0,inf,100": "left,top,right,bottom",
    "": "left,top,right,bottom",
    "a,b,c,d": "left,top,right,bottom",
    "٣,٣,٣٠٠,٣٠٠x": "left,top,right,bottom",
}


@pytest.mark.parametrize("box", BOXES)
def test_a_box_that_holds_no_head_is_refused(drawing, box):
    with pytest.raises(InputError) as told:
        head_in(drawing, box)
    assert BOXES[box] in str(told.value)
    with pytest.raises(InputError):
        fit(drawing, FitOptions(align=box))


@pytest.mark.parametrize("box", ["150,80,620,640", "0,0,768,768", "100,-200,700,700"])
def test_a_box_that_holds_the_head_is_taken(drawing, plain, box):
    crop = head_in(drawing, box)
    assert [crop.left, crop.top] == [float(value) for value in box.split(",")[:2]]
    found = fit(drawing, FitOptions(align=box))
    assert np.isfinite(found.vertices).all()
    if box == "150,80,620,640":
        assert found.contour_error_px["fitted"] < 1.3 * plain.contour_error_px["fitted"]


def test_boxes_are_told_in_pixels_of_the_picture_that_was_handed_in(tmp_path):
    from PIL import Image

    Image.open(SKETCH).resize((3072, 3072)).save(tmp_path / "big.png")  # reduced to 2048
    big = load_drawing(tmp_path / "big.png")
    with pytest.raises(InputError, match="at least 48×48 pixels"):
        head_in(big, "600,600,640,640")
    assert head_in(big, "600,320,2480,2560") is not None


def places(face) -> dict[str, np.ndarray]:
    found = face.camera.project(face.vertices[face.rig.landmarks])[:, :2]
    return dict(zip(LANDMARKS, found, strict=True))


FAR = {
    "outside": {"nose_tip": (9000, 9000)},
    "beyond": {"nose_tip": (1e300, 3)},
    "before": {"nose_tip": (-1, 300)},
    "corner": {"nose_tip": (760, 760)},
    "one_place": dict.fromkeys(LANDMARKS, (300, 300)),
    "four_in_one": dict.fromkeys(("nose_tip", "chin", "forehead", "pupil_left"), (300, 300)),
    "two_in_one": dict.fromkeys(("nose_tip", "chin"), (300, 300)),
    "apart": {"eye_inner_left": (740, 300), "eye_inner_right": (20, 300)},
    "crossed": {"chin": (400, 100), "forehead": (400, 600)},
}


@pytest.mark.parametrize("method", ["lines", "shape"])
@pytest.mark.parametrize("kind", FAR)
def test_pins_that_no_face_can_have_are_refused(drawing, kind, method):
    with pytest.raises(InputError) as told:
        fit(drawing, FitOptions(pins=FAR[kind], method=method))
    assert any(name in str(told.value) for name in FAR[kind])
    assert "\n" not in str(told.value) and len(str(told.value)) < 250


@pytest.mark.parametrize("kind", ["outside", "beyond", "before", "one_place"])
def test_in_the_thesis_method_too(drawing, kind):
    with pytest.raises(InputError):
        fit(drawing, FitOptions(pins=FAR[kind], method="thesis"))


def test_pins_are_measured_from_a_box_where_there_is_one(drawing):
    with pytest.raises(InputError, match="chin at 1,1 is far from the head"):
        fit(drawing, FitOptions(pins={"chin": (1, 1)}, align="300,300,600,640"))


@pytest.mark.parametrize("method", ["lines", "shape"])
@pytest.mark.parametrize("count", [1, 4, 12])
@pytest.mark.parametrize("off", [*map(at_night, (0.02, 0.05)), 0.1])
def test_pins_of_a_free_hand_are_taken(drawing, plain, method, count, off):
    """Exaggerated, and contradicting each other by a tenth of the head: a caricature has that."""
    rng = np.random.default_rng([count, int(1000 * off)])
    head = HEAD * plain.camera.scale[0]
    there = places(plain)
    names = rng.choice(LANDMARKS, count, replace=False)
    pins = {name: tuple(there[name] + off * head * rng.normal(size=2)) for name in names}
    pins = {name: tuple(np.clip(place, 0, 768)) for name, place in pins.items()}
    found = fit(drawing, FitOptions(pins=pins, method=method))
    if count == 1:
        (name,) = pins
        assert np.linalg.norm(places(found)[name] - pins[name]) < 0.03 * head


@pytest.mark.parametrize("factor", [0.9 / ROOM, 1.1 * ROOM, 1e6])
def test_a_head_that_pins_blow_up_is_not_drawn(drawing, monkeypatch, factor):
    """As far as pins may stretch a head it is drawn; beyond that its pixels have no bound."""
    drawn = []

    def stretched(self, values, parameters, camera):
        found, near = face(self, values, parameters, camera)
        return found, replace(near, scale=tuple(factor * s for s in near.scale))

    def draw(rig, posed, camera):
        drawn.append(camera)
        return face_contours(rig, posed, camera)

    face, face_contours = shape._Guess.face, shape.face_contours
    monkeypatch.setattr(shape, "face_contours", draw)
    fit(drawing, FitOptions(pins={"chin": (390.0, 560.0)}, method="shape"))
    usual = len(drawn)
    assert usual > 1
    monkeypatch.setattr(shape._Guess, "face", stretched)
    with pytest.raises(InputError, match="chin"):
        fit(drawing, FitOptions(pins={"chin": (390.0, 560.0)}, method="shape"))
    assert len(drawn) == usual


def test_landmarks_that_form_no_face_are_the_sketchs_matter(drawing):
    nowhere = {name: (200.0, 200.0) for name in LANDMARKS}
    with pytest.raises(InputError, match="do not form an upright face"):
        camera_for(drawing, load_rig(), FaceParameters(), None, nowhere, {})
