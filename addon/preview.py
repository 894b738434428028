"""The preview: a sketch and the face that came of it, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dataset_gen import Style, draw_strokes
from dataset_gen.linework import ink
from dataset_gen.linework.strokes import Stroke
from facs_rig import Camera, FaceParameters, FaceRig, rasterise
from facs_rig.looks import colours_of
from facs_rig.mesh import vertex_normals
from facs_rig.paint import MATERIAL_NAMES, materials_at, srgb
from facs_rig.raster import barycentric

PANEL = 420  # pixels, the height of a panel
ROOM = 0.12  # around the face, as a share of its height
FINER = 2
LAMPS = (((-0.45, 0.55, 0.7), 0.72), ((0.75, 0.1, 0.35), 0.22))  # direction to the lamp, strength
AMBIENT = 0.12
PAPER = 250
FITTED, UNMATCHED = (200, 40, 30), (30, 90, 220)  # red and blue, lines over the sketch


def panels(
    drawing: NDArray,
    rig: FaceRig,
    parameters: FaceParameters,
    fitted: NDArray,
    camera: Camera,
    unmatched: Sequence[NDArray] = (),
) -> NDArray[np.uint8]:
    """(h, 4 w, 3) uint8: sketch, detected expression, fitted face, its lines over the sketch.

    drawing : (h, w) float, 1 is paper;  fitted : (n, 3) metres;  camera : of the drawing's pixels;
    unmatched : polylines (k, 2) of the drawing that have no place on the face, in its pixels.
    """
    camera, box = _close_up(fitted, camera)
    sketch = _cut(drawing, box, (camera.width, camera.height))
    left, top, right, bottom = box
    zoom = np.array([camera.width / (right - left), camera.height / (bottom - top)])
    homeless = [(line - [left, top]) * zoom for line in unmatched]
    overlay = 255 - 0.35 * (255 - np.repeat(sketch[:, :, None], 3, axis=2).astype(float))
    for strokes, width, colour in (
        ([Stroke(line, np.ones(len(line)), "unmatched") for line in homeless], 1.4, UNMATCHED),
        (draw_strokes(rig, fitted, camera, detail=1), 1.8, FITTED),
    ):
        lines = ink(strokes, camera.width, camera.height, Style(width=width))
        share = (255 - lines[:, :, None].astype(float)) / 255
        overlay = overlay * (1 - share) + np.array(colour) * share
    identity = dict(parameters.identity)
    return np.concatenate(
        [
            np.repeat(sketch[:, :, None], 3, axis=2),
            paint(rig, rig.pose(parameters), camera, identity),
            paint(rig, fitted, camera, identity),
            overlay.astype(np.uint8),
        ],
        axis=1,
    )


def paint(
    rig: FaceRig, vertices: NDArray, camera: Camera, identity: dict[str, float] | None = None
) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 picture of a posed face (n, 3), coloured and lit by two soft lamps."""
    fine = camera.cropped(
        0, 0, camera.width, camera.height, camera.width * FINER, camera.height * FINER
    )
    buffers = rasterise(vertices, rig.triangles, fine)
    v, u = np.nonzero(buffers.triangle >= 0)
    owner = buffers.triangle[v, u]
    weights = barycentric(vertices, rig.triangles, fine, owner, u + 0.5, v + 0.5)

    def at_pixels(values: NDArray) -> NDArray:
        corners = zip(weights.T, rig.triangles[owner].T, strict=True)
        return sum(weight[:, None] * values[corner] for weight, corner in corners)

    normals = at_pixels(vertex_normals(vertices, rig.triangles, rig.corners))
    x, y, z = normals.T
    normals /= np.maximum(np.sqrt(x * x + y * y + z * z), 1e-9)[:, None]
    light = np.full(len(normals), AMBIENT)
    for direction, strength in LAMPS:
        toward = np.array(direction) / np.linalg.norm(direction)
        light += strength * np.clip(normals @ toward, 0, 1)
    # Brows and irises are looked up where the pixel lies on the default face: crisp at any size.
    material = materials_at(rig, at_pixels(rig.neutral()), rig.triangle_part[owner])
    palette = colours_of(identity or {})
    linear = np.array([palette[name].colour[:3] for name in MATERIAL_NAMES])
    picture = np.full((fine.height, fine.width, 3), PAPER, dtype=np.float32)
    picture[v, u] = 255 * srgb(linear[material] * np.clip(light, 0, 1.1)[:, None])
    rows = np.sum([picture[k::FINER] for k in range(FINER)], axis=0)
    mean = np.sum([rows[:, k::FINER] for k in range(FINER)], axis=0) / FINER**2
    return np.clip(mean, 0, 255).astype(np.uint8)


def _close_up(
    vertices: NDArray, camera: Camera
) -> tuple[Camera, tuple[float, float, float, float]]:
    """Camera of one panel, and the box of the drawing that it shows."""
    pixels = camera.project(vertices)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    room = ROOM * (high[1] - low[1])
    left, top = low - room
    right, bottom = high + room
    width = round(PANEL * (right - left) / (bottom - top))
    return camera.cropped(left, top, right, bottom, width, PANEL), (left, top, right, bottom)


def _cut(image: NDArray, box: tuple[float, float, float, float], size: tuple[int, int]) -> NDArray:
    """(h, w) uint8 the box of a drawing (1 is paper) at the panel's size, paper around it."""
    picture = Image.fromarray((255 * image).astype(np.uint8))
    left, top, right, bottom = (int(np.floor(x)) for x in box)
    page = Image.new("L", (max(right - left, 1), max(bottom - top, 1)), 255)
    page.paste(picture, (-left, -top))
    return np.asarray(page.resize(size, Image.Resampling.LANCZOS))
