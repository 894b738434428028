"""The bytes of a .glb, of small meshes that can be followed by hand."""

import json
import struct

import numpy as np
import pytest
import trimesh

from addon.gltf import STILL, glb


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
    kind, most = {5120: ("i1", 127), 5121: ("u1", 255), 5122: ("<i2", 32767), 5123: ("<u2", 1),
                  5125: ("<u4", 1), 5126: ("<f4", 1)}[a["componentType"]]  # fmt: skip
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[a["type"]]
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
    colours = np.tile(np.array([10, 20, 30, 255], np.uint8), (len(sheet), 1))
    tree, blob = parts(glb(sheet, triangles, colours, {"fold": up, "still": 0 * up}, "sheet"))
    (mesh,) = tree["meshes"]
    assert mesh["name"] == tree["nodes"][0]["name"] == "sheet"
    assert mesh["extras"]["targetNames"] == ["fold", "still"] and mesh["weights"] == [0, 0]
    (primitive,) = mesh["primitives"]
    got = {name: read(tree, blob, i) for name, i in primitive["attributes"].items()}
    np.testing.assert_array_equal(got["POSITION"], sheet.astype(np.float32))
    np.testing.assert_array_equal(got["NORMAL"], np.tile([0.0, 0.0, 1.0], (len(sheet), 1)))
    np.testing.assert_array_equal(got["COLOR_0"], colours / 255)
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


def test_other_readers_take_it(tmp_path):
    sheet, triangles, up = fold()
    path = tmp_path / "sheet.glb"
    path.write_bytes(glb(sheet, triangles, None, {"fold": up}))
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
