"""The face: what stands in facs_rig.upright, with a head, a neck and eyes that turn."""

from __future__ import annotations

import errno
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .anatomy import LANDMARKS
from .common.errors import InputError
from .identity import CAGE_TARGETS
from .mesh import is_shape
from .parameters import FaceParameters
from .posing import blended, refine_many, spanning, turned
from .rotation import rotation
from .upright import JOINTS, UprightFace, both

__all__ = ["ASSET", "JOINTS", "FaceRig", "landmark_points", "load_rig"]

ASSET = Path(__file__).parent / "data" / "head.npz"
BUSY = (errno.EMFILE, errno.ENFILE, errno.ENOMEM)  # the computer is, and the file may be whole
AT_ONCE = 16  # faces posed together: what stands between stays in the processor's cache


class FaceRig(UprightFace):
    """The baked head with everything that poses it. Make one with `load_rig()`."""

    @cached_property
    def _eyes(self) -> dict[str, NDArray[np.intp]]:
        """Name of the joint -> vertices of the ball that turns about it."""
        x = (self._matrix @ self._base[: self._m])[:, 0]
        eyes = self.parts["eyes"]
        return {"eye_left": np.flatnonzero(eyes & (x > 0)),
                "eye_right": np.flatnonzero(eyes & (x <= 0))}  # fmt: skip

    @cached_property
    def _eye_rows(self) -> dict[str, sp.csr_matrix]:
        return {eye: self._matrix[at] for eye, at in self._eyes.items()}

    @cached_property
    def _blended(self) -> NDArray[np.intp]:
        """Vertices that do not follow the joints fully."""
        return np.flatnonzero((self.weights < 1).any(axis=1))

    @cached_property
    def _blended_rows(self) -> sp.csr_matrix:
        return self._matrix[self._blended]

    def turn(self, vertices: NDArray, parameters: FaceParameters) -> NDArray[np.float32]:
        """Turn upright vertices (n, 3) by gaze, head and neck; the skin follows by its weights."""
        is_shape(vertices, (self.n_vertices, 3), "vertices")
        out = np.array(vertices, dtype=np.float32)
        joints = self.joints(parameters.identity)
        if any(parameters.gaze):
            turning = rotation((*parameters.gaze, 0.0)).astype(np.float32).T
            for eye, at in self._eyes.items():
                out[at] = (out[at] - joints[eye]) @ turning + joints[eye]
        skin = out[self._blended]
        for k, (angles, joint) in enumerate(self._joints(parameters, joints)):
            if any(angles):
                turning = rotation(angles).astype(np.float32).T
                shift = joint - joint @ turning
                out = out @ turning
                out += shift
                skin += self.weights[self._blended, k : k + 1] * (skin @ turning + shift - skin)
        out[self._blended] = skin
        return out

    @cached_property
    def _span(self) -> tuple[sp.csr_matrix, NDArray[np.float32]]:
        """Rows of the refinement, and weights, of vertices that span every person's head."""
        bare = self.parts["skin"].copy()  # without what details move: they are left out
        bare[self.motions.skin_at[np.unique(self.motions.details.indices // 3)]] = False
        skin = np.flatnonzero(bare)
        rows = self._matrix[skin]
        used = np.unique(rows.indices)  # some of the cage only holds the rest
        moves = self.motions.targets.reshape(CAGE_TARGETS, -1, 3)[:, used]
        corners = used[spanning(self._base[used] + np.concatenate([[0 * moves[0]], moves]))]
        at = skin[np.unique(np.asarray(rows[:, corners].argmax(axis=0)))]  # on the skin itself
        return self._matrix[at], self.weights[at]

    def extent(self, parameters: FaceParameters) -> NDArray[np.float32]:
        """(k, 3) points that span the head without its expression, turned: what a camera frames.

        A few hundred vertices, chosen once: the whole head reaches 1 mm farther, 5 at most.
        """
        rows, weights = self._span
        cage = self._cage(parameters.identity)
        joints = dict(zip(JOINTS, cage[self._m :] - cage[self._m], strict=True))
        out = rows @ cage[: self._m] - cage[self._m]
        for k, (angles, joint) in enumerate(self._joints(parameters, joints)):
            turning = rotation(angles).astype(np.float32).T
            out += weights[:, k : k + 1] * ((out - joint) @ turning + joint - out)
        return out

    def unturn_vectors(self, vectors: NDArray, parameters: FaceParameters) -> NDArray[np.float32]:
        """Displacements (n, 3) of the turned face as displacements of the upright one."""
        is_shape(vectors, (self.n_vertices, 3), "vectors")
        linear = self._turning(parameters)
        return np.linalg.solve(linear, vectors[:, :, None].astype(float))[:, :, 0].astype(
            np.float32
        )

    def turn_vectors(self, vectors: NDArray, parameters: FaceParameters) -> NDArray[np.float32]:
        """Displacements (..., n, 3) of the upright face as displacements of the turned one."""
        vectors = np.asarray(vectors, dtype=np.float32)
        if not any((*parameters.head, *parameters.neck, *parameters.gaze)):
            return vectors
        whole = (rotation(parameters.neck) @ rotation(parameters.head)).astype(np.float32)
        out = (whole @ vectors.swapaxes(-1, -2)).swapaxes(-1, -2)
        # Where the skin follows in part, and where eyes turn by themselves, each goes its own way.
        eyes = self._eyes.values() if any(parameters.gaze) else ()
        rows = np.concatenate([self._blended, *eyes])
        turning = self._turning(parameters, rows).astype(np.float32)
        out[..., rows, :] = np.einsum("nij,...nj->...ni", turning, vectors[..., rows, :])
        return out

    def _turning(
        self, parameters: FaceParameters, rows: NDArray | slice = slice(None)
    ) -> NDArray[np.float64]:
        """(k, 3, 3) what the joints do to a displacement of each vertex, or of some."""
        linear = np.tile(np.eye(3), (self.n_vertices, 1, 1))
        for at in self._eyes.values():
            linear[at] = rotation((*parameters.gaze, 0.0))
        linear = linear[rows]
        for k, (angles, _) in enumerate(self._joints(parameters, self.joints())):
            weight = self.weights[rows, k, None, None]
            linear = (np.eye(3) + weight * (rotation(angles) - np.eye(3))) @ linear
        return linear

    @staticmethod
    def _joints(parameters: FaceParameters, joints: Mapping[str, NDArray]):
        """Angles and place of head and neck, in the order of the columns of `weights`."""
        return (parameters.head, joints["head"]), (parameters.neck, joints["neck"])

    def pose(
        self, parameters: FaceParameters, offsets: NDArray | None = None
    ) -> NDArray[np.float32]:
        """(n, 3) the posed face: `turn(shape(parameters, offsets), parameters)`."""
        if offsets is None:
            return self.pose_batch([parameters])[0]
        return self.turn(self.shape(parameters, offsets), parameters)

    def pose_batch(self, batch: Sequence[FaceParameters]) -> NDArray[np.float32]:
        """(b, n, 3) many posed faces."""
        out = np.empty((len(batch), self.n_vertices, 3), dtype=np.float32)
        for start in range(0, len(batch), AT_ONCE):
            self._pose(batch[start : start + AT_ONCE], out[start : start + AT_ONCE])
        return out

    def _pose(self, batch: Sequence[FaceParameters], out: NDArray[np.float32]) -> None:
        """Some posed faces, at least one, into `out` (b, n, 3)."""
        who = self.motions.who([p.identity for p in batch])
        moves, skin = self.motions.person(who)
        made, folds = self.motions.expression(who, self._key_values(batch, who.targets))
        moves += made
        cages = self._caged(moves)
        joints = cages[:, self._m :] - cages[:, self._m : self._m + 1]
        cages = cages[:, : self._m] - cages[:, self._m : self._m + 1]
        creases = self._skin_or_still(both(skin, folds), len(batch))
        fine = self._blocks if len(batch) > 1 else [self._fine]
        if not any(any((*p.head, *p.neck, *p.gaze)) for p in batch):
            refine_many(fine, cages, creases, out=out)
            return

        head, neck, gaze = (
            np.stack([rotation(angles) for angles in part]).astype(np.float32)
            for part in zip(*((p.head, p.neck, (*p.gaze, 0.0)) for p in batch), strict=True)
        )
        still = np.zeros_like(joints[:, 0])  # the head turns about the origin, then the neck
        whole, shift = neck @ head, joints[:, 1:2] - turned(joints[:, 1:2], neck)
        refine_many(fine, turned(cages, whole) + shift, turned(creases, whole), out=out)
        for eye, at in self._eyes.items():
            ball = refine_many([self._eye_rows[eye]], cages)
            ball = turned(ball, gaze, joints[:, JOINTS.index(eye)])
            out[:, at] = turned(ball, whole) + shift
        follow = self.weights[self._blended]
        skin = blended(refine_many([self._blended_rows], cages), follow[:, 0], head, still)
        out[:, self._blended] = blended(skin, follow[:, 1], neck, joints[:, 1])


@lru_cache(maxsize=1)
def load_rig(path: Path = ASSET) -> FaceRig:
    """The rig that ships with the package, read once. InputError if the file is damaged."""
    try:
        with open(path, "rb") as file, np.load(file) as arrays:
            found = dict(arrays)  # every array has a checksum, which is compared here
    except Exception as error:  # a flipped bit may raise whatever zipfile and numpy can
        if isinstance(error, MemoryError) or getattr(error, "errno", None) in BUSY:
            raise
        raise _damaged(path) from error
    try:
        return FaceRig(found)
    except (ValueError, LookupError, TypeError) as error:  # another file, or a forged one
        raise _damaged(path) from error


def _damaged(path: Path) -> InputError:
    return InputError(f"the rig's data file '{path}' is damaged; install again or `make bake`")


def landmark_points(rig: FaceRig, vertices: NDArray) -> dict[str, NDArray]:
    """Landmark name -> (3,) its place on posed vertices."""
    return dict(zip(LANDMARKS, vertices[rig.landmarks], strict=True))
