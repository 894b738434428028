"""Beards on a page: found where they are drawn, not where they are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import binary_closing

from dataset_gen import STYLES, ink
from dataset_gen.conventions import Artist, draw_by_convention, zoomed
from facs_rig import Camera, FaceParameters, landmark_points, load_rig, rasterise
from facs_rig.beard.chart import ALONG, UP
from facs_rig.beard.lip import rim_of
from facs_rig.beard.mesh import beard_mesh
from facs_rig.common.box import Box
from facs_rig.common.images import area_resample
from snakes.hair.beard_fit import fit_beard, with_beard
from snakes.hair.region import page_hair

SIZE = 360
PLAIN = Artist(cut="bald", clothes="none", crease="none", crow="none", room=1.15)
MAN = {"gender": 1.0, "age": 0.3}


class Page:
    """A face drawn by convention, and what a network that sees its beard says in coarse cells."""

    def __init__(self, artist, yaw=0.0, who=None, doubt=0.0, seed=3):
        rig = load_rig()
        who = MAN if who is None else who
        self.parameters = FaceParameters({}, who, (float(np.radians(yaw)), 0.0, 0.0))
        self.vertices = rig.pose(self.parameters)
        camera = Camera.framing(rig.extent(self.parameters), SIZE, SIZE)
        self.camera = zoomed(camera, artist.room)
        strokes, _, regions = draw_by_convention(
            rig, self.vertices, self.camera, self.parameters, artist, 2.0,
            np.random.default_rng(seed),
        )  # fmt: skip
        self.drawing = ink(strokes, SIZE, SIZE, STYLES["ink"]) / 255
        self.truth = filled(regions.get("beard", []))
        coarse = area_resample(self.truth.astype(np.float32), Box(0, 0, SIZE, SIZE), (20, 20))
        self._says = 0.005 + (0.6 - doubt) * coarse

    def at(self, region, points):
        if region != "beard":
            return np.full(len(points), 0.01)
        u, v = np.clip((np.asarray(points) / SIZE * 20).astype(int), 0, 19).T
        return self._says[v, u]

    def fitted(self):
        """The page's hair, and its beard."""
        rig = load_rig()
        page = page_hair(self.drawing, self.at, rig, self.vertices, self.camera)
        return page, fit_beard(
            self.drawing, self.at, page, rig, self.parameters, self.vertices, self.camera
        )

    def shown(self, beard):
        """(h, w) bool where a beard is seen on the face."""
        rig = load_rig()
        mesh = beard_mesh(rig, self.parameters.identity, beard)
        both = np.concatenate([mesh.triangles, mesh.triangles[:, ::-1]]) + len(self.vertices)
        every = np.concatenate([self.vertices, mesh.on(self.vertices)])
        found = rasterise(every, np.concatenate([rig.triangles, both]), self.camera)
        return binary_closing(found.triangle >= len(rig.triangles), iterations=3)


def filled(outlines):
    picture = Image.new("1", (SIZE, SIZE))
    for outline in outlines:
        ImageDraw.Draw(picture).polygon((np.asarray(outline) - 0.5).ravel().tolist(), fill=1)
    return np.asarray(picture)


def overlap(a, b):
    return (a & b).sum() / max((a | b).sum(), 1)


@pytest.mark.parametrize("yaw", [0, 25])
@pytest.mark.parametrize("way", ["black", "hairs"])
def test_a_drawn_beard_is_found_where_it_is(way, yaw):
    drawn = Page(replace(PLAIN, beard=way), yaw)
    page, beard = drawn.fitted()
    assert beard is not None and beard.length[0] > 0
    assert overlap(drawn.shown(beard), drawn.truth) > 0.45
    marked = with_beard(page, beard, load_rig(), drawn.vertices, drawn.camera).beard
    truth = area_resample(drawn.truth.astype(np.float32), page.box, page.hair.shape[::-1]) > 0.5
    assert overlap(marked, truth) > 0.5


@pytest.mark.parametrize("yaw", [0, 25])
@pytest.mark.parametrize("shade", ["none", "nose", "full"])
@pytest.mark.parametrize("mouth", ["line", "lips", "dark"])
def test_a_bare_face_has_none(yaw, shade, mouth):
    artist = replace(PLAIN, shade=shade, mouth=mouth, chin="arc")
    assert Page(artist, yaw).fitted()[1] is None


def test_a_network_that_is_wrong_alone_makes_none():
    """It says beard all over a face where next to nothing is drawn, but not loudly."""
    bare = Page(PLAIN)
    bare._says = np.full((20, 20), 0.02)
    assert bare.fitted()[1] is None


def test_a_child_has_none_whatever_is_drawn():
    drawn = Page(replace(PLAIN, beard="black"))
    drawn.parameters = FaceParameters({}, {"age": -0.6}, drawn.parameters.head)
    assert drawn.fitted()[1] is None


def test_darker_drawn_beards_are_darker_and_longer():
    dark, pale = (Page(replace(PLAIN, beard=way)).fitted()[1] for way in ("black", "hairs"))
    assert dark.colour > pale.colour + 0.1 and dark.length[0] > pale.length[0]


def test_a_moustache_alone_is_no_beard():
    drawn = Page(replace(PLAIN, moustache="black"))
    low, high = (np.flatnonzero(drawn.truth.any(axis=1))[k] for k in (0, -1))
    drawn.drawing = np.where(filled_rows(drawn, low - 6, high + 4), 0.0, drawn.drawing)
    _, beard = drawn.fitted()
    assert beard is not None and beard.moustache > 0.005 and not beard.length.any()
    assert not beard.cover[ALONG > 0.45].any() and not beard.cover[:, UP < 0.03].any()


def test_what_has_no_mouth_below_it_is_no_moustache():
    drawn = Page(replace(PLAIN, moustache="black"))
    low, high = (np.flatnonzero(drawn.truth.any(axis=1))[k] for k in (0, -1))
    drawn.drawing = np.where(filled_rows(drawn, low - 6, high + 2), 0.0, drawn.drawing)
    assert drawn.fitted()[1] is not None
    mark = landmark_points(load_rig(), drawn.vertices)
    lip, chin = drawn.camera.project(np.stack([mark["lip_top"], mark["chin"]]))[:, 1]
    drawn.drawing[int(lip) + 3 : int(chin) - 20, SIZE // 3 : -SIZE // 3] = 1.0
    assert drawn.fitted()[1] is None


@pytest.mark.parametrize(("wide", "thick"), [(0.8, 1.0), (1.2, 1.0), (1.5, 0.7)])
def test_a_moustache_is_as_wide_and_as_high_as_it_is_drawn(wide, thick):
    drawn, rig = Page(PLAIN), load_rig()
    ends = np.linspace(-1, 1, 41)
    mark = landmark_points(rig, drawn.vertices)
    rim = rim_of(rig, rig.neutral(MAN))
    x = wide * ends * mark["mouth_corner_left"][0]
    low = np.interp(np.abs(x), *rim.T) - 0.5e-3
    room = mark["nose_base"][1] - low[20]
    high = low + thick * room * (1 - np.abs(ends) ** 2.6) ** 0.85
    depth = np.full(41, mark["lip_top"][2])
    line = np.concatenate(
        [np.stack([x, y, depth], axis=1)[:: 1 - 2 * k] for k, y in enumerate((low, high))]
    )
    picture = Image.new("1", (SIZE, SIZE))
    ImageDraw.Draw(picture).polygon((drawn.camera.project(line) - 0.5).ravel().tolist(), fill=1)
    drawn.drawing = np.where(np.asarray(picture), 0.0, drawn.drawing)
    found = drawn.fitted()[1]
    assert found is not None
    assert found.spread == pytest.approx(wide, abs=0.2)
    assert (found.rise < 0.85) == (thick < 0.85)


def filled_rows(drawn, low, high):
    """A broad moustache: between rows, as wide as what is drawn of one."""
    columns = np.flatnonzero(drawn.truth.any(axis=0))
    out = np.zeros((SIZE, SIZE), dtype=bool)
    out[low:high, columns[0] : columns[-1]] = True
    return out


def test_a_page_without_the_lower_face_has_none():
    drawn = Page(replace(PLAIN, beard="black"))
    away = replace(drawn.camera, centre=(drawn.camera.centre[0], drawn.camera.centre[1] + SIZE))
    drawn.camera = away
    assert drawn.fitted()[1] is None
