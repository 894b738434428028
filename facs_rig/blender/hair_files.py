"""Hair on its way to files: as Blender shows it, and as an object that Blender's exporters take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import from_blender, metre, to_blender
from facs_rig.blender.arrays import corners_of, make_mesh, read_map, write_map
from facs_rig.blender.hair import MAP, SHADE, colour_of, hair_material
from facs_rig.blender.hair_follows import hair_of
from facs_rig.hair.mesh import NAME, ROUGHNESS
from facs_rig.shape import Worn


def shown_hair(face: bpy.types.Object) -> tuple[Worn, ...]:
    """The hair of a face in the world, metres and core axes, with all that the artist did to it.

    Nothing where there is none, where it alone is hidden, and where no vertex is left of it.
    """
    hair = hair_of(face)
    if hair is None or (face.visible_get() and not hair.visible_get()):
        return ()
    return worn_object(hair, NAME)


def worn_object(hair: bpy.types.Object, name: str) -> tuple[Worn, ...]:
    """What a face wears, as it is evaluated; nothing where no vertex is left of it."""
    hair.update_from_editmode()
    if hair.mode == "OBJECT" and hair.visible_get():
        bpy.context.view_layer.update()
        final = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return _worn(final, hair, name)
    with _staged(hair) as (twin, layer):
        return _worn(twin.evaluated_get(layer.depsgraph), hair, name)


def hair_object(worn: Worn, name: str) -> bpy.types.Object:
    """A mesh object of what a face wears, in Blender's axes, linked nowhere, with a material."""
    triangle = worn.quads[:, 2] == worn.quads[:, 3]
    sizes = np.where(triangle, 3, 4)
    corners = worn.quads[np.arange(4) < sizes[:, None]].astype(np.int32)
    starts = (np.cumsum(sizes) - sizes).astype(np.int32)
    mesh = make_mesh(name, to_blender(worn.points), corners, starts)
    mesh.update(calc_edges=True)
    mesh.uv_layers.new(name=MAP)
    write_map(mesh.uv_layers[MAP], np.asarray(worn.uv, np.float32)[corners])
    mesh.materials.append(hair_material(worn.colour))
    return bpy.data.objects.new(name, mesh)


@contextmanager
def _staged(hair: bpy.types.Object) -> Iterator[tuple[bpy.types.Object, bpy.types.ViewLayer]]:
    """A copy of the hair in a scene of its own, which nobody sees, while it lasts: Blender shows
    but a cage of what is edited, and nothing of what is hidden."""
    scene = bpy.data.scenes.new("Sketch to Face")
    twin = hair.copy()
    twin.data = hair.data.copy()
    mesh = twin.data
    try:
        scene.collection.objects.link(twin)
        twin.hide_viewport = False
        scene.view_layers[0].update()  # makes its dependency graph
        yield twin, scene.view_layers[0]
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.objects.remove(twin)
        bpy.data.meshes.remove(mesh)


def _worn(final: bpy.types.Object, hair: bpy.types.Object, name: str) -> tuple[Worn, ...]:
    """final : the hair, evaluated"""
    mesh = final.data
    n = len(mesh.vertices)
    if not n or not len(mesh.polygons):
        return ()
    points = np.empty((n, 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", points.reshape(-1))
    world = np.array(final.matrix_world)
    points = (points @ world[:3, :3].T + world[:3, 3]) / metre(bpy.context.scene)
    uv = np.zeros((n, 2), dtype=np.float32)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    corners = corners_of(mesh)
    if layer is not None:
        uv[corners] = read_map(layer, len(corners))
    colour = colour_of(hair)
    if colour is None:
        material = next((slot.material for slot in hair.material_slots if slot.material), None)
        colour = (0.1, 0.1, 0.1) if material is None else tuple(material.diffuse_color[:3])
    return (
        Worn(name, from_blender(points), _quads(mesh, corners), uv, _shade(mesh), colour,
             ROUGHNESS),
    )  # fmt: skip


def _quads(mesh: bpy.types.Mesh, corners: NDArray[np.int32]) -> NDArray[np.int32]:
    """(q, 4) the polygons as `Worn` has them; larger ones are cut into triangles."""
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    four = np.diff(np.append(starts, len(corners))) == 4
    quads = corners[starts[four, None] + np.arange(4)]
    if four.all():
        return quads
    mesh.calc_loop_triangles()
    triangles = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles.reshape(-1))
    polygon = np.empty(len(triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("polygon_index", polygon)
    return np.concatenate([quads, triangles[~four[polygon]][:, [0, 1, 2, 2]]])


def _shade(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    out = np.ones(len(mesh.vertices), dtype=np.float32)
    layer = mesh.attributes.get(SHADE)
    if layer is not None and (layer.domain, layer.data_type) == ("POINT", "FLOAT"):
        layer.data.foreach_get("value", out)
    return out
