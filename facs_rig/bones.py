"""The bones of a posed face, for files: root, neck, head, eyes and jaw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .parameters import FaceParameters
from .rig import FaceRig
from .rotation import rotation

BONES = ("root", "neck", "head", "eye_left", "eye_right", "jaw")
PARENTS = (-1, 0, 1, 2, 2, 2)


@dataclass(frozen=True)
class Skeleton:
    """Bones in a pose, parents first, and what follows them.

    bones : their names      parents : index of each one's parent, -1 for none
    places : (b, 3) metres, where each turns      turns : (b, 3, 3) how each is turned
    weights : (n, b) how far each vertex follows each; a row adds up to 1
    """

    bones: tuple[str, ...]
    parents: tuple[int, ...]
    places: NDArray[np.float64]
    turns: NDArray[np.float64]
    weights: NDArray[np.float32]


def skeleton_of(rig: FaceRig, parameters: FaceParameters) -> Skeleton:
    """The bones of a posed face of the rig.

    The jaw carries no skin, which its keys move: it is where things can hang.
    """
    joints = rig.joints(parameters.identity)
    neck, head = rotation(parameters.neck), rotation(parameters.head)
    about = joints["neck"]

    def posed(joint: str) -> NDArray:
        return neck @ (head @ joints[joint] - about) + about

    both = neck @ head
    gaze = both @ rotation((*parameters.gaze, 0.0))
    places = [about, about, *(posed(name) for name in BONES[2:])]
    turns = [np.eye(3), neck, both, gaze, gaze, both]
    return Skeleton(BONES, PARENTS, np.array(places), np.array(turns), bone_weights(rig))


def bone_weights(rig: FaceRig) -> NDArray[np.float32]:
    """(n, len(BONES)) how far each vertex follows each bone."""
    head, neck = rig.weights.T
    weights = np.zeros((rig.n_vertices, len(BONES)), dtype=np.float32)
    weights[:, BONES.index("root")] = (1 - head) * (1 - neck)
    weights[:, BONES.index("neck")] = (1 - head) * neck
    weights[:, BONES.index("head")] = head
    left = rig.neutral()[:, 0] > 0
    for eye, side in (("eye_left", left), ("eye_right", ~left)):
        ball = rig.parts["eyes"] & side
        weights[ball] = 0
        weights[ball, BONES.index(eye)] = 1
    return weights
