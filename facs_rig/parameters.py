"""What poses a face: FACS intensities, identity, head, neck and gaze, checked and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from .common.errors import InputError
from .controls import CONTROL_NAMES, MAX_INTENSITY

ANGLES = ("yaw", "pitch", "roll")
Angles = tuple[float, float, float]


@dataclass(frozen=True)
class FaceParameters:
    """Everything that poses one face.

    aus : control name -> intensity 0..10 (5 is full natural activation; missing is 0)
    identity : parameter name -> value, see facs_rig.IDENTITY (missing is the default)
    head, neck : yaw, pitch, roll in radians. Yaw turns to the face's own left, pitch looks down,
        roll tilts to the image's right.
    gaze : yaw, pitch of both eyes in radians, signed as the head's (AU 61 to 64)
    """

    aus: Mapping[str, float] = field(default_factory=dict)
    identity: Mapping[str, float] = field(default_factory=dict)
    head: Angles = (0.0, 0.0, 0.0)
    neck: Angles = (0.0, 0.0, 0.0)
    gaze: tuple[float, float] = (0.0, 0.0)

    def to_json(self) -> dict:
        """Plain dictionary, angles in degrees by name."""

        def angles(values: tuple[float, ...]) -> dict[str, float]:
            return {a: float(np.degrees(v)) for a, v in zip(ANGLES, values, strict=False)}

        return {
            "aus": dict(self.aus),
            "identity": dict(self.identity),
            "head": angles(self.head),
            "neck": angles(self.neck),
            "gaze": angles(self.gaze),
        }

    @classmethod
    def from_json(cls, data: Mapping) -> FaceParameters:
        """The inverse of `to_json`; what is missing is neutral."""

        def angles(part: str) -> Angles:
            yaw, pitch, roll = (float(np.radians(data.get(part, {}).get(a, 0.0))) for a in ANGLES)
            return yaw, pitch, roll

        aus, identity = dict(data.get("aus", {})), dict(data.get("identity", {}))
        return cls(aus, identity, angles("head"), angles("neck"), angles("gaze")[:2])


def nearest(name: str, known: tuple[str, ...]) -> str:
    """The end of a sentence about an unknown name: the known one that it resembles, if any."""
    close = get_close_matches(name, known, n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def intensities(aus: Mapping[str, float]) -> NDArray[np.float32]:
    """(47,) intensities in the catalogue's order; InputError for unknown names and bad values."""
    values = np.zeros(len(CONTROL_NAMES), dtype=np.float32)
    for name, value in aus.items():
        if name not in CONTROL_NAMES:
            hint = nearest(str(name), CONTROL_NAMES) or "; `sketch2face rig --list` shows all 47"
            raise InputError(f"there is no control '{name}'{hint}")
        if not 0 <= value <= MAX_INTENSITY:
            raise InputError(f"{name} = {value} is outside 0 to {MAX_INTENSITY:g}")
        values[CONTROL_NAMES.index(name)] = value
    return values
