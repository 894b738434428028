"""Where the landmarks of a face at rest lie on a page."""

from __future__ import annotations

import numpy as np

from facs_rig import LANDMARKS, Camera, load_rig


def neutral_marks(turn=0.0):
    """Name -> (u, v) on a page of 400 pixels, turned about its middle, radians clockwise."""
    rig = load_rig()
    camera = Camera.framing(rig.neutral(), 400, 400)
    spots = camera.project(rig.neutral()[rig.landmarks]) - 200
    c, s = np.cos(turn), np.sin(turn)
    spots = spots @ np.array([[c, s], [-s, c]]) + 200
    return {name: tuple(spot) for name, spot in zip(LANDMARKS, spots.tolist(), strict=True)}
