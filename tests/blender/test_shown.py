"""Files of a face hold what Blender shows of it, whatever the artist did to it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, FaceParameters  # noqa: E402
from facs_rig.blender import build_face  # noqa: E402
from facs_rig.blender.pose import refresh  # noqa: E402
from facs_rig.levels import at_level  # noqa: E402
from tests.written import points_of  # noqa: E402

ops = bpy.ops.sketch_to_face
CLOSE = 5e-5  # metres


def made(rig):
    """A face that does something, selected."""
    face = build_face(
        "Ann", rig, FaceParameters({"smile": 3.0, "jaw_open": 2.0}, {"age": 0.7}, (0.2, 0.1, 0.0)),
        np.zeros((rig.n_vertices, 3)),
    )  # fmt: skip
    face.select_set(True)
    bpy.context.view_layer.objects.active = face
    return face


@pytest.fixture
def face(shell, rig):
    return made(rig)


@pytest.fixture
def light(shell, rig):
    """With a third of the vertices: what Blender does to them does not hang on their number."""
    return made(at_level(rig, "medium"))


def own_key(face) -> None:
    block = face.shape_key_add(name="Mine", from_mix=False)
    for point in block.data:
        point.co.z += 0.02
    block.value = 0.8


def mask(face) -> None:
    """A key of the artist's that a vertex group holds back."""
    own_key(face)
    group = face.vertex_groups.new(name="Half")
    group.add([v.index for v in face.data.vertices if v.co.x > 0], 1.0, "REPLACE")
    face.data.shape_keys.key_blocks["Mine"].vertex_group = "Half"


def mute(face) -> None:
    face.data.shape_keys.key_blocks["jaw_open"].mute = True


def key_range(face) -> None:
    face.data.shape_keys.key_blocks["smile"].slider_max = 0.2


def pinned(face) -> None:
    face.active_shape_key_index = face.data.shape_keys.key_blocks.find("frontalis")
    face.show_only_shape_key = True


def absolute(face) -> None:
    face.data.shape_keys.use_relative = False
    face.data.shape_keys.eval_time = 15.0


def sculpted_key(face) -> None:
    for point in face.data.shape_keys.key_blocks["smile"].data:
        point.co.y -= 0.01


def stretched(face) -> None:
    modifier = face.modifiers.new("Stretch", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.deform_axis, modifier.factor = "STRETCH", "Z", 0.2


def eyes_by_hand(face) -> None:
    face.parent.pose.bones["eye_left"].rotation_euler = (0.1, 0.0, 0.3)


def bone_scaled(face) -> None:
    face.parent.pose.bones["head"].scale = (1.2, 1.1, 1.0)


def bone_moved(face) -> None:
    face.parent.pose.bones["head"].location = (0.0, 0.0, 0.03)


def placed(face) -> None:
    face.parent.location, face.parent.rotation_euler = (1.0, -2.0, 0.5), (0.1, 0.2, 2.0)


def scaled(face) -> None:
    face.parent.scale = (2.0, 1.5, 1.0)


def own_transform(face) -> None:
    face.location, face.rotation_euler, face.scale = (0.1, 0, 0), (0, 0.3, 0), (1, 1, 1.2)


def parented(face) -> None:
    holder = bpy.data.objects.new("Holder", None)
    bpy.context.collection.objects.link(holder)
    face.parent.parent = holder
    holder.rotation_euler, holder.scale = (0.0, 0.0, 1.0), (1.5, 1.5, 1.5)


def constrained(face) -> None:
    target = bpy.data.objects.new("Target", None)
    target.location = (0.3, 0.4, 0.5)
    bpy.context.collection.objects.link(target)
    face.parent.constraints.new("COPY_LOCATION").target = target


def driven_slider(face) -> None:
    face.driver_add('["smile"]').driver.expression = "7.0"


def keyed(face) -> None:
    for frame, value in ((1, 0.0), (11, 5.0)):
        face["frontalis"] = value
        face.keyframe_insert('["frontalis"]', frame=frame)
    bpy.context.scene.frame_set(7)


def hidden(face) -> None:
    face.hide_set(True)


def edited(face) -> None:
    """Moved in Edit Mode, and not left."""
    import bmesh

    face.active_shape_key_index = 0
    bpy.ops.object.mode_set(mode="EDIT")
    mesh = bmesh.from_edit_mesh(face.data)
    for vertex in mesh.verts:
        vertex.co.x += 0.01
    bmesh.update_edit_mesh(face.data)


def sculpting(face) -> None:
    bpy.ops.object.mode_set(mode="SCULPT")


def unbound(face) -> None:
    """The armature's modifier is switched off."""
    face.modifiers[0].show_viewport = False


CAUSES = [own_key, mask, mute, key_range, pinned, absolute, sculpted_key, stretched, eyes_by_hand,
          bone_scaled, bone_moved, placed, scaled, own_transform, parented, constrained,
          driven_slider, keyed, hidden, edited, sculpting, unbound]  # fmt: skip
# Blender shows only a cage while a mesh is edited, and nothing of what is hidden.
AFTERWARDS = {
    edited: lambda face: bpy.ops.object.mode_set(mode="OBJECT"),
    hidden: lambda face: face.hide_set(False),
    sculpting: lambda face: bpy.ops.object.mode_set(mode="OBJECT"),
}


def written(path) -> np.ndarray:
    """(n, 3) vertices of a written file in core axes."""
    if path.suffix == ".fbx":
        from io_scene_fbx import parse_fbx

        tree, _ = parse_fbx.parse(str(path))
        objects = next(e for e in tree.elems if e.id == b"Objects")
        mesh = next(e for e in objects.elems if e.id == b"Geometry" and e.props[2] == b"Mesh")
        flat = next(e for e in mesh.elems if e.id == b"Vertices").props[0]
        return np.array(flat).reshape(-1, 3)
    return points_of(path)


def export(path, **options):
    return ops.export(filepath=str(path), format=path.suffix, **options)


@pytest.mark.parametrize("cause", CAUSES, ids=lambda c: c.__name__)
def test_a_file_holds_what_is_shown(light, cause, evaluated, tmp_path):
    face, plain = light, evaluated(light)
    cause(face)
    refresh(face)
    path = tmp_path / "face.obj"
    counts = [len(kind) for kind in (bpy.data.objects, bpy.data.meshes, bpy.data.scenes)]
    assert export(path) == {"FINISHED"}
    assert counts == [len(kind) for kind in (bpy.data.objects, bpy.data.meshes, bpy.data.scenes)]
    AFTERWARDS.get(cause, lambda face: None)(face)
    seen = evaluated(face)
    if cause not in (hidden, sculpting):
        assert np.abs(seen - plain).max() > 1e-3  # the cause does change the look
    assert np.abs(written(path) - seen).max() < CLOSE


@pytest.mark.parametrize("ending", ["glb", "ply", "fbx"])
def test_every_format_holds_what_is_shown(face, ending, evaluated, tmp_path):
    for cause in (mask, mute, stretched, eyes_by_hand, placed):
        cause(face)
    refresh(face)
    path = tmp_path / f"face.{ending}"
    assert export(path) == {"FINISHED"}
    assert np.abs(written(path) - evaluated(face)).max() < CLOSE


def test_morph_targets_are_what_the_sliders_do(face, evaluated, tmp_path, rig):
    """Alone, from the face at rest, with the artist's keys and modifiers; `neutral` takes away."""
    from facs_rig.blender.shape import moves, shown
    from facs_rig.blender.steps import finish

    for cause in (own_key, stretched, placed, bone_scaled):
        cause(face)
    refresh(face)
    before = dict(face.items())
    shape = shown(face, rig)
    found = finish(moves(face, rig, shape))
    assert list(found) == [*CONTROL_NAMES, "neutral", "Mine"]
    assert dict(face.items()).keys() == before.keys() and face["smile"] == 3.0
    for name in CONTROL_NAMES:
        face[name] = 0.0
    refresh(face)
    assert np.abs(shape.points + found["neutral"] - evaluated(face)).max() < CLOSE
    face["frontalis"] = 5.0
    refresh(face)
    posed = shape.points + found["neutral"] + found["frontalis"]
    assert np.abs(posed - evaluated(face)).max() < CLOSE
    face.data.shape_keys.key_blocks["Mine"].value = 0.0
    refresh(face)
    assert np.abs(posed - 0.8 * found["Mine"] - evaluated(face)).max() < CLOSE


def test_a_finer_surface_keeps_its_morph_targets_or_goes_without(face, evaluated, tmp_path, rig):
    from facs_rig.blender import shape as blender_shape
    from facs_rig.blender.steps import finish

    face.modifiers.new("Smooth", "SUBSURF").levels = 1
    path = tmp_path / "face.glb"
    assert export(path) == {"FINISHED"}
    seen = evaluated(face)
    assert len(seen) > 3 * rig.n_vertices
    file = written(path)  # cut by its materials, so that the order is another
    for some, others in ((seen, file), (file, seen)):
        assert cKDTree(others).query(some)[0].max() < CLOSE
    shape = blender_shape.shown(face, rig)
    assert len(shape.points) == len(seen)
    fine = len(seen) <= blender_shape.MOST
    assert bool(finish(blender_shape.moves(face, rig, shape))) == fine


def test_colours_are_those_of_the_materials(face, rig):
    from facs_rig.blender.shape import shown
    from facs_rig.shape import rig_shape

    plain = rig_shape(rig, FaceParameters(identity={"age": 0.7})).colours
    assert np.array_equal(shown(face, rig).colours, plain)
    skin = face.material_slots["Face Skin"].material
    node = next(n for n in skin.node_tree.nodes if n.label == "Skin")
    node.outputs[0].default_value = (0.0, 0.5, 0.0, 1.0)
    teeth = face.material_slots["Face Teeth"].material
    shader = next(n for n in teeth.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (1.0, 1.0, 0.0, 1.0)
    changed = shown(face, rig).colours
    assert (changed[rig.parts["teeth"]] == (255, 255, 0, 255)).all()
    greens = changed[rig.parts["skin"]]
    assert (greens[:, 1] > 150).mean() > 0.5 and (greens[:, 0] == 0).mean() > 0.5


def test_what_a_file_leaves_out_is_named(face, tmp_path, reports):
    face.data.color_attributes.new("Paint", "BYTE_COLOR", "POINT")
    face.data.polygons.foreach_set("use_smooth", [False] * len(face.data.polygons))
    reports()
    export(tmp_path / "face.obj")
    assert "left out: Shade Flat, Color Attributes" in reports()


def linked_duplicate(face) -> bpy.types.Object:
    """Alt-D of face and armature, moved aside."""
    for thing in (face, face.parent):
        thing.select_set(True)
    bpy.ops.object.duplicate(linked=True)
    return next(o for o in bpy.context.selected_objects if o.type == "MESH")


@pytest.mark.parametrize("ending", ["obj", "glb"])
def test_through_a_linked_duplicate_too(face, ending, evaluated, tmp_path):
    other = linked_duplicate(face)
    other.parent.location.x += 0.5
    other.parent.pose.bones["head"].rotation_euler.y += 0.4
    other["frontalis"] = 5.0  # moves nothing: the mesh follows the sliders of the first
    face["pucker"] = 4.0
    bpy.context.view_layer.objects.active = other
    refresh(face)
    refresh(other)
    path = tmp_path / f"face.{ending}"
    assert export(path) == {"FINISHED"}
    assert np.abs(written(path) - evaluated(other)).max() < CLOSE
    assert math.dist(evaluated(other).mean(axis=0), evaluated(face).mean(axis=0)) > 0.4
