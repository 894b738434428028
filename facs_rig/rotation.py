"""Head and neck angles as a rotation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def rotation(angles: Sequence[float]) -> NDArray[np.float64]:
    """(3, 3) rotation by yaw, pitch, roll in radians: roll first, then pitch, then yaw."""
    yaw, pitch, roll = angles
    cy, sy, cp, sp_, cr, sr = (f(a) for a in (yaw, pitch, roll) for f in (np.cos, np.sin))
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cp, -sp_], [0, sp_, cp]])
    about_z = np.array([[cr, sr, 0], [-sr, cr, 0], [0, 0, 1]])
    return about_y @ about_x @ about_z
