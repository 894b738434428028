"""Small functions on triangle meshes that numpy and the rest of the project share."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


def is_shape(array: NDArray, shape: tuple[int | None, ...], name: str) -> NDArray:
    """Return `array` if it has `shape` (None fits any length), else raise a ValueError."""
    if array.ndim != len(shape) or any(
        want is not None and got != want for got, want in zip(array.shape, shape, strict=False)
    ):
        wanted = "(" + ", ".join("n" if s is None else str(s) for s in shape) + ")"
        raise ValueError(f"{name} must have the shape {wanted}, got {array.shape}")
    return array


def triangle_normals(vertices: NDArray, triangles: NDArray) -> NDArray:
    """Normals (t, 3), as long as twice each triangle's area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def corner_matrix(triangles: NDArray, n: int) -> sp.csr_matrix:
    """Sparse (n, t) matrix that sums a value of each triangle to its three vertices."""
    t = len(triangles)
    rows = triangles.T.ravel()
    cols = np.tile(np.arange(t), 3)
    return sp.csr_matrix((np.ones(3 * t, dtype=np.float32), (rows, cols)), shape=(n, t))


def vertex_normals(
    vertices: NDArray, triangles: NDArray, corners: sp.csr_matrix | None = None
) -> NDArray:
    """Unit normals (n, 3), averaged over the triangles around a vertex with their areas.

    `corners` is `corner_matrix(triangles, n)`; pass it when many poses of one mesh are shaded.
    """
    if corners is None:
        corners = corner_matrix(triangles, len(vertices))
    normals = corners @ triangle_normals(vertices, triangles)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.maximum(length, 1e-20)
