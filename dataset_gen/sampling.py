"""Random faces: what a sample of the data set is made of.

Every sample draws from its own generator, seeded with the data set's seed and the sample's index,
so that sample k is the same whatever ran before it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from facs_rig import (
    CONTROL_NAMES,
    FULL_INTENSITY,
    TWELVE,
    Camera,
    FaceParameters,
    FaceRig,
)  # fmt: skip
from facs_rig.identity import EARLIER, FEATURES

from .feelings import sample_feeling
from .linework.lines import DETAILS, KINDS, WAYS
from .linework.style import Style
from .population import sample_person
from .styles import sample_style

# The first is what is meant where nothing is said.
SCHEMES = ("people", "felt", "sparse", "thesis", "smooth", "varied")
OF_ALL_KINDS = ("people", "felt")  # the schemes whose people are
DEFAULT = SCHEMES[0]
WAY_ODDS = {"levels": 0.3, "suggestive": 0.2, "creases": 0.3, "apparent": 0.2}  # of lines.WAYS
MOST_ACTIONS = 7
# The twelve that classifiers are trained for first come up this much more often than the others.
TWELVE_ODDS = 3.0
FELT = 0.6  # share of faces in the scheme `felt` that do what a feeling does


@dataclass(frozen=True)
class Sample:
    """One face to draw: parameters, camera, level of detail, kinds of lines and style."""

    parameters: FaceParameters
    camera: Camera
    detail: int
    kinds: tuple[str, ...]
    style: Style


def sample_rng(seed: int, index: int) -> np.random.Generator:
    """The generator of sample `index`, independent of all other samples."""
    return np.random.default_rng([seed, index])


def second_rng(seed: int, index: int) -> np.random.Generator:
    """The generator of how sample `index` is drawn, beside the face and its style."""
    return np.random.default_rng([seed, index, 1])


def sample_face(
    rig: FaceRig,
    rng: np.random.Generator,
    size: int,
    scheme: str = DEFAULT,
    drawable: Collection[str] = KINDS,
    identity: Mapping[str, float] | None = None,
    actions: Mapping[str, float] | None = None,
) -> Sample:
    """A random face, its camera (size x size pixels) and its style.

    scheme : people, a few actions at any strength, done in their own way by people of all kinds
        and ages (see population); felt, the same people, most of whom feel something (see
        feelings); sparse, the same by adults who do all in one way; smooth, these
        faces without creases; varied, two in three of them with faint creases or none; thesis,
        every action at a random 0 to 5
    drawable : the kinds of lines that the engine knows; ways that need others are not drawn by lot
    identity, actions : whose face it is and what it does, else by lot
    """
    if scheme == "felt" and rng.random() < FELT:
        aus = sample_feeling(rng)
    else:
        aus = _thesis_actions(rng) if scheme == "thesis" else sample_actions(rng)
    yaw = rng.normal(0, 12) if rng.random() < 0.45 else rng.uniform(-50, 50)
    head = np.radians([yaw, rng.normal(0, 7), rng.normal(0, 5)])
    neck = np.radians(rng.normal(0, 1.5, 3))
    gaze = np.radians(rng.normal(0, (12, 7))) if rng.random() < 0.5 else np.zeros(2)
    looking = (float(gaze[0]), float(gaze[1]))
    who = sample_person(rng) if scheme in OF_ALL_KINDS else {**EARLIER, **sample_identity(rng)}
    if identity is not None:
        who = dict(identity)
    if actions is not None:
        aus = dict(actions)
    parameters = FaceParameters(aus, who, _floats(head), _floats(neck), looking)
    distance = float(rng.uniform(0.7, 2.5)) if rng.random() < 0.5 else float("inf")
    margin = float(rng.uniform(0.02, 0.12))
    framing = Camera.framing(rig.extent(parameters), size, size, margin, distance)
    shift = rng.uniform(-0.02, 0.02, 2) * size
    camera = framing.cropped(shift[0], shift[1], shift[0] + size, shift[1] + size, size, size)
    detail = int(rng.integers(len(DETAILS)))
    ways = [way for way in WAYS if {*sum(WAYS[way], ())} <= {*drawable}]
    odds = np.array([WAY_ODDS[way] for way in ways])
    way = "levels" if scheme == "thesis" else str(rng.choice(ways, p=odds / odds.sum()))
    kinds = tuple(kind for kind in WAYS[way][detail] if kind in drawable)
    # The older schemes draw as they always did, so that what is measured on them compares.
    style = sample_style(rng, shaded=scheme in OF_ALL_KINDS)
    if scheme in ("smooth", "varied"):  # last, so that all else is as in sparse
        wrinkles = (
            -1.0 if scheme == "smooth" else _crease_depth(rng, parameters.identity["wrinkles"])
        )
        identity = {**parameters.identity, "wrinkles": wrinkles}
        parameters = replace(parameters, identity=identity)
    return Sample(parameters, camera, detail, kinds, style)


def _crease_depth(rng: np.random.Generator, wrinkles: float) -> float:
    """The identity's `wrinkles`: of three faces one has none, one faint creases, one its own."""
    kind = rng.integers(3)
    return (-1.0, round(float(rng.uniform(-1, 0)), 4), wrinkles)[kind]


def sample_actions(rng: np.random.Generator) -> dict[str, float]:
    """A few actions at any strength: the improvement that the thesis proposes.

    First how many, then which, then how strong, over the whole natural range.
    """
    odds = np.array([TWELVE_ODDS if name in TWELVE else 1.0 for name in CONTROL_NAMES])
    count = int(rng.integers(0, MOST_ACTIONS + 1))
    chosen = rng.choice(len(odds), count, replace=False, p=odds / odds.sum())
    return {CONTROL_NAMES[k]: float(rng.uniform(1.0, 1.2 * FULL_INTENSITY)) for k in chosen}


def _thesis_actions(rng: np.random.Generator) -> dict[str, float]:
    """Every action at a random integer from 0 to 5: the thesis' own scheme."""
    return {name: float(rng.integers(0, 6)) for name in CONTROL_NAMES}


def sample_identity(rng: np.random.Generator) -> dict[str, float]:
    """A random adult: mixed or clear in gender and ethnicity, young to old, varied features."""
    shares = rng.dirichlet([0.6, 0.6, 0.6])
    values = {
        "gender": rng.beta(0.6, 0.6),
        "age": rng.beta(0.7, 1.3),
        "weight": np.clip(rng.normal(0, 0.4), -1, 1),
        "african": shares[0],
        "asian": shares[1],
        "caucasian": shares[2],
        "wrinkles": np.clip(rng.normal(0, 0.25), -1, 1),
    }
    for feature in FEATURES:
        if rng.random() < 0.6:
            values[feature.name] = np.clip(rng.normal(0, 0.35), feature.minimum, feature.maximum)
    return {name: round(float(value), 4) for name, value in values.items()}


def _floats(values: np.ndarray) -> tuple[float, float, float]:
    a, b, c = (float(v) for v in values)
    return a, b, c
