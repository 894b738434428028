"""Open mouths as portraits have them: teeth that are hardly drawn, and slight openings.

White teeth have lips, dark corners or a few lines of their own, and those that do not meet end
above something dark: nothing that could as well be shut lips is drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .lips import below, borders, hairs, overgrown, shine, tone
from .patches import Patch
from .shapes import Points, part
from .sitter import Sitter

if TYPE_CHECKING:
    from .mouth import Mouth

CLOSE = 2.4  # pen's widths between rims, below which the pen that draws them is thinner
SMALL = 5.0  # pixels of the tallest opening, below which there are no teeth in it


def draw_parted(canvas: Canvas, sitter: Sitter, artist: Artist, mouth: Mouth) -> None:
    """An open mouth by `artist.teeth`, with lips by `artist.lips`."""
    rng, how = canvas.rng, artist.teeth
    over, under = overgrown(canvas, artist)
    gap = (mouth.lower - mouth.upper) @ sitter.down
    tall = float(gap.max())
    bold = float(np.clip(tall / (CLOSE * canvas.pen), 0.4, 1.0))
    canvas.line("mouth", mouth.upper, bold * rng.uniform(0.9, 1.3))
    whole = rng.random() < 0.8
    low = mouth.lower if whole else part(mouth.lower, 0.06, 0.94)
    canvas.line("mouth", low, bold * rng.uniform(0.7, 1.1))
    if tall < SMALL or how == "sliver":
        _sliver(canvas, mouth, sitter, tall)
        marked = not mouth.clenched
    else:
        marked = _teeth(canvas, sitter, mouth, how, tall, bold)
    bare = artist.lips == "line" and marked
    if not bare:
        _around(canvas, artist, mouth, over, under, marked)
    canvas.cover(mouth.hole())
    if rng.random() < 0.45:
        below(canvas, sitter, mouth)
    hairs(canvas, sitter, mouth, mouth.upper, mouth.lower, over, under)


def _around(
    canvas: Canvas, artist: Artist, mouth: Mouth, over: bool, under: bool, marked: bool
) -> None:
    """The lips of an open mouth. marked : whether what is inside tells that it is open"""
    rng, how = canvas.rng, artist.lips
    upper, lower = Patch(mouth.upper, mouth.outer_upper), Patch(mouth.lower, mouth.outer_lower)
    angle = float(rng.choice([0.7, 2.3, 1.4]) + rng.normal(0, 0.2))
    stroke = str(rng.choice(["drag", "slant", "across"], p=(0.25, 0.35, 0.4)))
    if not over:
        if how in ("dark", "upper", "wedge"):
            shape = upper.strip((0, rng.uniform(0.5, 1)), (0, rng.uniform(0.5, 1)), 0.0)
            if rng.random() < 0.4:
                canvas.fill(shape.outline)
            else:
                tone(canvas, shape, stroke, angle, rng.uniform(0.9, 1.4), 1.0)
        elif how == "shaded":
            tone(canvas, upper, stroke, angle, rng.uniform(0.4, 1.0), rng.uniform(0.5, 1.0))
    if not under and how in ("shaded", "dark"):
        dark = rng.uniform(0.4, 0.9)
        tone(canvas, lower, stroke, angle, rng.uniform(0.2, 0.8), dark, shine(rng))
    share = 0.6 if how in ("dark", "upper", "shaded") else 0.9
    borders(canvas, mouth, how, share if marked else 1.0, over, under)


def _sliver(canvas: Canvas, mouth: Mouth, sitter: Sitter, tall: float) -> None:
    """A dark opening, or a bit of teeth between its dark ends."""
    rng = canvas.rng
    if mouth.clenched:
        _dark_ends(canvas, mouth)
    elif tall > SMALL and rng.random() < 0.5:
        edge = _edge(mouth, sitter, rng.uniform(0.3, 0.55))
        canvas.line("mouth", part(edge, 0.12, 0.88), 0.6)
        _hollow(canvas, edge, mouth.lower)
    elif tall > CLOSE * canvas.pen and rng.random() < 0.3:
        _hollow(canvas, mouth.upper, mouth.lower)
    else:
        canvas.fill(mouth.hole())


def _teeth(
    canvas: Canvas, sitter: Sitter, mouth: Mouth, how: str, tall: float, bold: float
) -> bool:
    """Teeth that are hardly drawn; whether anything tells that the mouth is open.

    Those that do not meet end above something dark.
    """
    rng = canvas.rng
    foot, marked = mouth.lower, False
    if not mouth.clenched:
        foot = _edge(mouth, sitter, rng.uniform(*((0.4, 0.7) if how == "edge" else (0.3, 0.78))))
        canvas.line("mouth", part(foot, 0.05, 0.95), 0.8 * bold)
        _hollow(canvas, foot, mouth.lower, black=how == "grey")
        marked = True
    elif how in ("edge", "gums") or how == "grey" and rng.random() < 0.5:
        foot = _edge(mouth, sitter, rng.uniform(0.72, 0.92))
        a, b = rng.uniform(0.02, 0.2, 2)
        canvas.line("mouth", part(foot, a, 1 - b), 0.75 * bold, rng.uniform(0.6, 1.0))
    if how == "grey":
        _greyed(canvas, mouth.upper, foot)
    if how == "gums":
        # In arcs, one over each tooth.
        t = np.linspace(0.1, 0.9, 49)
        height = rng.uniform(0.1, 0.22) - 0.07 * np.abs(np.sin(np.linspace(0, 6 * np.pi, 49)))
        canvas.line("mouth", Patch(mouth.upper, foot).at(t, height), 0.6 * bold, 0.8)
    if how == "ticks":
        count = int(rng.integers(2, 6))
        t = np.sort(rng.uniform(0.22, 0.78, count))
        _gaps(canvas, mouth.upper, foot, t, (0.15, 0.5), bold)
    elif how != "edge":
        count = int(rng.choice([0, 0, 0, 2, 4, 6, 8]))
        t = 0.5 + 0.4 * np.sin(np.linspace(-1.2, 1.2, count)) + rng.normal(0, 0.015, count)
        _gaps(canvas, mouth.upper, foot, t, (0.3, 0.95), bold)
        marked = marked or count > 0
    if not marked or rng.random() < 0.45:
        _dark_ends(canvas, mouth)
    return marked or how == "ticks"


def _gaps(
    canvas: Canvas, upper: Points, lower: Points, t: NDArray, long: tuple[float, float], bold: float
) -> None:
    """Faint lines between teeth that begin above and do not go all the way, at shares t (k,)."""
    rng, soft = canvas.rng, canvas.rng.uniform(0.4, 1.0)
    rows = Patch(upper, lower)
    for at in np.clip(t, 0.03, 0.97):
        begin = rng.uniform(0, 0.15)
        ups = np.linspace(begin, begin + rng.uniform(*long) * (1 - begin), 4)
        canvas.line("mouth", rows.at(at + 0.01 * rng.normal() * ups, ups), 0.6 * bold, soft,
                    loose=0.4)  # fmt: skip


def _dark_ends(canvas: Canvas, mouth: Mouth) -> None:
    """The corners of an open mouth, where it is dark beside the teeth."""
    rng = canvas.rng
    solid = rng.random() < 0.6
    for way in (0, 1):
        k = int(rng.uniform(0.07, 0.17) * len(mouth.upper)) + 2
        own = slice(None, k) if way == 0 else slice(-k, None)
        top, low = mouth.upper[own], mouth.lower[own]
        tip = 0.5 * (top[-1 if way == 0 else 0] + low[-1 if way == 0 else 0])
        inner = top[-3 if way == 0 else 2] if k > 3 else tip
        shape = np.concatenate([top, (0.6 * tip + 0.4 * inner)[None], low[::-1]] if way == 0 else
                               [top, low[::-1], (0.6 * tip + 0.4 * inner)[None]])  # fmt: skip
        if solid:
            canvas.fill(shape)
        else:
            canvas.blacken(shape, rng.uniform(0.5, 2.6), 1.1, "hatch", 0.9)


def _hollow(canvas: Canvas, upper: Points, lower: Points, black: bool = False) -> None:
    """What is dark under teeth: black, or hatched."""
    rng, shape = canvas.rng, np.concatenate([upper, lower[::-1]])
    if black or rng.random() < 0.6:
        canvas.fill(shape)
    else:
        canvas.blacken(shape, rng.uniform(0, np.pi), rng.uniform(1.0, 1.15), "hatch", 1.0)


def _greyed(canvas: Canvas, upper: Points, lower: Points) -> None:
    """Tone on teeth, from the corners inward."""
    rng, rows = canvas.rng, Patch(upper, lower)
    angle, dark = rng.uniform(0.3, 2.8), rng.uniform(0.25, 0.6)
    inside = canvas.area(rows.outline)
    t, half = np.linspace(0, 2 * np.pi, 24), rng.uniform(0.2, 0.4)
    inside = inside & ~canvas.area(rows.at(0.5 + half * np.cos(t), 0.5 + 0.7 * np.sin(t)))
    canvas.blacken(rows.outline, angle, rng.uniform(1.2, 2.0), "hatch", dark, area=inside)


def _edge(mouth: Mouth, sitter: Sitter, share: float) -> Points:
    """The lower edge of the teeth, a share of the way down, flatter than the lower lip."""
    gap = (mouth.lower - mouth.upper) @ sitter.down
    flat = np.minimum(share * gap.max(), np.maximum(share, 0.9) * gap)
    return mouth.upper + flat[:, None] * sitter.down
