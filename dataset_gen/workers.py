"""What processes that draw for others have in common, on this computer or on a cluster."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

PATIENCE = 2.0  # seconds that a worker without its parent has to put away what it is making


class Flag(Protocol):
    """An event of threading or of multiprocessing."""

    def is_set(self) -> bool: ...


class Stopped(Exception):
    """What is being made is wanted no more."""


_flags: list[Flag] = []


def end_with(parent: int, stop: Flag | None = None) -> None:
    """Let a worker stop when it is told to, or when the process that started it was killed."""
    orphaned = threading.Event()
    _flags[:] = [flag for flag in (stop, orphaned) if flag is not None]

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        orphaned.set()
        time.sleep(PATIENCE)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def go_on() -> None:
    """To be called between two samples; raises Stopped in a worker that shall stop."""
    if any(flag.is_set() for flag in _flags):
        raise Stopped


@contextmanager
def deaf_children() -> Iterator[None]:
    """Processes started here do not hear Ctrl-C: who started them hears it, and stops them.

    On Windows they hear it, and end with a traceback of their own.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
