"""A person's creases are as deep as they are drawn."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.folds import FAMILIES
from facs_rig.grooves import CREASES
from snakes.creases import (
    GROUPS,
    PEOPLE,
    Found,
    crease_places,
    drawn_wrinkles,
    found_creases,
    likely_wrinkles,
)
from snakes.lines import Lines
from snakes.model_lines import face_lines

NONE = Lines(np.empty((0, 2)), np.empty((0, 2)))
LAUGHING = {"frontalis": 4.0, "brow_furrow": 3.0, "outer_squint": 4.0, "smile": 4.0}


@pytest.fixture(scope="module")
def rig():
    return load_rig()


class Page:
    """A face that does something, and a camera on it."""

    def __init__(self, rig, aus, **who):
        self.rig, self.parameters = rig, FaceParameters(aus, who, (0.15, 0.0, 0.0))
        self.vertices = rig.pose(self.parameters)
        self.camera = Camera.framing(self.vertices, 500, 500)
        index, _ = crease_places(rig)
        self.creases = self.camera.project(self.vertices[index[:, 1]].reshape(-1, 3))
        self.creases = self.creases.reshape(-1, index.shape[2], 2)

    def wrinkles(self, drawn, mane=NONE):
        return drawn_wrinkles(drawn, mane, self.rig, self.vertices, self.camera, self.parameters)

    def found(self, drawn, mane=NONE):
        return found_creases(drawn, mane, self.rig, self.vertices, self.camera, self.parameters)

    def of(self, *, wrinkles, kinds=("contour", "valley", "suggestive")):
        """The lines of somebody who does the same, with creases so deep."""
        who = {**self.parameters.identity, "wrinkles": wrinkles}
        face = self.rig.pose(FaceParameters(self.parameters.aus, who, self.parameters.head))
        return face_lines(self.rig, face, self.camera, kinds).lines


def along(lines, step=1.0):
    """Polylines (k, 2) as points a pixel apart that know where they run."""
    points, ways = [], []
    for line in lines:
        far = np.linalg.norm(np.diff(line, axis=0), axis=1)
        for a, b, d in zip(line[:-1], line[1:], far, strict=True):
            share = np.arange(0, d, step)[:, None] / max(d, 1e-9)
            points.append(a + share * (b - a))
            ways.append(np.tile((b - a) / max(d, 1e-9), (len(share), 1)))
    return Lines(np.concatenate(points), np.concatenate(ways))


def test_families_and_groups_are_the_rigs():
    assert set(GROUPS) <= set(FAMILIES)
    for family, groups in GROUPS.items():
        assert set(groups) <= set(FAMILIES[family][1]) & set(CREASES)


def test_places_lie_on_the_skin_where_the_creases_are_sculpted(rig):
    """Those of one group, from the rig's own fold at rest: where it is deepest a place is near."""
    index, lone = crease_places(rig)
    assert rig.parts["skin"][index].all() and lone.any() and not lone.all()
    deep = rig.neutral({"age": 1.0}) - rig.neutral({"age": 1.0, "wrinkles": -1.0})
    deepest = np.argsort(np.linalg.norm(deep, axis=1))[-200:]
    rest = rig.neutral()
    places = rest[index[:, 1].ravel()]
    away = np.linalg.norm(rest[deepest][:, None] - places[None], axis=2).min(axis=1)
    assert np.quantile(away, 0.9) < 0.008


@pytest.mark.parametrize(("aus", "age"), [(LAUGHING, 0.0), ({}, 0.9), (LAUGHING, 0.7)])
def test_deeper_creases_are_read_from_deeper_drawn_ones(rig, aus, age):
    page = Page(rig, aus, age=age)
    none, faint, deep = (page.wrinkles(page.of(wrinkles=w)) for w in (-1.0, -0.6, 1.0))
    assert none < faint < deep
    assert none < -0.2 < 0.1 < deep


def test_at_rest_a_young_face_says_nothing(rig):
    page = Page(rig, {}, age=0.0)
    assert page.wrinkles(along(page.creases)) == 0.0
    assert page.wrinkles(page.of(wrinkles=0.0)) == 0.0
    assert Page(rig, LAUGHING).wrinkles(NONE) == 0.0


def test_lines_along_creases_count_and_lines_across_them_do_not(rig):
    page = Page(rig, LAUGHING)
    drawn = along(page.creases)
    across = Lines(drawn.points, drawn.along[:, ::-1] * (-1, 1))
    inked = page.found(drawn).inked
    assert (inked > 0.4).all()
    assert (page.found(across).inked < 0.5 * inked).all()


def test_hatching_is_no_crease(rig):
    page = Page(rig, LAUGHING)
    low, high = page.creases.reshape(-1, 2).min(axis=0), page.creases.reshape(-1, 2).max(axis=0)
    for way in ((1, 0), (0, 1), (0.7, 0.7)):
        out = np.array([-way[1], way[0]])
        middle, far = (low + high) / 2, np.linalg.norm(high - low)
        rows = [middle + out * s for s in np.arange(-far / 2, far / 2, 4.0)]
        hatched = along([np.array([m - far / 2 * np.array(way), m + far / 2 * np.array(way)])
                         for m in rows])  # fmt: skip
        assert page.wrinkles(hatched) < 0.1


def test_a_face_draws_its_own_lines_without_any_crease(rig):
    page = Page(rig, LAUGHING)
    plain = page.found(page.of(wrinkles=-1.0, kinds=("contour",)))
    assert (plain.inked < 0.3).all()


def test_what_hair_hides_says_nothing(rig):
    page = Page(rig, LAUGHING)
    drawn = along(page.creases)
    found = page.found(drawn, along(page.creases))
    assert not found.seen.any()
    assert likely_wrinkles(found) == (0.0, PEOPLE)


def test_a_turned_face_hides_its_far_side(rig):
    seen = []
    for yaw in (0.0, 0.9):
        parameters = FaceParameters(LAUGHING, {}, (yaw, 0.0, 0.0))
        vertices = rig.pose(parameters)
        camera = Camera.framing(vertices, 500, 500)
        found = found_creases(along([np.zeros((2, 2)) + [[0, 0], [9, 9]]]), NONE, rig, vertices,
                              camera, parameters)  # fmt: skip
        seen.append(found.seen)
    assert (seen[0] > 0.9).all()
    sides = [list(GROUPS).index(name) for name in ("crow", "nasolabial", "corner")]
    assert (seen[1][sides] < 0.6).all()


def test_the_more_that_is_seen_the_surer_it_is_and_nothing_leaves_its_range():
    one = np.array([1.0, 0, 0, 0, 0])
    spreads = [likely_wrinkles(Found(one, seen, np.ones(5)))[1]
               for seen in (np.zeros(5), one, np.ones(5))]  # fmt: skip
    assert spreads[0] == PEOPLE > spreads[1] > spreads[2]
    rng = np.random.default_rng(0)
    for _ in range(100):
        found = Found(rng.uniform(-0.3, 1, 5), rng.uniform(0, 1, 5), rng.uniform(0, 1.3, 5))
        assert -1 <= likely_wrinkles(found)[0] <= 1
