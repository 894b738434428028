"""The hat that looks like the hat on a page.

Its rim is a ring around the head: level, leaning to a side, or higher in front than behind, as far
as it is seen and as hats do. Its crown is blown up from the outline (`hat_crown`), and then stands
off the head so that its outline meets the region's (few waves around the head, each dearer than the
one before). What juts out of the crown narrowly is a brim, or a peak where it is at the side that
the head is turned to, hangs over the forehead, or is cut off by a line (`hat_band`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.hair.cut import ANGLES, AZIMUTHS, Cut
from facs_rig.hair.hat import Hat, crown_on
from facs_rig.hair.head import Head, head_of

from .cut_fit import EYES, LIDS, fit_cut
from .hat_band import line_across, with_band
from .hat_crown import inflated, is_cut, without_juts
from .region import ROWS, PageHair
from .sight import Outline, Sight, bilinear, direction

__all__ = ["fit_hat"]

LINES, FULL = 0.14, 0.2
"""How dark a hat of white paper is drawn by its lines alone, and how much less than wholly a black
one is."""
STEPS = 16
"""Steps of a crown's thickness, from its top to its rim."""
ROUNDS = 4
"""How often the crown is held against the region."""
HEIGHTS = np.linspace(0.97, -0.6, 53)
"""At which a hat is looked for on the head."""
STAND, NEAR = 0.02, 0.006
"""Metres that a hat stands off the head of which nothing is known, and so near to the skin that it
is within the hat, where its border is looked for."""
FACING = 0.15
"""Cosine between a surface and the view from which on it is seen."""
THIN, HIGH = 0.011, 0.26
"""Metres that a crown stands off at least and at most: hair has to lie under it."""
ROUND = 0.5
"""Share that a crown stands off alike all around, beside what its outline says."""
WAVES = (0.04, 0.5, 3.0)
"""What it costs that a crown is not round, by waves around it."""
BENDS = 0.02
"""What it costs that a crown bends from its top to its rim."""
LEAN = (0.16, 0.10)
"""Height by which a rim is higher in front, and lower behind, than at the sides, where nothing else
is known, and the spread of that."""
SIDEWAYS = 0.05
"""Height by which a rim is usually lower at one side than in the middle."""
TILTS = {1: (0.0, 0.36), 2: (-0.15, 0.15)}
"""Heights between which it is higher in front than at the sides, and at the left: hats do not lie
lower on the forehead than on the neck, and fall off where they lean farther."""
RIM = (-0.3, 0.86)
"""Heights between which a rim is."""
NARROW = 0.08
"""Heads from which on what juts out of a crown is part of the crown: half its width."""
JUTS = 0.02, 0.012
"""Metres from which on what juts out is a brim, not an uneven outline, and where a head is turned
to that side, so that a peak is seen."""
FRONT, BESIDE, SIDES = np.radians(25), np.radians([32, 50]), np.radians(50)
"""Radians from the front to which a peak hangs lowest, between which it hangs less, and from which
on it does not hide the rim."""
RISES = 0.006
"""Metres that the border is higher there than in front, under a peak."""
DROPS = 0.018
"""Metres that the border lies lower in front than the rim of the sides would, under a peak."""
COVERS = 0.85
"""Height down to which cloth that hangs covers a head at least."""
CLOTH, EDGE, TOP = (1.2, 0.7), 0.5, 0.25
"""Azimuths and steps over which a cloth's thickness is evened, azimuths over which its edge is, and
share of the way down from its top where it is about as thick from all sides."""
HANGS = 0.2
"""Share of a hat below the eyes from which on it is a hood or a scarf."""
PEAK = (0.062, np.radians(66))
"""Metres that a peak juts out whose border alone is seen, and radians to each side that it goes."""
TURNED = 0.12
"""Share of a metre to the front from which on it is seen what juts out there."""
PLACES, LENGTH = np.radians([0, 15, 30, 45]), (0.055, 0.085)
"""Radians from the front at which a peak may be, and metres that it juts out."""
DROOPS = (0.05, 0.8)
"""Metres that a peak's border lies lower for each metre that it juts out."""
BESIDE_HEAD = 0.006
"""Metres that the tip of a brim or a peak is seen beside the head."""
STRAY, ALIKE = 0.055, 0.35
"""Metres from the rim's height from which on what juts out is no brim, and the share of what juts
out at one side that does at the other, where it goes all around."""
BRIM = (0.025, 0.16)
"""Metres that a brim juts out."""
STEEPEST = 1.1
"""Metres that a brim's border lies lower for each metre that it juts out, at most."""
FALLS = 0.45
"""The same from which on what juts out at both sides is the foot of a wide crown, and no brim."""


def fit_hat(
    page: PageHair, rig: FaceRig, parameters: FaceParameters, vertices: NDArray, camera: Camera
) -> Hat | None:
    """The hat whose surface covers what a hat covers on a page, or None where that sits on no head.

    page : with the hat for hair, see `hat_region.page_hat`
    vertices : (n, 3) metres, the posed face of `parameters`;  camera : of the page's pixels
    """
    tone = float(np.clip((page.tone - LINES) / (1 - LINES - FULL), 0, 1))
    head = head_of(rig, parameters.identity)
    eyes = page.cells(camera.project(vertices[rig.parts["eyes"]])).mean(axis=0)
    if page.hair[max(int(eyes[1]), 0) :].sum() > HANGS * page.hair.sum():
        cut = fit_cut(page, rig, parameters, vertices, camera)
        return None if cut is None else Hat.hanging(_as_cloth(cut), tone)
    crown = _without_brim(page.hair)
    if not crown.any():
        return None
    sight = Sight.of(replace(page, hair=crown), rig, parameters, vertices, camera, head)
    found, sure = _border(sight)
    if sure.sum() < 2:
        return None
    edge = _ring(found, sure)
    juts = _juts(_trimmed(sight, edge), page.hair)
    drop, line = 0.0, line_across(page, sight)
    ahead = sight.directions[0, 2]
    if len(juts) == 1 and next(iter(juts)) * ahead > -TURNED:
        edge = _ring(found, np.where(_away(ANGLES) < SIDES, 0.05 * sure, sure))
    elif line.crescent and len(juts) < 2:
        drop = line.high
        edge = _ring(_above_peak(found, head, drop), sure)
    else:
        edge, drop = _rim(found, sure, head)
    edge = np.maximum(edge, LIDS - 4 * np.clip(_away(ANGLES) - EYES, 0, 1))
    sight = _trimmed(sight, edge)
    thick = _crown(sight, sight.outline_of_region(), edge)
    made = Hat(edge, thick, np.zeros(AZIMUTHS), 0.0, tone)
    return with_band(_with_brim(made, sight, page.hair, drop), line)


def _as_cloth(cut: Cut) -> Cut:
    """A cut as evenly thick as cloth lies, alike at its top from all sides."""
    thick = ndimage.gaussian_filter(cut.thick, CLOTH, mode=("wrap", "nearest"))
    top = np.clip(1 - np.arange(thick.shape[1]) / (TOP * thick.shape[1]), 0, 1)
    thick = thick + top * (thick.mean(axis=0) - thick)
    edge = ndimage.gaussian_filter1d(cut.edge, EDGE, mode="wrap")
    return replace(cut, edge=np.minimum(edge, COVERS), thick=thick, top=None)


def _without_brim(hat: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The largest piece of a region after what is narrow has been taken off."""
    reach = NARROW * ROWS
    room = np.pad(hat, 1)
    if is_cut(hat):  # a crown that leaves the page goes on there
        first = int(room.any(axis=1).argmax())
        room[:first] = room[first : first + 3].any(axis=0)
    depth = ndimage.distance_transform_edt(room)
    wide = ndimage.distance_transform_edt(depth <= reach) <= reach
    label, count = ndimage.label((wide & room)[1:-1, 1:-1] & hat)
    if not count:
        return np.zeros(hat.shape, dtype=bool)
    return label == 1 + np.bincount(label.ravel())[1:].argmax()


def _border(sight: Sight) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(48,) height at which the hat ends, and how well that is seen, 0 to 1."""
    covered, weight = sight.covered(HEIGHTS, False, np.full(AZIMUTHS, NEAR), FACING)
    seen = weight * (2 * covered - 1)
    above = np.concatenate([np.zeros((AZIMUTHS, 1)), np.cumsum(seen, axis=1)], axis=1)
    best = above.argmax(axis=1)
    between = np.concatenate([HEIGHTS[:1], (HEIGHTS[1:] + HEIGHTS[:-1]) / 2, HEIGHTS[-1:]])
    sure = np.clip(2 * weight[:, :36].mean(axis=1), 0, 1)
    inside = (best > 0) & (best < len(HEIGHTS))
    return between[best], np.where(inside & (sure > 0.1), sure, 0.0)


def _away(azimuth: NDArray) -> NDArray[np.float64]:
    return np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi)


def _trimmed(sight: Sight, edge: NDArray) -> Sight:
    return replace(sight, page=replace(sight.page, hair=without_juts(sight, edge)))


def _above_peak(found: NDArray, head: Head, high: float) -> NDArray[np.float64]:
    """(48,) heights of a border without a peak that is so many metres high in front."""
    share = np.cos(np.clip(_away(ANGLES) / PEAK[1], 0, 1) * np.pi / 2)
    return head.height(head.metres(found) + high * share)


def _rim(found: NDArray, sure: NDArray, head: Head) -> tuple[NDArray[np.float64], float]:
    """(48,) heights of the rim, and metres that the border hangs below it in front: a peak's."""
    away = _away(ANGLES)
    sides = np.where(away > SIDES, sure, 0.0)
    front = np.where(away < FRONT, sure, 0.0)
    drop = 0.0
    if sides.sum() > 0.5 and front.sum() > 0.5:
        level = _ring(found, sides)
        lower = head.metres(level) - head.metres(found)
        drop = float(np.average(lower, weights=front))
        beside = np.where((away > BESIDE[0]) & (away < BESIDE[1]), sure, 1e-6)
        low, high = (np.average(head.metres(found), weights=w) for w in (front, beside))
        drop = drop if high - low > RISES else 0.0
    if drop < DROPS:
        return _ring(found, sure), 0.0
    return level, drop


def _ring(found: NDArray, sure: NDArray) -> NDArray[np.float64]:
    """(48,) heights of a ring around the head through what was found, robustly."""
    ways = np.stack([np.ones(AZIMUTHS), np.cos(ANGLES), np.sin(ANGLES), np.cos(2 * ANGLES)], axis=1)
    usual, spread = np.array([0.3, LEAN[0], 0.0, 0.0]), np.array([3.0, LEAN[1], SIDEWAYS, 0.04])
    held = np.diag((0.05 / spread) ** 2)
    weight = sure.copy()
    for _ in range(5):
        rows = ways * weight[:, None]
        solved = np.linalg.solve(ways.T @ rows + held, rows.T @ found + held @ usual)
        off = np.abs(ways @ solved - found)
        weight = sure / (1 + (off / 0.08) ** 2)
    for k, (low, high) in TILTS.items():
        solved[k] = np.clip(solved[k], low, high)
    off = found - ways @ solved
    solved[0] += np.average(off, weights=sure / (1 + (off / 0.08) ** 2) + 1e-9)
    return np.clip(ways @ solved, *RIM)


# --- the crown -----------------------------------------------------------------------------------


def _crown(sight: Sight, outline: Outline, edge: NDArray) -> NDArray[np.float64]:
    """(48, STEPS) metres with which a crown ends where the region does."""
    order = len(WAVES) - 1
    waves = [np.ones(AZIMUTHS)]
    costs = [WAVES[0]]
    for k in range(1, order + 1):
        waves += [np.cos(k * ANGLES), np.sin(k * ANGLES)]
        costs += [WAVES[k]] * 2
    around = np.stack(waves, axis=1)
    bend = np.diff(np.eye(STEPS), 2, axis=0)
    held = np.kron(np.diag(costs), np.eye(STEPS)) + BENDS * np.kron(
        np.eye(len(costs)), bend.T @ bend * STEPS
    )
    usual = inflated(sight, edge, STEPS)
    if usual is None:
        usual = np.full((AZIMUTHS, STEPS), STAND)
    usual = np.clip(usual, THIN, HIGH)
    usual = ROUND * usual.mean(axis=0) + (1 - ROUND) * usual
    basis = np.kron(around, np.eye(STEPS))
    thick = usual
    none = np.zeros(AZIMUTHS)
    for _ in range(ROUNDS):
        surface = crown_on(sight.head, Hat(edge, thick, none))
        azimuth, share, short, known = sight.shortfall(surface, outline)
        grid = bilinear(azimuth, share, STEPS)
        now = grid @ thick.ravel()
        # Below the rim another line ends the region, beside it a brim may.
        known = known & (short > -0.1)
        rows = (grid @ basis) * known[:, None]
        wanted = np.where(known, np.clip(now + short, THIN, HIGH), 0.0)
        off = wanted - (grid @ usual.ravel()) * known
        solved = np.linalg.solve(rows.T @ rows + held, rows.T @ off)
        thick = usual + around @ solved.reshape(len(costs), STEPS)
        thick = np.clip(thick, THIN, HIGH)
    return thick


# --- the brim ------------------------------------------------------------------------------------


def _juts(sight: Sight, region: NDArray[np.bool_]) -> dict[int, NDArray[np.float64]]:
    """side of the page, -1 left and 1 right -> (2,) metres on the page from the head's middle, the
    tip of what juts out of the crown there.

    sight : of the crown;  region : (h, w) bool, of all of the hat
    """
    cells = np.argwhere(region)
    crown, whole = (sight.metres(at[:, ::-1]) for at in (np.argwhere(sight.page.hair), cells))
    ahead = abs(sight.directions[0, 2])
    beside = ndimage.distance_transform_edt(~sight.page.head) / sight.unit
    tips, juts = {}, {}
    for side in (-1, 1):
        k = (side * whole[:, 0]).argmax()
        jut = side * whole[k, 0] - (side * crown[:, 0]).max()
        if jut > JUTS[int(ahead > TURNED)] and beside[tuple(cells[k])] > BESIDE_HEAD:
            tips[side], juts[side] = whole[k], jut
    if len(tips) == 2 and min(juts.values()) < ALIKE * max(juts.values()):
        tips.pop(min(juts, key=juts.__getitem__))
    return tips


def _with_brim(hat: Hat, sight: Sight, region: NDArray[np.bool_], drop: float) -> Hat:
    """The hat with the brim or the peak that is drawn.

    sight : of the crown;  region : (h, w) bool, of all of the hat;  drop : see `_rim`
    """
    view = _View.of(sight, hat)
    tips = {}
    for side, tip in _juts(sight, region).items():
        end = tip - view.rim(view.azimuth + side * np.pi / 2)
        if abs(end[1]) < STRAY:  # else a knot, or an end that hangs
            tips[side] = tip
    if len(tips) == 2:
        ends = [tips[side] - view.rim(view.azimuth + side * np.pi / 2) for side in (-1, 1)]
        out = float(np.clip(np.mean([abs(end[0]) for end in ends]), *BRIM))
        droop = -float(np.mean([end[1] for end in ends])) / out / view.upright
        if droop < FALLS:
            droop = (droop + view.droop(out, drop)) / 2 if drop else droop
            return replace(hat, brim=np.full(AZIMUTHS, out), droop=_steep(droop))
        tips = {}
    if tips and not drop:
        ((side, tip),) = tips.items()
        if side * view.ahead(0.0)[0] < -TURNED:
            return hat
        return _with_peak(hat, view, side, tip)
    if drop:
        droop = _steep(view.droop(PEAK[0], drop))
        return replace(hat, brim=_peak(PEAK[0], 0.0), droop=droop)
    return hat


def _with_peak(hat: Hat, view: _View, side: int, tip: NDArray) -> Hat:
    """The hat with a peak whose tip (2,) is seen at a side of the page: as far to the front as a
    peak of a usual length can be."""
    lengths = np.linspace(*LENGTH, 9)
    around = view.ways[:, [0, 2]] @ direction(ANGLES).T  # (2, 48)
    for place in PLACES:
        unit = _peak(1.0, side * place)
        border = view.ring.T + lengths[:, None, None] * unit * around  # (9, 2, 48)
        short = side * (tip[0] - border[:, 0])
        if short[-1].min() <= 0:
            break
    k = int(np.abs(short.min(axis=1)).argmin())
    out, at = float(lengths[k]), int(short[k].argmin())
    fall = border[k, 1, at] - tip[1]
    droop = fall / max(out * float(unit[at]), out / 2) / view.upright
    return replace(hat, brim=out * unit, droop=float(np.clip(droop, *DROOPS)))


@dataclass(frozen=True)
class _View:
    """A hat's rim as it is seen: metres on the page, to the right and up, from the head's middle.

    ring : (48, 2) the rim;  ways : (2, 3) see `Sight.directions`;  upright : a metre up, how much
    of it is seen;  azimuth : the one that faces the view
    """

    ring: NDArray[np.float64]
    ways: NDArray[np.float64]
    upright: float
    azimuth: float

    @classmethod
    def of(cls, sight: Sight, hat: Hat) -> _View:
        surface = crown_on(sight.head, hat, AZIMUTHS, 3)
        ring = sight.cells(surface.points[surface.outer[:, -1]].astype(float))
        ways = sight.directions
        return cls(sight.metres(ring), ways, max(float(ways[1, 1]), 0.3), sight.azimuth)

    def ahead(self, azimuth: float) -> NDArray[np.float64]:
        """(2,) where a metre outwards at an azimuth leads."""
        return self.ways[:, [0, 2]] @ direction(np.array(azimuth))

    def rim(self, azimuth: float) -> NDArray[np.float64]:
        """(2,) metres, where the rim is at an azimuth."""
        at = [np.interp(azimuth, ANGLES, of, period=2 * np.pi) for of in self.ring.T]
        return np.array(at)

    def droop(self, out: float, drop: float) -> float:
        """The droop with which a brim that juts out so far hides so much below the rim in front."""
        return drop / out + float(self.ahead(0.0)[1]) / self.upright


def _steep(droop: float) -> float:
    return float(np.clip(droop, -0.3, STEEPEST))


def _peak(out: float, front: float) -> NDArray[np.float64]:
    """(48,) metres that a peak juts out whose middle is at an azimuth."""
    away = _away(ANGLES - front) / PEAK[1]
    return out * np.clip(1 - away**2, 0, 1) ** 0.6
