"""How well fits match faces whose shape is known, and how long they take.

    python -m tests.benchmarks.bench_fit [--faces 100] [--seed 70001] [--strangers] [--markdown]

Drawings of people and expressions that nobody trained on, in all ways, looks and papers; the true
mesh is known. Four faces are measured against it: the template, turned and laid over the drawing by
its landmarks; the template with the detected expression; that after the thesis' snakes; ours. With
--strangers the people have features, ways of doing things and creases beyond what was trained on.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from addon import pipeline  # noqa: E402
from addon.drawing import Drawing  # noqa: E402
from facs_rig import FaceParameters, load_rig  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from snakes import align  # noqa: E402
from tests.benchmarks.truth import known_face, off, stranger, turned_over  # noqa: E402

SEED = 70_001
WAYS = ("template", "expression", "thesis", "ours")


def measure(seed: int, index: int, strangers: bool = False) -> dict[str, list[float]] | None:
    """way -> lines, outline, vertices, depth, triangles turned over, seconds; None if refused."""
    who = stranger(seed, index) if strangers else None
    rig, truth = load_rig(), known_face(seed, index, identity=who)
    drawing = Drawing.of(truth.drawing)
    try:
        fits = {
            way: pipeline.fit(drawing, pipeline.FitOptions(method=method))
            for way, method in (("thesis", "thesis"), ("ours", "lines"))
        }
    except InputError:
        return None
    seen = fits["ours"].detection
    found = {}
    for way, aus in (("template", {}), ("expression", seen.expression())):
        face = FaceParameters(aus=aus, head=seen.head)
        camera = align(drawing.image, rig, face, seen.landmarks)
        found[way] = [*vars(off(rig.pose(face), camera, truth)).values(), 0, 0.0]
    for way, fit in fits.items():
        folded = turned_over(rig, rig.pose(fit.parameters), fit.vertices)
        distances = vars(off(fit.vertices, fit.camera, truth)).values()
        found[way] = [*distances, folded, fit.timings_s["total"]]
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--faces", type=int, default=100)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument(
        "--strangers", action="store_true", help="people beyond what was trained on"
    )
    parser.add_argument("--markdown", action="store_true", help="print a table for docs/fit.md")
    options = parser.parse_args()
    measured = [measure(options.seed, index, options.strangers) for index in range(options.faces)]
    faces = [m for m in measured if m]
    table = np.array([[m[way] for way in WAYS] for m in faces])
    base = table[:, :1]
    head = ("", "lines", "of the template's", "outline", "vertices", "depth",
            "nearer than the template", "turned over", "time")  # fmt: skip
    rows = [head]
    for k, way in enumerate(WAYS):
        lines, outline, vertices, depth, folded, seconds = table[:, k].T
        rows.append(
            (
                way,
                f"{np.median(lines):.2f} %",
                f"{100 * np.median(lines) / np.median(base[:, 0, 0]):.0f} %",
                f"{outline.mean():.3f}",
                f"{vertices.mean():.2f} mm",
                f"{depth.mean():.2f} mm",
                f"{100 * (vertices < base[:, 0, 2]).mean():.0f} %" if k else "",
                f"{folded.mean():.1f}" if k > 1 else "",
                f"{1e3 * np.median(seconds):.0f} ms" if k > 1 else "",
            )
        )
    print(f"{len(faces)} faces of {options.faces}, seed {options.seed}; "
          f"{len(measured) - len(faces)} refused")  # fmt: skip
    if options.markdown:
        lines_of = ["| " + " | ".join(row) + " |" for row in rows]
        print("\n".join([lines_of[0], "|---" * len(head) + "|", *lines_of[1:]]))
    else:
        width = [max(len(row[c]) for row in rows) for c in range(len(head))]
        for row in rows:
            print("  ".join(f"{cell:>{w}}" for cell, w in zip(row, width, strict=True)))


if __name__ == "__main__":
    main()
