"""How an artist bends a face: expressions overdone, features grown and moved, the jaw bent, the
whole stretched."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS

from .artist import Artist
from .places import FEATURES, Places
from .shapes import Points

MIDDLE = 0.35  # units below the eyes: the middle of the head, about which it is stretched
# The landmarks about which a feature grows.
ANCHORS = {
    "lid": ("eye_inner", "eye_outer"), "brow": ("brow_peak",), "nose": ("nose_root", "nose_base"),
    "rim": ("mouth_corner_left", "mouth_corner_right"),
}  # fmt: skip


# Of each feature, how much of what an artist overdoes bends it, and how much shifts it: brows bend
# most, what lids do is told by how far they are open, and a mouth must stay on its chin.
OVERDONE = {"lid": (0.0, 0.0), "brow": (1.0, 0.35), "nose": (0.15, 0.15), "rim": (0.5, 0.1)}


class Frame:
    """Where a face is on the page: between the eyes, unit vectors rightward and downward as the
    head has them, and the pixels of a unit; turn : how far the nose points to the right."""

    def __init__(
        self, origin: NDArray, right: NDArray, down: NDArray, unit: float, turn: float
    ) -> None:
        self.origin, self.right, self.down = origin, right, down
        self.unit, self.turn = unit, turn

    def stretched(self, points: NDArray, artist: Artist) -> Points:
        """Points (..., 2) of the head as wide and tall as this artist draws it."""
        middle = self.origin + MIDDLE * self.unit * self.down
        frame = np.stack([self.right, self.down])
        return middle + (points - middle) @ (frame.T @ np.diag([artist.wide, artist.tall]) @ frame)


def overdone(
    points: NDArray, rest: NDArray, places: Places, frame: Frame, artist: Artist
) -> Points:
    """All places (p, 2) of an expression, going further from where they are at rest (p, 2), as in
    a caricature (Brennan 1985): in the bend of each feature more than in where it is. Brows are
    turned so that at rest they are as level as this artist has them."""
    out = points.copy()
    for k, ((kind, *_), side) in enumerate(FEATURES):
        bend, shift = OVERDONE[kind]
        own = places.feature == k
        away = points[own] - rest[own]
        if kind == "rim":
            # As the upper lip bends, so that lips part no further: how far is told by the jaw.
            upper = places.curves["rim_upper"]
            across = rest[upper] @ frame.right
            order = np.argsort(across)
            lines = (points[upper] - rest[upper])[order].T
            here = rest[own] @ frame.right
            away = np.stack([np.interp(here, across[order], line) for line in lines], axis=1)
        middle = away.mean(axis=0)
        out[own] += (artist.overdo - 1) * (bend * (away - middle) + shift * middle)
        if kind == "brow":
            line = rest[places.curves[f"brow_lower{side}"]]
            across, down = frame.right @ (line[-1] - line[0]), frame.down @ (line[-1] - line[0])
            slope = artist.level * np.arctan2(-down, abs(across)) * np.sign(across)
            c, s = np.cos(slope), np.sin(slope)
            centre = out[own].mean(axis=0)
            out[own] = centre + (out[own] - centre) @ np.array([[c, s], [-s, c]])
    return out


def moved(points: NDArray, places: Places, frame: Frame, artist: Artist) -> Points:
    """All places (p, 2) on the page, each feature grown about its anchor and shifted."""
    marks = points[places.curves["landmarks"]]
    sizes: Mapping[str, float] = {
        "lid": artist.eyes, "brow": 1.0, "nose": artist.nose_size, "rim": artist.mouth_size,
    }  # fmt: skip
    shifts = {"lid": artist.eye_shift, "brow": artist.brow_shift, "nose": artist.nose_shift,
              "rim": artist.mouth_shift}  # fmt: skip
    grow = np.tile(np.eye(2), (len(FEATURES) + 1, 1, 1))
    shift = np.zeros((len(FEATURES) + 1, 2))
    axes = np.stack([frame.right, frame.down])
    for k, ((kind, *_), side) in enumerate(FEATURES):
        anchor = np.mean([marks[LANDMARKS.index(f"{n}{side}")] for n in ANCHORS[kind]], axis=0)
        x, y = shifts[kind]
        # The eyes move apart or together, as far as the turned head shows it.
        x = x * np.sqrt(max(1 - frame.turn**2, 0.1)) * (-1 if side == "_right" else 1)
        tall = artist.eye_tall if kind == "lid" else 1.0
        grow[k] = sizes[kind] * axes.T @ np.diag([1.0, tall]) @ axes
        away = frame.unit * (x * frame.right + y * frame.down)
        shift[k] = anchor - grow[k] @ anchor + away
    out = np.einsum("pij,pj->pi", grow[places.feature], points)
    return out + shift[places.feature]


def ear_grown(outline: NDArray, frame: Frame, artist: Artist) -> Points:
    """An ear's outline (k, 2), grown about its root at the head."""
    root = outline[np.argmin(np.abs((outline - frame.origin) @ frame.right))]
    root = 0.4 * outline.mean(axis=0) + 0.6 * root
    return root + artist.ear_size * (outline - root)


def jaw_bent(face: NDArray, frame: Frame, artist: Artist) -> Points:
    """The face's outline (k, 2) with this artist's jaw: pointed, square, round, large or small."""
    centre = face.mean(axis=0)
    x, y = ((face - centre) / frame.unit @ np.stack([frame.right, frame.down]).T).T
    low = np.clip(y / max(y.max(), 1e-6), 0, 1)  # 0 at the middle of the face, 1 at the chin
    if artist.jaw == "v":
        x = x * (1 - 0.3 * low**1.2 * (1 - 0.35 * low))
    elif artist.jaw == "box":
        x = x * (1 + 0.28 * low**1.5 * (1 - low**6))
        y = np.where(low > 0.75, y * (1 - 0.06 * low), y)
    elif artist.jaw == "round":
        r = np.hypot(x, y)
        rounder = 1 + 0.55 * low**0.5 * (np.median(r) / np.maximum(r, 1e-6) - 1)
        x, y = x * rounder, y * rounder
    y = np.where(y > 0, y * artist.jaw_size, y)
    return centre + frame.unit * (x[:, None] * frame.right + y[:, None] * frame.down)
