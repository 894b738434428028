"""docs/detectors.md tells the figures that were measured, of the weights that ship."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[3] / "docs"


@pytest.fixture
def tables():
    spec = importlib.util.spec_from_file_location("detector_tables", DOCS / "detector_tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(tables):
    page = (DOCS / "detectors.md").read_text(encoding="utf-8")
    assert tables.renewed(page) == page, "run: python docs/detector_tables.py"


def test_figures_of_other_weights_are_said_to_be_so(tables, tmp_path, monkeypatch):
    shipped = tables.read_description(tables.WEIGHTS)["sha256"]
    line = tables.measured("detector")[0]
    monkeypatch.setattr(tables, "RESULTS", tmp_path / "results.jsonl")
    for sha256, told in ((shipped, False), ("0" * 64, True)):
        line["model"]["sha256"] = sha256
        tables.RESULTS.write_text(json.dumps(line) + "\n")
        assert ("earlier weights" in tables.sets()) == told
    tables.RESULTS.unlink()
    assert tables.sets() == tables.units() == tables.splits() == tables.NONE


def test_the_baseline_stands_beside_the_detector_on_the_same_set(tables, tmp_path, monkeypatch):
    ours = tables.measured("detector")[0]
    unit = {key: 0.5 for key in ours["mean"]}
    theirs = ours | {
        "model": {"networks": "googlenet", "training": {}},
        "units": {"smile": unit | {"auc": 0.625}},
        "landmark_error": None, "seen_as_face": None, "landmark_confidence_ece": None,
        "angle_error_deg": dict.fromkeys(("yaw", "pitch", "roll", "mean")),
    }  # fmt: skip
    monkeypatch.setattr(tables, "RESULTS", tmp_path / "results.jsonl")
    tables.RESULTS.write_text("".join(json.dumps(line) + "\n" for line in (ours, theirs)))
    name = tables.name_of(ours)
    assert f"| {name}, GoogLeNets |" in tables.sets()
    (row,) = [row for row in tables.units().splitlines() if row.startswith("| `smile`")]
    assert row.endswith("| 0.500 / 0.625 |")
    smile = ours["units"]["smile"]
    assert f"| {smile['balanced_accuracy']:.3f} / {smile['auc']:.3f} |" in row


def test_a_page_without_a_place_for_a_table_is_refused(tables):
    with pytest.raises(ValueError, match="needs the lines"):
        tables.renewed("# Seeing\n")
