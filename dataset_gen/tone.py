"""Shade as a soft pencil leaves it: fields of tone by the light on the face and in its hollows."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter, map_coordinates

from facs_rig import Camera, FaceRig

from .linework.paper import grained
from .linework.style import Style
from .shading import cell_size, known, light_on, skin_depth

if TYPE_CHECKING:
    from .hair_area import Area

WITHIN, EDGE = 0.58, 6.0  # of cells of skin, blurred: where shade begins, how soon it is full
DARKEST = 0.8  # of the deepest shade, where graphite is 1
HAIR_EDGE = 1.2  # pixels over which the shade of hair begins
LIT = 0.7  # share of the face that the light reaches so far that it stays white
HOLLOW, DEEP = 2.2, 0.5  # cells: how wide a hollow is looked for, how deep a dark one is
Floats = NDArray[np.float32]


def graphite(
    rig: FaceRig, vertices: NDArray, camera: Camera, style: Style, hair: Area | None = None
) -> Floats | None:
    """Darkness (h, w) 0..1 of the shade on a posed face (n, 3), in pixels of `camera`, or None.

    `style.graphite` says how dark, `style.light` where the light is, `style.smudge` whether the
    tooth of the paper shows in it or it is rubbed smooth. hair : what lies over the face
    """
    if not style.graphite:
        return None
    depth, skin = skin_depth(rig, vertices, camera, style.layers)
    if skin.sum() < 20:
        return None
    cell = cell_size(camera)
    lit = light_on(depth, style, cell)
    bright, darkest = np.quantile(lit[skin], [LIT, 0.02])
    form = np.clip((bright - lit) / max(bright - darkest, 1e-6), 0, 1)
    below = known(depth, skin, HOLLOW) - depth
    dark = np.clip(form**1.4 + np.clip(below / (DEEP * cell), 0, 1), 0, 1) * skin
    dark = known(dark, skin, 0.7)  # the cells must not show
    v, u = (np.arange(n) + 0.5 for n in (camera.height, camera.width))
    place = np.stack(np.meshgrid(v / cell - 0.5, u / cell - 0.5, indexing="ij"))
    # Nearest outside, so that an edge does not fade before its line; inside alone, so that it ends.
    tone, inside = (
        map_coordinates(values, place, order=1, mode="nearest").astype(np.float32)
        for values in (dark, gaussian_filter(skin.astype(float), 0.8))
    )
    tone *= np.clip(EDGE * (inside - WITHIN), 0, 1) * np.float32(DARKEST * style.graphite)
    if hair is not None:
        over = gaussian_filter(hair.mask.astype(np.float32), HAIR_EDGE)
        tone += over * (np.float32(DARKEST * style.graphite) * hair.dark - tone)
    return grained(tone, replace(style, grain=1 - style.smudge))


def tilted(tone: Floats, matrix: NDArray) -> Floats:
    """A field (h, w) of a page as it lies in the picture; `matrix` (3, 3) takes page to picture."""
    back = np.linalg.inv(matrix)
    # Pillow's pixel k is centred on k + 0.5, as ours.
    coefficients = (back / back[2, 2]).ravel()[:8].tolist()
    picture = Image.fromarray(tone).transform(
        (tone.shape[1], tone.shape[0]),
        Image.Transform.PERSPECTIVE,
        coefficients,
        Image.Resampling.BILINEAR,
    )
    return np.asarray(picture)
