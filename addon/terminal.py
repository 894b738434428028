"""What a command is given by whoever starts it: three streams and signals that may stop it.

The streams may be closed, full, left by their reader or of an encoding without degree signs; a
command does its work all the same, and says in one sentence what it could not.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any, TextIO

PATIENCE = 3.0  # seconds for clearing up, until one may ask again
PLAIN = {"°": " deg", "…": "...", "×": "x"}  # what we write, for streams without these


class Stopped(KeyboardInterrupt):
    """The command was asked to end, by signal `number`; what it began is undone on the way."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def prepare_streams() -> None:
    """See that stdin, stdout and stderr are there and take every character."""
    for handle in (0, 1, 2):
        try:
            os.fstat(handle)
        except OSError:  # closed: the next file to be opened would be taken for it
            os.open(os.devnull, os.O_RDWR)
    codecs.register_error("sketch2face", _plainly)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8", errors="replace"))
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="sketch2face")


def _plainly(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that a stream's encoding does not have."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lost = error.object[error.start : error.end]
    return "".join(PLAIN.get(c) or ascii(c)[1:-1] for c in lost), error.end


def printable(text: str) -> str:
    """The text on one line, without what a terminal would act on: file names may hold anything."""
    line = " ".join(part.strip() for part in text.splitlines())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


def mute(stream: TextIO | None) -> None:
    """Let what is still written to a stream go nowhere: its reader has left, or its disk is full.

    Otherwise Python would complain of the rest of it at its very end.
    """
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())  # type: ignore[union-attr]
        os.close(nowhere)
        stream.flush()  # type: ignore[union-attr]


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Within, SIGTERM and SIGHUP raise Stopped, as Ctrl-C raises KeyboardInterrupt.

    One that follows at once does not hinder the clearing up after the first. Signals that whoever
    started us had ignored, as nohup does, stay ignored.
    """
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before: dict[int, Any] = {}
    last = -math.inf

    def stop(number: int, frame: object) -> None:
        nonlocal last
        previous, last = last, time.monotonic()
        if last - previous > PATIENCE:
            raise Stopped(number)

    if threading.current_thread() is threading.main_thread():
        for number in numbers:
            if signal.getsignal(number) == signal.SIG_DFL:
                before[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
