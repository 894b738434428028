"""The container of a .glb: accessors, the views of a buffer that they read, and the file's chunks.

By the specification of glTF 2.0; what a mesh is made of says `addon.gltf`.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

BYTE, UNSIGNED_BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


class File:
    """Accessors and their bytes, in the order in which they are asked for."""

    def __init__(self) -> None:
        self._views: list[dict[str, int]] = []
        self._accessors: list[dict[str, Any]] = []
        self._parts: list[bytes] = []
        self._size = 0

    def _view(self, array: NDArray, **more: int) -> int:
        data = np.ascontiguousarray(array).tobytes()
        view = {"buffer": 0, "byteOffset": self._size, "byteLength": len(data), **more}
        self._views.append(view)
        padded = data + b"\0" * (-len(data) % 4)
        self._parts.append(padded)
        self._size += len(padded)
        return len(self._views) - 1

    def _accessor(self, kind: int, count: int, type_: str, **more: Any) -> int:
        accessor = {"componentType": kind, "count": count, "type": type_, **more}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def vertices(self, values: NDArray, kind: int, normalized: bool = True) -> int:
        """The accessor of a value (n, 2), (n, 3) or (n, 4) of each vertex; of integers the largest
        means 1, unless they only count."""
        n, c = values.shape
        room = -c * values.itemsize % 4 // values.itemsize
        # In the file each vertex begins at a multiple of four bytes.
        padded = np.pad(values, ((0, 0), (0, room))) if room else values
        view = self._view(padded, byteStride=padded[:1].nbytes, target=ARRAY_BUFFER)
        more: dict[str, Any] = {
            "min": values.min(axis=0).tolist(),
            "max": values.max(axis=0).tolist(),
        }
        if normalized and kind != FLOAT:
            more["normalized"] = True
        return self._accessor(kind, n, f"VEC{c}", bufferView=view, **more)

    def matrices(self, values: NDArray) -> int:
        """The accessor of matrices (k, 4, 4)."""
        view = self._view(values.swapaxes(1, 2).astype("<f4"))  # column by column in the file
        return self._accessor(FLOAT, len(values), "MAT4", bufferView=view)

    def indices(self, triangles: NDArray, n: int) -> int:
        """The accessor of triangles (t, 3) of n vertices."""
        kind, dtype = _index(n)
        view = self._view(triangles.astype(dtype), target=ELEMENT_ARRAY_BUFFER)
        return self._accessor(kind, triangles.size, "SCALAR", bufferView=view)

    def sparse(self, n: int, rows: NDArray, values: NDArray, kind: int) -> int:
        """The accessor of n vectors: `values` (3, k) at `rows` (k,), and 0 elsewhere."""
        ends = values if len(rows) == n else np.pad(values, ((0, 0), (0, 1)))
        more: dict[str, Any] = {"min": ends.min(axis=1).tolist(), "max": ends.max(axis=1).tolist()}
        if kind != FLOAT:
            more["normalized"] = True
        if len(rows):
            index, dtype = _index(n)
            more["sparse"] = {
                "count": len(rows),
                "indices": {"bufferView": self._view(rows.astype(dtype)), "componentType": index},
                "values": {"bufferView": self._view(values.T)},
            }
        return self._accessor(kind, n, "VEC3", **more)

    def packed(self, **tree: Any) -> bytes:
        """The whole file."""
        tree |= {
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._size}],
        }
        text = json.dumps(tree, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + self._size)
        chunks = struct.pack("<I4s", len(text), b"JSON"), struct.pack("<I4s", self._size, b"BIN\0")
        return b"".join([head, chunks[0], text, chunks[1], *self._parts])


def _index(n: int) -> tuple[int, str]:
    """The integers that number n vertices; the largest of each kind is no number in glTF."""
    return (UNSIGNED_SHORT, "<u2") if n <= 0xFFFF else (UNSIGNED_INT, "<u4")
