"""Active contours: each contour of the drawing settles on the render (thesis, chapter 3, step 4).

The snake of Kass, Witkin and Terzopoulos ("Snakes: active contour models", 1988) in the form that
``skimage.segmentation.active_contour`` gives it, and point for point the same (a test holds the
two together). It is written anew for two reasons. First, speed: scikit-image filters the image and
inverts a dense matrix for every snake, while here all snakes of a drawing move together, with one
spline of the image and one sparse factorisation. Second, the ends: scikit-image writes the third
difference at the far end of a free snake with the sign of the near end, and the second difference
at both ends of a fixed snake with the wrong sign, which gives the iteration growing modes (with
the defaults by factors of 1.2 and 2.9), so that ends fly off and the snake never rests. Here the
signs are such that nothing grows; ``as_scikit_image`` brings the originals back.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, identity
from scipy.sparse.linalg import splu
from skimage.filters import sobel

from .tweakables import Tweakables

__all__ = ["image_energy", "relax", "stiffness"]

CONTRACTION = 0.01
"""How strongly a snake shortens itself; not tweakable in the thesis, scikit-image's default."""

HISTORY = 10
"""A snake rests when it is where it was in one of this many iterations (it may oscillate)."""

FEWEST = 5
"""Fourth differences need five points."""

ENDS: dict[str, tuple[tuple[int, ...], tuple[int, ...]]] = {
    "free": ((1, -2, 1), (-1, 3, -3, 1)),
    "fixed": ((), (-1, 2, -1)),
}
"""Patterns in the first and second row: no bending moment, and at a free end no shear force."""


def image_energy(
    image: NDArray[np.floating], brightness_weight: float, edge_weight: float
) -> NDArray[np.float64]:
    """What draws a snake, uphill: weighted brightness plus weighted Sobel edges, (h, w) float64."""
    values = np.asarray(image, dtype=np.float64)
    energy = brightness_weight * values
    if edge_weight != 0:
        energy = energy + edge_weight * sobel(values)
    return energy


def stiffness(
    n: int, smoothness: float, snake_type: str = "free", *, as_scikit_image: bool = False
) -> csr_matrix:
    """The shape matrix of a snake of `n` points: minus contraction plus smoothness, (n, n) sparse.

    Free ends have no bending moment and no shear force; fixed ends have no bending moment and the
    iteration holds them; a periodic snake has no ends. Raises ValueError below five points.
    """
    if n < FEWEST:
        raise ValueError(f"A snake needs at least {FEWEST} points, not {n}.")
    here = np.arange(n)
    inner_rows = here if snake_type == "periodic" else here[2:-2]
    entries: list[tuple[NDArray[np.intp] | int, NDArray[np.intp] | int, float]] = []
    for weight, pattern in ((-CONTRACTION, (1, -2, 1)), (smoothness, (1, -4, 6, -4, 1))):
        for offset, value in enumerate(pattern, start=-(len(pattern) // 2)):
            entries.append((inner_rows, (inner_rows + offset) % n, weight * value))
    if snake_type != "periodic":
        outer, inner = ENDS[snake_type]
        far_inner = inner[::-1]
        if as_scikit_image:
            far_inner = inner = (1, -2, 1) if snake_type == "fixed" else inner
        for row, first, values in (
            (0, 0, outer),
            (1, 0, inner),
            (n - 2, n - len(inner), far_inner),
            (n - 1, n - len(outer), outer),
        ):
            entries += [(row, first + k, float(value)) for k, value in enumerate(values)]
    rows = np.concatenate([np.atleast_1d(entry[0]) for entry in entries])
    columns = np.concatenate([np.atleast_1d(entry[1]) for entry in entries])
    weights = np.concatenate([np.full(np.size(entry[0]), entry[2]) for entry in entries])
    return csr_matrix((weights, (rows, columns)), shape=(n, n))


def relax(
    image: NDArray[np.floating],
    snakes: Sequence[NDArray[np.floating]],
    tweakables: Tweakables | None = None,
    *,
    as_scikit_image: bool = False,
) -> list[NDArray[np.float64]]:
    """Let snakes settle on the dark lines and edges of an image.

    Parameters
    ----------
    image : (h, w) float
        The shaded render, 0 black to 1 white.
    snakes : sequence of (k, 2) float
        Points as (u, v), pixel centres at .5, five or more each. A periodic snake does not repeat
        its first point.
    tweakables
        Snake type, smoothness, time stepping, max step, max iterations, convergence and weights.
    as_scikit_image
        Treat the ends of free and fixed snakes as scikit-image does (see the module's docstring).

    Returns
    -------
    list of (k, 2) float64
        Where the points come to rest, in the order given.

    Raises ValueError when a snake has fewer than five points or the image is not (h, w).
    """
    settings = tweakables or Tweakables()
    if np.ndim(image) != 2:
        raise ValueError(f"The render has the shape (height, width), not {np.shape(image)}.")
    if not snakes:
        return []
    energy = image_energy(image, settings.brightness_weight, settings.edge_weight)
    height, width = energy.shape
    # Quadratic, as in scikit-image: the force is then continuous.
    spline = RectBivariateSpline(np.arange(height), np.arange(width), energy, kx=2, ky=2, s=0)

    lengths = np.array([len(snake) for snake in snakes])
    starts = np.concatenate([[0], np.cumsum(lengths)])
    points = np.concatenate([np.asarray(snake, dtype=np.float64) for snake in snakes])[:, ::-1]
    points = points - 0.5
    shapes = {
        n: stiffness(
            int(n), settings.smoothness, settings.snake_type, as_scikit_image=as_scikit_image
        ).tocoo()
        for n in np.unique(lengths)
    }
    inertia = settings.time_stepping
    rest = _Rest(points, lengths, settings.convergence)
    moving = np.arange(len(snakes))
    first, last = _ends(lengths)
    result = points.copy()
    solver = None
    for iteration in range(settings.max_iterations):
        if solver is None:
            owner = np.repeat(np.arange(len(moving)), lengths[moving])
            system = _side_by_side([shapes[n] for n in lengths[moving]], first)
            solver = splu(csc_matrix(system + inertia * identity(len(owner))))
        force = np.stack(
            [spline(*points.T, dx=1, grid=False), spline(*points.T, dy=1, grid=False)], axis=1
        )
        if settings.snake_type == "free":
            force[first] *= 2.0
            force[last] *= 2.0
        elif settings.snake_type == "fixed":
            force[first] = 0.0
            force[last] = 0.0
        step = settings.max_step * np.tanh(solver.solve(inertia * points + force) - points)
        if settings.snake_type == "fixed":
            step[first] = 0.0
            step[last] = 0.0
        points = points + step
        resting = rest.after(iteration, points, first)
        if resting is None or not resting.any():
            continue
        for index in np.flatnonzero(resting):
            slot = moving[index]
            result[starts[slot] : starts[slot + 1]] = points[first[index] : last[index] + 1]
        stays = ~resting[owner]
        points, moving, solver = points[stays], moving[~resting], None
        first, last = _ends(lengths[moving])
        rest.keep(stays)
        if len(moving) == 0:
            break
    for index, slot in enumerate(moving):
        result[starts[slot] : starts[slot + 1]] = points[first[index] : last[index] + 1]
    result = result[:, ::-1] + 0.5
    return [result[a:b] for a, b in zip(starts[:-1], starts[1:], strict=True)]


def _ends(lengths: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first and the last row of each snake, where their points stand below each other."""
    after = np.cumsum(lengths)
    return after - lengths, after - 1


def _side_by_side(shapes: Sequence[coo_matrix], first: NDArray[np.intp]) -> csc_matrix:
    """The shape matrices of all snakes as one, each beginning at its `first` row.

    What scipy.sparse.block_diag gives, without its checks of every small matrix.
    """
    values = np.concatenate([shape.data for shape in shapes])
    counts = [shape.nnz for shape in shapes]
    shift = np.repeat(first, counts)
    rows = np.concatenate([shape.row for shape in shapes]) + shift
    columns = np.concatenate([shape.col for shape in shapes]) + shift
    n = int(first[-1]) + shapes[-1].shape[0]
    return csc_matrix((values, (rows, columns)), shape=(n, n))


class _Rest:
    """Says which snakes have come to rest, by scikit-image's rule."""

    def __init__(
        self, points: NDArray[np.float64], lengths: NDArray[np.intp], convergence: float
    ) -> None:
        self.history = np.empty((HISTORY, *points.shape))
        self.convergence = convergence

    def after(
        self, iteration: int, points: NDArray[np.float64], first: NDArray[np.intp]
    ) -> NDArray[np.bool_] | None:
        """Per snake, whether it rests; None in the iterations that only fill the history."""
        turn = iteration % (HISTORY + 1)
        if turn < HISTORY:
            self.history[turn] = points
            return None
        moved = np.abs(self.history - points).sum(axis=2)
        farthest = np.maximum.reduceat(moved, first, axis=1)
        return farthest.min(axis=0) < self.convergence

    def keep(self, stays: NDArray[np.bool_]) -> None:
        """Forget the points of the snakes that rest."""
        self.history = self.history[:, stays]
