"""What the commands share: their errors, progress bars and checks of their arguments."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

FACES = (".glb", ".fbx", ".obj", ".ply", ".blend")
# Endings that only Blender can write.
BLENDERS = (".blend", ".fbx")


class UsageError(ValueError):
    """A command line that cannot be carried out; the text is one sentence."""


def say(sentence: str, status: int) -> int:
    """One line on stderr, and the exit status passed through."""
    print(f"sketch2face: {' '.join(sentence.split())}", file=sys.stderr)
    return status


def usage(call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    """Call something that answers wrong arguments with a ValueError of one sentence."""
    try:
        return call(*arguments, **named)
    except UsageError:
        raise
    except ValueError as error:
        raise UsageError(str(error)) from error


def assignment(text: str, option: str, example: str) -> tuple[str, float]:
    """NAME=VALUE as a name and a number; UsageError if it is none.

    option : what the text was given to;  example : what it could have been
    """
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise UsageError(f"{option} takes NAME=VALUE, such as {example}, not '{text}'.") from None


class Bar:
    """A progress bar on stderr, if that is a terminal; otherwise nothing. Call it (done, total)."""

    WIDTH = 32

    def __init__(self, label: str) -> None:
        self.label = label
        self.shown = sys.stderr.isatty()
        self._last = ""

    def __call__(self, done: int, total: int) -> None:
        if not self.shown:
            return
        full = self.WIDTH * done // max(total, 1)
        line = f"\r{self.label} [{'#' * full}{'.' * (self.WIDTH - full)}] {done}/{total}"
        if line != self._last:
            self._last = line
            sys.stderr.write(line)
            sys.stderr.flush()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._last:
            sys.stderr.write("\n")


def distinct(paths: Sequence[Any]) -> None:
    """UsageError if a file is named twice; empty names do not count."""
    seen: set[Path] = set()
    for path in (Path(path).resolve() for path in paths if path):
        if path in seen:
            raise UsageError(f"'{path.name}' is named twice; give every file a name of its own.")
        seen.add(path)


def need_bpy(face: Path) -> None:
    """UsageError if only Blender can write this file and there is none."""
    if face.suffix.lower() not in BLENDERS:
        return
    from importlib.util import find_spec

    if find_spec("bpy") is None:
        raise UsageError(
            f"writing '{face}' needs Blender as a module: pip install 'sketch-to-face[blender]'"
        )
