"""Small meshes with the shape keys of other rigs, and what is to be seen of them."""

from __future__ import annotations

import bpy
import pytest

from facs_rig import ARKIT_NAMES
from facs_rig.retarget import retarget


def mesh(name: str, keys=ARKIT_NAMES):
    """A triangle with shape keys of these names, linked to the scene, not selected."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    for key in ("Basis", *keys) if keys else ():
        made.shape_key_add(name=key, from_mix=False).value = 0.0
    return made


def select(*objects, active=None) -> None:
    """Exactly these, the first one active unless another is named; remembered by undo."""
    bpy.context.view_layer.update()
    for each in bpy.context.view_layer.objects:
        each.select_set(each in objects)
    bpy.context.view_layer.objects.active = active or objects[0]
    bpy.ops.ed.undo_push(message="selected")


def values(name: str) -> dict[str, float]:
    """The shape keys of a mesh that are not at rest."""
    blocks = bpy.data.objects[name].data.shape_keys.key_blocks
    return {block.name: block.value for block in blocks if block.value}


def wanted(aus, convention: str) -> dict[str, float]:
    """The keys that the core computes, without those at rest."""
    return pytest.approx({k: v for k, v in retarget(aus, convention).items() if v}, abs=1e-6)


def keyed(name: str) -> dict[str, list[tuple[float, float]]]:
    """Shape key -> its keyframes (frame, value)."""
    keys = bpy.data.objects[name].data.shape_keys
    action = keys.animation_data.action if keys.animation_data else None
    out = {}
    for block in keys.key_blocks if action else ():
        path = block.path_from_id("value")
        curve = next((c for c in curves_of(action) if c.data_path == path), None)
        if curve is not None:
            out[block.name] = [tuple(point.co) for point in curve.keyframe_points]
    return out


def curves_of(action):
    """An action's curves, wherever this Blender keeps them."""
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
    return [curve for bag in bags for curve in bag.fcurves]


def error_of(operator, *args, **options) -> str:
    """The one sentence that an operator reports."""
    with pytest.raises(RuntimeError) as caught:
        operator(*args, **options)
    sentence = str(caught.value).removeprefix("Error: ").strip()
    assert "\n" not in sentence and "Traceback" not in sentence
    return sentence
