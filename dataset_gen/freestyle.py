"""An engine of the data set: Blender's Freestyle finds the lines and what hides them.

Freestyle's view map gives the lines in space (see freestyle_view_map). They are projected with our
own camera, so that both engines agree to the last pixel, and chained into the same strokes.
Surface strokes (brows, irises, lips, hair) are drawn by dataset_gen.linework.lines for both.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facs_rig import Camera, FaceRig, rasterise
from facs_rig.anatomy import UNDRAWN_PARTS
from facs_rig.common.derived import derived
from facs_rig.common.polylines import line_length
from facs_rig.mesh import vertex_normals
from facs_rig.raster import Buffers

from .freestyle_view_map import InputError, Nature, ViewMap, version, view_map
from .linework.hidden import BIAS, DIP, LIFT, Cover, Scene
from .linework.lines import LEAST, LEAST_ANGLE, Surface, draw_strokes
from .linework.strokes import LineSet, Stroke, cut
from .linework.topology import FaceTopology, face_topology
from .linework.zero_sets import chains

__all__ = ["KINDS", "InputError", "freestyle_strokes", "version"]

KINDS = ("contour", "suggestive", "valley", "boundary", "crease")  # that Freestyle has
# Those that data sets are drawn with. Its valleys are too few: of the folds of a strong expression
# most are missing, and a drawing must show what it is labelled with.
DRAWN = ("contour", "suggestive", "boundary", "crease")
BEHIND = 0.004  # metres behind the surface that is seen: still near enough to matter
LEAST_TOWARD = -0.3  # n·v of a vertex that may still be beside an outline
RINGS = 2  # triangles around those that are seen
WELD = 1e-6  # metres within which two ends are one point
FADING = ("suggestive", "valley")  # kinds that are found by Freestyle's curvature
SMOOTHINGS = 5  # times that the points of those are averaged with their neighbours
SHORTEST = 5.0  # pixels: of those, strokes that are shorter are left out
AMONG = 8  # triangles around a point of which one holds it


def freestyle_strokes(
    rig: FaceRig,
    vertices: NDArray,
    camera: Camera,
    detail: int = 1,
    layers: tuple[str, ...] = ("brow", "iris", "pupil", "lip"),
    kinds: tuple[str, ...] = ("contour", "suggestive"),
    cover: Cover | None = None,
) -> list[Stroke]:
    """All visible strokes of a posed face as `draw_strokes` gives them, found by Freestyle.

    vertices : (n, 3) metres, from `rig.pose`;  detail : 0, 1 or 2, an index into DETAILS;
    layers : which surface strokes to add;  kinds : which of KINDS to draw;  cover : what is worn,
    which hides what Freestyle finds, and whose own lines are not Freestyle's

    Freestyle's curvature is a sum over the triangles around a vertex that is not divided by their
    area, so that its derivative says as much about the mesh as about the face. What is drawn at
    which level of detail, and how strongly a line fades, is therefore decided as in the other
    engine, by curvatures in 1/m. Freestyle's "ridges and valleys" are one set of lines, where the
    smaller principal curvature changes its sign; those of them in hollow places are drawn.

    Raises InputError for an unknown layer or kind, InputError where Freestyle cannot draw.
    """
    for kind in set(kinds) - set(KINDS):
        raise InputError(f"Freestyle draws no '{kind}'; it has: {', '.join(KINDS)}")
    painted = draw_strokes(rig, vertices, camera, detail, layers, kinds=(), cover=cover)
    face = face_topology(rig)
    curves = [rig.curves[layer] for layer in layers if layer in rig.curves]
    shells = [(c.points(vertices), c.triangles) for c in curves if len(c.triangles)]
    triangles = _along_folds(rig)
    triangles = triangles[_near_the_eye(vertices, triangles, camera)]
    found = view_map(vertices, triangles, camera, shells, "valley" in kinds)
    used = np.zeros(len(vertices), dtype=bool)
    used[triangles] = True
    near = np.flatnonzero(used[face.solid.triangles].all(axis=1))
    surface = Surface(vertices, face.solid, face.skin, camera)
    scene = Scene.of(surface.vertices, face.solid.triangles, camera, shells, cover)
    strokes = []
    for lines, free in _line_sets(surface, face, near, found, kinds, detail):
        pixels, seen, nearly = _seen(lines, free, scene)
        cuts = cut([lines], pixels, seen, nearly)
        strokes += [s for s in cuts if lines.kind not in FADING or line_length(s.points) > SHORTEST]
    return strokes + painted


@derived
def _along_folds(rig: FaceRig) -> NDArray[np.int32]:
    """Triangles (t, 3) of the face without hairs, its quads cut along their longer diagonals.

    Freestyle takes the curvature of a vertex from the angles at its edges. The quads along a fold
    are slanted, and only edges that run along it say how it bends: cut the other way, the lines of
    a forehead come out in shreds.
    """
    first, sizes = rig.polygon_starts, np.diff([*rig.polygon_starts, len(rig.polygon_vertices)])
    hair = np.isin(rig.vertex_part, [rig.part_names.index(part) for part in UNDRAWN_PARTS])
    solid = ~hair[rig.polygon_vertices[first]]
    a, b, c, d = (rig.polygon_vertices[first[solid & (sizes == 4)] + k] for k in range(4))
    rest = rig.neutral()
    across = np.linalg.norm(rest[a] - rest[c], axis=1) < np.linalg.norm(rest[b] - rest[d], axis=1)
    a, b, c, d = (np.where(across, x, y) for x, y in ((b, a), (c, b), (d, c), (a, d)))
    small = rig.polygon_vertices[first[solid & (sizes == 3)][:, None] + np.arange(3)]
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1), small])


def _near_the_eye(vertices: NDArray, triangles: NDArray, camera: Camera) -> NDArray[np.bool_]:
    """Triangles (t,) that can be seen or are close to one that can: all that Freestyle needs.

    What lies behind the face is hidden with or without what lies behind it, too.
    """
    buffers = rasterise(vertices, triangles, camera)
    toward = vertex_normals(vertices, triangles) * camera.view_vectors(vertices)
    near = _not_deep(vertices, camera, buffers) & (toward.sum(axis=1) > LEAST_TOWARD)
    keep = near[triangles].any(axis=1)
    for _ in range(RINGS):
        near[triangles[keep]] = True
        keep = near[triangles].any(axis=1)
    return keep


def _not_deep(vertices: NDArray, camera: Camera, buffers: Buffers) -> NDArray[np.bool_]:
    """Vertices (n,) at most BEHIND metres behind the deepest surface seen near them, or outside."""
    h, w = buffers.depth.shape
    col, row = np.floor(camera.project(vertices)).astype(np.int64).T
    inside = (col >= 0) & (col < w) & (row >= 0) & (row < h)
    deepest = buffers.deepest[np.clip(row, 0, h - 1), np.clip(col, 0, w - 1)]
    return ~inside | (vertices[:, 2] >= deepest - BEHIND)


def _line_sets(
    surface: Surface,
    face: FaceTopology,
    near: NDArray,
    found: ViewMap,
    kinds: tuple[str, ...],
    detail: int,
) -> Iterator[tuple[LineSet, NDArray]]:
    """The pieces of a view map of the triangles `near` (t,), chained, and which points are free."""
    triangles = surface.topology.triangles[near]
    middles = cKDTree(surface.vertices[triangles].mean(axis=1))
    for kind, chosen in _of_kind(found).items():
        if kind not in kinds or not chosen.any():
            continue
        points, segments, free = _welded(found, chosen)
        if kind in FADING:
            points = _smoothed(points, segments)
        at, weight = _under(surface.vertices, triangles, middles, points)
        at = near[at]
        strength = np.ones(len(points))
        if kind in FADING:
            field = _strength(surface, kind, detail)
            strength = np.einsum("kc,kc->k", field[surface.topology.triangles[at]], weight)
            strength = np.minimum(strength, 1.0)
            strength[~face.skin[at]] = 0.0
            segments = segments[(strength[segments] > 0).any(axis=1)]
        line, starts = chains(segments)
        at, weight = at[line], weight[line]
        corner = surface.topology.triangles[at]
        out = np.einsum("kc,kcd->kd", weight, surface.normals[corner])
        bulging = np.einsum("kc,kc->k", weight, surface.radial[0][corner]) > 0
        yield LineSet(
            kind, points[line], starts, strength[line], np.ones(len(starts) - 1), out,
            # where it is hollow, the surface itself covers its contour
            bulging if kind == "contour" else np.ones(len(line), dtype=bool),
            (face.index[at], weight),
        ), free[line]  # fmt: skip


def _of_kind(found: ViewMap) -> dict[str, NDArray[np.bool_]]:
    """Which pieces (e,) are of which kind; a piece that is several is the first of them."""
    bits = {
        "contour": Nature.SILHOUETTE,
        "boundary": Nature.BORDER,
        "crease": Nature.CREASE,
        "suggestive": Nature.SUGGESTIVE,
        "valley": Nature.RIDGE | Nature.VALLEY,
    }
    left = np.ones(len(found.nature), dtype=bool)
    out = {}
    for kind, bit in bits.items():
        out[kind] = left & (found.nature & bit > 0)
        left &= ~out[kind]
    return out


def _strength(surface: Surface, kind: str, detail: int) -> NDArray:
    """(n,) strength of a line of a kind at each vertex, not above 0 where it is not drawn."""
    if kind == "suggestive":
        head_on = surface.facing > np.cos(np.radians(LEAST_ANGLE))
        value = np.where(head_on, 0.0, surface.radial[1])
    else:
        value = -surface.principal.k1
    return np.clip(value / LEAST[kind][detail] - 1.0, -1.0, 1.0)


def _seen(lines: LineSet, free: NDArray, scene: Scene) -> tuple[NDArray, NDArray, NDArray]:
    """Pixels (m, 2) of the points of lines, which can be seen (m,), and which nearly.

    free : (m,) bool, that nothing hides by Freestyle's count. It counts a surface that a line
    touches, too: the line between closed lips would be gone.
    """
    camera = scene.camera
    pixels = camera.project(lines.points)
    inside = ((pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=1)
    above = lines.points + LIFT * lines.normals
    depth, owner = scene.topmost(above)
    behind, inside = depth - above[:, 2], inside & (owner < scene.face)
    touching, nearly = (lines.shown & (behind <= least) for least in (BIAS, DIP))
    return pixels, inside & (free | touching), inside & (free | nearly)


def _welded(found: ViewMap, chosen: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Points (p, 3) of the chosen pieces, the pieces as pairs of them (s, 2), seen or not (p,)."""
    ends = np.concatenate([found.start[chosen], found.end[chosen]])
    _, first, index = np.unique(
        np.round(ends / WELD).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    segments = index.reshape(2, -1).T
    seen = np.zeros(len(first), dtype=bool)
    seen[segments[found.hidden[chosen] == 0]] = True
    return ends[first], segments[segments[:, 0] != segments[:, 1]], seen


def _under(
    vertices: NDArray, triangles: NDArray, middles: cKDTree, points: NDArray
) -> tuple[NDArray, NDArray]:
    """The triangle (k,) on which each point (k, 3) lies and its barycentric weights (k, 3)."""
    _, nearest = middles.query(points, min(AMONG, len(triangles)))
    nearest = np.reshape(nearest, (len(points), -1))
    a, b, c = np.moveaxis(vertices[triangles[nearest]], 2, 0)  # each (k, among, 3)
    ab, ac, ap = b - a, c - a, points[:, None] - a
    d00, d01, d11 = (np.einsum("kmd,kmd->km", x, y) for x, y in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = (np.einsum("kmd,kmd->km", ap, x) for x in (ab, ac))
    whole = np.maximum(d00 * d11 - d01 * d01, 1e-24)
    v, w = (d11 * d20 - d01 * d21) / whole, (d00 * d21 - d01 * d20) / whole
    weight = np.clip(np.stack([1 - v - w, v, w], axis=2), 0.0, None)
    weight /= weight.sum(axis=2, keepdims=True)
    there = np.einsum("kmc,kmcd->kmd", weight, np.stack([a, b, c], axis=2))
    best = np.linalg.norm(there - points[:, None], axis=2).argmin(axis=1)
    row = np.arange(len(points))
    return nearest[row, best], weight[row, best]


def _smoothed(points: NDArray, segments: NDArray) -> NDArray:
    """Points (p, 3) averaged with the two they are joined with; ends and forks stay.

    Freestyle's curvature is taken from the nearest triangles alone, so its lines tremble.
    """
    count = np.bincount(segments.ravel(), minlength=len(points))
    inner = (count == 2)[:, None]
    for _ in range(SMOOTHINGS):
        total = np.zeros_like(points)
        np.add.at(total, segments[:, 0], points[segments[:, 1]])
        np.add.at(total, segments[:, 1], points[segments[:, 0]])
        points = np.where(inner, points / 2 + total / 4, points)
    return points
