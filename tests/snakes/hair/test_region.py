"""Hair on a page: the coarse answer of a network, brought to the lines."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import load_rig
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample
from snakes.hair.region import page_hair


def found(scene, drawing, at=None, **more):
    return page_hair(drawing, at or scene.at(), load_rig(), scene.vertices, scene.camera, **more)


def on_grid(page, mask):
    """(h, w) bool of the page's pixels, in the cells of the grid."""
    return area_resample(mask.astype(np.float32), page.box, page.hair.shape[::-1]) > 0.5


def coarse(page, at):
    v, u = np.mgrid[: page.hair.shape[0], : page.hair.shape[1]]
    cells = np.stack([u.ravel(), v.ravel()], axis=1)
    return (at("hair", page.pixels(cells)) > 0.5).reshape(page.hair.shape)


@pytest.mark.parametrize("name, yaw", [("crop", 0), ("bob", 25), ("afro", -30)])
@pytest.mark.parametrize("how", ["black", "outline"])
def test_a_region_ends_where_its_lines_are(hairy, name, yaw, how):
    scene = hairy(name, yaw)
    page = found(scene, scene.drawn(how))
    truth = on_grid(page, scene.hair)
    assert hairy.overlap(page.hair, truth) > 0.85
    assert hairy.overlap(page.hair, truth) >= hairy.overlap(coarse(page, scene.at()), truth) - 0.01
    assert page.texture == how and (page.tone > 0.9 if how == "black" else page.tone < 0.4)
    assert not page.beard.any()


def test_lines_correct_what_a_network_says(hairy):
    scene = hairy("crop", 0)
    shifted = np.roll(scene.hair, (-4, 7), axis=(0, 1))
    page = found(scene, scene.drawn("black"), scene.at(shifted))
    truth = on_grid(page, scene.hair)
    assert hairy.overlap(page.hair, truth) > hairy.overlap(on_grid(page, shifted), truth) + 0.1


def test_a_bald_head_has_no_hair(hairy):
    scene = hairy(None, 0)
    page = found(scene, 1.0 - hairy.outline(scene.head, 1))
    assert not page.hair.any() and not page.beard.any()
    assert page.texture == "" and page.tone == 0 and page.part is None
    assert page.contour.shape == (0, 2) and not page.strokes.coherence.any()


def test_an_empty_page_has_no_hair(hairy):
    scene = hairy("bob", 0)
    blank = found(scene, np.ones(scene.hair.shape), scene.at(np.zeros_like(scene.hair)))
    assert not blank.hair.any()


def test_hair_that_leaves_the_page_is_kept_to_its_edge(hairy):
    scene = hairy("bob", 0)
    top = int(np.flatnonzero(scene.hair.any(axis=1))[0]) + 25
    drawing = scene.drawn("black")[top:]
    camera = scene.camera.cropped(0, top, 300, 330, 300, 330 - top)
    inner = scene.at()

    def at(region, points):
        return inner(region, points + (0, top))

    page = page_hair(drawing, at, load_rig(), scene.vertices, camera)
    assert page.hair[0].any()
    assert hairy.overlap(page.hair, on_grid(page, scene.hair[top:])) > 0.85


def test_a_page_may_be_nearly_all_hair(hairy):
    scene = hairy("long_wavy", 0)
    everything = ~scene.head
    page = found(scene, 1.0 - everything, scene.at(everything))
    assert page.hair.any() and page.hair[~page.head].mean() > 0.4
    assert page.hair[page.head].mean() < 0.3


def test_hair_of_another_head_is_left_out(hairy):
    scene = hairy("bob", 0)
    right = int(np.flatnonzero(scene.hair.any(axis=0))[-1])
    other = np.zeros_like(scene.hair)
    width = min(80, scene.hair.shape[1] - right)
    rows = scene.hair.any(axis=1)
    other[rows, right - 3 : right + width] = True  # touches ours
    drawing = np.minimum(scene.drawn("black"), 1.0 - other)
    low, high = np.flatnonzero(rows)[[0, -1]]
    head = Box(right, low, right + (high - low) * 0.8, high)
    page = found(scene, drawing, scene.at(scene.hair | other), others=[head])
    theirs = on_grid(page, other & ~scene.hair)
    assert page.hair[theirs].mean() < 0.35
    assert hairy.overlap(page.hair & ~theirs, on_grid(page, scene.hair) & ~theirs) > 0.85


def test_strokes_run_as_they_are_drawn(hairy):
    scene = hairy("bob", 0)
    u = np.arange(scene.hair.shape[1])
    stripes = scene.hair & (u % 6 < 2)  # upright
    page = found(scene, 1.0 - np.maximum(stripes, hairy.outline(scene.hair, 1)))
    clear = page.strokes.coherence > 0.6
    assert page.texture == "strands" and clear.mean() > 0.05
    assert np.median(np.abs(page.strokes.along[clear][:, 1])) > 0.97
    assert not page.strokes.coherence[~page.hair].any()


def test_cells_and_pixels_are_the_reverse_of_each_other(hairy):
    scene = hairy("crop", 0)
    page = found(scene, scene.drawn("black"))
    points = np.array([[10.0, 20.0], [150.5, 99.5]])
    assert np.allclose(page.pixels(page.cells(points)), points)
