"""The bust is closed: a rounded foot under the cut of the neck.

It is a part of its own, with vertices of its own that lie on the skin's edge, so that drawings,
which know nothing of where a bust was cut, show no line there. Its vertices are sums of those of
the cut, so that every identity and every turn of the neck moves it along.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

# Rings from the cut to the middle: share of the way to the middle, and millimetres below the cut.
# The first lies on the cut, a hair's breadth inside, so that nobody takes it for the skin's.
RINGS = ((0.0008, 0.0), (0.025, 1.6), (0.075, 2.7), (0.16, 3.2), (0.40, 3.3), (0.68, 3.3))
REACH = 0.04  # metres above the cut that levelling it moves
NARROW, FLARE = 0.050, 0.55  # metres from the middle; share of what goes beyond that is taken back
FLAT = 1e-6  # metres from the plane of symmetry
# Free of the source's map near where it has other skin: the middle, and its width for a metre.
PLACE, WIDTH = (0.35, 0.7), 0.9


def foot(
    cage: NDArray, quads: NDArray
) -> tuple[sp.csr_matrix, NDArray[np.int64], NDArray[np.float64]]:
    """Rows (k, m) of new vertices over the cage (m, 3), quads (f, 4) of them, numbered from m on,
    and where their corners lie on a texture (f, 4, 2).

    quads : of the skin, whose edge at the neck is closed
    """
    ring = cut_ring(cage, quads)
    count = len(ring)
    pick = sp.csr_matrix((np.ones(count), (np.arange(count), ring)), (count, len(cage)))
    middle = sp.csr_matrix(np.full((1, count), 1 / count)) @ pick
    above = np.unique(quads[np.isin(quads, ring).any(axis=1)])
    above = above[~np.isin(above, ring)]
    higher = sp.csr_matrix((np.full(len(above), 1 / len(above)), (0 * above, above)),
                           (1, len(cage)))  # fmt: skip
    down = middle - higher
    down = down / np.linalg.norm(down @ cage)
    every = sp.csr_matrix(np.ones((count, 1)))
    rounder = _rounder(count)
    rows, spread = [], []
    for number, (share, below) in enumerate(RINGS):
        rim = rounder ** (number * number) @ pick  # an even oval in the end, without a hollow
        rows.append((1 - share) * rim + every @ (share * middle + 1e-3 * below * down))
        spread.append(np.full(count, 1 - share - 8e-3 * below))
    half = count // 2
    left, right = np.arange(1, half), np.arange(count - 1, half, -1)
    last = rows[-1]
    rows.append((last[left] + last[right]) / 2)  # the middle line between both sides
    first = len(cage) + count * (len(RINGS) - 1)
    line = len(cage) + count * len(RINGS) + np.arange(half - 1)
    line = np.concatenate([[first], line, [first + half]])
    sides = []
    for k in range(len(RINGS) - 1):
        own = len(cage) + k * count + np.arange(count)
        after, inner = np.roll(own, -1), own + count
        sides.append(np.stack([own, after, np.roll(inner, -1), inner], axis=1))
    disc = [[first + 1, line[1], first + count - 1, first]]
    disc.append([first + half, first + half + 1, line[half - 1], first + half - 1])
    for k in range(1, half - 1):
        disc.append([first + k, first + k + 1, line[k + 1], line[k]])
        disc.append([line[k], line[k + 1], first + count - k - 1, first + count - k])
    found = np.concatenate([*sides, np.array(disc)])
    matrix = sp.vstack(rows).tocsr()
    return matrix, found, _places(matrix @ cage, np.concatenate(spread), found - len(cage), count)


def _rounder(count: int) -> sp.csr_matrix:
    """(count, count) each point of a ring halfway between itself and its neighbours."""
    k = np.arange(count)
    near = (np.full(3 * count, 1.0), (np.tile(k, 3), np.concatenate([k, k - 1, k + 1]) % count))
    near[0][:count] = 2.0
    return sp.csr_matrix(near, (count, count)) / 4


def as_fine(
    level: NDArray, cage: NDArray, quads: NDArray, skin: NDArray, first: int
) -> NDArray[np.int64]:
    """Levels of refinement of quads (f, 4), those of the foot's rim as those of the skin above it,
    so that no crack opens between both. skin : (f,) which are; first : vertex of the foot"""
    ring = cut_ring(cage, quads[skin])
    pairs = np.sort(np.stack([ring, np.roll(ring, -1)], axis=1), axis=1)
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2), axis=2)
    out, rim = level.copy(), np.flatnonzero(quads[:, 0] >= first)[: len(ring)]
    for pair, quad in zip(pairs, rim, strict=True):
        above = (sides == pair).all(axis=2).any(axis=1) & skin
        out[quad] = level[above].max()
    return out


def levelled(points: NDArray, ring: NDArray) -> NDArray[np.float64]:
    """(m, 3) metres to move skin vertices (m, 3) by, so that the cut lies in a plane and does not
    flare out toward shoulders that are not there. ring : (r,) vertices of the cut"""
    rim = points[ring]
    table = np.column_stack([np.ones(len(rim)), rim[:, 2]])
    plane = np.linalg.lstsq(table, rim[:, 1], rcond=None)[0]
    move = np.zeros_like(rim)
    move[:, 0] = -FLARE * np.sign(rim[:, 0]) * np.clip(np.abs(rim[:, 0]) - NARROW, 0, None)
    move[:, 1] = table @ plane - rim[:, 1]
    middle = rim[:, [0, 2]].mean(axis=0) * (0, 1)
    around, where = (np.arctan2(p[:, 0], p[:, 2] - middle[1]) for p in (rim, points))
    order = np.argsort(around)
    near = np.stack([np.interp(where, around[order], axis[order], period=2 * np.pi)
                     for axis in (*move.T, rim[:, 1])], axis=1)  # fmt: skip
    above = np.clip((points[:, 1] - near[:, 3]) / REACH, 0, 1)
    return ((1 - above) ** 2 * (1 + 2 * above))[:, None] * near[:, :3]


def cut_ring(cage: NDArray, quads: NDArray) -> NDArray[np.int64]:
    """Vertices of the longest edge of the skin, from the front over the face's left."""
    ends = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    there = {tuple(pair) for pair in ends.tolist()}
    after = {b: a for a, b in there if (b, a) not in there}  # against the skin's own way round
    loops = []
    while after:
        start, way = min(after), []
        at = start
        while at in after:
            way.append(at)
            at = after.pop(at)
        loops.append(way)
    ring = np.array(max(loops, key=len))
    middle = np.flatnonzero(np.abs(cage[ring, 0]) < FLAT)
    if len(ring) % 2 or len(middle) != 2:
        raise ValueError("the neck's edge has no two points on the plane of symmetry")
    ring = np.roll(ring, -middle[np.argmax(cage[ring[middle], 2])])
    return ring


def _places(points: NDArray, spread: NDArray, quads: NDArray, count: int) -> NDArray[np.float64]:
    """Texture (f, 4, 2): the foot from below, its rounded edge flattened."""
    middle = points[:count].mean(axis=0)
    rings = points[: count * len(RINGS)] - middle
    shares = np.repeat([1 - share for share, _ in RINGS], count)
    rim = rings * (spread / shares)[:, None]
    half = count // 2
    last = rim[-count:]
    line = (last[1:half] + last[:half:-1]) / 2
    flat = np.concatenate([rim, line])[:, [0, 2]]
    return (np.array(PLACE) + WIDTH * flat)[quads]
