"""How long detecting an expression takes: loading, the first sketch, warm sketches.

    python tests/benchmarks/bench_detect.py [SKETCH ...]

Without sketches a drawing of a few hundred random strokes is used; the time does not depend on what
is drawn. The thesis: 23.3 s for twelve action units. The aim: under 50 ms for all of them, warm.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))


def strokes(size: int) -> np.ndarray:
    rng = np.random.default_rng(0)
    image = Image.new("L", (size, size), 255)
    draw = ImageDraw.Draw(image)
    for _ in range(300):
        points = rng.uniform(0.1, 0.9, 2) * size + np.cumsum(rng.normal(0, size / 60, (8, 2)), 0)
        draw.line(points.ravel().tolist(), fill=0, width=max(size // 250, 1))
    return np.asarray(image) / np.float32(255)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("sketches", nargs="*", type=Path)
    parser.add_argument("--repeats", type=int, default=40)
    args = parser.parse_args()
    drawings = {
        str(path): np.asarray(Image.open(path).convert("L")) / np.float32(255)
        for path in args.sketches
    } or {f"strokes, {size} x {size} px": strokes(size) for size in (256, 512, 2048)}

    begun = time.perf_counter()
    from classifiers import load_detector

    imported = time.perf_counter()
    detector = load_detector()
    loaded = time.perf_counter()
    detector.detect(next(iter(drawings.values())))
    first = time.perf_counter()
    print(
        f"import {1000 * (imported - begun):.0f} ms, load {1000 * (loaded - imported):.0f} ms,",
        end=" ",
    )
    print(f"first detection {1000 * (first - loaded):.0f} ms")
    for name, drawing in drawings.items():
        times = []
        for _ in range(args.repeats):
            begun = time.perf_counter()
            detector.detect(drawing)
            times.append(1000 * (time.perf_counter() - begun))
        print(f"{name}: {np.median(times):.1f} ms warm (best {min(times):.1f})")


if __name__ == "__main__":
    main()
