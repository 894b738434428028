"""Hairs of a beard go with the skin that they grow from: to any expression, pose and person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.derived import derived
from ..curves import head_frame
from ..rig import FaceRig

UNMOVED = 1e-4  # metres: less than any file keeps


@dataclass(frozen=True, eq=False)
class Bound:
    """Points bound to the skin, each by the root that its hair has.

    index, weight : (r, 3) vertices that a root lies between, and their weights
    anchors : (r, 3) vertices around it, which say how the skin there is turned
    skull : (3,) the same for the head, which no action turns
    root : (n,) of which root each point is
    turned, stiff : (n, 3) metres, what of its way from the root turns with the skin, in the axes of
        its anchors, and what with the head
    """

    index: NDArray[np.int32]
    weight: NDArray[np.float32]
    anchors: NDArray[np.int32]
    skull: NDArray[np.int32]
    root: NDArray[np.int32]
    turned: NDArray[np.float32]
    stiff: NDArray[np.float32]

    def points(self, vertices: NDArray) -> NDArray[np.float32]:
        """(n, 3) metres on a face (v, 3), of whatever person, pose and expression."""
        vertices = np.asarray(vertices, np.float32)
        a, b, c = self.weight.T[..., None]
        first, second, third = self.index.T
        at = a * vertices[first] + b * vertices[second] + c * vertices[third]
        axes = axes_of(vertices[self.anchors])
        out = at[self.root]
        for k in range(3):
            out += self.turned[:, k : k + 1] * axes[:, k][self.root]
        if self.stiff.any():
            out += self.stiff @ axes_of(vertices[self.skull][None])[0]
        return out

    def moves(
        self, vertices: NDArray, moves: Mapping[str, NDArray]
    ) -> dict[str, NDArray[np.float32]]:
        """Name -> (n, 3) metres that a face's moves (v, 3) move the points, those that do.

        vertices : (v, 3) metres, unmoved
        """
        used = np.unique(np.concatenate([self.index.ravel(), self.anchors.ravel(), self.skull]))
        rest, out = self.points(vertices), {}
        for name, move in moves.items():
            if np.abs(move[used]).max() > UNMOVED:
                out[name] = self.points(vertices + move) - rest
        return out


def axes_of(corners: NDArray) -> NDArray[np.floating]:
    """(k, 3, 3) right-angled unit axes of triangles (k, 3, 3): along the first edge, across it, and
    out of the triangle."""
    along = corners[:, 1] - corners[:, 0]
    out = np.cross(along, corners[:, 2] - corners[:, 0])
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return np.stack([along, np.cross(out, along), out], axis=1)


def bound_to(
    points: NDArray,
    root: NDArray,
    roots: tuple[NDArray, NDArray, NDArray],
    stiffness: NDArray,
    rig: FaceRig,
    vertices: NDArray,
) -> Bound:
    """Bind points (n, 3), metres, on an upright face at rest (v, 3), to their roots.

    roots : index, weight and anchors of `Bound`
    stiffness : (r,) 0..1, how far a hair keeps to the head's turning and not to the skin's
    """
    index, weight, anchors = roots
    skull = skull_of(rig)
    vertices = np.asarray(vertices, float)
    away = points - np.einsum("kc,kcd->kd", weight, vertices[index])[root]
    share = stiffness[root, None]
    head = axes_of(vertices[skull][None])[0]
    axes = axes_of(vertices[anchors])[root]
    return Bound(
        index.astype(np.int32), weight.astype(np.float32), anchors.astype(np.int32), skull,
        root.astype(np.int32),
        ((1 - share) * np.einsum("ncd,nd->nc", axes, away)).astype(np.float32),
        (share * away @ head.T).astype(np.float32),
    )  # fmt: skip


@derived
def skull_of(rig: FaceRig) -> NDArray[np.int32]:
    """(3,) vertices of the skull, wide apart."""
    still = rig.parts["skin"] & (rig.weights >= 1).all(axis=1)
    right, left, top, _ = (
        int(k) for k in np.asarray(head_frame(rig.neutral(), still)[0])[[1, 0, 2, 3]]
    )
    return np.array([right, left, top], np.int32)
