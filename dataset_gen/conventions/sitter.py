"""The face as an artist sees it: its own curves on the page, and how this artist bends them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.folds import line_depths
from facs_rig.identity import crease_gain

from .artist import Artist
from .bending import Frame, ear_grown, jaw_bent, moved, overdone
from .places import Places, places_of
from .shapes import Points, even

UNIT = 0.1  # metres on the head's height that all proportions are given in: about eyes to chin
RAYS = 96  # directions in which outlines are looked for, from above to the right
NECK = 1.34  # units below the eyes where the neck ends
NARROW = 0.94  # of the neck as the skin has it: how wide it is drawn
SIDES = ("left", "right")
BARING = ("smile", "grimace", "sneer", "lower_lip_depress")  # what teeth may be bared in
FAR_EAR = -0.42  # how far an ear may be turned away and still be seen
SEEN = 0.08  # n·v from which a place on the skin is seen
SOFT = np.array([0.03, 0.08, 0.14, 0.16, 0.18, 0.16, 0.14, 0.08, 0.03])  # between rays
ANGLES = np.linspace(0, 2 * np.pi, RAYS, endpoint=False)


@dataclass(frozen=True)
class Sitter:
    """Everything that is drawn of a posed face, in pixels.

    curves : name -> (k, 2)        seen : name -> (k,) bool, whether that part faces the viewer
    creases : name -> how deep, 1 at full natural activation        crease_names : of all
    face, head : (RAYS, 2) outlines of the face within jaw and hairline, of the whole skull
    ears : side -> (k, 2) its outline, of the ears that are seen
    neck : (2, k, 2) its right and left side in the picture, downward
    landmarks : (m, 2) where this artist has them
    origin, right, down, unit : the frame: between the eyes, unit vectors, pixels of 0.1 m
    turn : how far the nose points to the picture's right, -1 to 1        person : its identity
    smile : how much both corners of the mouth smile, 1 at full natural activation
    bared : how much the mouth is stretched or smiles, so that teeth may be shown
    """

    curves: dict[str, Points]
    seen: dict[str, NDArray[np.bool_]]
    creases: dict[str, float]
    crease_names: tuple[str, ...]
    face: Points
    head: Points
    ears: dict[str, Points]
    neck: Points
    landmarks: Points
    origin: Points
    right: Points
    down: Points
    unit: float
    turn: float
    person: Mapping[str, float]
    smile: float
    bared: float

    def at(self, x: NDArray | float, y: NDArray | float) -> Points:
        """Pixels (..., 2) of places in the frame, in units."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        return self.origin + self.unit * (x[..., None] * self.right + y[..., None] * self.down)

    def local(self, points: NDArray) -> Points:
        """Units (..., 2) in the frame of pixels."""
        away = (np.asarray(points, float) - self.origin) / self.unit
        return np.stack([away @ self.right, away @ self.down], axis=-1)

    def mark(self, name: str) -> Points:
        """(2,) a landmark."""
        return self.landmarks[LANDMARKS.index(name)]

    @property
    def far(self) -> str:
        """The face's own side that is turned away."""
        return "left" if self.turn > 0 else "right"


def sit(
    rig: FaceRig, vertices: NDArray, camera: Camera, parameters: FaceParameters, artist: Artist
) -> Sitter:
    """The posed face (n, 3) before this artist; parameters : its own."""
    places = places_of(rig)
    axes = _axes(rig, vertices)
    points = np.einsum("kc,kcd->kd", places.weight, vertices[places.index])
    flat = camera.project(points).astype(float)
    facing = (places.normals @ axes)[:, 2] > SEEN
    frame = _frame(axes, points[_eyes(places)], camera)
    rest = flat
    if artist.overdo > 1 and any(parameters.aus.values()):
        resting = rig.pose(replace(parameters, aus={}))
        rest = np.einsum("kc,kcd->kd", places.weight, resting[places.index])
        rest = camera.project(rest).astype(float)
    flat = overdone(flat, rest, places, frame, artist)
    flat = frame.stretched(moved(flat, places, frame, artist), artist)
    face, head = _outlines(places, vertices, camera, frame)
    ears = {
        side: _around(camera.project(vertices[at]).astype(float))
        for side, at in places.ears.items()
        if (1 if side == "left" else -1) * axes[0, 2] > FAR_EAR
    }
    neck = _neck(camera.project(vertices[places.neck]).astype(float), frame)
    return Sitter(
        {name: flat[at] for name, at in places.curves.items()},
        {name: facing[at] for name, at in places.curves.items()},
        _creases(places, parameters),
        tuple(places.controls),
        frame.stretched(jaw_bent(face, frame, artist), artist),
        frame.stretched(head, artist),
        {k: frame.stretched(ear_grown(ear, frame, artist), artist) for k, ear in ears.items()},
        frame.stretched(neck, artist),
        flat[places.curves["landmarks"]],
        frame.origin, frame.right, frame.down, frame.unit, frame.turn, parameters.identity,
        float(parameters.aus.get("smile", 0.0)) / 5,
        max(float(parameters.aus.get(name, 0.0)) for name in BARING) / 5,
    )  # fmt: skip


def face_outline(rig: FaceRig, vertices: NDArray, camera: Camera) -> Points:
    """The outline (RAYS, 2), in pixels, of a posed face within its jaw and hairline, as it is."""
    places = places_of(rig)
    eyes = _eyes(places)
    pupils = np.einsum("kc,kcd->kd", places.weight[eyes], vertices[places.index[eyes]])
    frame = _frame(_axes(rig, vertices), pupils, camera)
    face = camera.project(vertices[places.face]).astype(float)
    outline = _outline(face, (face.min(axis=0) + face.max(axis=0)) / 2, frame)
    plain = Artist()
    return frame.stretched(jaw_bent(outline, frame, plain), plain)


def _eyes(places: Places) -> list[int]:
    """Which of its points are the pupils."""
    return [places.curves["landmarks"].start + LANDMARKS.index(f"pupil_{s}") for s in SIDES]


def _frame(axes: NDArray, pupils: NDArray, camera: Camera) -> Frame:
    """The frame of a head with these axes and pupils (2, 3)."""
    origin = camera.project(pupils).astype(float).mean(axis=0)
    near = float(camera.relative_depth(pupils).mean())
    up = axes[1, :2] * [1, -1]
    down = -up / max(float(np.hypot(*up)), 1e-9)
    return Frame(
        origin, np.array([down[1], -down[0]]), down, float(np.mean(camera.scale)) * UNIT / near,
        float(axes[2, 0]),
    )  # fmt: skip


def _axes(rig: FaceRig, vertices: NDArray) -> NDArray[np.float64]:
    """(3, 3) the head's own axes x, y, z as rows."""
    curve = next(iter(rig.curves.values()))
    axes = np.asarray(curve.axes @ vertices[curve.anchors], float)
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def _creases(places: Places, parameters: FaceParameters) -> dict[str, float]:
    """How deep the expression folds each crease of this person, 1 at full natural activation."""
    if parameters.identity.get("wrinkles") == -1:
        return {}
    gain = float(np.clip(crease_gain(parameters.identity), 0.4, 1.5))
    worn = {name: value for name, value in parameters.aus.items() if value > 0}
    own, out = line_depths(parameters.identity), {}
    for name, controls in places.controls.items():
        other = "right" if name.endswith("left") else "left"
        depth = sum(worn.get(c, 0.0) for c in controls if not c.endswith(other))
        if depth and own[name]:
            out[name] = gain * own[name] * float(depth) / 5
    return out


def _outlines(
    places: Places, vertices: NDArray, camera: Camera, at: Frame
) -> tuple[Points, Points]:
    """The outlines (RAYS, 2) of the face and of the skull, about the middle of the face."""
    face, head = (
        camera.project(vertices[part]).astype(float) for part in (places.face, places.head)
    )
    centre = (face.min(axis=0) + face.max(axis=0)) / 2
    return _outline(face, centre, at), _outline(np.concatenate([head, face]), centre, at)


def _outline(points: NDArray, centre: NDArray, at: Frame) -> Points:
    """(RAYS, 2) how far points (k, 2) reach from a centre."""
    x, up = ((points - centre) @ np.stack([at.right, -at.down], axis=1)).T
    ray = np.round(np.arctan2(x, up) / (2 * np.pi) * RAYS).astype(np.int64) % RAYS
    far = np.zeros(RAYS)
    np.maximum.at(far, ray, np.hypot(x, up))
    known = np.flatnonzero(far > 0)
    far = np.interp(np.arange(RAYS), known, far[known], period=RAYS)
    wide = len(SOFT) // 2
    padded = np.concatenate([far[-wide:], far, far[:wide]])
    far = np.convolve(padded, SOFT, mode="valid")
    ways = np.sin(ANGLES)[:, None] * at.right - np.cos(ANGLES)[:, None] * at.down
    return centre + far[:, None] * ways


def _around(points: NDArray, count: int = 30) -> Points:
    """The outline (count, 2) of a small round thing, closed."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    ways = np.stack([np.sin(ANGLES), -np.cos(ANGLES)], axis=1)
    tips = ((points - centre) @ ways.T).argmax(axis=0)
    hull = points[tips[np.flatnonzero(np.diff(tips, append=tips[:1]))]]
    hull = even(np.concatenate([hull, hull[:1]]), count)[:-1]
    soft = 0.5 * hull + 0.25 * (np.roll(hull, 1, axis=0) + np.roll(hull, -1, axis=0))
    return np.concatenate([soft, soft[:1]])


def _neck(points: NDArray, frame: Frame) -> Points:
    """(2, k, 2) the neck's sides in the picture, from the top downward."""
    x, y = ((points - frame.origin) / frame.unit @ np.stack([frame.right, frame.down]).T).T
    rows = np.linspace(np.partition(y, len(y) // 10)[len(y) // 10], NECK, 7)
    near = np.abs(y[None, :] - rows[:, None]) < 0.12
    near[~near.any(axis=1)] = True
    low, high = np.where(near, x, np.inf).min(axis=1), np.where(near, x, -np.inf).max(axis=1)
    # Where the skin ends it runs out to the shoulders: the neck is as wide as it is narrowest.
    half = NARROW * float(np.min(high - low)) / 2 * (1 + 0.15 * np.linspace(-0.6, 1, 7) ** 2)
    middle = (low + high) / 2
    top, foot = middle[:3].mean(), middle[-3:].mean()
    middle = top + (foot - top) * np.linspace(-0.25, 1.25, 7)
    return np.stack([
        frame.origin
        + frame.unit * ((middle + side * half)[:, None] * frame.right + rows[:, None] * frame.down)
        for side in (-1, 1)
    ])  # fmt: skip
