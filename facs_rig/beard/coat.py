"""What lies under the hairs of a thick beard: a coat on the skin, so that it does not show through.

Polygons of a lighter level of detail, lifted off the skin where the beard is thick and sunk into it
where it is not: they come out of it along a line that runs as the beard does, not as they do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.derived import derived
from ..mesh import vertex_normals
from ..rig import FaceRig, landmark_points
from .beard import Beard
from .chart import _anchors, _over_mouth, chart_of
from .growth import growth
from .lip import lip_places, rim_of

COVERED = (0.45, 0.85)
"""How thick a beard grows where its coat is deepest in the skin, and where it comes out of it: well
inside, where hairs hide its rim."""
LEAST = (0.008, 0.018)
"""Metres of hairs up to which skin is meant to be seen between them, and from which on not."""
THICK, SUNK = 0.12, 0.0015
"""Share of the hairs' length that a coat stands off, and metres that its edge lies in the skin."""
MOST = 0.0014
"""Metres that it stands off at most."""


@dataclass(frozen=True, eq=False)
class Coat:
    """points : (n, 3) metres;  root : (n,), each its own
    quads, uv, index, weight, anchors : as in hairs.Hairs
    """

    points: NDArray[np.float64]
    root: NDArray[np.intp]
    uv: NDArray[np.float64]
    quads: NDArray[np.intp]
    index: NDArray[np.int32]
    weight: NDArray[np.float64]
    anchors: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Ground:
    """Polygons of the chart's skin, light ones.

    vertices : (g,) of the rig;  quads : (q, 4) of these, by their numbers
    place : (g, 2) on the chart;  anchors : (g, 3);  above, lip : as in chart.Roots
    """

    vertices: NDArray[np.intp]
    quads: NDArray[np.intp]
    place: NDArray[np.float64]
    anchors: NDArray[np.int32]
    above: NDArray[np.bool_]
    lip: NDArray[np.float64]


def coat(rig: FaceRig, vertices: NDArray, beard: Beard) -> Coat:
    """The coat under a beard on an upright face at rest (v, 3); empty under stubble."""
    ground = ground_of(rig)
    grown = growth(beard, ground.place, ground.lip, ground.above)
    deepest, out = COVERED
    hides = np.clip((grown.length - LEAST[0]) / (LEAST[1] - LEAST[0]), 0, 1)
    cover = grown.cover * hides
    kept = (cover > deepest)[ground.quads].all(axis=1)
    used = np.unique(ground.quads[kept])
    number = np.full(len(ground.vertices), -1)
    number[used] = np.arange(len(used))
    at, cover = ground.vertices[used], cover[used]
    normals = vertex_normals(vertices.astype(np.float32), rig.triangles, rig.corners)[at]
    inner = np.ones(len(ground.vertices), bool)
    inner[np.unique(ground.quads[~kept])] = False
    cover = np.where(inner[used], cover, np.minimum(cover, (deepest + out) / 2))
    lift = np.minimum(THICK * grown.length[used], MOST) * np.clip((cover - out) / (1 - out), 0, 1)
    lift -= SUNK * np.clip((out - cover) / (out - deepest), 0, 1)
    points = vertices[at] + lift[:, None] * normals
    index = np.repeat(at[:, None], 3, axis=1).astype(np.int32)
    return Coat(
        points, np.arange(len(used)), ground.place[used] * (1, 0), number[ground.quads[kept]],
        index, np.full((len(used), 3), 1 / 3), ground.anchors[used],
    )  # fmt: skip


@derived
def ground_of(rig: FaceRig) -> Ground:
    """The light polygons of a rig's chart, worked out once."""
    chart = chart_of(rig)
    corners, starts = _light_polygons(rig)
    four = np.diff(np.append(starts, len(corners))) == 4
    quads = corners[starts[four][:, None] + np.arange(4)]
    known = np.full(rig.n_vertices, -1)
    known[chart.vertices] = np.arange(len(chart.vertices))
    quads = quads[(known[quads] >= 0).all(axis=1)]
    used, flat = np.unique(quads, return_inverse=True)
    rest = np.asarray(rig.neutral(), float)
    mark = landmark_points(rig, rest)
    above = _over_mouth(rest[used], mark)
    place, normal = chart.place[known[used]], chart.normal[known[used]]
    anchors = _anchors(rest[used], normal, above, chart.vertices, rest, mark)
    lip = lip_places(rest[used], rim_of(rig, rest), mark)
    return Ground(used, flat.reshape(-1, 4), place, anchors, above, lip)


def _light_polygons(rig: FaceRig) -> tuple[NDArray, NDArray]:
    """Polygons of few vertices, by the rig's numbers, and their starts."""
    if rig.level != "full":
        return np.asarray(rig.polygon_vertices), np.asarray(rig.polygon_starts)
    places, starts = rig.lighter["medium"]
    return rig.texture.vertices[places], np.asarray(starts)
