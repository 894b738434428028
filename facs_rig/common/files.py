"""Output files appear whole or not at all: written beside their place, then renamed.

Several outputs of one job stand or fall together:

    with Outputs() as outputs:
        write_mesh(outputs.beside("face.glb"))
        write_text(outputs.beside("report.json"))
    # both exist now; had anything failed, neither would, and older files would be untouched

Everything that this project writes for its users is written through here. Nothing but Python's own
library is needed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from .errors import InputError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

__all__ = ["OutputError", "Outputs", "check_output", "clear", "is_work", "write_text"]

# Where the files of a job grow. The name says nothing of theirs, which may fill a name's 255 bytes.
PREFIX, SUFFIX = ".sketch2face-", ".part"
LONGEST_ENDING = 16  # characters that a file keeps while it grows: writers choose a format by it
FORGOTTEN = 24 * 3600.0  # seconds after which nobody works there any more, without locks to tell


class OutputError(InputError):
    """A place that cannot be written to.

    reason : why, as half a sentence without a full stop
    """

    def __init__(self, sentence: str, reason: str = "") -> None:
        super().__init__(sentence)
        self.reason = reason or sentence


def check_output(path: str | Path, suffixes: tuple[str, ...] = ()) -> Path:
    """`path`, if a file can be written there and its name ends in one of `suffixes`.

    To be asked before any work is done. Raises OutputError otherwise. Changes nothing.
    """
    if not os.fspath(path):
        raise OutputError("An output has an empty name; give the file a name.")
    path = Path(path)
    if suffixes and path.suffix.lower() not in suffixes:
        raise OutputError(
            f"'{path}' has no known ending; use {', '.join(suffixes[:-1])} or {suffixes[-1]}."
            if len(suffixes) > 1
            else f"'{path}' has no known ending; use {suffixes[0]}."
        )
    try:
        _check_place(path)
    except OutputError:
        raise
    except (OSError, ValueError) as error:  # pathlib's ValueError for a zero byte
        raise _failed(path, error) from None
    return path


def _check_place(path: Path) -> None:
    known = _state(path)
    if known and stat.S_ISDIR(known.st_mode):
        raise OutputError(f"'{path}' is a folder; name a file in it.")
    if known and not stat.S_ISREG(known.st_mode):
        raise OutputError(f"'{path}' is a device or a pipe; name an ordinary file.")
    if known and not os.access(path, os.W_OK):
        raise OutputError(f"'{path}' is write-protected; choose another name or allow writing.")
    folder = Path(os.path.realpath(path)).parent if path.is_symlink() else path.parent
    if not folder.is_dir():
        raise OutputError(f"There is no folder '{folder}' to write '{path.name}' into.")
    try:
        # The only sure test: permissions alone do not tell of read-only disks, or of root.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError:
        raise OutputError(f"Nothing can be written into the folder '{folder}'.") from None


@dataclass(frozen=True)
class _File:
    """A file or folder on its way: what it will be called, where that leads to, where it grows."""

    path: Path
    place: Path
    part: Path

    @property
    def old(self) -> Path:
        return self.part.with_name(f"old-{self.part.name}")

    def put(self) -> None:
        """Bring it to its place, and keep what was there as `old`."""
        there = _state(self.place)
        if there and stat.S_ISDIR(os.lstat(self.part).st_mode):
            os.replace(self.place, self.old)
        elif there:
            with contextlib.suppress(OSError):  # a disk may know neither modes nor owners
                self.part.chmod(stat.S_IMODE(there.st_mode))
                if hasattr(os, "chown") and there.st_uid != os.getuid():
                    os.chown(self.part, there.st_uid, there.st_gid)
            try:
                os.link(self.place, self.old)
            except OSError:  # no hard links on this disk
                shutil.copy2(self.place, self.old)
        os.replace(self.part, self.place)

    def put_back(self) -> None:
        """Undo `put`, however far it came."""
        if not os.path.lexists(self.part):
            os.replace(self.place, self.part)
        if os.path.lexists(self.old) and not os.path.lexists(self.place):
            os.replace(self.old, self.place)


class Outputs:
    """Context of a job that writes files; see the module's example.

    A link is followed, and a file that was there keeps its permissions. An OSError within the
    context becomes an OutputError that names the file that was asked for last.
    """

    def __init__(self) -> None:
        self._files: list[_File] = []
        self._works: dict[Path, tuple[Path, int | None]] = {}  # folder -> where files grow, lock

    def beside(self, path: str | Path) -> Path:
        """A path to write to now, on the disk of `path` and with its ending: a file or a folder.

        It does not exist yet.
        """
        path = Path(path)
        place = Path(os.path.realpath(path))
        if place.parent not in self._works:
            try:
                clear(place.parent)
                self._works[place.parent] = _work_in(place.parent)
            except OSError as error:
                raise _failed(path, error) from error
        work, _ = self._works[place.parent]
        ending = path.suffix if len(path.suffix) <= LONGEST_ENDING else ""
        self._files.append(_File(path, place, work / f"{len(self._files)}{ending}"))
        return self._files[-1].part

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
                self._put_all()
        finally:
            for work, lock in self._works.values():
                shutil.rmtree(work, ignore_errors=True)
                if lock is not None:
                    os.close(lock)
        if isinstance(error, OSError) and self._files:
            raise _failed(self._files[-1].path, error) from error

    def _put_all(self) -> None:
        tried: list[_File] = []
        try:
            for file in self._files:
                tried.append(file)
                file.put()
        except BaseException as error:
            for file in reversed(tried):
                with contextlib.suppress(OSError):
                    file.put_back()
            if isinstance(error, OSError):
                raise _failed(tried[-1].path, error) from error
            raise


def write_text(path: str | Path, text: str) -> None:
    """Write a UTF-8 file whole or not at all; OutputError if that fails."""
    with Outputs() as outputs:
        outputs.beside(path).write_text(text, encoding="utf-8", newline="\n")


# --- where files grow -----------------------------------------------------------------------------


def is_work(name: str) -> bool:
    """Whether a folder of this name is one where outputs grow."""
    return name.startswith(PREFIX) and name.endswith(SUFFIX)


def clear(folder: Path) -> None:
    """Remove what killed programs left in a folder; what still grows stays."""
    for work in _works_in(folder):
        lock = None
        try:
            lock = _locked(work)
            if lock is None and time.time() - work.stat().st_mtime < FORGOTTEN:
                continue
            shutil.rmtree(work, ignore_errors=True)
        except OSError:  # somebody works there, or it has just gone
            continue
        finally:
            if lock is not None:
                os.close(lock)


def _works_in(folder: Path) -> Iterator[Path]:
    with os.scandir(folder) as entries:
        names = [entry.name for entry in entries if is_work(entry.name)]
    yield from (folder / name for name in names)


def _work_in(folder: Path) -> tuple[Path, int | None]:
    """A new folder in `folder`, and the lock that keeps others from clearing it."""
    while True:
        work = Path(tempfile.mkdtemp(dir=folder, prefix=PREFIX, suffix=SUFFIX))
        try:
            return work, _locked(work)
        except OSError:  # cleared before it was locked
            continue


def _locked(work: Path) -> int | None:
    """A lock on a folder, to be closed; None where there are no locks. OSError if it is taken."""
    if fcntl is None:
        return None
    handle = os.open(work, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.stat(work)  # the lock of a folder that is gone is nobody's
    except OSError as error:
        os.close(handle)
        if error.errno in (errno.EBADF, errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EINVAL):
            return None  # some network disks
        raise
    except BaseException:
        os.close(handle)
        raise
    return handle


def _state(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except FileNotFoundError:
        return None


# --- what is said ---------------------------------------------------------------------------------

REASONS = {
    errno.ENOSPC: "the disk is full; make room or choose another one",
    errno.EDQUOT: "your share of the disk is full; make room or choose another one",
    errno.EFBIG: "the file would be larger than is allowed here",
    errno.EROFS: "the disk may only be read; choose another one",
    errno.EACCES: "that is not allowed; choose another folder, or change the permissions",
    errno.EPERM: "that is not allowed; choose another name, or change the permissions",
    errno.ENAMETOOLONG: "the name is too long; choose a shorter one",
    errno.ELOOP: "it is a link that leads back to itself",
    errno.ENOTDIR: "a part of the path is a file where a folder is needed",
    errno.EISDIR: "a folder of that name is there; choose another name",
    errno.EEXIST: "a file of that name is there; choose another name",
    errno.EBUSY: "another program holds it; close that, or choose another name",
}


def reason_of(error: BaseException) -> str:
    """What an OSError is about and what helps, as half a sentence without a full stop."""
    if isinstance(error, OSError):
        said = REASONS.get(error.errno or 0, (error.strerror or "it is out of reach").lower())
    else:
        said = "a name cannot hold such characters"  # pathlib's ValueError for a zero byte
    return said


def _failed(path: Path, error: BaseException) -> OutputError:
    why = reason_of(error)
    return OutputError(f"'{path}' cannot be written: {why}.", why)
