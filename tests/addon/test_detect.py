"""`sketch2face detect`: what it says, what it draws, and what it does with several faces."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import classifiers.detector
from addon import cli, explain, pipeline
from addon.drawing import load_drawing
from addon.sketches.render import FOLDER as SKETCHES
from classifiers import load_detector
from classifiers.evidence import evidence
from classifiers.finding import Face
from classifiers.preprocess import Crop
from facs_rig import DETECTED

SKETCH = SKETCHES / "smiling_woman.png"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def drawing():
    return load_drawing(SKETCH).image


@pytest.fixture(scope="module")
def found(drawing):
    return evidence(drawing, load_detector())


def test_an_object_a_line(capsys):
    sketches = sorted(str(path) for path in SKETCHES.glob("*.png"))
    assert cli.main(["detect", *sketches, "--json"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    answers = [json.loads(line) for line in said.out.splitlines()]
    assert [answer["sketch"] for answer in answers] == sketches
    for answer in answers:
        assert set(answer["aus"]) >= set(DETECTED)
        for au in answer["aus"].values():
            assert set(au) == {"probability", "active", "intensity"}
            assert 0 <= au["probability"] <= 1
            assert 0 <= au["intensity"] <= 5
            assert isinstance(au["active"], bool)
        assert set(answer["head"]) == {"yaw", "pitch", "roll"}
        assert answer["model"]
        assert set(answer["confidences"]) == set(answer["landmarks"])
        assert all(0 <= p <= 1 for p in answer["confidences"].values())
        (face,) = answer["faces"]
        assert face["probability"] == answer["face_probability"] > 0.5
        left, top, right, bottom = face["box"]
        pupil, chin = answer["landmarks"]["pupil_left"], answer["landmarks"]["chin"]
        for u, v in (pupil, chin):
            assert left < u < right and top < v < bottom


def test_it_goes_on_after_a_sketch_that_fails(capsys, folder):
    arguments = ["detect", str(SKETCH), "nobody.png", str(SKETCH), "--json", "--explain", "why.png"]
    assert cli.main(arguments) == 2
    said = capsys.readouterr()
    assert len(said.out.splitlines()) == 2
    assert said.err.count("\n") == 1 and "nobody.png" in said.err
    assert not list(folder.iterdir())


def test_for_people(capsys):
    assert cli.main(["detect", str(SKETCH)]) == 0
    said = capsys.readouterr().out
    assert str(SKETCH) in said and all(name in said for name in DETECTED)


def test_damaged_weights_are_named(capsys, folder, monkeypatch):
    def damaged():
        raise ValueError("weights/detector.onnx is damaged: install the package again.")

    monkeypatch.setattr("classifiers.load_detector", damaged)
    for command in ("detect", "fit"):
        assert cli.main([command, str(SKETCH)]) == 2
        said = capsys.readouterr()
        assert said.err.count("\n") == 1 and "detector.onnx is damaged" in said.err
    assert not list(folder.iterdir())


# --- several faces on a page ----------------------------------------------------------------------


@pytest.fixture
def couple(folder, drawing, found, monkeypatch):
    """A page with a large and a small woman, and networks that find both."""
    height, width = drawing.shape
    page = np.ones((height, width + width // 2), np.float32)
    page[:, :width] = drawing
    page[: height // 2, width:] = drawing[::2, ::2]
    Image.fromarray((255 * page).astype(np.uint8)).save("couple.png")
    box = found.box
    small = Crop(box.left / 2 + width, box.top / 2, box.width / 2, box.height / 2)
    faces = [Face(box, 0.9), Face(small, 0.8)]

    def inside(_, crop):
        boxes = [face for face in faces if face.box.left + face.box.width > crop.left]
        return [face for face in boxes if face.box.left < crop.left + crop.width]

    monkeypatch.setattr(classifiers.detector, "faces_on", inside)
    return Path("couple.png"), small


def test_the_others_are_listed(capsys, couple, found):
    path, small = couple
    assert cli.main(["detect", str(path), "--json"]) == 0
    faces = json.loads(capsys.readouterr().out)["faces"]
    largest, other = (face["box"] for face in faces)
    corners = Face(found.box, 1.0).corners
    np.testing.assert_allclose(largest, corners, atol=0.08 * found.box.width)
    np.testing.assert_allclose(other, Face(small, 1.0).corners, atol=0.02)
    assert faces[1]["probability"] == 0.8
    assert cli.main(["detect", str(path)]) == 0
    assert "Another face is drawn on the page; the largest was read" in capsys.readouterr().out


def test_a_fit_says_that_it_left_faces_out(capsys, couple, found):
    path, _ = couple
    assert cli.main(["fit", str(path), "-o", "face.obj", "--report", "report.json"]) == 0
    said = capsys.readouterr()
    assert said.err.count("\n") == 1 and "the largest was read" in said.err
    report = json.loads(Path("report.json").read_text())
    assert len(report["faces"]) == 2
    assert report["aus"]["smile"]["active"]
    assert cli.main(["fit", str(path), "-o", "face.obj", "-q"]) == 0
    assert capsys.readouterr().err == ""


def test_the_other_is_read_where_the_head_is_placed_by_hand(couple, drawing):
    path, small = couple
    left, top, right, bottom = Face(small, 1.0).corners
    head = left, top - 0.2 * small.height, right, bottom
    options = pipeline.FitOptions(align=",".join(f"{x:.1f}" for x in head))
    detection = pipeline.fit(path, options).detection
    assert detection.faces[0].box.left > drawing.shape[1]
    assert detection.left_out() == ""
    assert detection.active["smile"]


# --- the picture of the evidence ------------------------------------------------------------------


def coloured(picture: np.ndarray) -> np.ndarray:
    return np.ptp(picture.astype(int), axis=2) > 40


def test_explain_draws_every_sketch(capsys, folder):
    small = Image.open(SKETCH).resize((192, 192))
    small.save("small.png")
    assert cli.main(["detect", "small.png", "--explain", "one.png"]) == 0
    one = np.asarray(Image.open("one.png"))
    assert coloured(one).any()
    assert cli.main(["detect", "small.png", str(SKETCH), "--explain", "two.png"]) == 0
    two = np.asarray(Image.open("two.png"))
    assert two.shape[0] > one.shape[0] + explain.TILE
    np.testing.assert_array_equal(two[: len(one) - explain.LEGEND, : one.shape[1]],
                                  one[: len(one) - explain.LEGEND])  # fmt: skip


def test_explain_does_not_overwrite_a_sketch(capsys, folder):
    Path("b.png").write_bytes(SKETCH.read_bytes())
    assert cli.main(["detect", str(SKETCH), "b.png", "--explain", "b.png"]) == 2
    assert capsys.readouterr().out == ""
    assert Path("b.png").read_bytes() == SKETCH.read_bytes()


def test_a_smile_is_seen_at_the_mouth(drawing, found):
    page = found.on_page("smile") * (1 - drawing)
    v, u = np.unravel_index(page.argmax(), page.shape)
    points = found.detection.landmarks
    mouth = np.array([points["mouth_corner_left"], points["mouth_corner_right"]])
    nearest = np.linalg.norm(mouth - (u, v), axis=1).min()
    assert nearest < 0.15 * found.box.width


def test_a_tile_for_each_active_control(drawing, found):
    names = list(found.detection.active)
    detection = replace(found.detection, active={name: k < 5 for k, name in enumerate(names)})
    picture = explain.section("five", drawing, replace(found, detection=detection))
    step = explain.TILE + explain.GAP
    assert picture.width == explain.GAP + explain.COLUMNS * step
    assert picture.height == explain.HEADING + 2 * (explain.CAPTION + step)
    rest = replace(found.detection, active=dict.fromkeys(names, False))
    picture = explain.section("none", drawing, replace(found, detection=rest))
    assert picture.width == explain.GAP + explain.LIKELIEST * step
    assert coloured(np.asarray(picture)).any()


def test_lines_are_red_where_they_speak_for_and_blue_where_against():
    ink = np.zeros((40, 40), np.float32)
    ink[::10] = 0.4
    heat = np.zeros((40, 40), np.float32)
    heat[:15], heat[25:] = 2.0, -2.0
    picture = np.asarray(explain.coloured(ink, heat)).astype(int)
    assert (picture[0, 0] == explain.FOR).all()
    assert (picture[20, 20] == explain.NEITHER).all()
    assert (picture[30, 30] == explain.AGAINST).all()
    assert (picture[5] == 255).all()
    pale = np.asarray(explain.coloured(ink, heat * 0.001)).astype(int)
    assert np.abs(pale[0, 0] - explain.NEITHER).max() < 20  # next to nothing is not shouted
    blank = np.asarray(explain.coloured(0 * ink, heat))
    assert (blank == 255).all()
