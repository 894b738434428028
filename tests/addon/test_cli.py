"""The command line: exit statuses, what it says, and that a failure leaves nothing behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from addon import cli
from addon.console import Bar
from addon.files import OutputError, Outputs, check_output, write_text
from addon.sketches.render import FOLDER as SKETCHES
from facs_rig import ARKIT_NAMES, CONTROL_NAMES, DETECTED, FaceParameters, expressions, load_rig
from snakes import Tweakables

ROOT = Path(__file__).resolve().parents[2]
SKETCH = SKETCHES / "smiling_woman.png"
OLD_MAN = SKETCHES / "worried_old_man.png"


def refused(capsys, *arguments) -> str:
    """The one line that a refused command line says on stderr."""
    status = cli.main([str(argument) for argument in arguments])
    said = capsys.readouterr()
    assert status == 2, said.err
    assert said.out == ""
    assert said.err.startswith("sketch2face") and said.err.count("\n") == 1
    return said.err


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


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


def test_no_command(capsys):
    assert "COMMAND" in refused(capsys)


def test_an_unknown_command(capsys):
    assert "paint" in refused(capsys, "paint")


@pytest.mark.parametrize("command", ["fit", "detect"])
def test_a_missing_sketch(capsys, folder, command):
    assert "There is no file 'nobody.png'" in refused(capsys, command, "nobody.png")
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
def test_a_bad_sketch_leaves_older_files_alone(capsys, folder, kind):
    Path("bad.png").write_bytes(bad_pictures()[kind])
    Path("face.glb").write_bytes(b"an older face")
    outputs = ["-o", "face.glb", "--report", "r.json", "--preview", "p.png"]
    assert "bad.png" in refused(capsys, "fit", "bad.png", *outputs)
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
        (["--align", "1,2,3"], "left,top,right,bottom"),
        (["--align", "200,0,100,300"], "is empty"),
        (["--unmatched", "carve"], "--unmatched: invalid choice: 'carve'"),
        (["--stroke-profile", "trench"], "--stroke-profile: invalid choice: 'trench'"),
        (["--stroke-depth", "deep"], "--stroke-depth: invalid float value: 'deep'"),
        (["--stroke-depth", "0"], "stroke depth (stroke_depth) is more than 0 and at most 5 mm"),
        (["--stroke-depth", "nan"], "at most 5 mm, not nan"),
        (["--stroke-width", "50"], "stroke width (stroke_width) is more than 0 and at most 20 mm"),
        (["--no-such-option"], "unrecognized arguments: --no-such-option"),
    ],
)
def test_arguments_that_cannot_be_carried_out(capsys, folder, arguments, says):
    assert says in refused(capsys, "fit", SKETCH, *arguments)
    assert not contents(folder)


def test_a_folder_that_cannot_be_written_to(capsys, folder):
    # /proc refuses files even from root, which permissions do not.
    if not Path("/proc").is_dir():
        pytest.skip("there is no /proc here")
    assert "Nothing can be written" in refused(capsys, "fit", SKETCH, "-o", "/proc/face.glb")


def test_generate_says_what_is_wrong(capsys, folder):
    assert "--count" in refused(capsys, "generate", "--count", "0", "--out", "data")
    order = ("generate", "--count", "1", "--out", "data", "--dask")
    assert "tcp://HOST:8786" in refused(capsys, *order, "localhost")
    assert "leave one of the two" in refused(capsys, *order, "tcp://host:8786", "--jobs", "2")
    assert not contents(folder)


def test_generate_without_dask_names_the_extra(capsys, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = refused(capsys, "generate", "--count", "1", "--out", "d", "--dask", "tcp://host:8786")
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


def test_a_missing_extra_is_named(capsys, monkeypatch):
    def needy(options):
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    about, arguments, _ = cli.COMMANDS["rig"]
    monkeypatch.setitem(cli.COMMANDS, "rig", (about, arguments, needy))
    assert "pip install 'sketch-to-face[train]'" in refused(capsys, "rig")


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


def test_rig_lists_all_controls(capsys):
    assert cli.main(["rig"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines if line.startswith("  ")][:47] == list(CONTROL_NAMES)
    assert cli.main(["rig", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert [control["name"] for control in table["controls"]] == list(CONTROL_NAMES)
    assert len(table["identity"]) >= 34


def test_rig_writes_a_posed_face(capsys, folder):
    import trimesh

    assert cli.main(["rig", "-o", "plain.ply"]) == 0
    assert cli.main(["rig", "-o", "smile.ply", "--au", "smile=5"]) == 0
    names = ("plain.ply", "smile.ply")
    plain, smile = (trimesh.load(name, process=False).vertices for name in names)
    moved = np.linalg.norm(smile - plain, axis=1)
    assert 0.002 < moved.max() < 0.05  # metres
    assert contents(folder) == {"plain.ply", "smile.ply"}


def rig_face(capsys, *arguments) -> str:
    assert cli.main(["rig", *map(str, arguments)]) == 0
    return capsys.readouterr().out


def test_the_catalogue_as_json(capsys):
    table = json.loads(rig_face(capsys, "--list", "--json"))
    assert table["counts"] == {"upper": 12, "mid": 11, "lower": 24}
    assert [control["name"] for control in table["controls"]] == list(CONTROL_NAMES)
    for control in table["controls"]:
        assert control["region"] in table["counts"]
        assert control["side"] in ("both", "left", "right")
        assert control["aus"] and control["label"] and control["muscle"] and control["signature"]
        assert all(part["shape"] and part["weight"] for part in control["mix"])
        assert isinstance(control["creases"], list)
    assert json.loads(rig_face(capsys, "--json")) == table
    for parameter in table["identity"]:
        assert parameter["minimum"] <= parameter["default"] <= parameter["maximum"]
    assert rig_face(capsys, "--list") == rig_face(capsys)
    assert "47 controls (12 upper, 11 mid, 24 lower)" in rig_face(capsys)


def test_rig_poses_everything_that_a_face_can_do(capsys, folder):
    import trimesh

    Path("joy.json").write_text(
        expressions.dumps(FaceParameters({"smile": 3.0, "squint": 2.0}, gaze=(0.1, 0.0)))
    )
    more = ["--expression", "joy.json", "--au", "smile=5", "--identity", "age=1"]
    turns = ["--head", "-20,5,0", "--neck", "5,-1,2", "--gaze", "-10,5"]
    rig_face(capsys, "-o", "face.ply", *more, *turns)
    wanted = FaceParameters(
        {"smile": 5.0, "squint": 2.0}, {"age": 1.0},
        *(tuple(np.radians(a)) for a in ((-20, 5, 0), (5, -1, 2), (-10, 5))),
    )  # fmt: skip
    vertices = trimesh.load("face.ply", process=False).vertices
    np.testing.assert_allclose(vertices, load_rig().pose(wanted), atol=1e-6)


def test_rig_writes_a_folder_of_keys_beside_an_obj(capsys, folder):
    rig_face(capsys, "-o", "face.obj", "--keys", "--names", "arkit")
    assert contents(folder) == {"face.obj", "face_keys"}
    assert contents(folder / "face_keys") == {f"{n}.obj" for n in (*ARKIT_NAMES, "neutral")}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--au", "smirk=5"], "there is no control 'smirk'"),
        (["--au", "smlie=5"], "there is no control 'smlie'; did you mean 'smile'?"),
        (["--au", "smile=50"], "smile = 50.0 is outside 0 to 10"),
        (["--au", "smile=nan"], "'smile' is nan"),
        (["--au", "smile"], "--au takes NAME=VALUE, such as smile=5, not 'smile'"),
        (["--au", "smile=much"], "--au takes NAME=VALUE"),
        (["--identity", "aeg=1"], "there is no identity parameter 'aeg'; did you mean 'age'?"),
        (["--identity", "age=2"], "age = 2.0 is outside 0 to 1"),
        (["--identity", "age=nan"], "'age' is nan"),
        (["--identity", "age"], "--identity takes NAME=VALUE, such as age=0.8"),
        (["--gaze", "5"], "--gaze takes YAW,PITCH in degrees, not '5'"),
        (["--gaze", "-70,0"], "gaze yaw = -70 is outside -60 to 60"),
        (["--head", "-5,0"], "--head takes YAW,PITCH,ROLL in degrees, not '-5,0'"),
        (["--head", "nan,0,0"], "'head yaw' is nan"),
        (["--neck", "a,b,c"], "--neck takes YAW,PITCH,ROLL"),
        (["--expression", "nobody.json"], "'nobody.json' cannot be read"),
        (["--names", "vrm"], "invalid choice: 'vrm'"),
        (["--names", "arkit"], "a file such as 'face.ply' cannot hold shape keys"),
        (["--keys"], "--keys is for .obj alone"),
        (["--sheet", "sheet.png"], "--sheet and -o are two jobs"),
        (["--json"], "--list and --json print the list"),
        (["--only", "smile"], "--only belongs to --sheet OUT.png; add that"),
    ],
)
def test_rig_refuses_what_no_face_can_do(capsys, folder, arguments, says):
    assert says in refused(capsys, "rig", "-o", "face.ply", *arguments)
    assert not contents(folder)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("not json", "'joy.json': this is not an expression file: it is not JSON"),
        (
            json.dumps({"format": expressions.FORMAT, "version": 2}),
            "'joy.json': this expression was saved by a newer Sketch to Face (format 2, this one "
            "knows 1); update the add-on",
        ),
        (
            json.dumps({"format": expressions.FORMAT, "version": 1, "aus": {"smlie": 1}}),
            "'joy.json': there is no control 'smlie'; did you mean 'smile'?",
        ),
    ],
)
def test_rig_refuses_a_bad_expression_file(capsys, folder, content, says):
    Path("joy.json").write_text(content)
    assert says in refused(capsys, "rig", "-o", "face.ply", "--expression", "joy.json")
    assert contents(folder) == {"joy.json"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--au", "smile=5"], "--au belongs to -o FACE; add that."),
        (["--gaze", "1,1"], "--gaze belongs to -o FACE"),
        (["--identity", "age=1"], "--identity belongs to --sheet OUT.png or -o FACE"),
        (["--drawn"], "--drawn belongs to --sheet OUT.png"),
        (["-o", "face.stl"], "'face.stl' has no known ending"),
        (["-o", "nowhere/face.glb"], "There is no folder 'nowhere'"),
        (["-o", "joy.json", "--expression", "joy.json"], "'joy.json' has no known ending"),
        (["--sheet", "sheet.jpg"], "'sheet.jpg' has no known ending; use .png."),
        (["--sheet", "nowhere/sheet.png"], "There is no folder 'nowhere'"),
        (["--sheet", "s.png", "--only", "smlie"], "'smlie'; did you mean 'smile'?"),
        (["--sheet", "s.png", "--size", "5"], "the size of a face is 48 to 1024 pixels, not 5"),
        (["--sheet", "s.png", "--size", "0"], "the size of a face is 48 to 1024 pixels, not 0"),
        (["--sheet", "s.png", "--size", "big"], "--size: invalid int value: 'big'"),
        (["--sheet", "s.png", "--identity", "aeg=1"], "did you mean 'age'?"),
        (["--sheet", "s.png", "--view", "back"], "invalid choice: 'back'"),
        (["--sheet", "s.png", "--drawn", "--layers", "beard"], "beard"),
    ],
)
def test_rig_says_which_option_belongs_where(capsys, folder, arguments, says):
    assert says in refused(capsys, "rig", *arguments)
    assert not contents(folder)


@pytest.mark.parametrize("job", [["-o", "face.glb"], ["--sheet", "sheet.png"]])
@pytest.mark.parametrize("harm", ["cut", "text", "missing array", "missing"])
def test_a_damaged_asset_costs_one_sentence(capsys, folder, monkeypatch, harm, job):
    from facs_rig import rig

    asset = folder / "head.npz"
    whole = rig.ASSET.read_bytes()
    if harm == "cut":
        asset.write_bytes(whole[: len(whole) // 2])
    elif harm == "text":
        asset.write_text("Not found")
    elif harm == "missing array":
        np.savez(asset, base=np.zeros((3, 3), np.float32))
    monkeypatch.setattr("facs_rig.load_rig", lambda: rig.load_rig.__wrapped__(asset))
    before = contents(folder)
    said = refused(capsys, "rig", *job)
    assert "the rig's data file" in said and "head.npz" in said
    assert "is damaged; install again or `make bake`" in said
    assert contents(folder) == before


def sheet_of(folder: Path) -> np.ndarray:
    with Image.open(folder / "sheet.png") as picture:
        return np.asarray(picture.convert("RGB")).astype(int)


def test_a_contact_sheet_is_drawn(capsys, folder):
    small = ["--sheet", "sheet.png", "--size", "64", "--only", "smile", "frontalis"]
    assert "sheet.png" in rig_face(capsys, *small)
    both = sheet_of(folder)
    assert contents(folder) == {"sheet.png"}
    rig_face(capsys, *small, "--drawn")
    drawn = sheet_of(folder)
    assert drawn.shape[0] < both.shape[0] - 100  # a row for each control is missing
    spread = np.ptp(drawn, axis=2)
    assert spread.max() < 3 and np.ptp(both, axis=2).max() > 30  # black ink against skin
    rig_face(capsys, *small, "--drawn", "--view", "three-quarter")
    assert (sheet_of(folder) != drawn).any()
    rig_face(capsys, *small, "--drawn", "--identity", "age=1")
    assert (sheet_of(folder) != drawn).any()


def test_a_sheet_has_every_control_at_rest_half_and_full():
    from addon import sheet

    seen = []
    rig = load_rig()
    page = sheet.contact_sheet(rig, kinds=("drawn",), size=48, progress=lambda *at: seen.append(at))
    assert seen[-1] == (1 + 2 * 47,) * 2
    assert page.dtype == np.uint8 and page.shape[2] == 3
    with pytest.raises(ValueError, match="there is no view 'back'"):
        sheet.contact_sheet(rig, view="back")
    with pytest.raises(ValueError, match="at least one control"):
        sheet.contact_sheet(rig, ())
    with pytest.raises(ValueError, match="can be shaded or drawn, not 'x-rayed'"):
        sheet.contact_sheet(rig, kinds=("x-rayed",))


def test_captions_fit_their_line():
    from addon import sheet

    long = [("Brow raise", "#000000"), ("   worry lines across the whole forehead", "#707070")]
    line = sheet.text_line(90, long, 13)
    assert line.shape[1] == 90
    assert (line[:, -2:] == sheet.PAPER).all()  # cut with an ellipsis, not at the edge
    assert (sheet.text_line(400, long, 13) != sheet.PAPER).any()


def test_fit_writes_face_report_and_preview(capsys, folder):
    outputs = ["-o", "face.glb", "--report", "report.json", "--preview", "preview.png"]
    assert cli.main(["fit", str(SKETCH), *outputs]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "face.glb, report.json, preview.png" in said.out
    assert contents(folder) == {"face.glb", "report.json", "preview.png"}
    assert Path("face.glb").read_bytes()[:4] == b"glTF"

    report = json.loads(Path("report.json").read_text())
    assert set(report["aus"]) >= set(DETECTED)
    assert set(report["head"]) == {"yaw", "pitch", "roll"}
    projection = np.array(report["projection"])
    assert projection.shape == (3, 4)
    np.testing.assert_allclose(projection[2], [0, 0, 0, 1])
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
        "seed": 0, "engine": "contours", "scheme": "sparse", "jobs": 1,
        "resume": True, "strokes": True, "meshes": True, "dask": "tcp://host:8786",
    }  # fmt: skip


def test_a_bar_is_drawn_on_a_terminal_only(capsys, monkeypatch):
    with Bar("work") as bar:
        bar(1, 2)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with Bar("work") as bar:
        bar(1, 2)
    assert "work [################................] 1/2" in capsys.readouterr().err


# --- files whole or not at all -------------------------------------------------------------------


def test_outputs_appear_together(tmp_path):
    with Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("1")
        outputs.beside(tmp_path / "two.txt").write_text("2")
        assert not (tmp_path / "one.txt").exists()
    assert contents(tmp_path) == {"one.txt", "two.txt"}


def test_outputs_fall_together(tmp_path):
    (tmp_path / "one.txt").write_text("old")
    with pytest.raises(RuntimeError), Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("new")
        outputs.beside(tmp_path / "two.txt").write_text("2")
        raise RuntimeError("in the middle of the work")
    assert contents(tmp_path) == {"one.txt"}
    assert (tmp_path / "one.txt").read_text() == "old"


def test_outputs_keep_the_ending_and_are_readable_by_others(tmp_path):
    with Outputs() as outputs:
        part = outputs.beside(tmp_path / "face.glb")
        assert part.suffix == ".glb" and part.parent == tmp_path
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "face.glb").stat().st_mode & 0o777 == 0o666 & ~umask


def test_write_text(tmp_path):
    write_text(tmp_path / "note.txt", "ä\n")
    assert (tmp_path / "note.txt").read_bytes() == "ä\n".encode()


def test_checking_an_output_changes_nothing(tmp_path):
    check_output(tmp_path / "new.glb", (".glb",))
    assert not contents(tmp_path)
    with pytest.raises(OutputError, match="is a folder"):
        check_output(tmp_path)
