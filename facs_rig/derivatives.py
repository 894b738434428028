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
    ASYMMETRY,
    BY_NAME,
    CAGE_TARGETS,
    DETAILS,
    ENDS,
    FEATURES,
    IDENTITY_KEYS,
    PEOPLE,
    check_identity,
    target_weights,
)
from .macros import macro_targets, macro_weights
from .mesh import is_shape
from .parameters import FaceParameters

if TYPE_CHECKING:
    from .rig import FaceRig

DETAIL_WEIGHTS = tuple(DETAILS.values())
MACROS = len(macro_targets())
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


@dataclass(frozen=True)
class Slopes:
    """How fast the weights of a face's targets and keys change with its parameters.

    identity : (parameters, targets), keys : (controls, keys), for each unit of these
    """

    identity: NDArray[np.float32]
    keys: NDArray[np.float32]


def slopes(
    rig: FaceRig, parameters: FaceParameters, identity: Sequence[str], controls: Sequence[str]
) -> Slopes:
    """Taken as differences about `parameters`, inside the parameters' ranges.

    Raises ValueError for unknown names.
    """
    widths, poses = [], []
    for name in controls:
        here = parameters.aus.get(name, 0.0)
        low, high = max(here - STEP, 0.0), min(here + STEP, MAX_INTENSITY)
        poses += [replace(parameters, aus={**parameters.aus, name: v}) for v in (low, high)]
        widths.append(high - low)
    keys = np.zeros((0, len(rig.keys)), np.float32)
    if poses:
        values = rig.key_values_of(poses)
        keys = (values[1::2] - values[::2]) / np.array(widths, np.float32)[:, None]
    return Slopes(identity_slopes(parameters.identity, identity), keys)


def identity_slopes(identity: Mapping[str, float], names: Sequence[str]) -> NDArray[np.float32]:
    """(names, targets) how the targets' weights change with each parameter, about `identity`."""
    found = np.zeros((len(names), len(IDENTITY_KEYS)), np.float32)
    known = check_identity(identity)
    readers = _readers(known)
    ends_of = {feature.name: ENDS.start + 2 * k for k, feature in enumerate(FEATURES)}
    ends_of |= {feature.name: MACROS + 2 * k for k, feature in enumerate(ASYMMETRY)}
    for row, name in enumerate(names):
        feature, here = BY_NAME[name], known[name]
        least, most = feature.minimum, feature.maximum  # of people, as long as this is one
        if not least <= here <= most:
            least, most = feature.span
        low, high = max(here - STEP, least), min(here + STEP, most)
        less, more = ({**known, name: x} for x in (low, high))
        if not feature.minimum <= low <= high <= feature.maximum:
            found[row] = target_weights(more) - target_weights(less)
        else:
            if name in ends_of:
                # The weights of its own two ends are -x and x, where they are above 0.
                column = ends_of[name]
                found[row, column : column + 2] = (
                    min(low, 0) - min(high, 0),
                    max(high, 0) - max(low, 0),
                )
            elif feature in PEOPLE:
                found[row, :MACROS] = macro_weights(more) - macro_weights(less)
            for k in readers.get(name, ()):
                found[row, CAGE_TARGETS + k] = DETAIL_WEIGHTS[k](more) - DETAIL_WEIGHTS[k](less)
        found[row] /= high - low
    return found


def _readers(known: Mapping[str, float]) -> dict[str, list[int]]:
    """Of each parameter the details whose weights hang on it: name -> their places in DETAILS."""
    readers: dict[str, list[int]] = {}
    for k, weight in enumerate(DETAIL_WEIGHTS):
        asked = _Read(known)
        weight(asked)
        for name in asked.names:
            readers.setdefault(name, []).append(k)
    return readers


class _Read(dict[str, float]):
    """Parameters by name, that remember which of them were asked for.

    Few weights of details hang on features, and it takes a while to work out all of them.
    """

    def __init__(self, known: Mapping[str, float]) -> None:
        super().__init__(known)
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> float:
        self.names.add(name)
        return super().__getitem__(name)

    def get(self, name: str, default: float = 0.0) -> float:  # type: ignore[override]
        return self[name] if name in self else default


def movements(points: SurfacePoints, slopes: Slopes) -> NDArray[np.float32]:
    """(parameters + controls, k, 3) metres that points of the upright head move for each unit."""
    parts = [(slopes.identity, points.identity), (slopes.keys, points.keys)]
    return np.concatenate([np.tensordot(*part, axes=1) for part in parts])
