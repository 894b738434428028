"""``python -m addon.packaging``: build the zips, check them, say how large they are."""

from __future__ import annotations

import argparse
import sys
import zipfile
from pathlib import Path

from .extension import ROOT, build_extension, build_legacy, validate
from .lock import relock
from .wheels import PLATFORMS, BuildError, core_wheel


def _megabytes(size: int) -> str:
    return f"{size / 1e6:7.2f} MB"


def _say(path: Path) -> None:
    print(f"{_megabytes(path.stat().st_size)}  {path}")
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            if entry.filename.endswith(".whl"):
                print(f"{_megabytes(entry.file_size)}    {entry.filename}")


def main(argv: list[str] | None = None) -> int:
    """Exit status: 0 built and checked, 1 not."""
    parser = argparse.ArgumentParser(prog="python -m addon.packaging", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="where the zips go")
    parser.add_argument("--cache", type=Path, default=ROOT / "build" / "wheels",
                        help="where fetched wheels are kept")  # fmt: skip
    parser.add_argument("--platform", choices=sorted(PLATFORMS), action="append",
                        help="default: all that are known")  # fmt: skip
    parser.add_argument("--no-legacy", action="store_true", help="only Blender 4.2 and newer")
    parser.add_argument("--relock", action="store_true",
                        help="write the hashes in the lock files anew, build nothing")  # fmt: skip
    options = parser.parse_args(argv)
    try:
        if options.relock:
            for lock in sorted({platform.lock for platform in PLATFORMS.values()}):
                relock(lock)
            return 0
        core = core_wheel(ROOT, options.cache)
        for platform in options.platform or sorted(PLATFORMS):
            extension = build_extension(options.out, options.cache, platform, core)
            print(validate(extension))
            _say(extension)
            if not options.no_legacy:
                _say(build_legacy(options.out, options.cache, platform, core))
    except BuildError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
