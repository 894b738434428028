"""Shards: tar files of samples in the WebDataset convention, each whole or not there at all."""

from __future__ import annotations

import hashlib
import io
import json
import os
import tarfile
from collections.abc import Iterator
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from .samples import SIZE, Recipe, make_sample

MANIFEST = "manifest.json"
FORMAT = 1
PACKAGES = ("sketch-to-face", "numpy", "pillow", "numba")  # whose version may show in the bytes


def write_shard(path: Path, indices: range, recipe: Recipe) -> int:
    """Write one shard (beside, then renamed); returns the number of its samples."""
    with Whole(path) as beside, tarfile.open(beside, "w", format=tarfile.USTAR_FORMAT) as tar:
        for index in indices:
            picture, meta = make_sample(
                recipe.seed, index, SIZE, recipe.scheme, recipe.engine, recipe.strokes
            )
            buffer = io.BytesIO()
            Image.fromarray(picture).save(buffer, format="PNG")
            _add(tar, f"{index:08d}.json", json.dumps(meta).encode())
            _add(tar, f"{index:08d}.png", buffer.getvalue())
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
    made = Recipe(first["seed"], first["scheme"], first["engine"], "strokes" in first)
    if made != recipe:
        raise ValueError(
            f"{path} was made with {_told(made)}; resume with the same ones or choose another "
            "folder"
        )
    return [int(n.split(".")[0]) for n in names[::2]] == list(indices)


def _told(recipe: Recipe) -> str:
    kept = "with" if recipe.strokes else "without"
    return f"seed {recipe.seed}, scheme {recipe.scheme}, engine {recipe.engine}, {kept} strokes"


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
        "versions": {name: _version(name) for name in PACKAGES},
    }
    path = folder / MANIFEST
    with Whole(path) as beside:
        beside.write_text(json.dumps(manifest, indent=1) + "\n")
    return path


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:  # run from the source tree, or inside Blender
        return None


def read_shards(folder: Path | str) -> Iterator[tuple[NDArray[np.uint8], dict]]:
    """All samples of a data set in order: picture (h, w) uint8 and its dictionary."""
    for path in sorted(Path(folder).glob("shard-*.tar")):
        with tarfile.open(path) as tar:
            meta: dict = {}
            for member in tar:
                data = tar.extractfile(member).read()  # type: ignore[union-attr]
                if member.name.endswith(".json"):
                    meta = json.loads(data)
                elif member.name.endswith(".png"):
                    yield np.asarray(Image.open(io.BytesIO(data))), meta
