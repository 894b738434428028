"""``python -m addon.packaging``: build the zips, check them, say how large they are."""

from __future__ import annotations

import argparse
import sys
import zipfile
from pathlib import Path

from .extension import ROOT, build, validate
from .lock import relock
from .needs import UnknownImport
from .wheels import PLATFORMS, SERIES, BuildError


def _megabytes(size: int) -> str:
    return f"{size / 1e6:7.2f} MB"


def _say(path: Path) -> None:
    print(f"{_megabytes(path.stat().st_size)}  {path}")
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            if "/wheels/" in entry.filename:
                print(f"{_megabytes(entry.file_size)}    {Path(entry.filename).name}")


def main(argv: list[str] | None = None) -> int:
    """Exit status: 0 built and checked, 1 not."""
    parser = argparse.ArgumentParser(prog="python -m addon.packaging", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="where the zips go")
    parser.add_argument("--cache", type=Path, default=ROOT / "build" / "wheels",
                        help="where fetched wheels are kept")  # fmt: skip
    parser.add_argument("--platform", choices=sorted(PLATFORMS), action="append",
                        help="default: all that are known")  # fmt: skip
    parser.add_argument("--blender", choices=[series.name for series in SERIES], action="append",
                        help="for which Blenders; default: all")  # fmt: skip
    parser.add_argument("--relock", action="store_true",
                        help="write the hashes in the lock files anew, build nothing")  # fmt: skip
    options = parser.parse_args(argv)
    try:
        if options.relock:
            for lock in sorted({platform.lock for platform in PLATFORMS.values()}):
                relock(lock)
            return 0
        for platform in options.platform or sorted(PLATFORMS):
            for series in PLATFORMS[platform].series:
                if options.blender and series.name not in options.blender:
                    continue
                made = build(options.out, options.cache, platform, series)
                if not series.legacy:
                    print(validate(made))
                _say(made)
    except (BuildError, UnknownImport) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
