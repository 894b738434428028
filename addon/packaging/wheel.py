"""Writes wheels: our own core, and others' without what nobody needs to run them."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping
from pathlib import Path

from .archive import read_zip, write_zip
from .needs import PACKAGES, module_name, reached

# The shell is the zip's root, and this package builds it: neither is in the core.
NOT_CORE = ("addon/blender/", "addon/packaging/")
# What is left out of third-party wheels: their own tests, a third of scipy, and sample pictures.
# Nothing else, since the wheels of all extensions lie in one folder: another one may need it.
UNNEEDED = {
    "scipy": re.compile(r"/tests/"),
    "scikit_image": re.compile(r"/tests/|^skimage/data/.*\.(png|jpg|npz|npy|tif|tiff|gif|fits)$"),
}
BUILD = "1lean"  # build tag of a wheel from which something was left out
_METADATA = """\
Metadata-Version: 2.4
Name: sketch-to-face
Version: {version}
Summary: The core of the Blender add-on Sketch to Face
License-Expression: GPL-3.0-or-later AND CC0-1.0
License-File: LICENSE
"""
_WHEEL = """\
Wheel-Version: 1.0
Generator: addon.packaging
Root-Is-Purelib: true
Tag: py3-none-any
"""


def core_files(root: Path) -> dict[str, bytes]:
    """What the core wheel is made of: name -> bytes.

    Of our modules those that the shell can import; of other files (weights, the head, samples) all
    but what they were made from.
    """
    imported = reached(root).modules
    files = {}
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*")):
            name = path.relative_to(root).as_posix()
            if not path.is_file() or "__pycache__" in path.parts or name.startswith(NOT_CORE):
                continue
            ships = module_name(name) in imported if path.suffix == ".py" else path.suffix != ".svg"
            if ships:
                files[name] = path.read_bytes()
    return files


def core_wheel(root: Path, version: str, out: Path) -> Path:
    """Write our own wheel from the checkout `root` into `out`; the same bytes each time.

    Its version ends in a mark of its content: Blender leaves an installed wheel of the same
    version as it is, and a new shell would meet an old core.
    """
    files = core_files(root)
    sums = repr([(name, _hash(data)) for name, data in files.items()])
    version = f"{version}+{hashlib.sha256(sums.encode()).hexdigest()[:12]}"
    info = f"sketch_to_face-{version}.dist-info"
    files[f"{info}/METADATA"] = _METADATA.format(version=version).encode()
    files[f"{info}/WHEEL"] = _WHEEL.encode()
    files[f"{info}/licenses/LICENSE"] = (root / "LICENSE").read_bytes()
    return write_zip(out / f"sketch_to_face-{version}-py3-none-any.whl", with_record(files, info))


def lean(wheel: Path, out: Path) -> Path:
    """The wheel without what is UNNEEDED of it, in `out`; itself where that is nothing.

    Its build tag is BUILD, its RECORD is written anew, licences stay.
    """
    package, version, *tags = wheel.name.split("-")
    if package not in UNNEEDED:
        return wheel
    info = f"{package}-{version}.dist-info"
    files = {n: d for n, d in read_zip(wheel).items() if not UNNEEDED[package].search(n)}
    files[f"{info}/WHEEL"] = files[f"{info}/WHEEL"].rstrip() + f"\nBuild: {BUILD}\n".encode()
    return write_zip(out / "-".join([package, version, BUILD, *tags]), with_record(files, info))


def with_record(files: Mapping[str, bytes], info: str) -> dict[str, bytes]:
    """The files of a wheel with a RECORD that names each of them, its hash and its size.

    info : the wheel's .dist-info folder
    """
    name = f"{info}/RECORD"
    told = {n: d for n, d in sorted(files.items()) if n != name}
    rows = [f"{_quoted(n)},sha256={_hash(d)},{len(d)}" for n, d in told.items()]
    return told | {name: "\n".join([*rows, f"{name},,", ""]).encode()}


def _quoted(name: str) -> str:
    return f'"{name}"' if "," in name else name


def _hash(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
