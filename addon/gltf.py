"""Binary glTF 2.0 of a mesh that morphs: arrays in, the bytes of a .glb out.

The shape itself is kept in float32. Morph targets are what makes a face large, so they are written
as KHR_mesh_quantization allows, in steps of 1/32767 m for movements and 1/127 for turned normals,
and for those vertices alone that move or turn enough to be seen. Each material has vertices of its
own: a viewer keeps what it needs for morphing once for each primitive.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.gltf_file import BYTE, FLOAT, SHORT, UNSIGNED_BYTE, UNSIGNED_SHORT, File
from addon.gltf_skeleton import followed, nodes, to_bones
from facs_rig.bones import BONES, Skeleton
from facs_rig.mesh import corner_matrix, is_shape
from facs_rig.shape import Worn

STILL = 0.00025
"""Metres: smaller movements are left out. A pixel is about that, on a head that fills a screen."""
UNTURNED = 0.1
"""Turned normals that are shorter, 6 degrees, are left out."""
EXTENSION = "KHR_mesh_quantization"
# Normalised integers: their type, and the one that means 1.
STEPS = {BYTE: (np.int8, 127), SHORT: (np.int16, 32767)}


@dataclass(frozen=True)
class Finish:
    """A material. colour : linear RGBA, 0..1      roughness : 0 mirror to 1 chalk"""

    name: str
    colour: tuple[float, float, float, float]
    roughness: float


@dataclass(frozen=True)
class Surface:
    """How a mesh is cut into materials, and where it lies on a texture.

    corners : (t, 3) int, the triangles as numbers of places, of which a vertex has several where
        the texture has a seam
    places : (k,) int, the vertex at each place      uv : (k, 2) float, 0..1, v up; or nowhere
    finish : (t,) int, index into `finishes` of each triangle
    """

    corners: NDArray
    places: NDArray
    uv: NDArray | None
    finish: NDArray
    finishes: tuple[Finish, ...]


def glb(
    vertices: NDArray,
    triangles: NDArray,
    colours: NDArray | None = None,
    targets: Mapping[str, NDArray] | None = None,
    name: str = "face",
    *,
    surface: Surface | None = None,
    skeleton: Skeleton | None = None,
    worn: Sequence[Worn] = (),
) -> bytes:
    """A mesh with morph targets as the bytes of a .glb.

    Parameters
    ----------
    vertices : (n, 3) float, metres, y up; as float32 in the file      triangles : (t, 3) int
    colours : (n, 4) float, linear, 0..1, of the vertices
    targets : name -> (n, 3) float, metres that it moves the vertices when it is fully on. What
        moves less than STILL stays, and up to twice that it moves the less, so that no edge shows;
        normals likewise by UNTURNED.
    name : of the mesh and its node
    surface : each material is a primitive with its own vertices: those that it has of the mesh, in
        their order, and behind them the doubles at seams
    skeleton : bones in the pose of `vertices`, and how far these follow them
    worn : what the face wears, each as a mesh of its own, which follows the head of the skeleton

    Raises ValueError for arrays of other shapes.
    """
    n = len(vertices)
    vertices = np.ascontiguousarray(is_shape(vertices, (n, 3), "vertices"), dtype=np.float32)
    light = _Light(vertices, is_shape(triangles, (None, 3), "triangles"))
    file = File()
    pieces = [_Piece(file, *cut) for cut in _cut(n, triangles, surface)]
    if skeleton is not None:
        is_shape(skeleton.weights, (n, len(skeleton.bones)), "weights")
        bones, weights = followed(skeleton.weights)
    for piece in pieces:
        piece.add("POSITION", vertices, FLOAT)
        piece.add("NORMAL", _stored(light.normals.T, BYTE), BYTE)
        if surface is not None and surface.uv is not None:
            places = np.clip(surface.uv, 0, 1) * (1, -1) + (0, 1)  # glTF counts v from the top
            piece.add("TEXCOORD_0", np.rint(65535 * places).astype(np.uint16), UNSIGNED_SHORT, True)
        if colours is not None:
            base = (1.0,) * 4 if piece.finish is None else piece.finish.colour
            share = is_shape(colours, (n, 4), "colours") / np.maximum(base, 1e-6)
            share = np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)
            piece.add("COLOR_0", share, UNSIGNED_BYTE)
        if skeleton is not None:
            piece.add("JOINTS_0", bones, UNSIGNED_BYTE)
            piece.add("WEIGHTS_0", weights, UNSIGNED_BYTE)
    mesh: dict[str, Any] = {"name": name, "primitives": [piece.primitive for piece in pieces]}
    if targets:
        order = np.concatenate([piece.vertices for piece in pieces])
        bounds = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
        for key, move in targets.items():
            moves = np.ascontiguousarray(is_shape(move, (n, 3), f"target {key}").T, np.float32)
            rows, turned = light.turned(moves)
            kind = SHORT if np.abs(moves).max() <= 1 else FLOAT
            moved = _seen(moves, STILL, kind)
            lit = _seen(turned, UNTURNED, BYTE, among=rows)
            for what, found, stored in (("POSITION", moved, kind), ("NORMAL", lit, BYTE)):
                for piece, own in zip(pieces, _shared(n, *found, order, bounds), strict=True):
                    piece.morph(what, *own, stored)
        mesh |= {"weights": [0.0] * len(targets), "extras": {"targetNames": list(targets)}}
    tree: dict[str, Any] = {"nodes": [{"name": name, "mesh": 0}], "scenes": [{"nodes": [0]}]}
    if surface is not None:
        tree["materials"] = [_material(piece.finish) for piece in pieces if piece.finish]
    meshes = [mesh]
    for thing in worn:
        number = len(tree.setdefault("materials", []))
        meshes.append(_worn(file, thing, number, skeleton is not None, tuple(targets or ())))
        finish = Finish(thing.name, thing.lightest, thing.roughness)
        tree["materials"].append(_material(finish) | {"doubleSided": True})
        tree["scenes"][0]["nodes"].append(len(tree["nodes"]))
        tree["nodes"].append({"name": thing.name, "mesh": len(meshes) - 1})
    if skeleton is not None:
        first = len(tree["nodes"])
        for node in tree["nodes"]:
            node["skin"] = 0
        tree["nodes"] += nodes(skeleton, first)
        tree["scenes"][0]["nodes"].append(first)
        joints = list(range(first, first + len(skeleton.bones)))
        back = file.matrices(to_bones(skeleton))
        tree["skins"] = [{"inverseBindMatrices": back, "joints": joints, "skeleton": first}]
    return file.packed(
        asset={"version": "2.0", "generator": "Sketch to Face"},
        extensionsUsed=[EXTENSION],
        extensionsRequired=[EXTENSION],
        scene=0,
        meshes=meshes,
        **tree,
    )


def _worn(
    file: File, thing: Worn, material: int, follows: bool, names: tuple[str, ...]
) -> dict[str, Any]:
    """The mesh of what a face wears. follows : whether there is a head that carries it
    names : of the face's morph targets, all of which it has where it has any"""
    n, triangles = len(thing.points), thing.triangles
    light = _Light(np.ascontiguousarray(thing.points, np.float32), triangles)
    places = np.clip(thing.uv, 0, 1) * (1, -1) + (0, 1)
    share = np.clip(thing.shade / max(float(thing.shade.max()), 1e-6), 0, 1)
    colours = np.rint(255 * np.stack([share, share, share, np.ones(n)], axis=1))
    attributes = {
        "POSITION": file.vertices(thing.points.astype(np.float32), FLOAT),
        "NORMAL": file.vertices(_stored(light.normals.T, BYTE), BYTE),
        "TEXCOORD_0": file.vertices(np.rint(65535 * places).astype(np.uint16), UNSIGNED_SHORT),
        "COLOR_0": file.vertices(colours.astype(np.uint8), UNSIGNED_BYTE),
    }
    carried = np.zeros((n, 4), np.uint8)
    for name, value in (("JOINTS_0", BONES.index("head")), ("WEIGHTS_0", 255)) if follows else ():
        carried[:, 0] = value
        attributes[name] = file.vertices(carried, UNSIGNED_BYTE, name == "WEIGHTS_0")
    primitive: dict[str, Any] = {"attributes": attributes, "indices": file.indices(triangles, n)}
    primitive |= {"material": material}
    mesh: dict[str, Any] = {"name": thing.name, "primitives": [primitive]}
    if thing.moves:
        still = np.zeros((n, 3), np.float32)
        moves = [thing.moves.get(name, still) for name in names]
        primitive["targets"] = [{"POSITION": _moving(file, move)} for move in moves]
        mesh |= {"weights": [0.0] * len(names), "extras": {"targetNames": list(names)}}
    return mesh


def _moving(file: File, move: NDArray) -> int:
    """The accessor of what a morph target adds to the vertices (n, 3) of what a face wears."""
    moves = np.ascontiguousarray(move.T, np.float32)
    kind = SHORT if np.abs(moves).max(initial=0.0) <= 1 else FLOAT
    rows, values = _seen(moves, STILL, kind)
    return file.sparse(len(move), rows, values, kind)


def _material(finish: Finish) -> dict[str, Any]:
    shading = {
        "baseColorFactor": [round(float(c), 5) for c in finish.colour],
        "metallicFactor": 0.0,
        "roughnessFactor": round(float(finish.roughness), 4),
    }
    return {"name": finish.name, "pbrMetallicRoughness": shading}


def _cut(
    n: int, triangles: NDArray, surface: Surface | None
) -> Iterator[tuple[NDArray, NDArray, NDArray, Finish | None, int | None]]:
    """What `_Piece` takes of each material that has triangles, in the order of the finishes."""
    if surface is None:
        yield np.arange(n), np.arange(n), np.asarray(triangles), None, None
        return
    number = 0
    for kind, finish in enumerate(surface.finishes):
        own = surface.corners[surface.finish == kind]
        if not len(own):
            continue
        places, corners = np.unique(own, return_inverse=True)
        yield surface.places[places], places, corners.reshape(-1, 3), finish, number
        number += 1


def _shared(
    n: int, rows: NDArray[np.intp], values: NDArray, order: NDArray, bounds: NDArray
) -> Iterator[tuple[NDArray[np.intp], NDArray]]:
    """Of n vectors, `values` (3, k) at `rows` (k,) and 0 elsewhere, those of each piece, by its own
    vertices' numbers. order : all pieces' vertices      bounds : where each piece's begin and end
    """
    at = np.full(n, -1, dtype=np.int32)
    at[rows] = np.arange(len(rows))
    found = at[order]
    hits = np.flatnonzero(found >= 0)
    mine = values[:, found[hits]]
    cuts = np.searchsorted(hits, bounds).tolist()
    for first, a, b in zip(bounds, cuts, cuts[1:], strict=False):
        yield hits[a:b] - first, mine[:, a:b]


class _Piece:
    """A primitive of the file, with vertices (m,) of the mesh at places (m,) of the texture."""

    def __init__(
        self,
        file: File,
        vertices: NDArray,
        places: NDArray,
        corners: NDArray,
        finish: Finish | None,
        material: int | None,
    ) -> None:
        self._file, self.vertices, self._places, self.finish = file, vertices, places, finish
        self.primitive: dict[str, Any] = {
            "attributes": {},
            "indices": file.indices(corners, len(vertices)),
        }
        if material is not None:
            self.primitive["material"] = material
        self._nothing: dict[int, int] = {}

    def add(self, name: str, values: NDArray, kind: int, of_places: bool = False) -> None:
        """An attribute: a value of each vertex of the mesh, or of each place of the texture."""
        own = values[self._places if of_places else self.vertices]
        counted = name != "JOINTS_0"
        self.primitive["attributes"][name] = self._file.vertices(own, kind, normalized=counted)

    def morph(self, name: str, rows: NDArray[np.intp], values: NDArray, kind: int) -> None:
        """Where the next morph target moves or turns vertices: `values` (3, k) at `rows` (k,)."""
        targets = self.primitive.setdefault("targets", [])
        if not targets or name in targets[-1]:
            targets.append({})
        if len(rows):
            targets[-1][name] = self._file.sparse(len(self.vertices), rows, values, kind)
            return
        if kind not in self._nothing:  # one for all
            self._nothing[kind] = self._file.sparse(len(self.vertices), rows, values, kind)
        targets[-1][name] = self._nothing[kind]


def _stored(values: NDArray, kind: int) -> NDArray:
    """Numbers as a component type of glTF; as integers they end at -1 and 1."""
    if kind == FLOAT:
        return values.astype(np.float32)
    dtype, one = STEPS[kind]
    return np.clip(np.rint(values * one), -one, one).astype(dtype)


def _seen(
    vectors: NDArray, least: float, kind: int, among: NDArray | None = None
) -> tuple[NDArray[np.intp], NDArray]:
    """Of vectors (3, n) those longer than `least`: their numbers (k,), or what `among` (n,) has in
    these places, and themselves (3, k) as they are stored."""
    x, y, z = vectors
    length2 = x * x + y * y + z * z
    at = np.flatnonzero(length2 > least * least)
    share = np.minimum(np.sqrt(length2[at]) / least - 1, 1)
    x, y, z = stored = np.stack([_stored(axis[at] * share, kind) for axis in vectors])
    kept = np.flatnonzero((x != 0) | (y != 0) | (z != 0))
    at = at[kept]
    return at if among is None else among[at], stored.take(kept, axis=1)


class _Light:
    """The normals of a mesh, and how they turn when it moves. Vectors are (3, n): x, y and z.

    Without turned normals a viewer would light creases as if the skin were still smooth.
    """

    def __init__(self, vertices: NDArray[np.float32], triangles: NDArray) -> None:
        self._corners = [np.ascontiguousarray(triangles[:, k], dtype=np.intp) for k in range(3)]
        self._around = corner_matrix(triangles, len(vertices))
        self._places = np.ascontiguousarray(vertices.T)
        self._flat = _crossed(self._places, self._corners)
        self._sums = self._summed(self._flat)
        self._stiff = (UNTURNED / 2) ** 2 * (self._sums**2).sum(axis=0)
        self.normals = _unit(self._sums)
        self.normals[2, self._stiff == 0] = 1.0  # no triangle says where they point

    def turned(self, moves: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray]:
        """Vertices (k,) whose normals may turn by UNTURNED when all move (3, n), and by how much
        theirs do (3, k)."""
        x, y, z = np.abs(moves)
        moving = (x > STILL / 15) | (y > STILL / 15) | (z > STILL / 15)
        a, b, c = (moving[corner] for corner in self._corners)
        hot = np.flatnonzero(a | b | c)
        change = np.zeros_like(self._flat)
        now = _crossed(self._places + moves, [corner[hot] for corner in self._corners])
        for out, new, old in zip(change, now, self._flat, strict=True):
            out[hot] = new - old[hot]
        x, y, z = sums = self._summed(change)
        # A unit vector changes by at most twice the share by which it was changed.
        rows = np.flatnonzero(x * x + y * y + z * z > self._stiff)
        sums = sums.take(rows, axis=1) + self._sums.take(rows, axis=1)
        return rows, _unit(sums) - self.normals.take(rows, axis=1)

    def _summed(self, values: NDArray) -> NDArray[np.float32]:
        """(3, n) vectors of the triangles (3, t) summed at their corners."""
        return np.stack([self._around @ value for value in values])


def _crossed(places: NDArray, corners: list[NDArray]) -> NDArray[np.float32]:
    """(3, k) normals of triangles, as long as twice their areas; corners : three times (k,)."""
    first, second, third = ([place[corner] for place in places] for corner in corners)
    u = [b - a for a, b in zip(first, second, strict=True)]
    v = [c - a for a, c in zip(first, third, strict=True)]
    return np.stack([u[i] * v[j] - u[j] * v[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def _unit(vectors: NDArray) -> NDArray:
    """Vectors (3, n) with length 1; what has none stays 0."""
    x, y, z = vectors
    return vectors / np.maximum(np.sqrt(x * x + y * y + z * z), 1e-30)
