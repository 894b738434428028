"""The lines of a head of hair on a posed face: its outline, its edge, its parting, its strands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.common.derived import derived
from facs_rig.hair.cut import Cut
from facs_rig.hair.follow import scalp
from facs_rig.hair.head import WIDEST, measured
from facs_rig.hair.shell import WAVELENGTH, Shell, edge_heights, shell_on, wave_phase
from facs_rig.hair.tails import PITCH, SLANT
from facs_rig.levels import at_level, kept_by
from facs_rig.mesh import corner_matrix

from .hairdo import Hairdo
from .linework.curvature import ready
from .linework.kernels import kernels
from .linework.strokes import LineSet
from .linework.topology import Topology
from .linework.zero_sets import chains, zero_set

COLUMNS, ROWS = 48, 14  # of the surface: half of what an artist's mesh has
EDGE, STRAND, MASS = "hair_edge", "hair", "mass"
# Times the lift of other lines: a smoothed outline lies in or out of coarse hair, strands on it.
LIFT, LOW = 10.0, 3.0
FINER = 4  # points of an outline from one edge of the mesh to the next
STEPS = 18  # points of a strand
# Of each finish, pixels between strands, how many lie side by side in a lock, and their widths.
STRANDS = {
    "outline": ((25.0, 80.0), (1, 3), (0.7, 1.0)),
    "strands": ((4.0, 14.0), (1, 5), (0.6, 1.1)),
    "dense": ((2.0, 3.6), (2, 8), (0.6, 1.2)),
    "hatch": ((30.0, 90.0), (1, 3), (0.7, 1.0)),
    "brush": ((14.0, 40.0), (1, 4), (0.6, 1.2)),
}
SPREAD = (0.003, 0.012)  # metres between strands of a lock
LENGTH = (0.05, 0.17)  # metres of a strand
ROOTS, TIPS = 0.35, 0.4  # shares of strands that begin where hair begins, that end where it ends
LANE = (3.2, 1.2)  # pixels between the strokes of a brush: and as many widths of a line
SHINE = 0.75  # share of brushed hair that keeps a band of light


@dataclass(frozen=True)
class Worn:
    """A head of hair on a posed face. points : (n, 3) metres, of `shell`, where they are now"""

    hairdo: Hairdo
    cut: Cut
    shell: Shell
    points: NDArray[np.float64]

    @cached_property
    def sheets(self) -> list[Sheet]:
        """The outer sheet, and buns, tails and braids."""
        return [Sheet.of(self.points[at]) for at in (self.shell.outer, *(
            ring.T for ring in self.shell.tails))]  # fmt: skip

    @property
    def inner(self) -> Sheet:
        """The sheet that is seen from within, where hair hangs down behind the neck."""
        return Sheet.of(self.points[self.shell.inner][::-1])

    @property
    def falls(self) -> NDArray[np.bool_]:
        """(columns,) where hair falls, rather than lies on the skin to its edge."""
        return self.cut.hangs & (edge_heights(self.cut, self.shell.azimuth) < WIDEST)


def wear(
    rig: FaceRig, vertices: NDArray, parameters: FaceParameters, hairdo: Hairdo
) -> Worn:  # fmt: skip
    """A head of hair on a posed face (n, 3), `rig.pose(parameters)`: it follows the skull."""
    few, cut = at_level(rig, "game"), hairdo.cut()
    rest = few.neutral(parameters.identity)
    shell = shell_on(measured(few, rest, _depths), cut, COLUMNS, ROWS)
    at = _scalp(rig)
    here, there = rest[at].astype(float), kept_by(few, vertices)[at].astype(float)
    # The rotation that brings the skull at rest to where it is (Kabsch 1976).
    u, _, vt = np.linalg.svd((there - there.mean(axis=0)).T @ (here - here.mean(axis=0)))
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    points = (shell.points - here.mean(axis=0)) @ turn.T + there.mean(axis=0)
    return Worn(hairdo, cut, shell, points)


def _depths(points: NDArray, triangles: NDArray, camera: Camera) -> NDArray[np.float64]:
    """(h, w) depth of the nearest surface, as `facs_rig.rasterise` finds it, compiled."""
    v, u = np.mgrid[: camera.height, : camera.width]
    places = np.stack([u.ravel(), v.ravel()], axis=1) + 0.5
    depth, _ = kernels().topmost(
        ready(camera.project(points)), ready(points[:, 2]), ready(triangles, np.int32), places
    )  # fmt: skip
    return depth.reshape(camera.height, camera.width)


@derived
def _scalp(rig: FaceRig) -> NDArray[np.intp]:
    return scalp(at_level(rig, "game"))


@dataclass(frozen=True)
class Sheet:
    """A surface of hair, closed around.

    points, normals : (c, r, 3) metres, unit vectors out of it, by column and row
    metres : (c, r, 2) of one column and of one row;  area : (c, r - 1) square metres of its cells
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    metres: NDArray[np.float64]
    area: NDArray[np.float64]

    @classmethod
    def of(cls, points: NDArray) -> Sheet:
        """The surface through points (c, r, 3)."""
        across = (np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)) / 2
        along = np.gradient(points, axis=1)
        normal = np.cross(along, across)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
        metres = np.stack([np.linalg.norm(way, axis=-1) for way in (across, along)], axis=-1)
        metres = np.maximum(metres, 5e-4)
        cells = metres[:, :-1] + metres[:, 1:]
        return cls(points, normal, metres, cells[..., 0] * cells[..., 1] / 4)

    @cached_property
    def both(self) -> NDArray[np.float64]:
        """(c, r, 6) points and normals."""
        return np.concatenate([self.points, self.normals], axis=2)

    def at(self, table: NDArray, column: NDArray, row: NDArray) -> NDArray[np.float64]:
        """(..., k) a table (c, r, k) at columns, which go around, and rows, which go on beyond."""
        columns, rows = table.shape[:2]
        flat = table.reshape(columns * rows, -1)
        left = np.floor(column)
        low = np.clip(np.floor(row), 0, rows - 2).astype(np.intp)
        across, down = (column - left)[..., None], (row - low)[..., None]
        i = left.astype(np.intp) % columns
        here, aside = i * rows + low, (i + 1) % columns * rows + low
        near, far = flat.take(here, axis=0), flat.take(here + 1, axis=0)
        near += across * (flat.take(aside, axis=0) - near)
        far += across * (flat.take(aside + 1, axis=0) - far)
        return near + down * (far - near)

    def lines(
        self, kind: str, column: NDArray, row: NDArray, strength: NDArray, width: NDArray
    ) -> LineSet:
        """Lines (n, k) through columns and rows. strength : (n, k);  width : (n,)"""
        points, normals = np.split(self.at(self.both, column, row).reshape(-1, 6), 2, axis=1)
        starts = np.arange(len(column) + 1) * column.shape[1]
        shown = np.ones(len(points), dtype=bool)
        return LineSet(kind, points, starts, strength.ravel(), width, LOW * normals, shown)

    def seeds(self, count: int, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
        """Columns and rows (count,) of places all over the surface."""
        reach = np.cumsum(self.area.ravel())
        cell = np.searchsorted(reach, rng.random(count) * reach[-1])
        column, row = np.divmod(np.minimum(cell, self.area.size - 1), self.area.shape[1])
        return column + rng.random(count), row + rng.random(count)


def hair_lines(worn: Worn, camera: Camera, pen: float, rng: np.random.Generator) -> list[LineSet]:
    """All lines of hair, hidden or not. pen : pixels, width of a full line"""
    finish = worn.hairdo.finish
    near = float(camera.relative_depth(worn.points).mean())
    scale = float(np.mean(camera.scale)) / near  # pixels of a metre
    edges, inside = _outline(worn, camera, rng) + _edges(worn, rng), []
    for k, sheet in enumerate(worn.sheets):
        if k and worn.cut.balls[k - 1].plait:
            inside += [_brushed(sheet, scale, pen, rng)] if finish == "brush" else []
            continue
        if finish == "curls":
            inside += _curls(sheet, rng)
            continue
        if finish == "brush":
            inside.append(_brushed(sheet, scale, pen, rng))
        if finish in STRANDS:
            inside += _strands(worn, sheet, scale, rng, on_head=not k)
    if worn.falls.any() and finish != "outline":  # what hangs down behind the neck, from within
        sheet = worn.inner
        inside += [_brushed(sheet, scale, pen, rng)] if finish == "brush" else []
        inside += _strands(worn, sheet, scale, rng, on_head=True) if finish in STRANDS else []
    inside += _plaits(worn)
    return edges + [replace(lines, shown=_faces(lines, camera)) for lines in inside]


def _faces(lines: LineSet, camera: Camera) -> NDArray[np.bool_]:
    """(m,) where the surface under lines is turned to the camera."""
    return np.einsum("ij,ij->i", lines.normals, camera.view_vectors(lines.points)) > 0


# --- outline and edges ----------------------------------------------------------------------------


def _outline(worn: Worn, camera: Camera, rng: np.random.Generator) -> list[LineSet]:
    """Where the surface turns away: the zero set of its n·v, smoothed; the inner sheet has none."""
    columns, rows = worn.shell.outer.shape
    body, tails = columns * (rows - 1), columns * (2 * rows - 1)
    quads = np.concatenate([worn.shell.quads[:body], worn.shell.quads[tails:]])
    topology, around = _topology(quads.tobytes(), len(worn.points))
    points = worn.points
    normals = kernels().vertex_normals(np.ascontiguousarray(points), topology.triangles)
    facing = np.einsum("ij,ij->i", normals, camera.view_vectors(points))
    facing = around @ (around @ facing)
    found = zero_set(topology, facing)
    if not len(found.segments):
        return []
    line, starts = chains(found.segments)
    places, normal = (found.of(values)[line] for values in (points, normals))
    places, normal, starts = _finer(np.concatenate([places, normal], axis=1), starts)
    step = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1)
    step[starts[:-1]] = 0
    along = np.cumsum(step)
    places = places + _ragged(worn, along, rng)[:, None] * normal
    count = len(starts) - 1
    return [
        LineSet(EDGE, places, starts, np.ones(len(places)), np.ones(count), LIFT * normal,
                np.ones(len(places), dtype=bool))
    ]  # fmt: skip


@lru_cache(maxsize=16)
def _topology(quads: bytes, n: int) -> tuple[Topology, sp.csr_matrix]:
    """Of a mesh of quads (q, 4) int32, and the mean (n, n) over what is around each vertex."""
    faces = np.frombuffer(quads, np.int32).reshape(-1, 4)
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    corner = corner_matrix(triangles, n)
    rows = np.repeat(np.arange(len(triangles)), 3)
    take = sp.csr_matrix((np.full(3 * len(triangles), 1 / 3), (rows, triangles.ravel())),
                         shape=(len(triangles), n))  # fmt: skip
    share = np.maximum(np.asarray(corner.sum(axis=1)).ravel(), 1)
    return Topology.of(triangles), sp.csr_matrix(sp.diags(1 / share) @ corner @ take)


def _finer(values: NDArray, starts: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Points and normals (m, 6) of lines, FINER times as many, on smooth curves (Catmull, Rom)."""
    first, last = np.repeat(starts[:-1], np.diff(starts)), np.repeat(starts[1:], np.diff(starts))
    here = np.arange(len(values))
    around = [values[np.clip(here + k, first, last - 1)] for k in (-1, 0, 1, 2)]
    t = (np.arange(FINER) / FINER)[None, :, None]
    a, b, c, d = (part[:, None] for part in around)
    fine = b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    kept = np.ones((len(values), FINER), dtype=bool)
    kept[starts[1:] - 1, 1:] = False  # nothing follows the last point of a line
    fine = fine.reshape(-1, values.shape[1])[kept.ravel()]
    begins = np.concatenate([[0], np.cumsum(FINER * (np.diff(starts) - 1) + 1)])
    return fine[:, :3], fine[:, 3:], begins


def _ragged(worn: Worn, along: NDArray, rng: np.random.Generator) -> NDArray[np.float64]:
    """(m,) metres by which an outline leaves the surface, at metres along it."""
    hairdo = worn.hairdo
    if hairdo.finish == "curls":
        bow = rng.uniform(0.014, 0.024)
        return 0.25 * bow * (2 * np.abs(np.sin(np.pi * along / bow)) - 1)
    size = rng.choice([0.0, 0.0004, 0.001]) + 0.0015 * hairdo.curl
    waves = np.sin(along / 0.0061 + 4 * np.sin(along / 0.017)) + np.sin(along / 0.0027)
    return 0.6 * size * waves


def _edges(worn: Worn, rng: np.random.Generator) -> list[LineSet]:
    """Where hair ends, and where it is parted."""
    sheet, finish = worn.sheets[0], worn.hairdo.finish
    columns, rows = worn.shell.outer.shape
    column = np.arange(6 * columns + 1) / 6
    falls = np.interp(column, np.arange(columns + 1), np.append(worn.falls, worn.falls[0]) * 1.0)
    metres = sheet.at(sheet.metres, column, np.full(len(column), rows - 1.0))[:, 1]
    along = np.cumsum(sheet.metres[:, -1, 0]).mean() / columns * column
    # Tips of locks reach beyond the edge; where hair lies on the skin its roots are uneven.
    tips = _tips(along, rng.uniform(0.006, 0.025), rng)
    size = falls * rng.uniform(0, 0.014) + (1 - falls) * rng.uniform(0, 0.004)
    if finish == "curls":
        size = size + 0.004
    row = rows - 1 + np.clip(size * tips / metres, 0, 1.5)
    strength = np.ones(len(column))
    if finish not in ("outline", "hatch") and rng.random() < 0.75:  # a hairline of few strokes
        soft = np.sin(along / 0.013 + 2 * np.sin(along / 0.029) + rng.uniform(0, 6))
        strength = np.clip(falls + 0.9 * soft + rng.uniform(-0.6, 0.4), 0, 1)
    sets = [sheet.lines(EDGE, column[None], row[None], strength[None], np.array([0.9]))]
    if worn.cut.part is not None:
        half = np.arange(3 * columns // 2 + 1)[None] / 3
        fade = np.clip(1.4 - 1.4 * half / half.max(), 0, 1)
        sets.append(sheet.lines(EDGE, half, 0 * half, fade, np.array([0.9])))
    return sets


def _tips(along: NDArray, wide: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """(m,) 0 to 1, the tips of locks about `wide` metres wide along an edge."""
    steps = wide * rng.uniform(0.3, 1.7, int(along[-1] / wide) + 2)
    ends = np.cumsum(steps)
    lock = np.minimum(np.searchsorted(ends, along), len(ends) - 1)
    place = 1 - (ends[lock] - along) / steps[lock]
    peak = rng.uniform(0.3, 0.7, len(ends))[lock]
    rise = np.minimum(place / peak, (1 - place) / (1 - peak))
    return np.clip(rise, 0, 1) ** 0.8 * rng.uniform(0.2, 1, len(ends))[lock]


# --- strands --------------------------------------------------------------------------------------


def _strands(
    worn: Worn, sheet: Sheet, scale: float, rng: np.random.Generator, on_head: bool
) -> list[LineSet]:
    """Strands in locks: many begin at the parting or end at the edge, where hair is darkest."""
    gap, beside, widths = STRANDS[worn.hairdo.finish]
    low, high = LENGTH
    length = rng.uniform(low, high) * (0.6 if worn.hairdo.curl > 0.5 else 1.0)
    count = int(sheet.area.sum() * scale / (length * rng.uniform(*gap)))
    if count < 1:
        return []
    size = rng.integers(beside[0], beside[1] + 1, count)
    lock = np.repeat(np.arange(count), size)[:count]
    column, row = sheet.seeds(count, rng)
    rows = sheet.points.shape[1] - 1
    kind = rng.random(count)
    row = np.where(kind < ROOTS, rng.exponential(0.05, count) * rows, row)
    column, row, kind = column[lock], row[lock], kind[lock]
    place = np.stack([column, row], axis=-1)
    metres = sheet.at(sheet.metres, place[:, 0], place[:, 1])
    spread = rng.uniform(*SPREAD)
    column = column + rng.normal(0, spread, count) / np.maximum(metres[:, 0], 0.002)
    reach = length * rng.lognormal(0, 0.35, count) / metres[:, 1]
    ends = rows + rng.normal(0.15, 0.25, count)
    row = np.where((kind > 1 - TIPS), ends - reach * rng.uniform(0.3, 1, count), row)
    row = np.clip(row + rng.normal(0, 0.4, count), 0, rows - 1)
    stop = np.minimum(row + reach, ends)
    t = np.linspace(0, 1, STEPS)
    rows_at = row[:, None] + (stop - row)[:, None] * t
    lean = rng.normal(0, 0.25, count) + rng.normal(0, 0.9, count)[lock] / (1 + 2 * on_head)
    bow = rng.normal(0, 0.3, count)[lock][:, None] * np.sin(np.pi * t)
    column = column[:, None] + 0.5 * lean[:, None] * t**1.5 + 0.5 * bow
    column = column + _waved(worn, sheet, column, rows_at, rng)
    kept = (stop - row) * metres[:, 1] > 0.006
    faint = rng.uniform(0.25, 1.0, count)
    strength = 1 + (faint[:, None] - 1) * t
    width = rng.uniform(*widths, count)
    return [sheet.lines(STRAND, column[kept], rows_at[kept], strength[kept], width[kept])]


def _waved(
    worn: Worn, sheet: Sheet, column: NDArray, row: NDArray, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(n, k) columns that waves move strands aside: neighbours wave together."""
    wave = max(worn.cut.wave, 0.5 * worn.cut.curl)
    if not wave:
        return np.zeros(column.shape)
    metres = sheet.at(sheet.metres, column, row)
    down = row * metres[..., 1]
    azimuth = 2 * np.pi * column / len(sheet.points)
    phase = 2 * np.pi * down / WAVELENGTH + wave_phase(azimuth)
    rising = np.clip(down / 0.05, 0, 1)
    return 0.006 * wave * rising * np.sin(phase) / np.maximum(metres[..., 0], 0.004)


def _brushed(sheet: Sheet, scale: float, pen: float, rng: np.random.Generator) -> LineSet:
    """Strokes of a full brush side by side along the hair, with a band of light left out."""
    columns, rows = sheet.points.shape[:2]
    gap = LANE[0] + LANE[1] * pen
    around = float(sheet.metres[..., 0].sum(axis=0).max())
    count = max(int(around * scale / gap), 8)
    column = (np.arange(count) + rng.normal(0, 0.15, count)) * columns / count
    t = np.linspace(0, 1, 2 * STEPS)
    row = (rows - 1 + rng.normal(0, 0.2, count)[:, None]) * t
    bend = 0.25 * np.sin(3 * t + rng.uniform(0, 6))
    strength = np.ones((count, len(t)))
    if rng.random() < SHINE:
        angle = 2 * np.pi * column / columns
        wander = np.sin(2 * angle + rng.uniform(0, 6)) + 0.6 * np.sin(5 * angle)
        middle = rng.uniform(0.25, 0.5) + 0.06 * wander + 0.04 * rng.normal(size=count)
        half = np.maximum(rng.uniform(0.03, 0.15) + 0.06 * rng.normal(size=count), 0)
        half = half * (np.sin(angle * rng.integers(1, 3) + rng.uniform(0, 6)) > -0.5)
        strength[np.abs(t - middle[:, None]) < half[:, None]] = 0
    width = np.full(count, 1.5 * gap / pen)
    return sheet.lines(MASS, column[:, None] + bend, row, strength, width)


def _curls(sheet: Sheet, rng: np.random.Generator) -> list[LineSet]:
    """Open loops all over the surface."""
    size = rng.uniform(0.0055, 0.0115)
    count = int(sheet.area.sum() / (size**2 * rng.uniform(3.5, 16)))
    if count < 1:
        return []
    column, row = sheet.seeds(count, rng)
    metres = sheet.at(sheet.metres, column, row)
    turns = rng.choice([-1, 1], (count, 1)) * rng.uniform(0.3, 1.0, count)[:, None]
    angle = 2 * np.pi * (turns * np.linspace(0, 1, STEPS) + rng.random((count, 1)))
    shrink = np.linspace(1, 0.35, STEPS) * size * rng.uniform(0.6, 1.3, count)[:, None]
    wide = np.minimum(shrink / np.maximum(metres[:, :1], 0.002), 1.5)
    tall = np.minimum(shrink / metres[:, 1:], 1.5)
    around = column[:, None] + wide * np.cos(angle)
    down = np.clip(row[:, None] + tall * np.sin(angle), 0, sheet.points.shape[1] - 1)
    strength = np.ones(angle.shape) * rng.uniform(0.5, 1, count)[:, None]
    return [sheet.lines(STRAND, around, down, strength, rng.uniform(0.6, 1.0, count))]


def _plaits(worn: Worn) -> list[LineSet]:
    """Where the strands of braids cross: see facs_rig.hair.tails."""
    sets = []
    for sheet, ball in zip(worn.sheets[1:], worn.cut.balls, strict=True):
        if not ball.plait:
            continue
        sides, rings = sheet.points.shape[:2]
        length = np.concatenate([[0.0], np.cumsum(sheet.metres[:, :, 1].mean(axis=0))])[:rings]
        turn = np.linspace(-np.pi / 2, np.pi / 2, STEPS)
        for side in (0.0, np.pi):
            aside = np.sin(turn + np.pi / 2 + side) * np.sign(np.cos(side) + 1e-9)
            pitch = PITCH * float(np.mean(ball.radius))
            count = int(length[-1] / pitch) + 1
            shift = 0.5 if side == 0 else 0.0
            begins = (np.arange(count) - shift)[:, None] * pitch
            down = begins + SLANT * pitch / np.pi * np.abs(aside)
            row = np.interp(down, length, np.arange(rings))
            column = np.broadcast_to((turn + np.pi / 2 + side) * sides / (2 * np.pi), row.shape)
            inside = (down > 0) & (down < length[-1])
            sets.append(
                sheet.lines(STRAND, column, row, inside * 1.0, np.full(count, 0.9))
            )  # fmt: skip
    return sets
