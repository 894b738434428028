"""The two ways to fit a face to a drawing: by its lines, and as in the thesis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from addon.drawing import Drawing
from addon.options import FitOptions
from addon.placement import apart, check_pins, pins_in
from classifiers import Detection
from classifiers.detection import CLOSE
from classifiers.mouth import RIMS, Mouth
from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.common.box import Box
from facs_rig.fitted_keys import FittedKey
from snakes import Lines, Observations, PinsApart, fit_lines
from snakes.lines import HEAD
from snakes.shape import OPENERS

# A drawing that the detector believes to be a face with less than this has no landmarks to go by.
LEAST_FACE = 0.5
# A mouth is taken for open from these log-odds on: those of the closer look, and half those of the
# likeliest action that opens it, by the networks that see the whole face. Chosen by drawings whose
# mouths are known, so that few shut ones are opened. The distance between its rims is at best told
# with LEAST_GAP, a share of the head, else as its landmarks are.
OPENED, LEAST_GAP = 2.0, 0.008
MEETING = 0.5
"""How probable it is that teeth meet in it, from which on the jaw is taken for shut."""


@dataclass(frozen=True)
class Fitted:
    """A face as a method has fitted it to a drawing.

    offsets : (n, 3) float32 metres, for `rig.shape`      vertices : (n, 3) posed and fitted
    keys : what of the offsets goes with the drawn actions; the rest stays at rest
    camera : that of the drawing
    box : pixels of the drawing, where its lines were looked for
    drawn : these lines      model : the face's own before its skin was moved
    Both are None where the method did without; `addon.measure` works them out when asked for.
    """

    parameters: FaceParameters
    offsets: NDArray[np.float32]
    vertices: NDArray[np.float32]
    camera: Camera
    box: Box
    drawn: Lines | None = None
    model: Lines | None = None
    keys: tuple[FittedKey, ...] = ()


def by_lines(
    drawing: Drawing,
    detection: Detection,
    rig: FaceRig,
    expression: FaceParameters,
    camera: Camera,
    options: FitOptions,
) -> Fitted:
    """Person, expression and skin with which the face's lines lie on the drawing's.

    expression, camera : as detected and aligned
    Raises InputError where no face can have its pins.
    """
    pins = pins_in(drawing, options.pins)
    sure = detection.face_probability >= LEAST_FACE
    observed = replace(
        _observations(detection, camera.scale[0]) if sure else Observations({}, {}),
        pins=pins,
        decided=frozenset(options.expression),
    )
    try:
        found = fit_lines(
            drawing.image,
            rig,
            expression,
            camera,
            observed,
            options.tweakables,
            pull=options.method != "shape",
        )
    except PinsApart:
        raise apart(options.pins) from None
    vertices = rig.pose(found.parameters, found.offsets)
    check_pins(rig, vertices, found.camera, pins)
    model = found.model.lines if found.model else None
    return Fitted(
        found.parameters, found.offsets, vertices, found.camera, found.box, found.drawn, model,
        found.keys,
    )  # fmt: skip


def as_thesis(
    drawing: Drawing,
    detection: Detection,
    rig: FaceRig,
    expression: FaceParameters,
    camera: Camera,
    options: FitOptions,
) -> Fitted:
    """The face as detected, its skin moved by contours that slide over its shading (chapter 3).

    Pins only say where the head is. See `by_lines`.
    """
    from snakes import fit_offsets  # with more of scipy than the other methods need

    found = fit_offsets(drawing.image, rig, expression, camera, options.tweakables)
    vertices = rig.pose(expression, found.offsets)
    return Fitted(expression, found.offsets, vertices, camera, found.box)


def _observations(detection: Detection, scale: float) -> Observations:
    """What the detector saw, for the fit. A landmark's distance is distributed exponentially.

    scale : pixels of the drawing for a metre
    """
    height = np.ptp([v for _, v in detection.landmarks.values()])
    spreads = {
        name: -CLOSE * height / math.log(max(1 - near, 1e-9)) if near > 0 else math.inf
        for name, near in detection.confidences.items()
    }
    hair = detection.mask.hides if detection.mask else None
    seen = Observations(detection.landmarks, spreads, person=detection.person, hair=hair)
    mouth = detection.mouth
    if mouth is None or _open_odds(mouth, detection) < OPENED:
        return seen
    off = np.mean([mouth.spreads[name] for pair in RIMS for name in pair])
    return replace(
        seen,
        landmarks={**seen.landmarks, **mouth.landmarks},
        spreads={**spreads, **mouth.spreads},
        gap=max(LEAST_GAP, float(off) / (HEAD * scale)),
        clenched=mouth.meets > MEETING,
    )


def _open_odds(mouth: Mouth, detection: Detection) -> float:
    """The log-odds of an open mouth, by all that was seen of it."""
    acts = max(p for name, p in detection.probabilities.items() if name in OPENERS)
    odds = [math.log(p / (1 - p)) for p in np.clip([mouth.opened, acts], 1e-6, 1 - 1e-6)]
    return odds[0] + 0.5 * odds[1]
