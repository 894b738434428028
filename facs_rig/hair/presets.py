"""Heads of hair to start from, as one table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from .cut import ANGLES, Ball, Cut
from .head import WIDEST

STEPS = 9  # of the thickness, from the parting to the edge
LYING = 0.0028  # metres of hair at an edge that lies on the skin
Points = tuple[tuple[float, float], ...]

# Degrees from the front and height, the same on both sides. Where hair begins to grow, from the
# forehead's middle around the ear to the nape.
HAIRLINE: Points = (
    (0, 0.59), (14, 0.60), (27, 0.58), (36, 0.49), (42, 0.36), (50, 0.24), (60, 0.14), (68, -0.02),
    (76, -0.10), (82, 0.10), (88, 0.24), (98, 0.26), (110, 0.16), (119, -0.10), (128, -0.30),
    (145, -0.42), (180, -0.46),
)  # fmt: skip
# And where it ends upwards on a bald head: in front of the temples there is none.
TOP: Points = ((0, 0.30), (62, 0.30), (72, 0.38), (90, 0.42), (120, 0.50), (150, 0.56), (180, 0.58))


@dataclass(frozen=True)
class Preset:
    """A row of the table.

    edge, top : degrees and height, from front to back
    thick : metres in front, on top, at the sides, behind;  tips : the same of hanging hair's edge
    part : degrees that the parting leans to the left;  balls, and the rest : as in `Cut`
    """

    edge: Points
    thick: tuple[float, float, float, float]
    tips: tuple[float, float, float] | None = None
    part: float | None = None
    hangs: bool = False
    wave: float = 0.0
    curl: float = 0.0
    balls: tuple[tuple[tuple[tuple[float, float, float, float], ...], int], ...] = ()
    colour: float = 0.75
    lying: float = LYING
    top: Points | None = None


PRESETS: Mapping[str, Preset] = {
    "bald_rim": Preset(HAIRLINE, (0.003, 0.007, 0.008, 0.009), colour=0.6, top=TOP),
    "crop": Preset(HAIRLINE, (0.011, 0.013, 0.006, 0.007), colour=0.8),
    "side_parting": Preset(HAIRLINE, (0.019, 0.019, 0.010, 0.011), part=24.0, colour=0.55),
    "bob": Preset(
        ((0, 0.55), (12, 0.52), (24, 0.44), (34, 0.26), (41, 0.02), (47, -0.30), (53, -0.68),
         (60, -0.86), (80, -0.86), (110, -0.82), (180, -0.74)),
        (0.012, 0.017, 0.015, 0.018), (0.004, 0.006, -0.020), part=14.0, hangs=True, colour=0.85,
    ),
    "long_straight": Preset(
        ((0, 0.59), (14, 0.55), (26, 0.46), (35, 0.26), (42, 0.0), (49, -0.5), (56, -1.2),
         (64, -1.55), (90, -1.72), (130, -1.86), (180, -1.95)),
        (0.009, 0.012, 0.011, 0.013), (0.006, 0.004, -0.034), part=0.0, hangs=True, colour=0.25,
    ),
    "long_wavy": Preset(
        ((0, 0.57), (14, 0.53), (26, 0.44), (35, 0.22), (42, -0.05), (49, -0.5), (56, -1.1),
         (64, -1.4), (90, -1.6), (130, -1.74), (180, -1.82)),
        (0.014, 0.018, 0.020, 0.020), (0.016, 0.022, -0.012), part=16.0, hangs=True, wave=0.8,
        colour=0.5,
    ),
    "curls": Preset(
        ((0, 0.52), (14, 0.52), (27, 0.48), (36, 0.38), (44, 0.20), (52, -0.05), (58, -0.45),
         (66, -0.70), (80, -0.78), (110, -0.80), (180, -0.85)),
        (0.024, 0.028, 0.030, 0.030), (0.030, 0.036, 0.020), part=-10.0, hangs=True, wave=0.3,
        curl=0.8, colour=0.7,
    ),
    "afro": Preset(
        ((0, 0.58), (14, 0.58), (27, 0.54), (36, 0.46), (44, 0.34), (52, 0.22), (62, 0.08),
         (72, -0.06), (82, -0.12), (98, -0.12), (112, -0.2), (122, -0.35), (140, -0.52),
         (180, -0.58)),
        (0.055, 0.062, 0.060, 0.062), curl=1.0, colour=0.85, lying=0.022,
    ),
    "bun": Preset(
        HAIRLINE, (0.005, 0.006, 0.004, 0.006), colour=0.9,
        balls=((((180, 0.66, -0.014, 0.026), (180, 0.79, 0.014, 0.031), (180, 0.91, 0.052, 0.026)),
                0),),
    ),
    "ponytail": Preset(
        HAIRLINE, (0.006, 0.008, 0.005, 0.007), colour=0.4,
        balls=((((180, 0.58, -0.006, 0.013), (180, 0.63, 0.016, 0.015), (180, 0.50, 0.036, 0.024),
                 (180, 0.05, 0.034, 0.030), (180, -0.5, 0.050, 0.026), (180, -1.2, 0.062, 0.009)),
                0),),
    ),
    "braids": Preset(
        HAIRLINE, (0.006, 0.008, 0.006, 0.008), part=0.0, colour=0.3,
        balls=tuple(
            (((side * 138, -0.34, -0.010, 0.014), (side * 122, -0.52, 0.010, 0.017),
              (side * 96, -0.80, 0.022, 0.018), (side * 78, -1.2, 0.030, 0.016),
              (side * 74, -1.75, 0.032, 0.009)), 3)
            for side in (1, -1)
        ),
    ),
    "fringe": Preset(
        ((0, 0.17), (20, 0.15), (33, 0.12), (40, 0.02), (46, -0.3), (52, -0.72), (60, -0.95),
         (80, -0.98), (110, -0.96), (180, -0.92)),
        (0.012, 0.017, 0.015, 0.017), (0.012, 0.014, 0.002), hangs=True, colour=0.85,
    ),
}  # fmt: skip


def preset(name: str) -> Cut:
    """A head of hair to start from; InputError for a name that is none."""
    if name not in PRESETS:
        raise InputError(f"there is no hair '{name}'; choose one of {', '.join(PRESETS)}")
    row = PRESETS[name]
    return Cut(
        _around(row.edge), _thickness(row), None if row.part is None else np.radians(row.part),
        row.hangs, row.wave, row.curl,
        tuple(
            Ball(np.array(line)[:, :3] * [np.pi / 180, 1, 1], np.array(line)[:, 3], plait)
            for line, plait in row.balls
        ),
        row.colour, None if row.top is None else _around(row.top),
    )  # fmt: skip


def _around(points: Points) -> NDArray[np.float64]:
    """(48,) values at ANGLES of points that are alike on both sides, rounded a little."""
    angle = np.degrees(np.minimum(ANGLES, 2 * np.pi - ANGLES))
    fine = np.stack([np.interp(np.abs(angle + off), *np.array(points).T) for off in (-3, 0, 3)])
    return fine.mean(axis=0)


def _thickness(row: Preset) -> NDArray[np.float64]:
    """(48, STEPS) metres: on top what the top has, then what each side has, then the edge's."""
    front, top, side, behind = row.thick
    below = _around(((0, front), (35, front), (80, side), (110, side), (180, behind)))[:, None]
    t = np.linspace(0, 1, STEPS)[None]
    body = top + (below - top) * np.clip(t / 0.55, 0, 1) ** 1.5
    lying = np.clip((t - 0.5) / 0.5, 0, 1) ** 1.8
    out = body + (row.lying - body) * lying
    if row.tips is not None:
        front, side, behind = row.tips
        tips = _around(((0, front), (50, front), (80, side), (110, side), (180, behind)))[:, None]
        falling = body + (tips - body) * np.clip((t - 0.4) / 0.6, 0, 1) ** 1.4
        falls = np.clip((WIDEST - _around(row.edge)) / 0.2, 0, 1)[:, None]
        out = out + (falling - out) * falls
    return out
