"""Whether a fit has the person, the camera and both sides of the face as they were drawn.

    python -m tests.benchmarks.bench_likeness [--faces 100] [--seed 80001]

Drawings that nobody trained on, of people and expressions that are known:

- one person drawn twice, from another side, in another expression and style: how often the nearest
  by `identity` among all is the same person (rank-1), and how high that person ranks;
- the head's pitch, its mean error and its bias, of contours, of conventions, which bend a face, and
  of people with features far out;
- how far the face at rest is from symmetric, of people who are.
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
from dataset_gen.generate import make_sample  # noqa: E402
from facs_rig import FaceParameters, load_rig  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.identity import BY_NAME  # noqa: E402
from snakes.shape import FEATURE, SPREAD, WHO  # noqa: E402
from tests.benchmarks.truth import SIZE, face_region  # noqa: E402

SEED = 80_001


def fitted(seed, index, scheme, engine="contours", identity=None):
    """The fit of a sample and what made it; None if no face was found."""
    drawing, record = make_sample(seed, index, SIZE, scheme, engine, identity=identity)
    try:
        return pipeline.fit(drawing), record
    except InputError:
        return None


def person(identity):
    """(p,) features in standard deviations among people."""
    return np.array(
        [identity.get(n, BY_NAME[n].default) / SPREAD.get(n, FEATURE) for n in WHO], dtype=float
    )


def crooked(face) -> float:
    """Mean millimetres from the face at rest to the symmetric one half way to its mirror image."""
    rig = load_rig()
    rest = rig.pose(FaceParameters(identity=face.parameters.identity), face.offsets)
    mirrored = rest[rig.mirror] * (-1, 1, 1)
    region = face_region(rig)
    return 1e3 * float(np.linalg.norm(rest - mirrored, axis=1)[region].mean()) / 2


def ranks(rank) -> str:
    return f"rank-1 {(rank == 0).mean():.2f}, rank-5 {(rank < 5).mean():.2f}"


def turned(fits) -> tuple[float, float]:
    """Mean error of the pitch and its bias, degrees."""
    off = [np.degrees(f.parameters.head[1]) - record["head"]["pitch"] for f, record in fits]
    return float(np.abs(off).mean()), float(np.mean(off))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--faces", type=int, default=100)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    count, seed = options.faces, options.seed

    for scheme in ("sparse", "people"):
        pairs = []
        for index in range(count):
            first = fitted(seed, index, scheme)
            who = first and first[1]["identity"]
            second = first and fitted(seed + 1, index, scheme, identity=who)
            if first and second:
                pairs.append((first, second))
        once, again = (
            np.array([person(pair[k][0].parameters.identity) for pair in pairs]) for k in (0, 1)
        )
        true = np.array([person(pair[0][1]["identity"]) for pair in pairs])
        apart = np.linalg.norm(once[:, None] - again[None], axis=2)
        rank = (apart < np.diag(apart)[:, None]).sum(axis=1)
        known = np.linalg.norm(once[:, None] - true[None], axis=2)
        first_of = (known < np.diag(known)[:, None]).sum(axis=1)
        print(
            f"{scheme}: one person drawn twice, {len(pairs)} people: {ranks(rank)}; "
            f"fitted against the true people: {ranks(first_of)}"
        )
        error, bias = turned([fit for pair in pairs for fit in pair])
        print(f"{scheme}: pitch {error:.2f} degrees off, bias {bias:+.2f}")
        aside = [f for pair in pairs for f, r in pair if 15 < abs(r["head"]["yaw"]) < 50]
        side = np.mean([crooked(face) for face in aside])
        print(f"{scheme}: {len(aside)} in three quarters, at rest {side:.2f} mm from symmetric")
    fits = [f for i in range(count) if (f := fitted(seed + 2, i, "people", "conventions"))]
    error, bias = turned(fits)
    print(f"conventions: pitch {error:.2f} degrees off, bias {bias:+.2f} ({len(fits)})")


if __name__ == "__main__":
    main()
