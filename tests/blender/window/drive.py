"""Runs inside Blender's real window and works as an artist does: mouse, keys, undo, sliders.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 -P drive.py -- \
        --sketch S.png --out DIR [--picture PICTURE.png]

The add-on `sketch_to_face` must be among Blender's user add-ons. Exit status 0 and DIR/result.json
if every step held, 1 and a traceback on stderr if not. Screenshots of the steps go to DIR.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from hands import FRAME, Desk, clear, find_button, look, main, open_tab, until, vertices  # noqa: E402

BUTTON = "bpy.ops.sketch_to_face.fit()"


def session(options, result: dict):
    desk = Desk()
    beginning = time.monotonic()
    yield from clear(desk)
    yield from open_tab(desk)
    shutil.copy(options.sketch, options.out)
    bpy.ops.wm.save_as_mainfile(filepath=str(options.out / "scene.blend"))
    bpy.context.scene.sketch_to_face.sketch = f"//{options.sketch.name}"
    with desk.context():
        bpy.ops.ed.undo_push(message="Choose the sketch")
    desk.area.tag_redraw()
    yield FRAME * 3
    desk.screenshot(options.out / "1_tab.png")

    places: list = []
    yield from find_button(desk, BUTTON, places)
    before = set(bpy.data.objects.keys()), set(bpy.data.meshes.keys())
    start = time.monotonic()
    desk.tap("LEFTMOUSE", *places[0])
    yield from until(lambda: set(bpy.data.meshes.keys()) != before[1], "a face")
    result["seconds_to_the_face"] = time.monotonic() - start
    name = bpy.context.view_layer.objects.active.name
    result["face"] = name
    keys = bpy.data.objects[name].data.shape_keys.key_blocks
    result["keys"] = [k.name for k in keys]
    result["values"] = {k.name: k.value for k in keys if k.value}
    face = bpy.data.objects[name]
    yield FRAME * 5
    desk.screenshot(options.out / "2_face.png")

    drawn = vertices(name)
    face["jaw_open"] += 2.5
    face.update_tag()
    with desk.context():
        bpy.ops.ed.undo_push(message="Move a slider")
    yield FRAME * 3
    moved = vertices(name)
    result["slider_moves_m"] = float(np.abs(moved - drawn).max())
    assert result["slider_moves_m"] > 0.003, "the slider moves nothing"
    desk.screenshot(options.out / "3_slider.png")

    centre = desk.middle("WINDOW")
    desk.move(*centre)
    yield FRAME
    desk.tap("Z", *centre, ctrl=True)
    yield FRAME * 5
    assert np.array_equal(vertices(name), drawn), "undo did not take the slider back"
    desk.tap("Z", *centre, ctrl=True)
    yield FRAME * 5
    after = set(bpy.data.objects.keys()), set(bpy.data.meshes.keys())
    assert after == before, f"undo left something behind: {before} became {after}"
    desk.screenshot(options.out / "4_undone.png")
    desk.tap("Z", *centre, ctrl=True, shift=True)
    yield FRAME * 5
    assert np.array_equal(vertices(name), drawn), "redo made another face"

    yield from look(desk, bpy.data.objects[name])
    desk.screenshot(options.picture or options.out / "5_picture.png")
    result["seconds"] = time.monotonic() - beginning


main(session)
