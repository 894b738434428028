"""The head of hair that looks like the hair on a page.

Two things of a cut can be read off a region: how far down hair covers the head where the camera
sees it, one azimuth after another, and how far it stands off where it ends against the page.
What no line says goes on smoothly from there (a membrane: Laplace's equation with what was measured
as soft constraints), alike on both sides. The surface that comes of it is held against the region
again a few times, as one registers surfaces by their outlines, and by their ends (`hem`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing, grey_opening

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.hair.cut import ANGLES, AZIMUTHS, Cut
from facs_rig.hair.head import WIDEST, head_of
from facs_rig.hair.presets import HAIRLINE, LYING, TOP
from facs_rig.hair.shell import shell_on

from .combed import combed
from .gathered import gathered
from .hem import hem
from .region import PageHair
from .sight import Outline, Sight, bilinear
from .steady import steadiest

__all__ = ["fit_cut"]

STEPS = 9
"""Steps of the thickness, from the parting to the edge."""
ROUNDS, HEMS = 3, 2
"""How often the surface is held against the region, and how often the end of hair that hangs."""
HEIGHTS = np.concatenate([np.linspace(0.97, 0.0, 34), np.linspace(-0.05, -3.0, 60)])
"""At which hair is looked for."""
NOWHERE = np.zeros(AZIMUTHS, dtype=bool)
FACING = 0.15
"""Cosine between a surface and the view from which on it is seen."""
PLAIN = 0.012
"""Metres that hair stands off of which nothing is known."""
THIN, THICK = 0.003, 0.09
"""Metres that hair stands off at least and at most."""
HUNG = -0.5
"""Height below which hair at the sides hangs: the mouth's."""
BESIDE_FACE, STRAND, LONG = (-0.4, -0.6, -0.8, -1.0), 0.01, -0.9
"""Heights beside the lower face between which falling hair is somewhere wider than a strand, how
wide that may be in metres, and the height below which hair falls however wide it is."""
NAPE, BELOW = np.radians(25), 0.3
"""Radians behind a head's outline where its hairline may yet be seen, and how far below that hair
ends that hangs."""
GAP, SIDES = 9, np.radians(50)
"""Azimuths side by side at which hair that hangs has no gap, and radians from the front from which
on that is so."""
TIP, JAGGED = 5, 0.12
"""Azimuths side by side to which a lock has to reach that hangs down farther than by this height
below those beside it."""
TEMPLES, CHEEKS = (np.radians(42), np.radians(80)), 0.3
"""Radians from the front between which falling hair grows as thick as it is at the sides, and the
share of it that it has before: it lies on the cheeks."""
USUAL, SOFTLY = 0.12, 0.1
"""How well a place is seen where what is seen of lying hair counts as much as where hairlines
usually are, and over what height these go from hair to skin."""
EARS, DOUBTED = (np.radians(92), np.radians(15)), 0.3
"""Radians from the front where ears are, and how far around, and how well hair is seen there that
lies: dark ears beside it are taken for it."""
STEADY = 20.0
"""Places seen wrongly that an edge which goes up and down by a whole head has to be worth: a notch
narrower than some 15 degrees is not."""
HIGHEST_FROM, EAR_AT, SIDE_AT = np.radians(38), 10, 7
"""Radians from the front within which a side's hairline is highest, and the azimuths to which it
only goes down from there, of hair that lies and that hangs."""
CHEEK, ON_CHEEK = np.radians((34, 50, 78, 90)), 0.12
"""Radians from the front between which lying hair is no more than so far below the usual hairline,
rising and fading, and that height."""
UNSEEN = 0.4
"""How well an azimuth is seen below which it is taken to be as on the other side."""
BARE, HAIRY = 0.86, 0.75
"""Height of an edge above which nothing is hair, and below which the usual edge in front is where
that is taken for a gap in what was seen."""
HIGHEST = 0.93
"""Of an edge."""
CROWN, BALD = 0.62, 0.3
"""Height from which on a crown is bald, and the share of it that hair covers at most then."""
SIDE, RIMMED = (-0.1, 0.5), 0.3
"""Heights at the sides of a bald head of which hair covers at least this share."""
OPEN, APEX = 0.42, 0.05
"""Height of an edge above which a forehead is open, and how far below its highest place is as good:
falling hair parts there unless its strokes say where."""
CURLED = 0.018
"""Metres that hair stands off from which on curls are as large as they get."""
LIDS, EYES = 0.1, np.radians(32)
"""Height above the eyes that a fringe keeps, and radians from the front to which it does: a face
that is to be posed needs both eyes."""


def fit_cut(
    page: PageHair, rig: FaceRig, parameters: FaceParameters, vertices: NDArray, camera: Camera
) -> Cut | None:
    """The cut whose surface covers what hair covers on a page, or None where there is none.

    vertices : (n, 3) metres, the posed face of `parameters`;  camera : of the page's pixels
    """
    if not page.hair.any():
        return None
    head = head_of(rig, parameters.identity)
    sight = Sight.of(page, rig, parameters, vertices, camera, head)
    whole = sight.outline_of_region()
    outline = whole.without_knots()
    hangs = _hangs(sight, outline)
    thick = np.full((AZIMUTHS, STEPS), PLAIN)
    # A thin band of shorn hair over the skull leaves the crown bare, too.
    rim = None if hangs or whole.spans else _rim(sight)
    edge, falls = _edges(sight, outline, hangs, thick) if rim is None else (rim[0], NOWHERE)
    top, outline = (None, outline) if rim is None else (rim[1], whole)
    cut = _cut(page, sight, edge, thick, hangs, top)
    for _ in range(ROUNDS):
        thick = _thickness(sight, outline, cut, thick, falls)
        if rim is None:
            edge, falls = _edges(sight, outline, hangs, thick)
        cut = _cut(page, sight, edge, _tapered(thick, falls), hangs, top)
    if hangs:
        for _ in range(HEMS):
            edge = hem(sight, shell_on(head, cut), edge)
            cut = _cut(page, sight, edge, _tapered(thick, falls), hangs, top)
    cut = replace(cut, balls=gathered(sight, cut))
    if hangs or top is not None or cut.balls or cut.curl:
        return cut
    stand, sweep = combed(sight, whole, edge)
    # What is combed up and back is not parted as well.
    return replace(cut, stand=stand, sweep=sweep, part=cut.part if sweep is None else None)


def _cut(
    page: PageHair, sight: Sight, edge: NDArray, thick: NDArray, hangs: bool, top: NDArray | None
) -> Cut:
    """All of a cut; parting, curls and colour as they are drawn."""
    part = None
    if page.part is not None and top is None:
        part = sight.azimuth_at(page.part, edge)
    if hangs and (part is None or _is_fringe(edge, part)):
        part = _apex(edge)
    curl = 0.0
    if page.texture == "curls":
        curl = 0.8 * float(np.clip(np.median(thick[:, : STEPS // 2 + 1]) / CURLED, 0.35, 1))
    # Only long strokes show waves: short ones lie in many directions, filled areas have none.
    wave = 0.5 * page.wave if hangs and page.texture == "strands" else 0.0
    colour = float(np.clip(page.tone, 0.1, 1.0))
    return Cut(edge, thick, part, hangs, wave, curl, (), colour, top)


def _is_fringe(edge: NDArray, part: float) -> bool:
    """Whether hair hangs over the forehead on both sides of a parting: it hides that."""
    near = _away(ANGLES - part) < np.radians(20)
    return bool(edge[near].max() < OPEN)


def _rounded(values: NDArray) -> NDArray[np.float64]:
    """(48, k) values shared with the azimuths beside each."""
    return (2 * values + np.roll(values, 1, axis=0) + np.roll(values, -1, axis=0)) / 4


def _apex(edge: NDArray) -> float | None:
    """Radians at which falling hair parts over an open forehead, None for a fringe."""
    front = (_away(ANGLES) < np.radians(50)) & (edge < BARE)
    highest = edge[front].max(initial=-np.inf)
    if highest < OPEN:
        return None
    turn = (ANGLES + np.pi) % (2 * np.pi) - np.pi
    return float(turn[front & (edge > highest - APEX)].mean())


# --- where it ends -------------------------------------------------------------------------------


def _hangs(sight: Sight, outline: Outline) -> bool:
    """Whether hair falls at a side: lower than the mouth, and than the nape where that is seen.

    A strand beside the face falls from hair that is short or pinned up as well.
    """
    for side in (-1, 1):
        behind = float(_away(sight.azimuth + side * np.pi / 2)) + NAPE
        nape = float(np.interp(np.degrees(min(behind, np.pi)), *np.array(HAIRLINE).T))
        low = sight.lowest(outline, side)
        if low < min(HUNG, nape - BELOW) and sight.is_mane(side):
            if low < LONG or sight.fullness(side, BESIDE_FACE) > STRAND:
                return True
    return False


def _away(azimuth: NDArray | float) -> NDArray[np.float64]:
    """Radians from the front, whichever way."""
    return np.abs((np.asarray(azimuth) + np.pi) % (2 * np.pi) - np.pi)


def _edges(
    sight: Sight, outline: Outline, hangs: bool, thick: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(48,) heights of the edge, and (48,) where hair falls past the head."""
    tips = _taper(np.full(AZIMUTHS, True))[:, -2:] * thick[:, -2:]
    stand = tips.mean(axis=1) if hangs else np.full(AZIMUTHS, 0.5 * PLAIN)
    covered, weight = sight.covered(HEIGHTS, hangs, np.maximum(stand, THIN), FACING)
    seen = weight * (2 * covered - 1)
    base = _around(HAIRLINE)
    if not hangs:
        ears = (np.abs(_away(ANGLES) - EARS[0]) < EARS[1])[:, None] & (HEIGHTS < base[:, None])
        seen = np.where(ears & (seen > 0), DOUBTED * seen, seen)
        usual = np.tanh((HEIGHTS - base[:, None]) / SOFTLY)
        seen = _rounded(seen + USUAL * usual * np.minimum(weight.max(axis=1) / USUAL, 1)[:, None])
    # Hair above a height and none below: the heights of which that is true for the most.
    above = np.concatenate([np.zeros((AZIMUTHS, 1)), np.cumsum(seen, axis=1)], axis=1)
    between = np.concatenate([[HEIGHTS[0]], (HEIGHTS[1:] + HEIGHTS[:-1]) / 2, [HEIGHTS[-1]]])
    best = above.argmax(axis=1) if hangs else steadiest(above, between, base, STEADY)
    found = between[best]
    sure = weight[:, :40].mean(axis=1)
    sure = np.where(sure > 0.1, np.minimum(2 * sure, 1), 0)
    for side in (-1, 1):
        low = sight.lowest(outline, side)
        rim = sight.rim(side)
        if low < HUNG and hangs:
            hidden = rim & (sure < 0.4)
            found, sure = np.where(hidden, low, found), np.where(hidden, 0.5, sure)
    if hangs:
        base = np.minimum(base, _behind(found, sure))
    other = -np.arange(AZIMUTHS)
    hidden = (sure < UNSEEN) & (sure[other] >= UNSEEN)
    found = np.where(hidden, found[other], found)
    sure = np.where(hidden, UNSEEN, sure)
    front = (_away(ANGLES) < np.radians(75)) & (sure > 0.3)
    if front.any() and np.median(found[front]) < HAIRY:
        sure = np.where(found > BARE, 0, sure)
    found = _declining(found, sure, SIDE_AT if hangs else EAR_AT)
    edge = _continued(found, sure, base)
    if hangs:
        even = grey_opening(edge, GAP, mode="wrap")
        even = np.maximum(even, grey_closing(even, TIP, mode="wrap") - JAGGED)
        front = np.maximum(edge, grey_closing(edge, TIP, mode="wrap") - JAGGED / 2)
        edge = np.where(_away(ANGLES) > SIDES, even, front)
    else:
        edge = _off_the_cheeks(edge)
    clear = LIDS - 4 * np.clip(_away(ANGLES) - EYES, 0, 1)
    edge = np.clip(np.maximum(edge, clear), HEIGHTS[-1], HIGHEST)
    return edge, (edge < WIDEST) & hangs


def _declining(values: NDArray, sure: NDArray, last: int) -> NDArray[np.float64]:
    """(48,) heights that do not rise again between where a side's hairline is highest and its last
    azimuth: the nearest such ones, by weights (isotonic regression, pooling adjacent violators).

    A head that is turned shows its far side slantwise, up to somewhere: there a notch would be."""
    out = values.copy()
    from_the_front = np.arange(int(HIGHEST_FROM * AZIMUTHS / (2 * np.pi)) + 1)
    for side in (1, -1):
        first = int(values[side * from_the_front].argmax())
        at = side * np.arange(first, last)
        pools: list[tuple[float, float, int]] = []  # value, weight, places
        for value, weight in zip(values[at], np.maximum(sure[at], 1e-3), strict=True):
            pools.append((float(value), float(weight), 1))
            while len(pools) > 1 and pools[-1][0] > pools[-2][0]:
                (a, v, m), (b, w, n) = pools[-2:]
                pools[-2:] = [((a * v + b * w) / (v + w), v + w, m + n)]
        out[at] = np.repeat([value for value, _, _ in pools], [places for _, _, places in pools])
    return out


def _off_the_cheeks(edge: NDArray) -> NDArray[np.float64]:
    """(48,) an edge of hair that lies, no more than a little below the usual hairline where cheeks
    are."""
    low = np.maximum(_around(HAIRLINE) - edge, 0)
    begins, whole, until, ends = CHEEK
    away = _away(ANGLES)
    there = np.clip((away - begins) / (whole - begins), 0, 1)
    there = there * np.clip((ends - away) / (ends - until), 0, 1)
    return edge + there * (low - ON_CHEEK * np.tanh(low / ON_CHEEK))


def _rim(sight: Sight) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """(48,) heights of both edges of a rim of hair around a bald crown, None if there is none."""
    stand = np.full(AZIMUTHS, 0.5 * PLAIN)
    covered, weight = sight.covered(HEIGHTS, False, stand, FACING)
    low, high = SIDE
    sides = (_away(ANGLES) > np.radians(50))[:, None] & (HEIGHTS > low) & (HEIGHTS < high)
    crown = np.broadcast_to(HEIGHTS > CROWN, weight.shape)
    crown, sides = ((weight * covered * at).sum() / max((weight * at).sum(), 1e-9)
                    for at in (crown, sides))  # fmt: skip
    if crown > BALD or sides < RIMMED:
        return None
    seen = weight * (2 * covered - 1)
    # Hair between two heights, and none above and below: those of which that is true for the most.
    above = np.concatenate([np.zeros((AZIMUTHS, 1)), np.cumsum(seen, axis=1)], axis=1)
    gain = above - np.minimum.accumulate(above, axis=1)
    end = gain.argmax(axis=1)
    begin = np.array([row[: k + 1].argmin() for row, k in zip(above, end, strict=True)])
    between = np.concatenate([[HEIGHTS[0]], (HEIGHTS[1:] + HEIGHTS[:-1]) / 2, [HEIGHTS[-1]]])
    sure = np.clip(2 * weight[:, :40].mean(axis=1), 0, 1)
    there = gain.max(axis=1) > 0
    base, around = _around(HAIRLINE), _around(TOP)
    top = np.where(there, between[begin], base - 0.15)
    edge = _continued(np.where(there, between[end], base), sure, base)
    return edge, np.clip(_continued(top, sure, around), HEIGHTS[-1], HIGHEST)


def _behind(found: NDArray, sure: NDArray) -> NDArray[np.float64]:
    """(48,) what hair behind is like that falls at the sides: it is no longer than these show."""
    away = _away(ANGLES)
    sides = (away > np.radians(55)) & (sure > 0.2)
    if not sides.any():
        return np.full(AZIMUTHS, np.inf)
    length = np.quantile(found[sides], 0.3)
    return np.where(away > np.radians(70), length, np.inf)


def _continued(found: NDArray, sure: NDArray, base: NDArray) -> NDArray[np.float64]:
    """(48,) values as found where that is sure, elsewhere running as a base does, and alike on both
    sides."""
    eye, mirror = np.eye(AZIMUTHS), np.eye(AZIMUTHS)[-np.arange(AZIMUTHS)]
    slope = np.roll(eye, -1, axis=0) - eye
    run = slope.T @ slope
    alike = (eye - mirror).T @ (eye - mirror)
    weight = np.diag(20 * sure**2)
    matrix = weight + run + 0.3 * alike + 0.02 * eye
    return np.linalg.solve(matrix, weight @ found + run @ base + 0.02 * base)


def _around(points: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """(48,) values at ANGLES of degrees and values that are alike on both sides."""
    degrees = np.degrees(np.minimum(ANGLES, 2 * np.pi - ANGLES))
    return np.interp(degrees, *np.array(points).T)


# --- how far it stands off -----------------------------------------------------------------------


def _taper(falls: NDArray) -> NDArray[np.float64]:
    """(48, STEPS) shares of the thickness: what ends on the skin lies on it there, and what falls
    in front of the ears lies on the cheeks."""
    late = np.clip((np.linspace(0, 1, STEPS) - 0.5) / 0.5, 0, 1)
    before, after = TEMPLES
    cheeks = np.clip((_away(ANGLES) - before) / (after - before), 0, 1)[:, None]
    cheeks = CHEEKS + (1 - CHEEKS) * cheeks
    return np.where(falls[:, None], 1 - np.clip(3 * late, 0, 1) * (1 - cheeks), 1 - late**2.2)


def _tapered(thick: NDArray, falls: NDArray) -> NDArray[np.float64]:
    share = _taper(falls)
    return share * thick + (1 - share) * LYING


def _thickness(
    sight: Sight, outline: Outline, cut: Cut, thick: NDArray, falls: NDArray
) -> NDArray[np.float64]:
    """(48, STEPS) metres with which a cut's surface ends where the region does."""
    hair = shell_on(sight.head, cut)
    azimuth, share, short, known = sight.shortfall(hair, outline)
    grid = bilinear(azimuth, share, STEPS)
    taper = _taper(falls).ravel()
    rows = grid * taper
    now = rows @ thick.ravel()
    weight = np.where(known, np.clip(rows.sum(axis=1), 0, 1), 0.0)
    rows, wanted = rows * weight[:, None], weight * (now + np.clip(short, -0.03, 0.03))
    membrane, loose = _membrane()
    typical = float(np.clip(np.median((now + short)[weight > 0.5]), THIN, 0.04)) if (
        weight > 0.5).any() else PLAIN  # fmt: skip
    matrix = rows.T @ rows + membrane
    solved = np.linalg.solve(matrix, rows.T @ wanted + loose * typical)
    low = THIN - 0.02 * falls[:, None] * (np.linspace(0, 1, STEPS) > 0.6)
    return np.clip(solved.reshape(AZIMUTHS, STEPS), low, THICK)


@lru_cache(maxsize=1)
def _membrane() -> tuple[NDArray[np.float64], float]:
    """(k, k) energy of a thickness that is uneven or not alike on both sides, and how weakly it is
    held at its usual value."""
    around, along = np.eye(AZIMUTHS), np.eye(STEPS)
    ring = np.roll(around, -1, axis=0) - around
    strip = np.diff(along, axis=0)
    other = around - around[-np.arange(AZIMUTHS)]
    loose = 0.01
    energy = (
        np.kron(0.5 * ring.T @ ring, along)
        + np.kron(around, 0.25 * strip.T @ strip)
        + np.kron(0.1 * other.T @ other, along)
    )
    return energy + loose * np.eye(AZIMUTHS * STEPS), loose
