"""The head that hair is put on: how far its skin is from its middle, and from its axis."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from ..camera import Camera
from ..common.derived import derived
from ..mesh import is_shape
from ..paint import MATERIAL_NAMES, painted
from ..raster import rasterise
from ..rig import FaceRig, landmark_points
from ..subdivide import triangulate

AROUND = 96  # rays around the head
STEEP, HIGH = 40, 56  # rays from the neck to the crown, and heights from under the neck to it
LOWEST = np.radians(-60.0)  # elevation of the lowest rays
WIDEST = 0.31  # height at which a skull is widest, as a share of eyes to crown
FALLS_CLEAR = 3  # steps of height by which what falls keeps off what is above and below
EAR_MOVES = 3e-4  # metres that a vertex of the ear moves when ears stand out
KEPT = 16  # persons whose heads are remembered
# Depth (h, w) of the nearest surface, -inf where none is, of vertices (n, 3), triangles, camera.
Depths = Callable[[NDArray, NDArray, Camera], NDArray]


@dataclass(frozen=True)
class Head:
    """A person's head, upright. Azimuths are radians, 0 in front, positive to its own left.

    eyes, middle : (3,) metres, between the eyes, and of the skull where it is widest
    above, below : metres from the eyes up to the crown, and down to the chin
    skull, covered : (96, 40) metres from the middle to the skin along rays by azimuth and
        elevation, without the ears, and over them
    axis, hull : (96, 56) metres from the upright axis to the skin by azimuth and height, without
        the ears, and of what hair that falls past head and ears keeps off
    """

    eyes: NDArray[np.float64]
    middle: NDArray[np.float64]
    above: float
    below: float
    skull: NDArray[np.float64]
    covered: NDArray[np.float64]
    axis: NDArray[np.float64]
    hull: NDArray[np.float64]

    def metres(self, height: NDArray) -> NDArray[np.float64]:
        """Heights of a cut as metres above the eyes."""
        return np.where(height > 0, self.above, self.below) * height

    def height(self, metres: NDArray) -> NDArray[np.float64]:
        """Metres above the eyes as heights of a cut."""
        return metres / np.where(np.asarray(metres) > 0, self.above, self.below)

    def rays(self, table: NDArray, ways: NDArray) -> NDArray[np.float64]:
        """(...) metres of `skull` or `covered` along unit vectors (..., 3) from the middle."""
        azimuth = np.arctan2(ways[..., 0], ways[..., 2])
        elevation = np.arcsin(np.clip(ways[..., 1], -1, 1))
        row = (elevation - LOWEST) / (np.pi / 2 - LOWEST) * (STEEP - 1)
        return _sampled(table, azimuth, row)

    def levels(self, table: NDArray, azimuth: NDArray, metres: NDArray) -> NDArray[np.float64]:
        """(...) metres of `axis` or `hull` at azimuths and metres above the eyes."""
        return _sampled(table, azimuth, (metres / self._step + HIGH - 1) - self.above / self._step)

    @property
    def _step(self) -> float:
        """Metres between two heights: the tables go down as far below the chin as it is itself."""
        return (self.above + 2 * self.below) / (HIGH - 1)


def head_of(rig: FaceRig, identity: Mapping[str, float] | None = None) -> Head:
    """The head of a person, remembered. InputError for what no person can be."""
    known, who = _heads(rig), tuple(sorted((identity or {}).items()))
    if who not in known:
        while len(known) >= KEPT:
            known.pop(next(iter(known)))
        known[who] = measured(rig, rig.neutral(identity))
    return known[who]


@derived
def _heads(rig: FaceRig) -> dict[tuple, Head]:
    return {}


@derived
def _outside(rig: FaceRig) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Triangles of the skin but for the mouth's lining: those that are no ear's, and the ears'.

    Of the full face those of the medium level: hair keeps more off than the finest detail is high.
    """
    triangles = rig.triangles
    if rig.level == "full":
        corners, starts = rig.lighter["medium"]
        triangles = triangulate(rig.texture.vertices[corners], starts)
    skin = painted(rig).material != MATERIAL_NAMES.index("mouth")
    skin &= rig.parts["skin"]
    ears = np.linalg.norm(rig.neutral({"ear_wing": 1.0}) - rig.neutral(), axis=1) > EAR_MOVES
    skin, ears = (of[triangles].any(axis=1) for of in (skin, ears))
    return triangles[skin & ~ears], triangles[skin & ears]


def measured(rig: FaceRig, vertices: NDArray, depths: Depths | None = None) -> Head:
    """The head of a face without expression, upright: vertices (n, 3) metres.

    The skin is rasterised as it looks unrolled, once around its middle and once around its axis,
    with its distance for a depth. depths : what rasterises, if not facs_rig.raster
    """
    depths = depths or _depths
    vertices = is_shape(np.asarray(vertices, dtype=np.float64), (rig.n_vertices, 3), "vertices")
    place = landmark_points(rig, vertices)
    skin = vertices[rig.parts["skin"]]
    eyes = vertices[rig.parts["eyes"]].mean(axis=0)
    above, below = skin[:, 1].max() - eyes[1], eyes[1] - place["chin"][1]
    low = eyes[1] - 0.6 * below
    back = skin[skin[:, 1] > low][:, 2].min()
    middle = np.array([eyes[0], eyes[1] + WIDEST * above, (place["forehead"][2] + back) / 2])

    bare, ear = _outside(rig)
    away = vertices - middle
    azimuth, level = np.arctan2(away[:, 0], away[:, 2]), np.hypot(away[:, 0], away[:, 2])
    elevation = np.arctan2(away[:, 1], level)
    rays = (elevation - LOWEST) / (np.pi / 2 - LOWEST) * (STEEP - 1)
    metres = vertices[:, 1] - eyes[1]
    step = (above + 2 * below) / (HIGH - 1)
    heights = (metres + 2 * below) / step
    far = np.linalg.norm(away, axis=1)

    axis, ears = _with_ears(azimuth, heights, level, bare, ear, HIGH, depths)
    skull, covered = _with_ears(azimuth, rays, far, bare, ear, STEEP, depths)
    hull = maximum_filter1d(_softly_over(ears), 2 * FALLS_CLEAR + 1, axis=1, mode="nearest")
    hull = np.maximum(gaussian_filter1d(hull, FALLS_CLEAR / 2, axis=1, mode="nearest"), ears)
    # Below the chin hair rests on the neck and goes on down: shoulders are not there to hold it.
    chin = round(below / step)
    hull[:, : chin + 1] = np.maximum.accumulate(hull[:, chin::-1], axis=1)[:, ::-1]
    return Head(eyes, middle, above, below, skull, _softly_over(covered), axis, hull)


def _depths(points: NDArray, triangles: NDArray, camera: Camera) -> NDArray[np.float32]:
    return rasterise(points, triangles, camera).depth


def _with_ears(
    azimuth: NDArray, row: NDArray, distance: NDArray, bare: NDArray, ear: NDArray, rows: int,
    depths: Depths,
) -> tuple[NDArray, NDArray]:  # fmt: skip
    """(AROUND, rows) without gaps: the farthest of the skin without ears, and with them."""
    skin, ears = (_unrolled(azimuth, row, distance, of, rows, depths) for of in (bare, ear))
    closed = _filled(skin)
    return closed, np.fmax(np.fmax(skin, ears), closed)


def _unrolled(
    azimuth: NDArray, row: NDArray, distance: NDArray, triangles: NDArray, rows: int,
    depths: Depths,
) -> NDArray[np.float64]:  # fmt: skip
    """(AROUND, rows) the farthest of a surface by azimuth, from -pi, and row; nan where none is."""
    a, b, c = (azimuth[triangles[:, k]] for k in range(3))
    seam = np.maximum(np.maximum(a, b), c) - np.minimum(np.minimum(a, b), c) > np.pi
    across = triangles[seam]
    n = len(azimuth)
    # What lies across the seam behind is laid out on both sides of it.
    used, back = np.unique(across, return_inverse=True)
    back = back.reshape(across.shape)
    turned = [np.where(azimuth[used] < 0, 2, 0), np.where(azimuth[used] > 0, -2, 0)]
    at = np.concatenate([azimuth, *(azimuth[used] + np.pi * turn for turn in turned)])
    thrice = np.concatenate([np.arange(n), used, used])
    points = np.stack([at * AROUND / (2 * np.pi), row[thrice], distance[thrice]], axis=1)
    laid = np.concatenate([triangles[~seam], back + n, back + n + len(used)])
    camera = Camera(AROUND, rows, (1.0, 1.0), (AROUND / 2 + 0.5, rows - 0.5))
    depth = depths(points, laid, camera)[::-1].T.astype(np.float64)
    return np.where(np.isfinite(depth), depth, np.nan)


def _filled(table: NDArray) -> NDArray[np.float64]:
    """(a, r) a table with its gaps closed: around the head, and beyond the last row."""
    out = table.copy()
    position = np.arange(-AROUND, 2 * AROUND)
    for row, finite in zip(out.T, np.isfinite(out).T, strict=True):
        count = np.count_nonzero(finite)
        if 3 * count < AROUND:  # less than a third is no outline
            row[:] = np.nan
        elif count < AROUND:
            known = np.flatnonzero(np.concatenate([finite] * 3))
            closed = np.interp(position, position[known], np.concatenate([row[finite]] * 3))
            row[:] = closed[AROUND : 2 * AROUND]
    whole = np.flatnonzero(np.isfinite(out).all(axis=0))
    nearest = whole[np.abs(np.arange(out.shape[1])[:, None] - whole).argmin(axis=1)]
    return out[:, nearest]


def _softly_over(table: NDArray) -> NDArray[np.float64]:
    """(a, r) what lies over a table as hair lies over an ear."""
    over = maximum_filter1d(table, 3, axis=0, mode="wrap")
    over = maximum_filter1d(over, 3, axis=1, mode="nearest")
    over = gaussian_filter1d(over, 1.5, axis=0, mode="wrap")
    return np.maximum(gaussian_filter1d(over, 1.0, axis=1, mode="nearest"), table)


def _sampled(table: NDArray, azimuth: NDArray, row: NDArray) -> NDArray[np.float64]:
    """(...) a table (a, r) between its places: the azimuth wraps, rows end."""
    column = azimuth * AROUND / (2 * np.pi) + AROUND / 2
    left = np.floor(column)
    low = np.clip(np.floor(row), 0, table.shape[1] - 2)
    across, up = column - left, np.clip(row - low, 0, 1)
    i, j = left.astype(np.intp) % AROUND, low.astype(np.intp)
    k = (i + 1) % AROUND
    lower = table[i, j] * (1 - across) + table[k, j] * across
    upper = table[i, j + 1] * (1 - across) + table[k, j + 1] * across
    return lower * (1 - up) + upper * up
