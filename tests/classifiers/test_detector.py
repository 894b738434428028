"""The detector on networks that were exported a moment ago, and what it does with bad input."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest

from classifiers import load_detector, shards
from classifiers.detector import Detector, Reading
from classifiers.labels import ACTIVE, FULL, mirror_order
from classifiers.preprocess import as_page
from facs_rig import DETECTED, LANDMARKS


@pytest.fixture(scope="module")
def detector(fresh_weights) -> Detector:
    return load_detector(fresh_weights)


@pytest.fixture(scope="module")
def drawing(cartoons) -> np.ndarray:
    return shards.load(cartoons, 1).drawings[0] / np.float32(255)


def test_a_detection_is_complete_and_in_range(detector, drawing):
    found = detector.detect(drawing)
    for mapping in (found.probabilities, found.active, found.intensities):
        assert tuple(mapping) == DETECTED
    assert all(0 <= p <= 1 for p in found.probabilities.values())
    assert all(type(active) is bool for active in found.active.values())
    for name, value in found.intensities.items():
        assert value == 0 if not found.active[name] else ACTIVE <= value <= FULL
    assert tuple(found.landmarks) == LANDMARKS
    assert len(found.head) == 3 and all(abs(angle) < np.pi for angle in found.head)
    assert 0 <= found.face_probability <= 1
    assert set(found.expression()) == {name for name in DETECTED if found.active[name]}


@pytest.mark.parametrize("shape", [(1, 1), (3, 700), (1400, 900)])
def test_any_page_size_will_do(detector, shape):
    page = np.ones(shape, np.float64)
    page[shape[0] // 3 : shape[0] // 2 + 1, shape[1] // 3 : shape[1] // 2 + 1] = 0.2
    found = detector.detect(page)
    assert np.isfinite(list(found.landmarks.values())).all()


def test_a_blank_page_is_read_without_complaint(detector):
    assert np.isfinite(detector.detect(np.ones((64, 64), np.float32)).face_probability)


def test_the_same_drawing_gives_the_same_answer(detector, drawing):
    assert detector.detect(drawing) == detector.detect(drawing)


def test_size_and_paper_around_the_drawing_hardly_matter(detector, drawing):
    a = detector.read(as_page(drawing))
    bigger = np.pad(np.kron(drawing, np.ones((3, 3), np.float32)), 150, constant_values=1)
    b = detector.read(as_page(bigger))
    np.testing.assert_allclose((b.landmarks - 150) / 3, a.landmarks, atol=1.0)
    np.testing.assert_allclose(b.angles, a.angles, atol=0.02)


def test_the_second_look_of_a_mirrored_crop_is_the_mirrored_answer(detector, rng):
    crop = rng.random((detector.size, detector.size), np.float32) ** 4
    a, b = detector.look_both_ways(crop), detector.look_both_ways(crop[:, ::-1])
    np.testing.assert_allclose(b.logits, a.logits[:, mirror_order(DETECTED)], atol=1e-4)
    np.testing.assert_allclose(b.angles, a.angles * (-1, 1, -1), atol=1e-5)
    order = mirror_order(LANDMARKS)
    np.testing.assert_allclose(b.landmarks, a.landmarks[:, order] * (-1, 1) + (1, 0), atol=1e-4)


def test_thresholds_and_the_rule_of_sides_decide(detector, monkeypatch):
    k = {name: i for i, name in enumerate(DETECTED)}
    logits = np.full(len(DETECTED), -40.0)
    intensities = np.full(len(DETECTED), 0.2)
    for name, value in (("smile", 7.3), ("grimace_left", 4.0), ("grimace_right", 2.5)):
        logits[k[name]], intensities[k[name]] = 40, value
    points = np.zeros((len(LANDMARKS), 2))
    found = detector.interpret(Reading(logits, intensities, np.zeros(3), points, 3.0))
    assert found.expression() == pytest.approx({"grimace": 2.5, "grimace_left": 1.5, "smile": 5.0})
    logits[k["grimace_right"]] = -0.5  # in doubt beside a certain left: it is the left alone
    monkeypatch.setitem(detector._thresholds, "grimace_right", 0.05)
    one = detector.interpret(Reading(logits, intensities, np.zeros(3), points, 3.0))
    assert one.expression() == pytest.approx({"grimace_left": 4.0, "smile": 5.0})
    logits[k["sneer"]] = 40  # certain but faint: an active control is at least at 1
    found = detector.interpret(Reading(logits, intensities, np.zeros(3), points, 3.0))
    assert found.intensities["sneer"] == ACTIVE


def test_no_drawing_no_detection(detector):
    with pytest.raises(ValueError, match="grey image"):
        detector.detect(np.ones((8, 8, 3), np.float32))


def test_damaged_or_missing_weights_are_named(fresh_weights, tmp_path):
    with pytest.raises(ValueError, match=r"model\.json is missing"):
        Detector(tmp_path)
    folder = tmp_path / "copy"
    shutil.copytree(fresh_weights, folder)
    weights = folder / "detector.onnx"
    weights.write_bytes(weights.read_bytes()[:-1])
    with pytest.raises(ValueError, match=r"detector\.onnx is damaged"):
        Detector(folder)
    weights.unlink()
    with pytest.raises(ValueError, match=r"detector\.onnx cannot be read"):
        Detector(folder)
    description = folder / "model.json"
    model = json.loads(description.read_text())
    description.write_text(json.dumps(model | {"format": 99}))
    with pytest.raises(ValueError, match="format 99"):
        Detector(folder)
    description.write_text("{")
    with pytest.raises(ValueError, match=r"model\.json is damaged"):
        Detector(folder)
