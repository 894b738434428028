"""Drawing strokes: from polylines to an antialiased picture, with a hand's looseness."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter1d

from .lines import Stroke

SUPERSAMPLING = 4
HAIR, HAIR_ODDS = ("hair_short", "hair_bob", "hair_long", "hair_bun"), 0.3


@dataclass(frozen=True)
class Style:
    """How strokes are drawn; sampled with the face and stored with it.

    width : pixels, full-strength line        fading : 0 equal width, 1 width follows strength
    wobble : pixels, slow deviation of the hand        passes : how often each line is drawn
    dropout : share of the strokes left out        layers : surface strokes that are drawn
    """

    width: float = 1.6
    fading: float = 0.6
    wobble: float = 0.0
    passes: int = 1
    dropout: float = 0.0
    layers: tuple[str, ...] = ("brow", "iris", "pupil", "lip")

    def to_json(self) -> dict:
        return {**asdict(self), "layers": list(self.layers)}


def sample_style(rng: np.random.Generator) -> Style:
    """A random style: from clean ink to a loose pen that goes over its lines."""
    loose = rng.random() < 0.5
    odds = {"brow": 0.85, "iris": 0.8, "pupil": 0.6, "lip": 0.65,
            "brow_hair": 0.15, "lash": 0.25, "lip_line": 0.25, "hairline": 0.1}  # fmt: skip
    layers = [layer for layer, p in odds.items() if rng.random() < p]
    if rng.random() < HAIR_ODDS:
        layers.append(str(rng.choice(HAIR)))
    return Style(
        width=float(rng.uniform(1.0, 2.8)),
        fading=float(rng.uniform(0.0, 0.8)),
        wobble=float(rng.uniform(0.2, 1.3)) if loose else 0.0,
        passes=int(rng.integers(1, 3)) if loose else 1,
        dropout=float(rng.choice([0.0, 0.05, 0.15])),
        layers=tuple(layers),
    )


def loosen(strokes: Iterable[Stroke], style: Style, rng: np.random.Generator) -> list[Stroke]:
    """The strokes as a hand of this style draws them: left out, wobbled, drawn over."""
    out = []
    for stroke in strokes:
        short = np.linalg.norm(np.diff(stroke.points, axis=0), axis=1).sum() < 40
        if short and rng.random() < style.dropout:
            continue
        for _ in range(style.passes):
            points = stroke.points
            if style.wobble > 0:
                noise = gaussian_filter1d(
                    rng.normal(size=points.shape), 12, axis=0, mode="nearest"
                ) + 0.15 * rng.normal(size=(1, 2))
                points = points + style.wobble * 3.0 * noise
            out.append(replace(stroke, points=points))
    return out


def ink(
    strokes: Iterable[Stroke], width: int, height: int, style: Style | None = None
) -> NDArray[np.uint8]:
    """(height, width) uint8 picture, 0 ink on 255 paper, antialiased by supersampling."""
    style = style or Style()
    s = SUPERSAMPLING
    picture = Image.new("L", (width * s, height * s), 255)
    draw = ImageDraw.Draw(picture)
    for stroke in strokes:
        if stroke.kind == "pupil" and len(stroke.points) > 8:
            draw.polygon([tuple(p) for p in stroke.points * s], fill=0)
        points = stroke.points * s
        local = style.width * stroke.width * s * (1 - style.fading * (1 - stroke.strength))
        step = max(1, int(2 / max(np.median(np.abs(np.diff(stroke.points, axis=0))), 0.2)))
        for a in range(0, len(points) - 1, step):
            b = min(a + step, len(points) - 1)
            thick = max(local[a], 0.35 * s)
            draw.line([tuple(p) for p in points[a : b + 1]], fill=0, width=round(thick))
            if thick > s:
                u, v = points[b]
                r = thick / 2
                draw.ellipse([u - r, v - r, u + r, v + r], fill=0)
    return np.asarray(picture.reduce(s))
