"""From movements known along lines to a smooth movement of all the skin.

A Gaussian process (Rasmussen & Williams 2006, "Gaussian Processes for Machine Learning", ch. 2):
the movement over the skin is as smooth as skin moves, and what is known of it is its part across a
line, at the line's points, with an error. Unlike a sum of falling-off handles it neither piles up
where lines are dense nor lumps around each of them, and what a line leaves open, the way along it,
is decided by the lines nearby that run otherwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

__all__ = ["smooth_field"]

MIRROR = np.array([-1.0, 1.0, 1.0], np.float32)
"""What takes a side of the face to the other."""


def smooth_field(
    places: NDArray[np.floating],
    normals: NDArray[np.floating],
    moves: NDArray[np.floating],
    errors: NDArray[np.floating],
    at: NDArray[np.floating],
    length: float,
    size: float,
    symmetry: float = 0.0,
) -> NDArray[np.float64]:
    """The likeliest movement (m, 3) at places `at` (m, 3), to six digits.

    Parameters
    ----------
    places : (k, 3) float, metres, where something is known; x to the side, 0 in the middle
    normals : (k, 3) float, unit, the direction of which it is known
    moves : (k,) float, metres, the movement in that direction
    errors : (k,) float, metres, how far off each may be; above 0
    at : (m, 3) float, metres
    length : metres over which a movement dies away (standard deviation of a bell)
    size : metres, how large movements usually are
    symmetry : 0..1, the correlation of a movement with the mirror image of the other side's

    Raises ValueError when an error is not above 0.
    """
    if not len(places):
        return np.zeros((len(at), 3))
    if not (np.asarray(errors) > 0).all():
        raise ValueError("What is known of a movement has an error above 0.")
    places, normals = np.asarray(places, float), np.asarray(normals, float)
    alike = _bell(places, places, length) * (normals @ normals.T)
    if symmetry:
        there, away = places * MIRROR, normals * MIRROR
        alike += symmetry * _bell(places, there, length) * (normals @ away.T)
    alike[np.diag_indices(len(places))] += (np.asarray(errors) / size) ** 2
    share = cho_solve(cho_factor(alike, lower=True), np.asarray(moves, float))
    # What was solved for is exact; where it is asked, single precision is plenty.
    here, known = np.asarray(at, np.float32), np.asarray(places, np.float32)
    pulls = (share[:, None] * normals).astype(np.float32)
    field = _bell(here, known, length) @ pulls
    if symmetry:
        field += np.float32(symmetry) * _bell(here, known * MIRROR, length) @ (pulls * MIRROR)
    return field


def _bell(a: NDArray, b: NDArray, length: float) -> NDArray[np.float64]:
    """(k, m) exp(-d² / 2 length²) of the distances d between points (k, 3) and (m, 3)."""
    a, b = a / a.dtype.type(length), b / b.dtype.type(length)
    exponent = a @ b.T
    exponent -= 0.5 * (a * a).sum(axis=1)[:, None]
    exponent -= 0.5 * (b * b).sum(axis=1)
    return np.exp(np.minimum(exponent, 0.0, out=exponent), out=exponent)
