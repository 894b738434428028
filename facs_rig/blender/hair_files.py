"""Hair on its way to files: as Blender shows it, and as an object that Blender's exporters take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import armature_of, from_blender, metre, to_blender
from facs_rig.blender.arrays import corners_of, make_mesh, read_map, write_map
from facs_rig.blender.hair import MAP, SHADE, colour_of, hair_material, hang, locks_of
from facs_rig.blender.hair_follows import curves_of, hair_of, hat_of, is_hat, parts_of
from facs_rig.hair import hat as hats
from facs_rig.hair.mesh import NAME, ROUGHNESS
from facs_rig.rig import FaceRig, load_rig
from facs_rig.shape import Worn


def shown_worn(face: bpy.types.Object, rig: FaceRig) -> tuple[Worn, ...]:
    """Hair and hat of a face, see `shown_hair`."""
    hat = hat_of(face)
    seen = hat is not None and (hat.visible_get() or not face.visible_get())
    return shown_hair(face, rig) + (worn_object(hat, hats.NAME) if seen else ())


def shown_hair(face: bpy.types.Object, rig: FaceRig) -> tuple[Worn, ...]:
    """The hair of a face in the world, metres and core axes, with all that the artist did to it.

    Nothing where there is none, where it alone is hidden, and where no vertex is left of it. Files
    cannot hold strands: in their place are locks of the same cut.
    rig : the full one
    """
    hair = hair_of(face)
    seen = any(part.visible_get() for part in parts_of(face))
    if hair is None or (face.visible_get() and not seen):
        return ()
    if curves_of(face) is not None:
        locks = locks_of(face, rig)
        with _staged(hair, locks) as (twin, layer):
            return _worn(twin.evaluated_get(layer.depsgraph), hair, NAME)
    return worn_object(hair, NAME)


def worn_object(hair: bpy.types.Object, name: str) -> tuple[Worn, ...]:
    """What a face wears, as it is evaluated, whether it is shown, hidden or edited; nothing where
    no vertex is left of it."""
    hair.update_from_editmode()
    if hair.mode == "OBJECT" and hair.visible_get():
        bpy.context.view_layer.update()
        final = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return _worn(final, hair, name)
    with _staged(hair, hair.data.copy()) as (twin, layer):
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
    kind = (worn.colour, "Hat", worn.roughness) if worn.name == hats.NAME else (worn.colour,)
    mesh.materials.append(hair_material(*kind))
    return bpy.data.objects.new(name, mesh)


@contextmanager
def held_by_files(face: bpy.types.Object) -> Iterator[bpy.types.Object | None]:
    """The hair of a face as Blender's exporters take it, if it is shown: while it lasts locks are
    in the place of strands."""
    hair = hair_of(face)
    if hair is None or not any(part.visible_get() for part in parts_of(face)):
        yield None
        return
    if curves_of(face) is None or hair.mode != "OBJECT":
        yield hair
        return
    mesh, hidden = hair.data, hair.hide_get()
    locks = hair.data = locks_of(face, load_rig())
    hang(hair, armature_of(face))
    hair.hide_set(False)
    try:
        yield hair
    finally:
        hair.data = mesh
        hair.hide_set(hidden)
        bpy.data.meshes.remove(locks)


@contextmanager
def _staged(
    hair: bpy.types.Object, mesh: bpy.types.Mesh
) -> Iterator[tuple[bpy.types.Object, bpy.types.ViewLayer]]:
    """A copy of the hair, with this mesh, in a scene of its own, which nobody sees, while it lasts:
    Blender shows but a cage of what is edited, and nothing of what is hidden."""
    scene = bpy.data.scenes.new("Sketch to Face")
    twin = hair.copy()
    twin.data = mesh
    hang(twin, armature_of(hair))
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
    rough = hats.ROUGHNESS if is_hat(hair) else ROUGHNESS
    places = from_blender(points)
    return (Worn(name, places, _quads(mesh, corners), uv, _shade(mesh), colour, rough),)


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
