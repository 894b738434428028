"""The strands of a face's hair as Blender's hair curves, for whoever grooms on.

They are an object of its own that hangs on the face, as Blender's own do: the face is its surface,
on whose texture their roots have their places, so that Blender's brushes and hair nodes work, and
the node "Deform Curves on Surface" takes them along with whatever moves the skin.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import to_blender
from facs_rig.blender.hair_follows import CURVES_MARK, curves_of, write_points, write_rest
from facs_rig.blender.materials import SKIN_MAP
from facs_rig.common.errors import InputError
from facs_rig.hair.strands import Strands

SINCE = (4, 2)  # Blender's version from which on curves can be made
GROUP = "Follow the Face"  # name of its modifier, and of the nodes in it
ROOT_PLACES = "surface_uv_coordinate"  # Blender's name for where roots lie on the surface
SHADE = "shade"  # attribute of each strand: what the colour is multiplied by
STRAND_SHADER, STRAND_OUTPUT = "Strands", "Strands in Cycles"  # labels of nodes
ROUGH = 0.35  # of the strands in Cycles, along them
LOOSE = 0.35  # how much lighter or darker than the hair a strand may be


def has_curves() -> bool:
    """Whether this Blender can make hair curves."""
    return bpy.app.version >= SINCE


def check_curves() -> None:
    """InputError, one sentence, in a Blender that is too old for hair curves."""
    if not has_curves():
        raise InputError(
            f"hair curves need Blender {'.'.join(map(str, SINCE))} or newer; choose Locks or "
            "Surface"
        )


def wear_curves(
    face: bpy.types.Object,
    strands: Strands,
    material: bpy.types.Material | None,
    identity,
    homes: list[bpy.types.Collection],
) -> bpy.types.Object:
    """Hang strands on a face, in the place of those that it has; return their object.

    strands : on the face's basis      homes : collections where a new object is linked
    """
    name, thing = f"{face.name} Hair Curves", curves_of(face)
    data = _curves(name, strands, identity)
    if thing is None:
        thing = bpy.data.objects.new(name, data)
        thing[CURVES_MARK] = 1
        thing.parent = face
        for home in homes:
            home.objects.link(thing)
    else:
        old, thing.data = thing.data, data
        if not old.users:
            data.name, old.name = old.name, data.name
            bpy.data.hair_curves.remove(old)
    if material is not None:
        shade_strands(material)
        data.materials.append(material)
    data.surface, data.surface_uv_map = face, SKIN_MAP
    face.add_rest_position_attribute = True
    if not any(m.type == "NODES" and m.node_group for m in thing.modifiers):
        thing.modifiers.new(GROUP, "NODES").node_group = _follow_nodes()
    return thing


def remove_curves(face: bpy.types.Object) -> None:
    """Take the strands of a face away; no error without any."""
    thing = curves_of(face)
    if thing is None:
        return
    data = thing.data
    groups = {m.node_group for m in thing.modifiers if m.type == "NODES" and m.node_group}
    bpy.data.objects.remove(thing)
    if not data.users:
        bpy.data.hair_curves.remove(data)
    for group in groups:
        if not group.users and group.name.startswith(GROUP):
            bpy.data.node_groups.remove(group)
    if not any(curves.surface == face for curves in bpy.data.hair_curves):
        face.add_rest_position_attribute = False


def _curves(name: str, strands: Strands, identity) -> bpy.types.Curves:
    count, each = strands.points.shape[:2]
    data = bpy.data.hair_curves.new(name)
    if not count:  # which Blender's functions do not stand
        return data
    try:
        data.add_curves([each] * count)
        points = strands.points.reshape(-1, 3)
        write_points(data, to_blender(points))
        _attribute(data, "radius", "FLOAT", "POINT", "value", strands.radius)
        _attribute(data, ROOT_PLACES, "FLOAT2", "CURVE", "vector", strands.uv)
        _attribute(data, SHADE, "FLOAT", "CURVE", "value", 1 + LOOSE * strands.tone)
        write_rest(data, points, identity)
    except BaseException:
        bpy.data.hair_curves.remove(data)
        raise
    return data


def _attribute(
    data: bpy.types.Curves, name: str, kind: str, domain: str, field: str, values: NDArray
) -> None:
    layer = data.attributes.get(name) or data.attributes.new(name, kind, domain)
    if len(layer.data):
        layer.data.foreach_set(field, np.ascontiguousarray(values, np.float32).reshape(-1))


def _follow_nodes() -> bpy.types.NodeTree:
    """Nodes that take curves along with the surface that they are attached to; shared by all."""
    for group in bpy.data.node_groups:
        if group.bl_idname == "GeometryNodeTree" and group.name == GROUP and not group.library:
            return group
    group = bpy.data.node_groups.new(GROUP, "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    if hasattr(group, "is_modifier"):
        group.is_modifier = True
    into, out = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    deform = group.nodes.new("GeometryNodeDeformCurvesOnSurface")
    for node, x in ((into, -200), (deform, 0), (out, 200)):
        node.location = (x, 0)
    group.links.new(into.outputs[0], deform.inputs[0])
    group.links.new(deform.outputs[0], out.inputs[0])
    return group


def shade_strands(material: bpy.types.Material) -> None:
    """Let a material of hair shine as strands do where Cycles sees strands.

    Its colour stays the one swatch: everything else, other renderers and files, has what it had.
    """
    tree = material.node_tree
    if tree is None or any(node.label == STRAND_OUTPUT for node in tree.nodes):
        return
    plain = next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if plain is None or not plain.inputs["Base Color"].is_linked:
        return
    colour = plain.inputs["Base Color"].links[0].from_socket
    hair = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    hair.label, hair.parametrization = STRAND_SHADER, "COLOR"
    hair.inputs["Roughness"].default_value = ROUGH
    info, mix = tree.nodes.new("ShaderNodeHairInfo"), tree.nodes.new("ShaderNodeMixShader")
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    out.label, out.target = STRAND_OUTPUT, "CYCLES"
    for node, place in ((hair, (0, -500)), (info, (0, -200)), (mix, (250, -300)),
                        (out, (450, -300))):  # fmt: skip
        node.location = place
    tree.links.new(colour, hair.inputs["Color"])
    tree.links.new(info.outputs["Is Strand"], mix.inputs[0])
    tree.links.new(plain.outputs[0], mix.inputs[1])
    tree.links.new(hair.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], out.inputs["Surface"])
