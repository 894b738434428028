"""Where the rims of an open mouth are: what is filled between the lips ends there.

Who draws a laugh as a black shape draws no lips, and its outline looks like theirs. Networks find
the mouth, and put lips where its rims are; that something is filled tells one from the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS, Camera, FaceRig

from .lines import HEAD, Lines
from .pull import Held

if TYPE_CHECKING:
    from .shape import Observations

__all__ = ["held_rims", "rims_of", "with_rims", "without_teeth"]

COLUMNS = (
    ("lip_inner_upper_right", "lip_inner_lower_right", "lip_peak_right", "lip_lower_inner_right"),
    ("lip_inner_top", "lip_inner_bottom", "lip_top", "lip_bottom"),
    ("lip_inner_upper_left", "lip_inner_lower_left", "lip_peak_left", "lip_lower_inner_left"),
)
"""The rim above and below, and the borders of the lips outside of them, from right to left."""
CORNERS = ("mouth_corner_right", "mouth_corner_left")
RIMS = tuple(column[:2] for column in COLUMNS)
BESIDE = 0.1
"""Of the mouth's width: so far beside a column the outline of what is filled belongs to it."""
ROOM = 0.35
"""Of the height between the lips' borders: so far outside of them it may lie."""
HIGH = 0.3
"""Of that height, what must be filled; less is the line between the lips."""
HELD = 0.4
"""Of the error of the distance between the rims, what lines may move each of them."""
PARTED = 0.15
"""Of that height, how far apart the rims must have been found: dark lips are filled, too."""

WIDE = 0.25
"""Of the mouth's width: rims that are so far apart are those of no mouth that is drawn shut."""
BESIDE_RIMS = 0.2
"""Of the height between the rims: what lies so near one of them may be the rim."""


def without_teeth(drawn: Lines, observed: Observations) -> Lines:
    """The lines of a drawing without those well between the rims of a mouth that is drawn wide
    open: they are of teeth and tongue, and no lip is to lie on them."""
    marks = observed.landmarks
    names = (*CORNERS, *sum(RIMS, ()))
    if not observed.gap or not len(drawn.points) or not set(names) <= set(marks):
        return drawn
    right, left = (np.asarray(marks[name], float) for name in CORNERS)
    width = max(float(np.hypot(*(left - right))), 1e-9)
    across = (left - right) / width
    down = np.array([-across[1], across[0]])
    gaps = [np.subtract(marks[lower], marks[upper]) @ down for upper, lower in RIMS]
    if np.mean(gaps) < WIDE * width:
        return drawn
    at, high = (drawn.points - right) @ across, (drawn.points - right) @ down
    rims = []
    for edge in (0, 1):
        line = np.array([[0, 0], *(np.subtract(marks[pair[edge]], right) for pair in RIMS),
                         left - right], float)  # fmt: skip
        rims.append(np.interp(at, line @ across, line @ down))
    upper, lower = rims
    beside = BESIDE_RIMS * (lower - upper)
    inside = (at > 0) & (at < width) & (high > upper + beside) & (high < lower - beside)
    return drawn.some(~inside)


def with_rims(observed: Observations, drawn: Lines) -> Observations:
    """Observations whose landmarks on the rims lie at the ends of what is filled between the lips,
    and whose borders of the lips say nothing where that leaves no room for a lip."""
    marks = observed.landmarks
    names = {*CORNERS, *(name for column in COLUMNS for name in column)}
    if drawn.border is None or not drawn.border.any() or not names <= set(marks):
        return observed
    right, left = (np.asarray(marks[name], float) for name in CORNERS)
    width = float(np.hypot(*(left - right)))
    if width < 1:
        return observed
    across = (left - right) / width
    down = np.array([-across[1], across[0]])
    edge = drawn.points[drawn.border] - right
    u, v = edge @ across, edge @ down
    moved: dict[str, tuple[float, float]] = {}
    silent: set[str] = set()
    for column in COLUMNS:
        places = [np.asarray(marks[name], float) - right for name in column]
        inner, lower_inner, outer, lower_outer = (float(place @ down) for place in places)
        high = lower_outer - outer
        if high <= 0 or lower_inner - inner < PARTED * high:
            return observed
        at = float(np.mean([place @ across for place in places[:2]]))
        near = (np.abs(u - at) < BESIDE * width) & (
            (v > outer - ROOM * high) & (v < lower_outer + ROOM * high)
        )
        if not near.any() or np.ptp(v[near]) < HIGH * high:
            return observed
        top, bottom = float(v[near].min()), float(v[near].max())
        for name, place, rim, border, beyond, way in (
            (column[0], inner, top, column[2], outer, -1),
            (column[1], lower_inner, bottom, column[3], lower_outer, 1),
        ):
            if way * (rim - place) > 0:
                point = right + at * across + rim * down
                moved[name] = float(point[0]), float(point[1])
            if way * (beyond - rim) < BESIDE * high:
                silent.add(border)
    kept = {name: place for name, place in marks.items() if name not in silent}
    return replace(observed, landmarks={**kept, **moved})


def rims_of(
    names: Sequence[str], places: NDArray[np.floating]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Which of some landmarks (m, 2) are the rims of the mouth, (2, 3) above and below, and the
    unit vector (2,) down across it. If they are not all among them, (2, 0)."""
    known = {name: k for k, name in enumerate(names)}
    if not {*CORNERS, *sum(RIMS, ())} <= known.keys():
        return np.zeros((2, 0), np.intp), np.array([0.0, 1.0])
    right, left = (places[known[name]] for name in CORNERS)
    across = (left - right) / max(float(np.hypot(*(left - right))), 1e-9)
    rims = np.array([[known[name] for name in pair] for pair in RIMS], np.intp).T
    return rims, np.array([-across[1], across[0]])


def held_rims(
    rig: FaceRig, posed: NDArray[np.floating], camera: Camera, observed: Observations
) -> Held:
    """The rims of a posed face's mouth (n, 3), as far from each other as they were seen: each goes
    half the way. Nothing if nothing is known of their distance."""
    names = list(observed.landmarks)
    places = np.array([observed.landmarks[name] for name in names]).reshape(-1, 2)
    rims, down = rims_of(names, places)
    if not observed.gap or not rims.size:
        return Held.nothing()
    index = rig.landmarks[[LANDMARKS.index(pair[edge]) for edge in (0, 1) for pair in RIMS]]
    here = camera.project(posed[index]).reshape(2, -1, 2)
    short = (places[rims[1]] - places[rims[0]] - (here[1] - here[0])) @ down
    moves = np.concatenate([-short / 2, short / 2])
    return Held(index, np.tile(down, (len(index), 1)), moves, HELD * observed.gap * HEAD)
