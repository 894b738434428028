"""Curly hair and straight hair as artists draw it, told by how it is drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw

from dataset_gen import STYLES, ink
from dataset_gen.conventions import Artist, curls, draw_by_convention, zoomed
from facs_rig import Camera, FaceParameters, load_rig
from snakes.hair.texture import is_curly
from snakes.lines import HEAD

SIZE, FINER, ROWS = 280, 3, 112
ARTIST = Artist(cut="short", clothes="none", room=1.6, beard="none", volume=0.25)
SEEDS = range(8)


def drawn(cut: str, finish: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(h, w) ink of the hair alone, and bool where it is told to be, ROWS cells to a head."""
    rig, parameters = load_rig(), FaceParameters({}, {}, (0.0, 0.3, 0.0))
    width = FINER * SIZE
    camera = zoomed(Camera.framing(rig.extent(parameters), width, width), ARTIST.room)
    many = round(width * ROWS / (HEAD * camera.scale[0]))
    artist = replace(ARTIST, cut=cut, finish=finish, hair_tone=0.4)
    strokes, _, regions = draw_by_convention(
        rig, rig.pose(parameters), camera, parameters, artist, 4.0, np.random.default_rng(seed)
    )
    page = Image.new("L", (width, width))
    for outline in regions["hair"]:
        ImageDraw.Draw(page).polygon(outline.ravel().tolist(), fill=255)
    hair = [s for s in strokes if s.kind in ("hair", "mass")]
    black = Image.fromarray(255 - ink(hair, width, width, STYLES["ink"]))
    pages = [np.asarray(one.resize((many, many), Image.Resampling.BOX)) for one in (black, page)]
    return pages[0] / 255, pages[1] > 127


def how_often(cut: str, finish: str) -> float:
    """The share of drawings whose hair is called curly."""
    return float(np.mean([is_curly(*drawn(cut, finish, seed), ROWS) for seed in SEEDS]))


@pytest.mark.parametrize(
    ("way", "least"), [("clumps", 0.4), ("frizz", 0.7), ("bumps", 0.7), ("rings", 0.7)]
)
def test_curls_are_told_however_they_are_drawn(way, least, monkeypatch):
    for manner, odds in curls.WAYS.items():
        monkeypatch.setitem(curls.WAYS, manner, {name: float(name == way) for name in odds})
    assert how_often("short", "curls") >= least


@pytest.mark.parametrize("finish", ["black", "hatch", "locks", "outline", "strands"])
@pytest.mark.parametrize("cut", ["short", "long"])
def test_straight_hair_is_not_curly(cut, finish):
    assert how_often(cut, finish) <= 0.2
