"""The pictures of the posed face that draw the snakes (thesis, chapter 3, step 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from facs_rig import Camera, FaceRig, rasterise, shade, visible
from facs_rig.anatomy import UNDRAWN_PARTS
from facs_rig.mesh import vertex_normals

__all__ = ["Render", "expression_render"]

FINER = 2
"""The render is made this many times finer than the working image and then averaged."""
BLUR = 1.0
"""Standard deviation, working pixels, of the blur that lets snakes feel a line from beside it."""
BROAD = ((2.0, 0.7), (6.0, 0.3))
"""The broad shading that is taken out of the render, so that snakes follow lines and do not slide
down a cheek: standard deviations of blurs in working pixels, and their shares."""
INKED = 0.3
"""Brightness that is left where a brow or an iris is drawn on the surface."""
SLOPE = 0.08
"""Brightness per pixel by which the ground around the face rises with the distance from it."""


@dataclass(frozen=True)
class Render:
    """The face as the snakes see it, in the working image's pixels.

    lines : (h, w) float32, the shading without its broad part: the dark lines of the face
    shading : (h, w) float32, the headlight-shaded face
    movable : (n,) bool, the visible skin vertices, which face the viewer
    covered : (h, w) bool, the pixels where the face is
    """

    lines: NDArray[np.float32]
    shading: NDArray[np.float32]
    movable: NDArray[np.bool_]
    covered: NDArray[np.bool_]


def expression_render(rig: FaceRig, posed: NDArray[np.floating], camera: Camera) -> Render:
    """Shade the posed face (n, 3) for the snakes, in the camera's pixels.

    The dark valleys of headlight shading are where suggestive contours run (DeCarlo et al.,
    "Suggestive contours for conveying shape", 2003), so the shaded face holds the lines that one
    draws of it. Both pictures are antialiased and slightly blurred. A white ground would be flat
    and leave a snake outside the face where it is, so the ground rises from the brightness of the
    nearest skin by SLOPE per pixel (and may pass 1): a drawn outline beyond the face's slides in.
    """
    width, height = camera.width, camera.height
    fine = camera.cropped(0, 0, width, height, width * FINER, height * FINER)
    # Lashes would hide the lids' own lines; brows are drawn as strokes.
    hair = np.any([rig.parts[part] for part in UNDRAWN_PARTS], axis=0)
    triangles = rig.triangles[~hair[rig.triangles].any(axis=1)]
    buffers = rasterise(posed, triangles, fine)
    shaded = shade(posed, triangles, fine, buffers)
    face = buffers.triangle >= 0
    _draw_strokes(shaded, rig, posed, fine, face)
    broad = sum(share * _blurred_inside(shaded, face, size * FINER) for size, share in BROAD)
    facing = vertex_normals(posed, rig.triangles)[:, 2] > 0.0
    return Render(
        lines=_finish(0.5 + shaded - broad, face),
        shading=_finish(shaded, face),
        movable=rig.parts["skin"] & facing & visible(posed, fine, buffers),
        covered=_reduce(face) > 0.5,
    )


def _finish(image: NDArray[np.floating], face: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Put the rising ground around the face, blur, and reduce to the working size."""
    if face.any():
        away, nearest = distance_transform_edt(~face, return_indices=True)
        ground = image[nearest[0], nearest[1]] + SLOPE * away / FINER
        image = np.where(face, image, ground)
    return _reduce(gaussian_filter(image, BLUR * FINER, mode="nearest"))


def _reduce(image: NDArray) -> NDArray[np.float32]:
    height, width = image.shape[0] // FINER, image.shape[1] // FINER
    blocks = image.reshape(height, FINER, width, FINER)
    return blocks.mean(axis=(1, 3)).astype(np.float32)


def _blurred_inside(
    image: NDArray[np.float32], face: NDArray[np.bool_], width: float
) -> NDArray[np.float32]:
    """Blur that takes nothing from outside the face."""
    weight = gaussian_filter(face.astype(np.float32), width)
    return gaussian_filter(np.where(face, image, 0.0), width) / np.maximum(weight, 1e-6)


def _draw_strokes(
    image: NDArray[np.float32],
    rig: FaceRig,
    posed: NDArray[np.floating],
    camera: Camera,
    face: NDArray[np.bool_],
) -> None:
    """Darken `image` along the brows and irises that lie on the surface, in place."""
    for name in rig.strokes:
        pixels = camera.project(rig.stroke_points(posed, name))
        steps = np.linspace(0, len(pixels) - 1, 12 * len(pixels))
        along = np.arange(len(pixels))
        column = np.interp(steps, along, pixels[:, 0]).astype(np.intp)
        row = np.interp(steps, along, pixels[:, 1]).astype(np.intp)
        inside = (column >= 0) & (row >= 0) & (column < camera.width) & (row < camera.height)
        column, row = column[inside], row[inside]
        on = face[row, column]
        image[row[on], column[on]] *= INKED
