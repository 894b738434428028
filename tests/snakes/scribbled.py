"""Pages that nobody would call a face: what the fit must survive."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

SIZE = 200
KINDS = ("scribbles", "dot", "ring", "black", "crowd", "hairline", "noise", "grid", "blank")


def page(seed: int, size: int = SIZE) -> tuple[str, np.ndarray]:
    """What is on page `seed`, and the page (size, size) float32, 1 is paper."""
    rng = np.random.default_rng((seed, 0xF0))
    kind = KINDS[seed % len(KINDS)]
    image = Image.new("L", (size, size), 255)
    draw = ImageDraw.Draw(image)

    def strokes(count: int, most: int) -> None:
        for _ in range(count):
            start = rng.uniform(-0.1, 1.1, 2) * size
            walk = rng.normal(0, rng.uniform(1, size / 8), (int(rng.integers(2, most)), 2))
            points = start + np.cumsum(walk, axis=0)
            draw.line(points.ravel().tolist(), fill=0, width=int(rng.integers(1, 6)))

    if kind == "scribbles":
        strokes(int(rng.integers(1, 40)), 20)
    elif kind == "dot":
        u, v = rng.uniform(0, size, 2)
        draw.ellipse([u, v, u + 3, v + 3], fill=0)
    elif kind == "ring":
        u, v, r = rng.uniform(0.2, 0.8) * size, rng.uniform(0.2, 0.8) * size, rng.uniform(3, size)
        draw.ellipse([u - r, v - r, u + r, v + r], outline=0, width=int(rng.integers(1, 8)))
    elif kind == "black":
        draw.rectangle([0, 0, size, size], fill=0)
    elif kind == "crowd":
        strokes(1000, 6)
    elif kind == "hairline":
        draw.line([*(rng.uniform(0, size, 4))], fill=int(rng.integers(0, 250)), width=1)
    elif kind == "noise":
        image = Image.fromarray(rng.integers(0, 256, (size, size), dtype=np.uint8))
    elif kind == "grid":
        for k in range(0, size, int(rng.integers(3, 40))):
            draw.line([k, 0, k, size], fill=0)
            draw.line([0, k, size, k], fill=0)
    return kind, np.asarray(image, dtype=np.float32) / 255
