"""How points of the surface move when a parameter of the face changes: what fitting needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .controls import MAX_INTENSITY
from .identity import (
    BY_NAME,
    CAGE_TARGETS,
    ENDS,
    FEATURES,
    IDENTITY_KEYS,
    check_identity,
    detail_weights,
    target_weights,
)
from .mesh import is_shape
from .parameters import FaceParameters

if TYPE_CHECKING:
    from .rig import FaceRig

STEP = 0.05  # of a parameter, between which its movement is taken


@dataclass(frozen=True)
class SurfacePoints:
    """k points of a face and what moves them.

    identity : (targets, k, 3), keys : (keys, k, 3), metres at weight 1, head upright;
    neutral : (k, 3) metres without any target or key
    """

    neutral: NDArray[np.float32]
    identity: NDArray[np.float32]
    keys: NDArray[np.float32]

    def at(self, index: NDArray | slice) -> SurfacePoints:
        """Some of the points."""
        return SurfacePoints(self.neutral[index], self.identity[:, index], self.keys[:, index])


def surface_points(
    rig: FaceRig,
    vertices: NDArray,
    weights: NDArray,
    identity: Mapping[str, float] | None = None,
) -> SurfacePoints:
    """Points given by vertices (k, c) and their weights (k, c), such as corners of triangles.

    identity : whose keys move them; the default person's if None. Raises ValueError if vertices
    and weights differ in shape.
    """
    is_shape(weights, vertices.shape, "weights")
    count, corners = vertices.shape
    rows = np.repeat(np.arange(count), corners)
    mixing = sp.csr_matrix(
        (np.asarray(weights, np.float32).ravel(), (rows, vertices.ravel())),
        shape=(count, rig.n_vertices),
    )
    matrix, cage, at, skin = rig.linear_parts(identity)
    rows = (mixing @ matrix).tocsr()
    used = np.unique(rows.indices)  # a few points touch little of the cage
    fine, own = _mixed(rows[:, used], cage[used]), _mixed(mixing[:, at], skin)
    split, details = 1 + CAGE_TARGETS, len(IDENTITY_KEYS) - CAGE_TARGETS
    targets = np.concatenate([fine[1:split], own[:details]])
    return SurfacePoints(fine[0], targets, np.concatenate([fine[split:], own[details:]]))


def _mixed(rows: sp.csr_matrix, moves: NDArray) -> NDArray[np.float32]:
    """(moves, k, 3) at points whose weights (k, m) of the movements (m, moves, 3) are given."""
    fine = rows @ moves.reshape(len(moves), 3 * moves.shape[1])
    return fine.reshape(-1, moves.shape[1], 3).transpose(1, 0, 2)


def identity_slopes(identity: Mapping[str, float], names: Sequence[str]) -> NDArray[np.float32]:
    """(names, targets) how the targets' weights change with each parameter, about `identity`."""
    slopes = np.zeros((len(names), len(IDENTITY_KEYS)), np.float32)
    known = check_identity(identity)
    place = {feature.name: k for k, feature in enumerate(FEATURES)}
    for row, name in enumerate(names):
        feature, here = BY_NAME[name], known[name]
        least, most = feature.minimum, feature.maximum  # of people, as long as this is one
        if not least <= here <= most:
            least, most = feature.span
        low, high = max(here - STEP, least), min(here + STEP, most)
        ends = ({**known, name: x} for x in (low, high))
        if name in place and feature.minimum <= low and high <= feature.maximum:
            # The weights of its own two ends are -x and x, where they are above 0.
            column = ENDS.start + 2 * place[name]
            less, more = np.array([[-min(x, 0.0), max(x, 0.0)] for x in (low, high)])
            slopes[row, column : column + 2] = (more - less) / (high - low)
            less, more = (detail_weights(who) for who in ends)
            slopes[row, CAGE_TARGETS:] = (more - less) / (high - low)
        else:
            less, more = (target_weights(who) for who in ends)
            slopes[row] = (more - less) / (high - low)
    return slopes


def movements(
    rig: FaceRig,
    points: SurfacePoints,
    parameters: FaceParameters,
    identity: Sequence[str],
    controls: Sequence[str],
) -> NDArray[np.float32]:
    """(identity + controls, k, 3) metres that points move for each unit of these parameters.

    Of the upright head, taken as differences about `parameters`, inside the parameters' ranges.
    Raises ValueError for unknown names.
    """
    how = []
    poses = []
    for name in controls:
        here = parameters.aus.get(name, 0.0)
        low, high = max(here - STEP, 0.0), min(here + STEP, MAX_INTENSITY)
        poses += [replace(parameters, aus={**parameters.aus, name: v}) for v in (low, high)]
        how.append(1 / (high - low))
    parts = [np.tensordot(identity_slopes(parameters.identity, identity), points.identity, axes=1)]
    if how:
        values = rig.key_values_of(poses)
        slopes = (values[1::2] - values[::2]) * np.array(how, np.float32)[:, None]
        parts.append(np.tensordot(slopes, points.keys, axes=1))
    return np.concatenate(parts)
