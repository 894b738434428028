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

EAR = "ear"  # of a record, in front of the hair around it
FINER = 6  # pixels to a side of a cell, in which outlines are painted


@dataclass(frozen=True)
class Outlines:
    """Polygons on a page.

    points : (k, 2) px, of one polygon behind another      starts : where each begins, and k
    owners : of each polygon its place in REGIONS, and behind those an ear
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
            ((*REGIONS, EAR).index(name), np.asarray(outline, float).reshape(-1, 2))
            for name, outlines in told.items()
            if name in (*REGIONS, EAR)
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
        own = (REGIONS.index("face"), len(REGIONS))
        return any(owner not in own for owner in self.owners)

    def mask(self, points: NDArray, crop: Box, cells: int) -> NDArray[np.float32]:
        """(r, cells, cells) how much of each cell of a crop is of each region, 0..1.

        points : (k, 2), where the outlines' own have been moved to on the page

        Hair lies over a face, and so does a beard; an ear over hair; a hat over ears and beards.
        """
        size = cells * FINER
        places = crop.to_units(np.asarray(points, float)) * size - 0.5
        every = np.zeros((len(REGIONS) + 1, size, size), np.float32)
        for a, b, owner in zip(self.starts[:-1], self.starts[1:], self.owners, strict=True):
            if b - a > 2:
                image = Image.fromarray(every[owner])
                ImageDraw.Draw(image).polygon(places[a:b].ravel().tolist(), fill=1)
                every[owner] = np.asarray(image)
        found, ear = every[:-1], every[-1]
        face, hair, beard, hat = (REGIONS.index(n) for n in ("face", "hair", "beard", "hat"))
        found[hair] *= 1 - ear * (1 - found[hat])
        found[beard] *= 1 - found[hat]
        found[face] *= 1 - np.maximum(found[hair], found[beard])
        if not self.hats:
            found[REGIONS.index("hat")] = np.nan
        return found.reshape(len(REGIONS), cells, FINER, cells, FINER).mean(axis=(2, 4))
