"""The hairs of a beard: narrow ribbons that taper, each grown from its own place on the skin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..mesh import vertex_normals
from ..rig import FaceRig, landmark_points
from .beard import Beard
from .chart import ROOTS, Roots, chart_of, on_chart, roots_of
from .growth import growth
from .lip import rim_of

SHORT = 0.006
"""Metres up to which hairs are straight blades of one triangle: stubble."""
STEPS = ((0.006, 1), (0.03, 3), (np.inf, 5))
"""Quads along hairs that are at most so long, metres."""
WIDE = (
    (0.0, 0.0005),
    (0.003, 0.0006),
    (0.008, 0.0014),
    (0.02, 0.002),
    (0.06, 0.0035),
    (0.2, 0.006),
)
"""Length and width of a hair, metres, of a beard of USUAL triangles: of fewer they are wider."""
USUAL, WIDER = 9_000, (0.8, 1.5)
DENSE = 0.4
"""How much denser hairs are where they are shorter: 0 not, 1 so that they cover the same."""
BUSHY, LEAST_WIDE = 0.25, 0.2
"""Share of the triangles that a moustache may have in any case, and share of the widest hair's
width that all have."""
STANDS = ((0.0, 0.6), (0.006, 0.5), (0.02, 0.45), (0.08, 0.3))
"""Length, and radians that hairs stand off the skin at the root."""
FREE = 0.0004
"""Metres that a hair keeps off the skin at least."""
TIPS, PAST = 0.0006, 0.002
"""Metres over the upper lip's rim at which a moustache ends, and past the corner to which."""
POINT, PAST_CORNER = (0.85, 0.5), (0.9, 1.15)
"""The way aside and down of a moustache's ends, and halves of the mouth's width between which its
hairs come to go that way."""
ASKEW = 0.5
"""Radians that a moustache's hairs lean otherwise than usual at most."""
FLAT = 0.7
"""How far a moustache's hairs stand off, as a share of what a beard's do."""
ARCHED = 0.8
"""How far hairs stand off more at the root than farther on, as a share of the mean."""
LOCKS = 9
"""Hairs to a lock of a long beard."""
BOTH = 0.003
"""Metres from the middle within which the ways that hairs lean on both sides are mixed."""
HANGS = (0.012, 0.05)
"""Length between which hairs begin to hang down rather than lie, and to keep upright with the
head."""


@dataclass(frozen=True, eq=False)
class Hairs:
    """Ribbons on a face.

    points : (n, 3) metres;  root : (n,) of which root each is;  uv : (n, 2);  tone : (n,) -1..1
    quads : (q, 4), a triangle has its last corner twice
    index, weight, anchors : (r, 3) of the roots, see chart.Roots;  stiffness : (r,) see follow
    """

    points: NDArray[np.float64]
    root: NDArray[np.intp]
    uv: NDArray[np.float64]
    tone: NDArray[np.float64]
    quads: NDArray[np.intp]
    index: NDArray[np.int32]
    weight: NDArray[np.float64]
    anchors: NDArray[np.int32]
    stiffness: NDArray[np.float64]


def hairs(rig: FaceRig, vertices: NDArray, beard: Beard, triangles: float) -> Hairs | None:
    """The hairs of a beard on an upright face at rest (v, 3), as many as there is room for where it
    covers all that it can; None where none grows."""
    roots = roots_of(rig)
    rng = np.random.default_rng(0)
    thin = rng.permutation(len(roots.place)) / len(roots.place)
    grown = growth(beard, roots.place, roots.lip, roots.above)
    cover, length, over = grown.cover, grown.length, grown.over
    longest = float(length[cover > 0.3].max(initial=0.0))
    steps = next(n for size, n in STEPS if longest <= size)
    lanes = 1 if longest <= SHORT else 2
    each = 1 if lanes == 1 else 2 * steps - 1
    kept = np.flatnonzero((cover > 0.2 + 0.6 * thin) & (length > 0.0004))
    if lanes == 1:
        kept = kept[kept < ROOTS]  # stubble is as dense everywhere
    kept = _room_for(kept, over, length, max(int(triangles // each), 1))
    if not len(kept):
        return None
    length, over = length[kept], over[kept]
    spread = rng.uniform(-1, 1, (3, len(roots.place)))[:, kept]
    length = length * (1 + 0.25 * spread[0])
    base, out, flow = frames(rig, vertices, roots, kept)
    flow = _pointed(flow, out, base, np.where(over, roots.lip[kept, 0], 0))
    if beard.lean.any():
        turn = _leans(beard, roots, kept)[:, None]
        turn = np.where(over[:, None], np.clip(turn, -ASKEW, ASKEW), turn)
        flow = np.cos(turn) * flow + np.sin(turn) * np.cross(out, flow)
    middle = _paths(base, out, flow, length, steps, beard, spread, over)
    middle = _off_the_lips(rig, vertices, middle, over)
    middle = _off_the_skin(rig, vertices, middle)
    wider = float(np.clip(np.sqrt(USUAL / max(triangles, 1)), *WIDER))
    return _ribbons(middle, out, length, wider, lanes, roots, kept, rng)


def _room_for(
    kept: NDArray, over: NDArray, length: NDArray, count: int
) -> NDArray[np.intp]:  # fmt: skip
    """As many of some roots as there is room for: moustache and beard each evenly, but the shorter
    hairs are, the denser, so that they cover as much."""
    mine, others = kept[over[kept]], kept[~over[kept]]
    few = min(len(mine), max(round(BUSHY * count), count - len(others)))
    dense = np.maximum(length[others], SHORT) ** -DENSE
    first = np.argsort(np.arange(len(others)) / dense, kind="stable")[: count - few]
    return np.sort(np.concatenate([mine[:few], others[first]]))


def _pointed(flow: NDArray, out: NDArray, base: NDArray, across: NDArray) -> NDArray[np.float64]:
    """The ways of hairs (k, 3), those past the mouth's corners turned along a moustache's ends.

    across : (k,) halves of the mouth's width from the middle, 0 of what is no moustache
    """
    way = np.where(base[:, :1] < 0, -1, 1) * np.array([POINT[0], 0, 0]) - [0, POINT[1], 0]
    way = way - np.einsum("kd,kd->k", way, out)[:, None] * out
    share = np.clip((across - PAST_CORNER[0]) / (PAST_CORNER[1] - PAST_CORNER[0]), 0, 1)[:, None]
    return _unit((1 - share) * flow + share * _unit(way))


def _leans(beard: Beard, roots: Roots, kept: NDArray) -> NDArray[np.float64]:
    """(k,) radians by which hairs at roots turn to the face's left from where they lie."""
    left, right = (on_chart(side, roots.place[kept]) for side in beard.lean)
    share = 0.5 + 0.5 * np.tanh(roots.across[kept] / BOTH)
    return share * left - (1 - share) * right


def rise_of(length: NDArray) -> NDArray[np.float64]:
    """Radians that hairs of a length, metres, stand off the skin at the root."""
    return np.interp(length, *np.array(STANDS).T)


def frames(
    rig: FaceRig, vertices: NDArray, roots: Roots, kept: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Places of roots (k,) on an upright face at rest (v, 3), metres, the ways out of the skin
    there, and along it as hair lies of itself, (k, 3) each."""
    chart = chart_of(rig)
    normals = np.zeros((rig.n_vertices, 3))
    flow = np.zeros((rig.n_vertices, 3))
    every = np.asarray(vertex_normals(vertices.astype(np.float32), rig.triangles, rig.corners))
    normals[chart.vertices] = every[chart.vertices]
    flow[chart.vertices] = chart.flow
    index, weight = roots.index[kept], roots.weight[kept]
    base, out, way = (
        np.einsum("kc,kcd->kd", weight, table[index]) for table in (vertices, normals, flow)
    )
    out = _unit(out)
    way = way - np.einsum("kd,kd->k", way, out)[:, None] * out
    return base, out, _unit(way)


def _paths(
    base: NDArray, out: NDArray, flow: NDArray, length: NDArray, steps: int, beard: Beard,
    spread: NDArray, over: NDArray,
) -> NDArray[np.float64]:  # fmt: skip
    """(k, steps + 1, 3) the middles of hairs: off the skin at a slant, then along it and down, in
    locks. over : (k,) which are moustache"""
    aside = np.cross(out, flow)
    lean = 0.25 * spread[1][:, None]
    first = flow * np.cos(lean) + aside * np.sin(lean)
    rise = (rise_of(length) * (1 + 0.35 * spread[2]) * np.where(over, FLAT, 1))[:, None]
    hang = beard.fall * np.clip((length - HANGS[0]) / (HANGS[1] - HANGS[0]), 0, 1)
    hang = np.where(over, 0.5 * hang, hang)[:, None]
    inward = -0.9 * np.clip(length / 0.1, 0.3, 1) * base[:, 0] / 0.06
    down = _unit(np.stack([inward, -np.ones(len(base)), np.full(len(base), 0.12)], axis=1))
    t = np.linspace(0, 1, steps + 1)
    path = [base - FREE * out]
    for k in range(1, steps + 1):
        there = (t[k] + t[k - 1]) / 2
        stands = rise * (1 + ARCHED * (1 - 2 * there))
        share = hang * np.clip(2.2 * there, 0, 1)
        way = np.cos(stands) * first + np.sin(stands) * out
        way = _unit((1 - share) * way + share * down)
        path.append(path[-1] + (length / steps)[:, None] * way)
    middle = np.stack(path, axis=1)
    if steps > 1:
        middle = _locked(middle, length, beard, t)
    return middle


def _locked(middle: NDArray, length: NDArray, beard: Beard, t: NDArray) -> NDArray[np.float64]:
    """Hairs that lean together toward their tips, and curl."""
    guides = np.arange(0, max(len(middle) // LOCKS, 1))  # roots in their order are spread evenly
    own = cKDTree(middle[guides, 0]).query(middle[:, 0])[1]
    pull = (0.55 * np.clip(length / 0.03, 0, 1))[:, None] * t**1.5
    middle = middle + pull[..., None] * (middle[guides][own] - middle) * np.array([1, 0.4, 1])
    if beard.curl:
        phase = (
            2 * np.pi * (own * 0.618 % 1)[:, None] + 2.5 * 2 * np.pi * t * (length / 0.03)[:, None]
        )
        size = beard.curl * 0.12 * np.minimum(length, 0.03)[:, None] * t
        middle = middle + np.stack([size * np.cos(phase), 0 * phase, size * np.sin(phase)], axis=2)
    return middle


def _off_the_lips(
    rig: FaceRig, vertices: NDArray, middle: NDArray, over: NDArray
) -> NDArray[np.float64]:
    """The same hairs, those of a moustache cut where they would come over the upper lip's rim."""
    mark = landmark_points(rig, vertices)
    rim, corner = rim_of(rig, vertices), mark["mouth_corner_left"]
    mine = np.flatnonzero(over)
    hair = middle[mine]
    away = np.abs(hair[..., 0])
    up = hair[..., 1] - np.interp(away, *rim.T) - TIPS
    up = np.where(away < corner[0] + PAST, up, 1.0)
    up[:, 0] = np.maximum(up[:, 0], 1e-6)
    steps = hair.shape[1] - 1
    low = (up < 0).any(axis=1)
    last = np.where(low, (up < 0).argmax(axis=1), steps)
    row = np.arange(len(mine))
    before, after = up[row, last - 1], up[row, last]
    far = np.where(low, last - 1 + before / np.maximum(before - after, 1e-9), steps)
    place = np.linspace(0, 1, steps + 1) * np.maximum(far, 0.2)[:, None]
    first = np.minimum(place.astype(np.intp), steps - 1)
    share = (place - first)[..., None]
    out = middle.copy()
    out[mine] = (1 - share) * hair[row[:, None], first] + share * hair[row[:, None], first + 1]
    return out


def _off_the_skin(rig: FaceRig, vertices: NDArray, middle: NDArray) -> NDArray[np.float64]:
    """The same hairs, what of them went under the skin lifted out of it."""
    near = _surroundings(rig)
    normals = vertex_normals(vertices.astype(np.float32), rig.triangles, rig.corners)[near]
    skin = vertices[near]
    flat = middle[:, 1:].reshape(-1, 3)
    nearest = cKDTree(skin).query(flat)[1]
    depth = np.einsum("kd,kd->k", flat - skin[nearest], normals[nearest])
    lift = np.clip(FREE - depth, 0, 0.02)
    middle = middle.copy()
    middle[:, 1:] += (lift[:, None] * normals[nearest]).reshape(middle[:, 1:].shape)
    return middle


def _surroundings(rig: FaceRig) -> NDArray[np.intp]:
    """Every third vertex of the skin that hairs may touch."""
    return chart_of(rig).vertices[::3]


def _ribbons(
    middle: NDArray, out: NDArray, length: NDArray, wider: float, lanes: int, roots: Roots,
    kept: NDArray, rng: np.random.Generator,
) -> Hairs:  # fmt: skip
    count, knots = middle.shape[:2]
    along = _unit(np.gradient(middle, axis=1))
    aside = _unit(np.cross(along, out[:, None] + 0 * along))
    t = np.linspace(0, 1, knots)
    width = np.interp([length, length.max() + 0 * length], *np.array(WIDE).T)
    width = np.maximum(width[0], LEAST_WIDE * width[1]) * rng.uniform(0.7, 1.3, count)
    number = np.arange(count)
    if lanes == 1:  # one triangle: two corners at the root and one at the tip
        half = 0.5 * width[:, None] * aside[:, 0]
        points = np.stack([middle[:, 0] - half, middle[:, 0] + half, middle[:, -1]], axis=1)
        uv = np.tile([(0.0, 0.0), (1.0, 0.0), (0.5, 1.0)], (count, 1))
        quads = 3 * number[:, None] + np.array([0, 1, 2, 2])
        size = 3
    else:
        taper = np.minimum(0.55 + 2 * t, 1) * (1 - t**2.2)
        half = 0.5 * (wider * width[:, None] * taper)[..., None] * aside
        sides = np.stack([middle - half, middle + half], axis=2)[:, :-1].reshape(count, -1, 3)
        points = np.concatenate([sides, middle[:, -1:]], axis=1)  # they end in a point
        size = 2 * knots - 1
        across = np.append(np.tile([0.0, 1.0], knots - 1), 0.5)
        uv = np.tile(np.stack([across, np.append(np.repeat(t[:-1], 2), 1.0)], axis=1), (count, 1))
        step = 2 * np.arange(knots - 1)[:, None] + np.array([0, 1, 3, 2])
        step[-1] = [size - 3, size - 2, size - 1, size - 1]
        quads = (size * number[:, None, None] + step).reshape(-1, 4)
    stiff = 0.75 * np.clip((length - HANGS[0]) / (HANGS[1] - HANGS[0]), 0, 1)
    tone = np.clip(rng.normal(0, 0.45, count), -1, 1)
    return Hairs(
        points.reshape(-1, 3), np.repeat(number, size), uv, np.repeat(tone, size), quads,
        roots.index[kept], roots.weight[kept], roots.anchors[kept], stiff,
    )  # fmt: skip


def _unit(vectors: NDArray) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
