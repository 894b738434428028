"""The rims of a mouth that is drawn as a black shape."""

from dataclasses import replace

import numpy as np
import pytest

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.coarse import coarse_rig
from snakes.lines import Lines
from snakes.mouth import RIMS as RIM_PAIRS
from snakes.mouth import held_rims, rims_of, with_rims, without_teeth
from snakes.shape import Observations, fit_shape

RIMS = {"lip_inner_upper_{}": -5.0, "lip_inner_lower_{}": 5.0}
BORDERS = {"lip_peak_{}": -15.0, "lip_lower_inner_{}": 15.0}


def mouth(turn=0.0, apart=1.0):
    """Observations of a mouth 100 pixels wide at (200, 300), its lips as landmarks of a closed or
    barely open one have them, turned by so many radians."""
    marks = {"mouth_corner_right": (-50.0, 0.0), "mouth_corner_left": (50.0, 0.0),
             "lip_top": (0.0, -16.0), "lip_bottom": (0.0, 16.0),
             "lip_inner_top": (0.0, -5.0 * apart),
             "lip_inner_bottom": (0.0, 5.0 * apart)}  # fmt: skip
    for side, u in (("right", -20.0), ("left", 20.0)):
        marks |= {name.format(side): (u, v * apart) for name, v in RIMS.items()}
        marks |= {name.format(side): (u, v) for name, v in BORDERS.items()}
    return Observations({name: turned(place, turn) for name, place in marks.items()}, {})


def turned(point, turn):
    c, s = np.cos(turn), np.sin(turn)
    u, v = point
    return (float(200 + c * u - s * v), float(300 + s * u + c * v))


def ellipse(high, turn=0.0, filled=True):
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    points = np.array([turned((48 * np.cos(a), high * np.sin(a)), turn) for a in t])
    along = np.roll(points, -1, axis=0) - points
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return Lines(points, along, np.full(len(points), filled))


def heights(observed, turn=0.0):
    c, s = np.cos(turn), np.sin(turn)
    return {n: -s * (u - 200) + c * (v - 300) for n, (u, v) in observed.landmarks.items()}


@pytest.mark.parametrize("turn", [0.0, 0.4, -0.7])
def test_rims_lie_where_what_is_filled_ends(turn):
    seen = with_rims(mouth(turn), ellipse(15.0, turn))
    v = heights(seen, turn)
    assert v["lip_inner_top"] == pytest.approx(-15, abs=0.3)
    assert v["lip_inner_bottom"] == pytest.approx(15, abs=0.3)
    expected = 15 * np.sqrt(1 - (20 / 48) ** 2)
    for side in ("left", "right"):
        assert v[f"lip_inner_upper_{side}"] == pytest.approx(-expected, abs=1.2)
        assert v[f"lip_inner_lower_{side}"] == pytest.approx(expected, abs=1.2)
    # Where a rim is, no border of a lip can be; farther out it can.
    assert not {"lip_top", "lip_bottom"} & set(v)
    assert {"mouth_corner_left", "mouth_corner_right"} <= set(v)


def test_lips_that_have_room_stay():
    seen = with_rims(mouth(), ellipse(8.0))
    assert {"lip_top", "lip_bottom"} <= set(seen.landmarks)
    assert seen.landmarks["lip_inner_bottom"][1] == pytest.approx(308, abs=0.3)


def test_rims_are_never_brought_together():
    """Teeth above the black belong to the mouth, too."""
    wide = mouth(apart=2.4)
    assert with_rims(wide, ellipse(8.0)).landmarks == wide.landmarks


@pytest.mark.parametrize(
    "lines",
    [ellipse(15.0, filled=False), ellipse(3.0), Lines(np.zeros((0, 2)), np.zeros((0, 2)))],
    ids=["an outline", "the line between the lips", "no lines"],
)
def test_what_is_not_filled_says_nothing(lines):
    assert with_rims(mouth(), lines).landmarks == mouth().landmarks


def test_dark_lips_that_are_closed_are_no_open_mouth():
    shut = mouth(apart=0.1)
    assert with_rims(shut, ellipse(15.0)).landmarks == shut.landmarks


def test_a_mouth_that_was_not_found_says_nothing():
    marks = {n: p for n, p in mouth().landmarks.items() if n != "lip_inner_top"}
    seen = Observations(marks, {})
    assert with_rims(seen, ellipse(15.0)) is seen


@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_teeth_are_no_lines_of_the_lips(turn):
    """A line where they meet goes; the rims and what is beside the mouth stay."""
    observed = replace(mouth(turn, apart=3.0), gap=0.01)  # rims 30 pixels apart
    u = np.linspace(-80, 80, 81)
    heights = (-15.0, 0.0, 15.0)
    points = np.array([turned((x, v), turn) for v in heights for x in u])
    drawn = Lines(points, np.tile([1.0, 0.0], (len(points), 1)))
    kept = {tuple(p) for p in without_teeth(drawn, observed).points.round(6)}
    stays = np.array([tuple(p) in kept for p in points.round(6)]).reshape(3, -1)
    assert stays[0].all() and stays[2].all()
    assert not stays[1][np.abs(u) < 40].any() and stays[1][np.abs(u) > 50].all()
    assert without_teeth(drawn, replace(observed, gap=None)) is drawn
    narrow = replace(mouth(turn, apart=1.5), gap=0.01)  # a line there may be that of shut lips
    assert without_teeth(drawn, narrow) is drawn


NOTHING = Lines(np.zeros((0, 2)), np.zeros((0, 2)))


def seen(aus, camera, gap=None):
    """Observations of the default face that does something."""
    rig = load_rig()
    spots = camera.project(rig.pose(FaceParameters(aus))[rig.landmarks]).tolist()
    marks = {name: (u, v) for name, (u, v) in zip(LANDMARKS, spots, strict=True)}
    return Observations(marks, dict.fromkeys(marks, 3.0), gap=gap)


def apart(rig, face, camera):
    """Pixels from rim to rim."""
    spots = camera.project(rig.pose(face)[rig.landmarks])
    return [spots[LANDMARKS.index(b), 1] - spots[LANDMARKS.index(a), 1] for a, b in RIM_PAIRS]


@pytest.fixture(scope="module")
def camera():
    return Camera.framing(load_rig().neutral(), 400, 400)


def test_a_mouth_that_is_drawn_open_opens_though_no_action_was_detected(camera):
    rig = coarse_rig(load_rig())
    drawn = {"smile": 4.0, "lower_lip_depress": 3.0, "jaw_open": 1.0}
    begin = FaceParameters({"smile": 4.0})
    there = np.mean(apart(rig, FaceParameters(drawn), camera))
    errors = {}
    for gap in (None, 0.01):
        observed = seen(drawn, camera, gap)
        found, laid = fit_shape(NOTHING, rig, begin, camera, observed)
        assert (set(found.aus) == {"smile"}) == (gap is None)
        errors[gap] = abs(np.mean(apart(rig, found, laid)) - there)
    assert errors[0.01] < 0.3 * errors[None]


def test_teeth_that_meet_are_bared_by_a_shut_jaw(camera):
    """However wide the mouth is drawn, and whatever the networks took it for."""
    rig = coarse_rig(load_rig())
    drawn = {"smile": 4.0, "lower_lip_depress": 5.0, "sneer": 5.0, "jaw_open": 1.0}
    begin = FaceParameters({"smile": 4.0, "jaw_open": 3.0})
    found = {}
    for clenched in (False, True):
        observed = replace(seen(drawn, camera, 0.01), clenched=clenched)
        face, laid = fit_shape(NOTHING, rig, begin, camera, observed)
        found[clenched] = face.aus.get("jaw_open", 0.0)
        there = np.mean(apart(rig, FaceParameters(drawn), camera))
        assert np.mean(apart(rig, face, laid)) > 0.7 * there
    assert found[True] < 1.0 < found[False]
    decided = replace(observed, decided=frozenset({"jaw_open"}))
    assert fit_shape(NOTHING, rig, begin, camera, decided)[0].aus["jaw_open"] == 3.0


def test_what_the_artist_has_decided_stays_shut(camera):
    rig = coarse_rig(load_rig())
    observed = replace(seen({"jaw_open": 4.0}, camera, 0.01), decided=frozenset({"jaw_open"}))
    found, _ = fit_shape(NOTHING, rig, FaceParameters(), camera, observed)
    assert not found.aus.get("jaw_open")


def test_rims_are_held_as_far_apart_as_they_were_seen(camera):
    rig = load_rig()
    shut = rig.pose(FaceParameters())
    observed = seen({"jaw_open": 2.0}, camera, 0.01)
    held = held_rims(rig, shut, camera, observed)
    assert len(held.index) == 6
    upper, lower = held.moves.reshape(2, 3)
    assert upper == pytest.approx(-lower) and (lower > 0).all()
    wide = np.array(apart(rig, FaceParameters({"jaw_open": 2.0}), camera))
    assert lower - upper == pytest.approx(wide - apart(rig, FaceParameters(), camera), abs=0.01)
    assert not len(held_rims(rig, shut, camera, replace(observed, gap=None)).index)


def test_rims_that_are_not_all_known_are_none():
    names = [name for pair in RIM_PAIRS for name in pair]
    assert rims_of(names, np.zeros((6, 2)))[0].shape == (2, 0)
