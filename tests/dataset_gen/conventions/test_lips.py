"""Lips and teeth as portraits have them: what is drawn lies on the mouth, and is recorded truly."""

from dataclasses import replace

import numpy as np
import pytest

from dataset_gen import STYLES, ink
from dataset_gen.conventions import draw_by_convention, sample_artist
from dataset_gen.conventions.artist import LIPPED, LIPS, TEETH
from dataset_gen.generate import make_sample
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from tests.dataset_gen.conventions.test_conventions import PLAIN, SIZE, drawn, points_of

OWN = [way for way in LIPS if way != "plain"]
ROWS = [way for way in TEETH if way != "plain"]
BARED, AJAR, SHOUT = {"smile": 4, "grimace": 3}, {"jaw_open": 1.2}, {"jaw_open": 4}
BARE = replace(PLAIN, nose="none", ear="none")


def mark(places, name):
    return places[LANDMARKS.index(name)]


def rims(places):
    """How far apart the rims are recorded, of the height from chin to forehead."""
    pairs = [("lip_inner_top", "lip_inner_bottom")]
    pairs += [(f"lip_inner_upper_{s}", f"lip_inner_lower_{s}") for s in ("left", "right")]
    tall = np.hypot(*(mark(places, "forehead") - mark(places, "chin")))
    return np.mean([np.hypot(*(mark(places, a) - mark(places, b))) for a, b in pairs]) / tall


def around(places, room=0.35):
    """left, top, right, bottom of the mouth and what is drawn about it."""
    right, left = (mark(places, f"mouth_corner_{s}") for s in ("right", "left"))
    top, bottom = mark(places, "lip_top"), mark(places, "lip_bottom")
    more = room * (left - right)[0]
    return right[0] - more, top[1] - more, left[0] + more, bottom[1] + more


def inside(artist, aus, seed=3):
    """(rows, columns) of a picture, dark low, between the recorded rims, without their ends."""
    strokes, places = drawn(artist, aus, seed=seed)
    picture = ink(strokes, SIZE, SIZE, STYLES["ink"])
    top, bottom = (mark(places, f"lip_inner_{e}") for e in ("top", "bottom"))
    right, left = (mark(places, f"mouth_corner_{s}") for s in ("right", "left"))
    wide = 0.3 * (left - right)[0]
    return picture[int(top[1]) + 3 : int(bottom[1]) - 2, int(right[0] + wide) : int(left[0] - wide)]


@pytest.mark.parametrize("yaw", [0, 32])
@pytest.mark.parametrize("way", OWN)
def test_shut_lips_are_drawn_on_the_mouth(way, yaw):
    for seed in range(6):
        strokes, places = drawn(replace(BARE, lips=way), {}, yaw, seed)
        shown = points_of([s for s in strokes if s.kind != "eye"], "mouth", "lip", "hatch")
        left, top, right, bottom = around(places)
        assert len(points_of(strokes, "mouth")) > 10
        assert (shown[:, 0] > left).all() and (shown[:, 0] < right).all()
        assert (shown[:, 1] > top).all() and (shown[:, 1] < bottom).all()


@pytest.mark.parametrize("way", OWN)
def test_rims_of_shut_lips_meet_and_those_of_open_ones_do_not(way):
    artist = replace(BARE, lips=way, teeth="row", bares=True)
    for aus in ({}, {"smile": 1}, {"frown": 4}, {"lip_lock": 4}):
        assert rims(drawn(artist, aus)[1]) < 0.02
    for aus in (AJAR, SHOUT, BARED):
        assert rims(drawn(artist, aus)[1]) > 0.032


def test_no_mouth_is_recorded_between_open_and_shut():
    """However far the jaw is open: rims meet, or are apart as an open mouth's."""
    told = [rims(drawn(PLAIN, {"jaw_open": f})[1]) for f in np.arange(0, 1.6, 0.1)]
    assert min(told) < 0.02 and max(told) > 0.035
    assert not any(0.022 < far < 0.031 for far in told)


@pytest.mark.parametrize("way", OWN)
@pytest.mark.parametrize("seed", range(6))
def test_shut_lips_are_no_black_hole(way, seed):
    """Something of lips or between them stays white; dark ones have the lower one's border."""
    strokes, places = drawn(replace(BARE, lips=way), {}, seed=seed)
    picture = ink(strokes, SIZE, SIZE, STYLES["ink"])
    top, bottom = mark(places, "lip_top"), mark(places, "lip_bottom")
    right, left = (mark(places, f"mouth_corner_{s}") for s in ("right", "left"))
    middle = 0.25 * (left - right)[0]
    lips = picture[int(top[1]) : int(bottom[1]), int(right[0] + middle) : int(left[0] - middle)]
    assert (lips > 128).mean() > 0.2
    if way in ("dark", "upper"):
        low = points_of(strokes, "lip")
        assert low[:, 1].max() > bottom[1] - 0.3 * (bottom - top)[1]


@pytest.mark.parametrize("way", ["dark", "upper"])
def test_a_dark_upper_lip_has_a_bow_and_in_a_smile_it_is_shaded_at_most(way):
    """A black shape whose upper edge is level would be the hole of a laughing mouth."""

    def black(aus, seed):
        strokes, places = drawn(replace(BARE, lips=way), aus, seed=seed)
        picture = ink(strokes, SIZE, SIZE, STYLES["ink"])
        top, line = mark(places, "lip_top"), mark(places, "lip_inner_top")
        wide = int(0.2 * (mark(places, "mouth_corner_left") - line)[0])
        lip = picture[int(top[1]) + 1 : int(line[1]), int(line[0]) - wide : int(line[0]) + wide]
        return (lip < 100).mean()

    rest, smile = (
        [black(aus, seed) for seed in range(6)] for aus in ({}, {"smile": 3.5, "lip_lock": 2})
    )
    assert max(rest) > 0.75 and max(smile) < 0.75


@pytest.mark.parametrize("way", ROWS)
@pytest.mark.parametrize("aus", [BARED, SHOUT], ids=["bared", "shout"])
def test_teeth_are_drawn_between_the_rims(way, aus):
    for seed in range(4):
        strokes, places = drawn(replace(BARE, teeth=way, bares=True), aus, seed=seed)
        shown = points_of(strokes, "mouth")
        left, top, right, bottom = around(places, 0.12)
        assert (shown[:, 0] > left).all() and (shown[:, 0] < right).all()
        assert (shown[:, 1] > top).all() and (shown[:, 1] < bottom).all()


@pytest.mark.parametrize("way", ROWS)
def test_teeth_that_meet_are_white_and_those_of_an_open_jaw_end_above_something_dark(way):
    def dark(aus):
        artist = replace(BARE, lips="contour", teeth=way, bares=True)
        return np.mean([(inside(artist, aus, seed) < 100).mean() for seed in range(5)])

    assert dark(BARED) < 0.35
    assert dark(SHOUT) > dark(BARED) + 0.1


@pytest.mark.parametrize("beard, moustache", [("none", "brush"), ("full", "hairs")])
def test_hair_comes_up_to_shut_lips(beard, moustache):
    artist = replace(BARE, beard=beard, moustache=moustache, lips="contour")
    near = []
    for seed in range(12):
        strokes, places = drawn(artist, {}, seed=seed)
        hairs = points_of(strokes, "beard")
        line = (mark(places, "lip_inner_top") + mark(places, "lip_inner_bottom")) / 2
        lip = abs((mark(places, "lip_top") - line)[1])
        about = np.abs(hairs[:, 0] - line[0]) < 2 * lip
        near.append(np.abs(hairs[about, 1] - line[1]).min() < 0.6 * lip)
    assert 3 <= sum(near) < 12


def test_the_same_seed_draws_the_same_mouth():
    for field, ways, aus in (("lips", OWN, {}), ("teeth", ROWS, BARED)):
        for way in ways:
            artist = replace(BARE, bares=True, **{field: way})
            first, again = (
                ink(drawn(artist, aus, seed=5)[0], SIZE, SIZE, STYLES["ink"]) for _ in range(2)
            )
            np.testing.assert_array_equal(first, again)


def test_most_portraits_have_them_and_few_cartoons():
    rng = np.random.default_rng(4)
    for manner, share in LIPPED.items():
        artists = [sample_artist(rng, {"gender": 0.3}, manner) for _ in range(300)]
        own = [a for a in artists if a.lips != "plain"]
        assert len(own) / 300 == pytest.approx(share, abs=0.08)
        if manner == "portrait":
            assert {a.lips for a in own} == set(OWN) and {a.teeth for a in own} == set(TEETH)


def test_a_sample_tells_them_and_is_read_again():
    record = make_sample(8, 1, 128, "sparse", "conventions", aus=BARED)[1]
    assert record["artist"]["lips"] in LIPS and record["artist"]["teeth"] in TEETH


def test_mouths_of_all_sizes_are_drawn_under_any_pen():
    rig = load_rig()
    for pen in (0.8, 6.0):
        for turn in (0.0, 0.9):
            for aus in ({"purse": 5.0}, {"jaw_open": 1.0}, {"smile": 5.0}):
                face = FaceParameters(aus, {}, (turn, 0.0, 0.0))
                camera = Camera.framing(rig.extent(face), 96, 96)
                for way, teeth in zip(OWN, ROWS, strict=False):
                    artist = replace(PLAIN, lips=way, teeth=teeth, bares=True)
                    strokes, places, _ = draw_by_convention(
                        rig, rig.pose(face), camera, face, artist, pen, np.random.default_rng(1)
                    )
                    assert all(np.isfinite(s.points).all() for s in strokes)
                    assert np.isfinite(places).all()
