"""Creases: grooves in the skin, drawn as curves on the active face and raised by their control.

MakeHuman's targets move the skin but do not fold it, and it is by its folds that an expression
shows in a line drawing. A crease is a curve on the face's left (the right is its mirror image)
with a depth at full natural activation (intensity 5) and a half-width. Its profile across is a
narrow groove between low, broad shoulders, its depth fades toward the ends of the curve, so that
the line that is seen grows longer as it grows deeper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from ..anatomy import PART_NAMES, bind_from_front, smooth_curve
from ..common.ties import nearest
from ..controls import Control

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Crease:
    """points in cm seen from the front (see facs_rig.anatomy); depth and half-width in mm.

    `fade` is the share of the length over which each end fades; 0 keeps an end deep, as where a
    line goes on across the middle of the face. `lift` in mm raises the skin on the crease's outer
    side, away from the middle of the face, as where the cheek is pushed over its edge: a fold.
    """

    points: Points
    depth: float
    width: float = 1.8
    fade: tuple[float, float] = (0.3, 0.3)
    lift: float = 0.0


def _worry(y: float, reach: float, arch: float = 0.25) -> Crease:
    points = ((0.0, y), (reach * 0.35, y + arch * 0.5), (reach * 0.7, y + arch), (reach, y - 0.1))
    return Crease(points, 1.3, 1.9, (0.0, 0.35))


CREASES: dict[str, tuple[Crease, ...]] = {
    "worry": (_worry(2.75, 4.4), _worry(3.65, 4.8), _worry(4.55, 4.7), _worry(5.4, 4.0)),
    "worry_centre": tuple(
        Crease(((0.0, y), (0.7, y - 0.18), (1.5, y - 0.62), (2.0, y - 1.0)), 1.3, 1.8, (0.0, 0.4))
        for y in (3.3, 4.1, 4.9)
    ),
    "worry_side": (
        Crease(((2.2, 2.6), (3.5, 3.0), (4.8, 2.5)), 1.1),
        Crease(((2.3, 3.4), (3.6, 3.8), (4.9, 3.2)), 1.0),
    ),
    "glabella": (
        Crease(((0.50, 0.35), (0.62, 1.3), (0.55, 2.5)), 1.6, 1.9),
        Crease(((1.05, 0.75), (1.25, 1.6), (1.35, 2.2)), 0.8, 1.6),
        Crease(((0.0, 0.1), (0.6, 0.12)), 0.9, 1.6, (0.0, 0.5)),
    ),
    "crow_down": (
        Crease(((4.40, -0.30), (4.95, -0.58), (5.60, -1.00)), 0.9, 1.2, (0.2, 0.5)),
        Crease(((4.30, -0.55), (4.78, -1.05), (5.25, -1.75)), 0.9, 1.2, (0.2, 0.5)),
        Crease(((4.05, -0.80), (4.40, -1.40), (4.65, -2.15)), 0.8, 1.2, (0.2, 0.5)),
    ),
    "under_eye": (
        Crease(((1.9, -0.95), (2.5, -1.22), (3.2, -1.25), (3.9, -0.95)), 0.8, 1.4, (0.35, 0.35)),
    ),
    "crow_up": (
        Crease(((4.50, 0.10), (5.05, 0.42), (5.65, 0.95)), 0.9, 1.2, (0.2, 0.5)),
        Crease(((4.55, -0.15), (5.15, -0.05), (5.85, 0.15)), 0.9, 1.2, (0.2, 0.5)),
        Crease(((4.40, 0.38), (4.80, 0.90), (5.15, 1.55)), 0.8, 1.2, (0.2, 0.5)),
    ),
    "bunny": (
        Crease(((0.40, -0.45), (0.85, -0.75), (1.30, -1.40)), 1.3, 1.5),
        Crease(((0.45, -1.20), (0.85, -1.50), (1.25, -2.10)), 1.2, 1.5),
        Crease(((0.0, 0.25), (0.6, 0.20)), 1.0, 1.5, (0.0, 0.5)),
    ),
    "nasal": (Crease(((1.65, -2.75), (2.05, -3.6), (2.35, -4.5)), 1.6, 1.9, (0.3, 0.45), 0.5),),
    "nasolabial": (
        Crease(((1.75, -3.3), (2.30, -4.1), (2.85, -5.2), (3.05, -6.4)), 1.6, 2.0, (0.3, 0.4), 0.9),
    ),
    "smile_fold": (
        Crease(((1.75, -3.25), (2.5, -4.0), (3.2, -4.9), (3.55, -5.8)), 1.6, 2.1, (0.3, 0.4), 0.9),
        Crease(((2.2, -0.95), (3.1, -1.25), (4.0, -0.95)), 0.6, 1.6),
    ),
    "corner_pinch": (
        Crease(((2.40, -6.15), (2.62, -6.75), (2.45, -7.40)), 1.6, 1.6),
        Crease(((2.85, -6.25), (3.08, -6.85), (2.90, -7.50)), 0.9, 1.6),
    ),
    "marionette": (Crease(((2.45, -7.0), (2.75, -7.7), (2.75, -8.5)), 1.2, 1.8),),
    "chin_boss": (
        Crease(((0.0, -8.35), (0.9, -8.5), (1.6, -9.1)), 1.4, 1.9, (0.0, 0.4)),
        Crease(((0.35, -9.2), (0.75, -9.5)), 0.8, 1.6),
    ),
    "lip_radial": tuple(Crease(((x, -5.65), (x * 1.25, -5.1)), 0.8, 1.3) for x in (0.5, 1.0, 1.45)),
    "corner_fold": (
        Crease(((2.75, -5.6), (3.15, -6.6), (3.15, -7.9)), 1.6, 1.9),
        Crease(((3.45, -5.9), (3.80, -6.9), (3.70, -8.0)), 1.2, 1.8),
    ),
}


SAMPLES = 120  # points along a crease
SMOOTH = 0.0008  # metres along a crease over which its depth in the face is smoothed
# Height of a crease's shoulders, as a share of its depth.
SHOULDER = 0.2

# Edge lengths in metres that the refinement aims at: along creases, the face, the rest of the skin.
CREASED_EDGE, FACE_EDGE, PLAIN_EDGE = 0.0013, 0.0055, 0.008
MOST_LEVELS = 3
BALL = 0.0135  # metres, the eyeballs' radius


def refinement_levels(cage: NDArray, quads: NDArray, part: NDArray) -> NDArray[np.int64]:
    """Subdivision level of each cage quad: fine where creases run, coarse where nothing happens.

    cage : (m, 3) metres in the source's frame;  quads : (f, 4);  part : (f,) part numbers.
    """
    corners = cage[quads]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    longest = np.maximum(sides[:, 0] + sides[:, 2], sides[:, 1] + sides[:, 3]) / 2
    eyes = cage[np.unique(quads[part == PART_NAMES.index("eyes")])].mean(axis=0)
    centre = (corners.mean(axis=1) - eyes) * 100
    x, y, z = centre.T
    creases = [crease for group in CREASES.values() for crease in group]
    left = [smooth_curve(np.array(crease.points), 60) for crease in creases]
    curves = np.concatenate([curve * [sign, 1] for curve in left for sign in (1, -1)])
    reach = cKDTree(curves).query(centre[:, :2])[0] - 70 * longest  # quad's half diagonal, in cm
    face = (z > -3.0) & (np.abs(x) < 6.4) & (y < 6.5) & (y > -11.0)
    aim = np.where(face, FACE_EDGE, PLAIN_EDGE)
    aim[face & (z > -2.0) & (reach < 0.05)] = CREASED_EDGE
    inside = (np.abs(x) < 2.6) & (np.abs(y + 6.5) < 2.5) & (z < 0.2)  # the cavity of the mouth
    aim[inside] = PLAIN_EDGE
    level = np.round(np.log2(np.maximum(longest / aim, 1)) + 0.1).astype(np.int64)
    level = np.clip(level, np.where(face & ~inside & (z > -1.5), 1, 0), MOST_LEVELS)
    socket = np.min(
        [np.linalg.norm(corners.mean(axis=1) - ball, axis=1) for ball in _balls(cage, quads, part)],
        axis=0,
    )
    level[(part == 0) & (socket < 0.9 * BALL)] = 0  # behind the eyeballs nothing is seen
    level[part == PART_NAMES.index("eyes")] = 2
    level[np.isin(part, [PART_NAMES.index(p) for p in ("teeth", "tongue", "lashes")])] = 1
    return _graded(level, quads)


def _graded(level: NDArray, quads: NDArray) -> NDArray[np.int64]:
    """Levels raised until quads that share an edge differ by one at most.

    Where coarse meets fine at once, the triangles between them shade as a row of spots.
    """
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, edge = np.unique(sides, axis=0, return_inverse=True)
    edge = edge.reshape(-1, 4)
    for _ in range(MOST_LEVELS):
        finest = np.zeros(edge.max() + 1, dtype=np.int64)
        np.maximum.at(finest, edge.ravel(), np.repeat(level, 4))
        level = np.maximum(level, finest[edge].max(axis=1) - 1)
    return level


def _on_surface(points, vertices, triangles, front, eyes_middle) -> NDArray:
    """A curve drawn from the front (k, 2) in cm, laid onto the surface: (SAMPLES, 3) metres."""
    places = smooth_curve(points, SAMPLES) * 0.01 + eyes_middle[:2]
    index, weight = bind_from_front(places, vertices, triangles, front)
    z = np.einsum("kc,kc->k", weight, vertices[index][:, :, 2])
    spacing = np.linalg.norm(np.diff(places, axis=0), axis=1).mean()
    return np.column_stack([places, gaussian_filter1d(z, SMOOTH / spacing, mode="nearest")])


def _balls(cage: NDArray, quads: NDArray, part: NDArray) -> list[NDArray]:
    """Centres (3,) of the eyeballs."""
    eyes = cage[np.unique(quads[part == PART_NAMES.index("eyes")])]
    return [own.mean(axis=0) for own in (eyes[eyes[:, 0] > 0], eyes[eyes[:, 0] < 0])]


def crease_displacements(
    control: Control,
    vertices: NDArray,
    triangles: NDArray,
    normals: NDArray,
    skin: NDArray,
    eyes_middle: NDArray,
) -> NDArray[np.float64]:
    """Displacements (n, 3) in metres of a control's creases at intensity 5, along the normals.

    vertices, normals : (n, 3) of the smooth face with the symmetric control at intensity 5, so
    that a curve lies where it is seen on the active face.

    One-sided controls get the symmetric displacement under a ramp over the middle of the face,
    1 cm to each side, so that left and right add up to the symmetric control.
    """
    depth = np.zeros(len(vertices))
    allowed = skin & (normals[:, 2] > 0.1) & (vertices[:, 2] > eyes_middle[2] - 0.05)
    front = np.flatnonzero(allowed)
    for name in control.creases:
        for crease in CREASES[name]:
            for fade, points in _both_sides(crease):
                curve = _on_surface(points, vertices, triangles, allowed, eyes_middle)
                depth += _groove(crease, fade, curve, vertices, front)
    x = vertices[:, 0]
    if control.side == "left":
        depth *= np.clip(0.5 + x / 0.02, 0, 1)
    elif control.side == "right":
        depth *= np.clip(0.5 - x / 0.02, 0, 1)
    return depth[:, None] * normals


def _both_sides(crease: Crease) -> list[tuple[tuple[float, float], NDArray]]:
    """The curve on both sides: one across the middle where it begins there, else two."""
    left = np.array(crease.points)
    right = left * [-1, 1]
    if crease.fade[0] > 0 or left[0, 0] != 0:
        return [(crease.fade, left), (crease.fade, right)]
    end = crease.fade[1] / 2
    return [((end, end), np.concatenate([right[:0:-1], left]))]


def _groove(crease, end_fades, curve, vertices, front) -> NDArray:
    """Height (n,) in metres of one crease, by the distance from its curve in half-widths.

    A narrow groove between broad, low shoulders.
    """
    away, at = cKDTree(curve).query(vertices[front], distance_upper_bound=4e-3 * crease.width)
    near = np.isfinite(away)
    front, away = front[near], away[near]
    at = nearest(curve, vertices[front])  # in the middle of the face two points are equally near
    s = np.linspace(0, 1, len(curve))[at]
    fade = np.ones_like(s)
    for share, from_end in zip(end_fades, (s, 1 - s), strict=True):
        if share > 0:
            t = np.clip(from_end / share, 0, 1)
            fade *= t * t * (3 - 2 * t)
    t = away / (1e-3 * crease.width)
    height = SHOULDER * np.exp(-((t / 2.2) ** 2)) - (1 + SHOULDER) * np.exp(-(t**2) / 0.9)
    height *= 1e-3 * crease.depth * fade
    if crease.lift:
        x = curve[at, 0]
        outer = np.where((vertices[front, 0] - x) * np.sign(x) > 0, t, -t)
        height += 1e-3 * crease.lift * fade * np.exp(-(((outer - 2.0) / 1.2) ** 2))
    out = np.zeros(len(vertices))
    out[front] = height
    return out
