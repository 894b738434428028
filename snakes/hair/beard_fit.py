"""The beard and the moustache that look like those on a page.

The fitted face says where on the page each place of its skin lies (facs_rig.beard.chart). What is
drawn there is asked twice: how probable a beard is to the network, which is coarse and sees too few
of them, and how much ink there is, more than on the cheeks. Whether there is a beard at all, and
how far it goes, are logistic regressions of these; their weights come from generated drawings, in
which beards are known. They are set so that a doubt leaves a face beardless: shading must not grow
a beard on a woman or a child.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facs_rig import Camera, FaceParameters, FaceRig
from facs_rig.beard.beard import Beard
from facs_rig.beard.chart import ALONG, COLUMNS, ROWS, UP, on_chart, roots_of, weights_at
from facs_rig.beard.follow import axes_of
from facs_rig.beard.presets import FULL, UNDER, preset, rimmed
from facs_rig.common.images import area_resample

from .beard_strokes import leans_in
from .region import At, PageHair
from .texture import strokes_in, texture_of, tone_of

__all__ = ["fit_beard", "with_beard"]

PLACES = 2_500
"""Places of the skin that are looked at."""
CELLS = 112
"""Cells to a head of the page's grid (see region.ROWS)."""
SOFT, FINE = 2.0, 1.0
"""Cells by which ink is blurred, to tell hatching from paper and a moustache from a lip's line."""
FACING, GRAZING = 0.2, 0.04
"""Cosine between skin and view from which on it is seen, and from which on it is of use where the
likely shape of a beard helps."""
USUAL = 4.0
"""By how much the first of TEMPLATES is likelier than the others before anything is seen."""
SURE = 0.002
"""Probabilities nearer to 0 or 1 than this are taken for it."""
CHILD = -0.4
"""`age` up to which nobody has a beard (see facs_rig.macros)."""
BEARDED, WITH_MOUSTACHE = (1.86, 1.40, 0.56, 1.01, 5.17), 1.0
"""Weights of the ink and the log-odds of that side of the chin that has less, of the jaw's log-odds
and the cheeks' ink, and what is added: above 0 there is a beard, which one generated beardless
drawing in a hundred comes to. Further what is added where there is a moustache."""
COVER = (0.86, 1.81, 2.08, 0.36, 0.85)
"""Of a place of a bearded face: log-odds and ink beyond the chin's, ink beyond the cheeks', the
share of the jaw, and what is added: above 0 hair grows there."""
TEMPLATED = (0.73, 1.68, 1.90, 1.09, 1.10, -0.20)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (1.12, 2.05, 2.95, -1.12, 0.19)
"""COVER of what hangs below the jaw."""
DENSE, PALE, BARE, WIDELY = 0.15, 0.35, 3.0, 5.0
"""Ink of a chin beyond the cheeks' from which on its beard is drawn all over; the share of that ink
below which another place is then bare, how much that takes off, and cells of the blur."""
MOUSTACHE, BESIDE = 0.27, 0.12
"""Ink over the mouth, of all but its emptiest columns, from which on it is a moustache, and beside
a beard."""
LOUD, UNLIKELY = 0.25, -5.2
"""How much more that is where the mouth smiles or is open, whose thick lines and teeth come near to
the nose where the fit is not quite right; and the log-odds up to which it is no moustache."""
COLUMN, WIDE = 0.004, 0.024
"""Metres of a column over the mouth, and from the middle to the last."""
INKED = ((0.03, 0.0022), (0.12, 0.003), (0.3, 0.007), (0.6, 0.014))
"""Ink of a chin beyond the cheeks', and metres of its hairs."""
DARK = 0.5
"""Colour of the palest beard: strokes on paper stand for darker hair than they are ink."""
BELOW, STEP = 0.16, 0.004
"""Metres below the jaw where a beard is looked for, and from one place to the next."""
TEMPLATES = (
    rimmed(FULL, UNDER),
    preset("goatee").cover,
    rimmed(((0, 61), (0.22, 60), (0.34, 50), (0.5, 30), (0.58, -45)), UNDER),
    rimmed(((0, 61), (0.22, 60), (0.34, 40), (0.5, 24), (0.7, 18), (0.92, 18)), UNDER),
)
"""Shapes of beards: up the cheeks, on the chin alone, in front of the jaw's angle, and low."""


@dataclass(frozen=True, eq=False)
class _Seen:
    """What the page has at places of the skin.

    place : (k, 2) on the chart;  above : (k,) over the mouth;  across : (k,) metres from the middle
    cells : (k, 2) columns and rows of the grid;  shown, grazed : (k,) whether the view
    and page have them, and at a slant at least
    ink, fine, wide : (k,) blurred by SOFT, FINE and WIDELY
    odds : (k,) the network's log-odds of a beard
    """

    place: NDArray[np.float64]
    above: NDArray[np.bool_]
    across: NDArray[np.float64]
    cells: NDArray[np.float64]
    shown: NDArray[np.bool_]
    grazed: NDArray[np.bool_]
    ink: NDArray[np.float64]
    fine: NDArray[np.float64]
    wide: NDArray[np.float64]
    odds: NDArray[np.float64]

    def zone(self, name: str) -> NDArray[np.bool_]:
        """(k,) which places of chin, jaw, cheeks or upper lip are seen."""
        along, up = self.place.T
        within = {
            "chin": ~self.above & (along < 0.3) & (up > 0) & (up < 0.038),
            "jaw": ~self.above & (along > 0.3) & (along < 0.75) & (up > 0) & (up < 0.022),
            "cheek": (along > 0.45) & (up > 0.035) & (up < 0.07),
            "lip": self.above & (np.abs(self.across) < WIDE) & (up < 0.058),
        }[name]
        return within & self.shown

    def mean(self, name: str, values: NDArray, otherwise: float) -> float:
        zone = self.zone(name)
        return float(values[zone].mean()) if zone.sum() > 8 else otherwise


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
    rows, columns = page.hair.shape
    size = (columns, rows)
    ink = 1 - area_resample(np.asarray(drawing, np.float32), page.box, size, outside=1.0)
    blurred = [ndimage.gaussian_filter(ink, blur) for blur in (SOFT, FINE, WIDELY)]
    seen = _seen(blurred, at, page, rig, vertices, camera)
    chin, cheek = (seen.mean(name, seen.ink, 0.1) for name in ("chin", "cheek"))
    odds = [seen.mean(name, seen.odds, -5.0) for name in ("chin", "jaw")]
    over = _over_the_mouth(seen)
    odds_lip = seen.mean("lip", seen.odds, UNLIKELY)
    alone = over > MOUSTACHE + LOUD * _is_loud(parameters) and odds_lip > UNLIKELY
    beside = WITH_MOUSTACHE if alone else 0.0
    less = [_lesser_side(seen, values) for values in (seen.ink, seen.odds)]
    bearded = float(np.dot(BEARDED, (*less, odds[1], cheek, 1.0))) + beside > 0
    hairy = over > BESIDE if bearded else alone
    if not bearded and not hairy:
        return None
    cover = np.zeros((COLUMNS, ROWS))
    if bearded:
        cover = _cover(seen, odds[0], chin, cheek)
    lip = preset("moustache").cover
    high = UP > 0.042
    cover[:, high] = np.where(ALONG[:, None] < 0.4, lip[:, high] if hairy else 0, cover[:, high])
    base = float(np.interp(chin - cheek, *np.array(INKED).T))
    length = np.full(COLUMNS, base if bearded else 0.0)
    if bearded:
        length += _reach(seen, blurred[0], at, page, rig, vertices, camera, (odds[0], chin, cheek))
    found = Beard(cover, length, moustache=_moustache(base, bearded) if hairy else 0.0)
    where = _where(found, seen, page)
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
    cells, _ = _places(page, rig, vertices, camera)
    roots = roots_of(rig)
    cover = on_chart(beard.cover, roots.place[:PLACES])
    return replace(page, beard=_filled(cells[cover > 0.5], page) & ~page.hair)


def _places(
    page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(PLACES, 2) cells of places of the skin, and (PLACES,) how far it faces the viewer there."""
    roots = roots_of(rig)
    index, weight = roots.index[:PLACES], roots.weight[:PLACES]
    at = np.einsum("kc,kcd->kd", weight, vertices[index])
    facing = axes_of(np.asarray(vertices[roots.anchors[:PLACES]], float))[:, 2, 2]
    return page.cells(camera.project(at)), facing


def _seen(
    blurred: list[NDArray], at: At, page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera
) -> _Seen:  # fmt: skip
    cells, facing = _places(page, rig, vertices, camera)
    roots = roots_of(rig)
    inside = ((cells > 0) & (cells < np.array(page.hair.shape[::-1]) - 1)).all(axis=1)
    soft, fine, wide = (_at(picture, cells) for picture in blurred)
    return _Seen(
        roots.place[:PLACES], roots.above[:PLACES], roots.across[:PLACES], cells,
        inside & (facing > FACING),
        inside & (facing > GRAZING), soft, fine, wide, _odds(at, page.pixels(cells)),
    )  # fmt: skip


def _at(picture: NDArray, cells: NDArray) -> NDArray[np.float64]:
    """(k,) values of a picture between its cells, at columns and rows (k, 2)."""
    return ndimage.map_coordinates(picture, cells[:, ::-1].T, order=1, mode="nearest")


def _odds(at: At, points: NDArray) -> NDArray[np.float64]:
    share = np.clip(at("beard", points), SURE, 1 - SURE)
    return np.log(share / (1 - share))


def _lesser_side(seen: _Seen, values: NDArray) -> float:
    """The mean of a chin's side, of that which has less where both are seen: light comes from one
    side, a beard grows on both."""
    chin = seen.zone("chin")
    sides = [chin & (way * seen.across > 0.002) for way in (-1, 1)]
    if min(side.sum() for side in sides) <= 15:
        sides = [chin]
    return min(float(values[side].mean()) if side.any() else -5.0 for side in sides)


def _over_the_mouth(seen: _Seen) -> float:
    """Ink between nose and mouth that a quarter of the columns there have less of: a moustache goes
    from side to side, a shadow or the line of a lip does not fill it."""
    mine = seen.zone("lip")
    column = np.floor(seen.across[mine] / COLUMN).astype(int)
    column -= column.min(initial=0)
    count = np.bincount(column)
    ink = np.bincount(column, seen.fine[mine])[count >= 3] / count[count >= 3]
    return float(np.quantile(ink, 0.25)) if len(ink) >= 4 else 0.0


def _is_loud(parameters: FaceParameters) -> bool:
    """Whether a mouth smiles or is open."""
    return any(parameters.aus.get(name, 0.0) > 1 for name in ("smile", "jaw_open"))


def _cover(seen: _Seen, odds: float, chin: float, cheek: float) -> NDArray[np.float64]:
    """(COLUMNS, ROWS) how thick a beard grows: what each place of the skin says, with the likeliest
    of the usual shapes, on both sides alike; where nothing is seen that shape."""
    mine = seen.grazed & ~seen.above
    says = _says(seen.odds, seen.ink, seen.place[:, 0], (odds, chin, cheek))[mine]
    bare = _bare(seen)[mine]
    plain = np.clip(says @ COVER[:-1] + COVER[-1] - bare, -3, 3)
    shapes = [on_chart(table, seen.place[mine]) for table in TEMPLATES]
    likely = np.array([float(((2 * shape - 1) * plain).sum()) for shape in shapes])
    likely[0] += USUAL
    best = int(likely.argmax())
    score = says @ TEMPLATED[:-2] + TEMPLATED[-2] * shapes[best] + TEMPLATED[-1] - bare
    cells, weight = weights_at(seen.place[mine])
    held = 3.0  # places that the shape counts for
    total = np.bincount(cells.ravel(), (weight * score[:, None]).ravel(), COLUMNS * ROWS)
    count = np.bincount(cells.ravel(), weight.ravel(), COLUMNS * ROWS)
    usual = 3 * (2 * TEMPLATES[best] - 1)
    mean = (total.reshape(COLUMNS, ROWS) + held * usual) / (count.reshape(COLUMNS, ROWS) + held)
    return np.clip(1 / (1 + np.exp(-1.5 * mean)), 0, 1)


def _bare(seen: _Seen) -> NDArray[np.float64]:
    """(k,) what speaks against a beard where paper is, if one is drawn densely on the chin."""
    chin, cheek = (seen.mean(name, seen.wide, 0.1) for name in ("chin", "cheek"))
    if chin - cheek < DENSE:
        return np.zeros(len(seen.wide))
    share = (seen.wide - cheek) / (chin - cheek)
    return BARE * np.clip(PALE - share, 0, PALE) / PALE


def _says(
    odds: NDArray, ink: NDArray, along: NDArray, usual: tuple[float, float, float]
) -> NDArray[np.float64]:
    """(k, 4) what COVER weighs. usual : log-odds and ink of the chin, ink of the cheeks"""
    return np.stack([odds - usual[0], ink - usual[1], ink - usual[2], along], axis=1)


def _reach(
    seen: _Seen, soft: NDArray, at: At, page: PageHair, rig: FaceRig, vertices: NDArray,
    camera: Camera, usual: tuple[float, float, float],
) -> NDArray[np.float64]:  # fmt: skip
    """(COLUMNS,) metres that a beard goes on below the jaw, as far as it is drawn without a gap."""
    down = _down(page, rig, vertices, camera)
    rim = (seen.place[:, 0] < 0.45) & (np.abs(seen.place[:, 1]) < 0.006)
    steps = np.arange(STEP, BELOW, STEP)
    out = np.zeros(COLUMNS)
    if not rim.any():
        return out
    cells = seen.cells[rim][:, None] + steps[:, None] * down
    flat = cells.reshape(-1, 2)
    odds, ink = _odds(at, page.pixels(flat)), _at(soft, flat)
    says = _says(odds, ink, np.repeat(seen.place[rim, 0], len(steps)), usual)
    score = (says @ BELOW_JAW[:-1] + BELOW_JAW[-1]).reshape(len(cells), -1)
    on_page = ((flat > 0) & (flat < np.array(soft.shape[::-1]) - 1)).all(axis=1)
    goes = (score > 0) & on_page.reshape(score.shape)
    far = np.where(goes.all(axis=1), len(steps), np.argmin(goes, axis=1)) * STEP
    along = seen.place[rim, 0]
    for k, here in enumerate(ALONG):
        weight = np.clip(1 - np.abs(along - here) / 0.12, 0, 1)
        if weight.sum() > 1:
            out[k] = (weight * far).sum() / weight.sum()
    return out


def _down(page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera) -> NDArray[np.float64]:
    """(2,) cells on the page of a metre down from the head."""
    from facs_rig import landmark_points

    mark = landmark_points(rig, vertices)
    eyes = (mark["eye_outer_left"] + mark["eye_outer_right"]) / 2
    across = mark["eye_outer_left"] - mark["eye_outer_right"]
    out = mark["nose_bridge_upper"] - eyes
    way = -np.cross(out, across)
    way /= max(float(np.linalg.norm(way)), 1e-9)
    ends = page.cells(camera.project(np.stack([mark["chin"], mark["chin"] + 0.05 * way])))
    return (ends[1] - ends[0]) / 0.05


def _moustache(base: float, bearded: bool) -> float:
    """Metres of a moustache's hairs: as stubble where the beard is."""
    if not bearded or base > 0.004:
        return float(np.clip(base, 0.007, 0.012))
    return base


def _where(beard: Beard, seen: _Seen, page: PageHair) -> NDArray[np.bool_]:
    """(h, w) cells of the page where a beard grows out of the skin."""
    cover = on_chart(beard.cover, seen.place)
    return _filled(seen.cells[(cover > 0.5) & seen.shown], page)


def _filled(cells: NDArray, page: PageHair, gap: int = 2) -> NDArray[np.bool_]:
    """(h, w) what a cloud of places (k, 2) covers that lie less than two gaps apart."""
    found = np.zeros(page.hair.shape, dtype=bool)
    at = np.rint(cells).astype(int)
    at = at[((at >= 0) & (at < page.hair.shape[::-1])).all(axis=1)]
    found[at[:, 1], at[:, 0]] = True
    return ndimage.binary_closing(np.pad(found, gap + 1), iterations=gap)[
        gap + 1 : -gap - 1, gap + 1 : -gap - 1
    ]
