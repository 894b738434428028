"""Named test sets, and anybody's answers to them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from addon import cli
from classifiers.training import benchmark, shards
from classifiers.training.evaluate import unit_figures
from classifiers.training.readings import Answers
from classifiers.training.targets import encode
from facs_rig import LANDMARKS, TWELVE
from facs_rig.common.errors import InputError


@pytest.fixture(scope="module")
def data(cartoons):
    return shards.load(cartoons)


@pytest.fixture(scope="module")
def guesses(data):
    rng = np.random.default_rng(4)
    return rng.random((len(data), len(TWELVE)))


def as_said(guesses):
    return {k: dict(zip(TWELVE, row.tolist(), strict=True)) for k, row in enumerate(guesses)}


def test_figures_are_those_of_evaluate(data, guesses):
    truth = encode(data.records, TWELVE, LANDMARKS)
    nothing = np.zeros_like(guesses)
    answers = Answers(guesses, guesses >= 0.5, nothing, *[nothing] * 5)
    theirs = unit_figures(TWELVE, answers, truth)
    ours = benchmark.figures(as_said(guesses), data)
    for name in TWELVE:
        for key in ("auc", "balanced_accuracy", "f1"):
            assert ours["units"][name][key] == pytest.approx(theirs["units"][name][key]), name


def test_the_truth_scores_one_and_its_opposite_zero(data):
    truth = encode(data.records, TWELVE, LANDMARKS).active
    for wrong in (False, True):
        found = benchmark.figures(as_said(np.abs(np.nan_to_num(truth) - wrong)), data)
        assert found["mean"]["auc"] == found["mean"]["balanced_accuracy"] == float(not wrong)


def test_a_line_may_decide_for_itself(data, guesses):
    own = {
        k: {n: {"probability": p, "active": p >= 0.9} for n, p in row.items()}
        for k, row in as_said(guesses).items()
    }
    plain, decided = (benchmark.figures(said, data) for said in (as_said(guesses), own))
    assert plain["mean"]["auc"] == pytest.approx(decided["mean"]["auc"])
    assert plain["mean"]["f1"] != pytest.approx(decided["mean"]["f1"])


def test_what_is_hard_cannot_be_left_out(data, guesses):
    said = as_said(guesses)
    del said[3]["smile"]
    with pytest.raises(InputError, match="drawing 3 has no answer for smile"):
        benchmark.figures(said, data)
    del said[5]
    with pytest.raises(InputError, match="drawing 5 has no answer"):
        benchmark.figures(said, data)


def test_a_control_that_is_unknown_to_a_method_does_not_count(data, guesses):
    said = {k: {"smile": row["smile"]} for k, row in as_said(guesses).items()}
    found = benchmark.figures(said, data)
    assert set(found["units"]) == {"smile"}
    rows = benchmark.table({"fresh": {"drawings": 60, "fingerprint": "0"} | found})
    assert "`smile`" in rows and "`sneer`" not in rows


GOOD = {"set": "fresh", "index": 0, "aus": {"smile": 0.5}}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("smile", "line 1: it is no JSON object"),
        ("[1]", 'a line needs "set"'),
        (json.dumps({"set": "fresh"}), 'a line needs "set"'),
        (json.dumps(GOOD | {"set": "frehs"}), "did you mean"),
        (json.dumps(GOOD | {"index": -1}), "is not the number"),
        (json.dumps(GOOD | {"index": True}), "is not the number"),
        (json.dumps(GOOD | {"aus": {"smiel": 0.5}}), "there is no control 'smiel'"),
        (json.dumps(GOOD | {"aus": {"smile": 2}}), "between 0 and 1, not 2"),
        (json.dumps(GOOD | {"aus": {"smile": {"active": True}}}), "between 0 and 1, not None"),
        ('{"set": "fresh", "index": 0, "aus": {"smile": NaN}}', "between 0 and 1, not nan"),
        (json.dumps(GOOD) + "\n" + json.dumps(GOOD), "line 2: drawing 0 of fresh is"),
        ("", "holds no answers"),
    ],
)  # fmt: skip
def test_bad_answers_get_one_sentence(tmp_path, capsys, line, words):
    path = tmp_path / "answers.jsonl"
    path.write_text(line)
    command = ["benchmark", "--out", str(tmp_path / "sets"), "--answers", str(path)]
    assert cli.main([*command, "--sets", "fresh"]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1
    assert not (tmp_path / "sets").exists()


def test_our_answers_written_and_read_again_give_the_same_table(tmp_path, capsys):
    command = ["benchmark", "--out", str(tmp_path), "--sets", "conventions", "--count", "12"]
    answers = tmp_path / "answers.jsonl"
    assert cli.main([*command, "--write", str(answers)]) == 0
    ours = capsys.readouterr().out
    assert "| conventions | 12 |" in ours
    made = {p: p.stat().st_mtime_ns for p in tmp_path.glob("conventions-12/*.tar")}
    assert cli.main([*command, "--answers", str(answers)]) == 0
    assert capsys.readouterr().out == ours
    assert {p: p.stat().st_mtime_ns for p in made} == made  # nothing was drawn again
    assert cli.main([*command, "--answers", str(answers), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["set"] == "conventions" and result["drawings"] == 12
    assert cli.main([*command, "--answers", str(answers), "--sets", "fresh"]) == 2
    assert "does not answer the set fresh" in capsys.readouterr().err


def test_the_fingerprint_is_of_drawings_and_labels(data):
    mark = benchmark.fingerprint(data)
    assert len(mark) == 12
    fewer = shards.DataSet(data.drawings[1:], data.records[1:])
    assert benchmark.fingerprint(fewer) != mark
