"""The materials of Blender's face: what `facs_rig.paint` says, finished for EEVEE and Cycles."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.paint import MATERIAL_NAMES, MATERIALS, materials_at
from facs_rig.rig import FaceRig

EYE_MAP = "Eyes"  # UV map: 1 is the rim of the iris, 0 the middle of the pupil
_EYES = ("eyes", "iris", "pupil")

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


def add_materials(
    mesh: bpy.types.Mesh, rig: FaceRig, neutral: NDArray[np.float32], made: list[bpy.types.ID]
) -> None:
    """Give the mesh its materials by polygon, and the map that draws the eyes.

    neutral : (n, 3) metres, core axes. Materials that have to be made are added to `made`.
    """
    corners, starts = np.asarray(rig.polygon_vertices), starts_of(rig)
    counts = np.diff(np.append(starts, len(corners)))[:, None]
    centres = np.add.reduceat(neutral[corners], starts, axis=0) / counts
    part = rig.vertex_part[corners[starts]]
    places = _eye_places(rig, neutral)
    layer = mesh.uv_layers.new(name=EYE_MAP)
    layer.data.foreach_set("uv", np.ascontiguousarray(places[corners]).ravel())
    for name in MATERIAL_NAMES:
        mesh.materials.append(_material(name, rig, neutral, made))
    mesh.polygons.foreach_set("material_index", materials_at(rig, neutral, centres, part))


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


def _material(
    part: str, rig: FaceRig, neutral: NDArray, made: list[bpy.types.ID]
) -> bpy.types.Material:
    """The material of a part; faces share it, and what the artist changed stays changed."""
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
    if part in _EYES:
        rims = [rig.stroke_points(neutral, f"{ring}_left") for ring in ("pupil", "iris")]
        pupil, iris = (np.linalg.norm(rim - rim.mean(axis=0), axis=1).mean() for rim in rims)
        _draw_eye(material.node_tree, shader, float(pupil / iris))
    return material


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
