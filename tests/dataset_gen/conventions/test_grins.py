"""Open mouths of comics: one bold shape with the lips' landmarks on its rims."""

from dataclasses import replace

import numpy as np
import pytest

from dataset_gen import STYLES, ink
from dataset_gen.conventions import draw_by_convention, sample_artist
from dataset_gen.conventions.artist import GRINS
from dataset_gen.generate import make_sample
from dataset_gen.samples import clenched
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from tests.dataset_gen.conventions.test_conventions import PLAIN, SIZE, drawn, points_of

SHAPES = [name for name in GRINS if name != "none"]
LAUGH, BARED = {"smile": 4, "jaw_open": 3}, {"smile": 4, "grimace": 3}


def mark(places, name):
    return places[LANDMARKS.index(name)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("aus", [LAUGH, BARED], ids=["open", "bared"])
@pytest.mark.parametrize("yaw", [0, 30])
def test_landmarks_of_the_lips_lie_on_the_shape(shape, aus, yaw):
    artist = replace(PLAIN, grin=shape, grin_wide=1.5, grin_tall=0.5, grin_tilt=0.05)
    strokes, places = drawn(artist, aus, yaw)
    shown = points_of(strokes, "mouth")
    left, right = shown[:, 0].min(), shown[:, 0].max()
    middle = shown[np.abs(shown[:, 0] - mark(places, "lip_inner_top")[0]) < 0.05 * (right - left)]
    high, low = middle[:, 1].min(), middle[:, 1].max()
    assert mark(places, "nose_base")[1] < high < low < mark(places, "chin")[1]
    tall, wide = low - high, right - left
    # The landmarks lie on the lips' skin beside the rims.
    assert mark(places, "lip_inner_top")[1] == pytest.approx(high, abs=0.16 * tall)
    assert mark(places, "lip_inner_bottom")[1] == pytest.approx(low, abs=0.16 * tall)
    assert mark(places, "lip_top")[1] < mark(places, "lip_inner_top")[1]
    assert mark(places, "lip_bottom")[1] > mark(places, "lip_inner_bottom")[1]
    assert mark(places, "mouth_corner_right")[0] == pytest.approx(left, abs=0.06 * wide)
    assert mark(places, "mouth_corner_left")[0] == pytest.approx(right, abs=0.06 * wide)


def test_a_shape_is_larger_than_the_mouth_of_who_is_drawn():
    def wide(artist):
        shown = points_of(drawn(artist, BARED)[0], "mouth")
        return np.ptp(shown, axis=0)

    own = wide(replace(PLAIN, bares=True))
    grin = wide(replace(PLAIN, grin="box", grin_wide=1.6, grin_tall=0.5))
    assert grin[0] > 1.4 * own[0] and grin[1] > 1.4 * own[1]


def test_a_mouth_that_is_shut_is_drawn_as_ever():
    for aus in ({}, {"frown": 4}):
        plain, places = drawn(PLAIN, aus)
        grin, same = drawn(replace(PLAIN, grin="oval"), aus)
        np.testing.assert_array_equal(places, same)
        assert [len(s.points) for s in plain] == [len(s.points) for s in grin]


@pytest.mark.parametrize("way, least, most", [("grid", 0.02, 0.6), ("tongue", 0.05, 0.8)])
def test_teeth_are_white(way, least, most):
    """A grid is lines alone; of blocks in black there is some of either."""
    artist = replace(PLAIN, open=way, grin="box", grin_wide=1.5, grin_tall=0.5)
    strokes, places = drawn(artist, BARED)
    picture = ink(strokes, SIZE, SIZE, STYLES["ink"])
    top, bottom = (mark(places, f"lip_inner_{e}") for e in ("top", "bottom"))
    right, left = (mark(places, f"mouth_corner_{s}") for s in ("right", "left"))
    inside = picture[int(top[1]) + 6 : int(bottom[1]) - 6, int(right[0]) + 8 : int(left[0]) - 8]
    assert least < (inside < 100).mean() < most


def test_nothing_of_the_face_is_drawn_over_a_mouth():
    artist = replace(PLAIN, open="outline", crease="all", chin="arc",
                     grin="box", grin_wide=1.9, grin_tall=0.7)  # fmt: skip
    strokes, places = drawn(artist, BARED)
    middle = np.mean([mark(places, f"lip_inner_{e}") for e in ("top", "bottom")], axis=0)
    half = np.array([
        0.4 * (mark(places, "mouth_corner_left") - mark(places, "mouth_corner_right"))[0],
        0.35 * (mark(places, "lip_inner_bottom") - mark(places, "lip_inner_top"))[1],
    ])  # fmt: skip
    for stroke in strokes:
        if stroke.kind == "mouth":
            continue
        assert not (np.abs(stroke.points - middle) < half).all(axis=1).any(), stroke.kind


def test_who_draws_no_such_mouth_draws_as_before():
    """They are told by lot, of a generator of their own."""
    after = []
    for grins in (0.0, 1.0):
        rng = np.random.default_rng(5)
        artists = [sample_artist(rng, {"gender": 0.1}, "cartoon", grins=grins) for _ in range(20)]
        after.append(rng.random())
        assert all((artist.grin != "none") == (grins == 1) for artist in artists)
    assert after[0] == after[1]


def test_a_beard_goes_with_no_such_mouth():
    rng = np.random.default_rng(2)
    people = {"gender": 1.0, "age": 0.5}
    artists = [sample_artist(rng, people, "comic", grins=1.0) for _ in range(60)]
    beards = [a for a in artists if (a.beard, a.moustache) != ("none", "none")]
    assert beards and all(a.grin == "none" for a in beards)
    assert {a.grin for a in artists} == set(GRINS)


def test_a_sample_may_ask_for_them():
    shapes = {
        make_sample(8, k, 128, "sparse", "conventions", aus=LAUGH, grins=1.0)[1]["artist"]["grin"]
        for k in range(8)
    }
    assert len(shapes - {"none"}) > 2


def test_a_mouth_fits_between_nose_and_chin_of_any_face():
    rig = load_rig()
    for seed in range(6):
        rng = np.random.default_rng(seed)
        artist = sample_artist(rng, {"gender": 0.2}, "cartoon", grins=1.0)
        face = FaceParameters({"jaw_open": 6.0}, {}, (rng.normal(0, 0.3), 0.0, 0.0))
        camera = Camera.framing(rig.extent(face), SIZE, SIZE)
        _, places, _ = draw_by_convention(rig, rig.pose(face), camera, face, artist, 1.6, rng)
        assert mark(places, "nose_base")[1] < mark(places, "lip_inner_top")[1]
        assert mark(places, "lip_inner_bottom")[1] < mark(places, "chin")[1]


def test_a_sample_tells_whether_its_teeth_meet():
    told = {
        name: {clenched(make_sample(8, k, 128, "sparse", "conventions", aus=aus, grins=1.0)[1])
               for k in range(4)}
        for name, aus in (("shout", {"jaw_open": 5.0}), ("rest", {}))
    }  # fmt: skip
    assert told == {"shout": {False}, "rest": {False}}
    bared = [
        make_sample(8, k, 128, "sparse", "conventions", aus=BARED, grins=1.0) for k in range(6)
    ]
    assert any(clenched(record) for _, record in bared)
