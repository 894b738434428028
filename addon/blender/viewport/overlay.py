"""The sketch and the lines of the face over each other in the 3D view, and the pins on them.

Everything lies in one upright plane before the face, where the sketch's camera saw it: from the
front the two drawings are one above the other as on the sketch itself, in its perspective. The
lines of the face are those of what is shown, sliders, bones and sculpting included; they are found
in a thread.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix
from numpy.typing import NDArray

from facs_rig.blender.pose import DETAIL
from facs_rig.levels import FULL, at_level

from ..background.tasks import BackgroundTask, redraw
from ..state import faces, memory
from ..state.session import session

BEFORE = 0.01  # metres between the face and the plane
SIZE = 640  # px of the picture in which the face's lines are looked for
AGAIN = 0.05  # seconds between looks whether they were found
WIDTH = 1.6
SKETCH, LOST, FACE = (0.05, 0.1, 0.3, 0.9), (0.1, 0.45, 1.0, 1.0), (0.95, 0.12, 0.05, 0.85)
POINT, PINNED, HELD = (1.0, 1.0, 1.0, 0.75), (0.2, 0.95, 0.3, 1.0), (1.0, 0.85, 0.1, 1.0)


@dataclass
class FaceLines:
    """What was found of a face. lines : (k, 2) each, landmarks : (m, 2); metres, x right, y up."""

    key: int = -1
    lines: list[NDArray] = field(default_factory=list)
    landmarks: NDArray = field(default_factory=lambda: np.empty((0, 2)))
    wanted: int = -1
    task: BackgroundTask | None = None


def plane_of(face: bpy.types.Object) -> Matrix:
    """From the plane (x right, y up, metres, the face's pivot at the origin) to the world.

    What is nearer to the eye than the pivot was drawn larger; on the plane it has its own size.
    """
    front = min(corner[1] for corner in face.bound_box) - BEFORE
    small = face.sketch_to_face.closeness
    rows = ((small, 0, 0, 0), (0, 0, -1, front), (0, small, 0, 0), (0, 0, 0, 1))
    return face.matrix_world @ Matrix(rows)


def on_plane(face: bpy.types.Object, pixels: NDArray) -> NDArray[np.float64]:
    """Pixels (k, 2) of the face's sketch as points of the plane, in which the face is upright."""
    zoom, u, v = face.sketch_to_face.camera
    offset = np.asarray(pixels, float).reshape(-1, 2) - (u, v)
    return offset @ _stand_up(face) / (zoom, -zoom)


def on_page(face: bpy.types.Object, points: NDArray) -> NDArray[np.float64]:
    """The reverse of `on_plane`."""
    zoom, u, v = face.sketch_to_face.camera
    offset = np.asarray(points, float).reshape(-1, 2) * (zoom, -zoom)
    return offset @ _stand_up(face).T + (u, v)


def _stand_up(face: bpy.types.Object) -> NDArray[np.float64]:
    """(2, 2) that turns rows (u, v) of the sketch as it lies to those of the upright one."""
    return np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), face.sketch_to_face.turn)


def pins_on_plane(face: bpy.types.Object) -> dict[str, NDArray[np.float64]]:
    """The face's pins as points of the plane."""
    page = memory.page_of(face)
    return {
        name: on_plane(face, np.array(memory.to_page(place, page)))[0]
        for name, place in memory.places(face).items()
    }


def look(context, face: bpy.types.Object) -> FaceLines:
    """What is known of the face's lines; has them found anew if the face is another than then."""
    shown = session.face_lines.setdefault(face.name, FaceLines())
    if shown.task is not None and shown.task.done.is_set():
        try:
            shown.lines, shown.landmarks = shown.task.result()
        finally:
            shown.key, shown.task = shown.wanted, None
    if session.doing is not None:  # a face that is being shaped is no face yet
        return shown
    mesh = face.evaluated_get(context.evaluated_depsgraph_get()).data
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", flat)
    key = zlib.crc32(flat.data)
    if shown.task is None and key != shown.key and len(mesh.vertices) == len(face.data.vertices):
        shown.wanted, shown.task = (
            key,
            BackgroundTask(_finder(flat.reshape(-1, 3), face)),
        )
        if not bpy.app.timers.is_registered(_again):
            bpy.app.timers.register(_again, first_interval=AGAIN)
    return shown


def _finder(vertices: NDArray, face: bpy.types.Object):
    """A function, for a thread, that finds a face's lines and landmarks from its vertices."""
    level, distance = face.get(DETAIL, FULL), face.sketch_to_face.distance or np.inf
    posed = np.stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]], axis=1)

    def find(_progress):
        from facs_rig import Camera, load_rig
        from snakes import face_lines

        rig = at_level(load_rig(), level)
        if len(posed) != rig.n_vertices:
            return [], np.empty((0, 2))
        camera = Camera.framing(posed, SIZE, SIZE, distance=distance)
        found = face_lines(rig, posed, camera)
        zoom = camera.scale[0], -camera.scale[0]
        flat = (found.lines.points - camera.centre) / zoom
        lines = np.split(flat, found.starts[1:-1]) if len(flat) else []
        return lines, (camera.project(posed[rig.landmarks].astype(float)) - camera.centre) / zoom

    return find


def _again() -> float | None:
    """Draw the views anew once the lines are found."""
    waiting = [shown.task for shown in session.face_lines.values() if shown.task is not None]
    if any(task.done.is_set() for task in waiting):
        redraw(bpy.context, {"WINDOW"})
        return None
    return AGAIN if waiting else None


def draw() -> None:
    """Called by Blender for every 3D view that it draws."""
    context = bpy.context
    if not context.scene.sketch_to_face.overlay:
        return
    face = faces.active_face(context)
    if face is None or faces.trouble(face) or not face.visible_get():
        return
    shown = look(context, face)
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE")
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(plane_of(face))
        if face.sketch_to_face.number and face.sketch_to_face.camera[0] > 0:
            _draw_lines([on_plane(face, n) for n in memory.unpack(face.get(memory.DRAWN))], SKETCH)
            _draw_lines([on_plane(face, n) for n in memory.unpack(face.get(memory.LOST))], LOST)
        _draw_lines(shown.lines, FACE)
        pinned = pins_on_plane(face) if face.sketch_to_face.camera[0] > 0 else {}
        if session.show_points:
            _draw_points(list(shown.landmarks), POINT, 5.0)
        _draw_points(list(pinned.values()), PINNED, 9.0)
        spots = points_of(face, shown)
        if session.held_point in spots:
            _draw_points([spots[session.held_point]], HELD, 12.0)
    gpu.state.blend_set("NONE")


def points_of(face: bpy.types.Object, shown: FaceLines) -> dict[str, NDArray[np.float64]]:
    """The points of a face by name, on the plane: where it has them, or where they are pinned."""
    from facs_rig import LANDMARKS

    found = dict(zip(LANDMARKS, shown.landmarks, strict=False))
    return {**found, **pins_on_plane(face)} if face.sketch_to_face.camera[0] > 0 else found


def _draw_lines(lines: list[NDArray], colour: tuple[float, ...]) -> None:
    """Polylines (k, 2) of the plane."""
    pairs = [np.repeat(line, 2, axis=0)[1:-1] for line in lines if len(line) > 1]
    if not pairs:
        return
    flat = np.concatenate(pairs)
    points = np.column_stack([flat, np.zeros(len(flat))]).astype(np.float32)
    prefix = "3D_" if bpy.app.version < (4, 0, 0) else ""
    shader = gpu.shader.from_builtin(f"{prefix}POLYLINE_UNIFORM_COLOR")
    batch = batch_for_shader(shader, "LINES", {"pos": points})
    shader.bind()
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("lineWidth", WIDTH * bpy.context.preferences.system.ui_scale)
    shader.uniform_float("color", colour)
    batch.draw(shader)


def _draw_points(points: list[NDArray], colour: tuple[float, ...], size: float) -> None:
    if not points:
        return
    places = np.column_stack([np.array(points), np.zeros(len(points))]).astype(np.float32)
    prefix = "3D_" if bpy.app.version < (4, 0, 0) else ""
    shader = gpu.shader.from_builtin(f"{prefix}UNIFORM_COLOR")
    batch = batch_for_shader(shader, "POINTS", {"pos": places})
    gpu.state.point_size_set(size * bpy.context.preferences.system.ui_scale)
    shader.bind()
    shader.uniform_float("color", colour)
    batch.draw(shader)


def attach() -> None:
    """Draw over every 3D view; nothing is drawn while the overlay is off."""
    session.draw_handler = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")


def detach() -> None:
    """The reverse of attach."""
    bpy.types.SpaceView3D.draw_handler_remove(session.draw_handler, "WINDOW")
    if bpy.app.timers.is_registered(_again):
        bpy.app.timers.unregister(_again)
    for shown in session.face_lines.values():
        if shown.task is not None:
            shown.task.stop()
