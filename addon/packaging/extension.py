"""Puts shell and wheels together: a zip for each platform and each run of Blenders."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from .archive import read_zip, write_zip
from .manual import manual
from .wheel import core_wheel, lean
from .wheels import PLATFORMS, BuildError, Series, shipped

NAME = "sketch_to_face"
ROOT = Path(__file__).resolve().parents[2]


def version(root: Path = ROOT) -> str:
    """The version that pyproject.toml states."""
    project = root / "pyproject.toml"
    if not project.is_file():
        raise BuildError(f"The add-on is built from a checkout; {project} is missing.")
    return tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"]


def zip_name(platform: str, series: Series, root: Path = ROOT) -> str:
    """What the zip for these Blenders on this platform is called."""
    return f"{NAME}-{version(root)}-{platform}-blender-{series.name}.zip"


def made_for(platform: str, series: Series, root: Path = ROOT) -> bytes:
    """made_for.json: which zip it is and which others there are (read by the shell's right_zip)."""
    zips = [
        {
            "name": zip_name(name, other, root),
            "platform": name,
            "python": other.python,
            "blender": other.label,
            "first": [int(n) for n in other.first.split(".")],
            "beyond": [int(n) for n in other.beyond.split(".")] if other.beyond else None,
        }
        for name, there in PLATFORMS.items()
        for other in there.series
    ]
    told = {"zip": zip_name(platform, series, root), "zips": zips}
    return json.dumps(told, indent=1).encode()


def shell(root: Path = ROOT) -> dict[str, bytes]:
    """The files of the shell, name -> bytes, with the version filled in, without the manifest."""
    numbers = ", ".join(version(root).split("."))
    folder = root / "addon" / "blender"
    sources = sorted(folder.rglob("*.py"))
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in sources}
    start = files["__init__.py"].decode()
    start, changed = re.subn(r'("version": )\([\d, ]*\)', rf"\1({numbers})", start)
    if changed != 1:
        raise BuildError("addon/blender/__init__.py states no version in its bl_info.")
    files["__init__.py"] = start.encode()
    files["LICENSE"] = (root / "LICENSE").read_bytes()
    files |= {f"manual/{name}": data for name, data in manual(root).items()}
    return files


def manifest(wheels: Sequence[str], platform: str, series: Series, root: Path = ROOT) -> bytes:
    """blender_manifest.toml with versions, platform and wheels filled in."""
    text = (root / "addon" / "blender" / "blender_manifest.toml").read_text(encoding="utf-8")
    generated = [
        f'version = "{version(root)}"',
        f'blender_version_min = "{series.first}"',
        *([f'blender_version_max = "{series.beyond}"  # exclusive'] if series.beyond else []),
        f'platforms = ["{platform}"]',
        "wheels = [",
        *(f'  "./wheels/{name}",' for name in wheels),
        "]",
    ]
    head, mark, tables = text.partition("\n[permissions]")
    return "\n".join([head.rstrip(), "", *generated, mark + tables]).encode()


def build(out: Path, cache: Path, platform: str, series: Series, root: Path = ROOT) -> Path:
    """The zip for these Blenders on this platform, in `out`; the same bytes each time.

    All lies in one folder: a Blender before 4.2 would scatter an extension among its other add-ons
    otherwise, and this one could not say which zip is right. There the wheels lie in `core`,
    unpacked, since that Blender does not know them.
    """
    wheels = [core_wheel(root, version(root), cache)]
    for wheel in shipped(platform, series.python, cache, root):
        wheels.append(lean(wheel, cache / "lean" / platform / series.python))
    content: dict[str, bytes | Path] = {**shell(root)}
    content["made_for.json"] = made_for(platform, series, root)
    if series.legacy:
        for wheel in wheels:
            content |= {f"core/{name}": data for name, data in read_zip(wheel).items()}
    else:
        content |= {f"wheels/{wheel.name}": wheel for wheel in wheels}
        names = sorted(wheel.name for wheel in wheels)
        content["blender_manifest.toml"] = manifest(names, platform, series, root)
    # The folder by itself, too: without it Blender before 4.2 would leave the older version's files
    # where they are, and overwrite its loaded libraries in place, which crashes it.
    inside = {f"{NAME}/": b""} | {f"{NAME}/{name}": data for name, data in content.items()}
    return write_zip(out / zip_name(platform, series, root), inside)


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
