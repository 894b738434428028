"""The buttons of a face's beard: one of the usual ones, the drawn one anew, or none."""

import bpy
from bpy.props import EnumProperty

from facs_rig.blender.beard import add_beard, beard_of, made_of, remove_beard
from facs_rig.common.errors import InputError

from ..messages import translation
from ..messages.reporting import reported
from ..state import faces

# identifier -> name among facs_rig.beard.presets.PRESETS
KINDS = {
    "STUBBLE": "stubble", "MOUSTACHE": "moustache", "GOATEE": "goatee",
    "CHIN_STRAP": "chin strap", "FULL_BEARD": "full beard", "LONG_BEARD": "long beard",
    "CURLY_BEARD": "curly beard",
}  # fmt: skip


class SKETCHTOFACE_OT_beard(faces.OnFace, bpy.types.Operator):
    """Give this face a beard, make the one that it had anew, or take it away"""

    bl_idname = "sketch_to_face.beard"
    bl_label = "Make Beard"
    bl_options = {"REGISTER", "UNDO"}
    kind: EnumProperty(
        name="Beard",
        description="Which beard the face is given",
        items=[
            ("AGAIN", "As It Was", "Make the beard anew that was drawn, or was there last"),
            ("STUBBLE", "Stubble", "Some days' growth"),
            ("MOUSTACHE", "Moustache", "On the upper lip alone"),
            ("GOATEE", "Goatee", "On chin and upper lip"),
            ("CHIN_STRAP", "Chin Strap", "A narrow rim along the jaw"),
            ("FULL_BEARD", "Full Beard", "Up the cheeks, and some centimeters long"),
            ("LONG_BEARD", "Long Beard", "Down to the chest"),
            ("CURLY_BEARD", "Curly Beard", "Full, and curled"),
            ("NONE", "No Beard", "Take the beard away; it can be made again"),
        ],
        **translation.OWN_CONTEXT,
    )

    @classmethod
    def poll(cls, context):
        """Any face, in Object Mode."""
        if not super().poll(context):
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set(translation.tip("Go to Object Mode first"))
            return False
        return True

    def execute(self, context):
        """Make or remove; if the beard was active, the face is."""
        face = faces.polled_face(context)
        with reported(self) as outcome:
            if self.kind != "NONE":
                _make(face, self.kind)
            elif (beard := beard_of(face)) is not None:
                active = faces.active_object(context) == beard
                remove_beard(face)
                if active:
                    faces.select_alone(context, face)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


def _make(face: bpy.types.Object, kind: str) -> None:
    """Of the colour of a beard that is there."""
    from facs_rig.beard.presets import preset
    from facs_rig.rig import load_rig

    if kind == "AGAIN":
        beard = made_of(face)
        if beard is None:
            raise InputError(
                translation.text("This face has had no beard yet: choose one of the others")
            )
    else:
        beard = preset(KINDS[kind])
    add_beard(face, load_rig(), beard)


CLASSES = (SKETCHTOFACE_OT_beard,)
