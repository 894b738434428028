"""Writing faces to files: .glb with morph targets, .obj, .ply, .blend."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.files import Outputs
from facs_rig import CONTROL_NAMES, FULL_INTENSITY, FaceParameters, FaceRig
from facs_rig.paint import vertex_colours

# The file's vertices as core coordinates: core = matrix @ [x y z 1]; .blend has z up.
FROM_BLENDER = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
STILL = 1e-6  # metres: a morph target leaves out vertices that move less
FLOAT, UNSIGNED_INT = 5126, 5125


def write_mesh(
    path: Path,
    rig: FaceRig,
    parameters: FaceParameters,
    offsets: NDArray | None = None,
) -> None:
    """Write the posed face to `path`, whole or not at all; its ending says how.

    .glb holds the posed, fitted face with one morph target for each of the 47 controls (weight 1
    is full natural activation, added to what is there) and one named `neutral` that takes the
    drawn expression away. .obj and .ply hold the shape alone, .blend the whole posable object.
    Raises ValueError for another ending, or for .blend where Blender's module is missing.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        raise ValueError(f"'{path}' has no known ending; use {', '.join(WRITERS)}.")
    with Outputs() as outputs:
        WRITERS[suffix](outputs.beside(path), rig, parameters, offsets, path.stem)


def file_to_core(path: Path) -> NDArray[np.float64]:
    """(4, 4) matrix from the coordinates of a written file to the rig's."""
    return FROM_BLENDER if path.suffix.lower() == ".blend" else np.eye(4)


def _trimesh(rig: FaceRig, parameters: FaceParameters, offsets: NDArray | None):
    import trimesh

    return trimesh.Trimesh(
        rig.pose(parameters, offsets),
        rig.triangles,
        vertex_colors=vertex_colours(rig, dict(parameters.identity)),
        process=False,
    )


def _write_plain(path: Path, rig, parameters, offsets, name: str) -> None:
    _trimesh(rig, parameters, offsets).export(path)


def _write_glb(path: Path, rig, parameters, offsets, name: str) -> None:
    from trimesh.exchange.gltf import export_glb

    mesh = _trimesh(rig, parameters, offsets)
    mesh.metadata["name"] = name
    targets = morph_targets(rig, parameters)
    path.write_bytes(
        export_glb(
            mesh, include_normals=True, buffer_postprocessor=_with_targets(targets, rig.n_vertices)
        )
    )


def morph_targets(rig: FaceRig, parameters: FaceParameters) -> dict[str, NDArray[np.float32]]:
    """Name -> (n, 3) displacement, metres, of the posed face: the controls, then `neutral`."""
    directions = dict(zip(CONTROL_NAMES, rig.control_deltas, strict=True))
    expression = np.zeros((rig.n_vertices, 3), dtype=np.float32)
    for control, intensity in parameters.aus.items():
        expression += directions[control] * np.float32(intensity / FULL_INTENSITY)
    directions["neutral"] = -expression
    turned = rig.turn_vectors(np.stack(list(directions.values())), parameters)
    return dict(zip(directions, turned, strict=True))


def _with_targets(targets: dict[str, NDArray], n: int) -> Callable[[dict, dict], None]:
    """A step of trimesh's glTF export that adds sparse morph targets (glTF 2.0, 3.6.2.3)."""

    def add(buffers: dict[Any, bytes], tree: dict[str, Any]) -> None:
        def view(array: NDArray) -> int:
            data = np.ascontiguousarray(array).tobytes()
            buffers[f"morph{len(buffers)}"] = data + b"\0" * (-len(data) % 4)
            return len(buffers) - 1

        mesh = tree["meshes"][0]
        mesh["extras"] = {**mesh.get("extras", {}), "targetNames": list(targets)}
        mesh["weights"] = [0.0] * len(targets)
        made = []
        for delta in targets.values():
            moved = np.flatnonzero(np.abs(delta).max(axis=1) > STILL).astype(np.uint32)
            values = delta[moved].astype(np.float32)
            bounds = np.vstack([values, np.zeros((1, 3), dtype=np.float32)])
            accessor: dict[str, Any] = {
                "componentType": FLOAT,
                "count": n,
                "type": "VEC3",
                "min": bounds.min(axis=0).tolist(),
                "max": bounds.max(axis=0).tolist(),
            }
            if len(moved):
                accessor["sparse"] = {
                    "count": len(moved),
                    "indices": {"bufferView": view(moved), "componentType": UNSIGNED_INT},
                    "values": {"bufferView": view(values)},
                }
            key = f"morph{len(tree['accessors'])}"
            tree["accessors"][key] = accessor
            made.append({"POSITION": len(tree["accessors"]) - 1})
        for primitive in mesh["primitives"]:
            primitive["targets"] = made

    return add


def _write_blend(path: Path, rig, parameters, offsets, name: str) -> None:
    try:
        import bpy
    except ImportError:
        raise ValueError(
            "Writing .blend needs Blender's Python module: pip install bpy, or write .glb."
        ) from None
    from facs_rig.blender import build_face

    bpy.ops.wm.read_factory_settings(use_empty=True)
    build_face(name, rig, parameters, offsets)
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)


WRITERS: dict[str, Callable] = {
    ".glb": _write_glb,
    ".obj": _write_plain,
    ".ply": _write_plain,
    ".blend": _write_blend,
}
