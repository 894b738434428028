"""Drawings by convention: the posed face's own curves, drawn as people draw them.

An artist draws each feature in one of several ways, somewhat larger, simpler or elsewhere than it
is; the face's curves lie on its skin, so that whatever the convention, its expression is drawn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera, FaceParameters, FaceRig

from ..linework.strokes import Stroke
from .artist import CONVENTIONS, HIDES, MANNERS, Artist, sample_artist
from .bands import draw_band
from .beards import draw_beard
from .canvas import Canvas
from .clothes import draw_clothes
from .cut import BARE, LONG, cut_hair
from .eyes import draw_brows, draw_eyes
from .glasses import draw_glasses
from .hair import draw_front, draw_hair
from .hats import draw_hat
from .head import (
    draw_creases,
    draw_ears,
    draw_face,
    draw_freckles,
    draw_neck,
    neck_shape,
)
from .moustaches import draw_moustache
from .mouth import Mouth, draw_mouth
from .nose import draw_nose
from .shade import draw_neck_shade, draw_shade
from .sitter import Sitter, face_outline, sit

__all__ = [
    "CONVENTIONS", "HIDES", "MANNERS", "Artist", "draw_by_convention", "face_outline",
    "sample_artist", "zoomed",
]  # fmt: skip

# How often no hair is seen below a hat: below these at all, below others where it is not long.
TUCKED = {"veil": 1.0, "hood": 0.6}
SHORT_TUCKED = 0.4
ASIDE = 0.35  # `turn` from which the back of the head is seen, which hair has to show


def zoomed(camera: Camera, room: float) -> Camera:
    """The camera with more of the page around the face, somewhat more below it than above."""
    w, h = camera.width, camera.height
    across, down = (room - 1) * w, (room - 1) * h
    return camera.cropped(-across / 2, -0.47 * down, w + across / 2, h + 0.53 * down, w, h)


def draw_by_convention(
    rig: FaceRig,
    vertices: NDArray,
    camera: Camera,
    parameters: FaceParameters,
    artist: Artist,
    pen: float,
    rng: np.random.Generator,
) -> tuple[list[Stroke], NDArray[np.float64], dict[str, list[NDArray[np.float64]]]]:
    """All strokes of a posed face by this artist, in pixels of `camera`, where it has the face's
    landmarks (m, 2), and what lies where: `face`, `hair` (with hats), `beard`, `hat` and the
    ears before the hair (`ear`), each as the outlines (k, 2) of its parts.

    vertices : (n, 3) metres, `rig.pose(parameters)`;  pen : pixels, width of a full line
    """
    sitter = sit(rig, vertices, camera, parameters, artist)
    canvas = Canvas(camera.width, camera.height, pen, artist.loose * sitter.unit, rng)
    hair = cut_hair(canvas, sitter, artist)
    middle = sitter.face.mean(axis=0)
    canvas.bound(middle + 1.015 * (sitter.face - middle))

    if artist.crowned:
        draw_hat(canvas, sitter, artist)
    else:
        draw_band(canvas, sitter, artist, hair)
        draw_front(canvas, sitter, artist, hair)
    draw_glasses(canvas, sitter, artist)
    draw_eyes(canvas, sitter, artist)
    draw_brows(canvas, sitter, artist)
    draw_nose(canvas, sitter, artist)
    draw_mouth(canvas, sitter, artist)
    draw_moustache(canvas, sitter, artist)
    draw_creases(canvas, sitter, artist)
    draw_shade(canvas, sitter, artist)
    if artist.freckles:
        draw_freckles(canvas, sitter)
    draw_beard(canvas, sitter, artist)
    tucked = _tucked(sitter, artist, rng)
    over_ears = artist.hat == "veil" or artist.cut in LONG and rng.random() < 0.6
    if not over_ears:
        draw_ears(canvas, sitter, artist)
    if not tucked:
        draw_hair(canvas, sitter, artist, hair)
    draw_face(canvas, sitter, artist, tucked or artist.cut in BARE)
    canvas.mark("face", sitter.face)
    canvas.cover(sitter.face)
    draw_neck_shade(canvas, sitter, artist)
    draw_neck(canvas, sitter, artist)
    draw_clothes(canvas, sitter, artist)
    canvas.cover(neck_shape(sitter))
    landmarks = Mouth(sitter, artist).landmarks(sitter.landmarks)
    return canvas.strokes(), landmarks, canvas.regions


def _tucked(sitter: Sitter, artist: Artist, rng: np.random.Generator) -> bool:
    """Whether all hair is hidden by a hat."""
    if artist.hat in TUCKED:
        return bool(rng.random() < TUCKED[artist.hat])
    seen = not artist.crowned or artist.cut in LONG or abs(sitter.turn) > ASIDE
    return not seen and bool(rng.random() < SHORT_TUCKED)
