"""The face upright: identity, 47 FACS controls and creases, as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .anatomy import PART_NAMES
from .controls import CONTROL_NAMES, FULL_INTENSITY
from .curves import read_curves
from .folds import crease_gain
from .identity import CAGE_TARGETS, ENDS, FEATURES, target_weights
from .keys import Key, compile_keys
from .mesh import corner_matrix, is_shape
from .motions import Who, read_motions
from .moves import dense
from .parameters import FaceParameters, intensities
from .posing import refine_many, row_blocks, with_creases
from .subdivide import triangulate
from .uv import read_uv

JOINTS = ("head", "neck", "eye_left", "eye_right", "jaw")


class UprightFace:
    """The mesh and all that moves it but its joints; what a `FaceRig` turns.

    Vertices are metres with the origin in the head's joint (top of the neck): x to the face's own
    left, y up, z out of the face. See facs_rig.bake for how the asset is made.

    triangles : (t, 3) int32        polygon_vertices, polygon_starts : quads and triangles, flat
    vertex_part : (n,) uint8, index into part_names      mirror : (n,) int32
    texture : where the polygons' corners lie on a texture (see facs_rig.uv); `uv` in short
    level, of_full : level of detail, and (n,) which of the full face's vertices it has
    lighter : other level -> places of its polygons' corners, and starts (see facs_rig.levels)
    landmarks : (k,) int32, vertex of each facs_rig.LANDMARKS
    strokes : name -> (vertex indices (k, 3), weights (k, 3)) of brows and irises on the surface
    under : the same of the surface under them, which for the brows' edges is the skin under hairs
    curves : layer -> lines for drawing (see facs_rig.curves): hairs of brows and lashes, hair, ...
    keys : the shape keys whose values pose the face, the 47 controls first (see facs_rig.keys)
    weights : (n, 2) float32, how far a vertex follows the head and the neck
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
        self.level = "full"
        self.of_full: NDArray[np.intp] | None = None
        self.vertex_part: NDArray[np.uint8] = arrays["vertex_part"]
        self.texture = read_uv(arrays)
        self.lighter: dict[str, tuple[NDArray[np.int32], NDArray[np.int32]]] = {
            name: (arrays[f"level_{name}_corners"], arrays[f"level_{name}_starts"])
            for name in ("medium", "game")
        }
        self.mirror: NDArray[np.int32] = arrays["mirror"]
        self.landmarks: NDArray[np.int32] = arrays["landmarks"]
        # Controls and helpers move the cage, creases the skin itself.
        self.motions = read_motions(arrays, self._matrix)
        self.keys = tuple(
            Key(str(name), str(text))
            for name, text in zip(arrays["key_names"], arrays["key_expressions"], strict=True)
        )
        self._values = compile_keys(self.keys[len(CONTROL_NAMES) :])
        self._lid_rest = arrays["lid_rest"]
        self._arkit = (arrays, "arkit")
        self.weights: NDArray[np.float32] = arrays["weights"]
        self.curves = read_curves(arrays)
        self.strokes = _bound(arrays, "stroke")
        self.under = self.strokes | _bound(arrays, "under")

    @cached_property
    def triangle_part(self) -> NDArray[np.uint8]:
        """(t,) index into part_names."""
        return self.vertex_part[self.triangles[:, 0]]

    @cached_property
    def parts(self) -> dict[str, NDArray[np.bool_]]:
        """Name of a part -> (n,) its vertices."""
        return {name: self.vertex_part == k for k, name in enumerate(PART_NAMES)}

    @cached_property
    def _fine(self) -> sp.csr_matrix:
        """The refinement of cage and creases, for one face."""
        return with_creases(self._matrix, self.motions.skin_at)

    @cached_property
    def _blocks(self) -> list[sp.csr_matrix]:
        """The same for many."""
        return row_blocks(self._fine)

    @cached_property
    def corners(self) -> sp.csr_matrix:
        """(n, t) sparse sums of triangles at vertices, for normals of many poses."""
        return corner_matrix(self.triangles, self.n_vertices)

    @property
    def uv(self) -> NDArray[np.float32]:
        """(c, 2) place on a texture, 0..1, v up, of each of `polygon_vertices`."""
        return self.texture.uv

    @cached_property
    def triangle_corners(self) -> NDArray[np.int32]:
        """(t, 3) which corners, numbers of `polygon_vertices`, make each of `triangles`."""
        return triangulate(np.arange(len(self.polygon_vertices)), self.polygon_starts)

    # --- identity ---

    def _cage(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        return self._caged(self.motions.person(self.motions.who([identity]))[0][0])

    def _caged(self, moves: NDArray) -> NDArray[np.float32]:
        """(..., M, 3) the cage moved by (..., 3M), in the source's place."""
        return self._base + moves.reshape(*moves.shape[:-1], -1, 3)

    def neutral(self, identity: Mapping[str, float] | None = None) -> NDArray[np.float32]:
        """(n, 3) the face without expression, head upright. InputError for unknown names.

        That of nobody in particular is worked out once and cannot be written to.
        """
        return self._neutral_of(identity) if identity else self._upright

    @cached_property
    def _upright(self) -> NDArray[np.float32]:
        vertices = self._neutral_of({})
        vertices.flags.writeable = False
        return vertices

    def _neutral_of(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        (cage,), skin = self.motions.person(self.motions.who([identity]))
        return self._upright_face(cage, skin)

    def _upright_face(self, moves: NDArray, skin: NDArray | None) -> NDArray[np.float32]:
        """(n, 3) the fine face whose cage is moved by (3M,) and its skin by (1, 3u) or nothing."""
        cage = self._caged(moves)
        vertices = (self._matrix @ cage[: self._m]) - cage[self._m]
        if skin is not None:
            vertices[self.motions.skin_at] += skin.reshape(-1, 3)
        return vertices

    def joints(self, identity: Mapping[str, float] | None = None) -> dict[str, NDArray]:
        """JOINTS name -> (3,) its place in metres from the head's joint."""
        cage = self._cage(identity or {})[self._m :]
        return dict(zip(JOINTS, cage - cage[0], strict=True))

    def scalars(self, identity: Mapping[str, float]) -> dict[str, float]:
        """The properties `crease_gain` and `lid_rest` that the keys' expressions read."""
        return self._scalars(identity, target_weights(identity))

    def _scalars(self, identity: Mapping[str, float], weights: NDArray) -> dict[str, float]:
        return {
            "crease_gain": crease_gain(identity),  # checked with the weights
            "lid_rest": float(self._lid_rest @ weights[:CAGE_TARGETS]),
        }

    @cached_property
    def identity_deltas(self) -> NDArray[np.float32]:
        """(identity targets, n, 3) metres that each of identity.IDENTITY_KEYS moves the face."""
        stack = self.motions.targets.reshape(CAGE_TARGETS, -1, 3)
        cage = self._refined(stack[:, : self._m] - stack[:, self._m : self._m + 1])
        return np.concatenate([cage, self._on_skin(self.motions.details)])

    def stretched(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        """(n, 3) metres that a stylised person's features move the face beyond their sum."""
        targets = self.motions.who([identity]).targets
        moves = self.motions.stretched(targets).reshape(1, -1, 3)
        out = self._refined(moves[:, : self._m] - moves[:, self._m : self._m + 1])[0]
        details = targets[0, CAGE_TARGETS:]
        more = self.motions.details_of(targets) - self.motions.details
        out[self.motions.skin_at] += (more.T @ details).reshape(-1, 3)
        return out

    @cached_property
    def landmark_moves(self) -> NDArray[np.float32]:
        """(features, landmarks, 3) metres that each of identity.FEATURES at 1 moves a landmark.

        The mean of the movements toward 1 and away from -1; the features alone, head upright.
        """
        ends = self.motions.targets[ENDS].reshape(len(FEATURES), 2, -1, 3)
        cage = (ends[:, 1] - ends[:, 0]) / 2
        cage = cage[:, : self._m] - cage[:, self._m : self._m + 1]
        rows = self._matrix[self.landmarks]
        return np.stack([rows @ move for move in cage])

    # --- expression ---

    def key_values(self, parameters: FaceParameters) -> NDArray[np.float32]:
        """(keys,) the value of every key; InputError for unknown names and bad values."""
        return self.key_values_of([parameters])[0]

    def key_values_of(self, batch: Sequence[FaceParameters]) -> NDArray[np.float32]:
        """(b, keys) the values of every key for many faces; see `key_values`."""
        return self._key_values(batch, [target_weights(p.identity) for p in batch])

    @cached_property
    def _default_parts(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        return self._parts(self.motions.who([{}]))

    def linear_parts(
        self, identity: Mapping[str, float] | None = None
    ) -> tuple[sp.csr_matrix, NDArray, NDArray, NDArray]:
        """What the upright face is a sum of, from the head's joint: the refinement (n, m) of the
        cage; the cage and its movements (m, 1 + cage targets + cage keys, 3); the vertices (u,)
        of the skin that move by themselves, and how (u, details + skin keys, 3).

        identity : whose keys, and whose features stretch what is stylised; the default person's if
        None"""
        who = self.motions.who([identity or {}])
        cage, skin = self._default_parts if who.default_keys else self._parts(who)
        return self._matrix, cage, self.motions.skin_at, skin

    def _parts(self, who: Who) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        keys, creases = self.motions.keys_of(who)
        base = self._base.reshape(1, -1)
        if who.stylised:
            base = base + self.motions.stretched(who.targets)
        moves = np.concatenate([base, self.motions.targets, keys])
        moves = moves.reshape(len(moves), -1, 3)
        moves = moves[:, : self._m] - moves[:, self._m : self._m + 1]
        skin = sp.vstack([self.motions.details_of(who.targets), creases]).toarray()
        skin = skin.reshape(len(skin), len(self.motions.skin_at), 3)
        by_vertex = [np.ascontiguousarray(part.transpose(1, 0, 2)) for part in (moves, skin)]
        return by_vertex[0], by_vertex[1].astype(np.float32)

    def cage(self, parameters: FaceParameters) -> NDArray[np.float32]:
        """(m, 3) the cage of the upright face, from the head's joint."""
        who = self.motions.who([parameters.identity])
        moves = self.motions.person(who)[0]
        moves = moves + self.motions.expression(who, self.key_values(parameters)[None])[0]
        cage = self._caged(moves[0])
        return cage[: self._m] - cage[self._m]

    def _key_values(
        self, batch: Sequence[FaceParameters], who: Sequence[NDArray] | NDArray
    ) -> NDArray[np.float32]:
        """(b, keys) the values of every key for many faces; who : their identities' weights."""
        controls = np.stack([intensities(p.aus) for p in batch])
        columns = zip(CONTROL_NAMES, controls.T.astype(float), strict=True)
        variables: dict[str, NDArray] = dict(columns)
        gaze = np.degrees([p.gaze for p in batch])
        variables |= {"gaze_yaw": gaze[:, 0], "gaze_pitch": gaze[:, 1]}
        scalars = [self._scalars(p.identity, w) for p, w in zip(batch, who, strict=True)]
        variables |= {name: np.array([s[name] for s in scalars]) for name in scalars[0]}
        if len(batch) == 1:  # plain numbers are quicker than arrays of one
            helpers = self._values({name: float(v[0]) for name, v in variables.items()})[:, None]
        else:
            helpers = self._values(variables)
        values = np.concatenate([controls / FULL_INTENSITY, helpers.T], axis=1)
        return values.astype(np.float32)

    @cached_property
    def key_deltas(self) -> NDArray[np.float32]:
        """(keys, n, 3) metres that each key moves the default person's face at value 1."""
        return self._deltas(self.motions.who([{}]))

    def key_deltas_of(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        """(keys, n, 3) metres that each key moves this person's face at value 1.

        Not to be written to. InputError for what no person can be.
        """
        who = self.motions.who([identity])
        return self.key_deltas if who.default_keys else self._deltas(who)

    def _deltas(self, who: Who) -> NDArray[np.float32]:
        keys, creases = self.motions.keys_of(who)
        cage = self._refined(keys.reshape(len(keys), -1, 3)[:, : self._m])
        return np.concatenate([cage, self._on_skin(creases)])

    @cached_property
    def control_deltas(self) -> NDArray[np.float32]:
        """(47, n, 3) movement in metres of each control alone, at intensity 5, default identity."""
        rest = FaceParameters()
        return self.moves([(rest, FaceParameters({n: FULL_INTENSITY})) for n in CONTROL_NAMES])

    @cached_property
    def arkit_deltas(self) -> NDArray[np.float32]:
        """(52, n, 3) movement in metres of each of controls.ARKIT_NAMES at 1, default identity."""
        return self._arkit_of({})

    def arkit_deltas_of(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        """(52, n, 3) the same for a person: as far as what is stylised has grown. Not to be written
        to. InputError for what no person can be."""
        who = self.motions.who([identity])
        return self._arkit_of(identity) if who.stylised else self.arkit_deltas

    def _arkit_of(self, identity: Mapping[str, float]) -> NDArray[np.float32]:
        cage = dense(*self._arkit, len(self._base)) * self.motions.grown(identity)
        return self._refined(cage.reshape(len(cage), -1, 3)[:, : self._m])

    def _refined(self, cages: NDArray) -> NDArray[np.float32]:
        """Cage movements (k, m, 3) as movements (k, n, 3) of the fine face."""
        flat = np.ascontiguousarray(cages.transpose(1, 0, 2)).reshape(self._m, -1)
        fine = (self._matrix @ flat).reshape(self.n_vertices, len(cages), 3)
        return np.ascontiguousarray(fine.transpose(1, 0, 2), dtype=np.float32)

    def _on_skin(self, rows: sp.csr_matrix) -> NDArray[np.float32]:
        """Movements (k, 3u) of the skin as movements (k, n, 3) of the fine face."""
        out = np.zeros((rows.shape[0], self.n_vertices, 3), dtype=np.float32)
        out[:, self.motions.skin_at] = rows.toarray().reshape(
            rows.shape[0], len(self.motions.skin_at), 3
        )
        return out

    def moves(self, pairs: Sequence[tuple[FaceParameters, FaceParameters]]) -> NDArray[np.float32]:
        """(pairs, n, 3) metres from the first to the second face of each pair, head upright.

        Both faces of a pair are of the same identity. The eyes' own turning is no movement.
        """
        before, after = (self.key_values_of(faces) for faces in zip(*pairs, strict=True))
        who = self.motions.who([first.identity for first, _ in pairs])
        cages, skin = self.motions.expression(who, after - before)
        cages = cages.reshape(len(pairs), -1, 3)
        return refine_many(
            self._blocks, cages[:, : self._m], self._skin_or_still(skin, len(pairs)), by_axis=True
        )

    def _skin_or_still(self, skin: NDArray | None, count: int) -> NDArray[np.float32]:
        """(count, u, 3) of the skin's movements (count, 3u), if it moves."""
        u = len(self.motions.skin_at)
        return np.zeros((count, u, 3), np.float32) if skin is None else skin.reshape(count, u, 3)

    def shape(
        self, parameters: FaceParameters, offsets: NDArray | None = None
    ) -> NDArray[np.float32]:
        """(n, 3) identity, expression and fitted `offsets` (n, 3), head upright."""
        who = self.motions.who([parameters.identity])
        (cage, skin), values = self.motions.person(who), self.key_values(parameters)
        moves, folds = self.motions.expression(who, values[None])
        vertices = self._upright_face((cage + moves)[0], both(skin, folds))
        if offsets is not None:
            vertices = vertices + is_shape(offsets, (self.n_vertices, 3), "offsets")
        return vertices.astype(np.float32)

    def stroke_points(self, vertices: NDArray, name: str) -> NDArray:
        """(k, 3) points of a surface stroke (see `strokes`) on posed vertices."""
        index, weight = self.strokes[name]
        return np.einsum("kc,kcd->kd", weight, vertices[index])


def both(one: NDArray | None, other: NDArray | None) -> NDArray | None:
    """The sum of two movements, either of which may be none; in the first one's place."""
    if one is None or other is None:
        return other if one is None else one
    one += other
    return one


def _bound(arrays: Mapping[str, NDArray], kind: str) -> dict[str, tuple[NDArray, NDArray]]:
    """Name -> vertices and weights (k, 3) of what is bound to the face."""
    names = [n.removesuffix("_vertices") for n in arrays if n.startswith(f"{kind}_")]
    return {
        name.removeprefix(f"{kind}_"): (arrays[f"{name}_vertices"], arrays[f"{name}_weights"])
        for name in names
        if f"{name}_weights" in arrays
    }
