"""Lips that meet instead of passing through each other.

Each control moves the lips for itself; two that close them (or one on a mouth that is closed
already) would push one lip through the other. How far each control brings the lips together is
measured at several places along the mouth; what the sum takes too far, a key pushes apart again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .keys import Key

ZONES = (-0.019, -0.010, 0.0, 0.010, 0.019)  # metres along the mouth, from the middle
OVERLAP = 0.005  # metres that a contact key at value 1 parts the lips by
REACH = 0.020  # metres above and below the seam over which the push fades
HALF = 0.0022  # metres to each side of a zone where its lips are looked for
SLACK = 0.0002  # metres that lips may press into each other before they are parted
LEAST = 0.00025  # metres at intensity 5: a control that does less does not count


def seam_markers(
    fine: NDArray, normals: NDArray, skin: NDArray, seam: NDArray
) -> list[tuple[int, int]]:
    """For each zone the vertices where the upper lip is lowest and the lower lip highest.

    fine, normals : (n, 3) of the plain face;  skin : (n,) bool;  seam : (3,) where the lips meet
    in the middle
    """
    out = []
    for zone in ZONES:
        near = skin & (np.abs(fine[:, 0] - zone) < HALF) & (np.abs(fine[:, 1] - seam[1]) < 0.006)
        near &= (fine[:, 2] > seam[2] - 0.008 - 25 * zone**2)
        upper = np.flatnonzero(near & (normals[:, 1] < -0.3))
        lower = np.flatnonzero(near & (normals[:, 1] > 0.3))
        out.append((int(upper[np.argmin(fine[upper, 1])]), int(lower[np.argmax(fine[lower, 1])])))
    return out


def closing(delta: NDArray, markers: list[tuple[int, int]]) -> NDArray[np.float64]:
    """(zones,) metres by which displacements (n, 3) bring the lips together."""
    upper, lower = np.array(markers).T
    return delta[lower, 1] - delta[upper, 1]


def lip_keys(names: tuple[str, ...], closings: NDArray) -> list[Key]:
    """A key for each zone whose value is the overlap of the lips there, in units of OVERLAP.

    closings : (controls, zones) metres at intensity 5
    """
    keys = []
    for zone in range(len(ZONES)):
        terms = [
            f"{value / OVERLAP / 5:+.3g}*{name}"
            for name, value in zip(names, closings[:, zone], strict=True)
            if abs(value) > LEAST
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
