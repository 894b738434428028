"""Where help is: the manual that comes with the add-on, and the log."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty

from ..messages import reporting

PAGES = ("index", "tutorial", "sketch", "detect", "fit", "result", "expression", "any_rig",
         "preferences", "troubleshooting")  # fmt: skip
# The zip brings the manual as web pages; in a checkout it is what they are made of.
_PLACES = (
    (Path(__file__).parents[1] / "manual", ".html"),
    (Path(__file__).resolve().parents[3] / "docs" / "manual", ".md"),
)


def page(name: str) -> Path | None:
    """The file of a page of the manual, if it is there."""
    for folder, suffix in _PLACES:
        path = folder / f"{name}{suffix}"
        if path.is_file():
            return path
    return None


class SKETCHTOFACE_OT_help(bpy.types.Operator):
    """Open the manual, which comes with the add-on, at the page of this panel"""

    bl_idname = "sketch_to_face.help"
    bl_label = "Sketch to Face Manual"
    bl_options = {"INTERNAL"}
    page: EnumProperty(
        name="Page",
        description="Where the manual is opened",
        items=[(name, name.replace("_", " ").capitalize(), "") for name in PAGES],
    )

    def execute(self, context):
        """Hand the page to the browser."""
        path = page(self.page)
        if path is None:
            reporting.say(self, "ERROR", "The manual is missing: install the add-on's zip again")
            return {"CANCELLED"}
        bpy.ops.wm.url_open(url=path.as_uri())
        return {"FINISHED"}


class SKETCHTOFACE_OT_log(bpy.types.Operator):
    """Open the file in which unexpected errors are written down"""

    bl_idname = "sketch_to_face.log"
    bl_label = "Open the Log"
    bl_options = {"INTERNAL"}

    def execute(self, context):
        """Hand the file to the program that reads texts."""
        path = reporting.log_path()
        if not path.is_file():
            reporting.say(self, "INFO", "The log is empty: nothing unexpected has happened")
            return {"CANCELLED"}
        bpy.ops.wm.path_open(filepath=str(path))
        return {"FINISHED"}


CLASSES = (SKETCHTOFACE_OT_help, SKETCHTOFACE_OT_log)
