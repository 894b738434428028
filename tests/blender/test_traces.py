"""What the add-on leaves behind: nothing once it is switched off, and a way back after each button.

The second half holds the undo of every operator: one that is new fails here until it has a line in
PRESSED.
"""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.blender.background import live  # noqa: E402
from addon.blender.messages import reporting  # noqa: E402
from addon.blender.operators import detect  # noqa: E402
from addon.blender.panels import sketch as sketch_panel  # noqa: E402
from addon.blender.state.session import Session, session  # noqa: E402
from addon.blender.viewport import overlay  # noqa: E402
from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender.pose import is_face  # noqa: E402
from facs_rig.expressions import dumps, write  # noqa: E402

from .conftest import ROOT  # noqa: E402
from .test_shell import everything  # noqa: E402

OTHER = ROOT / "addon" / "sketches" / "angry_man.png"
ops = bpy.ops.sketch_to_face


# --- switched off ---------------------------------------------------------------------------------


def traces() -> dict[str, list]:
    """All places in Blender that an add-on can hang itself on, and what hangs there."""
    handlers = bpy.app.handlers
    told = {
        f"handlers.{name}": list(getattr(handlers, name))
        for name in dir(handlers)
        if isinstance(getattr(handlers, name), list)
    }
    classes = [n for n in dir(bpy.types) if isinstance(getattr(bpy.types, n), type)]
    told["classes"] = classes
    # of data-blocks as they are kept: whatever is hung on one of them is there in all of its kind
    for name in classes:
        kind = getattr(bpy.types, name)
        if issubclass(kind, bpy.types.ID | bpy.types.WindowManager):
            told[f"types.{name}"] = [n for n in dir(kind) if not n.startswith("_")]
        drawn = getattr(getattr(kind, "draw", None), "_draw_funcs", ())
        told[f"drawn by {name}"] = [f for f in drawn if "addon" in f.__module__]
    told["operators"] = dir(bpy.ops.sketch_to_face)
    told["timers"] = [
        timer.__name__
        for timer in (live.watch, overlay._again)
        if bpy.app.timers.is_registered(timer)
    ]
    told["kept"] = [
        *(name for name, value in vars(session).items() if value != getattr(Session(), name)),
        *reporting._log.handlers,
    ]
    return told


def test_nothing_is_left_once_the_add_on_is_switched_off(sketch, tmp_path, monkeypatch):
    import addon.blender as module

    monkeypatch.setattr(reporting, "log_path", lambda: tmp_path / "log.txt")
    before, once = traces(), None
    for _ in range(3):
        module.register()
        try:
            assert session.draw_handler is not None and session.thumbnails is not None
            on = {k: v for k, v in traces().items() if k != "kept"}
            assert on["timers"] == ["watch"] and (once or on) == on
            once = on
            use(sketch)
        finally:
            module.unregister()
        after = traces()
        assert {k: v for k, v in after.items() if v != before.get(k, [])} == {}


def use(sketch) -> None:
    """Something of everything that keeps something: a thumbnail, evidence, a live face, a log."""
    settings = bpy.context.scene.sketch_to_face
    settings.sketch = str(sketch)
    assert ops.fit() == {"FINISHED"}
    face = bpy.context.active_object
    sketch_panel.thumbnail(settings)  # without a window it has no icon, but is kept all the same
    assert len(session.thumbnails)
    detect.keep("mark", {"smile": np.zeros((384, 384, 4), np.float32)})
    detect.picture("mark", "smile")
    assert len(session.evidence_icons)
    overlay.look(bpy.context, face)
    assert bpy.app.timers.is_registered(overlay._again)
    face.sketch_to_face.live = True
    face.sketch_to_face.sketch = "//nowhere.png"
    live.watch()
    live.wait()
    assert session.troubles
    try:
        raise ZeroDivisionError
    except ZeroDivisionError:
        reporting.log("A test")


def test_switched_off_while_a_live_face_is_fitted(sketch, evaluated):
    import addon.blender as module

    module.register()
    try:
        bpy.context.scene.sketch_to_face.sketch = str(sketch)
        ops.fit()
        face = bpy.context.active_object
        before = evaluated(face)
        face.sketch_to_face.live, face.sketch_to_face.sketch = True, str(OTHER)
        live.watch()
        assert session.refit is not None
    finally:
        module.unregister()
    end = time.monotonic() + 20
    while any(t.name == "Sketch to Face" for t in threading.enumerate()):
        assert time.monotonic() < end, "a thread is still at work"
        time.sleep(0.01)
    assert np.array_equal(evaluated(face), before)
    assert session.refit is None


# --- undo and redo --------------------------------------------------------------------------------


def whole() -> dict[str, object]:
    """What undo has to bring back: names, evaluated vertices, sliders, bones, decisions, keys."""
    settings = bpy.context.scene.sketch_to_face
    state: dict[str, object] = {"names": everything(), "pens": sorted(
        o.name for o in bpy.data.objects if o.type.startswith("G"))}  # fmt: skip
    state["scene"] = kept(settings) | {"tweakables": kept(settings.tweakables)}
    graph = bpy.context.evaluated_depsgraph_get()
    for thing in bpy.context.scene.objects:
        state[f"{thing.name} is keyed"] = keyframes(thing)
        if thing.type == "ARMATURE":
            state[f"{thing.name} stands"] = [
                (b.name, tuple(b.location), tuple(b.rotation_quaternion), tuple(b.rotation_euler))
                for b in thing.pose.bones
            ]
        if thing.type != "MESH":
            continue
        mesh = thing.evaluated_get(graph).data
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        state[f"{thing.name} is"] = points.tobytes()
        blocks = thing.data.shape_keys.key_blocks if thing.data.shape_keys else ()
        state[f"{thing.name} wears"] = [(key.name, key.value) for key in blocks]
        if is_face(thing):
            memory = thing.sketch_to_face
            state[f"{thing.name} does"] = {
                k: v for k, v in thing.items() if isinstance(v, int | float | str)
            }
            state[f"{thing.name} is who"] = dict(thing["facs_identity"])
            state[f"{thing.name} knows"] = kept(memory) | {
                "read": [kept(item) for item in memory.detections],
                "pins": [(pin.name, tuple(pin.place)) for pin in memory.pins],
            }
    return state


def kept(group) -> dict[str, object]:
    """The plain values of a property group."""
    out: dict[str, object] = {}
    for rna in group.bl_rna.properties:
        value = getattr(group, rna.identifier)
        if rna.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}:
            out[rna.identifier] = tuple(value) if getattr(rna, "is_array", False) else value
        elif rna.type == "POINTER" and isinstance(value, bpy.types.ID):
            out[rna.identifier] = value.name
    return out


def keyframes(thing) -> list[tuple]:
    """Paths and points of all that is animated on an object and on its shape keys."""
    from .rigs import keyed

    on_keys = keyed(thing.name) if thing.type == "MESH" and thing.data.shape_keys else {}
    action = thing.animation_data.action if thing.animation_data else None
    return [sorted(on_keys.items()), action.name if action else None]


def expression_file(tmp_path) -> str:
    write(tmp_path / "pucker.json", FaceParameters({"pucker": 4.0}, head=(0.2, 0.0, 0.0)))
    return str(tmp_path / "pucker.json")


def another_sketch(_tmp_path) -> dict:
    bpy.context.active_object.sketch_to_face.sketch = str(OTHER)
    return {}


def chosen_sketch(_tmp_path) -> dict:
    bpy.context.scene.sketch_to_face.sketch = str(OTHER)
    return {}


def other_settings(_tmp_path) -> dict:
    settings = bpy.context.scene.sketch_to_face
    settings.method, settings.tweakables.mirror = "shape", True
    return {}


def folder_of_sketches(tmp_path) -> dict:
    shutil.copy(OTHER, tmp_path / "1.png")
    bpy.context.scene.sketch_to_face.storyboard = str(tmp_path)
    return {}


def linked_duplicate(_tmp_path) -> dict:
    face = bpy.context.active_object
    bpy.context.view_layer.objects["Other"].select_set(False)
    face.parent.select_set(True)
    bpy.ops.object.duplicate(linked=True)
    bpy.context.view_layer.objects.active = next(
        o for o in bpy.context.selected_objects if is_face(o)
    )
    return {}


# Of every operator that promises undo: its arguments, or what has to be done before it is pressed.
def own_creases(where) -> dict:
    """The face has creases of its own, to be taken back."""
    ops.new_creases(seed=2)
    return {}


PRESSED: dict[str, dict | Callable] = {
    "mesh.add_facs_face": {"random_identity": True},
    "sketch_to_face.adopt_sketch": chosen_sketch,
    "sketch_to_face.apply_expression": {"keyframes": True},
    "sketch_to_face.decide": {"name": "smile", "decision": "REJECT"},
    "sketch_to_face.default_tweakables": other_settings,
    "sketch_to_face.fit": {},
    "sketch_to_face.fit_again": another_sketch,
    "sketch_to_face.hair": {"kind": "surface"},
    "sketch_to_face.hair_preset": {"preset": "bob"},
    "sketch_to_face.beard": {"kind": "GOATEE"},
    "sketch_to_face.key_expression": {},
    "sketch_to_face.load_expression": lambda where: {"filepath": expression_file(where)},
    "sketch_to_face.mirror_expression": {},
    "sketch_to_face.new_creases": {"seed": 3},
    "sketch_to_face.new_drawing": {},
    "sketch_to_face.paste_expression": {"text": dumps(FaceParameters({"pucker": 4.0}))},
    "sketch_to_face.pin": {"name": "chin", "place": (150.0, 310.0)},
    "sketch_to_face.plain_creases": own_creases,
    "sketch_to_face.plain_person": {},
    "sketch_to_face.random_expression": {"seed": 3},
    "sketch_to_face.random_person": {"seed": 3},
    "sketch_to_face.reset_sliders": {"to": "NEUTRAL", "head": True},
    "sketch_to_face.stylised_person": {"style": "MANGA"},
    "sketch_to_face.stand_alone": linked_duplicate,
    "sketch_to_face.storyboard": folder_of_sketches,
    "sketch_to_face.try_sample": {"drawing": "angry_man"},
    "sketch_to_face.unlock_all": {},
    "sketch_to_face.unpin": {"name": ""},
}
# Needs a mouse, and what it does with it is tested with a window (tests/blender/window).
BY_MOUSE = {"sketch_to_face.drag_pins"}


def test_every_operator_that_promises_undo_is_pressed_here(shell):
    ours = [
        kind
        for kind in (getattr(bpy.types, name) for name in dir(bpy.types))
        if isinstance(kind, type)
        and issubclass(kind, bpy.types.Operator)
        and kind.__module__.startswith(shell.__name__)
    ]
    assert len(ours) > len(PRESSED)
    promise = {kind.bl_idname for kind in ours if "UNDO" in kind.bl_options}
    names = {name.lower().replace("_ot_", ".", 1) for name in promise}
    assert names == PRESSED.keys() | BY_MOUSE


@pytest.fixture
def furnished(shell, sketch, kept):
    """A fitted face that does something everywhere, and a mesh with keys of ARKit's, selected."""
    return kept("furnished", lambda: furnish(sketch))


def furnish(sketch) -> None:
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    ops.fit()
    face = bpy.context.active_object
    face["smile_left"], face["gaze_yaw"] = 2.0, 10.0
    face.sketch_to_face.detections["jaw_open"].intensity = 3.0
    ops.pin(name="nose_tip", place=(384.0, 400.0))
    data = bpy.data.meshes.new("Other")
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    other = bpy.data.objects.new("Other", data)
    bpy.context.scene.collection.objects.link(other)
    for name in ("Basis", "mouthSmileLeft", "jawOpen"):
        other.shape_key_add(name=name, from_mix=False)
    other.data.shape_keys.key_blocks["jawOpen"].data[0].co.z = -1.0
    other.select_set(True)


@pytest.mark.parametrize("name", PRESSED)
def test_undo_and_redo_of(name, furnished, tmp_path):
    asks = PRESSED[name]
    given = asks(tmp_path) if callable(asks) else asks
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="before")
    states = [whole()]
    module, operator = name.split(".")
    assert getattr(getattr(bpy.ops, module), operator)("EXEC_DEFAULT", True, **given) == {
        "FINISHED"
    }
    states.append(whole())
    for step in (bpy.ops.ed.undo, bpy.ops.ed.redo, bpy.ops.ed.undo, bpy.ops.ed.redo):
        assert step() == {"FINISHED"}
        states.append(whole())
    before, after = states[:2]
    assert changed(before, after)
    for number, state in enumerate(states):
        assert changed(state, (before, after)[number % 2]) == [], f"state {number} of {name}"


def changed(one: dict, other: dict) -> list[str]:
    """Of what the two states differ."""
    return [what for what in {**one, **other} if one.get(what) != other.get(what)]
