"""What follows from one object alone, worked out when it is first asked for and kept with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

__all__ = ["derived", "forget"]

Owner = TypeVar("Owner")
Value = TypeVar("Value")
KEPT = "_derived"  # attribute of the owner: function -> what it found


def derived(function: Callable[[Owner], Value]) -> Callable[[Owner], Value]:
    """A function of an object that does not change, a rig say, as if it were its cached property.

    For what belongs to another room than the object's own class. It goes when the object goes.
    """

    @wraps(function)
    def kept(owner: Owner) -> Value:
        found: dict[Any, Any] = vars(owner).setdefault(KEPT, {})
        if function not in found:
            found[function] = function(owner)
        return found[function]

    return kept


def forget(owner: object) -> None:
    """Keep nothing of what was derived: of a copy that has become something else."""
    vars(owner)[KEPT] = {}
