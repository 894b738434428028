"""How well beards are read from drawings that are known, and how often a bare chin gets one.

    python -m tests.benchmarks.bench_beard [--men 60] [--others 200] [--seed 71]

Drawings by conventions, read and fitted as any sketch. `men` are adults who are drawn with a beard
or a moustache; of `others`, everybody, what counts are those without. Measured is the overlap
(intersection over union) of where the beard was drawn and where it is seen on the fitted face.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
from collections import defaultdict  # noqa: E402
from pathlib import Path  # noqa: E402
from time import perf_counter  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from PIL import Image, ImageDraw  # noqa: E402
from scipy.ndimage import binary_closing  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from addon import pipeline  # noqa: E402
from dataset_gen.conventions.artist import BEARDLESS  # noqa: E402
from dataset_gen.population import sample_person  # noqa: E402
from dataset_gen.samples import make_sample  # noqa: E402
from facs_rig import load_rig, rasterise  # noqa: E402
from facs_rig.beard.mesh import beard_mesh  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402

SIZE = 384
GAP = 8  # pixels between hairs that count as covered


def drawn(seed: int, number: int, bearded: bool) -> tuple[NDArray[np.uint8], dict]:
    """A drawing, and what made it; of a man with a beard, or of anybody."""
    if not bearded:
        return make_sample(seed, number, SIZE, engine="conventions")
    rng = np.random.default_rng([seed, number, 7])
    for k in range(1000):
        who = {**sample_person(rng), "gender": 1.0}
        if who.get("age", 0.0) <= BEARDLESS:
            continue
        picture, meta = make_sample(
            seed, 1000 * number + k, SIZE, engine="conventions", identity=who
        )
        if meta["regions"].get("beard"):
            return picture, meta
    raise RuntimeError("nobody has a beard")


def seen(face: pipeline.FaceFit) -> NDArray[np.bool_]:
    """(SIZE, SIZE) where the beard is seen on the fitted face."""
    mesh, rig, skin = face.beard, load_rig(), face.vertices
    if mesh is None:
        return np.zeros((SIZE, SIZE), dtype=bool)
    both = np.concatenate([mesh.triangles, mesh.triangles[:, ::-1]]) + len(skin)
    every = np.concatenate([skin, mesh.on(skin)])
    found = rasterise(every, np.concatenate([rig.triangles, both]), face.camera)
    return binary_closing(found.triangle >= len(rig.triangles), iterations=GAP // 2)


def filled(outlines: list[list[tuple[float, float]]]) -> NDArray[np.bool_]:
    picture = Image.new("1", (SIZE, SIZE))
    for outline in outlines:
        ImageDraw.Draw(picture).polygon((np.asarray(outline) - 0.5).ravel().tolist(), fill=1)
    return np.asarray(picture)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--men", type=int, default=60)
    parser.add_argument("--others", type=int, default=200)
    parser.add_argument("--seed", type=int, default=71)
    options = parser.parse_args()
    found: dict[str, list[tuple[bool, float]]] = defaultdict(list)
    bare = false = 0
    seconds = []
    jobs = [(k, True) for k in range(options.men)] + [(k, False) for k in range(options.others)]
    for number, bearded in jobs:
        picture, meta = drawn(options.seed, number, bearded)
        try:
            face = pipeline.fit(picture)
        except InputError:
            continue
        outlines = meta["regions"].get("beard", [])
        if not outlines:
            bare, false = bare + 1, false + (face.grows is not None)
            continue
        artist, truth, ours = meta["artist"], filled(outlines), seen(face)
        way = artist["beard"] if artist["beard"] != "none" else f"moustache, {artist['moustache']}"
        share = float((ours & truth).sum() / max((ours | truth).sum(), 1))
        found[way].append((face.grows is not None, share))
        if face.grows is not None:
            start = perf_counter()
            beard_mesh(load_rig(), face.parameters.identity, face.grows)
            seconds.append(perf_counter() - start)
    for way, rows in sorted(found.items()):
        there = [share for is_there, share in rows if is_there]
        print(f"{way:18} {len(rows):3} drawn, {len(there):3} found, overlap of these "
              f"{np.mean(there or [0]):.2f}")  # fmt: skip
    print(f"{false} of {bare} beardless drawings got a beard ({100 * false / max(bare, 1):.1f} %)")
    print(f"mesh {1e3 * np.median(seconds or [0]):.0f} ms")


if __name__ == "__main__":
    main()
