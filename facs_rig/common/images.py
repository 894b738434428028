"""Grey pictures: resampled exactly by area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .box import Box

__all__ = ["area_resample"]

Floats = NDArray[np.float32]
BLOCK = 16  # cells whose shares of the pixels are worked out together
FINE = 2  # samples along each side of a cell of a turned box


def area_resample(
    image: NDArray, box: Box, size: int | tuple[int, int], outside: float = 0.0
) -> Floats:
    """The mean of a picture (h, w) in each cell of a grid over a box: (height, width) float32.

    size : cells across and down, or one number for both
    outside : what there is beyond the picture

    Exact for any real rectangle: a pixel counts with the area that it shares with a cell. Linear
    in the picture. A box that is turned is sampled at some points in each cell.
    Raises ValueError for an empty box.
    """
    if not (box.width > 0 and box.height > 0):
        raise ValueError(f"the box {box} is empty: its right and bottom must lie beyond the others")
    width, height = (size, size) if isinstance(size, int) else size
    if outside:
        image = image - np.float32(outside)
    if box.turn:
        found = _turned(image, box, width, height)
    else:
        columns = slice(
            int(np.clip(np.floor(box.left), 0, image.shape[1])),
            int(np.clip(np.ceil(box.right), 0, image.shape[1])),
        )
        rows = _averages(image[:, columns], box.top, box.height, height)
        found = _averages(rows.T, box.left - columns.start, box.width, width).T
        found = np.ascontiguousarray(found)
    return found + np.float32(outside) if outside else found


def _turned(image: NDArray, box: Box, width: int, height: int) -> Floats:
    """`area_resample` of a turned box: of the upright square around it, then between its cells."""
    side = float(np.hypot(box.width, box.height))
    cell = min(box.width / width, box.height / height) / FINE
    around = Box.square(box.middle, side * (1 + 2 * cell / min(box.width, box.height)))
    count = int(np.ceil(around.width / cell))
    fine = area_resample(image, around, count)
    u, v = (np.arange(FINE * width) + 0.5) / (FINE * width), (np.arange(FINE * height) + 0.5)
    points = np.stack(np.broadcast_arrays(u[None, :], (v / (FINE * height))[:, None]), axis=-1)
    place = around.to_units(box.to_pixels(points)).astype(np.float32) * count - np.float32(0.5)
    first = np.clip(np.floor(place).astype(np.intp), 0, count - 2)
    u, v = np.moveaxis((place - first).astype(np.float32), -1, 0)
    at, flat = first[..., 1] * count + first[..., 0], fine.ravel()
    above = (1 - u) * flat[at] + u * flat[at + 1]
    below = (1 - u) * flat[at + count] + u * flat[at + count + 1]
    every = (1 - v) * above + v * below
    return np.ascontiguousarray(every.reshape(height, FINE, width, FINE).mean(axis=(1, 3)))


def _averages(image: NDArray, start: float, length: float, size: int) -> Floats:
    """Mean over `size` equal cells along the first axis: (n, w) -> (size, w).

    A product with the shares of each pixel in each cell, in blocks of cells so that large pictures
    are not multiplied with zeros.
    """
    out = np.zeros((size, image.shape[1]), np.float32)
    edges = start + length / size * np.arange(size + 1)
    for i in range(0, size, BLOCK):
        low, high = edges[i : i + BLOCK + 1][:-1, None], edges[i + 1 : i + BLOCK + 1][:, None]
        first = int(np.clip(np.floor(low[0, 0]), 0, len(image)))
        last = int(np.clip(np.ceil(high[-1, 0]), first, len(image)))
        if last > first:
            pixel = np.arange(first, last)
            share = np.minimum(pixel + 1, high) - np.maximum(pixel, low)
            share = (np.maximum(share, 0) / (high - low)).astype(np.float32)
            out[i : i + BLOCK] = share @ image[first:last].astype(np.float32, copy=False)
    return out
