"""How deep a person's creases are: ink is looked for where the fitted face may crease.

Lines that a face has for its lids, lips, nose and brows are left out, and so is what is as dense as
hatching or hair. What is left along a crease is held against what is found beside all of them, and
against how deep an average person of this age has it in this expression. What all families say
together becomes `wrinkles`, which deepens them alike: a depth for each family says hardly more, and
faces whose families differ have keys of their own, which take long to build.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facs_rig import CONTROLS, LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.common.derived import derived
from facs_rig.common.polylines import arc_lengths, resampled
from facs_rig.folds import REST, REST_FOLDS, SIDES, crease_gain
from facs_rig.grooves import CREASES

from .lines import Lines

__all__ = ["drawn_wrinkles", "found_creases", "likely_wrinkles"]

GROUPS = {
    "worry": ("worry", "worry_centre", "worry_side"),
    "glabella": ("glabella",),
    "crow": ("crow_down", "crow_up", "under_eye"),
    "nasolabial": ("nasolabial", "smile_fold"),
    "corner": ("corner_pinch", "corner_fold", "marionette"),
}
"""Family -> its groups of creases that drawings tell from the lines of eyes, nose and lips."""
BEGINS = {"crow_down": 0.3, "crow_up": 0.3, "nasolabial": 0.3, "smile_fold": 0.3, "marionette": 0.2}
"""From which share of their length on: before it lies the corner of an eye, a nostril or a lip."""
SAMPLES = 10
"""Places along a crease."""
NEAR = 0.0035
"""Metres within which ink that runs along a crease is its own; across it, half as far."""
BESIDE, APART = 0.009, 0.006
"""Metres beside a crease where ink is looked for that is none, and from there to other creases."""
OWN = 0.003
"""Metres around the lids, lips, nose and brows within which ink is theirs."""
HIDDEN = 0.012
"""Metres from lines of hair, hat or beard within which no skin is seen."""
CROWDED, AROUND = 3.0, 0.007
"""So many lines within this radius in metres are hatching or hair."""
FACING, SEEN = 0.3, 0.2
"""The cosine from which on skin is seen, and the share of a family that has to be."""
DEEP = 1.3
"""A crease this many times as deep as an average one is drawn along all its length."""
FOUND = {
    "worry": (0.003, 0.627, 0.532, 0.091),
    "glabella": (0.052, 0.230, 0.087, 0.103),
    "crow": (0.099, 0.303, 0.164, 0.126),
    "nasolabial": (0.173, 0.460, 0.332, 0.193),
    "corner": (0.084, 0.450, 0.201, 0.136),
}
"""Share of a family's lines that is inked: where nothing creases; more of it for each unit of the
depth that an average person's creases have; for each unit of it and of a person's deeper ones; and
its standard deviation. By least squares over generated drawings (docs/fit.md)."""
CLUTTER = 0.3
"""Of the ink beside creases, how much is on them as well; of the same drawings."""
PEOPLE, EACH = 0.6, 0.37
"""Standard deviations of `wrinkles` among people, and of one family's depth beside it."""
LIDS = ("inner", "top_inner", "top", "top_outer", "outer", "bottom_outer", "bottom",
        "bottom_inner", "inner")  # fmt: skip
STROKES = ("brow_lower_left", "brow_lower_right", "brow_upper_left", "brow_upper_right",
           "lip_upper", "lip_lower", "iris_left", "iris_right")  # fmt: skip
_LINES = tuple(
    (group, k, side)
    for groups in GROUPS.values()
    for group in groups
    for k in range(1 if group == "smile_fold" else len(CREASES[group]))
    for side in SIDES
)
_FAMILY = np.array(
    [next(k for k, g in enumerate(GROUPS.values()) if group in g) for group, _, _ in _LINES]
)


@dataclass(frozen=True)
class Found:
    """Of each of GROUPS, what a drawing shows: inked (f,), the share of its lines that lies under
    ink, less clutter; seen (f,), the share that is seen; expected (f,), how deep an average person
    of this age and expression has it, 1 at full natural activation."""

    inked: NDArray[np.float64]
    seen: NDArray[np.float64]
    expected: NDArray[np.float64]


def drawn_wrinkles(
    drawn: Lines, mane: Lines, rig: FaceRig, vertices: NDArray[np.floating], camera: Camera,
    parameters: FaceParameters,
) -> float:  # fmt: skip
    """The identity parameter `wrinkles` of who is drawn; 0 where the drawing says nothing of it.

    drawn, mane : lines of the face in the drawing, and those of hair, hat or beard
    vertices : (n, 3) metres, the face of these parameters as it lies over the drawing by this
    camera
    """
    if not len(drawn.points):
        return 0.0
    return likely_wrinkles(found_creases(drawn, mane, rig, vertices, camera, parameters))[0]


def likely_wrinkles(found: Found) -> tuple[float, float]:
    """The likeliest `wrinkles` for what was found, and its standard deviation: the product of a
    Gaussian for people in general and one for each family that is seen."""
    none, average, deeper, spread = np.array(list(FOUND.values())).T
    seen = found.seen >= SEEN
    slope = deeper * found.expected
    off = found.inked - none - average * found.expected
    # What is told of one family is told of all less that families differ.
    sure = np.where(seen, 1 / (spread**2 + (EACH * slope) ** 2), 0.0)
    total = 1 / PEOPLE**2 + float((sure * slope**2).sum())
    return float(np.clip((sure * slope * off).sum() / total, -1, 1)), total**-0.5


def found_creases(
    drawn: Lines, mane: Lines, rig: FaceRig, vertices: NDArray[np.floating], camera: Camera,
    parameters: FaceParameters,
) -> Found:  # fmt: skip
    """What a drawing shows of each family of creases; arguments as in `drawn_wrinkles`."""
    index, lone = crease_places(rig)
    metre = camera.scale[0]
    places = vertices[index]  # (lines, 3, samples, 3): on its inner side, itself, its outer side
    flat = camera.project(places.reshape(-1, 3)).reshape(*index.shape, 2)
    middle, aside = flat[:, 1], flat[:, 2] - flat[:, 0]
    along = np.gradient(middle, axis=1)
    seen = _facing(places, along, aside, metre) > FACING
    if len(mane.points):  # a hat's brim goes on where its mask ends
        hair = cKDTree(mane.points).query(middle[seen], distance_upper_bound=HIDDEN * metre)[0]
        seen[seen] = np.isinf(hair)
    own = cKDTree(_own_lines(rig, vertices, camera))
    free = np.isinf(own.query(drawn.points, distance_upper_bound=OWN * metre)[0])
    depth = _expected(parameters)
    if not free.any():
        return _by_family(seen, np.zeros(seen.shape), 0.0, depth)
    tree = cKDTree(_placed(drawn.points[free], drawn.along[free], NEAR * metre))
    every = cKDTree(drawn.points)

    def inked(at: NDArray, way: NDArray) -> NDArray[np.bool_]:
        near = tree.query(_placed(at, way, NEAR * metre), distance_upper_bound=NEAR * metre)[0]
        count = every.query_ball_point(at, AROUND * metre, return_length=True)
        crowded = count * drawn.spacing > CROWDED * 2 * AROUND * metre
        return np.isfinite(near) & ~crowded

    unit, across = (v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)
                    for v in (along, aside))  # fmt: skip
    beside = [
        inked(middle[at] + sign * BESIDE * metre * across[at], unit[at])
        for sign, alone in zip((-1, 1), lone, strict=True)
        for at in [alone & seen]
    ]
    on = np.zeros(seen.shape)
    on[seen] = inked(middle[seen], unit[seen])
    clutter = np.concatenate(beside)
    return _by_family(seen, on, float(clutter.mean()) if len(clutter) else 0.0, depth)


def _by_family(seen: NDArray, on: NDArray, clutter: float, depth: NDArray) -> Found:
    """What (lines, samples) of places say of each family; depth (lines,) of an average person."""
    share = seen.mean(axis=1)
    inked = on.sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    share = np.where(share > FACING, share, 0.0)
    count = np.bincount(_FAMILY)
    total = np.maximum(np.bincount(_FAMILY, share), 1e-9)
    return Found(
        np.bincount(_FAMILY, share * inked) / total - CLUTTER * clutter,
        np.bincount(_FAMILY, share) / count,
        np.bincount(_FAMILY, share * np.minimum(depth, DEEP)) / total,
    )


def _expected(parameters: FaceParameters) -> NDArray[np.float64]:
    """(lines,) how deep an average person of this age and expression has each of _LINES."""
    about = {name: parameters.identity[name] for name in ("age", "age_shows")
             if name in parameters.identity}  # fmt: skip
    rest: dict[tuple[str, str], float] = {}
    for name, (_, groups, share) in REST.items():
        for side in SIDES:
            deep = share * REST_FOLDS[f"rest {name} {side}"](about)
            rest |= {(group, side): deep for group in groups}
    gain = crease_gain(about) / 5
    folded = {key: gain * sum(parameters.aus.get(name, 0.0) for name in names)
              for key, names in _raised().items()}  # fmt: skip
    return np.array([folded[g, side] + rest.get((g, side), 0.0) for g, _, side in _LINES])


@lru_cache(maxsize=1)
def _raised() -> Mapping[tuple[str, str], tuple[str, ...]]:
    """(group, side) -> the controls that crease it there."""
    return {
        (group, side): tuple(
            control.name
            for control in CONTROLS
            if group in control.creases and control.side in ("both", side)
        )
        for groups in GROUPS.values()
        for group in groups
        for side in SIDES
    }


@derived
def crease_places(rig: FaceRig) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """(lines, 3, samples) vertices of the skin along _LINES, NEAR to the inner side of each, on it
    and to its outer side; and (2, lines, samples) whether BESIDE it there is no other crease."""
    rest = rig.neutral()
    pupils = rest[[rig.landmarks[LANDMARKS.index(f"pupil_{side}")] for side in SIDES]]
    eyes = pupils.mean(axis=0)
    lines, ways = [], []
    for group, k, side in _LINES:
        points = np.array(CREASES[group][k].points) * 0.01
        way = arc_lengths(points)
        at = np.linspace(BEGINS.get(group, 0.0) * way[-1], way[-1], SAMPLES)
        line = resampled(points, way, at)
        ahead = np.gradient(line, axis=0)
        out = (ahead / np.linalg.norm(ahead, axis=1, keepdims=True)) @ [[0, 1], [-1, 0]]
        mirror = (1 if side == "left" else -1, 1)
        lines.append(line * mirror + eyes[:2])
        ways.append(out * mirror)
    middle, out = np.array(lines), np.array(ways)
    front = np.flatnonzero(rig.parts["skin"] & (rest[:, 2] > eyes[2] - 0.06))
    places = np.stack([middle - NEAR * out, middle, middle + NEAR * out], axis=1)
    # Creased skin has a vertex each millimetre: the nearest will do, but not of what lies behind.
    near = cKDTree(rest[front, :2]).query(places.reshape(-1, 2), k=6)[1]
    deep = rest[front, 2][near]
    ahead = (deep > deep.max(axis=1, keepdims=True) - 0.01).argmax(axis=1)
    index = front[near[np.arange(len(near)), ahead]].reshape(places.shape[:3])
    creases = cKDTree(middle.reshape(-1, 2))
    away = [creases.query(middle + sign * BESIDE * out)[0] for sign in (-1, 1)]
    return index, np.array(away) > APART


def _facing(places: NDArray, along: NDArray, aside: NDArray, metre: float) -> NDArray[np.float64]:
    """(lines, samples) how much of the skin's area along creases is seen; below 0 from behind."""
    sides = np.linalg.norm(
        np.cross(np.gradient(places[:, 1], axis=1), places[:, 2] - places[:, 0]), axis=-1
    )
    area = along[..., 1] * aside[..., 0] - along[..., 0] * aside[..., 1]
    sign = np.array([1 if side == "left" else -1 for _, _, side in _LINES])
    return sign[:, None] * area / metre**2 / np.maximum(sides, 1e-12)


def _own_lines(rig: FaceRig, vertices: NDArray, camera: Camera) -> NDArray[np.float64]:
    """(k, 2) pixels along the face's lids, lips, brows, irises and the wings of its nose."""
    lines = [camera.project(rig.stroke_points(vertices, name)) for name in STROKES]
    at = dict(zip(LANDMARKS, camera.project(vertices[rig.landmarks]), strict=True))
    for side in SIDES:
        lines.append(np.array([at[f"eye_{name}_{side}"] for name in LIDS]))
        lines.append(np.array([at[f"nose_wing_{side}"], at[f"nostril_{side}"], at["nose_base"]]))
    step = OWN / 2 * camera.scale[0]
    ways = [arc_lengths(line) for line in lines]
    return np.concatenate(
        [
            resampled(line, way, np.arange(0, way[-1], step))
            for line, way in zip(lines, ways, strict=True)
        ]
    )


def _placed(points: NDArray, along: NDArray, turn: float) -> NDArray[np.float64]:
    """(k, 4) place and doubled angle, a right angle as far as twice `turn` (see lines)."""
    x, y = along.T
    return np.concatenate([points, turn * np.stack([x * x - y * y, 2 * x * y], axis=1)], axis=1)
