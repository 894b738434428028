"""The pictures of the face as an artist renders it: `python docs/renders.py [NAME ...]`.

Cycles, 1,280 pixels high, one lamp from the side that the face turns to, one that fills and one
from behind. Needs Blender as a module; a picture takes about a minute on two cores.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from PIL import Image

from facs_rig import FaceParameters, load_rig
from facs_rig.blender import build_face
from facs_rig.stylised import preset

IMAGES = Path(__file__).parent / "images"
WIDTH, HEIGHT = 1024, 1280
SAMPLES = 12  # and a denoiser
QUALITY = 88  # of the pictures' compression


@dataclass(frozen=True)
class Portrait:
    """Who, what, and from where: degrees that the face is turned to its own left, and down."""

    aus: dict[str, float] = field(default_factory=dict)
    who: dict[str, float] = field(default_factory=dict)
    yaw: float = 0.0
    pitch: float = 0.0
    gaze: tuple[float, float] = (0.0, 0.0)


LAUGH = {"smile": 5.0, "jaw_open": 3.0, "squint": 2.5, "outer_squint": 2.0, "sneer": 0.8}
SHOUT = {"jaw_open": 7.0, "lower_lip_depress": 3.0, "sneer": 2.5, "brow_furrow": 4.0,
         "wince": 2.0, "grimace": 1.5}  # fmt: skip
MAN = {"gender": 1.0, "caucasian": 1.0, "african": 0.0, "asian": 0.0}
WOMAN = {"gender": 0.0, "african": 0.9, "asian": 0.1, "caucasian": 0.0,
         "skin_tone": 0.74, "iris_colour": 0.1, "brow_colour": 0.95,
         "lip_colour": 0.15, "skin_gloss": 0.2}  # fmt: skip
ASIAN = {"gender": 0.15, "asian": 1.0, "african": 0.0, "caucasian": 0.0, "skin_tone": 0.37,
         "iris_colour": 0.15, "brow_colour": 0.95, "lip_colour": 0.2}  # fmt: skip
PORTRAITS = {
    "front": Portrait(yaw=0.0),
    "three_quarters": Portrait(who=WOMAN, yaw=38.0),
    "profile": Portrait(who=ASIAN, yaw=88.0),
    "laughing": Portrait(LAUGH, WOMAN, yaw=-18.0),
    "shouting": Portrait(SHOUT, MAN | {"skin_redness": 0.5, "brow_colour": 0.7}, yaw=20.0),
    "eyes_closed": Portrait({"blink": 5.0, "smile": 0.8}, ASIAN, yaw=12.0, pitch=6.0),
    "old": Portrait({"smile": 1.0}, MAN | {"age": 1.0, "brow_grey": 0.8, "skin_redness": 0.3,
                                           "skin_gloss": -0.3}, yaw=-25.0),
    "child": Portrait({"smile": 3.0}, {"age": -0.8, "gender": 0.3, "iris_colour": 0.4,
                                       "skin_redness": 0.3}, yaw=22.0),
    "comic": Portrait({"smile": 3.0, "jaw_open": 2.0}, preset("comic"), yaw=-28.0),
}  # fmt: skip


def stage(side: float) -> bpy.types.Object:
    """An empty scene with a wall, lamps and a camera; returns the camera.

    side : 1 for a key lamp from the face's right, which is the picture's left, -1 from its left
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, True
    scene.cycles.max_bounces = 6
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    sky = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    sky.inputs["Color"].default_value = (0.80, 0.86, 1.0, 1.0)
    sky.inputs["Strength"].default_value = 0.22
    wall = bpy.data.meshes.new("Wall")
    wall.from_pydata([(-4, 1.1, -3), (4, 1.1, -3), (4, 1.1, 3), (-4, 1.1, 3)], [], [(0, 1, 2, 3)])
    scene.collection.objects.link(bpy.data.objects.new("Wall", wall))
    paint = bpy.data.materials.new("Wall")
    if paint.node_tree is None:
        paint.use_nodes = True
    shader = next(n for n in paint.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.20, 0.215, 0.23, 1.0)
    shader.inputs["Roughness"].default_value = 0.9
    wall.materials.append(paint)
    # Place, watts, size, colour: the fill from where the key is not, the rim from behind.
    for name, (x, y, z), power, size, colour in (
        ("Key", (-0.75, -0.95, 0.75), 17.0, 0.55, (1.0, 0.95, 0.88)),
        ("Fill", (1.1, -0.9, 0.05), 4.0, 0.9, (0.88, 0.94, 1.0)),
        ("Rim", (0.75, 0.75, 0.65), 14.0, 0.4, (1.0, 0.98, 0.95)),
        ("Wall", (0.0, 0.35, -0.9), 6.0, 0.6, (1.0, 1.0, 1.0)),
    ):
        lamp = bpy.data.lights.new(name, "AREA")
        lamp.energy, lamp.size, lamp.color = power, size, colour
        thing = bpy.data.objects.new(name, lamp)
        place = Vector((side * x, y, z))
        thing.location = place
        goal = Vector((0.0, 1.1, -0.2)) if name == "Wall" else Vector((0.0, -0.04, 0.03))
        thing.rotation_euler = (goal - place).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(thing)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens, camera.data.sensor_width = 85.0, 24.0
    camera.data.sensor_fit = "HORIZONTAL"
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def render(portrait: Portrait, path: Path) -> None:
    """Render a portrait to a picture."""
    camera = stage(-1.0 if portrait.yaw > 0 else 1.0)
    rig = load_rig()
    face = build_face("Face", rig, FaceParameters(portrait.aus, portrait.who, gaze=tuple(
        np.radians(portrait.gaze))))  # fmt: skip
    armature = face.parent
    armature.rotation_euler = (np.radians(portrait.pitch), 0.0, np.radians(portrait.yaw))
    bpy.context.view_layer.update()
    points = rig.pose(FaceParameters(portrait.aus, portrait.who))[:, [0, 2, 1]] * (1, -1, 1)
    turned = points @ np.array(armature.rotation_euler.to_matrix()).T
    (left, _, low), (right, _, high) = turned.min(axis=0), turned.max(axis=0)
    # Heads are framed alike: the middle in the middle, 86 % of the picture high or wide.
    size = max(high - low, (right - left) * HEIGHT / WIDTH)
    away = 85.0 / 24.0 * WIDTH / HEIGHT * size / 0.86
    camera.location = ((left + right) / 2, -away, (low + high) / 2)
    camera.rotation_euler = (np.pi / 2, 0.0, 0.0)
    bpy.context.view_layer.update()
    with tempfile.TemporaryDirectory() as folder:
        scene = bpy.context.scene
        scene.render.filepath = str(Path(folder) / "render.png")
        bpy.ops.render.render(write_still=True)
        picture = Image.open(scene.render.filepath).convert("RGB")
        picture.save(path, quality=QUALITY, subsampling=0, optimize=True)


def main() -> None:
    for name in sys.argv[1:] or PORTRAITS:
        if name not in PORTRAITS:
            raise SystemExit(f"there is no portrait '{name}', only {', '.join(PORTRAITS)}")
        render(PORTRAITS[name], IMAGES / f"render_{name}.jpg")
        print(name)


if __name__ == "__main__":
    main()
