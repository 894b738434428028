"""A rectangle of a picture: where the head is, what is cropped, what is measured in."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

__all__ = ["Box"]


@dataclass(frozen=True)
class Box:
    """A rectangle in pixels of a picture: u to the right, v downwards, pixel centres at .5.

    It may reach beyond the picture. Unpacks to left, top, right, bottom.

    turn : radians, clockwise, about the middle; the sides are those of the box before it is turned
    """

    left: float
    top: float
    right: float
    bottom: float
    turn: float = 0.0

    def __iter__(self) -> Iterator[float]:
        return iter((self.left, self.top, self.right, self.bottom))

    def __str__(self) -> str:
        return ",".join(f"{side:g}" for side in self)

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.bottom - self.top

    @property
    def middle(self) -> tuple[float, float]:
        """Wherever it is turned to."""
        return (self.left + self.right) / 2, (self.top + self.bottom) / 2

    @classmethod
    def around(cls, points: NDArray) -> Box:
        """The smallest box, not turned, that holds points (k, 2); k at least 1."""
        (left, top), (right, bottom) = np.min(points, axis=0), np.max(points, axis=0)
        return cls(float(left), float(top), float(right), float(bottom))

    @classmethod
    def at(cls, left: float, top: float, width: float, height: float, turn: float = 0.0) -> Box:
        """By its corner and its size."""
        return cls(left, top, left + width, top + height, turn)

    @classmethod
    def square(cls, middle: Iterable[float], side: float, turn: float = 0.0) -> Box:
        u, v = middle
        return cls(u - side / 2, v - side / 2, u + side / 2, v + side / 2, turn)

    @classmethod
    def parse(cls, text: str, name: str = "The box") -> Box:
        """Read 'left,top,right,bottom'. InputError, one sentence, if it is no box.

        name : what the sentence calls it
        """
        try:
            values = [float(value) for value in text.split(",")]
        except ValueError:
            values = []
        if len(values) != 4:
            raise _not_a_box(name, text)
        return cls(*values).checked(name)

    def checked(self, name: str = "The box") -> Box:
        """Itself. InputError, one sentence, if nothing is in it or it has no end."""
        if not all(map(math.isfinite, self)):
            raise _not_a_box(name, str(self))
        if self.width <= 0 or self.height <= 0:
            raise InputError(
                f"{name} '{self}' is empty: its right and bottom must lie beyond its left and top."
            )
        return self

    def grown(self, share: float) -> Box:
        """With room on every side: a share of its width, and of its height."""
        room_u, room_v = share * self.width, share * self.height
        return Box(
            self.left - room_u, self.top - room_v, self.right + room_u, self.bottom + room_v,
            self.turn,
        )  # fmt: skip

    def to_units(self, points: NDArray) -> NDArray[np.float64]:
        """Pixels (..., 2) of the picture -> shares of the box (..., 2), 0 to 1 within."""
        points = _about(np.asarray(points, float), self.middle, -self.turn)
        return (points - (self.left, self.top)) / (self.width, self.height)

    def to_pixels(self, points: NDArray) -> NDArray[np.float64]:
        """Shares of the box (..., 2) -> pixels of the picture (..., 2)."""
        flat = np.asarray(points, float) * (self.width, self.height) + (self.left, self.top)
        return _about(flat, self.middle, self.turn)

    def within(self, shape: tuple[int, ...]) -> bool:
        """Whether it lies on a picture (h, w) whole, before it is turned."""
        return self.left >= 0 and self.top >= 0 and self.right <= shape[1] and (
            self.bottom <= shape[0]
        )  # fmt: skip

    def apart(self, other: Box) -> bool:
        """Whether two boxes share nothing, before they are turned."""
        return (
            self.left >= other.right
            or other.left >= self.right
            or self.top >= other.bottom
            or other.top >= self.bottom
        )


def _not_a_box(name: str, text: str) -> InputError:
    return InputError(
        f"{name} is given as left,top,right,bottom in pixels of the sketch, not as {text!r}."
    )


def _about(points: NDArray, middle: tuple[float, float], turn: float) -> NDArray[np.float64]:
    """Points (..., 2) turned clockwise, as one sees the picture, about another."""
    if not turn:
        return points
    c, s = np.cos(turn), np.sin(turn)
    return (points - middle) @ np.array([[c, s], [-s, c]]) + middle
