"""The buttons that change what a face does: clipboard, files, chance, mirror, keyframes, reset."""

import random
from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from facs_rig import CONTROL_NAMES, FaceParameters, expressions, load_rig
from facs_rig.blender.pose import (
    check_face,
    key_pose,
    pose_of,
    set_pose,
    straighten_eyes,
)
from facs_rig.blender.reshape import reshape
from facs_rig.common.errors import InputError
from facs_rig.fitted_keys import FITTED

from ..messages import translation
from ..messages.reporting import reported, say
from ..state import faces, preferences

_HEAD = {"name": "Head and Neck", "description": "Turn head and neck too", "default": True,
         "options": {"SKIP_SAVE"}}  # fmt: skip


def read_clipboard(context) -> str:
    """The text that was copied last, here or in another program."""
    return context.window_manager.clipboard


def write_clipboard(context, text: str) -> None:
    """Copy a text, for here and other programs."""
    context.window_manager.clipboard = text


class SKETCHTOFACE_OT_reset_sliders(faces.OnFace, bpy.types.Operator):
    """Set the sliders of the face back"""

    bl_idname = "sketch_to_face.reset_sliders"
    bl_label = "Reset Expression"
    bl_options = {"REGISTER", "UNDO"}
    to: EnumProperty(
        name="To",
        description="What the sliders are set back to",
        **translation.OWN_CONTEXT,
        items=[
            ("NEUTRAL", "Neutral", "A face at rest that looks ahead"),
            ("SKETCH", "As Drawn", "The expression that was read from the sketch"),
        ],
    )
    head: BoolProperty(**{**_HEAD, "default": False})

    def execute(self, context):
        """Write the values to the properties; a fitted face keeps its details."""
        face = faces.polled_face(context)
        with reported(self) as outcome:
            check_face(face)
            memory = face.sketch_to_face
            drawn = {i.name: i.value for i in memory.expression} if self.to == "SKETCH" else {}
            aus = {name: value for name, value in drawn.items() if name in CONTROL_NAMES}
            head, neck = (memory.head, memory.neck) if drawn else ((0, 0, 0), (0, 0, 0))
            set_pose(face, FaceParameters(aus, head=tuple(head), neck=tuple(neck)), turn=self.head)
            straighten_eyes(face)
            if FITTED in drawn and FITTED in face.data.shape_keys.key_blocks:
                face.data.shape_keys.key_blocks[FITTED].value = drawn[FITTED]
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_copy_expression(faces.OnFace, bpy.types.Operator):
    """Copy expression, gaze and head to the clipboard, as text that can be pasted anywhere"""

    bl_idname = "sketch_to_face.copy_expression"
    bl_label = "Copy Expression"
    bl_options = {"REGISTER"}

    def execute(self, context):
        """The text of an expression file, without the person."""
        with reported(self) as outcome:
            parameters = replace(pose_of(faces.polled_face(context)), identity={})
            write_clipboard(context, expressions.dumps(parameters))
        if outcome.failed:
            return {"CANCELLED"}
        say(self, "INFO", "Expression copied")
        return {"FINISHED"}


class SKETCHTOFACE_OT_paste_expression(faces.OnFace, bpy.types.Operator):
    """Let the face do what the copied expression says"""

    bl_idname = "sketch_to_face.paste_expression"
    bl_label = "Paste Expression"
    bl_options = {"REGISTER", "UNDO"}
    head: BoolProperty(**_HEAD)
    # Read once: redoing with other options must not paste what was copied meanwhile.
    text: StringProperty(options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context):
        """Read, check, write."""
        with reported(self) as outcome:
            self.text = self.text or read_clipboard(context)
            if not self.text.strip():
                raise InputError(
                    translation.text("the clipboard is empty: copy an expression first")
                )
            try:
                parameters = expressions.loads(self.text)
            except InputError as error:
                raise InputError(
                    translation.text("The clipboard holds no expression: {error}", error=error)
                ) from None
            set_pose(faces.polled_face(context), parameters, turn=self.head)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_save_expression(faces.OnFace, bpy.types.Operator, ExportHelper):
    """Save expression, gaze and head as a JSON file"""

    bl_idname = "sketch_to_face.save_expression"
    bl_label = "Save Expression"
    bl_options = {"REGISTER"}
    filename_ext = expressions.SUFFIX
    filepath: preferences.filepath()
    filter_glob: StringProperty(default=f"*{expressions.SUFFIX}", options={"HIDDEN"})
    person: BoolProperty(
        name="With the Person",
        description="Save gender, age and features in the same file",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context, event):
        """The file browser, with the face's name as the file's."""
        name = bpy.path.clean_name(faces.polled_face(context).name) + self.filename_ext
        self.filepath = self.filepath or preferences.in_folder(context, name)
        return super().invoke(context, event)

    def execute(self, context):
        """Write the file, whole or not at all."""
        with reported(self) as outcome:
            parameters = pose_of(faces.polled_face(context))
            if not self.person:
                parameters = replace(parameters, identity={})
            expressions.write(bpy.path.abspath(self.filepath), parameters)
        if outcome.failed:
            return {"CANCELLED"}
        say(self, "INFO", "Saved {name}", name=bpy.path.basename(self.filepath))
        return {"FINISHED"}


class SKETCHTOFACE_OT_load_expression(faces.OnFace, bpy.types.Operator, ImportHelper):
    """Let the face do what an expression file says"""

    bl_idname = "sketch_to_face.load_expression"
    bl_label = "Load Expression"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = expressions.SUFFIX
    filter_glob: StringProperty(default=f"*{expressions.SUFFIX}", options={"HIDDEN"})
    head: BoolProperty(**_HEAD)
    person: BoolProperty(
        name="The Person Too",
        description="Become the person in the file, if there is one",
        options={"SKIP_SAVE"},
    )

    def execute(self, context):
        """Read, check, write."""
        with reported(self) as outcome:
            face = faces.polled_face(context)
            check_face(face)
            parameters = expressions.read(bpy.path.abspath(self.filepath))
            if self.person and parameters.identity:
                reshape(face, load_rig(), parameters.identity)
            set_pose(face, parameters, turn=self.head)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_random_expression(faces.OnFace, bpy.types.Operator):
    """Let the face do something that a face can do; head and eyes stay"""

    bl_idname = "sketch_to_face.random_expression"
    bl_label = "Random Expression"
    bl_options = {"REGISTER", "UNDO"}
    seed: IntProperty(
        name="Seed", description="Another number, another expression", min=0, default=1
    )

    def invoke(self, context, event):
        """Each press another one."""
        self.seed = random.randrange(1_000_000)
        return self.execute(context)

    def execute(self, context):
        """Draw an expression from the seed."""
        with reported(self) as outcome:
            face = faces.polled_face(context)
            aus = expressions.random_expression(np.random.default_rng(self.seed))
            set_pose(face, replace(pose_of(face), aus=aus), turn=False)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_mirror_expression(faces.OnFace, bpy.types.Operator):
    """Exchange what the left and the right of the face do"""

    bl_idname = "sketch_to_face.mirror_expression"
    bl_label = "Mirror Expression"
    bl_options = {"REGISTER", "UNDO"}
    head: BoolProperty(**_HEAD)

    def execute(self, context):
        """Mirror sliders, gaze, head and neck."""
        with reported(self) as outcome:
            face = faces.polled_face(context)
            set_pose(face, mirrored(pose_of(face)), turn=self.head)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


def mirrored(pose: FaceParameters) -> FaceParameters:
    """A pose with left and right exchanged: sliders, and what turns or tilts aside."""

    def aside(angles):
        yaw, pitch, *roll = angles
        return (-yaw, pitch, *(-r for r in roll))

    return replace(pose, aus=expressions.mirrored(pose.aus), head=aside(pose.head),
                   neck=aside(pose.neck), gaze=aside(pose.gaze))  # fmt: skip


class SKETCHTOFACE_OT_key_expression(faces.OnFace, bpy.types.Operator):
    """Keyframe every slider, the gaze, head and neck at the current frame"""

    bl_idname = "sketch_to_face.key_expression"
    bl_label = "Key Expression"
    bl_options = {"REGISTER", "UNDO"}
    head: BoolProperty(**{**_HEAD, "description": "Head and neck too"})

    def execute(self, context):
        """Insert the keyframes."""
        with reported(self) as outcome:
            key_pose(faces.polled_face(context), context.scene.frame_current, turn=self.head)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


CLASSES = (
    SKETCHTOFACE_OT_reset_sliders,
    SKETCHTOFACE_OT_copy_expression,
    SKETCHTOFACE_OT_paste_expression,
    SKETCHTOFACE_OT_save_expression,
    SKETCHTOFACE_OT_load_expression,
    SKETCHTOFACE_OT_random_expression,
    SKETCHTOFACE_OT_mirror_expression,
    SKETCHTOFACE_OT_key_expression,
)
