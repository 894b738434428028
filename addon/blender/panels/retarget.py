"""The panel that puts expressions on any rig."""

import bpy

from ..operators.retarget import SKETCHTOFACE_OT_apply_expression, SKETCHTOFACE_OT_storyboard
from .tab import Tab


class SKETCHTOFACE_PT_retarget(Tab, bpy.types.Panel):
    """An expression on the selected meshes, or a folder of them on the timeline."""

    bl_idname = "SKETCHTOFACE_PT_retarget"
    bl_label = "On Any Rig"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 8
    page = "any_rig"

    def draw(self, context):
        """The two sources of an expression, then the storyboard's folder, pace and button."""
        settings = context.scene.sketch_to_face
        column = self.layout.column(align=True)
        column.label(text="Apply to Selected")
        row = column.row(align=True)
        apply = SKETCHTOFACE_OT_apply_expression.bl_idname
        row.operator(apply, text="From Face").source = "FACE"
        row.operator(apply, text="From Sketch").source = "SKETCH"
        column = self.layout.column()
        column.prop(settings, "storyboard", text="")
        column.prop(settings, "storyboard_every")
        column.operator(SKETCHTOFACE_OT_storyboard.bl_idname, icon="SEQUENCE")


CLASSES = (SKETCHTOFACE_PT_retarget,)
