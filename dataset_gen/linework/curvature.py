"""Curvatures of a triangle mesh: radial, principal, and as the viewer sees them.

Normals are taken as linear on each triangle, which gives a shape operator there: the estimate of
Rusinkiewicz 2004, "Estimating Curvatures and Their Derivatives on Triangle Meshes". Vertices get
the mean over their triangles, weighted with area. Derivatives of curvatures are taken the same
way from the curvatures at the vertices. Positive is convex; vertices that no triangle uses get 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .kernels import kernels

# Surfaces seen at a flatter angle than that (n·v) are as foreshortened as there.
MOST_FORESHORTENED = 0.1


@dataclass(frozen=True)
class Principal:
    """Principal curvatures in 1/m, |k1| >= |k2| (n,), and their directions d1, d2 (n, 3)."""

    k1: NDArray
    k2: NDArray
    d1: NDArray
    d2: NDArray


def ready(array: NDArray, kind: type = np.float64) -> NDArray:
    """The array as the kernels take it: contiguous, of one type."""
    return np.ascontiguousarray(array, dtype=kind)


def _all(triangles: NDArray, chosen: NDArray | None) -> tuple[NDArray, NDArray]:
    if chosen is None:
        chosen = np.ones(len(triangles), dtype=bool)
    return ready(triangles, np.int32), ready(chosen, np.bool_)


def radial_curvature(
    vertices: NDArray,
    triangles: NDArray,
    normals: NDArray,
    view: NDArray,
    chosen: NDArray | None = None,
) -> tuple[NDArray, NDArray]:
    """Radial curvature κr (n,) in 1/m and its growth D_w κr (n,) in 1/m² at the vertices.

    κr is the normal curvature in the direction w of the view vector's projection onto the
    surface (DeCarlo 2003). On each triangle n and κr are linear, so that D_w n and D_w κr are
    constant there.

    normals, view : (n, 3) unit vectors, out of the surface and to the eye
    chosen : (t,) bool, the triangles that count
    """
    triangles, chosen = _all(triangles, chosen)
    vertices, normals, view = ready(vertices), ready(normals), ready(view)
    return kernels().radial_curvature(vertices, triangles, chosen, normals, view)


def principal_curvatures(
    vertices: NDArray, triangles: NDArray, normals: NDArray, chosen: NDArray | None = None
) -> Principal:
    """Principal curvatures of vertices (n, 3) with normals (n, 3); see `radial_curvature`."""
    triangles, chosen = _all(triangles, chosen)
    vertices, normals = ready(vertices), ready(normals)
    shape = kernels().shape_operators(vertices, triangles, chosen, normals)
    return Principal(*kernels().principal(shape, normals))


def rise(
    vertices: NDArray,
    triangles: NDArray,
    value: NDArray,
    direction: NDArray,
    chosen: NDArray | None = None,
) -> NDArray[np.float64]:
    """(n, 3) the derivative of a field (n,) along a direction (n, 3), as a vector.

    It points to where the field rises, whichever of its two signs the direction has.
    """
    triangles, chosen = _all(triangles, chosen)
    return kernels().rises(ready(vertices), triangles, chosen, ready(value), ready(direction))


def apparent_curvature(
    curvature: Principal, view: NDArray, facing: NDArray
) -> tuple[NDArray, NDArray]:
    """The greatest curvature q (n,) in 1/m that the viewer sees, and its direction (n, 3).

    How fast normals turn along the picture plane: Q = S P⁻¹, with the projection P along the
    view; q is its greatest singular value (Judd, Durand, Adelson 2007, "Apparent Ridges for Line
    Drawing"). On surfaces flatter than MOST_FORESHORTENED it no longer grows.

    view : (n, 3) to the eye;  facing : (n,) n·v
    """
    u = np.einsum("nd,nd->n", view, curvature.d1)
    v = np.einsum("nd,nd->n", view, curvature.d2)
    more = 1 / np.maximum(facing, MOST_FORESHORTENED) - 1
    more = more / np.maximum(u * u + v * v, 1e-12)
    q11, q12 = curvature.k1 * (1 + more * u * u), curvature.k1 * more * u * v
    q21, q22 = curvature.k2 * more * u * v, curvature.k2 * (1 + more * v * v)
    a, b, c = q11 * q11 + q21 * q21, q11 * q12 + q21 * q22, q12 * q12 + q22 * q22
    half = np.sqrt((a - c) ** 2 / 4 + b * b)
    largest = (a + c) / 2 + half
    steep = a >= c
    x, y = np.where(steep, largest - c, b), np.where(steep, b, largest - a)
    length = np.sqrt(x * x + y * y)
    x = np.where(length > 0, x / np.maximum(length, 1e-300), 1.0)
    y = np.where(length > 0, y / np.maximum(length, 1e-300), 0.0)
    way = x[:, None] * curvature.d1 + y[:, None] * curvature.d2
    return np.sqrt(largest), way
