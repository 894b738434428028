"""Shaded pages: still pages of ink, on which the face can be found."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers.training import shards
from classifiers.training.scribbles import Frame
from classifiers.training.targets import encode
from classifiers.training.toning import toned
from facs_rig import LANDMARKS, TWELVE


@pytest.fixture(scope="module")
def pages(cartoons):
    loaded = shards.load(cartoons)
    points = encode(loaded.records, TWELVE, LANDMARKS).landmarks
    return [(255 - loaded.drawings[k], Frame.of(points[k], LANDMARKS)) for k in range(24)]


def test_shade_is_ink_too_and_the_lines_stay(pages):
    more, kept = [], []
    for seed, (ink, frame) in enumerate(pages):
        shaded = toned(ink, frame, np.random.default_rng(seed))
        assert shaded.shape == ink.shape and shaded.dtype == np.uint8
        more.append(shaded.sum() / ink.sum())
        lines = ink > 128
        kept.append(shaded[lines].mean() / max(shaded[~lines].mean(), 1))
    assert np.median(more) > 1.3  # there is shade
    assert np.median(kept) > 4 and min(kept) > 1.1  # and lines are darker than it


def test_the_same_lot_shades_alike_and_another_does_not(pages):
    ink, frame = pages[0]
    first, again, other = (toned(ink, frame, np.random.default_rng(seed)) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first.astype(int) - other).mean() > 1


def test_an_empty_page_stays_a_page(pages):
    empty = np.zeros_like(pages[0][0])
    for seed in range(12):
        assert toned(empty, pages[0][1], np.random.default_rng(seed)).shape == empty.shape
