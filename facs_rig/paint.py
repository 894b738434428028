"""What the face is made of: skin, lips, brows, eye white, iris, pupil, teeth, tongue, lashes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .rig import FaceRig, landmark_points

# name -> (base colour, linear RGBA 0..1; roughness)
MATERIALS: dict[str, tuple[tuple[float, float, float, float], float]] = {
    "skin": ((0.86, 0.63, 0.52, 1.0), 0.55),
    "eyes": ((0.90, 0.89, 0.87, 1.0), 0.20),
    "iris": ((0.16, 0.24, 0.30, 1.0), 0.20),
    "pupil": ((0.01, 0.01, 0.01, 1.0), 0.15),
    "brows": ((0.085, 0.052, 0.036, 1.0), 0.70),
    "brow_skin": ((0.46, 0.31, 0.235, 1.0), 0.60),
    "teeth": ((0.86, 0.82, 0.74, 1.0), 0.30),
    "lips": ((0.66, 0.36, 0.32, 1.0), 0.40),
    "tongue": ((0.30, 0.08, 0.075, 1.0), 0.40),
    "mouth": ((0.10, 0.02, 0.02, 1.0), 0.45),
    "lashes": ((0.05, 0.035, 0.03, 1.0), 0.80),
}
MATERIAL_NAMES = tuple(MATERIALS)


def materials_at(
    rig: FaceRig, neutral: NDArray, points: NDArray, part: NDArray
) -> NDArray[np.int32]:
    """Index into MATERIAL_NAMES for each of `points` (k, 3) on the neutral face (n, 3).

    part : (k,) index of the part each point belongs to. The skin under the brows, irises and
    pupils are the areas that the rig's surface strokes enclose, seen from the front.
    """
    by_part = np.array([MATERIAL_NAMES.index(name) for name in rig.part_names])
    out = by_part[part].astype(np.int32)
    skin = part == rig.part_names.index("skin")
    front = points[:, 2] > 0
    for material, carrier, outline in _drawn_areas(rig, neutral):
        near = front & (part == rig.part_names.index(carrier))
        flat = points[:, :2]
        near &= np.all((flat >= outline.min(axis=0)) & (flat <= outline.max(axis=0)), axis=1)
        index = np.flatnonzero(near)
        out[index[_inside(flat[index], outline)]] = MATERIAL_NAMES.index(material)
    out[skin & _inside_mouth(rig, neutral, points)] = MATERIAL_NAMES.index("mouth")
    return out


def _inside_mouth(rig: FaceRig, neutral: NDArray, points: NDArray) -> NDArray[np.bool_]:
    """(k,) which skin points line the cavity behind the lips rather than the face."""
    place = landmark_points(rig, neutral)
    lips = (place["lip_top"] + place["lip_bottom"]) / 2
    width = np.abs(place["mouth_corner_left"] - place["mouth_corner_right"])[0]
    near = np.abs(points - lips) < [0.45 * width, 0.27 * width, np.inf]
    return near[:, 0] & near[:, 1] & (points[:, 2] < lips[2] - 0.018) & (points[:, 2] > -0.01)


def vertex_colours(rig: FaceRig, identity: dict[str, float] | None = None) -> NDArray[np.uint8]:
    """(n, 4) sRGB colours of the vertices, for files and pictures without materials."""
    neutral = rig.neutral(identity)
    index = materials_at(rig, neutral, neutral, rig.vertex_part)
    linear = np.array([colour for colour, _ in MATERIALS.values()])
    colours = np.concatenate([srgb(linear[:, :3]), linear[:, 3:]], axis=1)
    return np.round(255 * colours[index]).astype(np.uint8)


def srgb(linear: NDArray) -> NDArray:
    """Linear light 0..1 as sRGB 0..1 (IEC 61966-2-1)."""
    low = linear * 12.92
    return np.where(linear <= 0.0031308, low, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


def _drawn_areas(rig: FaceRig, neutral: NDArray) -> Iterator[tuple[str, str, NDArray]]:
    """(material, part that carries it, outline (k, 2) from the front)."""
    for side in ("left", "right"):
        for kind in ("iris", "pupil"):
            yield kind, "eyes", rig.stroke_points(neutral, f"{kind}_{side}")[:, :2]
        lower, upper = (rig.stroke_points(neutral, f"brow_{e}_{side}") for e in ("lower", "upper"))
        rim = 0.15 * (upper - lower)  # under the hairs, not beside them
        lower, upper = (lower + rim)[1:-1], (upper - rim)[2:-1]
        yield "brow_skin", "skin", np.concatenate([lower, upper[::-1]])[:, :2]
    lower, upper = (rig.stroke_points(neutral, f"lip_{edge}") for edge in ("lower", "upper"))
    yield "lips", "skin", np.concatenate([lower, upper[::-1]])[:, :2]


def _inside(points: NDArray, outline: NDArray) -> NDArray[np.bool_]:
    """(k,) whether points (k, 2) lie in the closed outline (m, 2), by the even-odd rule."""
    ahead = np.roll(outline, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    spans = (outline[:, 1] > y) != (ahead[:, 1] > y)
    rise = ahead[:, 1] - outline[:, 1]
    slope = (ahead[:, 0] - outline[:, 0]) / np.where(rise == 0, 1.0, rise)
    crossing = outline[:, 0] + (y - outline[:, 1]) * slope
    return (np.sum(spans & (x < crossing), axis=1) % 2).astype(bool)
