"""How long a warm fit takes, stage by stage, and what its parts cost.

    python tests/benchmarks/bench_pipeline.py [SKETCH…]

Prints medians over a few rounds; quote them as such, machines differ and are shared.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from addon import pipeline  # noqa: E402
from dataset_gen import draw_strokes
from dataset_gen.generate import make_sample  # noqa: E402
from dataset_gen.linework import ink
from facs_rig import Camera, FaceParameters, load_rig, rasterise  # noqa: E402

ROUNDS = 5
SKETCHES = sorted((Path(pipeline.__file__).parent / "sketches").glob("*.png"))


def median_ms(call) -> float:
    """Median milliseconds of ROUNDS calls after one that is not counted."""
    call()
    laps = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        call()
        laps.append(time.perf_counter() - start)
    return 1e3 * statistics.median(laps)


def main() -> None:
    rig = load_rig()
    face = FaceParameters({"smile": 5.0, "frontalis": 3.0}, {"age": 0.5}, (0.3, 0.1, 0.0))
    posed = rig.pose(face)
    camera = Camera.framing(posed, 256, 256)
    strokes = draw_strokes(rig, posed, camera)
    batch = [face] * 64
    for name, call in {
        "pose one face": lambda: rig.pose(face),
        "pose a batch of 64": lambda: rig.pose_batch(batch),
        "rasterise at 512 px": lambda: rasterise(
            posed, rig.triangles, Camera.framing(posed, 512, 512)
        ),
        "lines of a face at 256 px": lambda: draw_strokes(rig, posed, camera),
        "ink at 256 px": lambda: ink(strokes, 256, 256),
        "a sample of the data set": lambda: make_sample(0, 0),
    }.items():
        print(f"{name:28s} {median_ms(call):8.1f} ms")
    for path in [Path(p) for p in sys.argv[1:]] or SKETCHES:
        pipeline.fit(path)
        fits = [pipeline.fit(path) for _ in range(ROUNDS)]
        for fit in fits:
            pipeline.report(fit)
        laps = [fit.timings_s for fit in fits]
        stages = {s: 1e3 * statistics.median(lap[s] for lap in laps) for s in laps[0]}
        print(f"\nfit {path.name}, warm:")
        for stage, value in stages.items():
            print(f"  {stage:26s} {value:8.1f} ms")


if __name__ == "__main__":
    main()
