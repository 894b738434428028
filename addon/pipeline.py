"""From a sketch to a posable face: the one place where all stages are composed.

    drawing -> detector -> expression and head -> camera -> lines -> identity -> snakes -> offsets

`fit` does the work, `report` and `preview` say and show what came of it, `write_face` keeps it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.drawing import Drawing, SketchError, load_drawing
from addon.export import file_to_core, write_mesh
from addon.measure import Comparison, contours
from addon.placement import camera_for, check_pins, head_in, pins_in, within_room
from addon.threads import on_one_thread
from classifiers import Detection, Detector, load_detector
from classifiers.detector import ANGLES, CLOSE
from facs_rig import (
    CONTROL_NAMES,
    LANDMARKS,
    MAX_INTENSITY,
    Camera,
    FaceParameters,
    FaceRig,
    load_rig,
)
from facs_rig.common.files import Outputs
from facs_rig.parameters import nearest
from snakes import (
    DEEPEST,
    PROFILES,
    WIDEST,
    WORKING_SIZE,
    Evidence,
    Lines,
    Tweakables,
    carvable,
    centre_lines,
    engrave,
    fit_lines,
    head_box,
)

Progress = Callable[[int, int], None]
Shaped = Callable[[FaceParameters, NDArray[np.float32]], None]
STAGES = ("read", "detect", "align", "fit", "carve")
METHODS = ("lines", "shape", "thesis")
# What becomes of the strokes that have no place on the face.
UNMATCHED = ("ignore", "engrave", "emboss")
# A drawing that the detector believes to be a face with less than this is refused.
LEAST_FACE = 0.5


@dataclass(frozen=True)
class FitOptions:
    """How to fit; the defaults need no help from anybody.

    tweakables : the thesis' table          align : the head's box 'left,top,right,bottom' in
    pixels of the sketch, instead of the landmarks that the detector finds
    pins : landmark -> (u, v) pixels of the sketch where it is, instead of where it was found
    expression : control -> intensity 0..10 that the artist has settled, 0 is off; the fit keeps to
    it, whatever the detector or the lines say
    method : 'lines' brings the face's lines to the drawing's; 'shape' finds the same person and
    expression and leaves the skin alone, quick and smooth; 'thesis' lets the drawing's contours
    slide over the shaded face, with all the tweakables of its table (chapter 3)
    strokes : one of UNMATCHED, for the strokes that have no place on the face (snakes.strokes says
    which of them); stroke_depth, stroke_width in mm, stroke_profile : see snakes.engrave

    Raises ValueError, one sentence, for a value that cannot be used.
    """

    tweakables: Tweakables = field(default_factory=Tweakables)
    align: str | None = None
    pins: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    expression: Mapping[str, float] = field(default_factory=dict)
    method: str = "lines"
    strokes: str = "ignore"
    stroke_depth: float = 1.2
    stroke_width: float = 4.0
    stroke_profile: str = "crease"

    def __post_init__(self) -> None:
        for what, value, choices in (
            ("The method", self.method, METHODS),
            ("Unmatched strokes (strokes)", self.strokes, UNMATCHED),
            ("The stroke profile (stroke_profile)", self.stroke_profile, tuple(PROFILES)),
        ):
            if value not in choices:
                raise ValueError(f"{what} can be {', '.join(choices)}, not {value!r}.")
        for what, length, most in (
            ("The stroke depth (stroke_depth)", self.stroke_depth, 1000 * DEEPEST),
            ("The stroke width (stroke_width)", self.stroke_width, 1000 * WIDEST),
        ):
            if not 0 < length <= most:
                raise ValueError(f"{what} is more than 0 and at most {most:g} mm, not {length:g}.")
        for name, place in self.pins.items():
            if name not in LANDMARKS:
                hint = nearest(name, LANDMARKS) or "."
                raise ValueError(f"There is no landmark '{name}'{hint}")
            if len(place) != 2 or not all(map(math.isfinite, place)):
                raise ValueError(f"The pin of {name} is a place u,v in pixels, not {place}.")
        for name, intensity in self.expression.items():
            if name not in CONTROL_NAMES:
                hint = nearest(name, CONTROL_NAMES) or "; `sketch2face rig --list` shows all."
                raise ValueError(f"There is no control '{name}'{hint}")
            if not 0 <= intensity <= MAX_INTENSITY:  # not-a-number fails both
                raise ValueError(
                    f"The intensity of {name} is at least 0 and at most {MAX_INTENSITY:g}, "
                    f"not {intensity:g}."
                )


@dataclass(frozen=True)
class FaceFit:
    """A fitted face and how it came about. Pixels are those of `drawing.image`, which stands
    upright however the sketch was handed in.

    parameters : expression and head as detected and fitted, controls as settled, fitted identity
    offsets : (n, 3) float32 metres, for `rig.shape`      vertices : (n, 3) posed and fitted
    drawn : the middle of every stroke within the head's box
    compared : the face held against the sketch, before strokes were carved into it
    """

    drawing: Drawing
    detection: Detection
    rig: FaceRig
    parameters: FaceParameters
    offsets: NDArray[np.float32]
    vertices: NDArray[np.float32]
    camera: Camera
    drawn: Lines
    compared: Comparison
    stages_s: dict[str, float]

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
    `shaped(parameters, offsets)` is called once these are final: a face can be built in the
    meantime. What is only said about a fit is worked out when it is asked for.
    Raises SketchError, one sentence, for whatever cannot be read or shows no face, and ValueError
    for an unusable alignment.
    """
    options = options or FitOptions()
    clock = _Stages(progress)
    drawing = _read(sketch)
    clock.done("read")

    drawing, detection = _detect(drawing, options.align, detector)
    expression = _worn(detection, options.expression)
    clock.done("detect")

    rig = load_rig()
    template = FaceParameters(head=expression.head)
    place = partial(
        camera_for,
        drawing,
        rig,
        box=options.align,
        landmarks=detection.landmarks,
        pins=options.pins,
    )
    pins = pins_in(drawing, options.pins)
    camera = place(expression)
    plain = rig.pose(template), place(template)
    box = head_box(*plain)
    clock.done("align")

    if options.method == "thesis":
        from snakes import fit_offsets  # with more of scipy than the other methods need

        parameters = expression
        stage = fit_offsets(drawing.image, rig, parameters, camera, options.tweakables)
        offsets, drawn = stage.offsets, centre_lines(drawing.image, stage.box)
        before = contours(rig, rig.pose(parameters), camera)
    else:
        sure = detection.face_probability >= LEAST_FACE
        evidence = replace(
            _evidence(detection) if sure else Evidence({}, {}),
            pins=pins,
            settled=frozenset(options.expression),
        )
        found = fit_lines(
            drawing.image,
            rig,
            expression,
            camera,
            evidence,
            within_room(partial(contours, rig), camera, options.pins),
            options.tweakables,
            pull=options.method != "shape",
        )
        parameters, camera, offsets = found.parameters, found.camera, found.offsets
        drawn, before = found.drawn, found.model
    vertices = rig.pose(parameters, offsets)
    if options.method != "thesis":  # there pins only say where the head is
        check_pins(rig, vertices, camera, pins)
    if shaped and options.strokes == "ignore":
        shaped(parameters, offsets)
    clock.done("fit")

    compared = Comparison(
        drawing=drawing.image,
        drawn=drawn,
        box=box,
        reach=options.tweakables.max_delta * (box[3] - box[1]) / WORKING_SIZE[1],
        rig=rig,
        fitted=vertices,
        camera=camera,
        template=plain,
        before=before.lines,
    )
    if options.strokes != "ignore":
        lost = compared.unmatched
        clock.leave_out()
        strokes = carvable(lost, rig, vertices, camera)
        depth = options.stroke_depth / 1000 * (1 if options.strokes == "engrave" else -1)
        width, profile = options.stroke_width / 1000, options.stroke_profile
        offsets = engrave(rig, parameters, offsets, camera, strokes, depth, width, profile)
        vertices = rig.pose(parameters, offsets)
        if shaped:
            shaped(parameters, offsets)
    clock.done("carve")
    return FaceFit(
        drawing=drawing,
        detection=detection,
        rig=rig,
        parameters=parameters,
        offsets=offsets,
        vertices=vertices,
        camera=camera,
        drawn=drawn,
        compared=compared,
        stages_s=clock.laps,
    )


def read_expression(
    sketch: str | Path | Drawing | NDArray,
    align: str | None = None,
    detector: Detector | None = None,
) -> FaceParameters:
    """What the face in a sketch does, expression and head, without building it.

    sketch, align, detector : as for `fit`, which also raises the same errors
    """
    return _worn(_detect(_read(sketch), align, detector)[1], {})


def report(face: FaceFit, path: Path | None = None) -> dict[str, Any]:
    """The contract's report; `projection` goes with the file written to `path` (default .glb)."""
    projection = face.drawing.matrix @ face.camera.matrix() @ file_to_core(path or Path("face.glb"))
    said = face.detection.to_json()
    for name, unit in said["aus"].items():  # as strong as the face wears it
        worn = face.parameters.aus.get(name, 0.0)
        unit["intensity"] = round(float(worn), 3)
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
        "contour_error_px": face.contour_error_px,
        "unmatched": [
            {"polyline": line.tolist(), "length_px": float(_length(line))}
            for line in face.unmatched
        ],
        "timings_s": face.timings_s,  # the last, when all has been measured
    }


def preview(face: FaceFit) -> NDArray[np.uint8]:
    """(h, 4 w, 3) picture: sketch, detected expression, fitted face, its lines on the sketch."""
    from addon.preview import panels

    homeless = [face.drawing.to_image(line) for line in face.unmatched]
    return panels(
        face.drawing.image, face.rig, face.parameters, face.vertices, face.camera, homeless
    )


def write_face(face: FaceFit, path: str | Path, outputs: Outputs | None = None) -> None:
    """Write the face to .glb, .obj, .ply or .blend, whole or not at all (see addon.export)."""
    write_mesh(Path(path), face.rig, face.parameters, face.offsets, outputs=outputs)


def _read(sketch: str | Path | Drawing | NDArray) -> Drawing:
    if isinstance(sketch, Drawing):
        return sketch
    if isinstance(sketch, np.ndarray):
        return Drawing.of(sketch)
    return load_drawing(sketch)


def _detect(
    drawing: Drawing, align: str | None, detector: Detector | None
) -> tuple[Drawing, Detection]:
    """What is read from a drawing, and the drawing stood upright. SketchError if it is no face."""
    head = head_in(drawing, align)
    detection = (detector or load_detector()).detect(drawing.image, head)
    if detection.trouble:
        raise SketchError(detection.no_face(_name(drawing)))
    return drawing.turned(detection.turn), detection


def _worn(detection: Detection, settled: Mapping[str, float]) -> FaceParameters:
    """Expression and head as detected, but for the controls that the artist has settled."""
    aus = {**detection.expression(), **settled}
    return FaceParameters({name: float(v) for name, v in aus.items() if v}, {}, detection.head)


def _evidence(detection: Detection) -> Evidence:
    """What the detector saw, for the fit. A landmark's distance is distributed exponentially."""
    height = np.ptp([v for _, v in detection.landmarks.values()])
    spreads = {
        name: -CLOSE * height / math.log(max(1 - near, 1e-9)) if near > 0 else math.inf
        for name, near in detection.confidences.items()
    }
    return Evidence(detection.landmarks, spreads)


def _name(drawing: Drawing) -> str:
    return f"'{drawing.source}'" if drawing.source else "the drawing"


def _length(line: NDArray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


class _Stages:
    """Seconds of each stage, and progress after it."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def leave_out(self) -> None:
        """Do not count what was done since the last stage: its time is known already."""
        self._last = time.perf_counter()

    def done(self, stage: str) -> None:
        now = time.perf_counter()
        self.laps[stage], self._last = now - self._last, now
        if self._progress:
            self._progress(len(self.laps), len(STAGES))
