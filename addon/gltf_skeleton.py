"""The bones of a .glb: nodes, and which of them each vertex follows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig.bones import Skeleton

MOST = 4  # bones that a vertex may follow in a set of glTF's attributes


def followed(weights: NDArray) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Bones (n, 4) that vertices follow most, and how far (n, 4), where 255 together is fully.

    weights : (n, bones) float, each row adds up to 1
    """
    most = min(MOST, weights.shape[1])
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :most]
    share = np.take_along_axis(weights, bones, axis=1)
    share = share / np.maximum(share.sum(axis=1, keepdims=True), 1e-12)
    stored = np.rint(255 * share).astype(int)
    stored[:, 0] += 255 - stored.sum(axis=1)
    bones[stored == 0] = 0
    room = ((0, 0), (0, MOST - most))
    return np.pad(bones, room).astype(np.uint8), np.pad(stored, room).astype(np.uint8)


def nodes(skeleton: Skeleton, first: int) -> list[dict[str, Any]]:
    """The nodes of the bones, of which the first gets the number `first` in the file."""
    out = []
    for k, (name, parent) in enumerate(zip(skeleton.bones, skeleton.parents, strict=True)):
        turn, place = skeleton.turns[k], skeleton.places[k]
        if parent >= 0:
            back = skeleton.turns[parent].T
            turn, place = back @ turn, back @ (place - skeleton.places[parent])
        node: dict[str, Any] = {
            "name": name,
            "translation": [round(float(x), 6) for x in place],
            "rotation": [round(float(x), 7) for x in quaternion(turn)],
        }
        children = [first + c for c, other in enumerate(skeleton.parents) if other == k]
        out.append(node | ({"children": children} if children else {}))
    return out


def to_bones(skeleton: Skeleton) -> NDArray[np.float64]:
    """(bones, 4, 4) from the mesh to each bone, in the pose in which both are written."""
    out = np.tile(np.eye(4), (len(skeleton.bones), 1, 1))
    back = skeleton.turns.swapaxes(1, 2)
    out[:, :3, :3] = back
    out[:, :3, 3] = -np.einsum("bij,bj->bi", back, skeleton.places)
    return out


def quaternion(turn: NDArray) -> NDArray[np.float64]:
    """(x, y, z, w) of a rotation (3, 3): Bar-Itzhack 2000, "New Method for Extracting the
    Quaternion from a Rotation Matrix"."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    table = [[a - e - i, b + d, c + g, h - f], [b + d, e - a - i, f + h, c - g],
             [c + g, f + h, i - a - e, d - b], [h - f, c - g, d - b, a + e + i]]  # fmt: skip
    found = np.linalg.eigh(np.array(table))[1][:, -1]
    return -found if found[3] < 0 else found
