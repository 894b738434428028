"""Writes the hashes in the lock files anew: ``python -m addon.packaging --relock``.

Change a version in a lock file by hand, run it, look at the difference.
"""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Iterable
from pathlib import Path

from .wheels import PLATFORMS, Platform, fetch


def _hashes(pin: str, platforms: Iterable[Platform]) -> list[str]:
    """The hashes of all files of a pinned package that some platform and Python would choose."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for platform in platforms:
            for python in platform.pythons:
                fetch([pin], platform.tags, python, folder)
        files = sorted(folder.glob("*.whl"))
        return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


def relock(lock: Path) -> None:
    """Fetch what the pins of a lock file name and write its hashes; comments and order stay."""
    platforms = [p for p in PLATFORMS.values() if p.lock == lock]
    lines: list[str] = []
    for line in lock.read_text(encoding="utf-8").splitlines():
        if line[:1].isalnum():
            pin = line.split()[0]
            hashes = [f"    --hash=sha256:{h}" for h in _hashes(pin, platforms)]
            lines += " \\\n".join([pin, *hashes]).split("\n")
        elif not line.startswith("    --hash="):
            lines.append(line)
    lock.write_text("\n".join(lines) + "\n", encoding="utf-8")
