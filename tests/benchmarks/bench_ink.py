"""How long finishing a drawing takes: the hand, the ink and the page of every style.

    python tests/benchmarks/bench_ink.py [--size PIXELS] [--repeats N]

The face's strokes are given; hatches and construction lines are timed with the styles that have
them. The aim: at most 8 ms for a drawing of 256 x 256 px in the common styles, on one core.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from dataset_gen import STYLES, draw_strokes, loosen, sample_style
from dataset_gen.linework import ink
from dataset_gen.page import draw_page  # noqa: E402
from dataset_gen.sampling import sample_face, sample_rng  # noqa: E402
from dataset_gen.shading import construction, hatches  # noqa: E402
from facs_rig import load_rig  # noqa: E402

FACES = 6


def timed(work: Callable[[], object], repeats: int) -> float:
    """Milliseconds of the fastest of `repeats` runs."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return 1000 * min(times)


def added(rig, posed, camera, style, rng) -> list:
    """What the style adds to a face's strokes."""
    helping = construction(rig, posed, camera) if style.construction else []
    return helping + hatches(rig, posed, camera, style, rng)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--repeats", type=int, default=10)
    args = parser.parse_args()
    rig, faces = load_rig(), []
    for index in range(FACES):
        sample = sample_face(rig, sample_rng(11, index), args.size)
        posed = rig.pose(sample.parameters)
        strokes = draw_strokes(rig, posed, sample.camera, 1, sample.style.layers)
        faces.append((posed, sample.camera, strokes))
    print(f"{FACES} faces of {np.mean([len(f[2]) for f in faces]):.0f} strokes, "
          f"{args.size} x {args.size} px, ms of one core, mean")  # fmt: skip
    print(f"{'style':12}{'added':>8}{'hand':>8}{'ink':>8}{'all':>8}")
    rng = np.random.default_rng(0)
    for name, style in STYLES.items():
        rows = []
        for posed, camera, strokes in faces:
            every = [*added(rig, posed, camera, style, rng), *strokes]
            drawn = loosen(every, style, rng)
            work = (
                partial(added, rig, posed, camera, style, rng),
                partial(loosen, every, style, rng),
                partial(ink, drawn, args.size, args.size, style),
            )
            rows.append([timed(job, args.repeats) for job in work])
        mean = np.mean(rows, axis=0)
        print(f"{name:12}" + "".join(f"{x:8.1f}" for x in (*mean, mean.sum())))
    sampled = []
    for k in range(12 * FACES):
        style = sample_style(rng)
        posed, camera, strokes = faces[k % FACES]
        page = partial(draw_page, strokes, rig, posed, camera, style, rng)
        sampled.append(timed(page, args.repeats))
    print(f"sample_style: {np.mean(sampled):.1f} ms, median {np.median(sampled):.1f}")


if __name__ == "__main__":
    main()
