"""Which face the artist works on."""

from typing import TYPE_CHECKING

import bpy

from facs_rig.blender.armature import layer_of
from facs_rig.blender.pose import armature_of, check_face, is_face, mover_of
from facs_rig.blender.worn import is_worn, worn_by
from facs_rig.common.errors import InputError

from ..messages import translation
from . import sources

if TYPE_CHECKING:  # what a class that is mixed into operators can count on
    from bpy.types import Operator as Mixin
else:
    Mixin = object


def active_object(context) -> bpy.types.Object | None:
    """The context's; without a window (in a timer, or where a script took it away) the layer's."""
    if hasattr(context, "active_object"):
        return context.active_object
    return layer_of(context).objects.active


def selected_objects(context) -> list[bpy.types.Object]:
    """The context's; without a window the layer's."""
    if hasattr(context, "selected_objects"):
        return list(context.selected_objects)
    layer = layer_of(context)
    return [thing for thing in layer.objects if thing.select_get(view_layer=layer)]


def active_face(context) -> bpy.types.Object | None:
    """The face that the artist works on: the active object, the one that the active rig, hair, hat
    or beard belongs to, or the one that was made last of the active Grease Pencil drawing."""
    active = active_object(context)
    if active is None:
        return None
    above = active.parent if is_worn(active) else None
    beside = (above, *above.children) if above is not None else ()
    for candidate in (active, *active.children, *beside):
        if is_face(candidate):
            return candidate
    if active.type not in sources.PENCILS:
        return None
    drawn = [o for o in context.scene.objects if is_face(o)
             and o.sketch_to_face.number and o.sketch_to_face.sketch_pencil == active]  # fmt: skip
    return max(drawn, key=lambda face: face.sketch_to_face.number, default=None)


def polled_face(context) -> bpy.types.Object:
    """The active face, where a poll has seen to it that there is one."""
    face = active_face(context)
    if face is None:
        raise InputError(translation.text("Select a face that Sketch to Face made"))
    return face


def trouble(face: bpy.types.Object) -> str:
    """Why this face cannot be posed, in one sentence; empty if it can."""
    try:
        check_face(face)
    except InputError as error:
        return str(error)
    return ""


class OnFace(Mixin):
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
    chosen = layer_of(context).active_layer_collection
    active = chosen.collection
    own = active.library is None and active.override_library is None
    shown = not chosen.exclude
    return active if own and shown else context.scene.collection


def select_alone(context, made: bpy.types.Object) -> None:
    """Make it the active object, and the only selected one; seen in a local view, too."""
    layer = layer_of(context)
    layer.update()  # what was linked a moment ago is not among its objects yet
    for other in layer.objects:
        if other.select_get(view_layer=layer):
            other.select_set(False, view_layer=layer)
    if made.name in layer.objects:
        made.select_set(True, view_layer=layer)
        layer.objects.active = made
    space = context.space_data
    if space is not None and space.type == "VIEW_3D" and space.local_view is not None:
        for thing in (made, armature_of(made), *worn_by(made)):
            if thing is not None:
                thing.local_view_set(space, True)
