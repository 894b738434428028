"""Where on a page faces are: from the networks' answer for each cell to boxes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box

from .runtime import sigmoid

SURE = 0.5  # a cell that is less sure of a face is not heard
BELL = 0.6  # cells; cells beside the one of a face's middle were taught a bell of this width
SMALLEST, LARGEST = 0.05, 1.5  # of a face's box, as a share of the page that is looked at
COVERED = 0.5  # of two boxes that share more than this of the smaller one, one is an echo


@dataclass(frozen=True)
class Face:
    """A face on a page: its box from chin to forehead in the page's pixels (it may reach over the
    edge; turned if the face is), and how probable it is that there is one."""

    box: Box
    probability: float

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom of the box; of the upright one around it, if it is turned."""
        box = self.box
        if box.turn:
            every = box.to_pixels(np.array([(0, 0), (1, 0), (0, 1), (1, 1)]))
            (left, top), (right, bottom) = every.min(axis=0).tolist(), every.max(axis=0).tolist()
            return left, top, right, bottom
        return box.left, box.top, box.left + box.width, box.top + box.height


def faces_on(found: NDArray, crop: Box) -> list[Face]:
    """The faces in a crop of a page, the largest first.

    found : (c, c, 4) of each cell of the crop: logit that a face's middle lies there, u and v of
    that middle from the cell's own in cells, log of the box's side as a share of the crop

    A cell speaks if none of its neighbours is surer; of boxes that cover each other the surest
    counts.
    """
    cells = len(found)
    logit = found[..., 0].astype(float)
    around = np.pad(logit, 1, constant_values=-np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(around, (3, 3))
    v, u = np.nonzero(logit >= windows.max(axis=(2, 3)))
    offset = np.clip(found[v, u, 1:3].astype(float), -0.5, 0.5)
    # At a corner between four cells even a certain face was taught as half a one.
    taught = np.exp(-np.square(offset).sum(axis=1) / (2 * BELL**2))
    probability = np.minimum(sigmoid(logit[v, u]) / taught, 1.0)
    middle = crop.to_pixels((np.stack([u, v], axis=1) + 0.5 + offset) / cells)
    share = np.exp(np.clip(found[v, u, 3].astype(float), np.log(SMALLEST), np.log(LARGEST)))
    side = share * np.sqrt(crop.width * crop.height)
    faces: list[Face] = []
    for k in np.argsort(-probability, kind="stable"):
        box = Box.square(middle[k], float(side[k]), crop.turn)
        if probability[k] >= SURE and not any(echo(box, face.box) for face in faces):
            faces.append(Face(box, float(probability[k])))
    return sorted(faces, key=lambda face: -face.box.width)


def echo(one: Box, other: Box) -> bool:
    """Whether two boxes cover each other so much that they must be of the same face."""
    width = min(one.left + one.width, other.left + other.width) - max(one.left, other.left)
    height = min(one.top + one.height, other.top + other.height) - max(one.top, other.top)
    smaller = min(one.width * one.height, other.width * other.height)
    return max(width, 0.0) * max(height, 0.0) > COVERED * smaller


def widened(box: Box, factor: float) -> Box:
    """The box, larger by a factor about its middle."""
    width, height = factor * box.width, factor * box.height
    left, top = box.left - (width - box.width) / 2, box.top - (height - box.height) / 2
    return Box.at(left, top, width, height, box.turn)


def squared(box: Box) -> Box:
    """The smallest square around a box, about its middle."""
    middle = box.left + box.width / 2, box.top + box.height / 2
    return Box.square(middle, max(box.width, box.height))
