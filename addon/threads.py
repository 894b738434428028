"""Work of many small matrices runs on one thread.

BLAS starts as many threads as there are cores, for matrices of any size; those of a fit are so
small that the threads wait for each other longer than they compute. Within Blender numpy is loaded
before us, so that no environment variable can say so.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def on_one_thread(work: Callable[P, R]) -> Callable[P, R]:
    """`work` with BLAS limited to one thread as long as it runs; then as it was before."""

    @wraps(work)
    def limited(*arguments: P.args, **named: P.kwargs) -> R:
        from threadpoolctl import threadpool_limits

        # Looked up at each call: a library may have been loaded since (a millisecond).
        with threadpool_limits(limits=1, user_api="blas"):
            return work(*arguments, **named)

    return limited
