"""Hair follows the skull: to another pose, another expression, another person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..curves import head_frame
from ..mesh import is_shape
from ..rig import FaceRig
from .head import WIDEST

NEAREST = 4  # vertices of the scalp that a point hangs from
SOFT = 0.01  # metres by which points share what is near


@dataclass(frozen=True)
class Bound:
    """Points bound to the skull.

    index, weight : (n, 4) vertices of the scalp that each point hangs from, and their weights
    lift : (n, 3) how far it stands off them, along the axes of the head
    anchors, axes : (4,) vertices of the skull and (3, 4) weights of them that give these axes
    """

    index: NDArray[np.int32]
    weight: NDArray[np.float32]
    lift: NDArray[np.float32]
    anchors: NDArray[np.int32]
    axes: NDArray[np.float32]

    def points(self, vertices: NDArray) -> NDArray[np.float32]:
        """(n, 3) metres on a face (v, 3), of whatever person, pose and expression."""
        at = np.einsum("kc,kcd->kd", self.weight, vertices[self.index])
        return (at + self.lift @ (self.axes @ vertices[self.anchors])).astype(np.float32)


def bind(points: NDArray, rig: FaceRig, identity: Mapping[str, float] | None = None) -> Bound:
    """Bind points (n, 3), metres, of hair on an upright person to its skull.

    What moves with the face does not move hair: it hangs from the scalp above the brows, stiff,
    at the size of the head. InputError for what no person can be.
    """
    is_shape(np.asarray(points), (None, 3), "points")
    vertices = rig.neutral(identity)
    over = scalp(rig)
    away, near = cKDTree(vertices[over]).query(points, NEAREST)
    weight = 1 / (away + SOFT)
    weight /= weight.sum(axis=1, keepdims=True)
    index = over[near]
    # The nape follows the head in part: axes that hang on it would shear the hair.
    anchors, axes = head_frame(rig.neutral(), rig.parts["skin"] & (rig.weights >= 1).all(axis=1))
    lift = points - np.einsum("kc,kcd->kd", weight, vertices[index])
    frame = axes @ vertices[anchors]
    return Bound(
        index.astype(np.int32), weight.astype(np.float32),
        (lift @ np.linalg.inv(frame)).astype(np.float32),
        anchors.astype(np.int32), axes.astype(np.float32),
    )  # fmt: skip


def scalp(rig: FaceRig) -> NDArray[np.intp]:
    """The vertices of the skull behind the forehead and above the ears, which no action moves."""
    rest = rig.neutral()
    skin = rig.parts["skin"]
    eyes = rest[rig.parts["eyes"]].mean(axis=0)
    above = rest[skin, 1].max() - eyes[1]
    back = rest[skin & (rest[:, 1] > eyes[1]), 2].min()
    high = rest[:, 1] > eyes[1] + WIDEST * above
    behind = rest[:, 2] < eyes[2] + 0.25 * (back - eyes[2])
    return np.flatnonzero(skin & high & behind & (rig.weights >= 1).all(axis=1))
