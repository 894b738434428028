"""Which edges join which triangles: worked out once for a mesh, used for every drawing of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig import FaceRig
from facs_rig.anatomy import UNDRAWN_PARTS
from facs_rig.common.derived import derived


@dataclass(frozen=True)
class Topology:
    """The edges of a triangle mesh in which at most two triangles share an edge.

    triangles : (t, 3) int32        edges : (e, 2) int32, the lower vertex first
    triangle_edges : (t, 3) int32, edge k joins the corners k and k + 1 of its triangle
    edge_triangles : (e, 2) int32, -1 for the missing one of an edge at the rim of the mesh
    """

    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    triangle_edges: NDArray[np.int32]
    edge_triangles: NDArray[np.int32]

    @classmethod
    def of(cls, triangles: NDArray) -> Topology:
        """The topology of triangles (t, 3)."""
        triangles = np.ascontiguousarray(triangles, dtype=np.int32)
        ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
        ends = np.sort(ends, axis=1).astype(np.int64)
        count = int(ends.max(initial=0)) + 1
        keys, edge, uses = np.unique(
            ends[:, 0] * count + ends[:, 1], return_inverse=True, return_counts=True
        )
        edge = edge.ravel()
        owner = np.append(np.argsort(edge, kind="stable") // 3, -1)
        first = np.cumsum(uses) - uses
        sides = np.stack([owner[first], owner[np.where(uses > 1, first + 1, -1)]], axis=1)
        return cls(
            triangles,
            np.stack(np.divmod(keys, count), axis=1).astype(np.int32),
            edge.reshape(-1, 3).astype(np.int32),
            sides.astype(np.int32),
        )

    def between(self, edge: NDArray, other: NDArray) -> NDArray[np.int32]:
        """The triangle (k,) that has both of two edges (k,)."""
        one, two = self.edge_triangles[edge], self.edge_triangles[other]
        shared = (one[:, 0] == two[:, 0]) | (one[:, 0] == two[:, 1])
        return np.where(shared, one[:, 0], one[:, 1])


@dataclass(frozen=True)
class FaceTopology:
    """The face without its hairs, which are drawn as curves.

    solid : topology of these triangles        index : (t,) int32, their numbers in the rig
    skin, eyes : (t,) bool        shells : hair layer -> topology of its surface
    under : stroke or layer -> the point of the face under each of its points, as a triangle of
    the rig (k,) and barycentric weights (k, 3); none for layers that stand off the face
    """

    solid: Topology
    index: NDArray[np.int32]
    skin: NDArray[np.bool_]
    eyes: NDArray[np.bool_]
    shells: dict[str, Topology]
    under: dict[str, tuple[NDArray, NDArray]]


@derived
def face_topology(rig: FaceRig) -> FaceTopology:
    """The topology of a rig, made when it is first asked for."""
    part = {name: k for k, name in enumerate(rig.part_names)}
    hairs = [part[name] for name in UNDRAWN_PARTS]
    index = np.flatnonzero(~np.isin(rig.triangle_part, hairs)).astype(np.int32)
    owner = rig.triangle_part[index]
    around = _around(rig.triangles, rig.n_vertices)
    found = {name: _under(rig.triangles, around, *place) for name, place in rig.under.items()}
    for name, curve in rig.curves.items():
        if not curve.lift.any():
            found[name] = _under(rig.triangles, around, curve.index, curve.weight)
    return FaceTopology(
        Topology.of(rig.triangles[index]),
        index,
        owner == part["skin"],
        owner == part["eyes"],
        {name: Topology.of(c.triangles) for name, c in rig.curves.items() if len(c.triangles)},
        {name: place for name, place in found.items() if place is not None},
    )


def _around(triangles: NDArray, n: int) -> tuple[NDArray, NDArray]:
    """The triangles of one vertex after another, and (n,) how many each of the n vertices has."""
    flat = triangles.ravel()
    return np.argsort(flat, kind="stable") // 3, np.bincount(flat, minlength=n)


def _under(
    triangles: NDArray, around: tuple[NDArray, NDArray], index: NDArray, weight: NDArray
) -> tuple[NDArray[np.int32], NDArray[np.float64]] | None:
    """Triangle (k,) and barycentric weights (k, 3) of points given by vertices and weights (k, 3).

    around : see `_around`. None if a point is not on a triangle.
    """
    owners, uses = around
    at = index[np.arange(len(index)), np.abs(weight).argmax(axis=1)]
    row = np.repeat(np.arange(len(index)), uses[at])
    place = np.arange(len(row)) - np.repeat(np.cumsum(uses[at]) - uses[at], uses[at])
    near = owners[(np.cumsum(uses) - uses)[at][row] + place]
    has = triangles[near][:, :, None] == index[row][:, None, :]  # (pairs, corners, vertices)
    fits = np.flatnonzero((has.any(axis=1) | (weight[row] == 0)).all(axis=1))
    found, first = np.unique(row[fits], return_index=True)
    if len(found) < len(index):
        return None
    chosen = fits[first]
    return near[chosen].astype(np.int32), (has[chosen] * weight[:, None, :]).sum(axis=2)
