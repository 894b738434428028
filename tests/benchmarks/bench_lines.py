"""How long the lines of a face take: each kind, each level of detail, with and without numba.

    python tests/benchmarks/bench_lines.py

Prints medians of processor time on one core, and each as a ratio to a fixed piece of numpy work
that is measured in the same run: compare ratios, not milliseconds, between machines. The middle
level of the data set (contours, suggestive contours, ridges, valleys) has a budget of 25 ms.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from dataset_gen import draw_strokes
from dataset_gen.linework import kernels as engine
from dataset_gen.linework.lines import DETAILS, KINDS  # noqa: E402
from facs_rig import Camera, FaceParameters, load_rig  # noqa: E402

ROUNDS = 15
DEFAULT = ("contour", "suggestive")
MIDDLE = (*DEFAULT, "ridge", "valley")
FACES = (
    FaceParameters(),
    FaceParameters({"smile": 5.0, "frontalis": 3.0}, {"age": 0.5}, (0.3, 0.1, 0.0)),
    FaceParameters({"wince": 5.0}, {"gender": 1.0}, (-0.6, 0.2, 0.1)),
)


def median_ms(call, rounds: int = ROUNDS) -> float:
    """Median milliseconds of processor time of some calls after one that is not counted."""
    call()
    laps = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        laps.append(time.process_time() - start)
    return 1e3 * statistics.median(laps)


def yardstick() -> None:
    """A fixed piece of work in numpy: sums, roots and sorts of 300,000 numbers."""
    values = np.random.default_rng(0).random(300_000)
    for _ in range(3):
        values = np.sqrt(np.sort(values[::-1]) * 0.99 + np.cumsum(values) * 1e-9)


def main() -> None:
    rig = load_rig()
    posed = [rig.pose(face) for face in FACES]
    cameras = [Camera.framing(vertices, 256, 256) for vertices in posed]
    unit = median_ms(yardstick)
    print(f"numpy yardstick {unit:6.1f} ms\n")

    def report(name: str, **options) -> None:
        def call() -> None:
            for vertices, camera in zip(posed, cameras, strict=True):
                draw_strokes(rig, vertices, camera, **options)

        took = median_ms(call) / len(FACES)
        print(f"{name:42s} {took:6.1f} ms a face, {took / unit:5.2f} yardsticks")

    loops = "numba" if engine.kernels() is engine.jitted() else "numpy"
    print(f"256 px, {len(FACES)} faces, {loops}:")
    for detail, level in enumerate(DETAILS):
        report(f"{level}, contours and suggestive contours", detail=detail, kinds=DEFAULT)
        report(f"{level}, ridges and valleys as well", detail=detail, kinds=MIDDLE)
    for kind in KINDS:
        report(f"{kind} alone", layers=(), kinds=(kind,))
    report("every kind", kinds=KINDS)
    report("nothing but brows, irises, lips", kinds=())
    report("with long hair", layers=("brow", "iris", "hair_long"))


if __name__ == "__main__":
    main()
