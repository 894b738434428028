"""How long a drawing by Blender's Freestyle takes at each level of detail.

    python tests/benchmarks/bench_freestyle.py

Prints medians of the time that passes and of processor time, of Freestyle's view map alone and of
all strokes, next to those of our own engine. Blender builds a view map on one core.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from dataset_gen import freestyle  # noqa: E402
from dataset_gen.linework.lines import DETAILS, draw_strokes  # noqa: E402
from facs_rig import Camera, FaceParameters, load_rig  # noqa: E402

ROUNDS = 3
FACES = (
    FaceParameters(),
    FaceParameters({"smile": 5.0, "frontalis": 3.0}, {"age": 0.5}, (0.3, 0.1, 0.0)),
    FaceParameters({"wince": 5.0}, {"gender": 1.0}, (-0.6, 0.2, 0.1)),
)


def main() -> None:
    rig = load_rig()
    posed = [rig.pose(face) for face in FACES]
    cameras = [Camera.framing(vertices, 256, 256) for vertices in posed]
    view_map, within = freestyle.view_map, []

    def timed(*arguments):
        start = time.perf_counter()
        found = view_map(*arguments)
        within.append(time.perf_counter() - start)
        return found

    freestyle.view_map = timed

    def report(name: str, draw: Callable, detail: int, **options) -> None:
        laps, work = [], []
        for turn in range(ROUNDS + 1):
            within.clear() if turn == 1 else None  # the first one warms everything up
            for vertices, camera in zip(posed, cameras, strict=True):
                start, busy = time.perf_counter(), time.process_time()
                draw(rig, vertices, camera, detail, **options)
                if turn:
                    laps.append(time.perf_counter() - start)
                    work.append(time.process_time() - busy)
        alone = f", view map {statistics.median(within):5.3f} s" if within else ""
        within.clear()
        print(f"{name:36s} {statistics.median(laps):6.3f} s a drawing, "
              f"{statistics.median(work):6.3f} s of processor time{alone}")  # fmt: skip

    size = f"{len(FACES)} faces of {len(rig.triangles)} triangles"
    print(f"Blender {freestyle.version()}, 256 px, {size}")
    for detail, level in enumerate(DETAILS):
        report(f"freestyle, {level}", freestyle.freestyle_strokes, detail)
        report(f"contours, {level}", draw_strokes, detail)
    more = ("contour", "suggestive", "valley", "boundary")
    report("freestyle, rich, valleys as well", freestyle.freestyle_strokes, 2, kinds=more)


if __name__ == "__main__":
    main()
