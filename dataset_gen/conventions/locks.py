"""Hair in locks, as artists with pencil and pen draw it: leaf-shaped clumps that follow the flow.

A lock is a strip of a sheet (`flow`), bounded by two lines along it and filled with strokes that
follow them, dark at its root, below and toward its tip, and blank where it shines. Locks in front
are drawn first and hide those behind; what is between them lies in shade. How dark it all is, the
artist's `hair_tone` says: from lines alone to black in which thin streaks stay white.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .cut import GATHERED, LONG, STEPS, Hair
from .flow import ALONG, STRANDS, mix, on_sheet, sheets_of
from .patches import ticks
from .shapes import Points, even, normals, part, ribbon, smooth, wave
from .sitter import Sitter

CLIPPED = ("short", "quiff", "crop", "flat", "swept", "fringe")  # cuts whose sides may be shaved
SHAVED = 0.25  # how often they are
SLENDER = (5.0, 14.0)  # how many times as long as wide locks are
# `hair_tone` from which locks are shaded, and are black, and all between them is.
HALF, DARK, SOLID = 0.3, 0.7, 0.84
MOST = 16  # strokes in a lock
FINEST = 2.2  # pixels: locks are at least so wide to have strokes in them


def draw_locks(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """The mass of the hair in locks, with its sides shaved by lot."""
    rng = canvas.rng
    pieces = [hair]
    if artist.cut in CLIPPED and not artist.crowned and rng.random() < SHAVED:
        low, high = rng.uniform(0.14, 0.26), rng.uniform(0.74, 0.86)
        for begin, end in ((0.0, low), (high, 1.0)):
            _shave(canvas, sitter, artist, hair.between(begin, end))
        pieces = [hair.between(low, high)]
    for piece in pieces:
        sheets = sheets_of(canvas, artist, piece)
        if artist.cut in LONG or rng.random() < 0.4:
            _apart(canvas, sitter, sheets)
        for sheet in sheets:
            _fill(canvas, artist, sheet)
        _between(canvas, artist, piece.shape(), sheets)
        _contour(canvas, sitter, artist, piece)


def draw_strip(canvas: Canvas, artist: Artist, left: Points, right: Points) -> None:
    """Locks between two lines (k, 2) that run from their roots to their tips."""
    share = np.linspace(0, 1, STRANDS)[:, None, None]
    left, right = even(left, ALONG), even(right, ALONG)
    sheet = left + share * (right - left)
    _fill(canvas, artist, sheet)
    _between(canvas, artist, np.concatenate([left, right[::-1]]), [sheet])


def draw_fringe(canvas: Canvas, artist: Artist, tops: Points, hem: Points) -> None:
    """Locks that hang over the forehead, from their roots (k, 2) to a hem (k, 2) in points."""
    rng = canvas.rng
    at = np.linspace(0, len(tops) - 1, 2 * STRANDS).round().astype(int)
    t = np.linspace(0, 1, ALONG)[None, :, None]
    k = np.flatnonzero(_peaks(hem - tops))
    tips = k / (len(hem) - 1)
    # Locks are as long as at their tips all over, what is between them ends at the hem.
    size = np.hypot(*(hem - tops).T)
    longest = np.interp(np.arange(len(hem)), k, size[k]) if len(k) else size
    low = tops + (longest / np.maximum(size, 1e-6))[:, None] * (hem - tops)
    # They leave their roots to the side before they fall.
    bow = t ** rng.uniform([0.65, 1.0], [1.0, 1.5])
    sheet, all_of = (tops[at][:, None] + bow * (line - tops)[at][:, None] for line in (low, hem))
    light = (rng.uniform(0.25, 0.6), rng.uniform(0.05, 0.2))
    half, lean = 0.5 / max(len(tips), 4), rng.normal(0, 0.04)
    for tip in rng.permutation(tips).tolist():
        begin = rng.uniform(0, 0.15)
        _lock(canvas, artist, sheet, tip, half, (begin, 1.0), lean * rng.random(), light, 0.6)
    _between(canvas, artist, np.concatenate([tops, hem[::-1]]), [all_of])


def draw_forelocks(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair, low: float) -> None:
    """Some locks that fall over the forehead to one side; low : units, how far down they may."""
    rng = canvas.rng
    way = float(rng.choice([-1, 1]))
    root = STEPS * (0.5 + 0.35 * artist.parting) + rng.normal(0, 3)
    far, bow = rng.uniform(0.1, 0.55), rng.uniform(-0.1, 0.25)
    x = np.linspace(0, 1, 16)
    half = max(0.045 * sitter.unit, 1.5 * canvas.pen)  # a bold pen draws few and broad ones
    for _ in range(int(rng.integers(1, max(3, int(0.27 * sitter.unit / half))))):
        k = np.array([np.clip(root + rng.normal(0, 2.5), 8, STEPS - 9)])
        u, v = sitter.local(mix(hair, k, np.array([rng.uniform(0, 0.2)]))[0])
        across, down = way * far * rng.uniform(0.6, 1.2), (low - v) * rng.uniform(0.3, 0.95)
        line = sitter.at(u + across * x, v + down * x**1.6 - bow * np.sin(np.pi * x) * abs(across))
        away = rng.uniform(0.6, 1.3) * half * normals(line)
        share = np.linspace(-1, 1, 4)[:, None, None]
        light = (rng.uniform(0.3, 0.6), 0.12)
        canvas.mark("hair", _lock(canvas, artist, line + share * away, 0.5, 0.5, (0.0, 1.0),
                                  0.2 * float(rng.normal()), light, 0.7))  # fmt: skip


def roots(canvas: Canvas, hair: Hair, tops: Points) -> Points:
    """Where a fringe that hangs from the crown begins, above its place at the hairline (k, 2)."""
    rng = canvas.rng
    up, gathered = rng.uniform(0.1, 0.85), rng.uniform(0.5, 1.0)
    first = int(np.hypot(*(hair.inner - tops[0]).T).argmin())
    last = int(np.hypot(*(hair.inner - tops[-1]).T).argmin())
    k = np.linspace(first, last, len(tops))
    middle = (first + last) / 2
    arch = up * (1 - 0.6 * np.linspace(-1, 1, len(tops)) ** 2)
    return mix(hair, middle + gathered * (k - middle), arch)


def pointed(canvas: Canvas, sitter: Sitter, artist: Artist, tops: Points, hem: Points) -> Points:
    """The hem (k, 2) of a fringe in wedges: as low as it was at their tips, higher between them;
    by lot the fringe is combed from the parting to one side, where it hangs lower."""
    rng = canvas.rng
    k = np.arange(len(hem))
    if rng.random() < 0.5:
        way = -np.sign(artist.parting) or 1.0
        aside = np.linspace(0, 1, len(hem))[:: int(way)]
        size = rng.uniform(0.3, 0.8) + rng.uniform(0.2, 0.7) * aside
        hem = tops + size[:, None] * (hem - tops)
        hem = hem + way * rng.uniform(0.05, 0.3) * sitter.unit * sitter.right
    wide = rng.uniform(0.06, 0.18)
    tips = np.cumsum(rng.uniform(0.6, 1.5, 60) * wide * len(hem)) - rng.uniform(0, wide * len(hem))
    notch = rng.uniform(0.3, 0.75)
    tips = tips[tips < 1.2 * len(hem)]
    deep = rng.uniform(0.8, 1.1, len(tips))
    near = np.abs(k[:, None] - tips).argmin(axis=1)
    away = np.abs(k - tips[near]) / (0.75 * wide * len(hem))
    share = deep[near] * (1 - (1 - notch) * np.clip(away, 0, 1) ** 0.8)
    return tops + share[:, None] * (hem - tops)


def _peaks(down: Points) -> NDArray[np.bool_]:
    """(k,) where something hangs lower than on either side."""
    size = np.hypot(*down.T)
    return (size >= np.roll(size, 1)) & (size > np.roll(size, -1))


def _fill(canvas: Canvas, artist: Artist, sheet: NDArray) -> None:
    """Locks all over a sheet: those of the front row first, then those behind."""
    rng = canvas.rng
    length = np.hypot(*np.diff(sheet[len(sheet) // 2], axis=0).T).sum()
    width = np.hypot(*np.diff(sheet[:, ALONG // 2], axis=0).T).sum()
    slender = rng.uniform(*SLENDER)
    count = int(np.clip(width / max(length / slender * 2, FINEST * canvas.pen), 4, 20))
    light = (rng.uniform(0.25, 0.65), rng.uniform(0.04, 0.22) * (rng.random() < 0.85))
    band = 0.1 * wave(rng, 1, 64, 1.5)[0]  # how it runs from strand to strand
    root = rng.uniform(0.2, 0.9)
    stick = rng.uniform(0.0, 0.14) if artist.cut not in (*GATHERED, "rim") else 0.0
    curl = rng.normal(0, 0.6) / count
    for row, (low, high) in enumerate(((0.0, 0.22), (0.25, 0.6))):
        many = count if row == 0 else int(count * rng.uniform(0.3, 0.9))
        for k in rng.permutation(many).tolist():
            s = (k + rng.uniform(0.1, 0.9)) / many
            half = rng.uniform(0.35, 0.75) / count
            begin = rng.uniform(low, high) * (rng.random() < 0.6 or row)
            end = rng.uniform((0.65, 0.85)[row], 1.0) + stick * rng.uniform(0, 1)
            shine = (light[0] + band[int(63 * np.clip(s, 0, 1))], light[1])
            bend = curl + 0.5 * rng.normal() / count
            _lock(canvas, artist, sheet, s, half, (begin, end), bend, shine, root)


def _lock(
    canvas: Canvas,
    artist: Artist,
    sheet: NDArray,
    s: float,
    half: float,
    span: tuple[float, float],
    bend: float,
    light: tuple[float, float],
    root: float,
) -> Points:
    """One lock about the strand s of a sheet: its outline (k, 2), where it hides what is behind.

    half : its half-width, of the sheet's        span : of t        bend : how far its tip turns
    light : t of the middle of what shines, and half of how much does        root : its width there,
    of its full one
    """
    rng, tone = canvas.rng, artist.hair_tone
    x = np.linspace(0, 1, 18)
    t = span[0] + (span[1] - span[0]) * x
    leaf = np.interp(x, [0, 0.2, 0.5, 0.8, 1], [root, 0.6 + 0.4 * root, 1, 0.6, 0.03])
    sway = 0.7 if artist.cut in LONG else 0.25
    middle = s + bend * x**2 + sway * half * rng.normal() * np.sin(2 * np.pi * x)
    left, right = (on_sheet(sheet, middle + side * half * leaf, t) for side in (-1, 1))
    across = float(np.hypot(*(right - left)[4:12].T).mean())
    for side in (left, right):
        if rng.random() < (0.9 if tone < DARK else 0.4):
            a, b = rng.uniform(0, 0.25), rng.uniform(0.75, 1)
            line = part(side, a, b)
            strong = np.interp(np.linspace(0, 1, len(line)), [0, 0.3, 0.7, 1], [0.6, 1, 0.9, 0.4])
            canvas.line("hair", line, float(rng.uniform(0.7, 1.2)), strong, loose=0.3)
    if across > FINEST:
        _strokes(canvas, sheet, middle, half * leaf, t, across, light, tone)
    outline = np.concatenate([left, right[::-1]])
    canvas.cover(outline)
    return outline


def _strokes(
    canvas: Canvas,
    sheet: NDArray,
    middle: NDArray,
    half: NDArray,
    t: NDArray,
    across: float,
    light: tuple[float, float],
    tone: float,
) -> None:
    """What fills a lock: strokes from its root and from its tip that run out where it shines."""
    rng = canvas.rng
    black = tone > DARK
    wide = rng.uniform(1.2, 2.0) if black else rng.uniform(0.6, 1.0)
    gap = np.interp(tone, [0, HALF, DARK, 1], [8.0, 2.7, 1.3, 1.05]) * rng.uniform(0.9, 1.4)
    count = int(np.clip(across / (gap * wide * canvas.pen), 1, MOST))
    if black:  # a wide lock's strokes are wide
        wide = float(np.clip(across / (count * gap * canvas.pen), wide, 3.0))
    # Closer together at the shaded side.
    u = 2 * ((np.arange(count) + rng.uniform(0.2, 0.8, count)) / count) ** 1.25 - 1
    lines = on_sheet(sheet, middle + 0.92 * u[:, None] * half, t + np.zeros((count, 1)))
    whole = rng.random(count) < np.interp(tone, [0, HALF, DARK, 1], [0.3, 0.15, 0.3, 0.6])
    size = len(t) - 1
    span = max(t[-1] - t[0], 1e-6)
    for line, all_of in zip(lines, whole.tolist(), strict=True):
        low, high = ((light[0] + way * light[1] - t[0]) / span for way in (-1, 1))
        low, high = low + rng.normal(0, 0.06), high + rng.normal(0, 0.06)
        if all_of or light[1] == 0:
            a, b = rng.uniform(0, 0.12), rng.uniform(0.7, 1.0)
            pieces = [(a, b, (0.7, 1.0, 0.5))]
        else:
            pieces = [(rng.uniform(0, 0.06), low, (1.0, 0.9, 0.2)),
                      (high, rng.uniform(0.85, 1.0), (0.2, 0.9, 0.6))]  # fmt: skip
        for a, b, strong in pieces:
            i, j = int(np.clip(a, 0, 1) * size), int(np.ceil(np.clip(b, 0, 1) * size)) + 1
            if j - i > 3:
                strength = np.interp(np.linspace(0, 1, j - i), [0, 0.5, 1], strong)
                canvas.line("hair", line[i:j], wide, strength, loose=0.3)


def _between(canvas: Canvas, artist: Artist, outline: Points, sheets: list[NDArray]) -> None:
    """What no lock hides lies in shade: black, strokes along the flow, or a few of them."""
    rng, tone = canvas.rng, artist.hair_tone
    if tone > SOLID:
        canvas.blacken(outline, float(rng.uniform(1.3, 1.8)))
    wide, gap = (2.4, 1.9) if tone > DARK else (0.9, np.interp(tone, [0, HALF, DARK], [12, 3.5, 2]))
    late = 0.05 if tone > DARK else 0.3
    for sheet in sheets:
        width = np.hypot(*np.diff(sheet[:, ALONG // 2], axis=0).T).sum()
        count = int(np.clip(width / (gap * canvas.pen), 2, 60))
        s = (np.arange(count) + rng.uniform(0, 1, count)) / count
        a, b = rng.uniform(0, late, (count, 1)), rng.uniform(0.95 - late, 1.0, (count, 1))
        lines = on_sheet(sheet, s[:, None], a + (b - a) * np.linspace(0, 1, 20))
        for line in lines:
            canvas.line("hair", line, wide, np.linspace(1, 0.5, 20), loose=0.3)


def _apart(canvas: Canvas, sitter: Sitter, sheets: list[NDArray]) -> None:
    """Single strands that cross the others or hang apart."""
    rng = canvas.rng
    x = np.linspace(0, 1, 24)
    for sheet in sheets:
        for _ in range(int(rng.integers(0, 5))):
            a, b = rng.uniform(0.0, 0.5), rng.uniform(0.8, 1.12)
            s = rng.uniform(0, 1) + rng.normal(0, 0.12) * x + 0.05 * wave(rng, 1, 24, 0.7)[0]
            line = on_sheet(sheet, np.clip(s, -0.04, 1.08), a + (b - a) * x)
            canvas.line("hair", line, float(rng.uniform(0.6, 1.0)), np.linspace(1, 0.3, 24))


def _contour(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """The outline of the whole: none, pieces of it, or all."""
    rng = canvas.rng
    how = rng.random()
    if how < 0.35:
        return
    lines = [hair.outer, *(fall[0] for fall in hair.falls if fall)]
    for line in lines:
        line = smooth(line, 60) + 0.008 * sitter.unit * wave(rng, 2, 60, 3).T
        width = float(rng.uniform(0.7, 1.1))
        if how > 0.75:
            canvas.line("hair", line, width)
            continue
        at = 0.0
        while at < 0.95:
            end = at + rng.uniform(0.08, 0.35)
            piece = part(line, at, min(end, 1.0))
            canvas.line("hair", piece, width, np.linspace(1, 0.5, len(piece)), loose=0.5)
            at = end + rng.uniform(0.03, 0.2)


def _shave(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """A side that is clipped short: ticks or hatching, lighter than the top, or black with lines
    shaved into it."""
    rng = canvas.rng
    if artist.hair_tone > DARK and rng.random() < 0.35:
        for _ in range(int(rng.integers(1, 3))):
            at = rng.uniform(0.15, 0.85)
            k = STEPS * (at + np.array([-0.12, 0.0, rng.uniform(-0.15, 0.15)]))
            line = mix(hair, k, np.array([0.0, rng.uniform(0.3, 0.7), 1.0]))
            canvas.cover(ribbon(line, max(0.012 * sitter.unit, 0.8 * canvas.pen)))
        canvas.blacken(hair.shape(), 1.2)
        return
    lean = float(rng.uniform(0.8, 2.3))
    if rng.random() < 0.4:
        canvas.blacken(hair.shape(), lean, float(rng.uniform(1.6, 3.0)), "hair", 0.7)
    else:
        count = int(rng.integers(50, 160))
        k, depth = rng.uniform(0, STEPS - 1, count), rng.uniform(0.02, 0.98, count)
        size = sitter.unit * rng.uniform(0.015, 0.05) * rng.uniform(0.6, 1.4, (count, 1))
        ways = np.maximum(size, 1.5) * np.array([np.cos(lean), np.sin(lean)])
        ticks(canvas, "hair", mix(hair, k, depth), ways, 0.8, rng.uniform(0.5, 1.0, count))
    canvas.line("hair", hair.outer, 0.8, 0.8)
