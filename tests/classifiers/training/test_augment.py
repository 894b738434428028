"""Training examples: the labels must follow whatever is done to the drawing."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from classifiers.training import negatives, scribbles, shards
from classifiers.training.augment import (
    FAR,
    NEAR,
    NO_FACE,
    PAD,
    WIDE,
    Names,
    artistic_page,
    example,
    mirrored,
)
from classifiers.training.paper import thicker, thinner, turned_and_bent
from classifiers.training.targets import encode
from dataset_gen.generate import make_sample
from facs_rig import LANDMARKS, TWELVE


@pytest.fixture(scope="module")
def names():
    return Names.of(TWELVE, LANDMARKS)


@pytest.fixture(scope="module")
def data(cartoons):
    loaded = shards.load(cartoons)
    return loaded, encode(loaded.records, TWELVE, LANDMARKS)


def make(data, names, seed, kind, row=0, size=128):
    drawings, targets = data[0].drawings, data[1]
    rng = np.random.default_rng(seed)
    return example(drawings[row], targets, row, names, size, rng, kind)


def same(a, b):
    for field in fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        np.testing.assert_allclose(x, y, atol=1e-6, err_msg=field.name)


def test_mirrored_twice_is_the_identity_and_once_exchanges_the_sides(data, names):
    one = make(data, names, 3, NEAR)
    other = mirrored(one, names)
    same(mirrored(other, names), one)
    left, right = TWELVE.index("grimace_left"), TWELVE.index("grimace_right")
    assert other.intensity[left] == one.intensity[right]
    np.testing.assert_allclose(other.angles, one.angles * [-1, 1, -1])
    corner = [LANDMARKS.index(f"mouth_corner_{side}") for side in ("left", "right")]
    np.testing.assert_allclose(
        other.landmarks[corner[0]], [1 - one.landmarks[corner[1], 0], one.landmarks[corner[1], 1]]
    )
    np.testing.assert_array_equal(other.ink, one.ink[:, ::-1])


def test_the_same_seed_makes_the_same_example(data, names):
    same(make(data, names, 5, NEAR), make(data, names, 5, NEAR))
    assert not np.array_equal(make(data, names, 5, NEAR).ink, make(data, names, 6, NEAR).ink)


@pytest.mark.parametrize("kind", [NEAR, FAR, NO_FACE, WIDE])
def test_examples_are_pages_of_ink(data, names, kind):
    for seed in range(8):
        one = make(data, names, seed, kind, row=seed)
        assert one.ink.shape == (128, 128) and one.ink.dtype == np.float32
        assert 0 <= one.ink.min() and one.ink.max() <= 1 and one.kind == kind
        assert np.isfinite(one.ink).all()
    if kind == NEAR:
        assert one.landmarks.min() > -0.35 and one.landmarks.max() < 1.35
    if kind == WIDE:  # the face takes the middle half
        assert 0.05 < one.landmarks.min() and one.landmarks.max() < 0.95


def test_points_move_with_the_page_that_is_turned_and_bent():
    places = np.array([[60.5, 80.5], [180.5, 70.5], [120.5, 190.5], [150.5, 120.5]])
    for seed in range(6):
        worst = []
        moved = turned = None
        for k, (u, v) in enumerate(places):
            page = np.zeros((256, 256), np.uint8)
            page[int(v) - 2 : int(v) + 3, int(u) - 2 : int(u) + 3] = 255
            image, moved, turned = turned_and_bent(page, places, np.random.default_rng(seed))
            grid = np.arange(256) + 0.5
            weight = image.astype(float)
            seen = (weight.sum(0) @ grid / weight.sum(), weight.sum(1) @ grid / weight.sum())
            worst.append(np.hypot(*(np.array(seen) - moved[k])))
        assert max(worst) < 1.0
        # clockwise is positive: a vector to the right turns downwards
        before, after = places[1] - places[0], moved[1] - moved[0]
        angle = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
        assert angle == pytest.approx(turned, abs=0.08)


def test_line_weight_changes_by_a_pixel():
    page = np.zeros((20, 20), np.uint8)
    page[:, 8:11] = 255
    assert (thicker(page)[10] > 0).sum() == 4
    assert (thinner(page)[10] > 0).sum() == 2
    hairline = np.zeros((20, 20), np.uint8)
    hairline[:, 8] = 255
    np.testing.assert_array_equal(thinner(hairline), hairline)


def test_an_artists_page_keeps_the_face_in_place(data, names):
    drawings, targets = data[0].drawings, data[1]
    added = 0.0
    for row in range(12):
        rng = np.random.default_rng(row)
        points = targets.landmarks[row]
        page, moved, turn = artistic_page(drawings[row], points, True, 0.5, names, rng)
        assert page.shape == tuple(n + 2 * PAD for n in drawings[row].shape)
        assert abs(turn) < 0.3
        assert np.hypot(*(moved - points - PAD).T).max() < 45
        added += page.sum() / max((255 - drawings[row]).sum(), 1) - 1
    assert added / 12 > 0.2  # hair and the like: clearly more ink than was there


def test_pages_without_a_face_are_all_sorts(rng):
    pages = {kind.__name__: kind(rng) for kind, _ in negatives.KINDS}
    for name, page in pages.items():
        assert page.dtype == np.uint8 and page.shape == (256, 256), name
    coverage = {name: page.mean() / 255 for name, page in pages.items()}
    assert coverage["nearly_blank"] < 0.5 and max(coverage.values()) > 0.02
    drawing = np.zeros((256, 256), np.uint8)
    drawing[100:110] = 255
    torn = negatives.torn_face(drawing, rng)
    assert torn.sum() == drawing.sum() and not np.array_equal(torn, drawing)


def test_features_are_drawn_where_they_lie_and_only_seen_from_the_front():
    """A pen that follows the landmarks stays near them; a half-hidden eye keeps it away."""
    made = (make_sample(3, k, scheme="sparse") for k in range(20))
    sample = next(s for s in made if abs(s[1]["head"]["yaw"]) < 5)
    points = np.array([sample[1]["landmarks"][name] for name in LANDMARKS])
    turned = points * (0.2, 1.0)
    turned[[n.endswith("_left") for n in LANDMARKS], 0] *= 0.4
    inked = 0
    for seed in range(12):
        for spots, allowed in ((points, True), (turned, False)):
            page = Image.new("L", (256, 256))
            pen = scribbles.Pen(page, scribbles.Frame.of(spots, LANDMARKS))
            scribbles.features(pen, np.random.default_rng(seed))
            drawn = np.argwhere(np.array(page))[:, ::-1]
            if len(drawn):
                assert allowed
                away = cKDTree(spots).query(drawn)[0] / pen.frame.unit
                assert away.max() < 0.3
                inked += 1
    assert inked > 6
