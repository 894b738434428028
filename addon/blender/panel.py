"""The tab "Sketch to Face" in the sidebar of the 3D view, and its first panel: the sketch."""

from pathlib import Path

import bpy
import bpy.utils.previews

from . import help_operators, operators, pencil_operators, sources, work

TAB = "Sketch to Face"

_thumbnails = None  # Blender's preview collection, while registered


def thumbnail(holder) -> int:
    """Icon of the chosen sketch, 0 if there is none; a file that changed is read again."""
    if holder.sketch_kind == "IMAGE" and holder.sketch_image is not None:
        return holder.sketch_image.preview_ensure().icon_id
    path = Path(bpy.path.abspath(holder.sketch))
    try:
        if holder.sketch_kind != "FILE" or not holder.sketch or not path.is_file():
            return 0
    except (OSError, ValueError):  # a path that the system cannot even look up
        return 0
    name = sources.file_mark(path)
    if name not in _thumbnails:
        _thumbnails.clear()
        _thumbnails.load(name, str(path), "IMAGE")
    return _thumbnails[name].icon_id


class Tab:
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
                help_operators.SKETCHTOFACE_OT_help.bl_idname, text="", icon="HELP"
            ).page = self.page


def progress(layout) -> None:
    """How far the work is, and how to stop it."""
    tick = work.now
    text = f"{tick.text[:1].upper()}{tick.text[1:]} …"
    if hasattr(layout, "progress"):  # Blender 4.0 and newer
        layout.progress(factor=tick.share, text=text)
    else:
        layout.label(text=f"{text} {tick.share:.0%}", icon="SORTTIME")
    layout.label(text="Esc stops it", icon="CANCEL")


class SKETCHTOFACE_PT_sketch(Tab, bpy.types.Panel):
    """The sketch and the big button."""

    bl_idname = "SKETCHTOFACE_PT_sketch"
    bl_label = "Sketch"
    bl_order = 0
    page = "sketch"

    def draw(self, context):
        """Where the sketch is, the sketch itself, the button."""
        column = self.layout.column()
        settings = context.scene.sketch_to_face
        row = column.row(align=True)
        row.prop(settings, "sketch_kind", expand=True)
        if settings.sketch_kind == "FILE":
            column.prop(settings, "sketch", text="")
            if not settings.sketch.strip():
                column.operator_menu_enum(
                    operators.SKETCHTOFACE_OT_try_sample.bl_idname, "drawing", icon="IMAGE_DATA"
                )
        elif settings.sketch_kind == "IMAGE":
            column.template_ID(settings, "sketch_image", open="image.open")
        else:
            column.prop(settings, "sketch_pencil", text="", icon="OUTLINER_OB_GREASEPENCIL")
            column.operator(
                pencil_operators.SKETCHTOFACE_OT_new_drawing.bl_idname, icon="GREASEPENCIL"
            )
        picture = thumbnail(settings)
        if picture:
            column.template_icon(icon_value=picture, scale=7.0)
        if work.now is not None:
            progress(column)
            return
        button = column.column()
        button.scale_y = 1.8
        button.operator(operators.SKETCHTOFACE_OT_fit.bl_idname, icon="USER")


CLASSES = (SKETCHTOFACE_PT_sketch,)


def attach() -> None:
    """Make room for thumbnails."""
    global _thumbnails
    _thumbnails = bpy.utils.previews.new()


def detach() -> None:
    """The reverse of attach."""
    global _thumbnails
    bpy.utils.previews.remove(_thumbnails)
    _thumbnails = None
