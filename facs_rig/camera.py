"""The one camera of the project: looking along -z, orthographic or with perspective."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Camera:
    """A camera in front of the face, looking along -z at the world's origin.

    Pixels are u to the right and v down, with pixel centres at .5. `scale` holds pixels per metre
    in u and v at the depth of the origin (they differ in the thesis' 91 x 200 working images),
    `centre` the pixel in which the world's origin appears. `distance` is the eye's distance from
    the origin in metres; infinite makes the projection orthographic.
    """

    width: int
    height: int
    scale: tuple[float, float]
    centre: tuple[float, float]
    distance: float = np.inf

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(
                f"a camera needs a picture of at least 1x1, got {self.width}x{self.height}"
            )
        if min(self.scale) <= 0 or self.distance <= 0:
            raise ValueError("a camera's scale and distance must be positive")

    @classmethod
    def framing(
        cls,
        points: NDArray,
        width: int,
        height: int,
        margin: float = 0.08,
        distance: float = np.inf,
    ) -> Camera:
        """Camera with square pixels whose picture holds all `points` (n, 3) with a margin.

        `margin` is a fraction of the picture's shorter side, kept free on every side.
        """
        flat = cls(1, 1, (1.0, 1.0), (0.0, 0.0), distance).project(points)
        low, high = flat.min(axis=0), flat.max(axis=0)
        room = np.array([width, height]) - 2 * margin * min(width, height)
        scale = float(np.min(room / np.maximum(high - low, 1e-9)))
        centre = np.array([width, height]) / 2 - scale * (low + high) / 2
        return cls(width, height, (scale, scale), (float(centre[0]), float(centre[1])), distance)

    def matrix(self) -> NDArray[np.float64]:
        """(3, 4) matrix M with [u v 1]ᵀ ~ M [x y z 1]ᵀ; its last row is 0 0 0 1 if orthographic."""
        (sx, sy), (cu, cv) = self.scale, self.centre
        k = 1.0 / self.distance  # 0 for the orthographic camera
        return np.array(
            [[sx, 0.0, -cu * k, cu], [0.0, -sy, -cv * k, cv], [0.0, 0.0, -k, 1.0]], dtype=np.float64
        )

    def project(self, points: NDArray) -> NDArray:
        """Pixels (..., 2) of points (..., 3) in metres."""
        (sx, sy), (cu, cv) = self.scale, self.centre
        w = self.relative_depth(points)
        u = sx * points[..., 0] / w + cu
        v = -sy * points[..., 1] / w + cv
        return np.stack([u, v], axis=-1)

    def relative_depth(self, points: NDArray) -> NDArray:
        """(...,) how far points (..., 3) are from the eye, in its distance from the origin.

        So much wider is a pixel there; 1 everywhere without perspective.
        """
        return 1.0 - points[..., 2] / self.distance

    def view_vectors(self, points: NDArray) -> NDArray:
        """Unit vectors (n, 3) from points (n, 3) toward the eye."""
        if np.isinf(self.distance):
            return np.broadcast_to(np.array([0, 0, 1], dtype=points.dtype), points.shape)
        toward = np.array([0, 0, self.distance], dtype=points.dtype) - points
        toward /= np.sqrt(np.einsum("...i,...i->...", toward, toward))[..., None]
        return toward

    def cropped(
        self, left: float, top: float, right: float, bottom: float, width: int, height: int
    ) -> Camera:
        """The camera whose picture is the given box of this one, resized to width x height."""
        if right <= left or bottom <= top:
            raise ValueError("a crop needs left < right and top < bottom")
        fu, fv = width / (right - left), height / (bottom - top)
        return Camera(
            width,
            height,
            (self.scale[0] * fu, self.scale[1] * fv),
            ((self.centre[0] - left) * fu, (self.centre[1] - top) * fv),
            self.distance,
        )
