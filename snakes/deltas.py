"""What the snakes say: how far each pixel of the render is from the drawing (thesis, step 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

__all__ = ["PixelDeltas", "consistent", "direct", "on_line", "pixel_deltas", "runs"]

NEIGHBOURS = 16
"""How many neighbouring deltas a delta is held against."""
LINE_WIDTH = 3.0
"""Standard deviation, working pixels, of the surroundings that a dark line is held against."""


@dataclass(frozen=True)
class PixelDeltas:
    """Averaged deltas of the pixels that snakes landed on.

    pixels : (k, 2) intp, column and row in the working image, each pixel once
    deltas : (k, 2) float64, drawing minus render, (u, v) in pixels of the working image
    counts : (k,) intp, how many snake points landed on the pixel
    """

    pixels: NDArray[np.intp]
    deltas: NDArray[np.float64]
    counts: NDArray[np.intp]


def pixel_deltas(
    contours: NDArray[np.floating],
    snakes: NDArray[np.floating],
    size: tuple[int, int],
    max_delta: float,
    usable: NDArray[np.bool_] | None = None,
) -> tuple[PixelDeltas, NDArray[np.bool_]]:
    """Average the deltas of all snake points that landed on the same pixel.

    A point that ended off the picture or moved farther than `max_delta` found nothing of its own
    and is left out.

    Parameters
    ----------
    contours, snakes : (p, 2) float
        All points before and after the snakes ran, (u, v) in the working image.
    size : (width, height) of the working image
    usable : (p,) bool, optional
        Points to leave out beforehand.

    Returns
    -------
    PixelDeltas, and (p,) bool that says which points were used
    """
    delta = np.asarray(contours, dtype=np.float64) - snakes
    cell = np.floor(snakes).astype(np.intp)
    used = np.all((cell >= 0) & (cell < size), axis=1)
    used &= np.linalg.norm(delta, axis=1) <= max_delta
    if usable is not None:
        used &= usable
    flat = cell[used, 1] * size[0] + cell[used, 0]
    places, owner, counts = np.unique(flat, return_inverse=True, return_counts=True)
    mean = np.zeros((len(places), 2))
    np.add.at(mean, owner, delta[used])
    mean /= np.maximum(counts, 1)[:, None]
    pixels = np.stack([places % size[0], places // size[0]], axis=1)
    return PixelDeltas(pixels, mean, counts), used


def direct(
    contours: NDArray[np.floating],
    snakes: NDArray[np.floating],
    slack: float = 1.5,
    detour: float = 1.4,
) -> NDArray[np.bool_]:
    """Which snake points came from the drawn line that is next to where they are; (p,) bool.

    A snake slides along a line of the render as easily as toward it, and past its own line to a
    stronger one. Where another part of the drawing lies nearer to the place it reached, by more
    than `slack` pixels and the factor `detour`, it says nothing about that place. Shapes as in
    :func:`pixel_deltas`. This goes beyond the thesis, which has Max Delta alone.
    """
    nearest = cKDTree(contours).query(snakes)[0]
    return np.linalg.norm(contours - snakes, axis=1) <= slack + detour * nearest


def on_line(
    render: NDArray[np.floating], snakes: NDArray[np.floating], contrast: float = 0.01
) -> NDArray[np.bool_]:
    """Which snake points rest on a dark line of the render; (p,) bool.

    Where the render is flat nothing moves a snake, and its small delta would say that the face is
    right there. A point counts when the render under it is darker, by `contrast`, than the
    average around it (a blur of LINE_WIDTH pixels). snakes : (p, 2), (u, v) pixels of the render.
    """
    depth = gaussian_filter(np.asarray(render, dtype=np.float64), LINE_WIDTH) - render
    inside = map_coordinates(depth, snakes.T[::-1] - 0.5, order=1, mode="nearest")
    return inside >= contrast


def consistent(
    found: PixelDeltas, reach: float = 12.0, tolerance: float = 1.5
) -> NDArray[np.bool_]:
    """Which deltas agree with those around them; (k,) bool.

    Skin moves smoothly, so a delta that differs from the (coordinate-wise) median of its
    neighbours within `reach` pixels by more than `tolerance` pixels plus half that median's length
    comes from a line that was mapped to the wrong one. This goes beyond the thesis, which judges
    each delta by its own length alone. A delta with fewer than two neighbours is kept.
    """
    n = len(found.pixels)
    if n < 3:
        return np.ones(n, dtype=bool)
    k = min(NEIGHBOURS + 1, n)
    near = cKDTree(found.pixels).query(found.pixels, k=k, distance_upper_bound=reach)[1]
    here = near < n
    around = np.where(here[..., None], found.deltas[np.minimum(near, n - 1)], np.nan)
    median = np.nanmedian(around, axis=1)
    off = np.linalg.norm(found.deltas - median, axis=1)
    limit = tolerance + 0.5 * np.linalg.norm(median, axis=1)
    return (off <= limit) | (here.sum(axis=1) < 3)


def runs(flags: NDArray[np.bool_], shortest: int = 1) -> list[slice]:
    """The stretches of at least `shortest` consecutive True values, as slices."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2) if b - a >= shortest]
