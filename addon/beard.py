"""The beard of a sketch: found on the page, as a beard for the fitted head."""

from __future__ import annotations

from dataclasses import replace

from addon.drawing import Drawing
from addon.strategies import Fitted
from classifiers import Detection
from facs_rig import FaceRig
from facs_rig.beard.beard import Beard
from facs_rig.hair.cut import Cut
from snakes.hair.beard_fit import fit_beard, with_beard
from snakes.hair.region import PageHair

__all__ = ["beard_of"]


def beard_of(
    drawing: Drawing, detection: Detection, rig: FaceRig, fitted: Fitted, page: PageHair | None,
    cut: Cut | None = None,
) -> tuple[PageHair | None, Beard | None]:  # fmt: skip
    """The page with where its beard lies, and the beard that looks like it on the fitted face, in
    the colour of its hair if there is any.

    None for a beardless one, neither where no network says what lies where.
    """
    mask = detection.mask
    if mask is None or page is None:
        return page, None
    vertices, camera = fitted.vertices, fitted.camera
    beard = fit_beard(drawing.image, mask.at, page, rig, fitted.parameters, vertices, camera)
    if beard is None:
        return page, None
    if cut is not None:
        beard = replace(beard, colour=cut.colour)
    return with_beard(page, beard, rig, vertices, camera), beard
