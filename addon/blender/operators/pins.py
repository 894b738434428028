"""Pins: points of the face that the artist puts in their place on the sketch."""

import bpy
import numpy as np
from bpy.props import FloatVectorProperty, StringProperty
from bpy_extras.view3d_utils import (
    location_3d_to_region_2d,
    region_2d_to_origin_3d,
    region_2d_to_vector_3d,
)
from mathutils import Vector
from mathutils.geometry import intersect_line_plane

from facs_rig.common.errors import InputError

from ..background.tasks import LOOKING, redraw
from ..messages import translation
from ..messages.reporting import reported, say
from ..state import faces, memory
from ..state.session import session
from ..viewport import looking, overlay

NEAR = 14  # px on the screen within which a point is taken


def set_pin(face, name: str, place) -> None:
    """Pin a landmark. InputError, one sentence, for an unknown one."""
    from facs_rig import LANDMARKS
    from facs_rig.parameters import nearest

    if name not in LANDMARKS:
        raise InputError(
            translation.text("There is no point '{name}' on a face{guess}.",
                             name=name, guess=nearest(name, LANDMARKS))
        )  # fmt: skip
    pin = face.sketch_to_face.pins.get(name) or face.sketch_to_face.pins.add()
    pin.name, pin.place = name, place


class SKETCHTOFACE_OT_pin(faces.OnSketchedFace, bpy.types.Operator):
    """Say where a point of the face lies on its sketch; the next fit brings it there"""

    bl_idname = "sketch_to_face.pin"
    bl_label = "Pin a Point"
    bl_options = {"REGISTER", "UNDO"}
    name: StringProperty(name="Point", description="Name of the landmark")
    place: FloatVectorProperty(
        name="Place", description="Pixels of the sketch, from its left and top", size=2
    )

    def execute(self, context):
        """Write the pin."""
        face = faces.polled_face(context)
        with reported(self) as outcome:
            page = memory.page_of(face)
            set_pin(face, self.name, page[:, :2] @ np.array(self.place) + page[:, 2])
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_unpin(faces.OnSketchedFace, bpy.types.Operator):
    """Take a pin away, or all of them"""

    bl_idname = "sketch_to_face.unpin"
    bl_label = "Remove Pins"
    bl_options = {"REGISTER", "UNDO"}
    name: StringProperty(name="Point", description="Name of the landmark; empty for all")

    def execute(self, context):
        """Remove what is there."""
        pins = faces.polled_face(context).sketch_to_face.pins
        if not self.name:
            pins.clear()
        elif self.name in pins:
            pins.remove(pins.find(self.name))
        return {"FINISHED"}


class SKETCHTOFACE_OT_drag_pins(faces.OnSketchedFace, bpy.types.Operator):
    """Drag points of the face to where the sketch has them, then fit it again"""

    bl_idname = "sketch_to_face.drag_pins"
    bl_label = "Drag Pins"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    def invoke(self, context, event):
        """Show face and sketch from the front, with all points, and wait for the mouse."""
        if context.area is None or context.area.type != "VIEW_3D":
            say(self, "WARNING", "Pins are dragged in the 3D view: press the button there")
            return {"CANCELLED"}
        face = faces.polled_face(context)
        self._name = face.name
        self._taken: str | None = None  # the point that follows the mouse
        self._area = context.area  # where the mouse is later is another matter
        self._before = memory.places(face)
        self._overlay = context.scene.sketch_to_face.overlay
        context.scene.sketch_to_face.overlay = session.show_points = True
        looking.look_at(context, face)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set(
            translation.text(
                "Drag a point to its place    Ctrl Click: remove    Enter: fit again    Esc: leave"
            )
        )
        redraw(context, {"WINDOW"})
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Take, drag and drop points."""
        face = bpy.data.objects.get(self._name)
        if face is None or not faces.is_face(face):
            return self._leave(context, {"CANCELLED"})
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            face.sketch_to_face.pins.clear()
            for name, place in self._before.items():
                set_pin(face, name, place)
            context.scene.sketch_to_face.overlay = self._overlay
            return self._leave(context, {"CANCELLED"})
        if event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            return self._fit(context, face)
        if event.type == "MOUSEMOVE":
            if self._taken is None:
                session.held_point = self._under(context, face, event)
            else:
                self._drag(face, self._taken, event)
            redraw(context, {"WINDOW"})
        elif event.type == "LEFTMOUSE":
            under = self._under(context, face, event)
            if event.value == "PRESS" and event.ctrl:
                pins = face.sketch_to_face.pins
                if under in pins:
                    pins.remove(pins.find(under))
            else:
                self._taken = under if event.value == "PRESS" else None
            session.held_point = self._taken
            redraw(context, {"WINDOW"})
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"} if event.type in LOOKING else {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender opens another file or closes."""
        self._leave(context, {"CANCELLED"})

    def _fit(self, context, face):
        changed = memory.places(face) != self._before
        self._leave(context, {"FINISHED"})
        if changed:
            bpy.ops.sketch_to_face.fit_again("INVOKE_DEFAULT")
        return {"FINISHED"}

    def _leave(self, context, result):
        session.show_points, session.held_point = False, None
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        redraw(context, {"WINDOW", "UI"})
        return result

    def _under(self, context, face, event) -> str | None:
        """The name of the point nearest to the mouse, if it is near."""
        plane, mouse, view = overlay.plane_of(face), self._mouse(event), self._view()
        best, away = None, float(NEAR) * context.preferences.system.ui_scale
        for name, spot in overlay.points_of(face, overlay.look(context, face)).items():
            seen = location_3d_to_region_2d(*view, plane @ Vector((*spot, 0.0)))
            if seen is not None and (seen - mouse).length < away:
                best, away = name, (seen - mouse).length
        return best

    def _drag(self, face, name: str, event) -> None:
        """Move a point to under the mouse."""
        plane, mouse, view = overlay.plane_of(face), self._mouse(event), self._view()
        origin = region_2d_to_origin_3d(*view, mouse)
        ahead = region_2d_to_vector_3d(*view, mouse)
        normal = plane.to_3x3() @ Vector((0.0, 0.0, 1.0))
        hit = intersect_line_plane(origin, origin + ahead, plane.translation, normal)
        if hit is None:  # the plane is seen from its edge
            return
        x, y, _ = plane.inverted() @ hit
        u, v = overlay.on_page(face, np.array([x, y]))[0]
        page = memory.page_of(face)
        set_pin(face, name, page[:, :2] @ (u, v) + page[:, 2])

    def _view(self):
        """Region and view of the area's main window, wherever the mouse is."""
        region = next(r for r in self._area.regions if r.type == "WINDOW")
        return region, self._area.spaces.active.region_3d

    def _mouse(self, event) -> Vector:
        region, _ = self._view()
        return Vector((event.mouse_x - region.x, event.mouse_y - region.y))


CLASSES = (SKETCHTOFACE_OT_pin, SKETCHTOFACE_OT_unpin, SKETCHTOFACE_OT_drag_pins)
