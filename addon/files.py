"""Output files appear whole or not at all: written beside their place, then renamed.

Several outputs of one job stand or fall together:

    with Outputs() as outputs:
        write_mesh(outputs.beside("face.glb"))
        write_text(outputs.beside("report.json"))
    # both exist now; had anything failed, neither would, and older files would be untouched
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path
from types import TracebackType


class OutputError(ValueError):
    """A place that cannot be written to; the text is one sentence."""


def check_output(path: str | Path, suffixes: tuple[str, ...] = ()) -> Path:
    """`path`, if a file can be written there and its name ends in one of `suffixes`.

    To be asked before any work is done. Raises OutputError otherwise. Changes nothing.
    """
    path = Path(path)
    if suffixes and path.suffix.lower() not in suffixes:
        raise OutputError(
            f"'{path}' has no known ending; use {', '.join(suffixes[:-1])} or {suffixes[-1]}."
            if len(suffixes) > 1
            else f"'{path}' has no known ending; use {suffixes[0]}."
        )
    if path.is_dir():
        raise OutputError(f"'{path}' is a folder; name a file in it.")
    if not path.parent.is_dir():
        raise OutputError(f"There is no folder '{path.parent}' to write '{path.name}' into.")
    try:
        # The only sure test: permissions alone do not tell of read-only disks, or of root.
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError:
        raise OutputError(f"Nothing can be written into the folder '{path.parent}'.") from None
    return path


class Outputs:
    """Context of a job that writes files; see the module's example."""

    def __init__(self) -> None:
        self._places: list[tuple[Path, Path]] = []

    def beside(self, path: str | Path) -> Path:
        """A path to write to now, in the folder of `path` and with its ending."""
        path = Path(path)
        handle, name = tempfile.mkstemp(
            dir=path.parent, prefix=f".{path.stem}-", suffix=f".part{path.suffix}"
        )
        os.close(handle)
        part = Path(name)
        # mkstemp's files are for their owner's eyes only; outputs are ordinary files.
        umask = os.umask(0)
        os.umask(umask)
        part.chmod(0o666 & ~umask)
        self._places.append((part, path))
        return part

    def __enter__(self) -> Outputs:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if kind is None:
                for part, path in self._places:
                    os.replace(part, path)
        finally:
            for part, _ in self._places:
                with contextlib.suppress(OSError):
                    part.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write a UTF-8 file whole or not at all."""
    with Outputs() as outputs:
        outputs.beside(path).write_text(text, encoding="utf-8")
