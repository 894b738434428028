"""What the scene keeps: the next sketch, the tweakables, how to fit."""

import dataclasses

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

from addon.options import FitOptions
from addon.storyboard import EVERY
from facs_rig.common.box import Box
from facs_rig.common.settings import settings_of
from snakes import Tweakables

from ..messages import translation
from . import memory, preferences, sources

_LIMITS = {"minimum": "min", "maximum": "max"}
_OPTIONS = settings_of(FitOptions)


def label(field: dataclasses.Field) -> str:
    """`max_delta` -> "Max Delta", unless the table has a label of its own."""
    return field.metadata.get("label") or field.name.replace("_", " ").title()


def blender_property(field: dataclasses.Field, **more):
    """The Blender property of a setting of the core: type, limits and tooltip as it has them."""
    unit = field.metadata.get("unit")
    text = field.metadata.get("help", "").strip().rstrip(".")
    common = {
        "name": label(field),
        "description": f"{text} (in {unit})" if unit else text,
        "default": field.default,
    }
    choices = field.metadata.get("choices")
    if choices:
        items = [(c, str(c).replace("_", " ").replace("-", " ").capitalize(), "") for c in choices]
        return EnumProperty(items=items, **common)
    if isinstance(field.default, bool):
        return BoolProperty(**common)
    limits = {to: field.metadata[key] for key, to in _LIMITS.items()
              if field.metadata.get(key) is not None}  # fmt: skip
    if isinstance(field.default, int):
        return IntProperty(**limits, **common)
    if isinstance(field.default, float):
        return FloatProperty(**{"precision": 2, **limits, **common, **more})
    raise TypeError(f"setting {field.name}: no Blender property for {field.default!r}")


SKETCHTOFACE_PG_tweakables = type(
    "SKETCHTOFACE_PG_tweakables",
    (bpy.types.PropertyGroup,),
    {
        "__doc__": "The thesis' table of tweakables, one property each.",
        "__annotations__": {f.name: blender_property(f) for f in dataclasses.fields(Tweakables)},
    },
)


def tweakables(group) -> Tweakables:
    """The core's Tweakables of a property group."""
    names = (field.name for field in dataclasses.fields(Tweakables))
    return Tweakables(**{name: _six_digits(getattr(group, name)) for name in names})


class SKETCHTOFACE_PG_scene(sources.SketchChoice, bpy.types.PropertyGroup):
    """The settings of the tab, kept in the scene."""

    place_head: BoolProperty(
        name="Place the Head by Hand",
        description="Say where the head is in the sketch instead of letting it be found",
    )
    head_box: IntVectorProperty(
        name="Head",
        description="Box around the head, from crown to chin and ear to ear, in pixels of the "
        "sketch: left, top, right, bottom",
        size=4,
        min=0,
    )
    method: EnumProperty(
        name="Method",
        description="How the face is brought to the drawing",
        items=[
            ("lines", "By Lines", "Person and expression first, then its lines onto the drawn"),
            ("shape", "Person Only", "Person and expression; the skin stays smooth. Quickest"),
            ("thesis", "Thesis", "The drawn contours slide over the shaded face"),
        ],
    )
    hair: EnumProperty(
        name="Hair",
        description="What is made of the hair in the drawing",
        items=[
            ("locks", "Locks", "A surface with locks on it"),
            ("surface", "Surface", "One plain surface, to be sculpted"),
            ("curves", "Curves", "Hair curves on a thin surface, to be groomed; Blender 4.2"),
            ("ignore", "Ignore", "Make none; hair that the face has stays"),
        ],
        **translation.OWN_CONTEXT,
    )
    beard: EnumProperty(
        name="Beard",
        description="What is made of a beard in the drawing",
        items=[
            ("hairs", "Hairs", "Single hairs, which go with the skin"),
            ("ignore", "Ignore", "Make none; a beard that the face has stays"),
        ],
        **translation.OWN_CONTEXT,
    )
    tweakables: PointerProperty(
        name="Tweakables",
        description="How the lines of the drawing pull the face",
        type=SKETCHTOFACE_PG_tweakables,
    )
    strokes: EnumProperty(
        name="Strokes Without a Place",
        description="What becomes of drawn lines that the face does not have, such as scars",
        items=[
            ("ignore", "Ignore", "Leave them out"),
            ("engrave", "Engrave", "Carve them into the skin"),
            ("emboss", "Emboss", "Raise them from the skin"),
        ],
    )
    stroke_profile: EnumProperty(
        name="Profile",
        description="The cut across a carved stroke",
        items=[
            ("crease", "Crease", "A groove between low rims"),
            ("scar", "Scar", "A groove between high rims"),
        ],
    )
    exaggerate: blender_property(_OPTIONS["exaggerate"])
    # a stroke of no depth or width is none, and less than this nobody sees
    stroke_depth: blender_property(_OPTIONS["stroke_depth"], min=0.1)
    stroke_width: blender_property(_OPTIONS["stroke_width"], min=0.5)
    storyboard: StringProperty(
        name="Storyboard",
        description="The folder of sketches that become key poses, in the order of their names",
        subtype="DIR_PATH",
        options=preferences.RELATIVE,
    )
    storyboard_every: IntProperty(
        name="Frames Apart",
        description="From one sketch's key pose to the next",
        default=EVERY,
        min=1,
    )
    overlay: BoolProperty(
        name="Overlay",
        description="Show the lines of the sketch and of the active face over each other, in "
        "the front view",
    )
    one_sided: BoolProperty(
        name="One-Sided",
        description="Show the sliders of the face's right and left under those of both",
    )


FIT_SETTINGS = (
    "method", "exaggerate", "hair", "beard", "strokes", "stroke_profile", "stroke_depth",
    "stroke_width",
)  # fmt: skip


def fit_values(context, face=None) -> dict:
    """What `addon.pipeline.FitOptions` is made of, as the scene has it and, of a face, as its
    artist has decided; without pins, which are places on the page that only reading brings."""
    settings = context.scene.sketch_to_face
    values = {name: _six_digits(getattr(settings, name)) for name in FIT_SETTINGS}
    if values["method"] == "lines" and preferences.of(context).quality == "QUICK":
        values["method"] = "shape"
    return {
        "tweakables": tweakables(settings.tweakables),
        "align": Box(*settings.head_box) if settings.place_head else None,
        "expression": memory.decided(face) if face else {},
        **values,
    }


def _six_digits(value):
    """Blender keeps 32-bit floats; six digits are what the artist sees and all that they hold."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


CLASSES = (
    SKETCHTOFACE_PG_tweakables,
    SKETCHTOFACE_PG_scene,
)


def attach() -> None:
    """Hang the groups on scenes."""
    bpy.types.Scene.sketch_to_face = PointerProperty(
        name="Sketch to Face",
        description="The next sketch, and how it is fitted",
        type=SKETCHTOFACE_PG_scene,
    )


def detach() -> None:
    """The reverse of attach."""
    del bpy.types.Scene.sketch_to_face
