"""What a face keeps: its sketch, what was read from it, what the artist decided, who it is."""

import contextlib
from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from numpy.typing import NDArray

from facs_rig import CONTROL_NAMES, IDENTITY, load_rig
from facs_rig.blender.beard import beard_of
from facs_rig.blender.hair import colour_of, comb, hair_of, set_colour, style_of
from facs_rig.blender.pose import identity_of, refresh
from facs_rig.blender.reshape import reshape
from facs_rig.common.errors import InputError
from facs_rig.fitted_keys import FITTED
from facs_rig.folds import SEED
from facs_rig.hair import style

from . import caricature, sources

TYPICAL = 2.5  # intensity of an action that the artist says is there and nobody has read
STRONGEST = 5.0  # full natural activation; more is exaggeration, and the sliders' affair
DRAWN, LOST = "sketch_lines", "sketch_lines_unmatched"  # lines of the sketch, as `pack` packs them


def _is_reloaded(face, now: float, value: float) -> bool:
    """Whether Blender only sets again what a library override has, as it does on every load."""
    return face.override_library is not None and abs(now - value) < 1e-5


def _identity_property(feature):
    """A live slider of one identity parameter; the face itself keeps the value."""

    def get(self) -> float:
        return identity_of(self.id_data).get(feature.name, feature.default)

    def put(self, value: float) -> None:
        face = self.id_data
        if _is_reloaded(face, get(self), value):
            return
        # A slider can tell nobody what is wrong; the panel that it is in does.
        with contextlib.suppress(InputError):
            reshape(face, load_rig(), {**identity_of(face), feature.name: value})

    return FloatProperty(
        name=feature.label,
        description=f"{feature.label} of this person",
        min=feature.span[0],
        max=feature.span[1],
        soft_min=feature.minimum,
        soft_max=feature.maximum,
        default=feature.default,
        precision=0 if feature.name == SEED else 2,
        step=100 if feature.name == SEED else 5,
        get=get,
        set=put,
        options=set(),  # not animated: an expression is, a person is not
    )


SKETCHTOFACE_PG_identity = type(
    "SKETCHTOFACE_PG_identity",
    (bpy.types.PropertyGroup,),
    {
        "__doc__": "Who a face is, one property for each parameter.",
        "__annotations__": {f.name: _identity_property(f) for f in IDENTITY},
    },
)


def worn(item) -> float:
    """How strongly the face wears an action of its list, 0 to 10."""
    return float(item.id_data.get(item.name, 0.0))


def decide(item, value: float) -> None:
    """The artist says how strong an action is (0: not there at all): wear it and keep to it."""
    if _is_reloaded(item.id_data, worn(item), value):
        return
    item.id_data[item.name] = float(value)
    item.locked = True
    refresh(item.id_data)


def exaggerate(memory_of, much: float) -> None:
    """Show so many times what makes the drawn person and the expression."""
    face = memory_of.id_data
    if not _is_reloaded(face, caricature.shown(face), much):
        # A slider can tell nobody what is wrong; the panel that it is in does.
        with contextlib.suppress(InputError):
            caricature.show(face, much)


def _colour_property(name: str, about: str, worn_as: Callable):
    """A colour of what a face wears, linear RGB; black, and not to be set, where it wears none.

    worn_as : face -> the object, or None
    """

    def shown(self) -> tuple[float, float, float]:
        thing = worn_as(self.id_data)
        return (thing is not None and colour_of(thing)) or (0.0, 0.0, 0.0)

    def put(self, colour) -> None:
        face = self.id_data
        if face.override_library is None and (thing := worn_as(face)) is not None:
            set_colour(thing, tuple(colour))

    return FloatVectorProperty(
        name=name,
        description=about,
        size=3,
        subtype="COLOR",
        min=0.0,
        max=1.0,
        options=set(),
        get=shown,
        set=put,
    )


def _style_property(name: str, about: str):
    """A live slider of how the hair is combed; the face itself keeps the value."""

    def put(self, value: float) -> None:
        face = self.id_data
        was, value = style_of(face), min(max(value, style.LEAST), style.MOST)
        if _is_reloaded(face, getattr(was, name), value):
            return
        # A slider can tell nobody what is wrong; while hair is edited the panel has it greyed out.
        with contextlib.suppress(InputError):
            comb(face, load_rig(), replace(was, **{name: value}))

    return FloatProperty(
        name=f"Hair {name.title()}",
        description=about,
        min=style.LEAST,
        max=style.MOST,
        default=1.0,
        precision=2,
        step=5,
        options=set(),
        get=lambda self: getattr(style_of(self.id_data), name),
        set=put,
    )


class SKETCHTOFACE_PG_detection(bpy.types.PropertyGroup):
    """One action unit as it was read from the sketch; `name` is the control's name.

    `active` and `intensity` are the face's own slider, so that there is one truth. Setting either
    by hand locks the action.
    """

    probability: FloatProperty(
        name="Probability",
        description="How likely the drawing shows this action",
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    read: FloatProperty(
        name="As Read", description="How strong the action was read, 0 if it was not seen"
    )
    active: BoolProperty(
        name="Accept",
        description="Whether the face does this; a tick that you set or take away is kept when "
        "the face is fitted again",
        get=lambda self: worn(self) > 0,
        set=lambda self, on: decide(self, (self.read or TYPICAL) if on else 0.0),
    )
    intensity: FloatProperty(
        name="Intensity",
        description="How strongly the face does this, 5 is fully natural; a value that you set "
        "is kept when the face is fitted again",
        min=0.0,
        max=STRONGEST,
        get=worn,
        set=decide,
    )
    locked: BoolProperty(
        name="Lock",
        description="Keep this action as it is now when the face is fitted again",
    )


class SKETCHTOFACE_PG_slider(bpy.types.PropertyGroup):
    """The value that a slider got from the sketch; `name` is the control's name or "Fitted"."""

    value: FloatProperty(name="Value", description="As the sketch has it")


class SKETCHTOFACE_PG_pin(bpy.types.PropertyGroup):
    """A point of the face that the artist has put in its place; `name` is the landmark's name."""

    place: FloatVectorProperty(
        name="Place",
        description="Where this point lies: pixels from the picture's left and top, or metres "
        "in the plane of a Grease Pencil drawing",
        size=2,
        precision=3,
    )


class SKETCHTOFACE_PG_face(sources.SketchChoice, bpy.types.PropertyGroup):
    """What a face object remembers of its sketch, and the sliders of who it is."""

    identity: PointerProperty(
        name="Person", description="Who the face is", type=SKETCHTOFACE_PG_identity
    )
    number: IntProperty(
        name="Number", description="Which of this file's sketches it was, counted from 1"
    )
    detections: CollectionProperty(
        name="Detections",
        description="The actions that were read from the sketch",
        type=SKETCHTOFACE_PG_detection,
    )
    shown: IntProperty(
        name="Action", description="The action whose buttons are shown below the list"
    )
    pins: CollectionProperty(
        name="Pins",
        description="The points of the face that were put in their place on the sketch",
        type=SKETCHTOFACE_PG_pin,
    )
    expression: CollectionProperty(
        name="Expression",
        description="The sliders as the sketch has them",
        type=SKETCHTOFACE_PG_slider,
    )
    head: FloatVectorProperty(
        name="Head", description="How the drawn head is turned", subtype="EULER", size=3
    )
    neck: FloatVectorProperty(
        name="Neck", description="How the drawn neck is turned", subtype="EULER", size=3
    )
    camera: FloatVectorProperty(
        name="Camera",
        description="Pixels of the sketch for a metre of the face, and where its pivot lies",
        size=3,
    )
    distance: FloatProperty(
        name="Distance",
        description="From the face's pivot to the eye that saw it, in metres; 0 is infinite",
    )
    closeness: FloatProperty(
        name="Closeness",
        description="How far that eye is from the drawn features, as a share of its distance",
        default=1.0,
    )
    turn: IntProperty(
        name="Turn",
        description="Quarter turns anticlockwise that stand the sketch upright",
        min=0,
        max=3,
    )
    page: FloatVectorProperty(
        name="Page",
        description="From pixels of the sketch to the places of pins, two rows",
        size=6,
        default=sources.SAME.ravel().tolist(),
    )
    contour_error_px: FloatVectorProperty(
        name="Contour error",
        description="Pixels between the sketch and the template, the expression, the fit",
        size=3,
    )
    live: BoolProperty(
        name="Live",
        description="Watch the sketch, and fit this face again whenever it changes",
    )
    caricature: FloatProperty(
        name="Caricature",
        description="How much of what makes this person and the expression is shown: 0 a plain "
        "face, 1 as drawn, 2 twice as much; what you have changed since stays",
        min=0.0,
        max=caricature.MOST,
        default=1.0,
        step=5,
        options=set(),
        get=lambda self: caricature.shown(self.id_data),
        set=lambda self, much: exaggerate(self, much),
    )
    hair_colour: _colour_property(
        "Hair Color", "Of the hair as a whole; its shades are darker and lighter", hair_of
    )
    hair_length: _style_property(
        "length",
        "How long the hair is, 1 as drawn. The hair is made anew: what you have changed on it goes",
    )
    hair_volume: _style_property(
        "volume",
        "How thick the hair is, 1 as drawn. The hair is made anew: what you have changed on it "
        "goes",
    )
    beard_colour: _colour_property(
        "Beard Color",
        "Of the beard as a whole; single hairs are darker and lighter",
        beard_of,
    )
    strokes: StringProperty(
        name="Strokes", description="What became of strokes without a place when it was fitted"
    )
    mark: StringProperty(
        name="Mark", description="The state of the sketch that this face was fitted to"
    )


def decided(face) -> dict[str, float]:
    """The actions that the artist has locked, each with what the face wears now."""
    return {item.name: worn(item) for item in face.sketch_to_face.detections if item.locked}


def places(face) -> dict[str, tuple[float, float]]:
    """The face's pins, where they are kept: see `sources.Source`."""
    return {pin.name: tuple(pin.place) for pin in face.sketch_to_face.pins}


def page_of(face) -> NDArray[np.float64]:
    """(2, 3) from pixels (u, v, 1) of the face's sketch to the places of its pins."""
    return np.array(face.sketch_to_face.page, dtype=float).reshape(2, 3)


def to_page(place, to_places: NDArray) -> tuple[float, float]:
    """A pin's place in pixels of a page. to_places : (2, 3), from its pixels to places."""
    u, v = np.linalg.solve(to_places[:, :2], np.asarray(place, float) - to_places[:, 2])
    return float(u), float(v)


def remember(face, holder, found) -> None:
    """Write to the face what `found` (sketching.Found) says of the sketch that `holder` means.

    What the artist has locked stays locked.
    """
    settings, fit = face.sketch_to_face, found.fit
    if holder != settings:
        sources.copy(holder, settings)
    if not settings.number:
        settings.number = 1 + max(other.sketch_to_face.number for other in bpy.data.objects)
    locked = {item.name for item in settings.detections if item.locked}
    settings.detections.clear()
    for name, probability in fit.detection.probabilities.items():
        item = settings.detections.add()
        item.name, item.probability = name, probability
        item.read, item.locked = fit.detection.intensities[name], name in locked
    surest = max(settings.detections, key=lambda item: (item.active, item.probability))
    settings.shown = settings.detections.find(surest.name)
    settings.expression.clear()
    drawn = {name: face[name] for name in CONTROL_NAMES}
    drawn[FITTED] = face.data.shape_keys.key_blocks[FITTED].value
    for name, value in drawn.items():
        item = settings.expression.add()
        item.name, item.value = name, value
    caricature.begin(face, fit.parameters.identity)
    settings.head, settings.neck = fit.parameters.head, fit.parameters.neck
    settings.strokes = found.strokes
    settings.mark, settings.page = found.mark, found.to_places.ravel().tolist()
    scale = float(np.mean(fit.drawing.scale))
    u, v = fit.drawing.to_input(fit.camera.centre)
    settings.camera = (fit.camera.scale[0] * scale, u, v)
    distance, marks = fit.camera.distance, fit.vertices[fit.rig.landmarks]
    settings.distance = distance if np.isfinite(distance) else 0.0
    settings.closeness = float(fit.camera.relative_depth(marks).mean())
    settings.turn = fit.drawing.turn
    error = fit.contour_error_px
    settings.contour_error_px = [error[k] for k in ("template", "expression", "fitted")]
    face[DRAWN], face[LOST] = pack(found.drawn), pack(fit.unmatched)


def pack(lines: list[NDArray]) -> list[float]:
    """Lines (k, 2) as one list that an object can keep: how many points, then the points, each."""
    return [x for line in lines for x in (float(len(line)), *np.asarray(line, float).ravel())]


def unpack(packed) -> list[NDArray[np.float64]]:
    """The lines of `pack`; none of nothing."""
    flat = np.array(packed, dtype=float) if packed is not None else np.empty(0)
    lines, at = [], 0
    while at < len(flat):
        end = at + 1 + 2 * int(flat[at])
        lines.append(flat[at + 1 : end].reshape(-1, 2))
        at = end
    return lines


CLASSES = (
    SKETCHTOFACE_PG_identity,
    SKETCHTOFACE_PG_detection,
    SKETCHTOFACE_PG_slider,
    SKETCHTOFACE_PG_pin,
    SKETCHTOFACE_PG_face,
)
OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}
# Or a library override of a face could not set them, and would forget them.
for _class in (sources.SketchChoice, *CLASSES):
    for _property in _class.__annotations__.values():
        lists = {"USE_INSERTION"} if _property.function is CollectionProperty else set()
        _property.keywords["override"] = OVERRIDABLE | lists


def attach() -> None:
    """Hang the groups on objects."""
    bpy.types.Object.sketch_to_face = PointerProperty(
        name="Sketch to Face",
        description="What a face remembers of its sketch",
        type=SKETCHTOFACE_PG_face,
        override=OVERRIDABLE,
    )


def detach() -> None:
    """The reverse of attach."""
    del bpy.types.Object.sketch_to_face
