"""Locks: ribbons of a few quads that lie on a shell and break its smoothness.

A lock begins somewhere on the shell and follows a field of directions down to the edge, or until
it is as long as its kind is. It has a ridge, tapers toward both ends, and waves and curls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from ..rig import FaceRig
from .cut import Cut
from .shell import Shell, shell

FEWEST, MOST = 3_000, 20_000  # triangles of shell and locks at detail 0 and 1
COARSE, FINE = (36, 11), (72, 20)  # columns and rows of the shell from detail 0 to FINE_FROM
FINE_FROM = 0.4
LENGTH = (0.12, 0.2)  # metres of a straight lock that lies, that falls; curls are shorter
SEGMENTS = (9, 18)  # of a straight lock, and of the tightest curl
RAISED = (0.0003, 0.0018)  # metres above the shell of a lock's sides, and of its ridge
BEYOND = (0.001, 0.018)  # metres that tips reach beyond the edge of hair that lies, that falls
PITCH, WAVELENGTH = 0.019, 0.055  # metres of a turn of a curl, and of a wave


@dataclass(frozen=True)
class Locks:
    """Ribbons on a shell.

    points : (n, 3) float32, metres;  quads : (q, 4) int32, turned outwards
    uv : (n, 2) float32, 0..1: u across a lock, v from its root to its tip
    tone : (n,) float32, -1..1, alike all over a lock: darker or lighter than the hair
    """

    points: NDArray[np.float32]
    quads: NDArray[np.int32]
    uv: NDArray[np.float32]
    tone: NDArray[np.float32]

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(2 q, 3) the halves of the quads."""
        return np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]])


def hair(
    rig: FaceRig,
    identity: Mapping[str, float] | None,
    cut: Cut,
    rng: np.random.Generator,
    detail: float = 0.5,
) -> tuple[Shell, Locks]:
    """A whole head of hair: about 3,000 triangles at detail 0, 20,000 at 1.

    InputError for a detail out of range.
    """
    if not 0 <= detail <= 1:
        raise InputError(f"the detail of hair must be from 0 to 1, got {detail}")
    share = min(detail / FINE_FROM, 1.0)
    columns, rows = (a + share * (b - a) for a, b in zip(COARSE, FINE, strict=True))
    under = shell(rig, identity, cut, 2 * round(columns / 2), round(rows))
    room = FEWEST + detail * (MOST - FEWEST) - 2 * len(under.quads)
    return under, locks(under, cut, rng, int(room))


def locks(
    shell: Shell,
    cut: Cut,
    rng: np.random.Generator,
    triangles: int = 8_000,
    width: float = 0.010,
    field: NDArray | None = None,
) -> Locks:
    """Locks on a shell, as many as there is room for.

    triangles : at most so many;  width : metres
    field : (columns, rows, 2) the direction of the hair at each point of `shell.outer`: across
        the columns, toward greater azimuths, and along them to the edge, of any length; down the
        columns where none is given
    """
    grids = [shell.points[shell.outer].astype(np.float64)]
    grids += [
        shell.points[ring.T].astype(np.float64)
        for ring, ball in zip(shell.tails, cut.balls, strict=True) if not ball.plait
    ]  # fmt: skip
    if field is None:
        field = np.zeros((*shell.outer.shape, 2))
        field[..., 1] = 1.0
    if field.shape != (*shell.outer.shape, 2):
        wanted = " x ".join(map(str, (*shell.outer.shape, 2)))
        raise InputError(f"the field of the locks must be {wanted} numbers, got {field.shape}")
    segments = round(SEGMENTS[0] + cut.curl * (SEGMENTS[1] - SEGMENTS[0]))
    count = max(triangles, 0) // (4 * segments)
    area = np.array([_cells(grid).sum() for grid in grids])
    shares = np.floor(count * area / area.sum()).astype(int)
    parts = []
    for k, (grid, some) in enumerate(zip(grids, shares, strict=True)):
        down = field if k == 0 else np.broadcast_to([0.0, 1.0], (*grid.shape[:2], 2))
        parts.append(_ribbons(grid, down, cut, rng, some, segments, width))
    points, tone = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    quads, uv = _strips(len(tone), segments)
    return Locks(
        points.reshape(-1, 3).astype(np.float32), quads, uv,
        np.repeat(tone, 3 * (segments + 1)).astype(np.float32),
    )  # fmt: skip


def _cells(grid: NDArray) -> NDArray[np.float64]:
    """(c, r - 1) square metres of the cells of a grid (c, r, 3) that closes around."""
    ahead = np.roll(grid, -1, axis=0)
    diagonals = np.cross(ahead[:, 1:] - grid[:, :-1], ahead[:, :-1] - grid[:, 1:])
    return np.linalg.norm(diagonals, axis=-1) / 2


def _ribbons(
    grid: NDArray, field: NDArray, cut: Cut, rng: np.random.Generator, count: int, segments: int,
    width: float,
) -> tuple[NDArray, NDArray]:  # fmt: skip
    """Points (count, segments + 1, 3 across, 3) and tones (count,) of locks on a grid."""
    columns, rows = grid.shape[:2]
    place = _seeds(grid, rng, count)
    across = (np.roll(grid, -1, axis=0) - np.roll(grid, 1, axis=0)) / 2
    along = np.gradient(grid, axis=1)
    normal = np.cross(along, across)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    metres = np.stack([np.linalg.norm(v, axis=-1) for v in (across, along)], axis=-1)
    metres = np.maximum(metres, 5e-4)
    root = np.cumsum(metres[..., 1], axis=1) - metres[:, :1, 1]

    length = LENGTH[int(cut.hangs)] * (1 - 0.7 * cut.curl) * rng.uniform(0.6, 1.2, count)
    lean = rng.normal(0, 0.07 + 0.35 * cut.curl, count)
    beyond = rng.uniform(0, BEYOND[int(cut.hangs)], count)
    step = length / segments
    path = np.empty((count, segments + 1, 2))
    for k in range(segments + 1):
        path[:, k] = place
        way = _at(field, place)
        way = way + np.stack([lean, 0 * lean], axis=-1)
        way /= np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9)
        size = _at(metres, place)
        ends = (rows - 1) + np.minimum(beyond / size[:, 1], 2.0)
        place = place + step[:, None] * way / size
        place[:, 1] = np.clip(place[:, 1], 0, ends)
    middle, up = _at(grid, path), _at(normal, path)
    up /= np.maximum(np.linalg.norm(up, axis=-1, keepdims=True), 1e-9)
    middle = _bent(middle, up, _at(root[..., None], path)[..., 0], path, cut, rng, columns)

    ahead = np.gradient(middle, axis=1)
    aside = np.cross(ahead, up)
    aside /= np.maximum(np.linalg.norm(aside, axis=-1, keepdims=True), 1e-9)
    t = np.linspace(0, 1, segments + 1)
    taper = np.minimum(np.clip(0.08 + 2.5 * t, 0, 1), (1 - t**2.5) + 0.04)
    wide = width * (1 - 0.45 * cut.curl) * rng.uniform(0.6, 1.3, count)[:, None] * taper
    sides = (np.array([-0.5, 0.0, 0.5]) * wide[..., None])[..., None] * aside[:, :, None]
    low, high = RAISED
    ridge = high * rng.uniform(0.6, 1.3, count)[:, None] * np.clip(2.5 * t, 0, 1)
    height = np.stack([0 * ridge + low, low + ridge, 0 * ridge + low], axis=-1)
    points = middle[:, :, None] + sides + height[..., None] * up[:, :, None]
    return points, np.clip(rng.normal(0, 0.45, count), -1, 1)


def _seeds(grid: NDArray, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """(count, 2) columns and rows where locks begin, evenly over the grid's surface."""
    area = _cells(grid)
    reach = np.concatenate([[0.0], np.cumsum(area.ravel())])
    want = (np.arange(count) + rng.uniform(0, 1, count)) / max(count, 1) * reach[-1]
    cell = np.clip(np.searchsorted(reach, want, side="right") - 1, 0, area.size - 1)
    column, row = np.divmod(cell, area.shape[1])
    return np.stack([column, row], axis=-1) + rng.uniform(0, 1, (count, 2))


def _at(table: NDArray, place: NDArray) -> NDArray[np.float64]:
    """(..., k) a table (c, r, k) that closes around, at columns and rows (..., 2); beyond its
    last row it goes on straight."""
    low = np.floor(place).astype(np.intp)
    row = np.clip(low[..., 1], 0, table.shape[1] - 2)
    i, j = low[..., 0] % table.shape[0], (low[..., 0] + 1) % table.shape[0]
    s = (place[..., 0] - low[..., 0])[..., None]
    t = (place[..., 1] - row)[..., None]
    near = table[i, row] * (1 - s) + table[j, row] * s
    return near * (1 - t) + (table[i, row + 1] * (1 - s) + table[j, row + 1] * s) * t


def _bent(
    middle: NDArray, up: NDArray, root: NDArray, path: NDArray, cut: Cut,
    rng: np.random.Generator, columns: int,
) -> NDArray[np.float64]:  # fmt: skip
    """The middles of locks (l, s, 3), waved and curled. root : (l, s) metres from the parting"""
    ahead = np.gradient(middle, axis=1)
    aside = np.cross(ahead, up)
    aside /= np.maximum(np.linalg.norm(aside, axis=-1, keepdims=True), 1e-9)
    count = len(middle)
    # Waves of neighbours go together, as those of the shell do; curls do not.
    azimuth = 2 * np.pi * path[..., 0] / columns
    phase = 2 * np.cos(3 * azimuth) + rng.normal(0, 0.35, count)[:, None]
    rising = np.clip(root / 0.06, 0, 1)
    wave = 0.004 * cut.wave * rising * np.sin(2 * np.pi * root / WAVELENGTH + phase + np.pi / 2)
    turn = 2 * np.pi * (root / PITCH + rng.uniform(0, 1, count)[:, None])
    turn = turn * rng.choice([-1.0, 1.0], count)[:, None]
    size = 0.0055 * cut.curl * rising * rng.uniform(0.7, 1.2, count)[:, None]
    lateral, lift = wave + size * np.cos(turn), size * (0.9 + np.sin(turn))
    return middle + lateral[..., None] * aside + lift[..., None] * up


def _strips(count: int, segments: int) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Quads (q, 4) and uv (n, 2) of `count` ribbons, three points across."""
    number = np.arange(count * (segments + 1) * 3).reshape(count, segments + 1, 3)
    a, b = number[:, :-1], number[:, 1:]
    quads = np.stack([a[..., :-1], a[..., 1:], b[..., 1:], b[..., :-1]], axis=-1)
    v, u = np.meshgrid(np.linspace(0, 1, segments + 1), (0.0, 0.5, 1.0), indexing="ij")
    uv = np.tile(np.stack([u, v], axis=-1).reshape(-1, 2), (count, 1))
    return quads.reshape(-1, 4).astype(np.int32), uv.astype(np.float32)
