"""Which way the strokes of a drawn beard run, as the way that its hairs lean on the skin.

The structure tensor of the ink (see texture.tensor) says how strokes run on the page. Where a place
of the fitted skin lies there, and where hairs that lie as they do of themselves would run on the
page, turns that into an angle on the skin, which carries from person to person. A stroke has no
head and no tail: it is taken to point where hair is nearer to pointing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy import ndimage

from facs_rig import Camera, FaceRig, landmark_points
from facs_rig.anatomy import LANDMARKS_68
from facs_rig.beard.beard import Beard
from facs_rig.beard.chart import COLUMNS, ROWS, roots_of, weights_at
from facs_rig.beard.follow import axes_of
from facs_rig.beard.growth import growth
from facs_rig.beard.hairs import frames, rise_of
from facs_rig.common.images import area_resample

from .region import PageHair
from .texture import tensor

__all__ = ["leans_in"]

FINER = 2
"""Cells of the picture whose strokes are looked at, to one of the page's grid."""
NEAR = 2.0
"""Cells of the page's grid around a place within which strokes say together where they run."""
RIM = 1
"""Cells at the edge of a beard that a line of the face or its own outline may take."""
BEYOND = 6
"""Cells around a beard that are looked at."""
AROUND, SPARSE = 1.5, 0.5
"""Cells around each in which ink is looked for, and the share of a beard's mean ink below which it
is taken for bare there: its edge is no stroke."""
EMPTY, DRAWN = 1e-3, 0.2
"""Squares of the ink's change up to which nothing is drawn, and the share of their mean in a beard
from which on its strokes are."""
LINE = 5
"""Cells of the finer picture beside which a line of lips or jaw is looked for, and is no stroke."""
OWN = (LANDMARKS_68[:17], (*LANDMARKS_68[48:60], LANDMARKS_68[48]))
"""Landmarks along these lines."""
AIMLESS, ONE_WAY = 0.4, 0.9
"""Coherence of strokes that run every way, and of those that run one way."""
INKED, SOLID, BESIDE = 0.4, 2.5, 3.0
"""Ink from which on a cell of the finer picture is dark, half the width in such cells of what is an
area and no stroke, and how far beside it its edge is seen."""
SLANT = 0.25
"""Cosine between skin and view from which on strokes on it are measured."""
OVER = 0.3
"""Weight of what is seen over the mouth: a moustache is so narrow that its own edges, which run
across its strokes, are as clear as these."""
SMOOTH = 1.2
"""Columns and rows of the chart around each within which strokes say together where they run."""
HELD = 0.3
"""Strokes that hair which lies as usual counts for, in squares of how far these run apart."""
OUTWARD = np.radians(104)
"""How far strokes may lean away from the middle; those across the usual way do."""
ANGLES = 91
"""How many leans are tried."""
STEP = 0.002
"""Metres along the skin by which directions on the page are told."""


def leans_in(
    drawing: NDArray, where: NDArray, page: PageHair, beard: Beard, rig: FaceRig,
    identity: Mapping[str, float], vertices: NDArray, camera: Camera, places: int,
) -> NDArray[np.float64]:  # fmt: skip
    """(2, COLUMNS, ROWS) radians, the `lean` of a beard whose strokes are drawn.

    drawing : (h, w) float, 1 is paper;  where : (rows, columns) bool, cells of the page with beard
    vertices : (n, 3) metres, the posed face of the person `identity`
    places : how many of the first roots are looked at

    What is not seen is as on the other side; where nothing is drawn, or dots or solid black, it is
    0: hairs then lie as they do of themselves.
    """
    if not where.any():
        return np.zeros((2, COLUMNS, ROWS))
    roots = roots_of(rig)
    kept = np.arange(places)
    base, ways, facing = _ways(rig, identity, vertices, camera, page, beard, kept)
    mark = landmark_points(rig, vertices)
    own = [np.stack([mark[name] for name in names]) for names in OWN]
    lines = [page.cells(camera.project(line)) for line in own]
    stroke, agree = _strokes(drawing, where, page, base, lines)
    left = roots.across[kept] > 0
    ways[:, 1] *= np.where(left, 1, -1)[:, None]
    apart = stroke[:, None, 0] * ways[..., 1] - stroke[:, None, 1] * ways[..., 0]
    apart /= np.maximum(np.linalg.norm(ways, axis=(1, 2)), 1e-9)[:, None]
    weight = agree * np.clip((facing - SLANT) / 0.3, 0, 1)
    weight = weight * np.where(roots.above[kept], OVER, 1)
    cells, near = weights_at(roots.place[kept])
    sums = np.zeros((2, 3, 3, COLUMNS * ROWS))
    for k, mine in enumerate((left, ~left)):
        for i, j in np.ndindex(3, 3):
            value = (weight * apart[:, i] * apart[:, j])[:, None]
            flat = (near * value)[mine].ravel()
            sums[k, i, j] = np.bincount(cells[mine].ravel(), flat, COLUMNS * ROWS)
    return _leans(sums.reshape(2, 3, 3, COLUMNS, ROWS))


def _leans(sums: NDArray) -> NDArray[np.float64]:
    """(2, COLUMNS, ROWS) radians at which hairs run most along strokes on the page.

    sums : (2, 3, 3, COLUMNS, ROWS), of squares and products of how far a stroke and each of three
        parts of a hair run apart: cosine and sine of the lean take the first two, the third is as
        it stands off
    """
    if not sums.any():
        return np.zeros((2, COLUMNS, ROWS))
    sums = ndimage.gaussian_filter(sums, (0, 0, 0, SMOOTH, SMOOTH), mode="nearest")
    known = np.trace(sums, axis1=1, axis2=2)[:, None, None]
    sums = sums + sums[::-1] * (HELD / (HELD + known))
    leans = np.linspace(OUTWARD - np.pi, OUTWARD, ANGLES)
    part = np.stack([np.cos(leans), np.sin(leans), np.ones(ANGLES)], axis=1)
    cost = np.einsum("ai,kijcr,aj->akcr", part, sums, part)
    cost += HELD * (1 - np.cos(leans))[:, None, None, None]
    return leans[cost.argmin(axis=0)]


def _ways(
    rig: FaceRig, identity: Mapping[str, float], vertices: NDArray, camera: Camera, page: PageHair,
    beard: Beard, kept: NDArray,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """(k, 2) cells of places on a posed face; (k, 3, 2) in cells the way that a hair of the beard
    lies along the skin there, that to the face's left of it, and that off the skin, as much of each
    as a hair has; and (k,) how far the skin faces the viewer."""
    roots = roots_of(rig)
    rest = np.asarray(rig.neutral(identity), float)
    _, out, flow = frames(rig, rest, roots, kept)
    at_rest = axes_of(rest[roots.anchors[kept]])
    posed = axes_of(np.asarray(vertices[roots.anchors[kept]], float))
    at = np.einsum("kc,kcd->kd", roots.weight[kept], vertices[roots.index[kept]])
    base = page.cells(camera.project(at))
    grown = growth(beard, roots.place[kept], roots.lip[kept], roots.above[kept])
    rise = rise_of(grown.length)[:, None]
    ways = (np.cos(rise) * flow, np.cos(rise) * np.cross(out, flow), np.sin(rise) * out)
    turned = np.einsum("kcd,kjd,kce->kje", at_rest, np.stack(ways, axis=1), posed)
    ends = camera.project((at[:, None] + STEP * turned).reshape(-1, 3)).reshape(-1, 3, 2)
    return base, page.cells(ends) - base[:, None], posed[:, 2, 2]


def _strokes(
    drawing: NDArray, where: NDArray, page: PageHair, base: NDArray, lines: list[NDArray]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k, 2) columns and rows of a unit along the strokes at cells (k, 2), either way, and (k,) how
    much they agree there, 0..1. lines : the face's own, (n, 2) cells each"""
    size = (FINER * where.shape[1], FINER * where.shape[0])
    ink = 1 - area_resample(np.asarray(drawing, np.float32), page.box, size, outside=1.0)
    high, wide = (
        slice(max(at.start - BEYOND, 0), at.stop + BEYOND)
        for at in ndimage.find_objects(where.astype(np.uint8))[0]
    )
    first = np.array([wide.start, high.start])
    where, base, lines = where[high, wide], base - first, [line - first for line in lines]
    ink = ink[FINER * high.start :, FINER * wide.start :]
    ink = ink[: FINER * len(where), : FINER * where.shape[1]]
    coarse = ink.reshape(len(where), FINER, -1, FINER).mean(axis=(1, 3))
    much = ndimage.gaussian_filter(coarse, AROUND)
    inner = where & (much > SPARSE * float(much[where].mean()))
    inner = ndimage.binary_erosion(inner, iterations=RIM)
    inner = inner.repeat(FINER, axis=0).repeat(FINER, axis=1)
    inner &= ~_beside_solid(ink) & ~_beside_lines(
        [(line + 0.5) * FINER for line in lines], inner.shape
    )
    places = (base[:, ::-1].T + 0.5) * FINER - 0.5
    down, across, right = (
        ndimage.map_coordinates(part, places, order=1, mode="constant")
        for part in tensor(ink, NEAR * FINER, inner)
    )
    turn = 0.5 * np.arctan2(2 * across, right - down) + np.pi / 2
    total = right + down
    agree = np.hypot(right - down, 2 * across) / np.maximum(total, 1e-9)
    sure = np.clip((agree - AIMLESS) / (ONE_WAY - AIMLESS), 0, 1)
    usual = float(total[total > EMPTY].mean()) if (total > EMPTY).any() else 1.0
    drawn = total > max(EMPTY, DRAWN * usual)
    return np.stack([np.cos(turn), np.sin(turn)], axis=1), np.where(drawn, sure, 0.0)


def _beside_lines(lines: list[NDArray], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(h, w) cells of a picture that are near to one of the lines, (k, 2) cells each."""
    picture = Image.new("1", (shape[1], shape[0]))
    for line in lines:
        ImageDraw.Draw(picture).line(line.ravel().tolist(), fill=1, width=2 * LINE + 1)
    return np.asarray(picture)


def _beside_solid(ink: NDArray) -> NDArray[np.bool_]:
    """(h, w) where ink is an area and no strokes, and beside that: its edge is none of them."""
    inside = ndimage.distance_transform_edt(np.pad(ink > INKED, 1))[1:-1, 1:-1] > SOLID
    if not inside.any():
        return inside
    return ndimage.distance_transform_edt(~inside) < SOLID + BESIDE
