"""Runs inside Blender's real window and works as an artist does: mouse, keys, undo, sliders.

    blender --factory-startup --enable-event-simulate --python-exit-code 1 -P drive.py -- \
        --sketch S.png --out DIR [--picture PICTURE.png]

The add-on `sketch_to_face` must be among Blender's user add-ons. Exit status 0 and DIR/result.json
if every step held, 1 and a traceback on stderr if not. Screenshots of the steps go to DIR.
"""

import argparse
import json
import os
import shutil
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

BUTTON = "bpy.ops.sketch_to_face.fit()"
FRAME = 0.1  # seconds between the steps of a person in a hurry
PATIENCE = 120.0


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sketch", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--picture", type=Path)
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])


class Desk:
    """The window, its 3D view, and hands to use them. Positions are window pixels from below."""

    def __init__(self) -> None:
        self.window = bpy.context.window_manager.windows[0]
        self.area = next(a for a in self.window.screen.areas if a.type == "VIEW_3D")
        self.space = self.area.spaces.active

    def region(self, kind: str) -> bpy.types.Region:
        return next(r for r in self.area.regions if r.type == kind)

    def context(self, kind: str = "WINDOW"):
        return bpy.context.temp_override(
            window=self.window, area=self.area, region=self.region(kind)
        )

    def move(self, x: float, y: float) -> None:
        self.window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))

    def tap(self, kind: str, x: float, y: float, **held) -> None:
        for value in ("PRESS", "RELEASE"):
            self.window.event_simulate(type=kind, value=value, x=int(x), y=int(y), **held)

    def middle(self, kind: str) -> tuple[float, float]:
        region = self.region(kind)
        return region.x + region.width / 2, region.y + region.height / 2

    def screenshot(self, path: Path) -> None:
        with self.context():
            bpy.ops.screen.screenshot(filepath=str(path), check_existing=False)


def vertices(name: str) -> np.ndarray:
    """What is shown of an object: its vertices after keys and bones."""
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.objects[name].evaluated_get(graph).data
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def until(condition, what: str):
    """Steps that wait for `condition()`."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"waited {PATIENCE:.0f} s in vain: {what}")
        yield FRAME


def open_tab(desk: Desk):
    """Show the sidebar and click down its tabs until ours is drawn."""
    drawn = []

    def notice(_panel, _context):
        drawn.append(True)

    bpy.types.SKETCHTOFACE_PT_sketch.append(notice)
    desk.space.show_region_ui = True
    yield FRAME * 5
    region = desk.region("UI")
    x = region.x + region.width - 10
    for below in range(20, min(region.height, 500), 25):
        y = region.y + region.height - below
        desk.move(x, y)
        yield FRAME
        desk.tap("LEFTMOUSE", x, y)
        yield FRAME * 2
        if drawn:
            break
    bpy.types.SKETCHTOFACE_PT_sketch.remove(notice)
    assert drawn, "the sidebar has no tab that draws our panel"


def find_button(desk: Desk, command: str, found: list):
    """Feel down the sidebar for the button: Ctrl C over a button copies its Python command."""
    region = desk.region("UI")
    manager = bpy.context.window_manager
    x = region.x + region.width * 0.45
    for below in range(20, region.height, 12):
        y = region.y + region.height - below
        manager.clipboard = ""
        desk.move(x - 2, y)
        yield 0.03
        desk.move(x, y)
        yield 0.03
        desk.tap("C", x, y, ctrl=True)
        yield 0.03
        if manager.clipboard.strip() == command:
            found.append((x, y))
            return
    raise AssertionError(f"no button in the sidebar does {command}")


def look(desk: Desk, face: bpy.types.Object):
    """A picture worth showing: front of the face, material colours, nothing in the way."""
    shading, overlay = desk.space.shading, desk.space.overlay
    shading.type, shading.light, shading.color_type = "SOLID", "STUDIO", "MATERIAL"
    shading.show_cavity, shading.cavity_type = True, "SCREEN"
    overlay.show_floor = overlay.show_ortho_grid = False
    overlay.show_axis_x = overlay.show_axis_y = overlay.show_outline_selected = False
    overlay.show_bones = overlay.show_cursor = overlay.show_object_origins = False
    with desk.context():
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
    yield FRAME * 8


def session(options: argparse.Namespace, result: dict):
    desk = Desk()
    beginning = time.monotonic()
    yield 1.0
    with desk.context():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["Cube"].select_set(True)
        bpy.ops.object.delete()
    yield FRAME

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
    yield FRAME * 5
    desk.screenshot(options.out / "2_face.png")

    drawn = vertices(name)
    keys["jaw_open"].value += 0.5
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


def leave(status: int) -> None:
    """Quit at once: a timer cannot pass an exit status on."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def main() -> None:
    options = arguments()
    result: dict = {"blender": bpy.app.version_string}
    bpy.context.preferences.view.show_splash = False
    bpy.ops.preferences.addon_enable(module="sketch_to_face")
    steps = session(options, result)

    def step() -> float:
        try:
            return next(steps)
        except StopIteration:
            (options.out / "result.json").write_text(json.dumps(result, indent=1))
            leave(0)
        except BaseException:
            traceback.print_exc()
            Desk().screenshot(options.out / "failed.png")
            leave(1)

    bpy.app.timers.register(step, first_interval=0.5)


main()
