"""Runs inside Blender's real window: a folder of sketches becomes key poses of a mesh.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 \
        -P drive_storyboard.py -- --sketch FOLDER --out DIR

Presses the button, lets it run through, undoes and redoes it; presses it again and stops it with
Escape. As drive.py: status 0 and DIR/result.json if every step held.
"""

import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from hands import FRAME, Desk, clear, find_button, main, open_tab, press, until  # noqa: E402

BUTTON = "bpy.ops.sketch_to_face.storyboard()"
NAME = "Head"


def head() -> None:
    """A triangle with two of ARKit's keys, selected."""
    data = bpy.data.meshes.new(NAME)
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    made = bpy.data.objects.new(NAME, data)
    bpy.context.scene.collection.objects.link(made)
    for key in ("Basis", "mouthSmileLeft", "jawOpen"):
        made.shape_key_add(name=key, from_mix=False)
    made.select_set(True)
    bpy.context.view_layer.objects.active = made


def keyed() -> list[float]:
    """The frames that the smile is keyed at."""
    keys = bpy.data.objects[NAME].data.shape_keys
    if keys.animation_data is None or keys.animation_data.action is None:
        return []
    curve = keys.animation_data.action.fcurves.find('key_blocks["mouthSmileLeft"].value')
    return [point.co[0] for point in curve.keyframe_points] if curve else []


def unfold_panel() -> None:
    """Register the panel once more, open this time."""
    panel = bpy.types.SKETCHTOFACE_PT_retarget
    bpy.utils.unregister_class(panel)
    panel.bl_options = set()
    bpy.utils.register_class(panel)


def session(options, result: dict):
    desk = Desk()
    yield from clear(desk)
    unfold_panel()
    yield from open_tab(desk)
    head()
    settings = bpy.context.scene.sketch_to_face
    settings.storyboard, settings.storyboard_every = str(options.sketch), 10
    count = len(list(options.sketch.iterdir()))
    with desk.context():
        bpy.ops.ed.undo_push(message="Choose the folder")
    desk.area.tag_redraw()
    yield FRAME * 3
    desk.screenshot(options.out / "1_panel.png")

    places: list = []
    yield from find_button(desk, BUTTON, places)
    start = time.monotonic()
    yield from press(desk, places[0])
    yield from until(lambda: len(keyed()) == count and bpy.context.scene.frame_current == 1, "keys")
    result["seconds"], result["frames"] = time.monotonic() - start, keyed()
    yield FRAME * 5

    centre = desk.middle("WINDOW")
    desk.move(*centre)
    yield FRAME
    desk.tap("Z", *centre, ctrl=True)
    yield FRAME * 5
    assert keyed() == [], "one undo left keyframes behind"
    desk.tap("Z", *centre, ctrl=True, shift=True)
    yield FRAME * 5
    assert keyed() == result["frames"], "redo made others"
    desk.tap("Z", *centre, ctrl=True)
    yield FRAME * 5

    x, y = places[0]
    desk.move(x - 3, y)
    yield FRAME
    desk.move(x, y)
    yield FRAME
    desk.tap("LEFTMOUSE", x, y)
    yield from until(lambda: len(keyed()) > 0, "the first key")
    desk.tap("ESC", x, y)
    yield FRAME * 10
    result["stopped"] = keyed()
    desk.screenshot(options.out / "2_stopped.png")
    desk.move(*centre)
    yield FRAME
    desk.tap("Z", *centre, ctrl=True)
    yield FRAME * 5
    assert keyed() == [], "one undo does not take back what Escape kept"


main(session)
