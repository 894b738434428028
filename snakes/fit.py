"""The snakes stage: a drawing and a posed face in, offsets for its vertices out (thesis, ch. 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.common.box import Box
from facs_rig.common.clock import Clock
from facs_rig.common.polylines import line_length

from .active import FEWEST, relax
from .contours import cut_at_corners, find_lines, head_box, working_drawing
from .deltas import PixelDeltas, consistent, direct, on_line, pixel_deltas, runs
from .mapping import pixels_to_vertices, world_moves
from .offsets import merge_handles, proportional_edit, reach_of, symmetrise
from .parts import carry_parts, even_skull, skin_smoother, skin_triangles
from .render import Render, expression_render
from .tweakables import WORKING_SIZE, Tweakables

__all__ = ["Fit", "fit_offsets"]

DEPTH = 4.0
"""How many times farther than sideways a movement reaches along the line of sight.

An outline is where the surface turns away; moved alone it would become a groove or a flange."""
LOST = 0.3
"""A snake of which less than this share found a line tries once more on the shading."""
CROWD_REACH = 8.0
CROWD = 75
"""Contour points within CROWD_REACH pixels from which on lines are hatching; one line has 45."""
PASSES = 2
"""The second pass moves what the averaging of the first left over."""
SMOOTHINGS = 20
"""How often the movements are averaged with those of the neighbouring vertices."""
SHORTEST_UNMATCHED = 0.05
"""A stretch without a match is reported from this length on, as a fraction of the box' height."""


@dataclass(frozen=True)
class Fit:
    """What the snakes stage found; pixels are (u, v) of the drawing unless said otherwise.

    offsets : (n, 3) float32, metres, in the frame of the upright head, ready for FaceRig.shape
    unmatched : list of (k, 2) float64, lines of the drawing that nothing on the face answers to
    contours, snakes : lists of (k, 2) float64, each contour before and after it settled
    used : list of (k,) bool, the snake points whose delta counts
    deltas : PixelDeltas in pixels of the working image, those that were applied
    box : the crop
    drawing, render : (200, 91) float32, the two working images
    timings_s : seconds for each step
    """

    offsets: NDArray[np.float32]
    unmatched: list[NDArray[np.float64]]
    contours: list[NDArray[np.float64]]
    snakes: list[NDArray[np.float64]]
    used: list[NDArray[np.bool_]]
    deltas: PixelDeltas
    box: Box
    drawing: NDArray[np.float32]
    render: NDArray[np.float32]
    timings_s: dict[str, float]


def fit_offsets(
    drawing: NDArray[np.floating],
    rig: FaceRig,
    parameters: FaceParameters,
    camera: Camera,
    tweakables: Tweakables | None = None,
) -> Fit:
    """Find the offsets that bring the lines of a posed face to those of a drawing.

    Parameters
    ----------
    drawing : (h, w) float, 1 is paper, 0 is ink
    parameters : expression, identity and head of the face
    camera : of the drawing's pixels, h x w, in which the face covers that of the drawing
    tweakables : the defaults of the thesis if not given

    Raises ValueError when the drawing and the camera differ in size or the face is out of sight.
    """
    settings = tweakables or Tweakables()
    if drawing.shape != (camera.height, camera.width):
        raise ValueError(
            f"The camera is made for a drawing of {camera.width}x{camera.height} pixels, "
            f"this one has {drawing.shape[1]}x{drawing.shape[0]}."
        )
    clock = Clock()
    posed = rig.pose(parameters)
    box = head_box(posed, camera)
    small = camera.cropped(box.left, box.top, box.right, box.bottom, *WORKING_SIZE)
    render = expression_render(rig, posed, small)
    clock.lap("render")

    working = working_drawing(drawing, box)
    lines = find_lines(working, settings.gap_closing, settings.thinning_iterations)
    contours, strays = _near_face(lines, render.covered, settings)
    clock.lap("contours")

    snakes = _run(contours, render, settings)
    clock.lap("snakes")

    found, used = _collect(contours, snakes, render.lines, settings.max_delta)
    agreeing = consistent(found)
    found = PixelDeltas(found.pixels[agreeing], found.deltas[agreeing], found.counts[agreeing])
    used = _only_from(found.pixels, snakes, used)
    clock.lap("deltas")

    offsets = _apply(found, rig, parameters, posed, render.movable, small, settings)
    clock.lap("offsets")

    cell = np.array([box.width, box.height]) / WORKING_SIZE
    corner = np.array([box.left, box.top])
    shortest = SHORTEST_UNMATCHED * box.height
    lost = strays + [
        contour[part]
        for contour, taken in zip(contours, used, strict=True)
        for part in runs(~taken, 2)
    ]
    unmatched = [line * cell + corner for line in lost]
    unmatched = [line for line in unmatched if line_length(line) >= shortest]
    return Fit(
        offsets=offsets.astype(np.float32),
        unmatched=unmatched,
        contours=[line * cell + corner for line in contours],
        snakes=[line * cell + corner for line in snakes],
        used=used,
        deltas=found,
        box=box,
        drawing=working,
        render=render.lines,
        timings_s=clock.laps,
    )


def _near_face(
    lines: list[NDArray[np.float64]], covered: NDArray[np.bool_], settings: Tweakables
) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """Cut the contours into what can reach the face and what is too far from it to be tried."""
    away = distance_transform_edt(~covered) if covered.any() else np.full(covered.shape, np.inf)
    height, width = covered.shape
    near: list[NDArray[np.float64]] = []
    far: list[NDArray[np.float64]] = []
    for line in lines:
        column = np.clip(line[:, 0].astype(np.intp), 0, width - 1)
        row = np.clip(line[:, 1].astype(np.intp), 0, height - 1)
        reachable = away[row, column] <= settings.max_delta
        if reachable.all() and settings.snake_type == "periodic":
            line, reachable = line[:-1], reachable[:-1]
        if settings.snake_type == "periodic" and not reachable.all():
            reachable[:] = False
        for part in runs(reachable, FEWEST):
            whole = settings.snake_type == "periodic"
            near += [line[part]] if whole else cut_at_corners(line[part], FEWEST)
        far += [line[part] for part in runs(~reachable, 2)]
    return near, far


def _run(
    contours: list[NDArray[np.float64]], render: Render, settings: Tweakables
) -> list[NDArray[np.float64]]:
    """Let the contours settle on the lines, and those that found none on the shading.

    A line draws a snake from a few pixels beside it, the shading of the whole head from far away;
    but what slides far often meets the wrong line, so it is the second choice, and hatching, which
    is mostly hair, is left out of it.
    """
    snakes = relax(render.lines, contours, settings)
    if not snakes:
        return snakes
    _, used = _collect(contours, snakes, render.lines, settings.max_delta)
    tree = cKDTree(np.concatenate(contours))
    lost = [
        index
        for index, (line, flags) in enumerate(zip(contours, used, strict=True))
        if flags.mean() < LOST
        and tree.query_ball_point(line, CROWD_REACH, return_length=True).mean() < CROWD
    ]
    for index, snake in zip(
        lost, relax(render.shading, [contours[index] for index in lost], settings), strict=True
    ):
        snakes[index] = snake
    return snakes


def _collect(
    contours: list[NDArray[np.float64]],
    snakes: list[NDArray[np.float64]],
    render: NDArray[np.float32],
    max_delta: float,
) -> tuple[PixelDeltas, list[NDArray[np.bool_]]]:
    if not contours:
        empty = np.zeros((0, 2))
        return PixelDeltas(empty.astype(np.intp), empty, np.zeros(0, dtype=np.intp)), []
    before, after = np.concatenate(contours), np.concatenate(snakes)
    usable = direct(before, after) & on_line(render, after)
    found, used = pixel_deltas(before, after, WORKING_SIZE, max_delta, usable)
    return found, np.split(used, np.cumsum([len(line) for line in contours])[:-1])


def _only_from(
    pixels: NDArray[np.intp], snakes: list[NDArray[np.float64]], used: list[NDArray[np.bool_]]
) -> list[NDArray[np.bool_]]:
    """Take back the points whose pixel did not pass."""
    kept = np.zeros(WORKING_SIZE[::-1], dtype=bool)
    kept[pixels[:, 1], pixels[:, 0]] = True
    result = []
    for snake, flags in zip(snakes, used, strict=True):
        at = np.floor(np.where(flags[:, None], snake, 0.0)).astype(np.intp)
        result.append(flags & kept[at[:, 1], at[:, 0]])
    return result


def _apply(
    found: PixelDeltas,
    rig: FaceRig,
    parameters: FaceParameters,
    posed: NDArray[np.floating],
    candidates: NDArray[np.bool_],
    camera: Camera,
    settings: Tweakables,
) -> NDArray[np.float64]:
    """Move the vertices under the pixels and the skin around them; (n, 3) metres, head upright."""
    at = pixels_to_vertices(found.pixels, posed, candidates, camera, settings.low_depth_preference)
    moves = world_moves(found.deltas[at >= 0], posed[at[at >= 0]], camera)
    handles, owner, counts = np.unique(at[at >= 0], return_inverse=True, return_counts=True)
    mean = np.zeros((len(handles), 3))
    np.add.at(mean, owner, moves)
    mean /= np.maximum(counts, 1)[:, None]
    skin = np.flatnonzero(rig.parts["skin"])
    place = np.full(len(posed), -1, dtype=np.intp)
    place[skin] = np.arange(len(skin))
    flattened = posed[skin] * np.array([1.0, 1.0, 1.0 / DEPTH])
    smoother = skin_smoother(rig)
    surface = skin_triangles(rig) if settings.soft_select_connected else None
    offsets, weights = np.zeros((len(posed), 3)), np.zeros(len(posed))
    for _ in range(PASSES if len(handles) else 0):
        left = mean - offsets[handles]
        reach = reach_of(left, settings.soft_select_distance / 100.0)
        merged, left, reach = merge_handles(
            flattened, place[handles], left, reach, triangles=surface
        )
        moved, weight = proportional_edit(
            flattened, merged, left, reach, settings.soft_select_curve, triangles=surface
        )
        for _ in range(SMOOTHINGS):
            moved = smoother @ moved
        offsets[skin] += moved
        weights[skin] = np.maximum(weights[skin], weight)
    offsets[skin] = even_skull(rig, smoother, offsets[skin])
    offsets = rig.unturn_vectors(offsets, parameters).astype(np.float64)
    if settings.mirror:
        offsets = symmetrise(offsets, rig.mirror, np.minimum(weights, 1.0))
    return carry_parts(rig, rig.shape(parameters), offsets)
