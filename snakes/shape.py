"""Who and how the drawn face is: its parameters from landmarks and lines, before any snake runs.

The face is drawn, every point of its lines looks for the line of the drawing that lies and runs
most like it, and all parameters together take one step toward these: an active contour that has
the parameters of the face for its shape (Cootes et al. 1995, "Active Shape Models", CVIU; the
pairs are those of iterated closest points, Besl & McKay 1992). Only the distance across a line
counts, so that lines may slide along each other. Landmarks hold the features in their places from
the first step on, and what is known of faces holds the parameters near plain ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.common.errors import InputError
from facs_rig.derivatives import Slopes, SurfacePoints, movements, slopes, surface_points
from facs_rig.identity import BY_NAME, FEATURES, target_weights
from facs_rig.macros import ETHNICITIES
from facs_rig.rotation import rotation

from .lines import HEAD, Lines, nearest_lines
from .model_lines import face_contours
from .mouth import rims_of
from .skull import beyond_hair, skull_triangles, under_hair

__all__ = ["Observations", "PinsApart", "fit_shape"]


class PinsApart(InputError):
    """No face can have its landmarks where they are pinned."""


@dataclass(frozen=True)
class Observations:
    """What is known of a drawn face beside its lines.

    landmarks : name -> (u, v) pixels;  spreads : name -> pixels that each may be off
    pins : name -> (u, v) pixels, landmarks whose place the artist has said; they override the rest
    person : identity parameter -> what the drawing says of it, and how far off that may be
    hair : (k, 2) pixels -> (k,) bool, whether hair, a hat or a beard is drawn there
    mane : (k, 2) pixels of lines of hair, hat or beard: no skull reaches beyond them
    decided : controls whose intensity the artist has said; it stays whatever the lines look like
    gap : of a mouth that is drawn open, whatever actions were detected, how far off the distance
    between its rims may be, as a share of the head; None if nobody says that it is
    clenched : whether its teeth meet, if it is drawn open: lips open it, and the jaw is shut
    """

    landmarks: Mapping[str, tuple[float, float]]
    spreads: Mapping[str, float]
    pins: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    decided: frozenset[str] = frozenset()
    person: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    hair: Callable[[NDArray], NDArray] | None = None
    mane: NDArray[np.float64] | None = None
    gap: float | None = None
    clenched: bool = False


STEPS = (0.05, 0.025, 0.012)
"""How far, as a share of the head, a line looks for its own in each step."""
TURN = 1.0
"""A right angle counts as this times the reach."""
PAIR = 0.006
"""Error of a pair of lines that belong together, as a share of the head."""
INDEPENDENT = 600.0
"""So many pairs would know as much as all of them do, which are not independent."""
LEAST_SPREAD = 0.008
"""Of a landmark, as a share of the head."""
PINNED = 0.002
"""How far off a pin may be, as a share of the head."""
ROOM = 2.0
"""How many times as large or small as it was found a head may become by its pins."""
EFFECTIVE_LANDMARKS = 45.0
"""Effective sample size: the errors of a face's landmarks go together, so that all of them weigh as
much as so many independent ones."""
SPREAD = {"gender": 0.35, "age": 0.3, "weight": 0.4, "african": 0.3, "asian": 0.3, "caucasian": 0.3}
"""Standard deviations of identity parameters among people; of features FEATURE."""
FEATURE = 0.3
CAMERA = (0.2, 0.3, 0.3)
"""How far the camera may be off: the logarithm of its scale, its centre in heads."""
NEAR, NEARNESS, NEAREST = 0.35, 0.35, 1.4
"""How near the eye likely is, how far off that is, and the most: one over metres. People draw what
stands before them, photographs, and figures that nobody ever saw in perspective."""
POSE = np.radians((6.0, 6.0, 4.0))
"""How far the detected angles of the head may be off."""
INTENSITY, MOST = 0.7, 5.0
"""How far the intensity of an action that was detected may be off, and how strong it may become."""
OPENERS = {"jaw_open": 1.5, "lower_lip_depress": 2.0, "sneer": 1.0}
"""Of a mouth that is drawn open: what may open it though it was not detected, and how strong that
usually is."""
UNSEEN = 2.5
"""So many times its usual strength is the most that it may have then: networks see the rest."""
CLENCHED = {"jaw_open": 0.3, "lower_lip_depress": 4.0, "sneer": 3.0}
"""The same of one whose teeth meet."""
CLOSERS = {"shrug": 2.0, "lip_lock": 2.0, "lip_tighten": 2.0}
"""What hardly goes with an open mouth: so far it may be off."""
FAINT = 0.4
"""An action that was not detected counts from this intensity on."""
VIEW = 7
"""So many numbers say from where the face is seen, before those of who and how it is."""
WHO = ("gender", "age", "weight", *ETHNICITIES, *(f.name for f in FEATURES))
"""What of a person is looked for; the rest stays as it is."""
LIKELY_AGE = 0.3
"""Of somebody of whom nothing was seen."""
GROWN = (0.0, 1.0)
"""Range of `age`: lines alone do not tell a child from an adult with large eyes."""
CHILD = -0.25
"""`age` from which on, with its spread, somebody is taken for a child: 20 years."""
LEAST_DOUBT = 0.05
"""However sure it was seen what somebody is like."""
SEXES, DECIDED = (0.08, 0.92), 1.5
"""`gender` of most women and most men, and how decidedly one of them is taken: with 1 the error of
`gender` has the least square, with 1.5 the least mean, and faces differ more (docs/fit.md)."""
BY_LINES = {"gender": 0.12, "age": 0.25, "neck_girth": 0.25}
"""How far lines may take them from what was read: those that strangers draw say little of them, and
a neck is drawn by hair and collars."""
PLAIN = 0.005
"""An identity parameter so near its default is at it."""
HAIRY = 0.1
"""Lines over the skull know so much less than others where there is hair, that hides its end."""
WITHIN = 0.03
"""How far off the end of the outermost hair may be as that of the skull, as a share of the head."""


def fit_shape(
    drawn: Lines,
    rig: FaceRig,
    parameters: FaceParameters,
    camera: Camera,
    observed: Observations,
    steps: Sequence[float] = STEPS,
) -> tuple[FaceParameters, Camera]:
    """Identity, head, intensities and camera with which a face's lines lie on those of a drawing.

    drawn : lines of the drawing      parameters, camera : where to begin
    steps : reach of each step, as a share of the head

    Without lines the landmarks alone decide. Raises PinsApart where pins blow the face up or crush
    it.
    """
    guess = _Guess.of(parameters, camera, observed)
    values = guess.start(parameters)
    known = {**observed.landmarks, **observed.pins}
    marks = [name for name in known if name in LANDMARKS]
    rows = rig.landmarks[[LANDMARKS.index(name) for name in marks]]
    fixed = surface_points(rig, rows[:, None], np.ones((len(rows), 1)))
    places = np.array([known[name] for name in marks]).reshape(-1, 2)
    pinned = np.array([name in observed.pins for name in marks], dtype=bool)
    spreads = np.array([observed.spreads.get(name, 0.0) for name in marks])
    rims, down = rims_of(marks, places)
    skull = skull_triangles(rig)
    start, detected = camera, set(parameters.aus)
    for reach in (0.0, *steps):
        parameters, camera = guess.face(values, parameters, camera)
        _check_room(camera, start, observed.pins)
        head = HEAD * camera.scale[0]
        system, now = _System(guess, values), _Now.of(rig, guess, parameters, camera)
        jacobian, here = _moves(fixed, now)
        sure = 1 / np.maximum(spreads / head, LEAST_SPREAD)
        weight = sure * np.sqrt(EFFECTIVE_LANDMARKS / max(len(marks), 1))
        off = (places - here) / head
        far = np.linalg.norm(off, axis=1) * sure
        weight = weight / np.sqrt(1 + (far / 3) ** 2)  # Cauchy: some lie on the wrong feature
        weight = np.where(pinned, 1 / PINNED, weight)
        for axis in range(2):
            system.add(jacobian[:, :, axis].T / head, off[:, axis], weight)
        if observed.gap:
            upper, lower = rims
            apart = jacobian[:, lower] - jacobian[:, upper]
            short = off[lower] - off[upper]
            system.add(np.einsum("pkd,d->kp", apart, down) / head, short @ down,
                       np.full(len(short), 1 / observed.gap))  # fmt: skip
        if reach and len(drawn.points):
            model = face_contours(rig, rig.pose(parameters), camera)
            pair, away = nearest_lines(drawn, model.lines, TURN * reach * head, 1.5 * reach * head)
            some = np.flatnonzero(pair >= 0)
            if len(some):
                normal = model.lines.along[some][:, ::-1] * (-1, 1)
                points = surface_points(rig, rig.triangles[model.triangle[some]],
                                        model.weights[some])  # fmt: skip
                jacobian, _ = _moves(points, now)
                apart = (drawn.points[pair[some]] - model.lines.points[some]) / head
                across = np.einsum("pkd,kd->kp", jacobian, normal) / head
                share = np.clip(1 - (away[some] / (1.5 * reach * head)) ** 2, 0, 1)  # Tukey
                sure = share / (PAIR + 0.3 * reach) * np.sqrt(INDEPENDENT / len(pair))
                over = skull[model.triangle[some]]
                hair = under_hair(drawn, model.lines.points[some], over, head, observed.hair)
                sure = sure * np.where(hair, HAIRY, 1.0)
                system.add(across, np.einsum("kd,kd->k", apart, normal), sure)
            out, inward = beyond_hair(model, rig, camera, drawn.points, observed.mane)
            if len(out):
                points = surface_points(rig, rig.triangles[model.triangle[out]], model.weights[out])
                jacobian, _ = _moves(points, now)
                far = np.linalg.norm(inward, axis=1)
                along = np.einsum("pkd,kd->kp", jacobian, inward / far[:, None]) / head
                sure = np.sqrt(INDEPENDENT / len(model.lines.points)) / WITHIN
                system.add(along, far / head, np.full(len(out), sure))
        values = system.solve()
    parameters, camera = guess.face(values, parameters, camera)
    _check_room(camera, start, observed.pins)
    aus = {n: v for n, v in parameters.aus.items() if n in detected or v >= FAINT}
    return replace(parameters, aus=aus), camera


def _check_room(camera: Camera, start: Camera, pins: Mapping[str, tuple[float, float]]) -> None:
    """PinsApart for a face that grew or shrank too much, before it is drawn in its size."""
    # A scale that is not a number fails, too.
    if pins and not 1 / ROOM <= camera.scale[0] / start.scale[0] <= ROOM:
        raise PinsApart("no face can have its landmarks where they are pinned")


@dataclass(frozen=True)
class _Guess:
    """The parameters that are sought, in one vector: what is likely, and within which bounds.

    The vector : log of the camera's scale, its centre u and v (heads), one over its distance
    (metres), yaw, pitch, roll, then identity and controls by name.
    """

    identity: tuple[str, ...]
    controls: tuple[str, ...]
    likely: NDArray[np.float64]
    spread: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def of(cls, parameters: FaceParameters, camera: Camera, observed: Observations) -> _Guess:
        identity = WHO
        aus = {name: value for name, value in parameters.aus.items() if value}
        doubt = {}
        if observed.gap:
            openers = CLENCHED if observed.clenched else OPENERS
            doubt = {**openers, **CLOSERS}
            aus = {**dict.fromkeys(openers, 0.0), **aus}
            if observed.clenched and "jaw_open" not in observed.decided:
                aus["jaw_open"] = 0.0
        controls = tuple(name for name in aus if name not in observed.decided)
        head = HEAD * camera.scale[0]
        begin = np.log(camera.scale[0]), *(np.array(camera.centre) / head)
        rows = [
            (value, spread, -np.inf, np.inf) for value, spread in zip(begin, CAMERA, strict=True)
        ]
        rows += [(NEAR, NEARNESS, 0.0, NEAREST)]
        rows += [
            (angle, spread, -np.inf, np.inf)
            for angle, spread in zip(parameters.head, POSE, strict=True)
        ]
        rows += [_likely(name, observed.person, bool(observed.pins)) for name in identity]
        rows += [
            (aus[name], max(doubt.get(_whole(name), 0.0), INTENSITY), 0.0,
             MOST if aus[name] else min(UNSEEN * doubt[name], MOST))
            for name in controls
        ]  # fmt: skip
        likely, spread, low, high = np.array(rows).T
        return cls(identity, controls, likely, spread, low, high)

    def start(self, parameters: FaceParameters) -> NDArray[np.float64]:
        values = self.likely.copy()
        for k, name in enumerate(self.identity):
            values[VIEW + k] = parameters.identity.get(name, BY_NAME[name].default)
        return values

    def face(
        self, values: NDArray, parameters: FaceParameters, camera: Camera
    ) -> tuple[FaceParameters, Camera]:
        """The vector as a face and a camera."""
        scale = float(np.exp(values[0]))
        centre = values[1:3] * HEAD * scale
        distance = 1 / values[3] if values[3] > 0 else np.inf
        who, how = np.split(values[VIEW:], [len(self.identity)])
        yaw, pitch, roll = values[4:VIEW].tolist()
        return (
            replace(
                parameters,
                identity={
                    **parameters.identity,
                    **_telling(dict(zip(self.identity, who.tolist(), strict=True))),
                },
                aus={**parameters.aus, **dict(zip(self.controls, how.tolist(), strict=True))},
                head=(yaw, pitch, roll),
            ),
            replace(
                camera,
                scale=(scale, scale),
                centre=(float(centre[0]), float(centre[1])),
                distance=float(distance),
            ),
        )


def _whole(control: str) -> str:
    """The control that one of a side, or of one lip, is a part of."""
    for part in ("_left", "_right", "_upper", "_lower"):
        control = control.removesuffix(part)
    return control


def _telling(identity: Mapping[str, float]) -> dict[str, float]:
    """Identity parameters that are not plain, to four digits."""
    return {
        name: round(value, 4)
        for name, value in identity.items()
        if abs(value - BY_NAME[name].default) > PLAIN
    }


def _likely(
    name: str, person: Mapping[str, tuple[float, float]], pinned: bool = False
) -> tuple[float, float, float, float]:
    """What an identity parameter probably is, how far off that is, its least and its most.

    Of people in general, or where something was seen of who is drawn, of such people.
    pinned : whether the artist has said where landmarks are
    """
    feature = BY_NAME[name]
    least, most = feature.minimum, feature.maximum
    if name not in person:
        if name == "age":
            return LIKELY_AGE, SPREAD[name], *GROWN
        return feature.default, SPREAD.get(name, FEATURE), least, most
    seen, spread = person[name]
    if name == "gender":
        seen = _woman_or_man(seen, spread)
    if name == "age" and seen > CHILD - spread:
        least, _ = GROWN
    if name in BY_LINES and not pinned:
        spread = min(spread, BY_LINES[name])
    return float(np.clip(seen, least, most)), max(spread, LEAST_DOUBT), least, most


def _woman_or_man(seen: float, spread: float) -> float:
    """`gender` of what was seen, which may be so far off.

    Networks that doubt answer with the mean, and there nobody is: people are one of SEXES rather
    than between them. What was seen says how much likelier one is than the other.
    """
    woman, man = SEXES
    odds = DECIDED * (man - woman) * (seen - (woman + man) / 2) / spread**2
    share = 1 / (1 + np.exp(-np.clip(odds, -30, 30)))
    return float(woman + (man - woman) * share)


class _System:
    """Normal equations of one step, and the bounds within which its solution stays."""

    def __init__(self, guess: _Guess, values: NDArray) -> None:
        self.guess, self.values = guess, values
        sure = 1 / guess.spread**2
        self.matrix = np.diag(sure)
        self.right = sure * (guess.likely - values)

    def add(self, jacobian: NDArray, off: NDArray, weight: NDArray) -> None:
        """Rows (k, p) that should move by `off` (k,), as sure as `weight` (k,) says."""
        rows = jacobian * weight[:, None]
        self.matrix += rows.T @ rows
        self.right += rows.T @ (off * weight)

    def solve(self) -> NDArray[np.float64]:
        """The next values; what would leave its bounds stays at them and the rest goes on."""
        free = np.ones(len(self.right), dtype=bool)
        values = self.values
        for _ in range(8):
            matrix = self.matrix[np.ix_(free, free)]
            fixed = (values - self.values)[~free]
            right = self.right[free] - self.matrix[np.ix_(free, ~free)] @ fixed
            values = values.copy()
            values[free] = self.values[free] + np.linalg.solve(matrix, right)
            over = free & ((values < self.guess.low) | (values > self.guess.high))
            values = np.clip(values, self.guess.low, self.guess.high)
            if not over.any():
                break
            free &= ~over
        return values


@dataclass(frozen=True)
class _Now:
    """A face and a camera in one step, the weights of what shapes it, and how these change."""

    parameters: FaceParameters
    camera: Camera
    targets: NDArray[np.float32]
    keys: NDArray[np.float32]
    slopes: Slopes

    @classmethod
    def of(cls, rig: FaceRig, guess: _Guess, parameters: FaceParameters, camera: Camera) -> _Now:
        targets = target_weights(parameters.identity).astype(np.float32)
        change = slopes(rig, parameters, guess.identity, guess.controls)
        return cls(parameters, camera, targets, rig.key_values(parameters), change)


def _moves(points: SurfacePoints, now: _Now) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(p, k, 2) pixels that points move for each unit of the vector, and (k, 2) where they are."""
    parameters, camera = now.parameters, now.camera
    place = points.neutral + np.tensordot(now.keys, points.keys, axes=1)
    place = place + np.tensordot(now.targets, points.identity, axes=1)
    turning = rotation(parameters.head)
    scale = np.array([camera.scale[0], -camera.scale[0]])
    turned = place @ turning.T
    near = 1 / camera.distance
    wide = camera.relative_depth(turned)[:, None]
    flat = turned[:, :2] * scale / wide

    def seen(moves: NDArray) -> NDArray:  # movements (..., k, 3) in pixels
        return (moves[..., :2] * scale + flat * (near * moves[..., 2:])) / wide

    head = HEAD * camera.scale[0]
    here = flat + np.array(camera.centre)
    rows = [here, np.tile([head, 0.0], (len(flat), 1)), np.tile([0.0, head], (len(flat), 1)),
            flat * turned[:, 2:] / wide]  # fmt: skip
    for axis in range(3):
        ends = [list(parameters.head), list(parameters.head)]
        ends[0][axis] -= 1e-4
        ends[1][axis] += 1e-4
        slope = (rotation(ends[1]) - rotation(ends[0])) / 2e-4
        rows.append(seen(place @ slope.T))
    moved = seen(movements(points, now.slopes) @ turning.T.astype(np.float32))
    return np.concatenate([np.array(rows), moved]), here
