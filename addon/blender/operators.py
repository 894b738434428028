"""The buttons of the sketch. Each reads the context, calls the core, writes back, reports."""

import bpy
from bpy.props import BoolProperty

from . import faces, properties
from .reporting import reported


def _frame(context, face: bpy.types.Object) -> None:
    """Look at the face's front in the 3D view that the button is in (a head is 25 cm tall)."""
    area = context.area
    if area is None or area.type != "VIEW_3D" or bpy.app.background:
        return
    region = next((r for r in area.regions if r.type == "WINDOW"), None)
    if region is None:
        return
    with context.temp_override(area=area, region=region, active_object=face,
                               selected_objects=[face]):  # fmt: skip
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()


class SKETCHTOFACE_OT_fit(bpy.types.Operator):
    """Read the sketch and build its face: expression, head and details as sliders"""

    bl_idname = "sketch_to_face.fit"
    bl_label = "Sketch to Face"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "frame": BoolProperty(
            name="Look at it", description="Turn the 3D view to the new face", default=True
        ),
    }

    @classmethod
    def poll(cls, context):
        """Only in Object Mode: a new object cannot be added anywhere else."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first")
            return False
        return True

    def execute(self, context):
        """Fit, build, remember, frame."""
        settings = context.scene.sketch_to_face
        if context.window:
            context.window.cursor_modal_set("WAIT")
        try:
            with reported(self) as outcome:
                face, fit = self._make(context, settings)
        finally:
            if context.window:
                context.window.cursor_modal_restore()
        if outcome.failed:
            return {"CANCELLED"}
        if self.frame:
            _frame(context, face)
        names = [name for name, active in fit.detection.active.items() if active]
        said = f"{face.name}: {', '.join(names) or 'no expression found'}"
        others = fit.detection.left_out()
        self.report({"WARNING" if others else "INFO"}, f"{said}. {others}" if others else said)
        return {"FINISHED"}

    def _make(self, context, settings):
        from addon import pipeline
        from facs_rig.blender import build_face

        path = properties.sketch_path(settings)
        fit = pipeline.fit(path, properties.fit_options(settings))
        face = build_face(
            path.stem,
            fit.rig,
            fit.parameters,
            fit.offsets,
            collection=context.collection,
            location=context.scene.cursor.location,
        )
        properties.remember(face, settings.sketch, fit)
        faces.select_alone(context, face)
        return face, fit


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


CLASSES = (SKETCHTOFACE_OT_fit, SKETCHTOFACE_OT_default_tweakables)


def register() -> None:
    """Register the operators."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """The reverse of register."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
