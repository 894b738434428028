"""Blender 5.2 as a module of Python 3.13, in an environment of its own under build/.

The other tests run in Blender 5.0, whose Python is 3.11; this is for what has to work in both.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .conftest import ROOT

# numpy as in Blender 5.2 itself; pip alone would take the newest
WHAT = ("bpy==5.2.3", "numpy==2.3.5")
WHERE = ROOT / "build" / "blender-5.2"
# What the bpy wheel needs to start, besides itself and numpy.
NEEDS = ("attr", "attrs", "cattr", "cattrs", "typing_extensions.py")


class Missing(Exception):
    """There is no Blender 5.2 to be had here; one sentence says why."""


def _says(command: list[str | Path]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def python_3_13() -> Path:
    """A Python 3.13: the one that PYTHON313 names, or that is on the path, or one of pyenv's."""
    named = os.environ.get("PYTHON313") or shutil.which("python3.13")
    others = sorted(Path.home().glob(".pyenv/versions/3.13.*/bin/python3.13"))
    for python in [Path(named), *others] if named else others:
        # asked, since pyenv puts a python3.13 on the path that may only say how to switch
        if _says([python, "-c", "import sys, venv; print(sys.version_info[:2])"]) == "(3, 13)":
            return python
    raise Missing("there is no Python 3.13; say which one: PYTHON313=/path/to/python3.13")


@contextmanager
def _alone() -> Iterator[None]:
    """Tests run in several processes, and of these one at a time may install."""
    import fcntl  # Linux and macOS; elsewhere the environment is laid out in another way anyhow

    WHERE.parent.mkdir(exist_ok=True)
    with open(f"{WHERE}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def blender_5_2() -> tuple[Path, Path]:
    """Its Python and its site-packages; installs them first where they are missing."""
    python = WHERE / "bin" / "python"
    site = WHERE / "lib" / "python3.13" / "site-packages"
    done = WHERE / "installed"  # written last, so that a broken installation is made anew
    with _alone():
        if not done.is_file() or done.read_text() != " ".join(WHAT):
            subprocess.run([python_3_13(), "-m", "venv", "--clear", WHERE], check=True)
            _install(python, *WHAT)
            done.write_text(" ".join(WHAT))
    return python, site


def blender_5_2_with_the_core() -> Path:
    """Its Python, with what the core needs at run time and the tests installed beside it."""
    python, _ = blender_5_2()
    pins = ROOT / "constraints.txt"
    needs = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    what = [*WHAT, "pytest", "hypothesis", *needs]  # WHAT once more: numpy has to stay as it is
    done, text = WHERE / "installed-core", " ".join([*what, pins.read_text()])
    with _alone():
        if not done.is_file() or done.read_text() != text:
            _install(python, "--constraint", str(pins), *what)
            done.write_text(text)
    return python


def _install(python: Path, *what: str) -> None:
    pip = [python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    asked = subprocess.run([*pip, *what], capture_output=True, text=True, check=False)
    if asked.returncode:
        raise Missing(f"pip cannot install {' '.join(what)}: {asked.stderr.strip()[-500:]}")
