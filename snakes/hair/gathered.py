"""Buns and tails: what of the hair on a page no surface around the head reaches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from facs_rig.hair.cut import Ball, Cut
from facs_rig.hair.shell import shell_on

from .sight import Sight

__all__ = ["gathered"]

OFF = 0.012
"""Metres beyond the surface from which on hair is no longer its own."""
NEAR = 0.012
"""Metres from the surface from which on it is led there: nothing hangs from nothing."""
LEAST, MOST = 0.0013, 3
"""Square metres of hair that may be gathered, and how many of the largest pieces are."""
ROUND = 1.8
"""Times as long as wide, from which on it is a tail rather than a bun."""
THIN, THICK = 0.009, 0.05
"""Radius in metres of what is gathered."""
BEHIND = 0.045
"""Metres behind the head's middle where it is gathered that is seen from the front."""
TURNED = 0.3
"""Sine of the head's turn from which on a tail is taken to hang in its plane of symmetry."""
LOW = 0.2
"""Metres below the eyes where falling hair has no buns."""
FLARES, INWARD = 0.2, 0.01
"""Share of its height at which a piece has hair beside it, so many metres towards the head, from
which on it is no tail: tails have skin or paper beside them."""
APART, OVER_NECK = 0.02, 0.07
"""Metres from other hair from which on a lone piece below the eyes is a tail only if at least this
share of it lies over head or neck, as braids do: what is all beside them is a shoulder's."""
PLACES = 5
"""Along a tail."""


def gathered(sight: Sight, cut: Cut) -> tuple[Ball, ...]:
    """Buns and tails where the hair on the page lies outside of a cut's surface, the largest first.

    One view does not say how far behind they are: in a head that is turned they lie in its plane of
    symmetry, else a little behind its middle.
    """
    beyond = sight.beyond(shell_on(sight.head, cut)) > OFF
    if cut.hangs:  # what is longer than a cut can be is no bun
        low = sight.cells(sight.head.eyes)[1] + LOW * sight.unit
        beyond &= np.arange(len(beyond))[:, None] < low
    label, count = ndimage.label(ndimage.binary_opening(beyond, iterations=2))
    size = np.bincount(label.ravel(), minlength=count + 1)[1:] / sight.unit**2
    largest = np.argsort(-size)[:MOST] + 1
    pieces = [label == k for k in largest if size[k - 1] >= LEAST]
    tails = [p for p in pieces if not (_below(sight, p) and (_flares(sight, p) or _lost(sight, p)))]
    found = [_ball(sight, piece) for piece in tails]
    return tuple(_held(sight, cut, ball) for ball in found if ball is not None)


def _places(sight: Sight, mask: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k,) metres to the right and up of the cells of a mask, as `Sight.metres`."""
    v, u = np.nonzero(mask)
    aside, up = sight.metres(np.stack([u, v], axis=1)).T
    return aside, up


def _below(sight: Sight, piece: NDArray) -> bool:
    """Whether a piece (h, w) bool of the page is all below the eyes."""
    eyes = sight.metres(sight.cells(sight.head.eyes[None]))[0, 1]
    return bool(_places(sight, piece)[1].max() < eyes)


def _lost(sight: Sight, piece: NDArray) -> bool:
    """Whether a piece is beside the neck, away from most of the hair, and has no counterpart."""
    label, _ = ndimage.label(sight.page.hair)
    own = label == label[piece].max()
    others = sight.page.hair & ~own
    if own.sum() > others.sum():
        return False
    (aside, up), (across, over) = (_places(sight, mask) for mask in (own, others))
    opposite = (over > up.min()) & (over < up.max()) & (across * np.median(aside) < 0)
    away = ndimage.distance_transform_edt(~others)[own].min() / sight.unit
    return bool(away > APART and sight.page.head[own].mean() < OVER_NECK and not opposite.any())


def _flares(sight: Sight, piece: NDArray) -> bool:
    """Whether a piece is the side of hair that falls, farther out than a surface is: with hair
    beside it towards the head."""
    aside, up = _places(sight, piece)
    cell = 1 / sight.unit
    level = np.rint((up.max() - up) / cell).astype(np.intp)
    inmost = np.full(level.max() + 1, np.inf)
    np.minimum.at(inmost, level, np.abs(aside))
    there = np.flatnonzero(np.isfinite(inmost))
    side = np.sign(np.median(aside)) * (inmost[there] - INWARD)
    inward = sight.at(np.stack([side, up.max() - cell * there], axis=1))
    hair = sight.page.hair & ~piece
    u, v = np.clip(np.rint(inward).astype(int), 0, np.array(hair.shape[::-1]) - 1).T
    return bool(hair[v, u].mean() > FLARES)


def _held(sight: Sight, cut: Cut, ball: Ball) -> Ball:
    """What is gathered, with a beginning at the nearest place of a cut's surface if it is off."""
    made = shell_on(sight.head, replace(cut, balls=(ball,)))
    surface = made.points[made.outer.ravel()]
    away, near = cKDTree(surface).query(made.points[made.tails[0].ravel()])
    if away.min() < NEAR:
        return ball
    root = _from_axis(sight, surface[near[away.argmin()]][None].astype(float))
    line = np.concatenate([root, ball.line])
    line[:, 0] = np.unwrap(line[:, 0])
    return replace(ball, line=line, radius=np.concatenate([ball.radius[:1], ball.radius]))


def _ball(sight: Sight, piece: NDArray) -> Ball | None:
    """What is gathered in a piece (h, w) bool of the page; None for a mere rim of the hair."""
    deep = ndimage.distance_transform_edt(np.pad(piece, 1)).max() / sight.unit
    if deep < THIN:
        return None
    v, u = np.nonzero(piece)
    cells = np.stack([u, v], axis=1).astype(float)
    away = np.linalg.norm(cells - sight.middle, axis=1)
    root = cells[away <= np.quantile(away, 0.05)].mean(axis=0)
    along = np.linalg.norm(cells - root, axis=1)
    length = float(along.max())
    area = len(cells)
    if length < ROUND * area / max(length, 1e-9):
        radius = min(np.sqrt(area / np.pi) / sight.unit, THICK)
        middle = cells.mean(axis=0)
        line = np.stack([middle + t * (middle - root) for t in (-1.2, 0.0, 1.2)])
        return Ball(_on_head(sight, line), radius * np.array([0.9, 1.1, 0.9]))
    cut = np.linspace(0, length + 1e-6, PLACES + 1)
    bins = [(along >= a) & (along < b) for a, b in zip(cut[:-1], cut[1:], strict=True)]
    line = np.stack([root, *(cells[which].mean(axis=0) for which in bins if which.any())])
    wide = [which.sum() / (2 * (cut[1] - cut[0])) / sight.unit for which in bins if which.any()]
    return Ball(_on_head(sight, line), np.clip([wide[0], *wide], THIN, THICK))


def _on_head(sight: Sight, cells: NDArray) -> NDArray[np.float64]:
    """(k, 3) azimuth, height and metres off the skin of places (k, 2) of the page's grid."""
    head = sight.head
    toward = np.array(sight.toward)
    start = head.middle - [0, 0, BEHIND]
    axes = np.linalg.svd(toward[None])[2][1:]  # two ways across the view
    origin = sight.cells(start)
    steps = np.stack([sight.cells(start + 0.01 * way) - origin for way in axes]) / 0.01
    places = start + (cells - origin) @ np.linalg.inv(steps) @ axes
    if abs(toward[0]) > TURNED:
        far = (head.eyes[0] - places[:, 0]) / toward[0]
        places = places + far[:, None] * toward
        places[:, 2] = np.minimum(places[:, 2], start[2])
    return _from_axis(sight, places)


def _from_axis(sight: Sight, places: NDArray) -> NDArray[np.float64]:
    """(k, 3) the same of places (k, 3) in metres."""
    head = sight.head
    x, y, z = (places - [head.eyes[0], head.eyes[1], head.middle[2]]).T
    azimuth, far = np.unwrap(np.arctan2(x, z)), np.hypot(x, z)
    skin = np.where(y > 0.97 * head.above, 0.0, head.levels(head.axis, azimuth, y))
    return np.stack([azimuth, head.height(y), far - skin], axis=1)
