"""Hair as Blender's hair curves: they grow on the face, follow it, and go to files."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender import build_face  # noqa: E402
from facs_rig.blender.armature import from_blender, to_blender  # noqa: E402
from facs_rig.blender.hair import (  # noqa: E402
    add_hair,
    colour_of,
    comb,
    curves_of,
    cut_of,
    hair_of,
    kind_of,
    remove_hair,
    set_colour,
)
from facs_rig.blender.hair_follows import read_points, write_points  # noqa: E402
from facs_rig.blender.pose import identity_of, set_pose  # noqa: E402
from facs_rig.blender.reshape import reshape  # noqa: E402
from facs_rig.blender.shape import shown  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.hair.follow import bind  # noqa: E402
from facs_rig.hair.mesh import hair_mesh  # noqa: E402
from facs_rig.hair.presets import preset  # noqa: E402
from facs_rig.hair.style import Style  # noqa: E402

from .test_hair import THEN, TURNED, WHO, back, light_face  # noqa: E402
from .test_iterate import again  # noqa: E402
from .test_shell import error_of, everything, press  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
SAME = 1e-5  # metres


@pytest.fixture(scope="session")
def cut():
    return preset("bob")


@pytest.fixture(params=[False, True], ids=["baked", "keys"])
def groomed(request, empty_blender, rig, cut):
    """A face with hair curves, its person baked or in keys."""
    face = build_face("Somebody", rig, FaceParameters(identity=WHO), identity_keys=request.param)
    add_hair(face, rig, cut, "curves")
    return face


@pytest.fixture
def fitted(shell, sketch, kept):
    face = kept("fitted", lambda: press(sketch))
    assert bpy.ops.sketch_to_face.hair(kind="curves") == {"FINISHED"}
    bpy.ops.ed.undo_push(message="curves")
    return face


def evaluated_strands(face) -> np.ndarray:
    """(n, 3) in the world, core axes, as the face takes them along."""
    bpy.context.view_layer.update()
    final = curves_of(face).evaluated_get(bpy.context.evaluated_depsgraph_get())
    world = np.array(final.matrix_world)
    return from_blender(read_points(final.data) @ world[:3, :3].T + world[:3, 3])


def roots(face, points) -> np.ndarray:
    """(n, 3) of the points those at which strands begin."""
    offsets = np.empty(len(curves_of(face).data.curves) + 1, np.int32)
    curves_of(face).data.curve_offset_data.foreach_get("value", offsets)
    return points[offsets[:-1]]


def depth(face, points) -> np.ndarray:
    """(n,) metres from points in the world to the face's skin as it is shown."""
    from mathutils import Vector

    graph = bpy.context.evaluated_depsgraph_get()
    final = face.evaluated_get(graph)
    into = final.matrix_world.inverted()
    out = []
    for point in to_blender(points):
        there = into @ Vector(point)
        out.append((final.closest_point_on_mesh(there)[1] - there).length)
    return np.array(out)


# --- the object -----------------------------------------------------------------------------------


def test_they_are_blender_s_own_hair(groomed, rig, cut):
    curves = curves_of(groomed)
    data = curves.data
    made = hair_mesh(rig, WHO, cut, "curves")
    assert kind_of(groomed) == "curves" and curves.name == "Somebody Hair Curves"
    assert curves.type == "CURVES" and curves.parent == data.surface == groomed
    assert data.surface_uv_map in groomed.data.uv_layers and groomed.add_rest_position_attribute
    (modifier,) = curves.modifiers
    assert "GeometryNodeDeformCurvesOnSurface" in [n.bl_idname for n in modifier.node_group.nodes]
    assert curves.users_collection == groomed.users_collection
    kinds = {name: (a.domain, a.data_type) for name, a in data.attributes.items()}
    assert kinds["radius"] == ("POINT", "FLOAT")
    assert kinds["surface_uv_coordinate"] == ("CURVE", "FLOAT2")
    assert kinds["shade"] == ("CURVE", "FLOAT")
    assert 2000 < len(data.curves) < 6000 and 6 <= data.curves[0].points_length <= 12
    assert abs(len(data.curves) - len(made.strands.points)) < 300  # on the basis' person
    # A thinner surface keeps the skin from showing.
    assert np.abs(read_points(hair_of(groomed).data) - to_blender(made.points)).max() < 1e-6


def test_at_rest_they_are_where_they_were_grown(empty_blender, rig, cut):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO), location=(0.3, 0.2, 0.1))
    add_hair(face, rig, cut, "curves")
    made = hair_mesh(rig, WHO, cut, "curves").strands
    wanted = made.points.reshape(-1, 3) + from_blender(np.array([0.3, 0.2, 0.1]))
    assert np.abs(evaluated_strands(face) - wanted).max() < SAME
    uv = np.empty((len(made.uv), 2), np.float32)
    data = curves_of(face).data
    data.attributes["surface_uv_coordinate"].data.foreach_get("vector", uv.ravel())
    assert np.array_equal(uv, made.uv)


@pytest.mark.parametrize("way", ["NEAREST", "DEFORM"])
def test_blender_s_own_tools_find_their_roots(empty_blender, rig, cut, way):
    """Snapping them to the surface, anew or by the places that are kept, moves next to none."""
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    add_hair(face, rig, cut, "curves")
    curves = curves_of(face)
    before = roots(face, read_points(curves.data))
    bpy.context.view_layer.objects.active = curves
    curves.select_set(True)
    assert bpy.ops.curves.snap_curves_to_surface(attach_mode=way) == {"FINISHED"}
    off = np.linalg.norm(roots(face, read_points(curves.data)) - before, axis=1)
    assert np.median(off) < 3e-4 and off.max() < 2e-3


def test_they_hang_on_the_skin_in_every_pose(groomed):
    for aus, head in (({}, (0.0, 0.0, 0.0)), ({}, TURNED.head), (TURNED.aus, (0.0, 0.0, 0.0))):
        set_pose(groomed, dataclasses.replace(TURNED, aus=aus, head=head, identity=WHO))
        some = roots(groomed, evaluated_strands(groomed))[::40]
        assert np.median(depth(groomed, some)) < 1e-3 and depth(groomed, some).max() < 3e-3


def test_they_turn_with_the_head(empty_blender, rig, cut):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    add_hair(face, rig, cut, "curves")
    pose = FaceParameters({}, WHO, head=TURNED.head)
    bound = bind(evaluated_strands(face), rig, WHO)
    set_pose(face, pose)
    now = evaluated_strands(face)
    off = np.linalg.norm(now - bound.points(rig.pose(pose)), axis=1)
    assert np.median(off) < 1e-4 and np.percentile(off, 95) < 5e-3  # the nape's go with the neck


def test_they_follow_the_person_as_they_are_groomed(empty_blender, rig, cut):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    add_hair(face, rig, cut, "curves")
    data = curves_of(face).data
    points = read_points(data)
    tips = points.reshape(len(data.curves), -1, 3)[:, 3:]
    tips[..., 2] += 0.01 * np.sin(30 * tips[..., 0])
    write_points(data, points)
    bound = bind(from_blender(points), rig, WHO)
    reshape(face, rig, THEN)
    assert np.abs(from_blender(read_points(data)) - bound.points(rig.neutral(THEN))).max() < SAME
    assert depth(face, roots(face, evaluated_strands(face))[::60]).max() < 4e-3
    reshape(face, rig, {})
    reshape(face, rig, WHO)
    assert np.abs(read_points(data) - points).max() < 1e-6


def test_identity_keys_take_them_along(empty_blender, rig, cut):
    face = build_face("Somebody", rig, FaceParameters(identity=WHO), identity_keys=True)
    add_hair(face, rig, cut, "curves")
    before = read_points(curves_of(face).data)
    reshape(face, rig, THEN)
    assert np.array_equal(read_points(curves_of(face).data), before)
    some = roots(face, evaluated_strands(face))[::60]
    assert np.median(depth(face, some)) < 1e-3


def test_making_them_anew_keeps_object_modifiers_and_colour(groomed, rig, cut):
    curves = curves_of(groomed)
    curves.name = "Wig"
    set_colour(hair_of(groomed), (0.6, 0.1, 0.1))
    curves.modifiers.new("Own", "NODES")
    add_hair(groomed, rig, preset("crop"), "curves")
    assert curves_of(groomed) == curves and curves.name == "Wig"
    assert [m.name for m in curves.modifiers] == ["Follow the Face", "Own"]
    assert colour_of(hair_of(groomed)) == pytest.approx((0.6, 0.1, 0.1))
    assert curves.data.materials[0] == hair_of(groomed).data.materials[0]
    assert len(bpy.data.hair_curves) == 1 and len(bpy.data.node_groups) == 1


def test_one_swatch_colours_all(groomed):
    material = curves_of(groomed).data.materials[0]
    tree = material.node_tree
    (swatch,) = [n for n in tree.nodes if n.type == "RGB"]
    shaders = [n for n in tree.nodes if n.type in ("BSDF_PRINCIPLED", "BSDF_HAIR_PRINCIPLED")]
    assert len(shaders) == 2
    for shader in shaders:
        socket = shader.inputs["Color" if "HAIR" in shader.type else "Base Color"]
        assert socket.links[0].from_node.inputs[0].links[0].from_node == swatch
    assert tree.get_output_node("CYCLES") != tree.get_output_node("EEVEE")
    set_colour(hair_of(groomed), (0.5, 0.2, 0.1))
    assert tuple(swatch.outputs[0].default_value[:3]) == pytest.approx((0.5, 0.2, 0.1))


def test_removing_leaves_nothing(groomed, rig, cut):
    remove_hair(groomed)
    for kind in ("hair_curves", "node_groups"):
        assert not len(getattr(bpy.data, kind))
    assert "Hair" not in bpy.data.materials and not groomed.add_rest_position_attribute
    add_hair(groomed, rig, cut, "curves")
    for kind in ("locks", "surface"):
        add_hair(groomed, rig, cut, "curves")
        add_hair(groomed, rig, cut, kind)
        assert curves_of(groomed) is None and not len(bpy.data.hair_curves)
        assert kind_of(groomed) == kind


def test_the_artist_s_own_curves_are_left_alone(groomed, rig, cut):
    data = bpy.data.hair_curves.new("Moustache")
    data.surface = groomed
    other = bpy.data.objects.new("Moustache", data)
    other.parent = groomed
    remove_hair(groomed)
    assert bpy.data.objects["Moustache"] == other and groomed.add_rest_position_attribute
    assert curves_of(groomed) is None


def test_curves_that_are_sculpted_are_said_so(groomed, rig, cut):
    bpy.context.view_layer.objects.active = curves_of(groomed)
    bpy.ops.object.mode_set(mode="SCULPT_CURVES")
    for change in (
        lambda: reshape(groomed, rig, THEN),
        lambda: add_hair(groomed, rig, cut),
        lambda: comb(groomed, rig, Style(0.5)),
        lambda: remove_hair(groomed),
    ):
        with pytest.raises(InputError, match="'Somebody Hair Curves' is being edited"):
            change()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_an_older_blender_says_what_it_needs(empty_blender, rig, cut, monkeypatch):
    from facs_rig.blender import hair_curves

    monkeypatch.setattr(hair_curves, "has_curves", lambda: False)
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    with pytest.raises(InputError, match="hair curves need Blender 4.2 or newer"):
        add_hair(face, rig, cut, "curves")
    assert hair_of(face) is None


def test_hair_without_a_single_strand(empty_blender, rig, cut, monkeypatch):
    """As of a cut that lies nowhere near the scalp."""
    from facs_rig.hair import strands

    monkeypatch.setattr(strands, "NEAR", 0.0)
    face = build_face("Somebody", rig, FaceParameters(identity=WHO))
    add_hair(face, rig, cut, "curves")
    assert len(curves_of(face).data.curves) == 0
    reshape(face, rig, THEN)


# --- the buttons ----------------------------------------------------------------------------------


def test_the_button_makes_them_and_undo_takes_them(shell, sketch, kept):
    face = kept("fitted", lambda: press(sketch))
    name, before = face.name, everything()
    assert bpy.ops.sketch_to_face.hair("EXEC_DEFAULT", True, kind="curves") == {"FINISHED"}
    points = read_points(curves_of(bpy.data.objects[name]).data)
    bpy.ops.ed.undo()
    assert everything() == before and curves_of(bpy.data.objects[name]) is None
    bpy.ops.ed.redo()
    assert np.array_equal(read_points(curves_of(bpy.data.objects[name]).data), points)
    assert curves_of(bpy.data.objects[name]).data.surface == bpy.data.objects[name]


def test_a_fit_with_curves(shell, sketch):
    settings = bpy.context.scene.sketch_to_face
    settings.hair = "curves"
    press(sketch)
    face = bpy.context.active_object
    assert kind_of(face) == "curves"
    assert depth(face, roots(face, evaluated_strands(face))[::60]).max() < 3e-3
    curves = curves_of(face)
    bpy.ops.ed.undo_push(message="fitted")
    assert again() == {"FINISHED"}
    assert curves_of(face) == curves and kind_of(face) == "curves"
    settings.hair = "ignore"
    points = read_points(curves.data)
    points[0] += 0.01
    write_points(curves.data, points)
    assert again() == {"FINISHED"}
    assert np.abs(read_points(curves_of(face).data) - points).max() < 1e-6


def test_a_fit_with_curves_in_an_older_blender(shell, sketch, monkeypatch):
    from facs_rig.blender import hair_curves

    monkeypatch.setattr(hair_curves, "has_curves", lambda: False)
    bpy.context.scene.sketch_to_face.hair = "curves"
    before = everything()
    said = error_of(lambda: press(sketch))
    assert said.startswith("Hair curves need Blender 4.2 or newer") and "\n" not in said
    assert everything() == before


def test_the_panel_is_the_face_s_while_curves_are_active(fitted):
    from addon.blender.state import faces

    bpy.context.view_layer.objects.active = curves_of(fitted)
    assert faces.active_face(bpy.context) == fitted
    assert bpy.ops.sketch_to_face.hair(kind="none") == {"FINISHED"}
    assert bpy.context.active_object == fitted and curves_of(fitted) is None


def test_an_independent_face_has_curves_of_its_own(fitted, rig):
    for thing in (fitted, fitted.parent, hair_of(fitted), curves_of(fitted)):
        thing.select_set(True)
    bpy.context.view_layer.objects.active = fitted
    bpy.ops.object.duplicate(linked=True)
    twin = next(o for o in bpy.context.selected_objects if o.data == fitted.data and o != fitted)
    bpy.context.view_layer.objects.active = twin
    assert bpy.ops.sketch_to_face.stand_alone() == {"FINISHED"}
    own = curves_of(twin)
    assert own != curves_of(fitted) and own.data != curves_of(fitted).data
    assert own.data.surface == twin and curves_of(fitted).data.surface == fitted
    before = read_points(curves_of(fitted).data)
    reshape(twin, rig, THEN)
    assert np.array_equal(read_points(curves_of(fitted).data), before)
    assert np.abs(read_points(own.data) - before).max() > 0.002


# --- files ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", [".glb", ".fbx", ".obj"])
def test_in_other_files_they_are_locks(fitted, rig, ending, tmp_path, reports):
    path, left, name = tmp_path / f"face{ending}", everything(), hair_of(fitted).name
    (worn,) = shown(fitted, rig).worn
    locks = hair_mesh(rig, identity_of(fitted), cut_of(fitted), "locks")
    assert len(worn.points) == len(locks.points) and np.array_equal(worn.quads, locks.quads)
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=ending) == {"FINISHED"}
    assert "its hair curves are locks there" in reports()
    assert everything() == left
    back(path, name, worn)


def test_hidden_underlayer_or_strands_still_go_to_files(fitted, rig):
    hair_of(fitted).hide_set(True)
    assert len(shown(fitted, rig).worn) == 1
    curves_of(fitted).hide_set(True)
    assert shown(fitted, rig).worn == ()


def test_a_moving_face_takes_locks_to_the_file(shell, rig, cut, tmp_path):
    face = light_face(rig)
    add_hair(face, rig, cut, "curves")
    for frame, yaw in ((1, 0.0), (5, 0.4)):
        set_pose(face, FaceParameters({}, identity_of(face), head=(yaw, 0.0, 0.0)))
        face.parent.pose.bones["head"].keyframe_insert("rotation_euler", frame=frame)
    path, name, left = tmp_path / "moving.glb", hair_of(face).name, everything()
    under = len(hair_of(face).data.vertices)
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=".glb") == {"FINISHED"}
    assert everything()["meshes"] == left["meshes"]
    assert len(hair_of(face).data.vertices) == under
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    found = bpy.data.objects[name]
    assert found.find_armature() is not None and len(found.data.vertices) > 1.5 * under


def test_a_blend_holds_them(fitted, tmp_path):
    path, name = tmp_path / "face.blend", fitted.name
    points = read_points(curves_of(fitted).data)
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=".blend") == {"FINISHED"}
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(path)) as (there, taken):
        taken.objects = there.objects
    for thing in taken.objects:
        bpy.context.collection.objects.link(thing)
    face = bpy.data.objects[name]
    assert kind_of(face) == "curves" and curves_of(face).data.surface == face
    assert np.array_equal(read_points(curves_of(face).data), points)
    assert depth(face, roots(face, evaluated_strands(face))[::60]).max() < 3e-3


def test_the_command_writes_them_to_a_blend_alone(shell, sketch, tmp_path):
    from addon import pipeline

    fit = pipeline.fit(sketch, pipeline.FitOptions(hair="curves"))
    with pytest.raises(InputError, match="'face.glb' cannot hold hair curves: write a .blend"):
        pipeline.write_face(fit, tmp_path / "face.glb")
    assert not list(tmp_path.iterdir())
    pipeline.write_face(fit, tmp_path / "face.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "face.blend"))
    face = next(o for o in bpy.data.objects if "facs_face" in o)
    assert kind_of(face) == "curves" and len(curves_of(face).data.curves) == len(
        fit.hair.strands.points
    )
    pipeline.write_face(fit, tmp_path / "face.ply")
    assert pipeline.preview(fit).shape[2] == 3
