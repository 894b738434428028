"""Who is drawn: what is learnt of it, and how far it is to be believed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from classifiers import load_detector
from classifiers.detector import together
from classifiers.labels import PERSON
from classifiers.training.calibration import person_spreads
from classifiers.training.evaluate import person_figures
from classifiers.training.targets import encode, manly
from facs_rig import LANDMARKS, TWELVE
from facs_rig.identity import BY_NAME
from facs_rig.macros import age_of, years

torch = pytest.importorskip("torch")
from classifiers.training.losses import MACRO, MACROS, person_loss  # noqa: E402
from classifiers.training.network import Networks  # noqa: E402

GENDER, AGE, NOSE = (PERSON.index(name) for name in ("gender", "age", "nose_length"))


def record(**identity) -> dict:
    return {
        "aus": dict.fromkeys(TWELVE, 0.0),
        "head": {"yaw": 0, "pitch": 0, "roll": 0},
        "landmarks": dict.fromkeys(LANDMARKS, (1.0, 2.0)),
    } | ({"identity": identity} if identity else {})


def test_the_person_is_what_the_record_tells_and_the_default_where_it_does_not():
    person = encode([record(gender=0.9, nose_length=-0.4), record()], TWELVE, LANDMARKS).person
    assert person[0, GENDER] == np.float32(0.9) and person[0, NOSE] == np.float32(-0.4)
    others = [k for k in range(len(PERSON)) if k not in (GENDER, NOSE)]
    np.testing.assert_allclose(person[0, others], [BY_NAME[PERSON[k]].default for k in others])
    assert np.isnan(person[1]).all()


def test_every_parameter_is_the_same_in_a_mirror():
    for name in PERSON:
        words = {*BY_NAME[name].low.split("/")[-1].split("-"), *name.split("_")}
        assert not words & {"left", "right", "asym"}, name


def test_boys_have_no_beards():
    person = np.zeros(len(PERSON), np.float32)
    person[GENDER], person[AGE] = 1.0, age_of(40)
    assert manly(person) == 1
    person[AGE] = age_of(9)
    assert manly(person) == 0
    assert manly(np.full(len(PERSON), np.nan)) == 0.5


def test_the_loss_is_least_for_the_truth_with_its_true_spread():
    rng = np.random.default_rng(0)
    truth = torch.tensor(0.3 + 0.5 * rng.standard_normal((4000, 1)))
    weight = torch.ones(4000)

    def slope(mean: float, spread: float) -> tuple[float, float]:
        told = torch.tensor([mean, np.log(spread)]).expand(4000, 1, 2).clone().requires_grad_()
        person_loss(told, truth, weight).backward()
        return tuple(told.grad.sum(dim=(0, 1)).tolist())

    middle, true = float(truth.mean()), float(truth.std())
    assert max(map(abs, slope(middle, true))) < 2e-3  # a stationary point
    assert slope(middle + 0.1, true)[0] > 0.05 and slope(middle - 0.1, true)[0] < -0.05
    assert slope(middle, 1.2 * true)[1] > 0.05 and slope(middle, 0.8 * true)[1] < -0.05


def test_looks_at_a_person_count_by_how_sure_they_are():
    sure, vague = np.log(0.1), np.log(0.3)
    near = np.array([[0.2, sure], [1.0, vague], [0.5, sure]])
    wide = np.array([[0.8, sure], [0.0, sure], [0.5, sure]])
    both = together(near, wide)
    np.testing.assert_allclose(both[:, 0], [0.5, 0.1, 0.5])
    np.testing.assert_allclose(both[[0, 2], 1], sure)
    assert sure < both[1, 1] < vague
    np.testing.assert_allclose(together(near, near), near)
    np.testing.assert_allclose(together(near, wide), together(wide, near))


def test_what_is_not_known_of_a_person_does_not_count():
    told = torch.zeros(3, 2, 2, requires_grad=True)
    truth = torch.tensor([[1.0, float("nan")], [2.0, 3.0], [float("nan")] * 2])
    person_loss(told, truth, torch.tensor([1.0, 0.0, 1.0])).backward()
    assert told.grad[0, 0].abs().sum() > 0
    for row, column in ((0, 1), (1, 0), (1, 1), (2, 0)):
        assert told.grad[row, column].abs().sum() == 0


def test_what_changes_the_whole_face_counts_more():
    assert set(PERSON[:MACROS]) == {"gender", "age", "weight"}
    told = torch.zeros(1, len(PERSON), 2, requires_grad=True)
    person_loss(told, torch.ones(1, len(PERSON)), torch.ones(1)).backward()
    pull = told.grad[0, :, 0]
    assert torch.allclose(pull[:MACROS], MACRO * pull[MACROS:].mean())


def test_the_person_does_not_bend_the_landmarks():
    networks = Networks(TWELVE, LANDMARKS, 64).eval()
    networks(torch.rand(2, 1, 64, 64))[5].sum().backward()
    assert networks.geometry.votes.weight.grad is None
    assert networks.person.conv.weight.grad.abs().sum() > 0


def test_spreads_are_made_true():
    rng = np.random.default_rng(1)
    truth = rng.standard_normal((500, 2)).astype(np.float32)
    truth[::5, 0] = np.nan
    told = np.stack([np.zeros((500, 2)), np.log(np.broadcast_to((2.0, 0.25), (500, 2)))], axis=2)
    found = person_spreads([_Reading(row) for row in told], _Targets(truth))
    np.testing.assert_allclose(found, [0.5, 4.0], rtol=0.1)


class _Reading:
    def __init__(self, person):
        self.person = person


class _Targets:
    def __init__(self, person):
        self.person = person


def test_figures_of_the_person():
    rng = np.random.default_rng(2)
    truth = rng.uniform(-1, 1, (200, len(PERSON)))
    truth[:, GENDER] = rng.random(200)
    perfect = person_figures(truth, truth)["person"]
    assert perfect == {"sex_auc": 1.0, "age_error_years": 0.0, "likeness": pytest.approx(1.0)}
    told = truth.copy()
    told[:, AGE] = age_of(40)
    told[:, GENDER] = -truth[:, GENDER]
    wrong = person_figures(told, truth)["person"]
    assert wrong["sex_auc"] == 0
    assert wrong["age_error_years"] == pytest.approx(
        np.mean([abs(years(a) - 40) for a in truth[:, AGE]])
    )
    assert person_figures(np.zeros((200, 0)), truth) == {}
    assert person_figures(told, np.full_like(truth, np.nan)) == {}


def test_a_detection_tells_who_is_drawn(fresh_weights, cartoons):
    from classifiers.training.readings import pages_of
    from classifiers.training.shards import load

    detector = load_detector(fresh_weights)
    page = next(pages_of(load(cartoons).drawings))
    reading = detector.read(page)
    found = detector.interpret(reading, placed=True)
    assert tuple(found.person) == PERSON
    spreads = np.array([spread for _, spread in found.person.values()])
    assert (spreads > 0).all()
    told = found.to_json()["person"]["gender"]
    assert told == {"value": pytest.approx(found.person["gender"][0], abs=1e-3),
                    "spread": pytest.approx(found.person["gender"][1], abs=1e-3)}  # fmt: skip
    none = detector.interpret(replace(reading, person=np.zeros((0, 2))), placed=True)
    assert none.person == {} and "person" not in none.to_json()


def test_faces_that_are_refused_have_answers_as_well(fresh_weights, cartoons):
    """Where nothing is called a face, figures still need a row as long as the others."""
    from classifiers.training.readings import DetectorReader, pages_of, stacked
    from classifiers.training.shards import load

    detector = load_detector(fresh_weights)
    readings = [detector.read(page) for page in pages_of(load(cartoons, limit=2).drawings)]
    refused = replace(readings[1], face=-20.0)
    assert detector.interpret(refused).trouble
    reader = DetectorReader(detector)
    answers = stacked([reader.answer(readings[0]), reader.answer(refused)])
    assert answers.person.shape == (2, len(PERSON))
