"""The third-party wheels that travel in the zips: which there are, and where they come from."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .needs import needed

HERE = Path(__file__).parent

OLD, NEW = "3.11", "3.13"  # the Python of Blender 4.1 to 5.0, and of 5.1 and newer


@dataclass(frozen=True)
class Series:
    """Versions of Blender that one zip is for; they have one Python."""

    name: str  # in the names of zips
    python: str
    first: str
    beyond: str | None  # the first version that it is no longer for
    legacy: bool = False  # knows no extensions and no wheels

    @property
    def label(self) -> str:
        """The versions, for people: 4.2 to 5.0."""
        return self.name.removesuffix("-legacy").replace("-", " ")


LEGACY = Series("3.4-to-4.1-legacy", OLD, "3.4.0", "4.2.0", legacy=True)
SERIES = (
    Series("4.2-to-5.0", OLD, "4.2.0", "5.1.0"),
    Series("5.1-and-newer", NEW, "5.1.0", None),
    LEGACY,
)


@dataclass(frozen=True)
class Platform:
    """One kind of computer, by Blender's name for it in `PLATFORMS`."""

    tags: tuple[str, ...]  # of the wheels that run there, newest first; pip adds macOS' older ones
    pythons: tuple[str, ...] = (OLD, NEW)
    lock: Path = HERE / "wheels.lock"

    @property
    def series(self) -> tuple[Series, ...]:
        """The Blenders there, each of which gets a zip."""
        return tuple(series for series in SERIES if series.python in self.pythons)


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


def _run(command: list[str], trouble: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"{trouble}\n{done.stdout}{done.stderr}".rstrip())


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


def shipped(platform: str, python: str, cache: Path, root: Path) -> list[Path]:
    """Those of the locked wheels that the add-on of the checkout `root` can import from.

    Raises BuildError for what it imports and no wheel has.
    """
    used, lacking = needed(root, third_party(platform, python, cache))
    if lacking:
        who = "; ".join(
            f"{name}, imported by {', '.join(sorted(by))}" for name, by in lacking.items()
        )
        raise BuildError(
            f"What ships imports what it does not bring: {who}. Name it in the lock files, or in "
            "OPTIONAL (addon/packaging/needs.py) if the add-on works without it."
        )
    return used


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
