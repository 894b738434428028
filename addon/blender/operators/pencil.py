"""A blank sheet: a Grease Pencil object to draw the next face in."""

import bpy

from facs_rig.blender.armature import metre

from ..messages.reporting import reported
from ..state import faces
from .sketch import to_object_mode

NAME = "Face Sketch"


class SKETCHTOFACE_OT_new_drawing(bpy.types.Operator):
    """Begin to draw: adds a Grease Pencil object, looks at it from the front, takes the pen"""

    bl_idname = "sketch_to_face.new_drawing"
    bl_label = "Draw in the View"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Make the sheet, mean it, look at it, draw."""
        with reported(self) as outcome:
            to_object_mode(context)
            pencil = new_pencil(context)
            settings = context.scene.sketch_to_face
            settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil
            faces.select_alone(context, pencil)
            if faces.active_object(context) == pencil:
                _look(context, pencil)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


def new_pencil(context) -> bpy.types.Object:
    """An empty Grease Pencil object with a layer and a black pen, at the 3D cursor."""
    if hasattr(bpy.data, "grease_pencils_v3"):  # 4.3 to 4.5, where both kinds are there
        data = bpy.data.grease_pencils_v3.new(NAME)
    else:
        data = bpy.data.grease_pencils.new(NAME)
    pencil = bpy.data.objects.new(NAME, data)
    layer = data.layers.new("Lines", set_active=True)
    layer.frames.new(context.scene.frame_current)
    ink = bpy.data.materials.new("Face Sketch Ink")
    bpy.data.materials.create_gpencil_data(ink)
    ink.grease_pencil.color = (0.02, 0.02, 0.02, 1.0)
    data.materials.append(ink)
    pencil.location = context.scene.cursor.location
    faces.home(context).objects.link(pencil)
    return pencil


def _look(context, pencil: bpy.types.Object) -> None:
    """From the front, a head's height of the sheet in view, with the pen in the hand."""
    area = context.area
    if area is None or area.type != "VIEW_3D" or bpy.app.background:
        return
    region = next(r for r in area.regions if r.type == "WINDOW")
    with context.temp_override(area=area, region=region):
        bpy.ops.view3d.view_axis(type="FRONT")
        view = area.spaces.active.region_3d
        view.view_location = context.scene.cursor.location
        view.view_distance = 0.8 * metre(context.scene)
        mode = "PAINT_GREASE_PENCIL" if pencil.type == "GREASEPENCIL" else "PAINT_GPENCIL"
        bpy.ops.object.mode_set(mode=mode)
    context.scene.tool_settings.gpencil_stroke_placement_view3d = "ORIGIN"
    context.scene.tool_settings.gpencil_sculpt.lock_axis = "AXIS_Y"


CLASSES = (SKETCHTOFACE_OT_new_drawing,)
