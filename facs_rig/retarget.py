"""An expression on other rigs: which convention a mesh's shape keys follow, and their values.

Names are seldom written as a convention has them: `head_jawOpen`, `jawOpen.001`, `mouthSmile_L`,
`MOUTH_SMILE_LEFT` all are met. They are compared without case and separators, the side may be
spelled in any usual way and stand anywhere, and further words before and after are allowed. What
can be read in two ways is refused rather than guessed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from .common.errors import InputError
from .controls import CONTROL_NAMES, FULL_INTENSITY
from .conventions import CONVENTIONS, Convention
from .parameters import intensities, nearest

_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+")
_SIDE = re.compile(r"(.+?)(Left|Right|(?<=_)left|(?<=_)right|L|R|(?<=_)l|(?<=_)r)$")
_SIDES = {"left": ("left", "l"), "right": ("right", "r")}
_SIDE_WORDS = {word for words in _SIDES.values() for word in words}
SHORT = 1  # letters: VRM's vowels; among other words these would be found everywhere


@dataclass(frozen=True)
class Recognised:
    """What is known of a mesh's shape keys.

    found : the convention's key -> the mesh's name of it
    missing : keys of the convention that the mesh does not have
    ambiguous : those of the missing ones that several names fit equally well -> these names
    """

    convention: Convention
    found: dict[str, str]
    missing: tuple[str, ...]
    ambiguous: dict[str, tuple[str, ...]]


def recognise(names: Iterable[str]) -> Recognised:
    """Which convention the names of a mesh's shape keys follow: the one with most keys among them.

    Between equals the one with least around its names decides, then the one whose names are there
    letter for letter: `jawOpen` alone is ARKit's, `jaw_open` ours.
    InputError, one sentence, if they follow none.
    """
    names = list(dict.fromkeys(names))
    best = (0, 0, 0)
    chosen: Recognised | None = None
    unsure: dict[str, tuple[str, ...]] = {}
    for convention in CONVENTIONS.values():
        recognised, surplus = _read_all(names, convention)
        unsure = unsure or recognised.ambiguous
        literally = sum(key in name for key, name in recognised.found.items())
        score = (len(recognised.found), -surplus, literally)
        if recognised.found and (chosen is None or score > best):
            best, chosen = score, recognised
    if chosen is not None:
        return chosen
    for key, alike in unsure.items():
        raise InputError(f"{_quoted(alike)} could all be '{key}'; rename all but one of them")
    known = ", ".join(convention.label for convention in CONVENTIONS.values())
    raise InputError(f"none of its {len(names)} shape keys has a name of {known}")


def retarget(aus: Mapping[str, float], convention: str) -> dict[str, float]:
    """Key of the convention -> its value for an expression, 0 to 1, keys at rest included.

    aus : control -> intensity 0 to 10; 5 alone gives a key of weight 1 the value 1
    Raises InputError for unknown conventions, unknown controls and intensities out of range.
    """
    if convention not in CONVENTIONS:
        hint = nearest(convention, tuple(CONVENTIONS)) or f"; there are {', '.join(CONVENTIONS)}"
        raise InputError(f"there is no convention '{convention}'{hint}")
    intensities(aus)  # refuses what no face can do
    full = {name: float(value) / FULL_INTENSITY for name, value in aus.items()}
    return {
        key: min(sum(weight * full.get(name, 0.0) for name, weight in weights.items()), 1.0)
        for key, weights in CONVENTIONS[convention].keys.items()
    }


def unshown(
    aus: Mapping[str, float], convention: Convention, found: Collection[str]
) -> tuple[str, ...]:
    """The active controls of an expression that none of the keys `found` shows anything of."""
    shown = {name for key in found for name in convention.keys.get(key, ())}
    return tuple(name for name in CONTROL_NAMES if aus.get(name, 0) > 0 and name not in shown)


# --- names ----------------------------------------------------------------------------------------


def _words(name: str) -> list[str]:
    """`Key_mouthSmileLeft.001` -> key, mouth, smile, left, 001."""
    return [word.lower() for word in _WORDS.findall(name)]


def _spellings(key: str, prefix: str) -> set[str]:
    """Every way to write a key, without case and separators."""
    name = key.removeprefix(prefix)
    match = _SIDE.match(name)
    if match is None:
        return {"".join(_words(name))}
    stem = _words(match[1])
    return {
        "".join((*stem[:k], word, *stem[k:]))
        for word in _SIDES["left" if match[2][0] in "Ll" else "right"]
        for k in range(len(stem) + 1)
    }


def _dictionary(convention: Convention) -> dict[str, str]:
    """Spelling -> key; spellings that two keys share are left out."""
    pairs = [(spelling, key) for key in convention.keys
             for spelling in _spellings(key, convention.prefix)]  # fmt: skip
    often = Counter(spelling for spelling, _ in pairs)
    return {spelling: key for spelling, key in pairs if often[spelling] == 1}


def _read(name: str, spelled: Mapping[str, str], prefix: list[str]) -> tuple[str, int] | None:
    """The key that a mesh's name stands for and the number of further words; None if unsure."""
    words = _words(name)
    hits = [(i, j, spelled[text]) for i in range(len(words)) for j in range(i + 1, len(words) + 1)
            if (text := "".join(words[i:j])) in spelled]  # fmt: skip
    # The longest reading counts: `mouthFunnelUL` is not also a shorter key that lies inside it.
    outer = [h for h in hits if not any(o != h and o[0] <= h[0] and h[1] <= o[1] for o in hits)]
    if len(outer) != 1:
        return None  # nothing, or a corrective such as `jawOpen_mouthClose`
    i, j, key = outer[0]
    rest = words[:i] + words[j:]
    if _SIDE_WORDS.intersection(rest):
        return None  # one half of a key that has no sides
    if len("".join(words[i:j])) <= SHORT and not all(word.isdigit() for word in rest):
        return None
    if prefix and words[:i][-len(prefix) :] == prefix:
        rest = rest[len(prefix) :]
    return key, len(rest)


def _read_all(names: list[str], convention: Convention) -> tuple[Recognised, int]:
    """What the names are in one convention, and how many further words they have."""
    spelled, prefix = _dictionary(convention), _words(convention.prefix)
    candidates: dict[str, list[tuple[tuple[bool, int], str]]] = {}
    for name in names:
        read = _read(name, spelled, prefix)
        if read is not None:
            key, surplus = read
            candidates.setdefault(key, []).append(((name != key, surplus), name))
    found, ambiguous, total = {}, {}, 0
    for key in convention.keys:
        ranked = sorted(candidates.get(key, []))
        if not ranked:
            continue
        closest = [name for rank, name in ranked if rank == ranked[0][0]]
        if len(closest) == 1:
            found[key] = closest[0]
            total += ranked[0][0][1]
        else:
            ambiguous[key] = tuple(closest)
    missing = tuple(key for key in convention.keys if key not in found)
    return Recognised(convention, found, missing, ambiguous), total


def _quoted(names: Iterable[str]) -> str:
    *first, last = [f"'{name}'" for name in names]
    return f"{', '.join(first)} and {last}"
