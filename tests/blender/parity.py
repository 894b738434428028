"""Runs in a Blender without a window: builds faces and compares them with the numpy rig.

blender -b --python-exit-code 1 -P parity.py -- RESULT.json
"""

import json
import sys
from pathlib import Path

import bpy
import numpy as np

from facs_rig import CONTROL_NAMES, FaceParameters, load_rig
from facs_rig.blender import build_face, set_identity
from facs_rig.blender.pose import set_pose
from facs_rig.blender.reshape import fitted_offsets, reshape
from facs_rig.folds import drawn_creases
from facs_rig.levels import at_level

result = Path(sys.argv[-1])
rig = load_rig()
random = np.random.default_rng(3)


def pose(who: dict) -> FaceParameters:
    aus = {n: float(random.uniform(0, 10)) for n in random.choice(CONTROL_NAMES, 10, False)}
    turns = random.uniform(-0.5, 0.5, 8)
    return FaceParameters(aus, who, tuple(turns[:3]), tuple(turns[3:6]), tuple(turns[6:]))


def off(face: bpy.types.Object, parameters: FaceParameters, offsets=None, few=rig) -> float:
    """The largest distance in metres between Blender's mesh and numpy's."""
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = face.evaluated_get(graph).to_mesh()
    flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", flat)
    x, y, z = flat.reshape(-1, 3).T
    return float(np.abs(np.stack([x, z, -y], axis=1) - few.pose(parameters, offsets)).max())


bpy.ops.wm.read_factory_settings(use_empty=True)
told: dict = {"blender": bpy.app.version_string, "off_m": {}}
first = pose({"age": 0.8, "gender": 0.9})
baked = build_face("Baked", rig, first)
told["off_m"]["baked"] = off(baked, first)
face = build_face("Live", rig, FaceParameters(), identity_keys=True, arkit=True)
told["off_m"]["neutral"] = off(face, FaceParameters())
for name, who in (("young", {"eye_spacing": 0.7}), ("old", {"age": 1.0, "neck_length": -0.9}),
                  ("creased", drawn_creases(random))):  # fmt: skip
    wanted = pose(who)
    set_identity(face, rig, who)
    set_pose(face, wanted)
    told["off_m"][name] = off(face, wanted)
for name, again, who in (
    ("baked reshaped", baked, {"age": 0.3, "eye_spacing": -0.8}),
    ("baked again", baked, {"neck_length": 0.9, "jaw_drop": 0.7}),
    ("live reshaped", face, {"gender": 1.0, "head_depth": 0.6}),
    ("baked creased", baked, drawn_creases(random)),
    ("live creased", face, {"age": 0.9, **drawn_creases(random)}),
):
    wanted = pose(who)
    offsets = random.normal(0, 0.002, (rig.n_vertices, 3)).astype(np.float32)
    reshape(again, rig, who, offsets)
    set_pose(again, wanted)
    told["off_m"][name] = off(again, wanted, offsets)
    told["off_m"][f"{name}: fitted"] = float(np.abs(fitted_offsets(again) - offsets).max())
for level in ("medium", "game"):
    few = at_level(rig, level)
    light = build_face(f"Light {level}", few, first, identity_keys=level == "game")
    told["off_m"][level] = off(light, first, few=few)
    who, offsets = {"age": 0.4, "eye_spacing": 0.8}, random.normal(0, 0.002, (rig.n_vertices, 3))
    wanted, offsets = pose(who), offsets.astype(np.float32)
    reshape(light, rig, who, offsets)
    set_pose(light, wanted)
    told["off_m"][f"{level} reshaped"] = off(light, wanted, offsets[few.of_full], few)
drivers = [d for block in (face.data.shape_keys, face.parent)
           for d in block.animation_data.drivers]  # fmt: skip
told["python"] = [d.data_path for d in drivers if not d.driver.is_simple_expression]
told["invalid"] = [d.data_path for d in drivers if not d.driver.is_valid]
result.write_text(json.dumps(told))
