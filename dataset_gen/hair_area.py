"""Where hair lies on a page: its pixels, how dark they are, their outlines, and what fills them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes, gaussian_filter, label

from facs_rig import Camera, FaceRig
from facs_rig.levels import at_level

from .conventions.canvas import Canvas
from .hair_lines import MASS, STRAND, Worn
from .linework.kernels import kernels
from .linework.strokes import Stroke
from .linework.zero_sets import chains

CELL = 2  # pixels to a side of the cells that outlines go around
LEAST = 8  # cells: smaller parts and holes of hair are left out
THINNED = 2  # of the points of an outline, every so many are kept
LIGHTEST = 0.25  # darkness of blond hair in graphite, where black hair's is 1
LAMP = np.array([-0.45, 0.65, 0.6])  # where hair shines


@dataclass(frozen=True)
class Area:
    """Hair as it is seen on a page.

    mask : (h, w) bool;  dark : (h, w) float32, 0 to 1, how dark it is there
    """

    mask: NDArray[np.bool_]
    dark: NDArray[np.float32]

    def outlines(self) -> list[NDArray[np.float64]]:
        """Its outlines (k, 2) in pixels, a closed one for each part; painted, each is that part.

        A hole is gone around as well, on a way out of the outline to it and back.
        """
        h, w = (-(-n // CELL) for n in self.mask.shape)
        cells = np.zeros((h * CELL, w * CELL), dtype=np.float32)
        cells[: self.mask.shape[0], : self.mask.shape[1]] = self.mask
        cells = cells.reshape(h, CELL, w, CELL).mean(axis=(1, 3)) >= 0.5
        cells = _without_specks(~_without_specks(~cells))
        parts, count = label(cells)
        out = []
        for k in range(1, count + 1):
            part = parts == k
            outer = binary_fill_holes(part)
            whole = max(_loops(outer), key=len)
            for hole in _loops(outer & ~part):
                whole = _joined(whole, hole)
            out.append(CELL * whole)
        return out


def area_of(worn: Worn, rig: FaceRig, vertices: NDArray, camera: Camera) -> Area:
    """What the camera sees of hair on a posed face (n, 3), by the face's lightest mesh."""
    few = at_level(rig, "game")
    points = np.concatenate([vertices[few.of_full], worn.points])
    triangles = np.concatenate([few.triangles, worn.shell.triangles + few.n_vertices])
    pixels = np.ascontiguousarray(camera.project(points), dtype=float)
    shape = camera.height, camera.width
    own = pixels[few.n_vertices :]
    low = np.clip(np.floor(own.min(axis=0)), 0, shape[::-1]).astype(int)
    high = np.clip(np.ceil(own.max(axis=0)), 0, shape[::-1]).astype(int)
    v, u = np.mgrid[low[1] : high[1], low[0] : high[0]]
    places = np.stack([u.ravel(), v.ravel()], axis=1) + 0.5
    _, owner = kernels().topmost(
        pixels, np.ascontiguousarray(points[:, 2], dtype=float),
        np.ascontiguousarray(triangles, dtype=np.int32), places,
    )  # fmt: skip
    mask, dark = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=np.float32)
    hair = owner >= len(few.triangles)
    mask[low[1] : high[1], low[0] : high[0]] = hair.reshape(u.shape)
    a, b, c = (worn.points[worn.shell.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    lit = np.clip(normal @ (LAMP / np.linalg.norm(LAMP)), 0, 1) ** 2
    darkness = LIGHTEST + (1 - LIGHTEST) * worn.hairdo.colour
    shade = np.zeros(len(owner), dtype=np.float32)
    shade[hair] = (darkness * (1 - 0.6 * lit))[owner[hair] - len(few.triangles)]
    dark[low[1] : high[1], low[0] : high[0]] = shade.reshape(u.shape)
    around = gaussian_filter(mask.astype(np.float32), 2.5)
    smooth = gaussian_filter(dark, 2.5) / np.maximum(around, 1e-6)
    return Area(mask, np.where(mask, smooth, 0).astype(np.float32))


def fill(area: Area, worn: Worn, pen: float, rng: np.random.Generator) -> list[Stroke]:
    """The strokes that blacken or hatch hair, for the finishes that do."""
    finish = worn.hairdo.finish
    if finish not in ("black", "hatch"):
        return []
    h, w = area.mask.shape
    page = np.array([[0, 0], [w, 0], [w, h], [0, h]], float)
    canvas = Canvas(w, h, pen, 0.0, rng)
    mask = area.mask
    if finish == "black":
        if rng.random() < 0.6:  # it shines where light falls on it
            lightest = np.quantile(area.dark[mask], rng.uniform(0.04, 0.16)) if mask.any() else 0
            mask = mask & (area.dark > lightest)
        canvas.blacken(page, float(rng.uniform(-1.4, 1.4)), area=mask, kind=MASS)
    else:
        sparse = float(rng.uniform(1.7, 3.2))
        canvas.blacken(page, float(rng.uniform(0.9, 2.2)), sparse, STRAND, area=mask)
    return canvas.strokes()


def _without_specks(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells (h, w) without parts of fewer than LEAST."""
    parts, _ = label(cells)
    return cells & (np.bincount(parts.ravel()) >= LEAST)[parts]


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
