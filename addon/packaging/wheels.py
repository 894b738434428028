"""The wheels that travel in the zip: our own core, and what it needs besides Blender's numpy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from .archive import read_zip, write_zip

PACKAGES = ("facs_rig", "classifiers", "snakes", "dataset_gen", "addon")
# The shell is the zip's root, so the wheel leaves it out; nor does a Blender build add-ons.
LEFT_OUT = ("addon/blender", "addon/packaging")
HERE = Path(__file__).parent

OLD, NEW = "3.11", "3.13"  # the Python of Blender 4.1 to 5.0, and of 5.1 and newer


@dataclass(frozen=True)
class Platform:
    """One kind of computer, by Blender's name for it in `PLATFORMS`."""

    tags: tuple[str, ...]  # of the wheels that run there, newest first; pip adds macOS' older ones
    pythons: tuple[str, ...] = (OLD, NEW)
    lock: Path = HERE / "wheels.lock"


PLATFORMS = {
    "linux-x64": Platform(
        tuple(f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 24, 17))
        + ("manylinux2014_x86_64",)
    ),
    "windows-x64": Platform(("win_amd64",)),
    "macos-arm64": Platform(("macosx_14_0_arm64",)),  # onnxruntime is not built for older ones
    # Blender 4.5 is the last for Intel Macs, so nobody there has the newer Python.
    "macos-x64": Platform(("macosx_13_0_x86_64",), (OLD,), HERE / "wheels-macos-x64.lock"),
}


class BuildError(Exception):
    """The zip cannot be built; one sentence says why and what to do."""


def known(platform: str) -> Platform:
    """The platform of this name; raises BuildError when there is none."""
    if platform not in PLATFORMS:
        raise BuildError(f"No wheels are known for {platform}; known: {', '.join(PLATFORMS)}.")
    return PLATFORMS[platform]


def _run(command: list[str], trouble: str, env: dict[str, str] | None = None) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
    if done.returncode:
        raise BuildError(f"{trouble}\n{done.stdout}{done.stderr}".rstrip())


def _stage(root: Path, folder: Path) -> None:
    """Copy what the core wheel is made of: setuptools writes into the tree that it builds."""
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        if (root / name).is_file():
            shutil.copy(root / name, folder)
    skipped = {(root / part).resolve() for part in LEFT_OUT}

    def ignore(where: str, names: list[str]) -> set[str]:
        here = Path(where).resolve()
        return {n for n in names if n == "__pycache__" or here / n in skipped}

    for package in PACKAGES:
        shutil.copytree(root / package, folder / package, ignore=ignore)


def _build_backend_is_here() -> bool:
    try:
        return int(metadata.version("setuptools").split(".")[0]) >= 77
    except metadata.PackageNotFoundError:
        return False


def core_wheel(root: Path, out: Path) -> Path:
    """Build our own wheel from the checkout `root` into `out`; the same bytes each time."""
    with tempfile.TemporaryDirectory() as temporary:
        source = Path(temporary) / "source"
        source.mkdir()
        _stage(root, source)
        command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir",
                   temporary, str(source)]  # fmt: skip
        if _build_backend_is_here():
            command.append("--no-build-isolation")
        environment = dict(os.environ, SOURCE_DATE_EPOCH="315532800")
        _run(command, "The core wheel could not be built:", env=environment)
        (built,) = Path(temporary).glob("sketch_to_face-*.whl")
        out.mkdir(parents=True, exist_ok=True)
        return write_zip(out / built.name, read_zip(built))


def fetch(what: Sequence[str], tags: Sequence[str], python: str, folder: Path) -> None:
    """Let pip put wheels for another platform or Python into `folder`.

    what : pip's own words for them, e.g. ``["scipy==1.15.3"]`` or ``["--requirement", FILE]``
    """
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet",
           "--no-deps", "--only-binary", ":all:", "--python-version", python,
           "--implementation", "cp", "--dest", str(folder)]  # fmt: skip
    for abi in ("cp" + python.replace(".", ""), "abi3", "none"):
        pip += ["--abi", abi]
    for tag in tags:
        pip += ["--platform", tag]
    _run([*pip, *what], "The wheels could not be fetched; is there a network?")


def third_party(platform: str, python: str, cache: Path) -> list[Path]:
    """The locked wheels for a Blender platform, fetched into `cache` unless they are there.

    pip checks each file against the hashes in the lock file, a cached one too.
    """
    there = known(platform)
    folder = cache / platform / python
    folder.mkdir(parents=True, exist_ok=True)
    wanted = locked(there.lock)
    if not set(_by_name(folder)) <= set(wanted):
        for stale in folder.glob("*.whl"):
            stale.unlink()
    what = ["--require-hashes", "--requirement", str(there.lock)]
    offline = [*what, "--no-index", "--find-links", str(folder)]
    try:
        fetch(offline if len(_by_name(folder)) == len(wanted) else what, there.tags, python, folder)
    except BuildError:  # a cached file is damaged, or the network hiccuped
        for stale in folder.glob("*.whl"):
            stale.unlink()
        fetch(what, there.tags, python, folder)
    found = _by_name(folder)
    return [found[name] for name in wanted]


def _by_name(folder: Path) -> dict[str, Path]:
    return {"==".join(p.name.split("-")[:2]).lower(): p for p in sorted(folder.glob("*.whl"))}


def locked(lock: Path) -> list[str]:
    """What a lock file names, as `name==version` in the spelling of wheel files, sorted."""
    lines = lock.read_text(encoding="utf-8").splitlines()
    pins = [line.split()[0] for line in lines if line[:1].isalnum()]
    return sorted(pin.replace("-", "_").lower() for pin in pins)


def packed_as(wheel: Path) -> str:
    """The wheel's file name in the zip: wheels for the newer Python get the build number 0.

    Blender 4.2.0 does not look at a wheel's Python. Of two with the same version it takes
    the one whose file name sorts last, which would be cp313, and cannot import it; `-0-cp313`
    sorts before `-cp311`. Newer Blenders look at the Python and do not mind the number.
    """
    name, version, *rest = wheel.name.split("-")
    if rest[0] == "cp" + NEW.replace(".", ""):
        rest.insert(0, "0")
    return "-".join([name, version, *rest])
