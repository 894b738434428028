"""The preview: a sketch and the face that came of it, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from PIL import Image

from addon.hair_light import hair_light
from dataset_gen import Style, draw_strokes
from dataset_gen.linework import ink
from dataset_gen.linework.strokes import Stroke
from facs_rig import Camera, FaceParameters, FaceRig, rasterise
from facs_rig.beard.mesh import BeardMesh
from facs_rig.hair.hat import HatMesh
from facs_rig.hair.mesh import HairMesh
from facs_rig.looks import colours_of
from facs_rig.mesh import corner_matrix, vertex_normals
from facs_rig.paint import MATERIAL_NAMES, materials_at, srgb
from facs_rig.raster import barycentric

PANEL = 420  # pixels, the height of a panel
ROOM = 0.12  # around the face, as a share of its height
FINER = 2
LAMPS = (((-0.45, 0.55, 0.7), 0.72), ((0.75, 0.1, 0.35), 0.22))  # direction to the lamp, strength
AMBIENT = 0.12
PAPER = 255
# Lines over the sketch, red and blue; over the face, what has no place on it, as hair.
FITTED, UNMATCHED, HOMELESS = (200, 40, 30), (30, 90, 220), (165, 165, 165)
FAINT = 0.35  # of the sketch's ink, where it lies under something
ASIDE = np.radians(32)


def panels(
    drawing: NDArray,
    rig: FaceRig,
    parameters: FaceParameters,
    fitted: NDArray,
    aside: NDArray,
    camera: Camera,
    unmatched: Sequence[NDArray] = (),
    hair: HairMesh | None = None,
    hat: HatMesh | None = None,
    beard: BeardMesh | None = None,
) -> NDArray[np.uint8]:
    """(h, 4 w, 3) uint8: sketch, fitted face as it is drawn with hair and hat (or what is drawn of
    hair and the like in grey), it in three quarters, its lines over the sketch.

    drawing : (h, w) float, 1 is paper;  fitted, aside : (n, 3) metres, turned as it is drawn and as
    it is not;  camera : of the drawing's pixels;  unmatched : polylines (k, 2) of the drawing that
    have no place on the face, in its pixels.
    """
    camera, box = _close_up(_with(fitted, hair, hat, beard), camera)
    sketch = _cut(drawing, box, (camera.width, camera.height))
    left, top, right, bottom = box
    zoom = np.array([camera.width / (right - left), camera.height / (bottom - top)])
    homeless = [
        Stroke((line - [left, top]) * zoom, np.ones(len(line)), "unmatched") for line in unmatched
    ]
    sketch = np.repeat(sketch[:, :, None], 3, axis=2)
    faint = 255 - FAINT * (255 - sketch.astype(float))
    overlay = _drawn_over(faint, homeless, 1.4, UNMATCHED)
    overlay = _drawn_over(overlay, draw_strokes(rig, fitted, camera, detail=1), 1.8, FITTED)
    identity = dict(parameters.identity)
    face: NDArray = paint(rig, fitted, camera, identity, hair, hat, beard)
    if hair is None and hat is None:
        face = _drawn_over(np.where(face == PAPER, faint, face), homeless, 1.2, HOMELESS)
    beside = _beside(_with(aside, hair, hat, beard), camera)
    other = paint(rig, aside, beside, identity, hair, hat, beard)
    return np.concatenate([sketch, face, other, overlay], axis=1).astype(np.uint8)


def _with(vertices: NDArray, *worn: HairMesh | HatMesh | BeardMesh | None) -> NDArray:
    """The points of a posed face and of what it wears."""
    return np.concatenate([vertices, *(thing.on(vertices) for thing in worn if thing is not None)])


def three_quarters(head: tuple[float, float, float]) -> tuple[float, float, float]:
    """Yaw, pitch and roll, radians, that show the side of a head that a drawing hardly shows."""
    return (-ASIDE if head[0] > 0 else ASIDE), 0.0, 0.0


def _drawn_over(
    picture: NDArray, strokes: Sequence[Stroke], width: float, colour: tuple[int, int, int]
) -> NDArray[np.float64]:
    """A picture (h, w, 3) with lines in a colour."""
    lines = ink(strokes, picture.shape[1], picture.shape[0], Style(width=width))
    share = (255 - lines[:, :, None].astype(float)) / 255
    return picture * (1 - share) + np.array(colour) * share


def _beside(vertices: NDArray, camera: Camera) -> Camera:
    """The same camera with a face in the middle, all of it on the picture."""
    pixels = camera.project(vertices)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    size = np.array([camera.width, camera.height])
    half = size / 2 * max(1.0, float(((high - low) / (0.96 * size)).max()))
    left, top = (low + high) / 2 - half
    return camera.cropped(
        left, top, left + 2 * half[0], top + 2 * half[1], camera.width, camera.height
    )


def paint(
    rig: FaceRig,
    vertices: NDArray,
    camera: Camera,
    identity: dict[str, float] | None = None,
    hair: HairMesh | None = None,
    hat: HatMesh | None = None,
    beard: BeardMesh | None = None,
) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 picture of a posed face (n, 3), coloured and lit by two soft lamps.

    hair, hat, beard : it wears these
    """
    fine = camera.cropped(
        0, 0, camera.width, camera.height, camera.width * FINER, camera.height * FINER
    )
    picture = np.full((fine.height, fine.width, 3), PAPER, dtype=np.float32)
    strands = [(thing, thing.on(vertices)) for thing in (hair, beard) if thing is not None]
    meshes = [(vertices, rig.triangles)]
    for thing, over in strands:  # from both sides
        meshes.append((over, np.concatenate([thing.triangles, thing.triangles[:, ::-1]])))
    if hat is not None:
        meshes.append((hat.on(vertices), hat.triangles))
    points, triangles = _together(meshes)
    buffers = rasterise(points, triangles, fine)
    seen = _Seen(vertices, rig.triangles, fine, buffers.triangle, 0)
    light = _lit(seen.normals(rig.corners))
    # Brows and irises are looked up where the pixel lies on the default face: crisp at any size.
    material = materials_at(rig, seen.at(rig.neutral()), rig.triangle_part[seen.owner])
    palette = colours_of(identity or {})
    linear = np.array([palette[name].colour[:3] for name in MATERIAL_NAMES])
    picture[seen.rows, seen.columns] = 255 * srgb(
        linear[material] * np.clip(light, 0, 1.1)[:, None]
    )
    first = len(rig.triangles)
    for (thing, over), (_, ribbons) in zip(strands, meshes[1:], strict=False):
        seen = _Seen(over, ribbons, fine, buffers.triangle, first)
        normals = seen.normals(corner_matrix(thing.triangles, len(over)), thing.triangles)
        linear = hair_light(thing, over, normals, seen.at, LAMPS, AMBIENT)
        picture[seen.rows, seen.columns] = 255 * srgb(np.clip(linear, 0, 1))
        first += len(ribbons)
    if hat is not None:
        over = meshes[-1][0]
        seen = _Seen(over, hat.triangles, fine, buffers.triangle, first)
        light = _lit(seen.normals(corner_matrix(hat.triangles, len(over))))
        shade = seen.at(hat.shade[:, None]) * light[:, None]
        picture[seen.rows, seen.columns] = 255 * srgb(np.clip(shade * hat.colour, 0, 1))
    rows = np.sum([picture[k::FINER] for k in range(FINER)], axis=0)
    mean = np.sum([rows[:, k::FINER] for k in range(FINER)], axis=0) / FINER**2
    return np.clip(mean, 0, 255).astype(np.uint8)


def _lit(normals: NDArray) -> NDArray[np.float64]:
    """(k,) how light the lamps make places with these normals (k, 3)."""
    light = np.full(len(normals), AMBIENT)
    for direction, strength in LAMPS:
        toward = np.array(direction) / np.linalg.norm(direction)
        light += strength * np.clip(normals @ toward, 0, 1)
    return light


def _together(meshes: Sequence[tuple[NDArray, NDArray]]) -> tuple[NDArray, NDArray]:
    """Points and triangles of several meshes as of one."""
    counts = np.cumsum([0, *(len(points) for points, _ in meshes[:-1])])
    triangles = [own + first for (_, own), first in zip(meshes, counts, strict=True)]
    return np.concatenate([points for points, _ in meshes]), np.concatenate(triangles)


class _Seen:
    """The pixels that show one mesh of several that were rasterised together.

    shown : (h, w) numbers of triangles over all meshes      first : where this one's begin
    rows, columns : (k,) its pixels      owner : (k,) which of its triangles each shows
    """

    def __init__(
        self, points: NDArray, triangles: NDArray, camera: Camera, shown: NDArray, first: int
    ) -> None:
        self._points, self._triangles = points, triangles
        mine = (shown >= first) & (shown < first + len(triangles))
        self.rows, self.columns = np.nonzero(mine)
        self.owner = shown[self.rows, self.columns] - first
        u, v = self.columns + 0.5, self.rows + 0.5
        self._weights = barycentric(points, triangles, camera, self.owner, u, v)

    def at(self, values: NDArray) -> NDArray:
        """(k, c) values (n, c) of the mesh's vertices at the pixels."""
        corners = zip(self._weights.T, self._triangles[self.owner].T, strict=True)
        return sum(weight[:, None] * values[corner] for weight, corner in corners)

    def normals(self, corners: sp.csr_matrix, triangles: NDArray | None = None) -> NDArray:
        """(k, 3) unit; corners : see `vertex_normals`, of the mesh or of some of its triangles"""
        triangles = self._triangles if triangles is None else triangles
        normals = self.at(vertex_normals(self._points, triangles, corners))
        x, y, z = normals.T
        normals /= np.maximum(np.sqrt(x * x + y * y + z * z), 1e-9)[:, None]
        return normals


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
