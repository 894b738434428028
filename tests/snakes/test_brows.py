"""Brows are as thick as they are drawn."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw

from facs_rig import Camera, FaceParameters, load_rig
from snakes.brows import THINNEST, brow_thickness

FINER = 4


@pytest.fixture(scope="module")
def face():
    """(rig, its vertices, a camera on them)."""
    rig = load_rig()
    vertices = rig.pose(FaceParameters(head=(0.2, 0.0, 0.0)))
    return rig, vertices, Camera.framing(vertices, 500, 500)


def drawn(face, thickness, ink=255, edges=False):
    """A page (500, 500), 1 is paper, with brows of that thickness: filled, or their edges alone."""
    rig, _, camera = face
    who = rig.pose(FaceParameters({}, {"brow_thickness": thickness}, (0.2, 0.0, 0.0)))
    image = Image.new("L", (FINER * 500, FINER * 500))
    pen = ImageDraw.Draw(image)
    for side in ("left", "right"):
        lower, upper = (
            FINER * camera.project(rig.stroke_points(who, f"brow_{edge}_{side}"))
            for edge in ("lower", "upper")
        )
        if edges:
            for line in (lower, upper):
                pen.line(line.ravel().tolist(), fill=ink, width=FINER)
        else:
            pen.polygon(np.concatenate([lower, upper[::-1]]).ravel().tolist(), fill=ink)
    return 1 - np.asarray(image.resize((500, 500), Image.Resampling.BOX), np.float32) / 255


@pytest.mark.parametrize("ink", [255, 120])
@pytest.mark.parametrize("thickness", [-0.4, 0.0, 0.4, 0.8])
def test_filled_brows_come_out_nearly_as_thick_as_they_were(face, thickness, ink):
    found = brow_thickness(drawn(face, thickness, ink), *face, {})
    assert found == pytest.approx(thickness, abs=0.2)


def test_thicker_brows_are_found_thicker_filled_or_in_outlines(face):
    for edges in (False, True):
        found = [brow_thickness(drawn(face, t, edges=edges), *face, {}) for t in (-0.5, 0, 0.5, 1)]
        assert (np.diff(found) > 0.15).all(), found


def test_a_single_stroke_is_thin_and_no_brow_is_unknown(face):
    rig, vertices, camera = face
    page = np.ones((500, 500), np.float32)
    assert brow_thickness(page, *face, {}) is None
    for side in ("left", "right"):
        lower, upper = (
            camera.project(rig.stroke_points(vertices, f"brow_{edge}_{side}"))
            for edge in ("lower", "upper")
        )
        middle = (lower + upper) / 2
        for a, b in zip(middle[:-1], middle[1:], strict=True):
            many = np.linspace(a, b, 50).astype(int)
            page[many[:, 1], many[:, 0]] = 0
    assert brow_thickness(page, *face, {}) == THINNEST
