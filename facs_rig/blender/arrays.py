"""Arrays to and from Blender's meshes and shape keys, by the quickest way that a version has.

From 4.1 on a mesh keeps its numbers as attributes, which are read and written whole; the older
properties, which went value by value, are ten to a hundred times slower there. Points are (n, 3)
metres in Blender's axes.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

BULK = bpy.app.version >= (4, 1, 0)  # arrays are read and written whole


def make_mesh(
    name: str, points: NDArray[np.float32], corners: NDArray[np.int32], starts: NDArray[np.int32]
) -> bpy.types.Mesh:
    """A smooth mesh without edges, which `mesh.update(calc_edges=True)` makes.

    corners : (c,) vertex of each corner      starts : (p,) first corner of each polygon
    """
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.loops.add(len(corners))
    mesh.polygons.add(len(starts))
    write_places(mesh, points)
    mesh.polygons.foreach_set("loop_start", starts)
    if BULK:
        mesh.attributes[".corner_vert"].data.foreach_set("value", corners)
        mesh.shade_smooth()
        return mesh
    mesh.loops.foreach_set("vertex_index", corners)
    if bpy.app.version < (4, 0, 0):  # later versions work it out from the starts
        totals = np.diff(np.append(starts, len(corners))).astype(np.int32)
        mesh.polygons.foreach_set("loop_total", totals)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(starts), dtype=bool))
    return mesh


def write_places(mesh: bpy.types.Mesh, points: NDArray[np.float32]) -> None:
    """Move the vertices of the mesh itself (its shape keys stay where they are)."""
    if BULK:
        mesh.attributes["position"].data.foreach_set("vector", _flat(points))
    else:
        mesh.vertices.foreach_set("co", _flat(points))


def corners_of(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    """(c,) vertex of each corner of the polygons."""
    out = np.empty(len(mesh.loops), dtype=np.int32)
    if BULK:
        mesh.attributes[".corner_vert"].data.foreach_get("value", out)
    else:
        mesh.loops.foreach_get("vertex_index", out)
    return out


def write_materials(mesh: bpy.types.Mesh, index: NDArray[np.int32]) -> None:
    """Give each polygon of a new mesh its material's index (p,)."""
    if BULK:
        layer = mesh.attributes.new("material_index", "INT", "FACE")
        layer.data.foreach_set("value", index)
    else:
        mesh.polygons.foreach_set("material_index", index)


def write_map(layer: bpy.types.MeshUVLoopLayer, places: NDArray[np.float32]) -> None:
    """Fill a UV map with the places (c, 2) of the corners."""
    if BULK:
        layer.uv.foreach_set("vector", _flat(places))
    else:
        layer.data.foreach_set("uv", _flat(places))


def read_map(layer: bpy.types.MeshUVLoopLayer, count: int) -> NDArray[np.float32]:
    """(count, 2) places of all corners in a UV map."""
    out = np.empty((count, 2), dtype=np.float32)
    if BULK:
        layer.uv.foreach_get("vector", out.reshape(-1))
    else:
        layer.data.foreach_get("uv", out.reshape(-1))
    return out


def write_key(block: bpy.types.ShapeKey, points: NDArray[np.float32]) -> None:
    """Set the points of a shape key."""
    _points(block).foreach_set("co", _flat(points))


def read_key(block: bpy.types.ShapeKey) -> NDArray[np.float32]:
    """(n, 3) points of a shape key."""
    out = np.empty((len(block.data), 3), dtype=np.float32)
    _points(block).foreach_get("co", out.reshape(-1))
    return out


def _points(block: bpy.types.ShapeKey):
    return block.points if BULK else block.data


def _flat(values: NDArray) -> NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32).reshape(-1)
