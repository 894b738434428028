"""The surface of a face as Blender shows it, with all that the artist did to it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import from_blender, metre
from facs_rig.blender.arrays import corners_of, read_key, read_map, write_places
from facs_rig.blender.beard_files import shown_beard
from facs_rig.blender.hair_files import shown_worn
from facs_rig.blender.keys import add_key, moved
from facs_rig.blender.materials import EYE_MAP, GLOSS, SKIN_NODE, own_palette
from facs_rig.blender.pose import armature_of, refresh, rig_of
from facs_rig.blender.steps import Steps
from facs_rig.blender.twin import discard, twin_of
from facs_rig.bones import BONES, PARENTS, Skeleton, bone_weights
from facs_rig.common.errors import InputError
from facs_rig.controls import ARKIT_NAMES, CONTROL_NAMES, FULL_INTENSITY
from facs_rig.fitted_keys import FITTED, FITTED_REGIONS
from facs_rig.identity import IDENTITY_KEYS
from facs_rig.looks import PLAIN, Finish
from facs_rig.paint import MADE_OF, MATERIAL_NAMES, as_bytes, painted
from facs_rig.rig import FaceRig
from facs_rig.shape import Shape
from facs_rig.uv import TextureMap, texture_map

NEUTRAL = "neutral"
MOST = 200_000  # vertices: finer surfaces get no morph targets, each of which is as large
_FLUSHED = ("EDIT", "SCULPT", "SCULPT_CURVES")


def shown(face: bpy.types.Object, rig: FaceRig) -> Shape:
    """The evaluated mesh of a face and of what it wears in the world, metres, core axes, without
    moves.

    Keys, modifiers, bones, parents and place count as they are shown. In Edit and Sculpt Mode it
    is what leaving it would show.
    """
    whole, rig = rig, rig_of(face, rig)
    worn = (*shown_worn(face, whole), *shown_beard(face))
    if face.mode in _FLUSHED or not face.visible_get():
        face.update_from_editmode()
        with staged(face) as (twin, layer):
            return replace(_shape(twin, layer.depsgraph, rig), worn=worn)
    bpy.context.view_layer.update()
    return replace(_shape(face, bpy.context.evaluated_depsgraph_get(), rig), worn=worn)


def moves(
    face: bpy.types.Object, rig: FaceRig, shape: Shape, names: str = "ours"
) -> Steps[dict[str, NDArray[np.float32]]]:
    """What each control, or each of ARKit's keys, adds to the shape of a face at rest, alone and
    fully on, and `neutral`, which takes away what the face does; then the keys of the artist's.

    (n, 3) metres each, core axes, by evaluating a copy of the face. Pauses after each. Nothing
    for a surface that is too fine, or whose vertices come and go with the expression.
    """
    if len(shape.points) > MOST:
        return {}
    rig = rig_of(face, rig)
    with staged(face) as (twin, layer):
        keys = twin.data.shape_keys
        if keys is None:
            return {}
        twin.show_only_shape_key, keys.use_relative = False, True
        was = _points(twin, layer)
        for name in CONTROL_NAMES:
            twin[name] = 0.0
        if names == "arkit":
            _add_arkit(twin, rig)
            for name in ARKIT_NAMES:
                keys.key_blocks[name].value = 0.0
        rest = _points(twin, layer)
        found = {}
        for name in ARKIT_NAMES if names == "arkit" else CONTROL_NAMES:
            if names == "arkit":
                keys.key_blocks[name].value = 1.0
                found[name] = _points(twin, layer)
                keys.key_blocks[name].value = 0.0
            else:
                twin[name] = FULL_INTENSITY
                found[name] = _points(twin, layer)
                twin[name] = 0.0
            yield
        out = {name: points - rest for name, points in found.items() if len(points) == len(rest)}
        if len(was) == len(rest) == len(shape.points):
            out[NEUTRAL] = rest - was
        for block in own_keys(twin, rig):
            value, block.value = block.value, 0.0
            without = _points(twin, layer)
            block.value = min(1.0, block.slider_max)
            full = _points(twin, layer)
            block.value = value
            if len(without) == len(full) == len(shape.points):
                out[block.name] = full - without
            yield
    return {name: move for name, move in out.items() if len(move) == len(shape.points)}


def own_keys(face: bpy.types.Object, rig: FaceRig) -> list[bpy.types.ShapeKey]:
    """The keys that the artist added, those that are on."""
    keys = face.data.shape_keys
    if keys is None:
        return []
    fitted = (FITTED, *FITTED_REGIONS.values())
    ours = {*(key.name for key in rig.keys), *IDENTITY_KEYS, *ARKIT_NAMES, *fitted}
    return [block for block in keys.key_blocks[1:] if block.name not in ours and not block.mute]


@contextmanager
def staged(face: bpy.types.Object) -> Iterator[tuple[bpy.types.Object, bpy.types.ViewLayer]]:
    """A copy of the face in a scene of its own, which nobody sees, while it lasts."""
    scene = bpy.data.scenes.new("Sketch to Face")
    things: tuple[bpy.types.Object | None, ...] = ()
    try:
        things = twin_of(face)
        for thing in things:
            if thing is not None:
                scene.collection.objects.link(thing)
                thing.hide_viewport = False
        twin = things[0]
        assert twin is not None
        scene.view_layers[0].update()  # makes its dependency graph
        yield twin, scene.view_layers[0]
    finally:
        bpy.data.scenes.remove(scene)
        discard(*things)


def left_out(face: bpy.types.Object) -> list[str]:
    """What is shown of a face but not in a file of its surface, as Blender calls it."""
    mesh = face.data
    smooth = np.ones(len(mesh.polygons), dtype=bool)
    mesh.polygons.foreach_get("use_smooth", smooth)
    sharp = np.zeros(len(mesh.edges), dtype=bool)
    mesh.edges.foreach_get("use_edge_sharp", sharp)
    found = ["Shade Flat"] if sharp.any() or not smooth.all() else []
    if mesh.color_attributes:
        found.append("Color Attributes")
    textures = any(
        node.type == "TEX_IMAGE"
        for slot in face.material_slots
        if slot.material is not None and slot.material.node_tree is not None
        for node in slot.material.node_tree.nodes
    )
    return [*found, *(["Image Texture"] if textures else [])]


def _points(twin: bpy.types.Object, layer: bpy.types.ViewLayer) -> NDArray[np.float32]:
    """(n, 3) vertices of the copy as it is evaluated now, in the world, core axes."""
    refresh(twin)
    twin.data.shape_keys.update_tag()
    layer.update()
    final = twin.evaluated_get(layer.depsgraph)
    return _in_the_world(final)


def _in_the_world(final: bpy.types.Object) -> NDArray[np.float32]:
    mesh = final.data
    points = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.vertices.foreach_get("co", points.reshape(-1))
    world = np.array(final.matrix_world)
    # files are in metres, whatever the scene's units are
    return from_blender((points @ world[:3, :3].T + world[:3, 3]) / metre(bpy.context.scene))


def _add_arkit(twin: bpy.types.Object, rig: FaceRig) -> None:
    """ARKit's keys for a face that was made without them."""
    keys = twin.data.shape_keys
    missing = [name for name in ARKIT_NAMES if name not in keys.key_blocks]
    if not missing:
        return
    if len(twin.data.vertices) != rig.n_vertices:
        raise InputError(
            f"'{twin.name}' has other vertices than it was made with, so that nobody knows where "
            "ARKit's keys go: use the names of Sketch to Face"
        )
    basis = read_key(keys.reference_key)
    for name in missing:
        add_key(twin, name, moved(basis, rig.arkit_deltas[ARKIT_NAMES.index(name)]), 0.0, 1.0)
    write_places(twin.data, basis)


def _shape(face: bpy.types.Object, graph: bpy.types.Depsgraph, rig: FaceRig) -> Shape:
    final = face.evaluated_get(graph)
    mesh = final.data
    corners = corners_of(mesh)
    starts = np.empty(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    index = np.zeros(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("material_index", index)
    points = _in_the_world(final)
    same = len(points) == rig.n_vertices and np.array_equal(corners, rig.polygon_vertices)
    materials = [slot.material for slot in final.material_slots]
    colours = np.array([_colour(m) for m in materials] or [(0.8, 0.8, 0.8, 1.0)])
    if same and len(materials) == len(MATERIAL_NAMES):
        own = own_palette(face)
        palette = {
            name: Finish((*np.clip(colour[:3] * own.get(name, 1.0), 0, 1), colour[3]), 0.0)
            for name, colour in zip(MATERIAL_NAMES, colours, strict=True)
        }
        linear = painted(rig).colours(palette)
        made_of = [MATERIAL_NAMES.index(MADE_OF.get(name, name)) for name in rig.part_names]
        rough = [_roughness(materials[k], face) for k in made_of]
        part, part_names = rig.vertex_part[corners[starts]], tuple(rig.part_names)
        triangle_corners = rig.triangle_corners
    else:
        vertex = np.zeros(len(points), dtype=np.int32)
        lengths = np.diff(np.append(starts, len(corners)))
        vertex[corners] = np.repeat(np.minimum(index, len(colours) - 1), lengths)
        used, part = np.unique(index, return_inverse=True)
        names = [m.name if m is not None else "none" for m in materials] or ["none"]
        part_names = tuple(names[min(k, len(names) - 1)] for k in used)
        rough = [_roughness(materials[k] if k < len(materials) else None, face) for k in used]
        linear = colours[vertex]
        mesh.calc_loop_triangles()
        triangle_corners = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", triangle_corners.reshape(-1))
    return Shape(
        points=points,
        polygon_vertices=corners,
        polygon_starts=starts,
        triangle_corners=triangle_corners,
        colours=as_bytes(linear),
        part=part,
        part_names=part_names,
        roughness=tuple(rough),
        skeleton=_skeleton(face, rig) if same else None,
        texture=_texture(mesh, corners, len(points), rig.texture if same else None),
    )


def _skeleton(face: bpy.types.Object, rig: FaceRig) -> Skeleton | None:
    """The bones of the face as they stand in the world, without their scale."""
    armature = armature_of(face)
    if armature is None or not set(BONES) <= set(armature.pose.bones.keys()):
        return None
    world, size = np.array(armature.matrix_world), metre(bpy.context.scene)
    axes = from_blender(np.eye(3)).T  # of Blender, in the core's
    places, turns = [], []
    for name in BONES:
        bone = armature.pose.bones[name]
        now = world @ np.array(bone.matrix)
        turned = now[:3, :3] @ np.linalg.inv(np.array(bone.bone.matrix_local)[:3, :3])
        left, _, right = np.linalg.svd(axes @ turned @ axes.T)
        places.append(from_blender(now[:3, 3] / size))
        turns.append(left @ right)
    if min(np.linalg.det(turn) for turn in turns) < 0:  # mirrored: no bone is
        return None
    return Skeleton(BONES, PARENTS, np.array(places), np.array(turns), bone_weights(rig))


def _texture(
    mesh: bpy.types.Mesh, corners: NDArray, n: int, usual: TextureMap | None
) -> TextureMap | None:
    """The map that renders use; `usual`, where the artist left it as it was."""
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is None or layer.name == EYE_MAP:
        return None
    places = read_map(layer, len(corners))
    if usual is not None and np.array_equal(places, usual.uv):
        return usual
    return texture_map(places, corners, n)


def _colour(material: bpy.types.Material | None) -> tuple[float, ...]:
    """The one colour of a material, linear RGBA: what its shader has, or the viewport shows."""
    if material is None:
        return (0.8, 0.8, 0.8, 1.0)
    nodes = material.node_tree.nodes if material.node_tree is not None else ()
    shader = next((n for n in nodes if n.type == "BSDF_PRINCIPLED"), None)
    if shader is not None and not shader.inputs["Base Color"].is_linked:
        return tuple(shader.inputs["Base Color"].default_value)
    skin = next((n for n in nodes if n.type == "RGB" and n.label == SKIN_NODE), None)
    if skin is None:
        return tuple(material.diffuse_color)
    change = np.array(skin.outputs[0].default_value[:3]) / PLAIN["skin"].colour[:3]
    return (*(change * material.diffuse_color[:3]).tolist(), material.diffuse_color[3])


def _roughness(material: bpy.types.Material | None, face: bpy.types.Object) -> float:
    """How rough a material is on this face."""
    if material is None or material.node_tree is None:
        return 0.5
    shader = next((n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if shader is None:
        return float(material.roughness)
    socket = shader.inputs["Roughness"]
    own = float(face.get(GLOSS) or 0.0) if socket.is_linked else 0.0
    return min(max(float(socket.default_value) + own, 0.0), 1.0)
