"""A beard as one mesh: single hairs, and under a thick one a coat that the skin does not show
through."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from ..looks import colours_of
from ..rig import FaceRig
from ..shape import Worn
from .beard import Beard
from .coat import coat
from .follow import Bound, bound_to
from .hairs import hairs

NAME = "beard"
DETAIL = 0.5
FEWEST, MOST = 3_000, 15_000  # triangles at detail 0 and 1, of a beard that covers all it can
UNDER = 0.72  # how light the coat is: what lies under hairs
LOOSE = 0.22  # how much lighter or darker than the beard a hair may be
ROUGHNESS = 0.55


@dataclass(frozen=True, eq=False)
class BeardMesh:
    """A beard on a person; see `hair.mesh.HairMesh`, whose fields it has.

    points : (n, 3) float32, metres, on the upright person at rest
    quads : (q, 4) int32, turned outwards; a triangle has its last corner twice
    uv : (n, 2) float32, 0..1, v from root to tip      shade, grain : (n,) float32
    colour : linear RGB      bound : how it follows the skin      beard : what it was made of
    """

    points: NDArray[np.float32]
    quads: NDArray[np.int32]
    uv: NDArray[np.float32]
    shade: NDArray[np.float32]
    grain: NDArray[np.float32]
    colour: tuple[float, float, float]
    bound: Bound
    beard: Beard

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(t, 3) the halves of the quads."""
        whole = self.quads[self.quads[:, 2] != self.quads[:, 3]]
        return np.concatenate([self.quads[:, [0, 1, 2]], whole[:, [0, 2, 3]]])

    def on(self, vertices: NDArray) -> NDArray[np.float32]:
        """(n, 3) metres, the points on a posed face (v, 3) of the rig."""
        return self.bound.points(vertices)

    def lying_on(self, vertices: NDArray) -> BeardMesh:
        """The same beard, its points on an upright face at rest (v, 3) whose skin was fitted."""
        return replace(self, points=self.on(vertices))

    def worn_on(self, vertices: NDArray, moves: Mapping[str, NDArray] | None = None) -> Worn:
        """The same as a face wears it in a file. moves : name -> (v, 3) metres, of the face"""
        points = self.on(vertices)
        own = self.bound.moves(vertices, moves or {})
        return Worn(
            NAME, points, self.quads, self.uv, self.shade, self.colour, ROUGHNESS, moves=own
        )


def beard_mesh(
    rig: FaceRig,
    identity: Mapping[str, float] | None,
    beard: Beard,
    detail: float = DETAIL,
) -> BeardMesh | None:
    """The beard of a person, None where nothing grows.

    The same beard makes the same mesh. rig : of any level. InputError for a detail out of range.
    """
    if not 0 <= detail <= 1:
        raise InputError(f"the detail of a beard must be from 0 to 1, got {detail}")
    vertices = np.asarray(rig.neutral(identity), float)
    room = FEWEST + detail * (MOST - FEWEST)
    under = coat(rig, vertices, beard)
    grown = hairs(rig, vertices, beard, room - 2 * len(under.quads))
    if grown is None:
        return None
    first, roots = len(under.points), len(under.index)
    points = np.concatenate([under.points, grown.points])
    growing = (
        np.concatenate([under.index, grown.index]),
        np.concatenate([under.weight, grown.weight]),
        np.concatenate([under.anchors, grown.anchors]),
    )
    root = np.concatenate([under.root, grown.root + roots])
    stiffness = np.concatenate([np.zeros(roots), grown.stiffness])
    bound = bound_to(points, root, growing, stiffness, rig, vertices)
    shade = np.concatenate([np.full(first, UNDER), 1 + LOOSE * grown.tone])
    grain = np.concatenate([40 * under.uv[:, 0], 17.0 * grown.root + 3 * grown.uv[:, 0]])
    colour = colours_of({**(identity or {}), "brow_colour": beard.colour})["brows"].colour
    return BeardMesh(
        points.astype(np.float32),
        np.concatenate([under.quads, grown.quads + first]).astype(np.int32),
        np.concatenate([under.uv, grown.uv]).astype(np.float32),
        shade.astype(np.float32), grain.astype(np.float32), colour[:3], bound, beard,
    )  # fmt: skip
