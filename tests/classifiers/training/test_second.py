"""A second opinion: the mean of two networks, where it is asked for, and theirs alone elsewhere."""

from __future__ import annotations

import hashlib
import json
import shutil

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("onnx")

from classifiers.detector import Detector
from classifiers.training import export as exporting
from classifiers.training.network import Networks
from classifiers.training.second import networks_in, second_in, write_second
from facs_rig import LANDMARKS, TWELVE
from facs_rig.common.errors import InputError


@pytest.fixture(scope="module")
def other(fresh_weights, tmp_path_factory):
    """A folder with other networks than those of `fresh_weights`, of the same units."""
    folder = tmp_path_factory.mktemp("other")
    exporting.to_onnx(Networks(TWELVE, LANDMARKS, 64), folder / "detector.onnx")
    return described(folder, fresh_weights)


def described(folder, like, **more):
    """The folder with the description of another, made true for its own networks."""
    model = json.loads((like / "model.json").read_text())
    del model["checksum"]
    model["sha256"] = hashlib.sha256((folder / "detector.onnx").read_bytes()).hexdigest()
    exporting.write_description(folder, model | more)
    return folder


@pytest.fixture(scope="module")
def both(fresh_weights, other, tmp_path_factory):
    """The networks of `fresh_weights`, and those of `other` as their second opinion."""
    folder = tmp_path_factory.mktemp("both")
    shutil.copy(fresh_weights / "detector.onnx", folder)
    second = folder / "second.onnx"
    write_second(networks_in(other), second, folder / "detector.onnx")
    told = {"weights": second.name, "sha256": hashlib.sha256(second.read_bytes()).hexdigest()}
    return described(folder, fresh_weights, second=told)


def ink(count=3):
    rng = np.random.default_rng(4)
    return (rng.random((count, 64, 64)) * (rng.random((count, 64, 64)) < 0.2)).astype(np.float32)


def test_the_answer_is_the_mean_of_both(fresh_weights, other, both):
    one, two, mean = (Detector(folder).run(ink()) for folder in (fresh_weights, other, both))
    for name in ("logits", "intensities", "landmarks", "spreads"):
        a, b, m = (getattr(answers, name) for answers in (one, two, mean))
        assert np.abs(a - b).max() > 1e-3
        np.testing.assert_allclose(m, (a + b) / 2, atol=1e-5)
    for name in ("angles", "face", "found", "person", "regions"):
        np.testing.assert_array_equal(getattr(mean, name), getattr(one, name))


def test_where_it_is_not_asked_for_it_does_not_count(fresh_weights, both):
    alone = Detector(fresh_weights).run(ink())
    np.testing.assert_array_equal(Detector(both).run(ink(), second=False).logits, alone.logits)
    # The looks that find a face and its person do without it, the one that reads it does not.
    page, counts = np.random.default_rng(1).random((90, 90)).astype(np.float32), []
    detector = Detector(both)
    run = detector._networks.run

    def counted(crops, second=True):
        counts.append(second)
        return run(crops, second)

    detector._networks.run = counted
    detector.read(page, turns=())
    assert counts.count(True) == 1 and counts.count(False) >= 2


def test_it_holds_no_more_than_it_is_asked_for(both):
    assert (both / "second.onnx").stat().st_size < 0.9 * (both / "detector.onnx").stat().st_size
    assert second_in(both) == both / "second.onnx"
    assert networks_in(both) == both / "detector.onnx"


def test_networks_of_other_units_or_sizes_are_no_second_opinion(fresh_weights, both, tmp_path):
    assert second_in(fresh_weights) is None and second_in(tmp_path / "nothing") is None
    for name, networks in (("units", Networks(TWELVE[:-1], LANDMARKS, 64)),
                           ("size", Networks(TWELVE, LANDMARKS, 96))):  # fmt: skip
        path = tmp_path / f"{name}.onnx"
        exporting.to_onnx(networks, path)
        with pytest.raises(InputError, match="other units, landmarks or size"):
            write_second(path, tmp_path / "second.onnx", both / "detector.onnx")
    assert not (tmp_path / "second.onnx").exists()


def test_a_damaged_or_foreign_one_is_named(both, other, fresh_weights, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(both, folder)
    second = folder / "second.onnx"
    second.write_bytes(second.read_bytes()[:-1])
    with pytest.raises(InputError, match=r"second\.onnx is damaged"):
        Detector(folder)
    exporting.to_onnx(Networks(TWELVE[:-1], LANDMARKS, 64), second)
    told = {"weights": second.name, "sha256": hashlib.sha256(second.read_bytes()).hexdigest()}
    described(folder, fresh_weights, second=told)
    with pytest.raises(InputError, match=r"second\.onnx does not belong to the model\.json"):
        Detector(folder)


def test_it_ships_with_the_networks_and_is_calibrated_with_them(cartoons, other, tmp_path):
    from classifiers.training import shards
    from classifiers.training.common import Config
    from classifiers.training.train import train

    data = shards.load(cartoons)
    config = Config(size=64, batch=8, minutes=5, steps=2, workers=0, threads=1, imagenet=False)
    checkpoint = train(data, TWELVE, tmp_path / "run", config)
    made = [
        exporting.export(checkpoint, data, tmp_path / name, lambda text: None, second=second)
        for name, second in (("alone", None), ("two", networks_in(other)))
    ]
    assert {path.name for path in (tmp_path / "two").iterdir()} == {
        "detector.onnx", "second.onnx", "model.json",
    }  # fmt: skip
    assert "second" not in made[0] and made[1]["second"]["weights"] == "second.onnx"
    assert made[0]["offsets"] != made[1]["offsets"]
    assert Detector(tmp_path / "two").model["second"] == made[1]["second"]
