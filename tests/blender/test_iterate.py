"""Fitting a face again: what the artist decided, pinned and locked stays; live faces follow."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.blender.state.session import session  # noqa: E402
from facs_rig import LANDMARKS, FaceParameters  # noqa: E402
from facs_rig.blender.pose import pose_of, set_pose  # noqa: E402

from .conftest import ROOT  # noqa: E402
from .sheets import draw_on, image_of, lines_of, pencil_of  # noqa: E402
from .test_shell import error_of, everything, press  # noqa: E402

OTHER = ROOT / "addon" / "sketches" / "angry_man.png"


@pytest.fixture
def face(shell, sketch, kept):
    return kept("fitted", lambda: press(sketch))


def item(face, name):
    return face.sketch_to_face.detections[name]


def again() -> set[str]:
    return bpy.ops.sketch_to_face.fit_again("EXEC_DEFAULT", True)


def test_fitting_again_changes_nothing_where_nothing_changed(face, evaluated):
    before, names = evaluated(face), everything()
    face.parent.location.x += 2.0
    bpy.context.view_layer.update()
    assert again() == {"FINISHED"}
    assert everything() == names
    assert np.abs(evaluated(face) - before - (2.0, 0, 0)).max() < 1e-6


def test_another_drawing_makes_the_same_object_another_face(face, evaluated, sketch, rig):
    from addon import pipeline

    face["gaze_yaw"] = 12.0
    face.keyframe_insert('["blink"]', frame=7)
    before, names = evaluated(face), everything()
    bpy.context.scene.sketch_to_face.sketch = str(OTHER)
    bpy.ops.sketch_to_face.adopt_sketch()
    again()
    fit = pipeline.fit(OTHER)
    assert everything() == names
    assert face["gaze_yaw"] == 12.0 and face.animation_data.action is not None
    face["gaze_yaw"] = 0.0
    set_pose(face, fit.parameters)
    assert np.abs(evaluated(face) - fit.vertices).max() < 1e-5
    assert np.abs(evaluated(face) - before).max() > 0.003


def test_undo_and_redo_of_fitting_again(face, evaluated):
    bpy.context.scene.sketch_to_face.sketch = str(OTHER)
    bpy.ops.sketch_to_face.adopt_sketch()
    bpy.ops.ed.undo_push(message="another sketch")
    name, before = face.name, evaluated(face)
    again()
    after = evaluated(bpy.data.objects[name])
    assert np.abs(after - before).max() > 0.003
    bpy.ops.ed.undo()
    assert np.array_equal(evaluated(bpy.data.objects[name]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects[name]), after)


def test_a_slider_of_the_list_is_the_slider_of_the_face(face):
    smile = item(face, "smile")
    assert smile.active and smile.intensity == pytest.approx(face["smile"])
    face["smile"] = 3.5
    assert smile.intensity == pytest.approx(3.5) and not smile.locked
    smile.intensity = 1.25
    assert face["smile"] == 1.25 and smile.locked


def test_what_the_artist_decides_is_kept(face, evaluated):
    item(face, "smile").active = False
    item(face, "brow_furrow").intensity = 4.0
    again()
    assert face["smile"] == 0.0 and not item(face, "smile").active
    assert face["brow_furrow"] == 4.0
    assert item(face, "smile").locked and item(face, "brow_furrow").locked
    assert item(face, "smile").probability > 0.5  # what was read is still said
    bpy.ops.sketch_to_face.unlock_all()
    again()
    assert face["smile"] > 0 and face["brow_furrow"] < 4.0


def test_accept_reject_lock_and_unlock(face):
    decide = bpy.ops.sketch_to_face.decide
    read = item(face, "smile").read
    decide(name="smile", decision="REJECT")
    assert face["smile"] == 0.0 and item(face, "smile").locked
    decide(name="smile", decision="ACCEPT")
    assert face["smile"] == pytest.approx(read)
    decide(name="cheek_puff", decision="ACCEPT")
    assert face["cheek_puff"] == 2.5  # nobody has read it: typical
    decide(name="cheek_puff", decision="FREE")
    assert not item(face, "cheek_puff").locked
    decide(name="frontalis", decision="LOCK")
    again()
    assert face["cheek_puff"] == 0.0 and face["frontalis"] == 0.0
    assert "knows of no action 'grin'" in error_of(lambda: decide(name="grin", decision="ACCEPT"))


def test_decisions_can_be_undone(face, evaluated):
    bpy.ops.ed.undo_push(message="before")
    name, before = face.name, evaluated(face)
    bpy.ops.sketch_to_face.decide("EXEC_DEFAULT", True, name="smile", decision="REJECT")
    after = evaluated(bpy.data.objects[name])
    assert np.abs(after - before).max() > 0.001
    bpy.ops.ed.undo()
    assert np.array_equal(evaluated(bpy.data.objects[name]), before)
    assert not item(bpy.data.objects[name], "smile").locked
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects[name]), after)


def landmark(face, evaluated, rig, name) -> np.ndarray:
    """Where a landmark of the face lies on its sketch, pixels."""
    zoom, u, v = face.sketch_to_face.camera
    place = evaluated(face)[rig.landmarks[LANDMARKS.index(name)]]
    x, y, z = place - np.array(face.matrix_world.translation)[[0, 2, 1]] * (1, 1, -1)
    near = zoom / (1 - z / (face.sketch_to_face.distance or np.inf))
    return np.array([u + near * x, v - near * y])


def test_a_pin_brings_the_face_there_and_stays(face, evaluated, rig):
    name = "mouth_corner_left"
    place = landmark(face, evaluated, rig, name) + (14.0, -9.0)
    assert bpy.ops.sketch_to_face.pin(name=name, place=place) == {"FINISHED"}
    again()
    assert np.linalg.norm(landmark(face, evaluated, rig, name) - place) < 3.0
    assert list(face.sketch_to_face.pins.keys()) == [name]
    again()
    assert np.allclose(face.sketch_to_face.pins[name].place, place, atol=1e-3)
    bpy.ops.sketch_to_face.unpin(name=name)
    again()
    assert np.linalg.norm(landmark(face, evaluated, rig, name) - place) > 8.0
    assert "no point 'nose_tipp' on a face" in error_of(
        lambda: bpy.ops.sketch_to_face.pin(name="nose_tipp", place=(1, 2))
    )


def test_pins_on_a_pencil_drawing_stay_when_the_page_grows(shell, sketch, evaluated, rig):
    settings = bpy.context.scene.sketch_to_face
    pencil = pencil_of(lines_of(sketch))
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil
    bpy.ops.sketch_to_face.fit()
    face = bpy.context.active_object
    name = "chin"
    place = landmark(face, evaluated, rig, name) + (0.0, 20.0)
    bpy.ops.sketch_to_face.pin(name=name, place=place)
    in_plane = np.array(face.sketch_to_face.pins[name].place)
    far = np.array([[0.25, 0.25], [0.28, 0.27], [0.3, 0.25]])
    draw_on(pencil.data.layers[0].frames[0], [far])
    again()
    assert np.allclose(face.sketch_to_face.pins[name].place, in_plane)
    page = np.array(face.sketch_to_face.page).reshape(2, 3)
    pixel = np.linalg.solve(page[:, :2], in_plane - page[:, 2])
    assert np.linalg.norm(pixel - place) > 20  # the page is another, the place is the same
    assert np.linalg.norm(landmark(face, evaluated, rig, name) - pixel) < 4.0


def test_a_drawing_without_a_face_leaves_the_old_one(face, evaluated, tmp_path):
    before = evaluated(face)
    blank = tmp_path / "blank.png"
    bpy.data.images.new("Blank", 200, 200).save(filepath=str(blank))
    bpy.context.scene.sketch_to_face.sketch = str(blank)
    bpy.ops.sketch_to_face.adopt_sketch()
    assert "blank" in error_of(again)
    assert np.array_equal(evaluated(face), before)


def test_only_faces_of_sketches_are_fitted_again(shell):
    bpy.ops.mesh.add_facs_face()
    assert not bpy.ops.sketch_to_face.fit_again.poll()
    assert not bpy.ops.sketch_to_face.pin.poll()


def test_a_face_survives_rename_save_reload_and_fits_again(face, evaluated, tmp_path):
    face.name = "Somebody Else"
    item(face, "smile").intensity = 2.0
    vertices, file = evaluated(face), str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    face = bpy.data.objects["Somebody Else"]
    assert np.array_equal(evaluated(face), vertices)
    again()
    assert face["smile"] == 2.0


def test_an_appended_face_is_as_good_as_made_here(face, evaluated, tmp_path):
    vertices, name, file = evaluated(face), face.name, str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(file) as (_, taken):
        taken.objects = [name]
    (appended,) = taken.objects
    for made in (appended, appended.parent):
        bpy.context.collection.objects.link(made)
    bpy.context.view_layer.objects.active = appended
    assert np.array_equal(evaluated(appended), vertices)
    appended.sketch_to_face.detections["smile"].intensity = 4.5
    assert again() == {"FINISHED"}
    assert appended["smile"] == 4.5


def test_a_linked_face_is_refused_with_a_way_out(face, tmp_path):
    name, file = face.name, str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(file, link=True) as (_, taken):
        taken.objects = [name]
    bpy.context.collection.objects.link(taken.objects[0])
    bpy.context.view_layer.objects.active = taken.objects[0]
    assert not bpy.ops.sketch_to_face.fit_again.poll()
    assert not bpy.ops.sketch_to_face.reset_sliders.poll()
    with pytest.raises(RuntimeError, match="make it local first"):
        again()


# --- live -----------------------------------------------------------------------------------------


def look() -> None:
    """One look of the timer, and whatever comes of it."""
    from addon.blender.background import live

    live.watch()
    live.wait()


def test_a_live_face_follows_its_image(shell, sketch, evaluated):
    settings = bpy.context.scene.sketch_to_face
    image = image_of(sketch)
    settings.sketch_kind, settings.sketch_image = "IMAGE", image
    bpy.ops.sketch_to_face.fit()
    face = bpy.context.active_object
    before = evaluated(face)
    other = image_of(OTHER, "Other")
    image.scale(*other.size)
    pixels = np.empty(len(other.pixels), np.float32)
    other.pixels.foreach_get(pixels)
    image.pixels.foreach_set(pixels)
    look()
    assert np.array_equal(evaluated(face), before)  # nobody said live
    face.sketch_to_face.live = True
    look()
    after = evaluated(face)
    assert np.abs(after - before).max() > 0.003
    mark = face.sketch_to_face.mark
    look()
    assert face.sketch_to_face.mark == mark and np.array_equal(evaluated(face), after)


def test_a_live_face_follows_the_pen_and_keeps_locks(shell, sketch, evaluated):
    settings = bpy.context.scene.sketch_to_face
    lines = lines_of(sketch)
    pencil = pencil_of(lines[len(lines) // 4 :])
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil
    bpy.ops.sketch_to_face.fit()
    face = bpy.context.active_object
    face.sketch_to_face.live = True
    item(face, "jaw_open").intensity = 3.0
    before = evaluated(face)
    bpy.context.view_layer.objects.active = pencil
    draw_on(pencil.data.layers[0].frames[0], lines[: len(lines) // 4])
    look()
    assert np.abs(evaluated(face) - before).max() > 1e-4
    assert face["jaw_open"] == 3.0


def test_a_live_face_says_what_is_wrong_once_and_waits(face, evaluated, tmp_path, sketch):
    from addon.blender.background import live

    file = tmp_path / "drawing.png"
    file.write_bytes(sketch.read_bytes())
    bpy.context.scene.sketch_to_face.sketch = str(file)
    bpy.ops.sketch_to_face.adopt_sketch()
    again()
    face.sketch_to_face.live = True
    before = evaluated(face)
    file.write_bytes(b"half written")
    look()
    assert "drawing.png" in session.troubles[face.name]
    assert np.array_equal(evaluated(face), before)
    live.watch()
    assert session.refit is None  # the same broken file is not read again
    file.write_bytes(sketch.read_bytes())
    look()
    assert face.name not in session.troubles


def test_a_live_face_is_at_peace_once_its_sketch_is_back_or_nobody_watches(face, tmp_path, sketch):

    settings, before = face.sketch_to_face, face.sketch_to_face.sketch
    settings.live = True
    for end in (lambda: setattr(settings, "sketch", before), lambda: setattr(settings, "live", 0)):
        settings.sketch = str(tmp_path / "gone.png")
        look()
        assert "gone.png" in session.troubles[face.name]
        end()
        look()
        assert not session.troubles and not session.refused


def test_a_fault_of_ours_is_logged_once_and_not_tried_again(face, evaluated, monkeypatch, tmp_path):
    from addon import pipeline

    asked = []

    def broken(*_args, **_options):
        asked.append(True)
        raise ZeroDivisionError("a fault of ours")

    monkeypatch.setattr(pipeline, "fit", broken)
    face.sketch_to_face.live, face.sketch_to_face.mark = True, ""
    before = evaluated(face)
    look()
    look()
    assert len(asked) == 1
    assert "Live broke (ZeroDivisionError)" in session.troubles[face.name]
    assert (tmp_path / "log.txt").read_text().count("Traceback") == 1
    assert np.array_equal(evaluated(face), before)


def test_a_live_face_that_is_deleted_meanwhile_is_no_trouble(face):
    from addon.blender.background import live

    face.sketch_to_face.live = True
    face.sketch_to_face.mark = ""
    live.watch()
    bpy.data.objects.remove(face)
    live.wait()
    assert session.refit is None


def test_pose_of_a_face_tells_who_it_is(face, sketch):
    from addon import pipeline

    fit = pipeline.fit(sketch)
    assert pose_of(face).identity == pytest.approx(dict(fit.parameters.identity))
    assert isinstance(pose_of(face), FaceParameters)
