"""The hair and the hat of a sketch: found on the page, and made for the fitted head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from addon.drawing import Drawing
from addon.strategies import Fitted
from classifiers import Detection
from facs_rig import FaceRig
from facs_rig.common.box import Box
from facs_rig.hair.cut import Cut
from facs_rig.hair.hat import Hat, pressed
from facs_rig.hair.head import head_of
from snakes.hair.cut_fit import fit_cut
from snakes.hair.hat_fit import fit_hat
from snakes.hair.hat_region import page_hat, with_hat, without_hat
from snakes.hair.region import PageHair, page_hair


def hair_of(
    drawing: Drawing, detection: Detection, rig: FaceRig, fitted: Fitted
) -> tuple[PageHair | None, Cut | None, PageHair | None, Hat | None]:
    """Where a drawing's hair lies, and the cut that looks like it on the fitted head; where its hat
    lies, and that hat.

    No cut for a bald one, neither where no network says what lies where. Under a hat hair is that
    which is drawn below it; with a hat of which none can be made there is none.
    """
    mask = detection.mask
    if mask is None:
        return None, None, None, None
    vertices, camera, who = fitted.vertices, fitted.camera, fitted.parameters
    place = rig, vertices, camera, mask.box, _other_heads(detection)
    page = page_hair(drawing.image, mask.at, *place)
    worn = page_hat(drawing.image, mask.at, *place)
    if worn is None:
        return page, fit_cut(page, rig, who, vertices, camera), None, None
    page = without_hat(page, worn, drawing.image)
    hat = fit_hat(worn, rig, who, vertices, camera)
    if hat is None or hat.cloth is not None or not page.hair.any():
        return page, None, worn, hat
    cut = fit_cut(with_hat(page, worn), rig, who, vertices, camera)
    head = head_of(rig, who.identity)
    return page, None if cut is None else pressed(cut, hat, head), worn, hat


def _other_heads(detection: Detection) -> list[Box]:
    """The boxes of the faces on the page that were not read."""
    middle = np.mean(list(detection.landmarks.values()), axis=0)
    found: list[Box] = []
    for face in detection.faces:
        left, top, right, bottom = face.corners
        if not (left < middle[0] < right and top < middle[1] < bottom):
            found.append(Box(left, top, right, bottom))
    return found


def beside_hair(page: PageHair, points: NDArray, hat: PageHair | None = None) -> NDArray[np.bool_]:
    """(k,) whether points (k, 2) of the drawing lie in no hair or beard, nor on its edge, which is
    a line of its own, and in no hat."""
    if hat is not None:
        return beside_hair(page, points) & beside_hair(hat, points)
    height, width = page.hair.shape
    column, row = np.rint(page.cells(points)).astype(np.intp).T
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    out = np.ones(len(points), dtype=bool)
    at = row[inside], column[inside]
    out[inside] = ~binary_dilation(page.hair | page.beard)[at]
    return out
