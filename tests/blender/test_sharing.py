"""Faces that are linked, overridden, duplicated or taken to other files: each works or says so."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, FaceParameters  # noqa: E402
from facs_rig.blender import build_face  # noqa: E402
from facs_rig.blender.pose import identity_of, is_face, mover_of, pose_of, refresh  # noqa: E402

from .rigs import error_of  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
ops = bpy.ops.sketch_to_face
EXACT = 1e-6  # metres


def make(rig, name="Ann", home=None, **options) -> bpy.types.Object:
    parameters = FaceParameters({"smile": 3.0}, {"age": 0.7}, (0.2, 0.0, 0.0))
    offsets = np.zeros((rig.n_vertices, 3), np.float32)
    offsets[:, 1] = 0.002
    face = build_face(name, rig, parameters, offsets, collection=home, **options)
    activate(face)
    return face


def activate(*things) -> None:
    for other in bpy.context.selected_objects:
        other.select_set(False)
    for thing in things:
        thing.select_set(True)
    bpy.context.view_layer.objects.active = things[0]


def faces_here() -> list[bpy.types.Object]:
    return [o for o in bpy.data.objects if is_face(o) and o.library is None]


def follows(face, evaluated, *others) -> bool:
    """Whether a slider moves this face, and none of the others."""
    before, still = evaluated(face), [evaluated(other) for other in others]
    face["frontalis"] = 5.0 - face["frontalis"]
    refresh(face)
    moved = np.abs(evaluated(face) - before).max() > 1e-3
    return moved and all(
        np.abs(evaluated(other) - there).max() < EXACT
        for other, there in zip(others, still, strict=True)
    )


# --- libraries ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made_once(tmp_path_factory):
    return tmp_path_factory.mktemp("library") / "library.blend"


@pytest.fixture
def library(shell, rig, sketch, tmp_path, made_once):
    """A file with a collection that holds a face with identity keys, and one of a sketch."""
    if not made_once.exists():
        make_library(rig, sketch, made_once)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return Path(shutil.copy(made_once, tmp_path))


def make_library(rig, sketch, path: Path) -> None:
    home = bpy.data.collections.new("Cast")
    bpy.context.scene.collection.children.link(home)
    make(rig, "Ann", home, identity_keys=True)
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    ops.fit()
    fitted = bpy.context.active_object
    fitted.name = "Eve"
    for thing in (fitted, fitted.parent):
        for collection in thing.users_collection:
            collection.objects.unlink(thing)
        home.objects.link(thing)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def linked(path, link=True):
    with bpy.data.libraries.load(str(path), link=link) as (_, taken):
        taken.collections = ["Cast"]
    return taken.collections[0]


def overridden(path) -> dict[str, bpy.types.Object]:
    cast = linked(path)
    context = bpy.context
    cast.override_hierarchy_create(context.scene, context.view_layer, do_fully_editable=True)
    return {face.name: face for face in faces_here()}


def reloaded(tmp_path) -> dict[str, bpy.types.Object]:
    mine = str(tmp_path / "mine.blend")
    bpy.ops.wm.save_as_mainfile(filepath=mine)
    bpy.ops.wm.open_mainfile(filepath=mine)
    return {face.name: face for face in faces_here()}


def alike(one: FaceParameters, other: FaceParameters) -> bool:
    """The same but for the digits that a 32-bit float lacks."""
    mine, theirs = (
        {**p.aus, **p.identity, **dict(enumerate((*p.head, *p.neck, *p.gaze)))}
        for p in (one, other)
    )
    return mine == pytest.approx(theirs, abs=1e-6)


def test_an_override_keeps_every_slider(library, tmp_path, evaluated):
    for name, face in overridden(library).items():
        for k, control in enumerate(CONTROL_NAMES):
            face[control] = 0.25 + 0.01 * k
        face["gaze_yaw"], face["gaze_pitch"], face["crease_gain"] = 12.0, -5.0, 2.0
        face.parent.pose.bones["head"].rotation_euler = (0.1, 0.3, -0.2)
        face.parent.pose.bones["neck"].rotation_euler.x = 0.15
        face.data.shape_keys.key_blocks["Fitted"].value = 0.3
        face.sketch_to_face.live = name == "Eve"
        refresh(face)
    before = {face.name: (evaluated(face), pose_of(face)) for face in faces_here()}
    after = reloaded(tmp_path)
    assert len(after) == 2
    for name, face in after.items():
        points, pose = before[name]
        assert alike(pose_of(face), pose)
        assert face["crease_gain"] == 2.0
        assert face.data.shape_keys.key_blocks["Fitted"].value == pytest.approx(0.3)
        assert face.sketch_to_face.live == (name == "Eve")
        assert np.abs(evaluated(face) - points).max() < EXACT


def test_an_override_keeps_its_person(library, tmp_path, evaluated, rig):
    face = overridden(library)["Ann"]
    face.sketch_to_face.identity.age = 0.2
    face.sketch_to_face.identity.gender = 0.9
    assert identity_of(face)["age"] == pytest.approx(0.2)
    points, pose = evaluated(face), pose_of(face)
    neutral = rig.pose(pose, np.tile([0, 0.002, 0], (rig.n_vertices, 1)))
    assert np.abs(points - neutral).max() < 1e-5
    face = reloaded(tmp_path)["Ann"]
    assert alike(pose_of(face), pose)
    assert face.sketch_to_face.identity.gender == pytest.approx(0.9)
    assert np.abs(evaluated(face) - points).max() < EXACT


def test_an_override_of_a_sketch_keeps_decisions(library, tmp_path):
    face = overridden(library)["Eve"]
    detections = face.sketch_to_face.detections
    locked = {item.name for item in detections if item.locked}
    assert not locked
    detections["jaw_open"].intensity = 3.0
    face = reloaded(tmp_path)["Eve"]
    detections = face.sketch_to_face.detections
    assert face["jaw_open"] == 3.0 and detections["jaw_open"].intensity == 3.0
    assert {item.name for item in detections if item.locked} == {"jaw_open"}


def test_what_an_override_cannot_is_one_sentence(library):
    face = overridden(library)["Eve"]
    activate(face)
    for press in (ops.random_person, ops.fit_again):
        assert "is linked from another file; make it and its mesh local" in error_of(press)


def test_keyframes_of_an_override_stay(library, tmp_path):
    face = overridden(library)["Ann"]
    activate(face)
    ops.key_expression()
    bpy.context.scene.frame_set(20)
    face["smile"] = 7.0
    ops.key_expression()
    face = reloaded(tmp_path)["Ann"]
    bpy.context.scene.frame_set(20)
    assert face["smile"] == 7.0
    bpy.context.scene.frame_set(1)
    assert face["smile"] == 3.0


def test_a_linked_face_says_that_it_is_linked(library):
    cast = linked(library)
    bpy.context.scene.collection.children.link(cast)
    face = next(o for o in cast.objects if is_face(o))
    activate(face)
    with pytest.raises(RuntimeError, match="linked from another file: make it local first"):
        ops.random_expression()
    bpy.ops.object.make_local(type="ALL")
    face = bpy.context.view_layer.objects.active
    assert face.library is None


@pytest.mark.parametrize("link", [False, True], ids=["appended", "made local"])
def test_faces_of_other_files_work(library, link, evaluated):
    cast = linked(library, link)
    bpy.context.scene.collection.children.link(cast)
    if link:
        for thing in cast.objects:
            thing.select_set(True)
        bpy.ops.object.make_local(type="ALL")
    found = faces_here()
    assert len(found) == 2
    one, other = found
    assert follows(one, evaluated, other) and follows(other, evaluated, one)


def test_instances_made_real_stand_alone_on_request(library, evaluated):
    """What a collection instance shows cannot be posed until it is an object of its own."""
    cast = linked(library, link=False)
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", cast
    bpy.context.scene.collection.objects.link(empty)
    activate(empty)
    bpy.ops.object.duplicates_make_real(use_base_parent=False, use_hierarchy=True)
    real = [o for o in bpy.context.selected_objects if is_face(o)]
    assert len(real) == 2
    for face in real:
        activate(face)
        assert "press Make Independent" in error_of(ops.random_expression)
        ops.stand_alone()
        assert follows(face, evaluated, *(o for o in faces_here() if o != face))


# --- duplicates -----------------------------------------------------------------------------------


def duplicate(face, linked: bool, bones: bool = True) -> bpy.types.Object:
    activate(face, *([face.parent] if bones else []))
    bpy.ops.object.duplicate(linked=linked)
    other = next(o for o in bpy.context.selected_objects if is_face(o))
    activate(other)
    return other


@pytest.mark.parametrize("bones", [True, False], ids=["with its bones", "alone"])
@pytest.mark.parametrize("keys", [True, False], ids=["identity keys", "baked"])
def test_a_duplicate_is_another_face(shell, rig, bones, keys, evaluated):
    face = make(rig, identity_keys=keys)
    other = duplicate(face, linked=False, bones=bones)
    assert mover_of(other) == other and mover_of(face) == face
    assert follows(other, evaluated, face) and follows(face, evaluated, other)
    before = evaluated(face)
    assert ops.random_person(seed=4) == {"FINISHED"}
    if bones:
        assert np.abs(evaluated(face) - before).max() < EXACT


@pytest.mark.parametrize("bones", [True, False], ids=["with its bones", "alone"])
def test_a_linked_duplicate_says_what_it_cannot_and_the_way_out(shell, rig, bones, evaluated):
    face = make(rig)
    other = duplicate(face, linked=True, bones=bones)
    before = evaluated(face)
    for press in (ops.random_person, ops.random_expression, ops.key_expression, ops.plain_person,
                  ops.copy_expression, ops.mirror_expression, ops.adopt_sketch):  # fmt: skip
        assert "linked duplicate" in error_of(press)
    said = shell.state.faces.trouble(other)
    assert "'Ann'" in said and "Make Independent" in said
    assert np.array_equal(evaluated(face), before)
    shows = evaluated(other)
    assert ops.stand_alone() == {"FINISHED"}
    assert np.abs(evaluated(other) - shows).max() < EXACT
    assert shell.state.faces.trouble(other) == ""
    assert follows(other, evaluated, face) and follows(face, evaluated, other)
    before = evaluated(face)
    ops.random_person(seed=3)
    assert np.abs(evaluated(face) - before).max() < EXACT
    if bones:
        other["gaze_yaw"] = 20.0
        refresh(other)
        assert np.abs(evaluated(face) - before).max() < EXACT


def test_made_single_user_by_blender_it_still_says_so(shell, rig, evaluated):
    face = make(rig)
    other = duplicate(face, linked=True)
    bpy.ops.object.make_single_user(type="SELECTED_OBJECTS", object=True, obdata=True)
    assert other.data != face.data and mover_of(other) == face
    assert "moves with the sliders of 'Ann'" in shell.state.faces.trouble(other)
    ops.stand_alone()
    assert follows(other, evaluated, face) and follows(face, evaluated, other)


def test_a_linked_duplicate_whose_original_is_gone(shell, rig, evaluated):
    face = make(rig)
    other = duplicate(face, linked=True)
    bpy.data.objects.remove(face)
    assert "is gone; press Make Independent" in shell.state.faces.trouble(other)
    ops.stand_alone()
    assert shell.state.faces.trouble(other) == "" and follows(other, evaluated)


def test_a_full_copy_of_the_scene_has_faces_of_its_own(shell, rig, evaluated):
    face = make(rig)
    bpy.ops.scene.new(type="FULL_COPY")
    copies = [o for o in faces_here() if o != face]
    assert len(copies) == 1 and mover_of(copies[0]) == copies[0]
    assert follows(copies[0], evaluated)


def test_copied_and_pasted(shell, rig, evaluated):
    face = make(rig)
    activate(face, face.parent)
    bpy.ops.view3d.copybuffer()
    bpy.ops.view3d.pastebuffer()
    other = next(o for o in bpy.context.selected_objects if is_face(o))
    assert other != face and follows(other, evaluated, face) and follows(face, evaluated, other)


def test_sliders_survive_renaming_undo_and_other_view_layers(shell, rig, evaluated):
    face, other = make(rig, "Ann"), make(rig, "Eve")
    for thing in (face, face.data, face.parent, face.data.shape_keys):
        thing.name = "Somebody Else"
    assert follows(face, evaluated, other) and follows(other, evaluated, face)
    name = face.name
    bpy.ops.ed.undo_push(message="before")
    face["smile"] = 9.0
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    face, other = bpy.data.objects[name], bpy.data.objects["Eve"]
    assert face["smile"] == 3.0 and follows(face, evaluated, other)
    seen = evaluated(face)
    face["jaw_open"] = 4.0
    refresh(face)
    assert shown_in(bpy.context.scene.view_layers.new("Second"), face, seen) > 1e-3
    scene = bpy.data.scenes.new("Other")
    for thing in (face, face.parent):
        scene.collection.objects.link(thing)
    face["jaw_open"] = 2.0
    refresh(face)
    assert shown_in(scene.view_layers[0], face, evaluated(face)) < EXACT


def shown_in(layer, face, points) -> float:
    """How far the face in a view layer is from points (n, 3) in core axes, metres at most."""
    layer.update()
    final = face.evaluated_get(layer.depsgraph)
    there = np.empty((len(final.data.vertices), 3), np.float32)
    final.data.vertices.foreach_get("co", there.reshape(-1))
    return float(np.abs(there[:, [0, 2, 1]] * (1, 1, -1) - points).max())
