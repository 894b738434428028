"""Runs inside Blender's real window: hair is combed, swapped, taken away and put on another face.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 -P drive_hair.py -- \
        --sketch S.png --out DIR

Exit status and files as drive.py.
"""

import shutil
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from drive import BUTTON, idle, key  # noqa: E402
from hands import (  # noqa: E402
    FRAME,
    Desk,
    clear,
    drag,
    find_button,
    find_slider,
    look,
    main,
    open_tab,
    press,
    scroll,
    unfold,
    until,
    vertices,
)

SLIDERS = {"length": "sketch_to_face.hair_length", "volume": "sketch_to_face.hair_volume"}
NONE = "bpy.ops.sketch_to_face.hair(kind='none')"
SURFACE = "bpy.ops.sketch_to_face.hair(kind='surface')"


def session(options, result: dict):
    desk = Desk()
    beginning = time.monotonic()
    yield from clear(desk)
    yield from open_tab(desk)
    shutil.copy(options.sketch, options.out)
    bpy.context.scene.sketch_to_face.sketch = str(options.out / options.sketch.name)
    # Before they are drawn for the first time: Blender remembers which ones were open.
    folded = ("detect", "face", "head", "wrinkles")
    yield from unfold(desk, **{f"SKETCHTOFACE_PT_{name}": True for name in folded})
    yield from unfold(desk, SKETCHTOFACE_PT_hair=False)
    places: list = []
    yield from find_button(desk, BUTTON, places)
    yield from press(desk, places[0])
    yield from until(lambda: idle() and any("Hair" in o.name for o in bpy.data.objects), "hair")
    yield FRAME * 5
    hair = next(o.name for o in bpy.data.objects if o.name.endswith(" Hair"))
    face = bpy.context.view_layer.objects.active.name
    result["face"], result["hair"] = face, hair
    yield from scroll(desk, 12)
    yield from look(desk, bpy.data.objects[face])
    desk.screenshot(options.out / "1_result.png")

    for number, (name, path) in enumerate(SLIDERS.items()):
        found: list = []
        yield from find_slider(desk, path, found)
        before = vertices(hair)
        yield from drag(desk, found[0], 40)
        value = getattr(bpy.data.objects[face].sketch_to_face, f"hair_{name}")
        result[name] = value
        assert value > 1.05, f"the slider of the {name} does not follow the mouse"
        after = vertices(hair)
        assert np.abs(np.ptp(after, axis=0) - np.ptp(before, axis=0)).max() > 0.002, name
        desk.screenshot(options.out / f"{2 + number}_{name}.png")
        yield from key(desk, "Z", ctrl=True)
        assert np.array_equal(vertices(hair), before), f"undo does not take the {name} back"
        assert getattr(bpy.data.objects[face].sketch_to_face, f"hair_{name}") == 1.0

    with desk.context():
        bpy.ops.sketch_to_face.hair_preset("EXEC_DEFAULT", True, preset="afro")
    yield FRAME * 5
    bpy.context.preferences.view.language = "de_DE"
    bpy.context.preferences.view.use_translate_interface = True
    desk.area.tag_redraw()
    yield from look(desk, bpy.data.objects[face])
    desk.screenshot(options.out / "4_german.png")
    bpy.context.preferences.view.use_translate_interface = False
    desk.area.tag_redraw()
    yield FRAME * 5
    found = []
    yield from find_button(desk, SURFACE, found, 0.6)
    yield from press(desk, found[0])
    assert bpy.data.objects[hair]["facs_hair_kind"] == "surface"
    found = []
    yield from find_button(desk, NONE, found, 0.78)
    yield from press(desk, found[0])
    assert hair not in bpy.data.objects, "the cross does not take the hair away"

    with desk.context():
        bpy.ops.mesh.add_facs_face("EXEC_DEFAULT", True)
        bpy.ops.sketch_to_face.hair_preset("EXEC_DEFAULT", True, preset="ponytail")
    yield from look(desk, bpy.context.view_layer.objects.active)
    desk.screenshot(options.out / "5_added.png")
    found = []
    yield from find_slider(desk, SLIDERS["length"], found)
    yield from drag(desk, found[0], 40)
    assert bpy.context.view_layer.objects.active.sketch_to_face.hair_length > 1.05
    result["seconds"] = time.monotonic() - beginning


if __name__ == "__main__":
    main(session)
