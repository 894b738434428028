"""The clock of stages: how long each step of a piece of work took, as its timings tell."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

__all__ = ["Clock"]


class Clock:
    """Seconds of each stage, in the order in which they end.

    progress : called after each stage with the number of stages that are done
    """

    def __init__(self, progress: Callable[[int], None] | None = None) -> None:
        self.laps: dict[str, float] = {}
        self._progress = progress
        self._last = perf_counter()

    def skip(self) -> None:
        """Do not count the time since the last stage: it is known, or nobody asks."""
        self._last = perf_counter()

    def lap(self, stage: str) -> None:
        """A stage has ended; its seconds are `laps[stage]`."""
        now = perf_counter()
        self.laps[stage], self._last = now - self._last, now
        if self._progress:
            self._progress(len(self.laps))
