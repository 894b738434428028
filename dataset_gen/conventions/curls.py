"""Curly hair: clumps of bent strokes, ringlets, frizz, bold bumps, or small rings and hooks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .artist import Artist, lot
from .canvas import Canvas
from .cut import LONG, Hair
from .mop import MOST, bent, bumps, field, many_for, outward, pieces_of, places_on, put, told
from .patches import Patch
from .shapes import Points, even, normals, ribbon, smooth, wave
from .sitter import Sitter

WAYS: dict[str, Mapping[str, float]] = {  # by manner, how often curls are drawn by which way
    "portrait": {"clumps": 3.0, "ringlets": 1.0, "frizz": 1.8, "bumps": 0.3, "rings": 1.5},
    "comic": {"clumps": 2.0, "ringlets": 0.8, "frizz": 1.2, "bumps": 1.5, "rings": 1.0},
    "cartoon": {"clumps": 0.8, "ringlets": 0.6, "frizz": 0.8, "bumps": 3.0, "rings": 1.0},
    "naive": {"clumps": 0.8, "ringlets": 1.0, "frizz": 1.5, "bumps": 1.0, "rings": 1.5},
}
TIGHT = ("shorn", "crop", "receding", "rim")  # too short for clumps and ringlets


def draw_curls(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """By one of WAYS, by lot; what stands off the hair's outline is told as hair, too."""
    odds = dict(WAYS[artist.manner])
    if artist.cut in TIGHT:
        odds["clumps"] = odds["ringlets"] = 0.0
    if artist.cut == "afro":
        odds["ringlets"], odds["frizz"] = 0.0, 2 * odds["frizz"]
    if artist.cut in LONG:
        odds["ringlets"] *= 3
    {"clumps": _clumps, "ringlets": _ringlets, "frizz": _frizz, "bumps": _bumps, "rings": _rings}[
        lot(canvas.rng, odds)
    ](canvas, sitter, artist, hair)


def _outline(canvas: Canvas, sitter: Sitter, hair: Hair, size: float, width: float) -> None:
    """The outline by lot: curls that stick out, scallops, or none; size : of a curl, px."""
    rng = canvas.rng
    how = lot(rng, {"loose": 2.0, "scallops": 1.0, "none": 0.6})
    if how == "none":
        return
    for piece in pieces_of(hair):
        line = piece.high
        length = float(np.hypot(*np.diff(line, axis=0).T).sum())
        way = outward(piece)
        if how == "scallops":
            line = bumps(rng, line, max(4, int(length / (1.3 * size))), way * 0.45)
            canvas.line("hair", line, width, loose=0.5)
            told(canvas, np.concatenate([line, piece.low[::-1]]))
            continue
        many = int(np.clip(rng.uniform(0.7, 2.2) * length / size, 6, 160))
        own = even(line, 4 * many + 1)
        k = rng.integers(0, len(own), many)
        out = normals(own)[k] * way
        heading = np.arctan2(out[:, 1], out[:, 0]) + rng.choice([-1, 1], many) * rng.uniform(
            0.5, 1.5, many
        )
        long = size * rng.uniform(0.7, 1.7, many)
        turn = rng.choice([-1, 1], many) * rng.uniform(1.5, 4.2, many)
        curls = bent(own[k] + 0.1 * size * out, heading, long, turn, 0 * turn)
        put(canvas, curls, width * rng.uniform(0.7, 1.1, many), rng.uniform(0.6, 1, many), 0.3)


def _clumps(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """Bundles of C- and S-shaped strokes all over, their ways by lot, darker at the hairline."""
    rng = canvas.rng
    room = float(np.median(Patch(hair.inner, hair.outer).tall))
    size = min(sitter.unit * rng.uniform(0.14, 0.45), max(0.8 * room, 0.12 * sitter.unit))
    each, bold = int(rng.integers(2, 8)), rng.uniform(0.6, 1.4)
    gap = max(1.5 * canvas.pen, size * rng.uniform(0.06, 0.14))
    many, grown = many_for(hair, size * gap * each, rng.uniform(1.0, 2.8), MOST // each)
    size, gap = grown * size, grown * gap
    places, way, up = places_on(rng, hair, many, rng.uniform(0.8, 1.5))
    n = len(places)
    if not n:
        return
    if rng.random() < 0.35:
        _base(canvas, sitter, hair)
    if artist.cut in LONG or rng.random() < 0.4:  # they hang, rather than stand
        down = np.arctan2(*sitter.down[::-1])
        way = down + 0.5 * np.sin(way - down)
    # Neighbours bend alike, as locks of curls do.
    flow = field(rng, places, sitter.unit * rng.uniform(0.4, 1.2))
    way = way + 0.9 * flow + rng.normal(0, rng.uniform(0.1, 0.8), n)
    alike = np.where(field(rng, places, 0.5 * sitter.unit) > 0, 1, -1)
    turn = alike * rng.choice([-1, 1, 1, 1], n) * rng.uniform(1.0, 3.6, n)
    back = turn * rng.choice([0, 1.1], n)
    long = size * np.exp(0.35 * rng.normal(size=n))
    across = np.stack([-np.sin(way + turn / 2), np.cos(way + turn / 2)], axis=1)
    for k in range(each):
        kept = rng.random(n) < 0.9 - 0.35 * up * (k > 2)
        off = (k - each / 2) * gap * rng.uniform(0.8, 1.2, n)
        shrunk = long * rng.uniform(0.75, 1.1, n) * (1 - 0.06 * abs(k - each / 2))
        lines = bent(places + off[:, None] * across, way + 0.08 * rng.normal(size=n), shrunk,
                     turn, back)[kept]  # fmt: skip
        width = bold * (1.25 - 0.5 * up) * rng.uniform(0.7, 1.2, n)
        put(canvas, lines, width[kept], rng.uniform(0.55, 1.0, n)[kept], 0.3)
    _outline(canvas, sitter, hair, 0.8 * size, bold)


def _base(canvas: Canvas, sitter: Sitter, hair: Hair) -> None:
    """What is dark under curls: all of it hatched, its depths by the face, or a dense tangle."""
    rng = canvas.rng
    how = lot(rng, {"hatch": 1.0, "depths": 1.5, "tangle": 2.0})
    lean = float(rng.uniform(0, np.pi))
    if how == "hatch":
        canvas.blacken(hair.shape(), lean, float(rng.uniform(1.6, 2.8)), "hair")
        return
    if how == "depths":
        sparse = float(rng.choice([1.4, 2.0] if any(hair.falls) else [1.0, 1.5, 2.0]))
        ends = rng.uniform(0.25, 0.8, 2)
        for piece in pieces_of(hair):
            # Its edge is ragged: an even one is a hood's.
            edge = piece.strip((0.0, ends[0]), (0.0, ends[1]), rng.uniform(-0.2, 0.1)).high
            count = int(np.hypot(*np.diff(edge, axis=0).T).sum() / (0.25 * sitter.unit)) + 3
            edge = bumps(rng, edge, count, rng.uniform(0.4, 0.8) * outward(piece))
            deep = np.concatenate([edge, piece.low[::-1]])
            canvas.blacken(deep, lean, sparse, "hair")
        return
    size, width = sitter.unit * rng.uniform(0.08, 0.2), rng.uniform(0.8, 1.4)
    n, grown = many_for(hair, size * canvas.pen * width, rng.uniform(0.6, 1.5), 420)
    places, way, _ = places_on(rng, hair, n, rng.uniform(1.0, 1.6))
    n = len(places)
    way = way + 1.5 * field(rng, places, 0.4 * sitter.unit) + rng.normal(0, 0.4, n)
    turn = rng.uniform(-3, 3, n)
    put(canvas, bent(places, way, grown * size * rng.uniform(0.7, 1.3, n), turn, 0 * turn),
         width, rng.uniform(0.7, 1.0, n), 0.2)  # fmt: skip


def _rings(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """Small rings, spirals and hooks side by side, as cropped curls are drawn."""
    rng = canvas.rng
    r = max(sitter.unit * rng.uniform(0.025, 0.075), 1.3 * canvas.pen)
    bold = rng.uniform(0.7, 1.3)
    if artist.finish == "black" and rng.random() < 0.6:
        _glints(canvas, sitter, hair, int(rng.integers(10, 40)), 1.6 * r)
        canvas.blacken(hair.shape(), float(rng.uniform(0, np.pi)), 1.0, "hair")
    elif rng.random() < 0.5:
        _base(canvas, sitter, hair)
    n, grown = many_for(hair, 4 * r * r, rng.uniform(0.7, 1.8))
    r = grown * r
    places, way, up = places_on(rng, hair, n, rng.uniform(0.6, 1.3))
    n = len(places)
    begin, turns = rng.uniform(0, 2 * np.pi, n), rng.uniform(2.5, 8.0, n) * rng.choice([-1, 1], n)
    t = np.linspace(0, 1, 13)
    angle = begin[:, None] + turns[:, None] * t
    own = r * rng.uniform(0.6, 1.35, n)
    shrink = 1 - t * np.clip(np.abs(turns) - 4, 0, 4)[:, None] / 6
    rings = (own[:, None] * shrink)[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    dark = rng.uniform(0.6, 1, n)
    put(canvas, places[:, None] + rings, bold * (1.15 - 0.3 * up), dark, 0.2)
    _outline(canvas, sitter, hair, 3.2 * r, bold)


def _frizz(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """Wiry zigzags and scribbles, from light to nearly black, within a rough edge."""
    rng = canvas.rng
    step = max(sitter.unit * rng.uniform(0.02, 0.055), 1.2 * canvas.pen)
    bold, tone = rng.uniform(0.6, 1.2), rng.uniform(0.35, 1.6)
    if artist.finish == "black" or tone > 1.2:
        dense = float(rng.choice([1.0, 1.5, 2.0]))
        lean = float(rng.uniform(0, np.pi))
        canvas.blacken(hair.shape(), lean, dense, "hair")
        if rng.random() < 0.5:
            canvas.blacken(hair.shape(), lean + 1.2, dense + 0.5, "hair")
    joints = 12
    n, grown = many_for(hair, joints * step * step * 1.2, tone, 380)
    step = grown * step
    places, way, _ = places_on(rng, hair, n, rng.uniform(0.6, 1.1))
    round_ = rng.random() < 0.5
    put(canvas, _scribbles(rng, places, step, joints, round_), bold, rng.uniform(0.5, 1.0), 0.2)
    # The edge: more of the same, half over it.
    for piece in pieces_of(hair):
        length = float(np.hypot(*np.diff(piece.high, axis=0).T).sum())
        many = int(np.clip(rng.uniform(0.8, 1.8) * length / (3 * step), 8, 140))
        line = even(piece.high, many)
        rough = line + step * rng.normal(0, 0.7, (many, 1)) * normals(line)
        put(canvas, _scribbles(rng, rough, 0.8 * step, joints, round_), bold, 1.0, 0.2)
        if rng.random() < 0.4:
            edge = bumps(rng, piece.high, int(length / (4 * step)) + 4, 0.5 * outward(piece))
            canvas.line("hair", edge, bold, loose=0.3)
            told(canvas, np.concatenate([edge, piece.low[::-1]]))


def _scribbles(
    rng: np.random.Generator, places: NDArray, step: float, joints: int, smoothed: bool
) -> Points:
    """Lines (n, k, 2) that wander from places (n, 2) by about `step` px, zigzag or in loops."""
    n = len(places)
    turn = rng.uniform(1.0, 2.6, (n, 1)) * rng.choice([-1, 1], (n, 1))
    if smoothed:
        heading = rng.uniform(0, 2 * np.pi, (n, 1)) + turn * np.arange(joints) * 0.8
    else:
        zigzag = (np.arange(joints) % 2) * (np.pi - rng.uniform(0.3, 1.1, (n, joints)))
        heading = rng.uniform(0, 2 * np.pi, (n, 1)) + zigzag
    heading = heading + 0.4 * rng.normal(size=(n, joints))
    long = step * rng.uniform(0.7, 2.0, (n, joints))
    line = np.cumsum(np.stack([long * np.cos(heading), long * np.sin(heading)], axis=2), axis=1)
    line = places[:, None] + line - line.mean(axis=1, keepdims=True)
    if not smoothed:
        return line
    return np.stack([smooth(own, 3 * joints) for own in line]) if n else line


def _bumps(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """Bold scallops around it with few arcs within, or black with small white arcs."""
    rng = canvas.rng
    size, width = sitter.unit * rng.uniform(0.13, 0.5), rng.uniform(0.9, 1.6)
    high, ends = rng.uniform(0.3, 0.6), rng.uniform(0.15, 0.6)
    black = artist.finish == "black" or rng.random() < 0.35
    low = rng.uniform(0.1, 0.4) * (rng.random() < 0.7)
    outlines = []
    for piece in pieces_of(hair):
        length = [float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in
                  (piece.high, piece.low)]  # fmt: skip
        out = outward(piece)
        outer = bumps(rng, piece.high, int(length[0] / size), out * high)
        inner = bumps(rng, piece.low, int(length[1] / (0.8 * size)), -out * ends * low)
        outlines.append(np.concatenate([outer, inner[::-1]]))
        canvas.line("hair", outer, width, loose=0.5)
        if low or not black:
            canvas.line("hair", inner, 0.85 * width, loose=0.5)
    if black:
        _glints(canvas, sitter, hair, int(rng.integers(0, 24)), 0.5 * size)
        for outline in outlines:
            canvas.blacken(outline, float(rng.uniform(-1.4, 1.4)))
    else:
        n = int(rng.integers(4, 10 + 40 * (rng.random() < 0.5)))
        places, way, _ = places_on(rng, hair, n)
        n = len(places)
        turn = rng.choice([-1, 1], n) * rng.uniform(2.0, 4.5, n)
        long = size * rng.uniform(0.5, 1.3, n)
        way = way - turn / 2 + np.pi / 2 * np.sign(turn) + 0.4 * rng.normal(size=n)
        put(canvas, bent(places, way, long, turn, 0 * turn), 0.85 * width, 1.0, 0.4)
    for outline in outlines:
        told(canvas, outline)


def _glints(canvas: Canvas, sitter: Sitter, hair: Hair, count: int, size: float) -> None:
    """Small arcs that stay white in black hair."""
    rng = canvas.rng
    places, way, _ = places_on(rng, hair, count)
    n = len(places)
    if not n:
        return
    turn = rng.choice([-1, 1], n) * rng.uniform(1.5, 3.5, n)
    half = max(0.6 * canvas.pen, 0.02 * sitter.unit)
    taper = np.sin(np.linspace(0.2, np.pi - 0.2, 12))
    for line in bent(places, way + rng.normal(0, 0.6, n), size * rng.uniform(1, 2, n), turn,
                     0 * turn):  # fmt: skip
        canvas.cover(ribbon(line, half * taper))


def _ringlets(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """Wavy strokes over the head, and corkscrews that hang down beside the face and over it."""
    rng = canvas.rng
    half, width = sitter.unit * rng.uniform(0.05, 0.12), rng.uniform(0.7, 1.3)
    n, _ = many_for(hair, half * sitter.unit * 0.5, rng.uniform(0.3, 1.2), 260)
    spiral = bool(rng.random() < 0.5)
    ends: list[tuple[Points, float]] = []
    falls = [Patch(f[1], f[0]) for f in hair.falls if f]
    for piece in falls:
        wide = float(np.median(piece.tall))
        many = int(np.clip(wide / (1.9 * half) + 1, 2, 7))
        for k in range(many):
            begin, end = rng.uniform(0, 0.3), rng.uniform(0.85, 1.12)
            t = np.linspace(begin, min(end, 1.0), 14)
            line = piece.at(t, np.full(14, (k + rng.uniform(0.3, 0.7)) / many))
            ends.append((line, half * rng.uniform(0.7, 1.2)))
    crown = Patch(hair.inner, hair.outer)
    if rng.random() < (0.4 if falls else 0.8):  # over the forehead, or from the temples
        for across in rng.uniform(0.02, 0.98, int(rng.integers(2, 8))):
            root = crown.at(across, rng.uniform(0.1, 0.5))
            side = abs(across - 0.5) > 0.3
            reach = sitter.unit * rng.uniform(0.15, 0.7 if side else 0.35)
            t = np.linspace(0, 1, 14)
            swing = 0.1 * sitter.unit * wave(rng, 1, 14, 0.7)[0] * t
            line = root + (t * reach)[:, None] * sitter.down + swing[:, None] * sitter.right
            ends.append((line, 0.6 * half * rng.uniform(0.7, 1.2)))
    for line, thick in ends:
        _corkscrew(canvas, line, thick, width, spiral)
    places, way, up = places_on(rng, hair, n)
    n = len(places)
    down = np.arctan2(*sitter.down[::-1])
    way = down + 1.2 * np.sin(way - down) + rng.normal(0, 0.3, n)
    turn = rng.choice([-1, 1], n) * rng.uniform(1.0, 3.0, n)
    long = sitter.unit * rng.uniform(0.2, 0.5, n)
    lines = bent(places, way - turn / 2, long, turn, 1.1 * turn, 16)
    put(canvas, lines, width * (1.15 - 0.4 * up), rng.uniform(0.5, 1, n), 0.4)
    _outline(canvas, sitter, hair, 3 * half, width)


def _corkscrew(canvas: Canvas, line: Points, half: float, width: float, spiral: bool) -> None:
    """A ringlet along a line: a spiral, or arcs across it between bulging edges; it hides."""
    rng = canvas.rng
    length = float(np.hypot(*np.diff(line, axis=0).T).sum())
    turns = max(2, int(length / (rng.uniform(1.3, 2.2) * half)))
    axis = even(line, 12 * turns + 1)
    t = np.linspace(0, 1, len(axis))
    thick = half * np.interp(t, [0, 0.2, 0.8, 1], [0.6, 1, 0.9, 0.4])
    away = normals(axis)
    ahead = np.gradient(axis, axis=0)
    ahead /= np.maximum(np.hypot(*ahead.T)[:, None], 1e-9)
    phase = 2 * np.pi * turns * t
    if spiral:
        coil = axis + (thick * np.cos(phase))[:, None] * away
        coil += (0.5 * thick * np.sin(phase))[:, None] * ahead
        canvas.line("hair", coil, width, loose=0.3)
    else:
        bulge = thick * (0.75 + 0.3 * np.abs(np.sin(phase / 2)))
        for side in (-1, 1):
            canvas.line("hair", axis + side * bulge[:, None] * away, width, loose=0.2)
        for k in np.arange(turns) * 12 + 2:
            for shift in (0, 3)[: int(rng.integers(1, 3))]:
                own = slice(k + shift, min(k + shift + 9, len(axis)))
                s = np.linspace(-0.9, 0.9, len(axis[own]))
                canvas.line("hair", axis[own] + (s * bulge[own])[:, None] * away[own], 0.75 * width,
                            loose=0.2)  # fmt: skip
    told(canvas, ribbon(axis[::3], thick[::3]))
