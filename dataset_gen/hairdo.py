"""Who wears which head of hair: the presets of facs_rig.hair, varied by lot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from facs_rig.hair.cut import ANGLES, Ball, Cut, mirrored
from facs_rig.hair.presets import preset
from facs_rig.macros import age_of

HAIR = 0.75  # share of faces that wear a head of hair
# How often a woman and a man wear a preset.
WORN: dict[str, tuple[float, float]] = {
    "bald_rim": (0.0, 2.5), "crop": (0.5, 3.0), "side_parting": (0.4, 2.6), "bob": (2.4, 0.25),
    "long_straight": (2.4, 0.35), "long_wavy": (2.4, 0.35), "curls": (1.0, 0.7),
    "afro": (0.3, 0.3), "bun": (1.1, 0.15), "ponytail": (1.1, 0.2), "braids": (0.6, 0.03),
    "fringe": (1.5, 0.5),
}  # fmt: skip
RIM_AGES = (age_of(30.0), age_of(65.0))  # from which on a rim of hair is worn, and as often as ever
BRAIDED = age_of(30.0)  # up to which braids are as often as that; half as often later
AFRICAN = {"afro": 8.0, "curls": 2.0}  # times as often by people who are African alone
# How a head of hair is drawn, and how often where it is light and where it is black.
FINISHES: dict[str, tuple[float, float]] = {
    "outline": (3.0, 1.0), "strands": (4.0, 2.2), "dense": (0.5, 1.5), "hatch": (0.6, 0.8),
    "brush": (0.05, 1.2), "black": (0.0, 1.6),
}  # fmt: skip
# Times as often in a look of styles.LOOKS.
LOOKS: Mapping[str, Mapping[str, float]] = {
    "brush": {"brush": 3.0, "black": 2.0, "hatch": 0.3},
    "marker": {"black": 1.5, "dense": 0.5, "hatch": 0.4},
    "pencil": {"strands": 1.5, "dense": 1.5, "black": 0.2, "brush": 0.3},
    "ballpoint": {"strands": 1.3, "dense": 1.5, "black": 0.3, "brush": 0.3},
    "technical": {"outline": 2.0, "brush": 0.3},
}
CURLY = 0.4  # curl from which on hair is mostly drawn as curls
SWAP = 0.15  # share of partings that are elsewhere than the preset's, or gone


@dataclass(frozen=True)
class Hairdo:
    """A varied preset and how it is drawn, as a sample's record tells it.

    preset : of facs_rig.hair.presets;  mirror : whether as a mirror shows it
    length : factor of how far hair falls below the eyes
    rise, front, aside : shares of the head by which its edge is higher: all around, more in front
        than behind, and more on the face's left than on its right
    volume, uneven : factor of its thickness, and how much more of it the left side has
    part : radians that the parting leans to the left, None for a whorl
    wave, curl, colour : as in `Cut`
    finish : of FINISHES, or curls
    """

    preset: str
    mirror: bool = False
    length: float = 1.0
    rise: float = 0.0
    front: float = 0.0
    aside: float = 0.0
    volume: float = 1.0
    uneven: float = 0.0
    part: float | None = None
    wave: float = 0.0
    curl: float = 0.0
    colour: float = 0.75
    finish: str = "strands"

    def to_json(self) -> dict:
        """All of it, as JSON knows it."""
        return asdict(self)

    @classmethod
    def from_json(cls, stored: Mapping) -> Hairdo:
        """The hairdo of `to_json`."""
        return cls(**stored)

    def cut(self) -> Cut:
        """The head of hair. InputError for a preset that there is not."""
        cut = _preset(self.preset)
        if self.mirror:
            cut = mirrored(cut)
        edge = np.where(cut.edge < 0, self.length * cut.edge, cut.edge)
        edge = edge + self.rise + self.front * np.cos(ANGLES) + self.aside * np.sin(ANGLES)
        thick = cut.thick * self.volume * (1 + self.uneven * np.sin(ANGLES))[:, None]
        balls = tuple(self._ball(ball) for ball in cut.balls)
        return replace(
            cut, edge=np.minimum(edge, np.maximum(cut.edge, 0.9)), thick=thick, part=self.part,
            wave=self.wave, curl=self.curl, colour=self.colour, balls=balls,
        )  # fmt: skip

    def _ball(self, ball: Ball) -> Ball:
        """A tail or a bun as long and as thick as all of it."""
        line = ball.line.copy()
        first = line[0, 1]
        below = line[:, 1] < first
        line[below, 1] = first + self.length * (line[below, 1] - first)
        return Ball(line, ball.radius * self.volume**0.5, ball.plait)


@lru_cache(maxsize=32)
def _preset(name: str) -> Cut:
    return preset(name)


def sample_hairdo(rng: np.random.Generator, who: Mapping[str, float], look: str) -> Hairdo:
    """A head of hair by lot, as somebody of this sex, age and origin may wear it.

    who : an identity;  look : of the style that it is drawn in
    """
    name = str(rng.choice(list(WORN), p=_odds(who)))
    cut = _preset(name)
    mirror = bool(rng.random() < 0.5)
    part = cut.part
    if part is not None:
        part = (-part if mirror else part) + rng.normal(0, 0.12)
        if rng.random() < SWAP:
            part = None if rng.random() < 0.4 else rng.uniform(-0.7, 0.7)
    elif cut.hangs and rng.random() < SWAP:
        part = rng.uniform(-0.6, 0.6)
    wave = np.clip(cut.wave + 0.25 * abs(rng.normal()) * (rng.random() < 0.5), 0, 1)
    curl = np.clip(cut.curl + rng.normal(0, 0.12), 0, 1) if cut.curl else 0.0
    # Grey hair is drawn as light as blond.
    colour = who.get("brow_colour", cut.colour) * (1 - 0.8 * who.get("brow_grey", 0.0))
    colour = np.clip(colour + rng.normal(0, 0.1), 0, 1)
    values: dict[str, float | None] = {
        "length": np.clip(rng.lognormal(0, 0.2), 0.6, 1.6),
        "rise": rng.normal(0, 0.04), "front": rng.normal(0, 0.03), "aside": rng.normal(0, 0.035),
        "volume": rng.uniform(0.65, 1.6), "uneven": np.clip(rng.normal(0, 0.12), -0.4, 0.4),
        "part": part, "wave": wave, "curl": curl, "colour": colour,
    }  # fmt: skip
    told: dict[str, Any] = {
        k: None if v is None else round(float(v), 4) for k, v in values.items()
    }  # fmt: skip
    return Hairdo(name, mirror, finish=_finish(rng, curl, colour, look), **told)


def _odds(who: Mapping[str, float]) -> np.ndarray:
    """(presets,) how likely somebody wears each of WORN."""
    man, age = who.get("gender", 0.5), who.get("age", 0.0)
    odds = {name: woman + man * (of_men - woman) for name, (woman, of_men) in WORN.items()}
    odds["bald_rim"] *= float(np.interp(age, RIM_AGES, (0, 1)))
    odds["braids"] *= 1.0 if age < BRAIDED else 0.5
    for name, times in AFRICAN.items():
        odds[name] *= 1 + (times - 1) * who.get("african", 0.0)
    values = np.array(list(odds.values()))
    return values / values.sum()


def _finish(rng: np.random.Generator, curl: float, colour: float, look: str) -> str:
    """How hair of this colour is drawn in this look, by lot."""
    if curl > CURLY and rng.random() < 0.7:
        return "curls"
    factors = LOOKS.get(look, {})
    odds = np.array([
        (light + colour**2 * (dark - light)) * factors.get(name, 1.0)
        for name, (light, dark) in FINISHES.items()
    ])  # fmt: skip
    return str(rng.choice(list(FINISHES), p=odds / odds.sum()))
