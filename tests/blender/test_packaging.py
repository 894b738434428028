"""The zips that `make addon` builds: what is in them, that they are the same again, that each
installs in a Blender that sees nothing else, and that everything works there."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import sys
import tomllib
import zipfile
from base64 import urlsafe_b64encode
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from packaging.requirements import Requirement
from scipy.spatial import cKDTree

from addon.packaging import extension, needs, wheels
from addon.packaging.archive import read_zip, write_zip
from addon.packaging.wheel import BUILD, core_wheel, lean
from facs_rig import ARKIT_NAMES, CONTROL_NAMES, load_rig
from facs_rig.identity import IDENTITY_KEYS
from tests.nightly import at_night, sample
from tests.written import face_of

from .conftest import ROOT, SKETCH
from .newer_blender import Missing, python_3_13
from .zips import BLENDERS, Blender, older_zip, top_level

PLATFORM = "linux-x64"
CACHE = ROOT / "build" / "wheels"
PRESS = Path(__file__).with_name("press_everything.py")
STRANGERS = Path(__file__).with_name("strangers.py")
PREVIOUS, LATEST, LEGACY = wheels.SERIES
# The oldest and the newest numpy that comes with a Blender of this Python.
BLENDERS_NUMPY = {"3.11": ("1.24.3", "1.26.4"), "3.13": ("2.2.0", "2.4.0")}
LARGEST = 90e6  # bytes

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or sys.version_info[:2] != (3, 11),
    reason="the zips are tested with Blender 5.0 as a module of Python 3.11, on Linux",
)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Function: the zip for these Blenders on this platform; built when it is first asked for."""
    folder = tmp_path_factory.mktemp("dist")

    @cache
    def make(series: wheels.Series, platform: str = PLATFORM) -> Path:
        return extension.build(folder, CACHE, platform, series)

    return make


def locked(platform: str = PLATFORM) -> dict[str, str]:
    return dict(pin.split("==") for pin in wheels.locked(wheels.PLATFORMS[platform].lock))


# --- what is in them ------------------------------------------------------------------------------


@pytest.mark.parametrize("python", [wheels.OLD, wheels.NEW])
def test_the_lock_names_exactly_what_the_shipped_code_can_import(python):
    locked_wheels = wheels.third_party(PLATFORM, python, CACHE)
    assert needs.needed(ROOT, locked_wheels) == (locked_wheels, {})


def test_lock_follows_the_constraints_except_for_scipy():
    pins = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        name, equals, version = line.split("#")[0].strip().partition("==")
        if equals:
            pins[name.lower().replace("-", "_")] = version
    others = {n: v for n, v in locked().items() if n != "scipy"}
    assert others == {n: pins[n] for n in others}
    # scipy 1.16 needs a newer numpy than Blender 4.1 to 4.3 bring
    assert tuple(map(int, locked()["scipy"].split(".")[:2])) < (1, 16)


def test_intel_macs_differ_in_onnxruntime_alone():
    here, there = locked(), locked("macos-x64")
    assert {n for n in here.keys() | there.keys() if here.get(n) != there.get(n)} == {"onnxruntime"}


class Inside(NamedTuple):
    """A zip, opened: names without the folder that all lies in, and the wheels' own files."""

    names: set[str]
    manifest: dict
    wheels: dict[str, dict[str, bytes]]


def look_into(archive: Path) -> Inside:
    content = {n.partition("/")[2]: data for n, data in read_zip(archive).items()}
    manifest = tomllib.loads(content.get("blender_manifest.toml", b"").decode())
    inside = {Path(n).name: read_bytes(content[n]) for n in content if n.startswith("wheels/")}
    with zipfile.ZipFile(archive) as opened:
        assert {n.split("/")[0] for n in opened.namelist()} == {extension.NAME}
        assert f"{extension.NAME}/" in opened.namelist()  # or an older version stays in between
    return Inside(set(content), manifest, inside)


def read_bytes(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as opened:
        return {i.filename: opened.read(i) for i in opened.infolist() if not i.is_dir()}


def check_content(archive: Path, platform: str, series: wheels.Series) -> None:
    """Small; the shell; a manifest that names every wheel; of each package one wheel, for here."""
    assert archive.stat().st_size < LARGEST
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert archive.name == f"sketch_to_face-{version}-{platform}-blender-{series.name}.zip"
    inside = look_into(archive)
    folder = ROOT / "addon" / "blender"
    shell = {p.relative_to(folder).as_posix() for p in folder.rglob("*.py")}
    assert shell | {"LICENSE", "made_for.json", "manual/index.html"} <= inside.names
    assert not [n for n in inside.names if "numpy" in n.lower().split("/")[0]]
    if series.legacy:
        return
    told = inside.manifest
    assert told["version"] == version and told["platforms"] == [platform]
    assert told["blender_version_min"] == series.first
    assert told.get("blender_version_max") == series.beyond
    assert sorted(told["wheels"]) == sorted(f"./wheels/{n}" for n in inside.wheels)
    packages = sorted(name.split("-")[0] for name in inside.wheels)
    assert packages == sorted([*locked(platform), "sketch_to_face"])
    for name, files in inside.wheels.items():
        check_wheel(name, files, platform, series.python)


def check_wheel(name: str, files: dict[str, bytes], platform: str, python: str) -> None:
    """It is for this platform, Python and numpy; its RECORD is true; its licence is in it."""
    system, machine = {"linux-x64": ("manylinux", "x86_64"), "windows-x64": ("win", "amd64"),
                       "macos-arm64": ("macosx", "arm64"),
                       "macos-x64": ("macosx", "x86_64")}[platform]  # fmt: skip
    *_, interpreter, _, where = name.removesuffix(".whl").split("-")
    # of the last part, since a wheel may carry several: manylinux_2_17_x86_64.manylinux2014_x86_64
    assert where == "any" or where.startswith(system) and where.endswith(machine), name
    assert interpreter in ("py3", "cp" + python.replace(".", "")), name
    (meta,) = [n for n in files if re.fullmatch(r"[^/]+\.dist-info/METADATA", n)]
    asks = re.findall(r"^Requires-Dist: (numpy\b[^;\n]*)$", files[meta].decode(), re.M)
    for version in BLENDERS_NUMPY[python]:
        assert all(version in Requirement(r.strip()).specifier for r in asks), (name, asks)
    assert [n for n in files if re.search("licen[sc]e", n, re.I) and files[n]], name
    rows = {row[0]: row[1:] for row in csv.reader(files[meta.replace("METADATA", "RECORD")]
            .decode().splitlines())}  # fmt: skip
    assert rows.keys() == files.keys(), name
    for file, (digest, size) in rows.items():
        if digest:
            said = urlsafe_b64encode(sha256(files[file]).digest()).rstrip(b"=").decode()
            assert (digest, int(size)) == (f"sha256={said}", len(files[file])), (name, file)


@pytest.mark.parametrize("series", wheels.SERIES, ids=lambda s: s.name)
def test_each_zip_is_small_and_holds_what_it_should(built, series):
    check_content(built(series), PLATFORM, series)
    if not series.legacy:
        assert "success" in extension.validate(built(series)).lower()


@pytest.mark.slow
@pytest.mark.parametrize("platform", [
    at_night(other) if other == "macos-arm64" else other  # its lock and Pythons are as elsewhere
    for other in sorted(set(wheels.PLATFORMS) - {PLATFORM})
])  # fmt: skip
def test_zips_of_another_platform(platform, tmp_path):
    for series in wheels.PLATFORMS[platform].series:
        if not series.legacy:  # the same wheels, unpacked
            made = extension.build(tmp_path, CACHE, platform, series)
            assert "success" in extension.validate(made).lower()
            check_content(made, platform, series)


def test_two_builds_give_the_same_bytes(built, tmp_path):
    again = extension.build(tmp_path / "dist", CACHE, PLATFORM, PREVIOUS)
    assert again.read_bytes() == built(PREVIOUS).read_bytes()


def test_a_lean_wheel_lacks_tests_and_sample_pictures_and_nothing_else(tmp_path):
    for wheel in wheels.third_party(PLATFORM, wheels.OLD, CACHE):
        made, package = lean(wheel, tmp_path), wheel.name.split("-")[0]
        if package not in ("scipy", "scikit_image"):
            assert made == wheel
            continue
        before, after = read_zip(wheel), read_zip(made)
        gone = before.keys() - after.keys()
        assert gone and not [n for n in gone if "/tests/" not in n and "/data/" not in n]
        assert not [n for n in after if "/tests/" in n]
        (info,) = {n.split("/")[0] for n in after if ".dist-info/" in n}
        changed = {n for n in after if after[n] != before.get(n)}
        assert changed == {f"{info}/RECORD", f"{info}/WHEEL"}
        assert f"\nBuild: {BUILD}\n" in after[f"{info}/WHEEL"].decode()
        assert made.stat().st_size < 0.9 * wheel.stat().st_size
        assert f"-{BUILD}-cp311-" in made.name


def test_the_sample_drawings_travel_in_the_core(tmp_path):
    names = zipfile.ZipFile(core_wheel(ROOT, "1.0", tmp_path)).namelist()
    for path in (ROOT / "addon" / "sketches").glob("*.png"):
        assert f"addon/sketches/{path.name}" in {re.sub("^[^/]*/(?=addon/)", "", n) for n in names}


def test_another_content_gives_the_core_another_version(tmp_path):
    """Blender does not unpack a wheel again whose name and version it has already."""
    for name in (*needs.PACKAGES, "LICENSE"):
        where = ROOT / name
        (shutil.copytree if where.is_dir() else shutil.copy)(where, tmp_path / name)
    one = core_wheel(tmp_path, "1.0", tmp_path / "out")
    assert core_wheel(tmp_path, "1.0", tmp_path / "out") == one
    with (tmp_path / "facs_rig" / "__init__.py").open("a") as file:
        file.write("# changed\n")
    needs.own_modules.cache_clear()
    assert core_wheel(tmp_path, "1.0", tmp_path / "out") != one


def test_blender_s_own_tool_refuses_a_wrong_manifest(built, tmp_path):
    broken = tmp_path / "broken.zip"
    with zipfile.ZipFile(built(PREVIOUS)) as source, zipfile.ZipFile(broken, "w") as target:
        text = source.read("sketch_to_face/blender_manifest.toml").decode()
        target.writestr("blender_manifest.toml", text.replace('type = "add-on"', 'type = "toy"'))
        target.writestr("__init__.py", source.read("sketch_to_face/__init__.py"))
    with pytest.raises(wheels.BuildError, match="does not accept broken.zip"):
        extension.validate(broken)


def test_unknown_platform_is_one_sentence(tmp_path):
    with pytest.raises(wheels.BuildError, match="No wheels are known for amiga; known: linux-x64"):
        wheels.third_party("amiga", wheels.OLD, tmp_path)


def test_a_damaged_cached_wheel_is_refused(tmp_path):
    """pip would take any file of the right name; the hash says that it is not the one."""
    for wheel in wheels.third_party(PLATFORM, wheels.OLD, CACHE):
        shutil.copy(wheel, tmp_path)
    (broken,) = tmp_path.glob("lazy_loader-*")
    broken.write_bytes(broken.read_bytes() + b" ")
    lock = wheels.PLATFORMS[PLATFORM].lock
    what = ["--require-hashes", "--requirement", str(lock), "--no-index", "--find-links",
            str(tmp_path)]  # fmt: skip
    with pytest.raises(wheels.BuildError, match="could not be fetched(.|\n)*lazy.loader"):
        wheels.fetch(what, wheels.PLATFORMS[PLATFORM].tags, wheels.OLD, tmp_path)


# --- installed, where there is nothing else -------------------------------------------------------


@pytest.fixture(scope="module")
def whole(built, tmp_path_factory):
    """Function: all of press_everything.py, in the Blender of this version; what it told."""

    @cache
    def run(version: str, series: wheels.Series) -> tuple[Blender, dict]:
        blender = started(version, tmp_path_factory.mktemp("home") / version)
        archive = built(series)
        older = older_zip(archive, blender.home)
        done = blender.run(PRESS, blender.kind, archive, older, SKETCH, blender.home)
        assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
        return blender, json.loads((blender.home / "result.json").read_text())

    return run


def started(version: str, home: Path) -> Blender:
    """That Blender with an empty profile; skips, with the reason, where there is none."""
    try:
        return BLENDERS[version](home)
    except Missing as why:
        pytest.skip(str(why))


# Everything is pressed in the newest: nothing else here knows its Python and its wheels. The shell
# is the same in each zip, and in Blender 5.0 all other tests of it press its buttons.
INSTALLED = pytest.mark.parametrize(
    ("version", "series"), [at_night("5.0", PREVIOUS), ("5.2", LATEST), at_night("3.4", LEGACY)],
    ids=["5.0", "5.2", "3.4"],
)  # fmt: skip


@pytest.mark.slow
@INSTALLED
def test_every_button_works_with_blender_and_the_zip_alone(whole, version, series):
    """Installed over another build, in a folder with spaces and letters of all kinds."""
    blender, told = whole(version, series)
    print(json.dumps(told["seconds"], indent=1))
    assert told["blender"].startswith(version)
    # a new button stands here until press_everything.py presses it, or says why it does not
    assert (told["not pressed"], told["unknown"]) == ([], [])
    keys = ["Basis", *(key.name for key in load_rig().keys)]
    # What goes with the drawn actions, squint and smile, is beside what stays at rest.
    assert told["keys"] == [*keys, "Fitted", "Fitted_upper", "Fitted_lower"]
    assert told["added"] == [*keys, *IDENTITY_KEYS, *ARKIT_NAMES]
    opened = (blender.home / "opened.txt").read_text().splitlines()
    pages = len(list((ROOT / "docs" / "manual").glob("*.md")))
    assert len(opened) == len(set(opened)) == pages + 1 and told["log"] in opened


@pytest.mark.slow
@pytest.mark.parametrize(("version", "series"), [("5.0", PREVIOUS), ("3.4", LEGACY)],
                         ids=["5.0", "3.4"])  # fmt: skip
def test_the_other_zips_fit_and_export_with_blender_and_the_zip_alone(
    built, tmp_path, version, series
):
    """Every format is written, every module imported, every wheel used."""
    blender = started(version, tmp_path / "home")
    done = blender.run(PRESS, blender.kind, built(series), "smoke", SKETCH, blender.home)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
    told = json.loads((blender.home / "result.json").read_text())
    assert told["blender"].startswith(version)
    check_exports(blender, told)
    check_imports(blender, told, series)


@pytest.mark.slow
@INSTALLED
def test_every_wheel_is_used_and_numpy_alone_comes_from_blender(whole, version, series):
    check_imports(*whole(version, series), series)


def check_imports(blender: Blender, told: dict, series: wheels.Series) -> None:
    imported = {n for n in needs.reached(ROOT).modules if not n.startswith("addon.blender")}
    assert set(told["modules"]) == imported
    for wheel in wheels.third_party(PLATFORM, series.python, CACHE):
        used = [top for top in top_level(wheel) if top in told["files"]]
        assert used, f"{wheel.name} is shipped and never imported"
        for top in used:
            assert Path(told["files"][top]).is_relative_to(blender.profile), top
    for top in needs.PACKAGES:
        assert Path(told["files"][top]).is_relative_to(blender.profile), top
    assert not Path(told["files"]["numpy"]).is_relative_to(blender.profile)


@pytest.mark.slow
@INSTALLED
def test_every_exported_file_holds_the_face_as_it_is_shown(whole, version, series):
    check_exports(*whole(version, series))


def check_exports(blender: Blender, told: dict) -> None:
    shown, files = np.load(blender.home / "shown.npy"), sorted((blender.home / "exports").iterdir())
    assert len(files) == told["exports"] > 6
    read = {path.suffix for path in files if check_export(path, shown)}
    assert read == {path.suffix for path in files} - {".blend", ".fbx"}
    own = {"ours": CONTROL_NAMES, "arkit": ARKIT_NAMES}
    for name, keys in told["read by Blender"].items():
        names = own["arkit" if "arkit" in name else "ours"]
        assert keys == (["Basis", *names, "neutral"] if name.endswith(".fbx") else told["keys"])
    assert told["read by Blender"].keys() == {p.name for p in files if p.suffix not in read}


def check_export(path: Path, shown: np.ndarray) -> bool:
    """Whether trimesh reads this format; if so its vertices are those that are shown, in metres."""
    if path.suffix in (".blend", ".fbx"):  # Blender has read it, in press_everything.py
        return False
    mesh = face_of(path)
    assert len(mesh.faces) == len(load_rig().triangles)
    for some, others in ((shown, mesh.vertices), (mesh.vertices, shown)):
        away, _ = cKDTree(others).query(some)
        assert away.max() < 1e-4, (path.name, away.max())  # metres
    if path.suffix == ".glb":
        head = path.read_bytes()
        tree = json.loads(head[20 : 20 + int.from_bytes(head[12:16], "little")])
        names = ARKIT_NAMES if "arkit" in path.name else CONTROL_NAMES
        assert tree["meshes"][0]["extras"]["targetNames"] == [*names, "neutral"]
    return True


@pytest.mark.slow
@INSTALLED
def test_nothing_is_left_once_it_is_switched_off_or_removed(whole, version, series):
    blender, told = whole(version, series)
    assert told["hung"] == told["still hung"] == {}
    left = {p.relative_to(blender.profile).as_posix() for p in blender.profile.rglob("*")
            if p.is_file() and "__pycache__" not in p.parts}  # fmt: skip
    # Blender's own index of extensions; before 4.2 nobody but the artist removes the log
    assert left <= {"extensions/.cache/compat.dat", "config/sketch_to_face/sketch_to_face.log"}


@pytest.mark.slow
@pytest.mark.parametrize("package", [*sample(sorted(n.split("==")[0] for n in wheels.locked(
    wheels.PLATFORMS[PLATFORM].lock)), 3), "sketch_to_face"])  # fmt: skip
def test_without_any_one_wheel_the_zip_fails(built, tmp_path, package):
    lame = without(built(PREVIOUS), package, tmp_path / "lame.zip")
    blender = started("5.0", tmp_path / "home")
    done = blender.run(PRESS, blender.kind, lame, "only", SKETCH, tmp_path)
    assert done.returncode == 1
    assert re.search("No module named|cannot find its own core", done.stdout + done.stderr)


def without(archive: Path, package: str, path: Path) -> Path:
    """The zip without a package's wheel."""
    content = read_zip(archive)
    (gone,) = (name for name in content if f"/wheels/{package}-" in name)
    del content[gone]
    manifest = f"{extension.NAME}/blender_manifest.toml"
    lines = content[manifest].decode().splitlines()
    content[manifest] = "\n".join(n for n in lines if Path(gone).name not in n).encode()
    return write_zip(path, content)


# --- packages of the same names ---------------------------------------------------------------


@pytest.mark.slow
@INSTALLED
@pytest.mark.parametrize(("case", "says"), [
    ("found", "Info: smiling_woman"),
    ("loaded", r"cannot start: '.*others.snakes.__init__\.py' is loaded as 'snakes'"),
    ("unpacked", r"cannot start: .*snakes.__init__\.py is missing or not its own"),
])  # fmt: skip
def test_no_other_addon_or_snakes_is_taken_for_ours(built, tmp_path, version, series, case, says):
    if case == "unpacked" and series.legacy:
        return  # there the core lies in the add-on's own folder
    blender = started(version, tmp_path / "home")
    done = blender.run(STRANGERS, blender.kind, built(series), case, SKETCH, tmp_path)
    said = done.stdout + done.stderr
    assert done.returncode == 0 and re.search(says, said), said[-5000:]


# --- the wrong zip --------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("version", "series", "says"), [
    ("5.2", PREVIOUS, r"Blender version \(5\.2\.\d+\) must be less than .* \(5\.1\.0\)"),
    ("5.0", LATEST, r"Blender version \(5\.0\.\d+\) doesn't meet the minimum .* \(5\.1\.0\)"),
    ("3.4", PREVIOUS, r"is for Blender 4\.2 to 5\.0 on linux-x64, .*for this one, Blender 3\.\d.*"
                      r"install sketch_to_face-[\d.]+-linux-x64-blender-3\.4-to-4\.1-legacy\.zip"),
])  # fmt: skip
def test_the_zip_for_another_blender_is_refused(built, tmp_path, version, series, says):
    blender = started(version, tmp_path / "home")
    done = blender.run(PRESS, blender.kind, built(series), "only", SKETCH, tmp_path)
    assert done.returncode == 1
    assert re.search(says, done.stdout + done.stderr), done.stdout + done.stderr


def test_the_right_zip_is_named_for_every_blender(tmp_path):
    from addon.blender.right_zip import complaint

    def says(ours: wheels.Series, platform: str, blender, python, here: str) -> str:
        path = tmp_path / "made_for.json"
        path.write_bytes(extension.made_for(platform, ours))
        return complaint(blender, python, here, path)

    def numbers(version: str) -> tuple[int, ...]:
        return tuple(map(int, version.split(".")))

    for platform, there in wheels.PLATFORMS.items():
        for right in there.series:
            blender, python = numbers(right.first), numbers(right.python)
            for ours in there.series:
                told = says(ours, platform, blender, python, platform)
                # a legacy zip works in newer Blenders, too, as long as they have its Python
                if ours.python == right.python and numbers(ours.first) <= blender:
                    assert told == ""
                else:
                    assert told.endswith(f"install {extension.zip_name(platform, right)}.")
            for other in wheels.PLATFORMS.keys() - {platform}:
                if right in wheels.PLATFORMS[other].series:
                    told = says(right, other, blender, python, platform)
                    assert f"is for Blender {right.label} on {other}, " in told
                    assert told.endswith(f"install {extension.zip_name(platform, right)}.")
    told = says(LEGACY, "linux-x64", (3, 6, 0), (3, 10, 9), "linux-x64")
    assert "Blender 3.6 on linux-x64 with Python 3.10" in told
    assert told.endswith("there is none: install Blender 4.2 or newer from blender.org.")
    assert complaint((3, 0, 0), (3, 9), "amiga", tmp_path / "checkout") == ""


def test_without_python_3_13_one_sentence_says_how_to_name_it(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    for named in ("/no/such/python", sys.executable):
        monkeypatch.setenv("PYTHON313", named)
        with pytest.raises(Missing, match="no Python 3.13; say which one: PYTHON313="):
            python_3_13()
