"""Carving lines into the skin: what a drawing shows and the face has no place for, as scars.

The fit moves lines that the face has to where they were drawn; a scar or a wrinkle at an unusual
place is a line that it does not have. Here such a line is thrown onto the posed skin, and the skin
near it moves along its normals: a groove between two rims, as the creases of the expressions are
made (facs_rig.baking.creases), or its opposite, a ridge. The movement becomes part of the fitted
offsets, so that the face stays posable.

A mesh can only show what is wider than its triangles. Where they are large the line is widened to
WIDEN times what they measure across it, and it is never deeper than STEEPEST of its width, so that
its walls stay smooth and no triangle turns over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial import cKDTree

from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.common.errors import InputError
from facs_rig.common.polylines import arc_lengths, line_length, resampled
from facs_rig.mesh import is_shape, triangle_normals, vertex_normals

from .deltas import runs
from .mapping import pixels_to_skin
from .tweakables import DEEPEST, PROFILES, WIDEST

__all__ = ["engrave"]

BOTTOM = 0.6
"""Share of the width, to either side of the line, at which the groove has risen to its rims."""
CREST = 0.5
"""Share of the width, to either side of the line, from which on the rims fall."""
WIDEN = 2.5
"""How many triangles a line is wide at least."""
STEEPEST = 0.3
"""Greatest depth as a share of the width."""
STEP = 0.0005
"""Metres between the points of a line."""
SMOOTH = 0.0015
"""Metres along a line over which the hand's tremble and the pixels' stairs are averaged."""
EVEN = 0.005
"""Metres along a line over which its width is evened out."""
FADE = 0.25
"""Share of a line's length over which either end runs out."""
SHORTEST = 0.002
"""Metres; what is shorter on the skin is a dot and no line."""
MOST_POINTS = 20_000
"""A longer line is taken in larger steps."""
FACING = 0.15
"""Least cosine between the skin's normal and the line of sight: no lines along the outline."""
ALIKE = 0.3
"""Least cosine between the normals of skin and line: what lies behind a nose stays as it is."""
JUMP = 0.005
"""Metres from one point to the next beyond which a line leaves one surface for another."""
EYE_REACH = (0.002, 0.006)
LIP_REACH = (0.001, 0.005)
"""Metres from an eyeball and from the line between the lips: nothing moves, everything moves."""
LEAST_AREA = 0.2
"""What is left at least of a triangle's area, seen along its normal of before."""
GENTLER = 8
"""How often a movement that turns a triangle too far is halved before it is left out."""
AT_ONCE = 10_000
"""Points of lines that are looked at in one go; bounds the memory."""

INNER_LIPS = (
    "mouth_inner_corner_right", "lip_inner_upper_right", "lip_inner_top", "lip_inner_upper_left",
    "mouth_inner_corner_left", "lip_inner_lower_left", "lip_inner_bottom", "lip_inner_lower_right",
    "mouth_inner_corner_right",
)  # fmt: skip


@dataclass(frozen=True)
class _Lines:
    """Points of all lines on the skin.

    points, normals : (p, 3) metres and unit vectors;  width : (p,) metres
    strength : (p,) share of the depth, 0 where a line runs out
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    width: NDArray[np.float64]
    strength: NDArray[np.float64]


def engrave(
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray[np.floating],
    camera: Camera,
    polylines: Sequence[NDArray[np.floating]],
    depth: float = 0.001,
    width: float = 0.004,
    profile: str = "crease",
) -> NDArray[np.float32]:
    """Carve lines of a picture into the posed face, or raise them.

    Each line is smoothed a little, cut where something else than skin is seen under it, and runs
    out toward its ends. Skin moves along its normals by the distance from the line in space; skin
    that faces elsewhere, eyeballs and teeth do not move, and toward the eyeballs and between the
    lips the line runs out. Where the mesh is coarse the line is wider than asked for, and where it
    is narrow less deep (see the module's docstring).

    Parameters
    ----------
    parameters, offsets : the posed face, offsets (n, 3) in metres with the head upright
    camera : that of the picture
    polylines : each (k, 2) float, (u, v) in pixels of the picture
    depth : metres from the skin to the groove's bottom; a negative depth raises a ridge
    width : metres from rim to rim; nothing moves that is farther than the width from a line
    profile : one of PROFILES; a "crease" has low rims, a "scar" high ones

    Returns
    -------
    (n, 3) float32, metres, the offsets with the lines in them, head upright

    Raises ValueError for offsets and polylines of another shape, values that are not finite or out
    of range, and an unknown profile.
    """
    is_shape(offsets, (rig.n_vertices, 3), "offsets")
    if not np.isfinite(offsets).all():
        raise ValueError("The offsets have a value that is not a number.")
    rim = _checked(polylines, depth, width, profile)
    result = np.array(offsets, dtype=np.float32)
    posed = rig.pose(parameters, result)
    normals = vertex_normals(posed, rig.triangles).astype(np.float64)
    lines = _lay(rig, posed, normals, camera, polylines, width)
    if lines is None or depth == 0:
        return result
    free = _free(rig, posed)
    height = np.zeros(rig.n_vertices)
    height[free > 0] = _heights(posed[free > 0], normals[free > 0], lines, abs(depth), rim)
    moves = (math.copysign(1.0, depth) * height * free)[:, None] * normals
    _carry_brows(rig, posed, moves)
    moves = _unfolded(posed, moves, rig.triangles)
    return (result + rig.unturn_vectors(moves, parameters)).astype(np.float32)


def _profile(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The groove and the bank that it is cut into, 1 at the line, by the distance in widths.

    Both only fall with the distance, so that where lines meet the greater value is their union.
    """
    bowl = (1 - np.clip(t / BOTTOM, 0, 1) ** 2) ** 2
    slope = np.clip((1 - t) / (1 - CREST), 0, 1)
    return np.asarray(bowl), np.asarray(slope * slope * (3 - 2 * slope))


def _checked(polylines: Sequence[NDArray], depth: float, width: float, profile: str) -> float:
    """The height of the rims, if all can be used."""
    if profile not in PROFILES:
        raise InputError(f"The profile of a line is {' or '.join(PROFILES)}, not {profile!r}.")
    if not abs(depth) <= DEEPEST:
        raise InputError(
            f"A line is at most {1000 * DEEPEST:g} mm deep or high, not {1000 * depth:g} mm."
        )
    if not 0 < width <= WIDEST:
        raise InputError(
            f"A line is more than 0 and at most {1000 * WIDEST:g} mm wide, not {1000 * width:g} mm."
        )
    for line in polylines:
        is_shape(np.asarray(line), (None, 2), "a polyline")
        if not np.isfinite(line).all():
            raise ValueError("A polyline has a point that is not a number.")
    return PROFILES[profile]


# --- lines on the skin ----------------------------------------------------------------------------


def _lay(
    rig: FaceRig,
    posed: NDArray[np.floating],
    normals: NDArray[np.float64],
    camera: Camera,
    polylines: Sequence[NDArray[np.floating]],
    width: float,
) -> _Lines | None:
    """Throw the lines onto the skin; None when none of them meets it."""
    even = [_smoothed(np.asarray(line, float) / camera.scale) for line in polylines if len(line)]
    if not even:
        return None
    pixels = np.concatenate([points for points, _ in even]) * camera.scale
    seen, corners, weights = pixels_to_skin(pixels, rig, posed, camera)
    points = np.einsum("kc,kcd->kd", weights, posed[corners])
    normal = np.einsum("kc,kcd->kd", weights, normals[corners])
    seen &= np.einsum("kd,kd->k", normal, camera.view_vectors(points)) > FACING
    # Columns: where, which way out, the corners of the triangle there.
    table = np.column_stack([points, normal, posed[corners].reshape(-1, 9)])
    starts = np.cumsum([0] + [len(points) for points, _ in even])
    pieces = []
    for (_, closed), start, end in zip(even, starts[:-1], starts[1:], strict=True):
        for part in runs(seen[start:end], 2):
            piece = table[start:end][part]
            steps = np.linalg.norm(np.diff(piece[:, :3], axis=0), axis=1)
            cuts = np.flatnonzero(steps > JUMP) + 1
            whole = closed and len(piece) == end - start and len(cuts) == 0
            pieces += [_finished(part, width, whole) for part in np.split(piece, cuts)]
    found = [piece for piece in pieces if piece is not None]
    if not found:
        return None
    table = np.concatenate(found)
    out = table[:, 3:6] / np.linalg.norm(table[:, 3:6], axis=1, keepdims=True)
    return _Lines(table[:, :3], out, table[:, 6], table[:, 7])


def _smoothed(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """A line (k, 2) in metres of the picture in even steps and smooth, and if it is a loop."""
    closed = len(points) > 3 and bool(np.allclose(points[0], points[-1]))
    points = _resampled(points, STEP)
    mode = "wrap" if closed else "nearest"
    return gaussian_filter1d(points, SMOOTH / STEP, axis=0, mode=mode), closed


def _resampled(table: NDArray[np.float64], step: float, columns: int = 2) -> NDArray[np.float64]:
    """The rows (k, m) of a line in even steps of the length that the first columns measure."""
    way = arc_lengths(table[:, :columns])
    count = int(min(np.ceil(way[-1] / step) + 1, MOST_POINTS))
    return resampled(table, way, np.linspace(0.0, way[-1], count))


def _finished(piece: NDArray[np.float64], width: float, closed: bool) -> NDArray[np.float64] | None:
    """One line on the skin (k, 15) as points, normals, width and strength in even steps (k, 8)."""
    length = line_length(piece[:, :3])
    if length < SHORTEST:
        return None
    coarse = _across(piece[:, :3], piece[:, 3:6], piece[:, 6:].reshape(-1, 3, 3))
    piece = _resampled(np.column_stack([piece[:, :6], coarse]), STEP, 3)
    mode = "wrap" if closed else "nearest"
    coarse = maximum_filter1d(piece[:, 6], round(EVEN / STEP), mode=mode)
    wide = np.maximum(width, WIDEN * gaussian_filter1d(coarse, EVEN / STEP, mode=mode))
    along = np.linspace(0.0, 1.0, len(piece))
    end = np.ones_like(along) if closed else np.clip(np.minimum(along, 1 - along) / FADE, 0, 1)
    # What is shorter than wide would be a pit.
    strength = end * end * (3 - 2 * end) * np.minimum(1.0, length / wide)
    return np.column_stack([piece[:, :6], wide, strength])


def _across(
    points: NDArray[np.float64], normals: NDArray[np.float64], corners: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(k,) metres, how far the triangle (3, 3) under each point reaches across the line."""
    sideways = np.cross(normals, np.gradient(points, axis=0))
    sideways /= np.maximum(np.linalg.norm(sideways, axis=1, keepdims=True), 1e-12)
    return np.ptp(np.einsum("kcd,kd->kc", corners, sideways), axis=1)


# --- the skin around them -------------------------------------------------------------------------


def _heights(
    vertices: NDArray[np.floating],
    normals: NDArray[np.float64],
    lines: _Lines,
    depth: float,
    rim: float,
) -> NDArray[np.float64]:
    """(m,) metres that vertices move along their normals for grooves of `depth`."""
    deep = lines.strength * np.minimum(depth, STEEPEST * lines.width)
    bowls, banks = np.zeros(len(vertices)), np.zeros(len(vertices))
    tree = cKDTree(vertices)
    # Lines of similar width are looked at together, wide ones in steps as much longer.
    octave = np.floor(np.log2(lines.width / lines.width.min())).astype(np.intp)
    for step in np.unique(octave):
        group = np.flatnonzero(octave == step)[:: 2**step]
        reach = float(lines.width[group].max())
        for start in range(0, len(group), AT_ONCE):
            some = group[start : start + AT_ONCE]
            pairs = cKDTree(lines.points[some]).sparse_distance_matrix(
                tree, reach, output_type="ndarray"
            )
            point, vertex = some[pairs["i"]], pairs["j"]
            alike = np.einsum("kd,kd->k", lines.normals[point], normals[vertex]) > ALIKE
            point, vertex, away = point[alike], vertex[alike], pairs["v"][alike]
            bowl, bank = _profile(away / lines.width[point])
            np.maximum.at(bowls, vertex, deep[point] * bowl)
            np.maximum.at(banks, vertex, deep[point] * bank)
    return rim * banks - (1 + rim) * bowls


def _free(rig: FaceRig, posed: NDArray[np.floating]) -> NDArray[np.float64]:
    """(n,) how far each vertex may move, 0 to 1: skin, but not the edges of lids and lips."""
    free = rig.parts["skin"].astype(np.float64)
    loop = posed[[rig.landmarks[LANDMARKS.index(name)] for name in INNER_LIPS]].astype(np.float64)
    for points, (none, full) in (
        (posed[rig.parts["eyes"]], EYE_REACH),
        (_resampled(loop, STEP, 3), LIP_REACH),
    ):
        if len(points):
            away = cKDTree(points).query(posed, distance_upper_bound=full)[0]
            free *= np.clip((np.minimum(away, full) - none) / (full - none), 0.0, 1.0)
    return free


def _unfolded(
    posed: NDArray[np.floating], moves: NDArray[np.float64], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """The movements, smaller where they would shrink or turn a triangle beyond LEAST_AREA."""
    near = triangles[moves.any(axis=1)[triangles].any(axis=1)]
    posed = posed.astype(np.float64)  # so that what does not move stays exactly as it was
    before = triangle_normals(posed, near)
    least = LEAST_AREA * np.einsum("ij,ij->i", before, before)
    moves, attempt = moves.copy(), 0
    while True:
        after = triangle_normals(posed + moves, near)
        over = np.einsum("ij,ij->i", before, after) < least
        if not over.any():
            return moves
        moves[np.unique(near[over])] *= 0.5 if attempt < GENTLER else 0.0
        attempt += 1


def _carry_brows(rig: FaceRig, posed: NDArray[np.floating], moves: NDArray[np.float64]) -> None:
    """Let the hairs of the brows follow the skin under them, in place."""
    brows, skin = np.flatnonzero(rig.parts["brows"]), np.flatnonzero(rig.parts["skin"])
    if len(brows):
        moves[brows] = moves[skin[cKDTree(posed[skin]).query(posed[brows])[1]]]
