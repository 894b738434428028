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
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from string import ascii_lowercase, ascii_uppercase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .common.errors import InputError
from .controls import CONTROL_NAMES

# What an expression may use beside the controls (0 to 10) and the keys before its own: where the
# eyes look (degrees), how deep creases are, how far the identity's lids are closed at rest.
PROPERTIES = ("gaze_yaw", "gaze_pitch", "crease_gain", "lid_rest")
LONGEST = 255  # characters that a driver's expression may have in Blender
READABLE = 2000  # characters of an expression that is evaluated here; ours have some 500
DEEPEST = 30  # brackets in brackets, signs before signs
LARGEST = 1e6  # of the numbers in it
ONE = "1"  # what a number in a sum is a multiple of: no name is spelt like that
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

    The keys are evaluated in their order, so that a key can read those before it. Raises
    InputError, one sentence, for an expression that is more than sums, products, quotients, `min`
    and `max` of two, numbers, controls, PROPERTIES and earlier keys. Nothing of it is executed.
    """
    known = {*CONTROL_NAMES, *PROPERTIES}
    steps: list[tuple[str, _Term]] = []
    for key in keys:
        try:
            steps.append((key.name, _term(parsed(key.expression, known))))
        except InputError as error:
            raise InputError(f"key '{key.name}': {error}") from None
        known.add(key.name)
    names = [key.name for key in keys]

    def values(variables: Mapping[str, Any]) -> NDArray[np.float64]:
        batched = any(isinstance(v, np.ndarray) for v in variables.values())
        functions = {"min": np.minimum, "max": np.maximum} if batched else {"min": min, "max": max}
        scope = {**variables, **functions, ONE: 1.0}
        for name, term in steps:
            scope[name] = term(scope)
        found = [scope[name] for name in names]
        return np.array(np.broadcast_arrays(*found) if batched and found else found, dtype=float)

    return values


def parsed(expression: str, known: Collection[str]) -> ast.expr:
    """The tree of an expression that reads `known` names alone; InputError (one sentence) for one
    that asks for anything but the few operations that drivers need."""
    if len(expression) > READABLE:
        raise InputError(f"an expression has at most {READABLE} characters, not {len(expression)}")
    try:
        tree = ast.parse(expression, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{expression[:60]!r} is no expression") from None
    waiting = [(tree, 0)]
    while waiting:
        node, depth = waiting.pop()
        match node:
            case ast.Constant() if _is_number(node):
                continue
            case ast.Name(id=name) if name in known:
                continue
            case _ if depth == DEEPEST:
                raise InputError(f"an expression is nested at most {DEEPEST} times")
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
                waiting.append((operand, depth + 1))
            case ast.BinOp(op=ast.Add() | ast.Sub(), left=a, right=b):
                waiting += [(a, depth), (b, depth + 1)]  # sums may be long
            case ast.BinOp(op=ast.Mult() | ast.Div(), left=a, right=b):
                waiting += [(a, depth + 1), (b, depth + 1)]
            case ast.Call(func=ast.Name(id="min" | "max"), args=[a, b], keywords=[]):
                waiting += [(a, depth + 1), (b, depth + 1)]
            case _:
                raise InputError(f"an expression may not hold {_text(node)}")
    return tree


def _is_number(node: ast.Constant) -> bool:
    value = node.value
    return isinstance(value, int | float) and type(value) is not bool and abs(value) < LARGEST


def _number(node: ast.Constant) -> float:
    return float(node.value)  # type: ignore[arg-type]


def _text(node: ast.AST) -> str:
    try:
        return repr(ast.unparse(node)[:60])
    except (RecursionError, ValueError):
        return f"a {type(node).__name__}"


_Scope = Mapping[str, Any]
_Term = Callable[[_Scope], Any]


def _term(node: ast.expr) -> _Term:
    """A function from the values of all names to that of a tree which `parsed` let through.

    It gives the very bits that Python gives: in IEEE arithmetic a - b c is a + (-b) c.
    """
    match node:
        case ast.Constant(value=value):
            return lambda scope: value
        case ast.Name(id=name):
            return itemgetter(name)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            inner = _term(operand)
            return lambda scope: -inner(scope)
        case ast.UnaryOp(operand=operand):
            inner = _term(operand)
            return lambda scope: +inner(scope)
        case ast.Call(func=ast.Name(id=function), args=[a, b]):
            first, second = _term(a), _term(b)
            return lambda scope: scope[function](first(scope), second(scope))
        case ast.BinOp(op=ast.Add() | ast.Sub()):
            return _sum(node)
        case ast.BinOp(op=ast.Mult(), left=a, right=b):
            if weighted := _weighted(1, node):
                weight, name = weighted
                return lambda scope: weight * scope[name]
            first = _term(a)
            if isinstance(b, ast.Name):
                name = b.id
                return lambda scope: first(scope) * scope[name]
            second = _term(b)
            return lambda scope: first(scope) * second(scope)
        case ast.BinOp(op=ast.Div(), left=a, right=b):
            first, second = _term(a), _term(b)
            return lambda scope: first(scope) / second(scope)
    raise TypeError(ast.dump(node))


def _sum(node: ast.expr) -> _Term:
    """A sum from left to right; long ones are weighted names, which one loop adds up."""
    parts: list[tuple[int, ast.expr]] = []
    while isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        parts.append((1 if isinstance(node.op, ast.Add) else -1, node.right))
        node = node.left
    first = _term(node)
    weighted = [_weighted(sign, part) for sign, part in reversed(parts)]
    if None not in weighted:
        return lambda scope: _added(first(scope), weighted, scope)
    others = [(sign, _term(part)) for sign, part in reversed(parts)]

    def total(scope: _Scope) -> Any:
        value = first(scope)
        for sign, term in others:
            value = value + term(scope) if sign > 0 else value - term(scope)
        return value

    return total


def _added(value: Any, weighted: Sequence[Any], scope: _Scope) -> Any:
    for weight, name in weighted:
        value = value + weight * scope[name]
    return value


def _weighted(sign: int, node: ast.expr) -> tuple[float, str] | None:
    """The weight and the name that a part of a sum is made of (ONE for a number), if it is."""
    match node:
        case ast.Constant(value=float()):  # whole numbers stay whole among each other
            return sign * _number(node), ONE
        case ast.Name(id=name):
            return sign, name
        case ast.BinOp(left=ast.Constant() as number, op=ast.Mult(), right=ast.Name(id=name)):
            return sign * _number(number), name
        case ast.BinOp(left=ast.Name(id=name), op=ast.Mult(), right=ast.Constant() as number):
            return sign * _number(number), name
    return None
