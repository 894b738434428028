"""Shade as artists hatch it: under the chin, beside the nose, on one side of the face."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .eyes import Eye
from .shapes import Points, part, smooth
from .sitter import RAYS, Sitter

NECK_SHADE = 0.36  # units that the chin's shadow reaches down, at most


def draw_shade(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """What is shaded on the face itself; all on the same side of the light."""
    if artist.shade == "none":
        return
    rng = canvas.rng
    side = sitter.far if abs(sitter.turn) > 0.2 else ("left", "right")[int(rng.integers(2))]
    angle = float(rng.choice([0.9, 2.2]) + rng.normal(0, 0.15))
    full = artist.shade == "full"
    if full or artist.shade == "side":
        _hatch(canvas, _cheek(sitter, side, rng.uniform(0.6, 0.85)), angle, 2.2, 0.6)
        if rng.random() < 0.4:  # crossed, and deeper at the edge
            _hatch(canvas, _cheek(sitter, side, 0.88), angle + 0.8, 2.4, 0.7)
    if full or artist.shade == "nose":
        edge = part(sitter.curves[f"nose_side_{side}"], 0.25, 1)
        wing = smooth(sitter.curves[f"nose_wing_{side}"], 10)
        out = 0.12 * sitter.unit * (1 if side == "left" else -1) * sitter.right
        _hatch(canvas, np.concatenate([edge, wing[4:5], (edge + out)[::-1]]), angle, 1.8, 0.6)
    if full:
        for own in ("left", "right"):
            eye = Eye(sitter, artist, own)
            if eye.seen and rng.random() < 0.7:
                brow = smooth(sitter.curves[f"brow_lower_{own}"], 12)[:7]
                lid = eye.upper[:12:2] - 0.08 * eye.width * eye.along
                _hatch(canvas, np.concatenate([brow, lid[::-1]]), angle, 1.9, 0.55)
        if rng.random() < 0.6:
            lip = part(smooth(sitter.curves["under_lip"], 12), 0.1, 0.9)
            low = lip + 0.06 * sitter.unit * sitter.down
            _hatch(canvas, np.concatenate([lip, low[::-1]]), 0.1, 1.6, 0.55)


def draw_neck_shade(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """The shadow of the chin on the neck."""
    if artist.shade not in ("neck", "full"):
        return
    rng = canvas.rng
    low = smooth(sitter.face[np.arange(0.3 * RAYS, 0.7 * RAYS + 1).astype(int)], 30)
    sag = np.sin(np.linspace(0, np.pi, 30)) * rng.uniform(0.4, 1) * NECK_SHADE
    under = low + (sag * sitter.unit)[:, None] * sitter.down
    neck = np.concatenate([sitter.neck[0], sitter.neck[1][::-1]])
    shape = np.concatenate([low, under[::-1]])
    canvas.blacken(
        shape, float(rng.choice([0.5, 2.6, 1.3])), 1.9, "hatch", 0.8, area=canvas.area(neck)
    )


def _cheek(sitter: Sitter, side: str, depth: float) -> Points:
    """The side of the face from the temple to the jaw, in from its outline by 1 - depth."""
    first, last = (0.14, 0.42) if side == "left" else (0.58, 0.86)
    edge = sitter.face[np.arange(first * RAYS, last * RAYS).astype(int)]
    middle = sitter.face.mean(axis=0)
    inner = middle + depth * (edge - middle)
    return np.concatenate([edge, inner[::-1]])


def _hatch(canvas: Canvas, shape: Points, angle: float, sparse: float, strength: float) -> None:
    canvas.blacken(shape, angle, sparse, "hatch", strength, within=True)
