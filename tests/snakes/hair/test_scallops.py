"""Curls from the outline of hair, by outlines whose kind is known, and from its strokes."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy import ndimage

from snakes.hair.scallops import scallops
from snakes.hair.texture import strokes_in, texture_of

ROWS, FINE = 112, 4
UNIT = ROWS * FINE  # of the picture that a mass is drawn on, to a head
MIDDLE = 0.8  # heads
WIDE, HIGH = 0.43, 0.48  # half of a mass of hair


def mass(kind: str, rng: np.random.Generator, size: float = 0.05) -> np.ndarray:
    """(h, w) ink of hair around a face that is filled, with an outer edge of a kind.

    size : heads, radius of the scallops, length of teeth, half the width of locks
    """
    picture = Image.new("L", (round(2 * MIDDLE * UNIT),) * 2)
    draw = ImageDraw.Draw(picture)
    turn = np.linspace(-1.9, 1.9, 400)

    def disc(x, y, wide, high, fill):
        box = np.array([x - wide, y - high, x + wide, y + high]) * UNIT
        draw.ellipse(box.tolist(), fill=fill)

    def at(turn, further=0.0):
        return (MIDDLE + (WIDE + further) * np.sin(turn), MIDDLE - (HIGH + further) * np.cos(turn))

    off = np.zeros(len(turn))
    if kind == "noise":
        off = 0.005 * _unit(ndimage.gaussian_filter1d(rng.normal(0, 1, len(turn)), 4))
    if kind == "sway":
        off = 0.012 * np.sin(turn * rng.uniform(6, 9))
    if kind == "teeth":
        ends = np.linspace(-1.9, 1.9, 60)
        off = np.interp(turn, ends, rng.uniform(0.3, 1, 60) * np.tile([0, size], 30))
    outline = np.stack(at(turn, off), axis=1) * UNIT
    bottom = [(MIDDLE * UNIT, (MIDDLE + 0.4) * UNIT)]
    draw.polygon([*map(tuple, outline.tolist()), *bottom], fill=255)
    place = -1.9
    while kind == "scallops" and place < 1.9:
        radius = size * rng.uniform(0.8, 1.25)
        disc(*at(place, rng.normal(0, 0.004)), radius, radius, 255)
        place += radius * rng.uniform(1.4, 1.8) / WIDE
    for place in rng.uniform(-1.9, 1.9, 14) if kind == "locks" else ():
        x, y = at(place, -0.02)
        way = place + rng.choice([-1, 1]) * rng.uniform(0.5, 1.2)
        long = rng.uniform(1.5, 3) * size
        aside = 0.4 * size * np.array([np.cos(way), np.sin(way)])
        tip = (x + long * np.sin(way), y - long * np.cos(way))
        corners = np.array([(x + aside[0], y + aside[1]), tip, (x - aside[0], y - aside[1])])
        draw.polygon((corners * UNIT).ravel().tolist(), fill=255)
    disc(MIDDLE, MIDDLE + 0.2, 0.3, 0.42, 0)  # the face
    return np.asarray(picture.reduce(FINE)) / 255


def _unit(values: np.ndarray) -> np.ndarray:
    return values / values.std()


def region_of(ink: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The hair as it is found: wrong at its edge by a cell here and there."""
    wrong = 1.4 * ndimage.gaussian_filter(rng.normal(0, 1, ink.shape), 1.5)
    return ndimage.gaussian_filter((ink > 0.5) + wrong, 1.0) > 0.5


def how_often(kind: str, size: float = 0.05) -> float:
    rng = np.random.default_rng(3)
    inks = [mass(kind, rng, size) for _ in range(10)]
    return float(np.mean([told(ink, region_of(ink, rng)) == "curls" for ink in inks]))


def told(ink: np.ndarray, region: np.ndarray) -> str:
    return texture_of(ink, region, strokes_in(ink, region, ROWS), ROWS)


@pytest.mark.parametrize("kind", ["smooth", "noise", "sway", "teeth", "locks"])
def test_straight_hair_is_not_scalloped(kind):
    assert how_often(kind) <= 0.1


@pytest.mark.parametrize("size", [0.045, 0.06])
def test_round_bumps_are_scallops(size):
    assert how_often("scallops", size) >= 0.8


def test_black_and_outlined_curls_are_told_by_their_edge():
    rng = np.random.default_rng(5)
    for kind, found in (("scallops", ("curls", "curls")), ("smooth", ("black", "outline"))):
        ink = mass(kind, rng, 0.06)
        region = ink > 0.5
        line = 1.0 * (region & ~ndimage.binary_erosion(region))
        for drawn, texture in zip((ink, line), found, strict=True):
            assert told(drawn, region) == texture


def test_long_highlights_say_that_black_hair_is_straight():
    rng = np.random.default_rng(5)
    ink = mass("scallops", rng, 0.06)
    region = ink > 0.5
    v, u = np.nonzero(ndimage.binary_erosion(region, iterations=8))
    lines, specks = ink.copy(), ink.copy()
    for k in rng.integers(0, len(v), 25):
        lines[v[k] : v[k] + 25, u[k]] = 0
        specks[v[k] : v[k] + 4, u[k] : u[k] + 2] = 0
    assert [told(drawn, region) for drawn in (lines, specks)] == ["black", "curls"]


def test_what_the_page_cuts_off_has_no_edge_there():
    ink = mass("scallops", np.random.default_rng(5), 0.05)
    below = np.flatnonzero(ink.any(axis=1))[0] + 15
    whole, cut = (scallops(part, part > 0.5, ROWS)[0] for part in (ink, ink[below:]))
    assert cut > 0.8 * whole > 3


@pytest.mark.parametrize("high", [1, 2, 5])
@pytest.mark.parametrize("wide", [1, 3, 40])
@pytest.mark.parametrize("tone", [0.0, 0.3, 1.0])
def test_specks_and_slivers_are_not_curly(high, wide, tone):
    region = np.zeros((60, 60), dtype=bool)
    region[20 : 20 + high, 10 : 10 + wide] = True
    assert told(tone * region, region) != "curls"
