"""A head of hair as parameters that carry from person to person."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError

AZIMUTHS = 48
# Around the head's upright axis: 0 in front, positive to the face's own left, in radians.
ANGLES: NDArray[np.float64] = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS


@dataclass(frozen=True)
class Ball:
    """A bun, a tail or a braid: hair gathered along a line of its own.

    line : (k, 3) float, from where it begins to its tip: azimuth in radians, height as in
        `Cut.edge`, metres off the skin (off the head's axis above the crown)
    radius : (k,) float, metres
    plait : how many strands cross along it, 0 where none do
    """

    line: NDArray[np.float64]
    radius: NDArray[np.float64]
    plait: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "line", _numbers(self.line, "a ball's line", (None, 3)))
        size = (len(self.line),)
        object.__setattr__(self, "radius", _numbers(self.radius, "a ball's radius", size))
        if len(self.line) < 2:
            raise InputError("a ball's line must have at least two places")
        if (self.radius <= 0).any():
            raise InputError(f"a ball's radius must be positive, got {self.radius.min():g} m")


@dataclass(frozen=True)
class Cut:
    """One head of hair.

    Heights are shares of the head: 0 at the eyes, 1 at the crown, -1 at the chin, and further down
    in the same unit. The arrays run over ANGLES.

    edge : (48,) float, height at which the hair ends
    top : (48,) float, height above which the head is bald, as one is with a rim of hair; where it
        is not above the edge there is no hair. None for hair that covers the crown
    thick : (48, r) float, metres that the surface stands off the skin, from the parting (first of
        r equal steps along the hair) to the edge; where hair falls, off the upright below the
        head's widest place, so that less than none brings it nearer to the neck
    part : radians that the parting leans to the face's own left, None for a whorl on the crown
    hangs : whether hair falls from the head's widest place, else it follows the skin to its edge
    wave, curl : 0 straight to 1
    balls : buns, tails and braids
    colour : 0 blond to 1 black, as the brows' (see facs_rig.looks)
    stand : how far tips stand out of the surface, most on top: 0 lies, 1 stands up
    sweep : radians from straight back, positive to the face's own left, in which hair over the
        forehead is combed away from its hairline; None where the cut's height alone says whether
        it grows back or falls forward

    InputError for arrays of another shape and for numbers that are none or out of range.
    """

    edge: NDArray[np.float64]
    thick: NDArray[np.float64]
    part: float | None = None
    hangs: bool = False
    wave: float = 0.0
    curl: float = 0.0
    balls: tuple[Ball, ...] = ()
    colour: float = 0.75
    top: NDArray[np.float64] | None = None
    stand: float = 0.0
    sweep: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "edge", _numbers(self.edge, "edge", (AZIMUTHS,)))
        if self.top is not None:
            object.__setattr__(self, "top", _numbers(self.top, "top", (AZIMUTHS,)))
            if self.top.max() >= 1:
                raise InputError(f"a cut's top must lie below the crown, got {self.top.max():g}")
        object.__setattr__(self, "thick", _numbers(self.thick, "thick", (AZIMUTHS, None)))
        if self.thick.shape[1] < 2:
            raise InputError("a cut's thick must have at least two steps from parting to edge")
        if self.edge.max() >= 1:
            raise InputError(f"a cut's edge must lie below the crown, got {self.edge.max():g}")
        for name in ("wave", "curl", "colour", "stand"):
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"a cut's {name} must be from 0 to 1, got {getattr(self, name)}")
        if self.part is not None and not abs(self.part) < np.pi / 2:
            raise InputError(f"a cut's part must be within a quarter turn, got {self.part} rad")
        if self.sweep is not None and not abs(self.sweep) <= np.pi / 2:
            raise InputError(f"a cut's sweep must be within a quarter turn, got {self.sweep} rad")


def mirrored(cut: Cut) -> Cut:
    """The cut as a mirror shows it."""
    other = -np.arange(AZIMUTHS) % AZIMUTHS
    return Cut(
        cut.edge[other], cut.thick[other], None if cut.part is None else -cut.part, cut.hangs,
        cut.wave, cut.curl,
        tuple(Ball(ball.line * [-1, 1, 1], ball.radius, ball.plait) for ball in cut.balls),
        cut.colour, None if cut.top is None else cut.top[other], cut.stand,
        None if cut.sweep is None else -cut.sweep,
    )  # fmt: skip


def to_json(cut: Cut) -> str:
    """The cut as a text that `from_json` reads: exact, and the same for the same cut."""
    balls = [
        {"line": ball.line.tolist(), "radius": ball.radius.tolist(), "plait": ball.plait}
        for ball in cut.balls
    ]
    kept = {name: getattr(cut, name) for name in ("part", "hangs", "wave", "curl", "colour")}
    arrays = {"edge": cut.edge.tolist(), "thick": cut.thick.tolist()}
    rare = {} if cut.top is None else {"top": cut.top.tolist()}
    if cut.stand:
        rare["stand"] = cut.stand
    if cut.sweep is not None:
        rare["sweep"] = cut.sweep
    return json.dumps({**arrays, **rare, **kept, "balls": balls})


def from_json(text: str) -> Cut:
    """The cut that `to_json` wrote. InputError, one sentence, for any other text."""
    try:
        kept = dict(json.loads(text))
        balls = tuple(
            Ball(ball["line"], ball["radius"], int(ball["plait"])) for ball in kept["balls"]
        )
        part = None if kept["part"] is None else float(kept["part"])
        wave, curl, colour = (float(kept[name]) for name in ("wave", "curl", "colour"))
        hangs = bool(kept["hangs"])
        top, stand = kept.get("top"), float(kept.get("stand", 0.0))
        sweep = None if kept.get("sweep") is None else float(kept["sweep"])
        return Cut(
            kept["edge"], kept["thick"], part, hangs, wave, curl, balls, colour, top, stand, sweep
        )
    except InputError as error:
        raise InputError(f"what is kept of the hair cannot be used: {error}") from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError("what is kept of the hair is not what Sketch to Face wrote") from error


def _numbers(values: NDArray, name: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """The values as finite floats of a shape, None for any length; InputError for others."""
    out = np.array(values, dtype=np.float64)
    fits = len(out.shape) == len(shape)
    fits = fits and all(n in (None, m) for n, m in zip(shape, out.shape, strict=True))
    if not fits:
        wanted = " x ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{name} must be {wanted} numbers, got {' x '.join(map(str, out.shape))}")
    if not np.isfinite(out).all():
        raise InputError(f"{name} must be finite numbers, but holds {out[~np.isfinite(out)][0]}")
    out.flags.writeable = False
    return out
