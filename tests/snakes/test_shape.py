"""Who and how a drawn face is, from lines and landmarks whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.derivatives import surface_points
from snakes.lines import HEAD, Lines
from snakes.model_lines import face_lines
from snakes.shape import VIEW, Observations, _Guess, _moves, _Now, fit_shape

NONE = Lines(np.zeros((0, 2)), np.zeros((0, 2)))
TRUE = FaceParameters(
    {"smile": 3.0},
    {"gender": 0.9, "nose_length": 0.6, "jaw_width": 0.7, "eye_spacing": -0.5, "chin_height": 0.6},
    head=(0.15, 0.05, 0.03),
)


def outlines(posed, camera):
    return face_lines(load_rig(), posed, camera, kinds=("contour",), step=2.0)


@pytest.fixture(scope="module")
def drawn():
    """(posed, camera, lines, landmarks) of the face that is to be found."""
    rig = load_rig()
    posed = rig.pose(TRUE)
    camera = Camera.framing(posed, 400, 400)
    spots = camera.project(posed[rig.landmarks])
    marks = {name: (float(u), float(v)) for name, (u, v) in zip(LANDMARKS, spots, strict=True)}
    return posed, camera, outlines(posed, camera).lines, marks


def observed(marks, spread=2.0):
    return Observations(marks, dict.fromkeys(marks, spread))


BEGIN = FaceParameters({"smile": 2.2}, head=(0.1, 0.0, 0.0))


def away(rig, parameters, camera, drawn):
    """Mean distance of the projected face from the true one, pixels."""
    skin = rig.parts["skin"]
    there = camera.project(rig.pose(parameters)[skin])
    return np.linalg.norm(there - drawn[1].project(drawn[0][skin]), axis=1).mean()


def test_lines_and_landmarks_find_the_face(drawn):
    rig = load_rig()
    off = Camera(400, 400, (drawn[1].scale[0] * 1.03,) * 2, tuple(np.array(drawn[1].centre) + 4))
    before = away(rig, BEGIN, off, drawn)
    found, camera = fit_shape(drawn[2], rig, BEGIN, off, observed(drawn[3]))
    after = away(rig, found, camera, drawn)
    assert after < 0.3 * before and after < 2.0
    assert found.aus["smile"] == pytest.approx(3.0, abs=0.8)
    assert set(found.aus) == {"smile"}  # what was not detected stays at rest
    assert np.degrees(np.abs(np.array(found.head) - TRUE.head)).max() < 3


def test_lines_do_better_than_landmarks_that_are_off(drawn):
    rig, rng = load_rig(), np.random.default_rng(3)
    loose = {n: tuple(np.array(p) + rng.normal(0, 5, 2)) for n, p in drawn[3].items()}
    seen = observed(loose, spread=6.0)
    errors = []
    for lines in (NONE, drawn[2]):
        found, camera = fit_shape(lines, rig, BEGIN, drawn[1], seen)
        errors.append(away(rig, found, camera, drawn))
    assert errors[1] < 0.7 * errors[0]


def test_lines_alone_suffice_where_the_camera_is_right(drawn):
    rig = load_rig()
    blind = Observations({}, {})
    before = away(rig, BEGIN, drawn[1], drawn)
    found, camera = fit_shape(drawn[2], rig, BEGIN, drawn[1], blind)
    assert away(rig, found, camera, drawn) < 0.7 * before


def test_parameters_stay_in_their_ranges_whatever_the_drawing(drawn):
    """Landmarks of a monster: a face with its own limits."""
    rig = load_rig()
    wild = {n: (200 + 2.5 * (u - 200), v) for n, (u, v) in drawn[3].items()}
    found, camera = fit_shape(NONE, rig, BEGIN, drawn[1], observed(wild, 0.5))
    assert np.isfinite(rig.pose(found)).all()  # posing raises for values outside their range
    assert camera.scale[0] > 0
    assert 0 <= found.aus["smile"] <= 6.5


def test_one_wrong_landmark_does_not_pull_the_face_along(drawn):
    rig = load_rig()
    wrong = {**drawn[3], "nose_tip": (20.0, 20.0)}
    pair = [fit_shape(NONE, rig, BEGIN, drawn[1], observed(marks)) for marks in (drawn[3], wrong)]
    errors = [away(rig, found, camera, drawn) for found, camera in pair]
    assert errors[1] < errors[0] + 1.5


def test_without_anything_the_face_stays_what_is_likely(drawn):
    rig = load_rig()
    found, camera = fit_shape(NONE, rig, BEGIN, drawn[1], Observations({}, {}))
    assert found.aus["smile"] == pytest.approx(2.2)
    np.testing.assert_allclose(found.head, BEGIN.head, atol=1e-9)
    assert camera.scale == pytest.approx(drawn[1].scale)


@pytest.mark.parametrize("metres", [0.8, 1.6])
def test_a_face_seen_from_near_is_found_in_its_perspective(drawn, metres):
    """What perspective does to a drawing is no one's bones."""
    rig = load_rig()
    camera = Camera.framing(drawn[0], 400, 400, distance=metres)
    spots = camera.project(drawn[0][rig.landmarks])
    marks = {name: (float(u), float(v)) for name, (u, v) in zip(LANDMARKS, spots, strict=True)}
    lines = outlines(drawn[0], camera).lines
    found, seen = fit_shape(lines, rig, BEGIN, Camera.framing(drawn[0], 400, 400), observed(marks))
    assert 1 / seen.distance == pytest.approx(1 / metres, abs=0.4)
    skin = rig.parts["skin"]
    off = seen.project(rig.pose(found)[skin]) - camera.project(drawn[0][skin])
    assert np.linalg.norm(off, axis=1).mean() < 2.0
    bones = [rig.shape(FaceParameters({}, face.identity)) for face in (found, TRUE)]
    assert np.linalg.norm(bones[0] - bones[1], axis=1).mean() < 0.004


@pytest.mark.parametrize("distance", [np.inf, 0.8])
def test_each_number_moves_the_face_as_is_said(drawn, distance):
    """Against differences of what the rig and the camera do."""
    rig = load_rig()
    camera = Camera.framing(drawn[0], 400, 400, distance=distance)
    guess = _Guess.of(TRUE, camera, Observations({}, {}))
    values = guess.start(TRUE)
    values[0] = np.log(camera.scale[0])
    values[1:3] = np.array(camera.centre) / (HEAD * camera.scale[0])
    values[3], values[4:VIEW] = 1 / distance, TRUE.head
    rows = rig.landmarks[::5]

    def places(at):
        face, eye = guess.face(at, TRUE, camera)
        return eye.project(rig.pose(face)[rows].astype(float))

    points = surface_points(rig, rows[:, None], np.ones((len(rows), 1)))
    moves, here = _moves(points, _Now.of(rig, guess, *guess.face(values, TRUE, camera)))
    np.testing.assert_allclose(here, places(values), atol=0.05)
    view = range(VIEW)
    for k in (*view, VIEW + guess.identity.index("jaw_width"), len(values) - 1):
        step = np.zeros(len(values))
        step[k] = 1e-3 if k in view else 1e-2
        before = np.maximum(values - step, 0) if k == 3 else values - step  # no eye is farther
        slope = (places(values + step) - places(before)) / (values + step - before)[k]
        np.testing.assert_allclose(moves[k], slope, rtol=0.02, atol=0.5, err_msg=str(k))


def test_what_is_settled_stays_and_the_rest_moves(drawn):
    rig = load_rig()
    begin = FaceParameters({"smile": 9.0, "sneer": 1.0}, head=BEGIN.head)
    seen = replace(observed(drawn[3]), decided=frozenset({"smile", "frontalis"}))
    found, _ = fit_shape(drawn[2], rig, begin, drawn[1], seen)
    assert found.aus["smile"] == 9.0  # more than lines alone are believed
    assert found.aus["sneer"] != 1.0
    assert set(found.aus) == {"smile", "sneer"}  # decided at rest: not among them
    everything = replace(seen, decided=frozenset(begin.aus))
    found, _ = fit_shape(drawn[2], rig, begin, drawn[1], everything)
    assert found.aus == begin.aus
    assert found.identity != begin.identity


def guess_of(**person) -> _Guess:
    camera = Camera(100, 100, (300.0, 300.0), (50.0, 50.0))
    return _Guess.of(FaceParameters(), camera, Observations({}, {}, person=person))


def test_nobody_is_made_a_child_by_lines_alone():
    guess = guess_of()
    at = VIEW + guess.identity.index("age")
    assert (guess.low[at], guess.high[at]) == (0.0, 1.0)
    assert not {"muscle", "age_shows", "asym_jaw", "brow_thickness"} & set(guess.identity)


@pytest.mark.parametrize(
    ("seen", "spread", "least"), [(-0.6, 0.2, -1.0), (-0.6, 0.5, 0.0), (0.4, 0.2, 0.0)]
)
def test_a_child_is_one_that_was_surely_seen(seen, spread, least):
    guess = guess_of(age=(seen, spread))
    at = VIEW + guess.identity.index("age")
    assert guess.low[at] == least
    assert guess.likely[at] == max(seen, least) and guess.spread[at] == min(spread, 0.25)


def test_who_was_seen_is_who_is_likely(drawn):
    """Without lines and landmarks the face is the one that the networks saw, within its ranges."""
    rig = load_rig()
    person = {"weight": (0.6, 0.1), "nose_length": (0.6, 0.2), "jaw_width": (7.0, 0.2)}
    found, _ = fit_shape(NONE, rig, BEGIN, drawn[1], Observations({}, {}, person=person))
    assert found.identity["weight"] == pytest.approx(0.6)
    assert found.identity["nose_length"] == pytest.approx(0.6)
    assert found.identity["jaw_width"] == 1.0
    assert "eye_size" not in found.identity


@pytest.mark.parametrize("seen, spread", [(0.4, 0.3), (0.45, 0.2), (0.3, 0.25), (0.55, 0.02)])
def test_people_are_women_or_men(drawn, seen, spread):
    """What was seen moves toward the nearer of the two, the further the surer it is; who is seen
    to be between them stays there, and a mirrored answer is mirrored."""

    def fitted(*person):
        observations = Observations({}, {}, person={"gender": person})
        identity = fit_shape(NONE, load_rig(), BEGIN, drawn[1], observations)[0].identity
        return identity.get("gender", 0.5)

    told, surer = fitted(seen, spread), fitted(seen, spread / 2)
    assert abs(told - 0.5) > abs(seen - 0.5) and (told - 0.5) * (seen - 0.5) > 0
    assert abs(surer - 0.5) >= abs(told - 0.5) and 0 <= surer <= 1
    assert fitted(1 - seen, spread) == pytest.approx(1 - told, abs=1e-4)
    assert fitted(0.5, spread) == 0.5


def test_what_is_surely_seen_bends_less_to_lines(drawn):
    rig, away_from = load_rig(), []
    for spread in (0.05, 0.5):
        seen = replace(observed(drawn[3]), person={"nose_length": (-0.8, spread)})
        found, _ = fit_shape(drawn[2], rig, BEGIN, drawn[1], seen)
        away_from.append(abs(found.identity.get("nose_length", 0.0) + 0.8))
    assert away_from[0] < 0.5 * away_from[1]
