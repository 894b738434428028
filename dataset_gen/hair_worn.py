"""A head of hair on a posed face, and its surface, in which lines are drawn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.common.derived import derived
from facs_rig.hair.cut import Cut
from facs_rig.hair.follow import scalp
from facs_rig.hair.head import WIDEST, measured
from facs_rig.hair.shell import Shell, edge_heights, shell_on
from facs_rig.levels import at_level, kept_by

from .hairdo import Hairdo
from .linework.curvature import ready
from .linework.kernels import kernels
from .linework.strokes import LineSet

COLUMNS, ROWS = 48, 14  # of the surface: half of what an artist's mesh has
LOW = 3.0  # times the lift of other lines, of those on the surface: it is coarse


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
