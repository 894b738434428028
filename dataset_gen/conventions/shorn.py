"""Hair so short that the skull is seen through it: a band of tone between outline and hairline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .artist import Artist, lot
from .canvas import Canvas
from .cut import STEPS, Hair
from .patches import Patch, ticks
from .shapes import normals, smooth, wave
from .sitter import Sitter

WAYS = {"hatched": 3.0, "solid": 2.0, "dots": 1.0, "fade": 1.5, "lit": 1.5}
ALSO = {"crop": 0.3, "receding": 0.25}  # how often these are drawn so, too
THIN, BROAD = (0.06, 0.2), (0.15, 0.5)  # units, the band over the crown


def is_shorn(canvas: Canvas, artist: Artist) -> bool:
    """Whether this cut is drawn as tone on the skull; of some cuts by lot."""
    if artist.finish == "curls":
        return False
    return artist.cut == "shorn" or (
        artist.cut in ALSO and bool(canvas.rng.random() < ALSO[artist.cut])
    )


def shaven(canvas: Canvas, sitter: Sitter, hair: Hair) -> Hair:
    """The hair with its hairline as high as the band is broad, by lot with square temples."""
    rng = canvas.rng
    centre = sitter.face.mean(axis=0)
    inner, outer = (np.linalg.norm(line - centre, axis=1) for line in (hair.inner, hair.outer))
    angle = np.linspace(-1, 1, STEPS) * 0.55 * np.pi
    thin = rng.uniform(*(THIN if rng.random() < 0.55 else BROAD)) * sitter.unit
    side = rng.uniform(0.4, 1.2)
    band = thin * (side + (1 - side) * np.cos(np.clip(angle, -np.pi / 2, np.pi / 2)) ** 2)
    if rng.random() < 0.5:
        raised = np.maximum(inner, outer - band)
    else:  # as it is, but for the crown
        raised = inner
    if rng.random() < 0.5:
        across, up = (
            np.abs((hair.inner - centre) @ sitter.right),
            (hair.inner - centre) @ -(sitter.down),
        )
        top, wide = up.max(), np.quantile(across, 0.9) * rng.uniform(0.82, 0.95)
        reach = np.stack([across / inner, np.maximum(up, 0) / inner], axis=1)
        box = 1 / np.maximum(reach[:, 0] / wide, reach[:, 1] / (top * rng.uniform(0.97, 1.08)))
        raised = np.where(up > 0.25 * top, np.maximum(raised, box), raised)
    if rng.random() < 0.4:
        raised = raised + 0.02 * sitter.unit * wave(rng, 1, STEPS, 3)[0]
    raised = np.minimum(raised, outer - np.minimum(band, 0.05 * sitter.unit))
    line = centre + (raised / np.maximum(inner, 1e-9))[:, None] * (hair.inner - centre)
    return replace(hair, inner=line)


def draw_shorn(canvas: Canvas, sitter: Sitter, artist: Artist, hair: Hair) -> None:
    """By one of WAYS, by lot, with or without lines around it."""
    rng = canvas.rng
    odds = dict(WAYS)
    if artist.finish == "black":
        odds.update(solid=8.0, dots=0.2)
    patch = Patch(hair.inner, hair.outer)
    {"hatched": _hatched, "solid": _solid, "dots": _dots, "fade": _fade, "lit": _lit}[
        lot(rng, odds)
    ](canvas, sitter, patch)
    if rng.random() < 0.75:
        canvas.line("hair", smooth(hair.outer[::2], 60), rng.uniform(0.7, 1.5), loose=0.6)
    if rng.random() < 0.3:
        canvas.line("hair", smooth(hair.inner[::3], 48), rng.uniform(0.5, 0.9), 0.8, loose=0.6)


def _strokes(
    canvas: Canvas, sitter: Sitter, patch: Patch, cover: float, odds, low: float = 0.8,
    length: float | None = None, dark: float = 1.0,
) -> None:  # fmt: skip
    """Short strokes side by side that cover the patch so many times, one way or another.

    odds : (across (n,), up (n,)) -> (n,), how many of them are drawn there
    """
    rng = canvas.rng
    along = rng.random() < 0.4
    length = sitter.unit * (rng.uniform(0.05, 0.2) if length is None else length)
    length = max(length, 2.0 * canvas.pen)
    width, lean, stray = rng.uniform(0.6, 1.2), rng.uniform(-0.7, 0.7), rng.uniform(0.05, 0.3)
    n = patch.covered(canvas, 1.6 * cover, length, width)
    across, up = patch.scattered(rng, n, low)
    kept = rng.random(n) < odds(across, up)
    across, up = across[kept], up[kept]
    n = len(across)
    out = patch.at(across, np.ones(n)) - patch.at(across, np.zeros(n))
    tall = np.hypot(*out.T)
    out /= np.maximum(tall, 1e-9)[:, None]
    angle = np.arctan2(out[:, 1], out[:, 0]) + lean + stray * rng.normal(size=n) + along * np.pi / 2
    long = length * rng.uniform(0.6, 1.3, n)
    if not along:
        long = np.minimum(long, 0.8 * tall + 1.5)
    ways = long[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    strong = np.clip(dark * rng.uniform(0.7, 1.1, n), 0, 1)
    roots = patch.at(across, up) - ways / 2
    ticks(canvas, "hair", roots, ways, width, strong, rng.normal(0, 0.08))


def _sides(across):
    """0 over the forehead to 1 at the ears."""
    return np.clip(2 * np.abs(across - 0.5), 0, 1)


def _hatched(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Parallel strokes, denser at the outline and the sides."""
    rng = canvas.rng
    edge, side = rng.uniform(0, 0.7, 2)

    def odds(across, up):
        return 1 - edge * (1 - up) - side * (1 - _sides(across)) * (1 - up)

    for _ in range(int(rng.choice([1, 1, 2]))):
        _strokes(canvas, sitter, patch, rng.uniform(0.5, 1.5), odds, rng.uniform(0.5, 1.0))
    if rng.random() < 0.4:
        rim = patch.strip((rng.uniform(0.4, 0.8), 1.0), (rng.uniform(0.4, 0.8), 1.0), 0.0)
        _strokes(canvas, sitter, rim, 1.2, lambda across, up: 1.0)


def _dots(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """An even tone of dots or the shortest strokes."""
    rng = canvas.rng
    tone, length = rng.uniform(0.2, 0.7), rng.uniform(0.01, 0.045)
    dark = rng.uniform(0.6, 1.0)
    _strokes(canvas, sitter, patch, tone, lambda across, up: 1.0, 1.0, length, dark)


def _solid(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Black between outline and hairline, whose edge is crisp or fuzzy."""
    rng = canvas.rng
    dense = float(rng.choice([1.0, 1.0, 1.4]))
    canvas.blacken(patch.outline, float(rng.uniform(-1.4, 1.4)), dense, "hair")
    if rng.random() < 0.5:
        return
    for line, way in ((patch.low, 1.0), (patch.high, rng.uniform(0, 0.5))):
        n = int(rng.integers(60, 160))
        k = rng.integers(0, len(line), n)
        out = (
            normals(line) * np.sign((normals(line) * (patch.high - patch.low)).sum(axis=1))[:, None]
        )
        long = sitter.unit * rng.uniform(0.03, 0.09, (n, 1)) * way
        away = out[k] + 0.4 * rng.normal(size=(n, 2))
        if way == 1.0:
            away = -away
        roots = line[k] + (line[np.minimum(k + 1, len(line) - 1)] - line[k]) * rng.random((n, 1))
        ticks(canvas, "hair", roots - 0.5 * long * away, 1.5 * long * away, 0.8)


def _fade(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Dark over the crown, lighter toward the ears."""
    rng = canvas.rng
    where, soft = rng.uniform(0.35, 0.8), rng.uniform(0.1, 0.4)
    if rng.random() < 0.6:
        t = np.linspace(0.5 - 0.5 * where, 0.5 + 0.5 * where, 40)
        top = Patch(patch.at(t, np.zeros(40)), patch.at(t, np.ones(40)))
        canvas.blacken(top.outline, float(rng.uniform(0.6, 2.4)), rng.choice([1.0, 1.5, 2.0]),
                       "hair")  # fmt: skip

    def odds(across, up):
        return 1 - 0.85 * np.clip((_sides(across) - where) / soft, 0, 1)

    _strokes(canvas, sitter, patch, rng.uniform(0.9, 1.8), odds)


def _lit(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """Light from in front: dark at the sides and the outline, light over the forehead."""
    rng = canvas.rng
    reach, rim = rng.uniform(0.3, 0.8), rng.uniform(0.6, 0.9)

    def odds(across, up):
        return np.maximum(np.clip((_sides(across) - reach) / 0.2, 0.06, 1), up > rim)

    _strokes(canvas, sitter, patch, rng.uniform(0.9, 1.8), odds)
    if rng.random() < 0.6:  # the hairline
        low = patch.strip((0.0, 0.15), (0.0, 0.15), 0.0)
        _strokes(canvas, sitter, low, 0.4, lambda across, up: 1.0, 1.0, 0.05, 0.8)
