"""The zip that `make addon` builds: what is in it, that it is the same again, that it installs."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from addon.packaging import extension, wheels
from facs_rig import ARKIT_NAMES, load_rig
from facs_rig.identity import IDENTITY_KEYS

from .conftest import ROOT, SKETCH
from .newer_blender import NEEDS, Missing, blender_5_2, python_3_13

PLATFORM = "linux-x64"
CACHE = ROOT / "build" / "wheels"
INSTALL = Path(__file__).with_name("install_and_press.py")
# What the bpy wheel needs to start; everything else has to come out of the zip.
BLENDER_ITSELF = ("bpy", "numpy", "numpy.libs", "requests", "urllib3", "idna", "certifi",
                  "charset_normalizer", "zstandard")  # fmt: skip
# The oldest and the newest numpy that comes with a Blender of this Python.
BLENDERS_NUMPY = {"3.11": ("1.24.3", "1.26.4"), "3.13": ("2.2.0", "2.4.0")}

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or sys.version_info[:2] != (3, 11),
    reason="the zips are tested with Blender 5.0 as a module of Python 3.11, on Linux",
)


@pytest.fixture(scope="module")
def core(tmp_path_factory) -> Path:
    return wheels.core_wheel(ROOT, tmp_path_factory.mktemp("core"))


@pytest.fixture(scope="module")
def archive(tmp_path_factory, core) -> Path:
    return extension.build_extension(tmp_path_factory.mktemp("dist"), CACHE, PLATFORM, core)


@pytest.fixture(scope="module")
def legacy(tmp_path_factory, core) -> Path:
    return extension.build_legacy(tmp_path_factory.mktemp("dist"), CACHE, PLATFORM, core)


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(platform: str = PLATFORM) -> dict[str, str]:
    pins = wheels.locked(wheels.PLATFORMS[platform].lock)
    return {canonical(n): v for n, v in (pin.split("==") for pin in pins)}


def test_lock_is_the_real_dependency_set_without_numpy():
    needed, todo = set(), ["scipy", "scikit-image", "onnxruntime"]
    while todo:
        name = canonical(todo.pop())
        if name in needed or name == "numpy":
            continue
        needed.add(name)
        todo += [re.match(r"[\w.-]+", r)[0] for r in metadata.requires(name) or ()
                 if "extra ==" not in r]  # fmt: skip
    assert set(locked()) == needed


def test_lock_follows_the_constraints_except_for_scipy():
    pins = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        name, equals, version = line.split("#")[0].strip().partition("==")
        if equals:
            pins[canonical(name)] = version
    others = {n: v for n, v in locked().items() if n != "scipy"}
    assert others == {n: pins[n] for n in others}
    # scipy 1.16 needs a newer numpy than Blender 4.1 to 4.3 bring
    assert tuple(map(int, locked()["scipy"].split(".")[:2])) < (1, 16)


def test_intel_macs_differ_in_onnxruntime_alone():
    here, there = locked(), locked("macos-x64")
    assert {n for n in here.keys() | there.keys() if here.get(n) != there.get(n)} == {"onnxruntime"}


def check_content(archive: Path, platform: str) -> None:
    """The shell, a manifest that names every wheel, and of each package one wheel a Python."""
    with zipfile.ZipFile(archive) as opened:
        names = opened.namelist()
        manifest = tomllib.loads(opened.read("blender_manifest.toml").decode())
        ours = next(n for n in names if n.startswith("wheels/sketch_to_face-"))
        with opened.open(ours) as stream, zipfile.ZipFile(stream) as wheel:
            core = wheel.namelist()
        inside = [n for n in names if n.startswith("wheels/")]
        for name in inside:
            check_wheel(opened, name, platform)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert manifest["version"] == project["version"]
    assert manifest["platforms"] == [platform]
    assert sorted(manifest["wheels"]) == sorted(f"./{n}" for n in inside)
    assert not [n for n in names + core if "numpy" in n.lower()]
    assert {p.name for p in (ROOT / "addon" / "blender").glob("*.py")} | {"LICENSE"} <= set(names)
    assert {n.split("/")[0] for n in core if "dist-info" not in n} == set(wheels.PACKAGES)
    assert "facs_rig/data/head.npz" in core and "addon/pipeline.py" in core
    assert not [n for n in core if n.startswith(wheels.LEFT_OUT)]

    for python in wheels.PLATFORMS[platform].pythons:
        loaded = [canonical(Path(n).name.split("-")[0]) for n in inside if loads(n, python)]
        assert sorted(loaded) == sorted([*locked(platform), "sketch-to-face"])


def loads(wheel: str, python: str) -> bool:
    """Whether a wheel of this name is for this Python."""
    return wheel.split("-")[-3] in ("cp" + python.replace(".", ""), "py3", "py2.py3")


def check_wheel(opened: zipfile.ZipFile, name: str, platform: str) -> None:
    """It is for this platform, and content with the numpy of each Blender that loads it."""
    system, machine = {"linux-x64": ("manylinux", "x86_64"), "windows-x64": ("win", "amd64"),
                       "macos-arm64": ("macosx", "arm64"),
                       "macos-x64": ("macosx", "x86_64")}[platform]  # fmt: skip
    where = name.removesuffix(".whl").split("-")[-1]
    # of the last part, since a wheel may carry several: manylinux_2_17_x86_64.manylinux2014_x86_64
    assert where == "any" or where.startswith(system) and where.endswith(machine), name
    with opened.open(name) as stream, zipfile.ZipFile(stream) as wheel:
        (meta,) = [n for n in wheel.namelist() if re.fullmatch(r"[^/]+\.dist-info/METADATA", n)]
        asks = re.findall(r"^Requires-Dist: (numpy\b[^;\n]*)$", wheel.read(meta).decode(), re.M)
    if "sketch_to_face" in name:  # Blender does not read it; pyproject.toml is for pip
        return
    for python in wheels.PLATFORMS[platform].pythons:
        if loads(name, python):
            for version in BLENDERS_NUMPY[python]:
                assert all(version in Requirement(r.strip()).specifier for r in asks), (name, asks)


def test_zip_is_the_shell_with_the_wheels_beside_it(archive):
    check_content(archive, PLATFORM)


def test_a_blender_that_does_not_look_at_the_python_takes_the_wheels_for_3_11(archive):
    """Blender 4.2.0: of several wheels of a package its tool skips all but one."""
    file = extension.validator().parents[3] / "modules/_bpy_internal/extensions/wheel_manager.py"
    spec = spec_from_file_location("wheel_manager", file)
    manager = module_from_spec(spec)
    spec.loader.exec_module(manager)
    with zipfile.ZipFile(archive) as opened:
        inside = [n for n in opened.namelist() if n.startswith("wheels/")]
    skipped = manager.wheel_list_deduplicate_as_skip_set([("sketch_to_face", inside)])
    assert skipped == {n for n in inside if "-cp313-" in n} != set()


def test_two_builds_give_the_same_bytes(archive, tmp_path):
    again = extension.build_extension(
        tmp_path, CACHE, PLATFORM, wheels.core_wheel(ROOT, tmp_path / "core")
    )
    assert again.name == archive.name
    digests = [hashlib.sha256(p.read_bytes()).hexdigest() for p in (archive, again)]
    assert digests[0] == digests[1]


def test_blender_s_own_tool_accepts_the_zip(archive):
    assert "success" in extension.validate(archive).lower()


@pytest.mark.slow
@pytest.mark.parametrize("platform", sorted(set(wheels.PLATFORMS) - {PLATFORM}))
def test_zip_of_another_platform(platform, core, tmp_path):
    built = extension.build_extension(tmp_path / "a", CACHE, platform, core)
    assert "success" in extension.validate(built).lower()
    check_content(built, platform)
    again = extension.build_extension(tmp_path / "b", CACHE, platform, core)
    assert built.read_bytes() == again.read_bytes()


def test_blender_s_own_tool_refuses_a_wrong_manifest(archive, tmp_path):
    broken = tmp_path / "broken.zip"
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(broken, "w") as target:
        text = source.read("blender_manifest.toml").decode()
        target.writestr("blender_manifest.toml", text.replace('type = "add-on"', 'type = "toy"'))
        target.writestr("__init__.py", source.read("__init__.py"))
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


def check(result: Path, done: subprocess.CompletedProcess[str], inside: Path) -> None:
    """The button worked, and everything but numpy came out of the zip."""
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(result.read_text())
    print(json.dumps({k: v for k, v in told.items() if k not in ("keys", "added")}, indent=1))
    keys = ["Basis", *(key.name for key in load_rig().keys)]
    assert told["keys"] == [*keys, "Fitted"]
    assert told["added"] == [*keys, *IDENTITY_KEYS, *ARKIT_NAMES]
    assert told["left"] == []
    for name, file in told["files"].items():
        assert Path(file).is_relative_to(inside.resolve()) == (name != "numpy"), (name, file)


def only(tmp_path: Path, names: tuple[str, ...], site: Path | None = None) -> Path:
    """A folder for the Python path with these packages of `site` (ours) and no others."""
    site = site or Path(find_spec("numpy").origin).parents[1]
    folder = tmp_path / "site"
    folder.mkdir()
    for name in names:
        if (site / name).exists():
            (folder / name).symlink_to(site / name)
    return folder


def environment(tmp_path: Path, folder: Path) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "BLENDER"))}
    return kept | {
        "HOME": str(tmp_path),
        "PYTHONPATH": str(folder),
        "BLENDER_USER_RESOURCES": str(tmp_path / "blender"),
        "BLENDER_USER_CONFIG": str(tmp_path / "blender" / "config"),
        "BLENDER_USER_SCRIPTS": str(tmp_path / "blender" / "scripts"),
        "BLENDER_USER_EXTENSIONS": str(tmp_path / "blender" / "extensions"),
        "SKETCH_TO_FACE_RAISE": "1",
    }


def install(archive: Path, tmp_path: Path, python: Path, folder: Path) -> None:
    """Install the zip in a clean profile of a Blender that is a module, press the button."""
    result = tmp_path / "result.json"
    done = subprocess.run(
        [python, "-S", "-P", str(INSTALL), "extension", str(archive), str(SKETCH), str(result)],
        env=environment(tmp_path, folder), cwd=tmp_path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    check(result, done, tmp_path / "blender" / "extensions")


@pytest.mark.slow
def test_zip_installs_in_a_clean_profile_and_the_button_works(archive, tmp_path):
    install(archive, tmp_path, Path(sys.executable), only(tmp_path, BLENDER_ITSELF))


def test_without_python_3_13_one_sentence_says_how_to_name_it(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    for named in ("/no/such/python", sys.executable):
        monkeypatch.setenv("PYTHON313", named)
        with pytest.raises(Missing, match="no Python 3.13; say which one: PYTHON313="):
            python_3_13()


@pytest.mark.slow
def test_zip_installs_in_blender_5_2_with_python_3_13_and_the_button_works(archive, tmp_path):
    try:
        python, site = blender_5_2()
    except Missing as why:
        pytest.skip(str(why))
    install(archive, tmp_path, python, only(tmp_path, (*BLENDER_ITSELF, *NEEDS), site))


@pytest.mark.slow
def test_legacy_zip_installs_in_an_old_blender_and_the_button_works(legacy, tmp_path):
    program = shutil.which("blender")
    if program is None:
        pytest.skip("no installed Blender (Debian: apt install blender)")
    asked = subprocess.run([program, "-b", "--factory-startup", "--python-expr",
                            "import sys, bpy; print('IS', bpy.app.version < (4, 2),"
                            " sys.version_info[:2] == (3, 11))"],
                           capture_output=True, text=True, check=False)  # fmt: skip
    if "IS True True" not in asked.stdout:
        pytest.skip("the installed Blender is not one before 4.2 with Python 3.11")
    folder = only(tmp_path, ("numpy", "numpy.libs"))
    result = tmp_path / "result.json"
    done = subprocess.run(
        [program, "-b", "--factory-startup", "--python-use-system-env", "--python-exit-code", "1",
         "-P", str(INSTALL), "--", "legacy", str(legacy), str(SKETCH), str(result)],
        env=environment(tmp_path, folder), cwd=tmp_path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    check(result, done, tmp_path / "blender" / "scripts")
