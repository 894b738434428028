"""Where a 3D view looks: at a new face, unless it is in sight."""

import bpy
import numpy as np
from mathutils import Vector

SEEN = 0.2  # of the view's height: a face that is smaller is not in sight
FACING = 0.5  # cosine of the angle between the view and the face's own direction


def look_at(context, face: bpy.types.Object) -> None:
    """Look at the face's front in the 3D view that the button is in (a head is 25 cm tall).

    Not where the artist looks through a camera, nor where the face is in sight already.
    """
    area = context.area
    if area is None or area.type != "VIEW_3D" or bpy.app.background:
        return
    region = next((r for r in area.regions if r.type == "WINDOW"), None)
    if region is None:
        return
    view = area.spaces.active.region_3d
    if view.view_perspective == "CAMERA" or in_sight(view, face):
        return
    with context.temp_override(area=area, region=region, active_object=face,
                               selected_objects=[face]):  # fmt: skip
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()


def in_sight(view: bpy.types.RegionView3D, face: bpy.types.Object) -> bool:
    """Whether a 3D view shows the whole face, large enough and from before."""
    corners = [face.matrix_world @ Vector(corner) for corner in face.bound_box]
    seen = [view.perspective_matrix @ corner.to_4d() for corner in corners]
    if any(point.w <= 0 for point in seen):
        return False
    flat = np.array([(point.x / point.w, point.y / point.w) for point in seen])
    forward = face.matrix_world.to_3x3() @ Vector((0.0, -1.0, 0.0))
    towards = view.view_rotation @ Vector((0.0, 0.0, 1.0))
    facing = forward.normalized().dot(towards) > FACING
    return bool(facing and (np.abs(flat) <= 1).all() and np.ptp(flat[:, 1]) / 2 >= SEEN)
