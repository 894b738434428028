"""Writing faces to files: .glb and .fbx with shape keys, .obj, .ply, .blend.

What each format keeps:

    .glb    the posed face; morph targets: our 47 controls or ARKit's 52, and `neutral`; hair beside
    .fbx    the same, hair too, by Blender's exporter
    .obj    the posed face in quads; with `keys` a folder NAME_keys beside it with a face for each
            shape key, fully on, its vertices in the same order (what sculpting and rigging programs
            import as blendshapes)
    .ply    the posed face
    .blend  the whole posable object with sliders, bones, drivers and hair
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from addon import gltf
from facs_rig import ARKIT_NAMES, CONTROL_NAMES, FULL_INTENSITY, FaceParameters, FaceRig
from facs_rig.beard.mesh import BeardMesh, beard_mesh
from facs_rig.common.errors import InputError
from facs_rig.common.files import OutputError, Outputs
from facs_rig.fitted_keys import FittedKey
from facs_rig.hair.hat import HatMesh
from facs_rig.hair.mesh import HairMesh
from facs_rig.levels import FULL, at_level, kept_by, keys_kept_by
from facs_rig.paint import linear_light, srgb
from facs_rig.shape import Shape, rig_shape

# The file's vertices as core coordinates: core = matrix @ [x y z 1]; .blend has z up.
FROM_BLENDER = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
NAMES = ("ours", "arkit")
NEUTRAL = "neutral"

Progress = Callable[[int, int], None]


def write_mesh(
    path: Path,
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
    fitted: Sequence[FittedKey] = (),
    hair: HairMesh | None = None,
    hat: HatMesh | None = None,
    beard: BeardMesh | None = None,
    *,
    names: str = "ours",
    keys: bool = False,
    detail: str = FULL,
    progress: Progress | None = None,
    outputs: Outputs | None = None,
) -> None:
    """Write the posed face to `path`, whole or not at all; its ending says how.

    offsets : (n, 3) float, metres, the fitted details, upright head
    fitted : what of them goes with the actions of the expression
    hair, hat, beard : what the face wears, each an object of its own; a .ply is the face alone, and
        only a .blend holds curves
    names : of the shape keys: `ours`, the 47 controls (1 is full natural activation), or `arkit`,
        the 52 of live-capture tools; both add to what is there, and a last one named `neutral`
        takes the expression away
    detail : the level, one of facs_rig.levels.LEVELS
    keys : write the folder of shape keys beside an .obj
    progress : is called with (done, total) where it takes long
    outputs : the job that this is a part of: the face appears together with its other files
    Raises InputError for another ending, for hair that the file cannot hold, or where Blender's
    module is needed and missing, and OutputError where the file cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix not in ENDINGS:
        raise InputError(f"'{path}' has no known ending; use {', '.join(ENDINGS)}.")
    if names not in NAMES:
        raise InputError(f"shape keys are named {' or '.join(NAMES)}, not '{names}'")
    if keys and suffix != ".obj":
        raise InputError(f"a folder of shape keys goes with .obj, not with '{path.name}'")
    if hair is not None:
        check_hair(path, hair.kind)
    wears = [part for part in (hair, hat) if part is not None]
    worn = tuple(part.worn_on(rig.pose(parameters, offsets)) for part in wears)
    if offsets is not None and wears:
        rest = rig.neutral(parameters.identity) + offsets
        hair = hair.lying_on(rest) if hair is not None else None
        hat = hat.lying_on(rest) if hat is not None else None
    rig = at_level(rig, detail)
    offsets = None if offsets is None else kept_by(rig, offsets)
    fitted = keys_kept_by(rig, fitted)
    moved = keys or suffix in (".glb", ".fbx")
    targets = morph_targets(rig, parameters, names, fitted) if moved else {}
    if beard is not None and rig.level != FULL:  # which has other vertices for it to grow from
        beard = beard_mesh(rig, parameters.identity, beard.beard)
    if beard is not None:
        at_rest = rig.neutral(parameters.identity)
        beard = beard.lying_on(at_rest if offsets is None else at_rest + offsets)
        worn = (*worn, beard.worn_on(rig.pose(parameters, offsets), targets))
    with contextlib.nullcontext(outputs) if outputs else Outputs() as job:
        if suffix == ".blend":
            _write_blend(
                job.beside(path), rig, parameters, offsets, fitted, (hair, hat, beard),
                _called(path), names,
            )  # fmt: skip
            return
        shape = replace(rig_shape(rig, parameters, offsets, targets), worn=worn)
        if suffix == ".fbx":
            _write_fbx(job.beside(path), rig, shape, parameters, _called(path))
            return
        WRITERS[suffix](job.beside(path), shape, _called(path))
        if keys:
            _write_keys(job.beside(_fit_for_keys(key_folder(path))), shape, progress)


def check_hair(path: Path, kind: str) -> None:
    """InputError, one sentence, for hair that a file cannot hold. kind : see facs_rig.hair.mesh"""
    if kind == "curves" and path.suffix.lower() not in (".blend", ".ply"):
        raise InputError(
            f"'{path.name}' cannot hold hair curves: write a .blend, or choose locks for the hair"
        )


def _called(path: Path) -> str:
    """What the face in a file is called: its name, without bytes that are no text."""
    return path.stem.encode("utf-8", "replace").decode()


def write_shape(path: Path, shape: Shape) -> None:
    """Write a surface to `path` (.glb, .obj or .ply), whole or not at all."""
    with Outputs() as outputs:
        WRITERS[path.suffix.lower()](outputs.beside(path), shape, _called(path))


def file_to_core(path: Path) -> NDArray[np.float64]:
    """(4, 4) matrix from the coordinates of a written file to the rig's."""
    return FROM_BLENDER if path.suffix.lower() == ".blend" else np.eye(4)


# --- shape keys -----------------------------------------------------------------------------------


def morph_targets(
    rig: FaceRig,
    parameters: FaceParameters,
    names: str = "ours",
    fitted: Sequence[FittedKey] = (),
) -> dict[str, NDArray[np.float32]]:
    """Name -> (n, 3) displacement, metres, of the posed face: the keys, then `neutral`.

    Ours are each control alone at full natural activation on this identity, creases included, and
    with what the drawing shows of it beyond that (`fitted`).
    Files add targets up; what the rig does where controls meet stays in Blender.
    """
    who = parameters.identity
    looking = FaceParameters({}, who, gaze=parameters.gaze)
    worn = FaceParameters(parameters.aus, who, gaze=parameters.gaze)
    if names == "arkit":
        moves = np.concatenate([rig.arkit_deltas_of(who), rig.moves([(worn, looking)])])
        keys = ARKIT_NAMES
    else:
        plain = FaceParameters({}, who)
        full = [(plain, FaceParameters({name: FULL_INTENSITY}, who)) for name in CONTROL_NAMES]
        moves = rig.moves([*full, (worn, looking)])
        keys = CONTROL_NAMES
        for row, name in enumerate(keys):
            for key in fitted:
                if on := key.value({name: FULL_INTENSITY}):
                    moves[row] += np.float32(on) * key.offsets
    for key in fitted:
        moves[-1] -= key.offsets
    return dict(zip((*keys, NEUTRAL), rig.turn_vectors(moves, parameters), strict=True))


# --- .ply and .glb --------------------------------------------------------------------------------


def _write_ply(path: Path, shape: Shape, name: str) -> None:
    vertices = np.empty(len(shape.points), [("place", "<f4", 3), ("colour", "u1", 4)])
    vertices["place"], vertices["colour"] = shape.points, shape.colours
    faces = np.empty(len(shape.triangles), [("corners", "u1"), ("vertices", "<i4", 3)])
    faces["corners"], faces["vertices"] = 3, shape.triangles
    head = [
        "ply",
        "format binary_little_endian 1.0",
        "comment made by Sketch to Face",
        f"element vertex {len(vertices)}",
        *(f"property float {axis}" for axis in "xyz"),
        *(f"property uchar {colour}" for colour in ("red", "green", "blue", "alpha")),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    path.write_bytes("\n".join(head).encode("ascii") + vertices.tobytes() + faces.tobytes())


def _write_glb(path: Path, shape: Shape, name: str) -> None:
    """Each part has its own material: its lightest colour, of which its vertices have shares."""
    colours = np.concatenate(
        [linear_light(shape.colours[:, :3] / 255), shape.colours[:, 3:] / 255], axis=1
    )
    sizes = np.diff(np.append(shape.polygon_starts, len(shape.polygon_vertices)))
    of_corner = np.repeat(shape.part, sizes)
    used = np.unique(shape.part).tolist()
    lightest = {k: colours[shape.polygon_vertices[of_corner == k]].max(axis=0) for k in used}
    texture = shape.texture
    surface = gltf.Surface(
        corners=(shape.polygon_vertices if texture is None else texture.corners)[
            shape.triangle_corners
        ],
        places=np.arange(len(shape.points)) if texture is None else texture.vertices,
        uv=None if texture is None else texture.points,
        finish=np.searchsorted(used, of_corner[shape.triangle_corners[:, 0]]),
        finishes=tuple(
            gltf.Finish(shape.part_names[k], tuple(lightest[k].tolist()), shape.roughness[k])
            for k in used
        ),
    )
    path.write_bytes(
        gltf.glb(
            shape.points, shape.triangles, colours, shape.moves, name,
            surface=surface, skeleton=shape.skeleton, worn=shape.worn,
        )
    )  # fmt: skip


# --- .obj -----------------------------------------------------------------------------------------


def _write_obj(path: Path, shape: Shape, name: str) -> None:
    lines = np.concatenate([shape.points, shape.colours[:, :3] / 255], axis=1)
    text = ("v %.7f %.7f %.7f %.4f %.4f %.4f\n" * len(lines)) % tuple(lines.ravel().tolist())
    others = _obj_worn(shape)
    path.write_text(f"o {name}\n{text}{_obj_faces(shape)}{others}", encoding="utf-8")


def _obj_worn(shape: Shape) -> str:
    """What the face wears: objects of their own behind it, whose corners are numbered on."""
    first = len(shape.points) + 1
    mapped = 1 if shape.texture is None else 1 + len(shape.texture.points)
    out = []
    for thing in shape.worn:
        colours = srgb(np.clip(thing.shade[:, None] * np.array(thing.colour), 0, 1))
        lines = np.concatenate([thing.points, colours], axis=1)
        out.append(f"o {thing.name}\n")
        out.append(("v %.7f %.7f %.7f %.4f %.4f %.4f\n" * len(lines)) % tuple(lines.ravel()))
        out.append(("vt %.6f %.6f\n" * len(thing.uv)) % tuple(thing.uv.ravel().tolist()))
        out.append(f"g {thing.name}\n")
        triangle = thing.quads[:, 2] == thing.quads[:, 3]
        for polygons in (thing.quads[~triangle], thing.quads[triangle][:, :3]):
            corners = np.stack([polygons + first, polygons + mapped], axis=2)
            row = "f" + " %d/%d" * polygons.shape[1] + "\n"
            out.append(row * len(corners) % tuple(corners.ravel().tolist()))
        first, mapped = first + len(thing.points), mapped + len(thing.uv)
    return "".join(out)


def _obj_faces(shape: Shape) -> str:
    """The polygons as they are, quads where the face has quads, grouped by part; before them where
    their corners lie on a texture."""
    corners, out = (shape.polygon_vertices + 1).astype(str).tolist(), []
    if shape.texture is not None:
        points, places = shape.texture.points, (shape.texture.corners + 1).tolist()
        out.append(("vt %.6f %.6f\n" * len(points)) % tuple(points.ravel().tolist()))
        corners = [f"{corner}/{place}" for corner, place in zip(corners, places, strict=True)]
    starts = shape.polygon_starts
    ends = np.append(starts[1:], len(corners))
    for number, group in enumerate(shape.part_names):
        mine = np.flatnonzero(shape.part == number)
        if len(mine):
            out.append(f"g {group}\n")
            spans = zip(starts[mine].tolist(), ends[mine].tolist(), strict=True)
            out += [f"f {' '.join(corners[a:b])}\n" for a, b in spans]
    return "".join(out)


def key_folder(path: Path) -> Path:
    """Where the shape keys of an .obj stand: FACE.obj has FACE_keys beside it."""
    return path.with_name(f"{path.stem}_keys")


def _fit_for_keys(folder: Path) -> Path:
    """`folder`, if shape keys may take its place; OutputError otherwise."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"'{folder}' is a file; the shape keys need a folder of that name.")
    if folder.is_dir() and any(p.suffix != ".obj" or p.is_dir() for p in folder.iterdir()):
        raise OutputError(f"The folder '{folder}' holds other files than .obj; move it away.")
    return folder


def _write_keys(folder: Path, shape: Shape, progress: Progress | None) -> None:
    """A face for each shape key, fully on, in a new folder."""
    faces, posed = _obj_faces(shape), shape.points
    folder.mkdir()
    for done, (name, move) in enumerate(shape.moves.items(), 1):
        flat = tuple((posed + move).ravel().tolist())
        text = ("v %.7f %.7f %.7f\n" * len(posed)) % flat
        (folder / f"{name}.obj").write_text(f"o {name}\n{text}{faces}", encoding="utf-8")
        if progress:
            progress(done, len(shape.moves))


# --- by Blender -----------------------------------------------------------------------------------


def _blender(suffix: str):
    try:
        import bpy
    except ImportError:
        raise InputError(
            f"Writing {suffix} needs Blender's Python module: pip install bpy, or write .glb."
        ) from None
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Blender's chat, printed by C, out of our standard output."""
    try:
        flush = ctypes.CDLL(None).fflush  # C has a buffer of its own
    except (OSError, TypeError, AttributeError):  # not on this system: then it may chat
        yield
        return
    sys.stdout.flush()
    ours = os.dup(1)
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        flush(None)
        os.dup2(ours, 1)
        os.close(ours)


@contextlib.contextmanager
def _failing_as_files_do() -> Iterator[None]:
    """Blender's word for a file that it could not write, a RuntimeError, as an OSError."""
    try:
        yield
    except RuntimeError as error:
        told = [line for line in str(error).splitlines() if "Error: " in line]
        why = told[-1].rpartition("Error: ")[2] if told else "Blender could not write it"
        raise OSError(errno.EIO, why) from error


def _write_blend(path: Path, rig, parameters, offsets, fitted, worn, name: str, names: str) -> None:
    """worn : hair, hat and beard, or None"""
    hair, hat, beard = worn
    bpy = _blender(".blend")
    from facs_rig.blender import build_face
    from facs_rig.blender.beard import grow
    from facs_rig.blender.hair import wear
    from facs_rig.blender.hat import put_on

    face = build_face(name, rig, parameters, offsets, fitted, arkit=names == "arkit")
    if hair is not None:
        wear(face, hair, parameters.identity)
    if hat is not None:
        put_on(face, hat, parameters.identity)
    if beard is not None:
        grow(face, beard)
    bpy.context.preferences.filepaths.save_version = 0
    with _quiet(), _failing_as_files_do():
        bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, compress=True)


def _write_fbx(
    path: Path, rig: FaceRig, shape: Shape, parameters: FaceParameters, name: str
) -> None:
    """The mesh with materials and plain shape keys: other programs know no drivers."""
    bpy = _blender(".fbx")
    from facs_rig.blender import build_face, to_blender
    from facs_rig.blender.files import add_moves, write_still_fbx
    from facs_rig.blender.hair_files import hair_object

    face = build_face(name, rig, FaceParameters({}, parameters.identity))
    others = [o for o in bpy.data.objects if o != face]
    face.parent = None
    face.modifiers.clear()
    face.shape_key_clear()
    face.animation_data_clear()
    bpy.data.batch_remove(others)
    posed = to_blender(shape.points)
    face.data.vertices.foreach_set("co", posed.ravel())
    face.data.update()
    add_moves(face, posed, {key: to_blender(move) for key, move in shape.moves.items()})
    worn = [hair_object(part, f"{name} {part.name}") for part in shape.worn]
    for thing, part in zip(worn, shape.worn, strict=True):
        bpy.context.scene.collection.objects.link(thing)
        moves = {key: to_blender(move) for key, move in part.moves.items()}
        add_moves(thing, to_blender(part.points), moves)
    with _quiet(), _failing_as_files_do():
        write_still_fbx(path, face, *worn)


WRITERS: dict[str, Callable] = {".glb": _write_glb, ".obj": _write_obj, ".ply": _write_ply}
ENDINGS = (".glb", ".fbx", ".obj", ".ply", ".blend")
