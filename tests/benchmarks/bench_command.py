"""How long the command takes from nothing, and what of it goes where.

    python tests/benchmarks/bench_command.py [--rounds 5]

The least of some rounds, wall and processor seconds: the whole command as an artist starts it, its
imports alone, and the writing of a .glb with its size. Without numba, as in Blender.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SKETCH = ROOT / "addon" / "sketches" / "smiling_woman.png"
ALONE = {**os.environ, "SKETCH2FACE_NUMBA": "0"}
WRITE = """
import sys, time
from pathlib import Path
from addon.export import write_mesh
from facs_rig import FaceParameters, load_rig
rig, face = load_rig(), FaceParameters({"smile": 4.0}, head=(0.2, 0.1, 0.0))
path = Path(sys.argv[1])
write_mesh(path, rig, face)
for _ in range(5):
    wall, cpu = time.perf_counter(), time.process_time()
    write_mesh(path, rig, face)
    print(time.perf_counter() - wall, time.process_time() - cpu)
"""


def least(call: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Least wall and processor seconds of a call that starts one process."""

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    laps = []
    for _ in range(rounds):
        wall, cpu = time.perf_counter(), used()
        call()
        laps.append((time.perf_counter() - wall, used() - cpu))
    walls, cpus = zip(*laps, strict=True)
    return min(walls), min(cpus)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as folder:
        face = str(Path(folder) / "face.glb")
        wanted = ["--report", f"{folder}/face.json", "--preview", f"{folder}/face.png"]

        def python(*arguments: str) -> str:
            command = [sys.executable, *arguments]
            return subprocess.run(
                command, cwd=ROOT, env=ALONE, check=True, capture_output=True, text=True
            ).stdout

        for name, arguments in {
            "fit, report, preview": ("-m", "addon", "fit", str(SKETCH), "-o", face, *wanted),
            "fit": ("-m", "addon", "fit", str(SKETCH), "-o", face),
            "imports": ("-c", "import addon.pipeline, addon.export"),
        }.items():
            wall, cpu = least(lambda these=arguments: python(*these), rounds)
            print(f"{name:24s} {wall:6.2f} s   processor {cpu:6.2f} s")
        laps = [list(map(float, line.split())) for line in python("-c", WRITE, face).splitlines()]
        wall, cpu = (min(column) for column in zip(*laps, strict=True))
        size = Path(face).stat().st_size / 1e6
        print(f"{'a .glb, warm':24s} {wall:6.2f} s   processor {cpu:6.2f} s   {size:.1f} MB")


if __name__ == "__main__":
    main()
