"""Shape keys and the expressions that drive them, the same in numpy and in Blender.

A pose is the neutral face plus the sum of its keys, each with a value. Most keys are controls and
their value is simply the slider; the others see to it that combinations stay sane (lids that
follow the eye and never cross, lips that meet instead of passing through each other) or raise
creases. Their values are written as expressions in Blender's driver language, from the sliders
and a few properties of the face, so that numpy and Blender evaluate the very same text.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# What an expression may use beside the controls (0 to 10): where the eyes look (degrees), how
# deep creases are, and how far the identity's lids are closed at rest (1 is closed).
PROPERTIES = ("gaze_yaw", "gaze_pitch", "crease_gain", "lid_rest")
LONGEST = 255  # characters that a driver's expression may have in Blender


@dataclass(frozen=True)
class Key:
    """One shape key: its name and the expression of its value (see `variables_of`)."""

    name: str
    expression: str


def variables_of(expression: str) -> tuple[str, ...]:
    """Names that an expression reads, sorted, without the functions min and max."""
    names = {n.id for n in ast.walk(ast.parse(expression, mode="eval")) if isinstance(n, ast.Name)}
    return tuple(sorted(names - {"min", "max"}))


def compile_keys(keys: Sequence[Key]) -> Callable[[Mapping[str, Any]], NDArray[np.float64]]:
    """A function from the variables' values to the keys' values (k,), or (k, b) for arrays (b,)."""
    code = compile(f"({''.join(f'{key.expression},' for key in keys)})", "<keys>", "eval")
    functions = {"__builtins__": {}, "min": np.minimum, "max": np.maximum}
    plain = {"__builtins__": {}, "min": min, "max": max}

    def values(variables: Mapping[str, Any]) -> NDArray[np.float64]:
        batched = any(isinstance(v, np.ndarray) for v in variables.values())
        found = eval(code, functions if batched else plain, dict(variables))  # noqa: S307
        return np.array(np.broadcast_arrays(*found) if batched and found else found, dtype=float)

    return values
