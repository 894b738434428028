"""Where a moustache grows: the skin between the nose and the upper lip, in coordinates of its own.

The chart of the beard is too coarse for it: a moustache is hardly a centimetre high. It is a band
that lies on the rim of the upper lip, as high as there is room under the nose, and comes to a
point on each side, at the corners of the mouth or past them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..anatomy import LANDMARKS
from ..common.derived import derived
from ..paint import MATERIAL_NAMES, materials_at
from ..rig import FaceRig

SPREAD, RISE, WIDEST = 1.3, 1.0, 2.0
"""A moustache of which no more is known (see `moustache_at`), and the most that one spreads."""
BEYOND_CORNER = (0.30, 0.55)
"""How far lower and upper rim of the widest band go down for each metre past the mouth's corner."""
FOLD = (0.38, 0.006)
"""Where the upper rim is over the corner: so far up from it to the nose's wing, and metres more."""
STEP, HIGH = 0.002, 0.025
"""Metres from one place of the lip's rim to the next, and that it may be over the corners."""
SOFT = 0.003
"""Metres over which a moustache grows thin at its upper rim, and half of it at its lower one."""
BULGE, POINTED = 2.6, 0.85
"""How long a band keeps its height toward its ends, and how it comes to a point there."""
ENDS = 0.25
"""Share of its half width in which it grows thin toward each end."""


def rim_of(rig: FaceRig, vertices: NDArray) -> NDArray[np.float64]:
    """(k, 2) metres from the middle and up, the upper lip's rim on an upright face at rest (v, 3):
    from its middle to a corner of the mouth, and on."""
    line = np.asarray(vertices, float)[_rim(rig)][:, :2]
    line[0, 0] = 0.0
    far = line[-1] + 0.05 * np.array([1, -BEYOND_CORNER[0]])
    return np.concatenate([line, far[None]])


@derived
def _rim(rig: FaceRig) -> NDArray[np.intp]:
    """Vertices at the upper edge of the red of the lips, from the middle to the left corner."""
    rest = np.asarray(rig.neutral(), float)
    corner = rig.landmarks[LANDMARKS.index("mouth_corner_left")]
    near = np.flatnonzero(
        rig.parts["skin"] & (rest[:, 0] > -STEP / 2) & (rest[:, 0] < rest[corner, 0] - STEP / 2)
        & (rest[:, 1] > rest[corner, 1]) & (rest[:, 1] < rest[corner, 1] + HIGH)
        & (rest[:, 2] > rest[corner, 2] - STEP)
    )  # fmt: skip
    material = materials_at(rig, rest[near], rig.vertex_part[near])
    red = near[material == MATERIAL_NAMES.index("lips")]
    column = np.rint(rest[red, 0] / STEP).astype(np.intp)
    columns = (red[column == k] for k in np.unique(column))
    line = [mine[rest[mine, 1].argmax()] for mine in columns] + [corner]
    kept: list[int] = []  # of them the upper hull (Andrew 1979): a light face's are uneven
    for k in line:
        while len(kept) > 1 and _turn(*rest[[*kept[-2:], k], :2]) >= 0:
            kept.pop()
        kept.append(int(k))
    return np.array(kept)


def _turn(a: NDArray, b: NDArray, c: NDArray) -> float:
    """More than 0 where the way from a over b to c turns left."""
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def lip_places(points: NDArray, rim: NDArray, mark: dict[str, NDArray]) -> NDArray[np.float64]:
    """(k, 3) where points (k, 3) of an upright face are about the upper lip: from the middle, in
    halves of the mouth's width; metres above the lip's `rim_of`; and metres from there to the nose,
    or to the fold beside it. mark : the face's landmarks"""
    away = np.abs(points[:, 0])
    corner, wing = mark["mouth_corner_left"], mark["nose_wing_left"]
    low = np.interp(away, *rim.T)
    over = corner[1] + FOLD[0] * (wing[1] - corner[1]) + FOLD[1]
    base = mark["nose_base"][1]
    far = over - 0.05 * BEYOND_CORNER[1]
    top = np.interp(away, [0, wing[0], corner[0], corner[0] + 0.05], [base, base, over, far])
    # Without room there is no band; far out both rims have met.
    return np.stack([away / corner[0], points[:, 1] - low, np.maximum(top - low, 1e-4)], axis=1)


def moustache_at(lip: NDArray, spread: float, rise: float) -> NDArray[np.float64]:
    """(k,) how thick a moustache grows at places (k, 3) of `lip_places`, 0..1.

    spread : halves of the mouth's width to its ends;  rise : share of the way from lip to nose
    """
    across, up, room = lip.T
    out = np.clip(across / spread, 0, 1)
    high = rise * room * (1 - out**BULGE) ** POINTED
    upper = np.clip(0.5 + (high - up) / (2 * SOFT), 0, 1)
    lower = np.clip(0.5 + up / SOFT, 0, 1)
    return upper * lower * np.clip((1 - out) / ENDS, 0, 1)
