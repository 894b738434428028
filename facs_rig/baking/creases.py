"""Creases: grooves in the skin, drawn as curves on the active face and raised by their control.

MakeHuman's targets move the skin but do not fold it, and it is by its folds that an expression
shows in a line drawing. A crease is a curve on the face's left (the right is its mirror image)
with a depth at full natural activation (intensity 5) and a half-width; facs_rig.grooves has them.
Its profile across is a narrow groove between low, broad shoulders, its depth fades toward the ends
of the curve, so that the line that is seen grows longer as it grows deeper.

The default person's creases are one movement for each control. What other people have in their
place is kept line by line and side by side, so that left may differ from right.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from ..anatomy import PART_NAMES, FromFront, smooth_curve
from ..common.polylines import arc_lengths, resampled
from ..common.ties import nearest
from ..controls import Control
from ..folds import REST
from ..grooves import CREASES, LINES, LONG, PLAIN, Crease, grooves, names_of

__all__ = ["CREASES"]  # where the default person's creases lie

SAMPLES = 120  # points along a crease
LEAST = 2e-5  # metres below which a single groove is left out
ACROSS = 2.0  # cm from the middle, to which the creases of a side reach over it
SMOOTH = 0.0008  # metres along a crease over which its depth in the face is smoothed
# Height of a crease's shoulders, as a share of its depth.
SHOULDER = 0.2
BULGE = 3.2  # half-widths over which the skin beyond a fold comes down again: no edge of its own
BULGE_FADES = 0.45  # of the length, over which it comes up from either end

# Edge lengths in metres that the refinement aims at: along creases, the face, the rest of the skin.
CREASED_EDGE, FACE_EDGE, PLAIN_EDGE = 0.0013, 0.0055, 0.008
MOST_LEVELS = 3
BALL = 0.0135  # metres, the eyeballs' radius


def refinement_levels(cage: NDArray, quads: NDArray, part: NDArray) -> NDArray[np.int64]:
    """Subdivision level of each cage quad: fine where creases run, coarse where nothing happens.

    cage : (m, 3) metres in the source's frame;  quads : (f, 4);  part : (f,) part numbers.
    """
    corners = cage[quads]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    longest = np.maximum(sides[:, 0] + sides[:, 2], sides[:, 1] + sides[:, 3]) / 2
    eyes = cage[np.unique(quads[part == PART_NAMES.index("eyes")])].mean(axis=0)
    centre = (corners.mean(axis=1) - eyes) * 100
    x, y, z = centre.T
    left = [
        drawn(crease, 60)
        for lines in LINES.values()
        for line in lines
        for way in (PLAIN, *line.ways)
        if way != LONG  # where that goes farther it fades
        for crease in grooves(line, way)
    ]
    curves = np.concatenate([curve * [sign, 1] for curve in left for sign in (1, -1)])
    reach = cKDTree(curves).query(centre[:, :2])[0] - 70 * longest  # quad's half diagonal, in cm
    face = (z > -3.0) & (np.abs(x) < 6.4) & (y < 6.5) & (y > -11.0)
    aim = np.where(face, FACE_EDGE, PLAIN_EDGE)
    aim[face & (z > -2.0) & (reach < 0.05)] = CREASED_EDGE
    inside = (np.abs(x) < 2.6) & (np.abs(y + 6.5) < 2.5) & (z < 0.2)  # the cavity of the mouth
    aim[inside] = PLAIN_EDGE
    level = np.round(np.log2(np.maximum(longest / aim, 1)) + 0.1).astype(np.int64)
    level = np.clip(level, np.where(face & ~inside & (z > -1.5), 1, 0), MOST_LEVELS)
    socket = np.min(
        [np.linalg.norm(corners.mean(axis=1) - ball, axis=1) for ball in _balls(cage, quads, part)],
        axis=0,
    )
    level[(part == 0) & (socket < 0.9 * BALL)] = 0  # behind the eyeballs nothing is seen
    level[part == PART_NAMES.index("eyes")] = 2
    level[np.isin(part, [PART_NAMES.index(p) for p in ("teeth", "tongue", "lashes")])] = 1
    return _graded(level, quads)


def _graded(level: NDArray, quads: NDArray) -> NDArray[np.int64]:
    """Levels raised until quads that share an edge differ by one at most.

    Where coarse meets fine at once, the triangles between them shade as a row of spots.
    """
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, edge = np.unique(sides, axis=0, return_inverse=True)
    edge = edge.reshape(-1, 4)
    for _ in range(MOST_LEVELS):
        finest = np.zeros(edge.max() + 1, dtype=np.int64)
        np.maximum.at(finest, edge.ravel(), np.repeat(level, 4))
        level = np.maximum(level, finest[edge].max(axis=1) - 1)
    return level


def drawn(crease: Crease, count: int) -> NDArray[np.float64]:
    """(count, 2) cm, the part of a curve that is creased, evenly by length."""
    curve = smooth_curve(np.array(crease.points), 4 * count)
    first, last = crease.span
    if (first, last) == (0.0, 1.0):
        return smooth_curve(np.array(crease.points), count)
    s = arc_lengths(curve)
    ends = curve[[0, -1]] + np.stack([curve[0] - curve[1], curve[-1] - curve[-2]]) * 4 * count
    curve = np.concatenate([ends[:1], curve, ends[1:]])
    s = np.concatenate([[-s[-1]], s, [2 * s[-1]]])
    length = s[-1] / 2
    return resampled(curve, s, np.linspace(first * length, last * length, count))


def _balls(cage: NDArray, quads: NDArray, part: NDArray) -> list[NDArray]:
    """Centres (3,) of the eyeballs."""
    eyes = cage[np.unique(quads[part == PART_NAMES.index("eyes")])]
    return [own.mean(axis=0) for own in (eyes[eyes[:, 0] > 0], eyes[eyes[:, 0] < 0])]


@dataclass(frozen=True)
class Skin:
    """The face that a control makes, on which its creases lie.

    vertices, normals : (n, 3) of the smooth face with the symmetric control at intensity 5, so
    that a curve lies where it is seen on the active face; allowed : (n,) where there may be
    creases; surface : of these vertices
    """

    vertices: NDArray
    normals: NDArray
    allowed: NDArray
    surface: FromFront
    eyes_middle: NDArray


def skin_of(vertices, normals, triangles, skin, eyes_middle) -> Skin:
    """The skin (n,) of a face from in front of the ears, as far as it faces the front."""
    allowed = skin & (normals[:, 2] > 0.1) & (vertices[:, 2] > eyes_middle[2] - 0.05)
    surface = FromFront(vertices, triangles, allowed)
    return Skin(vertices, normals, allowed, surface, eyes_middle)


def default_creases(control: Control, skin: Skin) -> NDArray[np.float64]:
    """Displacements (n, 3) in metres of the default person's creases of a control at intensity 5,
    along the normals: those on the face's left (see `left_half`)."""
    creases = [crease for group in control.creases for crease in CREASES[group]]
    return left_half(raised(creases, skin), skin)


def single_grooves(control: Control, skin: Skin) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """All that people may have in the place of the default person's creases of a control: names
    (grooves.names_of) and displacements (n, 3) of each on the face's left."""
    for group in control.creases:
        for name, line, way in names_of(group):
            height = raised(grooves(line, way), skin)
            height[np.abs(height) < LEAST] = 0
            yield name, left_half(height, skin)


def rest_folds(skin: Skin) -> dict[str, NDArray[np.float64]]:
    """Each of folds.REST -> (n, 3) what an old face has of it at rest, on the face's left."""
    out = {}
    for name, (_, groups, share) in REST.items():
        creases = [crease for group in groups for crease in CREASES[group]]
        out[name] = share * left_half(raised(creases, skin), skin)
    return out


def left_half(height: NDArray, skin: Skin) -> NDArray[np.float64]:
    """(n, 3) along the normals, fading over the middle of the face, 1 cm to each side: with its
    mirror image it is the whole."""
    share = np.clip(0.5 + skin.vertices[:, 0] / 0.02, 0, 1)
    return (share * height)[:, None] * skin.normals


def raised(creases: Sequence[Crease], skin: Skin) -> NDArray[np.float64]:
    """Height (n,) in metres of creases: on the face's left and across its middle."""
    height = np.zeros(len(skin.vertices))
    front = np.flatnonzero(skin.allowed)
    flat = [
        (crease, fade, points)
        for crease in creases
        for fade, points in _both_sides(crease)
        if points[:, 0].max() > -ACROSS
    ]
    places = np.concatenate([points for _, _, points in flat]) * 0.01 + skin.eyes_middle[:2]
    index, weight = skin.surface.bind(places)
    depths = np.einsum("kc,kc->k", weight, skin.vertices[index][:, :, 2])
    starts = np.cumsum([len(points) for _, _, points in flat])[:-1]
    curves = zip(flat, np.split(places, starts), np.split(depths, starts), strict=True)
    for (crease, fade, _), place, z in curves:
        spacing = np.linalg.norm(np.diff(place, axis=0), axis=1).mean()
        smooth = gaussian_filter1d(z, SMOOTH / spacing, mode="nearest")
        curve = np.column_stack([place, smooth])
        height += _groove(crease, fade, curve, skin.vertices, front)
    return height


def _both_sides(crease: Crease) -> list[tuple[tuple[float, float], NDArray]]:
    """The curve on both sides: one across the middle where it begins there, else two."""
    left = drawn(crease, SAMPLES)
    right = left * [-1, 1]
    if crease.fade[0] > 0 or crease.points[0][0] != 0 or crease.span[0] != 0:
        return [(crease.fade, left), (crease.fade, right)]
    end = crease.fade[1] / 2
    return [((end, end), np.concatenate([right[:0:-1], left]))]


def _groove(crease, end_fades, curve, vertices, front) -> NDArray:
    """Height (n,) in metres of one crease, by the distance from its curve in half-widths.

    A narrow groove between broad, low shoulders.
    """
    reach = 4.0 if not crease.lift else 2.0 + 2.2 * BULGE
    away, _ = cKDTree(curve).query(
        vertices[front], distance_upper_bound=1e-3 * reach * crease.width
    )
    near = np.isfinite(away)
    front, away = front[near], away[near]
    at = nearest(curve, vertices[front])  # in the middle of the face two points are equally near
    s = np.linspace(0, 1, len(curve))[at]
    fade = _faded(s, end_fades)
    t = away / (1e-3 * crease.width)
    height = SHOULDER * np.exp(-((t / 2.2) ** 2)) - (1 + SHOULDER) * np.exp(-(t**2) / 0.9)
    height *= 1e-3 * crease.depth * fade
    if crease.lift:
        x = curve[at, 0]
        outer = np.where((vertices[front, 0] - x) * np.sign(x) > 0, t, -t) - 2.0
        wide = np.where(outer > 0, BULGE, 1.2)
        soft = _faded(s, (max(end_fades[0], BULGE_FADES), max(end_fades[1], BULGE_FADES)))
        height += 1e-3 * crease.lift * soft * np.exp(-((outer / wide) ** 2))
    out = np.zeros(len(vertices))
    out[front] = height
    return out


def _faded(s: NDArray, shares: tuple[float, float]) -> NDArray[np.float64]:
    """How deep a crease is along its length s (k,), 0 to 1: it fades over a share at each end."""
    fade = np.ones_like(s)
    for share, from_end in zip(shares, (s, 1 - s), strict=True):
        if share > 0:
            t = np.clip(from_end / share, 0, 1)
            fade *= t * t * (3 - 2 * t)
    return fade
