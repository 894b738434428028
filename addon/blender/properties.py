"""What Blender keeps: the sketch and the tweakables (scene), what was read from it (object)."""

import dataclasses
from pathlib import Path

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    PointerProperty,
    StringProperty,
)

from addon.drawing import SketchError
from addon.storyboard import EVERY
from facs_rig import CONTROL_NAMES, IDENTITY, load_rig
from facs_rig.blender_keys import FITTED
from facs_rig.blender_pose import identity_of, set_identity
from snakes import DEEPEST, WIDEST, Tweakables

_LIMITS = {"minimum": "min", "maximum": "max"}


def label(field: dataclasses.Field) -> str:
    """`max_delta` -> "Max Delta", unless the table has a label of its own."""
    return field.metadata.get("label") or field.name.replace("_", " ").title()


def blender_property(field: dataclasses.Field):
    """The Blender property of one tweakable: type, limits and tooltip as the table has them."""
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
        return FloatProperty(precision=2, **limits, **common)
    raise TypeError(f"tweakable {field.name}: no Blender property for {field.default!r}")


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


def _identity_property(feature):
    """A live slider of one identity parameter; the face itself keeps the value."""

    def get(self) -> float:
        return identity_of(self.id_data).get(feature.name, feature.default)

    def put(self, value: float) -> None:
        face = self.id_data
        set_identity(face, load_rig(), {**identity_of(face), feature.name: value})

    return FloatProperty(
        name=feature.label,
        min=feature.minimum,
        max=feature.maximum,
        default=feature.default,
        precision=2,
        step=5,
        get=get,
        set=put,
        options=set(),  # not animated: an expression is, a person is not
    )


SKETCHTOFACE_PG_identity = type(
    "SKETCHTOFACE_PG_identity",
    (bpy.types.PropertyGroup,),
    {
        "__doc__": "Who a face with identity keys is, one property for each parameter.",
        "__annotations__": {f.name: _identity_property(f) for f in IDENTITY},
    },
)


class SKETCHTOFACE_PG_scene(bpy.types.PropertyGroup):
    """The settings of the tab, kept in the scene."""

    __annotations__ = {
        "sketch": StringProperty(
            name="Sketch",
            description="The drawing of a face: PNG, JPEG or whatever your scanner writes",
            subtype="FILE_PATH",
        ),
        "place_head": BoolProperty(
            name="Place the Head by Hand",
            description="Say where the head is in the sketch instead of letting it be found",
        ),
        "head_box": IntVectorProperty(
            name="Head",
            description="Box around the head, from crown to chin and ear to ear, in pixels of the "
            "sketch: left, top, right, bottom",
            size=4,
            min=0,
        ),
        "method": EnumProperty(
            name="Method",
            description="How the face is brought to the drawing",
            items=[
                ("lines", "By Lines", "Person and expression first, then its lines onto the drawn"),
                ("thesis", "Thesis", "The drawn contours slide over the shaded face"),
            ],
        ),
        "tweakables": PointerProperty(type=SKETCHTOFACE_PG_tweakables),
        "strokes": EnumProperty(
            name="Strokes Without a Place",
            description="What becomes of drawn lines that the face does not have, such as scars",
            items=[
                ("ignore", "Ignore", "Leave them out"),
                ("engrave", "Engrave", "Carve them into the skin"),
                ("emboss", "Emboss", "Raise them from the skin"),
            ],
        ),
        "stroke_profile": EnumProperty(
            name="Profile",
            description="The cut across a carved stroke",
            items=[
                ("crease", "Crease", "A groove between low rims"),
                ("scar", "Scar", "A groove between high rims"),
            ],
        ),
        "stroke_depth": FloatProperty(
            name="Depth",
            description="How deep a stroke is carved, or how high it is raised (in mm)",
            default=1.2,
            min=0.1,
            max=1000 * DEEPEST,
        ),
        "stroke_width": FloatProperty(
            name="Width",
            description="How wide a carved stroke is; wider where the mesh is coarse (in mm)",
            default=4.0,
            min=0.5,
            max=1000 * WIDEST,
        ),
        "storyboard": StringProperty(
            name="Storyboard",
            description="The folder of sketches that become key poses, in the order of their names",
            subtype="DIR_PATH",
        ),
        "storyboard_every": IntProperty(
            name="Frames Apart",
            description="From one sketch's key pose to the next",
            default=EVERY,
            min=1,
        ),
        "one_sided": BoolProperty(
            name="One-Sided",
            description="Show the sliders of the face's right and left under those of both",
        ),
    }


FIT_SETTINGS = ("method", "strokes", "stroke_profile", "stroke_depth", "stroke_width")


def sketch_path(settings) -> Path:
    """The chosen sketch's file. SketchError, one sentence, if none is chosen."""
    if not settings.sketch.strip():
        raise SketchError("No sketch is chosen: pick the image of a drawn face first.")
    return Path(bpy.path.abspath(settings.sketch)).expanduser()


def fit_options(settings):
    """The pipeline's options as the scene's settings have them."""
    from addon import pipeline  # late: Blender starts faster without what only a fit needs

    box = ",".join(map(str, settings.head_box)) if settings.place_head else None
    return pipeline.FitOptions(
        tweakables=tweakables(settings.tweakables),
        align=box,
        **{name: _six_digits(getattr(settings, name)) for name in FIT_SETTINGS},
    )


def _six_digits(value):
    """Blender keeps 32-bit floats; six digits are what the artist sees and all that they hold."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


class SKETCHTOFACE_PG_detection(bpy.types.PropertyGroup):
    """One action unit as it was read from the sketch; `name` is the control's name."""

    __annotations__ = {
        "probability": FloatProperty(name="Probability", min=0.0, max=1.0, subtype="FACTOR"),
        "active": BoolProperty(name="Active"),
        "intensity": FloatProperty(name="Intensity", min=0.0, max=5.0),
    }


class SKETCHTOFACE_PG_slider(bpy.types.PropertyGroup):
    """The value that a slider got from the sketch; `name` is the control's name or "Fitted"."""

    __annotations__ = {"value": FloatProperty(name="Value")}


class SKETCHTOFACE_PG_face(bpy.types.PropertyGroup):
    """What a face object remembers of its sketch, and the sliders of who it is."""

    __annotations__ = {
        "identity": PointerProperty(type=SKETCHTOFACE_PG_identity),
        "sketch": StringProperty(name="Sketch", description="The drawing that this face is from"),
        "number": IntProperty(
            name="Number", description="Which of this file's sketches it was, counted from 1"
        ),
        "detections": CollectionProperty(type=SKETCHTOFACE_PG_detection),
        "expression": CollectionProperty(type=SKETCHTOFACE_PG_slider),
        "head": FloatVectorProperty(name="Head", subtype="EULER", size=3),
        "neck": FloatVectorProperty(name="Neck", subtype="EULER", size=3),
        "contour_error_px": FloatVectorProperty(
            name="Contour error",
            description="Pixels between the sketch and the template, the expression, the fit",
            size=3,
        ),
    }


def remember(face, sketch: str, fit) -> None:
    """Write what `fit` (addon.pipeline.FaceFit) says of the sketch to the face object."""
    settings = face.sketch_to_face
    settings.sketch = sketch
    settings.number = 1 + max(other.sketch_to_face.number for other in bpy.data.objects)
    settings.detections.clear()
    for name, probability in fit.detection.probabilities.items():
        item = settings.detections.add()
        item.name = name
        item.probability = probability
        item.active = fit.detection.active[name]
        item.intensity = fit.detection.intensities[name]
    settings.expression.clear()
    drawn = {name: face[name] for name in CONTROL_NAMES}
    drawn[FITTED] = face.data.shape_keys.key_blocks[FITTED].value
    for name, value in drawn.items():
        item = settings.expression.add()
        item.name = name
        item.value = value
    settings.head, settings.neck = fit.parameters.head, fit.parameters.neck
    error = fit.contour_error_px
    settings.contour_error_px = [error[k] for k in ("template", "expression", "fitted")]


CLASSES = (
    SKETCHTOFACE_PG_tweakables,
    SKETCHTOFACE_PG_identity,
    SKETCHTOFACE_PG_scene,
    SKETCHTOFACE_PG_detection,
    SKETCHTOFACE_PG_slider,
    SKETCHTOFACE_PG_face,
)


def register() -> None:
    """Register the groups and hang them on scenes and objects."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.sketch_to_face = PointerProperty(type=SKETCHTOFACE_PG_scene)
    bpy.types.Object.sketch_to_face = PointerProperty(type=SKETCHTOFACE_PG_face)


def unregister() -> None:
    """The reverse of register."""
    del bpy.types.Object.sketch_to_face
    del bpy.types.Scene.sketch_to_face
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
