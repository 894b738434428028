"""An expression on any rig: the buttons that put it on the selected meshes, once or as a row."""

from collections.abc import Iterable, Mapping
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty

from addon.storyboard import sketches_in
from facs_rig import FaceParameters
from facs_rig.blender.pose import is_face, pose_of
from facs_rig.blender.retarget import Worn, check_wearer, wear
from facs_rig.common.errors import InputError

from ..background import sketching
from ..background.tasks import InSlices, Steps, in_background
from ..messages import translation
from ..messages.reporting import say
from ..state import faces, preferences

MOST_NAMES = 5  # in a sentence; beyond that nobody reads them


def giver(context) -> bpy.types.Object:
    """The face whose expression is given to others: the active one, else the only one selected,
    else the one that was made of a sketch last, else the only one. InputError if that is none."""
    active = faces.active_face(context)
    selected = [o for o in faces.selected_objects(context) if is_face(o)]
    present = [o for o in context.scene.objects if is_face(o)]
    fitted = sorted(
        (o for o in present if o.sketch_to_face.number), key=lambda o: o.sketch_to_face.number
    )
    for choice in ([active] if active else [], selected, fitted[-1:], present):
        if len(choice) == 1:
            return choice[0]
    if present:
        raise InputError(
            translation.text(
                "it is not clear which face gives the expression: select it too, or take the "
                "expression from the sketch"
            )
        )
    raise InputError(
        translation.text(
            "there is no face to take the expression from: make one, or take it from the sketch"
        )
    )


def wearers(context, source: bpy.types.Object | None = None) -> list[bpy.types.Object]:
    """The selected meshes but `source`, one of each that share their shape keys."""
    chosen: dict[str, bpy.types.Object] = {}
    for mesh in faces.selected_objects(context):
        if mesh.type == "MESH" and mesh != source:
            chosen.setdefault(mesh.name if is_face(mesh) else mesh.data.name_full, mesh)
    if not chosen:
        if source is None:
            raise InputError(translation.text("select the meshes that are to wear the expression"))
        raise InputError(
            translation.text(
                "select the meshes that are to wear the expression besides '{name}'",
                name=source.name,
            )
        )
    return list(chosen.values())


def some(names: Iterable[str]) -> str:
    """The names as they stand in a sentence, the first few of many."""
    names = list(names)
    more, first = len(names) - MOST_NAMES, ", ".join(names[:MOST_NAMES])
    if more <= 0:
        return first
    return translation.text("{names} and {more} more", names=first, more=more)


def outcome_of(worn: Mapping[str, Worn], failed: Mapping[str, str]) -> str:
    """One sentence: what was set on which mesh, what no mesh could show, what was left out."""
    parts = [
        translation.text("{name} ({convention}, {keys} keys)",
                         name=name, convention=w.label, keys=w.keys)
        for name, w in worn.items()
    ]  # fmt: skip
    said = [translation.text("Expression applied to {names}", names=some(parts))]
    lost = [name for name in next(iter(worn.values())).unshown
            if all(name in w.unshown for w in worn.values())]  # fmt: skip
    if lost:
        said.append(translation.text("no key was found for {names}", names=some(lost)))
    driven = dict.fromkeys(key for w in worn.values() for key in w.driven)
    if driven:
        said.append(translation.text("driven by something else: {names}", names=some(driven)))
    return "; ".join([*said, *failed.values()])


class OnMeshes(faces.Mixin):
    """An operator that needs selected meshes, in Object Mode: its undo covers shape keys."""

    @classmethod
    def poll(cls, context):
        """A mesh must be selected."""
        if context.mode != "OBJECT":
            cls.poll_message_set(translation.tip("Go to Object Mode first"))
            return False
        if not any(o.type == "MESH" for o in faces.selected_objects(context)):
            cls.poll_message_set(
                translation.tip("Select the meshes that are to wear the expression")
            )
            return False
        return True


class SKETCHTOFACE_OT_apply_expression(InSlices, OnMeshes, bpy.types.Operator):
    """Put an expression on the selected meshes, whatever convention their shape keys follow"""

    bl_idname = "sketch_to_face.apply_expression"
    bl_label = "Apply Expression to Selected"
    bl_options = {"REGISTER", "UNDO"}
    source: EnumProperty(
        name="From",
        description="Whose expression it is",
        **translation.OWN_CONTEXT,
        items=[
            ("FACE", "Face", "The sliders of the active face, or of the one made last"),
            ("SKETCH", "Sketch", "What is drawn in the chosen sketch; no face is built"),
        ],
    )
    keyframes: BoolProperty(
        name="Insert Keyframes",
        description="Key every shape key that is set, at the current frame",
    )

    def steps(self, context):
        """Read the expression, put it on each mesh, say what was not found."""
        worn, failed = {}, {}
        source = giver(context) if self.source == "FACE" else None
        meshes = [mesh.name for mesh in wearers(context, source)]
        if source is not None:
            aus = pose_of(source).aus
        else:
            read = sketching.expression(context, context.scene.sketch_to_face)
            aus = (yield from in_background(read, translation.text("reading the sketch"))).aus
        for name in meshes:
            try:
                frame = context.scene.frame_current if self.keyframes else None
                worn[name] = wear(bpy.data.objects[name], FaceParameters(aus), frame=frame)
            except InputError as error:
                failed[name] = str(error)
        if not worn:
            raise InputError("; ".join(failed.values()))
        lost = failed or any(w.unshown or w.driven for w in worn.values())
        self.report({"WARNING" if lost else "INFO"}, outcome_of(worn, failed))
        return {"FINISHED"}


class Storyboard:
    """A row of key poses in the making: one sketch a step, on the meshes of these names."""

    def __init__(self, context, turn: bool) -> None:
        settings = context.scene.sketch_to_face
        if not settings.storyboard.strip():
            raise InputError(
                translation.text("no folder is chosen: pick the one that your sketches are in")
            )
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
            except InputError as error:
                self.troubles.append(str(error))
        if not self.names:
            raise InputError("; ".join(self.troubles))
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

        total = len(self.sketches)
        text = translation.text("{number} of {total}, {name}",
                                number=self.done + 1, total=total, name=path.name)  # fmt: skip
        share = 1 / total
        try:
            pose = yield from in_background(read, text, self.done * share, (self.done + 1) * share)
        except InputError as error:
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
        first, last, names = self.keyed[0], self.keyed[-1], some(self.names)
        if len(self.keyed) == 1:
            said = [translation.text("1 key pose on {names}, frame {frame}",
                                     names=names, frame=first)]  # fmt: skip
        else:
            said = [translation.text("{count} key poses on {names}, frames {first} to {last}",
                                     count=len(self.keyed), names=names,
                                     first=first, last=last)]  # fmt: skip
        if self.remaining:
            said.append(translation.text("stopped after {done} of {total} sketches",
                                         done=self.done, total=len(self.sketches)))  # fmt: skip
        if self.bad:
            said.append(translation.text("left out {names}", names=some(self.bad)))
        return "; ".join(said)


class SKETCHTOFACE_OT_storyboard(InSlices, OnMeshes, bpy.types.Operator):
    """A folder of sketches as a row of key poses."""

    bl_idname = "sketch_to_face.storyboard"
    bl_label = "Storyboard"
    # The docstring would bring its line break into the tooltip.
    bl_description = (
        "Make each sketch of the folder a key pose of the selected faces or meshes, from the "
        "current frame on"
    )
    bl_options = {"REGISTER", "UNDO"}
    head: BoolProperty(
        name="Head and Neck",
        description="Turn the head of faces that Sketch to Face made too",
        default=True,
        options={"SKIP_SAVE"},
    )

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
            say(self, "ERROR", "None of the sketches could be read: {trouble}",
                trouble=job.troubles[-1])  # fmt: skip
        return {"CANCELLED"}


CLASSES = (SKETCHTOFACE_OT_apply_expression, SKETCHTOFACE_OT_storyboard)
