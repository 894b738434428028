"""What the networks are to answer: from the parameters in a shard's JSON to arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.errors import InputError
from facs_rig.identity import BY_NAME

from ..labels import ACTIVE, FULL, PERSON, resolve_sides
from .shards import DataSet

BOYS = -0.4  # `age` up to which nobody has a beard


def rotated_in_picture(angles: Sequence[float], turn: float) -> tuple[float, float, float]:
    """Yaw, pitch, roll (radians) after the picture has been turned clockwise by `turn` radians.

    The head's rotation is R = Y(yaw) X(pitch) Z(roll) as in facs_rig; turning the picture puts a
    rotation about the line of sight before it, and the three angles are read off the product.
    """
    yaw, pitch, roll = angles
    cy, sy, cp, sp, cr, sr = (f(a) for a in (yaw, pitch, roll) for f in (np.cos, np.sin))
    # Third column and second row of R are all that the angles are read from, and the turn needs
    # the first two entries of each column it mixes.
    first = np.array([cy * cr - sy * sp * sr, cy * sr + sy * sp * cr, sy * cp])
    second = np.array([-cp * sr, cp * cr, -sp])
    c, s = np.cos(turn), np.sin(turn)
    first, second = c * first + s * second, -s * first + c * second
    third_z = cy * cp
    return (
        float(np.arctan2(first[2], third_z)),
        float(np.arcsin(np.clip(-second[2], -1, 1))),
        float(np.arctan2(-second[0], second[1])),
    )


@dataclass(frozen=True)
class Targets:
    """Labels of n drawings.

    active : (n, k) float32, 1 yes, 0 no, nan neither (intensity between 0 and 1)
    intensity : (n, k) float32, 0..5      angles : (n, 3) float32, yaw, pitch, roll in radians
    landmarks : (n, m, 2) float32, pixels of the drawing
    person : (n, p) float32, the parameters of identity that PERSON names; nan where not known
    """

    active: NDArray[np.float32]
    intensity: NDArray[np.float32]
    angles: NDArray[np.float32]
    landmarks: NDArray[np.float32]
    person: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.angles)

    def take(self, index: NDArray) -> Targets:
        return Targets(**{name: values[index] for name, values in vars(self).items()})


def manly(person: NDArray) -> float:
    """How much of a grown man somebody is, 0..1, of parameters (p,): who is not known may be."""
    man, age = (float(person[PERSON.index(name)]) for name in ("gender", "age"))
    return 0.5 if np.isnan(man) else man * (np.isnan(age) or age > BOYS)


def encode_all(data: DataSet, aus: Sequence[str], landmarks: Sequence[str]) -> Targets:
    """`encode` of all of a data set's records, by its processes."""
    parts = data.each(partial(encode, aus=tuple(aus), landmarks=tuple(landmarks)))
    return Targets(*(np.concatenate(c) for c in zip(*map(astuple, parts), strict=True)))


def encode(records: Sequence[Mapping], aus: Sequence[str], landmarks: Sequence[str]) -> Targets:
    """Targets from the shards' JSON records; raises InputError naming what a record lacks.

    Landmarks are where they were drawn, if an artist had them elsewhere; what a way of drawing
    hides is neither active nor not.
    """
    intensity = np.zeros((len(records), len(aus)), np.float32)
    angles = np.zeros((len(records), 3), np.float32)
    points = np.zeros((len(records), len(landmarks), 2), np.float32)
    person = np.full((len(records), len(PERSON)), np.nan, np.float32)
    unseen = np.zeros(intensity.shape, bool)
    places_of = {name: k for k, name in enumerate(aus)}
    for i, record in enumerate(records):
        try:
            values = resolve_sides(record["aus"])
            intensity[i] = [values[name] for name in aus]
            angles[i] = [record["head"][name] for name in ("yaw", "pitch", "roll")]
            places = record.get("drawn_landmarks", record["landmarks"])
            points[i] = [places[name] for name in landmarks]
        except KeyError as error:
            raise InputError(
                f"Drawing {record.get('index', i)} of the data set has no entry {error}:"
                " generate it again with this version."
            ) from None
        if identity := record.get("identity"):
            person[i] = [identity.get(name, BY_NAME[name].default) for name in PERSON]
        for name in record.get("hidden", ()):
            if name in places_of:
                unseen[i, places_of[name]] = True
    active = np.where(intensity >= ACTIVE, 1, np.where(intensity > 0, np.nan, 0))
    active[unseen] = np.nan
    return Targets(
        active.astype(np.float32), np.clip(intensity, 0, FULL), np.radians(angles), points,
        person,
    )  # fmt: skip
