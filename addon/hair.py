"""The hair of a sketch: found on the page, as a cut for the fitted head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.drawing import Drawing
from addon.strategies import Fitted
from classifiers import Detection
from facs_rig import FaceRig
from facs_rig.common.box import Box
from facs_rig.hair.cut import Cut
from snakes.hair.cut_fit import fit_cut
from snakes.hair.region import PageHair, page_hair


def hair_of(
    drawing: Drawing, detection: Detection, rig: FaceRig, fitted: Fitted
) -> tuple[PageHair | None, Cut | None]:
    """Where a drawing's hair lies, and the cut that looks like it on the fitted head.

    No cut for a bald one, neither where no network says what lies where.
    """
    mask = detection.mask
    if mask is None:
        return None, None
    vertices, camera = fitted.vertices, fitted.camera
    page = page_hair(
        drawing.image, mask.at, rig, vertices, camera, mask.box, _other_heads(detection)
    )
    return page, fit_cut(page, rig, fitted.parameters, vertices, camera)


def _other_heads(detection: Detection) -> list[Box]:
    """The boxes of the faces on the page that were not read."""
    middle = np.mean(list(detection.landmarks.values()), axis=0)
    found: list[Box] = []
    for face in detection.faces:
        left, top, right, bottom = face.corners
        if not (left < middle[0] < right and top < middle[1] < bottom):
            found.append(Box(left, top, right, bottom))
    return found


def beside_hair(page: PageHair, points: NDArray) -> NDArray[np.bool_]:
    """(k,) whether points (k, 2) of the drawing lie in no hair or beard."""
    height, width = page.hair.shape
    column, row = np.rint(page.cells(points)).astype(np.intp).T
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    out = np.ones(len(points), dtype=bool)
    at = row[inside], column[inside]
    out[inside] = ~(page.hair | page.beard)[at]
    return out
