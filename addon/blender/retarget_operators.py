"""An expression on any rig: the buttons that put it on the selected meshes, once or as a row."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty

from addon.accepted import SketchError
from addon.storyboard import sketches_in
from facs_rig import FaceParameters
from facs_rig.blender_pose import is_face, pose_of
from facs_rig.blender_retarget import Worn, check_wearer, wear

from . import faces, preferences, sketching
from .work import InSlices, Steps, away

MOST_NAMES = 5  # in a sentence; beyond that nobody reads them


def giver(context) -> bpy.types.Object:
    """The face whose expression is given to others: the active one, else the only one selected,
    else the one that was made of a sketch last, else the only one. ValueError if that is none."""
    active = faces.active_face(context)
    selected = [o for o in context.selected_objects if is_face(o)]
    present = [o for o in context.scene.objects if is_face(o)]
    fitted = sorted(
        (o for o in present if o.sketch_to_face.number), key=lambda o: o.sketch_to_face.number
    )
    for choice in ([active] if active else [], selected, fitted[-1:], present):
        if len(choice) == 1:
            return choice[0]
    raise ValueError(
        "it is not clear which face gives the expression: select it too, or take the expression "
        "from the sketch"
        if present
        else "there is no face to take the expression from: make one, or take it from the sketch"
    )


def wearers(context, source: bpy.types.Object | None = None) -> list[bpy.types.Object]:
    """The selected meshes but `source`, one of each that share their shape keys."""
    chosen = {}
    for mesh in context.selected_objects:
        if mesh.type == "MESH" and mesh != source:
            chosen.setdefault(mesh.name if is_face(mesh) else mesh.data.name_full, mesh)
    if not chosen:
        besides = f" besides '{source.name}'" if source else ""
        raise ValueError(f"select the meshes that are to wear the expression{besides}")
    return list(chosen.values())


def some(names: Iterable[str]) -> str:
    """The names as they stand in a sentence, the first few of many."""
    names = list(names)
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def outcome_of(worn: Mapping[str, Worn], failed: Mapping[str, str]) -> str:
    """One sentence: what was set on which mesh, what no mesh could show, what was left out."""
    parts = [f"{name} ({w.label}, {w.keys} keys)" for name, w in worn.items()]
    said = f"Expression applied to {some(parts)}"
    lost = [name for name in next(iter(worn.values())).unshown
            if all(name in w.unshown for w in worn.values())]  # fmt: skip
    if lost:
        said += f"; no key was found for {some(lost)}"
    driven = dict.fromkeys(key for w in worn.values() for key in w.driven)
    if driven:
        said += f"; driven by something else: {some(driven)}"
    return "; ".join([said, *failed.values()])


class OnMeshes:
    """An operator that needs selected meshes, in Object Mode: its undo covers shape keys."""

    @classmethod
    def poll(cls, context):
        """A mesh must be selected."""
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first")
            return False
        if not any(o.type == "MESH" for o in context.selected_objects):
            cls.poll_message_set("Select the meshes that are to wear the expression")
            return False
        return True


class SKETCHTOFACE_OT_apply_expression(InSlices, OnMeshes, bpy.types.Operator):
    """Put an expression on the selected meshes, whatever convention their shape keys follow"""

    bl_idname = "sketch_to_face.apply_expression"
    bl_label = "Apply Expression to Selected"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "source": EnumProperty(
            name="From",
            items=[
                ("FACE", "Face", "The sliders of the active face, or of the one made last"),
                ("SKETCH", "Sketch", "What is drawn in the chosen sketch; no face is built"),
            ],
        ),
        "keyframes": BoolProperty(
            name="Insert Keyframes",
            description="Key every shape key that is set, at the current frame",
        ),
    }

    def steps(self, context):
        """Read the expression, put it on each mesh, say what was not found."""
        worn, failed = {}, {}
        source = giver(context) if self.source == "FACE" else None
        meshes = [mesh.name for mesh in wearers(context, source)]
        if source is not None:
            aus = pose_of(source).aus
        else:
            read = sketching.expression(context, context.scene.sketch_to_face)
            aus = (yield from away(read, "reading the sketch")).aus
        for name in meshes:
            try:
                frame = context.scene.frame_current if self.keyframes else None
                worn[name] = wear(bpy.data.objects[name], FaceParameters(aus), frame=frame)
            except ValueError as error:
                failed[name] = str(error)
        if not worn:
            raise ValueError("; ".join(failed.values()))
        lost = failed or any(w.unshown or w.driven for w in worn.values())
        self.report({"WARNING" if lost else "INFO"}, outcome_of(worn, failed))
        return {"FINISHED"}


class Storyboard:
    """A row of key poses in the making: one sketch a step, on the meshes of these names."""

    def __init__(self, context, turn: bool) -> None:
        settings = context.scene.sketch_to_face
        if not settings.storyboard.strip():
            raise ValueError("no folder is chosen: pick the one that your sketches are in")
        folder = Path(bpy.path.abspath(settings.storyboard)).expanduser()
        self.sketches = sketches_in(folder)
        self.first, self.every = context.scene.frame_current, settings.storyboard_every
        self.turn = turn
        self.names: list[str] = []
        self.troubles: list[str] = []
        for mesh in wearers(context):
            try:
                check_wearer(mesh)
                self.names.append(mesh.name)
            except ValueError as error:
                self.troubles.append(str(error))
        if not self.names:
            raise ValueError("; ".join(self.troubles))
        self.done = 0
        self.keyed: list[int] = []  # frames
        self.bad: list[str] = []  # names of files

    @property
    def remaining(self) -> int:
        """How many sketches are still to be read."""
        return len(self.sketches) - self.done

    def step(self, threads: int) -> Steps:
        """Read the next sketch and key it; one that cannot be read keeps its place empty."""
        path, frame = self.sketches[self.done], self.first + self.done * self.every

        def read(_progress):
            from addon import pipeline

            return pipeline.read_expression(path, detector=sketching.detector(threads))

        text = f"{self.done + 1} of {len(self.sketches)}, {path.name}"
        share = 1 / len(self.sketches)
        try:
            pose = yield from away(read, text, self.done * share, (self.done + 1) * share)
        except SketchError as error:
            self.done += 1
            self.bad.append(path.name)
            self.troubles.append(str(error))
            return
        self.done += 1
        for name in self.names:
            wear(bpy.data.objects[name], pose, frame=frame, turn=self.turn)
        self.keyed.append(frame)

    def sentence(self) -> str:
        """What was keyed where, and what was left out."""
        count, frames = len(self.keyed), f"frames {self.keyed[0]} to {self.keyed[-1]}"
        said = f"{count} key poses on {some(self.names)}, {frames}"
        if count == 1:
            said = f"1 key pose on {some(self.names)}, frame {self.keyed[0]}"
        if self.remaining:
            said += f"; stopped after {self.done} of {len(self.sketches)} sketches"
        return said + (f"; left out {some(self.bad)}" if self.bad else "")


class SKETCHTOFACE_OT_storyboard(InSlices, OnMeshes, bpy.types.Operator):
    """Make each sketch of the folder a key pose of the selected faces or meshes, from the current
    frame on"""

    bl_idname = "sketch_to_face.storyboard"
    bl_label = "Storyboard"
    bl_options = {"REGISTER", "UNDO"}
    __annotations__ = {
        "head": BoolProperty(
            name="Head and Neck",
            description="Turn the head of faces that Sketch to Face made too",
            default=True,
            options={"SKIP_SAVE"},
        ),
    }

    def steps(self, context):
        """One sketch after the other."""
        self._job = Storyboard(context, self.head)
        threads = preferences.of(context).threads
        while self._job.remaining:
            yield from self._job.step(threads)
        return self._end(context)

    def stopped(self, context):
        """What is done stays."""
        return self._end(context)

    def _end(self, context):
        """Show the frame that was shown, say what came of it."""
        job = self._job
        for trouble in job.troubles:
            self.report({"WARNING"}, trouble)
        if job.keyed:
            context.scene.frame_set(job.first)
            self.report({"WARNING" if job.troubles or job.remaining else "INFO"}, job.sentence())
            return {"FINISHED"}
        if job.bad:
            self.report({"ERROR"}, f"None of the sketches could be read: {job.troubles[-1]}")
        return {"CANCELLED"}


CLASSES = (SKETCHTOFACE_OT_apply_expression, SKETCHTOFACE_OT_storyboard)
