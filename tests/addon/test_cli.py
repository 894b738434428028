"""The command line: exit statuses, what it says, and that a failure leaves nothing behind."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from addon import cli
from addon.console import Bar
from addon.sketches.render import FOLDER as SKETCHES
from facs_rig import TWELVE
from snakes import Tweakables

ROOT = Path(__file__).resolve().parents[2]
SKETCH = SKETCHES / "smiling_woman.png"
OLD_MAN = SKETCHES / "worried_old_man.png"


def contents(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


# --- asking for help -----------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["", *cli.COMMANDS])
def test_help_of_every_command(capsys, command):
    assert cli.main([command, "--help"] if command else ["--help"]) == 0
    said = capsys.readouterr().out
    assert "usage: sketch2face" in said
    if not command:
        assert all(name in said for name in cli.COMMANDS)


def test_help_of_fit_names_every_tweakable(capsys):
    assert cli.main(["fit", "--help"]) == 0
    said = capsys.readouterr().out
    for field in fields(Tweakables):
        assert "--" + field.name.replace("_", "-") in said
    assert all(f"--{name}" in said for name in ("unmatched", "stroke-depth", "stroke-width"))


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from addon import cli; status = cli.main(['--help']); "
        "sys.exit(status or ','.join({'numpy', 'scipy', 'PIL', 'torch'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("sketch2face ")


def test_the_module_is_the_command():
    command = [sys.executable, "-m", "addon", "fit"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("sketch2face fit:") and done.stderr.count("\n") == 1


# --- what cannot be used -------------------------------------------------------------------------


def test_no_command(refused):
    assert "COMMAND" in refused()


def test_an_unknown_command(refused):
    assert "paint" in refused("paint")


@pytest.mark.parametrize("command", ["fit", "detect"])
def test_a_missing_sketch(refused, folder, command):
    assert "There is no file 'nobody.png'" in refused(command, "nobody.png")
    assert not contents(folder)


def bad_pictures() -> dict[str, bytes]:
    def png(array) -> bytes:
        import io

        buffer = io.BytesIO()
        Image.fromarray(array).save(buffer, format="PNG")
        return buffer.getvalue()

    from skimage import data

    return {
        "text": b"A letter, not a picture.\n",
        "empty": b"",
        "blank": png(np.full((200, 200), 255, np.uint8)),
        "dot": png(np.zeros((1, 1), np.uint8)),
        "layer": png(np.zeros((200, 200, 4), np.uint8)),
        "cut": SKETCH.read_bytes()[:5000],
        "photo": png(data.camera()),
    }


@pytest.mark.parametrize("kind", bad_pictures())
def test_a_bad_sketch_leaves_older_files_alone(refused, folder, kind):
    Path("bad.png").write_bytes(bad_pictures()[kind])
    Path("face.glb").write_bytes(b"an older face")
    outputs = ["-o", "face.glb", "--report", "r.json", "--preview", "p.png"]
    assert "bad.png" in refused("fit", "bad.png", *outputs)
    assert contents(folder) == {"bad.png", "face.glb"}
    assert Path("face.glb").read_bytes() == b"an older face"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["-o", "face.stl"], "has no known ending; use .glb, .fbx, .obj, .ply or .blend."),
        (["-o", "face"], "'face' has no known ending"),
        (["-o", "nowhere/face.glb"], "There is no folder 'nowhere'"),
        (["--report", "report.txt"], "'report.txt' has no known ending; use .json."),
        (["--preview", "preview.gif"], "'preview.gif' has no known ending; use .png."),
        (["--preview", SKETCH], "'smiling_woman.png' is named twice"),
        (["--gap-closing", "two"], "--gap-closing: invalid int value: 'two'"),
        (["--gap-closing", "0"], "Gap closing (gap_closing) lies between 1 and 20 px"),
        (["--snake-type", "lazy"], "invalid choice: 'lazy'"),
        (["--hair", "curves"], "'smiling_woman.glb' cannot hold hair curves: write a .blend"),
        (["--hair", "wig"], "--hair: invalid choice: 'wig'"),
        (["--align", "1,2,3"], "left,top,right,bottom"),
        (["--align", "200,0,100,300"], "is empty"),
        (["--unmatched", "carve"], "--unmatched: invalid choice: 'carve'"),
        (["--stroke-profile", "trench"], "--stroke-profile: invalid choice: 'trench'"),
        (["--stroke-depth", "deep"], "--stroke-depth: invalid float value: 'deep'"),
        (["--stroke-depth", "0"], "Depth (stroke_depth) is more than 0 and at most 5 mm"),
        (["--stroke-depth", "nan"], "Depth (stroke_depth) is a number, not nan"),
        (["--stroke-width", "50"], "Width (stroke_width) is more than 0 and at most 20 mm"),
        (["--no-such-option"], "unrecognized arguments: --no-such-option"),
    ],
)
def test_arguments_that_cannot_be_carried_out(refused, folder, arguments, says):
    assert says in refused("fit", SKETCH, *arguments)
    assert not contents(folder)


def test_a_folder_that_cannot_be_written_to(refused, folder):
    # /proc refuses files even from root, which permissions do not.
    if not Path("/proc").is_dir():
        pytest.skip("there is no /proc here")
    assert "Nothing can be written" in refused("fit", SKETCH, "-o", "/proc/face.glb")


def test_generate_says_what_is_wrong(refused, folder):
    assert "--count" in refused("generate", "--count", "0", "--out", "data")
    order = ("generate", "--count", "1", "--out", "data", "--dask")
    assert "tcp://HOST:8786" in refused(*order, "localhost")
    assert "leave one of the two" in refused(*order, "tcp://host:8786", "--jobs", "2")
    assert not contents(folder)


def test_generate_without_dask_names_the_extra(refused, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = refused("generate", "--count", "1", "--out", "d", "--dask", "tcp://host:8786")
    assert "pip install 'sketch-to-face[cluster]'" in said
    assert not contents(folder)


def test_a_fault_of_ours_is_not_blamed_on_the_sketch(capsys, monkeypatch):
    def broken(options):
        raise ZeroDivisionError("a bug")

    about, arguments, _ = cli.COMMANDS["rig"]
    monkeypatch.setitem(cli.COMMANDS, "rig", (about, arguments, broken))
    assert cli.main(["rig"]) == 1
    said = capsys.readouterr().err
    assert "ZeroDivisionError: a bug" in said
    assert "this is a fault of the program" in said


def test_a_missing_extra_is_named(refused, monkeypatch):
    def needy(options):
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    about, arguments, _ = cli.COMMANDS["rig"]
    monkeypatch.setitem(cli.COMMANDS, "rig", (about, arguments, needy))
    assert "pip install 'sketch-to-face[train]'" in refused("rig")


def test_a_reader_that_leaves_early_is_no_error():
    done = subprocess.run(
        f"{sys.executable} -m addon rig --json | head -n 1",
        shell=True,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == "{\n"
    assert done.stderr == ""


# --- what works ----------------------------------------------------------------------------------


def test_fit_writes_face_report_and_preview(capsys, folder):
    outputs = ["-o", "face.glb", "--report", "report.json", "--preview", "preview.png"]
    assert cli.main(["fit", str(SKETCH), *outputs]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "face.glb, report.json, preview.png" in said.out
    assert contents(folder) == {"face.glb", "report.json", "preview.png"}
    assert Path("face.glb").read_bytes()[:4] == b"glTF"

    report = json.loads(Path("report.json").read_text())
    assert set(report["aus"]) >= set(TWELVE)
    assert set(report["head"]) == {"yaw", "pitch", "roll"}
    projection = np.array(report["projection"])
    assert projection.shape == (3, 4)
    np.testing.assert_allclose(projection[2, [0, 1, 3]], [0, 0, 1])
    assert -1.5 < projection[2, 2] <= 0  # the eye is before the face, or infinitely far
    assert set(report["contour_error_px"]) == {"template", "expression", "fitted"}
    assert all(len(stroke["polyline"][0]) == 2 for stroke in report["unmatched"])
    assert all(seconds >= 0 for seconds in report["timings_s"].values())
    with Image.open("preview.png") as preview:
        assert preview.mode == "RGB"


def test_fit_is_quiet_when_asked_and_names_the_face_itself(capsys, folder):
    assert cli.main(["fit", str(SKETCH), "--quiet", "--max-iterations", "50", "--mirror"]) == 0
    assert capsys.readouterr() == ("", "")
    assert contents(folder) == {"smiling_woman.glb"}


def test_strokes_without_a_place_are_carved_when_asked(capsys, folder):
    import trimesh

    faces = {}
    for unmatched in ("ignore", "engrave", "emboss"):
        outputs = ["-o", f"{unmatched}.ply", "--report", f"{unmatched}.json", "-q"]
        depth = ["--unmatched", unmatched, "--stroke-depth", "1", "--stroke-profile", "scar"]
        assert cli.main(["fit", str(OLD_MAN), *outputs, *depth]) == 0
        vertices = trimesh.load(f"{unmatched}.ply", process=False).vertices
        faces[unmatched] = vertices, json.loads(Path(f"{unmatched}.json").read_text())["unmatched"]
    plain, engraved, embossed = (vertices for vertices, _ in faces.values())
    assert np.abs(engraved - plain).max() > 4e-4
    np.testing.assert_allclose(engraved - plain, plain - embossed, atol=1e-4)
    assert faces["ignore"][1] == faces["engrave"][1] == faces["emboss"][1]


@pytest.mark.parametrize(
    ("pin", "told"),
    [
        ("nose_tip", "NAME=U,V"),
        ("nose_tip=3", "NAME=U,V"),
        ("nose_tip=a,b", "NAME=U,V"),
        ("nose=3,4", "no landmark 'nose'"),
        ("nose_tip=inf,4", "place u,v in pixels"),
    ],
)
def test_a_pin_that_is_none_is_refused_in_a_sentence(capsys, folder, pin, told):
    assert cli.main(["fit", str(SKETCH), "--pin", pin]) == 2
    said = capsys.readouterr().err
    assert told in said and said.count("\n") == 1
    assert list(folder.iterdir()) == []


def test_the_projection_takes_the_written_file_into_the_sketch(capsys, folder):
    import trimesh

    Image.open(SKETCH).resize((3072, 3072)).save("big.png")  # reduced when read
    assert cli.main(["fit", "big.png", "-o", "face.ply", "--report", "report.json", "-q"]) == 0
    vertices = trimesh.load("face.ply", process=False).vertices
    matrix = np.array(json.loads(Path("report.json").read_text())["projection"])
    pixels = np.c_[vertices, np.ones(len(vertices))] @ matrix.T
    pixels /= pixels[:, 2:]
    (left, top), (right, bottom) = pixels[:, :2].min(axis=0), pixels[:, :2].max(axis=0)
    # The drawn head spans about 650 to 2450 by 300 to 2550 of these pixels.
    assert 300 < left < 1100 and 2000 < right < 2800
    assert 0 < top < 900 and 2100 < bottom < 3072


def test_generate_writes_shards(capsys, folder):
    arguments = ["generate", "--count", "3", "--out", "data", "--seed", "4", "--preview", "2"]
    assert cli.main(arguments) == 0
    said = capsys.readouterr()
    assert "3 samples" in said.out
    assert said.err == ""  # no progress bar in a pipe
    assert contents(folder / "data") == {"shard-000000.tar", "manifest.json", "preview.png"}
    with Image.open(folder / "data" / "preview.png") as sheet:
        assert sheet.size == (2 * 256 + 4, 256)


def test_generate_hands_its_options_on(folder, monkeypatch):
    taken = {}
    monkeypatch.setattr(
        "dataset_gen.generate.generate", lambda count, out, **options: taken.update(options) or []
    )
    order = ["generate", "--count", "3", "--out", "data", "--dask", "tcp://host:8786", "--meshes"]
    assert cli.main([*order, "--strokes", "--resume"]) == 0
    taken.pop("progress")
    assert taken == {
        "seed": 0, "engine": "contours", "scheme": "people", "jobs": 1,
        "resume": True, "strokes": True, "meshes": True, "dask": "tcp://host:8786",
        "hair": 0.75,
    }  # fmt: skip


def test_a_bar_is_drawn_on_a_terminal_only(capsys, monkeypatch):
    with Bar("work") as bar:
        bar(1, 2)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with Bar("work") as bar:
        bar(1, 2)
    assert "work [################................] 1/2" in capsys.readouterr().err
