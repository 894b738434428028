"""Long work on Blender's data in slices, between which its window lives.

The work is a generator that yields wherever it could pause: after units of some milliseconds.
bpy must be used by the main thread alone, so whoever keeps the window alive goes through the
slices there, one at each tick of a timer.
"""

from __future__ import annotations

from collections.abc import Generator
from time import perf_counter
from typing import TypeVar

Result = TypeVar("Result")
Steps = Generator[None, None, Result]
SLICE = 0.025  # seconds; with the unit that is begun before they are over, far below 0.05


def sliced(units: Steps[Result], seconds: float = SLICE) -> Steps[Result]:
    """Go through `units`, but pause only when `seconds` are over; return what they return.

    Closing it closes `units`, too.
    """
    try:
        while True:
            start = perf_counter()
            next(units)
            while perf_counter() - start < seconds:
                next(units)
            yield
    except StopIteration as end:
        return end.value
    finally:
        units.close()


def finish(steps: Steps[Result]) -> Result:
    """Go through all steps without a pause; return what they return."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
