"""Which points of a line can be seen: rays to the eye, against every triangle in their way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera

from .curvature import ready
from .kernels import kernels
from .strokes import LineSet, Stroke, cut

# A line on the face is looked for that far above it, in metres, and may still lie that much
# behind what is in front of it: its triangles are flat where the face is round.
LIFT, BIAS = 0.0003, 0.0015
LOOSE_BIAS = 0.0025  # the same of lines off the face: locks lie in the hair
COVER_BIAS = 0.003  # the same of lines on what is worn, whose triangles are larger
# A line that dips that far between two parts that are seen goes on: where lips press together.
DIP = 0.003


@dataclass(frozen=True)
class Cover:
    """What is worn on a face: it hides all of it that lies behind, and has lines of its own.

    points : (p, 3) metres;  triangles : (t, 3) of a closed surface, turned outwards
    lines : on it or off it, whole
    """

    points: NDArray
    triangles: NDArray
    lines: list[LineSet]


@dataclass(frozen=True)
class Scene:
    """What hides lines: triangles (t, 3) that face the camera, over vertices (n, 3) in metres.

    face : how many of the triangles, the first, are no cover's
    """

    vertices: NDArray
    triangles: NDArray
    pixels: NDArray
    camera: Camera
    face: int

    @classmethod
    def of(
        cls, vertices: NDArray, triangles: NDArray, camera: Camera,
        shells: list[tuple[NDArray, NDArray]], cover: Cover | None = None,
    ) -> Scene:  # fmt: skip
        """A face and `shells` of hair, (points, triangles), which hide from both sides."""
        for points, shell in shells:
            both = np.concatenate([shell, shell[:, ::-1]]) + len(vertices)
            triangles = np.concatenate([triangles, both.astype(triangles.dtype)])
            vertices = np.concatenate([vertices, points])
        face = len(triangles)
        if cover is not None:
            more = (cover.triangles + len(vertices)).astype(triangles.dtype)
            triangles = np.concatenate([triangles, more])
            vertices = np.concatenate([vertices, cover.points])
        return cls(
            ready(vertices), ready(triangles, np.int32), ready(camera.project(vertices)), camera,
            face,
        )  # fmt: skip

    def topmost(self, points: NDArray) -> tuple[NDArray, NDArray]:
        """Depth (p,) in metres and number (p,) of the triangle that is seen over points (p, 3).

        -inf and -1 where there is none.
        """
        at = ready(self.camera.project(points))
        return kernels().topmost(self.pixels, ready(self.vertices[:, 2]), self.triangles, at)


def visible_strokes(
    sets: list[LineSet], scene: Scene, eyes: NDArray, cover: Cover | None = None
) -> list[Stroke]:
    """What the camera sees of lines; eyes : (t,) bool, triangles on which irises are painted.

    cover : the scene's, whose lines are seen as well
    """
    bare = len(sets)
    sets = sets if cover is None else sets + cover.lines
    if not sets:
        return []
    camera = scene.camera
    points = np.concatenate([line.points for line in sets])
    above = points + LIFT * np.concatenate([line.normals for line in sets])
    pixels = camera.project(points)
    u, v = pixels.T
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    asked = inside & np.concatenate([line.shown & (line.strength > 0) for line in sets])
    asked = np.flatnonzero(asked)
    depth, owner = scene.topmost(above[asked])
    behind = np.full(len(points), np.inf)
    behind[asked] = depth - above[asked, 2]
    under = np.zeros(len(points), dtype=bool)
    under[asked] = owner >= scene.face
    on_eye = np.zeros(len(points), dtype=bool)
    on_eye[asked] = np.append(eyes, np.zeros(len(scene.triangles) - len(eyes) + 1, bool))[owner]
    seen, nearly = np.zeros((2, len(points)), dtype=bool)
    start = 0
    for k, line in enumerate(sets):
        part = slice(start, start + len(line.points))
        start = part.stop
        if k >= bare:
            seen[part] = nearly[part] = behind[part] <= COVER_BIAS
            continue
        bias = BIAS if line.normals.any() else LOOSE_BIAS
        seen[part], nearly[part] = behind[part] <= bias, behind[part] <= DIP
        # However thin a cover is, nothing under it is seen.
        seen[part] &= ~under[part]
        nearly[part] &= ~under[part]
        if line.kind in ("iris", "pupil"):  # the lids are thinner than the bias
            seen[part] &= on_eye[part]
            nearly[part] &= on_eye[part]
    return cut(sets, pixels, seen, nearly)
