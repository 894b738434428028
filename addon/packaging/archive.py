"""Zip files whose bytes depend on nothing but their content."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from facs_rig.common.files import Outputs

_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip can hold
_STORED = (".whl", ".npz", ".png", ".jpg", "/")  # compressed already, or nothing at all


def write_zip(path: Path, content: Mapping[str, bytes | Path]) -> Path:
    """Write `content` (name in the archive -> bytes or file) to `path`, whole or not at all.

    A name that ends in a slash is a folder, without content.
    Names are sorted, dates and permissions fixed, so that the same content gives the same bytes.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with Outputs() as outputs, zipfile.ZipFile(outputs.beside(path), "w") as archive:
        for name in sorted(content):
            value = content[name]
            entry = zipfile.ZipInfo(name, _DATE)
            entry.external_attr = 0o40755 << 16 | 0x10 if entry.is_dir() else 0o644 << 16
            entry.create_system = 3  # Unix, wherever it is built
            entry.compress_type = (
                zipfile.ZIP_STORED if name.endswith(_STORED) else zipfile.ZIP_DEFLATED
            )
            archive.writestr(entry, value if isinstance(value, bytes) else value.read_bytes())
    return path


def read_zip(path: Path) -> dict[str, bytes]:
    """Every file of a zip: name -> bytes."""
    with zipfile.ZipFile(path) as archive:
        return {i.filename: archive.read(i) for i in archive.infolist() if not i.is_dir()}
