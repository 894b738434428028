"""Where a new face stands: clear of what is there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import layer_of, metre

# Metres from the pivot of a face to its outside, Blender's axes, and what is left free around it.
LOW, HIGH = np.array([-0.1, -0.14, -0.19]), np.array([0.1, 0.12, 0.17])
ROOM = 0.06
# What is larger than this (metres) in every direction is no thing to stand beside, but a room or a
# sky to stand in.
SURROUNDING = 2.6
SOLID = {"MESH", "CURVE", "CURVES", "SURFACE", "META", "FONT", "VOLUME", "POINTCLOUD",
         "GPENCIL", "GREASEPENCIL"}  # fmt: skip


def boxes(context) -> list[NDArray[np.float64]]:
    """World boxes (2, 3), lowest and highest corner, of all that is shown and solid."""
    layer = layer_of(context)
    layer.update()  # of what was made a moment ago nobody has asked where it is
    found = []
    for thing in layer.objects:
        if thing.type in SOLID and thing.visible_get(view_layer=layer):
            matrix = np.array(thing.matrix_world)
            corners = np.array(thing.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]
            found.append(np.stack([corners.min(axis=0), corners.max(axis=0)]))
    return [box for box in found if np.isfinite(box).all()]


def clear_place(context, wanted) -> tuple[float, float, float]:
    """The wanted place of a face's pivot or, where something is in the way, the next one beside it.

    wanted : units of the scene. To the right, as faces in a row are; or up, out of a floor.
    """
    unit = metre(context.scene)
    low, high = unit * (LOW - ROOM), unit * (HIGH + ROOM)
    things = [box for box in boxes(context) if (box[1] - box[0]).min() < SURROUNDING * unit]
    place = np.array(wanted, dtype=float)
    for _ in range(len(things) + 1):
        in_the_way = [
            box for box in things
            if (box[0] < place + high).all() and (box[1] > place + low).all()
        ]  # fmt: skip
        if not in_the_way:
            break
        aside = max(float(box[1][0]) for box in in_the_way) - low[0]
        above = max(float(box[1][2]) for box in in_the_way) - low[2]
        if aside - place[0] <= 2 * (above - place[2]):
            place[0] = aside
        else:
            place[2] = above
    x, y, z = place.tolist()
    return (x, y, z)
