"""The lines of a head of hair on a posed face: its outline, its edge, its parting, its strands."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from facs_rig import Camera
from facs_rig.mesh import corner_matrix

from .hair_strands import STRANDS, brushed, curls, plaits, strands
from .hair_worn import Worn
from .linework.kernels import kernels
from .linework.strokes import LineSet
from .linework.topology import Topology
from .linework.zero_sets import chains, zero_set

EDGE = "hair_edge"  # a kind of strokes
LIFT = 10.0  # times the lift of other lines: a smoothed outline lies in or out of coarse hair
FINER = 4  # points of an outline from one edge of the mesh to the next


def hair_lines(worn: Worn, camera: Camera, pen: float, rng: np.random.Generator) -> list[LineSet]:
    """All lines of hair, hidden or not. pen : pixels, width of a full line"""
    finish = worn.hairdo.finish
    near = float(camera.relative_depth(worn.points).mean())
    scale = float(np.mean(camera.scale)) / near  # pixels of a metre
    edges, inside = _outline(worn, camera, rng) + _edges(worn, rng), []
    for k, sheet in enumerate(worn.sheets):
        if k and worn.cut.balls[k - 1].plait:
            inside += [brushed(sheet, scale, pen, rng)] if finish == "brush" else []
            continue
        if finish == "curls":
            inside += curls(sheet, rng)
            continue
        if finish == "brush":
            inside.append(brushed(sheet, scale, pen, rng))
        if finish in STRANDS:
            inside += strands(worn, sheet, scale, rng, on_head=not k)
    if worn.falls.any() and finish != "outline":  # what hangs down behind the neck, from within
        sheet = worn.inner
        inside += [brushed(sheet, scale, pen, rng)] if finish == "brush" else []
        inside += strands(worn, sheet, scale, rng, on_head=True) if finish in STRANDS else []
    inside += plaits(worn)
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
