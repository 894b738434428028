"""What the artist prefers everywhere: quality, threads, where files go."""

from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ..messages.reporting import ADDON

# Newer Blenders want to be told that a path may begin with // for the folder of the .blend file.
_TOLD = "is_path_supports_blend_relative" in bpy.types.Property.bl_rna.properties
RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if _TOLD else set()


@dataclass(frozen=True)
class Defaults:
    """The preferences where the add-on is not among Blender's, as in scripts that register it."""

    quality: str = "FULL"
    threads: int = 0
    folder: str = ""


class SKETCHTOFACE_AP_preferences(bpy.types.AddonPreferences):
    """Edit > Preferences > Add-ons > Sketch to Face."""

    bl_idname = ADDON
    quality: EnumProperty(
        name="Quality",
        description="How far a fit goes, for the button and for live faces alike",
        items=[
            ("FULL", "Full", "The lines of the face are brought onto the drawn ones"),
            ("QUICK", "Quick", "Person and expression alone: smoother, and a third faster"),
        ],
    )
    threads: IntProperty(
        name="Threads",
        description="Processor cores that reading a sketch may use; 0 for as many as pay",
        min=0,
        max=64,
    )
    folder: StringProperty(
        name="Files Go To",
        description="Where the file browser begins when you save or export; empty for the "
        "folder of your .blend file",
        subtype="DIR_PATH",
        options=RELATIVE,
    )

    def draw(self, context):
        """The settings, then where help is."""
        layout = self.layout
        layout.use_property_split = True
        column = layout.column()
        for name in ("quality", "threads", "folder"):
            column.prop(self, name)
        row = layout.row()
        row.operator("sketch_to_face.help", text="Manual", icon="HELP")
        row.operator("sketch_to_face.log", icon="TEXT")


def of(context) -> "SKETCHTOFACE_AP_preferences | Defaults":
    """The artist's preferences."""
    addon = context.preferences.addons.get(ADDON)
    return addon.preferences if addon is not None and addon.preferences else Defaults()


def filepath():
    """The file of an export; asked for anew each time, as another face has another name."""
    return StringProperty(
        name="File Path",
        description="Where the file is written",
        subtype="FILE_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
    )


def in_folder(context, name: str) -> str:
    """A file's name with the folder that the artist likes files to go to, if that is there."""
    chosen = of(context).folder.strip()
    folder = Path(bpy.path.abspath(chosen)).expanduser()
    return str(folder / name) if chosen and folder.is_dir() else name


CLASSES = (SKETCHTOFACE_AP_preferences,)
