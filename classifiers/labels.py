"""What a drawing is labelled with: from the parameters in a shard's JSON to the networks' targets.

Left and right. A control with a left and a right version can say one thing in two ways: a grimace
of 2 on top of a left one of 3 is drawn exactly as a right one of 2 beside a left one of 5. One rule
everywhere, in the labels and in what is detected (`resolve_sides`): **what both sides share belongs
to the symmetric control, the rest to its side**, so that at most two of the three are ever active
and none is counted twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FULL = 5.0  # a full natural activation; intensities are detected from 0 to this
ACTIVE = 1.0  # from here on a control counts as active; between 0 and this it is neither


def resolve_sides(aus: Mapping[str, float]) -> dict[str, float]:
    """Apply the rule of left and right to every control that has all three versions.

    aus : control name -> intensity. -> the same names; of NAME, NAME_left and NAME_right the sum on
    each side is kept, the common part stands in NAME and at least one side is 0. Idempotent.
    """
    resolved = dict(aus)
    for name in aus:
        left, right = f"{name}_left", f"{name}_right"
        if left in aus and right in aus:
            common = min(aus[left], aus[right])
            resolved[name] = aus[name] + common
            resolved[left], resolved[right] = aus[left] - common, aus[right] - common
    return resolved


def mirrored_name(name: str) -> str:
    """The name of the same thing in a mirrored drawing: left and right exchanged."""
    swap = {"left": "right", "right": "left", "l": "r", "r": "l"}
    return "_".join(swap.get(word, word) for word in name.split("_"))


def mirror_order(names: Sequence[str]) -> NDArray[np.intp]:
    """Index (n,) such that values[index] are those of the mirrored drawing.

    Raises ValueError if a name has a side but its counterpart is missing.
    """
    places = {name: i for i, name in enumerate(names)}
    for name in names:
        if mirrored_name(name) not in places:
            raise ValueError(
                f"{name} has no counterpart {mirrored_name(name)}: name both sides or neither."
            )
    return np.array([places[mirrored_name(name)] for name in names], np.intp)


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
    """

    active: NDArray[np.float32]
    intensity: NDArray[np.float32]
    angles: NDArray[np.float32]
    landmarks: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.angles)

    def take(self, index: NDArray) -> Targets:
        return Targets(
            self.active[index], self.intensity[index], self.angles[index], self.landmarks[index]
        )


def encode(records: Sequence[Mapping], aus: Sequence[str], landmarks: Sequence[str]) -> Targets:
    """Targets from the shards' JSON records; raises ValueError naming what a record lacks."""
    intensity = np.zeros((len(records), len(aus)), np.float32)
    angles = np.zeros((len(records), 3), np.float32)
    points = np.zeros((len(records), len(landmarks), 2), np.float32)
    for i, record in enumerate(records):
        try:
            values = resolve_sides(record["aus"])
            intensity[i] = [values[name] for name in aus]
            angles[i] = [record["head"][name] for name in ("yaw", "pitch", "roll")]
            points[i] = [record["landmarks"][name] for name in landmarks]
        except KeyError as error:
            raise ValueError(
                f"Drawing {record.get('index', i)} of the data set has no entry {error}:"
                " generate it again with this version."
            ) from None
    active = np.where(intensity >= ACTIVE, 1, np.where(intensity > 0, np.nan, 0))
    return Targets(
        active.astype(np.float32), np.clip(intensity, 0, FULL), np.radians(angles), points
    )
