"""Puts shell and wheels together: the extension zip (4.2 and newer) and the one for 4.1."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from .archive import read_zip, write_zip
from .manual import manual
from .wheels import OLD, BuildError, known, packed_as, third_party

NAME = "sketch_to_face"
ROOT = Path(__file__).resolve().parents[2]


def version(root: Path = ROOT) -> str:
    """The version that pyproject.toml states."""
    project = root / "pyproject.toml"
    if not project.is_file():
        raise BuildError(f"The add-on is built from a checkout; {project} is missing.")
    return tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"]


def shell(root: Path = ROOT) -> dict[str, bytes]:
    """The files of the shell, name -> bytes, with the version filled in, without the manifest."""
    numbers = ", ".join(version(root).split("."))
    files = {p.name: p.read_bytes() for p in sorted((root / "addon" / "blender").glob("*.py"))}
    start = files["__init__.py"].decode()
    start, changed = re.subn(r'("version": )\([\d, ]*\)', rf"\1({numbers})", start)
    if changed != 1:
        raise BuildError("addon/blender/__init__.py states no version in its bl_info.")
    files["__init__.py"] = start.encode()
    files["LICENSE"] = (root / "LICENSE").read_bytes()
    files |= {f"manual/{name}": data for name, data in manual(root).items()}
    return files


def manifest(wheels: Sequence[str], platforms: Sequence[str], root: Path = ROOT) -> bytes:
    """blender_manifest.toml with version, platforms and wheels filled in."""
    text = (root / "addon" / "blender" / "blender_manifest.toml").read_text(encoding="utf-8")
    generated = "\n".join(
        [
            f'version = "{version(root)}"',
            "platforms = [" + ", ".join(f'"{p}"' for p in platforms) + "]",
            "wheels = [",
            *(f'  "./wheels/{name}",' for name in wheels),
            "]",
        ]
    )
    head, mark, tables = text.partition("\n[permissions]")
    return f"{head.rstrip()}\n\n{generated}\n{mark}{tables}".encode()


def build_extension(out: Path, cache: Path, platform: str, core: Path, root: Path = ROOT) -> Path:
    """The zip for Blender 4.2 and newer: shell at the root, wheels for each Python beside it.

    core : our own wheel, see `core_wheel`
    """
    wheels = {core.name: core}
    for python in known(platform).pythons:
        wheels |= {packed_as(wheel): wheel for wheel in third_party(platform, python, cache)}
    content: dict[str, bytes | Path] = {**shell(root)}
    content |= {f"wheels/{name}": wheel for name, wheel in wheels.items()}
    content["blender_manifest.toml"] = manifest(sorted(wheels), [platform], root)
    return write_zip(out / f"{NAME}-{version(root)}-{platform}.zip", content)


def build_legacy(out: Path, cache: Path, platform: str, core: Path, root: Path = ROOT) -> Path:
    """The zip for Blender before 4.2, which does not know wheels: they lie unpacked in `core`."""
    content: dict[str, bytes | Path] = {f"{NAME}/{n}": data for n, data in shell(root).items()}
    for wheel in [core, *third_party(platform, OLD, cache)]:
        for name, data in read_zip(wheel).items():
            if "/tests/" not in name:  # a third of scipy and scikit-image
                content[f"{NAME}/core/{name}"] = data
    return write_zip(out / f"{NAME}-{version(root)}-{platform}-legacy.zip", content)


def validator() -> Path | None:
    """Blender's own tool for extensions, if Blender is installed as a Python module."""
    spec = find_spec("bpy")
    if spec is None or spec.origin is None:
        return None
    tools = Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    return next(iter(sorted(tools)), None)


def validate(path: Path) -> str:
    """What Blender's tool says of the zip; raises BuildError when it finds a fault."""
    tool = validator()
    if tool is None:
        raise BuildError("bpy is not installed, so the zip is not checked: pip install bpy==5.0.1")
    done = subprocess.run(
        [sys.executable, str(tool), "validate", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    said = (done.stdout + done.stderr).strip()
    if done.returncode or "error" in said.lower() or "warning" in said.lower():
        raise BuildError(f"Blender does not accept {path.name}:\n{said}")
    return said
