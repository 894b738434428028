"""Which implementation of the loops over a mesh runs: compiled by numba, or plain numpy."""

from __future__ import annotations

import inspect
import os
from functools import cache
from types import SimpleNamespace
from typing import Any

from . import arrays, compiled

SWITCH = "SKETCH2FACE_NUMBA"  # environment variable: 0 does without numba


@cache
def kernels() -> Any:
    """The functions of `compiled`, by numba if it is installed, else those of `arrays`.

    Compiling takes some seconds, once: numba keeps the result on disk.
    """
    return arrays if os.environ.get(SWITCH, "1") == "0" else jitted() or arrays


@cache
def jitted() -> Any:
    """The functions of `compiled` by numba; None where it is not installed."""
    try:
        from numba import njit
    except ImportError:
        return None
    functions = {
        name: function
        for name, function in inspect.getmembers(compiled, inspect.isfunction)
        if function.__module__ == compiled.__name__
    }
    try:
        fast = {n: njit(cache=True, error_model="numpy")(f) for n, f in functions.items()}
    except RuntimeError:  # no folder can be written to
        fast = {n: njit(error_model="numpy")(f) for n, f in functions.items()}
    return SimpleNamespace(**fast)
