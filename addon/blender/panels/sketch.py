"""The first panel of the tab: the sketch."""

from pathlib import Path

import bpy
import bpy.utils.previews

from ..background.tasks import Tick
from ..operators import pencil, sketch
from ..state import sources
from ..state.session import session
from .tab import Tab


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
    if name not in session.thumbnails:
        session.thumbnails.clear()
        session.thumbnails.load(name, str(path), "IMAGE")
    return session.thumbnails[name].icon_id


def progress(layout, tick: Tick) -> None:
    """How far the work is, and how to stop it."""
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
                    sketch.SKETCHTOFACE_OT_try_sample.bl_idname, "drawing", icon="IMAGE_DATA"
                )
        elif settings.sketch_kind == "IMAGE":
            column.template_ID(settings, "sketch_image", open="image.open")
        else:
            column.prop(settings, "sketch_pencil", text="", icon="OUTLINER_OB_GREASEPENCIL")
            column.operator(pencil.SKETCHTOFACE_OT_new_drawing.bl_idname, icon="GREASEPENCIL")
        picture = thumbnail(settings)
        if picture:
            column.template_icon(icon_value=picture, scale=7.0)
        if session.doing is not None:
            progress(column, session.doing)
            return
        button = column.column()
        button.scale_y = 1.8
        button.operator(sketch.SKETCHTOFACE_OT_fit.bl_idname, icon="USER")


CLASSES = (SKETCHTOFACE_PT_sketch,)


def attach() -> None:
    """Make room for thumbnails."""
    session.thumbnails = bpy.utils.previews.new()


def detach() -> None:
    """The reverse of attach."""
    bpy.utils.previews.remove(session.thumbnails)
