"""Fit the weights by which curly hair is told anew, to generated drawings; and say how well it is.

    python -m tests.benchmarks.refit_curls [--seeds 901 902] [--held 903] [--count 400] [--jobs 2]

To be run when `snakes.hair.texture.curls_say` or the ways of drawing hair change. Drawings by
conventions, two in five of them with curls; where hair lies is as true, but seen by a network's
cells and brought to the drawn line as in any sketch. Writes snakes/hair/curl_weights.py, and prints
how often hair is called curly in drawings of the held-out seed.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
from dataclasses import dataclass  # noqa: E402
from functools import partial  # noqa: E402
from multiprocessing import get_context  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from PIL import Image, ImageDraw  # noqa: E402
from scipy import ndimage  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from addon.drawing import Drawing  # noqa: E402
from dataset_gen.samples import make_sample  # noqa: E402
from facs_rig import Camera, FaceParameters, load_rig  # noqa: E402
from facs_rig.common.images import area_resample  # noqa: E402
from snakes.hair import region  # noqa: E402
from snakes.hair.region import ROWS, chance, grid, spread  # noqa: E402
from snakes.hair.texture import curls_say, is_curly  # noqa: E402
from tests.benchmarks.refit_beard import logistic  # noqa: E402

WEIGHTS = ROOT / "snakes" / "hair" / "curl_weights.py"
FALSE = 0.035
"""Share of drawings of straight hair, but for hair shorn to the skull, that is called curly: as
many as were by rules before these weights."""
RIDGE = 30.0
"""Drawings that speak against large weights: strokes and edge are to tell curls together, as not
every drawing has both as clear as these have."""
CELLS, DOUBT = 24, 0.6
"""Cells of a network to a head, and log-odds by which what it says is off."""
SIZES = (320, 420, 560)  # pixels to a side of a drawing
LEAST = 200  # cells of hair
TEXT = '''"""Weights of the logistic regression that tells curls, of texture.curls_say's terms.

Written by tests/benchmarks/refit_curls.py: do not change them by hand, run it.
"""

CURLY = {CURLY}
"""Of a region of hair, as `curls_say`, and what is added: above 0 it is curly."""
'''


@dataclass(frozen=True, eq=False)
class Known:
    """What is seen of a drawing's hair, (5,) and whether it has strokes, see `curls_say`; whether
    it is curly by its edge alone; how it is drawn, and whether it is curly."""

    says: NDArray[np.float64]
    stroked: bool
    scalloped: bool
    how: str
    curly: bool


def known(job: tuple[int, int]) -> Known | None:
    """Drawing `job`, seed and number; None where no hair is seen."""
    seed, number = job
    size = int(np.random.default_rng([seed, number]).choice(SIZES))
    picture, meta = make_sample(
        seed, number, size, "people", "conventions", worn=0.3,
        finish="curls" if number % 5 < 2 else None,
    )  # fmt: skip
    if meta["regions"].get("hat") or not meta["regions"].get("hair"):
        return None
    ink, truth = on_grid(picture, meta)
    found = found_region(ink, truth, np.random.default_rng([seed, number, 2]))
    if found.sum() < LEAST:
        return None
    artist = meta["artist"]
    curly = artist["finish"] == "curls" or artist["cut"] == "afro"
    how = "shorn" if artist["cut"] == "shorn" and not curly else artist["finish"]
    says, stroked = curls_say(ink, found, ROWS)
    scalloped = not stroked and is_curly(ink, found, ROWS)
    return Known(says, stroked, scalloped, "curls" if curly else how, curly)


def on_grid(picture: NDArray, meta: dict) -> tuple[NDArray, NDArray[np.bool_]]:
    """A drawing's ink (h, w) 0..1, and where its hair is, in cells as `region.grid` makes them."""
    width, height = picture.shape[::-1]
    page = Image.new("1", (width, height))
    for outline in meta["regions"]["hair"]:
        ImageDraw.Draw(page).polygon(np.ravel(outline).tolist(), fill=1)
    told, slant = meta["camera"], np.array(meta["page"])
    larger = float(np.sqrt(abs(np.linalg.det(slant[:2, :2]))))
    centre = slant @ [*told["centre"], 1]
    camera = Camera(
        width, height, tuple(larger * s for s in told["scale"]), tuple(centre[:2] / centre[2]),
        told["distance"] or np.inf,
    )  # fmt: skip
    vertices = load_rig().pose(FaceParameters.from_json(meta))
    box, size = grid(vertices, camera, picture.shape)
    image = Drawing.of((picture / 255).astype(np.float32)).image
    ink = 1 - area_resample(np.asarray(image, np.float32), box, size, outside=1.0)
    truth = area_resample(np.asarray(page).astype(np.float32), box, size, outside=0.0) > 0.5
    return ink, truth


def found_region(ink: NDArray, truth: NDArray, rng: np.random.Generator) -> NDArray[np.bool_]:
    """(h, w) where hair is found that is there (h, w): seen by coarse cells, not quite surely, and
    brought to the drawn line."""
    soft = ndimage.gaussian_filter(truth.astype(float), 0.7 * ROWS / CELLS)
    share = np.clip(soft, region.SURE, 1 - region.SURE)
    off = ndimage.gaussian_filter(rng.normal(0, 1, soft.shape), 4)
    odds = np.log(share / (1 - share)) + DOUBT * off / off.std()
    cues = odds + region.LEANS + region.TONED * region._tones(ink, chance(odds))
    found = _large(ndimage.binary_opening(spread(cues, ink)))
    holes = ndimage.binary_fill_holes(found) & ~found
    return found | (holes & ~_large(holes))


def _large(found: NDArray) -> NDArray[np.bool_]:
    """(h, w) the pieces that are no strays."""
    label, count = ndimage.label(found)
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    return (size >= region.LEAST * ROWS**2)[label]


def weights_of(every: list[Known]) -> NDArray[np.float64]:
    """(6,) the weights, and what is added."""
    every = [one for one in every if one.stroked]
    curly = np.array([one.curly for one in every])
    says = np.stack([one.says for one in every])
    half = np.where(curly, 0.5 / curly.mean(), 0.5 / (1 - curly.mean()))  # both count alike
    weights = logistic(says, curly, half, ridge=RIDGE)
    straight = np.array([one.how not in ("curls", "shorn") for one in every])
    weights[-1] = -np.quantile(says[straight] @ weights[:-1], 1 - FALSE)
    return weights


def tell(every: list[Known], weights: NDArray) -> None:
    """Print how often hair is called curly, by how it is drawn."""
    score = np.stack([one.says for one in every]) @ weights[:-1] + weights[-1]
    stroked = np.array([one.stroked for one in every])
    called = np.where(stroked, score > 0, [one.scalloped for one in every])
    how = np.array([one.how for one in every])
    for name in sorted(set(how)):
        print(f"{name:8s} {called[how == name].sum():3d} of {(how == name).sum()}")
    score, how = score[stroked], how[stroked]
    curly = how == "curls"
    rank = score[curly][:, None] > score[~curly]
    print(f"a curly head scores higher than another in {rank.mean():.3f} of all pairs")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[901, 902])
    parser.add_argument("--held", type=int, default=903)
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    options = parser.parse_args()
    with get_context("spawn").Pool(options.jobs) as pool:
        seen = partial(pool.imap, known, chunksize=4)
        every, held = (
            [one for one in seen([(s, k) for s in seeds for k in range(options.count)]) if one]
            for seeds in (options.seeds, [options.held])
        )
    weights = weights_of(every)
    write(weights, options.out)
    tell(held, weights)


def write(weights: NDArray[np.float64], path: Path) -> None:
    """The module of weights."""
    told = f"({', '.join(f'{w:.2f}' for w in weights)})"
    path.write_text(TEXT.format(CURLY=told), encoding="utf-8")


if __name__ == "__main__":
    main()
