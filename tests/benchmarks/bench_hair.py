"""How well a head of hair is found again from where it lies on a page, and how long that takes.

    python -m tests.benchmarks.bench_hair [--heads 100] [--seed 0]

People with the presets' cuts, two in three of them varied, in any view up to 40 degrees. The hair's
region is given, what is measured is the cut alone: the overlap of true and refitted hair
(intersection over union) in the same view, and from the side that the view did not show.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402
from time import perf_counter  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from facs_rig import Camera, FaceParameters, load_rig, rasterise  # noqa: E402
from facs_rig.common.box import Box  # noqa: E402
from facs_rig.hair.cut import ANGLES, Cut  # noqa: E402
from facs_rig.hair.mesh import HairMesh, hair_mesh  # noqa: E402
from facs_rig.hair.presets import PRESETS, preset  # noqa: E402
from snakes.hair.cut_fit import fit_cut  # noqa: E402
from snakes.hair.region import PageHair  # noqa: E402
from snakes.hair.texture import Strokes  # noqa: E402

WIDTH, HEIGHT = 220, 260


def varied(cut: Cut, rng: np.random.Generator) -> Cut:
    """A cut of other lengths and another thickness."""
    edge = cut.edge + rng.normal(0, 0.06) + rng.normal(0, 0.05) * np.cos(ANGLES)
    return replace(cut, edge=np.minimum(edge, 0.9), thick=cut.thick * rng.uniform(0.6, 1.6))


def shown(hair: HairMesh, face: NDArray, camera: Camera) -> NDArray[np.bool_]:
    """(h, w) where hair is seen on a posed face."""
    triangles = load_rig().triangles
    every = np.concatenate([triangles, hair.triangles + len(face)])
    found = rasterise(np.concatenate([face, hair.on(face)]), every, camera)
    return found.triangle >= len(triangles)


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Intersection over union."""
    return float((one & other).sum() / max((one | other).sum(), 1))


def measure(name: str, vary: bool, rng: np.random.Generator) -> tuple[float, float, float]:
    """Overlap in the same view, from the other side, and seconds of `fit_cut`."""
    rig = load_rig()
    cut = varied(preset(name), rng) if vary else preset(name)
    who = {"gender": float(rng.integers(2)), "age": float(rng.uniform(0.1, 0.8))}
    yaw, pitch, roll = np.radians([rng.uniform(-40, 40), rng.normal(0, 6), rng.normal(0, 5)])
    person = FaceParameters(identity=who, head=(float(yaw), float(pitch), float(roll)))
    face, hair = rig.pose(person), hair_mesh(rig, who, cut, "surface")
    camera = Camera.framing(np.concatenate([face, hair.on(face)]), WIDTH, HEIGHT, 0.03)
    region = shown(hair, face, camera)
    nothing = np.zeros(region.shape, dtype=bool)
    page = PageHair(
        Box(0, 0, WIDTH, HEIGHT), region, nothing,
        rasterise(face, rig.triangles, camera).triangle >= 0, np.zeros((0, 2)), 0.7, "strands",
        Strokes(np.zeros((*region.shape, 2)), np.zeros(region.shape)), None,
    )  # fmt: skip
    start = perf_counter()
    found = fit_cut(page, rig, person, face, camera)
    seconds = perf_counter() - start
    if found is None:
        return 0.0, 0.0, seconds
    ours = hair_mesh(rig, who, found, "surface")
    side = rig.pose(replace(person, head=(np.pi / 2 if yaw < 0 else -np.pi / 2, 0.0, 0.0)))
    beside = Camera.framing(np.concatenate([side, hair.on(side)]), WIDTH, HEIGHT, 0.03)
    return (
        overlap(region, shown(ours, face, camera)),
        overlap(shown(hair, side, beside), shown(ours, side, beside)),
        seconds,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--heads", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng, names = np.random.default_rng(options.seed), list(PRESETS)
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in names}
    for k in range(options.heads):
        name = names[k % len(names)]
        found[name].append(measure(name, bool(k // len(names) % 3), rng))
    for name, rows in found.items():
        if rows:
            same, side, _ = np.mean(rows, axis=0)
            print(f"{name:14} same view {same:.3f}  other side {side:.3f}")
    table = np.array([row for rows in found.values() for row in rows])
    (same, side, _), (least, worst, _) = table.mean(axis=0), table.min(axis=0)
    print(
        f"{len(table)} heads: same view {same:.3f} (lowest {least:.2f}), other side {side:.3f}"
        f" (lowest {worst:.2f}), {1e3 * np.median(table[:, 2]):.0f} ms"
    )


if __name__ == "__main__":
    main()
