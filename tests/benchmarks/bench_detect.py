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
    parser.add_argument("--weights", type=Path, help="folder of other networks")
    args = parser.parse_args()
    drawings = {
        str(path): np.asarray(Image.open(path).convert("L")) / np.float32(255)
        for path in args.sketches
    } or {f"strokes, {size} x {size} px": strokes(size) for size in (256, 512, 2048)}

    laps = [time.perf_counter()]
    import onnxruntime  # noqa: F401

    laps.append(time.perf_counter())
    from classifiers import load_detector
    from classifiers.evidence import evidence

    laps.append(time.perf_counter())
    detector = load_detector(args.weights) if args.weights else load_detector()
    laps.append(time.perf_counter())
    detector.detect(next(iter(drawings.values())))
    laps.append(time.perf_counter())
    stages = ("import of ONNX Runtime", "of the detector", "load", "first detection")
    for stage, lap in zip(stages, np.diff(laps), strict=True):
        print(f"{stage} {1000 * lap:.0f} ms", end="\n" if stage == stages[-1] else ", ")
    for name, drawing in drawings.items():
        times = []
        for _ in range(args.repeats):
            begun = time.perf_counter()
            detector.detect(drawing)
            times.append(1000 * (time.perf_counter() - begun))
        begun = time.perf_counter()
        evidence(drawing, detector)
        explained = time.perf_counter() - begun
        print(
            f"{name}: {np.median(times):.1f} ms warm (best {min(times):.1f}),"
            f" evidence for all {len(detector.aus)} controls {explained:.2f} s"
        )


if __name__ == "__main__":
    main()
