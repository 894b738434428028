"""The part of a hat that holds the skull, and what else hats are put together of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .patches import Patch
from .shapes import Points, smooth, wave
from .sitter import RAYS, Sitter

# Units that each stands off the skull, and how much more at the crown's middle.
STANDS = {"cap": (0.1, 0.12), "skullcap": (0.05, 0.2), "brim": (0.12, 0.3), "beanie": (0.08, 0.4),
          "scarf": (0.08, 0.06), "veil": (0.09, 0.12), "bandana": (0.04, 0.08), "tall": (0.08, 0.0),
          "wrap": (0.13, 0.4), "hood": (0.12, 0.25), "helmet": (0.14, 0.2),
          "flat": (0.05, 0.12)}  # fmt: skip
SOFT = ("beanie", "scarf", "veil", "bandana", "wrap", "hood")  # whose outline is uneven
# How often each lies down over the temples to the ears, and how often it hangs over to one side.
DEEP = {"beanie": 0.6, "wrap": 0.8, "skullcap": 0.4, "bandana": 0.3, "scarf": 0.3, "cap": 0.25,
        "helmet": 0.3}  # fmt: skip
SLACK = {"beanie": 0.4, "wrap": 0.5, "cap": 0.25, "flat": 0.4, "hood": 0.2}
ABOVE = (0.36, 0.82)  # units above the eyes where a rim crosses the forehead


def make_crown(canvas: Canvas, sitter: Sitter, artist: Artist) -> Patch:
    """low : the rim, over the forehead;  high : the dome, both from the picture's left"""
    rng, kind = canvas.rng, artist.hat
    centre = sitter.face.mean(axis=0)
    reach = np.linspace(-0.28, 0.28, 49) * RAYS
    angle = 2 * np.pi * reach / RAYS
    skull = radius(sitter.head, centre, reach)
    ways = np.sin(angle)[:, None] * sitter.right - np.cos(angle)[:, None] * sitter.down
    stand, more = STANDS[kind]
    high = more * rng.uniform(0, 1) * np.cos(np.clip(angle, -np.pi / 2, np.pi / 2)) ** 2
    off = stand * rng.uniform(0.5, 2.0) + high
    if kind in SOFT:
        off = off + rng.uniform(0, 0.05) * wave(rng, 1, len(off), rng.uniform(1, 3))[0]
    if rng.random() < SLACK.get(kind, 0.0):
        place, wide = rng.uniform(-1.4, 1.4), rng.uniform(0.4, 0.8)
        off = off + rng.uniform(0.05, 0.35) * np.exp(-(((angle - place) / wide) ** 2))
    dome = centre + (skull + np.maximum(off, 0.02) * sitter.unit)[:, None] * ways
    if kind == "tall":
        dome = _risen(dome, sitter, rng)
    if kind == "veil":  # its edge frames the face
        share = np.interp(np.abs(angle), (0, np.pi / 2), rng.uniform((0.72, 0.9), (0.98, 1.0)))
        return Patch(centre + (share * radius(sitter.face, centre, reach))[:, None] * ways, dome)
    # The rim: an arc over the forehead between the dome's lower ends, lower or higher in front.
    height, lean = rng.uniform(*ABOVE), rng.normal(0, 0.07)
    if kind == "hood":
        height = rng.uniform(-0.6, 0.2)
    deep = rng.uniform(0.15, 0.7) if rng.random() < DEEP.get(kind, 0.0) else 0.0
    x, y = sitter.local(dome).T
    low = np.abs(y + height - deep - 0.1 - lean * x)
    half = len(dome) // 2
    first, last = int(low[:half].argmin()), half + int(low[half:].argmin())
    dome = dome[first : last + 1]
    t = np.linspace(0, 1, 31)
    dip = (rng.uniform(-0.12, 0.18) * (deep == 0) + deep) * np.sin(np.pi * t) ** (
        0.6 if deep else 1.0
    )
    rim = dome[0] + t[:, None] * (dome[-1] - dome[0]) - dip[:, None] * sitter.unit * sitter.down
    if kind == "hood":
        rim = _opening(sitter, dome, rng)
    return Patch(rim, dome)


def radius(line: Points, centre: Points, rays: NDArray) -> NDArray[np.float64]:
    """How far an outline (RAYS, 2) is from its centre at rays (k,), in pixels."""
    far = np.linalg.norm(np.concatenate([line, line[:1]]) - centre, axis=1)
    return np.interp(rays, np.arange(RAYS + 1), far, period=RAYS)


def worn(canvas: Canvas, outline: Points, width: float = 1.0) -> None:
    """A part of a hat that hides what is behind it."""
    canvas.mark("hat", outline)
    canvas.line("hat", outline, width)
    canvas.cover(outline)


def _risen(dome: Points, sitter: Sitter, rng: np.random.Generator) -> Points:
    """A dome as a cylinder that widens or narrows upwards."""
    x, y = sitter.local(dome).T
    top = y.min() - rng.uniform(0.0, 0.7)
    side, flare = np.abs(x).max(), rng.uniform(-0.2, 0.25)
    middle = (x.min() + x.max()) / 2
    n = len(dome)
    k = np.linspace(0, 1, n)
    begin = y[[0, -1]]
    corner = 0.28
    px = np.interp(k, [0, corner, 1 - corner, 1], [-1, -1 - flare, 1 + flare, 1]) * side + middle
    py = np.interp(k, [0, corner, 1 - corner, 1], [begin[0], top, top, begin[1]])
    bow = rng.uniform(-0.02, 0.12) * np.clip(np.sin(np.pi * (k - corner) / (1 - 2 * corner)), 0, 1)
    return sitter.at(px, py - bow)


def _opening(sitter: Sitter, dome: Points, rng: np.random.Generator) -> Points:
    """The inner edge of a hood, around the face from one of its lower ends to the other."""
    ends = sitter.local(dome[[0, -1]])
    middle, high = ends[:, 0].mean(), rng.uniform(0.6, 0.95)
    half = np.ptp(ends[:, 0]) / 2
    t = np.linspace(np.pi, 0, 31)
    x = middle + (half - 0.08) * np.sign(np.cos(t)) * np.abs(np.cos(t)) ** 0.8
    low = np.interp(np.linspace(0, 1, 31), [0, 1], ends[:, 1])
    return sitter.at(x, low - (low + high) * np.abs(np.sin(t)) ** 0.8)


def tail(begin: Points, end: Points, half: float, sitter: Sitter, bow: float) -> Patch:
    """A strip of cloth that hangs from a knot and widens, `half` and `bow` in units."""
    middle = (begin + end) / 2 + bow * sitter.unit * sitter.right
    line = smooth(np.stack([begin, middle, end]), 15)
    away = (0.3 + 0.7 * np.linspace(0, 1, 15))[:, None] * half * sitter.unit * sitter.right
    return Patch(line - away, line + away)
