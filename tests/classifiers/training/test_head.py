"""What the network that looks at heads learns from."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from classifiers.head import CELLS, SIZE, WHO, head_reader  # noqa: E402
from classifiers.labels import REGIONS  # noqa: E402
from classifiers.runtime import WEIGHTS  # noqa: E402
from classifiers.training import closer, exported, head  # noqa: E402
from classifiers.training.augment import Names  # noqa: E402
from facs_rig import LANDMARKS  # noqa: E402
from facs_rig.common.box import Box  # noqa: E402


def test_a_look_without_noise_is_the_right_one():
    own = Box.square((30, 40), 20, 0.3)
    assert closer.amiss(own, np.zeros(5), head.SPREADS) == own
    off = closer.amiss(own, np.array([0, 0, 1, -2, 3]), (0, 0, 0.1, 0.2))
    assert off.middle == pytest.approx((32, 36))
    assert off.width == pytest.approx(20) and off.turn == pytest.approx(0.9)


def test_looks_tell_what_lies_where():
    names = Names.of((), LANDMARKS)
    made = [head.page_of(77_000_000, k, names) for k in range(16)]
    ink, found, told, who = (np.concatenate(part) for part in zip(*made, strict=True))
    assert ink.shape == (32, SIZE, SIZE) and ink.dtype == np.uint8
    assert found.shape == (32, len(REGIONS), CELLS, CELLS) and found.dtype == bool
    assert told.all() and who.shape == (32, 2) and 0 <= who[:, 0].min() < who[:, 0].max() <= 1
    face, hair, _, hat = (found[:, k] for k in range(len(REGIONS)))
    assert face.any(axis=(1, 2)).all() and not (face & hair).any()
    assert 0.5 < hair.any(axis=(1, 2)).mean() < 1
    # A hat counts as the hair that it hides, a band or a wreath on hair does not.
    assert (hat & ~hair).sum() < 0.25 * hat.sum()


def test_the_loss_is_least_at_the_truth_and_ignores_what_is_not_told():
    found = torch.zeros(2, len(REGIONS), CELLS, CELLS)
    found[:, 1, :20] = 1
    told, who = torch.ones(2, len(REGIONS)), torch.full((2, 2), 0.5)
    person = torch.zeros(2, 2, 2)
    right, wrong = 40 * (found - 0.5), -40 * (found - 0.5)
    assert head.loss_of((right, person), found, told, who)[0] < 1e-6
    assert head.loss_of((wrong, person), found, told, who)[0] > 1
    told[:, :] = 0
    assert head.loss_of((wrong, person), found, told, who)[0] == 0


def test_drawing_goes_on_where_it_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(head, "CHUNK", 2)
    path = head.pages(77_000_000, tmp_path, 0)
    before = path.stat().st_mtime_ns
    assert head.pages(77_000_000, tmp_path, 0).stat().st_mtime_ns == before
    looks = head.Looks(tmp_path)
    assert looks.refresh() == 2 * head.LOOKS
    ink, found, told, _ = looks.at(np.array([0, 3]))
    assert ink.shape == (2, 1, SIZE, SIZE) and ink.max() <= 1
    assert found.shape == (2, len(REGIONS), CELLS, CELLS) and set(found.unique().tolist()) <= {0, 1}
    direct = head.page_of(77_000_000, 1, Names.of((), LANDMARKS))
    assert np.array_equal(found[1].numpy().astype(bool), direct[1][1])


def test_learning_goes_on_from_a_checkpoint_and_is_written(tmp_path, monkeypatch):
    for name, value in (("CHUNK", 3), ("HELD_OUT", 4), ("BATCH", 2)):
        monkeypatch.setattr(head, name, value)
    head.pages(77_000_000, tmp_path, 0)
    checkpoint = tmp_path / "checkpoint.pt"
    steps = []
    for minutes in (0.02, 0.06):
        looks = head.Looks(tmp_path)
        network, about = head.learn(looks, minutes, 1, 0, checkpoint)
        steps.append(about["steps"])
    saved = torch.load(checkpoint, weights_only=True)
    assert 0 < saved["step"] and steps[0] < steps[1]
    before = exported.opened(WEIGHTS)[0].trunk.state_dict()
    after = network.trunk.state_dict()
    kept = [name for name in before if name.startswith(("stem.", "blocks.0.", "blocks.1."))]
    assert all(torch.equal(before[name], after[name]) for name in kept)
    head.write(network, {"pages": 3, "seed": 0, "held_out": about}, tmp_path)
    reader = head_reader(tmp_path, 1)
    ink, *_ = looks.at(np.arange(2))
    # At the page's upper edge, above which nothing can be looked for.
    marks = {name: (80.0 + 9 * np.cos(k), 10.0 + 9 * np.sin(k)) for k, name in enumerate(LANDMARKS)}
    found = reader.read(ink[0, 0].numpy(), marks, 0.0)
    assert found.mask.shares.shape == (len(REGIONS), CELLS, CELLS)
    assert found.person.shape == (len(WHO), 2) and np.isfinite(found.person).all()
