"""The buttons of what was read from a sketch: accept, reject, lock, and on which lines it rests."""

import bpy
import bpy.utils.previews
import numpy as np
from bpy.props import EnumProperty, StringProperty

from facs_rig.common.errors import InputError

from ..background import sketching
from ..background.tasks import InSlices, in_background
from ..messages import translation
from ..messages.reporting import reported
from ..state import faces, memory, preferences, properties, sources
from ..state.session import session

PICTURE = 384  # px, side of an evidence picture
DECISIONS = (
    ("ACCEPT", "Accept", "The face does this, however unsure the reading was"),
    ("REJECT", "Reject", "The face does not do this, whatever was read"),
    ("LOCK", "Lock", "Keep it as it is now"),
    ("FREE", "Unlock", "Let the next fit decide"),
)


def item_of(face, name: str):
    """A face's item of an action; InputError if the sketch was not asked for it."""
    item = face.sketch_to_face.detections.get(name)
    if item is None:
        raise InputError(
            translation.text("'{face}' knows of no action '{name}': fit it to a sketch first.",
                             face=face.name, name=name)
        )  # fmt: skip
    return item


class SKETCHTOFACE_OT_decide(faces.OnFace, bpy.types.Operator):
    """Say whether the drawing shows an action; that is kept when the face is fitted again"""

    bl_idname = "sketch_to_face.decide"
    bl_label = "Decide"
    bl_options = {"REGISTER", "UNDO"}
    name: StringProperty(name="Action", description="Name of the control")
    decision: EnumProperty(
        name="Decision",
        description="What is said of the action",
        items=DECISIONS,
        **translation.OWN_CONTEXT,
    )

    @classmethod
    def description(cls, context, properties) -> str:
        """The tooltip of one decision."""
        said = next(text for key, _, text in DECISIONS if key == properties.decision)
        return translation.tip(said)

    def execute(self, context):
        """Write the decision and, where it changes something, the slider."""
        with reported(self) as outcome:
            item = item_of(faces.polled_face(context), self.name)
            if self.decision == "ACCEPT":
                memory.decide(item, memory.worn(item) or item.read or memory.TYPICAL)
            elif self.decision == "REJECT":
                memory.decide(item, 0.0)
            else:
                item.locked = self.decision == "LOCK"
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_unlock_all(faces.OnFace, bpy.types.Operator):
    """Let the next fit decide on every action again"""

    bl_idname = "sketch_to_face.unlock_all"
    bl_label = "Unlock All"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """Take every lock away."""
        for item in faces.polled_face(context).sketch_to_face.detections:
            item.locked = False
        return {"FINISHED"}


class SKETCHTOFACE_OT_evidence(InSlices, faces.OnFace, bpy.types.Operator):
    """Show which lines of the sketch speak for an action (red) and which against it (blue)"""

    bl_idname = "sketch_to_face.evidence"
    bl_label = "Show Evidence"
    bl_options = {"REGISTER"}

    def steps(self, context):
        """Erase the sketch patch by patch, read it each time; keep a picture for every action."""
        face = faces.polled_face(context)
        source = sources.source_of(face.sketch_to_face)
        align = properties.fit_values(context)["align"]
        work = pictures_of(source, align, preferences.of(context).threads)
        made = yield from in_background(work, translation.text("erasing the sketch patch by patch"))
        keep(face.sketch_to_face.mark, made)
        return {"FINISHED"}


def pictures_of(source, align: str | None, threads: int):
    """A function, for a thread: every action's picture (s, s, 4) float32, Blender's way up.

    align : where the head is, as for a fit
    """

    def work(progress):
        from addon.explain import VIEW, coloured
        from addon.placement import head_in
        from classifiers.evidence import evidence
        from classifiers.finding import widened
        from classifiers.plausible import turned
        from classifiers.preprocess import as_page
        from facs_rig.common.images import area_resample

        drawing, _ = source.load()
        head = head_in(drawing, align)
        seen = evidence(drawing.image, sketching.detector(threads), progress, head)
        view = widened(seen.box, VIEW)
        page = as_page(turned(drawing.image, seen.detection.turn))
        ink = area_resample(page, view, PICTURE)
        made = {}
        for name in seen.maps:
            tile = coloured(ink, seen.within(name, view, (PICTURE, PICTURE)))
            rgb = np.asarray(tile, dtype=np.float32)[::-1] / 255
            made[name] = np.dstack([rgb, np.ones(rgb.shape[:2], np.float32)])
        return made

    return work


def keep(mark: str, made: dict) -> None:
    """Remember the pictures of one sketch, and forget those of the one before."""
    session.evidence.clear()
    if session.evidence_icons is not None:
        session.evidence_icons.clear()
    session.evidence[mark] = made


def picture(mark: str, name: str) -> int:
    """Icon of an action's evidence in a sketch of this state; 0 if it was not asked for."""
    made = session.evidence.get(mark)
    if made is None or name not in made or session.evidence_icons is None:
        return 0
    if name not in session.evidence_icons:
        icon = session.evidence_icons.new(name)
        icon.image_size = (PICTURE, PICTURE)
        icon.image_pixels_float[:] = made[name].ravel()
    return session.evidence_icons[name].icon_id


CLASSES = (
    SKETCHTOFACE_OT_decide,
    SKETCHTOFACE_OT_unlock_all,
    SKETCHTOFACE_OT_evidence,
)


def attach() -> None:
    """Make room for pictures."""
    session.evidence_icons = bpy.utils.previews.new()


def detach() -> None:
    """The reverse of attach."""
    bpy.utils.previews.remove(session.evidence_icons)
