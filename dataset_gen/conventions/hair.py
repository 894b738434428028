"""Hair by an artist's conventions: where it lies is the cut, how it is drawn is the finish."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .shapes import Points, ellipse, smooth, wave
from .sitter import RAYS, Sitter

# Of the skull's radius: how far each cut stands off, times the artist's volume.
STANDS = {"receding": 0.25, "crop": 0.25, "short": 0.7, "swept": 1.1, "fringe": 0.8, "bob": 1.0,
          "long": 1.0, "bun": 0.35, "afro": 2.4, "tufts": 0.6, "bald": 0.0}  # fmt: skip
LONG = ("bob", "long")
STEPS = 48


@dataclass(frozen=True)
class Hair:
    """Hair on the page: between an inner and an outer line over the head (STEPS, 2), from the
    picture's left to its right, and on down beside the face.

    falls : outer and inner line of what hangs down at the left and at the right, or None
    tips : the lower end of each, from its outer line to its inner one
    """

    inner: Points
    outer: Points
    falls: tuple[tuple[Points, Points] | None, tuple[Points, Points] | None] = (None, None)
    tips: tuple[Points, ...] = ()

    def shape(self) -> Points:
        """The outline of all of it."""
        left, right = self.falls
        line = [self.outer]
        if right:
            line += [right[0], self.tips[1], right[1][::-1]]
        line.append(self.inner[::-1])
        if left:
            line += [left[1], self.tips[0][::-1], left[0][::-1]]
        return np.concatenate(line)


def cut_hair(canvas: Canvas, sitter: Sitter, artist: Artist) -> Hair:
    """Where this artist's hair lies on this head."""
    rng, cut = canvas.rng, artist.cut
    centre = sitter.face.mean(axis=0)
    reach = (0.25 if cut in LONG else 0.3 if cut == "afro" else 0.275) * RAYS
    rays = np.linspace(-reach, reach, STEPS)
    angle = 2 * np.pi * rays / RAYS
    face, head = (_radius(line, centre, rays) for line in (sitter.face, sitter.head))
    top = np.cos(np.clip(angle, -np.pi / 2, np.pi / 2)) ** 0.7
    sides = rng.uniform(0.2, 0.9)
    stand = STANDS[cut] * artist.volume * (sides + (1 - sides) * top) * sitter.unit
    if cut == "afro":
        stand = STANDS[cut] * artist.volume * sitter.unit * (0.7 + 0.3 * top) + 0.05 * sitter.unit
    if artist.crowned:
        stand = 0.15 * stand  # pressed down
    outer = np.maximum(head, face) + stand + 0.015 * sitter.unit
    inner = np.minimum(face, head)
    if cut == "receding":
        inner = inner * (1 + 0.28 * np.exp(-((np.abs(angle) - 0.45) ** 2) / 0.07))
        inner = np.minimum(inner, outer - 0.02 * sitter.unit)
    elif cut in LONG:  # it hangs over the temples, more to one side of the parting
        over = (rng.uniform(0, 0.2, 2) * _roomy(sitter))[(angle > 0.6 * artist.parting).astype(int)]
        inner = inner * (1 - over * np.clip(np.abs(angle - 0.6 * artist.parting), 0, 1))
    ways = np.sin(angle)[:, None] * sitter.right - np.cos(angle)[:, None] * sitter.down
    inner_line, outer_line = (centre + r[:, None] * ways for r in (inner, outer))
    if cut in LONG:
        # It hangs straight down from where it is widest.
        x, y = sitter.local(outer_line).T
        half = STEPS // 2
        x[half:] = np.maximum.accumulate(x[half:])
        x[:half] = np.minimum.accumulate(x[:half][::-1])[::-1]
        outer_line = sitter.at(x, y)
        falls = _falls(sitter, artist, inner_line, outer_line, rng)
        hang = rng.uniform(0.03, 0.16) * sitter.unit
        tips = tuple(_tips(sitter, fall, hang, rng) for fall in falls)
        return Hair(inner_line, outer_line, falls, tips)
    return Hair(inner_line, outer_line)


def _tips(
    sitter: Sitter, fall: tuple[Points, Points], hang: float, rng: np.random.Generator
) -> Points:
    """The lower end of what hangs down: round, or in points."""
    t = np.linspace(0, 1, 13)
    line = fall[0][-1] + t[:, None] * (fall[1][-1] - fall[0][-1])
    low = np.sin(np.pi * t) * hang
    if rng.random() < 0.5:
        low = low + hang * np.abs(wave(rng, 1, 13, 2.5)[0]) * (t > 0) * (t < 1)
    return line + low[:, None] * sitter.down


def _roomy(sitter: Sitter) -> NDArray[np.float64]:
    """(2,) how much of the cheek at the picture's left and right hair may hide: none far away."""
    far = np.array([-sitter.turn, sitter.turn])
    return np.clip(1 - 3 * far, 0, 1)


def _radius(line: Points, centre: Points, rays: NDArray) -> NDArray:
    return np.interp(rays, np.arange(RAYS + 1), np.linalg.norm(
        np.concatenate([line, line[:1]]) - centre, axis=1), period=RAYS)  # fmt: skip


def _falls(
    sitter: Sitter, artist: Artist, inner: Points, outer: Points, rng: np.random.Generator
) -> tuple[tuple[Points, Points], tuple[Points, Points]]:
    """What hangs beside the face: lines from the ends of inner and outer down to the tips."""
    flare, curl = rng.uniform(0.0, 0.35), rng.normal(0, 0.14)
    under, waves = rng.uniform(0.35, 0.9), rng.choice([0.0, 0.015, 0.04]) * sitter.unit
    sides = []
    for side, k in ((-1, 0), (1, -1)):
        (ix, iy), (ox, oy) = (sitter.local(line[k]) * [side, 1] for line in (inner, outer))
        ox = max(ox, ix + 0.1)
        end = max(artist.reach + rng.normal(0, 0.05), iy + 0.4)
        jaw = min(ix, 0.68) - rng.uniform(0, 0.08) * _roomy(sitter)[k]
        outside = [(ox, oy), (ox + 0.35 * flare, oy + 0.2 * (end - oy)),
                   (ox + flare, oy + 0.65 * (end - oy)), (ox + flare + curl, end)]  # fmt: skip
        inside = [(ix, iy), (jaw, iy + 0.45 * (min(end, 0.9) - iy)), (jaw + 0.02, min(end, 0.9)),
                  (jaw + (under - 0.6) * np.clip(end - 0.9, 0.05, 1), end - 0.05)]  # fmt: skip
        if end < 1.0:
            inside = [*inside[:2], (jaw + 0.05 + 0.5 * curl, end - 0.03)]
        lines = []
        for knots in (outside, inside):
            x, y = smooth(np.array(knots), 26).T
            swing = waves * wave(rng, 1, 26, 1.5)[0] * np.linspace(0, 1, 26)
            lines.append(sitter.at(side * x, y) + swing[:, None] * sitter.right)
        sides.append((lines[0], lines[1]))
    return sides[0], sides[1]


def draw_hair(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """The mass of the hair, in front of what it hides."""
    cut, finish = artist.cut, artist.finish
    if cut == "bald":
        return
    if cut == "bun":
        _bun(canvas, sitter, artist)
    if finish == "curls" or cut == "afro":
        _curls(canvas, sitter, artist, hair)
    elif finish == "black":
        _shine(canvas, sitter, hair)
        canvas.blacken(hair.shape(), float(canvas.rng.uniform(-1.4, 1.4)))
        _edges(canvas, sitter, artist, hair, 1.0)
    elif finish == "hatch":
        lean = float(canvas.rng.uniform(0.9, 2.2))
        canvas.blacken(hair.shape(), lean, float(canvas.rng.uniform(1.7, 3.2)), "hair")
        _edges(canvas, sitter, artist, hair, 1.0)
    elif finish == "strands":
        many = (25, 75) if canvas.rng.random() < 0.4 else (80, 190)
        _strands(canvas, sitter, artist, hair, int(canvas.rng.integers(*many)))
        if canvas.rng.random() < 0.7:
            _edges(canvas, sitter, artist, hair, 0.8)
    else:
        _edges(canvas, sitter, artist, hair, 1.1)
        if canvas.rng.random() < 0.6:
            _strands(canvas, sitter, artist, hair, int(canvas.rng.integers(2, 8)))
    canvas.mark("hair", hair.shape())
    canvas.cover(hair.shape())


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
    combed = artist.cut in (*LONG, "bun") or (
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


def mix(hair: Hair, k: NDArray, depth: NDArray) -> Points:
    """Points at places k (...) along the hair, a share `depth` (...) from inner to outer line."""
    low = np.minimum(k.astype(int), STEPS - 2)
    f = (k - low)[..., None]
    inner = hair.inner[low] * (1 - f) + hair.inner[low + 1] * f
    outer = hair.outer[low] * (1 - f) + hair.outer[low + 1] * f
    return inner + depth[..., None] * (outer - inner)


def _shine(canvas: Canvas, sitter: Sitter, hair: Hair) -> None:
    """Bands of light that stay white in black hair."""
    for _ in range(int(canvas.rng.integers(0, 5))):
        k = canvas.rng.uniform(6, STEPS - 12) + np.linspace(0, canvas.rng.uniform(3, 8), 12)
        depth = canvas.rng.uniform(0.3, 0.7)
        half = canvas.rng.uniform(0.03, 0.09) * np.sin(np.linspace(0, np.pi, 12))
        band = [mix(hair, k, depth + half), mix(hair, k, depth - half)[::-1]]
        canvas.cover(np.concatenate(band))


def _curls(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """Loops all over the hair, thicker at its edges."""
    rng = canvas.rng
    size = sitter.unit * rng.uniform(0.05, 0.11)
    if artist.finish == "black":
        canvas.blacken(hair.shape(), 0.5)
    for edge, every in ((hair.outer, 1), (hair.inner, 2)):
        line = smooth(edge, 90)[::every]
        turn = np.linspace(0, 2 * np.pi * len(line) * every / rng.uniform(3.5, 6), len(line) * 5)
        path = smooth(line, len(line) * 5)
        loop = (
            np.stack([np.cos(turn), np.sin(turn)], axis=1) * size * (0.6 if every == 2 else 1) * 0.6
        )
        canvas.line("hair", path + loop, 0.9, loose=0.5)
    if artist.finish == "black":
        return
    for _ in range(int(rng.integers(6, 40))):
        place = mix(hair, np.array([rng.uniform(2, STEPS - 3)]), np.array([rng.uniform(0.1, 0.9)]))[
            0
        ]
        t = np.linspace(0, rng.uniform(3, 8), 14) + rng.uniform(0, 6)
        r = size * rng.uniform(0.4, 0.9) * np.linspace(1, 0.5, 14)
        canvas.line(
            "hair", place + np.stack([r * np.cos(t), r * np.sin(t)], axis=1), 0.8, loose=0.3
        )


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
    for _ in range(int(rng.integers(0, 5))):
        begin = int(rng.integers(0, 18))
        shrink = np.linspace(0.9, 0.4, 14)[:, None]
        canvas.line("hair", place + (ball[begin : begin + 14] - place) * shrink, 0.7)
    canvas.cover(ball)


def draw_front(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """A fringe, which hides the forehead and perhaps the brows' tops."""
    if artist.cut != "fringe" and not (artist.cut in LONG and canvas.rng.random() < 0.3):
        return
    rng = canvas.rng
    low = rng.uniform(0.35, 0.8)
    inner = smooth(hair.inner, STEPS)
    brow = sitter.local(np.stack([sitter.mark(f"brow_peak_{s}") for s in ("left", "right")]))[
        :, 1
    ].mean()
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
    shape = np.concatenate([tops, hem[::-1]])
    if artist.finish == "black":
        canvas.blacken(shape, 1.3)
        canvas.line("hair", hem, 0.9)
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
