"""The identities: the cage without them and what each of their targets moves it by."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..identity import ASYMMETRY, FEATURES, target_weights
from ..macros import ETHNICITIES, SEXES, WHOLE_FACES, macro_targets
from .makehuman import JOINTS, Source
from .sculpts import MIXES, sculpted
from .strands import mirror_cage

__all__ = ["WHOLE_FACES", "People", "read_people"]

# A child of six lies between the source's baby of one year and its child of ten.
SIX = {"baby": 4 / 9, "child": 5 / 9}
# At six a head has this share of the girth of an adult of its kind (Farkas 1994): boys and girls
# differ little yet. The source's children are small people with small heads: they grow until they
# have it.
GIRTH = {"female": 0.935, "male": 0.91}
ABOVE_EYES = 0.02  # metres, where there are no ears
OTHER_JOINT = [JOINTS.index(j) for j in ("head", "neck", "r-eye", "l-eye", "mouth")]


@dataclass(frozen=True)
class People:
    """base : (M, 3) metres;  deltas : (targets, M, 3), changed in place while baking."""

    base: NDArray
    deltas: NDArray

    @property
    def plain(self) -> NDArray[np.float64]:
        """(M, 3) the default face."""
        weights = target_weights({})[: len(self.deltas)]  # behind them are those of the fine skin
        default: NDArray[np.float64] = np.tensordot(weights, self.deltas, axes=1)
        return self.base + default


def read_people(source: Source) -> People:
    """All identity targets, in the order of `identity.target_weights`."""
    base = source.cage.copy()
    names = macro_targets()
    ends = [
        end for f in (*ASYMMETRY, *FEATURES) for end in zip((f.low, f.high), f.reach, strict=True)
    ]
    deltas = np.zeros((len(names) + len(ends), *base.shape))
    larger = {(e, s): growth(source, e, s) for e in ETHNICITIES for s in SEXES}
    for k, name in enumerate(names):
        if name not in MIXES:
            deltas[k] = whole_or_universal(source, base, name, larger)
    for k, (name, reach) in enumerate(ends, start=len(names)):
        deltas[k] = reach * source.target(name)
    first = len(names)  # the two ends of an asymmetry are each other's mirror image
    mirror = np.append(mirror_cage(base[: source.size]), source.size + np.array(OTHER_JOINT))
    for k in range(first, first + 2 * len(ASYMMETRY), 2):
        deltas[k] = deltas[k + 1][mirror] * (-1, 1, 1)
    people = People(base, deltas)
    plain = people.plain
    for k, name in enumerate(names):
        if name in MIXES:
            deltas[k] = sculpted(source, plain, name)
    return people


def whole_or_universal(
    source: Source, base: NDArray, name: str, larger: dict[tuple[str, str], float]
) -> NDArray[np.float64]:
    """(M, 3) what a macro target of the source moves; that of six years is mixed and grown.

    larger : (ethnicity, sex) -> see `growth`
    """
    if "-six" not in name:
        return source.target(name)
    sex = next(s for s in SEXES if f"-{s}-" in name)
    delta = mixed(source, name)
    if "universal" in name:
        delta = delta * np.mean([larger[e, sex] for e in ETHNICITIES])
    else:
        grown = larger[name.split("/")[1].split("-")[0], sex]
        delta = grown * delta + (grown - 1) * base
    joint = source.size + JOINTS.index("head")
    return delta - delta[joint]  # children stand where adults do


def mixed(source: Source, name: str) -> NDArray[np.float64]:
    """(M, 3) the target of a child of six."""
    parts = [s * source.target(name.replace("-six", f"-{age}")) for age, s in SIX.items()]
    return np.sum(parts, axis=0)


def growth(source: Source, ethnicity: str, sex: str) -> float:
    """How much larger a child of six must be for its head to be GIRTH of an adult's."""
    around = []
    for age, read in (("young", source.target), ("six", partial(mixed, source))):
        names = f"{ethnicity}-{sex}-{age}", f"universal-{sex}-{age}-averagemuscle-averageweight"
        face = source.cage + sum(read(f"macrodetails/{name}") for name in names)
        eyes = face[source.size + JOINTS.index("l-eye"), 1]
        skin = face[: source.size][source.is_part("skin")]
        head = skin[skin[:, 1] > eyes + ABOVE_EYES]
        around.append(np.ptp(head[:, 0]) + np.ptp(head[:, 2]))
    return float(GIRTH[sex] * around[0] / around[1])
