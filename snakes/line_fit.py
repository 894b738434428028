"""From a detected face to the drawn one: parameters first, then snakes for what is left.

The thesis lets the sketch's contours slide down the shading of the face. Here the lines of both are
compared, which is quicker and comes closer (docs/fit.md); `snakes.fit` is the thesis' own way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.coarse import coarse_rig
from facs_rig.common.box import Box
from facs_rig.common.clock import Clock
from facs_rig.common.polylines import line_length
from facs_rig.fitted_keys import FittedKey

from .at_rest import expression_keys
from .brows import brow_thickness
from .contours import head_box
from .creases import drawn_wrinkles
from .deltas import runs
from .lines import HEAD, Lines, SurfaceLines, centre_lines, nearest_lines, paths
from .model_lines import face_contours
from .mouth import held_rims, with_rims, without_teeth
from .offsets import symmetrise
from .parts import skin_smoother, unfold
from .pull import pull_skin
from .shape import Observations, fit_shape
from .tweakables import WORKING_SIZE, Tweakables

__all__ = ["LineFit", "fit_lines", "unmatched_lines"]

ANSWERS = 0.02
"""A line of the face answers one of the drawing that lies so near, as a share of the head."""
SHORTEST = 0.035
"""A stretch without an answer is reported from this length on, as a share of the head."""
BRIDGED = 0.02
"""Of a stretch without an answer, what may have one by chance, as a share of the head."""


@dataclass(frozen=True)
class LineFit:
    """A face whose lines lie on a drawing's.

    parameters, camera : with identity, head and intensities as the lines have them
    offsets : (n, 3) float32, metres, head upright, for FaceRig.shape
    keys : what of them goes with the drawn actions
    box : pixels of the drawing, where its lines were looked for
    drawn : these lines      model : the face's before the offsets; None where it has none
    timings_s : seconds for each step
    """

    parameters: FaceParameters
    camera: Camera
    offsets: NDArray[np.float32]
    keys: tuple[FittedKey, ...]
    box: Box
    drawn: Lines
    model: SurfaceLines | None
    timings_s: dict[str, float]


def fit_lines(
    drawing: NDArray[np.floating],
    rig: FaceRig,
    parameters: FaceParameters,
    camera: Camera,
    observed: Observations,
    tweakables: Tweakables | None = None,
    pull: bool = True,
) -> LineFit:
    """Fit a face to a drawing (h, w; 1 is paper).

    parameters, camera : as detected and aligned      observed : what else is known of the drawing
    tweakables : LINE_TWEAKABLES of them count
    pull : False leaves the skin as the parameters shape it, smooth, with offsets of 0

    Raises ValueError when the drawing and the camera differ in size or the face is out of sight,
    and its PinsApart where no face can have all pins.
    """
    settings = tweakables or Tweakables()
    if drawing.shape != (camera.height, camera.width):
        raise ValueError(
            f"The camera is made for a drawing of {camera.width}x{camera.height} pixels, "
            f"this one has {drawing.shape[1]}x{drawing.shape[0]}."
        )
    clock = Clock()
    box = head_box(rig.pose(parameters), camera)
    drawn = centre_lines(drawing, box)
    faces, mane = _apart(drawn, observed)
    observed = replace(with_rims(observed, faces), mane=mane.points)
    faces = without_teeth(faces, observed)
    clock.lap("lines")
    # Where lines run is plain from fewer triangles; the skin is pulled by those of all.
    few = coarse_rig(rig)
    if observed.pins:  # far from what is drawn, lines would lead astray before these are met
        bare = faces.some(np.zeros(len(faces.points), bool))
        parameters, camera = fit_shape(bare, few, parameters, camera, observed)
    parameters, camera = fit_shape(faces, few, parameters, camera, observed)
    posed = rig.pose(parameters)
    thick = brow_thickness(drawing, rig, posed, camera, parameters.identity)
    deep = round(drawn_wrinkles(faces, mane, rig, posed, camera, parameters), 4)
    seen = {} if thick is None else {"brow_thickness": round(thick, 4)}
    seen |= {"wrinkles": deep} if deep else {}
    if seen:
        parameters = replace(parameters, identity={**parameters.identity, **seen})
        posed = rig.pose(parameters)
    clock.lap("shape")
    model = face_contours(rig, posed, camera) if pull else None
    if model:
        most = settings.max_delta * box.height / WORKING_SIZE[1] / camera.scale[0]
        offsets = pull_skin(faces, model, rig, parameters, camera, most, settings,
                            observed.pins, observed.hair,
                            held_rims(rig, posed, camera, observed))  # fmt: skip
        if settings.mirror:
            offsets = symmetrise(offsets, rig.mirror)
        offsets = unfold(rig, skin_smoother(rig), rig.shape(parameters), offsets)
    else:
        offsets = np.zeros((rig.n_vertices, 3))
    clock.lap("skin")
    single = offsets.astype(np.float32)
    keys = expression_keys(rig, parameters, single, settings.symmetry)
    clock.lap("keys")
    return LineFit(parameters, camera, single, keys, box, drawn, model, clock.laps)


def _apart(drawn: Lines, observed: Observations) -> tuple[Lines, Lines]:
    """The lines of a drawing that are of the face, and those of hair, hat or beard: a face has no
    such lines to lie on them, and its outline is not to follow them."""
    if observed.hair is None or not len(drawn.points):
        return drawn, drawn.some(np.zeros(len(drawn.points), bool))
    hair = observed.hair(drawn.points)
    return drawn.some(~hair), drawn.some(hair)


def unmatched_lines(drawn: Lines, model: Lines, camera: Camera) -> list[NDArray[np.float64]]:
    """The stretches of a drawing's lines that nothing on the face answers to; (k, 2) pixels each.

    model : all lines of the fitted face, as many kinds as can be drawn
    """
    head = HEAD * camera.scale[0]
    pair, _ = nearest_lines(among=model, of=drawn, turn=ANSWERS * head, reach=ANSWERS * head)
    step = drawn.spacing
    found = []
    for path in paths(drawn.points, 1.6 * step):
        lost = pair[path] < 0
        for gap in runs(~lost):
            inner = gap.start > 0 and gap.stop < len(path)
            if inner and (gap.stop - gap.start) * step < BRIDGED * head:
                lost[gap] = True
        for part in runs(lost, 2):
            line = drawn.points[path[part]]
            if line_length(line) >= SHORTEST * head:
                found.append(line)
    return found
