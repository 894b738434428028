"""What of a fitted face stays at rest, and what belongs to the expression that was drawn.

A drawing shows one expression. What its lines ask for beyond person and actions is either the
person's, whose sides are nearly alike, or how this person does the drawn actions: about as much as
these move the skin there, and the sides need not agree. Both are Gaussian, and what was found is
their sum, so that the likeliest parts follow from their covariances (the posterior of a sum of two
Gaussian processes: Rasmussen & Williams 2006, ch. 2; Duvenaud 2014, "Automatic Model Construction
with Gaussian Processes", ch. 2.4). The thesis asks for this in its last chapter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig import FaceParameters, FaceRig
from facs_rig.controls import CONTROLS, REGIONS
from facs_rig.fitted_keys import FITTED_REGIONS, FittedKey

from .field import MIRROR
from .parts import carry_parts, eyeballs, keep_lids_on_eyes

__all__ = ["expression_keys"]

OTHERWISE = 1.0
"""How differently somebody does an action, as a share of its movement."""
SIZE = 0.004
"""Metres: how large offsets at rest are."""
ALIKE = 0.99
"""Sides that are wholly alike leave nothing to be found: so much at most."""
LEAST = 2e-4
"""Metres: a key that moves nothing so far is left out."""


def expression_keys(
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray[np.floating],
    symmetry: float,
) -> tuple[FittedKey, ...]:
    """The keys of what belongs to the drawn actions; `offsets` without them stay at rest.

    parameters : of the fitted face      offsets : (n, 3) metres, as fitted, head upright
    symmetry : 0..1, the correlation of offsets at rest with the mirror image of the other side's
    """
    who, aus = parameters.identity, {k: v for k, v in parameters.aus.items() if v > 0}
    if not aus or not np.any(offsets):
        return ()
    plain = FaceParameters({}, who)
    moves = rig.moves([(plain, FaceParameters({name: v}, who)) for name, v in aus.items()])
    strong = dict(zip(aus, np.einsum("and,and->an", moves, moves), strict=True))
    moved = sum(strong.values())
    rest = _at_rest(rig, offsets, OTHERWISE**2 * moved, symmetry)
    rest = carry_parts(rig, face := rig.shape(plain), rest)
    for eye in eyeballs(rig):  # no action moves them
        rest[eye] = offsets[eye]
    rest = keep_lids_on_eyes(rig, face, rest)
    shown, keys = offsets - rest, []
    for region in REGIONS:
        here = {control.name for control in CONTROLS if control.region == region}
        ours = {name: energy for name, energy in strong.items() if name in here}
        part = sum(ours.values(), np.zeros(len(moved))) / np.maximum(moved, 1e-12)
        mine = (part[:, None] * shown).astype(np.float32)
        if np.abs(mine).max() < LEAST:
            continue
        total = sum(energy.sum() for energy in ours.values())
        shares = {name: float(energy.sum() / total) for name, energy in ours.items()}
        drawn = {name: aus[name] for name in ours}
        keys.append(FittedKey(FITTED_REGIONS[region], mine, shares, drawn))
    return tuple(keys)


def _at_rest(
    rig: FaceRig, offsets: NDArray, shown: NDArray[np.floating], symmetry: float
) -> NDArray[np.float64]:
    """(n, 3) the likeliest part of the offsets (n, 3) that a face has at rest.

    shown : (n,) square metres, the variance of what goes with the expression

    Of a vertex and its mirror image, with offsets f and g (mirrored), at rest they have the
    covariance S [1 ρ; ρ 1], by the expression [v 0; 0 w]: rest = S (S + V)⁻¹ [f g]ᵀ.
    """
    size, v, w = SIZE**2, shown, shown[rig.mirror]
    symmetry = min(symmetry, ALIKE)
    mirrored = (offsets * MIRROR)[rig.mirror]
    alone = size * (1 - symmetry**2)
    both = (size + v) * (size + w) - (size * symmetry) ** 2
    own, other = size * (alone + w) / both, size * symmetry * v / both
    return own[:, None] * offsets + other[:, None] * mirrored
