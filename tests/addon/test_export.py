"""Files of faces, read back by other programs' readers.

Each comes back through a reader that is not ours: the shape, the names of the shape keys, their
number, and how far each moves every vertex.
"""

import json
import struct
import sys

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from addon.export import file_to_core, key_folder, morph_targets, write_mesh
from addon.gltf import STILL, UNTURNED
from facs_rig import (
    ARKIT_NAMES,
    CONTROL_NAMES,
    CONTROLS,
    FULL_INTENSITY,
    FaceParameters,
    load_rig,
)
from facs_rig.common.errors import InputError
from facs_rig.common.files import OutputError
from facs_rig.fitted_keys import FITTED_REGIONS, FittedKey
from facs_rig.levels import at_level
from facs_rig.mesh import vertex_normals
from tests.nightly import at_night
from tests.written import in_rig_order, points_of

NAMES = {"ours": (*CONTROL_NAMES, "neutral"), "arkit": (*ARKIT_NAMES, "neutral")}
STEP = STILL + 0.75**0.5 / 32767  # how far off a morph target of a .glb may be, metres
FACE = FaceParameters({"smile": 4.0, "squint": 2.0}, {"age": 0.5}, (0.3, 0.1, -0.05))


@pytest.fixture(scope="module")
def offsets():
    return np.random.default_rng(0).normal(0, 1e-3, (load_rig().n_vertices, 3)).astype(np.float32)


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_vertices_come_back(tmp_path, offsets, suffix):
    path = tmp_path / f"face{suffix}"
    write_mesh(path, load_rig(), FACE, offsets)
    mesh = trimesh.load(path, force="mesh", process=False)
    posed = load_rig().pose(FACE, offsets)
    assert len(mesh.faces) == len(load_rig().triangles)
    np.testing.assert_allclose(points_of(path), posed, atol=1e-6)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def glb(path):
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def targets_of(tree, blob, name):
    """Morph target -> (n, 3) what it does to POSITION or NORMAL, in the rig's order."""
    (mesh,) = tree["meshes"]
    out = {}
    for k, key in enumerate(mesh["extras"]["targetNames"]):
        parts = [accessor(tree, blob, p["targets"][k][name]) for p in mesh["primitives"]]
        out[key] = in_rig_order(np.concatenate(parts))
    return out


def accessor(tree, blob, index):
    """(n, 3) values of a sparse accessor, decoded by the text of the glTF 2.0 specification."""
    a = tree["accessors"][index]
    kind, most = {5122: ("<i2", 32767), 5120: ("i1", 127)}[a["componentType"]]
    out = np.zeros((a["count"], 3), kind)

    def view(number, dtype):
        v = tree["bufferViews"][number]
        return np.frombuffer(blob[v["byteOffset"] :][: v["byteLength"]], dtype)

    if "sparse" in a:
        rows = view(a["sparse"]["indices"]["bufferView"], "<u2")
        assert len(rows) == a["sparse"]["count"]
        assert (np.diff(rows.astype(np.int64)) > 0).all()  # the specification wants them ascending
        out[rows] = view(a["sparse"]["values"]["bufferView"], kind).reshape(-1, 3)
    assert out.min(axis=0).tolist() == a["min"] and out.max(axis=0).tolist() == a["max"]
    assert a["normalized"] is True
    return np.maximum(out / most, -1)


def apart(a, b) -> float:
    """How far the farthest of points (n, 3) are apart."""
    return float(np.linalg.norm(a - b, axis=1).max())


def test_morph_targets_pose_the_written_face(tmp_path, offsets):
    path = tmp_path / "face.glb"
    rig = load_rig()
    write_mesh(path, rig, FACE, offsets)
    tree, blob = glb(path)
    (mesh,) = tree["meshes"]
    names = mesh["extras"]["targetNames"]
    assert names == [*CONTROL_NAMES, "neutral"]
    assert mesh["weights"] == [0.0] * 48
    targets = targets_of(tree, blob, "POSITION")
    moves = morph_targets(rig, FACE)
    for name, target in targets.items():
        assert apart(target, moves[name]) < STEP
    posed = rig.pose(FACE, offsets)
    rest = FaceParameters({}, FACE.identity, FACE.head)
    assert apart(posed + targets["neutral"], rig.pose(rest, offsets)) < STEP


FACES = {
    "plain": FaceParameters(),
    "worn": FACE,
    "old": FaceParameters(
        {"frontalis": 8.0, "brow_furrow": 8.0, "jaw_open": 6.0, "wince": 5.0, "grimace": 4.0},
        {"age": 1.0, "gender": 1.0, "weight": 1.0, "wrinkles": 1.0},
        (0.5, 0.1, 0.1),
        gaze=(0.2, 0.1),
    ),
}


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("face", FACES)
def test_a_face_with_all_its_targets_is_a_small_file(tmp_path, face, names):
    path = tmp_path / "face.glb"
    write_mesh(path, load_rig(), FACES[face], names=names)
    assert path.stat().st_size < 9.5e6  # with materials, a map and bones


@pytest.mark.parametrize("names", NAMES)
def test_morph_targets_turn_the_light(tmp_path, names):
    path = tmp_path / "face.glb"
    rig = load_rig()
    write_mesh(path, rig, FACE, names=names)
    tree, blob = glb(path)
    mesh = tree["meshes"][0]
    assert mesh["extras"]["targetNames"] == list(NAMES[names])
    posed = rig.pose(FACE)
    rest = vertex_normals(posed, rig.triangles, rig.corners)
    moves = morph_targets(rig, FACE, names)
    targets = targets_of(tree, blob, "NORMAL")
    for name in ("jawOpen",) if names == "arkit" else ("frontalis", "smile"):
        turned = vertex_normals(posed + moves[name], rig.triangles, rig.corners)
        assert np.abs(turned - rest).max() > 0.3  # creases: it matters
        written = rest + np.clip(targets[name], -1, 1)
        assert apart(written, np.clip(turned, rest - 1, rest + 1)) < UNTURNED + 0.01


def test_targets_of_a_face_at_rest():
    targets = morph_targets(load_rig(), FaceParameters())
    assert not targets["neutral"].any()
    np.testing.assert_allclose(
        targets["smile"], load_rig().control_deltas[CONTROL_NAMES.index("smile")], atol=1e-7
    )


@pytest.mark.parametrize("names", NAMES)
def test_neutral_takes_what_goes_with_the_expression_and_actions_bring_it(offsets, names):
    rig = load_rig()
    (name, drawn), *_ = FACE.aus.items()
    region = next(c.region for c in CONTROLS if c.name == name)
    key = FittedKey(FITTED_REGIONS[region], 0.5 * offsets, {name: 1.0}, {name: drawn})
    plain, own = (morph_targets(rig, FACE, names, fitted) for fitted in ((), (key,)))
    turned = rig.turn_vectors(key.offsets, FACE)
    assert apart(own["neutral"], plain["neutral"] - turned) < 1e-6
    if names == "ours":
        full = min(FULL_INTENSITY / drawn, 1.0)
        assert apart(own[name], plain[name] + full * turned) < 1e-6
    changed = {target for target in plain if apart(own[target], plain[target]) > 0}
    assert changed == ({name, "neutral"} if names == "ours" else {"neutral"})


@pytest.mark.parametrize("level", ["medium", "game"])
@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply"])
def test_lighter_levels_come_back(tmp_path, offsets, suffix, level):
    path = tmp_path / f"face{suffix}"
    write_mesh(path, load_rig(), FACE, offsets, detail=level)
    few = at_level(load_rig(), level)
    mesh = trimesh.load(path, force="mesh", process=False)
    assert len(mesh.faces) == len(few.triangles)
    there = load_rig().pose(FACE, offsets)[few.of_full]
    found = points_of(path)
    if suffix == ".glb":  # which cuts the surface apart where its texture has a seam
        for some, others in ((found, there), (there, found)):
            assert cKDTree(others).query(some)[0].max() < 1e-6
        return
    np.testing.assert_allclose(found, there, atol=1e-6)


@pytest.mark.parametrize("names", NAMES)
def test_the_middle_levels_targets_fit_in_a_small_file(tmp_path, names):
    path = tmp_path / "face.glb"
    write_mesh(path, load_rig(), FACES["old"], names=names, detail="medium")
    assert path.stat().st_size < 6e6
    targets = glb(path)[0]["meshes"][0]["extras"]["targetNames"]
    write_mesh(path, load_rig(), FACES["old"], names=names)
    assert targets == glb(path)[0]["meshes"][0]["extras"]["targetNames"]


def test_a_level_that_there_is_not_writes_nothing(tmp_path):
    with pytest.raises(InputError, match="'tiny'"):
        write_mesh(tmp_path / "face.glb", load_rig(), FACE, detail="tiny")
    assert not list(tmp_path.iterdir())


def test_unknown_endings_are_refused(tmp_path):
    with pytest.raises(ValueError, match="no known ending; use .glb"):
        write_mesh(tmp_path / "face.stl", load_rig(), FACE)
    with pytest.raises(ValueError, match="named ours or arkit, not 'vrm'"):
        write_mesh(tmp_path / "face.glb", load_rig(), FACE, names="vrm")
    with pytest.raises(ValueError, match="goes with .obj, not with 'face.ply'"):
        write_mesh(tmp_path / "face.ply", load_rig(), FACE, keys=True)
    assert not list(tmp_path.iterdir())


def test_a_write_that_fails_leaves_the_old_file(tmp_path):
    path = tmp_path / "face.glb"
    path.write_bytes(b"old")
    with pytest.raises(ValueError, match="offsets must have the shape"):
        write_mesh(path, load_rig(), FACE, np.zeros((2, 3)))
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["face.glb"]


def test_blend_holds_the_face_in_blenders_axes(tmp_path, offsets):
    bpy = pytest.importorskip("bpy")
    path = tmp_path / "face.blend"
    write_mesh(path, load_rig(), FACE, offsets)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    (face,) = [o for o in bpy.data.objects if o.type == "MESH"]
    evaluated = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    flat = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", flat)
    world = np.array(face.matrix_world)
    points = np.column_stack([flat.reshape(-1, 3), np.ones(len(mesh.vertices))]) @ world.T
    core = (points @ file_to_core(path).T)[:, :3]
    np.testing.assert_allclose(core, load_rig().pose(FACE, offsets), atol=1e-5)
    bpy.ops.wm.read_factory_settings(use_empty=True)


# --- shape keys, read back -----------------------------------------------------------------------


def test_targets_of_an_identity_are_its_own():
    rig, who = load_rig(), {"age": 1.0, "gender": 1.0, "wrinkles": 0.5}
    old, plain = (morph_targets(rig, FaceParameters({}, i))["frontalis"] for i in (who, {}))
    np.testing.assert_allclose(
        rig.neutral(who) + old, rig.pose(FaceParameters({"frontalis": 5.0}, who)), atol=1e-6
    )
    assert np.abs(old - plain).max() > 1e-4  # deeper worry lines


def test_targets_of_a_turned_face_pose_it(offsets):
    """Each target on a face at rest is the control itself, whatever the identity and the head."""
    rig = load_rig()
    rest = FaceParameters({}, FACE.identity, FACE.head)
    targets = morph_targets(rig, rest)
    for name in ("jaw_open", "blink", "sneer_left"):
        full = FaceParameters({name: 5.0}, FACE.identity, FACE.head)
        wanted = rig.pose(full, offsets)
        np.testing.assert_allclose(rig.pose(rest, offsets) + targets[name], wanted, atol=1e-6)


def test_an_obj_has_the_rigs_quads(tmp_path):
    path = tmp_path / "face.obj"
    write_mesh(path, load_rig(), FACE)
    corners = [len(line.split()) - 1 for line in path.read_text().splitlines() if line[:2] == "f "]
    starts = load_rig().polygon_starts
    assert len(corners) == (starts < len(load_rig().polygon_vertices)).sum()
    assert sum(n == 4 for n in corners) > len(corners) / 2
    assert {3, 4} >= set(corners)


def test_an_obj_lies_on_the_texture_as_the_rig_does(tmp_path):
    rig, path = load_rig(), tmp_path / "face.obj"
    write_mesh(path, rig, FACE)
    mesh = trimesh.load(path, force="mesh", process=False)
    posed = rig.pose(FACE)
    corners = rig.triangle_corners
    for face in range(0, len(mesh.faces), 1999):  # the reader orders faces by part
        places = mesh.vertices[mesh.faces[face]].mean(axis=0)
        near = np.argsort(np.linalg.norm(posed[rig.triangles].mean(axis=1) - places, axis=1))[:3]
        found = mesh.visual.uv[mesh.faces[face]].mean(axis=0)
        assert np.abs(rig.uv[corners[near]].mean(axis=1) - found).sum(axis=1).min() < 2e-6


@pytest.mark.parametrize("names", ["ours", at_night("arkit")])  # 50 files of other targets
def test_an_obj_has_a_face_for_each_key(tmp_path, offsets, names):
    rig, path = load_rig(), tmp_path / "face.obj"
    key_folder(path).mkdir()
    (key_folder(path) / "older.obj").write_text("v 0 0 0\n")
    seen = []
    write_mesh(path, rig, FACE, offsets, names=names, keys=True,
               progress=lambda *at: seen.append(at))  # fmt: skip
    assert seen[-1] == (len(NAMES[names]),) * 2
    assert {p.name for p in tmp_path.iterdir()} == {"face.obj", "face_keys"}
    assert {p.name for p in key_folder(path).iterdir()} == {f"{n}.obj" for n in NAMES[names]}
    targets = morph_targets(rig, FACE, names)
    base = trimesh.load(path, force="mesh", process=False)
    points = points_of(path)
    for name in list(NAMES[names])[::9] + ["neutral"]:
        of_key = key_folder(path) / f"{name}.obj"
        mesh = trimesh.load(of_key, force="mesh", process=False)
        np.testing.assert_array_equal(mesh.faces, base.faces)
        np.testing.assert_array_equal(mesh.visual.uv, base.visual.uv)
        np.testing.assert_allclose(points_of(of_key) - points, targets[name], atol=1e-6)


def test_a_folder_with_something_else_in_it_is_left_alone(tmp_path):
    path = tmp_path / "face.obj"
    key_folder(path).mkdir()
    (key_folder(path) / "thesis.txt").write_text("the only copy")
    with pytest.raises(OutputError, match="holds other files than .obj; move it away"):
        write_mesh(path, load_rig(), FACE, keys=True)
    assert {p.name for p in tmp_path.iterdir()} == {"face_keys"}
    assert (key_folder(path) / "thesis.txt").read_text() == "the only copy"


def blocks(bpy, keys) -> dict[str, np.ndarray]:
    """Shape key -> (n, 3) displacement from the basis, in the object's space."""
    out = {}
    for key in keys:
        flat = np.empty(3 * len(key.data), np.float32)
        key.data.foreach_get("co", flat)
        out[key.name] = flat.reshape(-1, 3)
    basis = out.pop("Basis")
    return {name: points - basis for name, points in out.items()}


def core(vectors: np.ndarray, world) -> np.ndarray:
    """Vectors of a Blender object in the rig's axes."""
    turned = vectors @ np.array(world)[:3, :3].T
    return np.stack([turned[:, 0], turned[:, 2], -turned[:, 1]], axis=1)


# Each format and each names in every run, every pair of them at night.
@pytest.mark.parametrize(("names", "suffix"), [
    ("ours", ".glb"), ("arkit", ".fbx"), at_night("ours", ".fbx"), at_night("arkit", ".glb"),
])  # fmt: skip
def test_blender_reads_the_keys_back(tmp_path, offsets, suffix, names, capfd):
    bpy = pytest.importorskip("bpy")
    rig, path = load_rig(), tmp_path / f"face{suffix}"
    write_mesh(path, rig, FACE, offsets, names=names)
    assert capfd.readouterr().out == ""  # Blender's exporters would chat
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path), import_shading="SMOOTH")
    else:
        bpy.ops.import_scene.fbx(filepath=str(path))
    (face,) = [o for o in bpy.data.objects if o.type == "MESH" and o.data.shape_keys]
    keys = face.data.shape_keys.key_blocks
    assert [key.name for key in keys[1:]] == list(NAMES[names])
    assert not any(key.value for key in keys[1:])
    moved = blocks(bpy, keys)
    if suffix == ".glb":
        assert [m.name for m in face.data.materials] == list(rig.part_names)
        moved = {name: in_rig_order(move) for name, move in moved.items()}
    assert len(next(iter(moved.values()))) == rig.n_vertices
    for name, delta in morph_targets(rig, FACE, names).items():
        read = core(moved[name], face.matrix_world)
        if suffix == ".glb":
            assert apart(read, delta) < STEP, name
        else:
            np.testing.assert_allclose(read, delta, atol=2e-6)
    bpy.ops.wm.read_factory_settings(use_empty=True)


def test_an_fbx_holds_the_rigs_own_coordinates(tmp_path, offsets):
    """Metres and y up, in the numbers of the file: a fit's projection is true of them."""
    pytest.importorskip("bpy")
    from io_scene_fbx import parse_fbx

    path = tmp_path / "face.fbx"
    write_mesh(path, load_rig(), FACE, offsets)
    tree, _ = parse_fbx.parse(str(path))

    def child(parent, name):
        return next(e for e in parent.elems if e.id == name)

    vertices = np.array(child(child(child(tree, b"Objects"), b"Geometry"), b"Vertices").props[0])
    posed = load_rig().pose(FACE, offsets)
    np.testing.assert_allclose(vertices.reshape(-1, 3), posed, atol=1e-6)
    np.testing.assert_array_equal(file_to_core(path), np.eye(4))


@pytest.mark.parametrize("names", NAMES)
def test_a_blend_keeps_every_key_of_the_rig(tmp_path, names, capfd):
    bpy = pytest.importorskip("bpy")
    rig, path = load_rig(), tmp_path / "face.blend"
    write_mesh(path, rig, FaceParameters(), names=names)
    assert capfd.readouterr().out == ""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    (face,) = [o for o in bpy.data.objects if o.type == "MESH" and o.data.shape_keys]
    moved = blocks(bpy, face.data.shape_keys.key_blocks)
    wanted = dict(zip([key.name for key in rig.keys], rig.key_deltas, strict=True))
    if names == "arkit":
        wanted |= dict(zip(ARKIT_NAMES, rig.arkit_deltas, strict=True))
    assert set(moved) == set(wanted)
    for name, delta in wanted.items():
        np.testing.assert_allclose(core(moved[name], np.eye(4)), delta, atol=1e-6)
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.mark.parametrize("suffix", [".fbx", ".blend"])
def test_without_blender_the_way_out_is_named(tmp_path, monkeypatch, suffix):
    monkeypatch.setitem(sys.modules, "bpy", None)
    with pytest.raises(ValueError, match=f"Writing {suffix} needs Blender's Python module"):
        write_mesh(tmp_path / f"face{suffix}", load_rig(), FACE)
    assert not list(tmp_path.iterdir())
