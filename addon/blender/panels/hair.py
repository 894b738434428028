"""The hair of a face: what it is made of, its colour, how it is combed."""

import bpy

from facs_rig.blender.hair import has_cut, kind_of, parts_of
from facs_rig.blender.hair_curves import has_curves

from ..messages import translation
from ..operators import hair
from ..state import faces
from .face import OfFace

# What is made of it -> what the button is called.
KINDS = {"locks": "Locks", "surface": "Surface", "curves": "Curves"}


def draw_hair(layout, face) -> None:
    """Colour, length and volume of what the face has; how it is made; other hair."""
    kind = kind_of(face)
    column = layout.column(align=True)
    if kind:
        column.prop(face.sketch_to_face, "hair_colour")
    else:
        column.label(text="Hair")
    if has_cut(face):
        make = hair.SKETCHTOFACE_OT_hair.bl_idname
        row = column.row(align=True)
        for name, text in KINDS.items():
            if name != "curves" or has_curves():
                row.operator(make, text=text, text_ctxt=translation.OWN,
                             depress=kind == name).kind = name  # fmt: skip
        if kind:
            row.operator(make, text="", icon="X").kind = "none"
    column.operator_menu_enum(hair.SKETCHTOFACE_OT_hair_preset.bl_idname, "preset",
                              text="Hair Presets", icon="STRANDS")  # fmt: skip
    if kind:
        column = layout.column(align=True)
        column.enabled = all(part.mode == "OBJECT" for part in parts_of(face))
        for name in ("hair_length", "hair_volume"):
            column.prop(face.sketch_to_face, name, slider=True)


class SKETCHTOFACE_PT_hair(OfFace, bpy.types.Panel):
    """Hair for a face that no drawing gave any."""

    bl_idname = "SKETCHTOFACE_PT_hair"
    bl_label = "Hair"
    bl_translation_context = translation.OWN
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 7
    page = "result"

    @classmethod
    def poll(cls, context):
        """The panel of the result has it for faces that were made of a sketch."""
        if not super().poll(context):
            return False
        return not faces.polled_face(context).sketch_to_face.number

    def draw(self, context):
        """The same as there."""
        draw_hair(self.layout, faces.polled_face(context))


CLASSES = (SKETCHTOFACE_PT_hair,)
