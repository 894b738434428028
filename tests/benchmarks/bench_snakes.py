"""How long the snakes stage takes, step by step: python tests/benchmarks/bench_snakes.py

A face that differs from the default is drawn by the project's own line drawing and fitted by the
default face, so that the figures are those of a real sketch of a hundred contours.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
from skimage.segmentation import active_contour  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from dataset_gen import draw_strokes, ink  # noqa: E402
from facs_rig import Camera, FaceParameters, load_rig  # noqa: E402
from snakes import (  # noqa: E402
    Tweakables,
    carvable,
    engrave,
    fit_offsets,
    unmatched_strokes,
)
from snakes.active import relax  # noqa: E402

ROUNDS = 5
OTHER = {"head_width": 0.5, "head_fat": 0.6, "eye_spacing": 0.4, "gender": 0.9}


def main() -> None:
    rig = load_rig()
    expression = {"smile": 5.0, "wince": 4.0}
    drawn = rig.pose(FaceParameters(aus=expression, identity=OTHER))
    camera = Camera.framing(drawn, 512, 512)
    strokes = draw_strokes(rig, drawn, camera, 2)
    drawing = ink(strokes, 512, 512).astype(np.float32) / 255
    parameters = FaceParameters(aus=expression)
    fit_offsets(drawing, rig, parameters, camera)  # warm up
    fits = [fit_offsets(drawing, rig, parameters, camera) for _ in range(ROUNDS)]
    fit = fits[-1]
    points = sum(map(len, fit.contours))
    print(f"{len(fit.contours)} contours, {points} points, {len(fit.deltas.pixels)} pixel deltas")
    for step in fit.timings_s:
        print(f"{step:>10} {1e3 * statistics.median(f.timings_s[step] for f in fits):8.1f} ms")
    total = statistics.median(sum(f.timings_s.values()) for f in fits)
    print(f"{'total':>10} {1e3 * total:8.1f} ms")

    posed = rig.pose(parameters, fit.offsets)
    laps: list[list[float]] = []
    for _ in range(ROUNDS):
        times = [time.perf_counter()]
        loose = unmatched_strokes(drawing, fit.unmatched, posed, camera)
        times.append(time.perf_counter())
        chosen = carvable(loose, rig, posed, camera)
        times.append(time.perf_counter())
        engrave(rig, parameters, fit.offsets, camera, chosen)
        times.append(time.perf_counter())
        laps.append([1e3 * (b - a) for a, b in zip(times, times[1:], strict=False)])
    found, judged, carved = map(statistics.median, zip(*laps, strict=True))
    print(
        f"{len(loose)} strokes without a place found in {found:.0f} ms, judged in {judged:.0f} ms, "
        f"{len(chosen)} engraved in {carved:.0f} ms"
    )

    cell = np.array([fit.box[2] - fit.box[0], fit.box[3] - fit.box[1]]) / fit.render.shape[::-1]
    contours = [(line - fit.box[:2]) / cell for line in fit.contours]
    settings = Tweakables(max_iterations=100)
    start = time.perf_counter()
    ours = relax(fit.render, contours, settings, as_scikit_image=True)
    between = time.perf_counter()
    image = fit.render.astype(np.float64)
    theirs = [
        active_contour(
            image,
            line[:, ::-1] - 0.5,
            beta=settings.smoothness,
            gamma=settings.time_stepping,
            w_line=settings.brightness_weight,
            w_edge=settings.edge_weight,
            max_px_move=settings.max_step,
            max_num_iter=settings.max_iterations,
            convergence=settings.convergence,
            boundary_condition=settings.snake_type,
        )
        for line in contours
    ]
    end = time.perf_counter()
    apart = max(np.abs(a - b[:, ::-1] - 0.5).max() for a, b in zip(ours, theirs, strict=True))
    print(
        f"the same snakes, up to 100 iterations: together {1e3 * (between - start):.0f} ms, one "
        f"by one with scikit-image {1e3 * (end - between):.0f} ms, at most {apart:.1e} px apart"
    )


if __name__ == "__main__":
    main()
