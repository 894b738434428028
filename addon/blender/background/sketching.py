"""From a sketch to a new face, or to an old one again: what the button and live faces share."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig import FaceParameters
from facs_rig.blender.beard import KEPT, add_beard, check_beard, grow, remove_beard
from facs_rig.blender.hair import CUT, DRAWN, LENGTH, VOLUME, fitting, remove_hair, style_of, wear
from facs_rig.blender.hair_curves import check_curves
from facs_rig.blender.hair_follows import check_hair
from facs_rig.blender.hat import put_on as put_on_hat
from facs_rig.blender.hat import take_off
from facs_rig.blender.keys import GAZE
from facs_rig.blender.pose import DETAIL, armature_of, identity_of, pose_of, refresh, set_pose
from facs_rig.fitted_keys import FittedKey
from facs_rig.hair.mesh import hair_mesh
from facs_rig.levels import FULL

from ..messages import translation
from ..state import faces, memory, placing, preferences, properties, sources
from .tasks import BackgroundTask, Progress, Steps, Tick, in_background, within

if TYPE_CHECKING:
    from addon.pipeline import FaceFit

ASKED = 0.005  # seconds that Blender waits for a thread at a time
WARM, READ = 0.1, 0.7  # shares of the whole at which these steps end


@dataclass(frozen=True)
class Found:
    """What became of a sketch. mark, to_places : see `sources.Source`.

    drawn : the sketch's lines, (k, 2) pixels of it each
    strokes : what was done with those that have no place
    hair, beard : whether it was looked for
    """

    fit: FaceFit
    mark: str
    to_places: NDArray[np.float64]
    drawn: list[NDArray[np.float64]]
    strokes: str
    hair: bool = True
    beard: bool = True


@dataclass
class Shape:
    """The shape of a face that is being read, for whoever can build it before the rest is known."""

    known: threading.Event = field(default_factory=threading.Event)
    parameters: FaceParameters | None = None
    offsets: NDArray[np.float32] | None = None
    keys: tuple[FittedKey, ...] = ()

    def tell(
        self,
        parameters: FaceParameters,
        offsets: NDArray[np.float32],
        keys: tuple[FittedKey, ...],
    ) -> None:
        """It is known now."""
        self.parameters, self.offsets, self.keys = parameters, offsets, keys
        self.known.set()


def reading(context, holder, face=None, shape=None) -> Callable[[Progress], Found]:
    """A function, for a thread, that fits the sketch that `holder` means.

    face : keeps its locks and pins      shape : is told the shape as soon as it is known
    InputError, one sentence, if there is no sketch to read.
    """
    source = sources.source_of(holder)
    values = properties.fit_values(context, face)
    if values["hair"] == "curves":
        check_curves()
    places = memory.places(face) if face else {}
    threads = preferences.of(context).threads

    def work(progress: Progress) -> Found:
        try:
            from addon import pipeline  # here: on first use it takes seconds, and not Blender's
            from snakes import polylines

            drawing, to_places = source.load()
            pins = {name: memory.to_page(place, to_places) for name, place in places.items()}
            options = pipeline.FitOptions(**values, pins=pins)
            tell = shape.tell if shape else None
            fit = pipeline.fit(drawing, options, progress, detector(threads), tell)
            # Here, where nobody waits for them.
            _ = fit.contour_error_px, fit.unmatched, fit.hair, fit.hat_mesh, fit.beard
            drawn = [fit.drawing.to_input(line) for line in polylines(fit.drawn)]
            looked = [
                how != "ignore" and options.method != "thesis"
                for how in (options.hair, options.beard)
            ]
            return Found(fit, source.mark, to_places, drawn, options.strokes, *looked)
        finally:
            if shape:
                shape.known.set()  # whoever waits must hear of an error, too

    return work


def expression(context, holder) -> Callable[[Progress], FaceParameters]:
    """A function, for a thread, that reads what the face in the sketch does. Errors: `reading`."""
    source, threads = sources.source_of(holder), preferences.of(context).threads
    align = properties.fit_values(context)["align"]

    def work(_progress: Progress) -> FaceParameters:
        from addon import pipeline

        return pipeline.read_expression(source.load()[0], align, detector(threads))

    return work


def detector(threads: int):
    """The shipped detector on so many cores; 0 for as many as pay."""
    from classifiers import load_detector

    return load_detector(threads=threads) if threads else load_detector()


def warm_up(_progress: Progress):
    """The rig, and what of a face can be worked out before there is a sketch."""
    from facs_rig import load_rig
    from facs_rig.blender import prepare

    rig = load_rig()
    prepare(rig)
    return rig


def new_face(context, holder) -> Steps:
    """Steps that fit the sketch of `holder` and build its face; return (face, Found).

    What is common to all faces is built while the sketch is read, the rest while the lines of the
    face are measured.
    """
    from facs_rig.blender import build_when

    name, shape = sources.source_of(holder).name, Shape()
    work = reading(context, holder, shape=shape)
    wanted = sources.place_beside(context, holder)
    place = {"collection": faces.home(context), "location": placing.clear_place(context, wanted)}
    rig = yield from in_background(warm_up, translation.text("getting ready"), 0.0, WARM)
    face, waits = None, False

    def known():
        nonlocal waits
        waits = not shape.known.wait(ASKED)
        if waits:
            return None
        if shape.parameters is None:
            task.done.wait()
            task.result()  # raises what kept it from being known
        return shape.parameters, shape.offsets, shape.keys

    build = build_when(name, rig, known, **place)
    next(build)  # the bones, while no thread runs
    task = BackgroundTask(work)
    try:
        while face is None:
            try:
                next(build)
            except StopIteration as end:
                face = end.value
            share = WARM + (1 - WARM) * task.share
            said = translation.text("reading {name}", name=name)
            yield Tick(said, share, shape.known if waits else None)
        while not task.done.is_set():
            said = translation.text("measuring {name}", name=name)
            yield Tick(said, WARM + (1 - WARM) * task.share, task.done)
        found = task.result()
        put_hair(face, found)
        put_beard(face, found)
    except BaseException:
        if face is not None:
            remove(face)
        raise
    finally:
        build.close()
        task.stop()
    memory.remember(face, holder, found)
    return face, found


def remove(face: bpy.types.Object) -> None:
    """Take a face that was just built away again, with all that it alone uses."""
    remove_hair(face)
    take_off(face)
    remove_beard(face)
    armature, mesh = face.parent, face.data
    bpy.data.batch_remove([face, armature, mesh, armature.data])


def put_hair(face: bpy.types.Object, found: Found) -> None:
    """Give a face the hair and the hat that were found; what it has stays where none was looked
    for, and where no bones carry any."""
    if not found.hair or armature_of(face) is None:
        return
    rig, hair, style = found.fit.rig, found.fit.hair, style_of(face)
    if found.fit.hat_mesh is not None:
        who = identity_of(face)
        hat = found.fit.hat_mesh.lying_on(rig.neutral(who) + found.fit.offsets)
        put_on_hat(face, hat, who)
    else:
        take_off(face)
    if hair is not None:
        if style != hair.style:
            hair = hair_mesh(rig, identity_of(face), hair.cut, hair.kind, style=style)
        wear(face, fitting(face, rig, hair), identity_of(face))
        face.pop(DRAWN, None)
        return
    remove_hair(face)
    for name in (CUT, DRAWN, LENGTH, VOLUME):
        face.pop(name, None)


def put_beard(face: bpy.types.Object, found: Found) -> None:
    """Give a face the beard that was found, as `put_hair`."""
    if not found.beard or armature_of(face) is None:
        return
    beard = found.fit.beard
    if beard is None:
        remove_beard(face)
        face.pop(KEPT, None)
    elif face.get(DETAIL, FULL) == FULL:
        grow(face, beard)
    else:
        add_beard(face, found.fit.rig, beard.beard)


def again(context, face) -> Steps:
    """Steps that fit an existing face to its sketch once more; return Found.

    Locked actions, pins, gaze, neck, place, keyframes and what the artist made of the hair (colour,
    length, volume) stay.
    """
    work = reading(context, face.sketch_to_face, face)
    yield from in_background(warm_up, translation.text("getting ready"), 0.0, WARM)
    said = translation.text("reading the sketch of {name}", name=face.name)
    found = yield from in_background(work, said, WARM, READ)
    yield from put_on(face, found)
    return found


def put_on(face, found: Found) -> Steps:
    """Steps that give an existing face the shape and the expression that were found."""
    from facs_rig import load_rig
    from facs_rig.blender.reshape import reshape_steps

    if found.hair:
        check_hair(face)
    if found.beard:
        check_beard(face)
    fit, before = found.fit, pose_of(face)
    reshape = reshape_steps(face, load_rig(), fit.parameters.identity, fit.offsets, fit.keys)
    said = translation.text("shaping {name}", name=face.name)
    yield from within(reshape, said, READ, 1.0, 2)
    put_hair(face, found)
    put_beard(face, found)
    gaze = {name: face[name] for name in GAZE}  # no drawing says where the eyes look
    set_pose(face, replace(fit.parameters, neck=before.neck))
    for name, angle in gaze.items():
        face[name] = angle
    refresh(face)
    memory.remember(face, face.sketch_to_face, found)


def sentence(face: bpy.types.Object, fit) -> tuple[str, str]:
    """What to report of a fit: the kind of report and the text."""
    names = [name for name, value in fit.parameters.aus.items() if value]
    said = f"{face.name}: {', '.join(names) or translation.text('no expression found')}"
    if fit.drawing.turn == 2:
        said += ". " + translation.text("The sketch is upside down: it was turned to be read")
    elif fit.drawing.turn:
        said += ". " + translation.text("The sketch lies on its side: it was turned to be read")
    if fit.drawing.painted:
        said += ". " + translation.text(
            "It is rather a painting or a photograph: a line drawing is read better"
        )
    if fit.hat_left_out:
        said += ". " + translation.text("A hat was seen of which none could be made")
    others = fit.detection.left_out()
    return ("WARNING", f"{said}. {others}") if others else ("INFO", said)
