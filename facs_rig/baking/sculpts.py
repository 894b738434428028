"""What the source's faces lack, mixed of its modelling targets and sculpted: age, sex and muscle.

A sculpt is a list of soft strokes: at a place of the face's left (and mirrored) skin moves by some
millimetres, less and less beyond the stroke's radii.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..macros import MUSCLES, SEXES, STAGES
from .makehuman import JOINTS, Source

CM, MM = 0.01, 0.001
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Stroke:
    """at, radius : cm, seen from the middle between the eyes (see facs_rig.anatomy);
    move : mm, x to the face's own left, y up, z forward; fades as a Gaussian."""

    at: Vector
    radius: Vector
    move: Vector


CORNER, CORNER_RADIUS = (2.25, -6.85, 1.2), 0.45  # cm, of the mouth

# Signs of age that are full at 90, and how much of each is there at STAGES.
AGED: dict[str, float] = {
    "eyes/{s}-eye-eyefold-down": 0.45, "eyes/{s}-eye-eyefold-angle-down": 0.5,
    "eyes/{s}-eye-bag-incr": 0.5, "mouth/mouth-laugh-lines-in": 0.2,
    "mouth/mouth-upperlip-height-decr": 0.45, "mouth/mouth-lowerlip-height-decr": 0.28,
    "ears/{s}-ear-scale-vert-incr": 0.35, "ears/{s}-ear-lobe-incr": 0.45,
    "nose/nose-base-down": 0.3, "nose/nose-volume-incr": 0.25, "nose/nose-scale-vert-incr": 0.15,
    "head/head-age-incr": 0.45, "cheek/{s}-cheek-volume-decr": 0.35,
    "mouth/mouth-angles-down": 0.08,
}  # fmt: skip
SHARES = (0.4, 0.75, 1.0)
SAGGING = (
    Stroke((4.1, -8.7, -0.6), (1.3, 1.3, 1.8), (0.8, -3.8, 0.8)),  # jowls
    Stroke((2.5, -9.5, 1.0), (0.7, 1.0, 1.2), (-0.6, 0.8, -1.0)),  # the dent before them
    Stroke((6.3, 1.6, -1.5), (1.2, 1.7, 1.6), (-3.0, 0.0, -0.6)),  # temples
    Stroke((4.9, -4.8, 0.4), (1.1, 1.5, 1.2), (-2.2, 0.0, -2.0)),  # cheeks
    Stroke((2.7, -4.4, 2.6), (0.8, 1.0, 1.0), (0.3, -2.0, 1.8)),  # over the nasolabial fold
    Stroke((0.9, -12.3, -0.6), (0.55, 2.4, 1.5), (0.0, -1.0, 3.2)),  # cords of the neck
    Stroke((0.0, -11.4, -0.4), (0.9, 1.0, 1.4), (0.0, -2.4, 1.2)),  # under the chin
)
MIXES: dict[str, dict[str, float]] = {
    f"macrodetails/{name}": {} for name in MUSCLES
} | {
    f"aging/aged-{stage}": {name: share * weight for name, weight in AGED.items()}
    for stage, share in zip(STAGES, SHARES, strict=True)
} | {
    "sex/more-male": {
        "eyebrows/eyebrows-trans-forward": 0.12, "eyebrows/eyebrows-trans-down": 0.25,
        "forehead/forehead-trans-backward": 0.25, "chin/chin-bones-incr": 0.5,
        "chin/chin-width-incr": 0.4, "chin/chin-height-incr": 0.2, "chin/chin-prominent-incr": 0.3,
        "neck/measure-neck-circ-incr": 0.7, "mouth/mouth-upperlip-height-decr": 0.25,
        "mouth/mouth-lowerlip-height-decr": 0.2, "nose/nose-scale-depth-incr": 0.15,
        "nose/nose-scale-horiz-incr": 0.15, "nose/nose-width1-incr": 0.25,
        "eyes/{s}-eye-scale-decr": 0.12,
    },
    "sex/more-female": {
        "eyebrows/eyebrows-trans-up": 0.35, "eyebrows/eyebrows-trans-backward": 0.4,
        "chin/chin-bones-decr": 0.4, "chin/chin-width-decr": 0.4,
        "chin/chin-prominent-decr": 0.15, "neck/measure-neck-circ-decr": 0.4,
        "mouth/mouth-upperlip-height-incr": 0.35, "mouth/mouth-lowerlip-height-incr": 0.3,
        "mouth/mouth-lowerlip-volume-incr": 0.3, "nose/nose-scale-horiz-decr": 0.25,
        "nose/nose-point-width-decr": 0.3, "nose/nose-scale-depth-decr": 0.2,
        "eyes/{s}-eye-scale-incr": 0.2, "cheek/{s}-cheek-bones-incr": 0.15,
    },
    "weight/heavy": {
        "head/head-fat-incr": 0.6, "neck/neck-double-incr": 0.6, "cheek/{s}-cheek-volume-incr": 0.3,
        "neck/measure-neck-circ-incr": 0.6, "chin/chin-width-incr": 0.2,
    },
    "weight/thin": {
        "head/head-fat-decr": 0.35, "cheek/{s}-cheek-volume-decr": 0.4,
        "cheek/{s}-cheek-bones-incr": 0.25, "neck/measure-neck-circ-decr": 0.35,
    },
}  # fmt: skip
RIDGE = (
    Stroke((2.2, 1.0, 2.6), (1.1, 0.55, 1.2), (0.0, -0.6, 2.4)),  # over the inner half of the eye
    Stroke((4.2, 1.0, 1.6), (0.9, 0.6, 1.2), (0.6, -0.6, 1.6)),
)
FAT = (
    Stroke((4.6, -8.2, -1.2), (1.6, 1.4, 2.0), (2.4, -1.0, 1.0)),  # over the jaw
    Stroke((0.0, -11.6, -1.0), (2.4, 1.2, 2.0), (0.0, -4.0, 2.0)),  # a second chin
    Stroke((4.8, -4.4, 0.4), (1.2, 1.3, 1.3), (1.8, -0.4, 1.4)),  # cheeks
)
LEAN = (
    Stroke((4.9, -5.2, 0.2), (1.2, 1.5, 1.4), (-2.6, 0.0, -1.8)),  # cheeks
    Stroke((6.3, 1.6, -1.5), (1.2, 1.7, 1.6), (-2.0, 0.0, -0.4)),  # temples
    Stroke((0.0, -11.2, -1.6), (2.4, 0.9, 1.6), (0.0, 1.6, 0.0)),  # under the chin
)
STROKES: dict[str, tuple[tuple[float, tuple[Stroke, ...]], ...]] = {
    f"aging/aged-{stage}": ((share, SAGGING),) for stage, share in zip(STAGES, SHARES, strict=True)
} | {
    "sex/more-male": ((1.0, RIDGE),), "weight/heavy": ((1.0, FAT),), "weight/thin": ((1.0, LEAN),),
}  # fmt: skip


def sculpted(source: Source, plain: NDArray, name: str) -> NDArray[np.float64]:
    """(M, 3) metres that one of MIXES moves the plain face (M, 3); joints only as targets do."""
    delta = np.zeros_like(plain)
    for target, weight in MIXES[name].items():
        delta += weight * source.target(target)
    if name.split("/")[-1] in MUSCLES:
        delta += muscle(source, name.split("/")[-1])
    m = source.size
    skin = source.is_part("skin")
    eyes = plain[m + JOINTS.index("l-eye")] + plain[m + JOINTS.index("r-eye")]
    centre = (plain[:m] - eyes / 2) / CM
    for share, strokes in STROKES.get(name, ()):
        for stroke in strokes:
            delta[:m][skin] += share * stroked(centre[skin], stroke)
    delta[:m] = stiff_corners(centre, delta[:m])
    return delta


def stiff_corners(points: NDArray, moves: NDArray) -> NDArray[np.float64]:
    """Moves (m, 3) of points (m, 3) in cm with each corner of the mouth moved as a whole: thinner
    lips would squeeze its folded skin to nothing."""
    out = moves.copy()
    for sign in (1, -1):
        away = (points - np.array(CORNER) * (sign, 1, 1)) / CORNER_RADIUS
        near = np.exp(-0.5 * (away**2).sum(axis=1))[:, None]
        out += near * ((near * moves).sum(axis=0) / near.sum() - moves)
    return out


def stroked(points: NDArray, stroke: Stroke) -> NDArray[np.float64]:
    """(k, 3) metres that a stroke and its mirror image move points (k, 3) in cm.

    One in the middle is its own mirror image.
    """
    out = np.zeros_like(points)
    for sign in (1, -1) if stroke.at[0] else (1,):
        mirror = np.array([sign, 1, 1])
        away = (points * mirror - stroke.at) / stroke.radius
        out += np.exp(-0.5 * (away**2).sum(axis=1))[:, None] * (MM * np.array(stroke.move) * mirror)
    return out


def muscle(source: Source, name: str) -> NDArray[np.float64]:
    """(M, 3) what the most or the least muscle changes on a young adult of average weight."""
    sex = next(s for s in SEXES if name.startswith(s))
    most = "min" if name.endswith("slight") else "max"
    young = f"macrodetails/universal-{sex}-young"
    strong, average = (source.target(f"{young}-{k}muscle-averageweight") for k in (most, "average"))
    return strong - average
