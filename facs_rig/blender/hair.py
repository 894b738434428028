"""The hair of Blender's face: a mesh of its own beside it, which the bone of the head carries.

It hangs on the face's armature and bears a mark, by which it is found whatever it is called. What
it was made of, a `Cut`, and how that is combed are remembered on it and on the face, so that it can
be made anew. Hair of the kind `curves` has strands over the mesh (facs_rig.blender.hair_curves).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import bpy
import numpy as np

from facs_rig.blender.armature import HEAD, armature_of, to_blender
from facs_rig.blender.arrays import make_mesh, write_map
from facs_rig.blender.hair_curves import check_curves, remove_curves, wear_curves
from facs_rig.blender.hair_follows import (
    MARK,
    VERSION,
    check_hair,
    curves_of,
    hair_of,
    is_curves,
    is_hair,
    parts_of,
    write_rest,
)
from facs_rig.blender.pose import has_identity_keys, identity_of
from facs_rig.blender.reshape import fitted_offsets
from facs_rig.common.errors import InputError
from facs_rig.hair.cut import Cut, from_json, to_json
from facs_rig.hair.hat import HatMesh
from facs_rig.hair.mesh import KINDS, ROUGHNESS, HairMesh, hair_mesh
from facs_rig.hair.style import AS_DRAWN, LEAST, MOST, Style
from facs_rig.rig import FaceRig

__all__ = [
    "add_hair", "colour_of", "comb", "curves_of", "cut_of", "fitting", "hair_material", "hair_of",
    "hang", "has_cut", "is_curves", "is_hair", "kind_of", "locks_of", "parts_of", "remove_hair",
    "set_colour", "style_of", "wear",
]  # fmt: skip

CUT, KIND = "facs_hair_cut", "facs_hair_kind"  # properties of the hair object and of its face
LENGTH, VOLUME = "facs_hair_length", "facs_hair_volume"  # of the face: how the cut is combed
DRAWN = "facs_hair_drawn"  # of the face: the cut that was drawn, while it wears another
MADE_IN = "facs_hair_colour"  # property of what is worn: its colour as it was made
SHADE = "shade"  # attribute of the vertices: what the colour is multiplied by
COLOUR_NODE = "Hair"  # label of the node with the colour
COLOUR_NODES = (COLOUR_NODE, "Hat")
MAP = "UVMap"  # v runs along the strands


def cut_of(face: bpy.types.Object) -> Cut | None:
    """What the hair of a face is made of, or was before it was taken away; None if it never had
    any. InputError for what is not as we wrote it."""
    hair = hair_of(face)
    text = face.get(CUT) if hair is None else hair.get(CUT, face.get(CUT))
    if text is None:
        return None
    if not isinstance(text, str):
        raise InputError(f"what is kept of the hair of '{face.name}' is no text")
    return from_json(text)


def has_cut(face: bpy.types.Object) -> bool:
    """Whether `cut_of` knows any, without reading it."""
    hair = hair_of(face)
    return CUT in face or (hair is not None and CUT in hair)


def kind_of(face: bpy.types.Object) -> str:
    """As which of KINDS the hair of a face was made; empty if there is none."""
    hair = hair_of(face)
    kind = hair.get(KIND) if hair is not None else None
    return kind if kind in KINDS else ""


def style_of(face: bpy.types.Object) -> Style:
    """How the hair of a face is combed; as drawn where nobody has said anything that can be."""
    said = (face.get(name, 1.0) for name in (LENGTH, VOLUME))
    try:
        length, volume = (min(max(float(value), LEAST), MOST) for value in said)
        return Style(length, volume)
    except (TypeError, ValueError, InputError):
        return AS_DRAWN


def add_hair(
    face: bpy.types.Object,
    rig: FaceRig,
    cut: Cut,
    kind: str = "locks",
    collection: bpy.types.Collection | None = None,
    style: Style | None = None,
) -> bpy.types.Object:
    """Make the hair of a face, or make what it has anew; return the hair object.

    rig : the full one, whatever the face's level of detail
    kind : of facs_rig.hair.mesh.KINDS
    collection : where a new object is linked; those of the face if None
    style : how it is combed; as it was if None
    Raises InputError, with nothing changed: as `wear`, and for another kind.
    """
    check_hair(face)
    who = identity_of(face)
    style = style_of(face) if style is None else style
    made = hair_mesh(rig, who, cut, kind, style=style)
    return wear(face, fitting(face, rig, made), who, collection)


def comb(face: bpy.types.Object, rig: FaceRig, style: Style) -> None:
    """Comb the hair of a face: make it anew so, if it has any, and remember it for what it gets.

    Raises InputError, with nothing changed, as `add_hair` and `cut_of`.
    """
    kind, cut = kind_of(face), cut_of(face)
    if kind and cut is not None:
        add_hair(face, rig, cut, kind, style=style)
    face[LENGTH], face[VOLUME] = style.length, style.volume


def fitting(face: bpy.types.Object, rig: FaceRig, made: HairMesh) -> HairMesh:
    """Hair that was made for the person of a face, as this face can wear it: on the skin that was
    fitted, its strands on the basis of the face's keys.

    rig : the full one
    """
    who, offsets = identity_of(face), fitted_offsets(face)
    if offsets is not None and len(offsets) == rig.n_vertices:
        made = made.lying_on(rig.neutral(who) + offsets)
    if made.strands is not None and has_identity_keys(face):
        made = replace(
            made, strands=hair_mesh(rig, {}, made.cut, made.kind, style=made.style).strands
        )
    return made


def wear(
    face: bpy.types.Object,
    made: HairMesh,
    identity: Mapping[str, float],
    collection: bpy.types.Collection | None = None,
) -> bpy.types.Object:
    """Put hair that was made for this person on a face; return the hair object.

    Hair that is there keeps its objects and material, and the colour that the artist gave it.
    Raises InputError, with nothing changed, for a face without its armature, for strands in a
    Blender that has none, and as `check_hair`.
    """
    check_hair(face)
    armature, hair = armature_of(face), hair_of(face)
    if armature is None:
        raise InputError(f"'{face.name}' has lost its bones, which carry the hair; add a new face")
    if made.strands is not None:
        check_curves()
    name, kept = f"{face.name} Hair", to_json(made.cut)
    mesh = worn_mesh(name, made, identity)
    if hair is None:
        hair = bpy.data.objects.new(name, mesh)
        mesh.materials.append(hair_material(made.colour))
        hair.parent = armature
    else:
        exchange_mesh(hair, mesh, made.colour, hair_material)
    hang(hair, armature)
    hair[MARK], hair[MADE_IN] = VERSION, list(made.colour)
    hair[KIND], hair[CUT], face[CUT] = made.kind, kept, kept
    face[LENGTH], face[VOLUME] = made.style.length, made.style.volume
    homes = [collection] if collection is not None else list(face.users_collection)
    if not hair.users_collection:
        for home in homes:
            home.objects.link(hair)
    if made.strands is None:
        remove_curves(face)
    else:
        material = next((m for m in mesh.materials if _node_in(m) is not None), None)
        on = {} if has_identity_keys(face) else identity
        wear_curves(face, made.strands, material, on, homes)
    return hair


def locks_of(face: bpy.types.Object, rig: FaceRig) -> bpy.types.Mesh:
    """A mesh of locks of the cut that a face wears, for what cannot hold strands: the hair object
    can have it (`hang` it then). Whoever asks removes it. rig : the full one"""
    hair, cut, who = hair_of(face), cut_of(face), identity_of(face)
    assert hair is not None
    assert cut is not None
    made = fitting(face, rig, hair_mesh(rig, who, cut, "locks", style=style_of(face)))
    mesh = worn_mesh(f"{hair.data.name} Locks", made, who)
    for material in hair.data.materials:
        mesh.materials.append(material)
    return mesh


def remove_hair(face: bpy.types.Object) -> None:
    """Take the hair of a face away, with all that it alone uses; no error without any.

    The face remembers the cut. InputError as `check_hair`.
    """
    check_hair(face)
    remove_curves(face)
    hair = hair_of(face)
    if hair is None:
        return
    discard_worn(hair)


def discard_worn(thing: bpy.types.Object) -> None:
    """Remove what a face wears, with the mesh and the materials that it alone uses."""
    mesh, materials = thing.data, [m for m in thing.data.materials if m is not None]
    bpy.data.objects.remove(thing)
    if not mesh.users:
        bpy.data.meshes.remove(mesh)
    for material in set(materials):
        if not material.users:
            bpy.data.materials.remove(material)


def colour_of(hair: bpy.types.Object) -> tuple[float, float, float] | None:
    """The colour of hair, linear RGB, where an artist changes it; None without its material."""
    node = _colour_node(hair)
    return None if node is None else tuple(node.outputs[0].default_value[:3])


def set_colour(hair: bpy.types.Object, colour: tuple[float, float, float]) -> None:
    """Colour hair, linear RGB, in renders and in solid shading; nothing without its material."""
    for material in hair.data.materials:
        node = _node_in(material)
        if node is not None and material.library is None:
            _paint(material, node, colour)
            return


def worn_mesh(name: str, made: HairMesh | HatMesh, identity: Mapping[str, float]) -> bpy.types.Mesh:
    """The mesh of hair on a person; nothing is left of it after an error."""
    corners = np.ascontiguousarray(made.quads, dtype=np.int32).reshape(-1)
    starts = np.arange(0, len(corners), 4, dtype=np.int32)
    mesh = make_mesh(name, to_blender(made.points), corners, starts)
    try:
        mesh.update(calc_edges=True)
        mesh.uv_layers.new(name=MAP)
        write_map(mesh.uv_layers[MAP], made.uv[corners])
        mesh.attributes.new(SHADE, "FLOAT", "POINT")
        mesh.attributes[SHADE].data.foreach_set("value", made.shade.astype(np.float32))
        write_rest(mesh, made.points, identity)
    except BaseException:
        bpy.data.meshes.remove(mesh)
        raise
    return mesh


def exchange_mesh(
    thing: bpy.types.Object,
    mesh: bpy.types.Mesh,
    colour: tuple[float, float, float],
    material: Callable[[tuple[float, float, float]], bpy.types.Material],
) -> None:
    """Give what a face wears another mesh with the materials of its old one, and its new colour
    unless somebody has changed that. material : makes one where there is none any more"""
    old, painted, first = thing.data, colour_of(thing), thing.get(MADE_IN)
    for kept in old.materials:
        mesh.materials.append(kept)
    if not len(mesh.materials):
        mesh.materials.append(material(colour))
    thing.data = mesh
    if painted is not None and first is not None and np.allclose(painted, first, atol=1e-6):
        set_colour(thing, colour)
    if not old.users:
        name = old.name
        bpy.data.meshes.remove(old)
        mesh.name = name


def hang(hair: bpy.types.Object, armature: bpy.types.Object) -> None:
    """Let all of a hair's mesh follow the bone of the head, as the skull does."""
    group = hair.vertex_groups.get(HEAD) or hair.vertex_groups.new(name=HEAD)
    group.add(range(len(hair.data.vertices)), 1.0, "REPLACE")
    if armature_of(hair) is None:
        modifier = hair.modifiers.new("Head", "ARMATURE")
        modifier.object = armature


# --- material ---


def hair_material(
    colour: tuple[float, float, float], name: str = COLOUR_NODE, roughness: float = ROUGHNESS
) -> bpy.types.Material:
    """A new material: colour = one node, to be changed, times the shade of the vertices.

    name : of COLOUR_NODES
    """
    material = bpy.data.materials.new(name)
    material.roughness = roughness
    if material.node_tree is None:  # Blender 5 makes the nodes itself
        material.use_nodes = True
    tree = material.node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = roughness
    plain = tree.nodes.new("ShaderNodeRGB")
    plain.label, plain.location = name, (-600, 300)
    shade = tree.nodes.new("ShaderNodeAttribute")
    shade.attribute_name, shade.location = SHADE, (-600, 80)
    shaded = tree.nodes.new("ShaderNodeVectorMath")
    shaded.operation, shaded.location = "SCALE", (-300, 300)
    tree.links.new(plain.outputs[0], shaded.inputs[0])
    tree.links.new(shade.outputs["Fac"], shaded.inputs["Scale"])
    tree.links.new(shaded.outputs[0], shader.inputs["Base Color"])
    _paint(material, plain, colour)
    return material


def _paint(material: bpy.types.Material, node: bpy.types.Node, colour: tuple) -> None:
    """Set the colour, and where solid shading and other programs look for it."""
    node.outputs[0].default_value = material.diffuse_color = (*colour, 1.0)
    for shader in material.node_tree.nodes:
        if shader.type == "BSDF_PRINCIPLED":
            shader.inputs["Base Color"].default_value = (*colour, 1.0)


def _colour_node(hair: bpy.types.Object) -> bpy.types.Node | None:
    found = (_node_in(material) for material in hair.data.materials)
    return next((node for node in found if node is not None), None)


def _node_in(material: bpy.types.Material | None) -> bpy.types.Node | None:
    if material is None or material.node_tree is None:
        return None
    nodes = material.node_tree.nodes
    return next((n for n in nodes if n.type == "RGB" and n.label in COLOUR_NODES), None)
