"""A face becomes another person in place, and everything else about it stays."""

from __future__ import annotations

import bmesh
import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import ARKIT_NAMES, FaceParameters  # noqa: E402
from facs_rig.blender import build_face, to_blender  # noqa: E402
from facs_rig.blender.arrays import read_key, write_key  # noqa: E402
from facs_rig.blender.pose import MARK, VERSION, identity_of, pose_of, set_pose  # noqa: E402
from facs_rig.blender.reshape import fitted_offsets, reshape, reshape_steps  # noqa: E402
from facs_rig.identity import IDENTITY_KEYS  # noqa: E402
from facs_rig.stylised import preset  # noqa: E402

from .test_build_face import TOLERANCE, a_pose, names_of  # noqa: E402

WHO = {"age": 0.7, "gender": 0.9, "eye_spacing": 0.6, "neck_length": -0.8, "jaw_drop": 0.5}
BOTH = pytest.mark.parametrize("identity_keys", [False, True])


def some_offsets(rig, seed: int):
    random = np.random.default_rng(seed)
    return random.normal(0, 0.002, (rig.n_vertices, 3)).astype(np.float32)


def points_of(face) -> dict[str, np.ndarray]:
    """Every key's points, and the mesh's own."""
    own = np.empty((len(face.data.vertices), 3), dtype=np.float32)
    face.data.vertices.foreach_get("co", own.reshape(-1))
    return {"": own} | {block.name: read_key(block) for block in face.data.shape_keys.key_blocks}


def state_of(face) -> dict:
    """All that `reshape` could change."""
    blocks = face.data.shape_keys.key_blocks
    bones = face.parent.pose.bones if face.parent else ()
    return {
        "points": {name: points.tobytes() for name, points in points_of(face).items()},
        "values": [(b.name, b.value, b.mute, b.relative_key.name) for b in blocks],
        "properties": {k: v.to_dict() if hasattr(v, "to_dict") else v for k, v in face.items()
                       if isinstance(v, int | float) or hasattr(v, "to_dict")},
        "bones": [(bone.name, tuple(bone.location)) for bone in bones],
    }  # fmt: skip


def artist_key(face, rig, name: str, relative: str | None = None, *, by: float = 0.003):
    """A key that the artist adds: moves the first hundred vertices sideways."""
    blocks = face.data.shape_keys.key_blocks
    block = face.shape_key_add(name=name, from_mix=False)
    block.value = 0.0
    if relative is not None:
        block.relative_key = blocks[relative]
    points = read_key(block.relative_key)
    points[:100, 0] += by
    write_key(block, points)
    return block


@BOTH
@pytest.mark.parametrize("seed", [1, 2])
def test_reshaped_face_equals_the_posed_rig_and_a_new_face(rig, evaluated, identity_keys, seed):
    pose, before = a_pose(seed, someone=True), a_pose(seed + 50, someone=True)
    face = build_face(
        "Face", rig, before, some_offsets(rig, 9), identity_keys=identity_keys, arkit=True
    )
    offsets = some_offsets(rig, seed)
    reshape(face, rig, pose.identity, offsets)
    told = pose_of(face)
    assert dict(told.identity) == pytest.approx(dict(pose.identity), abs=1e-6)
    assert dict(told.aus) == pytest.approx(dict(before.aus), abs=1e-6)
    for part in ("head", "neck", "gaze"):
        assert getattr(told, part) == pytest.approx(getattr(before, part), abs=1e-6)
    stays = FaceParameters(before.aus, pose.identity, before.head, before.neck, before.gaze)
    assert np.abs(evaluated(face) - rig.pose(stays, offsets)).max() < TOLERANCE
    set_pose(face, pose)
    assert np.abs(evaluated(face) - rig.pose(pose, offsets)).max() < TOLERANCE

    new = build_face("New", rig, pose, offsets, identity_keys=identity_keys, arkit=True)
    assert names_of(face) == names_of(new)
    assert np.abs(evaluated(face) - evaluated(new)).max() < 1e-6
    for (name, points), wanted in zip(
        points_of(face).items(), points_of(new).values(), strict=True
    ):
        assert np.abs(points - wanted).max() < 1e-7, name
    for name in names_of(new):
        theirs = new.data.shape_keys.key_blocks[name].value
        assert face.data.shape_keys.key_blocks[name].value == pytest.approx(theirs, abs=1e-6)
    for bone, other in zip(face.parent.pose.bones, new.parent.pose.bones, strict=True):
        assert tuple(bone.location) == pytest.approx(tuple(other.location), abs=1e-7)


@BOTH
def test_stylised_people_equal_the_posed_rig(rig, evaluated, identity_keys):
    """Their keys are their own: lids of large eyes go farther, and ARKit's as well."""
    pose = a_pose(1)
    face = build_face("Face", rig, pose, identity_keys=identity_keys, arkit=True)
    blocks = face.data.shape_keys.key_blocks
    for who in (preset("chibi"), preset("witch"), WHO, {}):
        reshape(face, rig, who)
        stays = FaceParameters(pose.aus, who, pose.head, pose.neck, pose.gaze)
        assert np.abs(evaluated(face) - rig.pose(stays)).max() < TOLERANCE
        assert dict(identity_of(face)) == pytest.approx(who)
        closing = ARKIT_NAMES.index("eyeBlinkLeft")
        moves = read_key(blocks["eyeBlinkLeft"]) - read_key(blocks["Basis"])
        wanted = to_blender(rig.arkit_deltas_of(who)[closing])
        assert np.abs(moves - wanted).max() < 1e-6


@BOTH
def test_place_animation_and_names_stay(rig, evaluated, identity_keys):
    face = build_face(
        "Face", rig, FaceParameters(), location=(1.0, 2.0, 3.0), identity_keys=identity_keys
    )
    for frame, smile in ((1, 0.0), (11, 10.0)):
        face["smile"] = smile
        face.keyframe_insert('["smile"]', frame=frame)
    face.name = face.data.name = "Anna"
    face.active_shape_key_index = 3
    polygons = len(face.data.polygons)
    reshape(face, rig, WHO, some_offsets(rig, 1))
    assert (face.name, face.data.name, face.active_shape_key_index) == ("Anna", "Anna", 3)
    assert len(face.data.polygons) == polygons and not face.data.validate()
    for frame, smile in ((1, 0.0), (6, 5.0), (11, 10.0)):
        bpy.context.scene.frame_set(frame)
        wanted = rig.pose(FaceParameters({"smile": smile}, WHO), some_offsets(rig, 1))
        assert np.abs(evaluated(face) - (wanted + (1.0, 3.0, -2.0))).max() < TOLERANCE


@BOTH
def test_fitted_is_made_kept_and_emptied(rig, evaluated, identity_keys):
    face = build_face("Face", rig, FaceParameters(), identity_keys=identity_keys)
    assert fitted_offsets(face) is None
    reshape(face, rig, WHO)
    assert fitted_offsets(face) is None and "Fitted" not in names_of(face)
    offsets = some_offsets(rig, 3)
    reshape(face, rig, WHO, offsets)
    assert names_of(face)[-1] == "Fitted"
    assert np.abs(fitted_offsets(face) - offsets).max() < 1e-7
    face.data.shape_keys.key_blocks["Fitted"].value = 0.5
    reshape(face, rig, {"age": 1.0})
    assert np.abs(fitted_offsets(face) - offsets).max() < 1e-7
    wanted = rig.neutral({"age": 1.0}) + 0.5 * offsets  # as far on as the artist had it
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE
    reshape(face, rig, {"age": 1.0}, np.zeros((rig.n_vertices, 3)))
    assert not fitted_offsets(face).any()
    assert np.abs(evaluated(face) - rig.neutral({"age": 1.0})).max() < TOLERANCE
    face.shape_key_clear()
    assert fitted_offsets(face) is None


@BOTH
def test_undo_and_redo_bring_the_vertices_exactly(rig, evaluated, identity_keys):
    face = build_face("Face", rig, a_pose(3, someone=True), identity_keys=identity_keys)
    artist_key(face, rig, "Mine").value = 1.0
    bpy.ops.ed.undo_push(message="built")
    before, state = evaluated(face), state_of(face)
    reshape(face, rig, WHO, some_offsets(rig, 4))
    bpy.ops.ed.undo_push(message="reshaped")
    after, reshaped = evaluated(face), state_of(face)
    reshape(face, rig, {"weight": 1.0}, some_offsets(rig, 5))
    bpy.ops.ed.undo_push(message="reshaped again")
    assert np.abs(after - before).max() > 0.003
    for turn in (bpy.ops.ed.undo, bpy.ops.ed.undo, bpy.ops.ed.redo, bpy.ops.ed.undo):
        turn()
        face = bpy.data.objects["Face"]
        wanted = (after, reshaped) if "Fitted" in names_of(face) else (before, state)
        assert np.array_equal(evaluated(face), wanted[0])
        assert state_of(face) == wanted[1]
    bpy.ops.ed.redo()
    assert np.array_equal(evaluated(bpy.data.objects["Face"]), after)


@BOTH
def test_keys_of_the_artist_keep_their_offsets(rig, evaluated, identity_keys):
    face = build_face(
        "Face", rig, FaceParameters(), some_offsets(rig, 6), identity_keys=identity_keys
    )
    made = {"Bump": None, "Corner": "smile", "On Bump": "Bump", "On Fitted": "Fitted"}
    for k, (name, relative) in enumerate(made.items()):
        artist_key(face, rig, name, relative, by=0.001 * (k + 1))
    artist_key(face, rig, "Round").relative_key = artist_key(face, rig, "About")
    blocks = face.data.shape_keys.key_blocks
    blocks["About"].relative_key = blocks["Round"]
    blocks["Bump"].vertex_group, blocks["Corner"].mute = "head", True

    def offsets() -> dict[str, np.ndarray]:
        return {n: read_key(blocks[n]) - read_key(blocks[n].relative_key) for n in names_of(face)
                if n in (*made, "Round", "About")}  # fmt: skip

    before = offsets()
    for k, who in enumerate((WHO, {"age": 1.0}, {})):
        reshape(face, rig, who, some_offsets(rig, k))
        for name, wanted in before.items():
            assert np.abs(offsets()[name] - wanted).max() < 1e-7, name
    assert blocks["Bump"].vertex_group == "head" and blocks["Corner"].mute
    blocks["Corner"].mute, blocks["Bump"].vertex_group = False, ""
    for block in (blocks["Bump"], blocks["Corner"]):
        block.value = 1.0
    wanted = rig.pose(FaceParameters(), some_offsets(rig, 2))
    wanted[:100, 0] += 0.001 + 0.002
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


@BOTH
def test_arkit_keys_move_the_new_person(rig, evaluated, identity_keys):
    face = build_face("Face", rig, FaceParameters(), identity_keys=identity_keys, arkit=True)
    reshape(face, rig, WHO)
    face.data.shape_keys.key_blocks["jawOpen"].value = 0.5
    wanted = rig.neutral(WHO) + 0.5 * rig.arkit_deltas[ARKIT_NAMES.index("jawOpen")]
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_key_that_is_only_called_as_arkit_s_stays_the_artist_s(rig):
    face = build_face("Face", rig, FaceParameters())
    artist_key(face, rig, "jawOpen")
    reshape(face, rig, WHO)
    blocks = face.data.shape_keys.key_blocks
    kept = read_key(blocks["jawOpen"]) - read_key(blocks["Basis"])
    assert kept[:100, 0] == pytest.approx(0.003, abs=1e-7) and not kept[100:].any()


@BOTH
def test_renamed_face_is_reshaped_after_reloading(rig, evaluated, tmp_path, identity_keys):
    pose = a_pose(7, someone=True)
    face = build_face("Face", rig, pose, some_offsets(rig, 1), identity_keys=identity_keys)
    face.name, face.data.name, face.parent.name = "Anna", "Anna's Mesh", "Bones"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "anna.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "anna.blend"))
    face = bpy.data.objects["Anna"]
    assert dict(identity_of(face)) == pytest.approx(dict(pose.identity), abs=1e-6)
    reshape(face, rig, WHO, some_offsets(rig, 2))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "anna.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "anna.blend"))
    stays = FaceParameters(pose.aus, WHO, pose.head, pose.neck, pose.gaze)
    shown = evaluated(bpy.data.objects["Anna"])
    assert np.abs(shown - rig.pose(stays, some_offsets(rig, 2))).max() < TOLERANCE


def test_face_that_went_through_edit_mode_is_reshaped(rig, evaluated):
    face = build_face("Face", rig, FaceParameters({"smile": 3.0}))
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    reshape(face, rig, WHO)
    assert np.abs(evaluated(face) - rig.pose(FaceParameters({"smile": 3.0}, WHO))).max() < TOLERANCE
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.abs(evaluated(face) - rig.pose(FaceParameters({"smile": 3.0}, WHO))).max() < TOLERANCE


def test_face_without_its_armature_is_reshaped(rig, evaluated):
    face = build_face("Face", rig, FaceParameters())
    bpy.data.objects.remove(face.parent)
    reshape(face, rig, WHO)
    assert np.abs(evaluated(face) - rig.neutral(WHO)).max() < TOLERANCE


# --- what cannot be reshaped ----------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize(
    ("who", "offsets", "says"),
    [
        ({"weight": 1.0, "agge": 0.5}, None, "there is no identity parameter 'agge'"),
        ({"age": 7.0}, None, "age = 7.0 is outside -1 to 1"),
        ({"age": float("nan")}, None, "age = nan is outside -1 to 1"),
        (WHO, np.zeros((5, 3)), r"offsets must have the shape \(\d+, 3\), got \(5, 3\)"),
        (WHO, "nan", "offsets must be finite numbers"),
    ],
)
def test_bad_values_change_nothing(rig, who, offsets, says, identity_keys):
    face = build_face("Face", rig, a_pose(1, someone=True), identity_keys=identity_keys)
    if isinstance(offsets, str):
        offsets = np.full((rig.n_vertices, 3), np.nan)
    before = state_of(face)
    with pytest.raises(ValueError, match=says):
        reshape(face, rig, who, offsets)
    assert state_of(face) == before


def without_vertex(face) -> None:
    edited = bmesh.new()
    edited.from_mesh(face.data)
    edited.verts.ensure_lookup_table()
    edited.verts.remove(edited.verts[1000])
    edited.to_mesh(face.data)
    edited.free()


def reordered(face) -> None:
    edited = bmesh.new()
    edited.from_mesh(face.data)
    for vertex in edited.verts:
        vertex.index = len(edited.verts) - 1 - vertex.index
    edited.verts.sort()
    edited.to_mesh(face.data)
    edited.free()


def lost_key(face, name: str) -> None:
    face.shape_key_remove(face.data.shape_keys.key_blocks[name])


def in_edit_mode(face) -> None:
    bpy.context.view_layer.objects.active = face
    bpy.ops.object.mode_set(mode="EDIT")


def old_bones(face) -> None:
    bpy.context.view_layer.objects.active = face.parent
    bpy.ops.object.mode_set(mode="EDIT")
    bones = face.parent.data.edit_bones
    bones.remove(bones["neck_at"])
    bpy.ops.object.mode_set(mode="OBJECT")


@BOTH
@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (without_vertex, "the mesh of 'Face' has other vertices or polygons"),
        (reordered, "the mesh of 'Face' has other vertices or polygons"),
        (lambda face: lost_key(face, "smile"), "'Face' has lost its shape key 'smile'"),
        (lambda face: face.shape_key_clear(), "'Face' has lost its shape keys"),
        (in_edit_mode, "'Face' is being edited; go to Object Mode first"),
        (old_bones, "the bones of 'Face' cannot follow another person's joints"),
        (lambda face: face.__setitem__(MARK, VERSION + 1), "made by a newer version"),
        (lambda face: face.__delitem__(MARK), "is not a face that Sketch to Face made"),
    ],
)
def test_spoilt_face_is_one_sentence_and_changes_nothing(rig, spoil, says, identity_keys):
    face = build_face(
        "Face", rig, FaceParameters(), some_offsets(rig, 1), identity_keys=identity_keys
    )
    spoil(face)
    keys = face.data.shape_keys
    before = state_of(face) if keys and face.mode == "OBJECT" else None
    with pytest.raises(ValueError, match=says) as caught:
        reshape(face, rig, WHO, some_offsets(rig, 2))
    assert "\n" not in str(caught.value)
    assert before is None or state_of(face) == before
    assert identity_of(face) == {}


def test_face_that_lost_one_identity_key_is_refused(rig):
    face = build_face("Face", rig, FaceParameters(identity=WHO), identity_keys=True)
    lost_key(face, IDENTITY_KEYS[5])
    before = state_of(face)
    with pytest.raises(ValueError, match="has lost its shape key"):
        reshape(face, rig, {})
    assert state_of(face) == before


def test_linked_face_is_refused_until_it_is_local(rig, evaluated, tmp_path):
    library = str(tmp_path / "library.blend")
    made = build_face("Face", rig, FaceParameters())
    bpy.data.libraries.write(library, {made, made.parent})
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (there, here):
        here.objects = list(there.objects)
    for thing in here.objects:
        bpy.context.scene.collection.objects.link(thing)
    with pytest.raises(ValueError, match="'Face' is linked from another file; make it and its"):
        reshape(bpy.data.objects["Face"], rig, WHO)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.make_local(type="ALL")
    face = bpy.data.objects["Face"]
    reshape(face, rig, WHO)
    assert np.abs(evaluated(face) - rig.neutral(WHO)).max() < TOLERANCE


# --- in slices ------------------------------------------------------------------------------------


def test_newer_blenders_write_in_one_slice(rig):
    face = build_face("Face", rig, FaceParameters())
    before = state_of(face)
    steps = reshape_steps(face, rig, WHO, some_offsets(rig, 1))
    steps.close()
    assert state_of(face) == before
    reshape(face, rig, WHO)  # what is computed once is computed
    assert sum(1 for _ in reshape_steps(face, rig, WHO, some_offsets(rig, 1))) < 3


@BOTH
@pytest.mark.parametrize("pauses", [0, 1, 2, 3, 40])
def test_closing_early_leaves_no_half(rig, monkeypatch, evaluated, identity_keys, pauses):
    from facs_rig.blender import reshape as blender_reshape

    # as Blenders before 4.1 do it: a pause after each key
    monkeypatch.setattr(blender_reshape, "BULK", False)
    monkeypatch.setattr(blender_reshape, "sliced", lambda units, seconds: units)
    pose = a_pose(8, someone=True)
    face = build_face("Face", rig, pose, identity_keys=identity_keys)
    artist_key(face, rig, "Mine")
    before, offsets = state_of(face), some_offsets(rig, 1)
    steps = reshape_steps(face, rig, WHO, offsets)
    done = 0
    for _ in range(pauses):
        done += next(steps, "end") != "end"
    steps.close()
    if not done:
        assert state_of(face) == before
        return
    stays = FaceParameters(pose.aus, WHO, pose.head, pose.neck, pose.gaze)
    assert np.abs(evaluated(face) - rig.pose(stays, offsets)).max() < TOLERANCE
    assert np.abs(fitted_offsets(face) - offsets).max() < 1e-7


def test_basis_and_mesh_agree(rig):
    face = build_face("Face", rig, FaceParameters())
    reshape(face, rig, WHO)
    points = points_of(face)
    assert np.array_equal(points[""], points["Basis"])
    assert np.array_equal(points["Basis"], to_blender(rig.neutral(WHO)))
