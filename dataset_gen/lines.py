"""Line drawings of a posed face: occluding contours and suggestive contours, hidden lines removed.

Occluding contours are the zero set of n·v (v toward the eye). Suggestive contours are the zero
set of the radial curvature κr, the normal curvature in the direction w of the view vector's
projection onto the surface, where κr grows toward the eye: D_w κr > 0 (DeCarlo, Finkelstein,
Rusinkiewicz, Santella 2003, "Suggestive Contours for Conveying Shape"). Both are followed
through the triangles by linear interpolation and chained into strokes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig import Buffers, Camera, FaceRig, rasterise
from facs_rig.anatomy import HAIR_PARTS
from facs_rig.curves import Curves
from facs_rig.mesh import corner_matrix, vertex_normals
from facs_rig.parameters import nearest
from facs_rig.raster import unhidden

DETAILS = ("sparse", "medium", "rich")
# Least D_w κr (1/m²) of a suggestive contour at each level of detail, and the angle in degrees
# from the view direction below which w is too short to be trusted (DeCarlo's θc).
LEAST_GROWTH = (14_000.0, 7_000.0, 3_000.0)
LEAST_ANGLE = 18.0
DEPTH_BIAS = 0.0015  # metres
BUFFER = 384  # pixels: small pictures get a finer depth buffer, up to 1.5 times
SHORTEST = 3.0  # pixels, strokes below are left out
HAIR_GAP = 2.8  # pixels between hairs that are drawn
MOST_OF_A_HAIR = 5  # points that a hair of lashes and brows has at most


@dataclass(frozen=True)
class Stroke:
    """One line of a drawing.

    points : (k, 2) float, pixels (u, v)        strength : (k,) float 0..1, fading toward 0
    kind : contour, suggestive or the layer it belongs to        width : share of a line's width
    surface : the point of the face under each vertex, as the index of its triangle (k,) and its
    barycentric weights (k, 3); None for lines that stand off the face
    """

    points: NDArray
    strength: NDArray
    kind: str
    width: float = 1.0
    surface: tuple[NDArray, NDArray] | None = None


def draw_strokes(
    rig: FaceRig,
    vertices: NDArray,
    camera: Camera,
    detail: int = 1,
    layers: tuple[str, ...] = ("brow", "iris", "pupil", "lip"),
    buffers: Buffers | None = None,
) -> list[Stroke]:
    """All visible strokes of a posed face, in pixels of `camera`.

    vertices : (n, 3) metres, from `rig.pose`;  detail : 0, 1 or 2, an index into DETAILS;
    layers : which surface strokes to add: those of rig.strokes by the first word of their name,
    and any of rig.curves. Hair hides what lies behind it.

    Raises ValueError for an unknown layer.
    """
    if detail not in range(len(DETAILS)):
        raise ValueError(f"detail must be 0, 1 or 2, got {detail}")
    known = {name.split("_")[0] for name in rig.strokes} | set(rig.curves)
    for layer in set(layers) - known:
        raise ValueError(f"no layer '{layer}'{nearest(layer, tuple(sorted(known)))}")
    solid = ~np.isin(rig.triangle_part, [rig.part_names.index(part) for part in HAIR_PARTS])
    triangles = rig.triangles[solid]
    normals = vertex_normals(vertices, rig.triangles, rig.corners)
    finer = float(np.clip(BUFFER / camera.height, 1.0, 1.5))
    size = round(camera.width * finer), round(camera.height * finer)
    fine = camera.cropped(0, 0, camera.width, camera.height, *size)
    curves = {layer: rig.curves[layer] for layer in layers if layer in rig.curves}
    places = {layer: curve.points(vertices) for layer, curve in curves.items()}
    shells = [(places[layer], curve.triangles) for layer, curve in curves.items()]
    if buffers is None or any(len(shell) for _, shell in shells):
        buffers = rasterise(*_behind_hair(vertices, triangles, shells), fine)
    view = camera.view_vectors(vertices)
    facing = np.einsum("ij,ij->i", normals, view)

    eyes = np.flatnonzero(rig.triangle_part[solid] == rig.part_names.index("eyes"))

    def trace(
        kind: str,
        points: NDArray,
        strength: NDArray,
        lines: Sequence[NDArray],
        widths: Sequence[float] | None = None,
    ) -> list[Stroke]:
        """What can be seen of polylines given by their point numbers, where they have strength."""
        at = fine.project(points)
        seen = unhidden(at, points[:, 2], buffers, DEPTH_BIAS)
        if kind in ("iris", "pupil"):  # the lids are thinner than the depth test's bias
            seen &= np.isin(_triangle_at(at, buffers), eyes)
        pixels = camera.project(points)
        return [
            Stroke(pixels[line[run]], strength[line[run]], kind, float(width))
            for line, width in zip(lines, widths or [1.0] * len(lines), strict=True)
            for run in _runs(_without_dots(seen[line]) & (strength[line] > 0))
            if _length(pixels[line[run]]) > SHORTEST
        ]

    points, strength, segments = zero_set(vertices, triangles, facing, np.ones(len(vertices)))
    strokes = trace("contour", points, strength, chains(segments))

    skin = triangles[rig.vertex_part[triangles[:, 0]] == rig.part_names.index("skin")]
    front = facing > 0
    skin = skin[front[skin[:, 0]] & front[skin[:, 1]] & front[skin[:, 2]]]
    curvature, growth = radial_curvature(vertices, skin, normals, view)
    least = LEAST_GROWTH[detail]
    head_on = facing > np.cos(np.radians(LEAST_ANGLE))
    fade = np.where(head_on, 0.0, np.clip(growth / least - 1.0, -1.0, 1.0))
    points, strength, segments = zero_set(vertices, skin, curvature, fade)
    strong = strength[segments].max(axis=1) > 0  # most of the zero set is not drawn
    strokes += trace("suggestive", points, strength, chains(segments[strong]))
    for name in rig.strokes:
        kind = name.split("_")[0]
        if kind in layers:
            stroke = rig.stroke_points(vertices, name)
            strokes += trace(kind, stroke, np.ones(len(stroke)), [np.arange(len(stroke))])
    for layer, curve in curves.items():
        shell, points = curve.triangles, places[layer]
        if len(shell):
            outward = vertex_normals(points, shell)
            facing = np.einsum("ij,ij->i", outward, camera.view_vectors(points))
            facing = _averaged(facing, shell)
            outline, strength, segments = zero_set(points, shell, facing, np.ones(len(points)))
            strokes += trace(layer, outline, strength, chains(segments))
        chosen = _spaced(curve, camera.project(points))
        strokes += trace(
            layer,
            points[curve.places],
            curve.strength,
            [np.arange(line.start, line.stop) for line in (curve.lines()[k] for k in chosen)],
            [curve.width[k] for k in chosen],
        )
    return strokes


def _behind_hair(
    vertices: NDArray, triangles: NDArray, shells: list[tuple[NDArray, NDArray]]
) -> tuple[NDArray, NDArray]:
    """The face's triangles with hair after them, which hides what is behind it from both sides."""
    for points, shell in shells:
        both = np.concatenate([shell, shell[:, ::-1]]) + len(vertices)
        triangles = np.concatenate([triangles, both.astype(triangles.dtype)])
        vertices = np.concatenate([vertices, points])
    return vertices, triangles


def _averaged(value: NDArray, triangles: NDArray, times: int = 3) -> NDArray:
    """A value (n,) averaged over the triangles around each point: one clean zero line of many."""
    around = corner_matrix(triangles, len(value))
    share = np.maximum(np.asarray(around.sum(axis=1)).ravel(), 1)
    for _ in range(times):
        value = around @ value[triangles].mean(axis=1) / share
    return value


def _spaced(curve: Curves, pixels: NDArray) -> list[int]:
    """Which lines of a layer to draw: so many hairs that they stand HAIR_GAP pixels apart.

    Long lines are always drawn; hairs too close to each other would run into one blot.
    """
    lines = curve.lines()
    hairs = [k for k, line in enumerate(lines) if line.stop - line.start <= MOST_OF_A_HAIR]
    if len(hairs) < 3:
        return list(range(len(lines)))
    roots = pixels[curve.places[curve.starts[hairs]]]
    gap = float(np.median(np.linalg.norm(np.diff(roots, axis=0), axis=1)))
    step = max(1, int(np.ceil(HAIR_GAP / max(gap, 1e-6))))
    return sorted(set(range(len(lines))) - set(hairs) | set(hairs[::step]))


def radial_curvature(
    vertices: NDArray, triangles: NDArray, normals: NDArray, view: NDArray
) -> tuple[NDArray, NDArray]:
    """Radial curvature κr (n,) in 1/m and its growth D_w κr (n,) in 1/m² at the vertices.

    On each triangle n and κr are linear, so that D_w n and D_w κr are constant there; vertices
    get the mean over their triangles, weighted with area. Positive κr is convex. Vertices that
    no triangle uses get 0.
    """
    corner = vertices[triangles]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area2 = np.maximum(np.einsum("ij,ij->i", cross, cross), 1e-24)  # (2 area)²
    opposite = np.roll(corner, -2, axis=1) - np.roll(corner, -1, axis=1)
    gradient = np.cross(cross[:, None, :], opposite) / area2[:, None, None]  # of the hat functions

    n = normals[triangles]
    mean = n.sum(axis=1)
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
    v = view[triangles].mean(axis=1)
    w = v - np.einsum("ij,ij->i", v, mean)[:, None] * mean
    length2 = np.maximum(np.einsum("ij,ij->i", w, w), 1e-6)
    slope = np.einsum("tkd,td->tk", gradient, w)
    turning = np.einsum("tkd,tk->td", n, slope)
    kr = np.einsum("td,td->t", turning, w) / length2

    area = np.sqrt(area2)
    count = len(vertices)
    weight = np.bincount(triangles.ravel(), np.repeat(area, 3), count)

    def at_vertices(value: NDArray) -> NDArray:
        total = np.bincount(triangles.ravel(), np.repeat(area * value, 3), count)
        return total / np.maximum(weight, 1e-24)

    curvature = at_vertices(kr)
    unit = slope / np.sqrt(length2)[:, None]
    growth = at_vertices(np.einsum("tk,tk->t", curvature[triangles], unit))
    return curvature, growth


def zero_set(
    vertices: NDArray, triangles: NDArray, value: NDArray, weight: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Where `value` (n,), linear on each triangle, is zero.

    Returns points (p, 3) on mesh edges, `weight` interpolated at them (p,), and the segments
    between them (s, 2) as indices: neighbouring triangles share the point on their common edge.
    """
    sign = value > 0
    a, b, c = sign[triangles[:, 0]], sign[triangles[:, 1]], sign[triangles[:, 2]]
    tri = triangles[(a != b) | (b != c)]
    ends = np.stack([tri, np.roll(tri, -1, axis=1)], axis=2)  # (t, 3 edges, 2)
    crossed = sign[ends[:, :, 0]] != sign[ends[:, :, 1]]
    pairs = np.sort(ends[crossed], axis=1)  # two for each triangle, in order
    edges, index = np.unique(pairs, axis=0, return_inverse=True)
    if not len(edges):
        return np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2), dtype=np.int64)
    a, b = edges.T
    t = value[a] / (value[a] - value[b])
    points = vertices[a] + t[:, None] * (vertices[b] - vertices[a])
    return points, weight[a] + t * (weight[b] - weight[a]), index.reshape(-1, 2)


def chains(segments: NDArray) -> list[NDArray]:
    """Chain segments (s, 2) of point numbers into polylines; a closed one repeats its first."""
    neighbours: dict[int, list[int]] = {}
    for a, b in segments.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    loose = [p for p, near in neighbours.items() if len(near) == 1]
    out = []
    for start in loose + list(neighbours):
        while neighbours[start]:
            chain, here = [start], start
            while neighbours[here]:
                there = neighbours[here].pop()
                neighbours[there].remove(here)
                chain.append(there)
                here = there
            out.append(np.array(chain))
    return out


def _runs(flag: NDArray) -> list[slice]:
    """Runs of True with at least two points."""
    edge = np.flatnonzero(np.diff(np.concatenate([[0], flag.astype(np.int8), [0]])))
    return [slice(a, b) for a, b in zip(edge[::2], edge[1::2], strict=True) if b - a >= 2]


def _without_dots(seen: NDArray) -> NDArray:
    """Visibility along a line without single samples that would dot it or cut it."""
    if len(seen) < 5:
        return seen
    padded = np.pad(seen, 2, mode="edge").astype(np.int8)
    return np.lib.stride_tricks.sliding_window_view(padded, 5).sum(axis=1) >= 3


def _triangle_at(pixels: NDArray, buffers: Buffers) -> NDArray:
    h, w = buffers.triangle.shape
    col, row = np.floor(pixels).astype(np.int64).T
    return buffers.triangle[np.clip(row, 0, h - 1), np.clip(col, 0, w - 1)]


def _length(points: NDArray) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())
