"""How thick the brows of a drawing are: ink is measured across them, where the fitted face has its.

Brows are what makes one face unlike another more than most features (Sadr, Jarudi, Sinha 2003, "The
role of eyebrows in face recognition", Perception 32), and no line of the face's shape tells them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from facs_rig import Camera, FaceRig
from facs_rig.coarse import coarse_rig

__all__ = ["brow_thickness"]

ABOVE, BELOW = 0.008, 0.006
"""Metres across the brow within which its ink is looked for: farther below is the lid."""
STEPS = 48
MIDDLE = slice(3, -4)
"""Of the points along a brow: its ends taper."""
INKY = 0.35
"""Of the page's darkest: what is ink."""
ENDS = (0.1, 0.9)
"""Of the ink across a brow: how much lies below its lower and upper edge."""
OUTLINED = 0.4
"""Of a brow's breadth, how much is inked where its edges alone are drawn."""
FILLED, LINED = 0.8, 1.2
"""Of its breadth, what lies between these ends of the ink: of a filled one, and of its edges."""
SEEN = 0.5
"""Of the points along the brows, those that need ink for its breadth to be known."""
THINNEST = -0.6
"""Of the parameter: that a brow is one stroke is how people draw, and says little more."""


def brow_thickness(
    drawing: NDArray[np.floating],
    rig: FaceRig,
    vertices: NDArray[np.floating],
    camera: Camera,
    identity: Mapping[str, float],
) -> float | None:
    """The identity parameter `brow_thickness` with which brows are as thick as drawn; None if not
    enough of them is seen.

    drawing : (h, w), 1 is paper;  vertices : (n, 3) metres, the face of this identity as it lies
    over the drawing by this camera
    """
    ink = 1 - np.asarray(drawing, np.float32)
    darkest = max(float(np.quantile(ink, 0.995)), 0.1)
    shares = []
    for side in ("left", "right"):
        lower, upper = (
            camera.project(rig.stroke_points(vertices, f"brow_{edge}_{side}"))[MIDDLE]
            for edge in ("lower", "upper")
        )
        breadth = np.linalg.norm(upper - lower, axis=1)
        up = (upper - lower) / np.maximum(breadth, 1e-9)[:, None]
        along = np.linspace(-BELOW, ABOVE, STEPS) * camera.scale[0]
        places = (lower + upper)[:, None] / 2 + along[:, None] * up[:, None]
        found = map_coordinates(ink, (places - 0.5)[..., ::-1].T, order=1, mode="constant").T
        dark = np.where(found > INKY * darkest, found, 0.0)
        total = dark.sum(axis=1)
        seen = total > 0
        below = np.cumsum(dark[seen], axis=1) / total[seen, None]
        first, last = ((below >= share).argmax(axis=1) for share in ENDS)
        inked = np.take_along_axis(np.cumsum(dark[seen] > 0, axis=1), np.c_[first, last], axis=1)
        filled = np.ptp(inked, axis=1) / np.maximum(last - first, 1)
        # Of a filled brow the ends of its ink were left out, to two lines the pen was added.
        part = np.clip((filled - OUTLINED) / (1 - OUTLINED), 0, 1)
        span = (along[last] - along[first]) * (part / FILLED + (1 - part) / LINED)
        share = np.full(len(total), np.nan)
        share[seen] = span / breadth[seen]
        shares.append(share)
    every = np.concatenate(shares)
    if np.isfinite(every).mean() < SEEN:
        return None
    rig, values = coarse_rig(rig), np.array([-1.0, 0.0, 1.0])
    breadths = np.array([_breadth(rig, {**identity, "brow_thickness": v}) for v in values])
    drawn = float(np.nanmedian(every)) * _breadth(rig, identity)
    return float(np.clip(np.interp(drawn, breadths, values), THINNEST, 1.0))


def _breadth(rig: FaceRig, identity: Mapping[str, float]) -> float:
    """Metres between the edges of somebody's brow."""
    face = rig.neutral(dict(identity))
    lower, upper = (rig.stroke_points(face, f"brow_{e}_left")[MIDDLE] for e in ("lower", "upper"))
    return float(np.linalg.norm(upper - lower, axis=1).mean())
