"""Changes to whole batches: the labels must follow, and agree with those of single examples."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from classifiers.preprocess import even_ink  # noqa: E402
from classifiers.training import augment, shards  # noqa: E402
from classifiers.training import jitter as jitters  # noqa: E402
from classifiers.training.augment import NEAR, Names, example  # noqa: E402
from classifiers.training.common import collate  # noqa: E402
from classifiers.training.targets import encode, rotated_in_picture  # noqa: E402
from facs_rig import LANDMARKS, TWELVE  # noqa: E402

NAMES = Names.of(TWELVE, LANDMARKS)


@pytest.fixture(scope="module")
def examples(cartoons):
    data = shards.load(cartoons)
    targets = encode(data.records, TWELVE, LANDMARKS)
    rng = np.random.default_rng(4)
    return [example(data.drawings[i], targets, i, NAMES, 64, rng, NEAR) for i in range(6)]


def batch_of(examples):
    batch = {name: torch.as_tensor(values) for name, values in collate(examples).items()}
    return batch | {"ink": batch["ink"][:, None]}


def test_a_batch_is_mirrored_as_each_example_is(examples):
    which = torch.tensor([True, False] * 3)
    found = jitters.mirrored(batch_of(examples), NAMES, which)
    expected = [
        augment.mirrored(e, NAMES) if w else e for e, w in zip(examples, which, strict=True)
    ]
    for name, values in batch_of(expected).items():
        torch.testing.assert_close(found[name], values, equal_nan=True, check_dtype=False)


def test_angles_turn_with_the_picture():
    rng = np.random.default_rng(0)
    angles, turn = rng.normal(0, 0.4, (9, 3)), rng.normal(0, 0.3, 9)
    found = jitters.turned(torch.as_tensor(angles), torch.as_tensor(turn))
    expected = [rotated_in_picture(a, t) for a, t in zip(angles, turn, strict=True)]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_ink_and_landmarks_move_together(examples):
    """A dot at a landmark is at the landmark afterwards, and its box about it."""
    size, n = 160, 40
    generator = torch.manual_seed(3)
    points = torch.rand(n, 1, 2, generator=generator) * 0.4 + 0.3
    at = (torch.arange(size) + 0.5) / size
    away = (at[None, None, :] - points[:, :, :1]) ** 2 + (at[None, :, None] - points[:, :, 1:]) ** 2
    batch = {
        "ink": torch.exp(-away[:, None] / (2 * 0.02**2)),
        "angles": torch.zeros(n, 3),
        "landmarks": points,
        "boxes": torch.cat([points, torch.full((n, 1, 1), 0.4)], dim=2),
    }
    turn, scale, shift = jitters.motion(batch)
    found = jitters.moved(batch, turn, scale, shift)
    ink = found["ink"][:, 0]
    mass = ink.sum(dim=(1, 2))
    u, v = (ink.sum(dim=1) * at).sum(1) / mass, (ink.sum(dim=2) * at).sum(1) / mass
    torch.testing.assert_close(torch.stack([u, v], 1), found["landmarks"][:, 0], atol=2e-3, rtol=0)
    torch.testing.assert_close(found["boxes"][:, 0, :2], found["landmarks"][:, 0])
    moved = (found["landmarks"] - points).norm(dim=2)[:, 0] > 1e-6
    assert 0.4 < moved.float().mean() < 1  # some stay where they are
    grown = mass / batch["ink"].sum(dim=(1, 2, 3))
    torch.testing.assert_close((found["boxes"][:, 0, 2] / 0.4) ** 2, grown, atol=0.02, rtol=0)


def test_shades_darken_and_rubbing_out_takes_away(examples):
    ink = batch_of(examples)["ink"]
    assert (jitters.shaded(ink) >= ink - 1e-6).all() and jitters.shaded(ink).max() <= 1
    assert jitters.shaded(ink).mean() > ink.mean()
    less = jitters.rubbed(ink)
    assert ((less == ink) | (less == 0)).all() and less.sum() < ink.sum()


def test_ink_is_evened_as_a_page_is(examples):
    ink = batch_of(examples)["ink"] * 0.3
    ink[0] = 0
    expected = np.stack([even_ink(page) for page in ink[:, 0].numpy()])
    np.testing.assert_allclose(jitters.evened(ink)[:, 0], expected, atol=1e-5)


def test_what_comes_out_is_what_the_networks_take(examples):
    batch = batch_of(examples)
    torch.manual_seed(1)
    found = jitters.jittered(batch, NAMES)
    assert found.keys() == batch.keys()
    for name, values in batch.items():
        assert (found[name].shape, found[name].dtype) == (values.shape, values.dtype), name
    assert 0 <= found["ink"].min() and found["ink"].max() <= 1
    assert not torch.equal(found["ink"], batch["ink"])
