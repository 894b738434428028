"""Faces whose shape is known, drawn by the generator, and how far a fit is from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dataset_gen.generate import make_sample
from dataset_gen.linework.paper import through
from dataset_gen.population import FEATURE
from dataset_gen.sampling import sample_identity
from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig, actions, folds, load_rig, rasterise
from facs_rig.identity import FEATURES
from snakes import face_lines

SIZE = 400  # pixels of a drawing
HEAD = 0.24  # metres, chin to crown
BEYOND = 2.0  # times as much as people differ that were trained on
FAR = 0.15  # of the head, at which every distance between lines is cut


@dataclass(frozen=True)
class Known:
    """A drawing (h, w) uint8, and the posed face (n, 3), camera and page that it shows."""

    drawing: NDArray[np.uint8]
    vertices: NDArray[np.float32]
    camera: Camera
    page: NDArray[np.float64]
    style: dict

    def places(self, points: NDArray) -> NDArray[np.float64]:
        """Points (k, 3) in metres as pixels of the drawing."""
        return through(self.page, self.camera.project(points))

    @cached_property
    def lines(self) -> NDArray[np.float64]:
        """(k, 2) pixels of the drawing: the face's lines."""
        return through(self.page, face_lines(load_rig(), self.vertices, self.camera).lines.points)

    @cached_property
    def silhouette(self) -> NDArray[np.bool_]:
        """(SIZE, SIZE) where the face is."""
        return silhouette(load_rig(), self.places(self.vertices), SIZE)


def known_face(
    seed: int,
    index: int,
    size: int = SIZE,
    scheme: str = "sparse",
    identity: Mapping[str, float] | None = None,
) -> Known:
    """Sample `index` of a data set with this seed; identity : whose face it is, else by lot."""
    drawing, record = make_sample(seed, index, size=size, scheme=scheme, identity=identity)
    about = record["camera"]
    distance = math.inf if about["distance"] is None else about["distance"]
    camera = Camera(size, size, tuple(about["scale"]), tuple(about["centre"]), distance)
    posed = load_rig().pose(FaceParameters.from_json(record))
    return Known(drawing, posed, camera, np.array(record["page"]), record["style"])


def stranger(seed: int, index: int) -> dict[str, float]:
    """Somebody beyond what was trained on: features that vary twice as much, into the range of
    stylised people where there is one, actions done far from the mean, creases of any kind."""
    rng = np.random.default_rng([seed, index, 7])
    who = sample_identity(rng)
    for feature in FEATURES:
        who[feature.name] = float(np.clip(rng.normal(0, BEYOND * FEATURE), *feature.span))
    for name in actions.TABLE:
        who[name] = float(rng.choice((-1, 1)) * rng.uniform(0.7, 1))
    who |= {name: float(rng.uniform(-1, 1)) for name in folds.PARAMETERS if name != folds.SEED}
    return {**who, folds.SEED: float(rng.integers(1, folds.SEEDS + 1))}


@dataclass(frozen=True)
class Off:
    """How far a fitted face is from the true one.

    lines : mean distance between their drawn lines, percent of the head's height
    outline : overlap of their silhouettes, intersection over union
    vertices, depth : mean distance of the face's vertices in all and along the line of sight, mm;
    the head's own depth is not known from a drawing and does not count
    """

    lines: float
    outline: float
    vertices: float
    depth: float


def off(posed: NDArray, camera: Camera, truth: Known) -> Off:
    """Measure a fitted face (n, 3) with the camera that lays it over the drawing."""
    rig = load_rig()
    head = HEAD * truth.camera.scale[0]
    ours = face_lines(rig, posed, camera).lines.points
    theirs = truth.lines
    there = np.minimum(cKDTree(theirs).query(ours)[0], FAR * head).mean()
    back = np.minimum(cKDTree(ours).query(theirs)[0], FAR * head).mean()

    covered = [silhouette(rig, camera.project(posed), SIZE), truth.silhouette]
    union, both = (covered[0] | covered[1]).sum(), (covered[0] & covered[1]).sum()

    face = face_region(rig)
    scale = truth.camera.scale[0]
    apart = np.empty((len(face), 3))
    apart[:, :2] = camera.project(posed[face]) - truth.places(truth.vertices[face])
    apart[:, 2] = posed[face, 2] * camera.scale[0] - truth.vertices[face, 2] * scale
    apart[:, 2] -= apart[:, 2].mean()
    return Off(
        50 * (there + back) / head,
        both / union,
        1e3 * np.linalg.norm(apart, axis=1).mean() / scale,
        1e3 * np.abs(apart[:, 2]).mean() / scale,
    )


def silhouette(rig: FaceRig, pixels: NDArray, size: int) -> NDArray[np.bool_]:
    """(size, size) bool where a projected face (n, 2) is."""
    flat = np.column_stack([pixels, np.zeros(len(pixels))]) * (1, -1, 1)
    return rasterise(flat, rig.triangles, Camera(size, size, (1.0, 1.0), (0.0, 0.0))).triangle >= 0


@cache
def face_region(rig: FaceRig) -> NDArray[np.intp]:
    """The vertices of the skin from forehead to chin and from cheekbone to cheekbone."""
    upright = rig.neutral()
    marks = dict(zip(LANDMARKS, upright[rig.landmarks], strict=True))
    between = (upright[:, 1] < marks["forehead"][1]) & (upright[:, 1] > marks["chin"][1] - 0.005)
    front = upright[:, 2] > marks["cheekbone_left"][2]
    return np.flatnonzero(rig.parts["skin"] & between & front)


def turned_over(rig: FaceRig, before: NDArray, after: NDArray) -> int:
    """How many triangles of the skin offsets have turned over."""
    skin = rig.triangles[rig.parts["skin"][rig.triangles].all(axis=1)]

    def normals(v: NDArray) -> NDArray:
        a, b, c = (v[skin[:, k]].astype(float) for k in range(3))
        return np.cross(b - a, c - a)

    return int((np.einsum("ij,ij->i", normals(before), normals(after)) < 0).sum())
