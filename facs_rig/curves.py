"""Curves for drawing, bound to the surface: brow hairs, lashes, line of the lips, hairline, hair.

Every layer is a set of points, each on the surface or standing off it, and lines through them.
A head of hair is a surface as well, so that its outline can be drawn from any side and what lies
behind it is hidden.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from .common.ties import first_most

FIELDS = ("index", "weight", "lift", "places", "starts", "strength", "width", "triangles")


@dataclass(frozen=True)
class Curves:
    """One layer of lines on the face.

    index, weight : (p, 3) vertices of the face and their weights: where each point stands
    lift : (p, 3) float32, metres off the surface, along the axes of the head
    places, starts : points of all lines, flat, with the start of each line
    strength : float32 0..1 for each of `places`, fading toward 0
    width : (lines,) float32, share of a drawing's line width
    triangles : (t, 3) the surface of hair, of points; empty for other layers
    anchors, axes : (4,) vertices of the skull and (3, 4) weights of them that give the axes
    """

    index: NDArray[np.int32]
    weight: NDArray[np.float32]
    lift: NDArray[np.float32]
    places: NDArray[np.int32]
    starts: NDArray[np.int32]
    strength: NDArray[np.float32]
    width: NDArray[np.float32]
    triangles: NDArray[np.int32]
    anchors: NDArray[np.int32]
    axes: NDArray[np.float32]

    def points(self, vertices: NDArray) -> NDArray:
        """(p, 3) metres on a posed face (n, 3)."""
        on_surface = np.einsum("kc,kcd->kd", self.weight, vertices[self.index])
        return on_surface + self.lift @ (self.axes @ vertices[self.anchors])

    def lines(self) -> list[slice]:
        """The part of `places` and `strength` that each line takes."""
        ends = np.append(self.starts[1:], len(self.places))
        return [slice(a, b) for a, b in zip(self.starts, ends, strict=True)]


def read_curves(arrays: Mapping[str, NDArray]) -> dict[str, Curves]:
    """Layer -> its curves, from the arrays of the asset."""
    names = [name[6:-6] for name in arrays if name.startswith("curve_") and name.endswith("_index")]
    shared = {name: arrays[f"head_{name}"] for name in ("anchors", "axes") if names}
    return {
        name: Curves(**{f: arrays[f"curve_{name}_{f}"] for f in FIELDS}, **shared) for name in names
    }


def curve_arrays(layers: Mapping[str, Curves]) -> dict[str, NDArray]:
    """The arrays that `read_curves` reads."""
    out: dict[str, NDArray] = {}
    for name, curves in layers.items():
        out |= {f"curve_{name}_{f}": getattr(curves, f) for f in FIELDS}
        out |= {"head_anchors": curves.anchors, "head_axes": curves.axes}
    return out


def make_curves(
    frame: tuple[NDArray, NDArray],
    lines: list[tuple[NDArray, NDArray]],
    width: float | NDArray = 1.0,
    taper: bool = False,
) -> Curves:
    """Curves on the surface from (indices, weights), each (k, 3), of every line.

    frame : anchors and axes (see `head_frame`);  taper : whether lines thin toward their end
    """
    index, weight = (np.concatenate(part) for part in zip(*lines, strict=True))
    sizes = [len(line[0]) for line in lines]
    strength = [np.linspace(1, 0.35 if taper else 1, size) for size in sizes]
    return as_arrays(
        index=index, weight=weight, lift=np.zeros((len(index), 3)), places=np.arange(len(index)),
        starts=np.cumsum([0, *sizes[:-1]]), strength=np.concatenate(strength),
        width=np.broadcast_to(width, len(lines)), triangles=np.zeros((0, 3)),
        anchors=frame[0], axes=frame[1],
    )  # fmt: skip


def as_arrays(**values: NDArray) -> Curves:
    """Curves with every array in the type that the asset keeps."""
    whole = ("index", "places", "starts", "triangles", "anchors")
    typed: dict[str, NDArray] = {
        f.name: np.asarray(values[f.name]).astype(np.int32 if f.name in whole else np.float32)
        for f in fields(Curves)
    }
    return Curves(**typed)


def head_frame(vertices: NDArray, skin: NDArray) -> tuple[NDArray, NDArray]:
    """Anchors (4,) on the skull and the weights (3, 4) of them that give the axes x, y and z.

    vertices : (n, 3) of the default face, upright;  skin : (n,) bool
    """
    upper = np.flatnonzero(skin & (vertices[:, 1] > vertices[skin, 1].max() - 0.09))
    ways = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -1)])
    anchors = upper[first_most(vertices[upper] @ ways.T, axis=0)]
    solve = np.linalg.inv(np.column_stack([vertices[anchors], np.ones(4)]))
    return anchors, solve[:3]
