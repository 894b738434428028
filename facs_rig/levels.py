"""Levels of detail: the same face with fewer vertices.

A level has some of the full face's vertices, where that has them in every pose, and polygons of its
own between them. So it takes the same parameters and has the same keys; what is known of the full
face's vertices is known of the level's.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .common.derived import derived, forget
from .common.errors import InputError
from .fitted_keys import FittedKey
from .rig import FaceRig
from .subdivide import triangulate
from .uv import TextureMap

FULL = "full"
LEVELS = {
    FULL: "every crease and hair",
    "medium": "a quarter of the polygons, hairs as flat blades, softer creases",
    "game": "under 6,000 triangles, brows and lashes as strips, no creases to speak of",
}
NEAR = 64  # triangles among which that under a point of a stroke is looked for


def at_level(rig: FaceRig, level: str) -> FaceRig:
    """The face at one of LEVELS; `rig` itself, which is a full one, at `full`.

    Its strokes lie on its own surface, its landmarks on the vertices that are nearest to the full
    face's; curves other than strokes, single hairs say, only the full face has.
    InputError for a level that there is not.
    """
    check_level(level)
    return rig if level == rig.level else _lighter(rig)[level]


def check_level(level: str) -> None:
    """InputError, one sentence, for a level that there is not."""
    if level not in LEVELS:
        raise InputError(f"there is no level of detail '{level}'; use {', '.join(LEVELS)}")


def kept_by(rig: FaceRig, values: NDArray) -> NDArray:
    """Values (n, ...) of the full face's vertices, for those of the level `rig`; others as are."""
    return values if rig.of_full is None or len(values) == rig.n_vertices else values[rig.of_full]


def keys_kept_by(rig: FaceRig, keys: Sequence[FittedKey]) -> tuple[FittedKey, ...]:
    """The same of fitted keys."""
    return tuple(replace(key, offsets=kept_by(rig, key.offsets)) for key in keys)


def at_vertices(rig: FaceRig, at: NDArray, polygons: NDArray, starts: NDArray) -> FaceRig:
    """The rig with some of its vertices alone, `at` (k,) in rising order.

    polygons : flat, by the rig's numbers, with the `starts` of each. It has neither texture,
    landmarks, strokes, curves nor mirror images: these are the caller's.
    """
    number = np.full(rig.n_vertices, -1, dtype=np.int32)
    number[at] = np.arange(len(at))
    new = copy.copy(rig)
    for name in list(vars(new)):
        if isinstance(getattr(type(rig), name, None), cached_property):
            delattr(new, name)
    forget(new)
    skin_at = rig.motions.skin_at
    kept = np.isin(skin_at, at)
    new.motions = rig.motions.at_skin(kept, number[skin_at[kept]].astype(np.intp))
    new._matrix, new.n_vertices, new.of_full = rig._matrix[at], len(at), at
    new.polygon_vertices, new.polygon_starts = number[polygons], starts.astype(np.int32)
    new.triangles = triangulate(new.polygon_vertices, new.polygon_starts)
    new.vertex_part = rig.vertex_part[at]
    new.mirror, new.curves, new.strokes = np.arange(len(at), dtype=np.int32), {}, {}
    new.under, new.weights = {}, rig.weights[at]
    return new


@derived
def _lighter(rig: FaceRig) -> dict[str, FaceRig]:
    """The levels below the full one."""
    return {name: _level(rig, name, *polygons) for name, polygons in rig.lighter.items()}


def _level(rig: FaceRig, name: str, corners: NDArray, starts: NDArray) -> FaceRig:
    """The rig with these polygons, given by the places of their corners on the texture."""
    owner = rig.texture.vertices
    at = np.unique(owner[corners])
    new = at_vertices(rig, at, owner[corners], starts)
    number = np.full(rig.n_vertices, -1, dtype=np.int32)
    number[at] = np.arange(len(at))
    new.level, new.mirror = name, number[rig.mirror[at]]
    new.texture = _texture(rig.texture, at, corners, number)
    rest = rig.neutral()
    for part in np.unique(rig.vertex_part[rig.landmarks]):
        mine = rig.vertex_part[rig.landmarks] == part
        own = np.flatnonzero(new.vertex_part == part)
        nearest = cKDTree(rest[at[own]]).query(rest[rig.landmarks[mine]])[1]
        new.landmarks = np.where(mine, 0, new.landmarks)
        new.landmarks[mine] = own[nearest]
    new.under = {
        name: _bound(new, _on(rest, *bound), int(rig.vertex_part[bound[0][0, 0]]))
        for name, bound in rig.under.items()
    }
    new.strokes = dict(new.under)
    return new


def _on(vertices: NDArray, index: NDArray, weight: NDArray) -> NDArray:
    """(k, 3) points on a surface, from the vertices (k, 3) and weights (k, 3) of each."""
    return np.einsum("kc,kcd->kd", weight, vertices[index])


def _texture(texture: TextureMap, at: NDArray, corners: NDArray, number: NDArray) -> TextureMap:
    """The places that a level's corners have, its vertices' first."""
    extra = np.setdiff1d(corners, at)  # a vertex' first place has its own number
    places = np.append(at, extra)
    new = np.full(len(texture.points), -1, dtype=np.int32)
    new[places] = np.arange(len(places))
    return TextureMap(texture.points[places], number[texture.vertices[places]], new[corners])


def _bound(rig: FaceRig, points: NDArray, part: int) -> tuple[NDArray[np.int32], NDArray]:
    """Points (k, 3) laid onto a level's triangles of one part: vertices and weights (k, 3)."""
    rest = rig.neutral()
    triangles = rig.triangles[rig.triangle_part == part]
    corners = rest[triangles].astype(float)
    near = cKDTree(corners.mean(axis=1)).query(points, min(NEAR, len(triangles)))[1]
    a, b, c = (corners[near][:, :, k] for k in range(3))
    u, v, w = b - a, c - a, points[:, None] - a
    uu, uv, vv, uw, vw = ((x * y).sum(axis=2) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    size = np.maximum(uu * vv - uv * uv, 1e-30)
    second, third = (vv * uw - uv * vw) / size, (uu * vw - uv * uw) / size
    weight = np.clip(np.stack([1 - second - third, second, third], axis=2), 0, 1)
    weight /= weight.sum(axis=2, keepdims=True)
    off = (weight[..., None] * corners[near]).sum(axis=2) - points[:, None]
    best = np.linalg.norm(off, axis=2).argmin(axis=1)
    row = np.arange(len(points))
    return triangles[near[row, best]], weight[row, best].astype(np.float32)
