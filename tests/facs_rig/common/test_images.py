"""Resampling by area, against an integral worked out another way and against what it must keep."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skimage.measure import block_reduce

from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

PICTURE = np.random.default_rng(3).random((37, 53)).astype(np.float32)


def by_the_pixel(image, box, width, height, outside):
    """Each cell on its own: every pixel with the area that it shares with it."""
    found = np.empty((height, width))
    us = np.linspace(box.left, box.right, width + 1)
    vs = np.linspace(box.top, box.bottom, height + 1)
    for row in range(height):
        for column in range(width):
            over = [
                np.clip(np.minimum(pixel + 1, high) - np.maximum(pixel, low), 0, None)
                for pixel, low, high in (
                    (np.arange(image.shape[0]), vs[row], vs[row + 1]),
                    (np.arange(image.shape[1]), us[column], us[column + 1]),
                )
            ]
            cell = (us[1] - us[0]) * (vs[1] - vs[0])
            mean = over[0] @ (image.astype(float) - outside) @ over[1] / cell
            found[row, column] = mean + outside
    return found


@settings(max_examples=40)
@given(
    st.floats(-30, 40), st.floats(-30, 30), st.floats(1, 90), st.floats(1, 90),
    st.integers(1, 23), st.integers(1, 23), st.sampled_from([0.0, 1.0]),
)  # fmt: skip
def test_exact_for_any_rectangle(left, top, wide, high, width, height, outside):
    box = Box(left, top, left + wide, top + high)
    found = area_resample(PICTURE, box, (width, height), outside)
    assert found.shape == (height, width) and found.dtype == np.float32
    wanted = by_the_pixel(PICTURE, box, width, height, outside)
    assert found == pytest.approx(wanted, abs=2e-6)


def test_whole_blocks_as_scikit_image_has_them():
    found = area_resample(PICTURE, Box(0, 0, 52, 36), (13, 9))
    assert found == pytest.approx(block_reduce(PICTURE[:36, :52], (4, 4), np.mean), abs=1e-6)


@pytest.mark.parametrize("turn", [0.3, np.pi / 2, -2.0])
def test_a_turned_box_keeps_a_slope(turn):
    """A picture that rises evenly has, in each cell, what it has in the cell's middle."""
    v, u = np.mgrid[:200, :240] + 0.5
    slope = (0.3 * u + 0.7 * v).astype(np.float32)
    box = Box(80, 70, 160, 130, turn)
    found = area_resample(slope, box, (16, 12))
    grid = np.stack(np.meshgrid((np.arange(16) + 0.5) / 16, (np.arange(12) + 0.5) / 12), axis=-1)
    assert found == pytest.approx(box.to_pixels(grid) @ [0.3, 0.7], abs=0.02)


def test_a_quarter_turn_is_the_turned_picture():
    found = area_resample(PICTURE, Box.square((20, 18), 30, np.pi / 2), 30)
    upright = area_resample(PICTURE, Box.square((20, 18), 30), 30)
    inner = np.rot90(upright)[2:-2, 2:-2]  # between cells at the rim there is nothing to look up
    assert np.abs(found[2:-2, 2:-2] - inner).mean() < 0.12  # sampled, of noise
    assert np.corrcoef(found[2:-2, 2:-2].ravel(), inner.ravel())[0, 1] > 0.9


def test_at_the_same_scale_it_is_the_picture_itself():
    height, width = PICTURE.shape
    found = area_resample(PICTURE, Box(0, 0, width, height), (width, height), outside=1.0)
    assert found == pytest.approx(PICTURE, abs=1e-6)
    part = area_resample(PICTURE, Box(2, 3, 7, 8), 5)
    assert part == pytest.approx(PICTURE[3:8, 2:7], abs=1e-6)


def test_the_mean_is_kept_and_around_it_is_paper():
    height, width = PICTURE.shape
    small = area_resample(PICTURE, Box(0, 0, width, height), (7, 11), outside=1.0)
    assert small.mean() == pytest.approx(PICTURE.mean(), abs=1e-5)
    wide = area_resample(PICTURE, Box(-width, -height, 2 * width, 2 * height), 3, outside=1.0)
    assert wide[1, 1] == pytest.approx(PICTURE.mean(), abs=1e-5)
    assert np.delete(wide.ravel(), 4) == pytest.approx(np.ones(8))


@pytest.mark.parametrize("box", [Box(2, 2, 2, 3), Box(2, 2, 3, 1), Box(0, 0, np.nan, 1)])
def test_an_empty_box_is_refused(box):
    with pytest.raises(ValueError, match="empty"):
        area_resample(np.ones((4, 4)), box, 5)
