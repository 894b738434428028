"""Adding faces and working with their expressions, in Blender without a window."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, IDENTITY, FaceParameters, expressions  # noqa: E402
from facs_rig.blender.pose import (  # noqa: E402
    MARK,
    VERSION,
    identity_of,
    pose_of,
    refresh,
    set_pose,
)
from facs_rig.folds import drawn_creases  # noqa: E402

KINDS = ("objects", "meshes", "materials", "armatures", "shape_keys", "actions")
POSE = FaceParameters(
    {"smile_left": 4.0, "frontalis": 2.5}, head=(0.3, -0.1, 0.2), neck=(0.1, 0.0, -0.1),
    gaze=(0.2, -0.1),
)  # fmt: skip


def everything() -> dict[str, list[str]]:
    """Names of all that a button could leave behind."""
    return {kind: sorted(d.name for d in getattr(bpy.data, kind)) for kind in KINDS}


def add(**options):
    """The button, with an undo step as the menu makes it."""
    assert bpy.ops.mesh.add_facs_face("EXEC_DEFAULT", True, **options) == {"FINISHED"}
    return bpy.context.active_object


def add_here(**options):
    """The same, and moved from beside the others to the middle, where vertices can be compared."""
    face = add(**options)
    (face.parent or face).location = (0.0, 0.0, 0.0)
    return face


def error_of(operator, *args, **options) -> str:
    """The one sentence that an operator reports."""
    with pytest.raises(RuntimeError) as caught:
        operator(*args, **options)
    sentence = str(caught.value).removeprefix("Error: ").strip()
    assert "\n" not in sentence and "Traceback" not in sentence
    return sentence


@pytest.fixture
def clipboard(shell, monkeypatch):
    """A clipboard, which Blender has only with a window."""
    from addon.blender.operators import expression

    held = SimpleNamespace(text="")
    monkeypatch.setattr(expression, "read_clipboard", lambda context: held.text)
    monkeypatch.setattr(
        expression, "write_clipboard", lambda context, text: setattr(held, "text", text)
    )
    return held


@pytest.fixture
def face(shell):
    """A face without identity keys, which is quick to make."""
    return add(identity_keys=False)


def test_added_face_stands_at_the_cursor_selected_and_active(shell, rig, evaluated):
    bpy.context.scene.cursor.location = (1.0, 2.0, 3.0)
    face = add()
    assert face.name == "FACS Face" and face[MARK] == VERSION
    assert bpy.context.active_object == face
    assert bpy.context.selected_objects == [face]
    assert np.abs(evaluated(face) - (rig.neutral() + (1.0, 3.0, -2.0))).max() < 1e-5


def test_options_of_the_added_face(shell):
    from facs_rig.blender.pose import has_identity_keys, identity_of

    assert not has_identity_keys(add(identity_keys=False))
    everybody = add(arkit=True)
    assert has_identity_keys(everybody) and identity_of(everybody) == {}
    assert "jawOpen" in everybody.data.shape_keys.key_blocks
    one, same, other = (identity_of(add(random_identity=True, seed=s)) for s in (3, 3, 4))
    assert one == same != other != {}


def test_undo_takes_the_added_face_away_and_redo_brings_it_again(shell, evaluated):
    bpy.ops.ed.undo_push(message="before")
    before = everything()
    add(random_identity=True, arkit=True)
    made, vertices = everything(), evaluated(bpy.context.active_object)
    bpy.ops.ed.undo()
    assert everything() == before
    bpy.ops.ed.redo()
    assert everything() == made
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), vertices)


def test_menu_entry_comes_and_goes(empty_blender):
    import addon.blender as module

    def entries():
        return len(bpy.types.VIEW3D_MT_mesh_add._dyn_ui_initialize())

    before = entries()
    module.register()
    assert entries() == before + 1
    module.unregister()
    assert entries() == before


def test_adding_waits_for_object_mode(shell, face):
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.mesh.add_facs_face.poll()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.mesh.add_facs_face.poll()


@pytest.mark.parametrize("content", [b"this is no archive", b"PK\x03\x04 nor this", None])
def test_damaged_asset_is_one_sentence_and_leaves_nothing(shell, monkeypatch, tmp_path, content):
    import facs_rig.rig

    damaged = tmp_path / "head.npz"
    if content is None:  # an archive that lacks most of what it should have
        np.savez(damaged, base=np.zeros((4, 3)))
    else:
        damaged.write_bytes(content)
    load = facs_rig.rig.load_rig.__wrapped__
    monkeypatch.setattr(facs_rig.rig, "load_rig", lambda: load(damaged))
    before = everything()
    sentence = error_of(bpy.ops.mesh.add_facs_face)
    assert "head.npz' is damaged; install again" in sentence
    assert everything() == before


def test_face_is_known_after_renaming_and_reloading_and_among_others(shell, evaluated, tmp_path):
    from addon.blender.state import faces

    first, _ = add(), add(identity_keys=False)
    set_pose(first, POSE)
    first.name = "Anna"
    vertices = evaluated(first)
    file = str(tmp_path / "two.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    anna, other = bpy.data.objects["Anna"], bpy.data.objects["FACS Face.001"]
    bpy.context.view_layer.objects.active = anna
    assert faces.active_face(bpy.context) == anna
    assert np.array_equal(evaluated(anna), vertices)
    assert not pose_of(other).aus
    bpy.ops.sketch_to_face.random_expression(seed=5)
    assert dict(pose_of(anna).aus) == expressions.random_expression(np.random.default_rng(5))
    assert not pose_of(other).aus
    bpy.context.view_layer.objects.active = anna.parent
    assert faces.active_face(bpy.context) == anna
    bpy.ops.object.empty_add()
    assert faces.active_face(bpy.context) is None
    assert not bpy.ops.sketch_to_face.random_expression.poll()


@pytest.mark.parametrize(
    ("operator", "options"),
    [
        ("reset_sliders", {"to": "NEUTRAL", "head": True}),
        ("random_expression", {"seed": 7}),
        ("mirror_expression", {}),
        ("paste_expression", {"text": expressions.dumps(FaceParameters({"wince": 5.0}))}),
    ],
)
def test_undo_and_redo_of_an_expression(face, evaluated, operator, options):
    set_pose(face, POSE)
    bpy.ops.ed.undo_push(message="posed")
    before = evaluated(face)
    assert getattr(bpy.ops.sketch_to_face, operator)("EXEC_DEFAULT", True, **options)
    after = evaluated(bpy.data.objects["FACS Face"])
    assert np.abs(after - before).max() > 0.001
    bpy.ops.ed.undo()
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), after)


def test_undo_and_redo_of_a_person(shell, rig, evaluated):
    face = add()
    set_pose(face, POSE)
    bpy.ops.ed.undo_push(message="posed")
    before = evaluated(face)
    bpy.ops.sketch_to_face.random_person("EXEC_DEFAULT", True, seed=2)
    after = evaluated(bpy.data.objects["FACS Face"])
    assert np.abs(after - rig.pose(pose_of(bpy.data.objects["FACS Face"]))).max() < 1e-5
    assert np.abs(after - before).max() > 0.003
    bpy.ops.ed.undo()
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), after)
    bpy.ops.sketch_to_face.plain_person()
    assert np.abs(evaluated(bpy.data.objects["FACS Face"]) - before).max() < 1e-6


def test_new_creases_are_the_persons_and_undone(shell, rig, evaluated):
    """They show in an expression, are drawn from a seed, and leave who it is alone; folds
    at rest, which are deeper than an old face's on average, too."""
    face = add()
    face.sketch_to_face.identity.age = 0.9
    face["frontalis"] = face["smile"] = 5.0
    refresh(face)
    bpy.ops.ed.undo_push(message="smiling")
    before = evaluated(face)
    bpy.ops.sketch_to_face.new_creases("EXEC_DEFAULT", True, seed=4)
    face = bpy.data.objects["FACS Face"]
    who = {"age": 0.9, **drawn_creases(np.random.default_rng(4))}
    assert identity_of(face) == pytest.approx(who)
    after = evaluated(face)
    wanted = rig.pose(FaceParameters({"frontalis": 5.0, "smile": 5.0}, identity_of(face)))
    assert np.abs(after - wanted).max() < 1e-5
    assert np.abs(after - before).max() > 5e-4
    bpy.ops.ed.undo()
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects["FACS Face"]), after)
    bpy.ops.sketch_to_face.plain_creases("EXEC_DEFAULT", True)
    assert identity_of(bpy.data.objects["FACS Face"]) == pytest.approx({"age": 0.9})
    assert np.abs(evaluated(bpy.data.objects["FACS Face"]) - before).max() < 1e-6


def test_identity_sliders_are_live_and_remembered(shell, rig, evaluated, tmp_path):
    face = add()
    sliders = face.sketch_to_face.identity
    for feature in IDENTITY:
        assert getattr(sliders, feature.name) == pytest.approx(feature.default)
        shown = sliders.bl_rna.properties[feature.name]
        ends = shown.hard_min, shown.hard_max, shown.soft_min, shown.soft_max
        assert ends == pytest.approx((*feature.span, feature.minimum, feature.maximum))
    sliders.age, sliders.nose_length = 0.75, -0.5
    wanted = rig.neutral({"age": 0.75, "nose_length": -0.5})
    assert np.abs(evaluated(face) - wanted).max() < 1e-5
    file = str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    assert bpy.data.objects["FACS Face"].sketch_to_face.identity.age == 0.75
    sliders = bpy.data.objects["FACS Face"].sketch_to_face.identity
    sliders.age = sliders.nose_length = 0.0
    assert np.abs(evaluated(bpy.data.objects["FACS Face"]) - rig.neutral()).max() < 1e-5


def test_copied_expression_is_pasted_on_another_face(face, clipboard, evaluated):
    set_pose(face, POSE)
    assert bpy.ops.sketch_to_face.copy_expression() == {"FINISHED"}
    assert json.loads(clipboard.text)["aus"] == dict(POSE.aus)
    other = add_here(identity_keys=False)
    bpy.ops.sketch_to_face.paste_expression()
    assert np.abs(evaluated(other) - evaluated(face)).max() < 1e-7
    third = add_here(identity_keys=False)
    bpy.ops.sketch_to_face.paste_expression(head=False)
    assert pose_of(third).head == (0, 0, 0) and dict(pose_of(third).aus) == dict(POSE.aus)


def test_copying_leaves_the_person_out(clipboard):
    add(random_identity=True)
    bpy.ops.sketch_to_face.copy_expression()
    assert "identity" not in json.loads(clipboard.text)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "The clipboard is empty: copy an expression first"),
        ("a letter to my aunt", "The clipboard holds no expression"),
        ('{"format": "sketch-to-face expression", "version": 1, "aus": {"smlie": 3}}', "'smile'"),
        ('{"format": "sketch-to-face expression", "version": 1, "aus": {"smile": 30}}', "outside"),
        ('{"format": "sketch-to-face expression", "version": 99, "aus": {}}', "newer"),
    ],
)
def test_bad_paste_is_one_sentence_and_changes_nothing(face, clipboard, evaluated, text, says):
    set_pose(face, POSE)
    before, clipboard.text = evaluated(face), text
    assert says in error_of(bpy.ops.sketch_to_face.paste_expression)
    assert np.array_equal(evaluated(face), before)


def test_saved_expression_is_loaded_again(face, tmp_path, evaluated):
    set_pose(face, POSE)
    posed, file = evaluated(face), str(tmp_path / "grin.json")
    assert bpy.ops.sketch_to_face.save_expression(filepath=file) == {"FINISHED"}
    assert dict(expressions.read(file).aus) == dict(POSE.aus)
    bpy.ops.sketch_to_face.reset_sliders(to="NEUTRAL", head=True)
    assert np.abs(evaluated(face) - posed).max() > 0.003
    assert bpy.ops.sketch_to_face.load_expression(filepath=file) == {"FINISHED"}
    assert np.abs(evaluated(face) - posed).max() < 1e-7


def test_person_is_saved_and_loaded_on_request(shell, rig, tmp_path, evaluated):
    add(random_identity=True, seed=6)
    file, plain = str(tmp_path / "who.json"), str(tmp_path / "what.json")
    bpy.ops.sketch_to_face.save_expression(filepath=file, person=True)
    bpy.ops.sketch_to_face.save_expression(filepath=plain)
    someone = dict(pose_of(bpy.context.active_object).identity)
    assert dict(expressions.read(file).identity) == pytest.approx(someone, abs=1e-6)
    assert not expressions.read(plain).identity
    other = add_here()
    bpy.ops.sketch_to_face.load_expression(filepath=file)
    assert not pose_of(other).identity
    bpy.ops.sketch_to_face.load_expression(filepath=file, person=True)
    assert np.abs(evaluated(other) - rig.neutral(someone)).max() < 1e-5


def test_baked_person_is_saved_too(shell, tmp_path):
    face = add(identity_keys=False, random_identity=True, seed=6)
    file = str(tmp_path / "who.json")
    bpy.ops.sketch_to_face.save_expression(filepath=file, person=True)
    assert pose_of(face).identity
    assert dict(expressions.read(file).identity) == pytest.approx(pose_of(face).identity, abs=1e-6)


@pytest.mark.parametrize("content", [None, b"", b"{", b'{"format": "x"}', b"\xff\xfe\x00"])
def test_bad_file_is_one_sentence_and_changes_nothing(face, tmp_path, evaluated, content):
    set_pose(face, POSE)
    before, file = evaluated(face), tmp_path / "sad.json"
    if content is not None:
        file.write_bytes(content)
    assert "sad.json" in error_of(bpy.ops.sketch_to_face.load_expression, filepath=str(file))
    assert np.array_equal(evaluated(face), before)


def test_file_that_cannot_be_written_is_one_sentence(face, tmp_path):
    nowhere = str(tmp_path / "missing" / "grin.json")
    assert "cannot be written" in error_of(bpy.ops.sketch_to_face.save_expression, filepath=nowhere)


def test_mirror_exchanges_the_sides_and_twice_is_nothing(face, rig, evaluated):
    set_pose(face, POSE)
    before = evaluated(face)
    bpy.ops.sketch_to_face.mirror_expression()
    told = pose_of(face)
    assert dict(told.aus) == {"smile_right": 4.0, "frontalis": 2.5}
    assert told.gaze == pytest.approx((-0.2, -0.1))
    assert told.head == pytest.approx((-0.3, -0.1, -0.2))
    flipped = evaluated(face)[rig.mirror] * (-1, 1, 1)
    assert np.abs(flipped - before).max() < 0.001  # as symmetric as the head itself
    bpy.ops.sketch_to_face.mirror_expression()
    assert np.abs(evaluated(face) - before).max() < 1e-6


def test_reset_brings_eyes_and_sliders_back_and_the_head_on_request(face, rig, evaluated):
    set_pose(face, POSE)
    face.parent.pose.bones["eye_left"].rotation_euler[2] = 0.2
    bpy.ops.sketch_to_face.reset_sliders()
    told = pose_of(face)
    assert not told.aus and told.gaze == (0, 0) and told.head == pytest.approx(POSE.head)
    bpy.ops.sketch_to_face.reset_sliders(head=True)
    assert np.abs(evaluated(face) - rig.neutral()).max() < 1e-5


def test_keyed_expressions_play_as_an_animation(face, rig, evaluated):
    scene = bpy.context.scene
    for frame, pose in ((1, FaceParameters()), (21, POSE)):
        scene.frame_set(frame)
        set_pose(face, pose)
        assert bpy.ops.sketch_to_face.key_expression() == {"FINISHED"}
    for frame, pose in ((1, FaceParameters()), (21, POSE)):
        scene.frame_set(frame)
        assert np.abs(evaluated(face) - rig.pose(pose)).max() < 1e-5
    scene.frame_set(11)
    assert 0 < face["smile_left"] < 4
    assert np.abs(evaluated(face) - rig.pose(pose_of(face))).max() < 1e-5


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda face: face.__setitem__(MARK, VERSION + 1), "made by a newer version"),
        (lambda face: face.__delitem__("wince"), "lost its slider 'wince'"),
        (lambda face: face.shape_key_clear(), "lost its shape keys"),
    ],
)
def test_face_that_cannot_be_posed_says_why_and_shows_no_sliders(face, clipboard, spoil, says):
    from addon.blender.panels import face as face_panel

    upper = face_panel.CLASSES[1]
    assert upper.poll(bpy.context)
    spoil(face)
    clipboard.text = expressions.dumps(POSE)
    for name in ("reset_sliders", "random_expression", "mirror_expression", "copy_expression",
                 "paste_expression", "key_expression"):  # fmt: skip
        assert says in error_of(getattr(bpy.ops.sketch_to_face, name))
    assert face_panel.SKETCHTOFACE_PT_face.poll(bpy.context)
    assert not upper.poll(bpy.context)
    assert says.split(" '")[0] in " ".join(Layout.of(face_panel.SKETCHTOFACE_PT_face).labels)


def test_face_without_its_armature_keeps_its_sliders(face, rig, evaluated):
    bpy.data.objects.remove(face.parent)
    set_pose(face, POSE)
    bpy.ops.sketch_to_face.key_expression()
    wanted = rig.pose(FaceParameters(POSE.aus))
    expected = np.abs(evaluated(face) - wanted).max(axis=1)
    assert expected[rig.parts["teeth"]].max() < 1e-5
    assert pose_of(face).head == (0, 0, 0)


# --- what the panels draw ---


class Layout:
    """Stands in for Blender's layout and notes what is drawn."""

    def __init__(self, noted: Layout | None = None) -> None:
        noted = noted or self
        if noted is self:
            self.props: list[tuple[str, str]] = []
            self.operators: list[str] = []
            self.labels: list[str] = []
        self.noted = noted

    @classmethod
    def of(cls, panel) -> Layout:
        layout = cls()
        panel.draw(SimpleNamespace(layout=layout), bpy.context)
        return layout

    def column(self, **_options) -> Layout:
        return Layout(self.noted)

    row = column

    def separator(self, **_options) -> None:
        pass

    def label(self, text="", **_options) -> None:
        self.noted.labels.append(text)

    def prop(self, owner, path, text=None, **_options) -> None:
        owner.path_resolve(path)  # raises if there is no such property
        self.noted.props.append((path, text))

    def operator(self, name, **_options) -> SimpleNamespace:
        folder, _, stem = name.partition(".")
        getattr(getattr(bpy.ops, folder), stem).get_rna_type()
        self.noted.operators.append(name)
        return SimpleNamespace()


def test_panels_show_every_control_once_and_one_sided_ones_on_request(face):
    from addon.blender.panels import face as face_panel

    panels = [face_panel.CLASSES[k] for k in (1, 2, 3)]

    def shown():
        return [path[2:-2] for panel in panels for path, _ in Layout.of(panel).props]

    bpy.context.scene.sketch_to_face.one_sided = True
    assert sorted(shown()) == sorted(CONTROL_NAMES)
    bpy.context.scene.sketch_to_face.one_sided = False
    few = shown()
    assert {"smile", "blink", "jaw_left", "jaw_right"} <= set(few)
    assert not {"smile_left", "blink_right"} & set(few)
    counts = [len(Layout.of(panel).props) for panel in panels]
    assert counts == [8, 7, 20]


def test_other_panels_draw_for_added_and_baked_faces(shell):
    from addon.blender.panels import face as face_panel

    face = add(arkit=True)
    buttons = Layout.of(face_panel.SKETCHTOFACE_PT_face).operators
    assert len(buttons) == 8
    shown = [path for path, _ in Layout.of(face_panel.SKETCHTOFACE_PT_head).props]
    assert shown == ['["gaze_yaw"]', '["gaze_pitch"]'] + ["rotation_euler"] * 6
    creases = [("wrinkles", None), ("crease_seed", None)]
    assert Layout.of(face_panel.SKETCHTOFACE_PT_wrinkles).props == creases
    names = [path for panel in face_panel.CLASSES if "identity_" in panel.bl_idname
             for path, _ in Layout.of(panel).props]  # fmt: skip
    assert sorted([*names, "wrinkles", "crease_seed"]) == sorted(f.name for f in IDENTITY)
    face.parent.pose.bones["head"].rotation_mode = "QUATERNION"
    assert len(Layout.of(face_panel.SKETCHTOFACE_PT_head).props) == 5
    add(identity_keys=False)
    assert face_panel.SKETCHTOFACE_PT_identity.poll(bpy.context)


def test_a_baked_face_becomes_another_person_by_its_sliders(shell, rig, evaluated):
    add(identity_keys=False, random_identity=True, seed=3)
    face = bpy.context.active_object
    face["smile"] = 4.0
    face.sketch_to_face.identity.age = 0.9
    who = pose_of(face).identity
    assert who["age"] == pytest.approx(0.9) and len(who) > 5
    expected = rig.pose(FaceParameters({"smile": 4.0}, who))
    refresh(face)
    assert np.abs(evaluated(face) - expected).max() < 1e-5
    assert bpy.ops.sketch_to_face.plain_person() == {"FINISHED"}
    assert np.abs(evaluated(face) - rig.pose(FaceParameters({"smile": 4.0}))).max() < 1e-5


def test_depth_of_creases_is_live(face, rig, evaluated):
    set_pose(face, FaceParameters({"frontalis": 5.0}))
    face["crease_gain"] = 0.0
    refresh(face)
    smooth = evaluated(face)
    wanted = rig.pose(FaceParameters({"frontalis": 5.0}, {"wrinkles": -1.0}))
    assert np.abs(smooth - wanted).max() < 1e-5
