"""From a sketch to a posable face: the one place where all stages are composed.

    drawing -> detector -> expression and head -> camera -> identity -> snakes -> offsets

`fit` does the work, `report` and `preview` say and show what came of it, `write_face` keeps it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.drawing import Drawing, SketchError, load_drawing
from addon.export import file_to_core, write_mesh
from addon.measure import contour_error, ruler
from classifiers import Detection, load_detector
from classifiers.preprocess import Crop
from facs_rig import Camera, FaceParameters, FaceRig, load_rig
from snakes import (
    WORKING_SIZE,
    Tweakables,
    align,
    fit_identity,
    fit_offsets,
    head_box,
    parse_box,
)

Progress = Callable[[int, int], None]
STAGES = ("read", "detect", "align", "identity", "snakes", "measure")
# A drawing that the detector believes to be a face with less than this is refused.
LEAST_FACE = 0.5
# How much of the identity that the landmarks suggest is tried; the first that brings the lines
# closer stays.
IDENTITY_SHARES = (1.0, 0.5)


@dataclass(frozen=True)
class FitOptions:
    """How to fit; the defaults need no help from anybody.

    tweakables : the thesis' table          align : the head's box 'left,top,right,bottom' in
    pixels of the sketch, instead of the landmarks that the detector finds
    """

    tweakables: Tweakables = field(default_factory=Tweakables)
    align: str | None = None


@dataclass(frozen=True)
class FaceFit:
    """A fitted face and how it came about. Pixels are those of `drawing.image`.

    parameters : detected expression and head, fitted identity
    offsets : (n, 3) float32 metres, for `rig.shape`      vertices : (n, 3) posed and fitted
    contour_error_px, unmatched : in pixels of the sketch as it was handed in
    """

    drawing: Drawing
    detection: Detection
    rig: FaceRig
    parameters: FaceParameters
    offsets: NDArray[np.float32]
    vertices: NDArray[np.float32]
    camera: Camera
    contour_error_px: dict[str, float]
    unmatched: list[NDArray[np.float64]]
    timings_s: dict[str, float]


def fit(
    sketch: str | Path | Drawing | NDArray,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> FaceFit:
    """Fit the face to a sketch: a file, a loaded Drawing, or a picture (h, w) or (h, w, 3 or 4).

    `progress(done, total)` is called after each stage. Raises SketchError, one sentence, for
    whatever cannot be read or shows no face, and ValueError for an unusable alignment.
    """
    options = options or FitOptions()
    clock = _Stages(progress)
    drawing = _read(sketch)
    clock.done("read")

    head = None
    if options.align is not None:
        left, top, right, bottom = _box(drawing, options.align)
        head = Crop(left, top, right - left, bottom - top)
    detection = load_detector().detect(drawing.image, head)
    if detection.face_probability < LEAST_FACE and options.align is None:
        raise SketchError(
            f"No face was found in {_name(drawing)}; crop the picture to one drawn face, seen "
            "from the front or in three-quarter view, or say where in the picture the head is."
        )
    expression = FaceParameters(aus=detection.expression(), head=detection.head)
    clock.done("detect")

    rig = load_rig()
    template = FaceParameters(head=expression.head)
    place = partial(_align, drawing, rig, detection, options)
    box = head_box(rig.pose(template), place(template))
    reach = options.tweakables.max_delta * (box[3] - box[1]) / WORKING_SIZE[1]
    error = partial(contour_error, ruler(drawing.image, box, reach), rig)
    errors = {"template": error(rig.pose(template), place(template))}
    clock.done("align")

    parameters, camera = expression, place(expression)
    errors["expression"] = error(rig.pose(parameters), camera)
    if options.align is None:
        found = fit_identity(rig, expression, camera, detection.landmarks)
        for share in IDENTITY_SHARES:
            tried = replace(expression, identity={k: share * v for k, v in found.items()})
            error_px = error(rig.pose(tried), place(tried))
            if error_px < errors["expression"]:
                parameters, camera, errors["expression"] = tried, place(tried), error_px
                break
    clock.done("identity")

    result = fit_offsets(drawing.image, rig, parameters, camera, options.tweakables)
    vertices = rig.pose(parameters, result.offsets)
    clock.done("snakes")

    errors["fitted"] = error(vertices, camera)
    scale = float(np.mean(drawing.scale))
    clock.done("measure")
    return FaceFit(
        drawing=drawing,
        detection=detection,
        rig=rig,
        parameters=parameters,
        offsets=result.offsets,
        vertices=vertices,
        camera=camera,
        contour_error_px={name: scale * e for name, e in errors.items()},
        unmatched=[drawing.to_input(line) for line in result.unmatched],
        timings_s=clock.timings(),
    )


def report(face: FaceFit, path: Path | None = None) -> dict[str, Any]:
    """The contract's report; `projection` goes with the file written to `path` (default .glb)."""
    to_input = np.diag([*face.drawing.scale, 1.0])
    projection = to_input @ face.camera.matrix() @ file_to_core(path or Path("face.glb"))
    return {
        "sketch": str(face.drawing.source) if face.drawing.source else None,
        **face.detection.to_json(),
        "faces": face.detection.faces_to_json(face.drawing.scale),
        "identity": {name: float(v) for name, v in face.parameters.identity.items()},
        "projection": projection.tolist(),
        "contour_error_px": face.contour_error_px,
        "unmatched": [
            {"polyline": line.tolist(), "length_px": float(_length(line))}
            for line in face.unmatched
        ],
        "timings_s": face.timings_s,
    }


def preview(face: FaceFit) -> NDArray[np.uint8]:
    """(h, 4 w, 3) picture: sketch, detected expression, fitted face, its lines on the sketch."""
    from addon.preview import panels

    return panels(face.drawing.image, face.rig, face.parameters, face.vertices, face.camera)


def write_face(face: FaceFit, path: str | Path) -> None:
    """Write the face to .glb, .obj, .ply or .blend, whole or not at all (see addon.export)."""
    write_mesh(Path(path), face.rig, face.parameters, face.offsets)


def _read(sketch: str | Path | Drawing | NDArray) -> Drawing:
    if isinstance(sketch, Drawing):
        return sketch
    if isinstance(sketch, np.ndarray):
        return Drawing.of(sketch)
    return load_drawing(sketch)


def _align(
    drawing: Drawing,
    rig: FaceRig,
    detection: Detection,
    options: FitOptions,
    parameters: FaceParameters,
) -> Camera:
    if options.align is None:
        return align(drawing.image, rig, parameters, detection.landmarks)
    return align(drawing.image, rig, parameters, box=_box(drawing, options.align))


def _box(drawing: Drawing, text: str) -> tuple[float, float, float, float]:
    """The head's box in pixels of `drawing.image`; the text's are of the picture handed in."""
    su, sv = drawing.scale
    left, top, right, bottom = parse_box(text)
    return left / su, top / sv, right / su, bottom / sv


def _name(drawing: Drawing) -> str:
    return f"'{drawing.source}'" if drawing.source else "the drawing"


def _length(line: NDArray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


class _Stages:
    """Seconds of each stage, and progress after it."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._laps: dict[str, float] = {}
        self._start = self._last = time.perf_counter()

    def done(self, stage: str) -> None:
        now = time.perf_counter()
        self._laps[stage], self._last = now - self._last, now
        if self._progress:
            self._progress(len(self._laps), len(STAGES))

    def timings(self) -> dict[str, float]:
        return {**self._laps, "total": time.perf_counter() - self._start}
