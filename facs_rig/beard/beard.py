"""A beard as numbers that carry from person to person."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from .chart import COLUMNS, ROWS
from .lip import RISE, SPREAD, WIDEST

LONGEST = 0.25
"""Metres that a beard may be long."""
MOST = {
    "moustache": LONGEST, "fall": 1.0, "curl": 1.0, "colour": 1.0, "spread": WIDEST, "rise": 1.0
}  # fmt: skip


@dataclass(frozen=True)
class Beard:
    """One beard, alike on both sides but for the way that its hairs lean.

    cover : (12, 18) float, how thick it grows on the chart of the lower face, 0..1: from the chin
        to the ear (chart.ALONG), and from under the jaw up the face (chart.UP)
    length : (12,) float, metres of its hairs, from the chin to the ear
    moustache : metres of the hairs over the mouth;  spread : halves of the mouth's width that it
        goes aside;  rise : share of the way from lip to nose that it takes in the middle
    fall : how far long hairs hang down, 0 stand off to 1
    curl : 0 straight to 1
    colour : 0 blond to 1 black, as the brows' (see facs_rig.looks)
    lean : (2, 12, 18) float, radians that hairs lean away from the face's middle, more than hair
        does of itself (chart.Chart.flow), on the left side and on the right

    InputError for arrays of another shape and for numbers that are none or out of range.
    """

    cover: NDArray[np.float64]
    length: NDArray[np.float64]
    moustache: float = 0.01
    fall: float = 0.6
    curl: float = 0.0
    colour: float = 0.75
    lean: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, COLUMNS, ROWS)))
    spread: float = SPREAD
    rise: float = RISE

    def __post_init__(self) -> None:
        object.__setattr__(self, "cover", _numbers(self.cover, "cover", (COLUMNS, ROWS), 1.0))
        object.__setattr__(self, "length", _numbers(self.length, "length", (COLUMNS,), LONGEST))
        leans = _numbers(self.lean, "lean", (2, COLUMNS, ROWS), np.pi, -np.pi)
        object.__setattr__(self, "lean", leans)
        for name, most in MOST.items():
            if not 0 <= getattr(self, name) <= most:
                value = getattr(self, name)
                raise InputError(f"a beard's {name} must be from 0 to {most:g}, got {value}")


def to_json(beard: Beard) -> str:
    """The beard as a text that `from_json` reads: exact, and the same for the same beard."""
    kept = {name: getattr(beard, name) for name in MOST}
    tables = {name: getattr(beard, name).tolist() for name in ("cover", "length", "lean")}
    return json.dumps({**tables, **kept})


def from_json(text: str) -> Beard:
    """The beard that `to_json` wrote. InputError, one sentence, for any other text."""
    try:
        kept = dict(json.loads(text))
        more = [float(kept[name]) for name in ("moustache", "fall", "curl", "colour")]
        beard = Beard(kept["cover"], kept["length"], more[0], more[1], more[2], more[3])
        # Older files do not say how hairs lean, and how far a moustache goes.
        late: dict[str, Any] = {n: float(kept[n]) for n in ("spread", "rise") if n in kept}
        return replace(beard, lean=kept.get("lean", beard.lean), **late)
    except InputError as error:
        raise InputError(f"what is kept of the beard cannot be used: {error}") from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError("what is kept of the beard is not what Sketch to Face wrote") from error


def _numbers(
    values: NDArray, name: str, shape: tuple[int, ...], most: float, least: float = 0.0
) -> NDArray[np.float64]:
    """The values as floats of a shape from `least` to `most`; InputError for others."""
    out = np.array(values, dtype=np.float64)
    if out.shape != shape:
        wanted, got = (" x ".join(map(str, size)) for size in (shape, out.shape))
        raise InputError(f"a beard's {name} must be {wanted} numbers, got {got or 'one'}")
    within = (out >= least) & (out <= most)
    if not within.all():  # which no nan is
        bad = out[~within][0]
        raise InputError(f"a beard's {name} must be from {least:g} to {most:g}, but holds {bad}")
    out.flags.writeable = False
    return out
