"""Where a face may crease: curves drawn on the face's left, and what people have in their place.

Every group of creases is a set of lines. Some are there on everybody in particular's nobody, the
default person; others come with more lines than that. And each line may lie elsewhere, be shorter
or longer, fork, break or be doubled: its ways. A person has a mix of all of them (facs_rig.folds).
Places are in cm seen from the front of the face that creases there (see facs_rig.anatomy).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Crease:
    """points in cm; depth and half-width in mm.

    `fade` is the share of the length over which each end fades; 0 keeps an end deep, as where a
    line goes on across the middle of the face. `lift` in mm raises the skin on the crease's outer
    side, away from the middle of the face, as where the cheek is pushed over its edge: a fold.
    `span` is the part of the curve that is creased, from 0 to 1; beyond these it goes on straight.
    """

    points: Points
    depth: float
    width: float = 1.8
    fade: tuple[float, float] = (0.3, 0.3)
    lift: float = 0.0
    span: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True)
class Line:
    """A line of a group.

    since : the `number` of lines, from -1 to 1, at which a person has it; the default person has
        number 0
    step : cm outward and up that it may lie elsewhere; ways : which of WAYS it has beside "plain"
    """

    crease: Crease
    since: float = -9.0
    step: tuple[float, float] = (0.0, 0.0)
    ways: tuple[str, ...] = ()
    branch: str = "fork"


# What a line may be instead: itself, farther out or up, farther in or down, shorter, longer, and
# with a fork, a break or a double.
PLAIN, FAR, NEAR, SHORT, LONG, BRANCHED = "plain", "far", "near", "short", "long", "branched"
WAYS = (PLAIN, FAR, NEAR, SHORT, LONG, BRANCHED)


def _worry(y: float, reach: float, arch: float = 0.25, depth: float = 1.3) -> Crease:
    points = ((0.0, y), (reach * 0.35, y + arch * 0.5), (reach * 0.7, y + arch), (reach, y - 0.1))
    return Crease(points, depth, 1.9, (0.0, 0.35))


def _centre(y: float, depth: float = 1.3) -> Crease:
    points = ((0.0, y), (0.7, y - 0.18), (1.5, y - 0.62), (2.0, y - 1.0))
    return Crease(points, depth, 1.8, (0.0, 0.4))


def _lip(x: float, depth: float = 0.8) -> Crease:
    return Crease(((x, -5.65), (x * 1.25, -5.1)), depth, 1.3)


_ALL = (FAR, NEAR, SHORT, LONG, BRANCHED)
_PLACE = (FAR, NEAR)
_UP, _OUT = (0.0, 0.42), (0.22, 0.0)
_FAN = (0.2, 0.5)  # of crow's feet: they fade outward

LINES: dict[str, tuple[Line, ...]] = {
    "worry": (
        Line(_worry(2.75, 4.4), -0.35, _UP, (*_PLACE, SHORT, BRANCHED), "break"),
        Line(_worry(3.65, 4.8), -9.0, _UP, (*_PLACE, SHORT, BRANCHED), "fork"),
        Line(_worry(4.55, 4.7), -0.65, _UP, (*_PLACE, SHORT, BRANCHED), "break"),
        Line(_worry(5.4, 4.0), -0.2, _UP, (NEAR, SHORT, BRANCHED), "double"),
        Line(_worry(4.15, 3.6, 0.15, 0.9), 0.35, ways=(BRANCHED,), branch="break"),
        Line(_worry(3.2, 3.0, 0.15, 0.8), 0.6),
    ),
    "worry_centre": (
        Line(_centre(3.3), -0.3, _UP, (FAR, SHORT)),
        Line(_centre(4.1), -9.0, _UP, (*_PLACE, SHORT, LONG, BRANCHED), "break"),
        Line(_centre(4.9), -0.5, _UP, (*_PLACE, SHORT)),
        Line(_centre(5.6, 0.9), 0.5),
    ),
    "worry_side": (
        Line(Crease(((2.2, 2.6), (3.5, 3.0), (4.8, 2.5)), 1.1), -9.0, _UP, (FAR, SHORT, BRANCHED)),
        Line(Crease(((2.3, 3.4), (3.6, 3.8), (4.9, 3.2)), 1.0), -0.4, _UP, (FAR, SHORT)),
        Line(Crease(((2.5, 4.2), (3.7, 4.5), (4.8, 3.9)), 0.8), 0.5),
    ),
    "glabella": (
        Line(Crease(((0.50, 0.35), (0.62, 1.3), (0.55, 2.5)), 1.6, 1.9), -0.6, _OUT, _ALL, "break"),
        Line(Crease(((1.05, 0.75), (1.25, 1.6), (1.35, 2.2)), 0.8, 1.6), -0.3, (0.3, 0.0),
             (FAR, LONG, BRANCHED), "double"),
        Line(Crease(((0.0, 0.1), (0.6, 0.12)), 0.9, 1.6, (0.0, 0.5)), -0.45, (0.0, 0.25), (FAR,)),
        # One in the middle, drawn from both sides.
        Line(Crease(((0.0, 0.5), (0.0, 1.4), (0.0, 2.3)), 0.7, 1.8), 0.5, ways=(SHORT,)),
        Line(Crease(((1.6, 1.1), (1.85, 1.7), (1.95, 2.4)), 0.8, 1.7), 0.75),
    ),
    "crow_down": (
        Line(Crease(((4.40, -0.30), (4.95, -0.58), (5.60, -1.00)), 0.9, 1.2, _FAN), -0.6,
             (0.0, 0.2), _ALL, "fork"),
        Line(Crease(((4.30, -0.55), (4.78, -1.05), (5.25, -1.75)), 0.9, 1.2, _FAN), -9.0,
             (0.0, 0.25), _ALL, "fork"),
        Line(Crease(((4.05, -0.80), (4.40, -1.40), (4.65, -2.15)), 0.8, 1.2, _FAN), -0.3,
             (0.2, 0.1), _ALL, "break"),
        Line(Crease(((4.45, -0.10), (5.10, -0.22), (5.75, -0.45)), 0.8, 1.2, _FAN), 0.35),
        Line(Crease(((3.65, -1.00), (3.92, -1.60), (4.02, -2.30)), 0.7, 1.2, _FAN), 0.7),
    ),
    "under_eye": (
        Line(Crease(((1.9, -0.95), (2.5, -1.22), (3.2, -1.25), (3.9, -0.95)), 0.8, 1.4,
                    (0.35, 0.35)), -9.0, (0.0, 0.2), (NEAR, SHORT, BRANCHED), "break"),
        Line(Crease(((1.65, -0.95), (2.1, -1.45), (2.8, -1.75)), 0.8, 1.6, (0.25, 0.5)), 0.3),
    ),
    "crow_up": (
        Line(Crease(((4.50, 0.10), (5.05, 0.42), (5.65, 0.95)), 0.9, 1.2, _FAN), -9.0,
             (0.0, 0.22), _ALL, "fork"),
        Line(Crease(((4.55, -0.15), (5.15, -0.05), (5.85, 0.15)), 0.9, 1.2, _FAN), -0.6,
             (0.0, 0.2), _ALL, "fork"),
        Line(Crease(((4.40, 0.38), (4.80, 0.90), (5.15, 1.55)), 0.8, 1.2, _FAN), -0.3,
             (0.2, 0.0), _ALL, "break"),
        Line(Crease(((4.50, -0.42), (5.05, -0.55), (5.70, -0.65)), 0.8, 1.2, _FAN), 0.35),
    ),
    "bunny": (
        Line(Crease(((0.40, -0.45), (0.85, -0.75), (1.30, -1.40)), 1.3, 1.5), -9.0, (0.0, 0.3),
             _ALL, "fork"),
        Line(Crease(((0.45, -1.20), (0.85, -1.50), (1.25, -2.10)), 1.2, 1.5), -0.5, (0.0, 0.3),
             _ALL, "break"),
        Line(Crease(((0.0, 0.25), (0.6, 0.20)), 1.0, 1.5, (0.0, 0.5)), -0.3, (0.0, 0.3), (NEAR,)),
        Line(Crease(((0.42, -0.82), (0.85, -1.12), (1.25, -1.72)), 0.8, 1.3), 0.4),
    ),
    "nasal": (
        Line(Crease(((1.62, -2.75), (2.02, -3.45), (2.35, -4.4)), 1.5, 2.0, (0.2, 0.5), 0.6),
             -9.0, _OUT, (FAR, SHORT, LONG)),
        Line(Crease(((2.05, -2.75), (2.5, -3.4), (2.8, -4.2)), 0.8, 1.9), 0.4),
    ),
    "nasolabial": (
        Line(Crease(((1.60, -2.85), (2.05, -3.55), (2.6, -4.6), (2.98, -5.7), (3.02, -6.8)),
                    1.5, 1.9, (0.08, 0.55), 1.0), -9.0, _OUT, _ALL, "double"),
        Line(Crease(((2.9, -4.0), (3.4, -4.95), (3.65, -6.1)), 0.9, 1.9), 0.4),
    ),
    "smile_fold": (
        Line(Crease(((1.60, -2.85), (2.3, -3.4), (3.05, -4.25), (3.5, -5.2), (3.55, -6.2),
                     (3.3, -7.0)), 1.5, 1.9, (0.08, 0.5), 1.1), -9.0, _OUT, _ALL, "double"),
        Line(Crease(((2.2, -0.95), (3.1, -1.25), (4.0, -0.95)), 0.6, 1.6), -0.4, (0.0, 0.2),
             (NEAR,)),
        Line(Crease(((3.75, -4.2), (4.25, -5.1), (4.35, -6.2)), 1.0, 1.9, (0.35, 0.4), 0.4), 0.3),
        Line(Crease(((4.45, -4.5), (4.9, -5.4), (4.95, -6.5)), 0.7, 1.9, (0.4, 0.4), 0.3), 0.7),
    ),
    "corner_pinch": (
        Line(Crease(((2.32, -6.1), (2.62, -6.6), (2.62, -7.2), (2.3, -7.7)), 1.0, 2.2, (0.45, 0.45),
                    0.5), -9.0, _OUT, (FAR, SHORT, LONG, BRANCHED), "double"),
        Line(Crease(((3.05, -6.0), (3.35, -6.85), (3.1, -7.75)), 0.7, 2.0, (0.4, 0.4)), 0.3),
    ),
    "marionette": (
        Line(Crease(((2.45, -7.0), (2.75, -7.7), (2.75, -8.5)), 1.2, 2.0, (0.15, 0.5), 0.3),
             -9.0, _OUT, (FAR, SHORT, LONG, BRANCHED)),
        Line(Crease(((3.0, -7.1), (3.25, -7.8), (3.2, -8.5)), 0.8, 1.9), 0.4),
    ),
    "chin_boss": (
        Line(Crease(((0.0, -8.35), (0.9, -8.5), (1.6, -9.1)), 1.4, 1.9, (0.0, 0.4)), -9.0,
             (0.0, 0.25), (NEAR, SHORT, LONG, BRANCHED), "double"),
        Line(Crease(((0.35, -9.2), (0.75, -9.5)), 0.8, 1.6), -0.3, (0.25, 0.1), (FAR,)),
        Line(Crease(((0.1, -9.75), (0.4, -9.95)), 0.7, 1.6), 0.4),
    ),
    "lip_radial": (
        *(Line(_lip(x), since, (0.2, 0.0), (FAR, LONG, BRANCHED))
          for x, since in ((0.5, -0.6), (1.0, -9.0), (1.45, -0.3))),
        Line(_lip(0.75, 0.7), 0.3),
        Line(_lip(1.75, 0.7), 0.6),
    ),
    "corner_fold": (
        Line(Crease(((2.75, -4.9), (3.3, -5.7), (3.65, -6.7), (3.65, -7.6), (3.3, -8.4)), 1.3, 2.0,
                    (0.4, 0.4), 0.7), -9.0, (0.25, 0.0), _ALL, "double"),
        Line(Crease(((4.25, -6.2), (4.5, -7.0), (4.35, -7.8)), 0.6, 2.0, (0.4, 0.4)), 0.2,
             (0.3, 0.0), (FAR,)),
        Line(Crease(((4.8, -6.3), (5.0, -7.0), (4.85, -7.8)), 0.5, 2.0, (0.4, 0.4)), 0.6),
    ),
}  # fmt: skip

# Of the default person.
CREASES: dict[str, tuple[Crease, ...]] = {
    group: tuple(line.crease for line in lines if line.since <= 0) for group, lines in LINES.items()
}


def names_of(group: str) -> Iterator[tuple[str, Line, str]]:
    """The lines of a group in each of their ways: the name of the groove, the line, the way."""
    for k, line in enumerate(LINES[group]):
        for way in (PLAIN, *line.ways):
            yield f"{group} {k} {way}", line, way


def grooves(line: Line, way: str) -> tuple[Crease, ...]:
    """The creases that a line is in one of its ways; ValueError for a way that it has not."""
    crease = line.crease
    if way != PLAIN and way not in line.ways:
        raise ValueError(f"the line has no way '{way}'")
    middle = crease.fade[0] == 0  # it goes on across the middle of the face
    if way in (FAR, NEAR):
        return (_moved(crease, line.step if way == FAR else (-line.step[0], -line.step[1])),)
    if way == SHORT:
        return (replace(crease, span=(0.0, 0.5) if middle else (0.2, 0.75)),)
    if way == LONG:
        return (replace(crease, span=(0.0, 1.3) if middle else (-0.1, 1.35)),)
    if way == BRANCHED:
        return {"fork": _forked, "break": _broken, "double": _doubled}[line.branch](crease)
    return (crease,)


def _moved(crease: Crease, step: tuple[float, float]) -> Crease:
    """The crease elsewhere, in cm; its end in the middle of the face stays there."""
    points = [(x + step[0] * (x != 0), y + step[1]) for x, y in crease.points]
    return replace(crease, points=tuple(points))


def _forked(crease: Crease) -> tuple[Crease, ...]:
    """A second end that leaves the line behind its middle."""
    start, way = _at(crease, 0.5)
    left = np.array([-way[1], way[0]])
    steps = ((0.0, 0.0), (0.2, 0.05), (0.42, 0.17))
    points = tuple(
        (float(p[0]), float(p[1])) for p in (start + a * way + b * left for a, b in steps)
    )
    return crease, replace(
        crease, points=points, depth=0.85 * crease.depth, lift=0.0, fade=(0.35, 0.5)
    )


def _broken(crease: Crease) -> tuple[Crease, ...]:
    """Two parts, the second beside where the first would go on."""
    _, way = _at(crease, 0.55)
    aside = 0.18 * np.array([-way[1], way[0]]) / np.hypot(*way)
    second = replace(crease, span=(0.5, 1.0), fade=(0.3, 0.35), depth=0.85 * crease.depth)
    first = replace(crease, span=(0.0, 0.55), fade=(crease.fade[0], 0.4))
    return first, _moved(second, (float(aside[0]), float(aside[1])))


def _doubled(crease: Crease) -> tuple[Crease, ...]:
    """A fainter, shorter line beside it."""
    _, way = _at(crease, 0.5)
    aside = 0.32 * np.array([-way[1], way[0]]) / np.hypot(*way)
    second = replace(
        crease, span=(0.25, 0.85), fade=(0.35, 0.4), depth=0.6 * crease.depth, lift=0.0
    )
    return crease, _moved(second, (float(aside[0]), float(aside[1])))


def _at(crease: Crease, share: float) -> tuple[NDArray, NDArray]:
    """(2,) cm, the place at a share of the length, and the way to the end as a vector as long as
    the whole line."""
    points = np.array(crease.points)
    length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    place, on = (
        np.array([np.interp(s * length[-1], length, column) for column in points.T])
        for s in (share, share + 0.1)
    )
    way = on - place
    return place, way / np.hypot(*way) * length[-1]
