"""How a cut is combed: longer or shorter, fuller or flatter than it was drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from .cut import ANGLES, Ball, Cut
from .presets import HAIRLINE

LEAST, MOST = 0.3, 2.0  # of length and volume
# Degrees from the front at which a face ceases to be open, and is not open any more: hair that ends
# at the hairline is combed away from there, and only a fringe grows; behind that all of it does.
OPEN = (34.0, 62.0)
BALD = 0.12  # height above the hairline from which on there is no hair to grow
THIN = 0.25  # share of its thickest place that hair has at least, for what volume adds


@dataclass(frozen=True)
class Style:
    """length, volume : LEAST to MOST, 1 as drawn. InputError for others."""

    length: float = 1.0
    volume: float = 1.0

    def __post_init__(self) -> None:
        for name in ("length", "volume"):
            value = getattr(self, name)
            if not LEAST <= value <= MOST:  # not-a-number fails, too
                raise InputError(
                    f"the {name} of hair must be from {LEAST:g} to {MOST:g}, got {value}"
                )


AS_DRAWN = Style()


def styled(cut: Cut, style: Style) -> Cut:
    """The cut, combed so."""
    return fuller(longer(cut, style.length), style.volume)


def longer(cut: Cut, factor: float) -> Cut:
    """The cut with hair `factor` times as long, measured from the crown; of a fringe, and where it
    is gathered into tails, what hangs below the hairline. Shorter hair ends at the hairline at the
    latest; what is bald stays bald, and 1 changes nothing."""
    if factor == 1:
        return cut
    line = _hairline()
    hangs = np.maximum(line - cut.edge, 0)
    side = np.clip((_from_the_front() - OPEN[0]) / (OPEN[1] - OPEN[0]), 0, 1)
    length = hangs if cut.balls else (1 - side) * hangs + side * (1 - cut.edge)
    length = length * np.clip(1 - (cut.edge - line) / BALD, 0, 1)
    if cut.top is not None:
        length = np.where(cut.top > cut.edge, length, 0)
    edge = cut.edge - (factor - 1) * length
    if factor < 1:
        edge = np.minimum(edge, np.maximum(cut.edge, line))
    return replace(cut, edge=edge, balls=tuple(_longer_ball(b, factor) for b in cut.balls))


def fuller(cut: Cut, factor: float) -> Cut:
    """The cut with hair `factor` times as thick; 1 changes nothing."""
    if factor == 1:
        return cut
    thickest = np.maximum(cut.thick.max(axis=1, keepdims=True), 0)
    thick = cut.thick + (factor - 1) * np.maximum(cut.thick, THIN * thickest)
    balls = tuple(replace(ball, radius=ball.radius * factor) for ball in cut.balls)
    return replace(cut, thick=thick, balls=balls)


def _longer_ball(ball: Ball, factor: float) -> Ball:
    """A tail that hangs down farther; a bun as it is."""
    line = ball.line.copy()
    first = line[0, 1]
    line[:, 1] = np.where(line[:, 1] < first, first + factor * (line[:, 1] - first), line[:, 1])
    return replace(ball, line=line)


def _from_the_front() -> NDArray[np.float64]:
    """(48,) degrees of ANGLES from the front, the same on both sides."""
    return np.degrees(np.minimum(ANGLES, 2 * np.pi - ANGLES))


def _hairline() -> NDArray[np.float64]:
    """(48,) heights at ANGLES of where hair usually begins to grow."""
    return np.interp(_from_the_front(), *np.array(HAIRLINE).T)
