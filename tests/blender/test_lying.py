"""Sketches that lie on their sides or upside down, in Blender: told, and drawn over the face."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

bpy = pytest.importorskip("bpy")

from addon.blender.state import memory  # noqa: E402
from addon.blender.viewport import overlay  # noqa: E402

from .test_shell import press  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
UPRIGHT = {0: "", 90: "on its side", 180: "upside down", 270: "on its side"}


@pytest.mark.parametrize("clockwise", UPRIGHT)
def test_the_overlay_fits_a_sketch_as_it_lies(shell, sketch, tmp_path, reports, clockwise):
    path = tmp_path / "lies.png"
    with Image.open(sketch) as picture:
        picture.rotate(-clockwise, expand=True).save(path)
    press(sketch)
    upright = bpy.context.active_object
    reports()
    press(path)
    face, said = bpy.context.active_object, reports()
    assert face != upright
    assert ("it was turned to be read" in said) == bool(clockwise) and UPRIGHT[clockwise] in said

    def on_plane(face):
        return np.concatenate(
            [overlay.on_plane(face, line) for line in memory.unpack(face[memory.DRAWN])]
        )

    one, other = on_plane(upright), on_plane(face)  # metres
    for low_or_high in (np.min, np.max, np.mean):
        np.testing.assert_allclose(
            low_or_high(other, axis=0), low_or_high(one, axis=0), atol=0.0015
        )
    places = np.array([(10.0, 20.0), (300.0, 500.0)])
    np.testing.assert_allclose(
        overlay.on_page(face, overlay.on_plane(face, places)), places, atol=1e-3
    )
