"""The weights in the repository, on faces that nobody has trained on."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from addon.drawing import load_drawing
from classifiers import load_detector
from classifiers.preprocess import as_page
from classifiers.training.evaluate import evaluate
from classifiers.training.metrics import auc
from classifiers.training.negatives import faceless
from classifiers.training.readings import DetectorReader
from classifiers.training.shards import DataSet
from classifiers.training.targets import encode
from dataset_gen.generate import make_sample
from facs_rig import CONTROL_NAMES, LANDMARKS, TWELVE
from tests.nightly import sample

SKETCHES = Path(__file__).resolve().parents[2] / "addon" / "sketches"
SEED = 52_000_111  # far from every seed in model.json, which the first test checks
# What the shipped weights must reach on fresh drawings; raise these when they are trained better.
AUC, AUC_OF_THE_TWELVE, YAW_DEGREES, LANDMARK_ERROR = 0.895, 0.97, 2.2, 0.017


def test_the_weights_belong_to_this_catalogue():
    model = load_detector().model
    assert tuple(model["aus"]) == CONTROL_NAMES
    assert tuple(model["landmarks"]) == LANDMARKS
    assert SEED not in model["data"]["seeds"]
    assert model["figures"]["onnx_minus_torch"] < 1e-4


@pytest.fixture(scope="module")
def fresh():
    """300 drawings, and what is drawn in each."""
    made = (make_sample(SEED, index, scheme="sparse") for index in range(300))
    return tuple(zip(*made, strict=True))


@pytest.fixture(scope="module")
def upright(fresh):
    """What the detector's figures are on these drawings as they are, and its readings of them."""
    readings = []

    class Keeping(DetectorReader):
        def row(self, page):
            readings.append(self.detector.read(page))
            return self.answer(readings[-1])

    return evaluate(Keeping(load_detector()), DataSet(*fresh)), readings


@pytest.mark.slow
def test_fresh_drawings_are_read_as_well_as_promised(upright):
    found, _ = upright
    assert found["mean"]["auc"] >= AUC
    assert found["angle_error_deg"]["yaw"] <= YAW_DEGREES
    assert found["landmark_error"] <= LANDMARK_ERROR
    assert found["seen_as_face"] >= 0.95
    twelve = found["mean_of_the_twelve"]["auc"]
    assert twelve >= 0.968  # of a face that the networks were not trained on: it has another mouth
    if twelve < AUC_OF_THE_TWELVE:
        pytest.xfail(f"{twelve:.4f} of {AUC_OF_THE_TWELVE} until they are trained on this face")


def rolled(drawing: np.ndarray, degrees: float) -> np.ndarray:
    """A drawing (h, w) float turned clockwise on a larger page."""
    turned = ndimage.rotate(drawing, -degrees, order=1, cval=1.0)
    return np.clip(turned, 0, 1).astype(np.float32)


@pytest.mark.parametrize("path", sorted(SKETCHES.glob("*.png")), ids=lambda path: path.stem)
def test_a_sketch_rolled_in_its_plane_keeps_its_expression(path):
    detector, drawing = load_detector(), load_drawing(path).image
    upright = detector.detect(drawing)
    before = np.array(list(upright.probabilities.values()))
    for degrees in (-45, -30, -20, -10, 10, 20, 30, 45):
        found = detector.detect(rolled(drawing, degrees))
        roll = np.degrees(found.head[2] - upright.head[2])
        assert abs(roll - degrees) < 4, degrees
        after = np.array(list(found.probabilities.values()))
        assert np.abs(after - before).mean() < 0.05, degrees
        for name, strength in upright.expression().items():
            if upright.probabilities[name] > 0.9:
                assert found.intensities[name] == pytest.approx(strength, abs=0.6), (name, degrees)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", sample((-45, -20, 30), 1))  # once 0.62, 0.95 and 0.87
def test_rolled_drawings_are_read_as_well_as_upright_ones(fresh, upright, degrees):
    detector = load_detector()
    drawings, records = (some[:120] for some in fresh)
    targets = encode(records, detector.aus, detector.landmarks)
    twelve = [k for k, name in enumerate(detector.aus) if name in TWELVE]

    def auc_of_the_twelve(readings) -> float:
        logits = np.stack([detector.log_odds(reading.logits) for reading in readings])
        return np.nanmean([auc(targets.active[:, k], logits[:, k]) for k in twelve])

    turned = [detector.read(as_page(rolled(d / np.float32(255), degrees))) for d in drawings]
    assert auc_of_the_twelve(turned) > auc_of_the_twelve(upright[1][:120]) - 0.012


def test_pages_without_a_face_are_seldom_taken_for_one():
    pages = [faceless(np.random.default_rng((SEED, i))) for i in range(60)]
    detector = load_detector()
    taken = [detector.detect(1 - page / 255.0).face_probability > 0.5 for page in pages]
    assert np.mean(taken) <= 0.1


def test_reading_a_sketch_reports_to_nobody(tmp_path):
    """Neither does it leave anything at home, nor complain that it cannot."""
    sketch = Path(__file__).parents[2] / "addon" / "sketches" / "smiling_woman.png"
    for home in (tmp_path, Path("/dev/null/nobody")):
        done = subprocess.run(
            [sys.executable, "-m", "addon", "detect", str(sketch)], check=True,
            cwd=sketch.parents[2], env=os.environ | {"HOME": str(home)}, capture_output=True,
        )  # fmt: skip
        assert done.stderr == b""
    assert not list(tmp_path.rglob("*onnx*"))
