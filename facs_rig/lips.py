"""Lips that meet instead of passing through each other.

Each control moves the lips for itself; two that close them (or one on a mouth that is closed
already) would push one lip through the other. How far each control brings the lips together is
measured at several places along the mouth; what the sum takes too far, a key pushes apart again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .keys import Key

ZONES = (-0.0235, -0.017, -0.009, 0.0, 0.009, 0.017, 0.0235)  # metres from the middle
OVERLAP = 0.005  # metres that a contact key at value 1 parts the lips by
REACH = 0.020  # metres above and below the seam over which the push fades
HALF = 0.0013  # metres to each side of a zone where its lips are looked for
SLACK = 0.0002  # metres that lips may press into each other before they are parted
PRESSED = 0.0004  # metres that lips at rest press into each other, so that no gap shows
# Controls that part the lips; all others leave a closed mouth closed.
PARTING = ("sneer", "lower_lip_depress", "lip_loosen", "jaw_", "wince")
LEAST_CLOSING = 0.00025  # metres at intensity 5: a control that does less does not count


def lip_zones(
    fine: NDArray, normals: NDArray, skin: NDArray, seam: NDArray
) -> list[tuple[NDArray, NDArray]]:
    """For each zone the vertices of the upper lip that face down, of the lower that face up.

    fine, normals : (n, 3) of the plain face;  skin : (n,) bool;  seam : (3,) where the lips meet
    in the middle
    """
    x = fine[:, 0]
    near = skin & (np.abs(fine[:, 1] - seam[1]) < 0.006)
    near &= fine[:, 2] > seam[2] - 0.008 - 25 * x**2
    return [
        (
            np.flatnonzero(near & (np.abs(x - zone) < HALF) & (normals[:, 1] < -0.3)),
            np.flatnonzero(near & (np.abs(x - zone) < HALF) & (normals[:, 1] > 0.3)),
        )
        for zone in ZONES
    ]


def gaps(face: NDArray, zones: list[tuple[NDArray, NDArray]]) -> NDArray[np.float64]:
    """(zones,) metres between the lips of a face (n, 3), negative where they overlap."""
    return np.array([face[upper, 1].min() - face[lower, 1].max() for upper, lower in zones])


def seam_markers(
    fine: NDArray, zones: list[tuple[NDArray, NDArray]]
) -> list[tuple[int, int]]:
    """For each zone the vertices where the upper lip is lowest and the lower lip highest."""
    return [
        (int(upper[np.argmin(fine[upper, 1])]), int(lower[np.argmax(fine[lower, 1])]))
        for upper, lower in zones
    ]


def closing(delta: NDArray, markers: list[tuple[int, int]]) -> NDArray[np.float64]:
    """(zones,) metres by which displacements (n, 3) bring the lips together."""
    upper, lower = np.array(markers).T
    return delta[lower, 1] - delta[upper, 1]


def sealed(rest, deltas: NDArray, opened, apart: NDArray) -> NDArray[np.float64]:
    """Displacements (m, 3) of the cage that leave a mouth closed.

    opened : function from the moved cage to the zones' gaps (metres) that are too much;
    apart : (zones, m, 3) from `lip_deltas`. Repeated, as lips that close also move aside.
    """
    for _ in range(4):
        deltas = deltas - np.tensordot(opened(rest + deltas) / OVERLAP, apart, axes=1)
    return deltas


def lip_keys(names: tuple[str, ...], closings: NDArray) -> list[Key]:
    """A key for each zone whose value is the overlap of the lips there, in units of OVERLAP.

    closings : (controls, zones) metres at intensity 5
    """
    keys = []
    for zone in range(len(ZONES)):
        terms = [
            f"{value / OVERLAP / 5:+.4g}*{name}"
            for name, value in zip(names, closings[:, zone], strict=True)
            if value
        ]
        keys.append(Key(f"lips_apart_{zone + 1}", f"max({''.join(terms)}-{SLACK / OVERLAP:.3g},0)"))
    return keys


def lip_deltas(cage: NDArray, is_upper: NDArray, movable: NDArray, seam_y: float) -> NDArray:
    """(zones, m, 3) displacements of `lip_keys` on the cage (m, 3).

    is_upper : (m,) 1 above the seam, 0 below;  movable : (m,) bool, the skin
    """
    x, away = cage[:, 0], np.abs(cage[:, 1] - seam_y)
    t = np.clip(away / REACH, 0, 1)
    fade = (1 - t * t * (3 - 2 * t)) * movable * (cage[:, 2] > 0.06)
    out = np.zeros((len(ZONES), len(cage), 3))
    zones = np.array(ZONES)
    hats = np.stack([np.interp(x, zones, np.eye(len(zones))[k]) for k in range(len(zones))])
    beyond = np.clip(1 - (np.abs(x) - zones[-1]) / 0.015, 0, 1)
    for k, hat in enumerate(hats):
        out[k, :, 1] = OVERLAP / 2 * (2 * is_upper - 1) * fade * hat * beyond
    return out
