"""How many finished drawings a second: sampled, posed, drawn, inked and written into shards.

    python tests/benchmarks/bench_generate.py [--jobs 2] [--shards 3] [--freestyle]

Prints the rate of `jobs` processes writing `shards` shards of 100 each, on every level of detail
with the kinds of lines of that level (WAYS["levels"] of dataset_gen.linework.lines), and as the
data set has them, all by lot, and the same without hair (--hair 0); the time to start the processes
is not counted. Budget: 50 a second on two cores at the middle level. With --freestyle also the rate
of Blender's Freestyle (needs bpy).
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from concurrent.futures import ProcessPoolExecutor  # noqa: E402
from dataclasses import replace  # noqa: E402
from multiprocessing import get_context  # noqa: E402
from pathlib import Path  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from dataset_gen import samples  # noqa: E402
from dataset_gen.hairdo import HAIR  # noqa: E402
from dataset_gen.linework.lines import DETAILS, WAYS  # noqa: E402
from dataset_gen.samples import Recipe  # noqa: E402
from dataset_gen.sampling import sample_face  # noqa: E402
from dataset_gen.shards import write_shard  # noqa: E402

SHARD = 100


def prepare(level: int | None, engine: str) -> None:
    """What every worker does once: fix the level of detail, and draw what compiles the loops."""

    def at_level(*arguments):
        sample = sample_face(*arguments)
        return replace(sample, detail=level, kinds=WAYS["levels"][level])

    samples.sample_face = sample_face if level is None else at_level  # type: ignore[assignment]
    for index in range(3):
        samples.make_sample(99, index, engine=engine)


def rate(
    level: int | None, jobs: int, shards: int, engine: str = "contours", each: int = SHARD,
    hair: float = HAIR,
) -> float:  # fmt: skip
    """Finished samples a second."""
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(
            jobs, get_context("spawn"), initializer=prepare, initargs=(level, engine)
        ) as pool,
    ):
        list(pool.map(time.sleep, [1.0] * jobs))  # every worker is there and ready
        start = time.perf_counter()
        todo = [
            pool.submit(
                write_shard,
                Path(folder) / f"shard-{k:06d}.tar",
                range(k * each, (k + 1) * each),
                Recipe(1, engine=engine, hair=hair),
            )
            for k in range(jobs * shards)
        ]
        done = sum(future.result() for future in todo)
        return done / (time.perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--shards", type=int, default=3, help="of each process")
    parser.add_argument("--freestyle", action="store_true")
    options = parser.parse_args()
    print(f"finished 256 px drawings a second, {options.jobs} processes")
    for level, name in enumerate(DETAILS):
        print(f"{name:10s} {rate(level, options.jobs, options.shards):6.1f}", flush=True)
    print(f"{'by lot':10s} {rate(None, options.jobs, options.shards):6.1f}", flush=True)
    each = rate(None, options.jobs, options.shards, hair=0)
    print(f"{'no hair':10s} {each:6.1f}", flush=True)
    each = rate(None, options.jobs, options.shards, "conventions")
    print(f"{'conventions':11s} {each:5.1f}", flush=True)
    if options.freestyle:
        each = rate(None, options.jobs, 1, "freestyle", 10)
        print(f"{'freestyle':10s} {each:6.1f}")


if __name__ == "__main__":
    main()
