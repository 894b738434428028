"""Blenders that see nothing but themselves, and an older zip to install before the one in test."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from addon.packaging.archive import read_zip, write_zip
from addon.packaging.wheel import with_record

from .newer_blender import NEEDS, Missing, blender_5_2

# What the bpy wheel needs to start; everything else has to come out of the zip.
BLENDER_ITSELF = ("bpy", "numpy", "numpy.libs", "requests", "urllib3", "idna", "certifi",
                  "charset_normalizer", "zstandard")  # fmt: skip
PROFILE = "Käthes Köpfe 日本"  # spaces and letters that are not ASCII, as in many a home folder
# Its version, its Python's, and where its numpy is.
ASK = """
import sys, bpy, importlib.util
spec = importlib.util.find_spec('numpy')
print('IS', *bpy.app.version[:2], *sys.version_info[:2], spec.origin if spec else '')
"""
PATHS = os.environ.get("PATH", "").split(":")
OPENER = '#!/bin/sh\nprintf "%s\\n" "$*" >> "$OPENED"\n'


@dataclass(frozen=True)
class Blender:
    """A Blender that starts with an empty profile under `home`."""

    kind: str  # extension or legacy
    command: tuple[str, ...]
    home: Path
    environment: dict[str, str]

    def run(self, script: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
        """Run a script in it."""
        words = ["--"] * (self.kind == "legacy") + [str(a) for a in arguments]
        return subprocess.run(
            [*self.command, str(script), *words], env=self.environment, cwd=self.home,
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    @property
    def profile(self) -> Path:
        """Where it keeps what is installed."""
        return self.home / PROFILE


def _blender(kind: str, command: Sequence[str | Path], home: Path, links: Sequence[Path]):
    """links : what is put on its path, the only things there besides itself and Python"""
    site, tools = home / "site", home / "tools"
    for folder in (site, tools, home / PROFILE):
        folder.mkdir(parents=True)
    for link in links:
        if link.exists():
            (site / link.name).symlink_to(link)
    for name in ("browser", "xdg-open"):
        (tools / name).write_text(OPENER)
        (tools / name).chmod(0o755)
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "BLENDER"))}
    profile = home / PROFILE
    environment = kept | {
        "HOME": str(home),
        # without the tests' own Python, in which Blender's would look for modules
        "PATH": ":".join([str(tools), *(p for p in PATHS if Path(p).parent != Path(sys.prefix))]),
        "BROWSER": str(tools / "browser"),
        "OPENED": str(home / "opened.txt"),
        "PYTHONPATH": str(site),
        "BLENDER_USER_RESOURCES": str(profile),
        "BLENDER_USER_CONFIG": str(profile / "config"),
        "BLENDER_USER_SCRIPTS": str(profile / "scripts"),
        "BLENDER_USER_EXTENSIONS": str(profile / "extensions"),
        "SKETCH_TO_FACE_RAISE": "1",
    }
    return Blender(kind, tuple(map(str, command)), home, environment)


def blender_5_0(home: Path) -> Blender:
    """The one that the tests run in, as a module."""
    site = Path(find_spec("numpy").origin).parents[1]
    links = [site / name for name in BLENDER_ITSELF]
    return _blender("extension", [sys.executable, "-S", "-P"], home, links)


def newer(home: Path) -> Blender:
    """Blender 5.2; raises Missing."""
    python, site = blender_5_2()
    links = [site / name for name in (*BLENDER_ITSELF, *NEEDS)]
    return _blender("extension", [python, "-S", "-P"], home, links)


def older(home: Path) -> Blender:
    """An installed Blender before 4.2 with Python 3.11, as Debian's; raises Missing."""
    program = shutil.which("blender")
    if program is None:
        raise Missing("no installed Blender (Debian: apt install blender)")
    start = [program, "-b", "--factory-startup"]
    said = subprocess.run([*start, "--python-expr", ASK], capture_output=True, text=True,
                          check=False).stdout  # fmt: skip
    told = next((line.split(maxsplit=5)[1:] for line in said.splitlines() if line[:3] == "IS "), [])
    if len(told) < 4 or tuple(map(int, told[:2])) >= (4, 2) or told[2:4] != ["3", "11"]:
        raise Missing("the installed Blender is not one before 4.2 with Python 3.11")
    # without a numpy of its own it gets the one that the tests have
    numpy = Path(told[4] if len(told) > 4 else find_spec("numpy").origin).parent
    links = [numpy, numpy.with_name("numpy.libs")]
    command = [*start, "--python-use-system-env", "--python-exit-code", "1", "-P"]
    return _blender("legacy", command, home, links)


BLENDERS = {"5.0": blender_5_0, "5.2": newer, "3.4": older}


def older_zip(archive: Path, out: Path) -> Path:
    """The zip as it might have been built the day before, under the same version.

    Its core says that it is old, shell and core have a module more.
    """
    content: dict[str, bytes | Path] = {**read_zip(archive)}
    top = next(iter(content)).split("/")[0]
    for name in [n for n in content if n.endswith("/facs_rig/__init__.py")]:
        content[name] = _aged(content[name])
        content[name.replace("__init__", "only_then")] = b""
    for name in [n for n in content if "/wheels/sketch_to_face-" in n]:
        content[_before(name)] = _old_wheel(content.pop(name), out)
    manifest = f"{top}/blender_manifest.toml"
    if manifest in content:
        content[manifest] = _before(content[manifest].decode()).encode()
    content |= {f"{top}/": b"", f"{top}/only_then.py": b""}
    return write_zip(out / "older.zip", content)


def _aged(start: bytes) -> bytes:
    return start + b"\nIS_OLD = True\n"


def _before(text: str) -> str:
    """With the mark that the core wheel's version would have had of another content."""
    return re.sub(r"(sketch_to_face-[\d.]+\+)[0-9a-f]{12}", r"\g<1>000000000000", text)


def _old_wheel(data: bytes, out: Path) -> bytes:
    path = out / "wheel.zip"
    path.write_bytes(data)
    files = {_before(name): data for name, data in read_zip(path).items()}
    files["facs_rig/__init__.py"] = _aged(files["facs_rig/__init__.py"])
    files["facs_rig/only_then.py"] = b""
    (info,) = {name.split("/")[0] for name in files if ".dist-info/" in name}
    return write_zip(path, with_record(files, info)).read_bytes()


def top_level(wheel: str) -> set[str]:
    """The packages and modules that a wheel brings, its libraries included."""
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.split("/")[0].removesuffix(".py") for name in archive.namelist()}
    return {top for top in tops if not top.endswith(".dist-info")}
