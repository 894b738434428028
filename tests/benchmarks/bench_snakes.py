"""How long the snakes stage takes, step by step: python tests/benchmarks/bench_snakes.py

A face that differs from the default is drawn by the project's own line drawing and fitted by the
default face, so that the figures are those of a real sketch of a hundred contours: by our method
(lines: of the drawing; shape: person, head and expression; skin: snakes and offsets), then by the
thesis' own. Budgets: 100 ms for the snakes, 50 ms for the offsets.
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

from dataset_gen import draw_strokes
from dataset_gen.linework import ink
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig  # noqa: E402
from snakes import (  # noqa: E402
    HEAD,
    Observations,
    Tweakables,
    carvable,
    engrave,
    face_contours,
    face_lines,
    fit_lines,
    fit_offsets,
    unmatched_lines,
)
from snakes.active import relax  # noqa: E402
from snakes.pull import line_moves  # noqa: E402

ROUNDS = 5
OTHER = {"head_width": 0.5, "head_fat": 0.6, "eye_spacing": 0.4, "gender": 0.9}


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
    expression = {"smile": 5.0, "wince": 4.0}
    drawn = rig.pose(FaceParameters(aus=expression, identity=OTHER))
    camera = Camera.framing(drawn, 512, 512)
    strokes = draw_strokes(rig, drawn, camera, 2)
    drawing = ink(strokes, 512, 512).astype(np.float32) / 255
    parameters = FaceParameters(aus=expression)
    begin = rig.pose(parameters)
    marks = dict(zip(LANDMARKS, camera.project(drawn[rig.landmarks]), strict=True))
    observed = Observations(marks, dict.fromkeys(marks, 5.0))

    def ours():
        return fit_lines(drawing, rig, parameters, camera, observed)

    def thesis():
        return fit_offsets(drawing, rig, parameters, camera)

    for name, run in (("lines", ours), ("thesis", thesis)):
        run()  # warm up
        fits = [run() for _ in range(ROUNDS)]
        print(f"method {name}")
        for step in fits[0].timings_s:
            print(f"{step:>10} {1e3 * statistics.median(f.timings_s[step] for f in fits):8.1f} ms")
        total = statistics.median(sum(f.timings_s.values()) for f in fits)
        print(f"{'total':>10} {1e3 * total:8.1f} ms")
        if name == "lines":
            found = fits[-1]
    model = face_contours(rig, begin, camera)
    reach = (0.012 * HEAD * camera.scale[0], 0.008 * HEAD * camera.scale[0])
    took = median_ms(lambda: line_moves(model.lines, model.starts, found.drawn, reach))
    print(
        f"{len(model.starts) - 1} snakes at rest, {len(model.lines.points)} points: {took:.1f} ms"
    )

    after = face_lines(rig, rig.pose(found.parameters, found.offsets), found.camera)
    posed = rig.pose(found.parameters, found.offsets)
    loose = unmatched_lines(found.drawn, after.lines, found.camera)
    chosen = carvable(loose, rig, posed, found.camera)
    place = rig, found.parameters, found.offsets, found.camera
    for what, call in (
        (f"{len(loose)} strokes without a place found",
         lambda: unmatched_lines(found.drawn, after.lines, found.camera)),
        ("judged", lambda: carvable(loose, rig, posed, found.camera)),
        (f"{len(chosen)} engraved", lambda: engrave(*place, chosen)),
    ):  # fmt: skip
        print(f"{what} in {median_ms(call):.0f} ms")

    fit = fits[-1]
    print(f"{len(fit.contours)} contours, {sum(map(len, fit.contours))} points")
    cell = np.array([fit.box.width, fit.box.height]) / fit.render.shape[::-1]
    rings = [(line - [fit.box.left, fit.box.top]) / cell for line in fit.contours]
    settings = Tweakables(max_iterations=100)
    start = time.perf_counter()
    together = relax(fit.render, rings, settings, as_scikit_image=True)
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
        for line in rings
    ]
    end = time.perf_counter()
    apart = max(np.abs(a - b[:, ::-1] - 0.5).max() for a, b in zip(together, theirs, strict=True))
    print(
        f"the same snakes, up to 100 iterations: together {1e3 * (between - start):.0f} ms, one "
        f"by one with scikit-image {1e3 * (end - between):.0f} ms, at most {apart:.1e} px apart"
    )


if __name__ == "__main__":
    main()
