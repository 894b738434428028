"""Which face the artist works on."""

import bpy

from facs_rig.blender_pose import check_face, is_face, mover_of

from . import sources, translation


def active_face(context) -> bpy.types.Object | None:
    """The face that the artist works on: the active object, the one that the active rig carries,
    or the one that was made last of the active Grease Pencil drawing."""
    active = context.active_object
    if active is None:
        return None
    for candidate in (active, *active.children):
        if is_face(candidate):
            return candidate
    if active.type not in sources.PENCILS:
        return None
    drawn = [o for o in context.scene.objects if is_face(o)
             and o.sketch_to_face.number and o.sketch_to_face.sketch_pencil == active]  # fmt: skip
    return max(drawn, key=lambda face: face.sketch_to_face.number, default=None)


def trouble(face: bpy.types.Object) -> str:
    """Why this face cannot be posed, in one sentence; empty if it can."""
    try:
        check_face(face)
    except ValueError as error:
        return str(error)
    return ""


class OnFace:
    """An operator that needs an active face."""

    @classmethod
    def poll(cls, context):
        """A face must be active."""
        face = active_face(context)
        if face is None:
            cls.poll_message_set(translation.tip("Select a face that Sketch to Face made"))
            return False
        if face.library is not None or face.data.library is not None:
            cls.poll_message_set(
                translation.tip("This face is linked from another file: make it local first")
            )
            return False
        if mover_of(face) != face:
            cls.poll_message_set(
                translation.tip(
                    "A linked duplicate moves with the sliders of its original: press Make "
                    "Independent first"
                )
            )
            return False
        return True


class OnShownFace(OnFace):
    """An operator that only looks at the active face: linked ones and duplicates will do."""

    @classmethod
    def poll(cls, context):
        """A face must be active."""
        if active_face(context) is None:
            cls.poll_message_set(translation.tip("Select a face that Sketch to Face made"))
            return False
        return True


class OnSketchedFace(OnFace):
    """An operator that needs an active face that was made of a sketch."""

    @classmethod
    def poll(cls, context):
        """Pins, and another fit, need the sketch."""
        face = active_face(context)
        if face is None or not face.sketch_to_face.number:
            cls.poll_message_set(translation.tip("Select a face that was made of a sketch"))
            return False
        return super().poll(context)


def home(context) -> bpy.types.Collection:
    """The collection that new objects go to: the active one or, where that is of another file or
    left out of what is shown, the scene's own, as with Blender's own new objects."""
    active = context.collection
    own = active.library is None and active.override_library is None
    shown = not context.view_layer.active_layer_collection.exclude
    return active if own and shown else context.scene.collection


def select_alone(context, made: bpy.types.Object) -> None:
    """Make it the active object, and the only selected one."""
    for selected in context.selected_objects:
        selected.select_set(False)
    if made.name in context.view_layer.objects:
        made.select_set(True)
        context.view_layer.objects.active = made
