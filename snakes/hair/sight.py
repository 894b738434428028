"""A head as a camera sees it, beside the hair on its page: what is covered, and how far out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_opening

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.curves import head_frame
from facs_rig.hair.cut import ANGLES, AZIMUTHS
from facs_rig.hair.head import WIDEST, Head
from facs_rig.hair.shell import Shell

from .region import PageHair

__all__ = ["Outline", "Sight", "bilinear", "direction"]

RAYS, LEVELS, LEVEL = 48, 64, 0.007
"""Rays over the half of an outline above the head's middle, levels to each side below it, and
metres from one to the next."""
FINER = (2, 4)
"""Places of a surface between two columns, and between two rows, that its outline is made of."""
KNOT = (11, 0.025)
"""Rays side by side that a knot of hair is narrower than, and metres by which it juts out."""
EAR, BEHIND_EAR, OFF = (0.1, -0.2), np.radians(88), (0.012, 0.0, -0.01)
"""Heights of the middle of an ear, its azimuth, and metres that it stands off; drawn heads are
narrower."""
CHIN, TAIL = 0.13, 0.062
"""Metres from the head's middle down to the mouth, and the width of a wide tail."""
RIM = (np.radians(62), np.radians(125))
"""Azimuths from the view between which something hangs that is seen beside the head."""
CHEEKS, BACK = np.radians(58), 0.15
"""Radians from the front to which the cheeks reach, and what it counts for hair in front of there
that it is seen beside the head."""
LINE, TEMPLE = 1.5, 0.5
"""Cells that a drawn hairline at the head's outline may be wide, and the height below which it is
at the temples."""
SPANNED = 0.8
"""Share of the rays over the top on which hair that goes from side to side is seen."""
AXIS = 0.03
"""Metres from the head's axis from which on hair is beside the face."""
BESIDE = 0.055
"""Metres beside the head's axis where what hangs is no beard and no collar."""


@dataclass(frozen=True)
class Outline:
    """How far out something reaches on the page, as seen from the head's middle.

    far : (RAYS + 2 LEVELS,) metres: along rays from the picture's left over the top to its right,
        then beside the axis at levels downwards, left and right; -inf where there is nothing
    cut : the same, bool, where it leaves the picture
    """

    far: NDArray[np.float64]
    cut: NDArray[np.bool_]

    @property
    def spans(self) -> bool:
        """Whether there is something over the head from one side to the other."""
        top = self.far[RAYS // 3 : -(-2 * RAYS // 3)]
        return bool(np.isfinite(top).mean() > SPANNED)

    def without_knots(self) -> Outline:
        """The same without what juts out of it narrowly, as buns do."""
        rays = self.far[:RAYS]
        flat = grey_opening(np.where(np.isfinite(rays), rays, 0), KNOT[0], mode="nearest")
        juts = rays - flat > KNOT[1]
        return replace(self, far=np.append(np.where(juts, flat, rays), self.far[RAYS:]))


@dataclass(frozen=True, eq=False)
class Sight:
    """A posed head in front of a camera.

    linear, shift : (3, 3) and (3,), from the upright head to where it is, x @ linear + shift
    up : (2,) unit, cells: where the head's crown is on the page;  middle : (2,) its middle
    unit : cells to a metre at its middle
    """

    page: PageHair
    head: Head
    camera: Camera
    linear: NDArray[np.float64]
    shift: NDArray[np.float64]
    up: NDArray[np.float64]
    middle: NDArray[np.float64]
    unit: float

    @classmethod
    def of(
        cls, page: PageHair, rig: FaceRig, parameters: FaceParameters, vertices: NDArray,
        camera: Camera, head: Head,
    ) -> Sight:  # fmt: skip
        rest = rig.neutral(parameters.identity)
        anchors, axes = head_frame(rig.neutral(), rig.parts["skin"])
        linear = np.linalg.inv(axes @ rest[anchors]) @ (axes @ vertices[anchors])
        shift = vertices[anchors].mean(axis=0) - rest[anchors].mean(axis=0) @ linear
        places = np.stack([head.middle, head.middle + [0, 0.1, 0]]) @ linear + shift
        middle, above = page.cells(camera.project(places))
        depth = float(camera.relative_depth(places[:1])[0])
        up = above - middle
        length = np.linalg.norm(up)
        up = up / length if length > 1e-6 else np.array([0.0, -1.0])
        size = float(np.linalg.norm(linear, axis=1).mean())
        unit = size * camera.scale[0] / depth / page.cell
        return cls(page, head, camera, linear, shift, up, middle, unit)

    def cells(self, points: NDArray) -> NDArray[np.float64]:
        """(..., 2) columns and rows of the page's grid of upright points (..., 3)."""
        return self.page.cells(self.camera.project(points @ self.linear + self.shift))

    def metres(self, cells: NDArray) -> NDArray[np.float64]:
        """(k, 2) of cells (k, 2), metres on the page, right and up, from the head's middle."""
        right = np.array([-self.up[1], self.up[0]])
        away = np.asarray(cells, float) - self.middle
        return np.stack([away @ right, away @ self.up], axis=1) / self.unit

    def at(self, metres: NDArray) -> NDArray[np.float64]:
        """The reverse of `metres`."""
        right = np.array([-self.up[1], self.up[0]])
        return self.middle + self.unit * (np.asarray(metres, float) @ np.stack([right, self.up]))

    @property
    def directions(self) -> NDArray[np.float64]:
        """(2, 3) how far right and up on the page a metre leads to the upright head's left, up and
        to its front."""
        ways = 0.1 * np.eye(3)
        ends = self.metres(self.cells(self.head.middle + np.concatenate([ways, -ways])))
        return ((ends[:3] - ends[3:]) / 0.2).T

    @property
    def toward(self) -> NDArray[np.float64]:
        """(3,) unit vector from the upright head's middle to the camera."""
        middle = self.head.middle @ self.linear + self.shift
        toward = self.linear @ self.camera.view_vectors(middle[None])[0]
        return toward / np.linalg.norm(toward)

    @property
    def azimuth(self) -> float:
        """Where on the upright head the camera stands, radians."""
        x, _, z = self.toward
        return float(np.arctan2(x, z))

    # --- the head's skin ---------------------------------------------------------------------

    def surface(self, heights: NDArray, falls: bool, stand: NDArray) -> NDArray[np.float64]:
        """(48, k, 3) upright places so far (48,) off the skin, or off what falling hair keeps."""
        head, metres = self.head, self.head.metres(heights)
        far = head.levels(head.axis, ANGLES[:, None], metres)
        if falls:
            widest = head.middle[1] - head.eyes[1]
            hull = head.levels(head.hull, ANGLES[:, None], metres)
            most = head.levels(head.axis, ANGLES, np.full(len(ANGLES), widest))[:, None]
            far = np.where(metres < widest, np.maximum(hull, most), far)
        far = far + stand[:, None]
        x, z = (turn(ANGLES)[:, None] * far for turn in (np.sin, np.cos))
        y = np.broadcast_to(metres + head.eyes[1], far.shape)
        return np.stack([x + head.eyes[0], y, z + head.middle[2]], axis=-1)

    def covered(
        self, heights: NDArray, falls: bool, stand: NDArray, facing: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Whether hair covers the head at azimuths and heights, and how well that is seen: (48, k).

        facing : cosine to the view from which on a place is seen
        """
        points = self.surface(heights, falls, stand)
        posed = points @ self.linear + self.shift
        around = np.roll(posed, -1, axis=0) - np.roll(posed, 1, axis=0)
        normal = np.cross(np.gradient(posed, axis=1), around)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
        toward = self.camera.view_vectors(posed.reshape(-1, 3)).reshape(posed.shape)
        slope = np.einsum("akd,akd->ak", normal, toward)
        at = np.round(self.page.cells(self.camera.project(posed))).astype(int)
        height, width = self.page.hair.shape
        inside = ((at >= 0) & (at < (width, height))).all(axis=-1)
        u, v = np.clip(at[..., 0], 0, width - 1), np.clip(at[..., 1], 0, height - 1)
        step = np.abs(np.gradient(self.head.metres(heights))) / 0.005
        weight = np.clip((slope - facing) / 0.3, 0, 1) * inside * np.minimum(step, 1)
        hair = self.page.hair[v, u]
        if not falls:  # lines at the temples are as wide as much of what lies beside them
            aside = np.rint(LINE * np.sin(ANGLES - self.azimuth))[:, None].astype(int)
            right = np.array([-self.up[1], self.up[0]])
            u, v = (np.clip(k - np.rint(aside * r).astype(int), 0, n - 1)
                    for k, r, n in ((u, right[0], width), (v, right[1], height)))  # fmt: skip
            hair = np.where(heights < TEMPLE, hair & self.page.hair[v, u], hair)
        # What is seen beside the cheeks may as well hang farther back.
        front = np.abs((ANGLES + np.pi) % (2 * np.pi) - np.pi) < CHEEKS
        beside = hair & ~self.page.head[v, u] & front[:, None] & (heights < WIDEST)
        return hair.astype(float), np.where(beside, BACK * weight, weight)

    def azimuth_at(self, place: NDArray, edge: NDArray) -> float | None:
        """Radians at which a cut's edge (48,) is nearest to a pixel of the page, in front."""
        front = np.abs((ANGLES + np.pi) % (2 * np.pi) - np.pi) < np.radians(60)
        head = self.head
        metres = head.metres(edge)
        far = head.levels(head.axis, ANGLES, metres)
        points = np.stack([np.sin(ANGLES) * far + head.eyes[0], metres + head.eyes[1],
                           np.cos(ANGLES) * far + head.middle[2]], axis=-1)  # fmt: skip
        away = np.linalg.norm(self.cells(points) - self.page.cells(place), axis=1)
        found = ANGLES[np.where(front, away, np.inf).argmin()]
        return float((found + np.pi) % (2 * np.pi) - np.pi)

    # --- outlines ----------------------------------------------------------------------------

    def _polar(self, cells: NDArray) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """The ray or level of places (k, 2) of the grid, -1 below all, and metres out along it."""
        x, y = self.metres(cells).T
        ray = np.clip(np.floor((np.arctan2(x, y) / np.pi + 0.5) * RAYS), 0, RAYS - 1)
        level = np.floor(-y / LEVEL)
        side = np.where(x < 0, RAYS, RAYS + LEVELS)
        at = np.where(y >= 0, ray, np.where(level < LEVELS, side + level, -1)).astype(np.intp)
        return at, np.where(y >= 0, np.hypot(x, y), np.abs(x))

    def outline_of_region(self) -> Outline:
        """How far the hair on the page reaches: to the middles of its outermost cells, since what a
        drawing's region ends with is half of a line's width too much."""
        hair = self.page.hair
        v, u = np.nonzero(hair)
        at, away = self._polar(np.stack([u, v], axis=1).astype(float))
        edge = (u == 0) | (v == 0) | (u == hair.shape[1] - 1) | (v == hair.shape[0] - 1)
        far = np.full(RAYS + 2 * LEVELS + 1, -np.inf)
        np.maximum.at(far, at, away)
        cut = np.zeros(len(far), dtype=bool)
        cut[at[edge]] = True
        return Outline(far[:-1], cut[:-1])

    def shortfall(self, hair: Shell, outline: Outline) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Where a surface's own outline is, and how far the region reaches beyond it.

        Returns (m,) azimuth and share of the way from parting to edge, (m,) metres, and whether
        both are known there.
        """
        azimuth, share, at, away = self._sheet(hair)
        order = np.lexsort((away, at))
        last = np.append(np.flatnonzero(np.diff(at[order])), len(order) - 1)
        outer = order[last]
        outer = outer[at[outer] >= 0]
        there = outline.far[at[outer]]
        known = np.isfinite(there) & ~outline.cut[at[outer]]
        i, j = np.divmod(outer, len(share))
        short = np.where(known, there - away[outer], 0.0)
        return azimuth[i], share[j], short, known

    def beyond(self, hair: Shell) -> NDArray[np.float64]:
        """(h, w) metres by which hair on the page lies outside of a surface, 0 where it does not
        and where there is none."""
        _, _, at, away = self._sheet(hair)
        far = np.zeros(RAYS + 2 * LEVELS + 1)
        np.maximum.at(far, at, away)
        out = np.zeros(self.page.hair.shape)
        v, u = np.nonzero(self.page.hair)
        at, away = self._polar(np.stack([u, v], axis=1).astype(float))
        out[v, u] = np.where(at >= 0, np.maximum(away - far[at], 0), 0)
        return out

    def ends(self, hair: Shell) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Azimuths (k,) along a surface's edge, and its cells (k, 2) there."""
        edge = hair.points[hair.outer[:, -1]].astype(float)
        column = np.arange(len(edge) * FINER[0]) / FINER[0]
        edge = _between(np.concatenate([edge, edge[:1]]), column, axis=0)
        turn = np.append(hair.azimuth, 2 * np.pi)
        return np.interp(column, np.arange(len(turn)), turn), self.cells(edge)

    def _sheet(self, hair: Shell) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Azimuths (c,) and shares (r,) of a fine grid on a surface's outer sheet, and the ray and
        the metres out (c r,) of its places."""
        across, down = FINER
        sheet = hair.points[hair.outer].astype(float)
        columns, rows = sheet.shape[:2]
        row = np.linspace(0, rows - 1, (rows - 1) * down + 1)
        sheet = _between(sheet, row, axis=1)
        column = np.arange(columns * across) / across
        sheet = _between(np.concatenate([sheet, sheet[:1]]), column, axis=0)
        turn = np.append(hair.azimuth, 2 * np.pi)
        azimuth = np.interp(column, np.arange(columns + 1), turn)
        return azimuth, row / (rows - 1), *self._polar(self.cells(sheet).reshape(-1, 2))

    def lowest(self, outline: Outline, side: int) -> float:
        """The height down to which hair hangs at the picture's left (-1) or right (1)."""
        first = RAYS if side < 0 else RAYS + LEVELS
        far = outline.far[first : first + LEVELS]
        levels = np.flatnonzero(far > BESIDE)
        if not len(levels):
            return WIDEST
        run = np.flatnonzero(np.diff(levels) > 4)
        level = levels[run[0]] if len(run) else levels[-1]
        widest = self.head.middle[1] - self.head.eyes[1]
        return float(self.head.height(widest - (level + 1) * LEVEL / self._upright))

    def fullness(self, side: int, heights: tuple[float, ...]) -> float:
        """Metres that hair at the picture's left (-1) or right (1) is wide between two of these
        heights (falling), the most: of a few strands and of what ends above them that is little."""
        at, away = self._polar(np.argwhere(self.page.hair)[:, ::-1].astype(float))
        first = RAYS + (LEVELS if side > 0 else 0)
        beside = (at >= first) & (at < first + LEVELS) & (away > AXIS)
        widest = self.head.middle[1] - self.head.eyes[1]
        height = self.head.height(widest - (at[beside] - first + 0.5) * LEVEL / self._upright)
        cells = np.histogram(-height, -np.array(heights))[0]
        tall = -np.diff(np.array(heights)) * self.head.below * self._upright
        return float((cells / self.unit**2 / tall).max())

    def is_mane(self, side: int) -> bool:
        """Whether what hangs at the picture's left (-1) or right (1) falls from the whole side: it
        covers the ear, or is wider than a tail."""
        at, away = self._polar(np.argwhere(self.page.hair)[:, ::-1].astype(float))
        first = RAYS + (LEVELS if side > 0 else 0) + int(CHIN / LEVEL)
        below = (at >= first) & (at < first + LEVELS - int(CHIN / LEVEL)) & (away > BESIDE)
        wide = np.unique(at[below], return_counts=True)[1] / (LEVEL * self.unit**2)
        return bool(len(wide) and np.quantile(wide, 0.75) > TAIL) or self._over_ear(side)

    def _over_ear(self, side: int) -> bool:
        """Whether hair is drawn where the ear is at a side, or where it is behind the cheek."""
        heights, height, width = np.linspace(*EAR, 8), *self.page.hair.shape
        ear = np.abs(ANGLES - side * BEHIND_EAR % (2 * np.pi)).argmin()
        rings = [self.surface(heights, False, np.full(len(ANGLES), off))[ear] for off in OFF]
        at = np.round(self.cells(np.array(rings))).astype(int)
        u, v = np.moveaxis(np.clip(at, 0, (width - 1, height - 1)), -1, 0)
        return bool(self.page.hair[v, u].any(axis=0).mean() > 0.5)

    @property
    def _upright(self) -> float:
        """How long an upright metre is on the page."""
        places = np.stack([self.head.middle, self.head.middle + [0, -0.1, 0]])
        above, below = self.cells(places)
        return max(float(np.linalg.norm(above - below)) / (0.1 * self.unit), 0.3)

    @property
    def drop(self) -> float:
        """Metres on the page of a unit of height below the eyes."""
        return self.head.below * self._upright

    def rim(self, side: int) -> NDArray[np.bool_]:
        """(48,) azimuths at which hair is seen beside the head, at the picture's left or right."""
        away = (ANGLES - self.azimuth + np.pi) % (2 * np.pi) - np.pi
        return (side * away > RIM[0]) & (side * away < RIM[1])


def direction(azimuth: NDArray) -> NDArray[np.float64]:
    """(..., 2) unit vectors to the head's left and to its front."""
    return np.stack([np.sin(azimuth), np.cos(azimuth)], axis=-1)


def _between(values: NDArray, at: NDArray, axis: int) -> NDArray[np.float64]:
    """Values at places between those along an axis."""
    low = np.minimum(at.astype(int), values.shape[axis] - 2)
    share = np.expand_dims(at - low, tuple(k for k in range(values.ndim) if k != axis))
    return np.take(values, low, axis) * (1 - share) + np.take(values, low + 1, axis) * share


def bilinear(azimuth: NDArray, share: NDArray, steps: int) -> NDArray[np.float64]:
    """(m, 48 steps) weights of a thickness, at `cut.ANGLES` by equal steps, at places of a surface.

    azimuth : (m,) radians;  share : (m,) 0..1 of the way down it
    """
    column, step = azimuth * AZIMUTHS / (2 * np.pi), share * (steps - 1)
    left, low = np.floor(column).astype(int), np.minimum(step.astype(int), steps - 2)
    across, up = column - left, step - low
    out = np.zeros((len(azimuth), AZIMUTHS, steps))
    m = np.arange(len(azimuth))
    for i, a in ((left, 1 - across), (left + 1, across)):
        for j, b in ((low, 1 - up), (low + 1, up)):
            out[m, i % AZIMUTHS, j] += a * b
    return out.reshape(len(azimuth), -1)
