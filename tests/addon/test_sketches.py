"""The sketches that ship: drawn as strokes, rendered from their SVG, readable by the program."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from addon.drawing import load_drawing
from addon.sketches.render import FOLDER, SIZE, render

SKETCHES = sorted(FOLDER.glob("*.svg"))


def test_there_are_at_least_three():
    assert len(SKETCHES) >= 3


@pytest.mark.parametrize("svg", SKETCHES, ids=lambda path: path.stem)
def test_a_sketch_is_strokes_and_nothing_else(svg):
    text = svg.read_text(encoding="utf-8")
    assert set(re.findall(r"<(\w+)", text)) == {"svg", "title", "desc", "g", "path"}
    assert text.count("<path") > 50


@pytest.mark.parametrize("svg", SKETCHES, ids=lambda path: path.stem)
def test_the_picture_is_the_drawing(svg):
    pytest.importorskip("resvg_py")
    shipped = np.asarray(Image.open(svg.with_suffix(".png")), np.int16)
    assert shipped.shape == (SIZE, SIZE)
    # Antialiasing may differ by a few tones between versions of the renderer, strokes may not.
    assert np.abs(shipped - np.asarray(render(svg), np.int16)).mean() < 0.1


@pytest.mark.parametrize("svg", SKETCHES, ids=lambda path: path.stem)
def test_a_sketch_is_read_as_ink_on_paper(svg):
    drawing = load_drawing(svg.with_suffix(".png"))
    assert not drawing.inverted
    ink = drawing.image < 0.5
    assert 0.01 < ink.mean() < 0.15
    # Open ends and gaps, as a hand leaves them: no single closed blob.
    assert ndimage.label(ink, np.ones((3, 3)))[1] > 20
