"""Whose face it is: identity parameters from the landmarks of a sketch."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.identity import FEATURES
from facs_rig.rotation import rotation

__all__ = ["fit_identity"]

RIDGE = 0.35
"""How dear a parameter is: so many hundredths of the face's height of landmark error at ±1."""
LIMIT = 0.8
"""Parameters stay within this much of the natural range of -1 to 1."""
ROUNDS = 4


def fit_identity(
    rig: FaceRig,
    parameters: FaceParameters,
    camera: Camera,
    landmarks: Mapping[str, tuple[float, float]],
    ridge: float = RIDGE,
) -> dict[str, float]:
    """Identity features that bring the posed face's landmarks onto those of a sketch.

    Regularised linear least squares (Tikhonov) in the features, which move the landmarks
    linearly, together with a scale and a shift of the picture, iterated with the features kept
    within ±LIMIT. Features that no landmark speaks of stay at 0.

    landmarks : name -> (u, v) in pixels of `camera`. Returns name -> value, without the zeros.
    """
    names = [name for name in landmarks if name in LANDMARKS]
    if len(names) < 6:
        return {}
    points = np.array([landmarks[name] for name in names], dtype=float)
    rows = [LANDMARKS.index(name) for name in names]
    base = rig.pose(parameters)[rig.landmarks[rows]]
    moves = rig.landmark_moves[:, rows] @ rotation(parameters.head).T
    flat = camera.project(base)
    jacobian = camera.project(base + moves) - flat  # (features, landmarks, 2)
    size = 0.01 * camera.scale[1] * 0.24  # a hundredth of the height of a head in pixels
    solution = np.zeros(len(FEATURES))
    free = np.ones(len(FEATURES), dtype=bool)
    for _ in range(ROUNDS):
        here = flat + np.tensordot(solution * ~free, jacobian, axes=1)
        columns = [
            *jacobian[free].reshape(free.sum(), -1),
            (flat - camera.centre).ravel(),  # scale
            np.tile([1.0, 0.0], len(names)),
            np.tile([0.0, 1.0], len(names)),
        ]
        system = np.array(columns).T / size
        price = np.diag(np.r_[np.full(free.sum(), ridge * np.sqrt(len(names))), 0, 0, 0])
        wanted = np.r_[(points - here).ravel() / size, np.zeros(len(price))]
        found = np.linalg.lstsq(np.vstack([system, price]), wanted, rcond=None)[0]
        solution[free] = found[: free.sum()]
        over = free & (np.abs(solution) > LIMIT)
        solution = np.clip(solution, -LIMIT, LIMIT)
        if not over.any():
            break
        free &= ~over
    return {
        feature.name: round(float(value), 4)
        for feature, value in zip(FEATURES, solution, strict=True)
        if abs(value) > 0.005
    }
