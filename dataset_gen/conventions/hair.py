"""Hair by an artist's conventions: where it lies is the cut, how it is drawn is the finish."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .curls import draw_curls
from .cut import GATHERED, LONG, STEPS, Hair
from .flow import mix
from .locks import draw_forelocks, draw_fringe, draw_locks, draw_strip, pointed, roots
from .shapes import ellipse, normals, part, ribbon, smooth, wave
from .shorn import draw_shorn, is_shorn, shaven
from .sitter import Sitter

# Cuts of which locks may fall over the forehead, and of which some are combed to it.
LOOSE = ("short", "swept", "quiff", "long", "bob", "bun", "tail")
CROPPED = ("short", "crop", "flat")


def draw_hair(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """The mass of the hair, in front of what it hides."""
    cut = artist.cut
    if cut == "bald":
        return
    if cut == "bun":
        _bun(canvas, sitter, artist)
    elif cut == "tail":
        _tail(canvas, sitter, artist, hair)
    for piece in (hair.between(0, 0.46), hair.between(0.54, 1)) if cut == "rim" else (hair,):
        if cut == "shorn":
            piece = shaven(canvas, sitter, piece)
        _finished(canvas, sitter, artist, piece)
        canvas.mark("hair", piece.shape())
        canvas.cover(piece.shape())


def _finished(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """What is seen of it: curls, black, hatching, locks, or its edges alone."""
    cut, finish = artist.cut, artist.finish
    if is_shorn(canvas, artist):
        draw_shorn(canvas, sitter, artist, hair)
    elif finish == "curls" or cut == "afro":
        draw_curls(canvas, sitter, artist, hair)
    elif finish == "black":
        _shine(canvas, sitter, hair)
        canvas.blacken(hair.shape(), float(canvas.rng.uniform(-1.4, 1.4)))
        _edges(canvas, sitter, artist, hair, 1.0)
    elif finish == "hatch":
        lean = float(canvas.rng.uniform(0.9, 2.2))
        canvas.blacken(hair.shape(), lean, float(canvas.rng.uniform(1.7, 3.2)), "hair")
        _edges(canvas, sitter, artist, hair, 1.0)
    elif finish == "locks":
        draw_locks(canvas, sitter, artist, hair)
    elif finish == "strands":
        many = (25, 75) if canvas.rng.random() < 0.4 else (80, 190)
        _strands(canvas, sitter, artist, hair, int(canvas.rng.integers(*many)))
        if canvas.rng.random() < 0.7:
            _edges(canvas, sitter, artist, hair, 0.8)
    else:
        _edges(canvas, sitter, artist, hair, 1.1)
        if canvas.rng.random() < 0.6:
            _strands(canvas, sitter, artist, hair, int(canvas.rng.integers(2, 8)))


def _edges(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair, width: float) -> None:
    """The lines around the hair: smooth, wavy, or in tufts."""
    rng = canvas.rng
    size = sitter.unit * (0.05 if artist.cut == "tufts" else rng.choice([0.0, 0.0, 0.012, 0.025]))
    teeth = float(rng.uniform(14, 26))
    outline = hair.outer
    if size:
        t = np.linspace(0, 1, 160)
        outline = smooth(outline, 160)
        saw = (
            np.abs(((t * teeth) % 1) - 0.3)
            if artist.cut == "tufts"
            else np.sin(2 * np.pi * teeth * 0.5 * t)
        )
        middle = hair.inner.mean(axis=0)
        away = outline - middle
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
        outline = outline + size * saw[:, None] * away
    canvas.line("hair", outline, width)
    inner = smooth(hair.inner[:: int(rng.integers(2, 5))], 48)
    if size:
        ripple = wave(rng, 1, 48, teeth / 8)[0][:, None]
        inner = inner + 0.5 * size * ripple * sitter.down
    canvas.line("hair", inner, 0.9 * width)
    for fall, tips in zip(hair.falls, hair.tips, strict=False):
        if fall:
            canvas.line("hair", fall[0], width)
            canvas.line("hair", fall[1], 0.9 * width)
            canvas.line("hair", tips, 0.8 * width)


def _strands(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair, count: int) -> None:
    """Lines along the hair in locks: from the parting over the head and down, or combed back."""
    rng = canvas.rng
    combed = artist.cut in (*LONG, *GATHERED) or (
        artist.cut in ("swept", "fringe") and rng.random() < 0.5
    )
    t = np.linspace(0, 1, 20)
    root = float(np.clip(0.5 + 0.42 * artist.parting, 0.1, 0.9)) * (STEPS - 1)
    wavy = sitter.unit * rng.choice([0.0, 0.01, 0.025, 0.05, 0.08])
    lean, spread = rng.uniform(-7, 7), rng.uniform(0.02, 0.12)
    lift = rng.uniform(0.0, 0.3)
    lean_out, wide = rng.uniform(-0.15, 0.35), rng.uniform(1.0, 2.0)
    while count > 0:
        size = min(int(rng.integers(1, 12)), count)
        count -= size
        share = rng.random() + spread * rng.normal(size=(size, 1))
        share = np.clip(share, -0.02, 1.04)
        if combed:
            side = 1 if rng.random() < 1 - root / STEPS else 0
            k = root + ((STEPS - 1) * side - root) * t**0.85
            # It rises from the parting before it lies down at the side.
            depth = share + lift * (1 - share) * np.sin(np.pi * t**0.6)
            lines = mix(hair, k + np.zeros((size, 1)), depth + lean_out * share * t * (1 - t))
            fall = hair.falls[side]
            if fall:
                hanging = fall[1] + share[:, :, None] * (fall[0] - fall[1])
                lines = np.concatenate([lines, hanging], axis=1)
        else:
            k = rng.uniform(0, STEPS - 1) + 40 * spread * rng.normal(size=(size, 1)) + lean * t
            lines = mix(hair, np.clip(k, 0, STEPS - 1), t * rng.uniform(0.85, 1.06, (size, 1)))
        steps = lines.shape[1]
        lines += (wavy * wave(rng, 1, steps, 1.2)[0])[:, None] * sitter.right
        begin = rng.uniform(0, 0.5) if rng.random() < 0.6 else 0.0
        first = (steps * np.clip(begin + rng.uniform(-0.05, 0.05, size), 0, 1)).astype(int)
        stop = first + (steps * (1 - begin) * rng.uniform(0.35, 1.1, size)).astype(int)
        width, faint = rng.uniform(0.6, wide, size), rng.uniform(0.3, 1, size)
        for line, a, b, w, f in zip(lines, first, stop, width, faint, strict=True):
            piece = line[a : max(b, a + 4)]
            canvas.line("hair", piece, float(w), np.linspace(1, f, len(piece)), loose=0.4)


def _shine(canvas: Canvas, sitter: Sitter, hair: Hair) -> None:
    """Bands of light that stay white in black hair."""
    for _ in range(int(canvas.rng.integers(0, 5))):
        k = canvas.rng.uniform(6, STEPS - 12) + np.linspace(0, canvas.rng.uniform(3, 8), 12)
        depth = canvas.rng.uniform(0.3, 0.7)
        half = canvas.rng.uniform(0.03, 0.09) * np.sin(np.linspace(0, np.pi, 12))
        band = [mix(hair, k, depth + half), mix(hair, k, depth - half)[::-1]]
        canvas.cover(np.concatenate(band))


def _tail(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """A ponytail that hangs beside the neck from behind the head, or two."""
    rng = canvas.rng
    sides = (-1, 1) if rng.random() < 0.3 else (int(rng.choice([-1, 1])),)
    for side in sides:
        out, half = rng.uniform(0.02, 0.4), rng.uniform(0.06, 0.2)
        end, swing = rng.uniform(0.9, 2.0), rng.normal(0, 0.12)
        k = 0 if side < 0 else -1
        root = hair.outer[rng.integers(0, 6) if side < 0 else -1 - rng.integers(0, 6)]
        low = sitter.local(hair.outer[k])[0] + side * (out + half)
        x, y = sitter.local(root)
        knots = sitter.at(
            np.array([x, low + side * 0.1, low, low + side * swing]),
            np.array([y, max(y, 0.1) + 0.1 * (end - y), 0.6 * end + 0.2, end]),
        )
        line = smooth(knots, 24)
        t = np.linspace(0, 1, 24)
        thick = half * sitter.unit * (0.35 + np.sin(np.pi * t**0.7) ** 0.8)
        shape = ribbon(line, thick * np.clip(4 * (1 - t), 0.05, 1))
        if artist.finish == "black":
            canvas.blacken(shape, 1.4)
        elif artist.finish == "locks":
            away = thick[:, None] * normals(line) * np.clip(4 * (1 - t), 0.05, 1)[:, None]
            draw_strip(canvas, artist, line - away, line + away)
        else:
            for _ in range(int(rng.integers(2, 4) if artist.finish == "outline" else
                               rng.integers(8, 30))):  # fmt: skip
                off = rng.uniform(-0.95, 0.95) * thick[:, None] * normals(line)
                a, b = sorted(rng.uniform(0, 1, 2))
                canvas.line("hair", part(line + off, a, min(b + 0.2, 1.0)), 0.7, loose=0.4)
        canvas.line("hair", shape, 1.0)
        canvas.mark("hair", shape)
        canvas.cover(shape)


def _bun(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """A knot on top of the head, or behind it."""
    rng = canvas.rng
    top = sitter.local(sitter.head).min(axis=0)[1]
    place = sitter.at(sitter.local(sitter.head).mean(axis=0)[0] + rng.normal(0, 0.15), top - 0.1)
    r = sitter.unit * rng.uniform(0.2, 0.34)
    ball = ellipse(place, r, 0.85 * r, rng.normal(0, 0.2), 33)
    if artist.finish == "black":
        canvas.blacken(ball, 0.4)
    canvas.mark("hair", ball)
    canvas.line("hair", ball, 1.0)
    if artist.finish == "locks":
        around = np.roll(ball[:-1], -int(rng.integers(0, 32)), axis=0)
        draw_strip(canvas, artist, around[:17], np.roll(around[::-1], 1, axis=0)[:17])
    for _ in range(int(rng.integers(0, 5))):
        begin = int(rng.integers(0, 18))
        shrink = np.linspace(0.9, 0.4, 14)[:, None]
        canvas.line("hair", place + (ball[begin : begin + 14] - place) * shrink, 0.7)
    canvas.cover(ball)


def draw_front(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """A fringe, which hides the forehead and perhaps the brows' tops."""
    rng, locks = canvas.rng, artist.finish == "locks"
    brow = sitter.local(np.stack([sitter.mark(f"brow_peak_{s}") for s in ("left", "right")]))[
        :, 1
    ].mean()
    if locks and artist.cut in LOOSE and rng.random() < 0.3:
        draw_forelocks(canvas, sitter, artist, hair, brow - 0.02)
    cropped = locks and artist.cut in CROPPED and rng.random() < 0.25
    if not cropped and artist.cut != "fringe" and not (artist.cut in LONG and rng.random() < 0.3):
        return
    low = rng.uniform(0.08, 0.3) if cropped else rng.uniform(0.35, 1.0 if locks else 0.8)
    inner = smooth(hair.inner, STEPS)
    local = sitter.local(inner)
    near = np.abs(local[:, 0] - local[:, 0].mean()) < 0.62
    tops = inner[near]
    if len(tops) < 6:
        return
    part_at = rng.uniform(0.2, 0.8)
    t = np.linspace(0, 1, len(tops))
    down = (brow - 0.04 - sitter.local(tops)[:, 1]) * low
    down = down * (1 - 0.7 * np.exp(-((t - part_at) ** 2) / 0.01) * (rng.random() < 0.5))
    hem = tops + (np.maximum(down, 0.03) * sitter.unit)[:, None] * sitter.down
    saw = 0.03 * sitter.unit * np.abs(wave(rng, 1, len(hem), 4)[0])
    hem = hem + saw[:, None] * sitter.down
    if locks:
        hem, tops = pointed(canvas, sitter, artist, tops, hem), roots(canvas, hair, tops)
    shape = np.concatenate([tops, hem[::-1]])
    if artist.finish == "black":
        canvas.blacken(shape, 1.3)
        canvas.line("hair", hem, 0.9)
    elif locks:
        draw_fringe(canvas, artist, tops, hem)
    elif artist.finish in ("strands", "hatch"):
        for _ in range(int(rng.integers(10, 30))):
            k = int(rng.integers(0, len(hem)))
            j = int(np.clip(k + rng.integers(-4, 5), 0, len(hem) - 1))
            bow = (tops[j] + hem[k]) / 2 + 0.03 * sitter.unit * rng.normal() * sitter.right
            canvas.line(
                "hair", smooth(np.stack([tops[j], bow, hem[k]]), 12), 0.9, np.linspace(0.9, 0.5, 12)
            )
    else:
        canvas.line("hair", smooth(hem[::2], 40), 1.0)
    canvas.mark("hair", shape)
    canvas.cover(shape)
