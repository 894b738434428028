"""Eyes, lashes and brows by an artist's conventions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .shapes import Points, arc, ellipse, part, ribbon, smooth
from .sitter import Sitter

CLOSED = 0.075  # of an eye's width: the lids are so near each other that the eye is shut
USUAL = 0.3  # of an eye's width: how far it is open at rest
CHEERFUL = 0.25  # the least smile of which shut eyes may be arcs upward
RESTING = np.linspace(0.0, 1.0, 24)


class Eye:
    """One eye on the page. `across` and `along` are unit vectors: from the inner corner to the
    outer one, and downward; opening is the gap of the face's own lids, of the eye's width."""

    def __init__(self, sitter: Sitter, artist: Artist, side: str) -> None:
        self.side = side
        self.upper = smooth(sitter.curves[f"lid_upper_{side}"], 24)
        self.lower = smooth(sitter.curves[f"lid_lower_{side}"], 24)
        self.seen = sitter.seen[f"lid_upper_{side}"].mean() > 0.35
        self.inner, self.outer = self.upper[0], self.upper[-1]
        span = self.outer - self.inner
        self.width = max(float(np.hypot(*span)), 1e-6)
        self.across = span / self.width
        self.along = np.array([-self.across[1], self.across[0]])
        if self.along @ sitter.down < 0:
            self.along = -self.along
        self.top, self.bottom = (self.heights(line) for line in (self.upper, self.lower))
        self.opening = float(np.max(self.bottom - self.top)) / self.width / artist.eye_tall
        iris = sitter.curves[f"iris_{side}"]
        self.pupil = iris.mean(axis=0)
        high = max(float(np.ptp((iris - self.inner) @ self.along)) / artist.eye_tall, 1e-6)
        self.radius = artist.iris_size * 0.5 * high
        self.squash = float(np.ptp((iris - self.inner) @ self.across)) / high
        self.middle = (self.inner + self.outer) / 2 + self.along * float(
            np.median(self.top + self.bottom) / 2
        )

    def heights(self, line: NDArray) -> NDArray:
        """How low a line from corner to corner lies at even places along the eye."""
        x, y = (line - self.inner) @ self.across, (line - self.inner) @ self.along
        order = np.argsort(x)
        return np.interp(RESTING * self.width, x[order], y[order])

    def inside(self, points: NDArray) -> NDArray[np.bool_]:
        """(k,) which points lie between the lids."""
        x, y = (points - self.inner) @ self.across, (points - self.inner) @ self.along
        at = RESTING * self.width
        return (
            (x > 0) & (x < self.width)
            & (y > np.interp(x, at, self.top)) & (y < np.interp(x, at, self.bottom))
        )  # fmt: skip

    def between(self, points: NDArray) -> Points:
        """Points (k, 2), each moved to the nearest place between the lids above or below it."""
        x, y = (points - self.inner) @ self.across, (points - self.inner) @ self.along
        x, at = np.clip(x, 0, self.width), RESTING * self.width
        y = np.clip(y, np.interp(x, at, self.top), np.interp(x, at, self.bottom))
        return self.inner + x[:, None] * self.across + y[:, None] * self.along

    def round(self, size: float, count: int = 31, centre: NDArray | None = None) -> Points:
        """A circle of `size` irises, as far turned aside as the iris is."""
        turn = float(np.arctan2(self.across[1], self.across[0]))
        centre = self.pupil if centre is None else centre
        return ellipse(centre, size * self.radius * self.squash, size * self.radius, turn, count)


def draw_eyes(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    for side in ("left", "right"):
        eye = Eye(sitter, artist, side)
        if not eye.seen:
            continue
        if eye.opening < CLOSED:
            _closed(canvas, eye, artist, sitter.smile)
        elif artist.eye in ("dot", "oval", "round"):
            _simple(canvas, eye, artist)
        else:
            _lids(canvas, eye, artist)
            _iris(canvas, eye, artist)
        if artist.fold != "none" and artist.eye in ("almond", "lids", "upper"):
            fold = smooth(sitter.curves[f"lid_fold_{side}"], 16)
            # A fold that the lid has swallowed is no line of its own.
            if float(np.median(np.abs((fold - eye.upper[4]) @ eye.along))) > 1.5:
                canvas.line("lid", part(fold, 0.05, 0.97), 0.6, 0.75, within=True)
            if artist.fold == "double":
                under = eye.lower + 0.16 * eye.width * eye.along
                canvas.line("lid", part(under, 0.1, 0.7), 0.45, 0.5, within=True)


def _closed(canvas: Canvas, eye: Eye, artist: Artist, smile: float) -> None:
    """A shut eye is one arc, perhaps with lashes."""
    line = (eye.upper + eye.lower) / 2
    if artist.manner != "portrait":  # as an arc that everybody reads: upward in a smile
        way = -1.3 if smile > CHEERFUL and canvas.rng.random() < 0.6 else 1.0
        depth = way * canvas.rng.uniform(0.0, 0.26) * eye.width
        line = line + depth * np.sin(np.pi * np.linspace(0, 1, len(line)))[:, None] * eye.along
    heavy = {"dot": 1.2, "oval": 1.2, "round": 1.2, "thick": 1.5}.get(artist.eye, 1.3)
    canvas.line("lid", line, heavy, within=True)
    if artist.lashes != "none":
        _ticks(canvas, line[6:], eye, artist, 0.12, 1.0)


def _lids(canvas: Canvas, eye: Eye, artist: Artist) -> None:
    heavy = {"thick": 2.2, "flick": 1.7}.get(artist.lashes, 1.15)
    upper = eye.upper
    if artist.lashes == "flick":
        tip = eye.outer + eye.width * (0.14 * eye.across - 0.1 * eye.along)
        upper = smooth(np.concatenate([upper[::4], eye.outer[None], tip[None]]), 26)
    strength = 0.75 + 0.25 * np.sin(np.pi * np.linspace(0.15, 1, len(upper)))
    canvas.line("lid", upper, heavy, strength, within=True)
    if artist.eye == "almond":
        canvas.line("lid", eye.lower, 0.8, 0.85, within=True)
    elif artist.eye == "lids":
        begin = 0.35 if artist.iris in ("black", "shine") else 0.15
        canvas.line("lid", part(eye.lower, begin, 0.97), 0.65, 0.7, within=True)
    if artist.lashes == "ticks":
        _ticks(canvas, eye.upper[8:], eye, artist, 0.13, -1.0)


def _ticks(canvas: Canvas, line: Points, eye: Eye, artist: Artist, size: float, way: float) -> None:
    """Lashes: a few short strokes off a lid, up (-1) or down (1)."""
    count = int(canvas.rng.integers(3, 8))
    for root in part(line, 0.05, 1.0)[np.linspace(0, len(line) - 1, count).astype(int)]:
        out = ((root - eye.middle) @ eye.across) / eye.width
        tip = root + size * eye.width * (way * eye.along + 1.2 * out * eye.across)
        canvas.line("lash", np.stack([root, (root + tip) / 2, tip]), 0.7, np.array([1, 0.8, 0.4]))


def _iris(canvas: Canvas, eye: Eye, artist: Artist) -> None:
    """The iris between the lids: a ring and a pupil, black, or black with a highlight."""
    ring = eye.round(1.0, 41)
    if artist.iris in ("black", "shine"):
        shape = eye.between(ring)
        if artist.iris == "shine":
            shine = eye.pupil + 0.42 * eye.radius * np.array([0.8, -0.75])
            if eye.inside(shine[None])[0] and eye.radius > 2.2:
                hole = ellipse(shine, 0.36 * eye.radius, 0.36 * eye.radius, count=11)[::-1]
                near = int(np.argmin(np.linalg.norm(shape - hole[0], axis=1)))
                shape = np.concatenate([shape[: near + 1], hole, shape[near:]])
        canvas.fill(shape)
        return
    canvas.line("iris", ring, 0.8, 0.9, within=True, seen=eye.inside(ring), loose=0.3)
    pupil = eye.round(0.42)
    canvas.fill(eye.between(pupil), loose=0.2)
    if artist.iris == "rays":
        for angle in canvas.rng.uniform(0, 2 * np.pi, 9):
            way = np.array([np.cos(angle), np.sin(angle)]) * eye.radius
            ray = eye.pupil + np.array([[0.45], [0.95]]) * way
            canvas.line("iris", ray, 0.5, 0.7, within=True, seen=eye.inside(ray), loose=0.0)


def _simple(canvas: Canvas, eye: Eye, artist: Artist) -> None:
    """Dots, ovals and round eyes: the opening shows in how tall they are."""
    power = 1 + 0.4 * (artist.overdo - 1)  # what is overdone shows in it
    open_ = float(np.clip((eye.opening / USUAL) ** power, 0.25, 1.7))
    gaze = (eye.pupil - eye.middle) * 0.8
    turn = float(np.arctan2(eye.across[1], eye.across[0]))
    tall = 0.55 + 0.45 * open_
    if artist.eye == "dot":
        rx = (0.12 + 0.06 * artist.eyes) * eye.width * min(eye.squash * 1.1, 1)
        canvas.fill(ellipse(eye.middle + gaze, rx, max(1.25 * rx * open_, 0.7), turn))
        if artist.lashes in ("thick", "flick"):
            top = eye.upper - 0.1 * eye.width * eye.along
            canvas.line("lid", part(top, 0.2, 0.95), 0.9, within=True)
    elif artist.eye == "oval":
        rx = 0.26 * eye.width * min(eye.squash * 1.1, 1)
        ry = 0.45 * eye.width * open_
        if artist.iris in ("black", "shine"):
            shape = ellipse(eye.middle + gaze, rx, ry, turn)
            if artist.iris == "shine" and ry > 3:
                hole = ellipse(
                    eye.middle + gaze + [0.3 * rx, -0.45 * ry], 0.35 * rx, 0.28 * ry, count=9
                )
                shape = np.concatenate([shape, hole[::-1], shape[:1]])
            canvas.fill(shape)
        else:
            canvas.line("lid", ellipse(eye.middle, rx * 1.25, ry, turn), 1.0, within=True)
            canvas.fill(ellipse(eye.middle + gaze, 0.5 * rx, min(0.6 * rx, 0.9 * ry), turn))
    else:
        rx, ry = 0.5 * eye.width * min(1.0, eye.squash * 1.1), 0.5 * eye.width * tall
        ball = ellipse(eye.middle, rx, ry, turn, 33)
        # The lid cuts the ball from above, as far as the eye is shut.
        cut = float(np.clip(1 - 0.95 * open_, -1, 0.75))
        height = (ball - eye.middle) @ eye.along / ry
        canvas.line("lid", ball, 1.0, 1.0, within=True, seen=height > -1 + cut if cut > 0 else None)
        if cut > 0.05:
            half = np.arccos(np.clip(1 - cut, -1, 1))
            lid = arc(eye.middle, rx, ry, np.array([-np.pi / 2 - half, -np.pi / 2 + half]), turn)
            canvas.line("lid", lid, 1.5, within=True)
        r = 0.3 * rx + 0.1 * artist.iris_size * rx
        pupil = ellipse(eye.middle + gaze, r, min(r, 0.8 * ry * min(open_, 1)), turn)
        canvas.fill(pupil)


def draw_brows(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    if artist.brow == "none":
        return
    for side in ("left", "right"):
        if sitter.seen[f"lid_upper_{side}"].mean() <= 0.35:
            continue
        lower, upper = (smooth(sitter.curves[f"brow_{e}_{side}"], 20) for e in ("lower", "upper"))
        middle = (lower + upper) / 2
        half = np.linalg.norm(upper - lower, axis=1) / 2 * artist.brow_size
        size = float(half.max())
        if artist.brow == "stroke":
            thick = float(np.clip(1.5 * size / canvas.pen, 1.1, 3.4))
            canvas.line("brow", part(middle, 0.03, 0.96), thick, within=True)
        elif artist.brow == "taper":
            thick = float(np.clip(1.7 * size / canvas.pen, 1.1, 3.4))
            canvas.line("brow", middle, thick, np.linspace(1, 0.25, len(middle)), within=True)
            canvas.line("brow", part(middle, 0, 0.7), thick, 0.9, within=True)
        elif artist.brow == "double":
            for edge in (lower, upper):
                line = middle + (edge - middle) * artist.brow_size * 0.7
                canvas.line("brow", line, 1.0, 0.9, within=True)
        elif artist.brow in ("shape", "outline"):
            taper = 1 - 0.75 * np.linspace(0, 1, len(middle)) ** 1.6
            shape = ribbon(middle, 0.85 * half.max() * taper)
            if artist.brow == "shape":
                canvas.fill(shape)
            else:
                canvas.line("brow", shape, 0.9, within=True)
        else:
            _brow_hairs(canvas, sitter, artist, middle, half)


def _brow_hairs(
    canvas: Canvas, sitter: Sitter, artist: Artist, middle: Points, half: NDArray
) -> None:
    """A brow of hairs: they stand up at the nose and lie down toward the temple."""
    count = int(canvas.rng.integers(12, 30))
    t = np.sort(canvas.rng.uniform(0, 1, count))
    way = np.gradient(middle, axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    k = (t * (len(middle) - 1)).astype(int)
    size = np.maximum(half[k], 0.012 * sitter.unit)
    root = middle[k] + (0.75 * size * canvas.rng.uniform(0.2, 1, count))[:, None] * sitter.down
    lean = np.clip(0.3 + 1.3 * t + canvas.rng.normal(0, 0.2, count), 0, 1.7)[:, None]
    tip = root + size[:, None] * 2.1 * (
        way[k] * lean - sitter.down * (1 - 0.55 * np.minimum(lean, 1.5))
    )
    for a, b in zip(root, tip, strict=True):
        canvas.line(
            "brow_hair", np.stack([a, (a + b) / 2, b]), 0.85, np.array([1, 0.9, 0.5]), within=True
        )
