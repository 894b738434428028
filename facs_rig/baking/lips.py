"""Lips that meet instead of passing through each other.

Each control moves the lips for itself; two that close them (or one on a mouth that is closed
already) would push one lip through the other. How far each control brings the lips together is
measured at several places along the mouth; what the sum takes too far, a key pushes apart again.
"""

from __future__ import annotations

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

ZONES = (-0.0235, -0.017, -0.009, 0.0, 0.009, 0.017, 0.0235)  # metres from the middle
# Where closed lips are laid on each other once more: near the corner, where the seam is slanted and
# a gap would show teeth. Beyond these places the push ends at once, in metres.
_NEAR_CORNER = (0.0187, 0.0197, 0.0206, 0.0213)
SEALED = (*(-x for x in _NEAR_CORNER[::-1]), *ZONES[1:-1], *_NEAR_CORNER)
BEYOND, BEYOND_SEALED = 0.015, 0.0014
OVERLAP = 0.005  # metres that a contact key at value 1 parts the lips by
REACH = 0.020  # metres above and below the seam over which the push fades
HALF, HALF_NEAR = 0.0013, 0.0005  # metres to each side of a zone where its lips are looked for
SLACK = 0.0002  # metres that lips may press into each other before they are parted
# Metres that lips at rest press into each other, so that no gap shows; SEALED, more.
PRESSED, PRESSED_SEALED = 0.0004, 0.0007
# Controls that part the lips; all others leave a closed mouth closed.
PARTING = ("sneer", "lower_lip_depress", "lip_loosen", "jaw_", "wince")
# Lips that roll in pass behind each other's edge, unseen: only a part of that is an overlap.
ROLLING = {"lip_tighten": 0.3, "lip_lock": 0.5}
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
        y = (self.matrix @ cage)[:, 1]
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
    places: tuple[float, ...] = ZONES,
) -> Mouth:
    """The mouth of the plain face (M, 3); skin : (n,) which fine vertices are skin; places :
    metres from the middle at which the lips are looked at."""
    cage = plain[: source.size] - plain[source.size + JOINTS.index("head")]
    fine = matrix @ cage
    normals = vertex_normals(fine, triangles)
    seam = cage[lip_line(cage)]
    masks = side_masks(cage, seam[1])
    x, y, z = fine.T
    near = skin & (np.abs(y - seam[1]) < 0.006) & (z > seam[2] - 0.008 - 25 * x**2)
    zones, markers = [], []
    for zone in places:
        half = HALF_NEAR if places is SEALED and abs(zone) in _NEAR_CORNER else HALF
        here = near & (np.abs(x - zone) < half)
        upper, lower = (np.flatnonzero(here & (sign * normals[:, 1] > 0.3)) for sign in (-1, 1))
        zones.append((upper, lower))
        markers.append((upper[first_least(y[upper])], lower[first_most(y[lower])]))
    apart = lip_deltas(cage, masks["upper"][:, 0], source.is_part("skin"), seam[1], places)
    return Mouth(matrix, zones, apart, masks, np.array(markers))


def side_masks(cage: NDArray, seam_y: float) -> dict[str, NDArray]:
    """Weights (m, 1) that cut a blendshape in left and right, or upper and lower lip.

    The cut is a linear ramp, 1 cm to each side of the middle, 1 mm around the line of the lips;
    opposite masks add up to one.
    """
    left = np.clip(0.5 + cage[:, 0] / 0.02, 0, 1)
    upper = np.clip(0.5 + (cage[:, 1] - seam_y) / 0.002, 0, 1)
    masks = {"left": left, "right": 1 - left, "upper": upper, "lower": 1 - upper}
    return {name: mask[:, None] for name, mask in masks.items()}


def lip_line(cage: NDArray) -> int:
    """Index of the cage vertex where the lips meet in the middle, seen from the front."""
    middle = np.flatnonzero((np.abs(cage[:, 0]) < 1e-4) & (cage[:, 2] > 0.08))
    middle = middle[(cage[middle, 1] > -0.055) & (cage[middle, 1] < -0.005)]
    return int(middle[first_least(np.abs(cage[middle, 1] + 0.028))])


def seal_identities(people: People, mouth: Mouth) -> None:
    """Close the lips of every identity at rest, in place; features leave them as they are."""
    close(people, mouth, PRESSED)
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
        keys.append(Key(f"lips_apart_{zone + 1}", f"max({''.join(terms)}-{SLACK / OVERLAP:.3g},0)"))
    return keys


def lip_deltas(
    cage: NDArray, is_upper: NDArray, movable: NDArray, seam_y: float, places: tuple[float, ...]
) -> NDArray:
    """(zones, m, 3) displacements of `lip_keys` on the cage (m, 3).

    is_upper : (m,) 1 above the seam, 0 below;  movable : (m,) bool, the skin
    """
    x, away = cage[:, 0], np.abs(cage[:, 1] - seam_y)
    t = np.clip(away / REACH, 0, 1)
    fade = (1 - t * t * (3 - 2 * t)) * movable * (cage[:, 2] > 0.06)
    out = np.zeros((len(places), len(cage), 3))
    zones = np.array(places)
    hats = np.stack([np.interp(x, zones, np.eye(len(zones))[k]) for k in range(len(zones))])
    last = BEYOND_SEALED if places is SEALED else BEYOND
    beyond = np.clip(1 - (np.abs(x) - zones[-1]) / last, 0, 1)
    for k, hat in enumerate(hats):
        out[k, :, 1] = OVERLAP / 2 * (2 * is_upper - 1) * fade * hat * beyond
    return out
