"""Settings as data: fields of a dataclass that say what they are called and which values they take.

Whoever checks them, asks for them on a command line or shows them in a panel reads the same field.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import Field, field, fields
from numbers import Integral, Real
from typing import Any

from .errors import InputError


def setting(
    default: Any,
    label: str = "",
    help: str = "",
    unit: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] | None = None,
    above: float | None = None,
) -> Any:
    """A field of a dataclass. minimum, maximum : the least and the most of a number
    above : instead of a minimum, what the number is more than"""
    about = {
        "label": label,
        "help": help,
        "unit": unit,
        "minimum": minimum,
        "maximum": maximum,
        "choices": choices,
        "above": above,
    }
    return field(default=default, metadata=about)


def settings_of(kind: type) -> dict[str, Field[Any]]:
    """The settings among the fields of a dataclass, by name."""
    return {item.name: item for item in fields(kind) if "label" in item.metadata}


def describe(kind: type) -> Iterator[tuple[str, type, Any, dict[str, Any]]]:
    """Yield (name, type, default, metadata) of every setting of a dataclass, in its order."""
    for name, item in settings_of(kind).items():
        yield name, type(item.default), item.default, dict(item.metadata)


def check_settings(holder: Any, whose: str = "") -> None:
    """Raise InputError, one sentence, unless every setting of the dataclass can have its value.

    whose : goes before the name of a setting that has no label
    """
    for item in fields(holder):
        if "label" not in item.metadata:
            continue
        value = getattr(holder, item.name)
        if fault := _fault(item, value):
            label = item.metadata["label"]
            name = f"{label} ({item.name})" if label else whose + item.name
            raise InputError(f"{name} {fault}.")


def _fault(item: Field[Any], value: Any) -> str:
    """What is wrong with a value, after the setting's name; empty if nothing is."""
    about, kind = item.metadata, type(item.default)
    if kind is bool:
        return "" if isinstance(value, bool) else f"is either true or false, not {value!r}"
    if kind is str:
        choices = about["choices"]
        fits = choices is None or value in choices
        return "" if fits else f"is one of {', '.join(choices)}, not {value!r}"
    # the common kinds first: asking for Real takes longer than all the rest
    number = type(value) in (kind, int) or (
        isinstance(value, Integral if kind is int else Real) and not isinstance(value, bool)
    )
    if not number or not math.isfinite(value):
        return f"is {'a whole number' if kind is int else 'a number'}, not {value!r}"
    low, high, above = about["minimum"], about["maximum"], about["above"]
    unit = f" {about['unit']}" if about["unit"] else ""
    if above is not None and not above < value <= high:
        return f"is more than {above:g} and at most {high:g}{unit}, not {value:g}"
    if low is not None and not low <= value <= high:
        return f"lies between {low:g} and {high:g}{unit}, not at {value:g}"
    return ""
