"""Runs inside Blender's real window and works as an artist does, from the drawing to the file.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 -P drive.py -- \
        --sketch S.png --out DIR [--picture PICTURE.png]

Opens the tab, chooses the sketch, presses the button, moves a slider, undoes, redoes, saves,
reloads, exports. The add-on `sketch_to_face` must be among Blender's user add-ons. Exit status 0
and DIR/result.json if every step held, 1 and a traceback on stderr if not. Screenshots of the
steps go to DIR.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from hands import (  # noqa: E402
    FRAME,
    PATIENCE,
    Deaf,
    Desk,
    clear,
    drag,
    find_button,
    find_slider,
    look,
    main,
    open_tab,
    until,
    vertices,
    write,
)

BUTTON = "bpy.ops.sketch_to_face.fit()"
FIELD = "sketch_to_face.sketch"
STRENGTH = "sketch_to_face.detections[{}].intensity"


def things() -> tuple[set, set]:
    return set(bpy.data.objects.keys()), set(bpy.data.meshes.keys())


def idle() -> bool:
    """Whether the add-on's work is over."""
    from sketch_to_face.state.session import session

    return session.doing is None


def key(desk: Desk, letter: str, **held):
    """A key over the middle of the 3D view."""
    centre = desk.middle("WINDOW")
    desk.move(*centre)
    yield FRAME
    desk.tap(letter, *centre, **held)
    yield FRAME * 5


def timed_press(desk: Desk, place, result: dict, name: str):
    """Press the button; how long until the face is there, how long Blender was deaf meanwhile."""
    before = things()
    x, y = place
    desk.move(x - 3, y)
    yield FRAME
    desk.move(x, y)
    yield FRAME
    from sketch_to_face.background import tasks

    deaf, start = Deaf(tasks.InSlices), time.monotonic()
    desk.tap("LEFTMOUSE", x, y)
    yield 0.01
    while not (idle() and things()[0] != before[0]):
        if time.monotonic() - start > PATIENCE:
            raise AssertionError(f"waited {PATIENCE:.0f} s in vain for a face")
        yield 0.05  # seldom: every look takes the thread that reads some time
    result[name] = {
        "seconds_to_the_face": round(time.monotonic() - start, 3),
        "seconds_deaf": round(deaf.stop(), 3),
    }
    yield FRAME * 5


def session(options, result: dict):
    desk = Desk()
    beginning = time.monotonic()
    yield from clear(desk)
    yield from open_tab(desk)
    shutil.copy(options.sketch, options.out)
    file = options.out / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    desk.screenshot(options.out / "1_tab.png")

    places: list = []
    yield from find_slider(desk, FIELD, places)
    yield from write(desk, places[0], f"//{options.sketch.name}")
    chosen = bpy.context.scene.sketch_to_face.sketch
    assert chosen == f"//{options.sketch.name}", f"typed a path, the field has '{chosen}'"
    desk.screenshot(options.out / "2_sketch.png")

    yield from find_button(desk, BUTTON, places)
    before = things()
    yield from timed_press(desk, places[1], result, "first")
    name = bpy.context.view_layer.objects.active.name
    drawn = vertices(name)
    yield from key(desk, "Z", ctrl=True)
    assert things() == before, f"undo left something behind: {before} became {things()}"
    yield from timed_press(desk, places[1], result, "again")
    assert np.array_equal(vertices(name), drawn), "the same sketch made another face"
    result["face"] = name
    keys = bpy.data.objects[name].data.shape_keys.key_blocks
    result["keys"] = [k.name for k in keys]
    result["values"] = {k.name: k.value for k in keys if k.value}
    desk.screenshot(options.out / "3_face.png")

    face = bpy.data.objects[name]
    shown = face.sketch_to_face.detections.find("smile")
    face.sketch_to_face.shown = shown
    desk.area.tag_redraw()
    yield FRAME * 3
    yield from find_slider(desk, STRENGTH.format(shown), places)
    yield from drag(desk, places[2], -60)
    moved = vertices(name)
    result["slider_moves_m"] = float(np.abs(moved - drawn).max())
    assert result["slider_moves_m"] > 0.001, "the slider moves nothing"
    assert bpy.data.objects[name].sketch_to_face.detections[shown].locked, "no lock was set"
    desk.screenshot(options.out / "4_slider.png")

    yield from key(desk, "Z", ctrl=True)
    assert np.array_equal(vertices(name), drawn), "undo did not take the slider back"
    yield from key(desk, "Z", ctrl=True, shift=True)
    assert np.array_equal(vertices(name), moved), "redo did not bring the slider again"
    yield from key(desk, "Z", ctrl=True)
    yield from key(desk, "Z", ctrl=True)
    assert things() == before, f"undo left something behind: {before} became {things()}"
    desk.screenshot(options.out / "5_undone.png")
    yield from key(desk, "Z", ctrl=True, shift=True)
    assert np.array_equal(vertices(name), drawn), "redo made another face"

    saved = file.stat().st_mtime_ns
    yield from key(desk, "S", ctrl=True)
    yield from until(lambda: file.stat().st_mtime_ns != saved, "the file to be saved")
    bpy.ops.wm.revert_mainfile()
    yield FRAME * 10
    desk = Desk()
    assert np.array_equal(vertices(name), drawn), "the face was saved otherwise than it was"
    face = bpy.data.objects[name]
    face["jaw_open"] += 2.5
    face.update_tag()
    yield FRAME * 3
    assert np.abs(vertices(name) - drawn).max() > 0.003, "the reloaded face is dead"
    for region in desk.area.regions:
        region.tag_redraw()
    yield FRAME * 8
    desk.screenshot(options.out / "6_reloaded.png")

    with desk.context():
        bpy.ops.sketch_to_face.export(filepath=str(options.out / "ours.glb"))
        bpy.ops.export_scene.gltf(filepath=str(options.out / "blenders.glb"))
    result["exported"] = {p.name: p.stat().st_size for p in options.out.glob("*.glb")}

    face["jaw_open"] -= 2.5
    face.update_tag()
    yield from look(desk, face)
    desk.screenshot(options.picture or options.out / "7_picture.png")
    result["seconds"] = time.monotonic() - beginning


if __name__ == "__main__":
    main(session)
