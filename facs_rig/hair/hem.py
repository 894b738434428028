"""Where hair that hangs ends: in many points that nearly meet a line, over a surface a bit shorter.

Hairs of a clump are about as long, and lie together toward their ends: a clump ends in a brush, its
middle longest. What lies under the tips ends above them and bends in, so that no rim is seen.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .cut import Cut
from .head import WIDEST
from .shell import Shell, edge_heights

TUCKED = 0.008  # metres that the surface ends above the tips
FROM = 0.5  # share of a column above which it is as it was
CLOSED = 0.8  # share of its thickness that it has lost at its rim
LEVEL = (0.75, 0.35)  # slopes of an edge between which hair comes to end at it, not to run along it
LENGTH = (0.035, 0.10)  # metres of a tip
# Share of how far hair falls by which tips differ, and that at least and at most, metres.
LAYERS = (0.025, 0.003, 0.009)
CLUMP, DRAWN, BRUSH = 0.018, 0.3, 0.5  # metres across, how far it is drawn together, how pointed
OVERLAP, WIDEST_TIP = 3.2, 0.014  # times as wide as they are apart, and metres at most
CURLY = 0.5  # curl at which tips are the curls themselves
BENT = (0.0, 0.003)  # metres that tips bend in


def hanging(shell: Shell, cut: Cut) -> NDArray[np.float64]:
    """(columns,) 0..1, how far a column ends in tips: where it falls and its edge is level."""
    end = shell.points[shell.outer[:, -1]].astype(np.float64)
    along = np.roll(end, -1, axis=0) - np.roll(end, 1, axis=0)
    slope = np.abs(along[:, 1]) / np.maximum(np.linalg.norm(along, axis=1), 1e-9)
    level = np.clip((LEVEL[0] - slope) / (LEVEL[0] - LEVEL[1]), 0, 1)
    falls = cut.hangs & (edge_heights(cut, shell.azimuth) < WIDEST)
    return falls * level * np.clip(1 - cut.curl / CURLY, 0, 1)


def tucked(shell: Shell, cut: Cut) -> Shell:
    """The shell as it is under tips: it ends above them, and its sheets meet there."""
    hem = hanging(shell, cut)[:, None]
    if not hem.any():
        return shell
    columns, rows = shell.outer.shape
    points = shell.points.copy()
    outer = points[shell.outer].astype(np.float64)
    row = np.linalg.norm(outer[:, -1] - outer[:, -3], axis=1)[:, None] / 2
    late = np.clip((np.linspace(0, 1, rows) - FROM) / (1 - FROM), 0, 1) ** 2
    at = np.arange(rows) - np.minimum(hem * TUCKED / row, 0.25 * rows) * late
    low = np.minimum(at.astype(np.intp), rows - 2)
    share = (at - low)[..., None]
    column = np.arange(columns)[:, None]
    for sheet in (shell.outer, shell.inner):
        whole = shell.points[sheet]
        points[sheet] = whole[column, low] * (1 - share) + whole[column, low + 1] * share
    last = [sheet[:, -1] for sheet in (shell.outer, shell.inner)]
    points[last[0]] += hem * CLOSED * (points[last[1]] - points[last[0]])
    return replace(shell, points=points)


def tip_paths(
    shell: Shell, cut: Cut, rng: np.random.Generator, count: int, t: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Columns and rows of `shell.outer` along tips (count, k, 2), beyond the last row where
    they are longer; metres that they are wide (count,), and that they bend in (count,).

    t : (k,) 0..1, shares of their length
    """
    hem = hanging(shell, cut)
    columns, rows = shell.outer.shape
    outer = shell.points[shell.outer].astype(np.float64)
    row = np.linalg.norm(outer[:, -1] - outer[:, -3], axis=1) / 2
    wide = np.linalg.norm(np.roll(outer[:, -1], -1, axis=0) - outer[:, -1], axis=1)
    reach = np.concatenate([[0.0], np.cumsum(wide * (hem + np.roll(hem, -1)) / 2)])
    whole = reach[-1]
    number = np.arange(count)
    place = (number + rng.uniform(0, 1, count)) / max(count, 1) * whole  # metres along the hem
    # Clumps of unlike width: their borders are moved from where even ones would have them.
    borders = np.arange(max(round(whole / CLUMP), 1) + 1.0)
    borders[1:-1] += rng.uniform(-0.35, 0.35, len(borders) - 2)
    borders *= whole / borders[-1]
    clump = np.clip(np.searchsorted(borders, place, side="right") - 1, 0, len(borders) - 2)
    middle = (borders[clump] + borders[clump + 1]) / 2
    aside = 2 * (place - middle) / (borders[clump + 1] - borders[clump])  # -1..1
    drawn = DRAWN * rng.uniform(0.6, 1.2, len(borders))[clump] * (middle - place)

    def column(metres: NDArray) -> NDArray[np.float64]:
        return np.interp(metres, reach, np.arange(columns + 1.0))

    start = column(place)
    near = np.rint(start).astype(np.intp) % columns
    fall = np.linalg.norm(outer[:, 1:] - outer[:, :-1], axis=-1).sum(axis=1)[near]
    zone = np.clip(LAYERS[0] * fall, *LAYERS[1:])
    longer = rng.normal(0, 0.3, len(borders))[clump] - BRUSH * np.abs(aside) ** 1.5
    longer = zone * np.clip(longer + 0.5 - rng.exponential(0.25, count), -2, 1)
    length = np.minimum(rng.uniform(*LENGTH, count), 0.45 * fall)
    metres = (length + longer)[:, None] * t - length[:, None]
    end = column(place + drawn)
    path = np.empty((count, len(t), 2))
    path[..., 0] = start[:, None] + (end - start)[:, None] * t**1.5
    path[..., 1] = np.maximum(rows - 1 + metres / row[near][:, None], 0)
    width = min(OVERLAP * whole / max(count, 1), WIDEST_TIP) * rng.uniform(0.7, 1.3, count)
    return path, width, rng.uniform(*BENT, count)
