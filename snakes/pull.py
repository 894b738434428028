"""The last millimetres: a face's lines settle on the drawing's, and the skin follows smoothly.

Each line of the face is a snake (Kass, Witkin, Terzopoulos 1988, "Snakes: Active Contour Models")
that starts at rest where the face has it. Its points move across it alone, toward the line of the
drawing that lies and runs most like it; stretching (α) and bending (β) are those of the movement,
not of the line, so that a line at rest keeps its form. Ends are natural: A = α D1ᵀD1 + β D2ᵀD2,
which is stable at every step, and banded, so that all snakes take a step in a millisecond.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.sparse import csr_matrix

from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.rotation import rotation

from .field import smooth_field
from .lines import HEAD, Lines, SurfaceLines, nearest_lines
from .parts import carry_parts, keep_lids_on_eyes
from .skull import skull_triangles, under_hair
from .tweakables import Tweakables

__all__ = ["Held", "pull_skin", "line_moves"]

ROUNDS = 6
REACH = (0.012, 0.008)
"""How far a snake looks for a line, as a share of the head, at first and in the last round."""
TURN = 1.0
"""A right angle counts as this times the reach."""
ALPHA, BETA = 1.0, 20.0
SURE = 0.35
"""A point whose line is less sure says nothing to the skin."""
APART = 0.012
"""Of the points on a line those are asked that lie so far apart, as a share of the head."""
SIZE, ERROR = 0.004, 0.003
"""Metres: how large a movement of the skin is, and how far off what a line says."""
PIN_ERROR = 0.0002
"""Metres that a pinned landmark may be off."""
OPEN = {"jaw_open": 5.0}
"""Distance over the skin is that of a face with its mouth open: lips do not pull each other."""


@dataclass(frozen=True)
class Held:
    """Vertices of which something is known beside lines.

    index : (k,) vertices      ways : (k, 2) unit, in pixels      moves : (k,) pixels along them
    error : metres that these may be off
    """

    index: NDArray[np.intp]
    ways: NDArray[np.float64]
    moves: NDArray[np.float64]
    error: float

    @classmethod
    def nothing(cls) -> Held:
        return cls(np.zeros(0, np.intp), np.zeros((0, 2)), np.zeros(0), 1.0)


def line_moves(
    model: Lines,
    starts: NDArray[np.integer],
    drawn: Lines,
    reach: tuple[float, float],
    alpha: float = ALPHA,
    beta: float = BETA,
    rounds: int = ROUNDS,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far each point of some lines has to move across its line to lie on a drawing's.

    Parameters
    ----------
    model : k points of lines, one behind another      starts : (lines + 1,) where each begins
    drawn : lines of the drawing
    reach : pixels within which a line is looked for, at first and in the last round

    Returns
    -------
    moves : (k,) pixels along (-v, u) of the line's direction (u, v)
    sure : (k,) 0..1, how well a point's line fits; 0 where it found none and follows its neighbours
    """
    moves, sure = np.zeros(len(model.points)), np.zeros(len(model.points))
    if not len(model.points) or not len(drawn.points):
        return moves, sure
    normal = model.along[:, ::-1] * (-1, 1)
    stiff = _stiffness(starts, alpha, beta)
    for far in np.geomspace(*reach, rounds):
        here = replace(model, points=model.points + moves[:, None] * normal)
        pair, away = nearest_lines(drawn, here, TURN * far, 1.5 * far)
        target = np.einsum("kd,kd->k", drawn.points[pair] - model.points, normal)
        sure = np.where(pair >= 0, np.clip(1 - (away / (1.5 * far)) ** 2, 0, 1) ** 2, 0.0)
        bands = stiff.copy()
        bands[0] += sure + 1e-6
        moves = solveh_banded(bands, sure * target, lower=True)
    return moves, sure


def _stiffness(starts: NDArray[np.integer], alpha: float, beta: float) -> NDArray[np.float64]:
    """(3, k) lower bands of α D1ᵀD1 + β D2ᵀD2, whose differences never cross from line to line."""
    count = int(starts[-1])
    bands = np.zeros((3, count))
    line = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    for weight, pattern in ((alpha, (-1.0, 1.0)), (beta, (1.0, -2.0, 1.0))):
        reach = len(pattern)
        first = np.flatnonzero(line[: count - reach + 1] == line[reach - 1 :])
        for i, a in enumerate(pattern):
            for j, b in enumerate(pattern[: i + 1]):
                np.add.at(bands[i - j], first + j, weight * a * b)
    return bands


def pull_skin(
    drawn: Lines,
    model: SurfaceLines,
    rig: FaceRig,
    parameters: FaceParameters,
    camera: Camera,
    max_move: float,
    tweakables: Tweakables,
    pins: Mapping[str, tuple[float, float]] | None = None,
    hair: Callable[[NDArray], NDArray] | None = None,
    held: Held | None = None,
) -> NDArray[np.float64]:
    """Offsets (n, 3) in metres, head upright, that bring a face's lines onto a drawing's.

    model : the posed face's lines      max_move : metres, no vertex moves farther
    tweakables : Smoothness counts, of the snakes, Soft Select Distance: over as many centimetres a
    movement of the skin dies away, and Symmetry: how far the other side goes along
    pins : landmark -> (u, v) pixels where it has to be;  hair : see shape.Observations
    held : what else is known of some vertices
    """
    head = HEAD * camera.scale[0]
    reach = REACH[0] * head, REACH[1] * head
    stiff = ALPHA * tweakables.smoothness, BETA * tweakables.smoothness
    moves, sure = line_moves(model.lines, model.starts, drawn, reach, *stiff)
    over = skull_triangles(rig)[model.triangle]
    sure[under_hair(drawn, model.lines.points, over, head, hair)] = 0.0
    asked = np.flatnonzero((sure > SURE) & (np.abs(moves) <= max_move * camera.scale[0]))
    asked = asked[_thinned(model.lines.points[asked], APART * head)]
    pins = pins or {}
    held = held or Held.nothing()
    if not len(asked) and not pins:
        return np.zeros((rig.n_vertices, 3))
    matrix = rig.linear_parts()[0]
    opened = {**parameters.aus, **OPEN}
    spread = rig.cage(FaceParameters(opened, parameters.identity)).astype(float)
    corners = rig.triangles[model.triangle[asked]]
    pinned = rig.landmarks[[LANDMARKS.index(name) for name in pins]]
    posed = rig.pose(parameters)
    off = np.array(list(pins.values())).reshape(-1, 2) - camera.project(posed[pinned])
    places = np.einsum("kc,kcd->kd", model.weights[asked], posed[corners])
    wide = camera.relative_depth(np.concatenate([places, *[posed[pinned]] * 2, posed[held.index]]))
    normal = model.lines.along[asked][:, ::-1] * (-1, 1)
    # A pin is known in both directions, a line across itself alone.
    ways = np.concatenate([normal, *np.repeat(np.eye(2)[:, None], len(pins), axis=1), held.ways])
    turning = rotation(parameters.head)
    field = smooth_field(
        np.concatenate([_mixed(matrix, corners, model.weights[asked]) @ spread,
                        *[matrix[pinned] @ spread] * 2, matrix[held.index] @ spread]),
        (ways * (1, -1)) @ turning[:2],  # pixels run down, metres up; the head is upright
        np.concatenate([moves[asked], *off.T, held.moves]) * wide / camera.scale[0],
        np.concatenate([ERROR / np.sqrt(sure[asked]), np.full(2 * len(pins), PIN_ERROR),
                        np.full(len(held.index), held.error)]),
        spread,
        tweakables.soft_select_distance / 100,
        SIZE,
        tweakables.symmetry,
    )  # fmt: skip
    offsets = matrix @ field
    shape = rig.shape(parameters)
    offsets = keep_lids_on_eyes(rig, shape, carry_parts(rig, shape, offsets))
    far = np.linalg.norm(offsets, axis=1, keepdims=True)
    return offsets * np.minimum(1.0, max_move / np.maximum(far, 1e-12))


def _mixed(matrix, corners: NDArray, weights: NDArray):
    """Rows of the refinement (k, m) of points given by triangles' corners and weights (k, 3)."""
    return csr_matrix(sum(matrix[corners[:, c]].multiply(weights[:, c : c + 1]) for c in range(3)))


def _thinned(points: NDArray, apart: float) -> NDArray[np.intp]:
    """One point of each square cell of side `apart`."""
    _, first = np.unique(np.floor(points / apart), axis=0, return_index=True)
    return np.sort(first)
