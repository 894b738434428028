"""Runs inside Blender's real window: corrects what was read, pins, draws with Grease Pencil, live.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 \
        -P drive_iterate.py -- --sketch S.png --out DIR

Makes a face, looks at the evidence, rejects an action in the list, fits again; drags a pin with the
mouse; turns the overlay on; draws a line with Grease Pencil in a live sketch; stops a fit with
Escape. As drive.py: status 0 and DIR/result.json if every step held.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))
from bpy_extras.view3d_utils import location_3d_to_region_2d  # noqa: E402
from hands import (  # noqa: E402
    FRAME,
    Desk,
    clear,
    look,
    main,
    open_tab,
    press,
    reach_button,
    until,
    vertices,
    zoom,
)
from mathutils import Vector  # noqa: E402
from sheets import lines_of, pencil_of  # noqa: E402

FIT, AGAIN, EVIDENCE, PINS = (
    f"bpy.ops.sketch_to_face.{name}()" for name in ("fit", "fit_again", "evidence", "drag_pins")
)
REJECT = "bpy.ops.sketch_to_face.decide(name=\"{}\", decision='REJECT')"
CORNER = "mouth_corner_left"


def idle() -> bool:
    """Whether the add-on's work is over."""
    from sketch_to_face.state.session import session

    return session.doing is None


def pressed(desk: Desk, command: str, done=idle):
    """Find a button, press it, wait for its work."""
    places: list = []
    yield from reach_button(desk, command, places)
    yield from press(desk, places[0])
    yield from until(done, command)
    yield FRAME * 5


def show(desk: Desk, name: str):
    """Choose an action in the list."""
    face = bpy.context.view_layer.objects.active
    face.sketch_to_face.shown = face.sketch_to_face.detections.find(name)
    desk.area.tag_redraw()
    yield FRAME * 3


def on_screen(desk: Desk, face, spot) -> tuple[float, float]:
    """Window pixels of a point of the overlay's plane."""
    from sketch_to_face.viewport import overlay

    region = desk.region("WINDOW")
    seen = location_3d_to_region_2d(
        region, desk.space.region_3d, overlay.plane_of(face) @ Vector((*spot, 0.0))
    )
    return region.x + seen.x, region.y + seen.y


def drag_a_pin(desk: Desk, face, result: dict, out: Path):
    """Press Drag Pins, take the corner of the mouth with the mouse, put it lower, Enter."""
    from sketch_to_face.state.session import session
    from sketch_to_face.viewport import overlay

    yield from pressed(desk, PINS, lambda: session.show_points)
    yield from until(lambda: len(overlay.look(bpy.context, face).landmarks), "points")
    spots = overlay.points_of(face, overlay.look(bpy.context, face))
    x, y = on_screen(desk, face, spots[CORNER])
    desk.move(x - 2, y)
    yield FRAME
    desk.move(x, y)
    yield FRAME * 2
    assert session.held_point == CORNER, f"the mouse is on {session.held_point}, not on {CORNER}"
    desk.window.event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x), y=int(y))
    for step in range(1, 6):
        yield 0.05
        desk.move(x + 3 * step * desk.scale, y - 4 * step * desk.scale)
    yield FRAME
    x, y = x + 15 * desk.scale, y - 20 * desk.scale
    desk.window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x), y=int(y))
    yield FRAME * 3
    assert list(face.sketch_to_face.pins.keys()) == [CORNER], "no pin was set"
    desk.screenshot(out / "3_pins.png")
    desk.tap("RET", x, y)
    yield FRAME * 3
    yield from until(idle, "the fit with a pin")
    yield FRAME * 5
    from facs_rig import LANDMARKS, load_rig

    wanted = overlay.pins_on_plane(face)[CORNER]  # the fit moves the sketch against the face, too
    corner = vertices(face.name)[load_rig().landmarks[LANDMARKS.index(CORNER)]]
    distance = face.sketch_to_face.distance or np.inf  # as the sketch's camera sees it
    seen = corner[[0, 2]] / (1 + corner[1] / distance)
    result["pin_off_mm"] = float(1000 * np.linalg.norm(seen - wanted))
    assert result["pin_off_mm"] < 2.0, "the face did not come to its pin"


def session(options, result: dict):
    desk = Desk()
    beginning = time.monotonic()
    zoom(desk, 0.9)
    yield from clear(desk)
    yield from open_tab(desk)
    # Beside the .blend file, so that no picture of the window shows where this computer has it.
    shutil.copy(options.sketch, options.out)
    bpy.ops.wm.save_as_mainfile(filepath=str(options.out / "scene.blend"))
    bpy.context.scene.sketch_to_face.sketch = f"//{options.sketch.name}"
    with desk.context():
        bpy.ops.ed.undo_push(message="Choose the sketch")
    desk.area.tag_redraw()
    yield FRAME * 3
    yield from pressed(desk, FIT)
    face = bpy.context.view_layer.objects.active
    name, first = face.name, vertices(face.name)

    # Detect: why, and no
    yield from show(desk, "smile")
    yield from pressed(desk, EVIDENCE)
    desk.screenshot(options.out / "1_evidence.png")
    places: list = []
    yield from reach_button(desk, REJECT.format("smile"), places, 0.5)
    yield from press(desk, places[0])
    assert face["smile"] == 0.0 and face.sketch_to_face.detections["smile"].locked
    yield from pressed(desk, AGAIN)
    face = bpy.data.objects[name]
    assert face["smile"] == 0.0, "fitting again forgot what was rejected"
    rejected = vertices(name)
    assert np.abs(rejected - first).max() > 0.001
    desk.screenshot(options.out / "2_rejected.png")

    # Fit: a pin, the overlay
    yield from drag_a_pin(desk, face, result, options.out)
    yield from until(lambda: not drawing(), "lines")
    desk.screenshot(options.out / "4_overlay.png")
    bpy.context.scene.sketch_to_face.overlay = False

    # Escape stops, and nothing has changed
    before = vertices(name)
    places = []
    yield from reach_button(desk, AGAIN, places)
    x, y = places[0]
    desk.tap("LEFTMOUSE", x, y)
    yield 0.1
    assert not idle(), "the button's work was over before Escape"
    desk.tap("ESC", x, y)
    yield from until(idle, "Escape to be heard")
    yield FRAME * 5
    assert np.array_equal(vertices(name), before), "a stopped fit changed the face"

    # Grease Pencil, live
    yield from live(desk, options, result)
    result["seconds"] = time.monotonic() - beginning


def drawing() -> bool:
    """Whether the overlay still looks for lines."""
    from sketch_to_face.state.session import session

    return any(shown.task is not None for shown in session.face_lines.values())


def live(desk: Desk, options, result: dict):
    """A face of Grease Pencil strokes follows the pen."""
    from sheets import draw_on

    with desk.context():
        bpy.ops.object.select_all(action="SELECT")
        bpy.ops.object.delete()
    settings = bpy.context.scene.sketch_to_face
    lines = lines_of(options.sketch)
    mouth = [k for k, line in enumerate(lines) if -0.09 < line.mean(axis=0)[1] < -0.02]
    pencil = pencil_of([line for k, line in enumerate(lines) if k not in mouth], "Face Sketch")
    ink = bpy.data.materials.new("Ink")
    bpy.data.materials.create_gpencil_data(ink)
    ink.grease_pencil.color = (0.02, 0.02, 0.02, 1.0)
    pencil.data.materials.append(ink)
    pencil.location.x = -0.28
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil
    bpy.context.view_layer.objects.active = pencil
    with desk.context():
        bpy.ops.ed.undo_push(message="Draw")
    desk.area.tag_redraw()
    yield FRAME * 3
    yield from pressed(desk, FIT)
    face = bpy.context.view_layer.objects.active
    name = face.name
    face.sketch_to_face.live = True
    for thing in bpy.data.objects:
        thing.select_set(True)
    yield from look(desk, face)
    desk.screenshot(options.out / "5_pencil.png")
    before = vertices(name)
    draw_on(pencil.data.layers[0].frames[0], [lines[k] for k in mouth])
    bpy.context.view_layer.objects.active = pencil
    mark = face.sketch_to_face.mark
    yield from until(lambda: bpy.data.objects[name].sketch_to_face.mark != mark, "a live fit")
    yield FRAME * 5
    result["live_moves_m"] = float(np.abs(vertices(name) - before).max())
    assert result["live_moves_m"] > 0.001, "the live face does not follow the pen"
    desk.screenshot(options.out / "6_live.png")


main(session)
