"""The buttons that keep a face: for other programs, or for other files of Blender."""

import os
from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from facs_rig.blender_pose import armature_of, check_face, pose_of
from facs_rig.blender_reshape import fitted_offsets

from . import faces, preferences, translation
from .reporting import say
from .work import InSlices, away

FORMATS = (
    (".glb", "glTF (.glb)", "The posed face with a morph target for every action"),
    (".obj", "Wavefront (.obj)", "The posed face in quads, for sculpting programs"),
    (".ply", "Stanford (.ply)", "The posed face, coloured"),
    (".blend", "Blender (.blend)", "The face with sliders and bones, to append to other files"),
)


class SKETCHTOFACE_OT_export(InSlices, faces.OnFace, bpy.types.Operator, ExportHelper):
    """Write the face to a file: for other programs, or to be appended in Blender"""

    bl_idname = "sketch_to_face.export"
    bl_label = "Export Face"
    bl_options = {"REGISTER"}
    filename_ext = ".glb"
    __annotations__ = {
        "filepath": preferences.filepath(),
        "filter_glob": StringProperty(
            default=";".join(f"*{suffix}" for suffix, *_ in FORMATS), options={"HIDDEN"}
        ),
        "format": EnumProperty(
            name="Format",
            description="What kind of file",
            items=FORMATS,
            update=lambda given, context: _rename(given),
        ),
        "names": EnumProperty(
            name="Morph Targets",
            description="What the actions are called in a glTF file",
            items=[
                ("ours", "Sketch to Face", "The 47 controls of this add-on"),
                ("arkit", "ARKit", "The 52 names that live-capture tools know"),
            ],
        ),
    }

    def check(self, context) -> bool:
        """The file browser asks whether the name had to be mended."""
        before = self.filepath
        _rename(self)
        return self.filepath != before

    def draw(self, context):
        """The format, and the names where they count."""
        column = self.layout.column()
        column.prop(self, "format")
        if self.format == ".glb":
            column.prop(self, "names")

    def invoke(self, context, event):
        """The file browser, with the face's name as the file's; then the work in slices."""
        if not self.filepath:
            name = bpy.path.clean_name(faces.active_face(context).name) + self.format
            self.filepath = preferences.in_folder(context, name)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def steps(self, context):
        """Read the face from Blender, write the file in a thread."""
        face = faces.active_face(context)
        check_face(face)
        path = Path(with_ending(_named(self.filepath), self.format, keep=True))
        if not path.parent.is_dir():
            raise ValueError(
                translation.text(
                    "There is no folder '{folder}'; choose one that is there.", folder=path.parent
                )
            )
        if path.suffix.lower() == ".blend":
            armature = armature_of(face)
            blocks = {face, armature} if armature else {face}
            bpy.data.libraries.write(str(path), blocks, fake_user=True)
        else:
            doing = translation.text("writing {name}", name=path.name)
            yield from away(_writer(path, face, self.names), doing)
        say(self, "INFO", "Saved {name}", name=path.name)
        return {"FINISHED"}


def _rename(given) -> None:
    """The file's ending follows the format.

    given : the operator or, while a script or the file browser sets them, its properties alone
    """
    if given.filepath:
        given.filepath = with_ending(given.filepath, given.format)


def with_ending(path: str, ending: str, *, keep: bool = False) -> str:
    """The path with that ending instead of one that we write; `keep` that if it has one."""
    stem, dot, last = path.rpartition(".")
    if dot and stem and f".{last.lower()}" in {suffix for suffix, *_ in FORMATS}:
        return path if keep else stem + ending
    return path + ending if path[-1:] not in ("", "/", os.sep) else path


def _named(filepath: str) -> str:
    """The absolute path of the file to write; ValueError, one sentence, if that is no file."""
    path = bpy.path.abspath(filepath)
    if not path or path.endswith(("/", os.sep)) or os.path.isdir(path):
        raise ValueError(
            translation.text("'{path}' names no file; say which one to write.", path=filepath)
        )
    return path


def _writer(path: Path, face: bpy.types.Object, names: str):
    """A function, for a thread, that writes a face as it is now."""
    parameters, offsets = pose_of(face), fitted_offsets(face)
    fitted = face.data.shape_keys.key_blocks.get("Fitted")
    if offsets is not None and fitted is not None:
        offsets = offsets * fitted.value

    def write(progress):
        from addon.export import write_mesh
        from facs_rig import load_rig

        write_mesh(path, load_rig(), parameters, offsets, names=names, progress=progress)

    return write


CLASSES = (SKETCHTOFACE_OT_export,)
