"""Hands in Blender's real window: mouse, keys, screenshots. Shared by the scripts beside it."""

import argparse
import json
import os
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

FRAME = 0.1  # seconds between the steps of a person in a hurry
PATIENCE = 120.0
# Pixels between the places at which a button is felt for; the second time for a machine that was
# busy with something else.
APART = (12, 7)


class Desk:
    """The window, its 3D view, and hands to use them. Positions are window pixels from below."""

    scale = 1.0  # of the window and all that is in it; see `main`

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


class Deaf:
    """How long an operator keeps Blender from hearing anything: the longest of its slices."""

    def __init__(self, operator: type) -> None:
        self.longest = 0.0
        self._operator, self._modal = operator, operator._advance
        modal = self._modal

        def timed(self_, context):
            start = time.perf_counter()
            try:
                return modal(self_, context)
            finally:
                self.longest = max(self.longest, time.perf_counter() - start)

        operator._advance = timed

    def stop(self) -> float:
        self._operator._advance = self._modal
        return self.longest


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
    x = region.x + region.width - 10 * desk.scale
    for number in range(20):
        below = (20 + 25 * number) * desk.scale
        y = region.y + region.height - below
        desk.move(x, y)
        yield FRAME
        desk.tap("LEFTMOUSE", x, y)
        yield FRAME * 2
        if drawn:
            break
    bpy.types.SKETCHTOFACE_PT_sketch.remove(notice)
    assert drawn, "the sidebar has no tab that draws our panel"


def find_button(desk: Desk, command: str, found: list, across: float = 0.45):
    """Feel down the sidebar for the button: Ctrl C over a button copies its Python command.

    `across` says how far from the sidebar's left to the right, 0 to 1, to feel.
    """
    place: list = []
    for apart in APART:
        yield from feel(desk, command, place, across, apart, ctrl=True)
        if place:
            break
    if not place:
        raise AssertionError(f"no button in the sidebar does {command}")
    found += place


def reach_button(desk: Desk, command: str, found: list, across: float = 0.45):
    """`find_button`, scrolling down from the top as far as it takes."""
    place: list = []
    for apart in APART:
        yield from scroll(desk, -30)
        for _ in range(6):
            yield from feel(desk, command, place, across, apart, ctrl=True)
            if place:
                found += place
                return
            yield from scroll(desk, 5)
    raise AssertionError(f"no button in the whole sidebar does {command}")


def find_slider(desk: Desk, path: str, found: list):
    """Feel down the sidebar for a slider: Shift Ctrl C over one copies its data path."""
    place: list = []
    yield from feel(desk, path, place, 0.45, 8, ctrl=True, shift=True)
    if not place:
        raise AssertionError(f"no slider in the sidebar shows {path}")
    found += place


def feel(desk: Desk, wanted: str, found: list, across: float, apart: float, **held):
    """Go down the sidebar, at places so many pixels `apart`, until C copies what is wanted.

    One frame for each place: drawing the sidebar anew is what takes the time. What is copied may
    come a frame late, so a find is asked once more.
    """
    region = desk.region("UI")
    manager = bpy.context.window_manager
    x = region.x + region.width * across

    def copied(y: float, patience: float):
        manager.clipboard = ""
        desk.move(x, y)
        desk.tap("C", x, y, **held)
        yield patience
        return manager.clipboard.strip() == wanted

    apart *= desk.scale
    for number in range(int((region.height - 20 * desk.scale) / apart)):
        y = region.y + region.height - 20 * desk.scale - number * apart
        if not (yield from copied(y, 0.02)):
            continue
        for near in (y, y + apart):
            if (yield from copied(near, FRAME)):
                found.append((x, near))
                return


def write(desk: Desk, place: tuple[float, float], text: str):
    """Double-click into a text field, replace what is in it, Enter."""
    x, y = place
    desk.move(x - 3, y)
    yield FRAME
    desk.move(x, y)
    yield FRAME
    desk.tap("LEFTMOUSE", x, y)
    yield 0.03
    desk.tap("LEFTMOUSE", x, y)
    yield FRAME * 3
    desk.tap("A", x, y, ctrl=True)
    yield FRAME
    for letter in text:
        desk.window.event_simulate(type="A", value="PRESS", unicode=letter, x=int(x), y=int(y))
        desk.window.event_simulate(type="A", value="RELEASE", x=int(x), y=int(y))
        yield 0.01
    yield FRAME
    desk.tap("RET", x, y)
    yield FRAME * 3


def unfold(desk: Desk, **folded: bool):
    """Register panels once more, folded or not: `unfold(desk, SKETCHTOFACE_PT_fit=False)`."""
    for name, closed in folded.items():
        panel = getattr(bpy.types, name)
        children = [
            c for c in bpy.types.Panel.__subclasses__() if getattr(c, "bl_parent_id", "") == name
        ]
        for cls in (*children, panel):
            bpy.utils.unregister_class(cls)
        panel.bl_options = {"DEFAULT_CLOSED"} if closed else set()
        for cls in (panel, *children):
            bpy.utils.register_class(cls)
    desk.area.tag_redraw()
    yield FRAME * 3


def press(desk: Desk, place: tuple[float, float]):
    """Go to a button, let it notice, click."""
    x, y = place
    desk.move(x - 3, y)
    yield FRAME
    desk.move(x, y)
    yield FRAME
    desk.tap("LEFTMOUSE", x, y)
    yield FRAME * 4


def scroll(desk: Desk, notches: int):
    """Turn the mouse wheel over the sidebar: down, or up if `notches` is negative."""
    place = desk.middle("UI")
    desk.move(*place)
    yield FRAME
    wheel = "WHEELDOWNMOUSE" if notches > 0 else "WHEELUPMOUSE"
    for _ in range(abs(notches)):  # all at once, so that the sidebar is drawn once
        desk.window.event_simulate(type=wheel, value="PRESS", x=int(place[0]), y=int(place[1]))
    yield FRAME * 3


def drag(desk: Desk, place: tuple[float, float], way: int):
    """Press on a slider, pull it `way` pixels to the right, let go."""
    x, y = place
    desk.window.event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x), y=int(y))
    for step in range(1, 6):
        yield 0.05
        desk.move(x + way * step / 5, y)
    yield FRAME
    desk.window.event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x + way), y=int(y))
    yield FRAME * 10


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
    yield FRAME * 3
    if desk.scale == 1.0:
        bpy.context.preferences.system.viewport_aa = "8"
        yield 6.0  # until the last of the frames that smooth it


def zoom(desk: Desk, factor: float) -> None:
    """How large Blender writes, in a window of full size."""
    bpy.context.preferences.view.ui_scale = factor * desk.scale


def clear(desk: Desk):
    """Away with the cube of a new file."""
    yield 1.0
    with desk.context():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.data.objects["Cube"].select_set(True)
        bpy.ops.object.delete()
    yield FRAME


def leave(status: int) -> None:
    """Quit at once: a timer cannot pass an exit status on."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def main(session) -> None:
    """Run the steps of `session(options, result)`, then write what it found, or fail loudly."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sketch", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--picture", type=Path)
    # A small window is drawn in half the time; a picture for the documentation has a large one.
    parser.add_argument("--scale", type=float, default=1.0)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    result: dict = {"blender": bpy.app.version_string}
    Desk.scale = options.scale
    zoom(Desk(), 1.0)
    bpy.context.preferences.view.show_splash = False
    # The processor draws: a view that is smoothed over sixteen frames would be all it does.
    bpy.context.preferences.system.viewport_aa = "OFF"
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

    bpy.app.timers.register(step, first_interval=0.5, persistent=True)
