"""The add-on as an artist meets it, in Blender without a window."""

from __future__ import annotations

import dataclasses
import re
import tomllib

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, TWELVE, FaceParameters  # noqa: E402
from facs_rig.blender.pose import is_face, refresh, set_pose  # noqa: E402
from snakes import Tweakables  # noqa: E402
from snakes.shape import OPENERS  # noqa: E402

from .conftest import ROOT  # noqa: E402


def press(sketch) -> set[str]:
    """The button, with an undo step as the button makes it."""
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    bpy.ops.ed.undo_push(message="sketch chosen")
    return bpy.ops.sketch_to_face.fit("EXEC_DEFAULT", True)


def everything() -> dict[str, list[str]]:
    """Names of all that a button could leave behind."""
    kinds = ("objects", "meshes", "materials", "armatures", "shape_keys")
    return {kind: sorted(d.name for d in getattr(bpy.data, kind)) for kind in kinds}


def error_of(operator, *args) -> str:
    """The one sentence that an operator reports."""
    with pytest.raises(RuntimeError) as caught:
        operator(*args)
    return str(caught.value).removeprefix("Error: ").strip()


def test_register_unregister_register():
    import addon.blender as module

    def ours():
        return [n for n in dir(bpy.types) if n.startswith("SKETCHTOFACE_")] + [
            n for n in dir(bpy.ops.sketch_to_face)
        ]

    before = ours()
    module.register()
    once = ours()
    assert len(once) > len(before)
    module.unregister()
    assert ours() == before
    assert not hasattr(bpy.types.Scene, "sketch_to_face")
    module.register()
    assert ours() == once
    module.unregister()


def test_versions_agree():
    import addon.blender as module

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert ".".join(map(str, module.bl_info["version"])) == project["version"]


def test_tweakables_are_the_core_s(shell):
    from addon.blender.state import properties

    group = bpy.context.scene.sketch_to_face.tweakables
    assert properties.tweakables(group) == Tweakables()
    for field in dataclasses.fields(Tweakables):
        shown = group.bl_rna.properties[field.name]
        assert shown.name == field.metadata["label"]
        assert shown.description.startswith(field.metadata["help"].rstrip("."))
        if field.metadata["choices"]:
            assert tuple(shown.enum_items.keys()) == field.metadata["choices"]
        elif not isinstance(field.default, bool):
            assert shown.hard_min == pytest.approx(field.metadata["minimum"])
            assert shown.hard_max == pytest.approx(field.metadata["maximum"])


def test_changed_tweakables_reach_the_core_and_defaults_come_back(shell):
    from addon.blender.state import properties

    group = bpy.context.scene.sketch_to_face.tweakables
    group.max_delta, group.snake_type, group.mirror = 7.3, "fixed", True
    wanted = Tweakables(max_delta=7.3, snake_type="fixed", mirror=True)
    assert properties.tweakables(group) == wanted
    bpy.ops.sketch_to_face.default_tweakables()
    assert properties.tweakables(group) == Tweakables()


def test_method_and_strokes_reach_the_core_and_defaults_come_back(shell):
    from addon import pipeline
    from addon.blender.state import properties

    def options() -> pipeline.FitOptions:
        return pipeline.FitOptions(**properties.fit_values(bpy.context))

    settings = bpy.context.scene.sketch_to_face
    assert options() == pipeline.FitOptions()
    settings.method, settings.strokes, settings.stroke_profile = "thesis", "emboss", "scar"
    settings.stroke_depth, settings.stroke_width = 0.7, 6.5
    wanted = pipeline.FitOptions(
        method="thesis", strokes="emboss", stroke_profile="scar", stroke_depth=0.7, stroke_width=6.5
    )
    assert options() == wanted
    bpy.ops.sketch_to_face.default_tweakables()
    assert options() == pipeline.FitOptions()


def test_button_builds_the_face_of_the_pipeline(shell, sketch, rig, evaluated):
    from addon import pipeline

    assert press(sketch) == {"FINISHED"}
    fit = pipeline.fit(sketch)
    face = bpy.context.active_object
    keys = face.data.shape_keys.key_blocks
    fitted = ["Fitted", *(key.name for key in fit.keys)]
    assert [k.name for k in keys] == ["Basis", *(k.name for k in rig.keys), *fitted]
    for name in CONTROL_NAMES:
        assert face[name] == fit.parameters.aus.get(name, 0.0)
    assert np.abs(evaluated(face) - fit.vertices).max() < 1e-5
    detections = face.sketch_to_face.detections
    assert set(detections.keys()) >= set(TWELVE)
    for item in detections:
        assert item.probability == pytest.approx(fit.detection.probabilities[item.name], abs=1e-6)
        assert item.active == (fit.parameters.aus.get(item.name, 0.0) > 0)
        if item.name not in OPENERS:  # a gap between the lips may open a mouth by itself
            assert item.active == fit.detection.active[item.name]


def test_slider_of_the_result_keeps_working(shell, sketch, rig, evaluated):
    from addon import pipeline

    press(sketch)
    fit = pipeline.fit(sketch)
    face = bpy.context.active_object
    face["jaw_open"] = 3.0
    refresh(face)
    aus = {**fit.parameters.aus, "jaw_open": 3.0}
    moved = dataclasses.replace(fit.parameters, aus=aus)
    assert np.abs(evaluated(face) - rig.pose(moved, fit.offsets)).max() < 1e-5


def test_one_undo_takes_everything_back_and_redo_brings_it_again(shell, sketch, evaluated):
    before = everything()
    press(sketch)
    name = bpy.context.active_object.name
    made, vertices = everything(), evaluated(bpy.context.active_object)
    assert made != before
    bpy.ops.ed.undo()
    assert everything() == before
    bpy.ops.ed.redo()
    assert everything() == made
    assert np.array_equal(evaluated(bpy.data.objects[name]), vertices)


def test_two_faces_do_not_disturb_each_other(shell, sketch, evaluated):
    press(sketch)
    first = bpy.context.active_object.name
    vertices = evaluated(bpy.data.objects[first])
    press(sketch)
    second = bpy.context.active_object
    assert second.name != first
    second["blink"] = 5.0
    refresh(second)
    assert np.abs(evaluated(second) - vertices).max() > 0.003
    assert np.array_equal(evaluated(bpy.data.objects[first]), vertices)


def test_reset_sliders_to_the_sketch_and_to_neutral(shell, sketch, rig, evaluated):
    press(sketch)
    face = bpy.context.active_object
    drawn = evaluated(face)
    set_pose(face, FaceParameters({"pucker": 10.0}, head=(0.2, 0.1, 0.0), gaze=(0.3, 0.0)))
    face.data.shape_keys.key_blocks["Fitted"].value = 0.0
    bpy.ops.sketch_to_face.reset_sliders(to="SKETCH", head=True)
    assert np.abs(evaluated(face) - drawn).max() < 1e-6
    bpy.ops.sketch_to_face.reset_sliders(to="NEUTRAL")
    assert face.data.shape_keys.key_blocks["Fitted"].value == 1.0
    assert not any(face[name] for name in CONTROL_NAMES)


def test_face_survives_save_and_reload(shell, sketch, evaluated, tmp_path):
    press(sketch)
    name, vertices = bpy.context.active_object.name, evaluated(bpy.context.active_object)
    file = str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    face = bpy.data.objects[name]
    assert np.array_equal(evaluated(face), vertices)
    assert is_face(face) and len(face.sketch_to_face.detections) >= 12
    bpy.ops.sketch_to_face.reset_sliders(to="NEUTRAL")


def test_panel_follows_the_mesh_and_its_rig(shell, sketch):
    from addon.blender.state import faces

    press(sketch)
    face = bpy.context.active_object
    assert faces.active_face(bpy.context) == face
    bpy.context.view_layer.objects.active = face.parent
    assert faces.active_face(bpy.context) == face
    bpy.ops.object.empty_add()
    assert faces.active_face(bpy.context) is None
    assert not bpy.ops.sketch_to_face.reset_sliders.poll()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "missing.png"),
        (b"this is not a picture", "broken.png"),
        (b"", "broken.png"),
    ],
)
def test_bad_sketch_is_one_sentence_and_leaves_nothing(shell, tmp_path, content, says):
    path = tmp_path / says
    if content is not None:
        path.write_bytes(content)
    before = everything()
    bpy.context.scene.sketch_to_face.sketch = str(path)
    sentence = error_of(bpy.ops.sketch_to_face.fit)
    assert says in sentence
    assert "\n" not in sentence and "Traceback" not in sentence
    assert everything() == before


def test_no_sketch_chosen(shell):
    assert re.match(r"No sketch is chosen", error_of(bpy.ops.sketch_to_face.fit))


def test_unexpected_error_goes_whole_to_the_log(shell, sketch, tmp_path, monkeypatch):
    from addon import pipeline
    from addon.blender.messages import reporting

    def broken(*_args, **_options):
        raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(pipeline, "fit", broken)
    monkeypatch.delenv(reporting.RAISE, raising=False)
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    sentence = error_of(bpy.ops.sketch_to_face.fit)
    assert "ZeroDivisionError" in sentence and "log.txt" in sentence
    assert "a fault of ours" in (tmp_path / "log.txt").read_text()
    assert "Traceback" in (tmp_path / "log.txt").read_text()


def test_button_leaves_edit_mode_by_itself(shell, rig, sketch):
    from facs_rig.blender import build_face

    face = build_face("Face", rig, FaceParameters())
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.mode_set(mode="EDIT")
    assert press(sketch) == {"FINISHED"}
    assert bpy.context.mode == "OBJECT"
    assert bpy.context.active_object.name == sketch.stem


def test_new_objects_go_to_the_scene_where_the_active_collection_is_of_another_file(
    shell, sketch, tmp_path
):
    file = str(tmp_path / "cast.blend")
    bpy.data.libraries.write(file, {bpy.data.collections.new("Cast")})
    with bpy.data.libraries.load(file, link=True) as (_, taken):
        taken.collections = ["Cast"]
    bpy.context.scene.collection.children.link(taken.collections[0])
    layers = bpy.context.view_layer
    layers.active_layer_collection = layers.layer_collection.children[0]
    assert bpy.context.collection.library is not None
    for make in (lambda: press(sketch), bpy.ops.mesh.add_facs_face,
                 bpy.ops.sketch_to_face.new_drawing):  # fmt: skip
        assert make() == {"FINISHED"}
        assert bpy.context.active_object.users_collection == (bpy.context.scene.collection,)


def test_head_placed_by_hand_reaches_the_core(shell):
    from addon.blender.state import properties
    from facs_rig.common.box import Box

    settings = bpy.context.scene.sketch_to_face
    assert properties.fit_values(bpy.context)["align"] is None
    settings.place_head, settings.head_box = True, (10, 20, 300, 400)
    assert properties.fit_values(bpy.context)["align"] == Box(10, 20, 300, 400)


def test_empty_head_box_is_one_sentence(shell, sketch):
    settings = bpy.context.scene.sketch_to_face
    settings.sketch, settings.place_head = str(sketch), True
    assert "is empty" in error_of(bpy.ops.sketch_to_face.fit)
