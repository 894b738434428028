"""The buttons of the sketch: a new face of it, the same face once more, defaults."""

import contextlib
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty

import addon.accepted
from facs_rig.blender.armature import layer_of

from ..background import sketching
from ..background.tasks import InSlices
from ..messages import translation
from ..messages.reporting import say
from ..state import faces, properties, sources
from ..viewport import looking

SAMPLES = Path(addon.accepted.__file__).parent / "sketches"


def to_object_mode(context) -> None:
    """Leave drawing, sculpting or editing: a new object cannot be added there."""
    if context.mode != "OBJECT" and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")


@contextlib.contextmanager
def out_of_its_mode(face: bpy.types.Object):
    """Leave the mode that a face is sculpted or painted in, for the while: its keys cannot be
    written there."""
    mode, there = face.mode, {"active_object": face, "object": face}
    if mode == "OBJECT":
        yield
        return
    name = face.name
    with bpy.context.temp_override(**there):
        bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
    finally:
        back = bpy.data.objects.get(name)
        if back is not None and layer_of(bpy.context).objects.active == back:
            with bpy.context.temp_override(active_object=back, object=back):
                bpy.ops.object.mode_set(mode=mode)


class SKETCHTOFACE_OT_fit(InSlices, bpy.types.Operator):
    """Read the sketch and build its face: expression, head and details as sliders"""

    bl_idname = "sketch_to_face.fit"
    bl_label = "Sketch to Face"
    bl_options = {"REGISTER", "UNDO"}
    frame: BoolProperty(
        name="Look at It", description="Turn the 3D view to the new face", default=True
    )

    def steps(self, context):
        """Fit, build, remember, frame."""
        to_object_mode(context)
        face, found = yield from sketching.new_face(context, context.scene.sketch_to_face)
        faces.select_alone(context, face)
        if self.frame:
            looking.look_at(context, face)
        kind, said = sketching.sentence(face, found.fit)
        self.report({kind}, said)
        return {"FINISHED"}


class SKETCHTOFACE_OT_fit_again(InSlices, faces.OnSketchedFace, bpy.types.Operator):
    """Fit this face to its sketch once more; locked actions, pins, gaze and keyframes stay"""

    bl_idname = "sketch_to_face.fit_again"
    bl_label = "Fit Again"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Nor may it be in Edit Mode."""
        if not super().poll(context):
            return False
        if faces.polled_face(context).mode == "EDIT":
            cls.poll_message_set(translation.tip("Leave Edit Mode first"))
            return False
        return True

    def steps(self, context):
        """Fit, reshape, remember."""
        face = faces.polled_face(context)
        with out_of_its_mode(face):
            found = yield from sketching.again(context, face)
        kind, said = sketching.sentence(face, found.fit)
        self.report({kind}, said)
        return {"FINISHED"}


class SKETCHTOFACE_OT_adopt_sketch(faces.OnFace, bpy.types.Operator):
    """Let this face be of the sketch chosen above; Fit Again then follows that one"""

    bl_idname = "sketch_to_face.adopt_sketch"
    bl_label = "Use the Chosen Sketch"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Copy which sketch is meant; pins belong to the old one."""
        memory = faces.polled_face(context).sketch_to_face
        sources.copy(context.scene.sketch_to_face, memory)
        memory.pins.clear()
        memory.number = memory.number or 1
        return {"FINISHED"}


class SKETCHTOFACE_OT_try_sample(bpy.types.Operator):
    """Choose one of the drawings that come with the add-on, to see what the button does"""

    bl_idname = "sketch_to_face.try_sample"
    bl_label = "Try a Sample"
    bl_options = {"REGISTER", "UNDO"}
    drawing: EnumProperty(
        name="Drawing",
        description="Which of them",
        items=[
            ("smiling_woman", "Smiling Woman", "A woman who laughs"),
            ("angry_man", "Angry Man", "A man who shouts"),
            ("worried_old_man", "Worried Old Man", "An old man with a lined forehead"),
        ],
    )

    def execute(self, context):
        """Mean its file."""
        path = SAMPLES / f"{self.drawing}.png"
        if not path.is_file():
            say(self, "ERROR", "The sample drawings are missing: install the add-on's zip again")
            return {"CANCELLED"}
        settings = context.scene.sketch_to_face
        settings.sketch_kind, settings.sketch = "FILE", str(path)
        return {"FINISHED"}


class SKETCHTOFACE_OT_default_tweakables(bpy.types.Operator):
    """Set everything in this panel back to its default, the tweakables to those of the thesis"""

    bl_idname = "sketch_to_face.default_tweakables"
    bl_label = "Defaults"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Unset the properties."""
        settings = context.scene.sketch_to_face
        for name in properties.SKETCHTOFACE_PG_tweakables.__annotations__:
            settings.tweakables.property_unset(name)
        for name in properties.FIT_SETTINGS:
            settings.property_unset(name)
        return {"FINISHED"}


CLASSES = (
    SKETCHTOFACE_OT_fit,
    SKETCHTOFACE_OT_fit_again,
    SKETCHTOFACE_OT_adopt_sketch,
    SKETCHTOFACE_OT_try_sample,
    SKETCHTOFACE_OT_default_tweakables,
)
