"""The thesis' own networks: their layers, their training, their figures."""

from __future__ import annotations

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from addon.cli import main  # noqa: E402
from classifiers.training import googlenet, shards  # noqa: E402
from classifiers.training.common import Config  # noqa: E402
from classifiers.training.googlenet import (  # noqa: E402
    GoogLeNet,
    Inception,
    load_baseline,
    logits,
    train_baseline,
    whole_page,
)
from classifiers.training.readings import pages_of  # noqa: E402


def test_it_has_the_layers_of_the_paper():
    """Table 1 of Szegedy et al. 2015: the channels after each layer."""
    network = GoogLeNet().eval()
    x = torch.zeros(1, 1, 128, 128)
    channels = []
    with torch.no_grad():
        for layer in network.layers:
            x = layer(x)
            channels.append(x.shape[1])
    assert channels == [
        64, 64, 64, 192, 192, 256, 480, 480, 512, 512, 512, 528, 832, 832, 832, 1024,
    ]  # fmt: skip
    assert x.shape[2:] == (4, 4)  # 7 x 7 of 224 pixels
    assert sum(isinstance(layer, Inception) for layer in network.layers) == 9
    with pytest.raises(ValueError, match="multiple of 64"):
        GoogLeNet(96)


def test_it_sees_all_the_ink_wherever_it_stands_on_the_page():
    rng = np.random.default_rng(0)
    face = (rng.random((60, 60)) < 0.1).astype(np.float32)
    page = np.zeros((200, 300), np.float32)
    page[20:80, 30:90] = face
    moved = np.zeros((400, 300), np.float32)
    moved[211:271, 107:167] = face
    np.testing.assert_allclose(whole_page(page, 64), whole_page(moved, 64), atol=1e-5)
    assert whole_page(page, 64).shape == (64, 64)


@pytest.fixture(scope="module")
def baseline(cartoons, tmp_path_factory):
    out = tmp_path_factory.mktemp("googlenet")
    options = ["--data", str(cartoons), "--out", str(out), "--baseline", "sneer,frontalis"]
    options += ["--size", "64", "--batch", "8", "--steps", "2", "--threads", "1"]
    assert main(["train", *options]) == 0
    return out


def test_a_network_for_each_unit_with_the_figures_of_the_detector(baseline, cartoons, capsys):
    assert sorted(path.name for path in baseline.glob("*.pt")) == ["frontalis.pt", "sneer.pt"]
    reader = load_baseline(baseline)
    assert reader.aus == ("frontalis", "sneer")
    options = ["--baseline", str(baseline), "--data", str(cartoons), "--limit", "11"]
    assert main(["evaluate", *options, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["units"]) == {"frontalis", "sneer"} and found["drawings"] == 11
    assert found["units"]["sneer"]["auc"] is not None and found["median_ms"] > 0
    assert found["model"]["networks"] == "googlenet"
    assert found["model"]["training"]["sneer"]["images"] == 16
    assert found["landmark_error"] is None and found["seen_as_face"] is None
    assert main(["evaluate", *options]) == 0


def test_it_answers_by_calibrated_probability_and_threshold(baseline, cartoons):
    reader = load_baseline(baseline)
    page = next(pages_of(shards.load(cartoons, limit=1).drawings))
    saved = torch.load(baseline / "sneer.pt", weights_only=True)
    logit = logits(reader.networks[1], [whole_page(page, 64)])[0]
    probability = 1 / (1 + np.exp(-(logit / saved["temperature"] + saved["offset"])))
    row = reader.row(page)
    assert row[0][1] == pytest.approx(probability)
    assert row[1][1] == (probability >= saved["threshold"])


def test_training_lowers_the_loss(cartoons, tmp_path, monkeypatch):
    """On one batch, so that every step should help."""
    losses = []
    real = googlenet.F.cross_entropy

    def watched(*arguments):
        loss = real(*arguments)
        losses.append(float(loss.detach()))
        return loss

    monkeypatch.setattr(googlenet.F, "cross_entropy", watched)
    data = shards.load(cartoons, limit=14)
    config = Config(size=64, batch=13, minutes=5, steps=8, threads=1)
    path = train_baseline(data, "frontalis", tmp_path, config)
    saved = torch.load(path, weights_only=True)
    assert saved["steps"] == 8 and saved["images"] == 104 and saved["drawings"] == 13
    assert losses[-1] < 0.5 * losses[0]


def test_wrong_folders_and_names_are_told_in_a_sentence(baseline, cartoons, tmp_path, capsys):
    with pytest.raises(ValueError, match="holds no GoogLeNet"):
        load_baseline(tmp_path)
    whole = (baseline / "sneer.pt").read_bytes()
    (tmp_path / "sneer.pt").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=r"sneer\.pt is damaged"):
        load_baseline(tmp_path)
    torch.save({"unit": "sneer"}, tmp_path / "sneer.pt")
    with pytest.raises(ValueError, match="no GoogLeNet of this version"):
        load_baseline(tmp_path)
    options = ["--data", str(cartoons), "--out", str(tmp_path / "run"), "--baseline", "smirk"]
    assert main(["train", *options]) == 2
    assert "no unit smirk" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
