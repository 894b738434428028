"""Lines that are painted on the face or stand off it: brows, irises, lips, lashes, hair."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera, FaceRig
from facs_rig.curves import Curves
from facs_rig.mesh import corner_matrix

from .kernels import kernels
from .strokes import LineSet
from .topology import FaceTopology, Topology
from .zero_sets import chains, zero_set

HAIR_LIFT = 10.0  # times the lift of other lines: smoothed outlines lie in or out of coarse hair
HAIR_GAP = 2.8  # pixels between hairs that are drawn
MOST_OF_A_HAIR = 5  # points that a hair of lashes and brows has at most


def painted_lines(
    rig: FaceRig,
    vertices: NDArray,
    normals: NDArray,
    topology: FaceTopology,
    layers: tuple[str, ...],
) -> list[LineSet]:
    """The strokes of rig.strokes whose names' first words are among `layers`, a set for each kind.

    vertices, normals : (n, 3) of the posed face
    """
    kinds: dict[str, list[str]] = {}
    for name in rig.strokes:
        kinds.setdefault(name.split("_")[0], []).append(name)
    sets = []
    for kind in kinds:
        if kind in layers:
            names = kinds[kind]
            index, weight = (np.concatenate([rig.strokes[n][k] for n in names]) for k in range(2))
            sizes = [len(rig.strokes[name][0]) for name in names]
            sets.append(
                LineSet(
                    kind,
                    np.einsum("kc,kcd->kd", weight, vertices[index]),
                    np.concatenate([[0], np.cumsum(sizes)]),
                    np.ones(len(index)),
                    np.ones(len(names)),
                    np.einsum("kc,kcd->kd", weight, normals[index]),
                    np.ones(len(index), dtype=bool),
                    _joined([topology.under.get(name) for name in names]),
                )
            )
    return sets


def _joined(places: list) -> tuple[NDArray, NDArray] | None:
    if any(place is None for place in places):
        return None
    triangle, weights = zip(*places, strict=True)
    return np.concatenate(triangle), np.concatenate(weights)


def curve_lines(
    layer: str, curve: Curves, points: NDArray, topology: FaceTopology, camera: Camera
) -> list[LineSet]:
    """The lines of one of rig.curves, and the outline of hair; points : (p, 3) metres."""
    sets = []
    if len(curve.triangles):
        sets.append(_outline(layer, topology.shells[layer], points, camera))
    lines = curve.lines()
    chosen = _spaced(curve, camera.project(points))
    at = np.concatenate([np.arange(lines[k].start, lines[k].stop) for k in chosen])
    sizes = [lines[k].stop - lines[k].start for k in chosen]
    place = curve.places[at]
    under = topology.under.get(layer)
    sets.append(
        LineSet(
            layer,
            points[place],
            np.concatenate([[0], np.cumsum(sizes)]),
            curve.strength[at],
            curve.width[chosen],
            np.zeros((len(at), 3)),
            np.ones(len(at), dtype=bool),
            None if under is None else (under[0][place], under[1][place]),
        )
    )
    return sets


def _outline(layer: str, shell: Topology, points: NDArray, camera: Camera) -> LineSet:
    """The contour of a surface of hair, of its smoothed n·v: one clean line of many."""
    normals = kernels().vertex_normals(points, shell.triangles)
    facing = np.einsum("ij,ij->i", normals, camera.view_vectors(points))
    around = corner_matrix(shell.triangles, len(points))
    share = np.maximum(np.asarray(around.sum(axis=1)).ravel(), 1)
    for _ in range(3):
        facing = around @ facing[shell.triangles].mean(axis=1) / share
    found = zero_set(shell, facing)
    line, starts = chains(found.segments)
    return LineSet(
        layer, found.of(points)[line], starts, np.ones(len(line)), np.ones(len(starts) - 1),
        HAIR_LIFT * found.of(normals)[line], np.ones(len(line), dtype=bool),
    )  # fmt: skip


def _spaced(curve: Curves, pixels: NDArray) -> list[int]:
    """Which lines of a layer to draw: so many hairs that they stand HAIR_GAP pixels apart.

    Long lines are always drawn; hairs too close to each other would run into one blot.
    """
    lines = curve.lines()
    hairs = [k for k, line in enumerate(lines) if line.stop - line.start <= MOST_OF_A_HAIR]
    if len(hairs) < 3:
        return list(range(len(lines)))
    roots = pixels[curve.places[curve.starts[hairs]]]
    gap = float(np.median(np.linalg.norm(np.diff(roots, axis=0), axis=1)))
    step = max(1, int(np.ceil(HAIR_GAP / max(gap, 1e-6))))
    return sorted(set(range(len(lines))) - set(hairs) | set(hairs[::step]))
