"""Runs inside Blender's real window: adds a face from the menu and works with its sliders.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 -P drive_face.py -- \
        --out DIR [--picture PICTURE.png]

Exit status and files as drive.py.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
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
    until,
    vertices,
    zoom,
)  # fmt: skip

COPY = "bpy.ops.sketch_to_face.copy_expression()"
PASTE = "bpy.ops.sketch_to_face.paste_expression()"
# The face of the picture: a smile that reaches the eyes.
SMILE = {"smile": 4.2, "outer_squint": 2.5, "squint": 0.8, "frontalis": 0.8, "jaw_open": 0.6}
WHO = {"gender": 0.25, "age": 0.12, "caucasian": 0.6, "asian": 0.3, "african": 0.1,
       "wrinkles": -0.4}  # fmt: skip


def add_from_menu(desk: Desk):
    """Shift A, then the letters that the menu underlines: Mesh, FACS Face."""
    centre = desk.middle("WINDOW")
    desk.move(*centre)
    yield FRAME
    desk.tap("A", *centre, shift=True)
    yield FRAME * 3
    desk.tap("M", *centre)
    yield FRAME * 3
    desk.tap("F", *centre)


def session(options, result: dict):
    desk = Desk()
    beginning = time.monotonic()
    yield from clear(desk)
    yield from open_tab(desk)
    desk.screenshot(options.out / "1_no_face.png")

    start = time.monotonic()
    yield from add_from_menu(desk)
    yield from until(lambda: "FACS Face" in bpy.data.objects, "a face from Add > Mesh")
    result["seconds_to_the_face"] = time.monotonic() - start
    face = bpy.data.objects["FACS Face"]
    result["keys"] = [k.name for k in face.data.shape_keys.key_blocks]
    result["active"] = bpy.context.view_layer.objects.active.name
    yield from look(desk, face)
    desk.screenshot(options.out / "2_face.png")

    centre = desk.middle("WINDOW")
    for name, there in (("undo", False), ("redo", True)):
        desk.move(*centre)
        yield FRAME
        desk.tap("Z", *centre, ctrl=True, shift=there)
        yield FRAME * 5
        assert ("FACS Face" in bpy.data.objects) == there, f"{name} does not work"
    assert bpy.data.objects["FACS Face"].data.shape_keys.animation_data.drivers

    rest = vertices("FACS Face")
    places: list = []
    yield from find_slider(desk, '["frontalis"]', places)
    yield from drag(desk, places[0], 25)
    moved = vertices("FACS Face")
    result["frontalis"] = bpy.data.objects["FACS Face"]["frontalis"]
    result["slider_moves_m"] = float(np.abs(moved - rest).max())
    assert result["frontalis"] > 0.5, "the slider does not follow the mouse"
    assert result["slider_moves_m"] > 0.0005, "the slider moves nothing"
    desk.screenshot(options.out / "3_slider.png")

    found: list = []
    yield from find_button(desk, COPY, found, 0.3)
    yield from find_button(desk, PASTE, found, 0.7)
    yield from press(desk, found[0])
    result["clipboard"] = bpy.context.window_manager.clipboard
    face = bpy.data.objects["FACS Face"]
    face["frontalis"] = 0.0
    face.update_tag()
    yield FRAME
    assert np.abs(vertices("FACS Face") - rest).max() < 1e-6, "the slider is not back"
    yield from press(desk, found[1])
    assert np.abs(vertices("FACS Face") - moved).max() < 1e-6, "pasting brings another face"

    face = bpy.data.objects["FACS Face"]
    face["frontalis"] = 0.0
    for name, value in SMILE.items():
        face[name] = value
    for name, value in WHO.items():
        setattr(face.sketch_to_face.identity, name, value)
    face.update_tag()
    zoom(desk, 0.8)  # so that all sliders fit
    yield FRAME * 5
    yield from scroll(desk, 5)
    yield from look(desk, face)
    desk.screenshot(options.picture or options.out / "4_picture.png")
    result["seconds"] = time.monotonic() - beginning


main(session)
