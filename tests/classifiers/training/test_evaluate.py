"""What evaluation reports, against figures worked out by hand."""

from __future__ import annotations

import json
import shutil
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon import evaluate_command
from addon.cli import main
from classifiers import load_detector
from classifiers.labels import PERSON
from classifiers.training import evaluate, shards
from classifiers.training.evaluate import band, scores, split_scores, summary, table
from classifiers.training.readings import Answers, DetectorReader
from classifiers.training.targets import Targets

AUS = ("smile", "sneer", "blink")  # the first two are of the twelve
POINTS = ("chin", "forehead")


def perfect(n: int = 40) -> tuple[Answers, Targets]:
    """Targets of n drawings and answers without a fault."""
    rng = np.random.default_rng(3)
    intensity = np.where(rng.random((n, 3)) < 0.4, rng.uniform(1, 5, (n, 3)), 0).astype(np.float32)
    intensity[:8] = 0
    active = (intensity > 0).astype(np.float32)
    angles = rng.uniform(-0.5, 0.5, (n, 3)).astype(np.float32)
    landmarks = rng.uniform(0, 50, (n, 2, 2)).astype(np.float32)
    landmarks[:, 1, 1] = landmarks[:, 0, 1] + 100
    person = rng.uniform(-1, 1, (n, len(PERSON))).astype(np.float32)
    targets = Targets(active, intensity, angles, landmarks, person)
    answers = Answers(
        active.astype(float), active > 0, intensity.astype(float), angles.astype(float),
        landmarks.astype(float), np.ones((n, 2)), np.ones(n), person.astype(float),
    )  # fmt: skip
    return answers, targets


def test_answers_without_a_fault():
    found = scores(AUS, *perfect())
    for means in ("mean", "mean_of_the_twelve"):
        for key in ("accuracy", "balanced_accuracy", "f1", "auc"):
            assert found[means][key] == 1
        assert found[means]["ece"] == found[means]["intensity_error"] == 0
    assert set(found["angle_error_deg"].values()) == {0.0}
    assert found["landmark_error"] == found["landmark_confidence_ece"] == 0
    assert found["false_alarms_at_rest"] == 0 and found["seen_as_face"] == 1


def test_each_fault_shows_where_it_belongs():
    answers, targets = perfect()
    found = scores(AUS, replace(answers, active=answers.active | True), targets)
    assert found["false_alarms_at_rest"] == 3
    assert found["mean"]["balanced_accuracy"] == 0.5 and found["mean"]["auc"] == 1

    wrong = answers.probability.copy()
    wrong[:, 2] = 1 - wrong[:, 2]
    found = scores(AUS, replace(answers, probability=wrong), targets)
    assert found["mean_of_the_twelve"]["auc"] == 1
    assert found["mean"]["auc"] == pytest.approx(2 / 3)

    found = scores(AUS, replace(answers, angles=answers.angles + np.radians((3, 0, -6))), targets)
    expected = {"yaw": 3, "pitch": 0, "roll": 6, "mean": 3}
    assert found["angle_error_deg"] == pytest.approx(expected, abs=1e-4)

    # every second landmark is 5 of the face's 100 pixels off, and its confidence says so or not
    moved = answers.landmarks + np.array([[3, 4], [0, 0]])
    doubt = np.tile([0.0, 1.0], (40, 1))
    found = scores(AUS, replace(answers, landmarks=moved, confidence=doubt), targets)
    assert found["landmark_error"] == pytest.approx(0.025, abs=1e-6)
    assert found["landmark_confidence_ece"] == 0
    found = scores(AUS, replace(answers, landmarks=moved), targets)
    assert found["landmark_confidence_ece"] == pytest.approx(0.5)

    found = scores(AUS, replace(answers, intensity=answers.intensity + 0.5), targets)
    assert found["mean"]["intensity_error"] == pytest.approx(0.5)


def test_undecided_drawings_count_neither_way():
    answers, targets = perfect()
    active = targets.active.copy()
    active[10:20, 0] = np.nan
    said = answers.active.copy()
    said[10:20, 0] = ~said[10:20, 0]
    found = scores(AUS, replace(answers, active=said), replace(targets, active=active))
    assert found["units"]["smile"]["accuracy"] == 1


def test_what_a_detector_does_not_say_is_not_measured():
    answers, targets = perfect()
    silent = {
        name: np.full_like(getattr(answers, name), np.nan)
        for name in ("intensity", "angles", "landmarks", "confidence", "face")
    }
    found = scores(AUS, replace(answers, **silent), targets)
    for key in ("landmark_error", "landmark_confidence_ece", "seen_as_face"):
        assert np.isnan(found[key])
    assert np.isnan(found["mean"]["intensity_error"]) and found["mean"]["auc"] == 1
    assert evaluate.rounded(found)["angle_error_deg"]["yaw"] is None
    assert "nan" in table(evaluate.rounded(found))


def test_split_by_strength_pits_each_band_against_what_is_not_active():
    answers, targets = perfect(400)
    weak = (targets.intensity > 0) & (targets.intensity < 2)
    missed = replace(answers, active=answers.active & ~weak)
    parts = split_scores("strength", AUS, missed, targets, [])
    balanced = {name: part["mean"]["balanced_accuracy"] for name, part in parts.items()}
    assert balanced == {"1 to under 2": 0.5, "2 to under 3.5": 1.0, "3.5 or more": 1.0}


def test_split_by_a_key_of_the_records():
    answers, targets = perfect()
    looks = ["ink", "brush", "ink", "pencil"] * 10
    wrong = replace(answers, angles=answers.angles + 0.1 * np.array([[k] for k in range(40)]) % 0.4)
    records = [{"style": {"look": look}} for look in looks]
    parts = split_scores("look", AUS, wrong, targets, records)
    assert {name: part["drawings"] for name, part in parts.items()} == {
        "brush": 10, "ink": 20, "pencil": 10,
    }  # fmt: skip
    rows = np.array([k for k, look in enumerate(looks) if look == "brush"])
    alone = scores(AUS, wrong.take(rows), targets.take(rows))
    del alone["units"]
    assert evaluate.rounded(parts["brush"]) == evaluate.rounded(alone)


def test_bands_are_told_in_words():
    edges = (0, 10, 25, np.inf)
    assert [band(v, edges, "°") for v in (0, 9.9, 10, 25, 80)] == [
        "0° to under 10°", "0° to under 10°", "10° to under 25°", "25° or more", "25° or more",
    ]  # fmt: skip


def test_several_folders_are_several_test_sets(fresh_weights, cartoons, many_cartoons, capsys):
    steps = []
    options = ["--weights", str(fresh_weights), "--limit", "9", "--split", "yaw", "strength"]
    for folder in (cartoons, many_cartoons):
        options += ["--data", str(folder)]
    parser = ArgumentParser()
    evaluate_command.arguments(parser)
    args = parser.parse_args([*options, "--json"])
    evaluate_command.evaluate(args, lambda done, total: steps.append((done, total)))
    sets = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["data"] for one in sets] == [str(cartoons), str(many_cartoons)]
    known = json.loads((fresh_weights / "model.json").read_text())["sha256"]
    assert all(one["model"] == {"networks": "detector", "sha256": known} for one in sets)
    assert all(one["drawings"] == 9 and one["median_ms"] > 0 for one in sets)
    assert set(sets[0]["splits"]) == {"yaw", "strength"}
    assert sum(part["drawings"] for part in sets[0]["splits"]["yaw"].values()) == 9
    assert steps == [(k, 9) for k in range(1, 10)] * 2
    assert main(["evaluate", *options]) == 0
    shown = capsys.readouterr().out
    assert "by strength" in shown and "mean of the twelve" in shown
    assert summary(sets[0]).rpartition("; ")[0] in shown  # all but the time it took


def test_no_more_than_one_drawing_is_decoded_at_a_time(fresh_weights, cartoons):
    """Nor kept: 100,000 of them would take 6.5 GB."""
    import gc
    import weakref

    made_so_far, most = [], 0

    class Drawing(np.ndarray):
        pass

    def made(png):
        nonlocal most
        gc.collect()
        most = max(most, sum(alive() is not None for alive in made_so_far))
        drawing = shards.drawing_of(png).view(Drawing)
        made_so_far.append(weakref.ref(drawing))
        return drawing

    data = shards.load(cartoons, limit=12)
    stored = shards.DataSet(shards.Stored(data.drawings.blobs, made), data.records)
    reader = DetectorReader(load_detector(fresh_weights))
    assert evaluate.evaluate(reader, stored)["drawings"] == 12
    assert most <= 2


def test_baselines_need_a_test_set(capsys, tmp_path):
    assert main(["evaluate", "--baseline", str(tmp_path)]) == 2
    assert "--data" in capsys.readouterr().err
    assert main(["evaluate", "--data", str(tmp_path), "--split", "nonsense"]) == 2


def damaged(folder: Path, cartoons: Path, how: str) -> None:
    """A copy of a data set whose second shard is not as it should be."""
    shutil.copytree(cartoons, folder)
    shard = sorted(folder.glob("*.tar"))[-1]
    data = shard.read_bytes()
    changes = {
        "torn": lambda: data[: len(data) // 2],
        "without its end": lambda: data.rstrip(b"\0") + bytes(-len(data.rstrip(b"\0")) % 512),
        "empty": lambda: b"",
        "no tar": lambda: b"<html>not found</html>" * 100,
        "a record without actions": lambda: data.replace(b'"aus"', b'"xus"'),
        "a record with words": lambda: data.replace(b'"yaw": ', b'"yaw":"'),
        "a picture with a flipped bit": lambda: data.replace(b"IDAT", b"IDAU", 1),
    }
    shard.write_bytes(changes[how]())


@pytest.mark.parametrize(
    "how",
    ["torn", "without its end", "empty", "no tar", "a record without actions",
     "a record with words", "a picture with a flipped bit"],
)  # fmt: skip
def test_an_odd_shard_is_one_sentence(tmp_path, cartoons, capsys, how):
    damaged(tmp_path / "data", cartoons, how)
    assert main(["evaluate", "--data", str(tmp_path / "data")]) == 2
    captured = capsys.readouterr()
    assert str(sorted((tmp_path / "data").glob("*.tar"))[-1]) in captured.err
    assert captured.err.count("\n") == 1
    with pytest.raises(ValueError, match="shard-000001.tar"):
        shards.load(tmp_path / "data")


def test_a_limit_that_is_none(cartoons, capsys):
    assert main(["evaluate", "--data", str(cartoons), "--limit", "0"]) == 2
    assert "--limit must be at least 1, got 0" in capsys.readouterr().err
