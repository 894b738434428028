"""The bytes of a .glb, of small meshes that can be followed by hand."""

import json
import struct

import numpy as np
import pytest
import trimesh

from addon.gltf import STILL, Finish, Surface, glb
from facs_rig.bones import Skeleton
from facs_rig.rotation import rotation


def parts(data):
    """The tree and the buffer of a .glb, by the text of the specification."""
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON" and size % 4 == 0
    tree = json.loads(data[20 : 20 + size])
    blob_size, kind = struct.unpack("<I4s", data[20 + size : 28 + size])
    assert kind == b"BIN\0" and blob_size == tree["buffers"][0]["byteLength"] == len(
        data[28 + size :]
    )
    return tree, data[28 + size :]


def read(tree, blob, index):
    """The values of an accessor as floats."""
    a = tree["accessors"][index]
    kind, most = {5120: ("i1", 127), 5121: ("u1", 255), 5122: ("<i2", 32767), 5123: ("<u2", 65535),
                  5125: ("<u4", 1), 5126: ("<f4", 1)}[a["componentType"]]  # fmt: skip
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a["type"]]
    out = np.zeros((a["count"], width), kind)

    def view(number, dtype, count, width):
        v = tree["bufferViews"][number]
        assert v["byteOffset"] % 4 == 0
        part = blob[v["byteOffset"] :][: v["byteLength"]]
        step = v.get("byteStride", width * np.dtype(dtype).itemsize)
        assert step % 4 == 0 or "byteStride" not in v
        rows = np.lib.stride_tricks.as_strided(
            np.frombuffer(part, dtype), (count, width), (step, np.dtype(dtype).itemsize)
        )
        return rows.copy()

    if "bufferView" in a:
        out = view(a["bufferView"], kind, *out.shape)
    if "sparse" in a:
        count, where = a["sparse"]["count"], a["sparse"]["indices"]
        number = {5123: "<u2", 5125: "<u4"}[where["componentType"]]
        rows = view(where["bufferView"], number, count, 1)[:, 0]
        out[rows] = view(a["sparse"]["values"]["bufferView"], kind, count, width)
    return out / most if a.get("normalized") else out


def fold(n=9):
    """A flat sheet of n x n vertices, 1 cm apart, and a movement that folds it along its middle."""
    x, y = np.meshgrid(0.01 * np.arange(n), 0.01 * np.arange(n), indexing="ij")
    sheet = np.stack([x, y, 0 * x], axis=2).reshape(-1, 3)
    corner = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    triangles = np.concatenate([corner[:, None] + [0, n, n + 1], corner[:, None] + [0, n + 1, 1]])
    middle = 0.01 * (n // 2)
    up = np.zeros_like(sheet)
    up[:, 2] = np.maximum(sheet[:, 0] - middle, 0.0)
    return sheet, triangles, up


def test_a_folded_sheet_comes_back():
    sheet, triangles, up = fold()
    colours = np.tile(np.array([10, 20, 30, 255]) / 255, (len(sheet), 1))
    tree, blob = parts(glb(sheet, triangles, colours, {"fold": up, "still": 0 * up}, "sheet"))
    (mesh,) = tree["meshes"]
    assert mesh["name"] == tree["nodes"][0]["name"] == "sheet"
    assert mesh["extras"]["targetNames"] == ["fold", "still"] and mesh["weights"] == [0, 0]
    (primitive,) = mesh["primitives"]
    got = {name: read(tree, blob, i) for name, i in primitive["attributes"].items()}
    np.testing.assert_array_equal(got["POSITION"], sheet.astype(np.float32))
    np.testing.assert_array_equal(got["NORMAL"], np.tile([0.0, 0.0, 1.0], (len(sheet), 1)))
    np.testing.assert_array_equal(got["COLOR_0"], colours)
    np.testing.assert_array_equal(read(tree, blob, primitive["indices"]).reshape(-1, 3), triangles)
    moved, still = ({n: read(tree, blob, i) for n, i in t.items()} for t in primitive["targets"])
    np.testing.assert_allclose(moved["POSITION"], up, atol=0.5 / 32767)
    flank = sheet[:, 0] > 0.045  # a slope of 45 degrees beyond the fold
    turned = [-np.sqrt(0.5), 0.0, np.sqrt(0.5) - 1]
    np.testing.assert_allclose(moved["NORMAL"][flank], np.tile(turned, (flank.sum(), 1)), atol=0.01)
    assert not moved["NORMAL"][sheet[:, 0] < 0.035].any()
    assert not still["POSITION"].any() and not still["NORMAL"].any()


def test_what_moves_unseen_is_left_out_without_an_edge():
    """A movement that fades away is written fading away, and never more off than STILL."""
    sheet, triangles, _ = fold(60)
    move = np.zeros_like(sheet)
    move[:, 2] = 0.003 * sheet[:, 0]  # 0 to 1.8 mm
    tree, blob = parts(glb(sheet, triangles, None, {"slope": move}))
    written = read(tree, blob, tree["meshes"][0]["primitives"][0]["targets"][0]["POSITION"])[:, 2]
    assert np.abs(written - move[:, 2]).max() < STILL + 1 / 32767
    assert not written[move[:, 2] < STILL].any()
    np.testing.assert_allclose(written[move[:, 2] > 2 * STILL], move[move[:, 2] > 2 * STILL, 2],
                               atol=0.5 / 32767)  # fmt: skip
    across = written.reshape(60, 60)[:, 0]
    assert np.diff(across).max() < 4 * 0.003 * 0.01  # steeper there, but no step


@pytest.mark.parametrize(("n", "kind"), [(255, 5123), (257, 5125)])
def test_large_meshes_are_numbered_with_larger_integers(n, kind):
    sheet, triangles, up = fold(n)
    tree, blob = parts(glb(sheet, triangles, None, {"fold": up}))
    primitive = tree["meshes"][0]["primitives"][0]
    assert tree["accessors"][primitive["indices"]]["componentType"] == kind
    np.testing.assert_array_equal(read(tree, blob, primitive["indices"]).reshape(-1, 3), triangles)
    np.testing.assert_allclose(
        read(tree, blob, primitive["targets"][0]["POSITION"])[-1], up[-1], atol=0.5 / 32767
    )


def two_materials(sheet, triangles):
    """A sheet of red and, beyond its middle, blue; its texture is cut along the middle line."""
    beyond = (sheet[triangles].mean(axis=1)[:, 0] > 0.04).astype(int)
    n = len(sheet)
    line = np.flatnonzero(np.isclose(sheet[:, 0], 0.04))
    other = np.arange(n)
    other[line] = n + np.arange(len(line))
    corners = np.where(beyond[:, None], other[triangles], triangles)
    places = np.append(np.arange(n), line)
    uv = sheet[places, :2] * 10
    uv[n:, 0] += 0.05
    finishes = (Finish("red", (1.0, 0.0, 0.0, 1.0), 0.25), Finish("none", (0, 0, 0, 1.0), 1.0),
                Finish("blue", (0.0, 0.0, 0.5, 1.0), 0.75))  # fmt: skip
    return Surface(corners, places, uv, 2 * beyond, finishes)


def test_materials_are_primitives_with_vertices_of_their_own():
    sheet, triangles, up = fold()
    surface = two_materials(sheet, triangles)
    shades = np.tile([0.5, 0.0, 0.25, 1.0], (len(sheet), 1))
    tree, blob = parts(glb(sheet, triangles, shades, {"fold": up}, surface=surface))
    assert [m["name"] for m in tree["materials"]] == ["red", "blue"]
    assert [m["pbrMetallicRoughness"] for m in tree["materials"]] == [
        {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": rough}
        for colour, rough in (([1.0, 0.0, 0.0, 1.0], 0.25), ([0.0, 0.0, 0.5, 1.0], 0.75))
    ]
    count = 0
    for number, primitive in enumerate(tree["meshes"][0]["primitives"]):
        assert primitive["material"] == number
        got = {name: read(tree, blob, i) for name, i in primitive["attributes"].items()}
        assert {len(values) for values in got.values()} == {45}  # the middle line in both
        own = triangles[surface.finish == 2 * number]
        index = read(tree, blob, primitive["indices"]).astype(int).reshape(-1, 3)
        np.testing.assert_array_equal(got["POSITION"][index], sheet.astype(np.float32)[own])
        mine = surface.uv[surface.corners[surface.finish == 2 * number]]
        np.testing.assert_allclose(got["TEXCOORD_0"][index] * (1, -1) + (0, 1), mine, atol=1e-5)
        assert got["COLOR_0"][0].tolist() == pytest.approx(
            ([0.5, 0, 1, 1], [1, 0, 0.5, 1])[number], abs=0.003
        )
        (target,) = primitive["targets"]
        moved = read(tree, blob, target["POSITION"])
        np.testing.assert_allclose(moved[index], up[own], atol=0.5 / 32767)
        count += len(index)
    assert count == len(triangles)


def test_an_untouched_part_shares_its_one_target_of_nothing():
    sheet, triangles, up = fold()
    tree, blob = parts(glb(sheet, triangles, None, {"a": up, "b": up, "c": 0 * up},
                           surface=two_materials(sheet, triangles)))  # fmt: skip
    red = tree["meshes"][0]["primitives"][0]["targets"]
    assert len({t["POSITION"] for t in red}) == 1
    assert not read(tree, blob, red[0]["POSITION"]).any()
    assert len(red) == 3


def hanging(sheet):
    """Two bones in a pose; the sheet follows the second one more and more."""
    turn = rotation((0.3, 0.2, 0.1))
    share = sheet[:, 0] / sheet[:, 0].max()
    weights = np.stack([1 - share, share, 0 * share], axis=1).astype(np.float32)
    return Skeleton(
        ("root", "arm", "hand"), (-1, 0, 1), np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0.1, 0.0]]),
        np.array([np.eye(3), turn, turn @ rotation((0.5, 0, 0))]), weights,
    )  # fmt: skip


def test_bones_stand_where_they_were_written_and_leave_the_mesh_alone():
    """Nodes times inverse bind matrices is nothing at all, until somebody turns a bone."""
    sheet, triangles, up = fold()
    bones = hanging(sheet)
    tree, blob = parts(glb(sheet, triangles, None, {"fold": up}, "sheet", skeleton=bones))
    (skin,) = tree["skins"]
    assert tree["nodes"][0] == {"name": "sheet", "mesh": 0, "skin": 0}
    assert tree["scenes"][0]["nodes"] == [0, skin["skeleton"]]
    nodes = [tree["nodes"][k] for k in skin["joints"]]
    assert [node["name"] for node in nodes] == list(bones.bones)
    assert [node.get("children") for node in nodes] == [[2], [3], None]
    back = read(tree, blob, skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    world = np.eye(4)
    for k, node in enumerate(nodes):
        x, y, z, w = node["rotation"]
        assert np.hypot(np.hypot(x, y), np.hypot(z, w)) == pytest.approx(1, abs=1e-6)
        local = trimesh.transformations.quaternion_matrix([w, x, y, z])
        local[:3, 3] = node["translation"]
        world = world @ local
        np.testing.assert_allclose(world[:3, 3], bones.places[k], atol=1e-5)
        np.testing.assert_allclose(world[:3, :3], bones.turns[k], atol=1e-6)
        np.testing.assert_allclose(world @ back[k], np.eye(4), atol=1e-5)
    attributes = tree["meshes"][0]["primitives"][0]["attributes"]
    joints, weights = (read(tree, blob, attributes[f"{n}_0"]) for n in ("JOINTS", "WEIGHTS"))
    joints = joints.astype(int)
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    assert not joints[weights == 0].any()  # as validators ask
    given = np.zeros_like(bones.weights)
    np.add.at(given, (np.arange(len(sheet))[:, None], joints), weights)
    np.testing.assert_allclose(given, bones.weights, atol=1 / 255)


def test_other_readers_take_it(tmp_path):
    sheet, triangles, up = fold()
    path = tmp_path / "sheet.glb"
    path.write_bytes(glb(sheet, triangles, None, {"fold": up}, skeleton=hanging(sheet)))
    mesh = trimesh.load(path, force="mesh", process=False)
    np.testing.assert_array_equal(mesh.vertices, sheet.astype(np.float32))
    np.testing.assert_array_equal(mesh.faces, triangles)
    np.testing.assert_allclose(
        mesh.vertex_normals[:, 2] / np.linalg.norm(mesh.vertex_normals, axis=1), 1
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"vertices": np.zeros((4, 2))}, "vertices must have the shape"),
        ({"triangles": np.zeros((4, 4), int)}, "triangles must have the shape"),
        ({"colours": np.zeros((2, 4), np.uint8)}, "colours must have the shape"),
        ({"targets": {"smile": np.zeros((2, 3))}}, "target smile must have the shape"),
    ],
)
def test_arrays_of_other_shapes_are_refused(change, says):
    sheet, triangles, _ = fold(3)
    with pytest.raises(ValueError, match=says):
        glb(**{"vertices": sheet, "triangles": triangles, **change})
