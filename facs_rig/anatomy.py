"""Where things are on the head: parts, landmarks, the cut of the neck, brows and irises.

Places are in centimetres on the default face, seen from the front: x to the face's own left, y up,
z forward, from the middle between the centres of the eyeballs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PART_NAMES = ("skin", "eyes", "teeth", "tongue", "lashes", "brows")
HAIR_PARTS = ("lashes", "brows")  # blades: coloured, but no surface to draw contours of

# The neck is cut at y = a + b z of the source data (decimetres): higher at the back.
NECK_CUT = (5.85, -0.2)

_SIDED = {
    "eye_inner": ("skin", (1.62, -0.36)),
    "eye_outer": ("skin", (4.15, -0.10)),
    "eye_top": ("skin", (3.0, 0.30)),
    "eye_bottom": ("skin", (3.0, -0.52)),
    "pupil": ("eyes", (2.89, 0.0)),
    "brow_inner": ("skin", (1.25, 1.15)),
    "brow_peak": ("skin", (3.35, 1.70)),
    "brow_outer": ("skin", (4.85, 1.15)),
    "nose_wing": ("skin", (1.72, -3.95)),
    "mouth_corner": ("skin", (2.25, -6.83)),
    "jaw": ("skin", (5.2, -7.6)),
    "cheekbone": ("skin", (5.6, -2.2)),
    "temple": ("skin", (6.3, 2.0)),
}
_MIDDLE = {
    "nose_root": ("skin", (0.0, 0.0)),
    "nose_tip": ("skin", (0.0, -3.55)),
    "nose_base": ("skin", (0.0, -4.62)),
    "lip_top": ("skin", (0.0, -5.72)),
    "lip_bottom": ("skin", (0.0, -7.92)),
    "chin": ("skin", (0.0, -10.3)),
    "forehead": ("skin", (0.0, 5.0)),
}

# name -> (part, place); jaw, cheekbone and temple lie on the side of the head.
LANDMARK_POINTS: dict[str, tuple[str, tuple[float, ...]]] = {
    **{f"{name}_left": value for name, value in _SIDED.items()},
    **{f"{name}_right": (part, (-x, y)) for name, (part, (x, y)) in _SIDED.items()},
    **_MIDDLE,
}
LANDMARKS: tuple[str, ...] = tuple(LANDMARK_POINTS)


def smooth_curve(points: NDArray, count: int) -> NDArray[np.float64]:
    """`count` points along a shape-preserving curve through `points` (k, d), evenly by length."""
    from scipy.interpolate import PchipInterpolator  # heavy, and only baking draws curves

    points = np.asarray(points, dtype=float)
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if len(points) > 2:
        fine = PchipInterpolator(s, points)(np.linspace(0, s[-1], 200))
    else:
        fine = np.linspace(points[0], points[1], 200)
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    at = np.linspace(0, s[-1], count)
    return np.stack([np.interp(at, s, fine[:, k]) for k in range(fine.shape[1])], axis=1)


DEEPEST = 0.02  # metres that a surface may lie behind what is beside it


def bind_from_front(
    places: NDArray, vertices: NDArray, triangles: NDArray, allowed: NDArray
) -> tuple[NDArray, NDArray]:
    """Bind places (k, 2) seen from the front to the surface under them.

    Returns vertex indices (k, 3) and barycentric weights (k, 3) of the frontmost triangle whose
    vertices are all `allowed` (n,) and that faces the viewer; ValueError if there is none.
    """
    from scipy.spatial import cKDTree

    corner = vertices[triangles]
    a, b, c = (corner[:, k, :2] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    facing = np.flatnonzero((area > 1e-12) & allowed[triangles].all(axis=1))
    tree = cKDTree(corner[facing, :, :2].mean(axis=1))
    index = np.empty((len(places), 3), dtype=np.int64)
    weight = np.empty((len(places), 3))
    for k, place in enumerate(places):
        near = facing[tree.query(place, k=min(80, len(facing)))[1]]
        deep = corner[near, :, 2].mean(axis=1)
        near = near[deep > deep.max() - DEEPEST]  # through a slit one would see what is behind it
        w = _weights(place, a[near], b[near], c[near], area[near])
        inside = np.flatnonzero((w >= -1e-3).all(axis=1))
        if not len(inside):  # between triangles seen edge on: the nearest point of any of them
            clipped = np.clip(w, 0, 1) / np.clip(w, 0, 1).sum(axis=1, keepdims=True)
            off = np.einsum("kc,kcd->kd", clipped, corner[near][:, :, :2]) - place
            inside = np.array([np.argmin(np.hypot(*off.T))])
            if np.hypot(*off[inside[0]]) > 0.003:
                raise ValueError(f"no surface under the place {tuple(place * 100)} cm")
        best = inside[np.argmax(vertices[triangles[near[inside]]][:, :, 2].mean(axis=1))]
        index[k] = triangles[near[best]]
        weight[k] = np.clip(w[best], 0, 1) / np.clip(w[best], 0, 1).sum()
    return index, weight


def _weights(p, a, b, c, area) -> NDArray:
    wa = ((b[:, 0] - p[0]) * (c[:, 1] - p[1]) - (b[:, 1] - p[1]) * (c[:, 0] - p[0])) / area
    wb = ((c[:, 0] - p[0]) * (a[:, 1] - p[1]) - (c[:, 1] - p[1]) * (a[:, 0] - p[0])) / area
    return np.stack([wa, wb, 1 - wa - wb], axis=1)


# The brow's lower and upper edge on the face's left, from the nose outwards.
BROW_LOWER = ((1.15, 0.95), (2.2, 1.25), (3.3, 1.50), (4.2, 1.40), (4.95, 1.05))
BROW_UPPER = ((1.10, 1.55), (2.1, 1.75), (3.2, 1.95), (4.2, 1.65), (4.95, 1.08))
IRIS_RADIUS, PUPIL_RADIUS = 0.58, 0.24


def brow_curves(vertices, triangles, skin, eyes_middle) -> dict[str, tuple[NDArray, NDArray]]:
    """Lower and upper edge of each brow, bound to the skin: name -> (indices, weights)."""
    out = {}
    for side, sign in (("left", 1), ("right", -1)):
        for edge, points in (("lower", BROW_LOWER), ("upper", BROW_UPPER)):
            places = smooth_curve(np.array(points) * [sign, 1], 16) * 0.01 + eyes_middle[:2]
            out[f"brow_{edge}_{side}"] = bind_from_front(places, vertices, triangles, skin)
    return out


# The border of the lips, from the middle to the corner on the face's left.
LIP_UPPER = ((0.0, -5.82), (0.42, -5.66), (1.0, -5.98), (1.65, -6.42), (2.18, -6.82))
LIP_LOWER = ((0.0, -7.95), (0.6, -7.88), (1.2, -7.62), (1.75, -7.22), (2.18, -6.86))


def lip_curves(vertices, triangles, skin, eyes_middle) -> dict[str, tuple[NDArray, NDArray]]:
    """The border of the upper and the lower lip, bound to the skin: name -> (indices, weights)."""
    out = {}
    for name, points in (("lip_upper", LIP_UPPER), ("lip_lower", LIP_LOWER)):
        half = np.array(points)
        whole = np.concatenate([half[:0:-1] * [-1, 1], half])
        places = smooth_curve(whole, 33) * 0.01 + eyes_middle[:2]
        out[name] = bind_from_front(places, vertices, triangles, skin)
    return out


def eye_curves(vertices, triangles, part, eyes_middle) -> dict[str, tuple[NDArray, NDArray]]:
    """Iris and pupil circles of each eye, bound to the eyeball: name -> (indices, weights)."""
    out = {}
    ball = part == PART_NAMES.index("eyes")
    turn = np.linspace(0, 2 * np.pi, 25)
    for side, sign in (("left", 1), ("right", -1)):
        own = ball & (sign * vertices[:, 0] > 0)
        centre = (vertices[own].max(axis=0) + vertices[own].min(axis=0))[:2] / 2
        for name, radius in (("iris", IRIS_RADIUS), ("pupil", PUPIL_RADIUS)):
            circle = centre + 0.01 * radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            out[f"{name}_{side}"] = bind_from_front(circle, vertices, triangles, own)
    return out
