"""The face: identity, 47 FACS controls, creases, head and neck, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .anatomy import LANDMARKS, PART_NAMES
from .controls import CONTROL_NAMES, FULL_INTENSITY, MAX_INTENSITY
from .identity import FEATURES, target_weights
from .mesh import corner_matrix, is_shape
from .rotation import rotation
from .subdivide import triangulate

ASSET = Path(__file__).parent / "data" / "head.npz"
ANGLES = ("yaw", "pitch", "roll")


@dataclass(frozen=True)
class FaceParameters:
    """Everything that poses one face.

    aus : control name -> intensity 0..10 (5 is full natural activation; missing is 0)
    identity : parameter name -> value, see facs_rig.IDENTITY (missing is the default)
    head, neck : yaw, pitch, roll in radians. Yaw turns to the face's own left, pitch looks down,
        roll tilts to the image's right.
    """

    aus: Mapping[str, float] = field(default_factory=dict)
    identity: Mapping[str, float] = field(default_factory=dict)
    head: tuple[float, float, float] = (0.0, 0.0, 0.0)
    neck: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def to_json(self) -> dict:
        """Plain dictionary, angles in degrees by name."""
        return {
            "aus": dict(self.aus),
            "identity": dict(self.identity),
            "head": dict(zip(ANGLES, map(float, np.degrees(self.head)), strict=True)),
            "neck": dict(zip(ANGLES, map(float, np.degrees(self.neck)), strict=True)),
        }

    @classmethod
    def from_json(cls, data: Mapping) -> FaceParameters:
        """The inverse of `to_json`; what is missing is neutral."""
        def angles(part: str) -> tuple[float, float, float]:
            yaw, pitch, roll = (float(np.radians(data.get(part, {}).get(a, 0.0))) for a in ANGLES)
            return yaw, pitch, roll

        aus, identity = dict(data.get("aus", {})), dict(data.get("identity", {}))
        return cls(aus, identity, angles("head"), angles("neck"))


def intensities(aus: Mapping[str, float]) -> NDArray[np.float32]:
    """(47,) intensities in the catalogue's order; ValueError for unknown names and bad values."""
    values = np.zeros(len(CONTROL_NAMES), dtype=np.float32)
    for name, value in aus.items():
        if name not in CONTROL_NAMES:
            raise ValueError(f"there is no control '{name}'; `sketch2face rig` lists all 47")
        if not 0 <= value <= MAX_INTENSITY:
            raise ValueError(f"{name} = {value} is outside 0 to {MAX_INTENSITY:g}")
        values[CONTROL_NAMES.index(name)] = value
    return values


class FaceRig:
    """The baked head with everything that poses it. Make one with `load_rig()`.

    Vertices are metres with the origin in the head's joint (top of the neck): x to the face's own
    left, y up, z out of the face. See facs_rig.bake for how the asset is made.

    triangles : (t, 3) int32        polygon_vertices, polygon_starts : quads and triangles, flat
    vertex_part : (n,) uint8, index into part_names      mirror : (n,) int32
    landmarks : (k,) int32, vertex of each facs_rig.LANDMARKS
    strokes : name -> (vertex indices (k, 3), weights (k, 3)) of brows and irises on the surface
    """

    part_names = PART_NAMES

    def __init__(self, arrays: Mapping[str, NDArray]) -> None:
        self._m = int(arrays["cage_joints"])  # cage vertices; the joints come behind them
        self._base = arrays["base"]
        n = len(arrays["vertex_part"])
        self._matrix = sp.csr_matrix(
            (arrays["matrix_data"], arrays["matrix_indices"], arrays["matrix_indptr"]),
            shape=(n, self._m),
        )
        self.n_vertices = n
        self.polygon_vertices: NDArray[np.int32] = arrays["polygon_vertices"]
        self.polygon_starts: NDArray[np.int32] = arrays["polygon_starts"]
        self.triangles = triangulate(self.polygon_vertices, self.polygon_starts)
        self.vertex_part: NDArray[np.uint8] = arrays["vertex_part"]
        self.triangle_part = self.vertex_part[self.triangles[:, 0]]
        self.parts = {name: self.vertex_part == k for k, name in enumerate(PART_NAMES)}
        self.mirror: NDArray[np.int32] = arrays["mirror"]
        self.landmarks: NDArray[np.int32] = arrays["landmarks"]
        self._identity = _rows(arrays, "identity", len(self._base))
        self._controls = _rows(arrays, "controls", len(self._base))
        self._creases = _rows(arrays, "creases", n)
        self.weights: NDArray[np.float32] = arrays["weights"]
        self.strokes = {
            name[7:-9]: (arrays[name], arrays[f"{name[:-9]}_weights"])
            for name in arrays
            if name.startswith("stroke_") and name.endswith("_vertices")
        }

    @cached_property
    def corners(self) -> sp.csr_matrix:
        """(n, t) sparse sums of triangles at vertices, for normals of many poses."""
        return corner_matrix(self.triangles, self.n_vertices)

    @cached_property
    def control_deltas(self) -> NDArray[np.float32]:
        """(47, n, 3) movement in metres of each control at intensity 5, creases included."""
        count = len(CONTROL_NAMES)
        cage = self._controls.toarray().reshape(count, -1, 3)[:, : self._m]
        cage = np.ascontiguousarray(cage.transpose(1, 0, 2)).reshape(self._m, -1)
        moved = (self._matrix @ cage).reshape(self.n_vertices, count, 3).transpose(1, 0, 2)
        moved += self._creases.toarray().reshape(count, self.n_vertices, 3)
        return np.ascontiguousarray(moved, dtype=np.float32)

    def _cage(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        weights = target_weights(identity).astype(np.float32)
        return self._base + (self._identity.T @ weights).reshape(-1, 3)

    def neutral(self, identity: Mapping[str, float] | None = None) -> NDArray[np.float32]:
        """(n, 3) the face without expression, head upright. ValueError for unknown names."""
        cage = self._cage(identity or {})
        return (self._matrix @ cage[: self._m]) - cage[self._m]

    @cached_property
    def landmark_moves(self) -> NDArray[np.float32]:
        """(features, landmarks, 3) metres that each of identity.FEATURES at 1 moves a landmark.

        The mean of the movements toward 1 and away from -1; the features alone, head upright.
        """
        ends = self._identity[-2 * len(FEATURES) :].toarray().reshape(len(FEATURES), 2, -1, 3)
        cage = (ends[:, 1] - ends[:, 0]) / 2
        cage = cage[:, : self._m] - cage[:, self._m : self._m + 1]
        rows = self._matrix[self.landmarks]
        return np.stack([rows @ move for move in cage])

    def neck_joint(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        """(3,) where the neck turns, in metres from the head's joint."""
        cage = self._cage(identity)
        return cage[self._m + 1] - cage[self._m]

    def shape(
        self, parameters: FaceParameters, offsets: NDArray | None = None
    ) -> NDArray[np.float32]:
        """(n, 3) identity, expression and fitted `offsets` (n, 3), head upright."""
        weights = intensities(parameters.aus) / FULL_INTENSITY
        vertices = self.neutral(parameters.identity)
        for k in np.flatnonzero(weights):
            vertices += weights[k] * self.control_deltas[k]
        if offsets is not None:
            vertices = vertices + is_shape(offsets, (self.n_vertices, 3), "offsets")
        return vertices.astype(np.float32)

    def turn(self, vertices: NDArray, parameters: FaceParameters) -> NDArray[np.float32]:
        """Turn upright vertices (n, 3) by head and neck; the skin follows by its weights."""
        is_shape(vertices, (self.n_vertices, 3), "vertices")
        out = vertices
        for angles, weight, pivot in self._joints(parameters):
            turned = (out - pivot) @ rotation(angles).T + pivot
            out = out + weight * (turned - out)
        return out.astype(np.float32)

    def unturn_vectors(self, vectors: NDArray, parameters: FaceParameters) -> NDArray[np.float32]:
        """Displacements (n, 3) of the turned face as displacements of the upright one."""
        is_shape(vectors, (self.n_vertices, 3), "vectors")
        linear = self._turning(parameters)
        return np.linalg.solve(linear, vectors[:, :, None].astype(float))[:, :, 0].astype(
            np.float32
        )

    def turn_vectors(self, vectors: NDArray, parameters: FaceParameters) -> NDArray[np.float32]:
        """Displacements (..., n, 3) of the upright face as displacements of the turned one."""
        if not any(parameters.head) and not any(parameters.neck):
            return vectors.astype(np.float32)
        turning = self._turning(parameters).astype(np.float32)
        return np.einsum("nij,...nj->...ni", turning, vectors)

    def _turning(self, parameters: FaceParameters) -> NDArray[np.float64]:
        """(n, 3, 3) what the joints do to a displacement of each vertex."""
        linear = np.broadcast_to(np.eye(3), (self.n_vertices, 3, 3))
        for angles, weight, _ in self._joints(parameters):
            linear = (np.eye(3) + weight[:, :, None] * (rotation(angles) - np.eye(3))) @ linear
        return linear

    def _joints(self, parameters: FaceParameters):
        """(angles, vertex weights (n, 1), pivot) of the joints in use, head first."""
        if any(parameters.head):
            yield parameters.head, self.weights[:, :1], np.zeros(3, dtype=np.float32)
        if any(parameters.neck):
            yield parameters.neck, self.weights[:, 1:], self.neck_joint(parameters.identity)

    def pose(
        self, parameters: FaceParameters, offsets: NDArray | None = None
    ) -> NDArray[np.float32]:
        """(n, 3) the posed face: `turn(shape(parameters, offsets), parameters)`."""
        return self.turn(self.shape(parameters, offsets), parameters)

    def pose_batch(self, batch: Sequence[FaceParameters]) -> NDArray[np.float32]:
        """(b, n, 3) many posed faces."""
        if not batch:
            return np.zeros((0, self.n_vertices, 3), dtype=np.float32)
        weights = np.stack([intensities(p.aus) for p in batch]) / np.float32(FULL_INTENSITY)
        moved = weights @ self.control_deltas.reshape(len(CONTROL_NAMES), -1)
        moved = moved.reshape(len(batch), self.n_vertices, 3)
        out = np.empty((len(batch), self.n_vertices, 3), dtype=np.float32)
        for k, parameters in enumerate(batch):
            out[k] = self.turn(self.neutral(parameters.identity) + moved[k], parameters)
        return out

    def stroke_points(self, vertices: NDArray, name: str) -> NDArray:
        """(k, 3) points of a surface stroke (see `strokes`) on posed vertices."""
        index, weight = self.strokes[name]
        return np.einsum("kc,kcd->kd", weight, vertices[index])


def _rows(arrays: Mapping[str, NDArray], name: str, n: int) -> sp.csr_matrix:
    """(rows, 3n) sparse matrix from a list of moved vertices and their displacements."""
    index, delta, starts = (arrays[f"{name}_{k}"] for k in ("index", "delta", "starts"))
    columns = (3 * index[:, None] + np.arange(3)).ravel()
    return sp.csr_matrix((delta.ravel(), columns, 3 * starts), shape=(len(starts) - 1, 3 * n))


@lru_cache(maxsize=1)
def load_rig(path: Path = ASSET) -> FaceRig:
    """The rig that ships with the package, read once."""
    with np.load(path) as arrays:
        return FaceRig(dict(arrays))


def landmark_points(rig: FaceRig, vertices: NDArray) -> dict[str, NDArray]:
    """Landmark name -> (3,) its place on posed vertices."""
    return dict(zip(LANDMARKS, vertices[rig.landmarks], strict=True))
