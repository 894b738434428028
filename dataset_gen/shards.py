"""Shards: tar files of samples in the WebDataset convention, each whole or not there at all."""

from __future__ import annotations

import io
import json
import sys
import tarfile
import zlib
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dataset_gen.tars import files_of, record_of, samples_of, size_of
from facs_rig import FaceParameters, load_rig
from facs_rig.common.files import Outputs

from .samples import SIZE, Recipe, make_sample
from .workers import go_on

if TYPE_CHECKING:
    import trimesh

PACKAGES = ("sketch-to-face", "numpy", "scipy", "pillow", "numba")  # may show in the bytes


def fill(file: BinaryIO, indices: range, recipe: Recipe) -> None:
    """Write these samples into an open file, as a tar: the same bytes wherever it is done.

    Raises Stopped in a worker that shall stop.
    """
    with tarfile.open(fileobj=file, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for index in indices:
            go_on()
            picture, meta = make_sample(
                recipe.seed, index, SIZE, recipe.scheme, recipe.engine, recipe.strokes,
                hair=recipe.hair,
            )  # fmt: skip
            buffer = io.BytesIO()
            # run lengths: half the time and smaller than zlib's own way, for lines on paper
            Image.fromarray(picture).save(buffer, format="PNG", compress_type=zlib.Z_RLE)
            _add(tar, f"{index:08d}.json", json.dumps(meta).encode())
            _add(tar, f"{index:08d}.png", buffer.getvalue())
            if recipe.meshes:
                _add(tar, f"{index:08d}.ply", posed_ply(meta))


def posed_ply(meta: dict) -> bytes:
    """The posed mesh of a sample's dictionary as a binary .ply: metres, y up, triangles.

    Its vertices are those of `rig.pose`, in the same order, so that they answer each other from
    sample to sample and to everything that the rig knows of a vertex.
    """
    import trimesh
    from trimesh.exchange.ply import export_ply

    rig = load_rig()
    posed = rig.pose(FaceParameters.from_json(meta))
    mesh = trimesh.Trimesh(posed, rig.triangles, process=False)
    return export_ply(mesh, encoding="binary", vertex_normal=False)


def write_shard(path: Path, indices: range, recipe: Recipe) -> int:
    """Write one shard (beside, then renamed); returns the number of its samples."""
    with Outputs() as outputs, outputs.beside(path).open("wb") as file:
        fill(file, indices, recipe)
    return len(indices)


def _add(tar: tarfile.TarFile, name: str, data: bytes) -> None:
    info = tarfile.TarInfo(name)
    info.size = len(data)
    tar.addfile(info, io.BytesIO(data))


def versions(recipe: Recipe) -> dict[str, str | None]:
    """Package -> its version here (None: not installed), of all that may show in the bytes."""
    more = ["trimesh"] * recipe.meshes + ["bpy"] * (recipe.engine == "freestyle")
    return {name: _version(name) for name in (*PACKAGES, *more)}


def _version(name: str) -> str | None:
    program = sys.modules.get("bpy") if name == "bpy" else None
    if program is not None and program.app.binary_path:  # not the module of an environment
        return program.app.version_string.split()[0]
    try:
        return version(name)
    except PackageNotFoundError:  # run from the source tree, or inside Blender
        return None


def read_shards(folder: Path | str) -> Iterator[tuple[NDArray[np.uint8], dict]]:
    """All samples of a data set in order: picture (h, w) uint8 and its dictionary.

    Raises InputError, an InputError of one sentence, for a damaged shard.
    """
    for path in _shards(folder):
        for key, parts in samples_of(path):
            size_of(path, key, parts["png"])
            picture = np.asarray(Image.open(io.BytesIO(parts["png"])))
            yield picture, record_of(path, key, parts["json"])


def read_meshes(folder: Path | str) -> Iterator[trimesh.Trimesh]:
    """The posed meshes of a data set made with them, in the order of `read_shards`; else none.

    Raises InputError for a damaged shard.
    """
    import trimesh

    for path in _shards(folder):
        for name, data in files_of(path):
            if name.endswith(".ply"):
                yield trimesh.load_mesh(io.BytesIO(data), file_type="ply", process=False)


def _shards(folder: Path | str) -> list[Path]:
    return sorted(Path(folder).glob("shard-*.tar"))
