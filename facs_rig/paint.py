"""What the face is made of: skin, lips, brows, eye white, iris, pupil, teeth, tongue, lashes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .anatomy import LOOK_DOWN, lines_mouth
from .common.derived import derived
from .looks import PLAIN, Finish, colours_of
from .rig import FaceRig, landmark_points
from .rotation import rotation

MATERIAL_NAMES = tuple(PLAIN)
MADE_OF = {"bust": "skin"}  # part -> material, where it has another name
TINTED = ("skin", "lips", "brow_skin")  # one skin, in several colours
# The polygons are too coarse for the rim of the lips, so it is drawn softly: what lies within this
# distance of a vertex is averaged.
SOFT = 0.0012  # metres
# Where blood shows through: between which landmarks, how much, over which distance in metres.
_BLUSH = ((("cheekbone_left", "nose_wing_left"), 0.13, 0.017),
          (("cheekbone_right", "nose_wing_right"), 0.13, 0.017),
          (("nose_tip",), 0.14, 0.008), (("chin",), 0.06, 0.012))  # fmt: skip


@dataclass(frozen=True)
class Painted:
    """What is painted on the vertices of the default face, and so on everybody's.

    material : (n,) int, index into MATERIAL_NAMES
    areas : (n, 3) float32, how far a vertex of the skin is plain, lip, and skin under a brow
    blush : (n, 3) float32, what the skin's colour is multiplied by where blood shows through
    """

    material: NDArray[np.int32]
    areas: NDArray[np.float32]
    blush: NDArray[np.float32]

    def colours(self, palette: Mapping[str, Finish]) -> NDArray[np.float32]:
        """(n, 4) linear RGBA of the vertices. palette : MATERIAL_NAMES -> what it is made of"""
        every = np.array([palette[name].colour for name in MATERIAL_NAMES], dtype=np.float32)
        out = every[self.material]
        skin = self.areas.any(axis=1)
        tinted = every[[MATERIAL_NAMES.index(name) for name in TINTED]]
        out[skin] = self.areas[skin] @ tinted
        out[skin, :3] *= self.blush[skin]
        return out


@derived
def painted(rig: FaceRig) -> Painted:
    """What is painted on a rig's vertices, worked out once."""
    neutral = rig.neutral()
    n, kinds = len(neutral), [MATERIAL_NAMES.index(name) for name in TINTED]
    material = materials_at(rig, neutral, rig.vertex_part)
    areas = (material[:, None] == kinds).astype(np.float32)
    around = areas.argmax(axis=1)[rig.triangles]
    mixed = (around != around[:, :1]).any(axis=1)
    rim = np.unique(rig.triangles[mixed])
    rim = rim[areas[rim].any(axis=1) & (neutral[rim, 2] > 0)]
    total = np.zeros((len(rim), 3))
    for turn in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        for radius in (0.4 * SOFT, SOFT):
            aside = radius * np.array([np.cos(turn), np.sin(turn), 0.0])
            index = materials_at(rig, neutral[rim] + aside, rig.vertex_part[rim])
            total += index[:, None] == kinds
    count = total.sum(axis=1, keepdims=True)
    areas[rim] = np.where(count > 0, total / np.maximum(count, 1), (1, 0, 0))

    blush = np.ones((n, 3), dtype=np.float32)
    skin = np.flatnonzero(rig.parts["skin"] & (neutral[:, 2] > 0))
    places = landmark_points(rig, neutral)
    for names, amount, reach in _BLUSH:
        middle = np.mean([places[name] for name in names], axis=0)
        far = np.linalg.norm(neutral[skin] - middle, axis=1) / reach
        blush[skin] *= 1 - amount * np.exp(-0.5 * far**2)[:, None] * (0.1, 0.8, 0.7)
    return Painted(material, areas, blush)


def materials_at(rig: FaceRig, points: NDArray, part: NDArray) -> NDArray[np.int32]:
    """Index into MATERIAL_NAMES for each of `points` (k, 3) on the default face at rest.

    Of anybody's face: where on the default one the same point of the skin lies. part : (k,) index
    of the part each point belongs to. The skin under the brows, irises and pupils are the areas
    that the rig's surface strokes enclose, seen from the front.
    """
    by_part = np.array([MATERIAL_NAMES.index(MADE_OF.get(name, name)) for name in rig.part_names])
    out = by_part[part].astype(np.int32)
    skin = part == rig.part_names.index("skin")
    front = points[:, 2] > 0
    for material, carrier, outline in _drawn_areas(rig, rig.neutral()):
        near = front & (part == rig.part_names.index(carrier))
        flat = points[:, :2]
        near &= np.all((flat >= outline.min(axis=0)) & (flat <= outline.max(axis=0)), axis=1)
        index = np.flatnonzero(near)
        out[index[_inside(flat[index], outline)]] = MATERIAL_NAMES.index(material)
    out[skin & _inside_mouth(rig, points)] = MATERIAL_NAMES.index("mouth")
    return out


def _inside_mouth(rig: FaceRig, points: NDArray) -> NDArray[np.bool_]:
    """(k,) which skin points of the default face line the cavity behind the lips."""
    place = landmark_points(rig, rig.neutral())
    lips = (place["lip_inner_top"] + place["lip_inner_bottom"]) / 2
    return lines_mouth(1000 * (points - lips) @ rotation((0.0, -LOOK_DOWN, 0.0)).T)


def vertex_colours(rig: FaceRig, identity: Mapping[str, float] | None = None) -> NDArray[np.uint8]:
    """(n, 4) sRGB colours of the vertices, for files and pictures without materials."""
    return as_bytes(painted(rig).colours(colours_of(identity or {})))


def as_bytes(linear: NDArray) -> NDArray[np.uint8]:
    """Linear RGBA (n, 4) as sRGB in bytes."""
    colours = np.concatenate([srgb(linear[:, :3]), linear[:, 3:]], axis=1)
    return np.round(255 * np.clip(colours, 0, 1)).astype(np.uint8)


def linear_light(srgb_: NDArray) -> NDArray:
    """The inverse of `srgb`."""
    low = srgb_ / 12.92
    return np.where(srgb_ <= 0.04045, low, ((np.maximum(srgb_, 0) + 0.055) / 1.055) ** 2.4)


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
