"""Drawings shaded as people shade them, and read as the program reads them.

Light falls on a head that is nearly an egg: graphite, smudged or in streaks, darkens the side away
from it, the sockets of the eyes, what lies under nose, lip and chin, and hair; the paper is grey,
a lamp stands beside it. What comes out is what `tones.as_drawing` makes of such a page, so that
training and use find ink in tones by the same code.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from facs_rig.common.errors import InputError

from ..tones import as_drawing
from .scribbles import CROWN, HALF_WIDTH, Frame

Floats = NDArray[np.float32]
Ink = NDArray[np.uint8]

HEAD = (0.02, 0.98 * HALF_WIDTH, 1.02)  # of an egg in the frame: middle below the eyes, half axes
# Where shade lies whatever the light: x (of either side), y, spread across and down, how often.
HOLLOWS = (
    (0.30, -0.08, 0.16, 0.09, 0.7),  # the sockets of the eyes
    (0.12, 0.05, 0.05, 0.16, 0.5),  # beside the nose
    (0.0, 0.40, 0.10, 0.04, 0.6),  # under it
    (0.0, 0.68, 0.12, 0.04, 0.5),  # under the lower lip
    (0.0, 1.18, 0.40, 0.14, 0.7),  # under the chin
    (0.48, 0.35, 0.14, 0.22, 0.5),  # the hollow of the cheek
)


def toned(ink: Ink, frame: Frame, rng: Generator) -> Ink:
    """A page of ink (h, w), 0 = paper, shaded by somebody, as it is read; `frame`: of its face."""
    lines = ink.astype(np.float32) / 255 * np.float32(rng.uniform(0.55, 1.0))
    if rng.random() < 0.3:
        lines = gaussian_filter(lines, rng.uniform(0.4, 1.1))
    v, u = np.mgrid[0 : ink.shape[0], 0 : ink.shape[1]]
    place = frame.local(np.stack([u, v], axis=-1).reshape(-1, 2)).astype(np.float32)
    x, y = place.T.reshape(2, *ink.shape)
    light = (1 - lines) * (1 - _graphite(x, y, rng)) * (1 - _lock(x, y, rng))
    light = light * _paper(ink.shape, rng)
    try:
        drawing, _, _ = as_drawing(np.clip(light, 0, 1).astype(np.float32), "a page")
    except InputError:  # hardly anything is left of it
        return ink
    return np.uint8(255) - np.rint(255 * drawing).astype(np.uint8)


def _graphite(x: Floats, y: Floats, rng: Generator) -> Floats:
    """How dark the shade is, 0..1, at places (h, w) of the frame."""
    middle, wide, tall = HEAD
    across, down = x / wide, (y - middle) / tall
    high = 1 - across**2 - down**2
    head = np.clip(high * 8, 0, 1)
    toward = np.sqrt(np.clip(high, 0, 1))
    lamp = rng.normal(0, 1, 3) * (1, 0.6, 0.4) + (0, -0.5, 0.6)
    lamp = (lamp / np.linalg.norm(lamp)).astype(np.float32)
    form = 1 - np.clip(lamp[0] * across + lamp[1] * down + lamp[2] * toward, 0, 1)
    shade = rng.uniform(0, 0.6) * form ** np.float32(rng.uniform(1, 3)) * head
    side = int(rng.choice([-1, 1]))
    for hx, hy, sx, sy, often in HOLLOWS:
        if rng.random() > often:
            continue
        depth = rng.uniform(0.05, 0.35)
        dx, dy = rng.normal(0, 0.02, 2)
        for k, sign in enumerate((side, -side) if hx else (1,)):
            far = ((x - sign * hx - dx) / sx) ** 2 + ((y - hy - dy) / sy) ** 2
            bell = np.exp(-far * rng.uniform(0.4, 1.2))
            shade = np.maximum(shade, depth * (1 if k == 0 else rng.uniform(0.2, 1)) * bell)
    return np.clip(shade * _grain(x, y, rng), 0, 0.92).astype(np.float32)


def _grain(x: Floats, y: Floats, rng: Generator) -> Floats:
    """A mean of about 1: smooth as if smudged, of the paper's tooth, or in streaks."""
    kind = rng.random()
    if kind < 0.3:
        return np.ones_like(x)
    if kind < 0.65:
        tooth = rng.standard_normal(x.shape, np.float32)
        return 1 + np.float32(rng.uniform(0.1, 0.4)) * tooth
    lean, gap = rng.uniform(0, np.pi), rng.uniform(0.025, 0.07)
    along = x * np.float32(np.cos(lean)) + y * np.float32(np.sin(lean))
    stripes = np.sin(2 * np.pi * along / np.float32(gap)) + 0.5 * gaussian_filter(
        rng.standard_normal(x.shape, np.float32), 2
    )
    return 1 + np.float32(rng.uniform(0.2, 0.8)) * stripes


def _lock(x: Floats, y: Floats, rng: Generator) -> Floats:
    """A field of hair: over the skull, sometimes down beside the face."""
    if rng.random() < 0.4:
        return np.zeros_like(x)
    top, reach = rng.uniform(-0.9, -0.5), rng.uniform(-0.3, 1.6)
    thick = rng.uniform(0.05, 0.4)
    radius = np.hypot(x / HALF_WIDTH, np.minimum(y, 0) / -CROWN)
    rim = np.clip((radius - 1 + 0.12) * 14, 0, 1) * np.clip((1 + thick - radius) * 14, 0, 1)
    beside = rim * np.clip((reach - y) * 6, 0, 1)
    over = np.clip((top - y + 0.15 * x * rng.normal()) * 14, 0, 1)
    over = over * np.clip((1 + thick - radius) * 14, 0, 1)
    strands = gaussian_filter(rng.standard_normal(x.shape, np.float32), (5, 0.7)) * 3
    dark = np.float32(rng.uniform(0.2, 0.95))
    field = np.maximum(over, beside) * (dark + np.float32(rng.uniform(0, 0.3)) * strands)
    return np.clip(field, 0, 0.97).astype(np.float32)


def _paper(shape: tuple[int, ...], rng: Generator) -> Floats:
    """The paper's tone under a lamp: mostly white, else grey, falling off, a shadow at an edge."""
    if rng.random() < 0.5:
        return np.ones(shape, np.float32)
    v = np.linspace(-1, 1, shape[0], dtype=np.float32)[:, None]
    u = np.linspace(-1, 1, shape[1], dtype=np.float32)
    slope = rng.normal(0, 0.12, 2).astype(np.float32)
    tone = np.float32(rng.uniform(0.6, 1)) * (1 + slope[0] * u + slope[1] * v)
    if rng.random() < 0.3:
        edge = u * np.float32(rng.normal()) + v * np.float32(rng.normal())
        tone = tone * (
            1 - rng.uniform(0.1, 0.5) / (1 + np.exp(-12 * (edge - rng.uniform(0.5, 1.5))))
        )
    if rng.random() < 0.4:
        tone = tone + np.float32(rng.uniform(0.005, 0.03)) * rng.standard_normal(shape, np.float32)
    return np.clip(tone, 0.05, 1).astype(np.float32)
