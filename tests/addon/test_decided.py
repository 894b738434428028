"""What the artist has decided stays, by every method; and faces whose skin is left alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from addon import cli
from addon.pipeline import METHODS, FitOptions, fit, read_expression, report
from addon.sketches.render import FOLDER as SKETCHES
from addon.strategies import LEAST_FACE
from classifiers import load_detector
from facs_rig import CONTROL_NAMES

SKETCH = SKETCHES / "smiling_woman.png"
# The detector sees her smile and no sneer; 8 is more than any fit would make of it, or report.
SETTLED = {"smile": 0.0, "sneer": 2.5, "jaw_open": 8}


@pytest.fixture(scope="module")
def by_lines():
    return fit(SKETCH)


@pytest.mark.parametrize("method", METHODS)
def test_the_face_wears_exactly_what_is_settled(by_lines, method):
    assert by_lines.parameters.aus["smile"] > 1 and "sneer" not in by_lines.parameters.aus
    face = fit(SKETCH, FitOptions(expression=SETTLED, method=method))
    assert "smile" not in face.parameters.aus
    assert face.parameters.aus["sneer"] == 2.5
    assert face.parameters.aus["jaw_open"] == 8.0
    detected = {name for name, on in by_lines.detection.active.items() if on}
    assert set(face.parameters.aus) == detected - {"smile"} | {"sneer", "jaw_open"}
    assert face.detection.active == by_lines.detection.active  # what was read stays what was read

    said = report(face)["aus"]
    assert said["smile"]["intensity"] == 0 and said["smile"]["active"] is False
    assert said["smile"]["probability"] > 0.5
    assert said["sneer"]["intensity"] == 2.5 and said["sneer"]["active"] is True
    assert said["jaw_open"]["intensity"] == SETTLED["jaw_open"] > 5  # as the face wears it


def test_the_lines_decide_what_is_not_settled(by_lines):
    worn = by_lines.parameters.aus
    others = [name for name in worn if name != "smile"]
    face = fit(SKETCH, FitOptions(expression={"smile": worn["smile"] + 1}))
    assert any(face.parameters.aus[name] != worn[name] for name in others)
    assert face.parameters.identity != by_lines.parameters.identity


def test_it_counts_where_no_face_was_recognised():
    """A head placed by hand on scribbles: nothing of the detector's is believed but this."""
    page = np.full((300, 300), 255, np.uint8)
    page[40:260:20, 60:240] = 0
    box = "60,40,240,260"
    wanted = {name: 3.0 if name == "pucker" else 0.0 for name in CONTROL_NAMES}
    face = fit(page, FitOptions(align=box, expression=wanted))
    assert face.detection.face_probability < LEAST_FACE
    assert dict(face.parameters.aus) == {"pucker": 3.0}


def test_shape_is_lines_without_pulling_the_skin(by_lines, monkeypatch):
    def pulled(*_):
        raise AssertionError("the skin was pulled")

    monkeypatch.setattr("snakes.line_fit.pull_skin", pulled)
    face = fit(SKETCH, FitOptions(method="shape"))
    assert face.offsets.shape == by_lines.offsets.shape and face.offsets.dtype == np.float32
    assert not face.offsets.any()
    assert face.parameters == by_lines.parameters
    assert face.camera == by_lines.camera
    np.testing.assert_allclose(face.vertices, face.rig.pose(by_lines.parameters), atol=1e-6)
    error, theirs = face.contour_error_px, by_lines.contour_error_px
    assert error["expression"] == theirs["expression"] > theirs["fitted"]


def test_a_detector_of_ones_own_is_asked():
    class Asked(Exception):
        pass

    class Mine:
        def detect(self, drawing, head):
            raise Asked

    for read in (fit, read_expression):
        with pytest.raises(Asked):
            read(SKETCH, detector=Mine())
    single = load_detector(threads=1)
    assert read_expression(SKETCH, detector=single).aus == read_expression(SKETCH).aus


@pytest.mark.parametrize(
    ("expression", "says"),
    [
        ({"smlie": 1.0}, "^There is no control 'smlie'; did you mean 'smile'\\?$"),
        ({"xyzzy": 1.0}, "^There is no control 'xyzzy'; .* shows all\\.$"),
        ({"smile": 10.5}, "^The intensity of smile is at least 0 and at most 10, not 10.5\\.$"),
        ({"smile": -1.0}, "at most 10, not -1\\.$"),
        ({"smile": float("nan")}, "at most 10, not nan\\.$"),
        ({"smile": float("inf")}, "at most 10, not inf\\.$"),
    ],
)
def test_what_no_face_can_do_is_not_settled(expression, says):
    with pytest.raises(ValueError, match=says):
        FitOptions(expression=expression)


# --- from the command line ------------------------------------------------------------------------


def test_fit_takes_controls_and_shape(capsys, folder):
    Image.open(SKETCH).resize((384, 384)).save("small.png")
    order = ["fit", "small.png", "--method", "shape", "--report", "r.json", "-o", "face.ply"]
    assert cli.main([*order, "--au", "sneer=2.5", "--au", "smile=3", "--au", "smile=0"]) == 0
    assert "sneer 2.5" in capsys.readouterr().out
    said = json.loads(Path("r.json").read_text())["aus"]
    assert said["sneer"]["intensity"] == 2.5
    assert said["smile"]["intensity"] == 0  # the last word counts


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--au", "smile"], "--au takes NAME=VALUE, such as smile=4, not 'smile'"),
        (["--au", "smile=much"], "--au takes NAME=VALUE"),
        (["--au", "smlie=1"], "did you mean 'smile'?"),
        (["--au", "smile=11"], "at most 10, not 11"),
        (["--au", "smile=nan"], "at most 10, not nan"),
        (["--method", "guess"], "invalid choice: 'guess'"),
    ],
)
def test_fit_refuses_what_no_face_can_do(refused, folder, arguments, says):
    assert says in refused("fit", SKETCH, *arguments)
    assert not list(folder.iterdir())


def test_help_of_fit_tells_of_both(capsys):
    assert cli.main(["fit", "--help"]) == 0
    said = capsys.readouterr().out
    assert "--au NAME=VALUE" in said
    assert all(f"{method}:" in said for method in METHODS)
