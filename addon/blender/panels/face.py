"""The panels of a face: expression by thirds, head and eyes, who it is."""

import bpy

from facs_rig import CONTROLS, IDENTITY, Control, Feature, folds
from facs_rig.blender.armature import HEAD, NECK, ORDER
from facs_rig.blender.keys import GAZE
from facs_rig.blender.pose import armature_of

from ..messages import translation
from ..operators import expression, people
from ..state import faces
from .tab import Tab

REGIONS = {"upper": "Upper Face", "mid": "Middle Face", "lower": "Lower Face"}
CHARACTER = "character"
# Folder of the modelling targets -> what the group of sliders is called.
GROUPS = {CHARACTER: "Character", "head": "Head", "forehead": "Forehead", "eyebrows": "Brows",
          "eyes": "Eyes", "nose": "Nose", "mouth": "Mouth", "cheek": "Cheeks",
          "chin": "Chin and Jaw", "ears": "Ears", "neck": "Neck",
          "asym": "Left and Right", "actions": "Own Ways", "colours": "Colors"}  # fmt: skip
WRINKLES, PATTERN = "wrinkles", folds.SEED
# Family of creases -> what the group of its sliders is called.
CREASE_GROUPS = {name: label.title().replace("'S", "'s")
                 for name, (label, _) in folds.FAMILIES.items()}  # fmt: skip
# Title and the bone's axis: an upright bone has the core's axes (see facs_rig.blender.armature).
AXES = (("Turn", 1), ("Nod", 0), ("Tilt", 2))


def slider_rows(region: str) -> list[tuple[Control | None, Control | None, Control | None]]:
    """The controls of a third of the face as rows: (of both sides, right, left).

    A row's right and left belong to the action before; without one they stand alone. Right comes
    first: the face's own right is on the left of who looks at it.
    """
    controls = {c.name: c for c in CONTROLS if c.region == region}
    rows: list[tuple[Control | None, Control | None, Control | None]] = []
    for name, control in controls.items():
        if control.side == "both":
            rows.append((control, controls.get(f"{name}_right"), controls.get(f"{name}_left")))
            continue
        action = name.removesuffix(f"_{control.side}")
        if action not in controls and control.side == "left":
            rows.append((None, controls.get(f"{action}_right"), control))
    return rows


def identity_groups() -> dict[str, list[Feature]]:
    """Group -> its identity parameters, but for creases, which have their own panels."""
    groups: dict[str, list[Feature]] = {group: [] for group in GROUPS}
    for feature in IDENTITY:
        if feature.name not in (WRINKLES, *folds.PARAMETERS):
            groups[feature.part or CHARACTER].append(feature)
    return groups


class OfFace(Tab):
    """A panel that shows only while a face is active that can be posed."""

    @classmethod
    def poll(cls, context):
        """Nothing to show without a face."""
        face = faces.active_face(context)
        return face is not None and not faces.trouble(face)


def _slider(layout, face, name: str, text: str) -> None:
    layout.prop(face, f'["{name}"]', text=text, slider=True)


class SKETCHTOFACE_PT_face(Tab, bpy.types.Panel):
    """What can be done with the expression as a whole."""

    bl_idname = "SKETCHTOFACE_PT_face"
    bl_label = "Expression"
    bl_order = 4
    page = "expression"

    @classmethod
    def poll(cls, context):
        """Nothing to show without a face."""
        return faces.active_face(context) is not None

    def draw(self, context):
        """The buttons, or what is wrong with the face."""
        face = faces.polled_face(context)
        trouble = faces.trouble(face)
        if trouble:
            column = self.layout.column(align=True)
            column.label(text="This face cannot be posed.", icon="ERROR")
            for part in trouble.split("; "):
                column.label(text=part)
            operator = people.SKETCHTOFACE_OT_stand_alone
            if operator.poll(context):
                column.operator(operator.bl_idname, icon="DUPLICATE")
            return
        column = self.layout.column(align=True)
        row = column.row(align=True)
        row.operator(expression.SKETCHTOFACE_OT_copy_expression.bl_idname, text="Copy",
                     icon="COPYDOWN")  # fmt: skip
        row.operator(expression.SKETCHTOFACE_OT_paste_expression.bl_idname, text="Paste",
                     icon="PASTEDOWN")  # fmt: skip
        row = column.row(align=True)
        row.operator(expression.SKETCHTOFACE_OT_load_expression.bl_idname, text="Load",
                     text_ctxt=translation.OWN, icon="FILE_FOLDER")  # fmt: skip
        row.operator(expression.SKETCHTOFACE_OT_save_expression.bl_idname, text="Save",
                     icon="FILE_TICK")  # fmt: skip
        row = column.row(align=True)
        row.operator(expression.SKETCHTOFACE_OT_random_expression.bl_idname, text="Random",
                     icon="MOD_NOISE")  # fmt: skip
        row.operator(expression.SKETCHTOFACE_OT_mirror_expression.bl_idname, text="Mirror",
                     icon="MOD_MIRROR")  # fmt: skip
        reset = expression.SKETCHTOFACE_OT_reset_sliders.bl_idname
        row = column.row(align=True)
        row.operator(reset, text="Neutral", icon="LOOP_BACK").to = "NEUTRAL"
        if len(face.sketch_to_face.expression):
            row.operator(reset, text="As Drawn").to = "SKETCH"
        row.operator(expression.SKETCHTOFACE_OT_key_expression.bl_idname, text="Key",
                     icon="KEY_HLT")  # fmt: skip
        self.layout.prop(context.scene.sketch_to_face, "one_sided")


def _region_panel(region: str, label: str) -> type:
    """The sub-panel with the sliders of one third of the face."""
    rows = slider_rows(region)

    def draw(self, context):
        face = faces.polled_face(context)
        sides = context.scene.sketch_to_face.one_sided
        column = self.layout.column(align=True)
        for both, right, left in rows:
            pair = [control for control in (right, left) if control is not None]
            if both is None:
                for control in pair:
                    _slider(column, face, control.name, control.label)
                continue
            _slider(column, face, both.name, both.label)
            if pair and sides:
                row = column.row(align=True)
                row.separator(factor=2.0)
                for letter, control in zip("RL", pair, strict=True):
                    _slider(row, face, control.name, letter)
                column.separator(factor=0.5)

    return type(
        f"SKETCHTOFACE_PT_{region}",
        (OfFace, bpy.types.Panel),
        {
            "__doc__": f"Sliders of the {label.lower()}.",
            "bl_idname": f"SKETCHTOFACE_PT_{region}",
            "bl_parent_id": SKETCHTOFACE_PT_face.bl_idname,
            "bl_label": label,
            "draw": draw,
        },
    )


class SKETCHTOFACE_PT_head(OfFace, bpy.types.Panel):
    """Where the face turns and looks."""

    bl_idname = "SKETCHTOFACE_PT_head"
    bl_label = "Head and Eyes"
    bl_order = 5

    def draw(self, context):
        """Gaze, head and neck, in degrees."""
        face = faces.polled_face(context)
        column = self.layout.column(align=True)
        for name, text in zip(GAZE, ("Eyes Turn", "Eyes Down"), strict=True):
            _slider(column, face, name, text)
        armature = armature_of(face)
        bones = armature.pose.bones if armature is not None else {}
        for name, title in ((HEAD, "Head"), (NECK, "Neck")):
            bone = bones.get(name)
            if bone is None:
                continue
            column = self.layout.column(align=True)
            if bone.rotation_mode != ORDER:
                said = translation.label("{part}: turn its bone", part=translation.label(title))
                column.label(text=said, icon="BONE_DATA")
                continue
            for axis, index in AXES:
                column.prop(bone, "rotation_euler", index=index, text=f"{title} {axis}")


class SKETCHTOFACE_PT_wrinkles(OfFace, bpy.types.Panel):
    """How deep the creases are, and which ones this person has."""

    bl_idname = "SKETCHTOFACE_PT_wrinkles"
    bl_label = "Wrinkles"
    bl_order = 6

    def draw(self, context):
        """Part of the person."""
        identity = faces.polled_face(context).sketch_to_face.identity
        self.layout.prop(identity, WRINKLES, slider=True)
        row = self.layout.row(align=True)
        row.operator(people.SKETCHTOFACE_OT_new_creases.bl_idname, text="New Creases",
                     icon="MOD_NOISE")  # fmt: skip
        row.operator(people.SKETCHTOFACE_OT_plain_creases.bl_idname, text="Reset Creases",
                     icon="LOOP_BACK")  # fmt: skip
        self.layout.prop(identity, PATTERN)


class SKETCHTOFACE_PT_identity(OfFace, bpy.types.Panel):
    """Who the face is."""

    bl_idname = "SKETCHTOFACE_PT_identity"
    bl_label = "Person"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 7

    def draw(self, context):
        """Somebody else, or everybody's average."""
        row = self.layout.row(align=True)
        row.operator(people.SKETCHTOFACE_OT_random_person.bl_idname, text="Random",
                     icon="MOD_NOISE")  # fmt: skip
        row.operator_menu_enum(people.SKETCHTOFACE_OT_stylised_person.bl_idname, "style",
                               text="Stylised", icon="COMMUNITY")  # fmt: skip
        row.operator(people.SKETCHTOFACE_OT_plain_person.bl_idname, text="Reset",
                     icon="LOOP_BACK")  # fmt: skip


def _identity_panel(
    group: str, title: str, names: list[str], parent: str, closed: bool = True
) -> type:
    """The sub-panel with one group of identity sliders."""

    def draw(self, context):
        column = self.layout.column(align=True)
        for name in names:
            column.prop(faces.polled_face(context).sketch_to_face.identity, name, slider=True)

    return type(
        f"SKETCHTOFACE_PT_identity_{group}",
        (OfFace, bpy.types.Panel),
        {
            "__doc__": f"Sliders of the person: {title.lower()}.",
            "bl_idname": f"SKETCHTOFACE_PT_identity_{group}",
            "bl_parent_id": parent,
            "bl_label": title,
            "bl_options": {"DEFAULT_CLOSED"} if closed else set(),
            "draw": draw,
        },
    )


def _crease_panel(family: str) -> type:
    """The sub-panel with one family of creases."""
    names = [f"{family}_{trait}" for trait in folds.TRAITS]
    title = CREASE_GROUPS[family]
    return _identity_panel(f"{family}_creases", title, names, SKETCHTOFACE_PT_wrinkles.bl_idname)


def _feature_panel(group: str, features: list[Feature]) -> type:
    """The sub-panel with one group of features."""
    names, parent = [feature.name for feature in features], SKETCHTOFACE_PT_identity.bl_idname
    return _identity_panel(group, GROUPS[group], names, parent, group != CHARACTER)


CLASSES = (
    SKETCHTOFACE_PT_face,
    *(_region_panel(region, label) for region, label in REGIONS.items()),
    SKETCHTOFACE_PT_head,
    SKETCHTOFACE_PT_wrinkles,
    *(_crease_panel(family) for family in folds.FAMILIES),
    SKETCHTOFACE_PT_identity,
    *(_feature_panel(group, features) for group, features in identity_groups().items()),
)
