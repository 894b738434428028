"""The tab "Sketch to Face" in the sidebar of the 3D view."""

from pathlib import Path

import bpy
import bpy.utils.previews

from facs_rig import CONTROLS
from snakes import LINE_TWEAKABLES

from . import faces, operators, properties

TAB = "Sketch to Face"

_thumbnails = None  # Blender's preview collection, while registered


def thumbnail(sketch: str) -> int:
    """Icon of the chosen sketch, 0 if there is none; a file that changed is read again."""
    path = Path(bpy.path.abspath(sketch))
    try:
        if not sketch or not path.is_file():
            return 0
        name = f"{path} {path.stat().st_mtime_ns}"
    except (OSError, ValueError):  # a path that the system cannot even look up
        return 0
    if name not in _thumbnails:
        _thumbnails.clear()
        _thumbnails.load(name, str(path), "IMAGE")
    return _thumbnails[name].icon_id


class Tab:
    """Where the panels are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB


class SKETCHTOFACE_PT_sketch(Tab, bpy.types.Panel):
    """The sketch and the big button."""

    bl_idname = "SKETCHTOFACE_PT_sketch"
    bl_label = "Sketch to Face"
    bl_order = 0

    def draw(self, context):
        """File field, the sketch itself, button."""
        column = self.layout.column()
        settings = context.scene.sketch_to_face
        column.prop(settings, "sketch", text="")
        picture = thumbnail(settings.sketch)
        if picture:
            column.template_icon(icon_value=picture, scale=7.0)
        button = column.column()
        button.scale_y = 1.8
        button.operator(operators.SKETCHTOFACE_OT_fit.bl_idname, icon="USER")


class SKETCHTOFACE_PT_tweakables(Tab, bpy.types.Panel):
    """The thesis' table, folded away."""

    bl_idname = "SKETCHTOFACE_PT_tweakables"
    bl_parent_id = SKETCHTOFACE_PT_sketch.bl_idname
    bl_label = "Tweakables"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """One row each, then the defaults button."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.sketch_to_face
        column = layout.column()
        column.prop(settings, "place_head")
        if settings.place_head:
            for index, side in enumerate(("Left", "Top", "Right", "Bottom")):
                column.prop(settings, "head_box", index=index, text=side)
        column.prop(settings, "method")
        column.separator()
        group = settings.tweakables
        for name in properties.SKETCHTOFACE_PG_tweakables.__annotations__:
            if settings.method == "thesis" or name in LINE_TWEAKABLES:
                column.prop(group, name)
        column.separator()
        column.prop(settings, "strokes", text="Strokes")
        if settings.strokes != "ignore":
            for name in ("stroke_profile", "stroke_depth", "stroke_width"):
                column.prop(settings, name)
        layout.operator(operators.SKETCHTOFACE_OT_default_tweakables.bl_idname, icon="LOOP_BACK")


class SKETCHTOFACE_PT_detected(Tab, bpy.types.Panel):
    """What was read from the sketch."""

    bl_idname = "SKETCHTOFACE_PT_detected"
    bl_label = "Read From the Sketch"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 2

    @classmethod
    def poll(cls, context):
        """Nothing was read for a face that was just added."""
        face = faces.active_face(context)
        return face is not None and len(face.sketch_to_face.detections) > 0

    def draw(self, context):
        """A row for each action unit: found or not, how sure."""
        face = faces.active_face(context)
        column = self.layout.column(align=True)
        column.scale_y = 0.85
        for item in face.sketch_to_face.detections:
            row = column.row(align=True)
            row.active = item.active
            icon = "CHECKMARK" if item.active else "BLANK1"
            if hasattr(row, "progress"):  # Blender 4.0 and newer
                row.label(text=LABELS.get(item.name, item.name), icon=icon)
                row.progress(factor=item.probability, text=f"{item.probability:.0%}")
            else:
                split = row.split(factor=0.72, align=True)
                split.label(text=LABELS.get(item.name, item.name), icon=icon)
                value = split.row()
                value.alignment = "RIGHT"
                value.label(text=f"{item.probability:.0%}")


LABELS = {control.name: control.label for control in CONTROLS}

CLASSES = (
    SKETCHTOFACE_PT_sketch,
    SKETCHTOFACE_PT_tweakables,
    SKETCHTOFACE_PT_detected,
)


def register() -> None:
    """Register the panels, parents first."""
    global _thumbnails
    _thumbnails = bpy.utils.previews.new()
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """The reverse of register."""
    global _thumbnails
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    bpy.utils.previews.remove(_thumbnails)
    _thumbnails = None
