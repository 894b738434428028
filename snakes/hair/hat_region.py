"""Where on a page somebody's hat lies, to the drawn line, and whether there is one.

As hair is found (`region`): by the network's answer, by which paper is outside, and by the lines at
which a region ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facs_rig import Camera, FaceRig
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from .region import (
    ROWS,
    At,
    PageHair,
    Zones,
    chance,
    contour,
    grid,
    log_odds,
    outside,
    spread,
    theirs,
)
from .texture import strokes_in, texture_of, tone_of

__all__ = ["page_hat", "without_hat"]

ROOM = (0.55, 0.95, 0.55, 0.3)
"""Heads to the left, above, to the right and below the posed head that are looked at."""
WORN, LEAST = 0.5, 0.05
"""Probability from which on a place is a hat's, and square heads of such places above the eyes that
a hat has at least."""
PAPER, SKIN = -2.0, -0.6
"""Log-odds of paper outside, and of the face below the eyes."""
NEAR = 0.05
"""Heads between a head and a hat that is still its own."""
LEFT = 0.012
"""Square heads of hair that a hat leaves to be seen at least; less is its uneven border."""


def page_hat(
    drawing: NDArray[np.floating],
    at: At,
    rig: FaceRig,
    vertices: NDArray[np.floating],
    camera: Camera,
    seen: Box | None = None,
    others: Sequence[Box] = (),
) -> PageHair | None:
    """The hat of a fitted face as if it were hair, in a grid of its own; None where there is none.

    All arguments as `region.page_hair`, `at` for the region "hat".
    """
    box, size = grid(vertices, camera, drawing.shape, ROOM)
    zones = Zones.of(rig, vertices, camera, box, size)
    odds = log_odds(at, "hat", box, size, seen, camera) + theirs(box, size, zones, others)
    row = np.arange(size[1])[:, None]
    share = chance(odds)
    if ((share > WORN) & (row < zones.eyes)).sum() < LEAST * ROWS**2 or not zones.head.any():
        return None
    ink = 1 - area_resample(np.asarray(drawing, np.float32), box, size, outside=1.0)
    cues = odds + np.where(outside(ink, share, zones.head), PAPER, 0.0)
    cues = cues + np.where(zones.face & (row > zones.eyes), SKIN, 0.0)
    found = ndimage.binary_opening(spread(cues, ink), iterations=1)
    near = ndimage.binary_dilation(zones.head, iterations=max(round(NEAR * ROWS), 1))
    label, count = ndimage.label(found)
    touches = np.bincount(label[near & found], minlength=count + 1)
    areas = np.bincount(label.ravel(), minlength=count + 1) * (touches > 0)
    areas[0] = 0
    if areas.max() < LEAST * ROWS**2:
        return None
    found = ndimage.binary_fill_holes(label == areas.argmax())
    strokes = strokes_in(ink, found, ROWS)
    return PageHair(
        box, found, np.zeros(found.shape, dtype=bool), zones.head, contour(found, box),
        tone_of(ink, found), texture_of(ink, found, strokes, ROWS), strokes, None,
    )  # fmt: skip


def without_hat(page: PageHair, hat: PageHair, drawing: NDArray[np.floating]) -> PageHair:
    """Hair and beard of a page beside a hat that was taken for hair."""
    height, width = page.hair.shape
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    at = np.round(hat.cells(page.pixels(np.stack([u, v], axis=-1)))).astype(int)
    inside = ((at >= 0) & (at < hat.hair.shape[::-1])).all(axis=-1)
    x, y = (np.clip(at[..., k], 0, hat.hair.shape[1 - k] - 1) for k in (0, 1))
    over = ndimage.binary_dilation(inside & hat.hair[y, x], iterations=2)
    left = ndimage.binary_opening(page.hair & ~over, iterations=2)
    label, count = ndimage.label(left)
    large = np.bincount(label.ravel(), minlength=count + 1) >= LEFT * ROWS**2
    large[0] = False
    left = large[label]
    ink = 1 - area_resample(np.asarray(drawing, np.float32), page.box, (width, height), outside=1.0)
    strokes = strokes_in(ink, left, ROWS)
    return replace(
        page, hair=left, beard=page.beard & ~over, contour=contour(left, page.box),
        tone=tone_of(ink, left), texture=texture_of(ink, left, strokes, ROWS), strokes=strokes,
        part=None,
    )  # fmt: skip
