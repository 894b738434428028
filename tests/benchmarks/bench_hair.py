"""How well a head of hair is found again from where it lies on a page, and how long that takes.

    python -m tests.benchmarks.bench_hair [--heads 100] [--seed 0] [--drawn]

People with the presets' cuts, two in three of them varied, in any view up to 40 degrees. The hair's
region is given, what is measured is the cut alone: the overlap of true and refitted hair
(intersection over union) in the same view, and from the side that the view did not show; and what
must not be: skin that is seen through hair, and hair over eyes or mouth where none was drawn.
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
from PIL import Image, ImageDraw  # noqa: E402
from scipy.spatial import ConvexHull  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from addon.pipeline import fit  # noqa: E402
from dataset_gen.generate import make_sample  # noqa: E402
from dataset_gen.hairdo import Hairdo  # noqa: E402
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig, rasterise  # noqa: E402
from facs_rig.common.box import Box  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.hair.cut import ANGLES, Cut  # noqa: E402
from facs_rig.hair.head import WIDEST, head_of  # noqa: E402
from facs_rig.hair.mesh import HairMesh, hair_mesh  # noqa: E402
from facs_rig.hair.presets import PRESETS, preset  # noqa: E402
from facs_rig.hair.shell import edge_heights  # noqa: E402
from snakes.hair.cut_fit import fit_cut  # noqa: E402
from snakes.hair.region import PageHair  # noqa: E402
from snakes.hair.texture import Strokes  # noqa: E402

WIDTH, HEIGHT = 220, 260
MARGIN = 0.06  # height above the edge of hair from which on it covers the skin


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


def scalp_seen(
    cut: Cut, who: dict[str, float], hair: HairMesh, face: NDArray, camera: Camera
) -> int:
    """Pixels that show the scalp (above the brows, behind the forehead) well above the edge of the
    hair that covers it."""
    rig = load_rig()
    head, rest = head_of(rig, who), rig.neutral(who)
    azimuth = np.arctan2(rest[:, 0] - head.eyes[0], rest[:, 2] - head.middle[2])
    above = head.height(rest[:, 1] - head.eyes[1]) - edge_heights(cut, azimuth % (2 * np.pi))
    scalp = (rest[:, 2] < head.eyes[2] - 0.04) & (rest[:, 1] > head.eyes[1] + WIDEST * head.above)
    covered = (above > MARGIN) & scalp & rig.parts["skin"]
    if cut.top is not None:  # a bald crown is to be seen
        height = head.height(rest[:, 1] - head.eyes[1])
        top = np.interp(azimuth, ANGLES, cut.top, period=2 * np.pi)
        covered &= height < top - MARGIN
    every = np.concatenate([rig.triangles, hair.triangles + len(face)])
    shows = rasterise(np.concatenate([face, hair.on(face)]), every, camera).triangle
    skin = shows[(shows >= 0) & (shows < len(rig.triangles))]
    return int(covered[rig.triangles[skin]].all(axis=1).sum())


def over_the_face(more: NDArray[np.bool_], face: NDArray, camera: Camera) -> float:
    """Share of eyes and mouth that hair covers: more, (h, w), where none is drawn."""
    rig = load_rig()
    marks = camera.project(face[rig.landmarks])
    shares = []
    for begins in (("eye_", "_left"), ("eye_", "_right"), ("lip_", ""), ("mouth_", "")):
        of = [k for k, name in enumerate(LANDMARKS)
              if name.startswith(begins[0]) and name.endswith(begins[1])]  # fmt: skip
        page = Image.new("1", (camera.width, camera.height))
        hull = marks[of][ConvexHull(marks[of]).vertices] if len(of) > 2 else marks[of]
        ImageDraw.Draw(page).polygon((hull - 0.5).ravel().tolist(), fill=1)
        place = np.asarray(page)
        shares.append((place & more).sum() / max(place.sum(), 1))
    return float(max(shares))


def measure(name: str, vary: bool, rng: np.random.Generator) -> tuple[float, ...]:
    """Overlap in the same view, from the other side, seconds of `fit_cut`, pixels of scalp that are
    seen through the hair from both, and the share of eyes or mouth that is covered unduly."""
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
        return 0.0, 0.0, seconds, 0, 0.0
    ours = hair_mesh(rig, who, found, "surface")
    side = rig.pose(replace(person, head=(np.pi / 2 if yaw < 0 else -np.pi / 2, 0.0, 0.0)))
    beside = Camera.framing(np.concatenate([side, hair.on(side)]), WIDTH, HEIGHT, 0.03)
    again = shown(ours, face, camera)
    return (
        overlap(region, again),
        overlap(shown(hair, side, beside), shown(ours, side, beside)),
        seconds,
        scalp_seen(found, who, ours, face, camera) + scalp_seen(found, who, ours, side, beside),
        over_the_face(again & ~region, face, camera),
    )


def measure_drawn(seed: int, index: int) -> tuple[str, float, float] | None:
    """The preset that a drawing of the data set wears, and the overlap in its view and from the
    side; 0 where none was found, None where no face was."""
    drawing, record = make_sample(seed, index, 480, hair=1.0)
    try:
        face = fit((drawing / 255).astype(np.float32))
    except InputError:
        return None
    worn = Hairdo.from_json(record["hair"])
    if face.cut is None:
        return worn.preset, 0.0, 0.0
    page = Image.new("1", drawing.shape[::-1])
    for polygon in record["regions"]["hair"]:
        ImageDraw.Draw(page).polygon(np.ravel(polygon).tolist(), fill=1)
    rig, who = load_rig(), record["identity"]
    ours = hair_mesh(face.rig, face.parameters.identity, face.cut, "surface")
    camera = replace(face.camera, width=drawing.shape[1], height=drawing.shape[0])
    seen = shown(ours, face.vertices, camera)
    side = rig.pose(FaceParameters(identity=who, head=(np.pi / 2, 0.0, 0.0)))
    both = [hair_mesh(rig, who, cut, "surface") for cut in (worn.cut(), face.cut)]
    beside = Camera.framing(np.concatenate([side, both[0].on(side)]), WIDTH, HEIGHT, 0.03)
    return (
        worn.preset,
        overlap(np.asarray(page), seen),
        overlap(*(shown(hair, side, beside) for hair in both)),
    )


def drawn_heads(heads: int, seed: int) -> None:
    found = [row for k in range(heads) if (row := measure_drawn(seed, k)) is not None]
    for name in PRESETS:
        rows = [row[1:] for row in found if row[0] == name]
        if rows:
            same, side = np.mean(rows, axis=0)
            print(f"{name:14} {len(rows):3} drawn  same view {same:.3f}  side {side:.3f}")
    table = np.array([row[1:] for row in found])
    seen = table[table[:, 0] > 0]
    print(
        f"{len(table)} drawn heads: same view {table[:, 0].mean():.3f},"
        f" side {table[:, 1].mean():.3f}; {len(seen)} of them with hair that was found:"
        f" {seen[:, 0].mean():.3f}, {seen[:, 1].mean():.3f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--heads", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--drawn", action="store_true")
    options = parser.parse_args()
    if options.drawn:
        drawn_heads(options.heads, options.seed)
        return
    rng, names = np.random.default_rng(options.seed), list(PRESETS)
    found: dict[str, list[tuple[float, ...]]] = {name: [] for name in names}
    for k in range(options.heads):
        name = names[k % len(names)]
        found[name].append(measure(name, bool(k // len(names) % 3), rng))
    for name, rows in found.items():
        if rows:
            same, side, *_ = np.mean(rows, axis=0)
            print(f"{name:14} same view {same:.3f}  other side {side:.3f}")
    table = np.array([row for rows in found.values() for row in rows])
    (same, side, *_), (least, worst, *_) = table.mean(axis=0), table.min(axis=0)
    print(
        f"{len(table)} heads: same view {same:.3f} (lowest {least:.2f}), other side {side:.3f}"
        f" (lowest {worst:.2f}), {1e3 * np.median(table[:, 2]):.0f} ms"
    )
    print(
        f"scalp seen through hair: {table[:, 3].sum():.0f} pixels, {(table[:, 3] > 0).sum()} heads;"
        f" hair over an eye or the mouth where none is drawn: {(table[:, 4] > 0.02).sum()} heads,"
        f" at most {100 * table[:, 4].max():.0f}% of it"
    )


if __name__ == "__main__":
    main()
