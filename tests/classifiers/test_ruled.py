"""Drawings on lined and squared paper, and pages that are mostly black."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw

from addon import drawing
from addon.drawing import Drawing
from addon.sketches.render import FOLDER as SKETCHES
from classifiers import load_detector
from classifiers.ruled import find, without_rules
from tests.classifiers.doodles import head

PAPERS = {
    "lines": {},
    "faint": {"tone": 200},
    "squares": {"squares": True},
    "slanted": {"slope": 0.02},
    "margin": {"margin": True, "tone": 150},
    "slanted squares": {"slope": -0.04, "squares": True, "tone": 180},
}


def page() -> np.ndarray:
    with Image.open(SKETCHES / "smiling_woman.png") as picture:
        return np.asarray(picture.convert("L"))


def on_paper(ink, gap=28, width=2, tone=90, slope=0.0, squares=False, margin=False):
    """A drawing (h, w) uint8 on paper with rules."""
    high, wide = ink.shape
    paper = Image.new("L", (wide, high), 255)
    pen = ImageDraw.Draw(paper)
    for v in range(gap // 2 - 2 * gap, high + 2 * gap, gap):
        pen.line([0, v, wide, v + slope * wide], fill=tone, width=width)
    uprights = range(gap // 2, wide + 2 * gap, gap) if squares else [wide // 8] if margin else []
    for u in uprights:
        pen.line([u, 0, u - slope * high, high], fill=tone, width=width)
    return np.minimum(ink, np.asarray(paper))


@pytest.mark.parametrize("paper", PAPERS)
def test_rules_are_taken_out_and_the_drawing_stays(paper):
    clean = Drawing.of(page()).image
    read = Drawing.of(on_paper(page(), **PAPERS[paper])).image
    drawn, found = clean < 0.5, read < 0.5
    assert (found & drawn).sum() > 0.95 * drawn.sum()
    assert (found & ~drawn).sum() < 0.25 * drawn.sum()  # where strokes and rules meet
    one, other = (load_detector().detect(image) for image in (clean, read))
    assert other.trouble == "" and other.turn == 0
    assert other.active["smile"] and one.active["smile"]


@pytest.mark.parametrize("seed", range(6))
def test_drawings_without_rules_are_not_touched(seed):
    ink = 1 - head(40 + seed) > 0.3
    darkness = np.where(ink, 0.8, 0).astype(np.float32)
    assert without_rules(darkness, ink) is darkness


def test_a_few_straight_strokes_are_no_rules():
    ink = np.zeros((400, 400), bool)
    for row in (80, 100, 320):
        ink[row : row + 2] = True
    assert find(ink) is None
    ink[::25] = True
    found = find(ink)
    assert found is not None and len(found.rows) >= 12 and abs(found.slope) < 0.005


def test_much_solid_black_is_no_blank_page_and_no_photograph():
    """Hair, a hat, a night: more than half of the page is ink."""
    black = np.concatenate([np.zeros((900, page().shape[1]), np.uint8), page()])
    for share in (black, black[400:], black[300:]):
        found = Drawing.of(share)
        assert not found.inverted
        there = found.image[-page().shape[0] :] < 0.5
        assert (there == (page() < 128)).mean() > 0.98
    assert drawing.normalise(black).shape == black.shape
