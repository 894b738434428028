"""Reading data sets: tar shards in the WebDataset convention, KEY.png beside KEY.json."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

HELD_OUT = 10  # every tenth drawing is never trained on


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
    """drawings : n of (h, w) uint8, 0 = black, 255 = paper; records : the n JSON objects."""

    drawings: Sequence[NDArray[np.uint8]]
    records: Sequence[dict[str, Any]]

    def __len__(self) -> int:
        return len(self.records)

    @cached_property
    def index(self) -> NDArray[np.int64]:
        """(n,) the number of each drawing in its data set."""
        return np.array([record.get("index", i) for i, record in enumerate(self.records)])

    def held_out(self) -> NDArray[np.bool_]:
        """(n,) which drawings are for validation: by index, so that growing sets keep theirs."""
        return self.index % HELD_OUT == HELD_OUT - 1


def shard_paths(folder: Path) -> list[Path]:
    """The folder's shards in order; raises ValueError if there is none."""
    paths = sorted(Path(folder).glob("*.tar"))
    if not paths:
        raise ValueError(
            f"{folder} holds no .tar shard: run `sketch2face generate --out {folder}`."
        )
    return paths


def samples(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """The PNG and the JSON of each sample of one shard, in its order.

    Members of one key stand next to each other; keys without a picture or a record are skipped.
    """
    with tarfile.open(path) as shard:
        key = ""
        parts: dict[str, bytes] = {}
        for member in shard:
            name, _, extension = member.name.partition(".")
            if name != key:
                key, parts = name, {}
            if extension in ("png", "json"):
                stream = shard.extractfile(member)
                parts[extension] = stream.read() if stream else b""
                if len(parts) == 2:
                    yield parts["png"], parts["json"]


def load(folder: Path, limit: int | None = None) -> DataSet:
    """All drawings of a folder's shards, at most `limit`.

    Raises ValueError if there are none or if they are not all of one size.
    """
    drawings: list[bytes] = []
    records: list[bytes] = []
    size = None
    for path in shard_paths(folder):
        for png, record in samples(path):
            with Image.open(io.BytesIO(png)) as picture:  # reads no more than its header
                size = size or picture.size
                if picture.size != size:
                    raise ValueError(
                        f"{path}: a drawing of {picture.size} stands among drawings of {size};"
                        " train on one size."
                    )
            drawings.append(png)
            records.append(record)
            if len(records) == limit:
                break
        if len(records) == limit:
            break
    if not drawings:
        raise ValueError(f"The shards in {folder} hold no pair of .png and .json.")
    return DataSet(Stored(drawings, drawing_of), Stored(records, json.loads))
