"""What the commands share: what they say, progress bars and checks of their arguments."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from addon.terminal import mute, printable
from facs_rig.common.errors import InputError

FACES = (".glb", ".fbx", ".obj", ".ply", ".blend")
# Endings that only Blender can write.
BLENDERS = (".blend", ".fbx")


def say(sentence: str, status: int, who: str = "sketch2face") -> int:
    """One line on stderr, if that can be written, and the exit status passed through."""
    try:
        print(f"{who}: {printable(sentence)}", file=sys.stderr, flush=True)
    except OSError:
        mute(sys.stderr)
    return status


def remark(text: str) -> None:
    """Lines on stdout that nobody's work depends on: of files that are written already."""
    try:
        print(text, flush=True)
    except OSError:
        mute(sys.stdout)


def assignment(text: str, option: str, example: str) -> tuple[str, float]:
    """NAME=VALUE as a name and a number; InputError if it is none.

    option : what the text was given to;  example : what it could have been
    """
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise InputError(f"{option} takes NAME=VALUE, such as {example}, not '{text}'.") from None


class Bar:
    """A progress bar on stderr, if that is a terminal; otherwise nothing. Call it (done, total)."""

    WIDTH = 32

    def __init__(self, label: str) -> None:
        self.label = label
        self.shown = bool(sys.stderr) and sys.stderr.isatty()
        self._last = ""

    def __call__(self, done: int, total: int) -> None:
        if not self.shown:
            return
        full = self.WIDTH * done // max(total, 1)
        line = f"\r{self.label} [{'#' * full}{'.' * (self.WIDTH - full)}] {done}/{total}"
        if line != self._last:
            self._last = line
            self._write(line)

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._last:
            self._write("\n")

    def _write(self, text: str) -> None:
        try:
            sys.stderr.write(text)
            sys.stderr.flush()
        except OSError:  # the terminal is gone
            self.shown = False
            mute(sys.stderr)


def distinct(paths: Sequence[Any]) -> None:
    """InputError if two of these are one file, by the same name or by another: a link, a name in
    other letters on a disk that does not tell them apart. None does not count."""
    seen: dict[object, Any] = {}
    for path in (path for path in paths if path):
        try:
            known = os.stat(path)
            key: object = (known.st_dev, known.st_ino)
        except (OSError, ValueError):
            key = os.path.realpath(path)
        if key in seen:
            same = Path(path).name
            other = Path(seen[key]).name
            also = "" if other == same else f" (as '{other}', too)"
            raise InputError(f"'{same}' is named twice{also}; give every file a name of its own.")
        seen[key] = path


def name_paths(parser: argparse.ArgumentParser) -> None:
    """Let options that are paths take no empty names."""

    def file_path(text: str) -> Path:
        return Path(file_name(text))

    for action in parser._actions:
        if action.type is Path:
            action.type = file_path


def file_name(text: str) -> str:
    """`text`, for argparse: an option that names a file or a folder."""
    if not text or "\0" in text:
        raise argparse.ArgumentTypeError("the name is empty" if not text else "no file has a name "
                                         "with a zero byte")  # fmt: skip
    return text


def need_bpy(face: Path) -> None:
    """InputError if only Blender can write this file and there is none."""
    if face.suffix.lower() not in BLENDERS:
        return
    from importlib.util import find_spec

    if find_spec("bpy") is None:
        raise InputError(
            f"writing '{face}' needs Blender as a module: pip install 'sketch-to-face[blender]'"
        )
