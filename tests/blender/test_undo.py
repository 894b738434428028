"""Every button that changes something is taken back by one undo, and brought again by a redo."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters, expressions  # noqa: E402
from facs_rig.blender_pose import is_face  # noqa: E402

from .conftest import ROOT, SKETCH  # noqa: E402
from .test_shell import press  # noqa: E402

ANGRY = ROOT / "addon" / "sketches" / "angry_man.png"
POUTING = expressions.dumps(FaceParameters({"pucker": 4.0}))
# Operator -> what it is given, where it needs something; None where it needs the mouse.
GIVEN: dict[str, dict | None] = {
    "mesh.add_facs_face": {},
    "sketch_to_face.adopt_sketch": {},
    "sketch_to_face.apply_expression": {"source": "SKETCH"},
    "sketch_to_face.decide": {"name": "smile", "decision": "REJECT"},
    "sketch_to_face.default_tweakables": {},
    "sketch_to_face.drag_pins": None,  # the test of the real window drags
    "sketch_to_face.fit": {},
    "sketch_to_face.fit_again": {},
    "sketch_to_face.key_expression": {},
    "sketch_to_face.load_expression": {"filepath": "kept.face.json"},
    "sketch_to_face.mirror_expression": {},
    "sketch_to_face.new_drawing": {},
    "sketch_to_face.paste_expression": {"text": POUTING},
    "sketch_to_face.pin": {"name": "chin", "place": (300, 700)},
    "sketch_to_face.plain_person": {},
    "sketch_to_face.random_expression": {"seed": 3},
    "sketch_to_face.random_person": {"seed": 3},
    "sketch_to_face.reset_sliders": {"to": "NEUTRAL"},
    "sketch_to_face.storyboard": {},
    "sketch_to_face.unlock_all": {},
    "sketch_to_face.unpin": {"name": ""},
}


def undoable() -> list[str]:
    """Every operator of ours that makes an undo step."""
    import addon.blender as shell

    classes = [cls for module in shell._MODULES for cls in getattr(module, "CLASSES", ())]
    return sorted(
        cls.bl_idname
        for cls in classes
        if issubclass(cls, bpy.types.Operator) and "UNDO" in cls.bl_options
    )


def state(evaluated) -> dict:
    """All that a button can change and an artist can see, names before shapes."""
    seen: dict = {"objects": sorted(o.name for o in bpy.data.objects)}
    settings = bpy.context.scene.sketch_to_face
    seen["scene"] = (settings.method, settings.sketch, settings.sketch_kind)
    for thing in bpy.data.objects:
        animated = thing.animation_data is not None and thing.animation_data.action is not None
        seen[thing.name] = [animated]
        keys = getattr(thing.data, "shape_keys", None)
        if keys is not None and not is_face(thing):
            seen[thing.name] += [block.value for block in keys.key_blocks]
        if is_face(thing):
            memory = thing.sketch_to_face
            seen[thing.name] += [
                memory.sketch,
                [(i.name, i.active, i.intensity, i.locked) for i in memory.detections],
                [(pin.name, tuple(pin.place)) for pin in memory.pins],
                evaluated(thing).tobytes(),
            ]
    return seen


def test_no_operator_is_forgotten():
    assert undoable() == sorted(GIVEN)


@pytest.mark.parametrize("name", [name for name, given in GIVEN.items() if given is not None])
def test_one_undo_takes_it_back_and_redo_brings_it_again(shell, name, evaluated, tmp_path):
    press(SKETCH)
    face = bpy.context.active_object
    face.sketch_to_face.detections["jaw_open"].locked = True
    bpy.ops.sketch_to_face.pin(name="nose_tip", place=(310, 480))
    data = bpy.data.meshes.new("Other")
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    other = bpy.data.objects.new("Other", data)
    bpy.context.scene.collection.objects.link(other)
    for key in ("Basis", "browDownLeft", "browDownRight", "jawOpen"):
        other.shape_key_add(name=key, from_mix=False).value = 0.0
    other.select_set(True)
    settings = bpy.context.scene.sketch_to_face
    settings.sketch, settings.method = str(ANGRY), "shape"
    if name == "sketch_to_face.fit_again":
        bpy.ops.sketch_to_face.adopt_sketch()
    (tmp_path / "board").mkdir()
    shutil.copy(ANGRY, tmp_path / "board")
    settings.storyboard = str(tmp_path / "board")
    given = dict(GIVEN[name])
    if "filepath" in given:
        given["filepath"] = str(tmp_path / given["filepath"])
        (tmp_path / "kept.face.json").write_text(POUTING)
    bpy.context.view_layer.update()
    bpy.ops.ed.undo_push(message="before")
    before = state(evaluated)
    folder, _, stem = name.partition(".")
    assert getattr(getattr(bpy.ops, folder), stem)("EXEC_DEFAULT", True, **given) == {"FINISHED"}
    after = state(evaluated)
    assert after != before, "it changes nothing that this test can see"
    bpy.ops.ed.undo()
    assert state(evaluated) == before
    bpy.ops.ed.redo()
    assert state(evaluated) == after
    assert np.isfinite(np.frombuffer(after[SKETCH.stem][-1], np.float32)).all()
