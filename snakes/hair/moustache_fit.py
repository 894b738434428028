"""How far a drawn moustache goes aside, and how high.

A moustache is a band (facs_rig.beard.lip): of the bands that there may be, the one is sought whose
inside and outside differ most evenly in ink on the page (Chan, Vese 2001, "Active contours without
edges"), so that it is as smooth and as pointed as hair is, however crudely it is seen.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig import FaceRig
from facs_rig.beard.chart import roots_of
from facs_rig.beard.lip import RISE, SPREAD, moustache_at

from .beard_seen import PLACES, Seen

__all__ = ["band_of"]

SPREADS = np.linspace(0.7, 1.7, 11)
"""Halves of the mouth's width to a moustache's ends that are tried."""
RISES = np.linspace(0.4, 1.0, 7)
"""Shares of the way from lip to nose that are tried."""
AROUND, BELOW, OVER = 2.1, -0.002, 1.15
"""Halves of the mouth's width that are looked at, metres over the lip's rim from which on (its line
is below), and the share of the way to the nose up to which."""
HELD = 0.08
"""What half of such a width, or of the way, beside the usual costs, as a share of all that the ink
varies by."""
FEW = 40
"""Places to be seen for that."""


def band_of(seen: Seen, rig: FaceRig, alone: bool) -> tuple[float, float]:
    """Spread and rise of a moustache (see facs_rig.beard.beard.Beard).

    alone : whether there is no beard, among which its ends cannot be seen
    """
    lip = roots_of(rig).lip[:PLACES]
    across, up, room = lip.T
    mine = (across < (AROUND if alone else 1.0)) & (up > BELOW) & (up < OVER * room) & seen.shown
    if mine.sum() < FEW:
        return SPREAD, RISE
    ink = seen.fine[mine]
    varies = float(((ink - ink.mean()) ** 2).mean()) + 1e-6
    best, least = (SPREAD, RISE), np.inf
    for spread in SPREADS if alone else [SPREAD]:
        for rise in RISES:
            inside = moustache_at(lip[mine], float(spread), float(rise))
            cost = _left(ink, inside) / varies
            cost += HELD * ((spread - SPREAD) ** 2 + (rise - RISE) ** 2) / 0.25
            if cost < least:
                best, least = (float(spread), float(rise)), cost
    return best


def _left(ink: NDArray, inside: NDArray) -> float:
    """Mean square of what of the ink (k,) is not told by how far places lie inside (k,)."""
    within = inside - inside.mean()
    slope = max(float((within * ink).mean() / max((within**2).mean(), 1e-9)), 0.0)
    return float(((ink - ink.mean() - slope * within) ** 2).mean())
