"""Reading data sets: tar shards in the WebDataset convention, KEY.png beside KEY.json."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from dataset_gen.tars import ShardError, record_of, samples_of, size_of
from facs_rig.common.errors import InputError

ANGLES = ("yaw", "pitch", "roll")
HELD_OUT = 10  # every tenth drawing is never trained on
CHUNK = 1000  # records that are looked through at a time


class Stored(Sequence):
    """Items that are kept as bytes and made when asked for: data sets are larger than memory.

    A drawing takes 13 kB as it is stored, a record 8 kB; in use five and ten times that.
    """

    def __init__(self, blobs: list[bytes], make: Callable[[bytes], Any]) -> None:
        self.blobs, self.make = blobs, make

    def __len__(self) -> int:
        return len(self.blobs)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return Stored(self.blobs[index], self.make)
        return self.make(self.blobs[index])


def drawing_of(png: bytes) -> NDArray[np.uint8]:
    """(h, w) uint8, 0 = black, 255 = paper."""
    return np.array(Image.open(io.BytesIO(png)).convert("L"))


@dataclass(frozen=True)
class DataSet:
    """drawings : n of (h, w) uint8, 0 = black, 255 = paper; records : the n JSON objects.

    jobs : processes that look through many records
    """

    drawings: Sequence[NDArray[np.uint8]]
    records: Sequence[dict[str, Any]]
    jobs: int = 1

    def __len__(self) -> int:
        return len(self.records)

    def each(self, function: Callable[[Sequence[dict[str, Any]]], Any]) -> list[Any]:
        """What a function says of the records, `CHUNK` at a time."""
        starts = range(0, len(self), CHUNK)
        return spread(function, [self.records[k : k + CHUNK] for k in starts], self.jobs)

    @cached_property
    def _facts(self) -> list[tuple[int, str, tuple[Any, ...]]]:
        facts = [fact for part in self.each(_facts) for fact in part]
        return [(k if index is None else index, *r) for k, (index, *r) in enumerate(facts)]

    @property
    def index(self) -> NDArray[np.int64]:
        """(n,) the number of each drawing in its data set."""
        return np.array([index for index, *_ in self._facts])

    @property
    def looks(self) -> NDArray[np.str_]:
        """(n,) the look of each drawing."""
        return np.array([look for _, look, _ in self._facts])

    def twins(self) -> NDArray[np.int64]:
        """(n,) the number of another drawing of the same face, by another engine, or -1.

        Data sets of one seed and scheme draw the same faces, whatever their engine.
        """
        latest: dict[tuple[Any, ...], int] = {}
        found = np.full(len(self), -1)
        for k, (*_, face) in enumerate(self._facts):
            if (other := latest.get(face)) is not None:
                found[k], found[other] = other, k
            latest[face] = k
        return found

    def held_out(self) -> NDArray[np.bool_]:
        """(n,) which drawings are for validation: by index, so that growing sets keep theirs."""
        return self.index % HELD_OUT == HELD_OUT - 1


def _facts(records: Sequence[dict[str, Any]]) -> list[tuple[Any, ...]]:
    """The number of each drawing, its look, and which face it is of."""
    return [
        (
            r.get("index"),
            str(r.get("style", {}).get("look")),
            (r.get("seed"), r.get("scheme"), r.get("index")),
        )
        for r in records
    ]


def spread(function: Callable[[Any], Any], parts: Sequence[Any], jobs: int) -> list[Any]:
    """function(part) for each of the parts, in their order, by several processes."""
    if jobs < 2 or len(parts) < 2:
        return [function(part) for part in parts]
    with ProcessPoolExecutor(min(jobs, len(parts)), get_context("spawn")) as pool:
        return list(pool.map(function, parts))


def shard_paths(folder: Path) -> list[Path]:
    """The folder's shards in order; raises ValueError if there is none, or no folder."""
    if not Path(folder).is_dir():
        raise InputError(f"There is no folder {folder}: `sketch2face generate --out {folder}`.")
    paths = sorted(Path(folder).glob("*.tar"))
    if not paths:
        raise InputError(
            f"{folder} holds no .tar shard: run `sketch2face generate --out {folder}`."
        )
    return paths


def check_record(path: Path, key: str, data: bytes) -> None:
    """ShardError unless a record tells the actions, the head's angles and the landmarks."""
    record = record_of(path, key, data)
    for name in ("aus", "head", "landmarks"):
        if not (isinstance(record.get(name), dict) and record[name]):
            raise ShardError(
                f"{path}: {key}.json tells no {name}; `sketch2face generate` makes shards that do."
            )
    places = record["landmarks"].values()
    numbers = [*record["aus"].values(), *(record["head"].get(name) for name in ANGLES)]
    for place in places:
        numbers += place if isinstance(place, list) and len(place) == 2 else [None]
    if not all(isinstance(n, int | float) and math.isfinite(n) for n in numbers):
        raise ShardError(f"{path}: {key}.json holds something else where numbers belong.")


def load(*folders: Path, limit: int | None = None, jobs: int = 1) -> DataSet:
    """All drawings of the shards of one or several folders, at most `limit` of each.

    Raises InputError, one sentence that names the shard, if there are none, if they are not all of
    one size, and for damaged shards, drawings and records.
    """
    if limit is not None and limit < 1:
        raise InputError(f"--limit must be at least 1, got {limit}.")
    drawings: list[bytes] = []
    records: list[bytes] = []
    size = None
    for folder in folders:
        paths, before = shard_paths(folder), len(records)
        parts = map(_read, paths) if limit else spread(_read, paths, jobs)
        for path, (found, pngs, jsons) in zip(paths, parts, strict=False):
            size = size or found
            if found and found != size:
                raise InputError(
                    f"{path}: a drawing of {found} stands among drawings of {size};"
                    " train on one size."
                )
            drawings += pngs
            records += jsons
            if limit and len(records) - before >= limit:
                del drawings[before + limit :], records[before + limit :]
                break
    if not drawings:
        raise InputError(f"The shards in {folders[0]} hold no pair of .png and .json.")
    return DataSet(Stored(drawings, drawing_of), Stored(records, json.loads), jobs)


def _read(path: Path) -> tuple[Any, list[bytes], list[bytes]]:
    """The size of a shard's drawings, the drawings and the records, as they are stored."""
    pngs, jsons, size = [], [], None
    for key, parts in samples_of(path):
        found = size_of(path, key, parts["png"])
        size = size or found
        if found != size:
            raise InputError(
                f"{path}: a drawing of {found} stands among drawings of {size}; train on one size."
            )
        check_record(path, key, parts["json"])
        pngs.append(parts["png"])
        jsons.append(parts["json"])
    return size, pngs, jsons
