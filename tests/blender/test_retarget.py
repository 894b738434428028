"""Expressions on meshes with other rigs' shape keys, in Blender without a window."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import ARKIT_NAMES, CONTROL_NAMES, FaceParameters  # noqa: E402
from facs_rig.blender.pose import pose_of, set_pose  # noqa: E402
from facs_rig.conventions import CONVENTIONS  # noqa: E402
from facs_rig.retarget import retarget  # noqa: E402

from .rigs import curves_of, error_of, keyed, mesh, select, values, wanted  # noqa: E402

AUS = {"smile_left": 4.0, "frontalis": 2.5, "jaw_open": 5.0}


def apply(**options):
    """The button, with an undo step as the button makes it."""
    return bpy.ops.sketch_to_face.apply_expression("EXEC_DEFAULT", True, **options)


@pytest.fixture
def face(shell):
    """A face without identity keys that wears AUS."""
    bpy.ops.mesh.add_facs_face(identity_keys=False)
    made = bpy.context.active_object
    set_pose(made, FaceParameters(AUS, head=(0.2, 0.0, 0.0), gaze=(0.1, 0.0)))
    return made


# --- from a face ----------------------------------------------------------------------------------


def test_face_gives_its_expression_to_meshes_of_several_conventions(face, reports):
    names = {
        "arkit": [f"head_{name}" for name in ARKIT_NAMES],
        "metahuman": list(CONVENTIONS["metahuman"].keys),
        "vrm1": list(CONVENTIONS["vrm1"].keys),
        "ours": list(CONTROL_NAMES),
    }
    made = {name: mesh(name, keys) for name, keys in names.items()}
    made["arkit"].data.shape_keys.key_blocks["head_mouthFrownLeft"].value = 0.7  # old news
    made["arkit"].data.shape_keys.key_blocks["head_eyeLookUpLeft"].value = 0.3  # not ours to touch
    select(face, *made.values())
    reports()
    assert apply() == {"FINISHED"}
    said = reports()
    assert "Expression applied to" in said and "head_" not in said
    for name in ("metahuman", "vrm1", "ours"):
        assert values(name) == wanted(AUS, name)
    plain = {key.removeprefix("head_"): value for key, value in values("arkit").items()}
    assert plain.pop("eyeLookUpLeft") == pytest.approx(0.3)
    assert plain == wanted(AUS, "arkit")
    assert not keyed("arkit")


def test_undo_and_redo(face):
    target = mesh("Head")
    select(face, target)
    apply()
    assert values("Head") == wanted(AUS, "arkit")
    bpy.ops.ed.undo()
    assert values("Head") == {}
    bpy.ops.ed.redo()
    assert values("Head") == wanted(AUS, "arkit")


def test_keyframes_go_to_the_current_frame(face):
    target = mesh("Head")
    bpy.context.scene.frame_set(12)
    select(face, target)
    apply(keyframes=True)
    found = keyed("Head")
    assert set(found) == set(CONVENTIONS["arkit"].keys)
    for key, value in retarget(AUS, "arkit").items():
        assert found[key] == [(12.0, pytest.approx(value, abs=1e-6))]


def test_a_face_takes_the_expression_of_another_and_keeps_head_and_eyes(face):
    bpy.ops.mesh.add_facs_face(identity_keys=False)
    other = bpy.context.active_object
    set_pose(other, FaceParameters({"wince": 5.0}, head=(-0.3, 0, 0), gaze=(0, 0.2)))
    select(face, other)
    apply(keyframes=True)
    told = pose_of(other)
    assert dict(told.aus) == AUS
    assert told.head == pytest.approx((-0.3, 0, 0)) and told.gaze == pytest.approx((0, 0.2))
    curves = {c.data_path for c in curves_of(other.animation_data.action)}
    assert '["smile_left"]' in curves and '["wince"]' in curves
    assert dict(pose_of(face).aus) == AUS


def test_which_face_gives(face, sketch):
    from addon.blender.operators import retarget

    target = mesh("Head")
    select(target)
    assert retarget.giver(bpy.context) == face  # the only one
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    bpy.ops.sketch_to_face.fit()
    first = bpy.context.active_object
    bpy.ops.sketch_to_face.fit()
    second = bpy.context.active_object
    select(target)
    assert retarget.giver(bpy.context) == second  # made last
    select(target, first)
    assert retarget.giver(bpy.context) == first  # selected
    select(target, first, active=face)
    assert retarget.giver(bpy.context) == face  # active
    bpy.data.objects.remove(second)
    select(target)
    assert retarget.giver(bpy.context) == first


def test_without_a_face_one_sentence_says_what_to_do(shell):
    select(mesh("Head"))
    assert "no face to take the expression from" in error_of(apply)
    for _ in range(2):
        bpy.ops.mesh.add_facs_face(identity_keys=False)
    select(bpy.data.objects["Head"])
    assert "not clear which face" in error_of(apply)


# --- what does not fit ----------------------------------------------------------------------------


def test_what_was_not_found_is_reported(face, reports):
    set_pose(face, FaceParameters({"smile": 5.0, "nostril_flare": 5.0, "jaw_open": 2.0}))
    teeth, head = mesh("Teeth", ["jawOpen"]), mesh("Head")
    select(face, teeth, head, mesh("Hat", None))
    reports()
    assert apply() == {"FINISHED"}
    said = reports()
    assert "no key was found for nostril_flare" in said and "smile" not in said
    assert "'Hat' has no shape keys" in said
    assert values("Teeth") == pytest.approx({"jawOpen": 0.28})


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: mesh("Head", None), "'Head' has no shape keys"),
        (lambda: mesh("Head", ["bulge", "Key 1"]), "'Head' cannot wear an expression: none of its"),
        (
            lambda: mesh("Head", ["a_jawOpen", "b_jawOpen"]),
            "'a_jawOpen' and 'b_jawOpen' could all be",
        ),
    ],
)
def test_a_mesh_that_cannot_wear_it_is_one_sentence(face, make, says):
    select(face, make())
    assert says in error_of(apply)


def test_only_the_face_itself_is_selected(face):
    select(face)
    assert f"besides '{face.name}'" in error_of(apply)


def test_driven_keys_are_left_alone_and_told(face, reports):
    target = mesh("Head")
    blocks = target.data.shape_keys.key_blocks
    blocks["jawOpen"].driver_add("value").driver.expression = "0.25"
    bpy.context.view_layer.update()
    select(face, target)
    reports()
    apply(keyframes=True)
    assert "driven by something else: jawOpen" in reports()
    assert "jawOpen" not in keyed("Head")
    bpy.context.view_layer.update()
    assert values("Head")["jawOpen"] == pytest.approx(0.25)
    for name in ARKIT_NAMES:
        blocks[name].driver_add("value")
    assert "every shape key of 'Head' is driven" in error_of(apply).replace("Every", "every")


def test_objects_that_share_a_mesh_are_set_once(face, reports):
    target = mesh("Head")
    twin = target.copy()
    bpy.context.collection.objects.link(twin)
    select(face, target, twin)
    reports()
    apply()
    assert reports().count("(ARKit") == 1
    assert values("Head") == values(twin.name) == wanted(AUS, "arkit")


def test_linked_meshes_are_refused_until_they_are_overridden(face, tmp_path):
    library = str(tmp_path / "library.blend")
    bpy.data.libraries.write(library, {mesh("Linked")})
    bpy.data.objects.remove(bpy.data.objects["Linked"])
    bpy.data.meshes.remove(bpy.data.meshes["Linked"])
    with bpy.data.libraries.load(library, link=True) as (_, wished):
        wished.objects = ["Linked"]
    linked = wished.objects[0]
    bpy.context.collection.objects.link(linked)
    select(face, linked)
    assert "'Linked' is linked from 'library.blend': make it local" in error_of(apply)
    assert values("Linked") == {}
    own = linked.override_create(remap_local_usages=True)
    own.data = linked.data.override_create(remap_local_usages=True)
    select(face, own)
    assert apply() == {"FINISHED"}
    blocks = own.data.shape_keys.key_blocks
    assert blocks["jawOpen"].value == pytest.approx(0.7)


def test_buttons_wait_for_object_mode_and_meshes(face):
    target = mesh("Head")
    select(target)
    operators = (bpy.ops.sketch_to_face.apply_expression, bpy.ops.sketch_to_face.storyboard)
    assert all(operator.poll() for operator in operators)
    bpy.ops.object.mode_set(mode="EDIT")
    assert not any(operator.poll() for operator in operators)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.object.select_all(action="DESELECT")
    assert not any(operator.poll() for operator in operators)


# --- from a sketch --------------------------------------------------------------------------------


def test_sketch_goes_onto_a_mesh_without_building_a_face(shell, sketch):
    from addon import pipeline

    target = mesh("Head")
    select(target)
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    assert apply(source="SKETCH") == {"FINISHED"}
    assert values("Head") == wanted(pipeline.read_expression(sketch).aus, "arkit")
    assert [o.name for o in bpy.data.objects] == ["Head"]


def test_bad_sketch_is_one_sentence_and_changes_nothing(shell, tmp_path):
    select(mesh("Head"))
    assert "No sketch is chosen" in error_of(apply, source="SKETCH")
    (tmp_path / "broken.png").write_bytes(b"")
    bpy.context.scene.sketch_to_face.sketch = str(tmp_path / "broken.png")
    assert "broken.png" in error_of(apply, source="SKETCH")
    assert values("Head") == {}


# --- the panel ------------------------------------------------------------------------------------


def test_the_panel_draws(shell):
    from addon.blender.panels import retarget

    drawn = []

    class Layout:
        def column(self, **_options):
            return self

        row = column

        def label(self, **_options):
            pass

        def prop(self, owner, name, **_options):
            owner.path_resolve(name)
            drawn.append(name)

        def operator(self, name, **_options):
            drawn.append(getattr(bpy.ops.sketch_to_face, name.partition(".")[2]).idname_py())
            return SimpleNamespace()

    panel = retarget.SKETCHTOFACE_PT_retarget
    panel.draw(SimpleNamespace(layout=Layout()), bpy.context)
    assert drawn == ["sketch_to_face.apply_expression"] * 2 + [
        "storyboard", "storyboard_every", "sketch_to_face.storyboard",
    ]  # fmt: skip
