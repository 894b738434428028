"""Where hair that hangs ends, held against where its surface does.

Hair behind a head is seen below it and beside the neck alone, at whatever azimuth it hangs: what
says how long it is there is the region's lower end, one column of the page after another.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig.hair.cut import AZIMUTHS
from facs_rig.hair.shell import Shell

from .sight import Sight

__all__ = ["hem"]

COLUMN, COLUMNS = 0.007, 80
"""Metres that a column of the page is wide, and how many there are."""
MOST = 0.5
"""Height by which one round changes an edge at most."""
FALLEN = -0.2
"""Height below which an edge is a hem: higher up it is a fringe's or a hairline's, which is seen
from in front."""
SMOOTH = 4.0
"""How strongly neighbours go together, where a column says one."""


def hem(sight: Sight, hair: Shell, edge: NDArray[np.floating]) -> NDArray[np.float64]:
    """(48,) heights of an edge that ends where the region does below the head."""
    low, known = _lowest(sight)
    azimuth, cells = sight.ends(hair)
    column, down = _place(sight, cells)
    head = sight.page.head
    at = np.rint(cells).astype(int)
    inside = ((at >= 0) & (at < head.shape[::-1])).all(axis=1)
    u, v = np.clip(at, 0, np.array(head.shape[::-1]) - 1).T
    height = np.interp(azimuth, np.linspace(0, 2 * np.pi, AZIMUTHS + 1), np.append(edge, edge[0]))
    seen = (column >= 0) & ~(head[v, u] & inside) & (height < FALLEN)
    seen[seen] &= known[column[seen]]
    if not seen.any():
        return edge
    azimuth, column, down = azimuth[seen], column[seen], down[seen]
    short = low[column] - down
    # In each column all that hangs too low, and of what does not that which hangs lowest.
    lowest = np.full(COLUMNS, -np.inf)
    np.maximum.at(lowest, column, down)
    ends = (short < 0) | (down >= lowest[column])
    place, wanted = azimuth[ends] * AZIMUTHS / (2 * np.pi), -short[ends] / sight.drop
    left = np.floor(place).astype(int)
    share = place - left
    rows = np.zeros((len(place), AZIMUTHS))
    count = np.arange(len(place))
    rows[count, left % AZIMUTHS] += 1 - share
    rows[count, (left + 1) % AZIMUTHS] += share
    weight = np.bincount(column[ends], minlength=COLUMNS)[column[ends]] ** -0.5
    rows, wanted = rows * weight[:, None], wanted * weight
    ring = np.roll(np.eye(AZIMUTHS), -1, axis=0) - np.eye(AZIMUTHS)
    matrix = rows.T @ rows + SMOOTH * ring.T @ ring + 0.05 * np.eye(AZIMUTHS)
    moved = np.linalg.solve(matrix, rows.T @ wanted)
    return edge + np.where(edge < FALLEN, np.clip(moved, -MOST, MOST), 0)


def _place(sight: Sight, cells: NDArray) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The columns of places (k, 2) of the grid, -1 beyond all, and metres down from the middle."""
    right = np.array([-sight.up[1], sight.up[0]])
    x, y = ((cells - sight.middle) @ way / sight.unit for way in (right, sight.up))
    column = np.floor(x / COLUMN).astype(np.intp) + COLUMNS // 2
    return np.where((column >= 0) & (column < COLUMNS), column, -1), -y


def _lowest(sight: Sight) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(80,) metres down to where the region ends in each column, and where that is known: it goes
    on neither behind the head nor off the page."""
    hair, head = sight.page.hair, sight.page.head
    v, u = np.nonzero(hair)
    column, down = _place(sight, np.stack([u, v], axis=1).astype(float))
    order = np.lexsort((down, column))
    last = np.append(np.flatnonzero(np.diff(column[order])), len(order) - 1)
    ends = order[last]
    ends = ends[column[ends] >= 0]
    low, known = np.zeros(COLUMNS), np.zeros(COLUMNS, dtype=bool)
    low[column[ends]] = down[ends] + 0.5 / sight.unit
    below = np.clip(v[ends] + 2, 0, len(hair) - 1)
    off = v[ends] + 2 >= len(hair)
    known[column[ends]] = ~off & ~head[below, u[ends]] & (down[ends] > 0)
    return low, known
