"""The vertices of a written file in the order in which the face has them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from facs_rig import load_rig


def points_of(path: Path) -> np.ndarray:
    """(n, 3) vertices of the face in an .obj, .ply or .glb, without the hair beside it.

    Readers cut the surface of an .obj apart where its texture has a seam, so that its lines are
    read here; a .glb is cut by its materials, too, which is undone if it holds a face of the rig.
    """
    if path.suffix == ".obj":
        lines = (line.split() for line in _bald(path).splitlines())
        return np.array([words[1:4] for words in lines if words[:1] == ["v"]], dtype=float)
    points = np.asarray(face_of(path).vertices)
    order = glb_order()
    if path.suffix != ".glb" or len(points) != len(order):
        return points
    return in_rig_order(points)


def face_of(path: Path):
    """The face in an .obj, .ply or .glb as trimesh reads it, without the hair beside it."""
    import trimesh

    if path.suffix == ".obj":
        return trimesh.load(io.StringIO(_bald(path)), "obj", force="mesh", process=False)
    scene = trimesh.load(path, process=False, force="scene", maintain_order=True)
    if "hair" in scene.geometry:
        scene.delete_geometry("hair")
    return scene.to_mesh()


def _bald(path: Path) -> str:
    """An .obj up to where its hair begins."""
    return path.read_text(encoding="utf-8").partition("\no hair\n")[0]


def glb_order() -> np.ndarray:
    """The rig's vertex at each vertex of a .glb, part by part."""
    rig = load_rig()
    owner = rig.vertex_part[rig.texture.vertices]
    used = np.unique(rig.texture.corners)
    parts = [used[owner[used] == k] for k in range(len(rig.part_names))]
    return rig.texture.vertices[np.concatenate(parts)]


def in_rig_order(values: np.ndarray) -> np.ndarray:
    """(n, ...) values of a .glb's vertices, those at seams once; AssertionError if they differ."""
    order = glb_order()
    out = np.zeros((load_rig().n_vertices, *values.shape[1:]), values.dtype)
    out[order] = values
    np.testing.assert_array_equal(out[order], values)
    return out
