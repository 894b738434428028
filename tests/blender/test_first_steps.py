"""What an artist meets in the first ten minutes: a file with things in it, odd scenes and modes."""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector  # noqa: E402

from addon import pipeline  # noqa: E402
from facs_rig.blender.pose import is_face  # noqa: E402

from .conftest import ROOT  # noqa: E402
from .test_shell import error_of, press  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
SKETCHES = ROOT / "addon" / "sketches"
ops = bpy.ops.sketch_to_face


def box_of(thing) -> np.ndarray:
    """(2, 3) lowest and highest corner in the world."""
    bpy.context.view_layer.update()
    matrix = np.array(thing.matrix_world)
    corners = np.array(thing.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def apart(one, other) -> bool:
    a, b = box_of(one), box_of(other)
    return bool((a[0] > b[1]).any() or (b[0] > a[1]).any())


def cube(size, place=(0.0, 0.0, 0.0)):
    bpy.ops.mesh.primitive_cube_add(size=size, location=place)
    return bpy.context.active_object


@pytest.fixture
def factory(shell):
    """The file that Blender opens with: cube, camera, light. The add-on stays on."""
    shell.unregister()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bpy.ops.wm.read_factory_settings()
    shell.register()
    return shell


def test_faces_of_the_factory_scene_stand_clear_and_are_selected(factory):
    assert ops.try_sample(drawing="angry_man") == {"FINISHED"}
    made = []
    for button in (ops.fit, ops.fit, bpy.ops.mesh.add_facs_face):
        button()
        made.append(bpy.context.active_object)
        assert is_face(made[-1]) and bpy.context.selected_objects == [made[-1]]
    things = [bpy.data.objects["Cube"], *made]
    for k, one in enumerate(things):
        assert all(apart(one, other) for other in things[k + 1 :]), one.name
    assert np.abs(box_of(made[-1])).max() < 2.5  # all in a row at the cube's side, none far away


def test_what_is_hidden_or_all_around_is_not_in_the_way(shell):
    hidden, room = cube(1.0), cube(6.0)
    hidden.hide_set(True)
    bpy.ops.mesh.add_facs_face()
    assert np.allclose(bpy.context.active_object.parent.location, 0)
    assert room.visible_get()


def test_a_floor_is_stood_upon(shell):
    bpy.ops.mesh.primitive_plane_add(size=50.0)
    bpy.ops.mesh.add_facs_face()
    low, high = box_of(bpy.context.active_object)
    assert 0 < low[2] < 0.15 and abs(low[0] + high[0]) < 0.05


def test_a_cursor_that_was_put_somewhere_is_meant(shell):
    cube(1.0, (0.0, 0.0, 1.0))
    bpy.context.scene.cursor.location = (0.0, 0.0, 1.4)
    bpy.ops.mesh.add_facs_face()
    assert np.allclose(bpy.context.active_object.parent.location, (0.0, 0.0, 1.4))


@pytest.mark.parametrize("drawing", [path.stem for path in sorted(SKETCHES.glob("*.png"))])
def test_a_sample_is_chosen_with_one_press(shell, drawing):
    settings = bpy.context.scene.sketch_to_face
    settings.sketch_kind = "PENCIL"
    assert ops.try_sample(drawing=drawing) == {"FINISHED"}
    assert settings.sketch_kind == "FILE" and Path(settings.sketch).samefile(
        SKETCHES / f"{drawing}.png"
    )


@pytest.fixture
def fitted(shell, sketch, kept):
    return kept("fitted", lambda: press(sketch))


@pytest.mark.parametrize("mode", ["SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT"])
def test_fit_again_leaves_the_mode_and_comes_back(fitted, mode):
    place = tuple(fitted.parent.location)
    bpy.ops.object.mode_set(mode=mode)
    fitted["smile"] = 0.0
    assert ops.fit_again() == {"FINISHED"}
    assert fitted.mode == mode and fitted["smile"] > 1
    assert tuple(fitted.parent.location) == place


def test_fit_again_refuses_edit_mode_at_once(fitted):
    bpy.ops.object.mode_set(mode="EDIT")
    assert not ops.fit_again.poll()


@pytest.mark.parametrize("state", ["hide_set", "hide_viewport", "hide_select"])
def test_a_face_that_is_hidden_or_locked_is_fitted_again(fitted, state):
    if state == "hide_set":
        fitted.hide_set(True)
    else:
        setattr(fitted, state, True)
    bpy.context.view_layer.objects.active = fitted
    fitted["smile"] = 0.0
    assert ops.fit_again() == {"FINISHED"} and fitted["smile"] > 1


@pytest.mark.parametrize(
    "system, scale, units",
    [("METRIC", 0.01, 100.0), ("METRIC", 1.0, 1.0), ("IMPERIAL", 0.3048, 1 / 0.3048),
     ("NONE", 0.01, 1.0)],
)  # fmt: skip
def test_a_head_is_as_tall_as_a_head_in_every_scene(shell, sketch, tmp_path, system, scale, units):
    from trimesh import load

    bpy.context.scene.unit_settings.system = system
    bpy.context.scene.unit_settings.scale_length = scale
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    ops.fit()
    face = bpy.context.active_object
    before = box_of(face)
    core = pipeline.fit(sketch)
    tall = np.ptp(core.vertices[:, 1])
    assert 0.24 < tall < 0.28  # metres, from the neck's cut to the crown
    assert np.ptp(before[:, 2]) / units == pytest.approx(tall, abs=0.004)
    error = pipeline.report(core)["contour_error_px"]["fitted"]
    assert face.sketch_to_face.contour_error_px[2] == pytest.approx(error, abs=0.3)
    assert ops.fit_again() == {"FINISHED"}
    assert np.abs(box_of(face) - before).max() < 1e-4 * units
    ops.pin(name="chin", place=shell.viewport.overlay.on_page(face, np.array([[0.0, -0.115]]))[0])
    in_world = shell.viewport.overlay.plane_of(face) @ Vector((0.0, -0.115, 0.0))
    lower = -0.115 * face.sketch_to_face.closeness
    assert in_world.z == pytest.approx(lower * units, rel=1e-4)
    assert np.allclose(shell.viewport.overlay.pins_on_plane(face)["chin"], (0.0, -0.115), atol=1e-4)
    path = tmp_path / "face.obj"
    ops.export(filepath=str(path))
    tall = float(load(path, process=False, force="mesh").extents.max())
    assert tall == pytest.approx(0.258, abs=0.02)


@pytest.mark.parametrize("layer_too", [False, True])
def test_a_face_goes_to_the_scene_that_a_script_names(shell, sketch, layer_too):
    other = bpy.data.scenes.new("Other")
    other.sketch_to_face.sketch = str(sketch)
    named = {"scene": other} | ({"view_layer": other.view_layers[0]} if layer_too else {})
    with bpy.context.temp_override(**named):
        assert ops.fit() == {"FINISHED"}
        assert bpy.ops.mesh.add_facs_face() == {"FINISHED"}
    made = [thing for thing in bpy.data.objects if is_face(thing)]
    assert len(made) == 2 and all(face.users_scene == (other,) for face in made)
    assert other.view_layers[0].objects.active in made
    assert not len(bpy.context.scene.objects)


def test_without_a_window_the_active_face_is_still_known(fitted, capfd):
    capfd.readouterr()
    with bpy.context.temp_override(window=None):
        assert ops.fit_again.poll() and ops.random_person.poll()
        assert ops.random_expression(seed=2) == {"FINISHED"}
        assert ops.new_drawing() == {"FINISHED"}
    assert "Traceback" not in "".join(capfd.readouterr())


def test_the_frame_of_a_sequence_that_is_shown_is_read(shell, tmp_path):
    for number, name in ((7, "angry_man"), (8, "smiling_woman")):
        shutil.copy(SKETCHES / f"{name}.png", tmp_path / f"shot2_{number:04d}.png")
    scene, settings = bpy.context.scene, bpy.context.scene.sketch_to_face
    image = bpy.data.images.load(str(tmp_path / "shot2_0007.png"))
    image.source = "SEQUENCE"
    settings.sketch_kind, settings.sketch_image = "IMAGE", image
    marks = []
    for frame, smiles in ((1, False), (2, True), (40, False)):
        scene.frame_set(frame)
        marks.append(shell.state.sources.source_of(settings).mark)
        ops.fit()
        found = bpy.context.active_object.sketch_to_face.detections["smile"]
        assert found.active == smiles, frame
    assert marks[0] == marks[2] != marks[1]


def test_a_movie_or_a_render_says_what_to_do(shell, tmp_path):
    settings = bpy.context.scene.sketch_to_face
    shutil.copy(SKETCHES / "angry_man.png", tmp_path / "film.png")
    movie = bpy.data.images.load(str(tmp_path / "film.png"))
    movie.source = "MOVIE"
    settings.sketch_kind, settings.sketch_image = "IMAGE", movie
    said = error_of(ops.fit)
    assert "movie" in said and "save the frame" in said
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 16
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.samples = 1
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.ops.render.render()
    settings.sketch_image = bpy.data.images["Render Result"]
    said = error_of(ops.fit)
    assert "Save As" in said or "blank" in said
