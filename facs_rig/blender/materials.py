"""The materials of Blender's face: what `facs_rig.paint` says, finished for EEVEE and Cycles."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.arrays import write_map, write_materials
from facs_rig.blender.steps import Steps
from facs_rig.common.derived import derived
from facs_rig.paint import MATERIAL_NAMES, MATERIALS, materials_at
from facs_rig.rig import FaceRig, landmark_points

SKIN_MAP = "UVMap"  # UV map to paint on, MakeHuman's own
EYE_MAP = "Eyes"  # UV map: 1 is the rim of the iris, 0 the middle of the pupil
SKIN_NODE = "Skin"  # label of the node with the colour that the tints are multiplied with
TINT = "Tint"  # attribute of the vertices: what the skin's colour is multiplied by
_EYES = ("eyes", "iris", "pupil")
_TINTED = ("skin", "lips", "brow_skin")
# The polygons are too coarse for the rim of the lips, so it is drawn softly: what lies within this
# distance of a vertex is averaged.
SOFT = 0.0012  # metres
# Where blood shows through: between which landmarks, how much, over which distance in metres.
_BLUSH = ((("cheekbone_left", "nose_wing_left"), 0.13, 0.017),
          (("cheekbone_right", "nose_wing_right"), 0.13, 0.017),
          (("nose_tip",), 0.14, 0.008), (("chin",), 0.06, 0.012))  # fmt: skip

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
    eye_map : (c, 2) float32, where each corner of the polygons lies, in radii of its iris
    materials : (p,) int32, index into MATERIAL_NAMES of each polygon
    pupil : its radius, in radii of the iris
    """

    tints: NDArray[np.float32]
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
    return Paint(
        tints=_tints(rig, neutral),
        eye_map=np.ascontiguousarray(_eye_places(rig, neutral)[corners]),
        materials=materials_at(rig, neutral, centres, rig.vertex_part[corners[starts]]),
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
    tint = mesh.attributes.new(TINT, "FLOAT_VECTOR", "POINT")
    tint.data.foreach_set("vector", paint.tints.ravel())
    for name in MATERIAL_NAMES:
        mesh.materials.append(_material(name, paint.pupil, made))
        yield
    write_materials(mesh, paint.materials)
    yield


def _tints(rig: FaceRig, neutral: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 3) colour of each vertex as against plain skin: lips, skin under brows, blushes."""
    tints = np.ones((len(neutral), 3), dtype=np.float32)
    skin = np.flatnonzero(rig.parts["skin"] & (neutral[:, 2] > 0))
    plain = np.array(MATERIALS["skin"][0][:3])
    colours = np.array([MATERIALS[name][0][:3] for name in MATERIAL_NAMES])
    tinted = np.isin(np.arange(len(MATERIAL_NAMES)), [MATERIAL_NAMES.index(n) for n in _TINTED])

    material = np.full(len(neutral), MATERIAL_NAMES.index("skin"))
    material[skin] = materials_at(rig, neutral, neutral[skin], rig.vertex_part[skin])
    tints[tinted[material]] = (colours[material] / plain)[tinted[material]]

    around = material[rig.triangles]
    mixed = (around != around[:, :1]).any(axis=1)
    rim = np.intersect1d(rig.triangles[mixed], skin)
    total, count = np.zeros((len(rim), 3)), np.zeros((len(rim), 1))
    for turn in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        for radius in (0.4 * SOFT, SOFT):
            aside = radius * np.array([np.cos(turn), np.sin(turn), 0.0])
            index = materials_at(rig, neutral, neutral[rim] + aside, rig.vertex_part[rim])
            total += colours[index] * tinted[index, None]
            count += tinted[index, None]
    tints[rim] = np.where(count > 0, total / np.maximum(count, 1), plain) / plain

    places = landmark_points(rig, neutral)
    for names, amount, reach in _BLUSH:
        middle = np.mean([places[name] for name in names], axis=0)
        far = np.linalg.norm(neutral[skin] - middle, axis=1) / reach
        tints[skin] *= 1 - amount * np.exp(-0.5 * far**2)[:, None] * (0.1, 0.8, 0.7)
    return tints


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
    colour, roughness = MATERIALS[part]
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
    if part in _TINTED:
        _tint_skin(material.node_tree, shader)
    if part in _EYES:
        _draw_eye(material.node_tree, shader, pupil)
    return material


def _tint_skin(tree: bpy.types.NodeTree, shader: bpy.types.Node) -> None:
    """Colour = skin (a node of its own, to be changed) times the tint of the vertices."""
    plain = tree.nodes.new("ShaderNodeRGB")
    plain.label, plain.location = SKIN_NODE, (-600, 300)
    plain.outputs[0].default_value = MATERIALS["skin"][0]
    tint = tree.nodes.new("ShaderNodeAttribute")
    tint.attribute_name, tint.location = TINT, (-600, 80)
    product = tree.nodes.new("ShaderNodeVectorMath")
    product.operation, product.location = "MULTIPLY", (-300, 200)
    tree.links.new(plain.outputs[0], product.inputs[0])
    tree.links.new(tint.outputs["Vector"], product.inputs[1])
    tree.links.new(product.outputs[0], shader.inputs["Base Color"])


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

    white, iris, black = (np.array(MATERIALS[name][0][:3]) for name in _EYES)
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
    link(ramp.outputs[0], scaled.inputs[0])
    link(strength.outputs[0], scaled.inputs["Scale"])
    link(scaled.outputs[0], shader.inputs["Base Color"])
