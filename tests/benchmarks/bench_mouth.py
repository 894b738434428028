"""Whether mouths that are drawn open come out open, and shut ones shut.

    python -m tests.benchmarks.bench_mouth [--faces 100] [--seed 90001] [--markdown]

Drawings that nobody trained on, by conventions and by contours, of people who feel something, and
contours of smiles that show teeth. What was drawn is known: the gap between the inner rims of the
lips, at five places across the mouth, in millimetres of the face; where an artist draws one line
between the lips it is 0. The fitted face's is measured in the drawing's view.

gap : as drawn      off, bias : mean and signed error of the fitted one
read : mean error of the opening by landmarks, before any fit
shut : of mouths drawn open (3 mm and more), those fitted as shut (under 1 mm)
open : of mouths drawn shut (under 1 mm), those fitted as open (3 mm and more)
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import math  # noqa: E402
import sys  # noqa: E402
from collections import defaultdict  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from addon import pipeline  # noqa: E402
from dataset_gen.conventions.artist import Artist  # noqa: E402
from dataset_gen.conventions.mouth import Mouth  # noqa: E402
from dataset_gen.conventions.places import places_of  # noqa: E402
from dataset_gen.conventions.shapes import smooth  # noqa: E402
from dataset_gen.conventions.sitter import sit  # noqa: E402
from dataset_gen.generate import make_sample  # noqa: E402
from dataset_gen.linework.paper import through  # noqa: E402
from facs_rig import Camera, FaceParameters, FaceRig, load_rig  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from tests.benchmarks.truth import SIZE  # noqa: E402

SEED = 90_001
FINE = 41
PLACES = (8, 14, 20, 26, 32)
"""Of FINE points from corner to corner, where the gap is measured."""
SHUT, OPEN = 1.0, 3.0
LINE = "closed, "
"""How groups of mouths that are drawn as one line are named."""
RIMS = (
    ("lip_inner_upper_right", "lip_inner_lower_right"),
    ("lip_inner_top", "lip_inner_bottom"),
    ("lip_inner_upper_left", "lip_inner_lower_left"),
)


def rims(rig: FaceRig, vertices: NDArray, project) -> tuple[NDArray, NDArray]:
    """The inner rims (FINE, 2) of a posed face's upper and lower lip, in pixels."""
    places = places_of(rig)
    found = []
    for name in ("rim_upper", "rim_lower"):
        at = places.curves[name]
        points = np.einsum("kc,kcd->kd", places.weight[at], vertices[places.index[at]])
        found.append(smooth(np.asarray(project(points), float), FINE))
    return found[0], found[1]


def gaps(upper: NDArray, lower: NDArray) -> NDArray:
    """(5,) pixels from the upper rim down to the lower one; 0 where they pass each other."""
    across = upper[-1] - upper[0]
    across /= max(float(np.hypot(*across)), 1e-9)
    down = np.array([-across[1], across[0]])
    return np.maximum(((lower - upper) @ down)[list(PLACES)], 0.0)


def drawn_mouth(record: dict) -> tuple[str, NDArray]:
    """How the mouth of a sample is drawn, and its gaps (5,) in millimetres."""
    rig, about = load_rig(), record["camera"]
    distance = math.inf if about["distance"] is None else about["distance"]
    size = about["width"], about["height"]
    camera = Camera(*size, tuple(about["scale"]), tuple(about["centre"]), distance)
    face, page = FaceParameters.from_json(record), np.array(record["page"])
    vertices, scale = rig.pose(face), 1e3 / about["scale"][0]
    if record["engine"] != "conventions":
        pair = rims(rig, vertices, camera.project)
        return "contours", scale * gaps(*(through(page, rim) for rim in pair))
    artist = Artist.from_json(record["artist"])
    mouth = Mouth(sit(rig, vertices, camera, face, artist), artist)
    if not mouth.open:
        return LINE + artist.mouth, np.zeros(len(PLACES))
    how = "clenched" if mouth.clenched else artist.open
    return how, scale * gaps(through(page, mouth.upper), through(page, mouth.lower))


def measure(seed: int, index: int, engine: str, smiling: bool):
    """How it is drawn, its gaps, the fitted ones and those that were read; None if refused."""
    aus = None
    if smiling:
        rng = np.random.default_rng([seed, index])
        aus = {"smile": rng.uniform(2.5, 6), "lower_lip_depress": rng.uniform(1, 4.5),
               "sneer": rng.uniform(0, 3), "jaw_open": rng.uniform(0, 2)}  # fmt: skip
    drawing, record = make_sample(seed, index, SIZE, "felt", engine, aus=aus)
    how, true = drawn_mouth(record)
    try:
        fit = pipeline.fit(drawing, pipeline.FitOptions(hair="ignore"))
    except InputError:
        return None
    scale = 1e3 / record["camera"]["scale"][0]
    fitted = scale * gaps(*rims(fit.rig, fit.vertices, fit.camera.project))
    marks = fit.detection.landmarks
    read = [np.hypot(*np.subtract(marks[b], marks[a])) for a, b in RIMS]
    told = record.get("drawn_landmarks", record["landmarks"])
    there = [np.hypot(*np.subtract(told[b], told[a])) for a, b in RIMS]
    return "smiles" if smiling else how, true, fitted, scale * (np.mean(read) - np.mean(there))


def row(name: str, found: list) -> tuple[str, ...]:
    true, fitted, read = (np.array([m[k] for m in found]) for k in (1, 2, 3))
    wide, reached = true.max(axis=1), fitted.max(axis=1)
    drawn_open, drawn_shut = wide >= OPEN, wide < SHUT

    def share(some: NDArray, of: NDArray) -> str:
        return f"{100 * some[of].mean():.0f} % of {of.sum()}" if of.any() else ""

    return (
        name, str(len(found)), f"{true.mean():.1f}", f"{np.abs(fitted - true).mean():.1f}",
        f"{(fitted - true).mean():+.1f}", f"{np.abs(read).mean():.1f}",
        share(reached < SHUT, drawn_open), share(reached >= OPEN, drawn_shut),
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--faces", type=int, default=100, help="of each of the three kinds")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    groups = defaultdict(list)
    refused = 0
    for k, (engine, smiling) in enumerate(
        (("conventions", False), ("contours", False), ("contours", True))
    ):
        for index in range(options.faces):
            found = measure(options.seed + k, index, engine, smiling)
            refused += found is None
            if found:
                groups[found[0]].append(found)
    every = [m for found in groups.values() for m in found]
    conventions = [m for m in every if m[0] not in ("contours", "smiles")]
    rows = [("drawn", "faces", "gap", "off", "bias", "read", "shut", "open")]
    rows += [row(name, groups[name]) for name in sorted(groups)]
    rows += [row("by convention", conventions), row("all", every)]
    print(f"seed {options.seed}, millimetres; {refused} refused")
    if options.markdown:
        lines = ["| " + " | ".join(cells) + " |" for cells in rows]
        print("\n".join([lines[0], "|---" * len(rows[0]) + "|", *lines[1:]]))
    else:
        width = [max(len(cells[c]) for cells in rows) for c in range(len(rows[0]))]
        for cells in rows:
            print("  ".join(f"{cell:>{w}}" for cell, w in zip(cells, width, strict=True)))


if __name__ == "__main__":
    main()
