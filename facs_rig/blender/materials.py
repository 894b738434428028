"""The materials of Blender's face: what `facs_rig.paint` says, finished for EEVEE and Cycles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.arrays import write_map, write_materials
from facs_rig.blender.steps import Steps
from facs_rig.common.derived import derived
from facs_rig.looks import PLAIN, colours_of
from facs_rig.paint import MATERIAL_NAMES, TINTED, materials_at, painted
from facs_rig.rig import FaceRig

SKIN_MAP = "UVMap"  # UV map to paint on, MakeHuman's own
EYE_MAP = "Eyes"  # UV map: 1 is the rim of the iris, 0 the middle of the pupil
SKIN_NODE = "Skin"  # label of the node with the colour that the tints are multiplied with
TINT = "Tint"  # attribute of the vertices: what the skin's colour is multiplied by
_EYES = ("eyes", "iris", "pupil")
# Properties of the face that its materials read, so that faces share these and yet have colours of
# their own: the colour as against the default person's, less 1, so that nothing changes where a
# property is missing.
LOOKS = {"skin": "look_skin", "lips": "look_lips", "brow_skin": "look_brow_skin",
         "iris": "look_iris", "brows": "look_brows"}  # fmt: skip
GLOSS = "look_roughness"  # of the skin, less the default person's
AREAS = "Areas"  # attribute of the vertices: how far they are lip, and skin under a brow
# What else a principled shader needs to look like its material: input -> value, for each name
# that Blender's versions have for it.
_WET = {"Coat Weight": 1.0, "Clearcoat": 1.0, "Coat Roughness": 0.03, "Clearcoat Roughness": 0.03}
_SKIN = {"Subsurface Weight": 0.2, "Subsurface Scale": 0.006}
_DAMP = {**_SKIN, "Coat Weight": 0.15, "Clearcoat": 0.15}
_FINISH = {**dict.fromkeys(_EYES, _WET), **dict.fromkeys(("skin", "brow_skin"), _SKIN),
           **dict.fromkeys(("lips", "tongue", "mouth", "teeth"), _DAMP)}  # fmt: skip


def starts_of(rig: FaceRig) -> NDArray[np.int32]:
    """First corner of each polygon, without a closing end."""
    starts = np.ascontiguousarray(rig.polygon_starts, dtype=np.int32)
    return starts[starts < len(rig.polygon_vertices)]


@dataclass(frozen=True)
class Paint:
    """What is painted on the default face, and so, on the same vertices, on everybody's.

    tints : (n, 3) float32, what the skin's colour is multiplied by at each vertex
    areas : (n, 3) float32, how far each vertex is lip, and skin under a brow; the third is 0
    eye_map : (c, 2) float32, where each corner of the polygons lies, in radii of its iris
    materials : (p,) int32, index into MATERIAL_NAMES of each polygon
    pupil : its radius, in radii of the iris
    """

    tints: NDArray[np.float32]
    areas: NDArray[np.float32]
    eye_map: NDArray[np.float32]
    materials: NDArray[np.int32]
    pupil: float


@derived
def paint_of(rig: FaceRig) -> Paint:
    """The paint of a rig's faces, computed once; numpy alone, so that any thread may ask first."""
    neutral = rig.neutral()
    corners, starts = np.asarray(rig.polygon_vertices), starts_of(rig)
    counts = np.diff(np.append(starts, len(corners)))[:, None]
    centres = np.add.reduceat(neutral[corners], starts, axis=0) / counts
    rims = [rig.stroke_points(neutral, f"{ring}_left") for ring in ("pupil", "iris")]
    pupil, iris = (np.linalg.norm(rim - rim.mean(axis=0), axis=1).mean() for rim in rims)
    found = painted(rig)
    skin = found.areas.any(axis=1)
    tints = np.ones((len(neutral), 3), dtype=np.float32)
    tints[skin] = found.colours(PLAIN)[skin, :3] / np.array(PLAIN["skin"].colour[:3])
    areas = np.zeros_like(tints)
    areas[:, :2] = found.areas[:, 1:]
    return Paint(
        tints=tints,
        areas=areas,
        eye_map=np.ascontiguousarray(_eye_places(rig, neutral)[corners]),
        materials=materials_at(rig, centres, rig.vertex_part[corners[starts]]),
        pupil=float(pupil / iris),
    )


def add_materials(mesh: bpy.types.Mesh, rig: FaceRig, made: list[bpy.types.ID]) -> Steps[None]:
    """Give a new mesh its materials by polygon, the maps for textures and eyes, and the tints.

    Pauses after each. Materials that have to be made are added to `made`.
    """
    paint = paint_of(rig)
    yield
    for name, places in ((SKIN_MAP, rig.uv), (EYE_MAP, paint.eye_map)):
        # Layers may move when one is added: this one is looked up again.
        mesh.uv_layers.new(name=name)
        write_map(mesh.uv_layers[name], places)
        yield
    mesh.uv_layers[SKIN_MAP].active_render = True
    mesh.uv_layers.active = mesh.uv_layers[SKIN_MAP]
    for name, values in ((TINT, paint.tints), (AREAS, paint.areas)):
        mesh.attributes.new(name, "FLOAT_VECTOR", "POINT")
        mesh.attributes[name].data.foreach_set("vector", values.ravel())
    for name in MATERIAL_NAMES:
        mesh.materials.append(_material(name, paint.pupil, made))
        yield
    write_materials(mesh, paint.materials)
    yield


def _eye_places(rig: FaceRig, neutral: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 2) each vertex from the front, from the middle of its iris, in radii of the iris.

    Whatever is no eyeball, or its back, is far away from the iris.
    """
    places = np.full((len(neutral), 2), 9.0, dtype=np.float32)
    for side, sign in (("left", 1), ("right", -1)):
        rim = rig.stroke_points(neutral, f"iris_{side}")
        middle = rim.mean(axis=0)
        radius = np.linalg.norm((rim - middle)[:, :2], axis=1).mean()
        ball = rig.parts["eyes"] & (sign * rig.neutral()[:, 0] > 0)
        front = ball & (neutral[:, 2] > neutral[ball, 2].mean())
        places[front] = (neutral[front] - middle)[:, :2] / radius
    return places


def _material(part: str, pupil: float, made: list[bpy.types.ID]) -> bpy.types.Material:
    """The material of a part; faces share it, and what the artist changed stays changed.

    pupil : its radius, in radii of the iris
    """
    name = f"Face {part.capitalize()}"
    found = bpy.data.materials.get(name)
    if found is not None:
        return found
    colour, roughness = PLAIN[part].colour, PLAIN[part].roughness
    material = bpy.data.materials.new(name)
    made.append(material)
    material.diffuse_color = colour
    material.roughness = roughness
    if material.node_tree is None:  # Blender 5 makes the nodes itself
        material.use_nodes = True
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = colour
    shader.inputs["Roughness"].default_value = roughness
    for name, value in _FINISH.get(part, {}).items():
        if name in shader.inputs:
            shader.inputs[name].default_value = value
    tree = material.node_tree
    if part in TINTED:
        _tint_skin(tree, shader)
        _add_gloss(tree, shader, roughness)
    if part in _EYES:
        _draw_eye(tree, shader, pupil)
    if part == "brows":
        plain = tree.nodes.new("ShaderNodeRGB")
        plain.location, plain.outputs[0].default_value = (-600, 300), colour
        own = _multiplied(tree, plain.outputs[0], _own(tree, LOOKS["brows"], (-600, 80)))
        tree.links.new(own, shader.inputs["Base Color"])
    return material


def write_looks(face: bpy.types.Object, identity: Mapping[str, float]) -> None:
    """Give a face the colours of a person, in the properties that its materials read."""
    own = colours_of(identity)

    def against(name: str, base: str | None = None) -> NDArray:
        """A colour as against the default person's, or as against that of `base`."""
        now, plain = (np.array(p[name].colour[:3]) for p in (own, PLAIN))
        if base is not None:
            now, plain = now / own[base].colour[:3], plain / PLAIN[base].colour[:3]
        return now / plain - 1

    values: dict[str, object] = {
        prop: against(name, "skin" if name in ("lips", "brow_skin") else None).tolist()
        for name, prop in LOOKS.items()
    }
    values[GLOSS] = own["skin"].roughness - PLAIN["skin"].roughness
    for prop, value in values.items():
        face[prop] = value
        if face.override_library is None:
            face.property_overridable_library_set(f'["{prop}"]', True)


def own_palette(face: bpy.types.Object) -> dict[str, NDArray[np.float64]]:
    """Material -> (3,) what its colour is multiplied by on this face, as its shader does it."""
    own = {
        name: 1.0 + np.array(face.get(prop) or (0.0,) * 3, float) for name, prop in LOOKS.items()
    }
    return own | {name: own[name] * own["skin"] for name in ("lips", "brow_skin")}


def _own(
    tree: bpy.types.NodeTree,
    prop: str,
    place: tuple[int, int],
    area: bpy.types.NodeSocket | None = None,
) -> bpy.types.NodeSocket:
    """1 + a property of the object, or 1 + area times that."""
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name, node.location = "OBJECT", prop, place
    out = node.outputs["Vector"]
    if area is not None:
        share = tree.nodes.new("ShaderNodeVectorMath")
        share.operation, share.location = "SCALE", (place[0] + 180, place[1])
        tree.links.new(out, share.inputs[0])
        tree.links.new(area, share.inputs["Scale"])
        out = share.outputs[0]
    more = tree.nodes.new("ShaderNodeVectorMath")
    more.operation, more.location = "ADD", (place[0] + 360, place[1])
    more.inputs[1].default_value = (1.0, 1.0, 1.0)
    tree.links.new(out, more.inputs[0])
    return more.outputs[0]


def _multiplied(tree: bpy.types.NodeTree, *factors: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    product, *rest = factors
    for factor in rest:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation, node.location = "MULTIPLY", (-150, 200)
        tree.links.new(product, node.inputs[0])
        tree.links.new(factor, node.inputs[1])
        product = node.outputs[0]
    return product


def _tint_skin(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
    """Colour = skin (a node of its own, to be changed) times the tint of the vertices, and all that
    as the person has it."""
    plain = tree.nodes.new("ShaderNodeRGB")
    plain.label, plain.location = SKIN_NODE, (-900, 300)
    plain.outputs[0].default_value = PLAIN["skin"].colour
    tint, areas = (tree.nodes.new("ShaderNodeAttribute") for _ in range(2))
    tint.attribute_name, tint.location = TINT, (-900, 80)
    areas.attribute_name, areas.location = AREAS, (-1150, -150)
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    split.location = (-950, -150)
    tree.links.new(areas.outputs["Vector"], split.inputs[0])
    colour = _multiplied(
        tree,
        plain.outputs[0],
        tint.outputs["Vector"],
        _own(tree, LOOKS["skin"], (-900, -320)),
        _own(tree, LOOKS["lips"], (-900, -490), split.outputs[0]),
        _own(tree, LOOKS["brow_skin"], (-900, -660), split.outputs[1]),
    )
    tree.links.new(colour, shader.inputs["Base Color"])


def _add_gloss(tree: bpy.types.NodeTree, shader: bpy.types.Node, roughness: float) -> None:
    """Roughness = that of the material and how glossy the person's skin is."""
    own = tree.nodes.new("ShaderNodeAttribute")
    own.attribute_type, own.attribute_name, own.location = "OBJECT", GLOSS, (-600, -830)
    added = tree.nodes.new("ShaderNodeMath")
    added.operation, added.use_clamp, added.location = "ADD", True, (-300, -830)
    added.inputs[1].default_value = roughness
    tree.links.new(own.outputs["Fac"], added.inputs[0])
    tree.links.new(added.outputs[0], shader.inputs["Roughness"])


def _draw_eye(tree: bpy.types.NodeTree, shader: bpy.types.Node, pupil: float) -> None:
    """Colour an eyeball by its map, so that the iris is round whatever the polygons are.

    All three materials of the eye are drawn alike; they differ in solid shading and in files.
    `pupil` is its radius against that of the iris.
    """

    def node(kind: str, **settings):
        made = tree.nodes.new(kind)
        made.location = (-200 * len(tree.nodes), -100)
        for name, value in settings.items():
            setattr(made, name, value)
        return made

    def link(source, target) -> None:
        tree.links.new(source, target)

    white, iris, black = (np.array(PLAIN[name].colour[:3]) for name in _EYES)
    where = node("ShaderNodeUVMap", uv_map=EYE_MAP).outputs[0]
    far = node("ShaderNodeVectorMath", operation="LENGTH")
    link(where, far.inputs[0])
    half = node("ShaderNodeMath", operation="MULTIPLY")  # the ramp ends at two radii
    half.inputs[1].default_value = 0.5
    link(far.outputs["Value"], half.inputs[0])
    ramp = node("ShaderNodeValToRGB")
    stops = ((pupil / 2 - 0.012, black), (pupil / 2 + 0.012, 0.8 * iris), (0.32, 1.5 * iris),
             (0.42, iris), (0.475, 0.3 * iris), (0.53, white))  # fmt: skip
    elements = ramp.color_ramp.elements
    while len(elements) < len(stops):
        elements.new(0.5)
    for element, (place, colour) in zip(elements, stops, strict=True):
        element.position, element.color = place, (*np.minimum(colour, 1.0).tolist(), 1.0)
    link(half.outputs[0], ramp.inputs[0])

    # Fibres of the iris: noise over the direction alone, none outside the iris.
    aside = node("ShaderNodeVectorMath", operation="NORMALIZE")
    link(where, aside.inputs[0])
    noise = node("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 9.0
    link(aside.outputs[0], noise.inputs["Vector"])
    inside = node("ShaderNodeMath", operation="LESS_THAN")
    inside.inputs[1].default_value = 0.92
    link(far.outputs["Value"], inside.inputs[0])
    about = node("ShaderNodeMath", operation="SUBTRACT")
    about.inputs[1].default_value = 0.5
    link(noise.outputs[0], about.inputs[0])
    fibres = node("ShaderNodeMath", operation="MULTIPLY")
    link(about.outputs[0], fibres.inputs[0])
    link(inside.outputs[0], fibres.inputs[1])
    strength = node("ShaderNodeMath", operation="MULTIPLY_ADD")
    strength.inputs[1].default_value = 2.0
    strength.inputs[2].default_value = 1.0
    link(fibres.outputs[0], strength.inputs[0])
    scaled = node("ShaderNodeVectorMath", operation="SCALE")
    link(_in_iris(tree, ramp.outputs[0], far.outputs["Value"]), scaled.inputs[0])
    link(strength.outputs[0], scaled.inputs["Scale"])
    link(scaled.outputs[0], shader.inputs["Base Color"])


def _in_iris(
    tree: bpy.types.NodeTree, colour: bpy.types.NodeSocket, far: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """The colour, and where it is that of the iris, within a radius, as the person has it."""
    inside = tree.nodes.new("ShaderNodeMath")
    inside.operation, inside.location = "LESS_THAN", (-1400, -500)
    inside.inputs[1].default_value = 0.96
    tree.links.new(far, inside.inputs[0])
    own = _own(tree, LOOKS["iris"], (-1200, -500), inside.outputs[0])
    return _multiplied(tree, colour, own)
