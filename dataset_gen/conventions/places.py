"""Where on the head people draw lines: curves bound to the rig's skin, and sets of its vertices.

Curves are given as they are seen from the front of the default face and bound once; on a posed
face they are wherever its skin is, so that what is drawn along them wears its expression.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig import CONTROLS, Camera, FaceParameters, FaceRig
from facs_rig.anatomy import LANDMARKS, bind_from_front, smooth_curve
from facs_rig.common.derived import derived
from facs_rig.grooves import CREASES
from facs_rig.mesh import vertex_normals
from facs_rig.raster import rasterise

Points = tuple[tuple[float, float], ...]
# Centimetres from the middle between the eyes, on the face's left: x outward, y up.
LEFT: dict[str, Points] = {
    "nose_side": ((0.95, 0.75), (0.72, -0.2), (0.72, -1.3), (0.95, -2.5), (1.0, -3.1)),
    "nose_inner": ((0.5, 0.75), (0.38, -0.2), (0.4, -1.3), (0.55, -2.5), (0.6, -3.1)),
    "nose_wing": ((1.22, -2.95), (1.62, -3.25), (1.76, -3.8), (1.5, -4.25), (1.15, -4.42)),
    "nose_under": ((1.15, -4.42), (0.95, -4.2), (0.62, -4.28), (0.35, -4.5), (0.0, -4.55)),
    "philtrum": ((0.28, -4.85), (0.36, -5.5)),
    "cheek": ((5.3, -1.6), (4.6, -3.2), (3.9, -4.6)),
}
MIDDLE: dict[str, Points] = {
    "nose_middle": ((0.0, 0.75), (0.0, -0.2), (0.0, -1.3), (0.0, -2.5), (0.0, -3.1)),
    "nose_ball": ((-0.85, -2.95), (-0.6, -3.75), (0.0, -4.05), (0.6, -3.75), (0.85, -2.95)),
    "chin_fold": ((-1.2, -8.75), (0.0, -8.45), (1.2, -8.75)),
    "chin_arc": ((-1.3, -9.95), (0.0, -10.35), (1.3, -9.95)),
    "under_lip": ((-0.9, -8.25), (0.0, -8.4), (0.9, -8.25)),
}
# What an artist moves and grows by itself: how names of its curves and landmarks begin, and end.
FEATURES = tuple(
    (words, side)
    for words, sides in (
        (("lid", "iris", "pupil", "eye", "under_eye"), ("_left", "_right")),
        (("brow",), ("_left", "_right")),
        (("nose", "nostril", "philtrum"), ("",)),
        (("rim", "lip", "mouth", "under_lip"), ("",)),
    )
    for side in sides
)
SAMPLES = 12  # points of each of these curves
FOLD = 0.0042  # metres above the rim of the upper lid where its fold lies
LID, RIM = 16, 17  # points along a lid from the inner corner, and along a lip from side to side
FINE = 12_000.0  # pixels per metre in which rims are looked for
DROP = 0.001  # metres from pixel to pixel that the surface falls off behind a lip
FAR = 10.0  # metres: nothing of a face is as deep as what is not there
LEAST_OPEN = 25  # pixels between the lips where their rims are looked for
# Least z of the face at a height y, both in centimetres from the head's joint: in front of it are
# jaw, ears and hairline.
FRONT = (
    (-7.8, 7.2), (-7.38, 6.8), (-6.4, 5.4), (-5.6, 4.5), (-4.7, 3.8), (-3.5, 3.2), (-1.5, 2.8),
    (0.5, 2.7), (1.4, 2.9), (2.9, 3.7), (4.4, 4.8), (5.6, 6.1), (7.2, 7.2), (8.9, 7.9), (9.8, 8.5),
)  # fmt: skip
EAR_MOVES = 0.06  # of the largest movement when ears stand out: what moves more is an ear


@dataclass(frozen=True)
class Places:
    """index, weight : (p, 3) vertices and their weights of all curves, one after another
    curves : name -> its part of them; "landmarks" are all of facs_rig.LANDMARKS
    normals : (p, 3) the way out of the skin there, at rest
    feature : (p,) which of FEATURES each belongs to, -1 none
    controls : name of a crease -> the controls that raise it
    face, head, neck : (k,) vertices of the face within hairline and jaw, of the whole skull, of
    the neck        ears : of the left one and of the right one
    """

    index: NDArray[np.int64]
    weight: NDArray[np.float32]
    curves: dict[str, slice]
    normals: NDArray[np.float64]
    feature: NDArray[np.int64]
    controls: dict[str, tuple[str, ...]]
    face: NDArray[np.int64]
    head: NDArray[np.int64]
    neck: NDArray[np.int64]
    ears: dict[str, NDArray[np.int64]]


@derived
def places_of(rig: FaceRig) -> Places:
    """The places on a rig, found once: half a second."""
    rest = rig.neutral()
    skin = rig.parts["skin"]
    normals = vertex_normals(rest, rig.triangles, rig.corners)
    eyes = (rest[rig.landmarks[LANDMARKS.index("pupil_left")]]
            + rest[rig.landmarks[LANDMARKS.index("pupil_right")]]) / 2  # fmt: skip
    drawn: dict[str, NDArray] = {}
    for name, points in LEFT.items():
        line = smooth_curve(np.array(points), SAMPLES)
        drawn[f"{name}_left"], drawn[f"{name}_right"] = line, line * [-1, 1]
    drawn |= {name: smooth_curve(np.array(points), SAMPLES) for name, points in MIDDLE.items()}
    raised: dict[str, tuple[str, ...]] = {}
    for group, creases in CREASES.items():
        by = tuple(control.name for control in CONTROLS if group in control.creases)
        for k, crease in enumerate(creases):
            line = smooth_curve(np.array(crease.points), SAMPLES)
            for side, sign in (("left", 1), ("right", -1)):
                drawn[f"{group}_{k}_{side}"] = line * [sign, 1]
                raised[f"{group}_{k}_{side}"] = by
    front = skin & (normals[:, 2] > 0.05) & (rest[:, 2] > eyes[2] - 0.06)
    flat = np.concatenate(list(drawn.values())) * 0.01 + eyes[:2]
    bound = [bind_from_front(flat, rest, rig.triangles, front)]
    sizes = {name: len(line) for name, line in drawn.items()}
    hairline, corners = rig.curves["hairline"], np.eye(3)[:1].repeat(len(LANDMARKS), axis=0)
    more = {"hairline": (hairline.index, hairline.weight), **rig.strokes,
            "landmarks": (rig.landmarks[:, None].repeat(3, axis=1), corners)}  # fmt: skip
    for name, place in {**_lids(rig, rest), **_lips(rig), **more}.items():
        bound.append(place)
        sizes[name] = len(place[0])
    index, weight = (np.concatenate(part) for part in zip(*bound, strict=True))
    ends = np.cumsum([0, *sizes.values()]).tolist()
    curves = {name: slice(a, b) for name, a, b in zip(sizes, ends[:-1], ends[1:], strict=True)}
    words = [name for name, size in sizes.items() for _ in range(size)]
    words[curves["landmarks"]] = LANDMARKS
    feature = np.array([_feature(name) for name in words])
    weight = weight.astype(np.float32)
    out = np.einsum("kc,kcd->kd", weight, normals[index])
    return Places(index, weight, curves, out, feature, raised, *_regions(rig, rest, normals))


def _feature(name: str) -> int:
    """Which of FEATURES a curve or landmark belongs to."""
    for k, (words, side) in enumerate(FEATURES):
        if name.startswith(words) and name.endswith(side):
            return k
    return -1


def _regions(rig: FaceRig, rest: NDArray, normals: NDArray):
    """Vertices of the face, the skull, the neck and the ears."""
    skin = rig.parts["skin"]
    wing = np.linalg.norm(rig.neutral({"ear_wing": 1.0}) - rest, axis=1)
    ear = skin & (wing > EAR_MOVES * wing.max())
    y, z = (np.array(FRONT) * 0.01).T
    inside = skin & ~ear & (rest[:, 2] >= np.interp(rest[:, 1], y, z))
    inside &= (rest[:, 1] > y[0]) & (rest[:, 1] < y[-1])
    outward = np.einsum("nd,nd->n", normals, rest * [1, 0, 1]) > 0  # not the mouth's own lining
    neck = skin & (rest[:, 1] < -0.05) & (rest[:, 2] < np.interp(rest[:, 1], y, z) - 0.01)
    skull = skin & ~ear & ~neck & outward & (rest[:, 1] > -0.06)
    sides = {"left": rest[:, 0] > 0, "right": rest[:, 0] < 0}
    return (
        np.flatnonzero(inside & outward)[::6],
        np.flatnonzero(skull)[::8],
        np.flatnonzero(neck),
        {side: np.flatnonzero(ear & own) for side, own in sides.items()},
    )


def _lids(rig: FaceRig, rest: NDArray) -> dict[str, tuple[NDArray, NDArray]]:
    """The rims of all lids and the folds above, from the inner corner, as they are seen at rest."""
    out = {}
    eye = rig.part_names.index("eyes")
    for side, sign in (("left", 1), ("right", -1)):
        inner, outer = (
            rig.landmarks[LANDMARKS.index(f"eye_{c}_{side}")] for c in ("inner", "outer")
        )
        middle = (rest[inner] + rest[outer]) / 2
        camera = _around(middle, 0.05, 0.03)
        seen = rasterise(rest, _solid(rig), camera).triangle
        part = np.where(seen >= 0, rig.vertex_part[_solid(rig)[seen, 0]], 255)
        open_at = np.flatnonzero((part == eye).sum(axis=0) > 4)
        columns = np.round(np.linspace(open_at[0], open_at[-1], LID - 2)[::sign]).astype(int)
        first = (part[:, columns] == eye).argmax(axis=0)
        last = len(part) - (part[::-1][:, columns] == eye).argmax(axis=0)
        fold = first - FOLD * FINE * np.sin(np.linspace(0.35, 2.7, len(columns)))
        for name, rows in (("upper", first - 2), ("lower", last + 1), ("fold", fold)):
            index, weight = _bind(rig, rest, seen, camera, columns, rows.astype(int))
            if name != "fold":
                ends = np.zeros((2, 3), int), np.tile([1.0, 0, 0], (2, 1))
                ends[0][:] = [[inner], [outer]]
                index = np.concatenate([ends[0][:1], index, ends[0][1:]])
                weight = np.concatenate([ends[1][:1], weight, ends[1][1:]])
            out[f"lid_{name}_{side}"] = index, weight
    return out


def _lips(rig: FaceRig) -> dict[str, tuple[NDArray, NDArray]]:
    """The inner rims of both lips, found where an open mouth shows them, from right to left."""
    posed = rig.pose(FaceParameters({"jaw_open": 5.0, "lower_lip_depress": 1.5, "sneer": 1.0}))
    right, left, top, bottom = (
        posed[rig.landmarks[LANDMARKS.index(name)]]
        for name in ("mouth_corner_right", "mouth_corner_left", "lip_top", "lip_bottom")
    )
    middle = np.array([0.0, (top[1] + bottom[1]) / 2, 0.0])
    camera = _around(middle, 1.2 * (left[0] - right[0]), 1.4 * (top[1] - bottom[1]))
    buffers = rasterise(posed, _solid(rig), camera)
    part = np.where(buffers.triangle >= 0, rig.vertex_part[_solid(rig)[buffers.triangle, 0]], 0)
    borders = [rig.stroke_points(posed, f"lip_{edge}") for edge in ("upper", "lower")]
    pixels = [camera.project(border) for border in borders]
    columns = np.arange(int(pixels[0][0, 0]) + 2, int(pixels[0][-1, 0]) - 2)
    up, low = (np.interp(columns, *at.T) for at in pixels)
    rows = np.arange(camera.height)[:, None]
    # The opening begins where the surface falls off behind a lip, or teeth and tongue are seen.
    depth, tooth = np.maximum(buffers.depth[:, columns], -FAR), part[:, columns] != 0
    falls = np.diff(depth, axis=0)
    within = (rows > up) & (rows < low)
    begins = (np.vstack([falls < -DROP, np.zeros((1, len(columns)), bool)]) | tooth) & within
    stops = (np.vstack([np.zeros((1, len(columns)), bool), falls > DROP]) | tooth) & within
    first = begins.argmax(axis=0)
    last = len(rows) - 1 - stops[::-1].argmax(axis=0)
    open_at = np.flatnonzero(begins.any(axis=0) & stops.any(axis=0) & (last - first > LEAST_OPEN))
    columns, first, last = columns[open_at], first[open_at], last[open_at]
    # Nearest the corners the rims dive into the mouth.
    some = np.round(np.linspace(0.1, 0.9, RIM - 2) * (len(columns) - 1)).astype(int)
    first, last = first[some], last[some]
    out = {}
    corner = [rig.landmarks[LANDMARKS.index(f"mouth_corner_{s}")] for s in ("right", "left")]
    for name, row in (("upper", first - 1), ("lower", last + 1)):
        index, weight = _bind(rig, posed, buffers.triangle, camera, columns[some], row)
        index = np.concatenate([[[corner[0]] * 3], index, [[corner[1]] * 3]])
        weight = np.concatenate([[[1.0, 0, 0]], weight, [[1.0, 0, 0]]])
        out[f"rim_{name}"] = index, weight
    return out


@derived
def _solid(rig: FaceRig) -> NDArray[np.int32]:
    """The triangles without lashes and brows, which are blades."""
    blades = [rig.part_names.index(name) for name in ("lashes", "brows")]
    return rig.triangles[~np.isin(rig.triangle_part, blades)]


def _around(middle: NDArray, width: float, height: float) -> Camera:
    """A camera on a window of so many metres."""
    w, h = int(width * FINE), int(height * FINE)
    return Camera(w, h, (FINE, FINE), (w / 2 - FINE * middle[0], h / 2 + FINE * middle[1]))


def _bind(
    rig: FaceRig, posed: NDArray, seen: NDArray, camera: Camera, columns: NDArray, rows: NDArray
) -> tuple[NDArray, NDArray]:
    """Vertices and barycentric weights (k, 3) of the surface that pixels show."""
    index = _solid(rig)[seen[rows, columns]]
    a, b, c = np.moveaxis(camera.project(posed[index]).astype(float), 1, 0)
    p = np.stack([columns + 0.5, rows + 0.5], axis=1)
    area = _cross(b - a, c - a)
    weight = np.stack([_cross(b - p, c - p), _cross(c - p, a - p), _cross(a - p, b - p)], axis=1)
    return index, weight / area[:, None]


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
