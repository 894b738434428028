"""Hair in locks: it lies where hair is told, and the artist's tone says how dark it is."""

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation

from dataset_gen.conventions import Artist, draw_by_convention
from facs_rig import Camera, FaceParameters, load_rig

SIZE = 300
CUTS = ("short", "swept", "quiff", "flat", "receding", "fringe", "bob", "long", "bun", "tail")


def strokes_of(cut, tone, seed=3, yaw=0.0):
    """The strokes of the hair, and the pixels (SIZE, SIZE) that are told as hair."""
    rig, parameters = load_rig(), FaceParameters({}, {}, (np.radians(yaw), 0.0, 0.0))
    camera = Camera.framing(rig.extent(parameters), SIZE, SIZE).cropped(
        -90, -80, 390, 400, SIZE, SIZE
    )
    artist = Artist(cut=cut, finish="locks", hair_tone=tone, brow="none", reach=1.0)
    strokes, _, regions = draw_by_convention(
        rig, rig.pose(parameters), camera, parameters, artist, 1.2, np.random.default_rng(seed)
    )
    told = Image.new("1", (SIZE, SIZE))
    for outline in regions["hair"]:
        ImageDraw.Draw(told).polygon([tuple(p) for p in outline], fill=1)
    return [s for s in strokes if s.kind in ("hair", "mass")], np.asarray(told)


def inked(strokes, pen=1.2):
    """(SIZE, SIZE) bool, the pixels of strokes."""
    page = Image.new("1", (SIZE, SIZE))
    for stroke in strokes:
        width = max(round(pen * stroke.width), 1)
        ImageDraw.Draw(page).line([tuple(p) for p in stroke.points], fill=1, width=width)
    return np.asarray(page)


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("yaw", [0, 30])
def test_locks_lie_where_hair_is_told(cut, yaw):
    for seed in range(3):
        strokes, told = strokes_of(cut, 0.6, seed, yaw)
        ink = inked(strokes)
        assert ink[told].mean() > 0.1
        # Tips may stick out, by little.
        assert told[ink].mean() > 0.7
        assert binary_dilation(told, iterations=14)[ink].mean() > 0.97


@pytest.mark.parametrize("cut", ["short", "long"])
def test_the_tone_says_how_dark_locks_are(cut):
    share = [
        np.mean([ink[told].mean() for strokes, told in drawings for ink in [inked(strokes)]])
        for drawings in ([strokes_of(cut, tone, seed) for seed in range(6)]
                         for tone in (0.1, 0.5, 0.95))
    ]  # fmt: skip
    assert share[0] < 0.8 * share[1] and share[1] < 0.8 * share[2]
    assert share[2] > 0.5


def test_a_seed_draws_the_same_locks_again_and_another_others():
    (once, _), (again, _), (other, _) = (strokes_of("short", 0.5, seed) for seed in (4, 4, 5))
    assert len(once) == len(again)
    assert all(np.array_equal(a.points, b.points) for a, b in zip(once, again, strict=True))
    assert len(once) != len(other) or any(
        not np.array_equal(a.points, b.points) for a, b in zip(once, other, strict=True)
    )
