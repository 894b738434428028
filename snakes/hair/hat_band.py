"""What a hat's rim ends in: what a line across the hat cuts off, a fold or a peak, or a ribbon."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from facs_rig.hair.hat import Hat

from .region import ROWS, PageHair
from .sight import Sight

__all__ = ["Line", "line_across", "with_band"]

INKED, GAP = 0.3, 2
"""Ink of a line, and cells of paper between it and the border, which is another line."""
BAND, LEVEL = (0.075, 0.3), 0.5
"""Heads above the border between which a line is looked for, and how level it is: 1 wholly."""
LINED, EVEN = 0.6, 0.018
"""Share of the columns in front in which it is drawn, and heads that it is off a smooth line: what
is hatched has strokes at any height."""
CRESCENT = 1.6
"""Times as high in its middle as at its sides that what it cuts off is a peak, not a fold."""
RIBBON, FOLD, CUFF = (0.02, 0.035), (0.025, 0.07), 0.004
"""Metres that a ribbon and what is folded up are high, and that this stands off."""
HEM = 0.009, 0.001
"""The same of a hem."""


@dataclass(frozen=True)
class Line:
    """high : metres above a hat's border at which a line runs across it in front, 0 without one
    crescent : whether what it cuts off is higher in its middle than at its sides, as a peak is
    """

    high: float = 0.0
    crescent: bool = False


def line_across(page: PageHair, sight: Sight) -> Line:
    """The line above the border of a hat, the lowest that most columns in front have.

    page : with the hat for hair;  sight : of its crown
    """
    if page.ink is None:
        return Line()
    columns = np.flatnonzero(sight.page.hair.any(axis=0))
    margin = len(columns) // 6
    columns = columns[margin : len(columns) - margin]
    hat = page.hair[:, columns]
    row = np.arange(len(hat))[:, None]
    border = len(hat) - 1 - hat[::-1].argmax(axis=0)
    above = border - row
    inked = hat & (page.ink[:, columns] > INKED)
    paper = hat & ~inked & (above >= 1)
    clear = np.where(paper, above, len(hat)).min(axis=0) + GAP
    level = 2 * page.strokes.along[:, columns, 0] ** 2 - 1 > LEVEL
    near = (above >= clear) & (above > BAND[0] * ROWS) & (above < BAND[1] * ROWS)
    high = np.where(inked & level & near, above, np.inf).min(axis=0) / ROWS
    lined = np.isfinite(high)
    if lined.mean() < LINED:
        return Line()
    x = np.linspace(-1, 1, len(columns))
    fitted = _smooth(x, high, lined)
    if np.median(np.abs(high - fitted)[lined]) > EVEN:
        return Line()
    middle, ends = fitted[len(x) // 2], (fitted[0] + fitted[-1]) / 2
    metres = float(np.median(fitted)) * ROWS / sight.unit
    return Line(metres, bool(middle > CRESCENT * max(ends, 1e-6)))


def _smooth(x: NDArray, high: NDArray, known: NDArray) -> NDArray[np.float64]:
    """(k,) a parabola through most of what is known."""
    ways = np.stack([np.ones_like(x), x, x**2], axis=1)
    weight = known.astype(float)
    value = np.where(known, high, 0.0)
    for _ in range(5):
        rows = ways * weight[:, None]
        solved = np.linalg.solve(ways.T @ rows + 1e-6 * np.eye(3), rows.T @ value)
        weight = known / (1 + ((value - ways @ solved) / EVEN) ** 2)
    return ways @ solved


def with_band(hat: Hat, line: Line) -> Hat:
    """The hat with a ribbon above its brim, with what is folded up as far as a line across it, or
    with a hem. A peak needs none."""
    if hat.peaked:
        return hat
    if hat.brim.max() > 0:
        return replace(hat, band=float(np.clip(line.high, *RIBBON)))
    if not line.high:
        return replace(hat, band=HEM[0], cuff=HEM[1])
    return replace(hat, band=float(np.clip(line.high, *FOLD)), cuff=CUFF)
