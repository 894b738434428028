"""The panels of a sketch's face: what was detected, how it is fitted, what came of it."""

import bpy

from facs_rig import CONTROLS
from facs_rig.blender.beard import beard_of
from facs_rig.fitted_keys import FITTED
from snakes import LINE_TWEAKABLES, LINES_ALONE

from ..messages import translation
from ..operators import beard, detect, export, expression, pins, sketch
from ..state import faces, memory, properties, sources
from ..state.session import session
from .hair import draw_hair
from .presets import SKETCHTOFACE_PT_presets
from .tab import Tab

LABELS = {control.name: control.label for control in CONTROLS}
LIKELY = 0.2  # actions that are less likely are shown on request
_decide = detect.SKETCHTOFACE_OT_decide.bl_idname


class OfSketch(Tab):
    """A panel that shows only while a face is active that was made of a sketch."""

    @classmethod
    def poll(cls, context):
        """Nothing was read for a face that was just added."""
        face = faces.active_face(context)
        return face is not None and bool(face.sketch_to_face.number) and not faces.trouble(face)


def shown_first(items, every: bool, named: str) -> tuple[list[bool], list[int]]:
    """Which actions a list shows, and the place of each: those the face does, then the likeliest.

    items : detections;  every : also those that are neither done, locked nor likely
    named : only those whose label, in the artist's language, has this in it
    """
    order = sorted(range(len(items)), key=lambda k: (not items[k].active, -items[k].probability))
    places = [0] * len(items)
    for place, k in enumerate(order):
        places[k] = place
    show = [
        (every or item.active or item.locked or item.probability >= LIKELY)
        and named.lower() in translation.label(LABELS.get(item.name, item.name)).lower()
        for item in items
    ]
    return show, places


class SKETCHTOFACE_UL_detections(bpy.types.UIList):
    """The actions that were read, the surest first."""

    every: bpy.props.BoolProperty(
        name="Every Action", description="Show also what was hardly seen", default=False
    )

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        """Tick, name, how likely, lock."""
        row = layout.row(align=True)
        row.prop(item, "active", text="")
        split = row.split(factor=0.58, align=True)
        split.label(text=LABELS.get(item.name, item.name))
        split.active = item.active or item.probability >= LIKELY
        if hasattr(split, "progress"):  # Blender 4.0 and newer
            split.progress(factor=item.probability, text=f"{item.probability:.0%}")
        else:
            bar = split.row()
            bar.enabled = False
            bar.prop(item, "probability", text="", slider=True)
        row.prop(item, "locked", text="", emboss=False,
                 icon="LOCKED" if item.locked else "UNLOCKED")  # fmt: skip

    def draw_filter(self, context, layout):
        """Search by name, and the unlikely ones."""
        row = layout.row(align=True)
        row.prop(self, "filter_name", text="", icon="VIEWZOOM")
        row.prop(self, "every", text="", icon="HIDE_OFF")

    def filter_items(self, context, data, name):
        """Blender's flags and order."""
        show, places = shown_first(list(getattr(data, name)), self.every, self.filter_name)
        return [self.bitflag_filter_item if shown else 0 for shown in show], places


class SKETCHTOFACE_PT_detect(OfSketch, bpy.types.Panel):
    """What was read from the sketch, to be accepted, corrected, rejected, locked."""

    bl_idname = "SKETCHTOFACE_PT_detect"
    bl_label = "Detect"
    bl_order = 1
    page = "detect"

    def draw(self, context):
        """The list, then the chosen action with its strength, its verdicts and its evidence."""
        memory_of = faces.polled_face(context).sketch_to_face
        column = self.layout.column()
        column.template_list("SKETCHTOFACE_UL_detections", "", memory_of, "detections", memory_of,
                             "shown", rows=6)  # fmt: skip
        if not 0 <= memory_of.shown < len(memory_of.detections):
            return
        item = memory_of.detections[memory_of.shown]
        column = self.layout.column(align=True)
        column.prop(item, "intensity", text=LABELS.get(item.name, item.name), slider=True)
        row = column.row(align=True)
        for decision, icon, pressed in (
            ("ACCEPT", "CHECKMARK", item.locked and item.active),
            ("REJECT", "X", item.locked and not item.active),
            ("FREE" if item.locked else "LOCK", "LOCKED" if item.locked else "UNLOCKED", False),
        ):
            text = next(name for key, name, _ in detect.DECISIONS if key == decision)
            text = "" if decision in ("LOCK", "FREE") else text  # its icon says it
            button = row.operator(_decide, text=text, text_ctxt=translation.OWN, icon=icon,
                                  depress=pressed)  # fmt: skip
            button.name, button.decision = item.name, decision
        evidence = detect.picture(memory_of.mark, item.name)
        if evidence:
            self.layout.template_icon(icon_value=evidence, scale=9.0)
            self.layout.label(text="Red speaks for it, blue against it")
        else:
            self.layout.operator(detect.SKETCHTOFACE_OT_evidence.bl_idname, icon="ZOOM_ALL")
        if any(item.locked for item in memory_of.detections):
            self.layout.operator(detect.SKETCHTOFACE_OT_unlock_all.bl_idname, icon="UNLOCKED")


class SKETCHTOFACE_PT_fit(Tab, bpy.types.Panel):
    """How the face is brought to the drawing."""

    bl_idname = "SKETCHTOFACE_PT_fit"
    bl_label = "Fit"
    bl_translation_context = translation.OWN
    bl_order = 2
    page = "fit"

    def draw(self, context):
        """Method, exaggeration, symmetry, where the head is; for a face its pins and Fit Again."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.sketch_to_face
        column = layout.column()
        column.prop(settings, "method")
        column.prop(settings, "exaggerate")
        if settings.method != "thesis":
            column.prop(settings, "hair")
            column.prop(settings, "beard")
        ticks = column.column(align=True)
        ticks.use_property_split = False  # the words beside a tick need the whole width
        if settings.method != "shape":
            ticks.prop(settings.tweakables, "mirror")
        ticks.prop(settings, "place_head")
        if settings.place_head:
            for index, side in enumerate(("Left", "Top", "Right", "Bottom")):
                column.prop(settings, "head_box", index=index, text=side)
        face = faces.active_face(context)
        if face is not None and face.sketch_to_face.number and not faces.trouble(face):
            self._of_face(face)

    def _of_face(self, face):
        memory_of = face.sketch_to_face
        layout = self.layout
        row = layout.row(align=True)
        row.operator(pins.SKETCHTOFACE_OT_drag_pins.bl_idname, icon="PINNED")
        unpin = pins.SKETCHTOFACE_OT_unpin.bl_idname
        if len(memory_of.pins):
            row.operator(unpin, text="", icon="X").name = ""
            column = layout.column(align=True)
            for pin in memory_of.pins:
                row = column.row(align=True)
                row.prop(pin, "place", text=pin.name.replace("_", " ").capitalize())
                row.operator(unpin, text="", icon="REMOVE", emboss=False).name = pin.name
        column = layout.column()
        column.scale_y = 1.3
        row = column.row(align=True)
        row.operator(sketch.SKETCHTOFACE_OT_fit_again.bl_idname, icon="FILE_REFRESH")
        row.prop(memory_of, "live", text="", icon="RADIOBUT_ON", toggle=True)
        trouble = session.troubles.get(face.name) if memory_of.live else None
        if trouble:
            layout.label(text=trouble, icon="ERROR")
        if not sources.same(memory_of, bpy.context.scene.sketch_to_face):
            layout.operator(sketch.SKETCHTOFACE_OT_adopt_sketch.bl_idname)


class SKETCHTOFACE_PT_tweakables(Tab, bpy.types.Panel):
    """The thesis' table, folded away."""

    bl_idname = "SKETCHTOFACE_PT_tweakables"
    bl_parent_id = SKETCHTOFACE_PT_fit.bl_idname
    bl_label = "Tweakables"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, context):
        """Blender's list of presets."""
        SKETCHTOFACE_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        """One row each, then the defaults button."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.sketch_to_face
        column = layout.column()
        group = settings.tweakables
        for name in properties.SKETCHTOFACE_PG_tweakables.__annotations__:
            used = (
                name in LINE_TWEAKABLES if settings.method == "lines" else name not in LINES_ALONE
            )
            if name != "mirror" and used and settings.method != "shape":
                column.prop(group, name)
        layout.operator(sketch.SKETCHTOFACE_OT_default_tweakables.bl_idname, icon="LOOP_BACK")


def draw_beard(layout, face) -> None:
    """The colour of a beard, and which one it is."""
    column = layout.column(align=True)
    worn = beard_of(face) is not None
    if worn:
        column.prop(face.sketch_to_face, "beard_colour")
    row = column.row(align=True)
    make = beard.SKETCHTOFACE_OT_beard.bl_idname
    row.operator_menu_enum(make, "kind", text="Beard", text_ctxt=translation.OWN)
    if worn:
        row.operator(make, text="", icon="X").kind = "NONE"


class SKETCHTOFACE_PT_result(OfSketch, bpy.types.Panel):
    """How near the face came, what to do with the rest, where it goes."""

    bl_idname = "SKETCHTOFACE_PT_result"
    bl_label = "Result"
    bl_order = 3
    page = "result"

    def draw(self, context):
        """Overlay and distances, the fitted key, strokes without a place, files."""
        face, settings = faces.polled_face(context), context.scene.sketch_to_face
        column = self.layout.column()
        column.prop(settings, "overlay", icon="OVERLAY", toggle=True)
        if settings.overlay:
            column.label(text="Dark the sketch, red the face,")
            column.label(text="blue what has no place on it")
        template, _, fitted = face.sketch_to_face.contour_error_px
        said = translation.label("Lines {fitted:.1f} px apart, {template:.1f} before",
                                 fitted=fitted, template=template)  # fmt: skip
        column.label(text=said)
        key = face.data.shape_keys.key_blocks.get(FITTED)
        if key is not None:
            column.prop(key, "value", text="Fitted Details", slider=True)
        column.prop(face.sketch_to_face, "caricature", slider=True)
        draw_hair(self.layout, face)
        draw_beard(self.layout, face)
        column = self.layout.column(align=True)
        lost = len(memory.unpack(face.get(memory.LOST)))
        column.label(text=translation.label("Strokes without a place: {count}", count=lost))
        row = column.row(align=True)
        row.prop(settings, "strokes", expand=True)
        if settings.strokes != "ignore":
            for name in ("stroke_profile", "stroke_depth", "stroke_width"):
                column.prop(settings, name)
        if settings.strokes != "ignore" or settings.strokes != face.sketch_to_face.strokes:
            column.operator(sketch.SKETCHTOFACE_OT_fit_again.bl_idname, icon="FILE_REFRESH")
        row = self.layout.row(align=True)
        row.operator(expression.SKETCHTOFACE_OT_save_expression.bl_idname,
                     icon="FILE_TICK")  # fmt: skip
        row.operator(export.SKETCHTOFACE_OT_export.bl_idname, text="Export",
                     icon="EXPORT")  # fmt: skip


CLASSES = (
    SKETCHTOFACE_UL_detections,
    SKETCHTOFACE_PT_detect,
    SKETCHTOFACE_PT_fit,
    SKETCHTOFACE_PT_tweakables,
    SKETCHTOFACE_PT_result,
)
