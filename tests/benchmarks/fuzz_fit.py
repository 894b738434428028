"""Fit faces to pages that are none: scribbles, a dot, a ring, all black, a thousand strokes, noise.

    python -m tests.benchmarks.fuzz_fit [--pages 10000] [--first 0] [--method lines|thesis]

Stops at the first page that makes a fit crash, gives a number that is none, or moves a vertex
farther than Max Delta allows; seeds make pages, so that any can be had again.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
import warnings  # noqa: E402
from collections import Counter  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig  # noqa: E402
from snakes import (  # noqa: E402
    WORKING_SIZE,
    Observations,
    Tweakables,
    fit_lines,
    fit_offsets,
    head_box,
)
from tests.snakes.scribbled import SIZE, page  # noqa: E402


def situation(seed: int) -> tuple[FaceParameters, Camera, Observations, Tweakables]:
    """An expression, a camera, landmarks that may be wild, and tweakables, by lot."""
    rng = np.random.default_rng((seed, 0xF1))
    rig = load_rig()
    aus = {"smile": float(rng.uniform(0, 5)), "jaw_open": float(rng.uniform(0, 5))}
    yaw, pitch, roll = np.radians(rng.normal(0, (15, 8, 6))).tolist()
    face = FaceParameters({k: v for k, v in aus.items() if v > 2}, head=(yaw, pitch, roll))
    posed = rig.pose(face)
    framed = Camera.framing(posed, SIZE, SIZE, float(rng.uniform(0, 0.2)))
    shift = rng.normal(0, 0.1 * SIZE, 2)
    corner = (*shift, *(shift + SIZE))
    camera = framed.cropped(*corner, SIZE, SIZE)
    spots = camera.project(posed[rig.landmarks])
    spots = spots + rng.normal(0, rng.choice([1.0, 5.0, 60.0]), spots.shape)
    marks = dict(zip(LANDMARKS, map(tuple, spots.tolist()), strict=True))
    observed = Observations(marks, dict.fromkeys(marks, float(rng.uniform(0.5, 20))))
    if rng.random() < 0.2:
        observed = Observations({}, {})
    settings = Tweakables(
        max_delta=float(rng.choice([0.2, 3.0, 15.0, 60.0])),
        soft_select_distance=float(rng.choice([0.2, 1.0, 5.0])),
        smoothness=float(rng.choice([0.0, 1.0, 50.0])),
        mirror=bool(rng.random() < 0.2),
    )
    return face, camera, observed, settings


def _lines(drawing, face, camera, observed, settings):
    rig = load_rig()
    found = fit_lines(drawing, rig, face, camera, observed, settings)
    assert np.isfinite(rig.pose(found.parameters, found.offsets)).all()
    box = head_box(rig.pose(face), camera)
    return found.offsets, _limit(settings, box, found.camera)


def _thesis(drawing, face, camera, _observed, settings):
    rig = load_rig()
    found = fit_offsets(drawing, rig, face, camera, settings)
    return found.offsets, _limit(settings, found.box, camera)


def _limit(settings: Tweakables, box, camera: Camera) -> float:
    """Max Delta in metres: its pixels are those of the working image, the larger way of the two."""
    wide, high = box.width / WORKING_SIZE[0], box.height / WORKING_SIZE[1]
    return settings.max_delta * max(wide, high) / camera.scale[0]


FITS = {"lines": _lines, "thesis": _thesis}


def check(seed: int, method: str) -> str:
    """Fit page `seed`; what was on it. AssertionError, naming the page, if the fit is no fit."""
    kind, drawing = page(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        offsets, limit = FITS[method](drawing, *situation(seed))
    whole = np.isfinite(offsets).all()
    farthest = float(np.linalg.norm(offsets, axis=1).max()) if whole else float("nan")
    told = f"page {seed}, {kind}: the farthest vertex moved {farthest} m of {limit} m"
    assert whole and farthest <= 1.001 * limit + 1e-7, told
    return kind


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pages", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--method", choices=tuple(FITS), default="lines")
    options = parser.parse_args()
    start = time.perf_counter()
    done = Counter(
        check(seed, options.method) for seed in range(options.first, options.first + options.pages)
    )
    told = ", ".join(f"{count} {kind}" for kind, count in sorted(done.items()))
    print(f"{done.total()} pages in {time.perf_counter() - start:.0f} s: {told}")


if __name__ == "__main__":
    main()
