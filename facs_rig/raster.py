"""A depth-buffer rasteriser in plain numpy: depth, triangle under each pixel, headlight shading."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .mesh import is_shape, vertex_normals

# (triangle, pixel) pairs looked at in one go; bounds the memory at large picture sizes.
PAIRS_AT_ONCE = 4_000_000
# A pixel centre on a shared edge belongs to both triangles, whatever the rounding.
EDGE = 1e-9


@dataclass(frozen=True)
class Buffers:
    """What a rasterised picture knows of each pixel.

    depth : (h, w) float32, z in metres of the nearest surface, -inf off the face
    triangle : (h, w) int32, index of the triangle seen, -1 off the face
    """

    depth: NDArray[np.float32]
    triangle: NDArray[np.int32]

    @cached_property
    def deepest(self) -> NDArray[np.float32]:
        """(h, w) the deepest of the 3 x 3 pixels around each; off the picture is background."""
        deepest = np.pad(self.depth, 1, constant_values=-np.inf)
        deepest = np.minimum(np.minimum(deepest[:-2], deepest[1:-1]), deepest[2:])
        return np.minimum(np.minimum(deepest[:, :-2], deepest[:, 1:-1]), deepest[:, 2:])


def rasterise(vertices: NDArray, triangles: NDArray, camera: Camera) -> Buffers:
    """Depth buffer of the front-facing triangles, sampled at pixel centres.

    vertices : (n, 3) float, metres;  triangles : (t, 3) int.

    Every pair of a triangle and a pixel centre in its bounding box is tested at once with edge
    functions (Pineda 1988, "A Parallel Algorithm for Polygon Rasterization"); depth is linear
    in screen space, which is exact for the orthographic camera and monotone for perspective.
    """
    is_shape(vertices, (None, 3), "vertices")
    is_shape(triangles, (None, 3), "triangles")
    w, h = camera.width, camera.height
    pixels = camera.project(vertices)
    a, b, c = (pixels[triangles[:, k]] for k in range(3))
    # v runs down, so a triangle that faces the viewer has a negative area in the image
    front = np.flatnonzero(_cross(b - a, c - a) < 0)
    a, b, c = a[front], b[front], c[front]
    low = np.ceil(np.minimum(np.minimum(a, b), c) - 0.5)
    high = np.floor(np.maximum(np.maximum(a, b), c) - 0.5)
    low = np.maximum(low, 0).astype(np.int32)
    size = np.minimum(high, [w - 1, h - 1]).astype(np.int32) - low + 1
    seen = np.flatnonzero((size[:, 0] > 0) & (size[:, 1] > 0))
    planes = _planes(a[seen], b[seen], c[seen], vertices[:, 2][triangles[front[seen]]])
    owners, low, size = front[seen], low[seen], size[seen]

    depth = np.full(h * w, -np.inf, dtype=np.float32)
    owner = np.full(h * w, -1, dtype=np.int32)
    counts = size[:, 0].astype(np.int64) * size[:, 1]
    cuts = np.arange(PAIRS_AT_ONCE, counts.sum() + PAIRS_AT_ONCE, PAIRS_AT_ONCE)
    start = 0
    for stop in np.append(np.searchsorted(np.cumsum(counts), cuts), len(seen)):
        if stop > start:
            part = slice(start, stop)
            _fill(owners[part], planes[:, :, part], low[part], size[part], w, depth, owner)
        start = stop
    return Buffers(depth.reshape(h, w), owner.reshape(h, w))


def _planes(a: NDArray, b: NDArray, c: NDArray, z: NDArray) -> NDArray[np.float64]:
    """(3, 3, t) two barycentric weights and the depth of each triangle, as functions of a pixel.

    Value = first + second * u + third * v; a, b, c : (t, 2) corners, z : (t, 3) their depths.
    """
    area = _cross(b - a, c - a)
    planes = np.empty((3, 3, len(a)))
    for row, (p, q) in enumerate(((b, c), (c, a))):
        planes[row, 1] = -(q - p)[:, 1] / area
        planes[row, 2] = (q - p)[:, 0] / area
        planes[row, 0] = -(planes[row, 1] * p[:, 0] + planes[row, 2] * p[:, 1])
    za, zb, zc = z.T
    planes[2] = planes[0] * (za - zc) + planes[1] * (zb - zc)
    planes[2, 0] += zc
    return planes


def _fill(owners, planes, low, size, width, depth, owner) -> None:
    """Rasterise triangles into the flat buffers `depth` and `owner`, in place."""
    counts = size[:, 0].astype(np.int64) * size[:, 1]
    t = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(t)) - np.repeat(np.cumsum(counts) - counts, counts)
    row, col = np.divmod(step, size[t, 0])
    u, v = col + low[t, 0], row + low[t, 1]
    pu, pv = u + 0.5, v + 0.5
    wa = planes[0, 0][t] + planes[0, 1][t] * pu + planes[0, 2][t] * pv
    wb = planes[1, 0][t] + planes[1, 1][t] * pu + planes[1, 2][t] * pv
    inside = np.flatnonzero((wa >= -EDGE) & (wb >= -EDGE) & (wa + wb <= 1.0 + EDGE))
    t = t[inside]
    here = planes[2, 0][t] + planes[2, 1][t] * pu[inside] + planes[2, 2][t] * pv[inside]
    here = here.astype(np.float32)
    pixel = v[inside] * width + u[inside]
    np.maximum.at(depth, pixel, here)
    won = here == depth[pixel]
    owner[pixel[won]] = owners[t[won]]


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def shade(
    vertices: NDArray,
    triangles: NDArray,
    camera: Camera,
    buffers: Buffers | None = None,
    normals: NDArray | None = None,
) -> NDArray[np.float32]:
    """Grey picture (h, w) float32 in 0..1 of the face lit by a lamp at the camera, on white.

    Smoothly shaded with n·v, so that contours and creases are its dark lines: the picture on
    which the thesis runs its snakes.
    """
    if buffers is None:
        buffers = rasterise(vertices, triangles, camera)
    if normals is None:
        normals = vertex_normals(vertices, triangles)
    lit = np.clip(np.einsum("ij,ij->i", normals, camera.view_vectors(vertices)), 0.0, 1.0)
    image = np.ones((camera.height, camera.width), dtype=np.float32)
    v, u = np.nonzero(buffers.triangle >= 0)
    weights = barycentric(vertices, triangles, camera, buffers.triangle[v, u], u + 0.5, v + 0.5)
    image[v, u] = np.sum(weights * lit[triangles[buffers.triangle[v, u]]], axis=1)
    return image


def barycentric(
    vertices: NDArray, triangles: NDArray, camera: Camera, triangle: NDArray, u: NDArray, v: NDArray
) -> NDArray:
    """Barycentric weights (k, 3), in the picture, of pixels (u, v) in their triangles (k,)."""
    a, b, c = (camera.project(vertices[triangles[triangle, k]]) for k in range(3))
    p = np.stack([u, v], axis=1)
    area = _cross(b - a, c - a)
    area = np.where(np.abs(area) < 1e-12, 1e-12, area)
    wa = _cross(c - b, p - b) / area
    wb = _cross(a - c, p - c) / area
    return np.stack([wa, wb, 1.0 - wa - wb], axis=1)


def visible(
    vertices: NDArray, camera: Camera, buffers: Buffers, bias: float = 0.002
) -> NDArray[np.bool_]:
    """Which vertices (n,) are not hidden: at most `bias` metres behind the depth buffer.

    A vertex on a slope lies behind the nearest sample of its own surface, so the deepest of the
    3 x 3 pixels around it is compared.
    """
    pixels = camera.project(vertices)
    return unhidden(pixels, vertices[:, 2], buffers, bias)


def unhidden(pixels: NDArray, z: NDArray, buffers: Buffers, bias: float) -> NDArray[np.bool_]:
    """Like `visible` for any points given by pixels (k, 2) and depths (k,) in metres."""
    h, w = buffers.depth.shape
    col = np.floor(pixels[:, 0]).astype(np.int64)
    row = np.floor(pixels[:, 1]).astype(np.int64)
    inside = (col >= 0) & (col < w) & (row >= 0) & (row < h)
    deepest = buffers.deepest[np.clip(row, 0, h - 1), np.clip(col, 0, w - 1)]
    return inside & (z >= deepest - bias)
