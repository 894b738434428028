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
from importlib.util import find_spec
from pathlib import Path

import pytest

from addon.packaging import extension, wheels
from facs_rig import ARKIT_NAMES, load_rig
from facs_rig.identity import IDENTITY_KEYS

from .conftest import ROOT, SKETCH

PLATFORM = "linux-x64"
CACHE = ROOT / "build" / "wheels"
INSTALL = Path(__file__).with_name("install_and_press.py")
# What the bpy wheel needs to start; everything else has to come out of the zip.
BLENDER_ITSELF = ("bpy", "numpy", "numpy.libs", "requests", "urllib3", "idna", "certifi",
                  "charset_normalizer", "zstandard")  # fmt: skip

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or sys.version_info[:2] != (3, 11),
    reason="the zip is built for Python 3.11 on Linux so far",
)


@pytest.fixture(scope="module")
def archive(tmp_path_factory) -> Path:
    return extension.build_extension(tmp_path_factory.mktemp("dist"), CACHE, PLATFORM)


@pytest.fixture(scope="module")
def legacy(tmp_path_factory) -> Path:
    return extension.build_legacy(tmp_path_factory.mktemp("dist"), CACHE, PLATFORM)


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def locked() -> dict[str, str]:
    return {canonical(n): v for n, v in (pin.split("==") for pin in wheels.locked())}


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


def test_zip_is_the_shell_with_the_wheels_beside_it(archive):
    with zipfile.ZipFile(archive) as opened:
        names = opened.namelist()
        manifest = tomllib.loads(opened.read("blender_manifest.toml").decode())
        ours = next(n for n in names if n.startswith("wheels/sketch_to_face-"))
        with opened.open(ours) as stream, zipfile.ZipFile(stream) as wheel:
            core = wheel.namelist()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert manifest["version"] == project["version"]
    assert manifest["platforms"] == [PLATFORM]
    inside = [n for n in names if n.startswith("wheels/")]
    assert sorted(manifest["wheels"]) == sorted(f"./{n}" for n in inside)
    assert not [n for n in names + core if "numpy" in n.lower()]
    assert len(inside) == 1 + len(locked())
    assert {p.name for p in (ROOT / "addon" / "blender").glob("*.py")} | {"LICENSE"} <= set(names)
    assert {n.split("/")[0] for n in core if "dist-info" not in n} == set(wheels.PACKAGES)
    assert "facs_rig/data/head.npz" in core and "addon/pipeline.py" in core
    assert not [n for n in core if n.startswith(wheels.LEFT_OUT)]


def test_two_builds_give_the_same_bytes(archive, tmp_path):
    again = extension.build_extension(tmp_path, CACHE, PLATFORM)
    assert again.name == archive.name
    digests = [hashlib.sha256(p.read_bytes()).hexdigest() for p in (archive, again)]
    assert digests[0] == digests[1]


def test_blender_s_own_tool_accepts_the_zip(archive):
    assert "success" in extension.validate(archive).lower()


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
        wheels.third_party("amiga", tmp_path)


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


def only(tmp_path: Path, names: tuple[str, ...]) -> Path:
    """A folder for the Python path with these packages and no others."""
    folder = tmp_path / "site"
    folder.mkdir()
    for name in names:
        spec = find_spec(name) if "." not in name else None
        if spec is not None and spec.origin is not None:
            target = Path(spec.origin).parent
        else:
            target = Path(find_spec("numpy").origin).parents[1] / name
        if target.exists():
            (folder / name).symlink_to(target)
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


@pytest.mark.slow
def test_zip_installs_in_a_clean_profile_and_the_button_works(archive, tmp_path):
    folder = only(tmp_path, BLENDER_ITSELF)
    result = tmp_path / "result.json"
    done = subprocess.run(
        [sys.executable, "-S", "-P", str(INSTALL), "extension", str(archive), str(SKETCH),
         str(result)],
        env=environment(tmp_path, folder), cwd=tmp_path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    check(result, done, tmp_path / "blender" / "extensions")


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
