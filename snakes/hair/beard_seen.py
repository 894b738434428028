"""What a page has where a beard could grow on a fitted face, and what that says of one.

At places of the fitted skin (facs_rig.beard.chart) it is looked up how probable a beard is to the
network and how much ink there is. The numbers made of these are what logistic regressions weigh
(see beard_weights) to tell whether there is a beard, a moustache alone, and how far each goes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from facs_rig import Camera, FaceRig, landmark_points
from facs_rig.beard.chart import COLUMNS, ROWS, on_chart, roots_of, weights_at
from facs_rig.beard.follow import axes_of
from facs_rig.beard.presets import FULL, UNDER, rimmed
from facs_rig.common.images import area_resample

from .region import At, PageHair
from .texture import tensor

__all__ = [
    "PLACES", "STEP", "TEMPLATES", "Below", "Seen", "bare", "below", "chin_says", "gathered",
    "ink_of", "likeliest", "lip_says", "mouth_line", "over_the_mouth", "places_on", "places_say",
    "seen_on",
]  # fmt: skip

PLACES = 2_500
"""Places of the skin that are looked at."""
SOFT, FINE = 2.0, 1.0
"""Cells by which ink is blurred, to tell hatching from paper and a moustache from a lip's line."""
FACING, GRAZING = 0.2, 0.04
"""Cosine between skin and view from which on it is seen, and from which on it is of use where the
likely shape of a beard helps."""
USUAL = 4.0
"""By how much the first of TEMPLATES is likelier than the others before anything is seen."""
SURE = 0.002
"""Probabilities nearer to 0 or 1 than this are taken for it."""
DENSE, PALE, BARE, WIDELY = 0.15, 0.35, 3.0, 5.0
"""Ink of a chin beyond the cheeks' from which on its beard is drawn all over; the share of that ink
below which another place is then bare, how much that takes off, and cells of the blur."""
COLUMN, WIDE, INNER = 0.004, 0.024, 0.014
"""Metres of a column over the mouth, and from the middle to the last, and to the last of those that
every moustache has."""
MOUTH_WIDE, MOUTH_COLUMNS, MOUTH_LOW = 0.75, 13, 0.0105
"""Share of a mouth's width in which its line is looked for, in how many columns, and metres below
the fitted one."""
UNLIKELY = -5.2
"""Log-odds of a moustache where none is looked up."""
BELOW, STEP = 0.16, 0.004
"""Metres below the jaw where a beard is looked for, and from one place to the next."""
TEMPLATES = (
    rimmed(FULL, UNDER),
    rimmed(((0, 61), (0.22, 60), (0.3, 46), (0.36, -45)), ((0, -16), (0.3, -10))),
    rimmed(((0, 61), (0.22, 60), (0.34, 50), (0.5, 30), (0.58, -45)), UNDER),
    rimmed(((0, 61), (0.22, 60), (0.34, 40), (0.5, 24), (0.7, 18), (0.92, 18)), UNDER),
)
"""Shapes of beards: up the cheeks, on the chin alone, in front of the jaw's angle, and low."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What the page has at places of the skin.

    place : (k, 2) on the chart;  above : (k,) over the mouth;  across : (k,) metres from the middle
    cells : (k, 2) columns and rows of the grid;  shown, grazed : (k,) whether the view
    and page have them, and at a slant at least
    ink, fine, wide : (k,) blurred by SOFT, FINE and WIDELY
    upright : (k,) how much more strokes run up and down the head than across it, -1..1, as far as
    there are any
    odds : (k,) the network's log-odds of a beard
    down : (2,) cells on the page of a metre down from the head
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
    upright: NDArray[np.float64]
    odds: NDArray[np.float64]
    down: NDArray[np.float64]

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
        """That of values (k,) in a zone, or something else where next to nothing of it is seen."""
        zone = self.zone(name)
        return float(values[zone].mean()) if zone.sum() > 8 else otherwise

    @property
    def usual(self) -> tuple[float, float, float]:
        """Log-odds and ink of the chin, ink of the cheeks."""
        chin, cheek = (self.mean(name, self.ink, 0.1) for name in ("chin", "cheek"))
        return self.mean("chin", self.odds, -5.0), chin, cheek


def ink_of(drawing: NDArray, page: PageHair) -> NDArray[np.float32]:
    """(h, w) ink of a drawing (1 is paper) in the cells of its page."""
    rows, columns = page.hair.shape
    paper = np.asarray(drawing, np.float32)
    return np.asarray(1 - area_resample(paper, page.box, (columns, rows), outside=1.0))


def seen_on(
    ink: NDArray, at: At, page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera
) -> Seen:
    """What the page of a fitted face has. ink : see `ink_of`; at : see `region.page_hair`;
    vertices : (n, 3) metres, posed; camera : of the drawing's pixels"""
    cells, facing = places_on(page, rig, vertices, camera)
    roots = roots_of(rig)
    inside = ((cells > 0) & (cells < np.array(page.hair.shape[::-1]) - 1)).all(axis=1)
    down = _down(page, rig, vertices, camera)
    soft, fine, wide = (
        _at(ndimage.gaussian_filter(ink, blur), cells) for blur in (SOFT, FINE, WIDELY)
    )
    upright = _at(_upright(ink, down), cells)
    return Seen(
        roots.place[:PLACES], roots.above[:PLACES], roots.across[:PLACES], cells,
        inside & (facing > FACING), inside & (facing > GRAZING),
        soft, fine, wide, upright, _odds(at, page.pixels(cells)), down,
    )  # fmt: skip


def places_on(
    page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(PLACES, 2) cells of places of the skin, and (PLACES,) how far it faces the viewer there."""
    roots = roots_of(rig)
    index, weight = roots.index[:PLACES], roots.weight[:PLACES]
    at = np.einsum("kc,kcd->kd", weight, vertices[index])
    facing = axes_of(np.asarray(vertices[roots.anchors[:PLACES]], float))[:, 2, 2]
    return page.cells(camera.project(at)), facing


def chin_says(seen: Seen) -> NDArray[np.float64]:
    """(3,) what tells whether there is a beard: ink and log-odds of that side of the chin that has
    less, and the jaw's log-odds."""
    less = [_lesser_side(seen, values) for values in (seen.ink, seen.odds)]
    return np.array([*less, seen.mean("jaw", seen.odds, -5.0)])


def lip_says(seen: Seen) -> NDArray[np.float64]:
    """(5,) what tells whether there is a moustache: ink of all but the emptiest columns over the
    mouth, that of their darkest parts near the middle, how much strokes run up and down there, the
    log-odds, and the cheeks' ink."""
    inner = seen.zone("lip") & (np.abs(seen.across) < INNER)
    upright = float(seen.upright[inner].mean()) if inner.any() else 0.0
    return np.array([
        over_the_mouth(seen), _darkest(seen, inner), upright,
        seen.mean("lip", seen.odds, UNLIKELY), seen.mean("cheek", seen.ink, 0.1),
    ])  # fmt: skip


def over_the_mouth(seen: Seen) -> float:
    """Ink between nose and mouth that a quarter of the columns there have less of: a moustache goes
    from side to side, a shadow or the line of a lip does not fill it."""
    mine = seen.zone("lip")
    column, count = _columns(seen, mine)
    ink = np.bincount(column, seen.fine[mine])[count >= 3] / count[count >= 3]
    return float(np.quantile(ink, 0.25)) if len(ink) >= 4 else 0.0


def mouth_line(
    ink: NDArray, page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera, down: NDArray
) -> float:
    """Ink of the darkest place of each column where the fitted mouth is or a little below it, that
    a quarter of the columns have less of: with a moustache there is a mouth, too.

    down : see `Seen`; the rest as for `seen_on`
    """
    mark = landmark_points(rig, vertices)
    names = ("mouth_corner_right", "lip_inner_top", "lip_inner_bottom", "mouth_corner_left")
    right, top, low, left = page.cells(camera.project(np.stack([mark[n] for n in names])))
    middle = (top + low) / 2
    x = MOUTH_WIDE * np.linspace(-1, 1, MOUTH_COLUMNS)[:, None]
    away = np.where(x < 0, right, left) - middle
    rise = (away @ down / (down @ down))[:, None]
    along = middle + np.abs(x) * away - (np.abs(x) - x**2) * rise * down  # a parabola
    at = along[:, None] + np.arange(0, MOUTH_LOW, STEP / 4)[:, None] * down
    fine = _at(ndimage.gaussian_filter(ink, FINE), at.reshape(-1, 2)).reshape(at.shape[:2])
    return float(np.quantile(fine.max(axis=1), 0.25))


def _darkest(seen: Seen, mine: NDArray[np.bool_]) -> float:
    """Ink of the darkest place of columns over the mouth, that a quarter of them have less of."""
    column, count = _columns(seen, mine)
    if not len(count):
        return 0.0
    most = np.zeros(len(count))
    np.maximum.at(most, column, seen.ink[mine])
    most = most[count >= 3]
    return float(np.quantile(most, 0.25)) if len(most) >= 3 else 0.0


def _columns(seen: Seen, mine: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(k,) the column over the mouth of each of some places, and (c,) how many each has."""
    column = np.floor(seen.across[mine] / COLUMN).astype(np.intp)
    column -= column.min(initial=0)
    return column, np.bincount(column)


def _lesser_side(seen: Seen, values: NDArray) -> float:
    """The mean of a chin's side, of that which has less where both are seen: light comes from one
    side, a beard grows on both."""
    chin = seen.zone("chin")
    sides = [chin & (way * seen.across > 0.002) for way in (-1, 1)]
    if min(side.sum() for side in sides) <= 15:
        sides = [chin]
    return min(float(values[side].mean()) if side.any() else -5.0 for side in sides)


def places_say(seen: Seen) -> NDArray[np.float64]:
    """(k, 4) what tells whether hair grows at places: log-odds and ink beyond the chin's, ink
    beyond the cheeks', the share of the jaw."""
    return _says(seen.odds, seen.ink, seen.place[:, 0], seen.usual)


def bare(seen: Seen) -> NDArray[np.float64]:
    """(k,) what speaks against a beard where paper is, if one is drawn densely on the chin."""
    chin, cheek = (seen.mean(name, seen.wide, 0.1) for name in ("chin", "cheek"))
    if chin - cheek < DENSE:
        return np.zeros(len(seen.wide))
    share = (seen.wide - cheek) / (chin - cheek)
    return BARE * np.clip(PALE - share, 0, PALE) / PALE


def likeliest(place: NDArray, score: NDArray) -> int:
    """Which of TEMPLATES goes best with what places (k, 2) say, each more than 0 for hair."""
    score = np.clip(score, -3, 3)
    shapes = [on_chart(table, place) for table in TEMPLATES]
    likely = np.array([float(((2 * shape - 1) * score).sum()) for shape in shapes])
    likely[0] += USUAL
    return int(likely.argmax())


def gathered(place: NDArray, score: NDArray, best: int, held: float = 3.0) -> NDArray[np.float64]:
    """(COLUMNS, ROWS) means of what places (k, 2) say, where a template counts for so many."""
    cells, weight = weights_at(place)
    total = np.bincount(cells.ravel(), (weight * score[:, None]).ravel(), COLUMNS * ROWS)
    count = np.bincount(cells.ravel(), weight.ravel(), COLUMNS * ROWS)
    usual = 3 * (2 * TEMPLATES[best] - 1)
    return (total.reshape(COLUMNS, ROWS) + held * usual) / (count.reshape(COLUMNS, ROWS) + held)


@dataclass(frozen=True, eq=False)
class Below:
    """What is seen below the jaw, by lines that go down from it.

    along : (r,) where they begin, as shares of the jaw
    cells : (r, s, 2) of places along them, a STEP from one to the next
    says : (r, s, 4) what tells whether hair hangs there, as `places_say`
    on_page : (r, s)
    """

    along: NDArray[np.float64]
    cells: NDArray[np.float64]
    says: NDArray[np.float64]
    on_page: NDArray[np.bool_]


def below(seen: Seen, ink: NDArray, at: At, page: PageHair) -> Below:
    """What is seen below the jaw. ink, at, page : as for `seen_on`"""
    rim = (seen.place[:, 0] < 0.45) & (np.abs(seen.place[:, 1]) < 0.006)
    along = seen.place[rim, 0]
    steps = np.arange(STEP, BELOW, STEP)
    cells = seen.cells[rim][:, None] + steps[:, None] * seen.down
    flat = cells.reshape(-1, 2)
    soft = _at(ndimage.gaussian_filter(ink, SOFT), flat)
    says = _says(_odds(at, page.pixels(flat)), soft, np.repeat(along, len(steps)), seen.usual)
    on_page = ((flat > 0) & (flat < np.array(ink.shape[::-1]) - 1)).all(axis=1)
    size = (len(along), len(steps))
    return Below(along, cells, says.reshape(*size, 4), on_page.reshape(size))


def _says(
    odds: NDArray, ink: NDArray, along: NDArray, usual: tuple[float, float, float]
) -> NDArray[np.float64]:
    return np.stack([odds - usual[0], ink - usual[1], ink - usual[2], along], axis=1)


def _at(picture: NDArray, cells: NDArray) -> NDArray[np.float64]:
    """(k,) values of a picture between its cells, at columns and rows (k, 2)."""
    return ndimage.map_coordinates(picture, cells[:, ::-1].T, order=1, mode="nearest")


def _odds(at: At, points: NDArray) -> NDArray[np.float64]:
    share = np.clip(at("beard", points), SURE, 1 - SURE)
    return np.log(share / (1 - share))


def _upright(ink: NDArray, down: NDArray) -> NDArray[np.float64]:
    """(h, w) as `Seen` has it: how much ink changes across the head less how much along it."""
    v, both, u = tensor(ink, FINE)
    a, b = down / max(float(np.linalg.norm(down)), 1e-9)
    along = a * a * u + 2 * a * b * both + b * b * v
    across = b * b * u - 2 * a * b * both + a * a * v
    return (across - along) / (across + along + 0.1)


def _down(page: PageHair, rig: FaceRig, vertices: NDArray, camera: Camera) -> NDArray[np.float64]:
    """(2,) cells on the page of a metre down from the head."""
    mark = landmark_points(rig, vertices)
    eyes = (mark["eye_outer_left"] + mark["eye_outer_right"]) / 2
    across = mark["eye_outer_left"] - mark["eye_outer_right"]
    out = mark["nose_bridge_upper"] - eyes
    way = -np.cross(out, across)
    way /= max(float(np.linalg.norm(way)), 1e-9)
    ends = page.cells(camera.project(np.stack([mark["chin"], mark["chin"] + 0.05 * way])))
    return (ends[1] - ends[0]) / 0.05
