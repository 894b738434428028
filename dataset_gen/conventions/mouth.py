"""Mouths by an artist's conventions: closed ones as lines or lips, open ones as black shapes.

Those of comics, which are one bold shape, stand in `grins`, those of portraits in `lips` and
`teeth`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig import LANDMARKS

from .artist import Artist
from .canvas import Canvas
from .grins import LOWER, UPPER, Grin, draw_blocks, draw_grid
from .lips import draw_shut
from .shapes import Points, part, smooth
from .sitter import Sitter
from .teeth import draw_parted

# Units: rims that are at least so far apart, on the mean of GAUGES, are those of an open mouth; the
# others are drawn as lips that meet, so that no mouth is between open and shut.
OPEN = 0.031
GAUGES = [10, 20, 30]  # places along the rims
RED = 0.021  # units that the landmarks of both rims, which lie on lips, are apart where these meet
BARED, PARTED = 0.35, 0.2  # least action that bares teeth; how far it parts the lips, of its width
LEAST = 0.05  # units that lips are parted before teeth
WIDE = 0.3  # of the mouth's width: teeth of a mouth that is open so far do not meet
FINE = 41
INNER = "lip_inner"
PLAIN = Artist()
UP, DOWN = 0.3, 0.7  # of the way that lips are parted before teeth, what each of them moves


class Mouth:
    """The mouth on the page, all lines from the picture's left corner to its right one.

    upper, lower : inner rims        outer_upper, outer_lower : borders of the lips
    line : between the lips        opening : widest gap, as a share of the width
    clenched : whether lips are parted before teeth that meet: an artist shows them, the jaw is shut
    grin : its shape in comics, else None
    """

    def __init__(self, sitter: Sitter, artist: Artist = PLAIN) -> None:
        self.upper, self.lower = (
            smooth(sitter.curves[f"rim_{e}"], FINE) for e in ("upper", "lower")
        )
        self.outer_upper, self.outer_lower = (
            smooth(sitter.curves[f"lip_{e}"][::2], FINE) for e in ("upper", "lower")
        )
        self.width = max(float(np.hypot(*(self.upper[-1] - self.upper[0]))), 1e-6)
        gap = (self.lower - self.upper) @ sitter.down
        self.opening = float(gap.max()) / self.width
        self.line = (self.upper + self.lower) / 2
        # Rims that pass each other are pressed together.
        crossed = gap < 0
        self.upper[crossed] = self.lower[crossed] = self.line[crossed]
        self._unit, self._down = sitter.unit, sitter.down
        self.open = float(gap[GAUGES].clip(0).mean()) > OPEN * sitter.unit
        bares = artist.bares or artist.grin != "none"
        self.clenched = bares and not self.open and sitter.bared > BARED
        far = max(PARTED * min(sitter.bared, 1.2) * self.width, LEAST * sitter.unit)
        self._apart = far * sitter.down
        if self.clenched:
            away = self._away(np.linspace(0, 1, FINE))
            self.upper, self.lower = self.upper - UP * away, self.lower + DOWN * away
            self.outer_upper = self.outer_upper - UP * away
            self.outer_lower = self.outer_lower + DOWN * away
            self.open = True
        elif not self.open:
            self.upper = self.lower = self.line
        self.grin = None
        self._rims = self.upper, self.lower
        if self.open and artist.grin != "none":
            self.grin = Grin.of(sitter, artist, self.upper, self.lower)
            self.upper, self.lower = self.grin.upper, self.grin.lower

    def _away(self, across: NDArray) -> Points:
        """(k, 2) how far the lips are parted before teeth, at shares (k,) of the way across."""
        return np.sin(np.pi * np.clip(across, 0, 1))[:, None] ** 0.6 * self._apart

    def landmarks(self, points: Points) -> Points:
        """The face's landmarks (m, 2) with those of the lips where the lips are drawn."""
        if self.clenched:
            right, left = self.line[0], self.line[-1]
            across = (points - right) @ (left - right) / self.width**2
            share = np.array([_parts(name) for name in LANDMARKS])
            points = points + share[:, None] * self._away(across)
        points = self._on_rims(points)
        return self.grin.moved(points) if self.grin else points

    def _on_rims(self, points: Points) -> Points:
        """The landmarks (m, 2) with those of the rims as far apart as the rims are drawn."""
        way = np.array([self._down[1], -self._down[0]])
        out = points.copy()
        for k, name in enumerate(LANDMARKS):
            edge = name.startswith(LOWER)
            if name.startswith(INNER) and (edge or name.startswith(UPPER)):
                rim = self._rims[int(edge)]
                order = np.argsort(rim @ way)
                level = np.interp(points[k] @ way, (rim @ way)[order], (rim @ self._down)[order])
                level += (0.5 if edge else -0.5) * RED * self._unit
                out[k] += (level - points[k] @ self._down) * self._down
        return out

    def hole(self) -> Points:
        """The outline of what is between the lips."""
        return np.concatenate([self.upper, self.lower[::-1]])


def _parts(landmark: str) -> float:
    """How far a landmark goes along, downward, with lips that are parted by 1."""
    return -UP if landmark.startswith(UPPER) else DOWN if landmark.startswith(LOWER) else 0.0


def draw_mouth(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    mouth = Mouth(sitter, artist)
    if mouth.grin:
        _grin(canvas, sitter, artist, mouth)
        return
    if mouth.open and artist.teeth != "plain":
        draw_parted(canvas, sitter, artist, mouth)
        return
    if not mouth.open and artist.lips != "plain":
        draw_shut(canvas, sitter, artist, mouth)
        return
    lips = artist.mouth in ("lips", "dark")
    if mouth.open:
        _open(canvas, sitter, artist, mouth)
    else:
        bold = {"lips": 1.0, "dark": 1.0}.get(artist.mouth, 1.15)
        if artist.grin != "none":  # who draws bold open mouths draws shut ones so
            bold = max(bold, artist.grin_bold)
        canvas.line("mouth", mouth.line, bold, within=True)
        if artist.mouth in ("lower", "corners", "lips") and canvas.rng.random() < 0.5:
            middle = part(mouth.line, 0.38, 0.62)
            canvas.line("mouth", middle, 1.5, within=True)
    if lips:
        soft = canvas.rng.uniform(0.5, 1.0)
        canvas.line("lip", mouth.outer_upper, 0.8, soft, within=True)
        canvas.line("lip", part(mouth.outer_lower, 0.08, 0.92), 0.8, soft, within=True)
    if artist.mouth == "dark" and not mouth.open:
        shape = np.concatenate([mouth.outer_upper, mouth.line[::-1]])
        # Aslant: strokes upright would be teeth.
        canvas.blacken(shape, angle=0.7, sparse=1.4, kind="hatch", within=True)
    if artist.mouth == "lower" or (artist.mouth == "line" and canvas.rng.random() < 0.25):
        under = part(mouth.outer_lower, 0.3, 0.7) + 0.01 * sitter.unit * sitter.down
        canvas.line("lip", under, 0.8, 0.8, within=True)
    if artist.mouth == "corners":
        for k, way in ((0, -1), (-1, 1)):
            corner = mouth.line[k]
            tick = np.array([[-0.2, -0.5], [0.25, 0.0], [0.1, 0.5]]) * [way, 1] * 0.07 * sitter.unit
            points = corner + tick[:, :1] * sitter.right + tick[:, 1:] * sitter.down
            canvas.line("mouth", smooth(points, 9), 0.9, within=True)


def _grin(canvas: Canvas, sitter: Sitter, artist: Artist, mouth: Mouth) -> None:
    """The mouth of a comic: its outline, what is inside, and nothing of the face over it."""
    bold, how = artist.grin_bold, artist.open
    if not mouth.clenched and how != "rows":
        _open(canvas, sitter, artist, mouth, bold)
    else:
        canvas.line("mouth", mouth.upper, bold)
        canvas.line("mouth", mouth.lower, bold)
        if how in ("rows", "tongue"):
            draw_blocks(canvas, mouth.upper, mouth.lower, mouth.clenched)
        elif how != "outline":
            draw_grid(canvas, mouth.upper, mouth.lower, bold)
    canvas.cover(mouth.hole())


def _open(
    canvas: Canvas, sitter: Sitter, artist: Artist, mouth: Mouth, bold: float | None = None
) -> None:
    """An open mouth: its outline, and what its convention puts inside. bold : of the pen's width"""
    how = artist.open
    # What is inside tells whether the jaw is open: teeth that meet are those of a shut one.
    if mouth.clenched and how != "outline":
        how = "grid"
    elif how == "grid" and mouth.opening > WIDE:
        how = "rows"
    tall = float(((mouth.lower - mouth.upper) @ sitter.down).max())
    if tall < 4 and how in ("grid", "rows", "tongue"):
        how = "outline"
    # Where no lips are drawn around it, the outline of the hole is the mouth.
    if bold is None:
        bold = 0.9 if artist.mouth in ("lips", "dark") else 1.15
    canvas.line("mouth", mouth.upper, bold)
    canvas.line("mouth", mouth.lower, bold)
    if how == "outline":
        return
    teeth = _edge(sitter, mouth, canvas.rng.uniform(0.22, 0.42))
    gum = _edge(sitter, mouth, canvas.rng.uniform(0.75, 0.9))
    if how == "black":
        canvas.fill(mouth.hole())
    elif how == "teeth":
        canvas.line("mouth", part(teeth, 0.04, 0.96), 0.8)
        canvas.fill(np.concatenate([teeth, mouth.lower[::-1]]))
        if canvas.rng.random() < 0.3:
            _gaps(canvas, mouth.upper, teeth)
    elif how == "tongue":
        canvas.line("mouth", part(teeth, 0.04, 0.96), 0.8)
        t = np.linspace(0, 1, FINE)
        hump = np.clip(np.sin(np.pi * np.clip((t - 0.2) / 0.6, 0, 1)), 0, 1)[:, None]
        tongue = mouth.lower + hump * 0.55 * (teeth - mouth.lower)
        canvas.line("mouth", part(tongue, 0.2, 0.8), 0.8)
        canvas.fill(np.concatenate([teeth, tongue[::-1]]))
    elif how == "rows":
        canvas.line("mouth", part(teeth, 0.05, 0.95), 0.8)
        canvas.line("mouth", part(gum, 0.1, 0.9), 0.8)
        canvas.fill(np.concatenate([teeth, gum[::-1]]))
    else:
        middle = _edge(sitter, mouth, 0.5)
        canvas.line("mouth", part(middle, 0.02, 0.98), 0.8)
        _gaps(canvas, mouth.upper, mouth.lower)


def _edge(sitter: Sitter, mouth: Mouth, share: float) -> Points:
    """A line across the opening, a share of the way down, flatter than the lower lip."""
    gap = (mouth.lower - mouth.upper) @ sitter.down
    flat = np.minimum(share * gap.max(), 0.94 * gap)
    return mouth.upper + flat[:, None] * sitter.down


def _gaps(canvas: Canvas, upper: Points, lower: Points) -> None:
    """Lines between teeth, nearer to each other toward the corners."""
    count = int(canvas.rng.integers(5, 10))
    t = 0.5 + 0.46 * np.sin(np.linspace(-1.3, 1.3, count))
    k = (t * (len(upper) - 1)).astype(int)
    for a, b in zip(upper[k], lower[k], strict=True):
        if np.hypot(*(b - a)) > 2.5:
            canvas.line("mouth", np.stack([a, (a + b) / 2, b]), 0.6, 0.9, loose=0.5)
