"""What is worn on a head and is soft: beanies, scarves, veils, bandanas, turbans, hoods."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .bands import draw_bow
from .canvas import Canvas
from .crown import radius, tail, worn
from .patches import Patch
from .shapes import Points, ellipse, smooth, wave
from .sitter import RAYS, Sitter
from .textures import WOOL, locks, material, ribs, texture, wool


def beanie(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """A turned-up edge in a texture of its own, or a hem, or none; and perhaps a bobble."""
    rng = canvas.rng
    kind = rng.random()
    fold = rng.uniform(0.12, 0.36)
    if kind < 0.6:
        edge = raised(crown.low, fold, rng.uniform(0.0, 0.05), sitter)
        how = rng.random()
        if how < 0.3:
            ribs(canvas, sitter, edge)
        elif how < 0.5:
            wool(canvas, sitter, edge)
        elif how < 0.7:
            texture(canvas, sitter, edge, material(rng, artist, WOOL))
        worn(canvas, np.concatenate([edge.outline, edge.outline[:1]]))
    elif kind < 0.75:  # a hem of short strokes
        hem = raised(crown.low, 0.4 * fold, 0.0, sitter)
        ribs(canvas, sitter, hem)
    elif kind < 0.85:
        canvas.line("hat", raised(crown.low, 0.25 * fold, 0.0, sitter).high, 0.9)
    if rng.random() < 0.2:
        top = crown.at(0.5 + rng.normal(0, 0.05), 1.0)
        r = rng.uniform(0.12, 0.24) * sitter.unit
        ball = ellipse(top - 0.7 * r * sitter.down, r, r, 0.0, 33)
        away = (ball - ball[:-1].mean(axis=0)) / r * 0.03 * sitter.unit
        worn(canvas, ball + away * wave(rng, 1, 33, 5)[0][:, None], 0.9)


def raised(line: Points, high: float, out: float, sitter: Sitter) -> Patch:
    """The strip above a rim (k, 2), `high` units, that stands `out` at both sides."""
    aside = np.linspace(-out, out, len(line))[:, None] * sitter.unit * sitter.right
    return Patch(line + aside, line + aside - high * sitter.unit * sitter.down)


def scarf(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """It falls beside the face to a knot under the chin."""
    rng = canvas.rng
    under = rng.uniform(1.02, 1.12)
    low = under + rng.uniform(0.08, 0.4)
    if rng.random() < 0.6:
        tied(canvas, sitter, artist, _beside(sitter, crown.low[-1], 1, (under + low) / 2)[-1], 0)
    for k, side in ((0, -1), (-1, 1)):
        cheek = _beside(sitter, crown.low[k], side, under, rng.uniform(0.86, 0.98))
        outer = _beside(sitter, crown.high[k], side, low, rng.uniform(1.05, 1.35))
        _hanging(canvas, sitter, stuff, Patch(cheek, outer))


def _beside(
    sitter: Sitter, start: Points, side: int, chin: float, cheek: float | None = None
) -> Points:
    """A line (20, 2) from a place (2,) around the face to under its chin, of whose distance from
    the middle it is there at the share `chin`, and at `cheek` half the way."""
    centre = sitter.face.mean(axis=0)
    away = start - centre
    begin = np.arctan2(side * (away @ sitter.right), -(away @ sitter.down))
    turn = np.linspace(begin, np.pi, 20)
    far = radius(sitter.face, centre, side * turn * RAYS / (2 * np.pi))
    first = float(np.linalg.norm(away) / far[0])
    middle = 0.4 * first + 0.6 * chin if cheek is None else cheek
    share = smooth(np.array([[first, 0], [middle, 0], [chin, 0]]), 20)[:, 0]
    ways = np.sin(turn)[:, None] * side * sitter.right - np.cos(turn)[:, None] * sitter.down
    return centre + (share * far)[:, None] * ways


def _hanging(canvas: Canvas, sitter: Sitter, stuff: str, fall: Patch) -> None:
    """Cloth beside the face, between the line at the face and the outer one, downward."""
    rng = canvas.rng
    canvas.mark("hair", fall.outline)
    canvas.mark("hat", fall.outline)
    for share in rng.uniform(0.1, 0.9, int(rng.integers(0, 4))):
        canvas.line("hat", fall.at(np.linspace(rng.uniform(0, 0.4), 1, 14), share), 0.7)
    if stuff != "black" and rng.random() < 0.3:  # its folds
        locks(canvas, sitter, fall)
    texture(canvas, sitter, fall, stuff)
    canvas.line("hat", fall.low, 1.0)
    canvas.line("hat", fall.high, 1.0)
    canvas.cover(fall.outline)


def veil(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """It frames the whole face and falls to the shoulders; an inner cap may show at its edge."""
    rng = canvas.rng
    chin, low = rng.uniform(0.98, 1.07), rng.uniform(1.35, 2.0)
    foot = rng.uniform(0.75, 1.3)
    if rng.random() < 0.3:
        under = raised(crown.low[8:-8], rng.uniform(0.05, 0.14), 0.0, sitter)
        canvas.line("hat", smooth(under.high[::4], 30), 0.9)
    over = int(rng.choice([-1, 1]))  # the side that lies over the other one
    for side in (over, -over):
        k = 0 if side < 0 else -1
        cheek = _beside(sitter, crown.low[k], side, chin)
        x, y = sitter.local(crown.high[k])
        bottom = sitter.local(cheek[-1])
        outer = sitter.at(
            np.array([x, x + 0.1 * side, side * max(foot, abs(x))]), np.array([y, y + 0.5, low])
        )
        foot_x = bottom[0] + np.linspace(0, -0.4 * over if side == over else 0.1 * over, 8)[1:]
        inner = np.concatenate([cheek, sitter.at(foot_x, np.linspace(bottom[1], low, 8)[1:])])
        _hanging(canvas, sitter, stuff, Patch(inner, smooth(outer, 20)))
    for _ in range(int(rng.integers(0, 5))):  # folds that hang from side to side under the chin
        drop = rng.uniform(1.02, 1.5)
        a, b = (sitter.local(crown.low[k])[0] for k in (0, -1))
        x = np.linspace(a, b, 3) * rng.uniform(0.7, 1.1)
        y = sitter.local(sitter.face)[:, 1].max() * np.array([0.7, drop, 0.75])
        canvas.line("hat", smooth(sitter.at(x, y), 16), 0.8)


def bandana(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """Close to the skull, with folds that run to a knot at one side, whose ends hang down."""
    rng = canvas.rng
    side = int(np.sign(-sitter.turn)) if abs(sitter.turn) > 0.15 else int(rng.choice([-1, 1]))
    k = 0.0 if side < 0 else 1.0
    place = crown.at(k, 0.0) - 0.1 * sitter.unit * sitter.down
    if rng.random() < 0.75:
        tied(canvas, sitter, artist, place, side)
    for _ in range(int(rng.integers(0, 6))):
        end = crown.at(rng.uniform(0.2, 0.8), rng.uniform(0.05, 0.9))
        bow = rng.uniform(0, 0.1) * sitter.unit * sitter.down
        canvas.line("hat", smooth(np.stack([place, (place + end) / 2 - bow, end]), 12), 0.8)
    if rng.random() < 0.4:
        canvas.line("hat", raised(crown.low, rng.uniform(0.06, 0.14), 0.0, sitter).high, 0.8)


def tied(canvas: Canvas, sitter: Sitter, artist: Artist, place: Points, side: int) -> None:
    """A knot at a place (2,) at one side of the head, or in its middle (0), with a bow or with ends
    that hang down."""
    rng = canvas.rng
    if rng.random() < 0.25:
        draw_bow(canvas, sitter, artist, place)
        return
    wide, tall = rng.uniform(0.06, 0.14, 2) * sitter.unit
    knot = ellipse(place, wide, tall, rng.normal(0, 0.4), 19)
    for bow in rng.uniform(-0.5, 0.5, int(rng.integers(0, 3))):
        canvas.line("hat", place + bow * tall * sitter.down + np.linspace(-0.7, 0.7, 5)[:, None]
                    * wide * sitter.right, 0.6)  # fmt: skip
    worn(canvas, knot)
    for _ in range(int(rng.integers(1, 3))):
        aside = side or rng.choice([-1, 1])
        way = aside * rng.uniform(0.0, 0.35) * sitter.right + rng.uniform(0.3, 0.9) * sitter.down
        end = place + sitter.unit * way
        strip = tail(place, end, rng.uniform(0.05, 0.13), sitter, side * rng.uniform(-0.05, 0.1))
        for share in rng.uniform(0.2, 0.8, int(rng.integers(0, 4))):
            canvas.line("hat", strip.at(np.linspace(0, 0.9, 10), share), 0.6)
        worn(canvas, np.concatenate([strip.outline, strip.outline[:1]]))


def wrap(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """A turban: a plain band in front, strips with folds that cross, and perhaps a knot."""
    rng = canvas.rng
    if rng.random() < 0.3:
        side = int(rng.choice([-1, 1]))
        across, up = 0.5 + 0.48 * side, rng.uniform(0.0, 0.3)
        if rng.random() < 0.3:
            across, up = rng.uniform(0.35, 0.65), rng.uniform(0.3, 1.0)
        tied(canvas, sitter, artist, crown.at(across, up), side)
    if rng.random() < 0.4:
        high = rng.uniform(0.15, 0.45)
        front = crown.strip((0.0, high), (0.0, high), 0.0)
        if rng.random() < 0.4:
            locks(canvas, sitter, front)
        canvas.line("hat", front.high, 1.0)
        canvas.cover(front.outline)
    side = int(rng.choice([-1, 1]))
    folded = rng.random()
    for k in range(int(rng.integers(1, 7))):
        begin, end = rng.uniform(-0.1, 0.25) + 0.08 * k, rng.uniform(0.2, 0.75) + 0.08 * k
        wide = rng.uniform(0.18, 0.5, 2)
        ends = (begin, begin + wide[0]), (end, end + wide[1])
        left, right = ends[::side]
        strip = crown.strip(left, right, float(rng.normal(0, 0.12)))
        if rng.random() < folded:
            locks(canvas, sitter, strip)
        for share in rng.uniform(0.15, 0.85, int(rng.integers(0, 4))):
            begin, end = np.sort(rng.random(2))
            canvas.line("hat", strip.at(np.linspace(begin, end, 14), share), 0.7)
        canvas.line("hat", strip.low, 1.0)
        canvas.line("hat", strip.high, 1.0)
        canvas.cover(strip.outline)
        side = -side if rng.random() < 0.7 else side


def hood(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """It goes on to the shoulders; a seam or fur may run along its edge."""
    rng = canvas.rng
    under = sitter.local(sitter.face[RAYS // 2])[0]
    for k, side in ((0, -1), (-1, 1)):
        begin, inner = crown.high[k], crown.low[k]
        foot = sitter.at(side * rng.uniform(0.9, 1.5), rng.uniform(1.2, 1.8))
        chin = sitter.at(under + side * rng.uniform(0.05, 0.5), rng.uniform(1.15, 1.5))
        outer = smooth(np.stack([begin, begin + 0.4 * sitter.unit * sitter.down, foot]), 14)
        bow = 0.1 * side * sitter.unit * sitter.right
        edge = smooth(np.stack([inner, (inner + chin) / 2 + bow, chin]), 14)
        _hanging(canvas, sitter, stuff, Patch(edge, outer))
    if rng.random() < 0.5:
        seam = crown.at(np.linspace(0, 1, 31), rng.uniform(0.1, 0.35))
        if rng.random() < 0.3:
            ribs(canvas, sitter, Patch(crown.low, seam))
        canvas.line("hat", seam, 0.8)
