"""Reading data sets: tar shards in the WebDataset convention, KEY.png beside KEY.json."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

HELD_OUT = 10  # every tenth drawing is never trained on


@dataclass(frozen=True)
class DataSet:
    """drawings : (n, h, w) uint8, 0 = black, 255 = paper; records : the n JSON objects."""

    drawings: NDArray[np.uint8]
    records: list[dict[str, Any]]

    def __len__(self) -> int:
        return len(self.records)

    def held_out(self) -> NDArray[np.bool_]:
        """(n,) which drawings are for validation: by index, so that growing sets keep theirs."""
        index = np.array([record.get("index", i) for i, record in enumerate(self.records)])
        return index % HELD_OUT == HELD_OUT - 1


def shard_paths(folder: Path) -> list[Path]:
    """The folder's shards in order; raises ValueError if there is none."""
    paths = sorted(Path(folder).glob("*.tar"))
    if not paths:
        raise ValueError(
            f"{folder} holds no .tar shard: run `sketch2face generate --out {folder}`."
        )
    return paths


def samples(path: Path) -> Iterator[tuple[NDArray[np.uint8], dict[str, Any]]]:
    """(drawing (h, w) uint8, record) of one shard, in its order.

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
                picture = Image.open(io.BytesIO(parts["png"])).convert("L")
                yield np.array(picture), json.loads(parts["json"])
                parts = {}


def load(folder: Path, limit: int | None = None) -> DataSet:
    """All drawings of a folder's shards in memory (64 kB for each of 256 x 256), at most `limit`.

    Raises ValueError if there are none or if they are not all of one size.
    """
    drawings: list[NDArray[np.uint8]] = []
    records: list[dict[str, Any]] = []
    for path in shard_paths(folder):
        for drawing, record in samples(path):
            if drawings and drawing.shape != drawings[0].shape:
                raise ValueError(
                    f"{path}: a drawing of {drawing.shape} stands among drawings of"
                    f" {drawings[0].shape}; train on one size."
                )
            drawings.append(drawing)
            records.append(record)
            if len(records) == limit:
                return DataSet(np.stack(drawings), records)
    if not drawings:
        raise ValueError(f"The shards in {folder} hold no pair of .png and .json.")
    return DataSet(np.stack(drawings), records)
