"""Beards to put on any face, as tables of a few numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from .beard import Beard
from .chart import ALONG, UP

MM = 1e-3
SOFT = 5 * MM
"""Metres over which a beard grows thin at its rim."""
Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Preset:
    """A beard as points along the jaw, 0 at the chin and 1 at the ear.

    top, low : (share of the jaw, millimetres up from it) of its upper and lower rim
    over, mouth : whether it has a moustache, and what is below the mouth
    length : (share of the jaw, millimetres) of its hairs;  moustache : millimetres
    """

    top: Points
    low: Points
    length: Points
    moustache: float = 8.0
    over: bool = True
    mouth: bool = True
    fall: float = 0.6
    curl: float = 0.0
    thick: float = 1.0


FULL: Points = ((0, 61), (0.22, 60), (0.34, 52), (0.44, 42), (0.55, 34), (0.7, 27), (0.92, 27))
UNDER: Points = ((0, -26), (0.4, -24), (0.7, -12), (0.9, -4))
NONE = 1.0  # millimetre; no hair
PRESETS: dict[str, Preset] = {
    "stubble": Preset(FULL, UNDER, ((0, 2.4),), 2.4, thick=0.9),
    "moustache": Preset(((0, 61), (0.24, 60), (0.34, 50), (0.38, 36)), ((0, 42), (1, 42)),
                        ((0, 0),), 11.0, mouth=False),
    "goatee": Preset(((0, 61), (0.16, 60), (0.22, 46), (0.28, -45)), ((0, -16), (0.3, -10)),
                     ((0, 26), (0.2, 18), (0.35, 8)), 8.0),
    "chin strap": Preset(((0, 14), (0.4, 14), (0.7, 12), (0.92, 18)), ((0, -10), (0.9, -6)),
                         ((0, 7),), 0.0, over=False),
    "full beard": Preset(FULL, UNDER, ((0, 30), (0.3, 24), (0.6, 15), (0.9, 9)), 12.0),
    "long beard": Preset(FULL, UNDER, ((0, 120), (0.15, 105), (0.3, 60), (0.45, 30),
                                        (0.6, 18), (0.9, 10)), 20.0, fall=0.95),
    "curly beard": Preset(FULL, UNDER, ((0, 42), (0.3, 34), (0.6, 22), (0.9, 12)), 14.0, curl=1.0),
}  # fmt: skip


def preset(name: str, colour: float = 0.75) -> Beard:
    """A beard to start from; InputError for a name that is none."""
    if name not in PRESETS:
        raise InputError(f"there is no beard '{name}'; choose one of {', '.join(PRESETS)}")
    row = PRESETS[name]
    cover = rimmed(row.top, row.low)
    if not row.mouth:
        cover = cover * (UP > 40 * MM)
    return Beard(
        row.thick * cover, _between(row.length) * MM, row.moustache * MM if row.over else 0.0,
        row.fall, row.curl, colour,
    )  # fmt: skip


def rimmed(top: Points, low: Points) -> NDArray[np.float64]:
    """(COLUMNS, ROWS) cover between an upper and a lower rim, as in `Preset`."""
    above, below = (_between(points)[:, None] * MM for points in (top, low))
    return _soft(above - UP) * _soft(UP - below)


def _between(points: Points) -> NDArray[np.float64]:
    """(COLUMNS,) values at ALONG."""
    return np.interp(ALONG, *np.array(points, float).T)


def _soft(inside: NDArray) -> NDArray[np.float64]:
    """0..1 of metres inside a rim."""
    return np.clip(0.5 + inside / (2 * SOFT), 0, 1)
