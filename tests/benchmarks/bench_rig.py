"""How long the face takes: loading, one posed face, 64 of them, identities, strokes.

    python tests/benchmarks/bench_rig.py

The aim on one core: a face in under 10 ms, 64 faces in under 200 ms. Beside the time on the clock
stands the processor's own, which other programs on the machine do not change, and the same as a
multiple of a fixed piece of numpy (64 sums of 200 blendshapes of 10,000 vertices, one product),
which makes machines comparable. The aims are held against the processor's time.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import subprocess  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from dataset_gen.sampling import sample_identity  # noqa: E402
from facs_rig import CONTROL_NAMES, FaceParameters, load_rig  # noqa: E402
from facs_rig.rig import ASSET  # noqa: E402

REPEATS = 15
BATCH = 64
ASSET_MB = 5.0
BUDGETS = {"one face": 10.0, f"{BATCH} faces": 200.0}  # milliseconds


def faces(count: int, controls: int) -> list[FaceParameters]:
    """Random people with `controls` controls each, who turn their heads and look about."""
    out = []
    for k in range(count):
        rng = np.random.default_rng([0, k])
        chosen = rng.choice(len(CONTROL_NAMES), controls, replace=False)
        aus = {CONTROL_NAMES[c]: float(rng.uniform(0, 5)) for c in chosen}
        head, neck, gaze = rng.normal(0, 0.3, 3), rng.normal(0, 0.05, 3), rng.normal(0, 0.1, 2)
        out.append(FaceParameters(aus, sample_identity(rng), tuple(head), tuple(neck), tuple(gaze)))
    return out


def measure(work: Callable[[], object], repeats: int = REPEATS) -> tuple[float, float, float]:
    """Median and best milliseconds on the clock, median of the processor's; one run before."""
    work()
    wall, cpu = [], []
    for _ in range(repeats):
        begun, used = time.perf_counter(), time.process_time()
        work()
        wall.append(1e3 * (time.perf_counter() - begun))
        cpu.append(1e3 * (time.process_time() - used))
    return float(np.median(wall)), min(wall), float(np.median(cpu))


def fresh_load() -> float:
    """Milliseconds of the processor to load the rig in a process of its own, without imports."""
    code = (
        "import time; from facs_rig import load_rig; t = time.process_time(); load_rig(); "
        "print(1e3 * (time.process_time() - t))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def main() -> None:
    rig = load_rig()
    print(
        f"{rig.n_vertices} vertices, {len(rig.triangles)} triangles, {len(rig.keys)} keys; "
        f"loading {np.median([fresh_load() for _ in range(5)]):.0f} ms"
    )
    size = ASSET.stat().st_size / 1e6
    met = "met" if size < ASSET_MB else "MISSED"
    print(f"the baked asset {size:.2f} MB   aim {ASSET_MB:g}: {met}")
    batch = faces(BATCH, 10)
    turned = batch[0]
    upright = [FaceParameters(p.aus, p.identity) for p in batch]
    posed = rig.pose(turned)
    rng = np.random.default_rng(0)
    sums = rng.random((BATCH, 200), dtype=np.float32)
    shapes = rng.random((200, 3 * 10_000), dtype=np.float32)

    work: dict[str, Callable[[], object]] = {
        "fixed numpy": lambda: sums @ shapes,
        "one face": lambda: rig.pose(turned),
        "one face, upright": lambda: rig.pose(upright[0]),
        "one face, shape and turn": lambda: rig.turn(rig.shape(turned), turned),
        f"{BATCH} faces": lambda: rig.pose_batch(batch),
        f"{BATCH} faces, upright": lambda: rig.pose_batch(upright),
        "a person at rest": lambda: rig.neutral(turned.identity),
        "values of all keys": lambda: rig.key_values(turned),
        "points of all strokes": lambda: [rig.stroke_points(posed, name) for name in rig.strokes],
        "points of all curves": lambda: [c.points(posed) for c in rig.curves.values()],
    }
    unit = 0.0
    print(f"{'':>26} {'median':>8} {'best':>8} {'processor':>10} {'x fixed':>8}")
    for name, run in work.items():
        median, best, cpu = measure(run)
        unit = unit or cpu
        note = ""
        if name in BUDGETS:
            note = f"   aim {BUDGETS[name]:g}: {'met' if cpu < BUDGETS[name] else 'MISSED'}"
        print(f"{name:>26} {median:8.2f} {best:8.2f} {cpu:10.2f} {cpu / unit:8.2f}{note}")


if __name__ == "__main__":
    main()
