"""Where hair lies on a page: its pixels, how dark they are, their outlines, and what fills them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from facs_rig import Camera, FaceRig
from facs_rig.levels import at_level, kept_by

from .conventions.canvas import Canvas
from .hair_strands import MASS, STRAND
from .hair_worn import Worn
from .linework.kernels import kernels
from .linework.strokes import Stroke
from .linework.zero_sets import chains

FILLED = ("black", "hatch")
CELL = 2  # pixels to a side of the cells that outlines go around
LEAST = 8  # cells: smaller parts and holes of hair are left out
THINNED = 2  # of the points of an outline, every so many are kept
LIGHTEST = 0.25  # darkness of blond hair in graphite, where black hair's is 1
SHINE, SOFT = 0.6, 2.5  # of its darkness that light takes, in graphite; pixels that it fades in
LAMP = np.array([-0.45, 0.65, 0.6])  # where hair shines


@dataclass(frozen=True)
class Area:
    """Hair as it is seen on a page.

    owner : (r, c) int32, which triangle of `worn.shell` is seen in each cell, -1 none
    cell : pixels to a side of these;  size : width and height of the page
    """

    owner: NDArray[np.int32]
    cell: int
    size: tuple[int, int]
    worn: Worn

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """(h, w) which pixels show hair."""
        return self._on_page(self.owner >= 0)

    @cached_property
    def dark(self) -> NDArray[np.float32]:
        """(h, w) 0 to 1, how dark hair is there, or near there: by its colour and its shine."""
        a, b, c = (self.worn.points[self.worn.shell.triangles[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        lit = np.clip(normal @ (LAMP / np.linalg.norm(LAMP)), 0, 1) ** 2
        darkness = LIGHTEST + (1 - LIGHTEST) * self.worn.hairdo.colour
        hair = self.owner >= 0
        shade = np.where(hair, np.append(darkness * (1 - SHINE * lit), 0)[self.owner], 0)
        around = gaussian_filter(hair.astype(float), SOFT / self.cell)
        shade = gaussian_filter(shade, SOFT / self.cell) / np.maximum(around, 1e-6)
        return self._on_page(shade).astype(np.float32)

    def _on_page(self, values: NDArray) -> NDArray:
        w, h = self.size
        return values.repeat(self.cell, axis=0).repeat(self.cell, axis=1)[:h, :w]

    def outlines(self) -> list[NDArray[np.float64]]:
        """Its outlines (k, 2) in pixels, a closed one for each part; painted, each is that part.

        A hole is gone around as well, on a way out of the outline to it and back.
        """
        step = CELL // self.cell
        loops = [loop for loop in _loops(self.owner[::step, ::step] >= 0) if _size(loop) >= LEAST]
        loops.sort(key=_size, reverse=True)
        around = [
            [k for k in range(n) if _holds(loops[k], loop[0])] for n, loop in enumerate(loops)
        ]
        out = {n: loops[n] for n, outer in enumerate(around) if not len(outer) % 2}
        for n, outer in enumerate(around):
            if len(outer) % 2:
                out[outer[-1]] = _joined(out[outer[-1]], loops[n])
        return [CELL * loop for loop in out.values()]


def area_of(worn: Worn, rig: FaceRig, vertices: NDArray, camera: Camera) -> Area:
    """What the camera sees of hair on a posed face (n, 3), by the face's lightest mesh."""
    few = at_level(rig, "game")
    points = np.concatenate([kept_by(few, vertices), worn.points])
    triangles = np.concatenate([few.triangles, worn.shell.triangles + few.n_vertices])
    cell = 1 if worn.hairdo.finish in FILLED else CELL
    pixels = np.ascontiguousarray(camera.project(points) / cell, dtype=float)
    w, h = -(-camera.width // cell), -(-camera.height // cell)
    own = pixels[few.n_vertices :]
    low = np.clip(np.floor(own.min(axis=0)), 0, (w, h)).astype(int)
    high = np.clip(np.ceil(own.max(axis=0)), 0, (w, h)).astype(int)
    v, u = np.mgrid[low[1] : high[1], low[0] : high[0]]
    _, seen = kernels().topmost(
        pixels, np.ascontiguousarray(points[:, 2], dtype=float),
        np.ascontiguousarray(triangles, dtype=np.int32),
        np.stack([u.ravel(), v.ravel()], axis=1) + 0.5,
    )  # fmt: skip
    owner = np.full((h, w), -1, dtype=np.int32)
    seen = np.maximum(seen - len(few.triangles), -1).reshape(u.shape)
    owner[low[1] : high[1], low[0] : high[0]] = seen
    return Area(owner, cell, (camera.width, camera.height), worn)


def fill(area: Area, camera: Camera, pen: float, rng: np.random.Generator) -> list[Stroke]:
    """The strokes that blacken or hatch hair, for the finishes that do."""
    finish = area.worn.hairdo.finish
    if finish not in FILLED:
        return []
    h, w = area.mask.shape
    page = np.array([[0, 0], [w, 0], [w, h], [0, h]], float)
    canvas = Canvas(w, h, pen, 0.0, rng)
    if finish == "black":
        for band in _shine(area.worn, camera, rng):
            canvas.cover(band)
        canvas.blacken(page, float(rng.uniform(-1.4, 1.4)), area=area.mask, kind=MASS)
    else:
        sparse = float(rng.uniform(1.7, 3.2))
        canvas.blacken(page, float(rng.uniform(0.9, 2.2)), sparse, STRAND, area=area.mask)
    return canvas.strokes()


def _shine(worn: Worn, camera: Camera, rng: np.random.Generator) -> list[NDArray[np.float64]]:
    """Outlines (k, 2) of jagged bands across the strands that stay white in black hair."""
    sheet, bands = worn.sheets[0], []
    columns, rows = sheet.points.shape[:2]
    for _ in range(int(rng.integers(0, 4))):
        wide = int(rng.integers(4, 14))
        column = rng.uniform(0, columns) + np.linspace(0, wide, 3 * wide) * columns / 48
        middle = (rows - 1) * (rng.uniform(0.25, 0.55) + 0.04 * np.sin(column))
        lens = np.sin(np.linspace(0, np.pi, len(column))) * (rows - 1) * rng.uniform(0.03, 0.1)
        edges = [middle + side * lens * rng.uniform(0.1, 1, len(column)) for side in (-1, 1)]
        rim = np.concatenate([column, column[::-1]]), np.concatenate([edges[0], edges[1][::-1]])
        points, normals = (sheet.at(table, *rim) for table in (sheet.points, sheet.normals))
        if (np.einsum("ij,ij->i", normals, camera.view_vectors(points)) > 0).all():
            bands.append(camera.project(points))
    return bands


def _size(loop: NDArray) -> float:
    """How many cells a closed line (k, 2) goes around."""
    x, y = loop.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def _holds(loop: NDArray, point: NDArray) -> bool:
    """Whether a point (2,) lies within a closed line (k, 2): a ray from it crosses it oddly."""
    a, b = loop - point, np.roll(loop, -1, axis=0) - point
    crossed = (a[:, 1] > 0) != (b[:, 1] > 0)
    a, b = a[crossed], b[crossed]
    right = a[:, 0] - a[:, 1] * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1]) > 0
    return bool(np.count_nonzero(right) % 2)


def _loops(cells: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    """The closed lines (k, 2), in cells, between cells (h, w) and others; corners are cut."""
    h, w = cells.shape
    padded = np.pad(cells, 1)
    up, left = padded[:-1, 1:-1] != padded[1:, 1:-1], padded[1:-1, :-1] != padded[1:-1, 1:]
    row, column = np.nonzero(up)
    level = np.stack([row * (w + 1) + column, row * (w + 1) + column + 1], axis=1)
    row, column = np.nonzero(left)
    upright = np.stack([row * (w + 1) + column, (row + 1) * (w + 1) + column], axis=1)
    used, segments = np.unique(np.concatenate([level, upright]), return_inverse=True)
    line, starts = chains(segments.reshape(-1, 2))
    at = np.stack(np.divmod(used[line], w + 1)[::-1], axis=1).astype(float)
    out = []
    for a, b in zip(starts[:-1], starts[1:], strict=True):
        corners = at[a:b]
        loop = (corners[:-1] + corners[1:]) / 2
        out.append(loop[::THINNED] if len(loop) > 12 else loop)
    return out


def _joined(whole: NDArray, hole: NDArray) -> NDArray[np.float64]:
    """One closed line (k, 2) around a shape and a hole in it, by a way there and back."""
    away = np.linalg.norm(whole[:, None] - hole[None], axis=2)
    i, j = np.unravel_index(away.argmin(), away.shape)
    around = np.concatenate([hole[j:], hole[: j + 1]])
    return np.concatenate([whole[: i + 1], around, whole[i:]])
