"""Fit the weights by which beards are found anew, to generated drawings in which they are known.

    python -m tests.benchmarks.refit_beard [--men 110] [--others 260] [--moustaches 80] [--jobs 2]

To be run when the network that says what lies where changes, or what `snakes.hair.beard_seen` makes
of a page. Drawings by conventions are read and fitted as any sketch: men with beards or moustaches,
anybody, and men with a moustache alone that is larger than these drawings have them. Writes
snakes/hair/beard_weights.py. bench_beard then tells, by other drawings, how well beards are found.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import sys  # noqa: E402
from collections.abc import Callable  # noqa: E402
from dataclasses import dataclass  # noqa: E402
from functools import partial  # noqa: E402
from multiprocessing import get_context  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from addon import pipeline  # noqa: E402
from addon.hair import hair_of  # noqa: E402
from addon.options import FitOptions  # noqa: E402
from facs_rig import Camera  # noqa: E402
from facs_rig.beard.chart import on_chart  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from snakes.hair import beard_seen  # noqa: E402
from snakes.hair.beard_fit import CHILD  # noqa: E402
from tests.benchmarks.bench_beard import drawn, filled, with_moustache  # noqa: E402

WEIGHTS = ROOT / "snakes" / "hair" / "beard_weights.py"
FALSE = {"BEARDED": 0.015, "MOUSTACHE": 0.01}
"""Share of beardless drawings that are taken for bearded, and for having a moustache, wherever in
SHIFTS it is looked for: where the mouth is, far fewer."""
TAIL = 0.15
"""Share of beardless drawings, those with the most of a beard, whose scores say where so few are
left as FALSE wants."""
RIDGE = 1.0
"""Drawings, or places, that speak against large weights (Hoerl, Kennard 1970, "Ridge regression",
Technometrics)."""
SHIFTS = (0.0, -0.004, 0.004, 0.008)
"""Metres down by which mouths are looked for beside their place: people's drawings are not fitted
as well as these, and the lines of lips and nose must not be taken for moustaches."""
FEW = 300
"""Places of a drawing that are used."""
TEXT = '''"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = {BEARDED}
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = {MOUSTACHE}
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = {COVER}
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = {TEMPLATED}
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = {BELOW_JAW}
"""COVER of what hangs below the jaw."""
'''


@dataclass(frozen=True, eq=False)
class Known:
    """What is seen of a drawing, and what is true.

    beard, moustache : how each is drawn, "none" for not at all
    chin : (3,), see `chin_says`;  lip : (s, 5), `lip_says` at each of SHIFTS
    place, says, bare, grows : (k, 2), (k, 4), (k,) and (k,) bool of places of the skin, and whether
        a beard was drawn there
    under, hangs : (m, 4) and (m,) bool of places below the jaw
    """

    beard: str
    moustache: str
    chin: NDArray[np.float64]
    lip: NDArray[np.float64]
    place: NDArray[np.float64]
    says: NDArray[np.float64]
    bare: NDArray[np.float64]
    grows: NDArray[np.bool_]
    under: NDArray[np.float64]
    hangs: NDArray[np.bool_]


def known(job: tuple[int, int, str]) -> Known | None:
    """A drawing of a kind, "men", "others" or "moustaches", as it is seen; None for one that shows
    no grown face."""
    seed, number, kind = job
    if kind == "moustaches":
        picture, meta = with_moustache(seed, number)
    else:
        picture, meta = drawn(seed, number, kind == "men")
    try:
        face = pipeline.fit(picture, FitOptions(strokes="ignore", hair="ignore", beard="ignore"))
    except InputError:
        return None
    fitted, mask = face.fitted, face.detection.mask
    page = hair_of(face.drawing, face.detection, face.rig, fitted)[0]
    if page is None or mask is None or fitted.parameters.identity.get("age", 0.0) <= CHILD:
        return None
    ink = beard_seen.ink_of(face.drawing.image, page)
    look = partial(beard_seen.seen_on, ink, mask.at, page, face.rig, fitted.vertices)
    seen = look(fitted.camera)
    truth = filled(meta["regions"].get("beard", []))

    def true_at(cells: NDArray) -> NDArray[np.bool_]:
        at = face.drawing.to_input(page.pixels(cells)).astype(int)
        u, v = np.clip(at, 0, len(truth) - 1).T
        return truth[v, u]

    mine = np.flatnonzero(seen.grazed & ~seen.above)
    below = beard_seen.below(seen, ink, mask.at, page)
    return Known(
        meta["artist"]["beard"], meta["artist"]["moustache"],
        beard_seen.chin_says(seen), lips(look, fitted.camera, seen.down * page.cell),
        seen.place[mine], beard_seen.places_say(seen)[mine], beard_seen.bare(seen)[mine],
        true_at(seen.cells[mine]),
        below.says[below.on_page], true_at(below.cells[below.on_page]),
    )  # fmt: skip


def lips(
    look: Callable[[Camera], beard_seen.Seen], camera: Camera, down: NDArray
) -> NDArray[np.float64]:
    """(s, 5) what is said over the mouth, at each of SHIFTS. look : what is seen by a camera
    down : (2,) pixels of a metre down from the head"""
    w, h = camera.width, camera.height
    moved = [camera.cropped(-u, -v, w - u, h - v, w, h) for u, v in np.outer(SHIFTS, down)]
    return np.stack([beard_seen.lip_says(look(one)) for one in moved])


def weights_of(every: list[Known]) -> dict[str, NDArray[np.float64]]:
    """The weights of `beard_weights` by name."""
    without = [one.beard == "none" for one in every]
    # Those that these drawings have of themselves are as thin as the line of a lip.
    large = np.array([one.moustache.startswith("large") for one in every])
    nothing = np.array(
        [one.moustache == "none" and free for one, free in zip(every, without, strict=True)]
    )
    out = {}
    for name, terms, wanted in (
        ("BEARDED", [one.chin[None] for one in every], ~np.array(without)),
        ("MOUSTACHE", [one.lip for one in every], large),
    ):
        rows, used = np.stack(terms), wanted | nothing
        many = rows.shape[1]
        weights = logistic(
            np.concatenate(rows[used]),
            wanted[used].repeat(many),
            np.full(many * used.sum(), 1 / many),
        )
        scores = np.concatenate(rows[nothing]) @ weights[:-1]
        weights[-1] = -threshold(scores, FALSE[name])
        out[name] = weights
    bearded = [
        one for one, free in zip(every, without, strict=True) if not free and one.grows.any()
    ]
    grows = np.concatenate([one.grows for one in bearded])
    weight = _balanced([len(one.grows) for one in bearded])
    bare = np.concatenate([one.bare for one in bearded])
    says = np.concatenate([one.says for one in bearded])
    out["COVER"] = logistic(says, grows, weight, -bare)
    shapes = []
    for one in bearded:
        score = one.says @ out["COVER"][:-1] + out["COVER"][-1] - one.bare
        best = beard_seen.likeliest(one.place, score)
        shapes.append(on_chart(beard_seen.TEMPLATES[best], one.place))
    says = np.concatenate([says, np.concatenate(shapes)[:, None]], axis=1)
    out["TEMPLATED"] = logistic(says, grows, weight, -bare)
    hanging = [one for one in bearded if len(one.hangs)]
    out["BELOW_JAW"] = logistic(
        np.concatenate([one.under for one in hanging]),
        np.concatenate([one.hangs for one in hanging]),
        _balanced([len(one.hangs) for one in hanging]),
    )
    return out


def _balanced(counts: list[int]) -> NDArray[np.float64]:
    """Weights of places, of so many of each drawing, as many as FEW of each would have."""
    return np.concatenate([np.full(n, min(FEW / n, 1.0)) for n in counts])


def logistic(
    rows: NDArray,
    wanted: NDArray,
    weight: NDArray,
    fixed: NDArray | float = 0.0,
    ridge: float = RIDGE,
) -> NDArray[np.float64]:
    """(k + 1,) weights of terms (n, k), and what is added, by Newton's method.

    wanted : (n,) bool;  weight : (n,) how much each row counts;  fixed : what is added to each
    ridge : as RIDGE
    """
    mean, spread = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-9)
    x = np.c_[(rows - mean) / spread, np.ones(len(rows))]
    found = np.zeros(x.shape[1])
    held = ridge * np.diag([*np.ones(rows.shape[1]), 0.0])
    for _ in range(30):
        share = 1 / (1 + np.exp(-(x @ found + fixed)))
        slope = x.T @ (weight * (wanted - share)) - held @ found
        curve = (x * (weight * share * (1 - share))[:, None]).T @ x + held
        found = found + np.linalg.solve(curve + 1e-9 * np.eye(len(found)), slope)
    plain = found[:-1] / spread
    return np.array([*plain, found[-1] - plain @ mean])


def threshold(scores: NDArray, share: float) -> float:
    """The score that this share of drawings (n,) is above.

    So few are above it that its place is told by a generalised Pareto distribution of the TAIL,
    fitted by probability-weighted moments (Hosking, Wallis 1987, Technometrics).
    """
    begins = float(np.quantile(scores, 1 - TAIL))
    excess = np.sort(scores[scores > begins] - begins)
    rank = (np.arange(len(excess)) + 0.65) / len(excess)
    whole, upper = excess.mean(), ((1 - rank) * excess).mean()
    shape = whole / (whole - 2 * upper) - 2 or 1e-9  # 0 for an exponential tail
    size = 2 * whole * upper / (whole - 2 * upper)
    return begins + float(size / shape * (1 - (share / TAIL) ** shape))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--men", type=int, default=110)
    parser.add_argument("--others", type=int, default=260)
    parser.add_argument("--moustaches", type=int, default=80)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    options = parser.parse_args()
    jobs = [
        (options.seed, k, kind)
        for kind in ("men", "others", "moustaches")
        for k in range(getattr(options, kind))
    ]
    with get_context("spawn").Pool(options.jobs) as pool:
        every = [one for one in pool.imap(known, jobs, chunksize=4) if one is not None]
    found = weights_of(every)
    for name, weights in found.items():
        print(name, weights.round(2))
    write(found, options.out)


def write(found: dict[str, NDArray[np.float64]], path: Path) -> None:
    """The module of weights."""
    told = {name: f"({', '.join(f'{w:.2f}' for w in ws)})" for name, ws in found.items()}
    path.write_text(TEXT.format(**told), encoding="utf-8")


if __name__ == "__main__":
    main()
