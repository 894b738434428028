"""How well beards are read from drawings that are known, and how often a bare chin gets one.

    python -m tests.benchmarks.bench_beard [--men 60] [--others 200] [--moustaches 40] [--seed 71]

Drawings by conventions, read and fitted as any sketch. `men` are adults who are drawn with a beard
or a moustache; of `others`, everybody, what counts are those without; `moustaches` are men who are
drawn without either, over whose mouth a larger one is drawn. Measured is the overlap
(intersection over union) of where the beard was drawn and where it is seen on the fitted face.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
from collections import defaultdict  # noqa: E402
from functools import partial  # noqa: E402
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
from facs_rig.anatomy import LANDMARKS_68  # noqa: E402
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


def with_moustache(seed: int, number: int) -> tuple[NDArray[np.uint8], dict]:
    """A drawing of a man with a moustache alone, as broad and thick as people wear them, over a
    drawing without; and what made it."""
    rng = np.random.default_rng([seed, number, 13])
    for k in range(1000):
        who = {**sample_person(rng), "gender": 1.0}
        if who.get("age", 0.0) > BEARDLESS:
            picture, meta = make_sample(
                seed, 500_000 + 1000 * number + k, SIZE, engine="conventions", identity=who
            )
            if not meta["regions"].get("beard"):
                break
    mark = {name: np.array(at) for name, at in meta["drawn_landmarks"].items()}
    lip = np.stack([mark[name] for name in LANDMARKS_68[48:55]])
    up = mark["nose_base"] - lip[3]
    ends = lip[[0, -1]] + rng.uniform(0.0, 0.3) * (lip[[0, -1]] - lip[[-1, 0]])
    ends = ends - rng.uniform(-0.2, 0.7) * up
    t = np.linspace(-1, 1, 41)
    knots = np.stack([ends[0], lip[1], lip[3], lip[5], ends[1]])
    hem = np.stack([np.interp(t, (-1, -0.7, 0, 0.7, 1), knots[:, k]) for k in (0, 1)], axis=1)
    hem = hem + rng.uniform(0, 0.12) * up
    thick = rng.uniform(0.5, 0.9) * (1 - np.abs(t) ** rng.uniform(2, 5)) ** 0.7
    outline = np.concatenate([hem, (hem + thick[:, None] * up)[::-1]])
    page = Image.new("L", (3 * SIZE, 3 * SIZE), 255)
    way = str(rng.choice(["black", "hairs"]))
    if way == "black":
        ImageDraw.Draw(page).polygon((3 * outline).ravel().tolist(), fill=0)
    else:
        aside = rng.uniform(0.2, 1.2)
        for _ in range(rng.integers(50, 160)):
            k = int(rng.integers(41))
            root = hem[k] + thick[k] * rng.uniform(0.2, 1) * up
            along = (hem[min(k + 1, 40)] - hem[max(k - 1, 0)]) * np.sign(t[k])
            fall = np.linalg.norm(up) * along / max(float(np.linalg.norm(along)), 1e-6)
            tip = root + rng.uniform(0.25, 0.5) * (aside * abs(t[k]) ** 0.5 * fall - up)
            line = (3 * np.stack([root, tip])).ravel().tolist()
            ImageDraw.Draw(page).line(line, fill=0, width=int(rng.integers(3, 6)))
    over = np.asarray(page.resize((SIZE, SIZE), Image.Resampling.BOX), float)
    dark, pale = np.percentile(picture, (1, 80))  # as its own ink and paper
    picture = np.minimum(picture, dark + (pale - dark) * over / 255).astype(np.uint8)
    meta["regions"]["beard"] = [outline.tolist()]
    meta["artist"]["moustache"] = f"large, {way}"
    return picture, meta


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
    parser.add_argument("--moustaches", type=int, default=40)
    parser.add_argument("--seed", type=int, default=71)
    options = parser.parse_args()
    found: dict[str, list[tuple[bool, float]]] = defaultdict(list)
    bare = false = 0
    seconds = []
    draw = {"men": partial(drawn, bearded=True), "others": partial(drawn, bearded=False),
            "moustaches": with_moustache}  # fmt: skip
    jobs = [(way, k) for kind, way in draw.items() for k in range(getattr(options, kind))]
    for way, number in jobs:
        picture, meta = way(options.seed, number)
        try:
            face = pipeline.fit(picture)
        except InputError:
            continue
        outlines = meta["regions"].get("beard", [])
        if not outlines:
            bare, false = bare + 1, false + (face.grows is not None)
            continue
        artist, truth, ours = meta["artist"], filled(outlines), seen(face)
        name = artist["beard"] if artist["beard"] != "none" else f"moustache, {artist['moustache']}"
        share = float((ours & truth).sum() / max((ours | truth).sum(), 1))
        found[name].append((face.grows is not None, share))
        if face.grows is not None:
            start = perf_counter()
            beard_mesh(load_rig(), face.parameters.identity, face.grows)
            seconds.append(perf_counter() - start)
    for name, rows in sorted(found.items()):
        there = [share for is_there, share in rows if is_there]
        print(f"{name:23} {len(rows):3} drawn, {len(there):3} found, overlap of these "
              f"{np.mean(there or [0]):.2f}")  # fmt: skip
    print(f"{false} of {bare} beardless drawings got a beard ({100 * false / max(bare, 1):.1f} %)")
    print(f"mesh {1e3 * np.median(seconds or [0]):.0f} ms")


if __name__ == "__main__":
    main()
