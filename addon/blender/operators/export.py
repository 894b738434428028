"""The buttons that keep a face: for other programs, or for other files of Blender."""

import os
from dataclasses import replace
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from facs_rig import load_rig
from facs_rig.blender.beard_files import moving
from facs_rig.blender.files import not_moving, span_of, write_moving, write_shown_fbx
from facs_rig.blender.hair import curves_of
from facs_rig.blender.pose import armature_of, is_face, show_keys_to_exporters
from facs_rig.blender.shape import left_out, moves, shown
from facs_rig.blender.twin import shown_with
from facs_rig.blender.worn import worn_by
from facs_rig.common.errors import InputError
from facs_rig.common.files import Outputs

from ..background.tasks import InSlices, Steps, Tick, in_background, within
from ..messages import translation
from ..messages.reporting import say
from ..state import faces, preferences

FORMATS = (
    (".glb", "glTF (.glb)", "The posed face with a morph target for every action"),
    (".fbx", "FBX (.fbx)", "The posed face with a shape key for every action"),
    (".obj", "Wavefront (.obj)", "The posed face in quads, for sculpting programs"),
    (".ply", "Stanford (.ply)", "The posed face, coloured"),
    (".blend", "Blender (.blend)", "The face with sliders and bones, to append to other files"),
)
MORPHING = (".glb", ".fbx")  # these can hold morph targets and animations


class SKETCHTOFACE_OT_export(InSlices, faces.OnShownFace, bpy.types.Operator, ExportHelper):
    """Write the face to a file: for other programs, or to be appended in Blender"""

    bl_idname = "sketch_to_face.export"
    bl_label = "Export Face"
    bl_options = {"REGISTER"}
    filename_ext = ".glb"
    filepath: preferences.filepath()
    filter_glob: StringProperty(
        default=";".join(f"*{suffix}" for suffix, *_ in FORMATS), options={"HIDDEN"}
    )
    format: EnumProperty(
        name="Format",
        description="What kind of file",
        items=FORMATS,
        update=lambda given, context: _rename(given),
    )
    names: EnumProperty(
        name="Morph Targets",
        description="What the actions are called in the file",
        items=[
            ("ours", "Sketch to Face", "The 47 controls of this add-on"),
            ("arkit", "ARKit", "The 52 names that live-capture tools know"),
        ],
    )
    animation: BoolProperty(
        name="Animation",
        description="Write a face with keyframes as it moves, its bones and shape keys at "
        "every frame, instead of as it is now",
        default=True,
        options={"SKIP_SAVE"},
    )

    def check(self, context) -> bool:
        """The file browser asks whether the name had to be mended."""
        before = self.filepath
        _rename(self)
        return self.filepath != before

    def draw(self, context):
        """The format, and the names where they count."""
        column = self.layout.column()
        column.prop(self, "format")
        if self.format not in MORPHING:
            return
        moves = span_of(faces.polled_face(context)) is not None
        if moves:
            column.prop(self, "animation")
        if not (moves and self.animation):
            column.prop(self, "names")

    def invoke(self, context, event):
        """The file browser, with the face's name as the file's; then the work in slices."""
        if not self.filepath:
            name = bpy.path.clean_name(faces.polled_face(context).name) + self.format
            self.filepath = preferences.in_folder(context, name)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def steps(self, context):
        """Read the face from Blender, write the file in a thread."""
        face = faces.polled_face(context)
        path = Path(with_ending(_named(self.filepath), self.format, keep=True))
        if not path.parent.is_dir():
            raise InputError(
                translation.text(
                    "There is no folder '{folder}'; choose one that is there.", folder=path.parent
                )
            )
        ending, lost = path.suffix.lower(), []
        if ending == ".blend":
            _write_blend(path, face)
        elif ending in MORPHING and self.animation and span_of(face) is not None:
            with Outputs() as outputs:
                write_moving(outputs.beside(path), face)
            lost = not_moving(face)
        else:
            yield from _write_shown(path, face, self.names)
            lost = left_out(face)
        if lost:
            names = ", ".join(translation.label(name) for name in lost)
            say(self, "WARNING", "Saved {name}; left out: {lost}", name=path.name, lost=names)
        elif ending == ".blend" and shown_with(face):
            say(self, "WARNING", "Saved {name}; with '{mover}', whose sliders move this face",
                name=path.name, mover=shown_with(face))  # fmt: skip
        elif curves_of(face) is not None and ending not in (".blend", ".ply"):
            say(self, "INFO", "Saved {name}; its hair curves are locks there, for only a .blend "
                "can hold curves", name=path.name)  # fmt: skip
        else:
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
    """The absolute path of the file to write; InputError, one sentence, if that is no file."""
    path = bpy.path.abspath(filepath)
    if not path or path.endswith(("/", os.sep)) or os.path.isdir(path):
        raise InputError(
            translation.text("'{path}' names no file; say which one to write.", path=filepath)
        )
    return path


def _write_blend(path: Path, face: bpy.types.Object) -> None:
    """The objects themselves, for File > Append."""
    face.update_from_editmode()
    armature, worn = armature_of(face), worn_by(face)
    for part in worn:
        part.update_from_editmode()
    blocks = {thing for thing in (face, armature, *worn) if thing is not None}
    with Outputs() as outputs:
        bpy.data.libraries.write(str(outputs.beside(path)), blocks, fake_user=True, compress=True)


def _write_shown(path: Path, face: bpy.types.Object, names: str) -> Steps:
    """The face as it is shown now: read from Blender, then written in a thread."""
    rig = load_rig()
    shape = shown(face, rig)
    reading = translation.text("reading the face")
    if path.suffix.lower() in MORPHING:
        found = yield from within(moves(face, rig, shape, names), reading, 0.0, 0.8, 50)
        shape = moving(face, replace(shape, moves=found))
    doing = translation.text("writing {name}", name=path.name)

    def write(_progress) -> None:
        from addon.export import write_shape

        write_shape(path, shape)

    if path.suffix.lower() != ".fbx":
        yield from in_background(write, doing, 0.8)
        return
    yield Tick(doing, 0.8)
    with Outputs() as outputs:
        write_shown_fbx(outputs.beside(path), path.stem, face, shape)


def before_gltf(_settings) -> None:
    """Blender's glTF exporter calls this of add-ons that are on: keyed sliders are shown to it."""
    for face in bpy.data.objects:
        if is_face(face) and face.library is None:
            show_keys_to_exporters(face)


CLASSES = (SKETCHTOFACE_OT_export,)
