"""The beard and the moustache that look like those on a page.

The fitted face says where on the page each place of its skin lies (facs_rig.beard.chart). What is
drawn there is asked twice: how probable a beard is to the network, and how much ink there is, more
than on the cheeks (beard_seen). Whether there is a beard at all, or a moustache alone, and how far
it goes, are logistic regressions of these; their weights come from generated drawings, in which
beards are known (beard_weights). They are set so that a doubt leaves a face beardless: shading must
not grow a beard on a woman or a child.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.beard.beard import Beard
from facs_rig.beard.chart import ALONG, COLUMNS, ROWS, UP, on_chart, roots_of
from facs_rig.beard.growth import growth
from facs_rig.beard.lip import RISE, SPREAD
from facs_rig.beard.presets import preset

from . import beard_seen, beard_weights
from .beard_seen import PLACES, STEP, TEMPLATES, Below, Seen
from .beard_strokes import leans_in
from .moustache_fit import band_of
from .region import At, PageHair
from .texture import strokes_in, texture_of, tone_of

__all__ = ["fit_beard", "with_beard"]

CELLS = 112
"""Cells to a head of the page's grid (see region.ROWS)."""
CHILD = -0.4
"""`age` up to which nobody has a beard (see facs_rig.macros)."""
WITH_MOUSTACHE = 1.0
"""Log-odds that a beard gains where there is a moustache."""
BESIDE = 0.12
"""Ink over the mouth, of all but its emptiest columns, from which on it is a moustache beside a
beard."""
ALONE, LOUD, TOLD = 0.27, 0.25, -5.2
"""The same without a beard, where the network does not deny it by log-odds below the last; and how
much more that is where the mouth smiles or is open, whose thick lines and teeth come near to the
nose where the fit is not quite right."""
MOUTH = 0.25
"""Ink of a mouth's line from which on it is one: what has none below it is a mouth itself, and no
moustache."""
INKED = ((0.03, 0.0022), (0.12, 0.003), (0.3, 0.007), (0.6, 0.014))
"""Ink of a chin beyond the cheeks', and metres of its hairs."""
SOFTLY = 0.9
"""Columns and rows of the chart over which a beard grows thin at its edges."""
DARK = 0.5
"""Colour of the palest beard: strokes on paper stand for darker hair than they are ink."""


def fit_beard(
    drawing: NDArray,
    at: At,
    page: PageHair,
    rig: FaceRig,
    parameters: FaceParameters,
    vertices: NDArray,
    camera: Camera,
) -> Beard | None:
    """The beard of a drawing, or None where none is drawn.

    drawing : (h, w) float, 1 is paper;  at : see `region.page_hair`, whose `page` this is
    vertices : (n, 3) metres, the posed face of `parameters`;  camera : of the drawing's pixels
    """
    if parameters.identity.get("age", 0.0) <= CHILD:
        return None
    ink = beard_seen.ink_of(drawing, page)
    seen = beard_seen.seen_on(ink, at, page, rig, vertices, camera)
    mouth = beard_seen.mouth_line(ink, page, rig, vertices, camera, seen.down)
    alone = mouth > MOUTH and _moustache_alone(seen, parameters)
    beside = WITH_MOUSTACHE if alone else 0.0
    bearded = bool(_score(beard_weights.BEARDED, beard_seen.chin_says(seen)) + beside > 0)
    hairy = beard_seen.over_the_mouth(seen) > BESIDE if bearded else alone
    if not bearded and not hairy:
        return None
    cover = np.zeros((COLUMNS, ROWS))
    if bearded:
        cover = _cover(seen)
    lip = preset("moustache").cover
    high = UP > 0.042
    cover[:, high] = np.where(ALONG[:, None] < 0.4, lip[:, high] if hairy else 0, cover[:, high])
    _, chin, cheek = seen.usual
    base = float(np.interp(chin - cheek, *np.array(INKED).T))
    length = np.full(COLUMNS, base if bearded else 0.0)
    if bearded:
        length += _reach(beard_seen.below(seen, ink, at, page))
    spread, rise = band_of(seen, rig, alone=not bearded) if hairy else (SPREAD, RISE)
    size = _moustache(base, bearded) if hairy else 0.0
    found = Beard(cover, length, moustache=size, spread=spread, rise=rise)
    where = _where(found, seen, page, rig)
    strokes = strokes_in(ink, where, CELLS)
    curly = where.any() and texture_of(ink, where, strokes, CELLS) == "curls"
    tone = tone_of(ink, where) if where.any() else 0.75
    colour, curl = float(DARK + (1 - DARK) * tone), 0.8 if curly else 0.0
    lean = leans_in(drawing, where, page, found, rig, parameters.identity, vertices, camera, PLACES)
    return replace(found, colour=colour, curl=curl, lean=lean)


def with_beard(
    page: PageHair, beard: Beard, rig: FaceRig, vertices: NDArray, camera: Camera
) -> PageHair:
    """The page of hair with the cells that a beard takes."""
    cells, _ = beard_seen.places_on(page, rig, vertices, camera)
    cover = _cover_at_places(beard, rig)
    return replace(page, beard=_filled(cells[cover > 0.5], page) & ~page.hair)


def _score(weights: tuple[float, ...], says: NDArray) -> NDArray[np.float64]:
    """(...) log-odds of what is said (..., k); the last of the weights (k + 1) is added."""
    return says @ np.array(weights[:-1]) + weights[-1]


def _moustache_alone(seen: Seen, parameters: FaceParameters) -> bool:
    """Whether there is a moustache, be there a beard or not: by what its ink is like, or by plenty
    of ink and the network's word."""
    says = beard_seen.lip_says(seen)
    loud = any(parameters.aus.get(name, 0.0) > 1 for name in ("smile", "jaw_open"))
    told = seen.mean("lip", seen.odds, TOLD) > TOLD
    plenty = beard_seen.over_the_mouth(seen) > ALONE + LOUD * loud
    return bool(_score(beard_weights.MOUSTACHE, says) > 0) or (told and plenty)


def _cover(seen: Seen) -> NDArray[np.float64]:
    """(COLUMNS, ROWS) how thick a beard grows: what each place of the skin says, with the likeliest
    of the usual shapes, on both sides alike; where nothing is seen that shape."""
    mine = seen.grazed & ~seen.above
    place, says = seen.place[mine], beard_seen.places_say(seen)[mine]
    bare = beard_seen.bare(seen)[mine]
    best = beard_seen.likeliest(place, _score(beard_weights.COVER, says) - bare)
    shape = on_chart(TEMPLATES[best], place)
    says = np.concatenate([says, shape[:, None]], axis=1)
    score = _score(beard_weights.TEMPLATED, says) - bare
    cover = 1 / (1 + np.exp(-1.5 * beard_seen.gathered(place, score, best)))
    return ndimage.gaussian_filter(cover, SOFTLY, mode="nearest")


def _reach(below: Below) -> NDArray[np.float64]:
    """(COLUMNS,) metres that a beard goes on below the jaw, as far as it is drawn without a gap."""
    out = np.zeros(COLUMNS)
    if not len(below.along):
        return out
    goes = (_score(beard_weights.BELOW_JAW, below.says) > 0) & below.on_page
    far = np.where(goes.all(axis=1), goes.shape[1], np.argmin(goes, axis=1)) * STEP
    for k, here in enumerate(ALONG):
        weight = np.clip(1 - np.abs(below.along - here) / 0.12, 0, 1)
        if weight.sum() > 1:
            out[k] = (weight * far).sum() / weight.sum()
    return out


def _moustache(base: float, bearded: bool) -> float:
    """Metres of a moustache's hairs: as stubble where the beard is."""
    if not bearded or base > 0.004:
        return float(np.clip(base, 0.007, 0.012))
    return base


def _where(beard: Beard, seen: Seen, page: PageHair, rig: FaceRig) -> NDArray[np.bool_]:
    """(h, w) cells of the page where a beard grows out of the skin."""
    cover = _cover_at_places(beard, rig)
    return _filled(seen.cells[(cover > 0.5) & seen.shown], page)


def _cover_at_places(beard: Beard, rig: FaceRig) -> NDArray[np.float64]:
    """(PLACES,) how thick a beard grows at the places that are looked at."""
    roots = roots_of(rig)
    return growth(beard, roots.place[:PLACES], roots.lip[:PLACES], roots.above[:PLACES]).cover


def _filled(cells: NDArray, page: PageHair, gap: int = 2) -> NDArray[np.bool_]:
    """(h, w) what a cloud of places (k, 2) covers that lie less than two gaps apart."""
    found = np.zeros(page.hair.shape, dtype=bool)
    at = np.rint(cells).astype(int)
    at = at[((at >= 0) & (at < page.hair.shape[::-1])).all(axis=1)]
    found[at[:, 1], at[:, 0]] = True
    return ndimage.binary_closing(np.pad(found, gap + 1), iterations=gap)[
        gap + 1 : -gap - 1, gap + 1 : -gap - 1
    ]
