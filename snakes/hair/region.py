"""Where on a page somebody's hair and beard lie, to the drawn line.

What a network says is as coarse as its cells. Two more cues sharpen it: how light and dark are
spread where it is sure (Rother, Kolmogorov, Blake 2004, "GrabCut", SIGGRAPH, for tones), and that
a region ends at lines: what is known of the sure cells spreads to the others, but not across ink
(Grady 2005, "Multilabel random walker image segmentation using prior models", CVPR).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy import ndimage
from scipy.spatial import ConvexHull
from skimage.measure import find_contours

from facs_rig import LANDMARKS, Camera, FaceRig
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from ..lines import HEAD
from .texture import Strokes, parting, strokes_in, texture_of, tone_of, waves_in

__all__ = [
    "ROWS", "At", "PageHair", "Zones", "chance", "contour", "grid", "log_odds", "page_hair",
    "spread", "theirs",
]  # fmt: skip

At = Callable[[str, NDArray[np.float64]], NDArray[np.float64]]

ROWS = 112
"""Cells to a head of HEAD metres."""
COARSER = 2
"""Cells from one place to the next at which the network is asked."""
ROOM = (0.45, 0.40, 0.45, 0.75)
"""Heads to the left, above, to the right and below the posed head that are looked at."""
FADES = 0.15
"""Heads beyond what the network saw, where its log-odds are 1/e of those at the border."""
SURE = 0.02
"""Probabilities nearer to 0 or 1 than this are taken for it."""
TONES, RARE = 8, 1e-3
"""Bins of each of two tones, and the share of all cells that a bin is taken to have at least."""
TONED, TONED_BEARD, MOST_TONED = 0.5, 1.0, 3.0
"""Weight of what tones say of hair and of beards, and the largest log-likelihood ratio that they
count for."""
LEANS = 0.4
"""Log-odds that hair is given besides: the overlap is larger if what is doubtful is hair."""
FAR, FARTHER, BESIDE = 0.26, 0.10, 3.0
"""Heads beside a head from which on hair is unlikely, and in how many more it has lost so much."""
STRENGTH, STOPS, UNSURE, SWEEPS = 15.0, 25.0, 0.05, 40
"""How strongly neighbours go together, how fast that falls with ink, the least weight of what a
cell itself says, and steps of the solver."""
LEAST, LIKELY, SOMEWHERE = 0.012, 0.33, 0.55
"""Square heads of hair that are no stray, the mean probability of a piece that is hair, and what at
least a tenth of it reaches."""
LEAST_BEARD, BEARDED = 0.004, 1.6
"""The same square heads of a beard, and the log-odds by which the network takes too few for one."""
SHADED, DARKER, SHORN = 0.16, 1.3, 1.2
"""Mean ink from which on a scalp is not bare, if it is so many times darker than the face, and the
log-odds by which a network takes its ink too rarely for hair that is cut to the skin."""
COLLAR = 0.12
"""Heads below the nose from which on no piece of hair begins."""
FALLEN = 0.03
"""Square heads of hair below the mouth from which on it is one that falls."""
APART = 0.04
"""Heads between a head and a piece of hair that is still its own."""


@dataclass(frozen=True, eq=False)
class PageHair:
    """Hair and beard on a page, in cells of a grid.

    box : pixels of the page that the grid covers, in square cells
    hair, beard : (h, w) bool, where there is scalp hair (or a hat), and beard or moustache
    head : (h, w) bool, where the fitted head and neck are, hidden or not
    contour : (k, 2) pixels, around the largest piece of hair, closed; empty where there is none
    tone : how dark the hair is drawn, 0 paper to 1 ink
    texture : how it is drawn: "black", "outline", "strands", "curls" or "stubble"; "" for none
    strokes : where its strokes run
    part : (2,) pixels where a parting meets the forehead, or None
    wave : how wavy its strokes are, 0 to 1
    ink : (h, w) float, how much of each cell is inked, where a hat is looked at
    """

    box: Box
    hair: NDArray[np.bool_]
    beard: NDArray[np.bool_]
    head: NDArray[np.bool_]
    contour: NDArray[np.float64]
    tone: float
    texture: str
    strokes: Strokes
    part: NDArray[np.float64] | None
    wave: float = 0.0
    ink: NDArray[np.floating] | None = None

    @property
    def cell(self) -> float:
        """Pixels to a side of a cell."""
        return self.box.width / self.hair.shape[1]

    def cells(self, points: NDArray) -> NDArray[np.float64]:
        """Pixels (..., 2) of the page as columns and rows of the grid, centres at whole numbers."""
        height, width = self.hair.shape
        return self.box.to_units(points) * (width, height) - 0.5

    def pixels(self, cells: NDArray) -> NDArray[np.float64]:
        """The reverse of `cells`."""
        height, width = self.hair.shape
        return self.box.to_pixels((np.asarray(cells, float) + 0.5) / (width, height))


def page_hair(
    drawing: NDArray[np.floating],
    at: At,
    rig: FaceRig,
    vertices: NDArray[np.floating],
    camera: Camera,
    seen: Box | None = None,
    others: Sequence[Box] = (),
) -> PageHair:
    """The hair and the beard of a fitted face.

    drawing : (h, w) float, 1 is paper, 0 is ink
    at : region "hair" or "beard", (k, 2) pixels -> (k,) how probable it is there, 0..1
    vertices : (n, 3) metres, the posed face;  camera : of the drawing's pixels
    seen : the part of the page that `at` knows; beyond it, it counts ever less
    others : boxes of other heads on the page: what is nearer to one of these is not ours

    Where no hair is drawn, and where the head lies off the page, the regions are empty.
    """
    box, size = grid(vertices, camera, drawing.shape)
    ink = 1 - area_resample(np.asarray(drawing, np.float32), box, size, outside=1.0)
    zones = Zones.of(rig, vertices, camera, box, size)
    hair = log_odds(at, "hair", box, size, seen, camera)
    beard = log_odds(at, "beard", box, size, seen, camera) + BEARDED
    unlike = _beside(zones) + theirs(box, size, zones, others)
    region = _hair_in(ink, hair, beard, zones, unlike)
    whiskers = _beard_in(ink, beard, zones) & ~region
    strokes = strokes_in(ink, region, ROWS)
    low = max(int((zones.nose + zones.chin) / 2), 0)
    falls = bool(region[low:].sum() > FALLEN * ROWS**2)
    place = parting(strokes, region, zones.face, ROWS, falls)
    part = None if place is None else box.to_pixels((place + 0.5) / size)
    return PageHair(
        box, region, whiskers, zones.head, contour(region, box), tone_of(ink, region),
        texture_of(ink, region, strokes, ROWS), strokes, part, waves_in(strokes, region, ROWS),
    )  # fmt: skip


@dataclass(frozen=True)
class Zones:
    """What of the fitted face lies where, in cells: (h, w) bool, and rows of the grid.

    head : head and neck;  face : between forehead, temples and jaw;  middle : column of the face
    """

    head: NDArray[np.bool_]
    face: NDArray[np.bool_]
    eyes: float
    nose: float
    chin: float
    middle: float

    @classmethod
    def of(
        cls, rig: FaceRig, vertices: NDArray, camera: Camera, box: Box, size: tuple[int, int]
    ) -> Zones:
        skin = _cells(vertices[rig.parts["skin"]], camera, box, size)
        marks = _cells(vertices[rig.landmarks], camera, box, size)
        edge = [k for k, name in enumerate(LANDMARKS)
                if name.startswith(("jawline", "chin", "temple", "forehead"))]  # fmt: skip
        named = dict(zip(LANDMARKS, marks, strict=True))
        eyes = (named["eye_outer_left"] + named["eye_outer_right"]) / 2
        outline = marks[edge][ConvexHull(marks[edge]).vertices]
        picture = Image.new("L", size)
        ImageDraw.Draw(picture).polygon(outline.ravel().tolist(), fill=1)
        return cls(
            _covered(skin, size), np.asarray(picture) > 0, float(eyes[1]),
            float(named["nose_base"][1]), float(named["chin"][1]), float(eyes[0]),
        )  # fmt: skip


def _cells(points: NDArray, camera: Camera, box: Box, size: tuple[int, int]) -> NDArray[np.float64]:
    """Places (k, 3) as columns and rows, cell centres at whole numbers."""
    return box.to_units(camera.project(points)) * size - 0.5


def _covered(cells: NDArray, size: tuple[int, int], gap: int = 3) -> NDArray[np.bool_]:
    """(h, w) what a cloud of points (k, 2) covers that lie less than two gaps apart."""
    at = np.round(cells).astype(int) + gap + 1
    width, height = size[0] + 2 * gap + 2, size[1] + 2 * gap + 2
    at = at[((at >= 0) & (at < (width, height))).all(axis=1)]
    found = np.zeros((height, width), dtype=bool)
    found[at[:, 1], at[:, 0]] = True
    found = ndimage.binary_fill_holes(ndimage.binary_closing(found, iterations=gap))
    return found[gap + 1 : -gap - 1, gap + 1 : -gap - 1]


def grid(
    vertices: NDArray,
    camera: Camera,
    shape: tuple[int, ...],
    room: tuple[float, float, float, float] = ROOM,
) -> tuple[Box, tuple[int, int]]:
    """The part of the page that is looked at, and its cells across and down; room : see ROOM"""
    pixels = camera.project(vertices)
    head = HEAD * camera.scale[0]
    cell = head / ROWS
    left, above, right, below = np.array(room) * head
    low = np.maximum(pixels.min(axis=0) - (left, above), 0)
    high = np.minimum(pixels.max(axis=0) + (right, below), shape[1::-1])
    size = np.maximum(np.ceil((high - low) / cell - 1e-6), 2).astype(int)
    return Box.at(*low, *(size * cell)), (int(size[0]), int(size[1]))


def log_odds(
    at: At, region: str, box: Box, size: tuple[int, int], seen: Box | None, camera: Camera
) -> NDArray[np.float64]:
    """(h, w) what the network says of each cell, fading beyond what it saw."""
    knots = [np.append(np.arange(0, n - 1, COARSER), n - 1) for n in size]
    u, v = np.meshgrid(*knots)
    points = box.to_pixels((np.stack([u.ravel(), v.ravel()], axis=1) + 0.5) / size)
    share = np.clip(at(region, points), SURE, 1 - SURE)
    odds = np.log(share / (1 - share))
    if seen is not None:
        low, high = np.array([seen.left, seen.top]), np.array([seen.right, seen.bottom])
        beyond = np.maximum(np.maximum(low - points, points - high), 0).max(axis=1)
        odds = odds * np.exp(-beyond / (FADES * HEAD * camera.scale[0]))
    across, down = (_tents(k, n) for k, n in zip(knots, size, strict=True))
    return down @ odds.reshape(u.shape) @ across.T


def _tents(knots: NDArray, count: int) -> NDArray[np.float64]:
    """(count, k) weights of linear interpolation between knots (k,) among 0..count - 1."""
    return np.stack([np.interp(np.arange(count), knots, row) for row in np.eye(len(knots))], axis=1)


def _beside(zones: Zones) -> NDArray[np.float64]:
    """(h, w) log-odds lost by what lies far beside or above a head; hair may hang down from it."""
    over = zones.head.copy()
    chin = int(np.clip(zones.chin, 0, len(over) - 1))
    over[chin + 1 :] = over[: chin + 1].any(axis=0)
    if not over.any():
        return np.zeros(over.shape)
    away = ndimage.distance_transform_edt(~over) / ROWS
    return -BESIDE * np.clip((away - FAR) / FARTHER, 0, 2)


def theirs(
    box: Box, size: tuple[int, int], zones: Zones, others: Sequence[Box]
) -> NDArray[np.float64]:
    """(h, w) very low log-odds where another head is nearer, each measured in its own size."""
    lost = np.zeros(size[::-1])
    if not others or not zones.head.any():
        return lost
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    mine = np.hypot(u - zones.middle, v - zones.eyes) / ROWS
    for other in others:
        middle = box.to_units(np.array(other.middle)) * size - 0.5
        high = other.height / box.height * size[1]
        lost -= np.where(np.hypot(u - middle[0], v - middle[1]) / high < mine, 20.0, 0.0)
    return lost


def _hair_in(
    ink: NDArray, odds: NDArray, beard: NDArray, zones: Zones, unlike: NDArray
) -> NDArray[np.bool_]:
    """(h, w) scalp hair, by pieces that touch the head and are no strays."""
    share = chance(odds + unlike)
    scalp = zones.head & ~zones.face & (np.arange(len(ink))[:, None] < zones.eyes)
    if not scalp.any():
        return np.zeros(ink.shape, dtype=bool)
    cues = odds + unlike + LEANS + TONED * _tones(ink, share)
    near = ndimage.binary_dilation(zones.head, iterations=max(round(APART * ROWS), 1))
    allowed = (odds > beard - 1 - BEARDED) & (unlike > -6)

    def found_by(cues: NDArray, share: NDArray) -> NDArray[np.bool_]:
        found = ndimage.binary_opening(spread(cues, ink) & allowed, iterations=1)
        label, _ = ndimage.label(_pieces(found, share, near, LEAST))
        # Hair comes from behind an ear at the lowest: pieces that begin lower are clothes.
        tops = [0, *(at[0].start for at in ndimage.find_objects(label))]
        return (label > 0) & (np.array(tops) <= zones.nose + COLLAR * ROWS)[label]

    found = found_by(cues, share) if share.max() >= 0.5 else np.zeros(ink.shape, dtype=bool)
    bare = scalp & ~found
    face = ink[zones.face].mean() if zones.face.any() else 0.0
    if 2 * bare.sum() > scalp.sum() and ink[bare].mean() > max(SHADED, DARKER * face):
        shorn = SHORN * scalp * np.clip(ndimage.gaussian_filter(ink, 0.022 * ROWS) / SHADED, 0, 1)
        found = found_by(cues + shorn, chance(odds + unlike + shorn))
    return found


def _beard_in(ink: NDArray, odds: NDArray, zones: Zones) -> NDArray[np.bool_]:
    """(h, w) beard and moustache, below the eyes and down to a head's half under the chin."""
    found = np.zeros(ink.shape, dtype=bool)
    top, end = max(int(zones.eyes), 0), max(int(zones.chin + ROWS / 2), 0)
    part = slice(top, end)
    share = chance(odds[part])
    if share.size and share.shape[0] > 2 and share.max() >= 0.5:
        cues = odds[part] + TONED_BEARD * _tones(ink[part], share)
        near = ndimage.binary_dilation(zones.face[part], iterations=2)
        found[part] = _pieces(spread(cues, ink[part]), share, near, LEAST_BEARD)
    return found


def chance(odds: NDArray) -> NDArray[np.float64]:
    return 1 / (1 + np.exp(-np.clip(odds, -30, 30)))


def _tones(ink: NDArray, share: NDArray) -> NDArray[np.float64]:
    """(h, w) log-likelihood ratio of hair for the tone of each cell, and of what is around it.

    The tones of hair are those of cells in the measure in which they are it (`share`).
    """
    near, around = (ndimage.gaussian_filter(ink, reach) for reach in (ROWS / 128, 3 * ROWS / 128))
    bins = [np.minimum((np.sqrt(np.clip(t, 0, 1)) * TONES).astype(int), TONES - 1)
            for t in (near, around)]  # fmt: skip
    place = bins[0] * TONES + bins[1]
    counts = []
    for weight in (share, 1 - share):
        count = np.bincount(place.ravel(), weight.ravel(), TONES**2).reshape(TONES, TONES)
        count = ndimage.gaussian_filter(count, 0.7)
        counts.append(count / max(count.sum(), 1e-9) + RARE)
    return np.clip(np.log(counts[0] / counts[1]), -MOST_TONED, MOST_TONED).ravel()[place]


def spread(odds: NDArray, ink: NDArray) -> NDArray[np.bool_]:
    """(h, w) which cells are more likely than not, when neighbours between which no ink begins or
    ends go together.

    The minimum of Σ c (x - q)² + Σ w (x - x')², q the cells' own chances, c how sure they are, w
    the ties of neighbours, by conjugate gradients.
    """
    own = chance(odds).astype(np.float32)
    sure = UNSURE + (2 * own - 1) ** 2
    soft = ndimage.gaussian_filter(ink, 0.6)
    ties = [STRENGTH * np.exp(-STOPS * np.abs(np.diff(soft, axis=axis))) for axis in (0, 1)]
    down, across = (tie.astype(np.float32) for tie in ties)
    total = sure.copy()
    total[1:] += down
    total[:-1] += down
    total[:, 1:] += across
    total[:, :-1] += across

    def pulled(x: NDArray) -> NDArray:
        out = total * x
        out[1:] -= down * x[:-1]
        out[:-1] -= down * x[1:]
        out[:, 1:] -= across * x[:, :-1]
        out[:, :-1] -= across * x[:, 1:]
        return out

    x = own.copy()
    left = sure * own - pulled(x)
    way = left / total
    gain = float((left * way).sum())
    for _ in range(SWEEPS):
        moved = pulled(way)
        step = gain / max(float((way * moved).sum()), 1e-12)
        x += step * way
        left -= step * moved
        scaled = left / total
        before, gain = gain, float((left * scaled).sum())
        way = scaled + gain / max(before, 1e-12) * way
    return x > 0.5


def _pieces(found: NDArray, share: NDArray, near: NDArray, least: float) -> NDArray[np.bool_]:
    """(h, w) the pieces that are large enough (square heads), likely enough, and near enough."""
    label, count = ndimage.label(found)
    if not count:
        return found
    flat = label.ravel()
    size = np.bincount(flat, minlength=count + 1)
    mean = np.bincount(flat, share.ravel(), count + 1) / np.maximum(size, 1)
    sure = np.bincount(flat, share.ravel() >= SOMEWHERE, count + 1) / np.maximum(size, 1)
    kept = (size >= least * ROWS**2) & (mean >= LIKELY) & (sure >= 0.1)
    kept &= np.bincount(flat, near.ravel(), count + 1) > 0
    kept[0] = False
    whole = kept[label]
    holes = ndimage.binary_fill_holes(whole) & ~whole
    label, count = ndimage.label(holes)
    if count:
        small = np.bincount(label.ravel(), minlength=count + 1) < least * ROWS**2
        small[0] = False
        whole |= small[label]
    return whole


def contour(region: NDArray, box: Box) -> NDArray[np.float64]:
    """(k, 2) pixels around the largest piece of a region, closed."""
    if not region.any():
        return np.zeros((0, 2))
    loops = find_contours(np.pad(region, 1).astype(float), 0.5)
    longest = max(loops, key=len)[:, ::-1] - 1
    return box.to_pixels((longest + 0.5) / region.shape[::-1])
