"""Shards: tar files of samples in the WebDataset convention, each whole or not there at all."""

from __future__ import annotations

import hashlib
import io
import json
import os
import tarfile
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from facs_rig import FaceParameters, load_rig

from .samples import SIZE, Recipe, make_sample

if TYPE_CHECKING:
    import trimesh

MANIFEST = "manifest.json"
FORMAT = 1
PACKAGES = ("sketch-to-face", "numpy", "scipy", "pillow", "numba")  # may show in the bytes


def fill(file: BinaryIO, indices: range, recipe: Recipe) -> None:
    """Write these samples into an open file, as a tar: the same bytes wherever it is done."""
    with tarfile.open(fileobj=file, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for index in indices:
            picture, meta = make_sample(
                recipe.seed, index, SIZE, recipe.scheme, recipe.engine, recipe.strokes
            )
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
    with Whole(path) as beside, beside.open("wb") as file:
        fill(file, indices, recipe)
    return len(indices)


class Whole:
    """A file that appears whole or not at all: written beside, renamed when nothing went wrong."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.beside = path.with_name(f".{path.name}.{os.getpid()}")

    def __enter__(self) -> Path:
        return self.beside

    def __exit__(self, failure: type[BaseException] | None, *rest: object) -> None:
        if failure is None:
            self.beside.replace(self.path)
        else:
            self.beside.unlink(missing_ok=True)


def _add(tar: tarfile.TarFile, name: str, data: bytes) -> None:
    info = tarfile.TarInfo(name)
    info.size = len(data)
    tar.addfile(info, io.BytesIO(data))


def holds(path: Path, indices: range, recipe: Recipe) -> bool:
    """Whether a shard holds just these samples; ValueError if another recipe made it."""
    try:
        with tarfile.open(path, "r:") as tar:
            names = tar.getnames()
            first = json.loads(tar.extractfile(names[0]).read())  # type: ignore[union-attr]
    except (tarfile.TarError, ValueError, IndexError):
        raise ValueError(f"{path} is damaged; delete it to make it anew") from None
    meshes = any(name.endswith(".ply") for name in names)
    made = Recipe(first["seed"], first["scheme"], first["engine"], "strokes" in first, meshes)
    if made != recipe:
        raise ValueError(
            f"{path} was made with {_told(made)}; resume with the same ones or choose another "
            "folder"
        )
    endings = ("json", "png", "ply") if meshes else ("json", "png")
    return names == [f"{index:08d}.{ending}" for index in indices for ending in endings]


def _told(recipe: Recipe) -> str:
    strokes, meshes = ("with" if kept else "without" for kept in (recipe.strokes, recipe.meshes))
    return (
        f"seed {recipe.seed}, scheme {recipe.scheme}, engine {recipe.engine}, "
        f"{strokes} strokes, {meshes} meshes"
    )


def write_manifest(folder: Path, shards: dict[Path, range], recipe: Recipe) -> Path:
    """Write manifest.json: how many samples of which recipe, the shards and their checksums."""
    manifest = {
        "format": FORMAT,
        "samples": sum(map(len, shards.values())),
        "size": SIZE,
        "recipe": asdict(recipe),
        "shards": [
            {"name": path.name, "samples": len(indices), "sha256": _digest(path)}
            for path, indices in shards.items()
        ],
        "versions": versions(recipe),
    }
    path = folder / MANIFEST
    with Whole(path) as beside:
        beside.write_text(json.dumps(manifest, indent=1) + "\n")
    return path


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def versions(recipe: Recipe) -> dict[str, str | None]:
    """Package -> its version here (None: not installed), of all that may show in the bytes."""
    more = ["trimesh"] * recipe.meshes + ["bpy"] * (recipe.engine == "freestyle")
    return {name: _version(name) for name in (*PACKAGES, *more)}


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:  # run from the source tree, or inside Blender
        return None


def read_shards(folder: Path | str) -> Iterator[tuple[NDArray[np.uint8], dict]]:
    """All samples of a data set in order: picture (h, w) uint8 and its dictionary."""
    meta: dict = {}
    for name, data in _members(folder, ".json", ".png"):
        if name.endswith(".json"):
            meta = json.loads(data)
        else:
            yield np.asarray(Image.open(io.BytesIO(data))), meta


def read_meshes(folder: Path | str) -> Iterator[trimesh.Trimesh]:
    """The posed meshes of a data set made with them, in the order of `read_shards`; else none."""
    import trimesh

    for _, data in _members(folder, ".ply"):
        yield trimesh.load_mesh(io.BytesIO(data), file_type="ply", process=False)


def _members(folder: Path | str, *endings: str) -> Iterator[tuple[str, bytes]]:
    """Name and content of the files in all shards of a folder that end like this, in order."""
    for path in sorted(Path(folder).glob("shard-*.tar")):
        with tarfile.open(path) as tar:
            for member in tar:
                if member.name.endswith(endings):
                    yield member.name, tar.extractfile(member).read()  # type: ignore[union-attr]
