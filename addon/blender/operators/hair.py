"""The buttons of a face's hair: made in another way, or taken away."""

import bpy
from bpy.props import EnumProperty

from facs_rig.blender.hair import add_hair, cut_of, hair_of, has_cut, remove_hair

from ..messages import translation
from ..messages.reporting import reported
from ..state import faces


class SKETCHTOFACE_OT_hair(faces.OnFace, bpy.types.Operator):
    """Make the hair of this face anew, as it was drawn, or take it away"""

    bl_idname = "sketch_to_face.hair"
    bl_label = "Make Hair"
    bl_options = {"REGISTER", "UNDO"}
    kind: EnumProperty(
        name="Hair",
        description="What becomes of it",
        items=[
            ("locks", "Locks", "A surface with locks on it"),
            ("surface", "Surface", "One plain surface, to be sculpted"),
            ("none", "None", "Take the hair away; it can be made again"),
        ],
        **translation.OWN_CONTEXT,
    )

    @classmethod
    def description(cls, context, properties):
        """What the button is about to do."""
        tips = {
            "locks": translation.tip("Make the hair anew: a surface with locks on it"),
            "surface": translation.tip("Make the hair anew: one plain surface, to be sculpted"),
            "none": translation.tip("Take the hair away; it can be made again"),
        }
        return tips[properties.kind]

    @classmethod
    def poll(cls, context):
        """A face that hair was drawn for."""
        if not super().poll(context):
            return False
        if not has_cut(faces.polled_face(context)):
            cls.poll_message_set(translation.tip("No hair was found in the drawing of this face"))
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set(translation.tip("Go to Object Mode first"))
            return False
        return True

    def execute(self, context):
        """Make or remove; if the hair was active, the face is."""
        face = faces.polled_face(context)
        with reported(self) as outcome:
            if self.kind != "none":
                from facs_rig.rig import load_rig

                cut = cut_of(face)
                assert cut is not None  # the poll has seen to it
                add_hair(face, load_rig(), cut, self.kind)
            elif (hair := hair_of(face)) is not None:
                active = faces.active_object(context) == hair
                remove_hair(face)
                if active:
                    faces.select_alone(context, face)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


CLASSES = (SKETCHTOFACE_OT_hair,)
