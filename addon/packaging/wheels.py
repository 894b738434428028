"""The wheels that travel in the zip: our own core, and what it needs besides Blender's numpy."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from importlib import metadata
from pathlib import Path

from .archive import read_zip, write_zip

PYTHON = "3.11"  # Blender 4.1 to 5.0
PACKAGES = ("facs_rig", "classifiers", "snakes", "dataset_gen", "addon")
# The shell is the zip's root, so the wheel leaves it out; nor does a Blender build add-ons.
LEFT_OUT = ("addon/blender", "addon/packaging")
LOCK = Path(__file__).with_name("wheels.lock")

# Blender's name of a platform -> the wheel tags that run there, newest first.
PLATFORMS = {
    "linux-x64": tuple(f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 24, 17))
    + ("manylinux2014_x86_64",),
}


class BuildError(Exception):
    """The zip cannot be built; one sentence says why and what to do."""


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


def third_party(platform: str, cache: Path) -> list[Path]:
    """The locked wheels for a Blender platform, fetched into `cache` unless they are there.

    pip checks each file against the hash in wheels.lock, a cached one too.
    """
    if platform not in PLATFORMS:
        raise BuildError(f"No wheels are known for {platform}; known: {', '.join(PLATFORMS)}.")
    folder = cache / platform
    folder.mkdir(parents=True, exist_ok=True)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet",
           "--require-hashes", "--no-deps", "--only-binary", ":all:", "--requirement", str(LOCK),
           "--python-version", PYTHON, "--implementation", "cp", "--dest", str(folder)]  # fmt: skip
    for abi in ("cp311", "abi3", "none"):
        pip += ["--abi", abi]
    for tag in PLATFORMS[platform]:
        pip += ["--platform", tag]
    wanted = locked()
    if set(_by_name(folder)) != set(wanted):
        for stale in folder.glob("*.whl"):
            stale.unlink()
    offline = ["--no-index", "--find-links", str(folder)]
    if len(_by_name(folder)) == len(wanted):
        try:
            _run(pip + offline, "")
        except BuildError:
            _run(pip, "The wheels could not be fetched; is there a network?")
    else:
        _run(pip, "The wheels could not be fetched; is there a network?")
    found = _by_name(folder)
    return [found[name] for name in wanted]


def _by_name(folder: Path) -> dict[str, Path]:
    return {"==".join(p.name.split("-")[:2]).lower(): p for p in sorted(folder.glob("*.whl"))}


def locked() -> list[str]:
    """What wheels.lock names, as `name==version` in the spelling of wheel files, sorted."""
    lines = LOCK.read_text(encoding="utf-8").splitlines()
    pins = [line.split()[0] for line in lines if line[:1].isalnum()]
    return sorted(pin.replace("-", "_").lower() for pin in pins)
