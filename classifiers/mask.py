"""Where on a page face, hair, beard and hat are, from a network's answer for each cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box

from .labels import REGIONS

HIDES = 0.5  # from this probability on
SURE = 1e-3  # probabilities nearer to 0 or 1 than this are taken for it


@dataclass(frozen=True, eq=False)
class Mask:
    """What lies where in a part of a page.

    box : that part, in pixels of the page
    shares : (r, c, c) how probable each of the first r REGIONS is in each cell of it
    """

    box: Box
    shares: NDArray[np.float64]

    def hides(self, points: NDArray) -> NDArray[np.bool_]:
        """(k,) whether hair, a hat or a beard hides the face at points (k, 2) of the page."""
        return np.maximum(self.at("hair", points), self.at("beard", points)) >= HIDES

    def at(self, region: str, points: NDArray) -> NDArray[np.float64]:
        """(k,) how probable a region of REGIONS is at points (k, 2) of the page, 0..1: between the
        middles of cells as they say it together, beyond the box as at its edge."""
        if REGIONS.index(region) >= len(self.shares):  # older networks tell of no hats
            return np.zeros(len(points))
        shares = self.shares[REGIONS.index(region)]
        last = len(shares) - 1
        u, v = np.clip(self.box.to_units(np.asarray(points, float)) * len(shares) - 0.5, 0, last).T
        column, row = (np.minimum(x.astype(int), max(last - 1, 0)) for x in (u, v))
        a, b = u - column, v - row
        right, below = np.minimum(column + 1, last), np.minimum(row + 1, last)
        return (
            shares[row, column] * (1 - a) * (1 - b) + shares[row, right] * a * (1 - b)
            + shares[below, column] * (1 - a) * b + shares[below, right] * a * b
        )  # fmt: skip

    def amid(self, wider: Mask, cells: int) -> Mask:
        """This mask where it tells, and around it another one: over the box of that, in so many
        cells to a side."""
        middles = (np.arange(cells) + 0.5) / cells
        grid = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
        points = wider.box.to_pixels(grid)
        own = self.box.to_units(points)
        inside = ((own > 0) & (own < 1)).all(axis=1)
        shares = [
            np.where(inside, self.at(name, points), wider.at(name, points)).reshape(cells, cells)
            for name in REGIONS[: len(self.shares)]
        ]
        return Mask(wider.box, np.stack(shares))

    def agreed(self, other: Mask, region: str, weight: float = 0.5) -> Mask:
        """The same, with a region as probable as this mask and another one say on average: of
        log-odds, that is by what each is sure of.

        weight : 0 to 1, of what the other says
        """
        index, last = REGIONS.index(region), len(self.shares[0])
        if index >= len(other.shares):
            return self
        middles = (np.arange(last) + 0.5) / last
        cells = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
        theirs = other.at(region, self.box.to_pixels(cells)).reshape(last, last)
        both = np.clip(np.stack([self.shares[index], theirs]), SURE, 1 - SURE)
        shares = self.shares.copy()
        odds = np.average(np.log(both / (1 - both)), axis=0, weights=(1 - weight, weight))
        shares[index] = 1 / (1 + np.exp(-odds))
        return Mask(self.box, shares)
