"""The face with about a quarter of its triangles, for what does not need its finest shape.

It has the vertices of the middle level, and those that carry strokes; what lies between merges into
one of them. So it is closed wherever the fine mesh is, and all that stays is where that has it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .anatomy import PART_NAMES, UNDRAWN_PARTS
from .common.derived import derived
from .levels import at_vertices
from .rig import FaceRig


@derived
def coarse_rig(rig: FaceRig) -> FaceRig:
    """The same face with fewer vertices and about a quarter of the triangles, without hairs.

    It takes the same parameters; its vertices lie where this one has them, and its landmarks and
    strokes are the same. There is nothing to mirror and no other curve on it.
    """
    bound = (*rig.strokes.values(), *rig.under.values())
    carriers = [index[weight != 0] for index, weight in bound]
    medium = rig.texture.vertices[rig.lighter["medium"][0]]
    fine = merged(rig, np.concatenate([medium, *carriers]))
    at = np.unique(np.concatenate([fine.ravel(), rig.landmarks, *carriers]))
    new = at_vertices(rig, at, fine.ravel(), np.arange(0, fine.size, 3))
    number = np.zeros(rig.n_vertices, dtype=np.int32)
    number[at] = np.arange(len(at))
    new.landmarks = number[rig.landmarks]
    new.strokes, new.under = (
        {name: (number[index], w) for name, (index, w) in table.items()}
        for table in (rig.strokes, rig.under)
    )
    del new.texture  # nobody paints on it
    return new


def merged(rig: FaceRig, kept: NDArray) -> NDArray[np.intp]:
    """The triangles (s, 3) without hairs that are left if vertices merge into those that are kept.

    Each merges into the lowest of those that are kept beside it, or beside what is beside it, and
    so on: vertices of the cage have the lowest numbers. Triangles and `kept` are by the rig's.
    """
    hair = [PART_NAMES.index(name) for name in UNDRAWN_PARTS]
    solid = rig.triangles[~np.isin(rig.triangle_part, hair)]
    flat, starts = rig.polygon_vertices, rig.polygon_starts
    after = np.arange(1, len(flat) + 1)
    after[np.append(starts[1:], len(flat)) - 1] = starts
    one, other = np.concatenate([[flat, flat[after]], [flat[after], flat]], axis=1)
    far = rig.n_vertices
    into = np.full(far, far)
    into[kept] = kept
    while (into[solid] == far).any():
        open_ = (into[one] == far) & (into[other] < far)
        found = into[other[open_]]
        np.minimum.at(into, one[open_], found)
    found = into[solid]
    a, b, c = found.T
    return found[(a != b) & (b != c) & (c != a)]
