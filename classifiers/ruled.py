"""Lined and squared paper: long straight parallel rules are no drawing.

Rules are looked for in strips of the page, so that they may be slanted a little by the scanner and
crossed by the drawing. Only a family of several at even distances is taken for rules; then a line
across it, such as a margin's, counts too. What is taken out is their thin ink alone: where a stroke
crosses a rule, or lies on it and is darker, the ink is the stroke's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Floats = NDArray[np.float32]

SIDE = 800  # px of the longest side at which rules are looked for
STRIPS = 40  # along a rule
STEEPEST = 0.1  # slope, about 6 degrees
THICKEST = 1 / 80  # of the longest side
ALONG = 0.8  # of a strip's columns have ink where a rule is
LEAST_LONG, LEAST_WHOLE = 0.62, 0.85  # share of the strips: of each rule, and of one that is alone
LEAST_MANY = 4
EVEN = 0.15  # of the distance: how much the distances of rules may vary


@dataclass(frozen=True)
class Rules:
    """Nearly level lines. slope : rows per column      rows : where they are, in the middle column;
    all in pixels of the page."""

    slope: float
    rows: NDArray[np.float64]


def without_rules(darkness: Floats, ink: NDArray[np.bool_]) -> Floats:
    """(h, w) darkness relative to the paper without the rules of the paper; itself if it has none.

    ink : (h, w) where there is ink at all
    """
    level, upright = find(ink), find(ink.T)
    if level is None and upright is None:
        return darkness
    level = level or find(ink, alone=True)
    upright = upright or find(ink.T, alone=True)
    darkness = darkness.copy()
    for rules, page, where in ((level, darkness, ink), (upright, darkness.T, ink.T)):
        if rules is not None:
            _erase(rules, page, where)
    return darkness


def find(ink: NDArray[np.bool_], alone: bool = False) -> Rules | None:
    """The nearly level rules of a page (h, w), or None if there is no family of them.

    alone : a single line counts, if it crosses the whole page
    """
    scale = -(-max(ink.shape) // SIDE)
    small = _reduced(ink, scale)
    height, width = small.shape
    side = max(width // STRIPS, 10)
    count = width // side
    if count < 8 or height < 24:
        return None
    thickest = max(round(THICKEST * max(small.shape)), 2) + 1
    thin = small & ~_opened(small, thickest + 1)
    reach = int(np.ceil(STEEPEST * side / 2)) + 1
    near = ndimage.maximum_filter1d(thin, 2 * reach + 1, axis=0)
    inked = near[:, : count * side].reshape(height, count, side).astype(np.float32)
    # A product counts in a fraction of the time that a sum over so few columns takes.
    strips = (inked @ np.ones(side, np.float32)).astype(float) / side >= ALONG
    # A strip that is all lines tells of none.
    middles = (np.arange(count) + 0.5) * side - width / 2
    least = LEAST_WHOLE if alone else LEAST_LONG
    if (_most(strips, middles) >= least).sum() < (1 if alone else LEAST_MANY):
        return None
    best: tuple[float, float, Any] = (0.0, 0.0, None)
    rows = np.arange(height)
    # So many slopes that neighbours differ by two pixels at the ends of a rule.
    for slope in np.linspace(-STEEPEST, STEEPEST, 2 * int(STEEPEST * width / 4) + 1):
        place = rows[:, None] + np.rint(slope * middles).astype(int)
        inside = (place >= 0) & (place < height)
        seen = strips[np.clip(place, 0, height - 1), np.arange(count)] & inside
        share = seen.sum(axis=1) / np.maximum(inside.sum(axis=1), 1)
        share[inside.mean(axis=1) < 0.5] = 0
        score = float(np.square(share[share >= least]).sum())
        # Level is likelier than slanted, and a rule is as wide as the reach.
        if score > 1.02 * best[0] or (score >= best[0] > 0 and abs(slope) < abs(best[1])):
            best = (score, float(slope), share >= least)
    if best[2] is None:
        return None
    found, many = ndimage.label(best[2])
    places = np.array([np.flatnonzero(found == k + 1).mean() + 0.5 for k in range(many)])
    widths = np.bincount(found)[1:]
    places = places[widths <= 2 * (2 * reach + 1) + thickest]
    if not alone and not _even(places):
        return None
    if not len(places):
        return None
    return Rules(best[1], places.astype(np.float64) * scale)


def _opened(ink: NDArray[np.bool_], length: int) -> NDArray[np.bool_]:
    """`binary_opening` by an upright line of so many pixels, in the time of two filters."""
    values, even = ink.astype(np.uint8), 1 - length % 2
    worn = ndimage.minimum_filter1d(values, length, axis=0, mode="constant")
    full = ndimage.maximum_filter1d(worn, length, axis=0, mode="constant", origin=-even)
    return full.astype(bool)


def _most(strips: NDArray[np.bool_], middles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(h,) the largest share of the strips (h, count) that a rule of any slope through this row of
    the middle column can have: most pages end here."""
    reach = np.ceil(STEEPEST * np.abs(middles)).astype(int) + 1
    near = [
        ndimage.maximum_filter1d(strip, 2 * r + 1) for strip, r in zip(strips.T, reach, strict=True)
    ]
    most = np.mean(near, axis=0)
    edge = int(reach.max())
    most[:edge] *= 2  # of a rule that leaves the page, the half that is on it
    most[-edge:] *= 2
    return most


def _even(places: NDArray[np.float64]) -> bool:
    """Whether lines lie at even distances, though some of them may be missing."""
    if len(places) < LEAST_MANY:
        return False
    gaps = np.diff(np.sort(places))
    usual = float(np.median(gaps))
    times = np.maximum(np.rint(gaps / usual), 1)
    off = np.abs(gaps / times - usual) / usual
    return float((off < EVEN).mean()) >= 0.75 and float(off.mean()) < EVEN


def _reduced(ink: NDArray[np.bool_], scale: int) -> NDArray[np.bool_]:
    """A smaller page in which no thin line is lost."""
    if scale == 1:
        return ink
    height, width = (-(-n // scale) * scale for n in ink.shape)
    padded = np.zeros((height, width), bool)
    padded[: ink.shape[0], : ink.shape[1]] = ink
    blocks = padded.reshape(height // scale, scale, width // scale, scale)
    return blocks.any(axis=(1, 3))


def _erase(rules: Rules, page: Floats, ink: NDArray[np.bool_]) -> None:
    """Take nearly level rules out of a page (h, w), in place."""
    height, width = page.shape
    scale = -(-max(page.shape) // SIDE)
    reach = int(np.ceil(STEEPEST * max(width // STRIPS, 10) / 2)) + 2 * scale
    thickest = max(round(THICKEST * max(page.shape)), 2) + 2
    # Of every ink pixel, where its upright run begins and ends.
    edge = np.diff(np.pad(ink, ((1, 1), (0, 0))).astype(np.int8), axis=0)
    index = np.arange(height + 1)[:, None]
    begin = np.maximum.accumulate(np.where(edge[:-1] == 1, index[:-1], 0), axis=0)
    after = np.where(edge[1:] == -1, index[1:], height)
    end = np.minimum.accumulate(after[::-1], axis=0)[::-1]
    columns = np.arange(width)
    middles = columns + 0.5 - width / 2
    window = np.arange(-reach, reach + 1)
    for row in rules.rows:
        centre = np.floor(row + rules.slope * middles).astype(int)
        place = np.clip(centre + window[:, None], 0, height - 1)
        here = ink[place, columns]
        # The run nearest to where the rule is expected.
        order = np.abs(window)[:, None] + np.where(here, 0, 10 * reach + 10)
        nearest = place[order.argmin(axis=0), columns]
        there = here.any(axis=0)
        first, last = begin[nearest, columns], end[nearest, columns]
        thickness = last - first
        thin = there & (thickness <= thickest)
        if not thin.any():
            continue
        usual = float(np.median(thickness[thin]))
        spread = max(1.0, 0.5 * usual)
        where = _follow((first + last) / 2, thin & (thickness <= usual + spread), centre + 0.5)
        near = np.abs((first + last) / 2 - where) <= 1.0 + 0.5 * usual
        mine = np.flatnonzero(thin & (thickness <= usual + spread) & near)
        tones = page[nearest, columns]
        peak = float(np.median(tones[mine])) if len(mine) else 0.0
        for column in mine:
            run = page[first[column] : last[column], column]
            if run.max(initial=0.0) <= 1.35 * peak + 0.1:
                low, high = max(first[column] - 1, 0), last[column] + 1
                part = page[low:high, column]  # with its soft edge
                part[part <= 1.35 * peak + 0.1] = 0


def _follow(
    middle: NDArray[np.float64], known: NDArray[np.bool_], expected: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where a rule is in each column: the running median of where it was seen."""
    if known.sum() < 8:
        return expected
    columns = np.flatnonzero(known)
    size = max(5, 2 * (len(columns) // 24) + 1)
    off = ndimage.median_filter(middle[columns] - expected[columns], size, mode="nearest")
    return expected + np.interp(np.arange(len(middle)), columns, off)
