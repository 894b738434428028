"""The strokes of a beard on a page lean on the head as they are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw

from facs_rig import load_rig
from facs_rig.beard.chart import on_chart, roots_of
from facs_rig.beard.follow import axes_of
from facs_rig.beard.mesh import beard_mesh
from facs_rig.beard.presets import preset

from .test_beard_fit import PLAIN, SIZE, Page

FINE = 3  # times as many pixels as the drawing has


class Hatched(Page):
    """A bare face over whose lower half strokes are drawn, at an angle from down to the page's
    right that depends on the side of the face's middle, -1 to 1."""

    def __init__(self, yaw, angle, length=10.0, width=3, gap=4.0):
        super().__init__(PLAIN, yaw)
        rng, rig, roots = np.random.default_rng(1), load_rig(), roots_of(load_rig())
        corners = np.asarray(self.vertices[roots.anchors], float)
        at = np.einsum("kc,kcd->kd", roots.weight, self.vertices[roots.index])
        grows = on_chart(preset("full beard").cover, roots.place) > 0.5
        pixels = self.camera.project(at)[grows & (axes_of(corners)[:, 2, 2] > 0.1)]
        self.middle = self.camera.project(at[np.abs(roots.across) < 0.002])[:, 0].mean()
        kept = [pixels[0]]
        page = Image.fromarray((255 * self.drawing).astype(np.uint8)).resize((FINE * SIZE,) * 2)
        for place in pixels[1:]:
            if np.linalg.norm(place - kept, axis=1).min() < gap:
                continue
            kept.append(place)
            turn = self.angle_at(place, angle) + np.radians(4) * rng.normal()
            away = length * rng.uniform(0.6, 1.2) * np.array([np.sin(turn), np.cos(turn)])
            line = FINE * np.stack([place - away / 2, place + away / 2])
            ImageDraw.Draw(page).line(line.ravel().tolist(), fill=0, width=width)
            if not length:
                low, high = FINE * place - width / 2, FINE * place + width / 2
                ImageDraw.Draw(page).ellipse([*low, *high], fill=0)
        self.drawing = np.asarray(page.resize((SIZE, SIZE), Image.Resampling.BOX)) / 255
        cells = (np.array(kept) / SIZE * 20).astype(int)
        self._says = np.full((20, 20), 0.005)
        self._says[cells[:, 1], cells[:, 0]] = 0.6
        self.rig = rig

    def angle_at(self, place, angle):
        return angle(np.tanh((place[..., 0] - self.middle) / 6))

    def off(self, beard, angle):
        """Degrees between hairs that are seen and strokes drawn there, away from the middle."""
        short = replace(beard, length=np.minimum(beard.length, 0.006), moustache=0.006)
        mesh = beard_mesh(self.rig, self.parameters.identity, short)
        root, v = mesh.bound.root, mesh.uv[:, 1]
        ends = self.camera.project(mesh.on(self.vertices))
        single = np.flatnonzero(mesh.quads[:, 2] == mesh.quads[:, 3])
        base, _, tip = mesh.quads[single, :3].T
        assert (v[tip] == 1).all() and (root[base] == root[tip]).all()
        facing = axes_of(np.asarray(self.vertices[mesh.bound.anchors[root[base]]], float))[:, 2, 2]
        seen = (facing > 0.4) & (np.abs(ends[base, 0] - self.middle) > 8)
        way = (ends[tip] - ends[base])[seen]
        wanted = self.angle_at(ends[base][seen], angle)
        off = np.arctan2(way[:, 0], way[:, 1]) - wanted
        return np.degrees(np.abs((off + np.pi / 2) % np.pi - np.pi / 2))


WAYS = {
    "outward": lambda side: np.radians(40) * side,
    "far outward": lambda side: np.radians(62) * side,
    "one way": lambda side: np.radians(30) + 0 * side,
}


@pytest.mark.parametrize("yaw", [0, 25])
@pytest.mark.parametrize("way", WAYS)
def test_hairs_run_as_the_strokes_do(way, yaw):
    drawn = Hatched(yaw, WAYS[way])
    _, beard = drawn.fitted()
    assert np.median(drawn.off(beard, WAYS[way])) < 15
    assert np.median(drawn.off(replace(beard, lean=0 * beard.lean), WAYS[way])) > 25


def test_the_side_that_is_not_seen_is_like_the_other():
    _, beard = Hatched(55, WAYS["outward"]).fitted()
    grown = (beard.cover > 0.5) & (np.abs(beard.lean).min(axis=0) > 0.1)
    left, right = beard.lean[:, grown]
    assert grown.sum() > 20 and np.abs(left - right).mean() < np.radians(12)


@pytest.mark.parametrize("yaw", [0, 20])
def test_dots_have_no_way(yaw):
    _, beard = Hatched(yaw, WAYS["one way"], length=0.0, width=5).fitted()
    assert np.degrees(np.abs(beard.lean[:, beard.cover > 0.5])).mean() < 12


@pytest.mark.parametrize("yaw", [0, 20])
def test_neither_has_solid_black(yaw):
    page = Page(replace(PLAIN, beard="black"), yaw)
    page.drawing = np.where(page.truth, 0.0, page.drawing)  # without the light that is left in it
    _, beard = page.fitted()
    assert np.degrees(np.abs(beard.lean[:, beard.cover > 0.5])).mean() < 8
