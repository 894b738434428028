"""From a sketch to a posable face: the one place where all stages are composed.

    drawing -> detector -> expression and head -> camera -> lines -> identity -> snakes -> offsets

`fit` does the work, `report` and `preview` say and show what came of it, `write_face` keeps it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.beard import beard_of
from addon.drawing import Drawing, load_drawing
from addon.export import file_to_core, write_mesh
from addon.hair import beside_hair, hair_of
from addon.measure import Comparison
from addon.options import METHODS, UNMATCHED, FitOptions
from addon.placement import camera_for, head_in
from addon.strategies import Fitted, as_thesis, by_lines
from addon.threads import on_one_thread
from classifiers import Detection, Detector, load_detector
from classifiers.detection import ANGLES
from facs_rig import Camera, FaceParameters, FaceRig, load_rig
from facs_rig.beard.beard import Beard
from facs_rig.beard.mesh import BeardMesh, beard_mesh
from facs_rig.common.box import Box
from facs_rig.common.clock import Clock
from facs_rig.common.errors import InputError
from facs_rig.common.files import Outputs
from facs_rig.common.polylines import line_length
from facs_rig.exaggeration import exaggerated
from facs_rig.fitted_keys import FittedKey, offsets_at
from facs_rig.hair.cut import Cut
from facs_rig.hair.hat import Hat, HatMesh, hat_mesh
from facs_rig.hair.mesh import KINDS, HairMesh, hair_mesh
from facs_rig.levels import FULL
from snakes import Lines, carvable, engrave

__all__ = [
    "METHODS", "STAGES", "UNMATCHED", "FaceFit", "FitOptions", "fit", "preview", "read_expression",
    "report", "write_face",
]  # fmt: skip

Progress = Callable[[int, int], None]
Shaped = Callable[[FaceParameters, NDArray[np.float32], tuple[FittedKey, ...]], None]
HAT_LEFT_OUT = "There is a hat in the sketch of which none could be made: it is left out."
STAGES = ("read", "detect", "align", "fit", "hair", "carve")


@dataclass(frozen=True)
class FaceFit:
    """A fitted face and how it came about. Pixels are those of `drawing.image`, which stands
    upright however the sketch was handed in.

    fitted : what the method found, what was carved into it, exaggerated
    cut : the hair, for a person of `parameters`; None for a bald one, and where it is ignored
    hair_kind : of facs_rig.hair.mesh.KINDS
    hat : likewise; hat_left_out : whether there is one of which none could be made
    grows : the beard, for a person of `parameters`; None as for hair
    compared : the face held against the sketch, before strokes were carved into it or it was
    exaggerated
    """

    drawing: Drawing
    detection: Detection
    rig: FaceRig
    fitted: Fitted
    compared: Comparison
    cut: Cut | None
    hair_kind: str
    stages_s: dict[str, float]
    hat: Hat | None = None
    hat_left_out: bool = False
    grows: Beard | None = None

    @property
    def parameters(self) -> FaceParameters:
        """Expression and head as detected and fitted, controls as decided, fitted identity."""
        return self.fitted.parameters

    @property
    def camera(self) -> Camera:
        return self.fitted.camera

    @property
    def offsets(self) -> NDArray[np.float32]:
        """(n, 3) metres, for `rig.shape`, with the drawn expression."""
        return self.fitted.offsets

    @property
    def keys(self) -> tuple[FittedKey, ...]:
        """What of the offsets goes with the drawn actions; the rest stays at rest."""
        return self.fitted.keys

    def posed(self, parameters: FaceParameters) -> NDArray[np.float32]:
        """(n, 3) the fitted skin with another expression, head or person."""
        return self.rig.pose(parameters, offsets_at(self.offsets, self.keys, parameters.aus))

    @property
    def vertices(self) -> NDArray[np.float32]:
        """(n, 3) metres, posed and fitted."""
        return self.fitted.vertices

    @cached_property
    def hair(self) -> HairMesh | None:
        """The hair as a mesh, if there is any."""
        if self.cut is None:
            return None
        return hair_mesh(self.rig, self.parameters.identity, self.cut, self.hair_kind)

    @cached_property
    def hat_mesh(self) -> HatMesh | None:
        """The hat as a mesh, if there is any."""
        return None if self.hat is None else hat_mesh(self.rig, self.parameters.identity, self.hat)

    @cached_property
    def beard(self) -> BeardMesh | None:
        """The beard as a mesh, if there is any."""
        if self.grows is None:
            return None
        return beard_mesh(self.rig, self.parameters.identity, self.grows)

    @property
    def drawn(self) -> Lines:
        """The middle of every stroke within the head's box."""
        return self.compared.drawn

    @property
    def contour_error_px(self) -> dict[str, float]:
        """template, expression, fitted -> mean distance to the sketch's lines, in its pixels as it
        was handed in. Worked out when it is first asked for, as `unmatched` is."""
        scale = float(np.mean(self.drawing.scale))
        return {name: scale * error for name, error in self.compared.errors.items()}

    @property
    def unmatched(self) -> list[NDArray[np.float64]]:
        """Lines of the sketch (k, 2) that nothing on the face answers to, in its pixels."""
        return [self.drawing.to_input(line) for line in self.compared.unmatched]

    @property
    def timings_s(self) -> dict[str, float]:
        """Seconds of each stage so far; `measure` is what has been asked for of the two above."""
        measured = sum(self.compared.seconds.values())
        stages = {**self.stages_s, "measure": measured}
        return {**stages, "total": sum(stages.values())}


@on_one_thread
def fit(
    sketch: str | Path | Drawing | NDArray,
    options: FitOptions | None = None,
    progress: Progress | None = None,
    detector: Detector | None = None,
    shaped: Shaped | None = None,
) -> FaceFit:
    """Fit the face to a sketch: a file, a loaded Drawing, or a picture (h, w) or (h, w, 3 or 4).

    `progress(done, total)` is called after each stage. detector : None is `load_detector()`.
    `shaped(parameters, offsets, keys)` is called once these are final: a face can be built in the
    meantime. What is only said about a fit is worked out when it is asked for.
    Raises InputError, one sentence, for whatever cannot be read or shows no face, and InputError
    for an unusable alignment.
    """
    options = options or FitOptions()
    clock = Clock(progress and (lambda done: progress(done, len(STAGES))))
    drawing = _read(sketch)
    clock.lap("read")

    drawing, detection = _detect(drawing, options.align, detector)
    expression = _applied(detection, options.expression)
    clock.lap("detect")

    rig = load_rig()
    place = partial(
        camera_for,
        drawing,
        rig,
        box=options.align,
        landmarks=detection.landmarks,
        pins=options.pins,
    )
    camera = place(expression)
    clock.lap("align")

    strategy = as_thesis if options.method == "thesis" else by_lines
    as_drawn = strategy(drawing, detection, rig, expression, camera, options)
    fitted, carves = as_drawn, options.strokes != "ignore"
    if not carves:
        fitted = _exaggerated(as_drawn, rig, options.exaggerate)
        if shaped:
            shaped(fitted.parameters, fitted.offsets, fitted.keys)
    clock.lap("fit")

    looked = options.method != "thesis"
    wears, grows = (looked and how != "ignore" for how in (options.hair, options.beard))
    page, cut, worn, hat, beard = None, None, None, None, None
    if wears or grows:
        page, cut, worn, hat = hair_of(drawing, detection, rig, as_drawn)
    if grows:
        shown = cut if worn is None else None  # how dark hair is under a hat is hard to tell
        page, beard = beard_of(drawing, detection, rig, as_drawn, page, shown)
    if not wears:
        cut, worn, hat = None, None, None
    clock.lap("hair")

    compared = Comparison(
        drawing.image, rig, as_drawn, FaceParameters(head=expression.head), place,
        detection.mask.hides if detection.mask else None, options.tweakables.max_delta,
        partial(beside_hair, page, hat=worn) if page and (cut or hat or beard) else None,
    )  # fmt: skip
    if carves:
        lost = compared.unmatched
        clock.skip()
        carved = _carved(as_drawn, lost, rig, options)
        fitted = _exaggerated(carved, rig, options.exaggerate)
        if shaped:
            shaped(fitted.parameters, fitted.offsets, fitted.keys)
    clock.lap("carve")
    kind = options.hair if wears else KINDS[0]
    without = worn is not None and hat is None
    return FaceFit(
        drawing, detection, rig, fitted, compared, cut, kind, clock.laps, hat, without, beard
    )


def read_expression(
    sketch: str | Path | Drawing | NDArray,
    align: Box | str | None = None,
    detector: Detector | None = None,
) -> FaceParameters:
    """What the face in a sketch does, expression and head, without building it.

    sketch, align, detector : as for `fit`, which also raises the same errors
    """
    return _applied(_detect(_read(sketch), align, detector)[1], {})


def report(face: FaceFit, path: Path | None = None) -> dict[str, Any]:
    """The contract's report; `projection` goes with the file written to `path` (default .glb)."""
    projection = face.drawing.matrix @ face.camera.matrix() @ file_to_core(path or Path("face.glb"))
    said = face.detection.to_json()
    for name, unit in said["aus"].items():  # as strong as the face has it
        unit["intensity"] = round(float(face.parameters.aus.get(name, 0.0)), 3)
        unit["active"] = unit["intensity"] > 0
    said["head"] = {
        name: round(math.degrees(angle), 2)
        for name, angle in zip(ANGLES, face.parameters.head, strict=True)
    }
    return {
        "sketch": str(face.drawing.source) if face.drawing.source else None,
        **said,
        "face": not face.detection.trouble,
        "turned": face.detection.clockwise,
        "faces": face.detection.faces_to_json(face.drawing.matrix),
        "identity": {name: float(v) for name, v in face.parameters.identity.items()},
        "projection": projection.tolist(),
        "hair": _hair_to_json(face.cut),
        "hat": _hat_to_json(face),
        "beard": _beard_to_json(face.grows),
        "contour_error_px": face.contour_error_px,
        "unmatched": [
            {"polyline": line.tolist(), "length_px": line_length(line)} for line in face.unmatched
        ],
        "timings_s": face.timings_s,  # the last, when all has been measured
    }


def _hair_to_json(cut: Cut | None) -> dict[str, Any] | None:
    """What kind of hair it is."""
    if cut is None:
        return None
    return {"falls": cut.hangs, "curl": round(cut.curl, 3), "colour": round(cut.colour, 3)}


def _hat_to_json(face: FaceFit) -> dict[str, Any] | None:
    """What kind of hat it is, or that there is one that the face does not wear."""
    if face.hat is None:
        return {"left_out": HAT_LEFT_OUT} if face.hat_left_out else None
    brim = float(face.hat.brim.max())
    return {"left_out": None, "brim_m": round(brim, 4), "colour": round(face.hat.colour, 3)}


def _beard_to_json(beard: Beard | None) -> dict[str, Any] | None:
    """What kind of beard it is."""
    if beard is None:
        return None
    return {
        "length_mm": round(1000 * float(beard.length.max()), 1),
        "moustache_mm": round(1000 * beard.moustache, 1),
        "curl": round(beard.curl, 3),
        "colour": round(beard.colour, 3),
    }


def preview(face: FaceFit) -> NDArray[np.uint8]:
    """(h, 4 w, 3) picture: sketch, fitted face, it in three quarters, its lines on the sketch."""
    from addon.preview import panels, three_quarters

    hair = face.hair
    if hair is not None and hair.strands is not None:  # locks lie where strands lie
        hair = hair_mesh(face.rig, face.parameters.identity, hair.cut, "locks")
    aside = replace(face.parameters, head=three_quarters(face.parameters.head))
    return panels(
        face.drawing.image,
        face.rig,
        face.parameters,
        face.vertices,
        face.posed(aside),
        face.camera,
        face.compared.unmatched,
        face.hair,
        face.hat_mesh,
        face.beard,
    )


def write_face(
    face: FaceFit, path: str | Path, outputs: Outputs | None = None, detail: str = FULL
) -> None:
    """Write the face to .glb, .obj, .ply or .blend, whole or not at all (see addon.export).

    detail : the level, one of facs_rig.levels.LEVELS
    """
    write_mesh(
        Path(path), face.rig, face.parameters, face.offsets, face.keys, face.hair,
        face.hat_mesh, face.beard, detail=detail, outputs=outputs,
    )  # fmt: skip


def _read(sketch: str | Path | Drawing | NDArray) -> Drawing:
    if isinstance(sketch, Drawing):
        return sketch
    if isinstance(sketch, np.ndarray):
        return Drawing.of(sketch)
    return load_drawing(sketch)


def _detect(
    drawing: Drawing, align: Box | str | None, detector: Detector | None
) -> tuple[Drawing, Detection]:
    """What is read from a drawing, and the drawing stood upright. InputError if it is no face."""
    head = head_in(drawing, align)
    detection = (detector or load_detector()).detect(drawing.image, head)
    if detection.trouble:
        raise InputError(detection.no_face(_name(drawing)))
    return drawing.turned(detection.turn), detection


def _applied(detection: Detection, decided: Mapping[str, float]) -> FaceParameters:
    """Expression and head as detected, but for the controls that the artist has decided."""
    aus = {**detection.expression(), **decided}
    return FaceParameters({name: float(v) for name, v in aus.items() if v}, {}, detection.head)


def _carved(
    fitted: Fitted, unmatched: list[NDArray[np.float64]], rig: FaceRig, options: FitOptions
) -> Fitted:
    """The face with those strokes carved into it that its skin has room for."""
    strokes = carvable(unmatched, rig, fitted.vertices, fitted.camera)
    depth = options.stroke_depth / 1000 * (1 if options.strokes == "engrave" else -1)
    width, profile = options.stroke_width / 1000, options.stroke_profile
    offsets = engrave(
        rig, fitted.parameters, fitted.offsets, fitted.camera, strokes, depth, width, profile
    )
    return replace(fitted, offsets=offsets, vertices=rig.pose(fitted.parameters, offsets))


def _exaggerated(fitted: Fitted, rig: FaceRig, much: float) -> Fitted:
    if much == 1:
        return fitted
    parameters, offsets = exaggerated(fitted.parameters, fitted.offsets, much)
    vertices = rig.pose(parameters, offsets)
    keys = tuple(key.exaggerated(much) for key in fitted.keys) if much else ()
    return replace(fitted, parameters=parameters, offsets=offsets, vertices=vertices, keys=keys)


def _name(drawing: Drawing) -> str:
    return f"'{drawing.source}'" if drawing.source else "the drawing"
