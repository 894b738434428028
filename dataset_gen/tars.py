"""Reading tar shards in the WebDataset convention, and saying what is wrong with one that is not.

KEY.json and KEY.png (and what else there is of KEY) stand next to each other.
"""

from __future__ import annotations

import io
import json
import struct
import tarfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from facs_rig.common.errors import InputError

END = bytes(1024)  # the two empty blocks with which a tar ends
SIGNATURE = b"\x89PNG\r\n\x1a\n"
ENDS = (b"IHDR", b"IEND")  # the first and the last chunk of a PNG


class ShardError(InputError):
    """A shard that is damaged or foreign; the text names it."""


def files_of(path: Path) -> Iterator[tuple[str, bytes]]:
    """Name and content of the files of a tar, in its order; folders and links are passed over.

    Raises ShardError for what cannot be read, is no (uncompressed) tar, or was cut short.
    """
    try:
        with path.open("rb") as file:
            file.seek(max(0, file.seek(0, io.SEEK_END) - len(END)))
            whole = file.read() == END
        if not path.stat().st_size:
            raise ShardError(f"{path} is empty; make it anew.")
        with tarfile.open(path, "r:") as tar:
            for member in tar:
                stream = tar.extractfile(member) if member.isreg() else None
                if stream is not None:
                    yield member.name, stream.read()
    except OSError as problem:
        raise ShardError(f"{path} cannot be read ({problem.strerror or problem}).") from None
    except tarfile.TarError:
        raise ShardError(f"{path} is damaged, or no tar; make it anew.") from None
    if not whole:  # cut between two files, where tarfile takes it for the end
        raise ShardError(f"{path} is cut short; make it anew.")


def samples_of(path: Path) -> Iterator[tuple[str, dict[str, bytes]]]:
    """Key and files, by their ending, of each sample of a shard.

    Of a key there are both a picture and a record, or neither (a note beside the samples, say).
    Raises ShardError otherwise, and as `files_of`.
    """
    key, parts = "", dict[str, bytes]()
    for name, data in files_of(path):
        folder, _, base = name.rpartition("/")
        stem, _, ending = base.partition(".")
        if f"{folder}/{stem}" != key:
            yield from _whole(path, key, parts)
            key, parts = f"{folder}/{stem}", {}
        if ending in parts:
            raise ShardError(f"{path} holds {name} twice; make it anew.")
        parts[ending] = data
    yield from _whole(path, key, parts)


def _whole(path: Path, key: str, parts: dict[str, bytes]) -> Iterator[tuple[str, dict[str, bytes]]]:
    there = {"json", "png"} & set(parts)
    key = key.removeprefix("/")
    if len(there) == 1:
        (one,) = there
        other = "png" if one == "json" else "json"
        raise ShardError(
            f"{path}: beside {key}.{one} stands no {key}.{other}, as the two of a sample must; "
            "make it anew."
        )
    if there:
        yield key, parts


def record_of(path: Path, key: str, data: bytes) -> dict[str, Any]:
    """A sample's record; ShardError if it is no JSON object."""
    try:
        record = json.loads(data)
    except ValueError:
        record = None
    if not isinstance(record, dict):
        raise ShardError(f"{path}: {key}.json is damaged; make the shard anew.")
    return record


def size_of(path: Path, key: str, data: bytes) -> tuple[int, int]:
    """Width and height of a sample's picture; ShardError unless every chunk has its checksum."""
    chunks = []
    place = len(SIGNATURE)
    while place < len(data) and data.startswith(SIGNATURE):
        (length,) = struct.unpack(">I", data[place : place + 4].rjust(4, b"\xff"))
        body, end = data[place + 4 : place + 8 + length], place + 12 + length
        if data[place + 8 + length : end] != struct.pack(">I", zlib.crc32(body)):
            break
        chunks.append(body[:4])
        place = end
    if place != len(data) or not {b"IDAT"} < {*chunks} or (chunks[0], chunks[-1]) != ENDS:
        raise ShardError(f"{path}: {key}.png is damaged; make the shard anew.")
    width, height = struct.unpack(">II", data[16:24])
    return width, height
