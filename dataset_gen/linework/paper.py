"""The page: its tone and tooth, the scanner's grain, a phone's uneven light, lean and blur."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from .style import Style

TILE = 256  # pixels, after which the tooth of the paper repeats
TOOTH = 0.55  # pixels, fineness of the tooth
Floats = NDArray[np.float32]


@lru_cache(maxsize=1)
def _tile() -> Floats:
    """(TILE, TILE) heights of the paper's tooth, each from 0 to 1 as often as any other."""
    rough = np.random.default_rng(7).normal(size=(TILE, TILE))
    fine = gaussian_filter(rough, TOOTH, mode="wrap")
    coarse = gaussian_filter(rough[::-1, ::-1], 2.2, mode="wrap")
    height = fine / fine.std() + 0.5 * coarse / coarse.std()
    rank = height.ravel().argsort().argsort().reshape(height.shape)
    return (rank / (rank.size - 1)).astype(np.float32)


def tooth(height: int, width: int, seed: int) -> Floats:
    """(height, width) tooth of the paper, 0 its peaks and 1 its pits: always of the same sheet,
    laid down elsewhere for each seed."""
    du, dv, turn = np.random.default_rng(seed).integers(0, [TILE, TILE, 4])
    rows = (np.arange(height) + dv) % TILE
    columns = (np.arange(width) + du) % TILE
    return np.rot90(_tile(), int(turn)).take(rows, axis=0).take(columns, axis=1)


def grained(darkness: Floats, style: Style) -> Floats:
    """Darkness (h, w) as a pencil leaves it: light strokes reach only the peaks of the tooth."""
    if not style.grain:
        return darkness
    height, width = darkness.shape
    pits = tooth(height, width, style.seed)
    reach = np.clip(0.85 + 1.7 * darkness - 2 * pits * (1 - 0.5 * darkness), 0, 1)
    return darkness * (1 - style.grain + style.grain * reach)


def on_paper(darkness: Floats, style: Style) -> NDArray[np.uint8]:
    """(h, w) uint8 picture of darkness (h, w) 0..1 on the page of this style."""
    page = 1 - darkness
    if style.blur:
        page = gaussian_filter(page, style.blur, mode="nearest", truncate=3.0)
    if style.paper < 1 or style.shadow:
        page = page * light(page.shape[0], page.shape[1], style)
    if style.noise:
        rng = np.random.default_rng([style.seed, 1])
        page = page + style.noise * rng.standard_normal(page.shape, dtype=np.float32)
    return (np.clip(page, 0, 1) * 255 + 0.5).astype(np.uint8)


def light(height: int, width: int, style: Style) -> Floats | float:
    """(height, width) tone of the blank page: `paper` where it is brightest, less in the shadow.

    A phone's picture is lit from one side, darker to the corners, with the soft shadow of the one
    who takes it.
    """
    if not style.shadow:
        return style.paper
    rng = np.random.default_rng([style.seed, 2])
    u = np.linspace(-1, 1, width, dtype=np.float32)[None, :]
    v = np.linspace(-1, 1, height, dtype=np.float32)[:, None]
    angle = rng.uniform(0, 2 * np.pi)
    side = np.float32(np.cos(angle)) * u + np.float32(np.sin(angle)) * v
    corners = u * u + v * v
    a, b, reach = (np.float32(x) for x in (*rng.uniform(-1, 1, 2), rng.uniform(0.4, 0.9)))
    cast = np.exp(-((u - a) ** 2) / reach**2) * np.exp(-((v - b) ** 2) / reach**2)
    parts = (np.float32(x) for x in rng.dirichlet([2, 1, 1]))
    dark = sum(share * part for share, part in zip(parts, (side, corners, cast), strict=True))
    dark -= dark.min()
    return np.float32(style.paper) * (1 - np.float32(style.shadow) * dark / dark.max())


def tilt_matrix(style: Style, width: int, height: int) -> NDArray[np.float64]:
    """(3, 3) homography from the page's pixels to the picture's, for a page that leans away.

    Whatever was in the picture stays in it: the nearer side is as large as before.
    """
    a, b = style.tilt
    cu, cv = width / 2, height / 2
    to_middle = np.array([[1, 0, -cu], [0, 1, -cv], [0, 0, 1]], float)
    lean = np.diag([1 - abs(a) - abs(b)] * 2 + [1.0])
    lean[2, :2] = a / cu, b / cv
    back = np.array([[1, 0, cu], [0, 1, cv], [0, 0, 1]], float)
    return back @ lean @ to_middle


def through(matrix: NDArray, points: NDArray) -> NDArray[np.float64]:
    """Points (..., 2) mapped by a homography (3, 3)."""
    mapped = np.asarray(points, float) @ matrix[:, :2].T + matrix[:, 2]
    return mapped[..., :2] / mapped[..., 2:]
