"""Lips that meet instead of passing through each other.

Each control moves the lips for itself; two that close them (or one on a mouth that is closed
already) would push one lip through the other. How far each control brings the lips together is
measured at several places along the mouth; what the sum takes too far, a key pushes apart again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..common.ties import first_least, first_most
from ..controls import CONTROLS, WHOLE
from ..keys import Key
from ..mesh import vertex_normals
from .makehuman import JOINTS, Source
from .people import WHOLE_FACES, People

# Where the lips meet: metres from the middle, metres from the head's joint.
SEAM = ((0.0, -0.0281), (0.015, -0.0281), (0.0226, -0.0292))
# Metres above and below the seam within which upper turns into lower: to CORNER from the middle,
# how much more for every metre beyond, where the lips become one, and at most.
RAMP, CORNER, WIDER, WIDEST = 0.001, 0.0195, 0.33, 0.004
DEEPEST = 0.0766  # metres before the head's joint from where on lips are looked at, in the middle
# Places along the mouth, and how far to each side of each its lips are looked for: metres.
HALF = 0.0013
ZONES = dict.fromkeys((-0.0235, -0.017, -0.009, 0.0, 0.009, 0.017, 0.0235), HALF)
# Where closed lips are laid on each other once more: more closely toward the corner, where the seam
# is slanted and a gap would show teeth. Beyond these places the push ends at once, in metres.
_LEFT = {0.009: HALF, 0.013: 0.0007, 0.017: 0.0007, 0.0187: 0.0005, 0.0197: 0.0005,
         0.0206: 0.0005, 0.0213: 0.0005}  # fmt: skip
SEALED = {**{-x: half for x, half in reversed(_LEFT.items())}, 0.0: HALF, **_LEFT}
BEYOND, BEYOND_SEALED = 0.015, 0.0014
OVERLAP = 0.005  # metres that a contact key at value 1 parts the lips by
REACH = 0.020  # metres above and below the seam over which the push fades
# Metres that lips at rest press into each other, so that no gap shows; SEALED, more.
PRESSED, PRESSED_SEALED = 0.0004, 0.0006
# Controls that part the lips; all others leave a closed mouth closed.
PARTING = ("sneer", "lower_lip_depress", "lip_loosen", "jaw_", "wince")
# Lips that roll in pass behind each other's edge, unseen: only a part of that is an overlap.
ROLLING = {"lip_tighten": 0.34, "lip_lock": 0.55}
LEAST_CLOSING = 0.00025  # metres at intensity 5: a control that does less does not count


@dataclass(frozen=True)
class Mouth:
    """Where the lips of the plain face are, and what parts them.

    matrix : (n, m) refinement;  zones : for each of some places along the mouth the vertices of
    the upper lip that face down and of the lower that face up;  apart : (zones, m, 3)
    displacements of the cage that part the lips by OVERLAP;  masks : left, right, upper, lower ->
    (m, 1) weights that cut a blendshape;
    markers : (zones, 2) the lowest vertex of the upper lip and the highest of the lower
    """

    matrix: sp.csr_matrix
    zones: list[tuple[NDArray, NDArray]]
    apart: NDArray
    masks: dict[str, NDArray]
    markers: NDArray

    def gaps(self, cage: NDArray) -> NDArray[np.float64]:
        """(zones,) metres between the lips of a cage (m, 3), negative where they overlap."""
        y = self.matrix @ cage[:, 1]
        return np.array([y[upper].min() - y[lower].max() for upper, lower in self.zones])

    def closing(self, moves: NDArray) -> NDArray[np.float64]:
        """(zones,) metres by which displacements (m, 3) of the cage bring the lips together."""
        y = (self.matrix[self.markers.ravel()] @ moves)[:, 1].reshape(-1, 2)
        return y[:, 1] - y[:, 0]


def measure_mouth(
    source: Source,
    plain: NDArray,
    matrix: sp.csr_matrix,
    triangles: NDArray,
    skin: NDArray,
    places: Mapping[float, float] = ZONES,
) -> Mouth:
    """The mouth of the plain face (M, 3); skin : (n,) which fine vertices are skin; places :
    metres from the middle at which the lips are looked at -> metres to each side."""
    cage = plain[: source.size] - plain[source.size + JOINTS.index("head")]
    fine = matrix @ cage
    normals = vertex_normals(fine, triangles)
    masks = side_masks(cage)
    x, y, z = fine.T
    near = skin & (np.abs(y - seam_height(x)) < 0.006) & (z > DEEPEST - 25 * x**2)
    zones, markers = [], []
    for zone, half in places.items():
        here = near & (np.abs(x - zone) < half)
        upper, lower = (np.flatnonzero(here & (sign * normals[:, 1] > 0.3)) for sign in (-1, 1))
        zones.append((upper, lower))
        markers.append((upper[first_least(y[upper])], lower[first_most(y[lower])]))
    apart = lip_deltas(cage, masks["upper"][:, 0], source.is_part("skin"), places)
    return Mouth(matrix, zones, apart, masks, np.array(markers))


def seam_height(x: NDArray) -> NDArray[np.float64]:
    """Metres from the head's joint at which the lips meet at x metres from the middle."""
    return np.asarray(np.interp(np.abs(x), *np.array(SEAM).T))


def side_masks(cage: NDArray) -> dict[str, NDArray]:
    """Weights (m, 1) that cut a blendshape in left and right, or upper and lower lip.

    The cut is a linear ramp, 1 cm to each side of the middle, 1 mm around the line of the lips and
    wider at their corners, where a sharp cut would fold the skin; opposite masks add up to one.
    """
    x, above = cage[:, 0], cage[:, 1] - seam_height(cage[:, 0])
    ramp = np.clip(RAMP + WIDER * (np.abs(x) - CORNER), RAMP, WIDEST)
    left = np.clip(0.5 + x / 0.02, 0, 1)
    upper = np.clip(0.5 + above / ramp / 2, 0, 1)
    masks = {"left": left, "right": 1 - left, "upper": upper, "lower": 1 - upper}
    return {name: mask[:, None] for name, mask in masks.items()}


def seal_identities(people: People, mouth: Mouth, pressed: float) -> None:
    """Close the lips of every identity at rest, in place, until they press into each other by so
    many metres; features leave them as they are."""
    close(people, mouth, pressed)
    m = mouth.matrix.shape[1]
    plain = people.plain[:m]
    rest = mouth.gaps(plain)
    for k in range(WHOLE_FACES, len(people.deltas)):
        people.deltas[k, :m] = sealed(plain, people.deltas[k, :m], mouth, lambda gaps: gaps - rest)


def close(people: People, mouth: Mouth, pressed: float) -> None:
    """Close the lips of whole faces at rest until they press into each other by so many metres,
    in place."""
    m = mouth.matrix.shape[1]
    for k in range(WHOLE_FACES):
        people.deltas[k, :m] = sealed(
            people.base[:m], people.deltas[k, :m], mouth, lambda gaps: gaps + pressed
        )
    plain = people.plain[:m]  # with its share of the body's weight, which all faces have
    people.base[:m] += sealed(plain, np.zeros_like(plain), mouth, lambda gaps: gaps + pressed)


def seal_controls(controls: NDArray, plain: NDArray, mouth: Mouth) -> None:
    """Take what parts closed lips out of all controls (47, M, 3) but PARTING ones, in place."""
    m = mouth.matrix.shape[1]
    rest = mouth.gaps(plain[:m])
    for k, control in enumerate(CONTROLS):
        if control.name.startswith(PARTING) or WHOLE[k] != k:
            continue
        closed = sealed(plain[:m], controls[k, :m], mouth, lambda gaps: np.maximum(gaps - rest, 0))
        shift = closed - controls[k, :m]
        for j in (j for j in range(len(CONTROLS)) if WHOLE[j] == k):  # itself and its sides
            controls[j, :m] += shift * mouth.masks.get(CONTROLS[j].side, 1.0)


def sealed(rest: NDArray, moves: NDArray, mouth: Mouth, excess) -> NDArray[np.float64]:
    """Displacements (m, 3) of the cage without what `excess` of the gaps (zones,) is too much.

    Repeated, as lips that close also move aside.
    """
    for _ in range(4):
        opened = excess(mouth.gaps(rest + moves))
        moves = moves - np.tensordot(opened / OVERLAP, mouth.apart, axes=1)
    return moves


def lip_keys(controls: NDArray, mouth: Mouth) -> list[Key]:
    """A key for each zone whose value is the overlap of the lips there, in units of OVERLAP.

    controls : (47, m, 3) displacements of the cage at intensity 5
    """
    closings = np.stack([mouth.closing(moves) for moves in controls])  # (47, zones)
    for stem, share in ROLLING.items():
        closings[[control.name.startswith(stem) for control in CONTROLS]] *= share
    closings[np.abs(closings) < LEAST_CLOSING] = 0
    for k in range(len(CONTROLS)):  # a symmetric control is exactly its two sides
        sides = [j for j in range(len(CONTROLS)) if WHOLE[j] == k != j]
        if sides:
            closings[k] = closings[sides].sum(axis=0)
    keys = []
    for zone in range(len(ZONES)):
        terms = [
            f"{value / OVERLAP / 5:+.4g}*{control.name}"
            for control, value in zip(CONTROLS, closings[:, zone], strict=True)
            if value
        ]
        keys.append(Key(f"lips_apart_{zone + 1}", f"max({''.join(terms)},0)"))
    return keys


def lip_deltas(
    cage: NDArray, is_upper: NDArray, movable: NDArray, places: Mapping[float, float]
) -> NDArray:
    """(zones, m, 3) displacements of `lip_keys` on the cage (m, 3).

    is_upper : (m,) 1 above the seam, 0 below;  movable : (m,) bool, the skin
    """
    x, away = cage[:, 0], np.abs(cage[:, 1] - seam_height(cage[:, 0]))
    t = np.clip(away / REACH, 0, 1)
    fade = (1 - t * t * (3 - 2 * t)) * movable * (cage[:, 2] > 0.06)
    out = np.zeros((len(places), len(cage), 3))
    zones = np.array(list(places))
    hats = np.stack([np.interp(x, zones, np.eye(len(zones))[k]) for k in range(len(zones))])
    last = BEYOND_SEALED if places is SEALED else BEYOND
    beyond = np.clip(1 - (np.abs(x) - zones[-1]) / last, 0, 1)
    for k, hat in enumerate(hats):
        out[k, :, 1] = OVERLAP / 2 * (2 * is_upper - 1) * fade * hat * beyond
    return out
