"""Where things are on the head: parts, landmarks, the cut of the neck, brows and irises.

Places are in centimetres on the default face, seen from the front: x to the face's own left, y up,
z forward, from the middle between the centres of the eyeballs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .common.polylines import arc_lengths, resampled
from .common.ties import first_least, first_most

PART_NAMES = ("skin", "eyes", "teeth", "tongue", "lashes", "brows", "bust", "gums")
HAIR_PARTS = ("lashes", "brows")  # blades
# Coloured, but no surface to draw contours of; the bust is what closes the cut of the neck.
UNDRAWN_PARTS = (*HAIR_PARTS, "bust")

# The source's head looks up a little; turned down by so much (radians) it stands as people draw a
# face, with the jaw's outline before the neck.
LOOK_DOWN = float(np.radians(7.0))

# The neck is cut at y = a + b z of the source data (decimetres): higher at the back.
NECK_CUT = (5.85, -0.2)

# How far from the mouth's upright axis its lining lies, halfway through lips and cheeks: by the
# degrees that a place is turned from the front, less what it is by the height; in millimetres.
# The axis stands LIPS_BEFORE in front of it; heights are from where the lips meet.
LINING = ((0.0, 22.0, 30.0, 90.0, 180.0), (48.6, 47.8, 45.0, 44.0, 44.0))
LINING_LESS = (
    (-28.0, -24.0, -20.0, -16.0, -12.0, -7.0, 10.0, 20.0, 33.0),
    (25.0, 15.0, 9.0, 4.5, 2.0, 0.0, 0.0, 3.0, 12.0),
)
LIPS_BEFORE = 55.4
LINED = (-28.0, 33.0)  # heights between which there is a cavity
DEEP = -80.0  # how far behind the axis


def lines_mouth(places: NDArray) -> NDArray[np.bool_]:
    """(k,) which places (k, 3) on the skin line the mouth, from where the lips meet: millimetres
    on a face of the default size whose mouth's axis is upright."""
    x, y, z = np.asarray(places).T
    z = z + LIPS_BEFORE
    turn = np.degrees(np.arctan2(np.abs(x), z))
    least = np.interp(turn, *LINING) - np.interp(y, *LINING_LESS)
    away = np.hypot(x, np.maximum(z, 0))
    return np.asarray((away < least) & (z > DEEP) & (y > LINED[0]) & (y < LINED[1]))


_SIDED: dict[str, tuple[str, tuple[float, ...]]] = {
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
    # The rest of the 68 points that face alignment is used to, see LANDMARKS_68.
    "jawline_1": ("skin", (6.88, -1.26, -5.56)),
    "jawline_2": ("skin", (6.47, -3.0, -4.14)),
    "jawline_3": ("skin", (6.08, -5.0, -3.66)),
    "jawline_4": ("skin", (5.52, -6.92, -3.03)),
    "jawline_5": ("skin", (4.98, -8.02, -2.55)),
    "jawline_6": ("skin", (4.34, -8.89, -2.09)),
    "jawline_7": ("skin", (3.53, -9.53, -0.96)),
    "jawline_8": ("skin", (2.1, -10.25, 0.6)),
    "brow_inner_half": ("skin", (2.29, 1.79, 2.39)),
    "brow_outer_half": ("skin", (4.15, 1.67, 1.61)),
    "nostril": ("skin", (0.81, -4.03, 3.63)),
    "eye_top_inner": ("skin", (2.37, 0.35, 1.55)),
    "eye_top_outer": ("skin", (3.6, 0.44, 1.42)),
    "eye_bottom_inner": ("skin", (2.35, -0.46, 1.33)),
    "eye_bottom_outer": ("skin", (3.58, -0.46, 1.23)),
    "lip_peak": ("skin", (0.43, -5.31, 3.19)),
    "lip_upper_outer": ("skin", (1.28, -5.84, 3.06)),
    "lip_lower_outer": ("skin", (1.46, -7.25, 2.67)),
    "lip_lower_inner": ("skin", (0.61, -7.62, 2.97)),
    "mouth_inner_corner": ("skin", (1.81, -6.6, 2.56)),
    "lip_inner_upper": ("skin", (0.68, -6.52, 3.12)),
    "lip_inner_lower": ("skin", (0.82, -6.74, 2.85)),
}
_MIDDLE: dict[str, tuple[str, tuple[float, ...]]] = {
    "nose_root": ("skin", (0.0, 0.0)),
    "nose_tip": ("skin", (0.0, -3.55)),
    "nose_base": ("skin", (0.0, -4.62)),
    "lip_top": ("skin", (0.0, -5.72)),
    "lip_bottom": ("skin", (0.0, -7.92)),
    "chin": ("skin", (0.0, -10.3)),
    "forehead": ("skin", (0.0, 5.0)),
    "nose_bridge_upper": ("skin", (0.0, -0.94, 2.55)),
    "nose_bridge_lower": ("skin", (0.0, -1.98, 3.2)),
    "lip_inner_top": ("skin", (0.0, -6.48, 3.3)),
    "lip_inner_bottom": ("skin", (0.0, -6.75, 3.02)),
}

# name -> (part, place); jaw, cheekbone and temple lie on the side of the head.
LANDMARK_POINTS: dict[str, tuple[str, tuple[float, ...]]] = {
    **{f"{name}_left": value for name, value in _SIDED.items()},
    **{f"{name}_right": (part, (-at[0], *at[1:])) for name, (part, at) in _SIDED.items()},
    **_MIDDLE,
}
LANDMARKS: tuple[str, ...] = tuple(LANDMARK_POINTS)


def _both(*names: str) -> tuple[str, ...]:
    """Names from the face's right to the middle, and mirrored from there to its left."""
    return (*(f"{n}_right" for n in names), *(f"{n}_left" for n in reversed(names)))


_JAW = _both(*(f"jawline_{k}" for k in range(1, 9)))
_NOSE = _both("nose_wing", "nostril")
_UPPER, _LOWER = _both("lip_upper_outer", "lip_peak"), _both("lip_lower_outer", "lip_lower_inner")
# The 68 points of Sagonas et al. 2013 ("300 Faces in-the-Wild Challenge", ICCV workshops), in
# their order: jaw from the face's right to its left, brows, nose, eyes, outer and inner lips. The
# jaw's lie on the mandible itself, not on the outline that a turned head happens to show.
LANDMARKS_68: tuple[str, ...] = (
    *_JAW[:8], "chin", *_JAW[8:],
    *_both("brow_outer", "brow_outer_half", "brow_peak", "brow_inner_half", "brow_inner"),
    "nose_root", "nose_bridge_upper", "nose_bridge_lower", "nose_tip",
    *_NOSE[:2], "nose_base", *_NOSE[2:],
    *(f"eye_{n}_right" for n in ("outer", "top_outer", "top_inner", "inner",
                                 "bottom_inner", "bottom_outer")),
    *(f"eye_{n}_left" for n in ("inner", "top_inner", "top_outer", "outer",
                                "bottom_outer", "bottom_inner")),
    "mouth_corner_right", *_UPPER[:2], "lip_top", *_UPPER[2:],
    "mouth_corner_left", *_LOWER[::-1][:2], "lip_bottom", *_LOWER[::-1][2:],
    "mouth_inner_corner_right", "lip_inner_upper_right", "lip_inner_top", "lip_inner_upper_left",
    "mouth_inner_corner_left", "lip_inner_lower_left", "lip_inner_bottom", "lip_inner_lower_right",
)  # fmt: skip


def smooth_curve(points: NDArray, count: int) -> NDArray[np.float64]:
    """`count` points along a shape-preserving curve through `points` (k, d), evenly by length."""
    from scipy.interpolate import PchipInterpolator  # heavy, and only baking draws curves

    points = np.asarray(points, dtype=float)
    s = arc_lengths(points)
    if len(points) > 2:
        fine = PchipInterpolator(s, points)(np.linspace(0, s[-1], 200))
    else:
        fine = np.linspace(points[0], points[1], 200)
    s = arc_lengths(fine)
    return resampled(fine, s, np.linspace(0, s[-1], count))


DEEPEST = 0.02  # metres that a surface may lie behind what is beside it


AMONG = 80  # triangles near a place that may be under it


class FromFront:
    """A surface as it is seen from the front: vertices (n, 3), triangles (t, 3), of which those
    count whose vertices are all `allowed` (n,) and that face the viewer."""

    def __init__(self, vertices: NDArray, triangles: NDArray, allowed: NDArray):
        from scipy.spatial import cKDTree

        own = triangles[allowed[triangles].all(axis=1)]
        corner = vertices[own]
        a, b, c = (corner[:, k, :2] for k in range(3))
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        facing = np.flatnonzero(area > 1e-12)
        self._triangles, self._corner, self._area = own[facing], corner[facing], area[facing]
        self._depth = self._corner[:, :, 2].mean(axis=1)
        self._tree = cKDTree(self._corner[:, :, :2].mean(axis=1))

    def bind(self, places: NDArray) -> tuple[NDArray, NDArray]:
        """Vertex indices (k, 3) and barycentric weights (k, 3) of the frontmost triangle under each
        of the places (k, 2); ValueError if there is none."""
        near = np.sort(self._tree.query(places, k=min(AMONG, len(self._area)))[1], axis=1)
        deep = self._depth[near]
        seen = deep > deep.max(axis=1, keepdims=True) - DEEPEST  # not what is seen through a slit
        a, b, c = np.moveaxis(self._corner[near][..., :2], 2, 0)
        weight = _weights(places[:, None], a, b, c, self._area[near])
        inside = seen & (weight >= -1e-3).all(axis=2)
        for k in np.flatnonzero(~inside.any(axis=1)):  # between triangles seen edge on: the nearest
            clipped = np.clip(weight[k], 0, 1)
            clipped /= clipped.sum(axis=1, keepdims=True)
            off = np.einsum("kc,kcd->kd", clipped, self._corner[near[k]][:, :, :2]) - places[k]
            away = np.where(seen[k], np.hypot(*off.T), np.inf)
            at = first_least(away)
            if away[at] > 0.003:
                raise ValueError(f"no surface under the place {tuple(places[k] * 100)} cm")
            inside[k, at] = True
        best = first_most(np.where(inside, deep, -np.inf), axis=1)
        k = np.arange(len(places))
        chosen = np.clip(weight[k, best], 0, 1)
        return self._triangles[near[k, best]], chosen / chosen.sum(axis=1, keepdims=True)


def bind_from_front(
    places: NDArray, vertices: NDArray, triangles: NDArray, allowed: NDArray
) -> tuple[NDArray, NDArray]:
    """Bind places (k, 2) seen from the front to the surface under them, see `FromFront`."""
    return FromFront(vertices, triangles, allowed).bind(places)


def _weights(p: NDArray, a: NDArray, b: NDArray, c: NDArray, area: NDArray) -> NDArray:
    """(..., 3) barycentric weights of places (..., 2) in triangles a, b, c of twice this area."""
    wa = _cross(b - p, c - p) / area
    wb = _cross(c - p, a - p) / area
    return np.stack([wa, wb, 1 - wa - wb], axis=-1)


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


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
LIP_UPPER = ((0.0, -5.82), (0.42, -5.66), (1.0, -5.98), (1.68, -6.39), (2.34, -6.80))
LIP_LOWER = ((0.0, -7.95), (0.6, -7.88), (1.2, -7.62), (1.78, -7.22), (2.34, -6.84))


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
