"""Corners of the mouth, and what a smile does beside pulling them.

The source's targets pull the skin around a corner more than the lips' edges there: the lips thin
away before the corner, skin folds over them, and the slit that is left is seen as a black spike.
Here the skin around a corner goes with the nearest place of the lips' seam, so that lips keep
their thickness and what gives way lies farther out, where cheeks fold.

A smile also lifts the apples of the cheeks and, when the mouth opens, takes the upper lip off the
teeth, which a smile with closed lips cannot do.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..controls import CONTROLS, WHOLE
from ..keys import Key
from ..mesh import vertex_normals
from .makehuman import JOINTS, Source

# Metres from the head's joint, on the face's left; the right is its mirror image.
CORNER = np.array((0.0226, -0.0293, 0.0944))
MIDDLE_Y = -0.0275  # of the seam in the middle
REACH = (0.018, 0.017)  # metres around a corner, toward the middle and elsewhere, that go with it
STIFF = 0.65  # how far skin at the corner goes with the seam
INNER = 0.010  # metres from the middle from where on whole lips keep their thickness
SEAM = 0.0035  # metres above or below the seam that count as a lip's edge
ONE = 0.005  # metres before the corner from where on both lips become one
ALONG = 0.0022  # metres along the seam over which movements are averaged
# The apple of the cheek: middle and radii (metres), how far it comes out and rises at smile 5.
APPLE = np.array((0.0385, 0.0005, 0.0760))
APPLE_SIZE = np.array((0.0155, 0.0145, 0.0220))
APPLE_OUT, APPLE_UP = 0.0085, 0.0030
# How far an open smile lifts the upper lip's edge, metres; from where to where along the lip that
# fades, and the heights above the seam at which it is whole and at which it is gone.
LIFT = 0.0056
LIFT_ALONG, LIFT_UP = (0.008, 0.0225), (0.003, 0.0185)
TUBERCLE = (0.25, 40.0)  # least share of the upper lip in its middle, and more a metre aside
OPENED = 3.0  # intensity of jaw_open at which a smile is an open one


def ease(t: NDArray) -> NDArray[np.float64]:
    """1 at 0 and below, 0 at 1 and above, smooth."""
    t = np.clip(t, 0, 1)
    return np.asarray(1 - t * t * (3 - 2 * t))


def seam_height(x: NDArray) -> NDArray[np.float64]:
    """Height of the lips' seam at x, metres from the head's joint."""
    share = np.clip(np.abs(x) / CORNER[0], 0, 1)
    return np.asarray(MIDDLE_Y + (CORNER[1] - MIDDLE_Y) * share**2)


def stiffen_corners(moves: NDArray, cage: NDArray, skin: NDArray, wide: NDArray) -> None:
    """Let the skin around the corners of the mouth go with the lips' edges, in place.

    moves : (k, m, 3) displacements of the cage (m, 3), metres from the head's joint;
    skin : (m,) bool;  wide : (k,) bool, with which the whole lips keep their thickness, not only
    near the corners: where they are pulled as they are, not rolled or pushed
    """
    above = cage[:, 1] - seam_height(cage[:, 0])
    lips = skin & (np.abs(above) < SEAM) & (cage[:, 2] > CORNER[2] - 0.004)
    busy = np.abs(moves).max(axis=(1, 2)) > 1e-6
    for side in (1.0, -1.0):
        x = side * cage[:, 0]
        step = cage - CORNER * (side, 1, 1)
        step[:, 1] = above
        reach = np.tile(REACH[1], (len(x), 3))
        reach[x < CORNER[0], 0] = REACH[0]
        round_it = STIFF * ease(np.linalg.norm(step / reach, axis=1))
        inner = x < CORNER[0]
        step[inner, 0] = 0.0
        step[inner, 2] *= 0.5
        along = STIFF * ease(np.linalg.norm(step / reach, axis=1)) * ease((INNER - x) / INNER)
        for share, chosen in ((round_it, busy & ~wide), (along, busy & wide)):
            share = share * skin * (x > 0.002)
            near = np.flatnonzero(share > 1e-4)
            one = ease((CORNER[0] - x[near]) / ONE)  # at the corner both lips are one
            weights = []
            for upper in (True, False):
                edge = lips & ((above > 0) == upper) & (x > 0)
                gap = np.minimum(x[near], CORNER[0])[:, None] - x[edge]
                weight = np.zeros((len(near), len(x)))
                weight[:, edge] = np.exp(-((gap / ALONG) ** 2) / 2)
                weights.append(weight / weight.sum(axis=1, keepdims=True))
            own = np.where((above[near] > 0)[:, None], *weights)
            weight = own + one[:, None] * (sum(weights) / 2 - own)
            for k in np.flatnonzero(chosen):
                moves[k, near] += share[near, None] * (weight @ moves[k] - moves[k, near])


def raise_cheeks(
    controls: NDArray, cage: NDArray, source: Source, masks: dict[str, NDArray]
) -> None:
    """Add the apples of the cheeks to the smiles (47, m, 3), in place."""
    quads, skin = source.quads, source.is_part("skin")
    triangles = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    normals = vertex_normals(cage, triangles)
    apples = np.zeros_like(cage)
    for side in (1.0, -1.0):
        away = (cage - APPLE * (side, 1, 1)) / APPLE_SIZE
        bump = np.exp(-np.sum(away**2, axis=1) / 2) * skin * (normals[:, 2] > 0)
        apples += bump[:, None] * (APPLE_OUT * normals + APPLE_UP * np.array([0.0, 1.0, 0.0]))
    for k, control in enumerate(CONTROLS):
        if CONTROLS[WHOLE[k]].name == "smile":
            controls[k] += apples * masks.get(control.side, 1.0)


def open_smile(
    source: Source, cage: NDArray, masks: dict[str, NDArray]
) -> tuple[list[Key], NDArray]:
    """The keys that take the upper lip off the teeth where a smile opens, one for each side, and
    their displacements (2, m, 3) of the cage (m, 3), metres from the head's joint."""
    x, above = np.abs(cage[:, 0]), cage[:, 1] - seam_height(cage[:, 0])
    along = ease((x - LIFT_ALONG[0]) / (LIFT_ALONG[1] - LIFT_ALONG[0]))
    up = ease((above - LIFT_UP[0]) / (LIFT_UP[1] - LIFT_UP[0]))
    # In the middle the upper lip reaches down below the seam: its tubercle is lifted, too.
    upper = masks["upper"][:, 0] > np.minimum(TUBERCLE[0] + TUBERCLE[1] * x, 0.5)
    lip = source.is_part("skin") & upper & (cage[:, 2] > 0.075)
    share = (along * up * lip)[:, None]
    lift = share * np.array([0.0, LIFT, 0.0])
    keys = [
        Key(f"smile_open_{side}",
            f"min(jaw_open*{1 / OPENED:.4g},1)*min((smile+smile_{side})*0.2,1.5)")
        for side in ("left", "right")
    ]  # fmt: skip
    return keys, np.stack([lift * masks[side] for side in ("left", "right")])


def mouth_cage(source: Source, plain: NDArray) -> NDArray[np.float64]:
    """The cage (m, 3) of a face (M, 3) in metres from the head's joint."""
    m = source.size
    return np.asarray(plain[:m] - plain[m + JOINTS.index("head")])
