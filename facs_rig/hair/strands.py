"""Strands: thin curves that grow from the scalp and lie in a head of hair, to be groomed.

Each begins on the skin, rises into the hair's thickness and follows the columns of the shell down
to its edge, or above a bare forehead up from it, so that all of them together look like the cut.
Neighbours go together in clumps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..common.derived import derived
from ..common.errors import InputError
from ..rig import FaceRig
from ..subdivide import triangulate
from .cut import Cut
from .head import EAR_MOVES, WIDEST, head_of
from .locks import BEYOND, LENGTH, PITCH, SHORTER, _at, _bent, _grows, _unit, standing
from .presets import HAIRLINE
from .shell import Shell, edge_heights

FEWEST, MOST = 2_000, 8_000  # strands at detail 0 and 1
POINTS = (6, 12)  # of a straight strand at detail 0 and 1
A_TURN = 5  # points of a turn of a curl
RADIUS = (0.00042, 0.00006)  # metres at the root and at the tip, at detail 0.5
NEAR = 0.004  # metres from the shell within which the scalp has hair
RISES = (0.02, 1.5)  # metres, and shares of the hair's thickness, in which strands leave the skin
RISEN = 0.6  # share of its length in which a strand has left it at the latest
LAYERS = (0.35, 1.0)  # share of the thickness at which strands lie: what roots low lies low
CLUMP = 10  # strands that go together
DRAWN = 0.7  # share of the way to the middle of its clump that a tip is drawn
APART_WAYS = 1.0  # metres, more than a head: strands do not go with those that run the other way
APART = 4  # columns beyond which a strand does not go with its clump
OFF = 0.0012  # metres that the topmost strands rise over the shell
BACK = 0.03  # metres from the parting that a strand has at least which runs up to it
FINE = (3, 4)  # places looked up between two columns, two rows


@dataclass(frozen=True)
class Strands:
    """Hair as curves, upright in the frame of the rig; n may be 0.

    points : (n, k, 3) float32, metres, from the root, which lies on the skin, to the tip
    radius : (n, k) float32, metres
    tone : (n,) float32, -1..1: darker or lighter than the hair
    uv : (n, 2) float32, where the root lies on the face's texture
    """

    points: NDArray[np.float32]
    radius: NDArray[np.float32]
    tone: NDArray[np.float32]
    uv: NDArray[np.float32]


def grow(
    rig: FaceRig,
    identity: Mapping[str, float] | None,
    cut: Cut,
    shell: Shell,
    rng: np.random.Generator,
    detail: float = 0.5,
) -> Strands:
    """Strands that lie in the shell of a person's cut: on a full head of straight hair 2,000 at
    detail 0, 8,000 at 1, of curls twice as many.

    Plaits have none, as they have no locks. InputError for a detail out of range.
    """
    if not 0 <= detail <= 1:
        raise InputError(f"the detail of hair must be from 0 to 1, got {detail}")
    count = round((1 + cut.curl) * (FEWEST + detail * (MOST - FEWEST)))
    points = round(POINTS[0] + detail * (POINTS[1] - POINTS[0]))
    length = LENGTH[int(cut.hangs)] * (1 - 0.6 * cut.curl) * (1 - SHORTER * cut.stand)
    if cut.curl:
        points = max(points, min(round(A_TURN * cut.curl * length / PITCH), 2 * POINTS[1]))
    corners, uv = _scalp(rig)
    skin = rig.neutral(identity)
    roots, places = _scattered(skin[corners], uv, rng, count)
    tails = [
        shell.points[ring.T].astype(np.float64)
        for ring, ball in zip(shell.tails, cut.balls, strict=True)
        if not ball.plait
    ]
    heads = _on_the_head(cut, shell, roots, places, rng, points, length)
    parts = [heads, *(_in_a_tail(tail, roots, places, rng, count // 6, points) for tail in tails)]
    thin = np.sqrt(0.5 * (FEWEST + MOST) / count)
    every = Strands(*(np.concatenate([part[k] for part in parts]) for k in range(4)))
    return Strands(
        every.points.astype(np.float32), (thin * every.radius).astype(np.float32),
        every.tone.astype(np.float32), every.uv.astype(np.float32),
    )  # fmt: skip


@derived
def _scalp(rig: FaceRig) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Triangles (t, 3) of the skin that hair grows on, and their places (t, 3, 2) on the texture:
    what lies above the usual hairline and is no ear. Of the full face those of the medium level."""
    texture = rig.texture
    places = texture.corners[rig.triangle_corners]
    if rig.level == "full":
        places = triangulate(*rig.lighter["medium"])
    corners = texture.vertices[places]
    rest, head = rig.neutral(), head_of(rig)
    ears = np.linalg.norm(rig.neutral({"ear_wing": 1.0}) - rest, axis=1) > EAR_MOVES
    middle = rest[corners].mean(axis=1)
    turn = np.degrees(np.arctan2(middle[:, 0] - head.middle[0], middle[:, 2] - head.middle[2]))
    line = np.interp(np.abs(turn), *np.array(HAIRLINE).T)
    grows = head.height(middle[:, 1] - head.eyes[1]) > line
    grows &= rig.parts["skin"][corners].all(axis=1) & ~ears[corners].any(axis=1)
    # Inside the head there is skin, too: the mouth's.
    grows &= np.linalg.norm(middle - head.middle, axis=1) > 0.6 * (head.above - WIDEST * head.above)
    return corners[grows].astype(np.int32), texture.points[places[grows]].astype(np.float64)


def _scattered(
    triangles: NDArray, uv: NDArray, rng: np.random.Generator, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (count, 3) evenly on triangles (t, 3, 3), in random order, and their uv (count, 2)."""
    a, b, c = (triangles[:, k].astype(np.float64) for k in range(3))
    reach = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    want = (np.arange(count) + rng.uniform(0, 1, count)) / count * reach[-1]
    on = rng.permutation(np.clip(np.searchsorted(reach, want, side="right"), 0, len(reach) - 1))
    s, t = np.sqrt(rng.uniform(0, 1, count)), rng.uniform(0, 1, count)
    weight = np.stack([1 - s, s * (1 - t), s * t], axis=-1)
    return tuple(np.einsum("nk,nkd->nd", weight, of[on]) for of in (triangles, uv))


def _on_the_head(
    cut: Cut, shell: Shell, roots: NDArray, uv: NDArray, rng: np.random.Generator, points: int,
    length: float,
) -> tuple[NDArray, ...]:  # fmt: skip
    """Points, radii, tones and uv of strands that root where the shell lies on the skin.

    points : of each      length : metres of a strand that lies
    """
    inner, outer = (shell.points[at].astype(np.float64) for at in (shell.inner, shell.outer))
    place, far = _places(inner, roots)
    grown = far < NEAR
    roots, uv, place = roots[grown], uv[grown], place[grown]
    n = len(place)
    if not n:
        return _none(points)
    columns, rows = inner.shape[:2]
    along = np.gradient(outer, axis=1)
    across = (np.roll(outer, -1, axis=0) - np.roll(outer, 1, axis=0)) / 2
    metres = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 5e-4)
    wide = np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 5e-4)
    way = np.cumsum(metres, axis=1) - metres[:, :1]  # from the parting

    column = np.rint(place[:, 0]).astype(np.intp) % columns
    falls = (cut.hangs & (edge_heights(cut, shell.azimuth) < WIDEST))[column]
    past = rng.uniform(-0.5, 1, n) * np.where(falls, BEYOND[1], BEYOND[0])
    gone = _at(way, place)[:, 0]
    back = (rng.uniform(0, 1, n) < _grows(cut, shell.azimuth)[column]) & (gone > BACK)
    whole = np.where(back, gone, way[column, -1, 0] + past - gone)
    short = np.minimum(length * rng.uniform(0.6, 1.2, n), whole)
    length_of = np.maximum(np.where(falls, whole, short), 0.004)

    # Clumps: strands go with the nearest of the first few.
    guides = max(n // CLUMP, 1)
    # Those that run up to the parting have guides that do.
    ways = np.column_stack([roots, np.where(back, APART_WAYS, 0)])
    clump = cKDTree(ways[:guides]).query(ways)[1]
    lean = rng.normal(0, 0.07 + 0.35 * cut.curl, guides)[clump]
    step = np.where(back, -1, 1) * length_of / (points - 1)
    lean = lean + np.where(back, -(cut.sweep or 0.0), 0)
    path = _walked(place, step, lean, metres, wide, points)
    t = np.linspace(0, 1, points)
    over = path[clump, :, 0] - path[..., 0]
    over = (over + columns / 2) % columns - columns / 2
    over[np.abs(over) > APART] = 0  # across the parting, around the whorl
    path[..., 0] += DRAWN * t**1.5 * over

    # They leave the skin and rise to a layer of their own: what roots low lies low.
    low, high = _at(inner, path), _at(outer, path)
    thick = np.linalg.norm(high - low, axis=-1).max(axis=1)
    rise = np.minimum(RISES[0] + RISES[1] * thick, RISEN * length_of)
    risen = (1 - (1 - np.clip(length_of[:, None] * t / rise[:, None], 0, 1)) ** 2)[..., None]
    under = np.clip(place[:, 1] / (rows - 1), 0, 1)
    under = np.where(back, 1 - under, under) * rng.uniform(0.3, 1.6, n)
    layer = (LAYERS[1] - (LAYERS[1] - LAYERS[0]) * under)[:, None, None]
    up = _unit(_at(_unit(np.cross(along, across)), path))
    off = OFF * rng.uniform(0, 1, n)[:, None, None]
    middle = low + risen * (layer * (high - low) + off * up)
    middle = middle + (standing(cut, up) * t**1.5)[..., None] * up
    middle[:, 0] = roots

    # What waves and curls a clump has, its strands have.
    first = slice(guides)
    turned = _bent(
        middle[first], up[first], _at(way, path[first])[..., 0], path[first], shell.azimuth,
        cut, rng,
    )  # fmt: skip
    bend = turned - middle[first]
    bend[:, 0] = 0
    middle = middle + rng.uniform(0.8, 1.2, n)[:, None, None] * bend[clump]
    return middle, _radii(rng, n, points), _tones(rng, clump), uv


def _walked(
    place: NDArray, step: NDArray, lean: NDArray, metres: NDArray, wide: NDArray, points: int
) -> NDArray[np.float64]:
    """(n, points, 2) columns and rows down a shell from places (n, 2), by metres (n,) a step, up it
    where these are negative.

    lean : (n,) radians to the side      metres, wide : (c, r, 1) of a row, of a column
    """
    path = np.empty((len(place), points, 2))
    path[:, 0] = place
    last = metres.shape[1] - 1
    for k in range(1, points):
        at = path[:, k - 1]
        ahead, aside = step / _at(metres, at)[:, 0], lean * step / _at(wide, at)[:, 0]
        path[:, k, 0] = at[:, 0] + aside
        path[:, k, 1] = np.clip(at[:, 1] + ahead, 0, last + 2.0)
    return path


def _places(inner: NDArray, roots: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 2) columns and rows of the inner sheet (c, r, 3) over points (n, 3), and metres to it."""
    columns, rows = inner.shape[:2]
    grid = np.stack(np.meshgrid(
        np.arange(columns * FINE[0]) / FINE[0], np.arange((rows - 1) * FINE[1] + 1) / FINE[1],
        indexing="ij",
    ), axis=-1).reshape(-1, 2)  # fmt: skip
    far, near = cKDTree(_at(inner, grid)).query(roots)
    return grid[near], far


def _in_a_tail(
    tail: NDArray, roots: NDArray, uv: NDArray, rng: np.random.Generator, count: int, points: int
) -> tuple[NDArray, ...]:
    """The same of a tail (s, m, 3), its sides by its rings, gathered at its beginning."""
    if not len(roots) or not count:
        return _none(points)
    sides, rings = tail.shape[:2]
    middle = tail.mean(axis=0)
    near = cKDTree(roots).query(middle[0], min(40, len(roots)))[1]
    root = rng.choice(np.atleast_1d(near), count)
    t = np.linspace(0, 1, points)
    ends = rng.uniform(0.8, 1.02, count)
    path = np.empty((count, points, 2))
    path[..., 0] = (rng.uniform(0, sides, count))[:, None] + rng.normal(0, 0.3, count)[:, None] * t
    path[..., 1] = ends[:, None] * t * (rings - 1)
    out = np.sqrt(rng.uniform(0.3, 1.05, count))[:, None, None]
    surface = _at(tail, path)
    core = _at(np.broadcast_to(middle, tail.shape), path)
    line = core + out * (surface - core)
    line[:, 0] = roots[root]
    return line, _radii(rng, count, points), _tones(rng, np.arange(count) // CLUMP), uv[root]


def _none(points: int) -> tuple[NDArray, ...]:
    return np.empty((0, points, 3)), np.empty((0, points)), np.empty(0), np.empty((0, 2))


def _radii(rng: np.random.Generator, count: int, points: int) -> NDArray[np.float64]:
    root, tip = RADIUS
    taper = 1 - np.linspace(0, 1, points) ** 3
    return rng.uniform(0.7, 1.3, count)[:, None] * (tip + (root - tip) * taper)


def _tones(rng: np.random.Generator, clump: NDArray) -> NDArray[np.float64]:
    """(n,) alike in a clump, and a little of each strand's own."""
    of_clumps = rng.normal(0, 0.4, clump.max() + 1)[clump]
    return np.clip(of_clumps + rng.normal(0, 0.25, len(clump)), -1, 1)
