"""Which way up a drawing stands, and what is no face: of the shipped weights, on unseen pages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.drawing import load_drawing
from addon.sketches.render import FOLDER as SKETCHES
from classifiers import load_detector
from classifiers.detection import LAY
from classifiers.plausible import (
    FARTHEST,
    HIDDEN,
    LEAST_NOSE,
    NO_FACE,
    NO_NOSE,
    expected_error,
    nose_ink,
    trouble,
    turned,
    turned_crop,
)
from classifiers.preprocess import as_page
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample
from tests.classifiers.doodles import DOODLES, doodle, head, profile, smiley
from tests.nightly import at_night

FACES = range(900, 925)
SKETCH = SKETCHES / "smiling_woman.png"


@pytest.fixture(scope="module")
def detector():
    return load_detector()


@pytest.fixture(scope="module")
def pages():
    """The samples that ship, and their number; then the heads."""
    samples = [load_drawing(path).image for path in SKETCHES.glob("*.png")]
    return [*samples, *map(head, FACES)], len(samples)


def handed_in(drawing: np.ndarray, turn: int) -> np.ndarray:
    """A drawing turned so that so many quarter turns anticlockwise stand it upright."""
    return turned(drawing, -turn)


@pytest.mark.parametrize("turn", [0, 1, *map(at_night, (2, 3))])
def test_a_page_is_stood_upright_whichever_way_it_lies(detector, pages, turn):
    drawings, samples = pages
    found = [detector.detect(handed_in(page, turn)) for page in drawings]
    right = [one.turn == turn and not one.trouble for one in found]
    assert all(right[:samples])
    assert np.mean(right) == 1 if turn == 0 else np.mean(right) >= 0.96  # measured: 0.99


@pytest.mark.parametrize("turn", range(4))
def test_what_is_read_is_the_same_whichever_way_it_lies(detector, turn):
    page = load_drawing(SKETCH).image
    found = detector.detect(handed_in(page, turn))
    assert replace(found, turn=0) == detector.detect(page)
    assert bool(found.how_it_lay()) == bool(turn)
    assert found.clockwise == 90 * (-turn % 4)
    assert {0, *LAY} == {0, 90, 180, 270}


def test_a_head_that_is_placed_turns_with_the_page(detector):
    page = load_drawing(SKETCH).image
    box = detector.read(as_page(page)).box
    lying = handed_in(page, 3)
    there = turned_crop(box, page.shape, 1)
    np.testing.assert_allclose(
        area_resample(lying, there, 40), np.rot90(area_resample(page, box, 40)), atol=1e-5
    )
    found = detector.detect(lying, there)
    assert found.turn == 3 and found.active == detector.detect(page, box).active
    assert turned_crop(Box.at(1, 2, 30, 40), (100, 200), 4) == Box.at(1, 2, 30, 40)


def test_a_sure_reading_costs_nothing_more(detector, monkeypatch):
    looks = []
    look = type(detector).look
    monkeypatch.setattr(type(detector), "look", lambda *given: looks.append(1) or look(*given))
    page = as_page(load_drawing(SKETCH).image)
    detector.read(page)
    alone = len(looks)
    looks.clear()
    assert detector.detect(1 - page).turn == 0
    assert len(looks) == alone


def test_doodles_are_no_faces(detector):
    taken = [not detector.detect(doodle(draw, k)).trouble for draw in DOODLES for k in (60, 61, 62)]
    assert np.mean(taken) <= 0.06  # of fish on their sides some are taken for profiles


def test_a_smiley_has_no_nose(detector):
    found = [detector.detect(doodle(smiley, k)) for k in range(80, 100)]
    assert np.mean([not one.trouble for one in found]) <= 0.1
    noseless = next(one for one in found if one.trouble == NO_NOSE)
    assert noseless.face_probability > 0.5  # the networks alone would take it
    assert not any(noseless.active.values()) and not any(noseless.intensities.values())
    assert noseless.faces == () and noseless.expression() == {}
    assert "no nose" in noseless.no_face("'x.png'") and "'x.png'" in noseless.no_face("'x.png'")


def test_profiles_are_seldom_taken(detector):
    found = [detector.detect(profile(k)).trouble for k in range(700, 764)]
    assert np.mean([not why for why in found]) <= 0.15
    assert HIDDEN in found


def test_faces_to_three_quarters_are_not_refused(detector):
    found = [detector.detect(head(k, yaw)) for k in range(20, 26) for yaw in (-50.0, 0.0, 50.0)]
    assert [one.trouble for one in found] == [""] * len(found)
    assert [one.turn for one in found] == [0] * len(found)


def test_why_a_reading_is_refused(detector):
    good = detector.read(as_page(load_drawing(SKETCH).image))
    assert trouble(good) == ""
    assert trouble(replace(good, face=-0.1)) == NO_FACE
    # Whose landmarks are sure is a face, be it drawn by a light hand or bent.
    assert trouble(replace(good, apart=1.01 * FARTHEST)) == ""
    assert trouble(replace(good, nose=0.0)) == ""
    vague = replace(good, spreads=3 * good.spreads)
    assert expected_error(vague) == pytest.approx(3 * expected_error(good))
    assert trouble(vague) == ""
    assert trouble(replace(vague, apart=1.01 * FARTHEST)) == HIDDEN
    assert trouble(replace(vague, nose=1.1 * LEAST_NOSE)) == ""
    assert trouble(replace(vague, nose=0.9 * LEAST_NOSE)) == NO_NOSE
    lost = replace(vague, apart=1.0)
    assert not detector.interpret(lost).faces
    placed = detector.interpret(lost, placed=True)  # somebody said: it is one
    assert placed.faces and placed.active == detector.interpret(vague).active


def test_ink_between_the_eyes_and_the_mouth_is_a_nose():
    crop = np.zeros((80, 80), np.float32)
    frame = np.array(
        [(0.7, 0.4), (0.3, 0.4), (0.62, 0.75), (0.38, 0.75)]
    )  # the image's right first
    crop[60, 28:52] = crop[30:34, 22:26] = crop[30:34, 54:58] = 0.8  # mouth and eyes
    assert nose_ink(crop, frame) == 0
    crop[38:48, 39:41] = 0.8
    ink = nose_ink(crop, frame)
    assert ink > LEAST_NOSE
    assert nose_ink(crop / 4, frame) == pytest.approx(ink)  # pencil and felt pen
    assert nose_ink(np.ascontiguousarray(np.rot90(crop)), frame[:, ::-1] * (1, -1) + (0, 1)) == (
        pytest.approx(ink)
    )
    assert nose_ink(crop, np.full((4, 2), 0.5)) == 0
