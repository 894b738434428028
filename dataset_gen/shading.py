"""What an artist adds to the lines of a face: hatches in its shade, and lines that help to draw.

Hatches are where planes a distance apart cut the surface. The planes lean into the page, so that
the cuts bend with the form: cross-contours. They are found in a depth buffer, all at once: in a
frame turned to run along the hatches, every column looks for the places where it crosses the
planes. Light comes from one side; the deepest shade takes every plane, half-tone every second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, gaussian_filter, map_coordinates

from facs_rig import LANDMARKS, Camera, FaceRig
from facs_rig.common.derived import derived
from facs_rig.mesh import vertex_normals

from .linework.strokes import Stroke
from .linework.style import Style

CELLS = 64  # of the depth buffer that hatches are looked up in, along the longer side
FACING = 0.05  # least n·v of a vertex that is counted into it
STEP = 2.5  # pixels between the points of a hatch
APART = 0.0025  # metres, about, between the vertices that are counted
NEAR = 6.0  # pixels in depth behind the nearest vertex of a cell that still are the same surface
BEND = 0.55  # how much the planes lean into the page
SPACING = (2.4, 1.3)  # pixels between hatches: and as many widths of a line
JUMP = 4.0  # pixels in depth from one point to the next that end a hatch
SHORTEST = 7.0  # pixels
LAMP = (0.62, 0.5)  # sideways and toward the viewer
TURN = np.linspace(0, 2 * np.pi, 90)


def hatches(
    rig: FaceRig, vertices: NDArray, camera: Camera, style: Style, rng: np.random.Generator,
    covered: NDArray | None = None,
) -> list[Stroke]:  # fmt: skip
    """Strokes of kind "hatch" in the shade of a posed face (n, 3), in pixels of `camera`.

    `style.hatching` says how much of the face is in shade, `style.light` where the light is.
    covered : (h, w) bool, pixels of what lies over the face
    """
    if not style.hatching:
        return []
    depth, skin = skin_depth(rig, vertices, camera, style.layers)
    if skin.sum() < 20:
        return []
    shade = _shade(depth, skin, style, cell_size(camera))
    lean = np.radians(45.0 if style.light < 0 else 135.0) + rng.normal(0, 0.12)
    gap = SPACING[0] + SPACING[1] * style.width

    # The frame of the hatches: p along them, q across, both in pixels from the picture's middle.
    along = np.array([np.cos(lean), -np.sin(lean)])
    # Away from the light, where the surface falls off and the planes meet it at the best angle.
    across = np.array([-along[1], along[0]]) * (1 if style.light < 0 else -1)
    middle = np.array([camera.width, camera.height]) / 2
    cells = (np.argwhere(skin)[:, ::-1] + 0.5) * cell_size(camera) - middle
    p, q = (np.arange(way.min() - 3 * STEP, way.max() + 3 * STEP, STEP)
            for way in (cells @ along, cells @ across))  # fmt: skip
    place = middle + p[:, None, None] * along + q[None, :, None] * across
    cell = place[..., ::-1].reshape(-1, 2).T / cell_size(camera) - 0.5

    def at_places(values: NDArray, outside: float) -> NDArray:
        found = map_coordinates(values, cell, order=1, mode="constant", cval=outside)
        return found.reshape(len(p), len(q))

    z, dark = at_places(depth, 0.0), at_places(shade, -1.0)
    inside = at_places(skin.astype(np.float32), 0.0) > 0.7

    # Every column's q where q + BEND z, made to grow, crosses each plane: one sorted search.
    cut = np.maximum.accumulate(q[None, :] - BEND * z, axis=1)
    first, last = cut.min(), cut.max()
    levels = np.arange(np.ceil(first / gap), np.floor(last / gap) + 1) * gap
    levels = levels + rng.normal(0, 0.12 * gap, len(levels))
    rows = np.arange(len(p))[:, None] * (last - first + 4 * gap)
    found = np.searchsorted((cut + rows).ravel(), (levels[None, :] + rows).ravel())
    i = np.arange(len(p))[:, None]
    k = np.clip(found.reshape(len(p), -1) - i * len(q), 1, len(q) - 1)
    low, high = cut[i, k - 1], cut[i, k]
    f = np.clip((levels - low) / np.maximum(high - low, 1e-6), 0, 1)
    across_at = q[k - 1] + f * STEP
    dark = dark[i, k - 1] + f * (dark[i, k] - dark[i, k - 1])
    z = z[i, k - 1] + f * (z[i, k] - z[i, k - 1])

    # Every second plane only where it is darkest, and no two hatches end on the same line.
    least = np.where(np.arange(len(levels)) % 2, 0.35, 0.0) + rng.uniform(0, 0.12, len(levels))
    drawn = inside[i, k] & inside[i, k - 1] & (dark > least)
    drawn[1:] &= np.abs(np.diff(across_at, axis=0)) < 1.3 * STEP
    drawn[1:] &= np.abs(np.diff(z, axis=0)) < JUMP
    if covered is not None:
        place = middle + p[:, None, None] * along + across_at[..., None] * across
        column, row = (
            np.clip(place[..., k].astype(np.int64), 0, covered.shape[1 - k] - 1) for k in (0, 1)
        )
        drawn &= ~covered[row, column]
    runs = np.zeros((len(levels), len(p) + 2), np.int8)
    runs[:, 1:-1] = drawn.T
    edges = np.flatnonzero(np.diff(runs.ravel()))
    level, begin = np.divmod(edges[::2], len(p) + 2)
    size = edges[1::2] - edges[::2]
    base = middle + p[:, None] * along
    out = []
    for n, a, b in np.stack([level, begin, begin + size])[:, STEP * (size - 1) >= SHORTEST].T:
        points = base[a:b] + across_at[a:b, n, None] * across
        strength = np.clip(0.35 + 0.8 * (dark[a:b, n] - least[n]), 0, 1)
        out.append(Stroke(points, strength, "hatch"))
    return out


def skin_depth(
    rig: FaceRig, vertices: NDArray, camera: Camera, layers: tuple[str, ...]
) -> tuple[NDArray, NDArray]:
    """Depth (h, w) in pixels, smoothed, in cells of CELL pixels, and where skin is seen.

    The mesh is much finer than the cells, so some of the vertices are counted into them: the
    nearest says what is seen, those close behind it how deep it lies.
    """
    # The far side of the head must not be seen through gaps between vertices; the way that the
    # face at rest looks, turned with the head, tells it well enough.
    places, some, normals = _at_rest(rig)
    turn = _turn(places, vertices[rig.landmarks])
    some = some[normals @ turn[2] > FACING]
    shown, part = vertices[some], rig.vertex_part[some]
    skin, eyes = (part == rig.part_names.index(name) for name in ("skin", "eyes"))
    shells = [rig.curves[k].points(vertices) for k in layers
              if k in rig.curves and len(rig.curves[k].triangles)]  # fmt: skip
    for shell in shells:
        shown = np.concatenate([shown, shell])
        skin, eyes = (np.concatenate([part, np.zeros(len(shell), bool)]) for part in (skin, eyes))
    size = cell_size(camera)
    shape = int(np.ceil(camera.height / size)), int(np.ceil(camera.width / size))
    column, row = np.floor(camera.project(shown) / size).astype(np.int64).T
    on_page = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    cell = (row * shape[1] + column)[on_page]
    z = camera.scale[0] * shown[on_page, 2].astype(float)
    skin, eyes = skin[on_page], eyes[on_page]
    nearest = np.full(shape[0] * shape[1], -np.inf)
    np.maximum.at(nearest, cell, z)
    front = z > nearest[cell] - NEAR
    count = np.bincount(cell[front], minlength=nearest.size)
    ours = np.bincount(cell[front], skin[front], nearest.size)
    total = np.bincount(cell[front], z[front] * skin[front], nearest.size)
    depth = np.divide(total, ours, out=np.zeros(total.shape), where=ours > 0).reshape(shape)
    seen = ((ours > 0) & (ours >= 0.5 * count)).reshape(shape)
    whole = binary_closing(np.pad(seen, 2), iterations=2)[2:-2, 2:-2]
    fine, coarse = known(depth, seen, 0.8), known(depth, seen, 2.5)
    smooth = np.where(seen, fine, coarse)
    clear = np.bincount(cell[front], eyes[front], nearest.size).reshape(shape) == 0
    return smooth, whole & clear


def known(depth: NDArray, seen: NDArray, sigma: float) -> NDArray:
    """Depth (h, w) blurred from the cells in which it is known alone."""
    around = gaussian_filter(seen.astype(float), sigma, truncate=8)
    return gaussian_filter(depth * seen, sigma, truncate=8) / np.maximum(around, 1e-9)


def cell_size(camera: Camera) -> float:
    """Pixels of a cell of the depth buffer that hatches are looked up in."""
    return max(camera.width, camera.height) / CELLS


def light_on(z: NDArray, style: Style, cell: float) -> NDArray:
    """How bright each cell (h, w) is, by the light of `style` on the slopes of z (h, w), pixels."""
    dv, du = np.gradient(z, cell)
    angle = np.radians(style.light)
    lamp = np.array([LAMP[0] * np.sin(angle), LAMP[0] * np.cos(angle), LAMP[1]])
    return (-du * lamp[0] + dv * lamp[1] + lamp[2]) / np.sqrt(du * du + dv * dv + 1)


def _shade(z: NDArray, skin: NDArray, style: Style, cell: float) -> NDArray:
    """How dark each cell (h, w) is, above 0 in the shade and 1 in the deepest; z in pixels."""
    lit = light_on(z, style, cell)
    middle, darkest = np.quantile(lit[skin], [0.5 * style.hatching, 0.02])
    return np.clip((middle - lit) / max(middle - darkest, 1e-6), -1, 1)


def construction(rig: FaceRig, vertices: NDArray, camera: Camera) -> list[Stroke]:
    """Strokes of kind "construction": the head's oval, its middle line and its line of the eyes.

    They lie on an ellipsoid around the skull that is turned with the head, as one draws a ball
    before a face.
    """
    turn = _turn(_at_rest(rig)[0], vertices[rig.landmarks])
    # The head looks along z again; some of its skin says how large it is.
    head = vertices[np.flatnonzero(rig.parts["skin"])[::7]] @ turn
    points = vertices[rig.landmarks] @ turn

    def at(name: str) -> NDArray:
        return points[LANDMARKS.index(name)]

    eyes = 0.5 * (at("pupil_left") + at("pupil_right"))
    top, chin = head[:, 1].max(), at("chin")[1]
    skull = head[head[:, 1] > eyes[1] + 0.3 * (top - eyes[1])]  # above the ears
    half = np.array([0.5 * np.ptp(skull[:, 0]), 0.5 * (top - chin), 0.5 * np.ptp(skull[:, 2])])
    middle = np.array([eyes[0], 0.5 * (top + chin), at("nose_root")[2] - 0.97 * half[2]])
    rise = np.clip((eyes[1] - middle[1]) / half[1], -0.9, 0.9)
    around = np.sqrt(1 - rise**2)
    side = np.linspace(-0.5, 0.5, 40) * np.pi * 0.86
    eye_line = np.stack([around * np.sin(side), np.full(40, rise), around * np.cos(side)], axis=1)
    centre_line = np.stack([np.zeros(40), np.sin(side), np.cos(side)], axis=1)
    lines = [camera.project((middle + half * line) @ turn.T) for line in (eye_line, centre_line)]
    # The oval's outline is the rim of the ellipsoid as the camera sees it, which is an ellipse.
    lines.append(_rim(camera.project((middle + half * _ball()) @ turn.T)))
    return [Stroke(line, np.ones(len(line)), "construction") for line in lines]


def _ball(count: int = 600) -> NDArray:
    """(count, 3) places all over the unit ball's surface."""
    k = np.arange(count) + 0.5
    height = 1 - 2 * k / count
    angle = np.pi * (1 + np.sqrt(5)) * k
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(angle), height, ring * np.sin(angle)], axis=1)


def _rim(pixels: NDArray) -> NDArray:
    """The ellipse (m, 2) around the picture (k, 2) of an ellipsoid's surface."""
    centre = pixels.mean(axis=0)
    # Places even on a ball have a third of the squared half axis as variance, along every axis.
    values, axes = np.linalg.eigh(3 * np.cov(pixels.T))
    circle = np.stack([np.cos(TURN), np.sin(TURN)], axis=1)
    return centre + (circle * np.sqrt(values)) @ axes.T


@derived
def _at_rest(rig: FaceRig) -> tuple[NDArray, NDArray, NDArray]:
    """Of the upright face: landmarks (k, 3), vertices APART of each other (m,), normals (m, 3)."""
    vertices = rig.neutral()
    boxes = np.floor(vertices / APART).astype(np.int64) + 1000
    _, some = np.unique(boxes @ [1, 2000, 2000**2] * 10 + rig.vertex_part, return_index=True)
    normals = vertex_normals(vertices, rig.triangles, rig.corners)
    return vertices[rig.landmarks], some, normals[some]


def _turn(rest: NDArray, posed: NDArray) -> NDArray:
    """The rotation (3, 3) that brings points (k, 3) at rest nearest to posed ones (Kabsch 1976)."""
    u, _, vt = np.linalg.svd((posed - posed.mean(axis=0)).T @ (rest - rest.mean(axis=0)))
    flip = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    return u @ flip @ vt
