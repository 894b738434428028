"""How hair is drawn: how dark, with which strokes, which way these run, and where it is parted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from .curl_weights import CURLY
from .scallops import is_scalloped, scallops

__all__ = [
    "TEXTURES", "Strokes", "curls_say", "is_curly", "parting", "strokes_in", "tensor", "texture_of",
    "tone_of", "waves_in",
]  # fmt: skip

TEXTURES = ("black", "outline", "strands", "curls", "stubble")

NEAR = 0.022
"""Heads around a place within which strokes say together where they run."""
RIM = 0.025
"""Heads at the edge of a region that its outline may take."""
FULL = 0.75
"""Mean ink of hair that is as dark as it gets."""
SOLID, BLACK = 0.018, 0.45
"""Half the width in heads from which on ink is an area, and the share of the inside that is one."""
EMPTY = 0.07
"""Mean ink of an inside in which there is nothing but a few lines."""
STROKE, SHARPEST = 0.014, 60.0
"""Heads around a place in which a stroke has its own direction, and the most that curvature, one
over heads, counts."""
LOCK = 0.045
"""Heads around a place in which strokes of straight hair run alike."""
BENT, ALIKE, FEW = 8.0, 0.55, 0.008
"""Curvature and coherence that strokes are taken to have of which hardly any are seen, as in ink
that is filled and in hair that is left white, and square heads of them that are so few."""
STROKED = 0.07
"""How much of strokes there is to a cell where there are any to speak of."""
SPECKS, SPECK = 0.75, 0.035
"""Share of the pieces of ink that are shorter than SPECK heads, in stubble."""
SWAY, STRAIGHT, WAVY = 0.08, 0.19, 0.26
"""Heads within which waves go to and fro, and the radians by which strokes do so, root mean
square, in the most uneven straight hair and in waves."""
REACH = {"lies": 0.14, "falls": 0.30}
"""Heads to either side of a parting that say whether it is one, of lying and of falling hair."""
PARTED, LOPSIDED = {"lies": 0.42, "falls": 0.2}, 0.2
"""How much strokes beside a parting lean away from it at least, 1 for half a right angle and 0 for
upright, and the least share of them on each side."""


@dataclass(frozen=True, eq=False)
class Strokes:
    """Where the strokes of hair run, by cells.

    along : (h, w, 2) float, unit vectors, right and down, either way
    coherence : (h, w) 0..1, how much they agree; 0 outside the hair and where nothing is drawn
    """

    along: NDArray[np.float64]
    coherence: NDArray[np.float64]


def strokes_in(ink: NDArray, region: NDArray, rows: int) -> Strokes:
    """The way of the strokes in a region (h, w) bool of a picture (h, w), 1 is ink.

    rows : cells to a head

    By the structure tensor.
    """
    along = np.zeros((*ink.shape, 2))
    along[..., 1] = 1.0
    coherence = np.zeros(ink.shape)
    if not region.any():
        return Strokes(along, coherence)
    part = tuple(
        slice(max(at.start - 8, 0), at.stop + 8)
        for at in ndimage.find_objects(region.astype(np.uint8))[0]
    )
    down, across, right = tensor(ink[part], NEAR * rows)
    # Strokes run across the direction in which ink changes most.
    turn = 0.5 * np.arctan2(2 * across, right - down) + np.pi / 2
    total = right + down
    spread = np.hypot(right - down, 2 * across)
    along[part] = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    clear = total > 1e-4
    coherence[part] = np.where(clear & region[part], spread / np.maximum(total, 1e-9), 0.0)
    return Strokes(along, coherence)


def tensor(
    ink: NDArray, near: float, counts: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """The structure tensor of a picture (h, w), 1 is ink, by cells: how much ink changes downward,
    both ways together, and to the right, squares, (h, w) each.

    near : cells around each within which changes are summed up;  counts : (h, w) those that are

    Bigün & Granlund 1987, "Optimal orientation detection of linear symmetry", ICCV, as scikit-image
    has it, whose skimage.feature takes longer to load than to use.
    """
    soft = ndimage.gaussian_filter(ink.astype(np.float32), 0.7)
    v, u = (ndimage.sobel(soft, axis=axis, mode="constant") for axis in (0, 1))
    if counts is not None:
        v, u = v * counts, u * counts
    down, across, right = (
        ndimage.gaussian_filter(a * b, near, mode="constant") for a, b in ((v, v), (v, u), (u, u))
    )
    return down, across, right


def tone_of(ink: NDArray, region: NDArray) -> float:
    """How dark a region is drawn, 0 to 1."""
    return float(np.clip(ink[region].mean() / FULL, 0, 1)) if region.any() else 0.0


def texture_of(ink: NDArray, region: NDArray, strokes: Strokes, rows: int) -> str:
    """Which of TEXTURES a region is drawn with, "" where it is empty."""
    if not region.any():
        return ""
    depth = ndimage.distance_transform_edt(region)
    inside = depth > min(RIM * rows, 0.4 * depth.max())
    dark = ink > 0.4
    core = ndimage.distance_transform_edt(dark) > SOLID * rows
    solid = ndimage.distance_transform_edt(~core) <= SOLID * rows
    if is_curly(ink, region, rows):
        return "curls"
    if solid[inside].mean() > BLACK:
        return "black"
    label, count = ndimage.label(dark & region, np.ones((3, 3)))
    if count > 12:
        length = [max(a.stop - a.start, b.stop - b.start) for a, b in ndimage.find_objects(label)]
        if np.mean(np.array(length) < SPECK * rows) > SPECKS and ink[inside].mean() < 0.25:
            return "stubble"
    return "strands" if ink[inside].mean() >= EMPTY else "outline"


def is_curly(ink: NDArray, region: NDArray, rows: int) -> bool:
    """Whether a region (h, w) bool of a picture (h, w), 1 is ink, is drawn as curls: by strokes and
    the outer edge together (logistic regression), by that alone in one tone without strokes.

    rows : cells to a head
    """
    bend, alike, much = _bends(ink, region, rows)
    edge = scallops(ink, region, rows)
    if much <= STROKED:
        return is_scalloped(*edge)
    return bool(_weighed(bend, alike, *edge) @ CURLY[:-1] + CURLY[-1] > 0)


def curls_say(ink: NDArray, region: NDArray, rows: int) -> tuple[NDArray[np.float64], bool]:
    """(5,) what CURLY weighs, and whether there are strokes to speak of; see `is_curly`.

    These are the logarithm of how sharply strokes bend; how much they agree with those around them;
    the roots of how many valleys and tips there are to a head of the outer edge; and thousandths of
    square heads of valleys to it.
    """
    bend, alike, much = _bends(ink, region, rows)
    return _weighed(bend, alike, *scallops(ink, region, rows)), much > STROKED


def _weighed(
    bend: float, alike: float, valleys: float, hollow: float, tips: float
) -> NDArray[np.float64]:
    return np.array([np.log1p(bend), alike, np.sqrt(valleys), np.sqrt(tips), 1000 * hollow])


def _bends(ink: NDArray, region: NDArray, rows: int) -> tuple[float, float, float]:
    """How sharply strokes bend in a region (h, w) bool, one over heads: how fast their direction
    turns along them, root mean square, by how much ink says it; their coherence as far as a lock is
    wide, the mean; and how much of strokes there is to a cell."""
    part = tuple(
        slice(max(at.start - 4, 0), at.stop + 4)
        for at in ndimage.find_objects(region.astype(np.uint8))[0]
    )
    depth = ndimage.distance_transform_edt(region[part])
    inside = depth > min(RIM * rows, 0.4 * depth.max())
    few = FEW * rows**2
    down, across, right = tensor(ink[part], LOCK * rows, inside)
    total = down + right
    drawn = inside & (total > 1e-3)
    agreed = np.hypot(right - down, 2 * across) / np.maximum(total, 1e-9)
    alike = (agreed[drawn].sum() + few * ALIKE) / (drawn.sum() + few)
    down, across, right = tensor(ink[part], STROKE * rows, inside)
    total = down + right
    twice = np.arctan2(2 * across, right - down)
    cos, sin = np.cos(twice), np.sin(twice)
    turn = [0.5 * (cos * np.gradient(sin, axis=k) - sin * np.gradient(cos, axis=k)) for k in (0, 1)]
    # Strokes run across the direction in which ink changes most.
    along = np.abs(turn[0] * np.cos(twice / 2) - turn[1] * np.sin(twice / 2)) * rows
    agreed = (np.hypot(right - down, 2 * across) / np.maximum(total, 1e-9)) ** 2
    weight = np.where(inside & (total > 1e-3), np.sqrt(np.maximum(total, 0)) * agreed, 0)
    bent = (weight * np.minimum(along, SHARPEST) ** 2).sum() + few * BENT**2
    much = weight.sum()
    return float(np.sqrt(bent / (much + few))), float(alike), float(much / max(inside.sum(), 1))


def waves_in(strokes: Strokes, region: NDArray, rows: int) -> float:
    """How wavy strokes are, 0 to 1: by how much they turn to and fro from the way that they run all
    around."""
    weight = strokes.coherence * region
    if not weight.any():
        return 0.0
    x, y = strokes.along[..., 0], strokes.along[..., 1]
    cos, sin = x * x - y * y, 2 * x * y
    mean_cos, mean_sin = (ndimage.gaussian_filter(of * weight, SWAY * rows) for of in (cos, sin))
    off = 0.5 * np.arctan2(sin * mean_cos - cos * mean_sin, cos * mean_cos + sin * mean_sin)
    sway = float(np.sqrt((weight * off**2).sum() / weight.sum()))
    return float(np.clip((sway - STRAIGHT) / (WAVY - STRAIGHT), 0, 1))


def parting(
    strokes: Strokes, region: NDArray, face: NDArray, rows: int, falls: bool = False
) -> NDArray[np.float64] | None:
    """(2,) column and row where a parting meets the forehead, None where none is drawn.

    Beside a parting strokes run down and away from it; combed back they run up and away. Short hair
    does so around the crown as well: there only what is near to the parting says that it is one.
    face : (h, w) bool;  falls : whether hair falls beside the face
    """
    kind = "falls" if falls else "lies"
    columns = np.flatnonzero(face.any(axis=0))
    if not len(columns) or not region.any():
        return None
    brow = int(np.argmax(face.any(axis=1))) + int(0.1 * rows)
    inside = ndimage.distance_transform_edt(region) > RIM * rows  # the outline leans as if parted
    above = inside & (np.arange(len(region))[:, None] < brow)
    lean = 2 * strokes.along[..., 0] * strokes.along[..., 1] * strokes.coherence
    sum_ = np.concatenate([[0.0], np.cumsum((lean * above).sum(axis=0))])
    much = np.concatenate([[0.0], np.cumsum((strokes.coherence * above).sum(axis=0))])
    k, last = np.arange(columns[0], columns[-1] + 1), region.shape[1]
    reach = int(REACH[kind] * rows)
    low, high = np.maximum(k - reach, 0), np.minimum(k + reach, last)
    right, left = sum_[high] - sum_[k], sum_[k] - sum_[low]
    both = np.minimum(much[high] - much[k], much[k] - much[low])
    surplus = (right - left) / np.maximum(much[high] - much[low], 1e-9)
    surplus = np.where(both > LOPSIDED * (much[high] - much[low]), surplus, -1.0)
    best = int(surplus.argmax())
    if surplus[best] < PARTED[kind] or (right[best] < 0) or (left[best] > 0):
        return None
    column = int(k[best])
    hair = np.flatnonzero(region[:brow, column])
    return np.array([column, hair[-1] if len(hair) else brow], float)
