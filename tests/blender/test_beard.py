"""Beards in Blender: they go with the skin, whatever the face does and whoever it becomes."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.beard.beard import to_json  # noqa: E402
from facs_rig.beard.mesh import beard_mesh  # noqa: E402
from facs_rig.beard.presets import PRESETS, preset  # noqa: E402
from facs_rig.blender import build_face  # noqa: E402
from facs_rig.blender.armature import to_blender  # noqa: E402
from facs_rig.blender.beard import (  # noqa: E402
    KEPT,
    add_beard,
    beard_of,
    bound_of,
    has_beard,
    made_of,
    remove_beard,
)
from facs_rig.blender.hair import add_hair, colour_of, hair_of, set_colour  # noqa: E402
from facs_rig.blender.pose import identity_of, set_pose  # noqa: E402
from facs_rig.blender.reshape import reshape  # noqa: E402
from facs_rig.blender.shape import moves, shown  # noqa: E402
from facs_rig.blender.steps import finish  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.hair.presets import preset as haircut  # noqa: E402
from facs_rig.levels import at_level  # noqa: E402

from .test_shell import error_of, everything  # noqa: E402
from .test_sketch_panels import Layout  # noqa: E402

SAME = 1e-4  # metres
WHO = {"gender": 1.0, "age": 0.4, "head_width": 0.5, "neck_length": -0.4}
THEN = {"gender": 0.7, "age": 0.9, "head_width": -0.7, "head_height": 0.6, "neck_length": 0.5}
OPEN = FaceParameters(
    {"jaw_open": 8.0, "smile": 4.0}, WHO, head=(0.5, -0.3, 0.2), neck=(0.3, 0.2, -0.1)
)


@pytest.fixture(params=[False, True], ids=["baked", "keys"])
def plain(request, empty_blender, rig):
    """A face without a sketch that a beard was put on, its person baked or in keys."""
    made = build_face("Somebody", rig, FaceParameters(identity=WHO), identity_keys=request.param)
    add_beard(made, rig, preset("full beard"))
    return made


def wanted(face, rig, parameters, name="full beard"):
    return beard_mesh(rig, identity_of(face), preset(name)).on(rig.pose(parameters))


def test_the_object_is_the_core_s_beard(plain, rig, evaluated):
    beard = beard_of(plain)
    made = beard_mesh(rig, identity_of(plain), preset("full beard"))
    assert beard.name == "Somebody Beard" and len(beard.data.vertices) == len(made.points)
    assert np.abs(evaluated(beard) - made.points).max() < SAME
    assert to_json(made_of(plain)) == to_json(preset("full beard"))
    assert beard.parent == plain.parent and beard.users_collection == plain.users_collection
    assert colour_of(beard) == pytest.approx(made.colour)
    assert [material.name for material in beard.data.materials] == ["Beard"]
    assert not beard.data.validate()


def test_it_goes_with_the_expression(plain, rig, evaluated):
    posed = dataclasses.replace(OPEN, identity=identity_of(plain))
    before = evaluated(beard_of(plain))
    set_pose(plain, posed)
    after = evaluated(beard_of(plain))
    assert np.abs(after - wanted(plain, rig, posed)).max() < SAME
    assert np.abs(after - before).max() > 0.02


@pytest.mark.parametrize("name", PRESETS)
def test_a_slider_alone_moves_it(empty_blender, rig, evaluated, name):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    beard = add_beard(face, rig, preset(name))
    face["jaw_open" if name != "moustache" else "smile"] = 6.0
    face.update_tag()
    aus = {"jaw_open" if name != "moustache" else "smile": 6.0}
    posed = wanted(face, rig, FaceParameters(aus, WHO), name)
    assert np.abs(evaluated(beard) - posed).max() < SAME


def test_it_goes_with_the_person(plain, rig, evaluated):
    made = beard_mesh(rig, identity_of(plain), preset("full beard"))
    before = evaluated(beard_of(plain))
    reshape(plain, rig, THEN)
    assert np.abs(evaluated(beard_of(plain)) - made.on(rig.neutral(THEN))).max() < SAME
    reshape(plain, rig, WHO)
    assert np.abs(evaluated(beard_of(plain)) - before).max() < 1e-6


def test_it_goes_with_skin_that_was_sculpted(plain, rig, evaluated):
    key = plain.shape_key_add(name="Chin", from_mix=False)
    key.value = 0.0
    chin = beard_of(plain).data.attributes["root_0"].data[0].value
    bound = bound_of(beard_of(plain))
    for k in range(len(plain.data.vertices)):
        key.data[k].co.y -= 0.02
    before = evaluated(beard_of(plain))
    key.value = 1.0
    assert np.abs(evaluated(beard_of(plain)) - before - (0, 0, 0.02)).max() < SAME
    assert 0 <= chin < rig.n_vertices and bound.index.max() < rig.n_vertices


@pytest.mark.parametrize("level", ["medium", "game"])
def test_it_grows_on_lighter_faces(empty_blender, rig, evaluated, level):
    light = at_level(rig, level)
    face = build_face("Light", light, FaceParameters(identity=WHO))
    beard = add_beard(face, rig, preset("goatee"))
    posed = dataclasses.replace(OPEN, identity=WHO)
    set_pose(face, posed)
    there = beard_mesh(light, WHO, preset("goatee")).on(light.pose(posed))
    assert np.abs(evaluated(beard) - there).max() < SAME


def test_what_is_edited_stays_edited(plain, evaluated):
    beard = beard_of(plain)
    before = evaluated(beard)
    beard.data.vertices[7].co.z += 0.01
    beard.data.update()
    moved = evaluated(beard) - before
    assert moved[7] == pytest.approx((0, 0.01, 0), abs=1e-6)
    assert np.abs(np.delete(moved, 7, axis=0)).max() < 1e-6


def test_hair_and_beard_are_told_apart(plain, rig):
    hair = add_hair(plain, rig, haircut("crop"))
    assert hair_of(plain) == hair != beard_of(plain)
    remove_beard(plain)
    assert hair_of(plain) == hair and beard_of(plain) is None


def test_making_it_anew_keeps_object_and_colour(plain, rig):
    beard = beard_of(plain)
    set_colour(beard, (0.6, 0.1, 0.1))
    assert add_beard(plain, rig, preset("stubble")) == beard
    assert colour_of(beard) == pytest.approx((0.6, 0.1, 0.1))
    assert len(bpy.data.node_groups) == 1


def test_removing_leaves_nothing_but_what_it_was(plain):
    remove_beard(plain)
    assert beard_of(plain) is None and has_beard(plain) and made_of(plain) is not None
    assert not [mesh for mesh in bpy.data.meshes if "Beard" in mesh.name]
    assert not bpy.data.node_groups and "Beard" not in bpy.data.materials
    remove_beard(plain)


def test_what_cannot_be_written_is_one_sentence(plain, rig):
    bpy.context.view_layer.objects.active = beard_of(plain)
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(InputError, match="'Somebody Beard' is being edited"):
        add_beard(plain, rig, preset("stubble"))
    bpy.ops.object.mode_set(mode="OBJECT")
    beard_of(plain)[KEPT] = "{}"
    with pytest.raises(InputError, match="what is kept of the beard"):
        made_of(plain)


def test_it_is_shown_to_files_with_its_moves(plain, rig):
    shape = shown(plain, rig)
    (worn,) = shape.worn
    assert worn.name == "beard" and len(worn.points) == len(beard_of(plain).data.vertices)
    found = finish(moves(plain, rig, shape))
    from facs_rig.blender.beard_files import moving

    (worn,) = moving(plain, dataclasses.replace(shape, moves=found)).worn
    assert np.abs(worn.moves["jaw_open"]).max() > 0.005
    assert np.abs(worn.moves.get("frontalis", np.zeros(3))).max() < 1e-3
    assert to_blender(worn.points).shape == worn.points.shape


# --- the buttons ----------------------------------------------------------------------------------


@pytest.fixture
def face(shell, rig):
    made = build_face("Somebody", rig, FaceParameters(identity=WHO))
    bpy.context.view_layer.objects.active = made
    bpy.ops.ed.undo_push(message="a face")
    return made


def press(kind):
    return bpy.ops.sketch_to_face.beard("EXEC_DEFAULT", True, kind=kind)


def test_any_face_can_be_given_one_and_undo_takes_it(face):
    name, before = face.name, everything()
    assert press("GOATEE") == {"FINISHED"}
    assert made_of(bpy.data.objects[name]) is not None
    bpy.context.view_layer.objects.active = beard_of(face)  # the panel is the face's then, too
    assert press("STUBBLE") == {"FINISHED"}
    assert to_json(made_of(face)) == to_json(preset("stubble"))
    bpy.ops.ed.undo()
    assert to_json(made_of(bpy.data.objects[name])) == to_json(preset("goatee"))
    bpy.ops.ed.undo()
    assert everything() == before and beard_of(bpy.data.objects[name]) is None


def test_taken_away_and_made_again(face):
    press("FULL_BEARD")
    count = len(beard_of(face).data.vertices)
    assert press("NONE") == {"FINISHED"}
    assert beard_of(face) is None
    assert press("AGAIN") == {"FINISHED"}
    assert len(beard_of(face).data.vertices) == count


def test_the_panel_has_the_beards_and_the_colour(face):
    from addon.blender.panels.fit import draw_beard

    def drawn():
        layout = Layout()
        draw_beard(layout, face)
        return str(layout.noted)

    assert "beard_colour" not in drawn()
    press("MOUSTACHE")
    assert "beard_colour" in drawn()
    face.sketch_to_face.beard_colour = (0.5, 0.1, 0.2)
    assert colour_of(beard_of(face)) == pytest.approx((0.5, 0.1, 0.2))


def test_an_independent_face_has_a_beard_of_its_own(face, rig, evaluated):
    press("GOATEE")
    beard = beard_of(face)
    for thing in (face, face.parent, beard):
        thing.select_set(True)
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.duplicate(linked=True)
    twin = bpy.context.active_object
    assert bpy.ops.sketch_to_face.stand_alone() == {"FINISHED"}
    other = beard_of(twin)
    assert other is not None and other != beard
    before = evaluated(beard)
    reshape(twin, rig, THEN)
    assert np.array_equal(evaluated(beard), before)
    assert np.abs(evaluated(other) - before).max() > 0.002


def test_a_forged_beard_is_one_sentence(face):
    press("GOATEE")
    beard_of(face)[KEPT] = "{}"
    said = error_of(lambda: press("AGAIN"))
    assert said.startswith("What is kept of the beard") and "\n" not in said
    assert SimpleNamespace(face=face).face == face


@pytest.mark.parametrize("ending", [".glb", ".fbx"])
def test_it_moves_in_animated_files(empty_blender, rig, tmp_path, ending):
    from facs_rig.blender.files import write_moving

    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    beard = add_beard(face, rig, preset("stubble"))
    for frame, value in ((1, 0.0), (4, 8.0)):
        face["jaw_open"] = value
        face.keyframe_insert('["jaw_open"]', frame=frame)
    path = tmp_path / f"moving{ending}"
    write_moving(path, face)
    assert beard.name == "Somebody Beard" and len(bpy.data.objects) == 3
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if ending == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path))
    else:
        bpy.ops.import_scene.fbx(filepath=str(path))
    again = next(o for o in bpy.data.objects if o.type == "MESH" and "Beard" in o.name)
    keys = again.data.shape_keys
    assert "jaw_open" in keys.key_blocks
    bpy.context.scene.frame_set(4)
    assert keys.key_blocks["jaw_open"].value > 0.9
