"""The tab "Sketch to Face" in the sidebar of the 3D view."""

from typing import TYPE_CHECKING

from ..operators import help

TAB = "Sketch to Face"

if TYPE_CHECKING:  # what a class that is mixed into panels can count on
    from bpy.types import Panel as Mixin
else:
    Mixin = object


class Tab(Mixin):
    """Where the panels are. `page` is the page of the manual about a panel."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB
    page = ""

    def draw_header_preset(self, context):
        """A question mark that opens the manual."""
        if self.page:
            button = self.layout.row()
            button.emboss = "NONE"
            button.operator(
                help.SKETCHTOFACE_OT_help.bl_idname, text="", icon="HELP"
            ).page = self.page
