"""Line drawings of a posed face: which lines its shape has, as strokes without hidden parts.

contour      n·v = 0 (v toward the eye): where the surface turns away
suggestive   κr = 0 where it grows toward the eye, D_w κr > 0: contours of nearby views (DeCarlo,
             Finkelstein, Rusinkiewicz, Santella 2003, "Suggestive Contours for Conveying Shape")
highlight    κr = 0 where D_w κr < 0: bright lines (DeCarlo, Rusinkiewicz 2007, "Highlight Lines
             for Conveying Shape")
ridge, valley    a principal curvature is largest in its own direction (Ohtake, Belyaev, Seidel
             2004, "Ridge-Valley Lines on Meshes via Implicit Surface Fitting")
apparent     the curvature that the viewer sees is largest in its own direction (Judd, Durand,
             Adelson 2007, "Apparent Ridges for Line Drawing")
boundary     the rim of the surface: the neck's
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera, FaceRig
from facs_rig.common.errors import InputError
from facs_rig.parameters import nearest

from .curvature import (
    Principal,
    apparent_curvature,
    principal_curvatures,
    radial_curvature,
    ready,
    rise,
)
from .hidden import Cover, Scene, visible_strokes
from .kernels import kernels
from .layers import curve_lines, painted_lines
from .strokes import LineSet, Stroke
from .topology import Topology, face_topology
from .zero_sets import Crossings, MeshLines, crest, rim, traced, zero_set

__all__ = ["DETAILS", "KINDS", "WAYS", "Stroke", "draw_strokes"]

KINDS = ("contour", "suggestive", "highlight", "ridge", "valley", "apparent", "boundary")
DETAILS = ("sparse", "medium", "rich")
# What a line must have at each level of detail to be drawn: D_w κr in 1/m² of suggestive contours
# and highlights, the curvature in 1/m of the others.
LEAST = {
    "suggestive": (14_000.0, 7_000.0, 3_000.0),
    "highlight": (28_000.0, 14_000.0, 7_000.0),
    "ridge": (500.0, 400.0, 300.0),  # of folds, few: else a wrinkled forehead is one blot
    "valley": (200.0, 130.0, 80.0),
    "apparent": (500.0, 300.0, 180.0),
}
# Ways to draw what lies within the outline: the kinds of lines at each level of detail. The first
# is the thesis' way, where richer drawings take in more; people mostly draw one line in a crease.
WAYS = {
    "levels": (
        ("contour", "suggestive"),
        ("contour", "suggestive", "valley"),
        ("contour", "suggestive", "valley", "ridge"),
    ),
    "suggestive": (("contour", "suggestive"),) * 3,
    "creases": (("contour", "valley"),) * 3,
    "apparent": (("contour", "apparent"),) * 3,
}
LONGEST = 1.0  # pixels between points of a line: so exactly ends what is hidden
# Degrees from the view direction below which w is too short to be trusted: DeCarlo's θc.
LEAST_ANGLE = 18.0


def draw_strokes(
    rig: FaceRig,
    vertices: NDArray,
    camera: Camera,
    detail: int = 1,
    layers: tuple[str, ...] = ("brow", "iris", "pupil", "lip"),
    kinds: tuple[str, ...] = ("contour", "suggestive"),
    cover: Cover | None = None,
) -> list[Stroke]:
    """All visible strokes of a posed face, in pixels of `camera`.

    vertices : (n, 3) metres, from `rig.pose`;  detail : 0, 1 or 2, an index into DETAILS;
    layers : which surface strokes to add: those of rig.strokes by the first word of their name,
    and any of rig.curves. Hair hides what lies behind it. kinds : which of KINDS to draw;
    cover : what is worn

    Raises InputError for an unknown layer or kind, ValueError for another level of detail.
    """
    if detail not in range(len(DETAILS)):
        raise ValueError(f"detail must be 0, 1 or 2, got {detail}")
    known = {name.split("_")[0] for name in rig.strokes} | set(rig.curves)
    for layer in set(layers) - known:
        raise InputError(f"no layer '{layer}'{nearest(layer, tuple(sorted(known)))}")
    for kind in set(kinds) - set(KINDS):
        raise InputError(f"no kind of line '{kind}'{nearest(kind, KINDS)}")
    topology = face_topology(rig)
    curves = {layer: rig.curves[layer] for layer in layers if layer in rig.curves}
    places = {layer: ready(curve.points(vertices)) for layer, curve in curves.items()}
    shells = [(places[layer], curve.triangles) for layer, curve in curves.items()]
    shells = [shell for shell in shells if len(shell[1])]
    vertices = ready(vertices)
    scene = Scene.of(vertices, topology.solid.triangles, camera, shells, cover)
    surface = Surface(vertices, topology.solid, topology.skin, camera)

    sets = [
        replace(line, surface=line.surface and (topology.index[line.surface[0]], line.surface[1]))
        for line in shape_lines(surface, kinds, {k: least[detail] for k, least in LEAST.items()})
    ]
    sets += painted_lines(rig, vertices, surface.normals, topology, layers)
    for layer, curve in curves.items():
        sets += curve_lines(layer, curve, places[layer], topology, camera)
    return visible_strokes(sets, scene, topology.eyes, cover)


class Surface:
    """A mesh in front of a camera: what several kinds of lines need, worked out when asked for.

    chosen : (t,) bool, the triangles that have lines other than contours
    """

    def __init__(
        self, vertices: NDArray, topology: Topology, chosen: NDArray, camera: Camera,
        normals: NDArray | None = None,
    ) -> None:  # fmt: skip
        self.vertices = ready(vertices)
        self.topology = topology
        self.camera = camera
        triangles = topology.triangles
        if normals is None:
            normals = kernels().vertex_normals(self.vertices, triangles)
        self.normals = normals
        self.view = ready(camera.view_vectors(self.vertices))
        self.facing = np.einsum("ij,ij->i", self.normals, self.view)
        whole = np.ones(len(triangles), dtype=bool)
        self.some_front = kernels().touching(triangles, whole, self.facing > 0)
        self.front = chosen & ~kernels().touching(triangles, whole, ~(self.facing > 0))
        self._radial: tuple[NDArray, NDArray] | None = None
        self._principal: Principal | None = None

    def where(self, hot: NDArray) -> NDArray[np.bool_]:
        """The triangles (t,) in front of which a corner is among the vertices `hot` (n,)."""
        return kernels().touching(self.topology.triangles, self.front, hot)

    @property
    def radial(self) -> tuple[NDArray, NDArray]:
        """κr and D_w κr of the vertices of triangles in front (see curvature)."""
        if self._radial is None:
            self._radial = radial_curvature(
                self.vertices, self.topology.triangles, self.normals, self.view, self.some_front
            )
        return self._radial

    def bulging(self, lines: MeshLines) -> NDArray[np.bool_]:
        """Whether κr > 0 at the points (m,) of lines; worked out around them unless known."""
        triangles = self.topology.triangles
        if self._radial is None:
            hot = np.zeros(len(self.vertices), dtype=bool)
            hot[triangles[lines.triangle]] = True
            around = kernels().touching(triangles, self.some_front, hot)
            curvature, _ = radial_curvature(
                self.vertices, triangles, self.normals, self.view, around
            )
        else:
            curvature = self._radial[0]
        return lines.of(curvature, triangles) > 0

    @property
    def principal(self) -> Principal:
        """Principal curvatures of the vertices of triangles in front."""
        if self._principal is None:
            self._principal = principal_curvatures(
                self.vertices, self.topology.triangles, self.normals, self.front
            )
        return self._principal


def shape_lines(
    surface: Surface, kinds: Sequence[str], least: Mapping[str, float]
) -> Iterator[LineSet]:
    """The lines of some KINDS, hidden or not; triangles are those of the surface's topology.

    least : kind -> what its lines must have to be drawn, see LEAST
    """
    topology, vertices = surface.topology, surface.vertices
    by_radial = "suggestive" in kinds or "highlight" in kinds
    if by_radial:
        curvature, growth = surface.radial
    if "contour" in kinds:
        found = zero_set(topology, surface.facing, surface.some_front)
        yield _lines("contour", surface, found)
    if by_radial:
        head_on = surface.facing > np.cos(np.radians(LEAST_ANGLE))
        for kind, sign in (("suggestive", 1.0), ("highlight", -1.0)):
            if kind in kinds:
                strength = np.where(head_on, 0.0, _fade(sign * growth, least[kind]))
                found = zero_set(topology, curvature, surface.where(strength > 0))
                yield _lines(kind, surface, found, strength)
    for kind, sign in (("ridge", 1.0), ("valley", -1.0)):
        if kind in kinds:
            value = sign * surface.principal.k1
            yield _crest(kind, surface, value, surface.principal.d1, least[kind], value > 0)
    if "apparent" in kinds:
        seen, way = apparent_curvature(surface.principal, surface.view, surface.facing)
        yield _crest("apparent", surface, seen, way, least["apparent"])
    if "boundary" in kinds:
        pixels = surface.camera.project(vertices)
        yield _set("boundary", surface, rim(topology, pixels, LONGEST, surface.front))


def _crest(
    kind: str,
    surface: Surface,
    value: NDArray,
    way: NDArray,
    least: float,
    among: NDArray | None = None,
) -> LineSet:
    """Where a curvature (n,) is largest along directions (n, 3), at vertices `among` (n,) alone."""
    topology, vertices = surface.topology, surface.vertices
    there = surface.where(value > least)
    if among is not None:
        there &= ~surface.where(~among)
    used = np.zeros(len(vertices), dtype=bool)
    used[topology.triangles[there]] = True
    # the rise is a mean over all triangles around each vertex that matters
    up = rise(vertices, topology.triangles, value, way, surface.where(used))
    return _lines(kind, surface, crest(topology, vertices, up, there), _fade(value, least))


def _fade(value: NDArray, least: float) -> NDArray:
    """Strength of a line by what it has and must have: 0 at `least`, 1 at twice that."""
    return np.clip(value / least - 1.0, -1.0, 1.0)


def _lines(
    kind: str, surface: Surface, found: Crossings, strength: NDArray | None = None
) -> LineSet:
    """Crossings as lines; strength : (n,) of the vertices, 1 everywhere if None."""
    kept = np.ones(len(found.segments), dtype=bool)
    if strength is not None:  # most of a zero set is not drawn
        kept = (found.of(strength)[found.segments] > 0).any(axis=1)
    pixels = surface.camera.project(found.of(surface.vertices))
    lines = traced(surface.topology, found, pixels, LONGEST, kept)
    return _set(kind, surface, lines, strength)


def _set(kind: str, surface: Surface, lines: MeshLines, strength: NDArray | None = None) -> LineSet:
    triangles, count = surface.topology.triangles, len(lines.triangle)
    return LineSet(
        kind,
        lines.of(surface.vertices, triangles),
        lines.starts,
        np.ones(count) if strength is None else lines.of(strength, triangles),
        np.ones(len(lines.starts) - 1),
        lines.of(surface.normals, triangles),
        # where κr is negative, a surface covers its own contour
        surface.bulging(lines) if kind == "contour" else np.ones(count, bool),
        (lines.triangle, lines.weights),
    )
