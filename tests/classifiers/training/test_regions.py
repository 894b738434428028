"""Where face, hair and beard are: as drawn, as a mask of a crop, as it is learnt and read."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers.labels import REGIONS
from classifiers.mask import Mask
from classifiers.training.augment import NEAR, PAD, WIDE, Names, example
from classifiers.training.regions import Outlines
from classifiers.training.shards import DataSet
from classifiers.training.targets import encode_all
from dataset_gen.generate import make_sample
from facs_rig import LANDMARKS, TWELVE
from facs_rig.common.box import Box

torch = pytest.importorskip("torch")
from classifiers.training.losses import region_loss  # noqa: E402

FACE, HAIR, BEARD, HAT = range(len(REGIONS))
SQUARE = [[10.0, 10.0], [30.0, 10.0], [30.0, 30.0], [10.0, 30.0]]


@pytest.fixture(scope="module")
def drawn():
    """Eight drawings by convention: pictures, records, targets, names."""
    samples = [make_sample(11, k, engine="conventions") for k in range(8)]
    pictures, records = [picture for picture, _ in samples], [record for _, record in samples]
    targets = encode_all(DataSet(pictures, records), TWELVE, LANDMARKS)
    return pictures, records, targets, Names.of(TWELVE, LANDMARKS)


def test_cells_tell_how_much_of_them_is_within_an_outline():
    outlines = Outlines.of({"regions": {"face": [SQUARE], "hair": [], "tree": [SQUARE]}})
    mask = outlines.mask(outlines.points, Box.at(0, 0, 40, 40), 4)
    assert mask.shape == (4, 4, 4) and mask.dtype == np.float32
    np.testing.assert_allclose(mask[FACE][1:3, 1:3], 1, atol=0.4)
    assert mask[FACE].sum() == pytest.approx(4, abs=0.8) and not mask[1:].any()
    aside = outlines.mask(outlines.points, Box.at(10, 10, 20, 20), 4)
    np.testing.assert_allclose(aside[FACE], 1)
    assert Outlines.of({}) is None


def test_hair_and_beard_lie_over_the_face():
    lower = [[10.0, 20.0], [30.0, 20.0], [30.0, 30.0], [10.0, 30.0]]
    outlines = Outlines.of({"regions": {"face": [SQUARE], "beard": [lower]}})
    mask = outlines.mask(outlines.points, Box.at(10, 10, 20, 20), 2)
    np.testing.assert_allclose(mask[FACE], [[1, 1], [0, 0]], atol=0.2)
    np.testing.assert_allclose(mask[BEARD], [[0, 0], [1, 1]], atol=0.2)


def test_what_is_worn_on_the_head_hides_a_beard():
    lower = [[10.0, 20.0], [30.0, 20.0], [30.0, 30.0], [10.0, 30.0]]
    side = [[10.0, 10.0], [20.0, 10.0], [20.0, 30.0], [10.0, 30.0]]
    outlines = Outlines.of({"regions": {"face": [SQUARE], "beard": [lower], "hair": [side],
                                        "hat": [side]}})  # fmt: skip
    mask = outlines.mask(outlines.points, Box.at(10, 10, 20, 20), 2)
    np.testing.assert_allclose(mask[BEARD], [[0, 0], [0, 1]], atol=0.2)


def test_a_hat_is_told_of_or_not_known():
    told = {"face": [SQUARE], "hair": [SQUARE]}
    whole = Box.at(0, 0, 40, 40)
    bare = Outlines.of({"regions": told, "artist": {"hat": "none"}})
    assert not bare.mask(bare.points, whole, 4)[HAT].any()
    hatted = Outlines.of({"regions": {**told, "hat": [SQUARE]}, "artist": {"hat": "cap"}})
    mask = hatted.mask(hatted.points, whole, 4)
    np.testing.assert_array_equal(mask[HAT], mask[HAIR])
    older = Outlines.of({"regions": told, "artist": {"hat": "cap"}})  # before hats were told of
    mask = older.mask(older.points, whole, 4)
    assert np.isnan(mask[HAT]).all() and np.isfinite(mask[:HAT]).all()


def test_ears_are_no_hair_unless_a_hat_hides_them():
    told = {"hair": [SQUARE], "ear": [SQUARE]}
    whole = Box.at(0, 0, 40, 40)
    bare = Outlines.of({"regions": told})
    assert not bare.mask(bare.points, whole, 4)[HAIR].any()
    assert bare.haired and not Outlines.of({"regions": {"face": [], "ear": [SQUARE]}}).haired
    hatted = Outlines.of({"regions": {**told, "hat": [SQUARE]}})
    mask = hatted.mask(hatted.points, whole, 4)
    np.testing.assert_array_equal(mask[HAT], mask[HAIR])


def test_older_networks_tell_of_no_hats():
    places = np.array([[0.5, 0.5]])
    assert Mask(Box.at(0, 0, 1, 1), np.ones((3, 4, 4))).at("hat", places)[0] == 0
    assert Mask(Box.at(0, 0, 1, 1), np.ones((4, 4, 4))).at("hat", places)[0] == 1


def test_conventions_tell_where_their_face_and_hair_are(drawn):
    _, records, targets, names = drawn
    haired = 0
    for row, record in enumerate(records):
        outlines = Outlines.of(record)
        mask = outlines.mask(outlines.points, Box.at(0, 0, 256, 256), 64)
        places = {n: targets.landmarks[row][k] for k, n in enumerate(LANDMARKS)}
        at = Mask(Box.at(0, 0, 256, 256), mask).at("face", np.array([places["nose_tip"]]))
        assert at[0] > 0.5
        haired += mask[HAIR].sum() > 30
        if mask[HAIR].sum() > 30:  # it begins above the face
            tops = [np.flatnonzero(mask[part].max(axis=1) > 0.5)[0] for part in (HAIR, FACE)]
            assert tops[0] < tops[1]
    assert haired >= 4


def test_hair_of_contours_is_learnt_where_it_is_seen():
    """Outside the face's outline or over it, and most of it above the nose."""
    names = Names.of(TWELVE, LANDMARKS)
    samples = [make_sample(12, k, hair=1.0) for k in range(5)]
    pictures, records = zip(*samples, strict=True)
    targets = encode_all(DataSet(list(pictures), list(records)), TWELVE, LANDMARKS)
    for row, record in enumerate(records):
        outlines = Outlines.of(record)
        assert outlines.haired  # so that no hair is scribbled onto it
        page = outlines.mask(outlines.points, Box.at(0, 0, 256, 256), 64)
        assert 0.01 < page[HAIR].mean() < 0.6 and page[FACE].mean() > 0.03
        nose = targets.landmarks[row][LANDMARKS.index("nose_tip")]
        assert Mask(Box.at(0, 0, 256, 256), page).at("hair", nose[None])[0] < 0.5
        one = example(
            pictures[row], targets, row, names, 160, np.random.default_rng(row), WIDE,
            outlines=outlines,
        )  # fmt: skip
        assert one.regions[HAIR].sum() > 1


def test_masks_move_with_the_page_and_its_mirror_image(drawn):
    pictures, records, targets, names = drawn
    for seed, kind in ((0, NEAR), (1, WIDE), (2, WIDE)):
        outlines = Outlines.of(records[seed])
        one, other = (
            example(
                pictures[seed], targets, seed, names, 160, np.random.default_rng(seed), kind,
                flip=flip, outlines=outlines,
            )
            for flip in (False, True)
        )  # fmt: skip
        assert one.regions.shape == (4, 20, 20) and np.isfinite(one.regions).all()
        np.testing.assert_array_equal(other.regions, one.regions[:, :, ::-1])
        face = Mask(Box.at(0, 0, 1, 1), one.regions)
        nose = one.landmarks[LANDMARKS.index("nose_tip")]
        assert face.at("face", nose[None])[0] > 0.4
    bald = example(pictures[0], targets, 0, names, 160, np.random.default_rng(0), NEAR)
    assert np.isnan(bald.regions).all() and PAD


def test_only_what_is_known_is_learnt():
    told = torch.zeros(2, 3, 4, 4, requires_grad=True)
    truth = torch.full((2, 3, 4, 4), float("nan"))
    truth[0, HAIR] = 1.0
    region_loss(told, truth).backward()
    assert (
        (told.grad[0, HAIR] < 0).all() and not told.grad[1].any() and not told.grad[0, FACE].any()
    )
    assert float(region_loss(told.detach(), torch.full_like(truth, float("nan")))) == 0


def test_a_mask_is_read_between_the_middles_of_its_cells():
    shares = np.zeros((3, 2, 2))
    shares[HAIR] = [[0, 1], [0, 1]]
    mask = Mask(Box.at(100, 200, 40, 40), shares)
    points = np.array([[110, 220], [120, 220], [130, 210], [500, 200], [0, 0]], float)
    np.testing.assert_allclose(mask.at("hair", points), [0, 0.5, 1, 1, 0])
    assert not mask.at("beard", points).any()
    assert mask.hides(points).tolist() == [False, True, True, True, False]


def test_two_masks_agree_on_what_both_say():
    rng = np.random.default_rng(0)
    fine = Mask(Box.at(0, 0, 8, 8), rng.uniform(0.1, 0.9, (4, 8, 8)))
    flat = Mask(Box.at(-4, -4, 16, 16), np.full((4, 2, 2), 0.5))
    both = fine.agreed(flat, "hat")
    odds = fine.shares[HAT] / (1 - fine.shares[HAT])
    np.testing.assert_allclose(both.shares[HAT] / (1 - both.shares[HAT]), np.sqrt(odds))
    np.testing.assert_array_equal(both.shares[:HAT], fine.shares[:HAT])
    np.testing.assert_allclose(fine.agreed(fine, "hat").shares, fine.shares)
    np.testing.assert_allclose(fine.agreed(flat, "hat", 1.0).shares[HAT], 0.5)
    older = Mask(fine.box, fine.shares[:HAT])
    assert fine.agreed(older, "hat") is fine
