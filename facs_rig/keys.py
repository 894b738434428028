"""Shape keys and the expressions that drive them, the same in numpy and in Blender.

A pose is the neutral face plus the sum of its keys, each with a value. Most keys are controls and
their value is simply the slider; the others see to it that combinations stay sane (lids that
follow the eye and never cross, lips that meet instead of passing through each other) or raise
creases. Their values are written as expressions in Blender's driver language, from the sliders,
a few properties of the face and earlier keys, so that numpy and Blender evaluate the same text.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from string import ascii_lowercase, ascii_uppercase
from typing import Any

import numpy as np
from numpy.typing import NDArray

# What an expression may use beside the controls (0 to 10) and the keys before its own: where the
# eyes look (degrees), how deep creases are, how far the identity's lids are closed at rest.
PROPERTIES = ("gaze_yaw", "gaze_pitch", "crease_gain", "lid_rest")
LONGEST = 255  # characters that a driver's expression may have in Blender
_FUNCTIONS = ("min", "max")


@dataclass(frozen=True)
class Key:
    """One shape key: its name and the expression of its value (see `variables_of`)."""

    name: str
    expression: str


def variables_of(expression: str) -> tuple[str, ...]:
    """Names that an expression reads, in the order of their first use: controls, PROPERTIES or
    names of earlier keys."""
    names = (n.id for n in ast.walk(ast.parse(expression, mode="eval")) if isinstance(n, ast.Name))
    return tuple(dict.fromkeys(n for n in names if n not in _FUNCTIONS))


def abbreviated(expression: str) -> tuple[str, dict[str, str]]:
    """The expression with names of one letter (up to 52 of them), and what they stand for.

    A driver's expression has room for LONGEST characters, and its variables may be called as one
    likes.
    """
    names = variables_of(expression)
    alias = dict(zip(names, (*ascii_lowercase, *ascii_uppercase), strict=False))
    text = re.sub(r"[A-Za-z_]\w*", lambda m: alias.get(m.group(), m.group()), expression)
    return text, {alias[name]: name for name in names}


def compile_keys(
    keys: Sequence[Key],
) -> Callable[[Mapping[str, Any]], NDArray[np.float64]]:
    """A function from the variables' values to the keys' values (k,), or (k, b) for arrays (b,).

    The keys are evaluated in their order, so that a key can read those before it.
    """
    lines = "\n".join(f"{key.name} = {key.expression}" for key in keys)
    code = compile(lines, "<keys>", "exec")
    names = [key.name for key in keys]

    def values(variables: Mapping[str, Any]) -> NDArray[np.float64]:
        batched = any(isinstance(v, np.ndarray) for v in variables.values())
        functions = {"min": np.minimum, "max": np.maximum} if batched else {"min": min, "max": max}
        scope = {"__builtins__": {}, **functions, **variables}
        exec(code, scope)
        found = [scope[name] for name in names]
        return np.array(np.broadcast_arrays(*found) if batched and found else found, dtype=float)

    return values
