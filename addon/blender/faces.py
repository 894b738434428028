"""Which face the artist works on."""

import bpy

from facs_rig.blender_pose import check_face, is_face


def active_face(context) -> bpy.types.Object | None:
    """The face that the artist works on: the active object, or the one its rig carries."""
    active = context.active_object
    if active is None:
        return None
    for candidate in (active, *active.children):
        if is_face(candidate):
            return candidate
    return None


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
        if active_face(context) is None:
            cls.poll_message_set("Select a face that Sketch to Face made")
            return False
        return True


def select_alone(context, face: bpy.types.Object) -> None:
    """Make the face the active object, and the only selected one."""
    for selected in context.selected_objects:
        selected.select_set(False)
    if face.name in context.view_layer.objects:
        face.select_set(True)
        context.view_layer.objects.active = face
