"""Marks all over a head of hair: places on it, bent strokes there, and bumps along its edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .canvas import Canvas
from .cut import Hair
from .patches import Patch
from .shapes import Points, even, normals, smooth

MOST = 520  # strokes of one kind on one head


def pieces_of(hair: Hair) -> list[Patch]:
    """The hair over the head, and what hangs down at either side."""
    return [Patch(hair.inner, hair.outer)] + [Patch(f[1], f[0]) for f in hair.falls if f]


def places_on(
    rng: np.random.Generator, hair: Hair, count: int, low: float = 1.0
) -> tuple[Points, NDArray[np.float64], NDArray[np.float64]]:
    """Places (n, 2) all over the hair, the way out (n,) at each in radians, and how far out it is,
    0 at the hairline to 1 at the outline; low : see `Patch.scattered`."""
    pieces = pieces_of(hair)
    sizes = np.array([piece.size for piece in pieces])
    shares = np.round(count * sizes / max(sizes.sum(), 1e-9)).astype(int)
    places, ways, ups = [], [], []
    for piece, many in zip(pieces, shares.tolist(), strict=True):
        across, up = _evenly(rng, piece, many, low)
        out = piece.at(across, np.ones(many)) - piece.at(across, np.zeros(many))
        places.append(piece.at(across, up))
        ways.append(np.arctan2(out[:, 1], out[:, 0]))
        ups.append(up)
    return np.concatenate(places), np.concatenate(ways), np.concatenate(ups)


def _evenly(
    rng: np.random.Generator, piece: Patch, count: int, low: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """As `Patch.scattered`, without its crowds and holes: by the R2 sequence of M. Roberts, 2018
    ("The unreasonable effectiveness of quasirandom sequences")."""
    share = np.cumsum(piece.tall * np.hypot(*np.gradient(piece.high, axis=0).T) + 1e-9)
    k = np.arange(count)[:, None] * [0.7548776662, 0.5698402910]
    u, v = ((rng.random(2) + k + 0.3 / np.sqrt(count + 1) * rng.normal(size=(count, 2))) % 1).T
    return np.interp(u * share[-1], share, np.linspace(0, 1, len(share))), v**low


def field(rng: np.random.Generator, places: NDArray, scale: float) -> NDArray[np.float64]:
    """(n,) smooth noise on the page, about -1 to 1, that changes within `scale` px."""
    total = np.zeros(len(places))
    for angle, phase in rng.uniform(0, 2 * np.pi, (3, 2)):
        total += np.sin(places @ [np.cos(angle), np.sin(angle)] / scale * 1.5 + phase)
    return total / 1.7


def many_for(hair: Hair, each: float, cover: float, most: int = MOST) -> tuple[int, float]:
    """How many marks of `each` square pixels cover the hair `cover` times, at most `most`, and
    how many times as long and wide they have to be for it."""
    many = cover * sum(p.size for p in pieces_of(hair)) / max(each, 1.0)
    return int(np.clip(many, 4, most)), float(np.sqrt(max(many / most, 1.0)))


def bent(
    places: NDArray, way: NDArray, size: NDArray, turn: NDArray, turn_back: NDArray, count: int = 12
) -> Points:
    """Strokes (n, count, 2) of length `size` px about places (n, 2): their heading begins at `way`
    and turns by `turn` radians, of which it turns back `turn_back` in its second half (n,)."""
    t = np.linspace(0, 1, count)
    rest = np.clip(2 * t - 1, 0, 1)
    heading = way[:, None] + turn[:, None] * t - turn_back[:, None] * rest
    step = size[:, None] / (count - 1)
    line = np.stack([np.cumsum(step * np.cos(heading), 1), np.cumsum(step * np.sin(heading), 1)], 2)
    return places[:, None] + line - line.mean(axis=1, keepdims=True)


def put(
    canvas: Canvas, lines: NDArray, width: NDArray | float, strength: NDArray | float, loose: float
) -> None:
    """Strokes (n, k, 2) of hair; width, strength : (n,) or for all."""
    widths, strengths = (np.zeros(len(lines)) + v for v in (width, strength))
    taper = np.interp(np.linspace(0, 1, lines.shape[1]), [0, 0.3, 0.8, 1], [0.8, 1, 0.9, 0.5])
    for line, w, s in zip(lines, widths.tolist(), strengths.tolist(), strict=True):
        canvas.line("hair", line, w, s * taper, loose=loose)


def bumps(rng: np.random.Generator, line: NDArray, count: int, high: float) -> Points:
    """A line (k, 2) in `count` arcs of various widths that stand off it to the right of its way by
    `high` of their width (to the left below 0)."""
    count = max(count, 2)
    wide = rng.uniform(0.5, 1.5, count)
    ends = np.concatenate([[0], np.cumsum(wide)]) / wide.sum()
    n = 9 * count + 1
    line = even(line, n)
    total = float(np.hypot(*np.diff(line, axis=0).T).sum())
    t = np.linspace(0, 1, n)
    own = np.clip(np.searchsorted(ends, t, side="right") - 1, 0, count - 1)
    share = (t - ends[own]) / (ends[own + 1] - ends[own])
    off = high * total * np.diff(ends)[own] * np.sin(np.pi * np.clip(share, 0, 1)).clip(0) ** 0.6
    # Bumps on a ragged line would cross each other.
    away = normals(smooth(line[:: max(1, n // 16)], n))
    return line + off[:, None] * away


def outward(piece: Patch) -> float:
    """1 or -1: on which side of a patch's upper line its outside is."""
    out = (normals(piece.high) * (piece.high - piece.low)).sum()
    return 1.0 if out >= 0 else -1.0


def told(canvas: Canvas, outline: Points) -> None:
    """What stands off the hair is hair, and hides what is behind it."""
    canvas.mark("hair", outline)
    canvas.cover(outline)
