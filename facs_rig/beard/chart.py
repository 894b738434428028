"""Where a beard can grow: a chart of the lower face, and the places of single hairs on it.

A place has two coordinates that are the same on everybody: how far along the jaw it is nearest to,
from the chin to the ear, and how far up the face from the jaw, or down under it. They are measured
on the default face, and go with its skin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..anatomy import LANDMARKS
from ..common.derived import derived
from ..mesh import vertex_normals
from ..paint import MATERIAL_NAMES, materials_at
from ..rig import FaceRig, landmark_points
from .lip import SPREAD, lip_places, moustache_at, rim_of

COLUMNS, ROWS = 12, 18
ALONG: NDArray[np.float64] = np.linspace(0, 1, COLUMNS)
"""Shares of the jaw, from the chin to the ear."""
UP: NDArray[np.float64] = np.linspace(-0.042, 0.076, ROWS)
"""Metres on the default face from the jaw, up the face and (less than none) under it."""
ROOTS, DENSER = 9_000, 1_400
"""Places where a hair may grow, and more of them between nose and lip."""
LIPS = 0.0028
"""Metres beside the red of the lips and beside nose and ears where no hair grows."""
BEYOND = 0.004
"""Metres that what grows over the mouth goes on beside its corners."""
JAW = ("chin", *(f"jawline_{k}_left" for k in range(8, 0, -1)))
COMBED = ((0.0, 0.3), (0.3, 0.55), (0.7, 0.9), (1.0, 1.05), (1.3, 0.9))
"""Halves of the mouth's width from the middle, and radians that hair over it leans aside."""
ALONG_RIM = (65, 0.0045)
"""Degrees that it does so close to the lip, along which it lies, and metres over that to which."""
APART = 0.014
"""Metres from a hair to the three vertices that say how its skin is turned."""


@dataclass(frozen=True, eq=False)
class Chart:
    """The skin of the lower face.

    vertices : (m,) int, of the rig, where hair can grow
    place : (m, 2) share along the jaw and metres up from it
    normal, flow : (m, 3) unit, on the default face: out of the skin, and the way that hair lies
    """

    vertices: NDArray[np.intp]
    place: NDArray[np.float64]
    normal: NDArray[np.float64]
    flow: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Roots:
    """Places where hairs may grow, evenly spread; so is every first part of ROOTS, and of what
    follows, which is over the mouth.

    index, weight : (r, 3) vertices of the rig, and their weights
    anchors : (r, 3) vertices around each, by which the skin's turning is told
    place : (r, 2) on the chart
    across : (r,) metres on the default face from its middle, more than none to its left
    above : (r,) bool, over the mouth;  lip : (r, 3) see lip.lip_places
    """

    index: NDArray[np.int32]
    weight: NDArray[np.float64]
    anchors: NDArray[np.int32]
    place: NDArray[np.float64]
    across: NDArray[np.float64]
    above: NDArray[np.bool_]
    lip: NDArray[np.float64]


def weights_at(place: NDArray) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """(k, 4) cells of a flat (COLUMNS, ROWS) table and their weights at places (k, 2); beyond the
    chart as at its edge."""
    steps = np.array([ALONG[1] - ALONG[0], UP[1] - UP[0]])
    at = np.clip((place - (ALONG[0], UP[0])) / steps, 0, (COLUMNS - 1, ROWS - 1))
    low = np.minimum(at.astype(np.intp), (COLUMNS - 2, ROWS - 2))
    a, b = (at - low).T
    cells = low[:, 0] * ROWS + low[:, 1]
    weight = np.stack([(1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b], axis=1)
    return cells[:, None] + np.array([0, 1, ROWS, ROWS + 1]), weight


def on_chart(table: NDArray, place: NDArray) -> NDArray[np.float64]:
    """(k,) values of a table (COLUMNS, ROWS) at places (k, 2)."""
    cells, weight = weights_at(place)
    return (np.asarray(table, float).ravel()[cells] * weight).sum(axis=1)


@derived
def chart_of(rig: FaceRig) -> Chart:
    """The chart of a full rig, worked out once."""
    rest = np.asarray(rig.neutral(), float)
    normals = np.asarray(vertex_normals(rig.neutral(), rig.triangles, rig.corners), float)
    mark = landmark_points(rig, rest)
    near = _lower_face(rig, rest, mark)
    points = rest[near] * np.where(rest[near, :1] < 0, (-1, 1, 1), (1, 1, 1))  # as if on the left
    along, up = _from_jaw(points, mark, normals[[rig.landmarks[LANDMARKS.index(n)] for n in JAW]])
    kept = (up > UP[0] - 0.002) & (up < UP[-1] + 0.004)
    kept &= ~_is_ear(points, mark)
    near, along, up = near[kept], along[kept], up[kept]
    flow = _flow(rest[near], normals[near], up, rim_of(rig, rest), mark)
    return Chart(near, np.stack([along, up], axis=1), normals[near], flow)


def _lower_face(rig: FaceRig, rest: NDArray, mark: dict[str, NDArray]) -> NDArray[np.intp]:
    """Vertices of the plain skin around the chin, without lips, nose and what they hide."""
    eyes = mark["pupil_left"][1] - 0.012
    low = rig.parts["skin"] & (rest[:, 1] < eyes) & (rest[:, 2] > -0.02)
    lower = np.flatnonzero(low & (rest[:, 1] > mark["chin"][1] - 0.06))
    material = materials_at(rig, rest[lower], rig.vertex_part[lower])
    free = lower[material == MATERIAL_NAMES.index("skin")]
    red = lower[material == MATERIAL_NAMES.index("lips")]
    ring = free[_within(rest[free], rest[red].min(axis=0) - LIPS, rest[red].max(axis=0) + LIPS)]
    away = cKDTree(rest[red]).query(rest[ring], distance_upper_bound=LIPS)[0]
    plain = np.zeros(len(rest), dtype=bool)
    plain[free] = True
    plain[ring[away < LIPS]] = False
    base, wing = mark["nose_base"], mark["nose_wing_left"]
    nose = (np.abs(rest[:, 0]) < wing[0] + LIPS) & (rest[:, 2] > wing[2] - 0.012)
    plain &= ~(nose & (rest[:, 1] > base[1] - 0.7 * LIPS))
    number = np.full(len(rest), -1)
    here = np.flatnonzero(plain)
    number[here] = np.arange(len(here))
    rows = number[rig.triangles]
    rows = rows[(rows >= 0).all(axis=1)]
    pairs = np.concatenate([rows[:, :2], rows[:, 1:]])
    links = csr_matrix((np.ones(len(pairs)), pairs.T), shape=(len(here),) * 2)
    piece = connected_components(links, directed=False)[1]
    return here[piece == piece[number[rig.landmarks[LANDMARKS.index("chin")]]]]


def _within(points: NDArray, low: NDArray, high: NDArray) -> NDArray[np.bool_]:
    """(k,) which points lie in a box."""
    return ((points > low) & (points < high)).all(axis=1)


def _from_jaw(
    points: NDArray, mark: dict[str, NDArray], normals: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m,) share along the jaw and (m,) metres up from it. normals : (9, 3) of the skin at JAW"""
    line = np.stack([mark[name] for name in JAW]) * np.where(
        np.arange(9)[:, None] == 0, (0, 1, 1), 1
    )
    size = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    fine = np.linspace(0, size[-1], 200)
    jaw = np.stack([np.interp(fine, size, line[:, k]) for k in range(3)], axis=1)
    out = np.stack([np.interp(fine, size, normals[:, k]) for k in range(3)], axis=1)
    out[:10, 0] = np.minimum(out[:10, 0], 0.1)
    across = np.cross(out, np.gradient(jaw, axis=0))
    away, nearest = cKDTree(jaw).query(points)
    side = np.einsum("kc,kc->k", points - jaw[nearest], across[nearest])
    return fine[nearest] / size[-1], np.where(side < 0, -away, away)


def _is_ear(points: NDArray, mark: dict[str, NDArray]) -> NDArray[np.bool_]:
    """(m,) what lies behind the line of the jaw, up where the ear is."""
    line = np.stack([mark[name] for name in JAW[::-1]])[:5]
    behind = np.interp(-points[:, 1], -line[:, 1], line[:, 2])
    return (points[:, 1] > line[-1, 1]) & (points[:, 2] < behind + LIPS)


def _flow(
    rest: NDArray, normal: NDArray, up: NDArray, rim: NDArray, mark: dict[str, NDArray]
) -> NDArray[np.float64]:
    """(m, 3) unit, the way of hair along the skin: down, away from the middle over the mouth, the
    more so the nearer to the lip, and forward under the jaw."""
    corner, place = mark["mouth_corner_left"], lip_places(rest, rim, mark)
    over = np.clip((rest[:, 1] - corner[1] + 0.002) / 0.004, 0, 1)
    over *= np.clip((corner[0] + 0.016 - np.abs(rest[:, 0])) / 0.014, 0, 1)
    under = np.clip(-up / 0.03, 0, 1)
    lean = np.interp(place[:, 0], *np.array(COMBED).T)
    lean = lean + np.clip(1 - place[:, 1] / ALONG_RIM[1], 0, 1) * np.clip(
        np.radians(ALONG_RIM[0]) - lean, 0, None
    ) * np.clip(place[:, 0] / 0.3, 0, 1)
    side = np.tanh(rest[:, 0] / 0.002)
    aside = np.sin(lean) * over * side - 0.15 * np.tanh(rest[:, 0] / 0.02) * (1 - over)
    down = 1 - over * (1 - np.cos(lean))
    way = np.stack([aside, -down, 0.5 * under], axis=1)
    way -= np.einsum("kc,kc->k", way, normal)[:, None] * normal
    return way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)


@derived
def roots_of(rig: FaceRig) -> Roots:
    """The places of hairs on a full rig, worked out once.

    Triangles in the order of a space-filling curve (Morton 1966) laid end to end by their areas,
    and places on that line by multiples of the golden ratio: whatever number of them, they are
    spread evenly.
    """
    chart = chart_of(rig)
    rest = np.asarray(rig.neutral(), float)
    number = np.full(rig.n_vertices, -1)
    number[chart.vertices] = np.arange(len(chart.vertices))
    rows = rig.triangles[(number[rig.triangles] >= 0).all(axis=1)]
    mark = landmark_points(rig, rest)
    middle = rest[rows].mean(axis=1)
    band = (moustache_at(lip_places(middle, rim_of(rig, rest), mark), 1.1 * SPREAD, 1.0) > 0) & (
        _over_mouth(middle, mark) | (np.abs(middle[:, 0]) > mark["mouth_corner_left"][0] + BEYOND)
    )
    rng = np.random.default_rng(0)
    every, more = _spread(rest, rows, ROOTS, rng), _spread(rest, rows[band], DENSER, rng)
    index, weight = (np.concatenate(both) for both in zip(every, more, strict=True))
    own = number[index]
    place = np.einsum("kc,kcd->kd", weight, chart.place[own])
    at = np.einsum("kc,kcd->kd", weight, rest[index])
    above = _over_mouth(at, mark)
    anchors = _anchors(at, chart.normal[own[:, 0]], above, chart.vertices, rest, mark)
    lip = lip_places(at, rim_of(rig, rest), mark)
    return Roots(index.astype(np.int32), weight, anchors, place, at[:, 0], above, lip)


def _spread(
    rest: NDArray, rows: NDArray, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """(count, 3) vertices and weights of places all over triangles (t, 3)."""
    a, b, c = (rest[rows[:, k]] for k in range(3))
    order = np.argsort(_morton((a + b + c) / 3), kind="stable")
    rows, area = rows[order], np.linalg.norm(np.cross(b - a, c - a), axis=1)[order]
    reach = np.cumsum(area)
    golden, k = (np.sqrt(5) - 1) / 2, np.arange(count)
    triangle = np.minimum(np.searchsorted(reach, (0.5 + k * golden) % 1 * reach[-1]), len(rows) - 1)
    p, q = rng.uniform(0, 1, (2, count))
    p, q = np.where(p + q > 1, 1 - p, p), np.where(p + q > 1, 1 - q, q)
    return rows[triangle], np.stack([1 - p - q, p, q], axis=1)


def _over_mouth(points: NDArray, mark: dict[str, NDArray]) -> NDArray[np.bool_]:
    """(k,) which points of the default face lie over the line of the mouth, no farther out."""
    corner, middle = mark["mouth_corner_left"], mark["lip_inner_top"]
    away = np.abs(points[:, 0])
    line = np.interp(away, [0, corner[0]], [middle[1], corner[1]])
    return (points[:, 1] > line) & (away < corner[0] + BEYOND)


def _anchors(
    at: NDArray, normal: NDArray, above: NDArray, vertices: NDArray, rest: NDArray,
    mark: dict[str, NDArray],
) -> NDArray[np.int32]:  # fmt: skip
    """(k, 3) vertices around places, none of them across the mouth's opening."""
    one = np.cross(normal, (0.3, 1.0, 0.2))
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    two = np.cross(normal, one)
    turn = np.radians([90, 210, 330])
    wanted = at[:, None] + APART * (
        np.cos(turn)[:, None] * one[:, None] + np.sin(turn)[:, None] * two[:, None]
    )
    out = np.empty((len(at), 3), np.int32)
    beside = np.abs(rest[vertices, 0]) > mark["mouth_corner_left"][0] + 0.004
    over = _over_mouth(rest[vertices], mark)
    for side in (False, True):
        allowed = vertices[(over == side) | beside]
        mine = above == side
        out[mine] = allowed[cKDTree(rest[allowed]).query(wanted[mine])[1]]
    return out


def _morton(points: NDArray) -> NDArray[np.int64]:
    """(k,) numbers of points (k, 3) along a space-filling curve: the bits of cells, interleaved."""
    low = points.min(axis=0)
    cells = ((points - low) / np.ptp(points, axis=0).max() * 1023).astype(np.int64)
    out = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            out |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return out
