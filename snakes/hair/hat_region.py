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
    spread,
    theirs,
)
from .texture import strokes_in, texture_of, tone_of

__all__ = ["page_hat", "with_hat", "without_hat"]

ROOM = (0.55, 0.95, 0.55, 0.3)
"""Heads to the left, above, to the right and below the posed head that are looked at."""
WORN, LEAST = 0.25, 0.05
"""Mean probability of a hat, over what is hair or hat above the eyes, from which on one is
worn (1 in 93 held-out drawings without one reach it, and 9 in 10 of those with one), and its square
heads at least."""
SURELY = 0.04
"""Square heads above the eyes that are rather a hat's than not, so that a bare skull is none."""
INKED, DISC = 0.35, 0.062
"""Ink from which on a disc does not roll over a cell, and the disc's radius in heads."""
GIVEN, PAPER, SKIN, SCALP = 1.5, -2.5, -1.5, 0.5
"""Log-odds of a place where a hat is worn, of paper outside, of the face below the eyes, and of the
head above them beside the face."""
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
    odds, hair = (log_odds(at, region, box, size, seen, camera) for region in ("hat", "hair"))
    row = np.arange(size[1])[:, None]
    share = chance(odds)
    either = np.maximum(share, chance(hair))
    eyes = camera.project(vertices[rig.parts["eyes"]]).mean(axis=0)
    above = row < box.to_units(eyes)[1] * size[1]
    weight = either * above
    likely = (share * above)[share > 0.5].sum() >= SURELY * ROWS**2
    if not likely or (share * weight).sum() < WORN * weight.sum():
        return None
    zones = Zones.of(rig, vertices, camera, box, size)
    if not zones.head.any():
        return None
    odds = odds + theirs(box, size, zones, others)
    ink = 1 - area_resample(np.asarray(drawing, np.float32), box, size, outside=1.0)
    cues = odds + GIVEN + np.where(_outside(ink, either, zones.head), PAPER, 0.0)
    cues = cues + np.where(zones.face & (row > zones.eyes), SKIN, 0.0)
    cues = cues + np.where(zones.head & ~zones.face & (row < zones.eyes), SCALP, 0.0)
    found = ndimage.binary_opening(spread(cues, ink) & ~_above_all(ink), iterations=1)
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
        tone_of(ink, found), texture_of(ink, found, strokes, ROWS), strokes, None, ink=ink,
    )  # fmt: skip


def _outside(ink: NDArray, share: NDArray, head: NDArray) -> NDArray[np.bool_]:
    """(h, w) paper that a disc covers which rolls in from above and from the sides.

    Hair that leaves the page lets nothing in, and a head is no paper whatever its lines.
    """
    disc = DISC * ROWS
    roomy = ndimage.distance_transform_edt((ink < INKED) & ~head) > disc
    label, _ = ndimage.label(roomy)
    k = min(int(disc) + 1, *(np.array(ink.shape) - 1))
    rim = np.zeros(ink.shape, dtype=bool)
    rim[:k] = rim[:, :k] = rim[:, -k:] = True
    begins = np.unique(label[rim & (share < 0.25)])
    found = np.isin(label, begins[begins > 0])
    if not found.any():
        return found
    return ndimage.distance_transform_edt(~found) <= disc


def _above_all(ink: NDArray) -> NDArray[np.bool_]:
    """(h, w) paper between a page's upper edge and what is drawn below it, where no disc fits."""
    drawn = ink > INKED
    first = np.where(drawn.any(axis=0), drawn.argmax(axis=0), len(ink))
    return (np.arange(len(ink))[:, None] < first) & (first < 2 * DISC * ROWS + 2)


def without_hat(page: PageHair, hat: PageHair, drawing: NDArray[np.floating]) -> PageHair:
    """Hair and beard of a page beside a hat that was taken for hair."""
    over = ndimage.binary_dilation(_on_grid(page, hat), iterations=2)
    left = ndimage.binary_opening(page.hair & ~over, iterations=2)
    label, count = ndimage.label(left)
    large = np.bincount(label.ravel(), minlength=count + 1) >= LEFT * ROWS**2
    large[0] = False
    left = large[label]
    size = left.shape[1], left.shape[0]
    ink = 1 - area_resample(np.asarray(drawing, np.float32), page.box, size, outside=1.0)
    strokes = strokes_in(ink, left, ROWS)
    return replace(
        page, hair=left, beard=page.beard & ~over, contour=contour(left, page.box),
        tone=tone_of(ink, left), texture=texture_of(ink, left, strokes, ROWS), strokes=strokes,
        part=None,
    )  # fmt: skip


def with_hat(page: PageHair, hat: PageHair) -> PageHair:
    """The page as if the hat over its hair were hair, too: what goes on under it."""
    return replace(page, hair=ndimage.binary_closing(page.hair | _on_grid(page, hat), iterations=3))


def _on_grid(page: PageHair, hat: PageHair) -> NDArray[np.bool_]:
    """(h, w) where a hat is, in cells of another grid."""
    height, width = page.hair.shape
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    at = np.round(hat.cells(page.pixels(np.stack([u, v], axis=-1)))).astype(int)
    rows, columns = hat.hair.shape
    inside = ((at >= 0) & (at < (columns, rows))).all(axis=-1)
    return inside & hat.hair[np.clip(at[..., 1], 0, rows - 1), np.clip(at[..., 0], 0, columns - 1)]
