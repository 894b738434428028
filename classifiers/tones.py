"""Ink and paper told apart: a picture's tones as the drawing that is in them.

Light that falls unevenly, toned paper, chalk on a board, shading and photographs: all become
strokes of ink on white.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from facs_rig.common.errors import InputError

from .ruled import without_rules

Floats = NDArray[np.float32]

_PAPER_BLOCKS = 192  # the paper's tone is estimated on a grid of about so many blocks a side
_FITTED = 64  # of which about so many a side are looked at for a smooth surface
_SOLID_INK = 0.35  # of the way from ink to paper: a broad area below is ink, above it is shadow
_BLACK, _MUCH_BLACK = 0.15, 0.25  # tone relative to the paper; share of the page
FAINTEST_CONTRAST = 0.04  # of the full range, between paper and ink
_FAINTEST_INK = 0.12  # darkness relative to the paper that can be a stroke
_LEAST_INK = 2e-4  # share of the picture: less than that is dust
# What paintings and photographs have much of and line drawings little; shares of these add up, to
# 0.2 to 0.4 for line drawings, to 0.6 for shaded pencil, to 1.5 to 3 for most photographs.
_MOST_GRAIN = 0.16  # spread of the commonest tones, relative to the paper
_MOST_MIDTONES = 0.24  # share of the picture in broad areas neither paper nor ink
_SHADED, _PAINTED = 0.5, 1.0  # tonality from which lines are sought in tones; that gets a word
_BLACKEST = 0.02  # of the paper: no surroundings are darker
_LOCAL = 1 / 48  # of the longest side: how far around it a line is darker than its surroundings


def as_drawing(values: Floats, name: str) -> tuple[Floats, bool, bool]:
    """The drawing (h, w), 1 = paper and 0 = ink, that is in tones (h, w) of 0..1.

    And whether it had to be turned over, and whether it is rather a painting or a photograph, of
    which the drawing is the lines.

    InputError for a blank page, called `name`.
    """
    if not np.isfinite(values).all():
        raise InputError(f"{name} holds values that are not numbers; save it again.")
    dark, light = _extremes(values)
    if light - dark < FAINTEST_CONTRAST:
        raise InputError(f"{name} is blank; draw a face on it, or choose another file.")
    inverted = _is_light_on_dark(np.clip((values - dark) / (light - dark), 0, 1))
    if inverted:
        values, dark, light = 1 - values, 1 - light, 1 - dark
    values = np.clip(values / light, 0, 1)
    paper = _paper(values, dark / light)
    tonality = _tonality(1 - values / paper)
    if tonality > _SHADED:
        values = _lines_of(values)
        dark, _ = _extremes(values)
        paper = _paper(values, dark)
    return _inked(values, paper, name), inverted, tonality > _PAINTED


def _lines_of(values: Floats) -> Floats:
    """Tones (h, w) relative to those around them: what is darker than its surroundings is a line.

    A difference of Gaussians, of logarithms of tones: so that a line counts the same in the light
    and in the shadow of a face. What is black stays so: a pupil, an open mouth, hair.
    """
    around = ndimage.gaussian_filter(values, _LOCAL * max(values.shape), mode="nearest")
    lines = np.clip(values / np.maximum(around, _BLACKEST), 0, 1)
    return np.where(values < _BLACK, np.minimum(values, lines), lines).astype(np.float32)


def _inked(values: Floats, paper: Floats, name: str) -> Floats:
    """The drawing of tones on paper (h, w): its ink stretched, its grain gone; rules taken out."""
    # Most of what is not solid black is paper, so that its median is the paper's own tone.
    there = _not_solid(values / paper)
    paper *= min(1.0, float(np.median((values / paper)[there])))
    noise = 1.4826 * float(np.median(np.abs(values - paper)[there]))  # robust standard deviation
    darkness = np.maximum(1 - values / paper, 0)
    grain = noise / paper  # the same noise is stronger against dimly lit paper
    ink = darkness > np.maximum(_FAINTEST_INK, 4 * grain)
    ruled, darkness = darkness, without_rules(darkness, ink)
    if darkness is not ruled:
        ink &= darkness > 0
    share = float(ink.mean())
    if share < _LEAST_INK:
        raise InputError(f"{name} is blank; draw a face on it, or choose another file.")
    # The darker half of the ink becomes full ink, the grain becomes paper. Both are fixed points
    # of a second pass: the grain is 0 then, and at least half of the ink is at 1.
    full = float(np.quantile(darkness[ink], 0.5, method="lower"))
    floor = np.minimum(3 * grain, full / 2)
    drawing = 1 - np.clip((darkness - floor) / (full - floor), 0, 1)
    return drawing.astype(np.float32)


def _extremes(values: Floats) -> tuple[float, float]:
    """Darkest and lightest tone that more than a few pixels have."""
    few = max(4, int(1e-4 * values.size))
    flat = np.partition(values.ravel(), [few, values.size - 1 - few])
    return float(flat[few]), float(flat[-1 - few])


def _is_light_on_dark(values: Floats) -> bool:
    """Paper is what most of the picture and most of its margin are.

    values : (h, w) 0..1. Where those two disagree or are undecided, the thin strokes decide: they
    stand out of their surroundings on the ink's side. Odd under `1 - values`.
    """
    margin = max(1, min(values.shape) // 32)
    edge = np.concatenate(
        [
            values[:margin].ravel(),
            values[-margin:].ravel(),
            values[:, :margin].ravel(),
            values[:, -margin:].ravel(),
        ]
    )
    lightness = float(np.median(values)) + float(np.median(edge)) - 1
    # Of strokes there is little. Where both tones are broad, as with much black hair, none is paper
    # because there is more of it.
    black = float((values < 0.5).mean())
    if abs(lightness) > 0.2 and not _MUCH_BLACK < black < 1 - _MUCH_BLACK:
        return lightness < 0
    detail = values - ndimage.gaussian_filter(values, min(values.shape) / 40)
    skewness = float((detail**3).mean()) / max(float(detail.std()) ** 3, 1e-12)
    return skewness > 0.5


def _paper(values: Floats, black: float) -> Floats:
    """The paper's tone under each pixel: light that falls unevenly, toned paper.

    values : (h, w) 0..1, dark ink;  black : the darkest tone, of the ink. Returns (h, w) in 0.2..1.

    The light tones of small blocks are fitted with a cubic surface by asymmetric least squares
    (errors below it hardly count: that is ink), after which blocks that are paper by that fit are
    averaged locally. Large solid blacks stay black, as they lie far below the surface; a
    morphological closing would take them for shadow.
    """
    tones = _block_tones(values)
    if (tones[tones > 0.5] > 0.98).mean(dtype=float) > 0.98:
        return np.ones_like(values)  # a clean scan or a digital drawing: nothing to flatten
    surface = _upper_surface(tones)
    # Between dense strokes: the lightest tone within reach, then back to where it was.
    reach = 2 * (max(tones.shape) // 24) + 1
    tones = ndimage.grey_closing(tones, (reach, reach), mode="nearest")
    solid = black + _SOLID_INK * (1 - black)  # pale ink is solid at a paler tone
    weight = (tones > solid * surface).astype(np.float32)
    spread = max(tones.shape) / 64
    near = ndimage.gaussian_filter(weight, spread, mode="nearest")
    local = ndimage.gaussian_filter(weight * tones, spread, mode="nearest")
    # The surface joins in as a little evidence everywhere, and is all there is under solid blacks.
    paper = (local + 0.01 * surface) / (near + 0.01)
    height, width = values.shape
    picture = Image.fromarray(paper.astype(np.float32))
    paper = np.asarray(picture.resize((width, height), Image.Resampling.BICUBIC))
    return np.clip(paper, 0.05, 1)


def _block_tones(values: Floats) -> Floats:
    """Upper-quartile tone of square blocks: the paper between the strokes."""
    height, width = values.shape
    side = max(2, -(-max(height, width) // _PAPER_BLOCKS))
    padded = np.pad(values, ((0, -height % side), (0, -width % side)), mode="edge")
    rows, columns = padded.shape[0] // side, padded.shape[1] // side
    blocks = padded.reshape(rows, side, columns, side).transpose(0, 2, 1, 3)
    blocks = blocks.reshape(rows, columns, side * side)
    rank = (3 * side * side) // 4
    return np.partition(blocks, rank, axis=2)[..., rank]


def _upper_surface(tones: Floats) -> Floats:
    """Cubic surface along the upper side of `tones`, (rows, columns).

    Asymmetric least squares: P. Eilers and H. Boelens, Baseline Correction with Asymmetric Least
    Squares Smoothing, 2005; here with polynomials in place of the smoothness penalty.
    """
    terms = _cubic_terms(tones.shape)
    some = tuple(slice(None, None, -(-n // _FITTED)) for n in tones.shape)  # ten numbers need few
    whole, terms = terms, terms[some].reshape(-1, 10)
    target = tones[some].ravel().astype(np.float64)
    weight: NDArray[Any] = np.ones_like(target)
    ridge = 1e-3 * len(target) * np.diag([0.0] + [1.0] * 9)  # rather flat than wild
    factors: NDArray[Any] = np.zeros(10)
    for _ in range(12):
        weighted = terms * weight[:, None]
        factors = np.linalg.solve(terms.T @ weighted + ridge, weighted.T @ target)
        fitted = terms @ factors
        weight = np.where(target > fitted, 0.97, 0.03)
    return np.clip(whole @ factors, 0.2 * tones.max(), tones.max()).astype(np.float32)


def _cubic_terms(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """(rows, columns, 10) the terms of a cubic polynomial of two variables from -1 to 1."""
    v, u = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    return np.stack([u**i * v**j for i in range(4) for j in range(4 - i)], axis=-1)


def _not_solid(lightness: Floats) -> NDArray[np.bool_]:
    """(h, w) what is not black, of a page of which much is; all of any other page."""
    solid = lightness < _BLACK
    return ~solid if solid.mean() > _MUCH_BLACK else np.ones_like(solid)


def _tonality(darkness: Floats) -> float:
    """How far the tones spread beyond ink and paper; a line drawing stays under 1.

    Counts the spread of the commonest tones (nearly none on paper) and the share of the picture
    in mid-toned areas wider than any stroke's soft edge.
    """
    tones = darkness[_not_solid(1 - darkness)]
    spread = 1.4826 * float(np.median(np.abs(tones - np.median(tones))))
    middle = np.logical_and(darkness > 0.15, darkness < 0.85)
    radius = max(1, round(max(darkness.shape) / 256))
    broad = float(ndimage.minimum_filter(middle, 2 * radius + 1).mean())
    return spread / _MOST_GRAIN + broad / _MOST_MIDTONES
