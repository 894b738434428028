"""The buttons of a face's hair: made in another way, other hair, or taken away."""

import bpy
from bpy.props import EnumProperty

from facs_rig.blender.hair import (
    CUT,
    DRAWN,
    add_hair,
    cut_of,
    has_cut,
    kind_of,
    parts_of,
    remove_hair,
)
from facs_rig.common.errors import InputError
from facs_rig.hair.cut import from_json
from facs_rig.hair.presets import preset

from ..messages import translation
from ..messages.reporting import reported
from ..state import faces

PRESETS = (
    ("crop", "Crop", "Short all over"),
    ("side_parting", "Side Parting", "Short, parted at the side"),
    ("bald_rim", "Bald Crown", "Short around a bald crown"),
    ("fringe", "Fringe", "To the chin, with a fringe"),
    ("bob", "Bob", "To the chin, the forehead free"),
    ("long_straight", "Long and Straight", "Over the shoulders, parted in the middle"),
    ("long_wavy", "Long and Wavy", "Over the shoulders, in waves"),
    ("curls", "Curls", "To the chin, in curls"),
    ("afro", "Afro", "A round head of tight curls"),
    ("bun", "Bun", "Combed back into a bun on the crown"),
    ("ponytail", "Ponytail", "Combed back into a ponytail"),
    ("braids", "Braids", "Parted in the middle, two braids"),
)


def _in_object_mode(cls, context) -> bool:
    if context.mode != "OBJECT":
        cls.poll_message_set(translation.tip("Go to Object Mode first"))
        return False
    return True


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
            ("curves", "Curves", "Hair curves on a thin surface, to be groomed; Blender 4.2"),
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
            "curves": translation.tip(
                "Make the hair anew: hair curves that grow on the face, to be groomed, over a thin "
                "surface"
            ),
            "none": translation.tip("Take the hair away; it can be made again"),
        }
        return tips[properties.kind]

    @classmethod
    def poll(cls, context):
        """A face that has, or had, hair."""
        if not super().poll(context):
            return False
        if not has_cut(faces.polled_face(context)):
            cls.poll_message_set(
                translation.tip("This face has no hair: choose one of the presets")
            )
            return False
        return _in_object_mode(cls, context)

    def execute(self, context):
        """Make or remove; if what goes was active, the face is."""
        face = faces.polled_face(context)
        with reported(self) as outcome:
            active = faces.active_object(context)
            name = active.name if active is not None and active in parts_of(face) else None
            if self.kind != "none":
                from facs_rig.rig import load_rig

                cut = cut_of(face)
                assert cut is not None  # the poll has seen to it
                add_hair(face, load_rig(), cut, self.kind)
            else:
                remove_hair(face)
            if name is not None and name not in {part.name for part in parts_of(face)}:
                faces.select_alone(context, face)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_hair_preset(faces.OnFace, bpy.types.Operator):
    """Give this face other hair; its length, volume and the color that you gave it stay"""

    bl_idname = "sketch_to_face.hair_preset"
    bl_label = "Hair Presets"
    bl_options = {"REGISTER", "UNDO"}
    preset: EnumProperty(
        name="Hair",
        description="Which hair",
        items=[*PRESETS, ("drawn", "As Drawn", "What the drawing of this face shows")],
        **translation.OWN_CONTEXT,
    )

    @classmethod
    def poll(cls, context):
        """Any face."""
        return super().poll(context) and _in_object_mode(cls, context)

    def execute(self, context):
        """Put it on, as the kind of hair that the face has; what was drawn is kept."""
        face = faces.polled_face(context)
        with reported(self) as outcome:
            from facs_rig.rig import load_rig

            drawn = face.get(DRAWN)
            if drawn is None and face.sketch_to_face.number and has_cut(face):
                drawn = face.get(CUT)
            if self.preset != "drawn":
                cut = preset(self.preset)
            elif drawn is not None:
                cut = from_json(drawn)
            else:
                raise InputError(translation.text("No hair was found in the drawing of this face"))
            add_hair(face, load_rig(), cut, kind_of(face) or "locks")
            if self.preset == "drawn":
                face.pop(DRAWN, None)
            elif drawn is not None:
                face[DRAWN] = drawn
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


CLASSES = (SKETCHTOFACE_OT_hair, SKETCHTOFACE_OT_hair_preset)
