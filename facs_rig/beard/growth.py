"""What grows at places of the skin: how thick, how long, and whether it is beard or moustache."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .beard import Beard
from .chart import ALONG, UP, on_chart
from .lip import moustache_at

CHEEKS, SHORTER = (0.02, 0.055), 0.5
"""Metres up from the jaw between which hairs grow shorter, and the share of the length at the
latter."""
STUBBLE = 0.004
"""Metres of hairs that are as long everywhere."""
OVER_MOUTH = (0.3, 0.042)
"""Share of the jaw up to which, and metres up from it from which on, a chart tells how thick a
moustache grows."""
ENDS_AT = (0.74, 0.83)
"""Shares of the jaw between which a beard grows thin beside the ears, where it ends."""
BESIDE, FREE, RIM = 1.45, 2.0, 0.004
"""Halves of the mouth's width up to which a beard grows no higher than a moustache can, and from
which on it may; and metres over which it grows thin there."""


@dataclass(frozen=True, eq=False)
class Growth:
    """What grows at places.

    cover : (k,) how thick, 0..1;  length : (k,) metres;  over : (k,) bool, whether it is moustache
    """

    cover: NDArray[np.float64]
    length: NDArray[np.float64]
    over: NDArray[np.bool_]


def growth(beard: Beard, place: NDArray, lip: NDArray, above: NDArray) -> Growth:
    """What of a beard grows at places: (k, 2) on the chart, (k, 3) of `lip.lip_places`, and (k,)
    whether they lie over the mouth, where there is moustache alone. Beside the mouth a moustache
    ends among the beard."""
    along, up = place.T
    size = np.interp(along, ALONG, beard.length)
    ends = np.clip((ENDS_AT[1] - along) / (ENDS_AT[1] - ENDS_AT[0]), 0, 1)
    across, high, room = lip.T
    fold = np.clip(0.5 + (room - high) / (2 * RIM), 0, 1)
    fold = np.maximum(fold, np.clip((across - BESIDE) / (FREE - BESIDE), 0, 1))
    thick = np.where(above | (size <= 0), 0.0, on_chart(beard.cover, place) * ends * fold)
    near = (ALONG[:, None] < OVER_MOUTH[0]) & (UP > OVER_MOUTH[1])
    much = float(beard.cover[near].max()) if beard.moustache > 0 else 0.0
    hairy = much * moustache_at(lip, beard.spread, beard.rise)
    over = above | (hairy > thick)
    cover = np.where(over, hairy, thick)
    high = np.clip((up - CHEEKS[0]) / (CHEEKS[1] - CHEEKS[0]), 0, 1)
    least = np.minimum(size, STUBBLE)
    thin = np.clip(1.6 * cover - 0.3, 0.15, 1)
    size = least + (size - least) * (1 - (1 - SHORTER) * high) * thin
    return Growth(
        cover, np.where(over, beard.moustache * np.clip(0.4 + 0.7 * cover, 0, 1), size), over
    )
