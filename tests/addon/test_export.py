"""Files of faces, read back by other programs' readers."""

import json
import struct

import numpy as np
import pytest
import trimesh

from addon.export import file_to_core, morph_targets, write_mesh
from facs_rig import CONTROL_NAMES, FaceParameters, load_rig

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
    np.testing.assert_allclose(mesh.vertices, posed, atol=1e-6)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def glb(path):
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def accessor(tree, blob, index):
    """(n, 3) values of a sparse accessor, decoded by the text of the glTF 2.0 specification."""
    a = tree["accessors"][index]
    out = np.zeros((a["count"], 3), np.float32)

    def view(number, dtype):
        v = tree["bufferViews"][number]
        start = v.get("byteOffset", 0)
        return np.frombuffer(blob[start : start + v["byteLength"]], dtype)

    if "sparse" in a:
        count = a["sparse"]["count"]
        rows = view(a["sparse"]["indices"]["bufferView"], "<u4")[:count]
        values = view(a["sparse"]["values"]["bufferView"], "<f4")[: 3 * count]
        assert (np.diff(rows.astype(np.int64)) > 0).all()  # the specification wants them ascending
        out[rows] = values.reshape(-1, 3)
    np.testing.assert_allclose(out.min(axis=0), a["min"], atol=1e-7)
    np.testing.assert_allclose(out.max(axis=0), a["max"], atol=1e-7)
    return out


def test_morph_targets_pose_the_written_face(tmp_path, offsets):
    path = tmp_path / "face.glb"
    rig = load_rig()
    write_mesh(path, rig, FACE, offsets)
    tree, blob = glb(path)
    (mesh,) = tree["meshes"]
    names = mesh["extras"]["targetNames"]
    assert names == [*CONTROL_NAMES, "neutral"]
    assert mesh["weights"] == [0.0] * 48
    (primitive,) = mesh["primitives"]
    targets = {n: accessor(tree, blob, t["POSITION"])
               for n, t in zip(names, primitive["targets"], strict=True)}  # fmt: skip
    posed = rig.pose(FACE, offsets)
    more = FaceParameters({**FACE.aus, "jaw_open": 5.0}, FACE.identity, FACE.head)
    np.testing.assert_allclose(posed + targets["jaw_open"], rig.pose(more, offsets), atol=5e-6)
    rest = FaceParameters({}, FACE.identity, FACE.head)
    np.testing.assert_allclose(posed + targets["neutral"], rig.pose(rest, offsets), atol=5e-6)


def test_targets_of_a_face_at_rest():
    targets = morph_targets(load_rig(), FaceParameters())
    assert not targets["neutral"].any()
    np.testing.assert_array_equal(
        targets["smile"], load_rig().control_deltas[CONTROL_NAMES.index("smile")]
    )


def test_unknown_endings_are_refused(tmp_path):
    with pytest.raises(ValueError, match="no known ending; use .glb"):
        write_mesh(tmp_path / "face.fbx", load_rig(), FACE)
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
