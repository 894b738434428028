"""The buttons that make a face, or another person of it."""

import random

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty

from facs_rig import folds
from facs_rig.blender.pose import identity_of, mover_of
from facs_rig.blender.twin import stand_alone
from facs_rig.stylised import PRESETS, preset

from ..messages import translation
from ..messages.reporting import reported
from ..state import faces, placing
from ..viewport import looking

NAME = "FACS Face"


def _any_person(seed: int) -> dict[str, float]:
    from dataset_gen.sampling import sample_identity
    from facs_rig.looks import drawn_looks
    from facs_rig.macros import drawn_person

    rng = np.random.default_rng(seed)
    who = {**sample_identity(rng), **drawn_person(rng)}
    return {**who, **drawn_looks(rng, who)}


class MESH_OT_add_facs_face(bpy.types.Operator):
    """Add a head with the 47 actions of the Facial Action Coding System as sliders"""

    bl_idname = "mesh.add_facs_face"
    bl_label = "Add FACS Face"
    bl_options = {"REGISTER", "UNDO"}
    identity_keys: BoolProperty(
        name="Identity Sliders",
        description="Keep gender, age, ethnicity and features in shape keys: their sliders are "
        "quicker, and the face is heavier",
        default=True,
        options={"SKIP_SAVE"},
    )
    detail: EnumProperty(
        name="Detail",
        description="How fine the mesh is; all levels have the same sliders and shape keys",
        items=(
            ("full", "Full", "Every crease and hair"),
            ("medium", "Medium", "A quarter of the polygons, hairs as flat blades"),
            ("game", "Game", "Under 6,000 triangles, brows and lashes as strips"),
        ),
        default="full",
        options={"SKIP_SAVE"},
    )
    arkit: BoolProperty(
        name="ARKit Shape Keys",
        description="Add the 52 shape keys that live-capture tools drive by name",
        options={"SKIP_SAVE"},
    )
    random_identity: BoolProperty(
        name="Random Person",
        description="Somebody, instead of the average of everybody",
        options={"SKIP_SAVE"},
    )
    seed: IntProperty(name="Seed", description="Another number, another person", min=0, default=1)

    @classmethod
    def poll(cls, context):
        """Only in Object Mode: a new object cannot be added anywhere else."""
        if context.mode != "OBJECT":
            cls.poll_message_set(translation.tip("Go to Object Mode first"))
            return False
        return True

    def draw(self, context):
        """The options; a seed only where it says something."""
        column = self.layout.column()
        for name in ("detail", "identity_keys", "arkit", "random_identity"):
            column.prop(self, name)
        if self.random_identity:
            column.prop(self, "seed")

    def execute(self, context):
        """Build at the 3D cursor, select, look."""
        with reported(self) as outcome:
            from facs_rig import FaceParameters
            from facs_rig.blender import build_face
            from facs_rig.levels import at_level
            from facs_rig.rig import load_rig

            rig = at_level(load_rig(), self.detail)
            identity = _any_person(self.seed) if self.random_identity else {}
            wanted = tuple(context.scene.cursor.location)
            # A cursor that somebody has put somewhere is meant; a new file's own is in its cube.
            free = wanted if any(wanted) else placing.clear_place(context, wanted)
            face = build_face(
                NAME,
                rig,
                FaceParameters(identity=identity),
                collection=faces.home(context),
                location=free,
                identity_keys=self.identity_keys,
                arkit=self.arkit,
            )
            faces.select_alone(context, face)
            looking.look_at(context, face)
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


class SKETCHTOFACE_OT_random_person(faces.OnFace, bpy.types.Operator):
    """Make the face somebody else; the expression stays"""

    bl_idname = "sketch_to_face.random_person"
    bl_label = "Random Person"
    bl_options = {"REGISTER", "UNDO"}
    seed: IntProperty(name="Seed", description="Another number, another person", min=0, default=1)

    def invoke(self, context, event):
        """Each press another one."""
        self.seed = random.randrange(1_000_000)
        return self.execute(context)

    def execute(self, context):
        """Draw a person from the seed."""
        return _become(self, context, _any_person(self.seed))


class SKETCHTOFACE_OT_stylised_person(faces.OnFace, bpy.types.Operator):
    """Make the face a stylised person, to go on from; the expression stays"""

    bl_idname = "sketch_to_face.stylised_person"
    bl_label = "Stylised Person"
    bl_options = {"REGISTER", "UNDO"}
    style: EnumProperty(
        name="Style",
        description="Whom to start from",
        items=[(preset.name.upper(), preset.label, preset.about) for preset in PRESETS],
    )

    def execute(self, context):
        """Features far beyond those of people; typing a value into their sliders goes on there."""
        return _become(self, context, preset(self.style.lower()))


class SKETCHTOFACE_OT_plain_person(faces.OnFace, bpy.types.Operator):
    """Set every identity slider back; the expression stays"""

    bl_idname = "sketch_to_face.plain_person"
    bl_label = "Reset Person"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """The default face."""
        return _become(self, context, {})


class SKETCHTOFACE_OT_new_creases(faces.OnFace, bpy.types.Operator):
    """Give the person other creases; who it is and what it does stay"""

    bl_idname = "sketch_to_face.new_creases"
    bl_label = "New Creases"
    bl_options = {"REGISTER", "UNDO"}
    seed: IntProperty(name="Seed", description="Another number, other creases", min=0, default=1)

    def invoke(self, context, event):
        """Each press others."""
        self.seed = random.randrange(1_000_000)
        return self.execute(context)

    def execute(self, context):
        """Draw them from the seed."""
        return _crease(self, context, folds.drawn_creases(np.random.default_rng(self.seed)))


class SKETCHTOFACE_OT_plain_creases(faces.OnFace, bpy.types.Operator):
    """Give the person everybody's average creases; who it is and what it does stay"""

    bl_idname = "sketch_to_face.plain_creases"
    bl_label = "Reset Creases"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """All of the creases' own sliders back; their depth stays."""
        return _crease(self, context, {})


class SKETCHTOFACE_OT_stand_alone(bpy.types.Operator):
    """Give a linked duplicate a mesh, shape keys and sliders of its own; what it shows stays"""

    bl_idname = "sketch_to_face.stand_alone"
    bl_label = "Make Independent"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """A face must be active that moves with another's sliders, in Object Mode."""
        face = faces.active_face(context)
        if face is None or face.library is not None or mover_of(face) == face:
            cls.poll_message_set(translation.tip("Select a linked duplicate of a face"))
            return False
        if context.mode not in ("OBJECT", "POSE"):
            cls.poll_message_set(translation.tip("Go to Object Mode first"))
            return False
        return True

    def execute(self, context):
        """Copy the data, let it follow this face."""
        with reported(self) as outcome:
            stand_alone(faces.polled_face(context))
        return {"CANCELLED"} if outcome.failed else {"FINISHED"}


def _become(operator, context, identity: dict[str, float]) -> set[str]:
    from facs_rig.blender.reshape import reshape
    from facs_rig.rig import load_rig

    with reported(operator) as outcome:
        reshape(faces.polled_face(context), load_rig(), identity)
    return {"CANCELLED"} if outcome.failed else {"FINISHED"}


def _crease(operator, context, creases: dict[str, float]) -> set[str]:
    who = identity_of(faces.polled_face(context))
    kept = {name: value for name, value in who.items() if name not in folds.PARAMETERS}
    return _become(operator, context, {**kept, **creases})


CLASSES = (
    MESH_OT_add_facs_face,
    SKETCHTOFACE_OT_random_person,
    SKETCHTOFACE_OT_stylised_person,
    SKETCHTOFACE_OT_plain_person,
    SKETCHTOFACE_OT_new_creases,
    SKETCHTOFACE_OT_plain_creases,
    SKETCHTOFACE_OT_stand_alone,
)


def _menu(self, context):
    self.layout.operator(MESH_OT_add_facs_face.bl_idname, text=NAME, icon="USER")


def attach() -> None:
    """Add the entry in Add > Mesh."""
    bpy.types.VIEW3D_MT_mesh_add.append(_menu)


def detach() -> None:
    """The reverse of attach."""
    bpy.types.VIEW3D_MT_mesh_add.remove(_menu)
