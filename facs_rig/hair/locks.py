"""Locks: ribbons of a few quads that lie on a shell and break its smoothness.

A lock begins somewhere on the shell and follows a field of directions down to the edge, or until
it is as long as its kind is. It has a ridge, tapers toward both ends, and waves and curls. Above a
bare forehead hair grows up and back: there locks begin at the edge and run the other way. At the
sides of a face it does not end at the edge, but runs down along it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from ..rig import FaceRig
from .cut import Cut
from .head import WIDEST
from .hem import hanging, tip_paths, tucked
from .presets import HAIRLINE
from .shell import WAVELENGTH, Shell, edge_heights, lowered, shell, wave_phase

FEWEST, MOST = 3_000, 20_000  # triangles of shell and locks at detail 0 and 1
COARSE, FINE = (36, 11), (72, 20)  # columns and rows of the shell from detail 0 to FINE_FROM
FINE_FROM = 0.4
# Share of the triangles of locks that are in tips, segments of one, how much shorter these become,
# and tones: tips leave nothing dark between them, as locks do.
TIPS, TIP_SEGMENTS, SOON, TIP_TONES = 0.35, 4, 1.8, (-0.45, 0.4)
LENGTH = (0.12, 0.2)  # metres of a straight lock that lies, that falls; curls are shorter
SEGMENTS = (9, 18)  # of a straight lock, and of the tightest curl or wave
RAISED = (0.0003, 0.0018)  # metres above the shell of a lock's sides, and of its ridge
BEYOND = (0.001, 0.006)  # metres that tips reach beyond the edge of hair that lies, that falls
MORE = (2.0, 0.04)  # times as many locks begin at the parting, and metres over which that fades
GROWS = (0.16, 0.06)  # heights below the hairline between which an edge comes to be one itself
FOREHEAD = (np.radians(62), np.radians(80))  # from the front, where that ceases to matter
ALONG = (0.3, 0.9)  # shares of a column between which locks come to run along a steep edge
LEVEL = 0.3  # slope of an edge below which hair ends there
HAIRLINE_SPREAD = 0.004  # metres before a hairline that roots reach
# Shares of a lock's length that it is shorter and that its tip rises where hair stands, how much of
# that it does at the sides of a head, and radians that standing locks lean this way and that.
SHORTER, RISES, ASIDE, TOUSLED = 0.4, 0.17, 0.25, 0.12
BROADER = 0.5  # share by which locks that stand are broader
LOWER = 0.25  # share of its thickness by which the shell lies lower under locks that stand
CURLY = 0.5  # curl from which on locks are plain ribbons
DOWN = (0.0, 1.0)  # the field of hair that follows the columns
PITCH = 0.025  # metres of a turn of a curl


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
    under = lowered(under, LOWER * cut.stand)
    room = int(FEWEST + detail * (MOST - FEWEST)) - 2 * len(under.quads)
    ends = tips(under, cut, rng, int(TIPS * room))
    made = locks(under, cut, rng, room - 2 * len(ends.quads))
    return tucked(under, cut), _together(made, ends)


def _together(one: Locks, other: Locks) -> Locks:
    quads = np.concatenate([one.quads, other.quads + np.int32(len(one.points))])
    points, uv, tone = (
        np.concatenate([getattr(one, name), getattr(other, name)])
        for name in ("points", "uv", "tone")
    )
    return Locks(points, quads, uv, tone)


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
        columns, and along the edge where it is steep, where none is given
    """
    if field is None:
        field = _combed(shell)
    if field.shape != (*shell.outer.shape, 2):
        wanted = " x ".join(map(str, (*shell.outer.shape, 2)))
        raise InputError(f"the field of the locks must be {wanted} numbers, got {field.shape}")
    segments = round(SEGMENTS[0] + max(cut.curl, cut.wave) * (SEGMENTS[1] - SEGMENTS[0]))
    sheets = _sheets(shell, cut, field)
    area = np.array([_cells(sheet.points).sum() for sheet in sheets])
    # Curls are many and narrow, and have no room for a ridge.
    lanes = np.array([-0.5, 0.5] if cut.curl > CURLY else [-0.5, 0.0, 0.5])
    each = 2 * segments * (len(lanes) - 1)
    counts = np.floor(max(triangles, 0) // each * area / area.sum()).astype(int)
    parts = [
        _ribbons(sheet, cut, rng, count, segments, width * lanes)
        for sheet, count in zip(sheets, counts, strict=True)
    ]
    points, tone = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    quads, uv = _strips(len(tone), np.linspace(0, 1, segments + 1), lanes + 0.5)
    return Locks(
        points.reshape(-1, 3).astype(np.float32), quads, uv,
        np.repeat(tone, len(lanes) * (segments + 1)).astype(np.float32),
    )  # fmt: skip


@dataclass(frozen=True)
class _Sheet:
    """A surface that carries locks, closed around.

    points : (c, r, 3) metres;  field : (c, r, 2) see `locks`
    azimuth : (c,) radians, rising;  beyond : (c,) metres that tips may reach beyond a column's end
    grows : (c,) 0..1, the share of locks that begin at a column's end and run up from there
    """

    points: NDArray[np.float64]
    field: NDArray[np.float64]
    azimuth: NDArray[np.float64]
    beyond: NDArray[np.float64]
    grows: NDArray[np.float64]

    @cached_property
    def _steps(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        across = (np.roll(self.points, -1, axis=0) - np.roll(self.points, 1, axis=0)) / 2
        return across, np.gradient(self.points, axis=1)

    @cached_property
    def normal(self) -> NDArray[np.float64]:
        """(c, r, 3) unit."""
        across, along = self._steps
        return _unit(np.cross(along, across))

    @cached_property
    def metres(self) -> NDArray[np.float64]:
        """(c, r, 2) from a point to the next across columns, and along them."""
        size = np.stack([np.linalg.norm(step, axis=-1) for step in self._steps], axis=-1)
        return np.maximum(size, 5e-4)

    @cached_property
    def root(self) -> NDArray[np.float64]:
        """(c, r) metres from the parting."""
        return np.cumsum(self.metres[..., 1], axis=1) - self.metres[:, :1, 1]


def _sheets(shell: Shell, cut: Cut, field: NDArray) -> list[_Sheet]:
    """The outer sheet of a shell, and what is gathered but not plaited."""
    falls = cut.hangs & (edge_heights(cut, shell.azimuth) < WIDEST)
    points = shell.points[shell.outer].astype(np.float64)
    beyond = np.where(falls, BEYOND[1], BEYOND[0])
    out = [_Sheet(points, field, shell.azimuth, beyond, _grows(cut, shell.azimuth))]
    for ring, ball in zip(shell.tails, cut.balls, strict=True):
        if not ball.plait:
            points = shell.points[ring.T].astype(np.float64)
            turn = np.linspace(0, 2 * np.pi, len(points), endpoint=False)
            down = np.broadcast_to(DOWN, (*points.shape[:2], 2))
            tips = np.full(len(points), BEYOND[0])
            out.append(_Sheet(points, down, turn, tips, np.zeros(len(points))))
    return out


def _combed(shell: Shell) -> NDArray[np.float64]:
    """(columns, rows, 2) down the columns, and toward where the edge is steep along it."""
    end = shell.points[shell.outer[:, -1]].astype(np.float64)
    tangent = np.roll(end, -1, axis=0) - np.roll(end, 1, axis=0)
    steep = tangent[:, 1] / np.maximum(np.linalg.norm(tangent, axis=1), 1e-9)
    steep = np.sign(steep) * np.clip((np.abs(steep) - LEVEL) / (1 - LEVEL), 0, 1)
    columns, rows = shell.outer.shape
    begins, ends = ALONG
    near = np.clip((np.linspace(0, 1, rows) - begins) / (ends - begins), 0, 1)
    across = -steep[:, None] * near
    return np.stack([across, 1 - np.abs(across)], axis=-1)


def _grows(cut: Cut, azimuth: NDArray) -> NDArray[np.float64]:
    """(c,) how far a cut's edge is where hair begins to grow, rather than where it hangs to."""
    away = np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi)
    if cut.sweep is not None:  # combed back, however low it begins
        return np.clip((FOREHEAD[1] - away) / (FOREHEAD[1] - FOREHEAD[0]), 0, 1)
    low, high = np.interp(np.degrees(away), *np.array(HAIRLINE).T) - np.array(GROWS)[:, None]
    there = np.clip((edge_heights(cut, azimuth) - low) / (high - low), 0, 1)
    return there * np.clip((FOREHEAD[1] - away) / (FOREHEAD[1] - FOREHEAD[0]), 0, 1)


def _cells(grid: NDArray) -> NDArray[np.float64]:
    """(c, r - 1) square metres of the cells of a grid (c, r, 3) that closes around."""
    ahead = np.roll(grid, -1, axis=0)
    diagonals = np.cross(ahead[:, 1:] - grid[:, :-1], ahead[:, :-1] - grid[:, 1:])
    return np.linalg.norm(diagonals, axis=-1) / 2


def _ribbons(
    sheet: _Sheet, cut: Cut, rng: np.random.Generator, count: int, segments: int, lanes: NDArray
) -> tuple[NDArray, NDArray]:
    """Points (count, segments + 1, lanes, 3) and tones (count,) of locks on a sheet.

    lanes : (2,) or (3,) metres of a lock's points from its middle
    """
    path, long = _traced(sheet, cut, rng, count, segments)
    middle, up = _threads(sheet, path, cut, rng)
    t = np.linspace(0, 1, segments + 1)
    middle = middle + (standing(cut, up) * t**1.5)[..., None] * up
    taper = np.minimum(np.clip(0.08 + 2.5 * t, 0, 1), (1 - t**2.5) + 0.04)
    wide = (
        (1 - 0.2 * cut.curl)
        * (1 + BROADER * cut.stand)
        * (rng.uniform(0.6, 1.3, count) * np.sqrt(long))[:, None]
        * taper
    )
    ridge = RAISED[1] * rng.uniform(0.6, 1.3, count)[:, None] * np.clip(2.5 * t, 0, 1)
    high = np.array([0.0, 1.0, 0.0])[: len(lanes)]
    points = _widened(middle, up, wide, lanes, ridge[..., None] * high)
    return points, np.clip(rng.normal(0, 0.45, count), -1, 1)


def tips(shell: Shell, cut: Cut, rng: np.random.Generator, triangles: int) -> Locks:
    """The points in which hair that hangs ends, in at most so many triangles; see `hem`."""
    segments, lanes = TIP_SEGMENTS, np.array([-0.5, 0.5])
    there = hanging(shell, cut).any()
    count = max(triangles, 0) // (2 * segments) if there else 0
    t = 1 - (1 - np.linspace(0, 1, segments + 1)) ** SOON
    path, width, bend = tip_paths(shell, cut, rng, count, t)
    middle, up = _threads(_sheets(shell, cut, _combed(shell))[0], path, cut, rng)
    middle = middle - (bend[:, None] * t**2)[..., None] * up
    wide = width[:, None] * np.minimum(np.clip(0.1 + 3 * t, 0, 1), 1.03 - t**6)
    # Above the surface beside them, but for their roots, which come out of it.
    lift = rng.uniform(0.3, 1.0, count)[:, None] * np.clip(3 * t, 0, 1)
    points = _widened(middle, up, wide, lanes, RAISED[1] * lift[..., None])
    quads, uv = _strips(count, t, lanes + 0.5)
    tone = np.repeat(np.clip(rng.normal(*TIP_TONES, count), -1, 1), len(lanes) * (segments + 1))
    return Locks(points.reshape(-1, 3).astype(np.float32), quads, uv, tone.astype(np.float32))


def _threads(
    sheet: _Sheet, path: NDArray, cut: Cut, rng: np.random.Generator
) -> tuple[NDArray, NDArray]:
    """The middles (l, s, 3) of locks along paths on a sheet, waved and curled, and the unit normals
    of the sheet under them."""
    root = _at(sheet.root[..., None], path)[..., 0]
    middle, up = _at(sheet.points, path), _unit(_at(sheet.normal, path))
    return _bent(middle, up, root, path, sheet.azimuth, cut, rng), up


def _widened(
    middle: NDArray, up: NDArray, wide: NDArray, lanes: NDArray, lift: NDArray
) -> NDArray[np.float64]:
    """(l, s, lanes, 3) ribbons along middles (l, s, 3), their faces to `up`: metres that they are
    wide (l, s), and that lanes lie higher than the lowest (l, s, lanes or 1)."""
    aside = _unit(np.cross(np.gradient(middle, axis=1), up))
    sides = (lanes * wide[..., None])[..., None] * aside[:, :, None]
    return middle[:, :, None] + sides + (RAISED[0] + lift)[..., None] * up[:, :, None]


def standing(cut: Cut, up: NDArray) -> NDArray[np.float64]:
    """(...) metres that tips stand over places of a cut's surface whose normals are (..., 3)."""
    top = ASIDE + (1 - ASIDE) * np.clip(up[..., 1], 0, 1)
    return cut.stand * RISES * LENGTH[0] * top


def _unit(vectors: NDArray) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def _traced(
    sheet: _Sheet, cut: Cut, rng: np.random.Generator, count: int, segments: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Columns and rows along locks (count, segments + 1, 2), and what share of its length each has:
    one that comes to the end of the sheet is shorter, and as pointed."""
    columns, rows = sheet.points.shape[:2]
    metres = sheet.metres
    place = _seeds(sheet, rng, count)
    usual = LENGTH[int(cut.hangs)] * (1 - 0.6 * cut.curl) * (1 - SHORTER * cut.stand)
    length = usual * rng.uniform(0.6, 1.2, count)
    lean = rng.normal(0, 0.07 + 0.35 * cut.curl + TOUSLED * cut.stand, count)
    share = rng.uniform(0, 1, count)
    up = rng.uniform(0, 1, count) < sheet.grows[np.rint(place[:, 0]).astype(np.intp) % columns]
    turned = np.where(up, -1.0, 1.0)[:, None]
    first = up & (place[:, 1] > rows - 2)
    before = rng.uniform(0, HAIRLINE_SPREAD, count) / _at(metres, place)[:, 1]
    place[:, 1] = np.where(first, rows - 1 + np.minimum(before, 1.0), place[:, 1])
    path = np.empty((count, segments + 1, 2))
    gone = np.zeros(count)  # segments until the end
    inside = np.full(count, True)
    for k in range(segments + 1):
        path[:, k] = place
        way = turned * _unit(_at(sheet.field, place))
        if cut.sweep:
            swept = np.cos(cut.sweep) * way + np.sin(cut.sweep) * way[:, ::-1] * [-1, 1]
            way = np.where(up[:, None], swept, way)
        way = _unit(way + lean[:, None] * np.stack([way[:, 1], -way[:, 0]], axis=-1))
        size = _at(metres, place)
        past = share * sheet.beyond[np.rint(place[:, 0]).astype(np.intp) % columns]
        step = (length / segments)[:, None] * way / size
        end = np.clip(place[:, 1] + step[:, 1], 0, rows - 1 + np.minimum(past / size[:, 1], 2.0))
        part = np.clip((end - place[:, 1]) / np.where(step[:, 1] == 0, 1.0, step[:, 1]), 0, 1)
        part = np.where(end == place[:, 1] + step[:, 1], 1.0, part)
        gone += np.where(inside, part, 0.0)
        inside &= part == 1
        place = place + step
        place[:, 1] = end
    gone = np.minimum(gone, segments)
    at = gone[:, None] * np.linspace(0, 1, segments + 1)
    low = np.minimum(at.astype(np.intp), segments - 1)
    lock = np.arange(count)[:, None]
    share = (at - low)[..., None]
    return path[lock, low] * (1 - share) + path[lock, low + 1] * share, gone / segments


def _seeds(sheet: _Sheet, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """(count, 2) columns and rows where locks begin: evenly over the grid's surface, and more at
    the parting and at a hairline, where none comes from farther up."""
    grid, root, grows = sheet.points, sheet.root, sheet.grows[:, None]
    end = root[:, -1:] - root[:, 1:]
    more = (1 - grows) * np.exp(-root[:, :-1] / MORE[1]) + 2 * grows * np.exp(-end / MORE[1])
    area = _cells(grid) * (1 + MORE[0] * more)
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
    middle: NDArray, up: NDArray, root: NDArray, path: NDArray, azimuths: NDArray, cut: Cut,
    rng: np.random.Generator,
) -> NDArray[np.float64]:  # fmt: skip
    """The middles of locks (l, s, 3), waved and curled. root : (l, s) metres from the parting"""
    aside = _unit(np.cross(np.gradient(middle, axis=1), up))
    count, columns = len(middle), len(azimuths)
    # Waves of neighbours go together, as those of the shell do; curls do not.
    turned = np.append(azimuths, 2 * np.pi)
    azimuth = np.interp(path[..., 0] % columns, np.arange(columns + 1), turned)
    phase = wave_phase(azimuth) + rng.normal(0, 0.35, count)[:, None]
    rising = np.clip(root / 0.06, 0, 1)
    wave = 0.006 * cut.wave * rising * np.cos(2 * np.pi * root / WAVELENGTH + phase)
    turn = 2 * np.pi * (root / PITCH + rng.uniform(0, 1, count)[:, None])
    turn = turn * rng.choice([-1.0, 1.0], count)[:, None]
    early = np.clip(0.3 + root / 0.03, 0, 1)
    size = 0.007 * cut.curl * early * rng.uniform(0.7, 1.2, count)[:, None]
    lateral, lift = wave + size * np.cos(turn), size * (0.9 + np.sin(turn))
    return middle + lateral[..., None] * aside + lift[..., None] * up


def _strips(
    count: int, along: NDArray, across: NDArray
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Quads (q, 4) and uv (n, 2) of `count` ribbons. along : (k,) v of
    their points;  across : (lanes,) u"""
    steps, lanes = len(along), len(across)
    number = np.arange(count * steps * lanes).reshape(count, steps, lanes)
    a, b = number[:, :-1], number[:, 1:]
    quads = np.stack([a[..., :-1], a[..., 1:], b[..., 1:], b[..., :-1]], axis=-1)
    v, u = np.meshgrid(along, across, indexing="ij")
    uv = np.tile(np.stack([u, v], axis=-1).reshape(-1, 2), (count, 1))
    return quads.reshape(-1, 4).astype(np.int32), uv.astype(np.float32)
