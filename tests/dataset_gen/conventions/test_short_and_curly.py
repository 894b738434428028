"""Curls and shorn hair: however they are drawn, they lie where hair is told to be."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation

from dataset_gen import STYLES, ink
from dataset_gen.conventions import Artist, curls, draw_by_convention, mop, shorn, zoomed
from dataset_gen.linework.strokes import Stroke
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig

SIZE = 320
PLAIN = Artist(cut="short", clothes="none", finish="curls", room=1.5, iris="ring", beard="none")


def drawn(artist, yaw=0.0, seed=0):
    """The strokes of hair, and (SIZE, SIZE) where hair is told to be."""
    rig, parameters = load_rig(), FaceParameters({}, {}, (0.0, np.radians(yaw), 0.0))
    camera = zoomed(Camera.framing(rig.extent(parameters), SIZE, SIZE), artist.room)
    rng = np.random.default_rng(seed)
    strokes, _, regions = draw_by_convention(
        rig, rig.pose(parameters), camera, parameters, artist, 1.4, rng
    )
    page = Image.new("1", (SIZE, SIZE))
    for outline in regions["hair"]:
        ImageDraw.Draw(page).polygon(outline.ravel().tolist(), fill=1)
    return [s for s in strokes if s.kind in ("hair", "mass")], np.asarray(page)


def black(strokes: list[Stroke]) -> np.ndarray:
    return ink(strokes, SIZE, SIZE, STYLES["ink"]) < 128


@pytest.fixture(params=["clumps", "ringlets", "frizz", "bumps", "rings"])
def curly(request, monkeypatch):
    for manner, odds in curls.WAYS.items():
        monkeypatch.setitem(
            curls.WAYS, manner, {name: float(name == request.param) for name in odds}
        )
    return request.param


@pytest.fixture(params=shorn.WAYS)
def tone(request, monkeypatch):
    for name in shorn.WAYS:
        monkeypatch.setitem(shorn.WAYS, name, float(name == request.param))
    return request.param


def near(told):
    return binary_dilation(told, iterations=6)


@pytest.mark.parametrize("cut", ["short", "afro", "long"])
@pytest.mark.parametrize("yaw", [0, 30])
def test_curls_are_drawn_where_hair_is_told(curly, cut, yaw):
    for seed in range(4):
        strokes, told = drawn(replace(PLAIN, cut=cut), yaw, seed)
        page = black(strokes)
        assert near(told)[page].mean() > 0.85
        assert page[told].mean() > 0.03


@pytest.mark.parametrize("cut", ["shorn", "rim"])
def test_tight_curls_are_drawn_where_hair_is_told(cut):
    for seed in range(8):
        strokes, told = drawn(replace(PLAIN, cut=cut), 0, seed)
        assert near(told)[black(strokes)].mean() > 0.8


@pytest.mark.parametrize("finish", ["outline", "strands", "hatch"])
@pytest.mark.parametrize("yaw", [0, 30])
def test_shorn_hair_is_tone_within_what_is_told(tone, finish, yaw):
    for seed in range(4):
        strokes, told = drawn(replace(PLAIN, cut="shorn", finish=finish), yaw, seed)
        page = black(strokes)
        assert near(told)[page].mean() > 0.9
        assert page[told].mean() > 0.02
        assert told.mean() > 0.002  # a thin band is hair, too


def test_a_seed_draws_the_same_curls_again_and_another_does_not(curly):
    pages = [black(drawn(PLAIN, 0, seed)[0]) for seed in (1, 1, 2)]
    assert (pages[0] == pages[1]).all() and (pages[0] != pages[2]).any()


def test_a_seed_draws_the_same_shorn_hair_again_and_another_does_not(tone):
    artist = replace(PLAIN, cut="shorn", finish="strands")
    pages = [black(drawn(artist, 0, seed)[0]) for seed in (1, 1, 2)]
    assert (pages[0] == pages[1]).all() and (pages[0] != pages[2]).any()


def test_solid_shorn_hair_is_darker_than_dots(monkeypatch):
    def dark(way):
        for name in shorn.WAYS:
            monkeypatch.setitem(shorn.WAYS, name, float(name == way))
        artist = replace(PLAIN, cut="shorn", finish="strands")
        return np.mean(
            [black(s)[told].mean() for s, told in (drawn(artist, 0, k) for k in range(6))]
        )

    assert dark("solid") > 0.7 > 0.5 > dark("dots")


def test_some_crops_are_drawn_as_shorn_hair_is():
    """Tone on the skull, not long strokes: the median stroke is short."""

    def long(cut, seed):
        strokes, _ = drawn(replace(PLAIN, cut=cut, finish="strands"), 0, seed)
        return np.median([np.hypot(*np.diff(s.points, axis=0).T).sum() for s in strokes])

    lengths = [long("crop", seed) for seed in range(16)]
    assert 1 <= sum(length < 10 for length in lengths) <= 12


def test_bumps_stand_off_a_line_on_one_side_only():
    line = np.stack([np.linspace(0, 100, 60), np.zeros(60)], axis=1)
    for way in (1, -1):
        off = mop.bumps(np.random.default_rng(3), line, 8, 0.4 * way)[:, 1] * way
        assert off.min() > -1e-9 and 3 < off.max() < 12
        assert ((off[1:-1] < off[:-2]) & (off[1:-1] < off[2:])).sum() == 7  # between the bumps


def test_bent_strokes_have_their_length_and_turn():
    n, long, turn = 5, np.full(5, 20.0), np.full(5, np.pi)
    arcs = mop.bent(np.zeros((n, 2)), np.zeros(n), long, turn, np.zeros(n), 60)
    assert np.hypot(*np.diff(arcs, axis=1).T).sum(axis=0) == pytest.approx(long, rel=0.05)
    # Half a circle: its ends are 2/pi of its length apart.
    ends = np.linalg.norm(arcs[:, -1] - arcs[:, 0], axis=1)
    assert ends == pytest.approx(2 / np.pi * long, rel=0.05)
    assert np.abs(arcs.mean(axis=1)).max() < 1e-9


def test_dark_clothes_are_no_hair_and_stay_below_the_chin():
    """Those of a suit are often dark; what is told as hair does not change with them."""
    rig, parameters = load_rig(), FaceParameters()
    camera = zoomed(Camera.framing(rig.extent(parameters), SIZE, SIZE), 1.5)
    inked = []
    for seed in range(12):
        artist = replace(PLAIN, cut="crop", clothes="suit")
        rng = np.random.default_rng(seed)
        strokes, places, regions = draw_by_convention(
            rig, rig.pose(parameters), camera, parameters, artist, 1.4, rng
        )
        chin = places[LANDMARKS.index("chin"), 1]
        cloth = [s for s in strokes if s.kind == "clothes"]
        assert min(s.points[:, 1].min() for s in cloth) > chin - 0.05 * SIZE
        assert max(o[:, 1].max() for o in regions["hair"]) < chin
        inked.append(black(cloth).mean())
    assert max(inked) > 2.5 * min(inked)  # dark ones, and lines alone
