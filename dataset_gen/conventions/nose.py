"""Noses by an artist's conventions."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .shapes import Points, ellipse, part, smooth
from .sitter import Sitter


def draw_nose(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    draw = NOSES.get(artist.nose)
    if draw:
        draw(canvas, sitter)


def _toward(sitter: Sitter, canvas: Canvas) -> str:
    """The side of the face on which a nose seen from the front is given its line."""
    if abs(sitter.turn) > 0.12:
        return sitter.far
    return "left" if canvas.rng.random() < 0.5 else "right"


def _profile(sitter: Sitter, side: str) -> Points:
    """The bridge's edge (k, 2) toward one side, from the brow to the tip, as it is seen there."""
    names = [f"nose_side_{side}", f"nose_inner_{side}", "nose_middle"]
    sign = 1 if side == "left" else -1
    lines = np.stack([sitter.curves[name] for name in names])
    out = (lines - sitter.origin) @ sitter.right * sign
    best = out.argmax(axis=0)
    if abs(sitter.turn) < 0.15:
        best[:] = 0
    return lines[best, np.arange(lines.shape[1])]


def _wing(sitter: Sitter, side: str) -> Points:
    return smooth(sitter.curves[f"nose_wing_{side}"], 14)


def _tip(sitter: Sitter) -> Points:
    return sitter.curves["nose_ball"][len(sitter.curves["nose_ball"]) // 2]


def _shown(sitter: Sitter, side: str) -> bool:
    """Whether a wing is seen, and not hidden behind the tip."""
    return side != sitter.far or abs(sitter.turn) < 0.45


def _l(canvas: Canvas, sitter: Sitter) -> None:
    """One side, the tip, and back under it."""
    side = _toward(sitter, canvas)
    edge = part(_profile(sitter, side), canvas.rng.uniform(0, 0.6), 1)
    other = "right" if side == "left" else "left"
    end = _wing(sitter, other)[-3]
    tip = _tip(sitter) + (0.25 * (_wing(sitter, side)[-1] - _tip(sitter)))
    line = smooth(np.concatenate([edge[:: max(len(edge) // 4, 1)], tip[None],
                                  (0.5 * (tip + end) + 0.02 * sitter.unit * sitter.down)[None],
                                  end[None]]), 26)  # fmt: skip
    canvas.line("nose", line, 1.0)


def _u(canvas: Canvas, sitter: Sitter) -> None:
    right, left = (_wing(sitter, s) for s in ("right", "left"))
    tip = _tip(sitter) + 0.04 * sitter.unit * sitter.down
    line = smooth(np.stack([right[5], right[-3], tip, left[-3], left[5]]), 24)
    canvas.line("nose", line, 1.0)


def _ball(canvas: Canvas, sitter: Sitter) -> None:
    ball = smooth(sitter.curves["nose_ball"], 20)
    canvas.line("nose", part(ball, 0.1, 0.9), 0.9)
    for side in ("left", "right"):
        if _shown(sitter, side):
            canvas.line("nose", part(_wing(sitter, side), 0.15, 0.8), 0.9)


def _dots(canvas: Canvas, sitter: Sitter) -> None:
    for side in ("left", "right"):
        if _shown(sitter, side):
            place = sitter.mark(f"nostril_{side}") + 0.02 * sitter.unit * sitter.down
            canvas.fill(ellipse(place, 0.03 * sitter.unit, 0.018 * sitter.unit, count=11))


def _nostrils(canvas: Canvas, sitter: Sitter) -> None:
    """Two small dark arches under the tip."""
    for side in ("left", "right"):
        if _shown(sitter, side):
            line = smooth(sitter.curves[f"nose_under_{side}"], 14)
            canvas.line("nose", part(line, 0.12, 0.5), 1.7)


def _wings(canvas: Canvas, sitter: Sitter) -> None:
    for side in ("left", "right"):
        if _shown(sitter, side):
            canvas.line("nose", _wing(sitter, side), 1.0)
    if canvas.rng.random() < 0.6:
        _nostrils(canvas, sitter)
    if canvas.rng.random() < 0.4:
        _base(canvas, sitter)


def _side(canvas: Canvas, sitter: Sitter) -> None:
    edge = _profile(sitter, _toward(sitter, canvas))
    canvas.line("nose", smooth(part(edge, canvas.rng.uniform(0, 0.4), 1), 18), 1.0)
    if canvas.rng.random() < 0.4:
        _nostrils(canvas, sitter)


def _hook(canvas: Canvas, sitter: Sitter) -> None:
    """The profile of the nose as it is seen from half aside: bridge, tip, and back to the lip."""
    side = _toward(sitter, canvas)
    edge = part(_profile(sitter, side), canvas.rng.uniform(0.2, 0.7), 1)
    sign = 1 if side == "left" else -1
    jut = (0.10 + 0.05 * abs(sitter.turn)) * sitter.unit
    tip = _tip(sitter) + sign * jut * sitter.right
    under = tip + 0.09 * sitter.unit * sitter.down - sign * 0.07 * sitter.unit * sitter.right
    back = sitter.mark("nose_base") - sign * 0.04 * sitter.unit * sitter.right
    knots = [edge[0], edge[len(edge) // 2], edge[-1] * 0.5 + tip * 0.5, tip, under, back]
    canvas.line("nose", smooth(np.stack(knots), 26), 1.05)


def _base(canvas: Canvas, sitter: Sitter) -> None:
    """The underside: an arch from wing to wing, heaviest at the nostrils."""
    for side in ("left", "right"):
        if _shown(sitter, side):
            line = smooth(sitter.curves[f"nose_under_{side}"], 16)
            canvas.line("nose", part(line, 0.1, 1), 0.9)


def _sides(canvas: Canvas, sitter: Sitter) -> None:
    """Both sides from the brows down around the wings."""
    for side in ("left", "right"):
        if _shown(sitter, side):
            edge = part(_profile(sitter, side), canvas.rng.uniform(0, 0.5), 0.85)
            line = np.concatenate([edge[::3], _wing(sitter, side)[2::3]])
            canvas.line("nose", smooth(line, 26), 0.85, 0.9)
    _base(canvas, sitter)


def _full(canvas: Canvas, sitter: Sitter) -> None:
    """As it is drawn from life: wings, nostrils, the underside, and a faint edge of the bridge."""
    for side in ("left", "right"):
        if _shown(sitter, side):
            canvas.line("nose", _wing(sitter, side), 0.9)
    _nostrils(canvas, sitter)
    _base(canvas, sitter)
    edge = _profile(sitter, _toward(sitter, canvas))
    begin = canvas.rng.uniform(0, 0.3)
    canvas.line("nose", part(edge, begin, begin + canvas.rng.uniform(0.3, 0.7)), 0.6, 0.5)
    if canvas.rng.random() < 0.4:
        canvas.line("nose", part(smooth(sitter.curves["nose_ball"], 18), 0.2, 0.8), 0.5, 0.4)
    if canvas.rng.random() < 0.4:
        for side in ("left", "right"):
            canvas.line("nose", sitter.curves[f"philtrum_{side}"], 0.5, 0.4)


NOSES = {"l": _l, "u": _u, "ball": _ball, "dots": _dots, "wings": _wings, "side": _side,
         "hook": _hook, "base": _base, "sides": _sides, "full": _full}  # fmt: skip
