"""``sketch2face rig``: the list, the contact sheet, posed faces, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from addon import cli
from facs_rig import ARKIT_NAMES, CONTROL_NAMES, FaceParameters, expressions, load_rig


def contents(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


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


def test_a_stylised_person_is_listed_and_written(capsys, tmp_path):
    import trimesh

    text = rig_face(capsys, "--list")
    assert "(stylised: -1.6 to 3)" in text and "comic manga chibi" in text
    table = json.loads(rig_face(capsys, "--list", "--json"))
    people = {person["name"]: person["identity"] for person in table["people"]}
    changed = {**people["chibi"], "eye_size": 1.0}
    face = tmp_path / "face.ply"
    rig_face(capsys, "-o", face, "--person", "chibi", "--identity", "eye_size=1")
    written = trimesh.load(face, process=False).vertices
    np.testing.assert_allclose(written, load_rig().neutral(changed), atol=1e-5)


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
        (["--identity", "age=2"], "age = 2.0 is outside -1 to 1"),
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
def test_rig_refuses_what_no_face_can_do(refused, folder, arguments, says):
    assert says in refused("rig", "-o", "face.ply", *arguments)
    assert not contents(folder)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("not json", "'joy.json': this is not an expression file: it is not JSON"),
        (
            json.dumps({"format": expressions.FORMAT, "version": 3}),
            "'joy.json': this expression was saved by a newer Sketch to Face (format 3, this one "
            "knows 2); update the add-on",
        ),
        (
            json.dumps({"format": expressions.FORMAT, "version": 1, "aus": {"smlie": 1}}),
            "'joy.json': there is no control 'smlie'; did you mean 'smile'?",
        ),
    ],
)
def test_rig_refuses_a_bad_expression_file(refused, folder, content, says):
    Path("joy.json").write_text(content)
    assert says in refused("rig", "-o", "face.ply", "--expression", "joy.json")
    assert contents(folder) == {"joy.json"}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--au", "smile=5"], "--au belongs to -o FACE; add that."),
        (["--gaze", "1,1"], "--gaze belongs to -o FACE"),
        (["--identity", "age=1"], "--identity belongs to --sheet OUT.png or -o FACE"),
        (["--person", "manga"], "--person belongs to --sheet OUT.png or -o FACE"),
        (["--sheet", "s.png", "--person", "mangaa"], "did you mean 'manga'?"),
        (["-o", "face.ply", "--person", "elf", "--identity", "eye_size=3.5"], "-1.6 to 3"),
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
def test_rig_says_which_option_belongs_where(refused, folder, arguments, says):
    assert says in refused("rig", *arguments)
    assert not contents(folder)


@pytest.mark.parametrize("job", [["-o", "face.glb"], ["--sheet", "sheet.png"]])
@pytest.mark.parametrize("harm", ["cut", "text", "missing array", "missing"])
def test_a_damaged_asset_costs_one_sentence(refused, folder, monkeypatch, harm, job):
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
    said = refused("rig", *job)
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


def test_a_face_of_fewer_polygons(folder):
    from facs_rig.levels import at_level
    from tests.written import points_of

    assert cli.main(["rig", "-o", "game.ply", "--au", "smile=5", "--detail", "game"]) == 0
    few = at_level(load_rig(), "game")
    there = few.pose(FaceParameters({"smile": 5.0}))
    np.testing.assert_allclose(points_of(Path("game.ply")), there, atol=1e-6)


@pytest.mark.parametrize("job", [["rig", "-o", "face.ply"], ["fit", "face.png"]])
def test_a_level_that_there_is_not_is_named(capsys, folder, job):
    Image.new("L", (64, 64), 255).save("face.png")
    before = contents(folder)
    assert cli.main([*job, "--detail", "tiny"]) == 2
    assert "'tiny'" in (told := capsys.readouterr().err) and "game" in told
    assert len(told.splitlines()) == 1 and contents(folder) == before


def test_detail_belongs_to_a_written_face(capsys):
    assert cli.main(["rig", "--detail", "game"]) == 2
    assert "-o FACE" in capsys.readouterr().err
