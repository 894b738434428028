"""Glasses, by an artist's conventions."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .eyes import Eye
from .shapes import smooth
from .sitter import Sitter


def draw_glasses(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """Rims around both eyes, a bridge, and temples to the ears."""
    if artist.glasses == "none":
        return
    rng = canvas.rng
    power = {"round": 1.0, "square": 0.35, "half": 0.6, "dark": 0.6}[artist.glasses]
    t = np.linspace(0, 2 * np.pi, 41)
    c, s = (np.sign(f) * np.abs(f) ** power for f in (np.cos(t), np.sin(t)))
    wide, tall = rng.uniform(0.72, 0.95), rng.uniform(0.5, 0.8)
    width = float(rng.choice([0.8, 1.0, 1.6]))
    ends = {}
    for side in ("left", "right"):
        eye = Eye(sitter, artist, side)
        span = eye.width * wide / max(artist.eyes, 1)
        middle = eye.middle + 0.03 * sitter.unit * sitter.down
        rim = (
            middle
            + span * c[:, None] * eye.across
            + 0.28 * sitter.unit * tall * s[:, None] * eye.along
        )
        if not eye.seen:
            ends[side] = middle
            continue
        if artist.glasses == "dark":
            canvas.blacken(rim, 0.8)
            canvas.line("glasses", rim, width)
            canvas.cover(rim)
        elif artist.glasses == "half":
            canvas.line("glasses", rim, width, seen=(rim - middle) @ eye.along > -0.1)
        else:
            canvas.line("glasses", rim, width)
        ends[side] = middle - span * eye.across
        if side in sitter.ears:
            outer = middle + span * eye.across
            ear = sitter.ears[side]
            hook = ear[np.argmin(np.linalg.norm(ear - outer, axis=1))]
            hook = hook - 0.1 * sitter.unit * sitter.down
            canvas.line("glasses", np.stack([outer, (outer + hook) / 2, hook]), width)
    a, b = ends["left"], ends["right"]
    bow = (a + b) / 2 - rng.uniform(0.02, 0.08) * sitter.unit * sitter.down
    canvas.line("glasses", smooth(np.stack([a, bow, b]), 9), width)
