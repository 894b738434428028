"""One face, drawn twice: found, put into one batch, and read alike."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from addon import cli
from classifiers.training import shards
from classifiers.training.augment import Names
from classifiers.training.common import Batches, Config
from classifiers.training.shards import DataSet, Stored
from classifiers.training.targets import encode_all
from facs_rig import LANDMARKS, TWELVE

torch = pytest.importorskip("torch")
from classifiers.training.losses import agreement_loss  # noqa: E402


@pytest.fixture(scope="module")
def data(cartoons):
    """The cartoons as two engines drew them, the second without the last ten, and one by itself."""
    one = shards.load(cartoons)
    records = [dict(record, scheme="people") for record in one.records]
    other = [dict(record, engine="conventions") for record in records[:50]]
    alone = dict(records[0], seed=77)
    blobs = [json.dumps(record).encode() for record in [*records, *other, alone]]
    drawings = [*one.drawings.blobs, *one.drawings.blobs[:50], one.drawings.blobs[0]]
    return DataSet(Stored(drawings, one.drawings.make), Stored(blobs, json.loads))


@pytest.fixture(scope="module")
def batches(data):
    rows = np.flatnonzero(~data.held_out())
    config = Config(size=64, batch=16, agree=1.0, seed=3)
    names = Names.of(TWELVE, LANDMARKS)
    return Batches(data, encode_all(data, TWELVE, LANDMARKS), rows, names, config)


def test_twins_are_of_one_seed_scheme_and_number(data):
    twins = data.twins()
    np.testing.assert_array_equal(twins[:50], np.arange(60, 110))
    np.testing.assert_array_equal(twins[60:110], np.arange(50))
    assert (twins[50:60] == -1).all() and twins[110] == -1


def test_a_batch_holds_faces_and_their_twins_mirrored_alike(batches):
    met = 0
    for step in range(12):
        batch = batches[step]
        twin = batch["twin"]
        assert len(twin) == 16 and len(batch["ink"]) == 16
        for k in np.flatnonzero(twin >= 0):
            assert twin[twin[k]] == k
            np.testing.assert_array_equal(batch["intensity"][k], batch["intensity"][twin[k]])
            met += 1
        if step:
            assert not np.array_equal(twin, np.full(16, -1))
    assert met > 100


def test_every_face_comes_once_in_an_epoch(batches):
    order = batches.order(0)
    assert sorted(order) == sorted(batches.rows)
    # eight faces in a step: with the ink at hand the first eight of the order come first
    first = batches[0]["intensity"][:8]
    truth = batches.targets.intensity[order[:8]]
    mirror = batches.targets.intensity[order[:8]][:, batches.names.au_mirror]
    assert all(
        (a == b).all() or (a == c).all() for a, b, c in zip(first, truth, mirror, strict=True)
    )


def test_what_is_held_out_is_nobodys_twin(data, batches):
    kept = batches.twins[batches.twins >= 0]
    assert not data.held_out()[kept].any()


def test_without_agreement_batches_have_no_twins(data, batches):
    config = replace(batches.config, agree=0.0)
    plain = Batches(data, batches.targets, batches.rows, batches.names, config)[0]
    assert (plain["twin"] == -1).all() and len(plain["ink"]) == 16


def test_agreement_is_nought_for_equal_answers_and_grows_with_their_difference():
    twin, truth = torch.tensor([1, 0, -1, -1]), torch.zeros(4, 1)
    close = torch.tensor([True] * 4)

    def loss(a: float, b: float) -> float:
        units = torch.zeros(4, 1, 3)
        units[:, 0, 1] = torch.tensor([a, b, 5.0, -5.0])
        return float(agreement_loss(units, truth, twin, close))

    assert loss(0.7, 0.7) == 0
    p, q = (1 / (1 + np.exp(-x)) for x in (1.0, -0.5))
    jeffreys = (p - q) * np.log(p / q) + (q - p) * np.log((1 - p) / (1 - q))
    assert loss(1.0, -0.5) == pytest.approx(jeffreys, rel=1e-5)
    assert loss(-0.5, 1.0) == pytest.approx(jeffreys, rel=1e-5)
    assert loss(2.0, -2.0) > loss(1.0, -1.0) > 0


def test_what_one_drawing_cannot_show_need_not_agree():
    units = torch.randn(4, 2, 3, requires_grad=True)
    truth = torch.tensor([[1.0, float("nan")], [1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    close = torch.tensor([True, True, True, False])
    agreement_loss(units, truth, torch.tensor([1, 0, 3, 2]), close).backward()
    assert (units.grad[:2, 0, :2] != 0).all()
    assert (units.grad[:2, 1] == 0).all() and (units.grad[2:] == 0).all()
    assert (units.grad[..., 2] == 0).all()  # how strong: not asked


def test_a_pool_has_no_twins(cartoons, tmp_path, capsys):
    command = ["train", "--data", str(cartoons), "--out", str(tmp_path / "run")]
    assert cli.main([*command, "--agree", "1", "--pool", "64"]) == 2
    assert "--agree compares" in capsys.readouterr().err and not (tmp_path / "run").exists()
