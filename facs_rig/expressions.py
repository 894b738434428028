"""Expressions as files, and new ones out of old: random, mirrored, blended.

An expression file is JSON, so that it can be read, versioned and sent by mail:

    {"format": "sketch-to-face expression", "version": 2,
     "aus": {"smile": 4.5, "squint": 2}, "head": {"yaw": 10, "pitch": 0, "roll": 0},
     "neck": {...}, "gaze": {"yaw": 0, "pitch": -5}}

Intensities run from 0 to 10, angles are degrees. What is missing is neutral; `identity` is there
only if the expression was saved together with the person.
"""

from __future__ import annotations

import json
import math
import stat
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .common.errors import InputError
from .common.files import reason_of, write_text
from .controls import CONTROL_NAMES, FULL_INTENSITY
from .identity import EARLIER, check_identity
from .parameters import ANGLES, FaceParameters, intensities, nearest

FORMAT = "sketch-to-face expression"
VERSION = 2  # faces of version 1 had nothing of identity.EARLIER
SUFFIX = ".json"
LARGEST = 1_000_000  # bytes; an expression with everything in it has some 5,000
DIGITS = 6  # decimals in files: 1e-6 degrees move no vertex by more than some nanometres

# Degrees that a file may hold: whatever a bone can be turned to, and what an eye can bear.
TURNS = {"head": ANGLES, "neck": ANGLES, "gaze": ANGLES[:2]}
WIDEST = {"head": 180.0, "neck": 180.0, "gaze": 60.0}


# --- files ----------------------------------------------------------------------------------------


def dumps(parameters: FaceParameters) -> str:
    """The text of an expression file. InputError (one sentence) for what no face can do."""
    content = check(parameters)
    return json.dumps({"format": FORMAT, "version": VERSION, **content}, indent=2) + "\n"


def check(parameters: FaceParameters) -> dict[str, dict[str, float]]:
    """The plain content of a file; InputError (one sentence) for what no face can do."""
    plain, content = parameters.to_json(), {}
    content["aus"] = {name: _number(name, value) for name, value in plain["aus"].items()}
    for part in TURNS:
        content[part] = {a: _number(f"{part} {a}", v) for a, v in plain[part].items()}
    if plain["identity"]:
        content["identity"] = {n: _number(n, v) for n, v in plain["identity"].items()}
    _checked(content)
    return content


def loads(text: str) -> FaceParameters:
    """The expression of a file's text; InputError with one sentence for anything else.

    Refused are texts that are no JSON or no expression, files of a newer version, unknown names
    (with the nearest known one), values that are no number or outside their range.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError("this is not an expression file: it is not JSON") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError(f'this is not an expression file: it lacks "format": "{FORMAT}"')
    version = content.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise InputError("this is not an expression file: its version is missing")
    if version > VERSION:
        raise InputError(
            f"this expression was saved by a newer Sketch to Face (format {version}, this one "
            f"knows {VERSION}); update the add-on"
        )
    parameters = _checked(content)
    if version < VERSION and parameters.identity:
        parameters = replace(parameters, identity={**EARLIER, **parameters.identity})
    return parameters


def write(path: str | Path, parameters: FaceParameters) -> None:
    """Write an expression file, whole or not at all. InputError (one sentence) if that fails."""
    write_text(path, dumps(parameters))


def read(path: str | Path) -> FaceParameters:
    """The expression in a file; InputError with one sentence that names the file."""
    path = Path(path)
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            raise InputError("this is not an expression file: it is no file at all")
        if about.st_size > LARGEST:
            raise InputError("this is not an expression file: it is far too large")
        return loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {reason_of(error)}") from None
    except UnicodeDecodeError:
        raise InputError(f"'{path}': this is not an expression file: it is not text") from None
    except InputError as error:
        raise InputError(f"'{path}': {error}") from None


def _number(name: str, value: Any) -> float:
    """A finite number, rounded; InputError names what it was meant for."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InputError(f"'{name}' has no number: {json.dumps(value, default=str)[:40]}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"'{name}' is {number}, which is not a value that a face can have")
    return round(number, DIGITS) + 0.0  # no -0.0


def _checked(content: Mapping[str, Any]) -> FaceParameters:
    """The parameters in the content of a file of this version."""
    parts = ("aus", "identity", *TURNS)
    for name in content:
        if name not in (*parts, "format", "version"):
            raise InputError(f"an expression has no part '{name}'{nearest(name, parts)}")
    tables: dict[str, dict[str, float]] = {}
    for part in parts:
        table = content.get(part, {})
        if not isinstance(table, dict):
            raise InputError(f"'{part}' must be a table of names and numbers")
        known = TURNS.get(part)
        for name in table:
            if known and name not in known:
                raise InputError(f"'{part}' has no angle '{name}'; it has {', '.join(known)}")
        label = f"{part} " if known else ""
        tables[part] = {name: _number(label + name, value) for name, value in table.items()}
    for part, widest in WIDEST.items():
        for name, value in tables[part].items():
            if abs(value) > widest:
                raise InputError(f"{part} {name} = {value:g} is outside {-widest:g} to {widest:g}")
    intensities(tables["aus"])
    check_identity(tables["identity"])
    return FaceParameters.from_json(tables)


# --- new expressions ------------------------------------------------------------------------------


def mirrored(aus: Mapping[str, float]) -> dict[str, float]:
    """The same expression with the face's left and right exchanged."""
    return {_other_side(name): float(value) for name, value in aus.items()}


def blend(a: Mapping[str, float], b: Mapping[str, float], t: float) -> dict[str, float]:
    """From `a` (t = 0) to `b` (t = 1) in straight lines; controls that end at 0 are left out."""
    names = [name for name in CONTROL_NAMES if name in a or name in b]
    mixed = {name: (1 - t) * a.get(name, 0.0) + t * b.get(name, 0.0) for name in names}
    return {name: float(value) for name, value in mixed.items() if value}


# How often a face does something, as against 1 for the rest; one-sided actions are rarer still.
OFTEN = {"smile": 3.0, "frontalis": 2.5, "brow_furrow": 2.5, "jaw_open": 2.0, "squint": 2.0,
         "frown": 2.0, "medialis_frontalis": 1.5, "outer_squint": 1.5, "lid_raise": 1.5,
         "cheek_suck": 0.4, "nostril_compress": 0.4, "cheek_puff": 0.5}  # fmt: skip
SELDOM = 0.35

_LIPS = ("purse", "lip_loosen", "lip_lock", "lip_tighten")  # what the ring around the mouth does
# Actions that no face does together, or that are two words for one thing. A whole group excludes
# its own members from each other; `lip_lock` and the like stand for their upper and lower halves.
EXCLUDING: tuple[tuple[str, ...], ...] = (
    ("frontalis", "medialis_frontalis"), ("frontalis", "outer_frontalis"),
    ("lid_raise", "blink"), ("lid_raise", "squint"), ("blink", "squint"),
    ("nostril_flare", "nostril_compress"), ("sneer", "nasolabial_deepen"),
    ("cheek_puff", "cheek_suck"), ("cheek_puff", "jaw_open"), ("cheek_puff", "lip_loosen"),
    ("cheek_puff", "smile"), ("cheek_puff", "lower_lip_depress"), ("cheek_puff", "sneer"),
    _LIPS,
    ("smile", "frown"), ("smile", "purse"), ("smile", "lip_loosen"),
    ("grimace", "purse"), ("grimace", "lip_loosen"), ("grimace", "pucker"),
    ("purse", "pucker"), ("pucker", "lip_loosen"), ("frown", "lip_loosen"),
    ("jaw_open", "lip_lock"), ("jaw_open", "lip_tighten"), ("jaw_open", "shrug"),
    ("shrug", "lower_lip_depress"), ("shrug", "lip_loosen"), ("shrug", "lip_tighten"),
    ("lower_lip_depress", "lip_lock"), ("lower_lip_depress", "lip_tighten"),
    ("sneer", "lip_lock"), ("sneer", "lip_tighten"),
)  # fmt: skip


def random_expression(rng: np.random.Generator, count: int | None = None) -> dict[str, float]:
    """A plausible expression: a few controls, 1 to 5, that one face can do at the same time.

    Never both a symmetric action and one of its sides, never two that contradict each other
    (EXCLUDING), such as a blink and raised lids. `count` is the most controls that it has, 3 to 5
    if not given. Fewer come out when nothing is left that fits. InputError if it is negative.
    """
    count = int(rng.integers(3, 6)) if count is None else count
    if count < 0:
        raise InputError(f"an expression cannot have {count} controls")
    chosen: dict[str, float] = {}
    while len(chosen) < count:
        left = [name for name in CONTROL_NAMES if not any(_exclude(name, c) for c in chosen)]
        if not left:
            break
        odds = np.array([_odds(name) for name in left])
        name = left[int(rng.choice(len(left), p=odds / odds.sum()))]
        value = FULL_INTENSITY if "blink" in name else rng.uniform(1, FULL_INTENSITY)
        chosen[name] = round(float(value), 1)
    return {name: chosen[name] for name in CONTROL_NAMES if name in chosen}


def _odds(name: str) -> float:
    seldom = SELDOM if _action(name) != name or name.startswith(("jaw_l", "jaw_r", "jaw_f")) else 1
    return OFTEN.get(_action(name), 1.0) * seldom


def _action(name: str) -> str:
    """A control's action without its side or its half of the lips."""
    for end in ("_left", "_right", "_upper", "_lower"):
        whole = name.removesuffix(end)
        if whole != name and whole in CONTROL_NAMES:
            return whole
    return name


def _other_side(name: str) -> str:
    for here, there in (("_left", "_right"), ("_right", "_left")):
        if name.endswith(here):
            return name.removesuffix(here) + there
    return name


def _exclude(a: str, b: str) -> bool:
    a, b = _action(a), _action(b)
    if a == b or {a, b} == {"jaw_left", "jaw_right"}:
        return True
    return any(a in group and b in group for group in EXCLUDING)
