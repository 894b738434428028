"""What lies where on a drawing, as its record tells it: outlines, and a coarse mask of a crop."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from facs_rig.common.box import Box

from ..labels import REGIONS

FINER = 6  # pixels to a side of a cell, in which outlines are painted


@dataclass(frozen=True)
class Outlines:
    """Polygons on a page.

    points : (k, 2) px, of one polygon behind another      starts : where each begins, and k
    owners : of each polygon its place in REGIONS
    hats : whether it is told where hats are
    """

    points: NDArray[np.float64]
    starts: tuple[int, ...]
    owners: tuple[int, ...]
    hats: bool = True

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> Outlines | None:
        """Those of a drawing's record; None if it tells none."""
        told = record.get("regions")
        if told is None:
            return None
        every = [
            (REGIONS.index(name), np.asarray(outline, float).reshape(-1, 2))
            for name, outlines in told.items()
            if name in REGIONS
            for outline in outlines
        ]
        points = [outline for _, outline in every]
        starts = np.cumsum([0, *map(len, points)])
        return cls(
            np.concatenate([np.zeros((0, 2)), *points]),
            tuple(starts.tolist()),
            tuple(owner for owner, _ in every),
            "hat" in told or record.get("artist", {}).get("hat", "none") in ("none", "band"),
        )

    @property
    def haired(self) -> bool:
        """Whether anything but a face is told of."""
        return any(owner != REGIONS.index("face") for owner in self.owners)

    def mask(self, points: NDArray, crop: Box, cells: int) -> NDArray[np.float32]:
        """(r, cells, cells) how much of each cell of a crop is of each region, 0..1.

        points : (k, 2), where the outlines' own have been moved to on the page

        Hair lies over a face, and so does a beard, which what is worn on the head may hide.
        """
        size = cells * FINER
        places = crop.to_units(np.asarray(points, float)) * size - 0.5
        found = np.zeros((len(REGIONS), size, size), np.float32)
        for a, b, owner in zip(self.starts[:-1], self.starts[1:], self.owners, strict=True):
            if b - a > 2:
                image = Image.fromarray(found[owner])
                ImageDraw.Draw(image).polygon(places[a:b].ravel().tolist(), fill=1)
                found[owner] = np.asarray(image)
        found[REGIONS.index("beard")] *= 1 - found[REGIONS.index("hat")]
        face, *others = (REGIONS.index(name) for name in ("face", "hair", "beard"))
        found[face] *= 1 - np.maximum(*found[others])
        if not self.hats:
            found[REGIONS.index("hat")] = np.nan
        return found.reshape(len(REGIONS), cells, FINER, cells, FINER).mean(axis=(2, 4))
