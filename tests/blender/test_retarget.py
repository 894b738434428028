"""Expressions on meshes with other rigs' shape keys, in Blender without a window."""

from __future__ import annotations

import re
import shutil
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import ARKIT_NAMES, CONTROL_NAMES, FaceParameters  # noqa: E402
from facs_rig.blender_pose import pose_of, set_pose  # noqa: E402
from facs_rig.conventions import CONVENTIONS  # noqa: E402
from facs_rig.retarget import retarget  # noqa: E402

from .conftest import SKETCH  # noqa: E402

AUS = {"smile_left": 4.0, "frontalis": 2.5, "jaw_open": 5.0}
SKETCHES = SKETCH.parent


def mesh(name: str, keys=ARKIT_NAMES):
    """A triangle with shape keys of these names, linked to the scene, not selected."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    for key in ("Basis", *keys) if keys else ():
        made.shape_key_add(name=key, from_mix=False).value = 0.0
    return made


def select(*objects, active=None) -> None:
    """Exactly these, the first one active unless another is named; remembered by undo."""
    bpy.context.view_layer.update()
    for each in bpy.context.view_layer.objects:
        each.select_set(each in objects)
    bpy.context.view_layer.objects.active = active or objects[0]
    bpy.ops.ed.undo_push(message="selected")


def values(name: str) -> dict[str, float]:
    """The shape keys of a mesh that are not at rest."""
    blocks = bpy.data.objects[name].data.shape_keys.key_blocks
    return {block.name: block.value for block in blocks if block.value}


def wanted(aus, convention: str) -> dict[str, float]:
    """The keys that the core computes, without those at rest."""
    return pytest.approx({k: v for k, v in retarget(aus, convention).items() if v}, abs=1e-6)


def keyed(name: str) -> dict[str, list[tuple[float, float]]]:
    """Shape key -> its keyframes (frame, value)."""
    keys = bpy.data.objects[name].data.shape_keys
    action = keys.animation_data.action if keys.animation_data else None
    out = {}
    for block in keys.key_blocks if action else ():
        path = block.path_from_id("value")
        curve = next((c for c in curves_of(action) if c.data_path == path), None)
        if curve is not None:
            out[block.name] = [tuple(point.co) for point in curve.keyframe_points]
    return out


def curves_of(action):
    """An action's curves, wherever this Blender keeps them."""
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
    return [curve for bag in bags for curve in bag.fcurves]


def error_of(operator, *args, **options) -> str:
    """The one sentence that an operator reports."""
    with pytest.raises(RuntimeError) as caught:
        operator(*args, **options)
    sentence = str(caught.value).removeprefix("Error: ").strip()
    assert "\n" not in sentence and "Traceback" not in sentence
    return sentence


def apply(**options):
    """The button, with an undo step as the button makes it."""
    return bpy.ops.sketch_to_face.apply_expression("EXEC_DEFAULT", True, **options)


@pytest.fixture
def reports(capfd):
    """Function: what operators have reported since it was asked last, as Blender prints it."""

    def read() -> str:
        return capfd.readouterr().out

    read()
    return read


@pytest.fixture
def face(shell):
    """A face without identity keys that wears AUS."""
    bpy.ops.mesh.add_facs_face(identity_keys=False)
    made = bpy.context.active_object
    set_pose(made, FaceParameters(AUS, head=(0.2, 0.0, 0.0), gaze=(0.1, 0.0)))
    return made


@pytest.fixture
def folder(tmp_path):
    """Three sketches and something that is none, in an order that only people know."""
    drawn = tmp_path / "drawn"
    drawn.mkdir()
    for name, source in (("2", "smiling_woman"), ("10", "angry_man"), ("11", "worried_old_man")):
        shutil.copy(SKETCHES / f"{source}.png", drawn / f"{name}.png")
    (drawn / "9.png").write_bytes(b"not a picture")
    bpy.context.scene.sketch_to_face.storyboard = str(drawn)
    return drawn


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
    from addon.blender import retarget_operators

    target = mesh("Head")
    select(target)
    assert retarget_operators.giver(bpy.context) == face  # the only one
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    bpy.ops.sketch_to_face.fit()
    first = bpy.context.active_object
    bpy.ops.sketch_to_face.fit()
    second = bpy.context.active_object
    select(target)
    assert retarget_operators.giver(bpy.context) == second  # made last
    select(target, first)
    assert retarget_operators.giver(bpy.context) == first  # selected
    select(target, first, active=face)
    assert retarget_operators.giver(bpy.context) == face  # active
    bpy.data.objects.remove(second)
    select(target)
    assert retarget_operators.giver(bpy.context) == first


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


# --- storyboard -----------------------------------------------------------------------------------


def expected(folder) -> dict[float, FaceParameters]:
    """Frame -> what is drawn there, if the first stands at 5 and the next 10 further each."""
    from addon import pipeline

    places = {"2": 5, "10": 25, "11": 35}  # 9.png, which is broken, keeps 15
    return {at: pipeline.read_expression(folder / f"{n}.png") for n, at in places.items()}


def storyboard(**options):
    """The button in the background, on whatever is selected, at frame 5 every 10."""
    bpy.context.scene.frame_set(5)
    bpy.context.scene.sketch_to_face.storyboard_every = 10
    bpy.ops.ed.undo_push(message="frame chosen")
    return bpy.ops.sketch_to_face.storyboard("INVOKE_DEFAULT", True, **options)


def test_sketches_become_key_poses_of_a_mesh(shell, folder, reports):
    select(mesh("Head"), mesh("Teeth", ["jawOpen", "tongueOut"]))
    reports()
    assert storyboard() == {"FINISHED"}
    said = reports()
    assert re.search(r"3 key poses on (Head, Teeth|Teeth, Head), frames 5 to 35; left out 9.png",
                     said)  # fmt: skip
    assert said.count("9.png") == 2  # once more with the reason
    poses = expected(folder)
    found = keyed("Head")
    assert set(found) == set(CONVENTIONS["arkit"].keys) and set(keyed("Teeth")) == {"jawOpen"}
    for key, points in found.items():
        assert points == [
            (at, pytest.approx(retarget(pose.aus, "arkit")[key], abs=1e-6))
            for at, pose in poses.items()
        ]
    assert bpy.context.scene.frame_current == 5
    assert values("Head") == wanted(poses[5].aus, "arkit")  # it shows the frame that is shown


def test_sketches_become_key_poses_of_a_face_that_turns_its_head(face, folder):
    select(face)
    storyboard()
    for at, pose in expected(folder).items():
        bpy.context.scene.frame_set(at)
        told = pose_of(bpy.data.objects[face.name])
        assert dict(told.aus) == pytest.approx(pose.aus, abs=1e-5)
        assert told.head == pytest.approx(pose.head, abs=1e-5)
    turned = pose_of(face).head
    face.animation_data_clear()
    face.parent.animation_data_clear()
    set_pose(face, FaceParameters(head=(0.5, 0, 0)))
    storyboard(head=False)
    bpy.context.scene.frame_set(35)
    assert pose_of(face).head == pytest.approx((0.5, 0, 0)) != pytest.approx(turned)


def test_storyboard_is_undone_and_redone(shell, folder):
    select(mesh("Head"))
    storyboard()
    made = keyed("Head")
    bpy.ops.ed.undo()
    assert keyed("Head") == {} and values("Head") == {}
    bpy.ops.ed.redo()
    assert keyed("Head") == made and len(made["jawOpen"]) == 3


def test_storyboard_without_a_folder_or_with_nothing_to_read_is_one_sentence(shell, tmp_path):
    select(mesh("Head"))
    assert "No folder is chosen" in error_of(storyboard)
    bpy.context.scene.sketch_to_face.storyboard = str(tmp_path / "nowhere")
    assert "cannot be read: no such file or directory" in error_of(storyboard)
    bpy.context.scene.sketch_to_face.storyboard = str(tmp_path)
    assert "There is no picture in" in error_of(storyboard)
    (tmp_path / "one.png").write_bytes(b"")
    with pytest.raises(RuntimeError, match=r"None of the sketches could be read: .*one\.png"):
        storyboard()
    assert keyed("Head") == {}
    select(mesh("Hat", None))
    assert "'Hat' has no shape keys" in error_of(storyboard)


class Windowed:
    """Blender's module, but for saying that it runs in the background."""

    app = SimpleNamespace(background=False)

    def __getattr__(self, name):
        return getattr(bpy, name)


@pytest.fixture
def desk(shell, folder, monkeypatch):
    """The operator's own functions on stand-ins for the window, which the background lacks."""
    from addon.blender import retarget_operators

    monkeypatch.setattr(retarget_operators, "bpy", Windowed())
    operator = retarget_operators.SKETCHTOFACE_OT_storyboard
    noted = SimpleNamespace(progress=[], reports=[], texts=[], timers=[])
    manager = SimpleNamespace(
        progress_begin=lambda low, high: noted.progress.append((low, high)),
        progress_update=noted.progress.append,
        progress_end=lambda: noted.progress.append("end"),
        event_timer_add=lambda wait, window: noted.timers.append("timer") or "timer",
        event_timer_remove=noted.timers.remove,
        modal_handler_add=lambda op: None,
    )
    context = SimpleNamespace(
        window_manager=manager, window=None, scene=bpy.context.scene,
        selected_objects=[mesh("Head")], active_object=None,
        workspace=SimpleNamespace(status_text_set=noted.texts.append),
    )  # fmt: skip
    session = SimpleNamespace(
        head=True, bl_label=operator.bl_label, _timer=None,
        report=lambda kind, text: noted.reports.append(text),
    )  # fmt: skip
    for name in ("_begin", "_tell", "_put_away", "_end"):
        setattr(session, name, getattr(operator, name).__get__(session))

    def press(event: str) -> set[str]:
        return operator.modal(session, context, SimpleNamespace(type=event))

    def invoke() -> set[str]:
        return operator.invoke(session, context, None)

    return SimpleNamespace(press=press, invoke=invoke, noted=noted)


def test_from_the_button_it_goes_one_sketch_a_tick(desk):
    assert desk.invoke() == {"RUNNING_MODAL"}
    assert desk.press("MOUSEMOVE") == {"RUNNING_MODAL"} and desk.noted.progress == [(0, 4), 0]
    answers = [desk.press("TIMER") for _ in range(4)]
    assert answers == [{"RUNNING_MODAL"}] * 3 + [{"FINISHED"}]
    assert desk.noted.progress == [(0, 4), 0, 1, 2, 3, "end"]
    assert desk.noted.timers == [] and desk.noted.texts[-1] is None
    assert "2 of 4, 9.png" in desk.noted.texts[1]
    assert desk.noted.reports[-1] == "3 key poses on Head, frames 1 to 73; left out 9.png"


def test_escape_keeps_what_is_done_and_puts_everything_back(desk):
    desk.invoke()
    desk.press("TIMER")
    assert desk.press("ESC") == {"FINISHED"}
    assert desk.noted.timers == [] and desk.noted.progress[-1] == "end"
    said = "1 key pose on Head, frame 1; stopped after 1 of 4 sketches"
    assert desk.noted.reports == [said]
    assert len(keyed("Head")["jawOpen"]) == 1
    desk.invoke()
    assert desk.press("ESC") == {"CANCELLED"}
    assert desk.noted.timers == [] and desk.noted.reports == [said]


# --- the panel ------------------------------------------------------------------------------------


def test_the_panel_draws(shell):
    from addon.blender import retarget_panel

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

    panel = retarget_panel.SKETCHTOFACE_PT_retarget
    panel.draw(SimpleNamespace(layout=Layout()), bpy.context)
    assert drawn == ["sketch_to_face.apply_expression"] * 2 + [
        "storyboard", "storyboard_every", "sketch_to_face.storyboard",
    ]  # fmt: skip
