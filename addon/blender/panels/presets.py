"""Presets of how to fit, by Blender's own preset system: they lie among the artist's presets."""

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..state import properties
from .tab import Tab

FOLDER = "sketch_to_face/fit"


class SKETCHTOFACE_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Keep how faces are fitted as a preset, or remove one"""

    bl_idname = "sketch_to_face.add_preset"
    bl_label = "Add a Fit Preset"
    preset_menu = "SKETCHTOFACE_PT_presets"
    preset_subdir = FOLDER
    preset_defines = ("settings = bpy.context.scene.sketch_to_face",)
    preset_values = (
        *(f"settings.{name}" for name in properties.FIT_SETTINGS),
        *(f"settings.tweakables.{name}"
          for name in properties.SKETCHTOFACE_PG_tweakables.__annotations__),
    )  # fmt: skip


class SKETCHTOFACE_PT_presets(PresetPanel, bpy.types.Panel):
    """The list of presets in the header of the panel Tweakables."""

    bl_label = "Fit Presets"
    bl_space_type = Tab.bl_space_type
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = SKETCHTOFACE_OT_add_preset.bl_idname


CLASSES = (SKETCHTOFACE_OT_add_preset, SKETCHTOFACE_PT_presets)
