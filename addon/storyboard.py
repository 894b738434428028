"""A folder of sketches as a row of key poses: which files, in which order."""

from __future__ import annotations

import re
from pathlib import Path

from addon.accepted import FORMATS
from facs_rig.common.errors import InputError

# What files of accepted.FORMATS are called, where that is not simply the format's name.
_ENDINGS = {"JPEG": (".jpg", ".jpeg"), "TIFF": (".tif", ".tiff"), "PPM": (".ppm", ".pgm", ".pbm")}
SUFFIXES = tuple(ending for name in FORMATS for ending in _ENDINGS.get(name, (f".{name.lower()}",)))
EVERY = 24  # frames from one sketch to the next: a second of film


def sketches_in(folder: str | Path) -> list[Path]:
    """The pictures in a folder, not in those inside it, as people count: 2.png before 10.png.

    InputError, one sentence, if there is no such folder or no picture in it.
    """
    folder = Path(folder)
    try:
        files = [path for path in folder.iterdir() if path.is_file()]
    except OSError as error:
        reason = (error.strerror or "it is out of reach").lower()
        raise InputError(f"The folder '{folder}' cannot be read: {reason}.") from None
    found = [p for p in files if p.suffix.lower() in SUFFIXES and not p.name.startswith(".")]
    if not found:
        raise InputError(
            f"There is no picture in '{folder}'; choose the folder that your sketches are in "
            f"({', '.join(SUFFIXES)})."
        )
    return sorted(found, key=natural)


def natural(path: Path) -> tuple[list[tuple[int, int, str]], str]:
    """A key that sorts names by the numbers in them, and equal ones letter by letter."""
    parts = re.findall(r"\d+|\D+", path.name.casefold())
    order = [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts]
    return order, path.name
