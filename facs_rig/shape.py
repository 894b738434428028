"""What of a face goes to a file: its surface as it is posed, and what may be added to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from facs_rig.bones import Skeleton, skeleton_of
from facs_rig.looks import colours_of
from facs_rig.paint import MADE_OF, vertex_colours
from facs_rig.parameters import FaceParameters
from facs_rig.rig import FaceRig
from facs_rig.uv import TextureMap


@dataclass(frozen=True)
class Worn:
    """What a face wears: a surface of its own, which follows its head.

    points : (n, 3) float32, metres, core axes, posed
    quads : (q, 4) int; a triangle has its last corner twice
    uv : (n, 2) float, 0..1, v up      shade : (n,) float, of the colour, 1 as it is
    colour : linear RGB      roughness : 0 mirror to 1 chalk
    moves : name of a morph target of the face -> (n, 3) what it adds to `points`
    """

    name: str
    points: NDArray[np.float32]
    quads: NDArray[np.integer]
    uv: NDArray[np.floating]
    shade: NDArray[np.floating]
    colour: tuple[float, float, float]
    roughness: float
    moves: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)

    @property
    def triangles(self) -> NDArray[np.integer]:
        """(t, 3) the halves of the quads, and the triangles."""
        whole = self.quads[self.quads[:, 2] != self.quads[:, 3]]
        return np.concatenate([self.quads[:, [0, 1, 2]], whole[:, [0, 2, 3]]])

    @property
    def lightest(self) -> tuple[float, float, float, float]:
        """The colour where its shade is lightest, linear RGBA up to 1."""
        red, green, blue = (min(float(c * self.shade.max()), 1.0) for c in self.colour)
        return red, green, blue, 1.0


@dataclass(frozen=True)
class Shape:
    """A surface in metres and core axes (y up, z to the viewer).

    points : (n, 3) float32
    polygon_vertices : (c,) int, vertex of each corner      polygon_starts : (p,) first corners
    triangle_corners : (t, 3) int, the same surface in triangles of the polygons' corners
    colours : (n, 4) uint8, sRGB
    part : (p,) int, index into `part_names` of each polygon, and into `roughness`, 0 to 1
    texture : where the corners lie on a texture, if anybody has said so
    skeleton : bones in this pose, if anybody has said so
    moves : name -> (n, 3) float32, what each morph target adds to `points`
    worn : what it wears
    """

    points: NDArray[np.float32]
    polygon_vertices: NDArray[np.integer]
    polygon_starts: NDArray[np.integer]
    triangle_corners: NDArray[np.integer]
    colours: NDArray[np.uint8]
    part: NDArray[np.integer]
    part_names: tuple[str, ...]
    roughness: tuple[float, ...]
    texture: TextureMap | None = None
    skeleton: Skeleton | None = None
    moves: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    worn: tuple[Worn, ...] = ()

    @property
    def triangles(self) -> NDArray[np.integer]:
        """(t, 3) the vertices of the triangles."""
        return self.polygon_vertices[self.triangle_corners]


def rig_shape(
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
    moves: Mapping[str, NDArray[np.float32]] | None = None,
) -> Shape:
    """The posed face of the rig. offsets : (n, 3) metres, the fitted details, upright head"""
    corners = np.asarray(rig.polygon_vertices)
    starts = np.asarray(rig.polygon_starts)
    starts = starts[starts < len(corners)]
    palette = colours_of(parameters.identity)
    return Shape(
        points=np.asarray(rig.pose(parameters, offsets), dtype=np.float32),
        polygon_vertices=corners,
        polygon_starts=starts,
        triangle_corners=rig.triangle_corners,
        colours=vertex_colours(rig, dict(parameters.identity)),
        part=rig.vertex_part[corners[starts]],
        part_names=tuple(rig.part_names),
        roughness=tuple(palette[MADE_OF.get(name, name)].roughness for name in rig.part_names),
        texture=rig.texture,
        skeleton=skeleton_of(rig, parameters),
        moves=moves or {},
    )
