"""Hair in Blender: it follows head and person, stays as it was edited, goes to files."""

from __future__ import annotations

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.blender.background import live  # noqa: E402
from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender import build_face, set_identity  # noqa: E402
from facs_rig.blender.armature import from_blender, to_blender  # noqa: E402
from facs_rig.blender.hair import (  # noqa: E402
    CUT,
    add_hair,
    colour_of,
    cut_of,
    hair_of,
    kind_of,
    remove_hair,
    style_of,
)
from facs_rig.blender.pose import identity_of, pose_of, set_pose  # noqa: E402
from facs_rig.blender.reshape import reshape  # noqa: E402
from facs_rig.blender.shape import shown  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.hair.cut import from_json, to_json  # noqa: E402
from facs_rig.hair.follow import bind  # noqa: E402
from facs_rig.hair.mesh import KINDS, hair_mesh  # noqa: E402
from facs_rig.hair.presets import PRESETS, preset  # noqa: E402
from facs_rig.hair.style import Style  # noqa: E402
from facs_rig.levels import at_level  # noqa: E402

from .rigs import select  # noqa: E402
from .test_iterate import OTHER, again  # noqa: E402
from .test_shell import error_of, everything, press  # noqa: E402
from .test_sketch_panels import Layout  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
SAME = 1e-4  # metres
WHO = {"gender": 0.1, "age": 0.4, "head_width": 0.5, "neck_length": -0.4}
THEN = {"gender": 1.0, "age": 0.9, "head_width": -0.7, "head_height": 0.6, "neck_length": 0.5}
TURNED = FaceParameters(
    {"frontalis": 6.0, "jaw_open": 5.0}, head=(0.5, -0.3, 0.2), neck=(0.3, 0.2, -0.1)
)


@pytest.fixture
def face(shell, sketch, kept):
    return kept("fitted", lambda: press(sketch))


@pytest.fixture(scope="session")
def cut():
    return preset(next(iter(PRESETS)))


@pytest.fixture(params=[False, True], ids=["baked", "keys"])
def plain(request, empty_blender, rig, cut):
    """A face without a sketch that hair was put on, its person baked or in keys."""
    made = build_face("Somebody", rig, FaceParameters(identity=WHO), identity_keys=request.param)
    add_hair(made, rig, cut)
    return made


def places(hair) -> np.ndarray:
    out = np.empty((len(hair.data.vertices), 3), np.float32)
    hair.data.vertices.foreach_get("co", out.ravel())
    return out


def turned(face) -> FaceParameters:
    return dataclasses.replace(TURNED, identity=identity_of(face))


def light_face(rig):
    """A face of few vertices, selected."""
    face = build_face("Light", at_level(rig, "game"), FaceParameters(identity=WHO))
    select(face)
    return face


# --- what is kept of a cut ------------------------------------------------------------------------


@pytest.mark.parametrize("name", PRESETS)
def test_a_cut_is_kept_as_text(name):
    cut = preset(name)
    again = from_json(to_json(cut))
    assert to_json(again) == to_json(cut)
    assert np.array_equal(again.thick, cut.thick) and again.part == cut.part
    assert [ball.plait for ball in again.balls] == [ball.plait for ball in cut.balls]


@pytest.mark.parametrize(
    "forged", ["", "null", "[]", "{}", '"edge"', '{"edge": 1}', "{", "[[1, 2]]"]
)
def test_forged_text_is_no_cut(forged):
    with pytest.raises(InputError, match="what is kept of the hair") as caught:
        from_json(forged)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("key", ["edge", "thick", "wave", "balls", "part"])
@pytest.mark.parametrize("value", ["x", [[1]], {"a": 1}, float("nan"), 7e9])
def test_forged_values_are_no_cut(cut, key, value):
    forged = {**json.loads(to_json(cut)), key: value}
    with pytest.raises(InputError, match="what is kept of the hair"):
        from_json(json.dumps(forged))


# --- the object -----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_the_object_is_the_core_s_hair(plain, rig, cut, kind):
    hair = add_hair(plain, rig, cut, kind)
    made = hair_mesh(rig, identity_of(plain), cut, kind)
    assert hair == hair_of(plain) and hair.name == "Somebody Hair" and kind_of(plain) == kind
    assert np.abs(places(hair) - to_blender(made.points)).max() < 1e-6
    assert to_json(cut_of(plain)) == to_json(cut)
    assert hair.parent == plain.parent and hair.users_collection == plain.users_collection
    assert all(polygon.use_smooth for polygon in hair.data.polygons)
    assert not hair.data.validate()
    assert colour_of(hair) == pytest.approx(made.colour)
    shade = hair.data.attributes["shade"].data
    assert shade[0].value == pytest.approx(made.shade[0])
    assert [material.name for material in hair.data.materials] == ["Hair"]


def test_it_follows_head_and_neck_as_the_skull_does(plain, rig, cut, evaluated):
    made = hair_mesh(rig, identity_of(plain), cut)
    set_pose(plain, turned(plain))
    on = evaluated(hair_of(plain))
    assert np.abs(on - made.on(evaluated(plain))).max() < SAME
    assert np.abs(on - made.on(rig.pose(turned(plain)))).max() < SAME
    assert np.abs(on - made.points).max() > 0.02


def test_it_follows_the_person(plain, rig, cut, evaluated):
    made = hair_mesh(rig, identity_of(plain), cut)
    before = places(hair_of(plain))
    reshape(plain, rig, THEN)
    assert np.abs(places(hair_of(plain)) - to_blender(made.on(rig.neutral(THEN)))).max() < SAME
    set_pose(plain, turned(plain))
    assert np.abs(evaluated(hair_of(plain)) - made.on(evaluated(plain))).max() < SAME
    for who in ({}, {"head_depth": 1.0, "weight": 0.9}, {"age": 0.0}, WHO):
        reshape(plain, rig, who)
    assert np.abs(places(hair_of(plain)) - before).max() < 1e-6  # nothing adds up


def test_it_follows_identity_keys_that_are_set_one_by_one(empty_blender, rig, cut):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO), identity_keys=True)
    add_hair(face, rig, cut)
    made = hair_mesh(rig, identity_of(face), cut)
    set_identity(face, rig, THEN)
    assert np.abs(places(hair_of(face)) - to_blender(made.on(rig.neutral(THEN)))).max() < SAME


@pytest.mark.parametrize("level", ["medium", "game"])
def test_it_follows_lighter_faces_as_the_full_one(empty_blender, rig, cut, level):
    face = build_face("Light", at_level(rig, level), FaceParameters(identity=WHO))
    add_hair(face, rig, cut)
    made = hair_mesh(rig, identity_of(face), cut)
    reshape(face, rig, THEN)
    assert np.abs(places(hair_of(face)) - to_blender(made.on(rig.neutral(THEN)))).max() < SAME


def test_edited_hair_keeps_its_shape(plain, rig, cut):
    """Pulled, cut away in part, and with a shape key of the artist's."""
    import bmesh

    hair = hair_of(plain)
    editing = bmesh.new()
    editing.from_mesh(hair.data)
    editing.verts.ensure_lookup_table()
    for vertex in editing.verts:
        vertex.co.z += 0.01 * np.sin(40 * vertex.co.x)
    bmesh.ops.delete(editing, geom=editing.verts[:100], context="VERTS")
    editing.to_mesh(hair.data)
    editing.free()
    hair.shape_key_add(name="Basis", from_mix=False)
    wind = hair.shape_key_add(name="Wind", from_mix=False)
    wind.data[5].co.x += 0.03
    before = places(hair)
    wanted = to_blender(
        bind(from_blender(before), rig, identity_of(plain)).points(rig.neutral(THEN))
    )
    reshape(plain, rig, THEN)
    assert np.abs(places(hair) - wanted).max() < 1e-6
    keys = hair.data.shape_keys.key_blocks
    assert keys["Wind"].data[5].co.x - keys["Basis"].data[5].co.x == pytest.approx(0.03, abs=1e-6)
    reshape(plain, rig, {})
    reshape(plain, rig, WHO)
    assert np.abs(places(hair) - before).max() < 1e-6


def test_it_is_found_by_what_carries_it(plain, rig, cut):
    hair = hair_of(plain)
    hair.name, hair.data.name = "Wig", "Wig"
    other = build_face("Other", rig, FaceParameters())
    assert hair_of(other) is None and cut_of(other) is None and kind_of(other) == ""
    assert hair_of(plain) == hair
    assert add_hair(plain, rig, cut, "surface") == hair and hair.data.name == "Wig"
    reshape(plain, rig, THEN)


def test_making_it_anew_keeps_the_artist_s_colour(plain, rig, cut):
    from facs_rig.blender.hair import set_colour

    hair = hair_of(plain)
    set_colour(hair, (0.6, 0.1, 0.1))
    blond = dataclasses.replace(cut, colour=0.0)
    add_hair(plain, rig, blond)
    assert colour_of(hair) == pytest.approx((0.6, 0.1, 0.1))
    remove_hair(plain)
    dark = add_hair(plain, rig, dataclasses.replace(cut, colour=1.0))
    before = colour_of(dark)
    add_hair(plain, rig, blond)
    assert sum(colour_of(dark)) > sum(before)


def test_removing_leaves_nothing_but_the_cut(plain, cut):
    remove_hair(plain)
    assert hair_of(plain) is None and to_json(cut_of(plain)) == to_json(cut)
    assert not [m for m in bpy.data.meshes if "Hair" in m.name]
    assert "Hair" not in bpy.data.materials
    remove_hair(plain)


def test_hair_that_is_edited_or_linked_is_said_so(plain, rig, cut, tmp_path):
    hair, before = hair_of(plain), identity_of(plain)
    bpy.context.view_layer.objects.active = hair
    for mode in ("EDIT", "SCULPT"):
        bpy.ops.object.mode_set(mode=mode)
        for change in (
            lambda: reshape(plain, rig, THEN),
            lambda: add_hair(plain, rig, cut),
            lambda: remove_hair(plain),
        ):
            with pytest.raises(InputError, match="'Somebody Hair' is being edited"):
                change()
        assert identity_of(plain) == before
        bpy.ops.object.mode_set(mode="OBJECT")
    file = str(tmp_path / "wig.blend")
    bpy.data.libraries.write(file, {hair.data})
    with bpy.data.libraries.load(file, link=True) as (_, taken):
        taken.meshes = [hair.data.name]
    hair.data = taken.meshes[0]
    there = places(hair)
    with pytest.raises(InputError, match="linked from another file"):
        add_hair(plain, rig, cut)
    reshape(plain, rig, THEN)
    assert np.array_equal(places(hair), there)


def test_without_bones_there_is_no_hair(empty_blender, rig, cut):
    face = build_face("Somebody", rig, FaceParameters())
    add_hair(face, rig, cut)
    bpy.data.objects.remove(face.parent)
    assert hair_of(face) is None and kind_of(face) == ""
    reshape(face, rig, THEN)
    remove_hair(face)
    with pytest.raises(InputError, match="lost its bones"):
        add_hair(face, rig, cut)


def test_an_independent_face_has_hair_of_its_own(shell, rig, cut):
    face = build_face("Somebody", rig, FaceParameters())
    hair = add_hair(face, rig, cut)
    for thing in (face, face.parent, hair):
        thing.select_set(True)
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.duplicate(linked=True)
    twin = bpy.context.active_object
    assert hair_of(twin) not in (None, hair)
    assert bpy.ops.sketch_to_face.stand_alone() == {"FINISHED"}
    before = places(hair)
    reshape(twin, rig, THEN)
    assert np.array_equal(places(hair), before)
    assert np.abs(places(hair_of(twin)) - before).max() > 0.002


def test_a_face_that_leaves_a_shared_rig_takes_a_copy_of_the_hair(shell, rig, cut):
    face = build_face("Somebody", rig, FaceParameters())
    hair = add_hair(face, rig, cut)
    bpy.ops.object.select_all(action="DESELECT")
    face.select_set(True)
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.duplicate(linked=True)
    twin = bpy.context.active_object
    assert hair_of(twin) == hair
    bpy.ops.sketch_to_face.stand_alone()
    assert hair_of(twin) != hair and hair_of(face) == hair
    assert hair_of(twin).modifiers[0].object == twin.modifiers[0].object != face.parent


# --- the buttons ----------------------------------------------------------------------------------


def test_the_button_puts_the_drawn_hair_on(face, sketch, evaluated):
    from addon import pipeline

    fit = pipeline.fit(sketch)
    hair = hair_of(face)
    assert hair is not None and kind_of(face) == "locks"
    assert hair.name == f"{face.name} Hair"
    assert np.abs(evaluated(hair) - fit.hair.on(fit.vertices)).max() < SAME
    assert bpy.context.active_object == face and not hair.select_get()


def test_one_undo_takes_hair_and_face(shell, sketch, evaluated):
    before = everything()
    press(sketch)
    name = hair_of(bpy.context.active_object).name
    made, points = everything(), evaluated(bpy.data.objects[name])
    bpy.ops.ed.undo()
    assert everything() == before
    bpy.ops.ed.redo()
    assert everything() == made
    assert np.array_equal(evaluated(bpy.data.objects[name]), points)


@pytest.mark.parametrize("way", ["stop", "fault"])
def test_what_is_broken_off_leaves_nothing(shell, fitted_anew, sketch, monkeypatch, way):
    from addon.blender.background import sketching

    before = everything()
    bpy.context.scene.sketch_to_face.sketch = str(sketch)
    steps = sketching.new_face(bpy.context, bpy.context.scene.sketch_to_face)
    if way == "stop":
        for tick in steps:
            if tick.text.startswith("measuring"):
                break
        steps.close()
    else:
        from facs_rig.blender import hair

        monkeypatch.setattr(hair, "write_map", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            for tick in steps:
                if tick.waits_for is not None:
                    tick.waits_for.wait()
    after = everything()
    assert after["objects"] == before["objects"]
    assert after["meshes"] == before["meshes"] and after["armatures"] == before["armatures"]
    assert "Hair" not in after["materials"]


def test_the_setting_says_how(shell, sketch):
    settings = bpy.context.scene.sketch_to_face
    settings.hair = "surface"
    press(sketch)
    face = bpy.context.active_object
    assert kind_of(face) == "surface"
    settings.hair = "ignore"
    hair = hair_of(face)
    hair.data.vertices[0].co.z += 0.05
    before = places(hair)
    assert again() == {"FINISHED"}
    assert np.abs(places(hair_of(face)) - before).max() < 1e-6
    press(sketch)
    assert hair_of(bpy.context.active_object) is None and CUT not in bpy.context.active_object
    bpy.ops.sketch_to_face.default_tweakables()
    assert settings.hair == "locks"


def test_fitting_again_makes_it_anew(face, evaluated):
    from addon import pipeline

    face.sketch_to_face.hair_colour = (0.5, 0.1, 0.2)
    hair, names = hair_of(face), everything()
    bpy.context.scene.sketch_to_face.sketch = str(OTHER)
    bpy.ops.sketch_to_face.adopt_sketch()
    assert again() == {"FINISHED"}
    fit = pipeline.fit(OTHER)
    if fit.hair is None:
        assert hair_of(face) is None
        return
    assert hair_of(face) == hair and everything() == names
    assert colour_of(hair) == pytest.approx((0.5, 0.1, 0.2))
    set_pose(face, fit.parameters)
    assert np.abs(evaluated(hair) - fit.hair.on(fit.vertices)).max() < SAME


def test_undo_of_fitting_again_brings_the_old_hair(face, evaluated):
    bpy.context.scene.sketch_to_face.hair = "surface"
    bpy.ops.ed.undo_push(message="another kind")
    name, before = hair_of(face).name, evaluated(hair_of(face))
    again()
    after = evaluated(bpy.data.objects[name])
    assert len(after) != len(before)
    bpy.ops.ed.undo()
    assert np.array_equal(evaluated(bpy.data.objects[name]), before)
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects[name]), after)


def test_a_sketch_without_hair_takes_it_away(face, monkeypatch):
    from addon import pipeline

    found = pipeline.fit
    monkeypatch.setattr(
        pipeline, "fit", lambda *given: dataclasses.replace(found(*given), cut=None)
    )
    again()
    assert hair_of(face) is None and CUT not in face
    assert not bpy.ops.sketch_to_face.hair.poll()


def test_sliders_of_the_person_take_it_along(face, rig):
    hair, before = hair_of(face), places(hair_of(face))
    bound = bind(from_blender(before), rig, identity_of(face))
    face.sketch_to_face.identity.head_width += 0.4
    bpy.ops.sketch_to_face.random_person(seed=3)
    wanted = to_blender(bound.points(rig.neutral(identity_of(face))))
    assert np.abs(places(hair) - wanted).max() < SAME
    assert np.abs(places(hair) - before).max() > 0.002
    face.sketch_to_face.caricature = 1.5
    wanted = to_blender(bound.points(rig.neutral(identity_of(face))))
    assert np.abs(places(hair) - wanted).max() < SAME


def test_buttons_make_and_remove_it(face):
    def press_hair(kind):
        return bpy.ops.sketch_to_face.hair("EXEC_DEFAULT", True, kind=kind)

    name, count = face.name, len(hair_of(face).data.vertices)
    bpy.context.view_layer.objects.active = hair_of(face)  # the panel is the face's then, too
    assert press_hair("surface") == {"FINISHED"}
    assert kind_of(bpy.data.objects[name]) == "surface"
    assert press_hair("none") == {"FINISHED"}
    assert hair_of(bpy.data.objects[name]) is None
    assert bpy.context.active_object.name == name
    bpy.ops.ed.undo()
    assert kind_of(bpy.data.objects[name]) == "surface"
    bpy.ops.ed.redo()
    assert press_hair("locks") == {"FINISHED"}
    assert len(hair_of(bpy.data.objects[name]).data.vertices) == count


def test_a_forged_cut_is_one_sentence(face):
    hair_of(face)[CUT] = "{}"
    said = error_of(lambda: bpy.ops.sketch_to_face.hair(kind="locks"))
    assert said.startswith("What is kept of the hair") and "\n" not in said
    assert kind_of(face) == "locks"


def test_the_panel_shows_colour_and_buttons(face):
    from addon.blender.panels.fit import SKETCHTOFACE_PT_result as Result

    def drawn():
        layout = Layout()
        Result.draw(SimpleNamespace(layout=layout), bpy.context)
        return str(layout.noted)

    shaping = ("hair_colour", "hair_length", "hair_volume")
    assert all(name in drawn() for name in shaping)
    assert drawn().count("sketch_to_face.hair'") == 4 and "Hair Presets" in drawn()
    remove_hair(face)
    assert not any(name in drawn() for name in shaping)
    assert drawn().count("sketch_to_face.hair'") == 3
    del face[CUT]
    assert "sketch_to_face.hair'" not in drawn() and "Hair Presets" in drawn()


def test_an_older_blender_has_no_button_for_curves(face, monkeypatch):
    from addon.blender.panels import hair

    monkeypatch.setattr(hair, "has_curves", lambda: False)
    layout = Layout()
    hair.draw_hair(layout, face)
    assert str(layout.noted).count("sketch_to_face.hair'") == 3


def test_a_face_without_a_sketch_has_a_panel_of_its_own(shell, rig):
    from addon.blender.panels.hair import SKETCHTOFACE_PT_hair as Panel

    assert not Panel.poll(bpy.context)
    bpy.context.view_layer.objects.active = build_face("Somebody", rig, FaceParameters())
    assert Panel.poll(bpy.context)
    layout = Layout()
    Panel.draw(SimpleNamespace(layout=layout), bpy.context)
    assert "Hair Presets" in str(layout.noted) and "hair_length" not in str(layout.noted)


# --- length, volume, other hair -------------------------------------------------------------------


def lowest(face) -> float:
    return float(places(hair_of(face))[:, 2].min())


def test_sliders_comb_the_hair(shell, plain, rig):
    settings = plain.sketch_to_face
    assert settings.hair_length == settings.hair_volume == 1.0
    add_hair(plain, rig, preset("bob"))
    drawn = places(hair_of(plain))
    settings.hair_length = 1.5
    assert lowest(plain) < drawn[:, 2].min() - 0.05
    longer = hair_mesh(rig, identity_of(plain), preset("bob"), style=Style(length=1.5))
    assert np.abs(places(hair_of(plain)) - to_blender(longer.points)).max() < 1e-6
    assert to_json(cut_of(plain)) == to_json(preset("bob"))  # what was drawn is kept
    settings.hair_volume = 1.4
    assert np.ptp(places(hair_of(plain))[:, 0]) > np.ptp(drawn[:, 0]) + 0.003
    settings.hair_length = settings.hair_volume = 1.0
    assert np.abs(places(hair_of(plain)) - drawn).max() < 1e-6
    settings.hair_length = 99.0
    assert settings.hair_length == pytest.approx(2.0)
    settings.hair_length = 0.0
    assert settings.hair_length == pytest.approx(0.3)


def test_the_person_keeps_length_and_volume(shell, plain, rig):
    plain.sketch_to_face.hair_length, plain.sketch_to_face.hair_volume = 1.3, 0.7
    reshape(plain, rig, THEN)
    add_hair(plain, rig, cut_of(plain), "surface")
    made = hair_mesh(rig, THEN, cut_of(plain), "surface", style=Style(1.3, 0.7))
    assert np.abs(places(hair_of(plain)) - to_blender(made.points)).max() < SAME
    remove_hair(plain)
    plain.sketch_to_face.hair_length = 0.5  # what it gets again is as long
    assert hair_of(plain) is None
    add_hair(plain, rig, cut_of(plain), "surface")
    assert plain.sketch_to_face.hair_length == pytest.approx(0.5)


@pytest.mark.parametrize("forged", ["x", float("nan"), [1, 2], 1e9])
def test_a_forged_length_is_none(plain, forged):
    plain["facs_hair_length"] = forged
    assert style_of(plain).length in (1.0, 2.0)


def test_fitting_again_keeps_length_and_volume(face, rig):
    from addon import pipeline

    fit = pipeline.fit(bpy.path.abspath(face.sketch_to_face.sketch))
    face.sketch_to_face.hair_length, face.sketch_to_face.hair_volume = 1.4, 1.2
    assert again() == {"FINISHED"}
    assert face.sketch_to_face.hair_length == pytest.approx(1.4)
    style = Style(*(getattr(face.sketch_to_face, f"hair_{name}") for name in ("length", "volume")))
    who = identity_of(face)
    made = hair_mesh(rig, who, fit.cut, style=style).lying_on(rig.neutral(who) + fit.offsets)
    assert np.abs(places(hair_of(face)) - to_blender(made.points)).max() < SAME


def test_undo_of_a_slider(face):
    name, before = face.name, places(hair_of(face))
    face.sketch_to_face.hair_length = 1.5
    bpy.ops.ed.undo_push(message="Hair Length")
    bpy.ops.ed.undo()
    face = bpy.data.objects[name]
    assert np.array_equal(places(hair_of(face)), before)
    assert face.sketch_to_face.hair_length == 1.0
    bpy.ops.ed.redo()
    assert bpy.data.objects[name].sketch_to_face.hair_length == pytest.approx(1.5)


@pytest.mark.parametrize("name", PRESETS)
def test_any_face_gets_hair_of_the_presets(shell, rig, name):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    bpy.context.view_layer.objects.active = face
    assert not bpy.ops.sketch_to_face.hair.poll()
    assert bpy.ops.sketch_to_face.hair_preset(preset=name) == {"FINISHED"}
    assert to_json(cut_of(face)) == to_json(preset(name)) and kind_of(face) == "locks"
    assert bpy.ops.sketch_to_face.hair(kind="none") == {"FINISHED"}
    assert bpy.ops.sketch_to_face.hair(kind="surface") == {"FINISHED"}


def test_presets_swap_hair_and_what_was_drawn_comes_back(face):
    def swap(name):
        return bpy.ops.sketch_to_face.hair_preset("EXEC_DEFAULT", True, preset=name)

    name, drawn, before = face.name, to_json(cut_of(face)), places(hair_of(face))
    bpy.ops.sketch_to_face.hair(kind="surface")
    hair = hair_of(face)
    assert swap("afro") == {"FINISHED"} and swap("bun") == {"FINISHED"}
    assert hair_of(face) == hair and kind_of(face) == "surface"
    bpy.ops.ed.undo()
    assert to_json(cut_of(bpy.data.objects[name])) == to_json(preset("afro"))
    assert swap("drawn") == {"FINISHED"}
    face = bpy.data.objects[name]
    assert to_json(cut_of(face)) == drawn
    bpy.ops.sketch_to_face.hair(kind="locks")
    assert np.abs(places(hair_of(face)) - before).max() < 1e-6
    assert swap("afro") == {"FINISHED"}
    assert again() == {"FINISHED"}  # fits the drawn hair, too
    assert to_json(cut_of(face)) == drawn


def test_what_was_never_drawn_is_said_so(shell, rig):
    bpy.context.view_layer.objects.active = build_face("Somebody", rig, FaceParameters())
    said = error_of(lambda: bpy.ops.sketch_to_face.hair_preset(preset="drawn"))
    assert said == "No hair was found in the drawing of this face"


def test_the_menu_has_every_preset():
    from addon.blender.operators.hair import PRESETS as MENU

    assert {name for name, *_ in MENU} == set(PRESETS)


def test_a_face_whose_hair_was_deleted_goes_on(face, rig):
    bpy.data.objects.remove(hair_of(face))
    assert face.sketch_to_face.hair_colour[0] == 0.0
    reshape(face, rig, {"head_width": 0.3})
    face.sketch_to_face.caricature = 1.2
    assert shown(face, rig).worn == ()
    assert again() == {"FINISHED"}
    assert hair_of(face) is not None


def test_hair_that_is_edited_stops_fitting_again_with_nothing_changed(face, evaluated):
    hair, before = hair_of(face), evaluated(face)
    bpy.context.view_layer.objects.active = hair
    bpy.ops.object.mode_set(mode="SCULPT")
    bpy.context.scene.sketch_to_face.sketch = str(OTHER)
    bpy.ops.sketch_to_face.adopt_sketch()
    assert "is being edited" in error_of(again)
    face.sketch_to_face.live = True
    face.sketch_to_face.mark = ""
    assert not live.changed(face)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(evaluated(face), before)


# --- files ----------------------------------------------------------------------------------------


def test_what_is_shown_of_it_goes_to_files(face, rig, evaluated):
    face.parent.location = (0.3, 0.2, 0.1)
    set_pose(face, turned(face))
    hair = hair_of(face)
    (worn,) = shown(face, rig).worn
    assert np.abs(worn.points - evaluated(hair)).max() < 1e-6
    made = hair_mesh(rig, identity_of(face), cut_of(face))
    assert np.array_equal(worn.quads, made.quads)
    assert np.abs(worn.uv - made.uv).max() < 1e-6 and np.allclose(worn.shade, made.shade)
    assert worn.colour == pytest.approx(made.colour)
    hair.hide_set(True)
    assert shown(face, rig).worn == ()
    face.hide_set(True)
    face.parent.hide_set(True)
    (hidden,) = shown(face, rig).worn
    assert np.abs(hidden.points - worn.points).max() < 1e-6
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]


def test_edited_hair_goes_to_files_as_it_is(face, rig, tmp_path):
    hair = hair_of(face)
    hair.modifiers.new("Fewer", "TRIANGULATE")
    (worn,) = shown(face, rig).worn
    assert (worn.quads[:, 2] == worn.quads[:, 3]).all()
    assert len(worn.triangles) == 2 * len(hair.data.polygons)
    path = tmp_path / "face.obj"
    bpy.ops.sketch_to_face.export(filepath=str(path), format=".obj")
    faces = [line.split() for line in path.read_text().partition("\no hair")[2].splitlines()]
    assert {len(line) for line in faces if line and line[0] == "f"} == {4}
    hair.modifiers.clear()
    bpy.context.view_layer.objects.active = hair
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.delete(type="VERT")
    assert shown(face, rig).worn == ()
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("ending", [".glb", ".fbx", ".obj", ".blend"])
def test_export_and_back(face, rig, ending, tmp_path):
    path = tmp_path / f"face{ending}"
    (worn,) = shown(face, rig).worn
    name = hair_of(face).name
    left = everything()
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=ending) == {"FINISHED"}
    assert everything() == left
    back(path, name, worn)


@pytest.mark.parametrize("ending", [".blend", ".fbx"])
def test_the_command_writes_it_too(shell, sketch, ending, tmp_path):
    from addon import pipeline

    path = tmp_path / f"face{ending}"
    fit = pipeline.fit(sketch)
    pipeline.write_face(fit, path)
    back(path, "face Hair", fit.hair.worn_on(fit.vertices))


def back(path, name, worn):
    """Read a file into an empty Blender, and hold its hair against what was worn."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix == ".blend":
        with bpy.data.libraries.load(str(path)) as (there, taken):
            taken.objects = there.objects
        for thing in taken.objects:
            bpy.context.collection.objects.link(thing)
        found = bpy.data.objects[name]
        assert hair_of(next(o for o in taken.objects if "facs_face" in o)) == found
    else:
        read = {
            ".glb": lambda: bpy.ops.import_scene.gltf(filepath=str(path)),
            ".fbx": lambda: bpy.ops.import_scene.fbx(filepath=str(path)),
            ".obj": lambda: bpy.ops.wm.obj_import(filepath=str(path)),
        }
        read[path.suffix]()
        found = next(o for o in bpy.data.objects if o.name.lower().endswith("hair"))
        assert {o.name for o in bpy.data.objects if o.type == "MESH"} > {found.name}
    bpy.context.view_layer.update()
    final = found.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.array([final.matrix_world @ vertex.co for vertex in final.data.vertices])
    wanted = to_blender(worn.points)
    assert np.abs(points.min(axis=0) - wanted.min(axis=0)).max() < 1e-3
    assert np.abs(points.max(axis=0) - wanted.max(axis=0)).max() < 1e-3
    if path.suffix == ".fbx":
        tree = found.material_slots[0].material.node_tree
        shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
        colour = shader.inputs["Base Color"].default_value[:3]
        assert tuple(colour) == pytest.approx(worn.colour, abs=0.01)


def test_a_face_that_moves_takes_its_hair_to_the_file(shell, rig, cut, tmp_path):
    face = light_face(rig)  # Blender's exporter takes its time with each vertex of the face
    add_hair(face, rig, cut)
    for frame, yaw in ((1, 0.0), (5, 0.4)):
        set_pose(face, dataclasses.replace(pose_of(face), head=(yaw, 0.0, 0.0)))
        face.parent.pose.bones["head"].keyframe_insert("rotation_euler", frame=frame)
    path = tmp_path / "moving.glb"
    name = hair_of(face).name
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=".glb") == {"FINISHED"}
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    assert bpy.data.objects[name].find_armature() is not None
