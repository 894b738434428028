"""From page to crop and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from classifiers.preprocess import as_page, bounding_landmarks, even_ink, face_box, ink_square
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

finite = st.floats(-500, 500)
positive = st.floats(0.5, 500)


@given(finite, finite, positive, positive, finite, finite)
def test_points_survive_the_way_to_the_crop_and_back(left, top, width, height, u, v):
    crop = Box.at(left, top, width, height)
    assert crop.to_pixels(crop.to_units([[u, v]]))[0] == pytest.approx((u, v), abs=1e-6)


def test_a_dot_lands_where_the_crop_says(rng):
    for _ in range(20):
        ink = np.zeros((90, 130), np.float32)
        row, column = rng.integers(20, 70, 2)
        ink[row, column] = 1
        crop = Box.at(*rng.uniform(-5, 10, 2), *rng.uniform(90, 150, 2))
        u, v = crop.to_units([column + 0.5, row + 0.5]) * 64
        small = area_resample(ink, crop, 64)
        grid = np.arange(64) + 0.5
        mean = (small.sum(0) @ grid / small.sum(), small.sum(1) @ grid / small.sum())
        assert mean == pytest.approx((u, v), abs=0.5)


@pytest.mark.parametrize("factor", [1, 2, 3, 7])
def test_whole_factors_agree_with_pillows_box_filter(rng, factor):
    page = rng.random((32 * factor, 32 * factor)).astype(np.float32)
    theirs = np.asarray(Image.fromarray(page).resize((32, 32), Image.Resampling.BOX))
    ours = area_resample(page, Box.at(0, 0, 32 * factor, 32 * factor), 32)
    np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_any_rectangle_agrees_with_counting_on_a_finer_page(rng):
    # Each pixel as 10 x 10 equal ones makes every edge in tenths of a pixel a whole one.
    page = rng.random((23, 31)).astype(np.float32)
    fine = np.kron(page, np.ones((10, 10), np.float32))
    left, top, width, height = -24, 32, 192, 240  # in tenths; reaches over the left and the bottom
    padded = np.zeros((top + height, width), np.float32)
    seen = fine[:, : left + width]
    padded[: len(seen), -left:] = seen[: top + height]
    cells = padded[top:].reshape(8, height // 8, 8, width // 8)
    ours = area_resample(page, Box.at(left / 10, top / 10, width / 10, height / 10), 8)
    np.testing.assert_allclose(ours, cells.mean(axis=(1, 3)), atol=1e-5)


def test_ink_is_kept_and_off_the_page_is_paper(rng):
    page = rng.random((50, 40)).astype(np.float32)
    crop = Box.at(-7.3, -3.9, 61.0, 70.2)
    small = area_resample(page, crop, 33)
    assert small.sum() * 61.0 * 70.2 / 33**2 == pytest.approx(float(page.sum()), rel=1e-4)
    assert not area_resample(page, Box.at(400, 0, 20, 20), 8).any()


def test_thin_and_faint_lines_look_like_bold_ones():
    bold = np.zeros((64, 64), np.float32)
    bold[30:32] = 0.9
    faint = bold / 3
    np.testing.assert_allclose(even_ink(faint), even_ink(bold), atol=1e-6)
    assert even_ink(np.full((8, 8), 0.004, np.float32)).max() < 0.05


def test_the_ink_box_ignores_specks_and_frames_the_drawing():
    page = np.zeros((200, 300), np.float32)
    page[50:150, 100:102] = page[50:150, 198:200] = 1
    page[50:52, 100:200] = page[148:150, 100:200] = 1
    clean = ink_square(page)
    assert (clean.left + clean.width / 2, clean.top + clean.height / 2) == pytest.approx(
        (150, 100), abs=1.5
    )
    assert 100 <= clean.width <= 110 and clean.width == clean.height
    page[3, 290] = 0.3
    assert ink_square(page).width <= clean.width + 2
    large = np.kron(page, np.ones((5, 5), np.float32))
    for side in ("left", "top", "width"):
        assert getattr(ink_square(large), side) == pytest.approx(
            5 * getattr(ink_square(page), side), abs=9
        )
    blank = ink_square(np.zeros((20, 50), np.float32))
    assert (blank.left, blank.width) == (0, 50)


def test_the_face_box_leaves_out_what_lies_outside_the_face():
    assert bounding_landmarks(["chin", "crown", "neck_left", "jaw_left"]) == ["chin", "jaw_left"]
    box = face_box(np.array([[10, 20], [30, 80], [50, 50]]))
    assert (box.left + box.width / 2, box.top + box.height / 2) == pytest.approx((30, 50))
    assert box.width == pytest.approx(box.height)
    assert box.width > 60


@pytest.mark.parametrize(
    ("drawing", "message"),
    [
        (np.ones((4, 4, 3), np.float32), "grey image"),
        (np.ones((0, 4), np.float32), "at least one pixel"),
        (np.full((4, 4), 255, np.uint8), "divide by the largest value"),
        (np.full((4, 4), 255.0), "between 0"),
        (np.full((4, 4), np.nan), "between 0"),
    ],
)
def test_what_is_no_drawing_is_refused_in_one_sentence(drawing, message):
    with pytest.raises(ValueError, match=message) as caught:
        as_page(drawing)
    assert "\n" not in str(caught.value)


def test_a_turned_crop_is_the_upright_one_of_a_turned_page():
    v, u = np.indices((300, 260)) + 0.5
    middle = np.array([130.0, 140.0])

    def blobs(turn):  # smooth: nothing that sampling could miss
        out = np.zeros((300, 260))
        for du, dv, size in ((30, -10, 9), (-25, 20, 14), (5, 45, 7)):
            c, s = np.cos(turn), np.sin(turn)
            x, y = middle + (c * du - s * dv, s * du + c * dv)
            out += np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * size**2))
        return (out / out.max()).astype(np.float32)

    upright = area_resample(blobs(0.0), Box.square(middle, 150), 64)
    for turn in (0.2, -0.7, np.pi / 2, 3.0):
        turned = area_resample(blobs(turn), Box.square(middle, 150, turn), 64)
        assert turned.dtype == np.float32 and np.abs(turned - upright).max() < 0.01
    crop = Box.at(10, 20, 60, 40, 0.6)
    points = np.array([[0.0, 0.0], [1.0, 0.3], [0.5, 0.5]])
    assert np.allclose(crop.to_units(crop.to_pixels(points)), points)
    assert np.allclose(crop.to_pixels(points[2]), crop.middle)
    right = crop.to_pixels(np.array([1.0, 0.5])) - crop.middle  # clockwise: its right goes down
    assert np.allclose(right, (30 * np.cos(0.6), 30 * np.sin(0.6)))
