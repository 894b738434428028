"""The Blender object does what the rig does in numpy."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import ARKIT_NAMES, CONTROL_NAMES, CONTROLS, FaceParameters, variants  # noqa: E402
from facs_rig.blender import (  # noqa: E402
    build_face,
    build_steps,
    prepare,
    set_identity,
    to_blender,
)
from facs_rig.blender.keys import in_parts  # noqa: E402
from facs_rig.blender.materials import paint_of  # noqa: E402
from facs_rig.blender.pose import identity_of, pose_of, refresh, set_pose  # noqa: E402
from facs_rig.blender.reshape import reshape  # noqa: E402
from facs_rig.blender.steps import finish, sliced  # noqa: E402
from facs_rig.identity import IDENTITY_KEYS  # noqa: E402
from facs_rig.keys import LONGEST, PROPERTIES, abbreviated  # noqa: E402
from facs_rig.paint import MATERIAL_NAMES  # noqa: E402
from tests.facs_rig.test_motions import FACE, ROWS, with_variants  # noqa: E402

TOLERANCE = 1e-5  # metres
KINDS = ("objects", "meshes", "materials", "armatures", "shape_keys")


def a_pose(seed: int, *, someone: bool = False) -> FaceParameters:
    """Ten controls up to 10, head, neck and gaze at random, and any person."""
    random = np.random.default_rng(seed)
    who = {}
    if someone:
        from dataset_gen.sampling import sample_identity

        who = sample_identity(random) | {"wrinkles": float(random.uniform(-1, 1))}
    return FaceParameters(
        aus={n: float(random.uniform(0, 10)) for n in random.choice(CONTROL_NAMES, 10, False)},
        identity=who,
        head=tuple(random.uniform(-0.6, 0.6, 3)),
        neck=tuple(random.uniform(-0.3, 0.3, 3)),
        gaze=tuple(random.uniform(-0.6, 0.6, 2)),
    )


def names_of(face) -> list[str]:
    return [key.name for key in face.data.shape_keys.key_blocks]


def test_axes_turn_the_face_to_minus_y():
    toward_viewer, up, own_left = np.eye(3)[[2, 1, 0]]
    assert to_blender(toward_viewer).tolist() == [0, -1, 0]
    assert to_blender(up).tolist() == [0, 0, 1]
    assert to_blender(own_left).tolist() == [1, 0, 0]


def test_neutral_face_has_the_keys_of_the_rig(rig, evaluated):
    face = build_face("Face", rig, FaceParameters())
    assert names_of(face) == ["Basis", *(key.name for key in rig.keys)]
    assert names_of(face)[1 : 1 + len(CONTROL_NAMES)] == list(CONTROL_NAMES)
    assert all(p.use_smooth for p in face.data.polygons)
    assert np.abs(evaluated(face) - rig.neutral()).max() < TOLERANCE


def test_sliders_say_what_they_do(rig):
    face = build_face("Face", rig, FaceParameters(aus={"smile": 3.5}))
    for control in CONTROLS:
        shown = face.id_properties_ui(control.name).as_dict()
        assert (shown["min"], shown["max"], shown["default"]) == (0, 10, 0)
        assert control.signature[1:] in shown["description"]
        assert face[control.name] == (3.5 if control.name == "smile" else 0)
    assert {name: face[name] for name in PROPERTIES} == {
        "gaze_yaw": 0, "gaze_pitch": 0, **rig.scalars({})}  # fmt: skip
    gaze = face.id_properties_ui("gaze_yaw").as_dict()
    assert (gaze["soft_min"], gaze["soft_max"]) == (-35, 35)


def test_every_key_of_the_rig_is_driven_without_python(rig):
    face = build_face("Face", rig, FaceParameters(), identity_keys=True, arkit=True)
    drivers = face.data.shape_keys.animation_data.drivers
    driven = {d.data_path for d in drivers}
    wanted = {f'key_blocks["{k.name}"].value' for k in rig.keys}
    assert {path for path in driven if path.startswith("key_blocks")} == wanted
    others = list(face.parent.animation_data.drivers)
    assert all(d.driver.is_simple_expression for d in (*drivers, *others))
    assert all(v.type == "SINGLE_PROP" for d in drivers for v in d.driver.variables)


@pytest.mark.parametrize(
    "expression",
    [
        "max(" + "".join(f"-0.0{k + 11}*{n}" for k, n in enumerate(CONTROL_NAMES)) + "-0.04,0)",
        "min(1,smile-(" + "+".join(f"0.123*{name}*crease_gain" for name in CONTROL_NAMES) + "))",
    ],
)
def test_long_expressions_are_cut_into_parts_that_add_up(expression):
    parts = in_parts("long", expression)
    assert len(parts) > 1 and parts[-1][0] == "long"
    random = np.random.default_rng(1)
    values = {name: float(random.uniform(0, 10)) for name in (*CONTROL_NAMES, *PROPERTIES)}
    wanted = eval(expression, dict(values))
    for name, text in parts:
        assert len(abbreviated(text)[0]) <= LONGEST
        values[name] = eval(text, dict(values))
    assert values["long"] == pytest.approx(wanted, rel=1e-12)


def test_expressions_that_cannot_be_cut_are_refused():
    with pytest.raises(RuntimeError, match="the expression of 'long' is too long"):
        in_parts("long", "*".join(f"min(smile,{k})" for k in range(40)))


def test_polygons_and_materials_follow_the_rig(rig):
    face = build_face("Face", rig, FaceParameters())
    assert len(face.data.vertices) == rig.n_vertices
    flat = [v for p in face.data.polygons for v in p.vertices]
    assert flat == list(rig.polygon_vertices)
    slots = [m.name for m in face.data.materials]
    assert slots == [f"Face {n.capitalize()}" for n in MATERIAL_NAMES]
    used = {MATERIAL_NAMES[p.material_index] for p in face.data.polygons}
    assert used >= {"skin", "lips", "eyes", "iris", "pupil", "teeth"}


def test_the_map_to_paint_on_comes_first_and_renders_use_it(rig):
    mesh = build_face("Face", rig, FaceParameters(identity={"age": 1.0})).data
    assert [layer.name for layer in mesh.uv_layers] == ["UVMap", "Eyes"]
    layer = mesh.uv_layers["UVMap"]
    assert layer.active_render and mesh.uv_layers.active == layer
    flat = np.empty(2 * len(mesh.loops), dtype=np.float32)
    layer.data.foreach_get("uv", flat)
    np.testing.assert_array_equal(flat.reshape(-1, 2), rig.uv)


def test_two_faces_share_their_materials(rig):
    build_face("One", rig, FaceParameters())
    build_face("Two", rig, FaceParameters())
    assert len(bpy.data.materials) == len(MATERIAL_NAMES)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_evaluated_mesh_of_a_baked_person_equals_the_posed_rig(rig, evaluated, seed):
    parameters = a_pose(seed, someone=True)
    random = np.random.default_rng(seed)
    offsets = random.normal(0, 0.002, (rig.n_vertices, 3)).astype(np.float32)
    face = build_face("Face", rig, parameters, offsets)
    assert np.abs(evaluated(face) - rig.pose(parameters, offsets)).max() < TOLERANCE


@pytest.mark.parametrize("arkit", [False, True])
def test_evaluated_mesh_with_identity_keys_equals_the_posed_rig(rig, evaluated, arkit):
    first = a_pose(10, someone=True)
    face = build_face("Face", rig, first, identity_keys=True, arkit=arkit)
    extra = ARKIT_NAMES if arkit else ()
    assert names_of(face) == ["Basis", *(k.name for k in rig.keys), *IDENTITY_KEYS, *extra]
    assert np.abs(evaluated(face) - rig.pose(first)).max() < TOLERANCE
    for seed in (11, 12, 13):
        parameters = a_pose(seed, someone=True)
        set_identity(face, rig, parameters.identity)
        set_pose(face, parameters)
        assert np.abs(evaluated(face) - rig.pose(parameters)).max() < TOLERANCE
        told = pose_of(face)
        assert dict(told.identity) == pytest.approx(dict(parameters.identity), abs=1e-6)
        assert dict(told.aus) == pytest.approx(dict(parameters.aus), abs=1e-6)
        for part in ("head", "neck", "gaze"):
            assert getattr(told, part) == pytest.approx(getattr(parameters, part), abs=1e-6)
    set_identity(face, rig, {})
    set_pose(face, FaceParameters())
    assert np.abs(evaluated(face) - rig.neutral()).max() < TOLERANCE


def test_moved_slider_moves_the_mesh_as_numpy_says(rig, evaluated):
    head = (0.4, -0.2, 0.1)
    face = build_face("Face", rig, FaceParameters(aus={"smile": 3.0}, head=head))
    face["frontalis"], face["smile"] = 7.5, 1.0
    refresh(face)
    wanted = rig.pose(FaceParameters(aus={"frontalis": 7.5, "smile": 1.0}, head=head))
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_arkit_keys_add_the_rig_s_deltas_and_no_driver_fights_them(rig, evaluated):
    face = build_face("Face", rig, FaceParameters(aus={"smile": 2.0}), arkit=True)
    keys = face.data.shape_keys.key_blocks
    keys["jawOpen"].value, keys["tongueOut"].value = 0.5, 1.0
    moved = 0.5 * rig.arkit_deltas[ARKIT_NAMES.index("jawOpen")]
    moved = moved + rig.arkit_deltas[ARKIT_NAMES.index("tongueOut")]
    wanted = rig.pose(FaceParameters(aus={"smile": 2.0})) + moved
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_one_eye_can_be_turned_by_its_bone_on_top_of_the_gaze(rig, evaluated):
    pose = FaceParameters(gaze=(0.2, 0.1))
    face = build_face("Face", rig, pose)
    eye = face.parent.pose.bones["eye_left"]
    eye.rotation_euler[2] = 0.3
    moved = np.abs(evaluated(face) - rig.pose(pose)).max(axis=1)
    left = rig.parts["eyes"] & (rig.neutral()[:, 0] > 0)
    assert moved[left].max() > 0.002
    assert moved[~left].max() < TOLERANCE


@pytest.mark.parametrize("identity_keys", [False, True])
def test_jaw_bone_carries_what_hangs_on_it_along_with_the_lower_teeth(
    rig, evaluated, identity_keys
):
    who = {"jaw_drop": 0.8, "head_depth": -0.5}
    face = build_face("Face", rig, FaceParameters(identity=who), identity_keys=identity_keys)
    rest = evaluated(face)
    teeth = np.flatnonzero(rig.parts["teeth"])
    pose = FaceParameters(aus={"jaw_open": 5.0, "jaw_left": 2.0, "jaw_forward": 3.0}, identity=who)
    open_mouth = rig.pose(pose)
    tooth = teeth[np.argmax(np.linalg.norm(open_mouth - rest, axis=1)[teeth])]
    pendant = bpy.data.objects.new("Pendant", None)
    bpy.context.scene.collection.objects.link(pendant)
    child = pendant.constraints.new("CHILD_OF")
    child.target, child.subtarget = face.parent, "jaw"
    bpy.context.view_layer.update()
    jaw = face.parent.pose.bones["jaw"]
    child.inverse_matrix = (face.parent.matrix_world @ jaw.matrix).inverted()
    pendant.location = to_blender(rest[tooth]).tolist()
    set_pose(face, pose)
    bpy.context.view_layer.update()
    place = np.array(pendant.matrix_world.translation)
    path = np.linalg.norm(open_mouth[tooth] - rest[tooth])
    assert path > 0.015
    # a rigid jaw for keys that stretch a little: 1.2 of 20 mm apart
    assert np.linalg.norm(place - to_blender(open_mouth[tooth])) < 0.1 * path


def test_keyframes_move_the_mesh_between_frames(rig, evaluated):
    face = build_face("Face", rig, FaceParameters())
    for frame, smile, yaw in ((1, 0.0, 0.0), (11, 10.0, 20.0)):
        face["smile"], face["gaze_yaw"] = smile, yaw
        face.keyframe_insert('["smile"]', frame=frame)
        face.keyframe_insert('["gaze_yaw"]', frame=frame)
    for frame, smile, yaw in ((1, 0.0, 0.0), (6, 5.0, 10.0), (11, 10.0, 20.0)):
        bpy.context.scene.frame_set(frame)
        wanted = rig.pose(FaceParameters({"smile": smile}, gaze=(np.radians(yaw), 0.0)))
        assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_face_appended_from_another_file_keeps_its_drivers(rig, evaluated, tmp_path):
    build_face("Face", rig, FaceParameters(aus={"smile": 4.0}), identity_keys=True)
    file = str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build_face("Face", rig, FaceParameters())  # the appended one has to make way
    with bpy.data.libraries.load(file) as (there, here):
        here.objects = list(there.objects)
    for loaded in here.objects:
        bpy.context.scene.collection.objects.link(loaded)
    face = next(o for o in here.objects if o.type == "MESH")
    pose = a_pose(5, someone=True)
    set_identity(face, rig, pose.identity)
    set_pose(face, pose)
    assert np.abs(evaluated(face) - rig.pose(pose)).max() < TOLERANCE
    assert np.abs(evaluated(bpy.data.objects["Face"]) - rig.neutral()).max() < TOLERANCE


def test_copy_of_a_face_obeys_its_own_sliders(rig, evaluated):
    face = build_face("Face", rig, FaceParameters())
    bpy.ops.object.select_all(action="SELECT")
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.duplicate()
    copy = bpy.context.active_object
    assert copy != face
    set_pose(copy, FaceParameters({"jaw_open": 6.0}, gaze=(0.3, 0.0), head=(0.2, 0.0, 0.0)))
    wanted = rig.pose(FaceParameters({"jaw_open": 6.0}, gaze=(0.3, 0.0), head=(0.2, 0.0, 0.0)))
    assert np.abs(evaluated(copy) - wanted).max() < TOLERANCE
    assert np.abs(evaluated(face) - rig.neutral()).max() < TOLERANCE


def test_pose_is_read_and_set_in_any_rotation_mode(rig, evaluated):
    pose = FaceParameters(head=(0.4, -0.3, 0.2), neck=(-0.1, 0.2, -0.15))
    face = build_face("Face", rig, FaceParameters())
    for mode in ("QUATERNION", "AXIS_ANGLE", "XYZ", "ZXY"):
        for name in ("head", "neck"):
            face.parent.pose.bones[name].rotation_mode = mode
        set_pose(face, pose)
        assert np.abs(evaluated(face) - rig.pose(pose)).max() < TOLERANCE
        assert pose_of(face).head == pytest.approx(pose.head, abs=1e-6)
        assert pose_of(face).neck == pytest.approx(pose.neck, abs=1e-6)


def test_fitted_key_fades_the_offsets(rig, evaluated):
    offsets = np.full((rig.n_vertices, 3), 0.004, dtype=np.float32)
    face = build_face("Face", rig, FaceParameters(), offsets)
    face.data.shape_keys.key_blocks["Fitted"].value = 0.25
    assert np.abs(evaluated(face) - (rig.neutral() + 0.001)).max() < TOLERANCE


def test_location_moves_the_whole_face(rig, evaluated):
    face = build_face("Face", rig, FaceParameters(head=(0.3, 0, 0)), location=(1.0, 2.0, 3.0))
    wanted = rig.pose(FaceParameters(head=(0.3, 0, 0))) + (1.0, 3.0, -2.0)
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_face_is_built_in_a_collection_that_the_view_leaves_out(rig, evaluated):
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    bpy.context.view_layer.layer_collection.children["Hidden"].exclude = True
    face = build_face("Face", rig, FaceParameters(), collection=hidden)
    assert set(hidden.objects) == {face, face.parent}
    assert not bpy.context.scene.collection.objects


@pytest.mark.parametrize(
    ("parameters", "offsets", "says"),
    [
        (FaceParameters(), np.zeros((5, 3)), r"must have the shape \(\d+, 3\), got \(5, 3\)"),
        (FaceParameters({"smlie": 3.0}), None, "there is no control 'smlie'; did you mean 'smile'"),
        (FaceParameters({"smile": 11.0}), None, "smile = 11.0 is outside 0 to 10"),
        (FaceParameters(identity={"age": 7.0}), None, "age = 7.0 is outside -1 to 1"),
    ],
)
def test_what_cannot_be_built_leaves_nothing(rig, parameters, offsets, says):
    for identity_keys in (False, True):
        with pytest.raises(ValueError, match=says):
            build_face("Face", rig, parameters, offsets, identity_keys=identity_keys)
    assert not [kind for kind in KINDS if len(getattr(bpy.data, kind))]


def test_face_that_breaks_off_half_way_leaves_nothing(rig, monkeypatch):
    from facs_rig.blender import build as blender

    def broken(*_args):
        raise MemoryError("at the last step")

    monkeypatch.setattr(blender, "drive_jaw", broken)
    with pytest.raises(MemoryError):
        build_face("Face", rig, FaceParameters(), identity_keys=True)
    assert not [kind for kind in KINDS if len(getattr(bpy.data, kind))]


def test_slices_make_the_face_and_show_it_with_the_last(rig, evaluated):
    pose = a_pose(4, someone=True)
    steps, slices = build_steps("Face", rig, pose, location=(0.0, 0.0, 1.0)), 0
    while True:
        try:
            next(steps)
        except StopIteration as end:
            face = end.value
            break
        slices += 1
        assert not bpy.context.scene.collection.all_objects
    assert slices > 1
    assert set(bpy.context.scene.collection.objects) == {face, face.parent}
    assert np.abs(evaluated(face) - (rig.pose(pose) + (0.0, 1.0, 0.0))).max() < TOLERANCE


@pytest.mark.parametrize("identity_keys", [False, True])
def test_build_that_is_closed_early_leaves_nothing(rig, monkeypatch, identity_keys):
    from facs_rig.blender import build as blender

    monkeypatch.setattr(blender, "sliced", lambda units: units)  # pause after every unit
    keep = bpy.data.materials.new("Face Skin")

    def steps():
        offsets = np.zeros((rig.n_vertices, 3))
        return build_steps("Face", rig, a_pose(1), offsets, identity_keys=identity_keys, arkit=True)

    for _ in range(2):  # the second time without what only the first face of a rig needs
        pauses = sum(1 for _ in steps())
        bpy.data.batch_remove([*bpy.data.objects, *bpy.data.meshes, *bpy.data.armatures])
        bpy.data.batch_remove([m for m in bpy.data.materials if m != keep])
    assert pauses > 200
    for pause in (0, 1, 2, 3, *range(4, pauses, 25), pauses):
        half = steps()
        for _ in range(pause):
            next(half)
        half.close()
        left = {kind: list(getattr(bpy.data, kind)) for kind in KINDS}
        assert left.pop("materials") == [keep] and not any(left.values())


def test_build_whose_file_was_exchanged_says_so_and_leaves_nothing(rig, monkeypatch):
    from facs_rig.blender import build as blender

    monkeypatch.setattr(blender, "sliced", lambda units: units)
    for pause in (2, 20, 100):
        half = build_steps("Face", rig, FaceParameters())
        for _ in range(pause):
            next(half)
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        with pytest.raises(ReferenceError):
            finish(half)
        assert not [kind for kind in KINDS if len(getattr(bpy.data, kind))]


def test_slices_end_when_their_time_is_over_and_close_what_they_go_through():
    noted = []

    def units():
        try:
            for k in range(5):
                noted.append(k)
                yield
            return "done"
        finally:
            noted.append("closed")

    assert finish(sliced(units(), 60.0)) == "done" and noted == [0, 1, 2, 3, 4, "closed"]
    assert sum(1 for _ in sliced(units(), 60.0)) == 0
    assert sum(1 for _ in sliced(units(), 1e-12)) == 5
    noted.clear()
    half = sliced(units(), 1e-12)
    next(half)
    half.close()
    assert noted == [0, "closed"]


def test_what_faces_share_is_computed_once_in_any_thread(rig, monkeypatch):
    from facs_rig.blender import materials as blender_materials

    with ThreadPoolExecutor(1) as pool:
        pool.submit(prepare, rig, identity_keys=True, arkit=True).result()
    paint = paint_of(rig)
    monkeypatch.setattr(blender_materials, "_eye_places", None)
    face = build_face("Face", rig, FaceParameters(identity={"gender": 1.0}))
    tint = np.empty(3 * rig.n_vertices, dtype=np.float32)
    face.data.attributes["Tint"].data.foreach_get("vector", tint)
    assert np.array_equal(tint.reshape(-1, 3), paint.tints)
    assert [p.material_index for p in face.data.polygons] == paint.materials.tolist()


def test_polygons_are_what_blender_calls_valid(rig):
    mesh = build_face("Face", rig, FaceParameters()).data
    assert not mesh.validate(verbose=True)
    assert len(mesh.edges) > rig.n_vertices


@pytest.mark.parametrize("identity_keys", [False, True])
def test_every_face_remembers_who_it_is(rig, identity_keys):
    who = {"gender": 0.8, "nose_length": -0.5}
    parameters = FaceParameters({"smile": 2.0}, {**who, "age": 0.0})
    face = build_face("Face", rig, parameters, identity_keys=identity_keys)
    assert identity_of(face) == pose_of(face).identity == who  # without what is at its default
    assert identity_of(build_face("Other", rig, FaceParameters())) == {}


def test_identity_that_cannot_be_changes_nothing(rig, evaluated):
    face = build_face("Face", rig, FaceParameters(), identity_keys=True)
    with pytest.raises(ValueError, match="there is no identity parameter 'agge'"):
        set_identity(face, rig, {"weight": 1.0, "agge": 0.5})
    assert np.abs(evaluated(face) - rig.neutral()).max() < TOLERANCE
    baked = build_face("Baked", rig, FaceParameters())
    with pytest.raises(ValueError, match="'Baked' has no identity keys"):
        set_identity(baked, rig, {"weight": 1.0})


def test_renders_draw_round_irises_and_soft_lips(rig):
    face = build_face("Face", rig, FaceParameters(identity={"eye_size": 0.5}))
    corners = np.asarray(rig.polygon_vertices)
    flat = np.empty(2 * len(corners), dtype=np.float32)
    face.data.uv_layers["Eyes"].data.foreach_get("uv", flat)
    from_middle = np.linalg.norm(flat.reshape(-1, 2), axis=1)
    assert set(rig.vertex_part[corners[from_middle < 2]]) == {rig.part_names.index("eyes")}
    neutral = rig.neutral({"eye_size": 0.5})
    for side in ("left", "right"):
        rim = rig.stroke_points(neutral, f"iris_{side}")
        middle, radius = rim.mean(axis=0), np.ptp(rim[:, 0]) / 2
        eye = rig.parts["eyes"] & (neutral[:, 2] > middle[2] - 0.5 * radius)
        away = np.linalg.norm((neutral - middle)[:, :2], axis=1) / radius
        mine = eye[corners] & (away[corners] < 1.5)
        assert mine.any()
        assert np.abs(from_middle[mine] - away[corners][mine]).max() < 0.05
    tint = np.empty(3 * rig.n_vertices, dtype=np.float32)
    face.data.attributes["Tint"].data.foreach_get("vector", tint)
    green = tint.reshape(-1, 3)[:, 1]
    assert np.allclose(green[~rig.parts["skin"]], 1)
    lips = {v for p in face.data.polygons if MATERIAL_NAMES[p.material_index] == "lips"
            for v in p.vertices}  # fmt: skip
    assert green[list(lips)].mean() < 0.75 < np.median(green[rig.parts["skin"]])
    assert ((green > 0.62) & (green < 0.9)).sum() > 50  # between lips and skin


def test_faces_share_materials_and_have_colours_of_their_own(rig):
    from facs_rig.blender.materials import LOOKS, own_palette
    from facs_rig.looks import PLAIN, colours_of

    who = {"skin_tone": 0.8, "iris_colour": 0.1, "brow_colour": 0.1, "lip_colour": 0.7}
    plain, dark = (
        build_face(name, rig, FaceParameters(identity=i)) for name, i in (("A", {}), ("B", who))
    )
    assert list(plain.data.materials) == list(dark.data.materials)
    palette = colours_of(who)
    for name in LOOKS:
        assert np.allclose(own_palette(plain)[name], 1)
        shown = own_palette(dark)[name] * PLAIN[name].colour[:3]
        assert np.allclose(shown, palette[name].colour[:3], atol=1e-6)
    read = {
        node.attribute_name
        for material in dark.data.materials
        for node in material.node_tree.nodes
        if node.type == "ATTRIBUTE" and node.attribute_type == "OBJECT"
    }
    assert read == {*LOOKS.values(), "look_roughness"}
    assert all(name in dark for name in read)
    set_identity(build_face("C", rig, FaceParameters(), identity_keys=True), rig, who)
    assert list(bpy.data.objects["C"]["look_skin"]) == pytest.approx(list(dark["look_skin"]))


def picture_of(who, rig, path) -> np.ndarray:
    """(64, 64, 4) linear-ish pixels of a small Cycles render of a person."""
    scene = bpy.context.scene
    build_face("Face", rig, FaceParameters({"smile": 4.0, "jaw_open": 3.0}, who))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.3
    camera.location, camera.rotation_euler = (0, -1, 0), (np.pi / 2, 0, 0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3.0, (1.0, 0.3, 0.0)
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 2, False
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return np.array(image.pixels).reshape(64, 64, 4)


def test_faces_render(rig, tmp_path):
    pixels = picture_of({}, rig, tmp_path / "face.png")
    covered = pixels[..., 3] > 0.9
    assert 0.25 < covered.mean() < 0.8
    red, green, blue = pixels[covered][:, :3].mean(axis=0)
    assert 0.2 < blue < green < red  # skin, not the magenta or black of a broken material


def test_a_face_with_its_own_ways_is_the_rigs(evaluated, monkeypatch):
    """Variants of keys: built in, given to a face with identity keys, and taken off again."""
    kinds = {"broad": 0.7, "crooked": -0.4, "heavy": 0.5, "deep": 1.5, "twice": -1.0}
    monkeypatch.setattr(variants, "SOURCES", (lambda who: kinds if "age" in who else {},))
    rig = with_variants(ROWS)
    baked = build_face("Baked", rig, FACE)
    live = build_face("Live", rig, FACE, identity_keys=True)
    for face in (baked, live):
        assert np.abs(evaluated(face) - rig.pose(FACE)).max() < TOLERANCE
    plain = FaceParameters(FACE.aus, {"gender": 0.8})
    assert np.abs(rig.key_deltas_of(FACE.identity) - rig.key_deltas).max() > 1e-3
    for wanted in (plain, FACE):
        reshape(baked, rig, wanted.identity)
        set_identity(live, rig, wanted.identity)
        for face in (baked, live):
            assert np.abs(evaluated(face) - rig.pose(wanted)).max() < TOLERANCE


def test_dark_skin_renders_dark(rig, tmp_path):
    pixels = picture_of({"skin_tone": 0.85}, rig, tmp_path / "face.png")
    red, green, blue = pixels[pixels[..., 3] > 0.9][:, :3].mean(axis=0)
    assert 0.03 < blue < green < red < 0.45
