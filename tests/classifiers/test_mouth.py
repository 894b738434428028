"""The closer look at the mouth: where it looks, and what the shipped network says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from addon import strategies
from classifiers import load_detector
from classifiers.mouth import (
    MIRROR,
    MOUTH,
    SIDE,
    mouth_box,
    mouth_reader,
    opening,
)
from classifiers.preprocess import as_page, bounding_landmarks, points_of
from classifiers.runtime import WEIGHTS
from dataset_gen.generate import make_sample
from facs_rig import LANDMARKS
from tests.classifiers.marks import neutral_marks

SEED = 61_000_003  # far from those of the training, see mouth.json
OPENED = {"smile": 4.0, "jaw_open": 3.0}
COUNT = 20
DECIDED = 1 / (1 + math.exp(-strategies.OPENED))
"""From where on the program takes a mouth for open."""


def test_the_box_turns_with_the_face():
    plain, turned = mouth_box(neutral_marks()), mouth_box(neutral_marks(0.5), 0.5)
    bounds = points_of(neutral_marks(), bounding_landmarks(LANDMARKS))
    assert plain.width == pytest.approx(SIDE * np.ptp(bounds, axis=0).max())
    assert turned.width == pytest.approx(plain.width)
    inside = plain.to_units(points_of(neutral_marks(), MOUTH))
    assert turned.to_units(points_of(neutral_marks(0.5), MOUTH)) == pytest.approx(inside)
    assert inside.min() > 0.1 and inside.max() < 0.9


def test_a_shut_mouth_is_told_from_an_open_one_by_its_rims():
    marks = points_of(neutral_marks(), MOUTH)
    apart = marks.copy()
    low = [k for k, name in enumerate(MOUTH) if "lower" in name or name.endswith("bottom")]
    apart[low] += (0, 10)
    assert opening(marks) + 9 < opening(apart) <= opening(marks) + 10


def read(drawing):
    page = drawing.astype(np.float32) / 255
    return load_detector().detect(page).mouth


def test_laughs_are_open_and_faces_at_rest_are_shut():
    said = {
        name: [
            read(make_sample(SEED, k, 300, "sparse", engine, aus=aus)[0]).opened > DECIDED
            for engine in ("contours", "conventions")
            for k in range(COUNT // 2)
        ]
        for name, aus in (("open", OPENED), ("shut", {}))
    }
    assert np.mean(said["open"]) >= 0.9
    assert np.mean(said["shut"]) <= 0.1


def test_rims_are_found_where_they_are_drawn():
    off, at_rest = [], []
    for k in range(COUNT):
        drawing, record = make_sample(SEED, k, 300, "sparse", "contours", aus=OPENED)
        mouth, there = read(drawing), points_of(record["landmarks"], MOUTH)
        side = mouth_box(record["landmarks"]).width / SIDE
        off.append(abs(opening(points_of(mouth.landmarks, MOUTH)) - opening(there)) / side)
        at_rest.append(abs(opening(there)) / side)
    assert np.median(off) < 0.2 * np.median(at_rest)


GRIN = {"smile": 4.0, "grimace": 3.0}
SHOUT = {"jaw_open": 5.0}


def grins(aus, count):
    """Drawings of comics' mouths, with their landmarks as they are drawn."""
    k = 0
    while count:
        drawing, record = make_sample(SEED, k, 300, "sparse", "conventions", aus=aus, grins=1.0)
        k += 1
        if record["artist"]["grin"] != "none" and record["artist"]["manner"] != "portrait":
            count -= 1
            yield drawing, points_of(record["drawn_landmarks"], MOUTH)


@pytest.mark.parametrize("aus", [GRIN, SHOUT], ids=["teeth that meet", "shouting"])
def test_mouths_of_comics_are_found_as_large_as_they_are_drawn(aus):
    shares, opened = [], []
    for drawing, there in grins(aus, 12):
        mouth = read(drawing)
        found = points_of(mouth.landmarks, MOUTH)
        shares.append(opening(found) / opening(there))
        opened.append(mouth.opened > 0.5)
    assert 0.75 < np.median(shares) < 1.25
    assert np.mean(opened) >= 0.8


def test_teeth_that_meet_are_told_from_an_open_jaw():
    meet, apart = (np.mean([read(d).meets for d, _ in grins(a, 12)]) for a in (GRIN, SHOUT))
    assert meet > apart + 0.25


def test_a_mouth_beside_where_it_was_thought_to_be_is_looked_at_again():
    drawing, record = make_sample(SEED, 2, 300, "sparse", "contours", aus=OPENED)
    reader, page = mouth_reader(WEIGHTS, 1), as_page(drawing.astype(np.float32) / 255)
    marks = record["landmarks"]
    side = mouth_box(marks).width
    off = {n: (u + 0.08 * side * (n in MOUTH), v) for n, (u, v) in marks.items()}
    found = [points_of(reader.read(page, m, 0.0).landmarks, MOUTH) for m in (marks, off)]
    assert np.linalg.norm(found[0] - found[1], axis=1).mean() < 0.03 * side


def test_a_mirrored_page_gives_the_mirrored_mouth():
    drawing, record = make_sample(SEED, 1, 300, "sparse", "contours", aus=OPENED)
    reader = mouth_reader(WEIGHTS, 1)
    width = drawing.shape[1]
    page = as_page(drawing.astype(np.float32) / 255)
    plain = reader.read(page, record["landmarks"], 0.0)
    swapped = points_of(record["landmarks"], LANDMARKS)
    order = [LANDMARKS.index(_other(name)) for name in LANDMARKS]
    marks = dict(zip(LANDMARKS, (swapped[order] * (-1, 1) + (width, 0)).tolist(), strict=True))
    flipped = reader.read(np.ascontiguousarray(page[:, ::-1]), marks, 0.0)
    there = points_of(plain.landmarks, MOUTH)[MIRROR] * (-1, 1) + (width, 0)
    assert points_of(flipped.landmarks, MOUTH) == pytest.approx(there, abs=0.05)
    assert flipped.opened == pytest.approx(plain.opened, abs=1e-3)


def _other(name):
    return name.replace("left", "#").replace("right", "left").replace("#", "right")
