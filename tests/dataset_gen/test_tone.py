"""Fields of shade: where the light does not reach, inside the face, and where the page leans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, map_coordinates

from dataset_gen.conventions import Artist
from dataset_gen.linework import ink
from dataset_gen.linework.paper import through, tilt_matrix
from dataset_gen.linework.style import STYLES, Style
from dataset_gen.page import draw_page
from dataset_gen.sampling import sample_face, sample_rng
from dataset_gen.shading import LAMP
from dataset_gen.styles import GRAPHITE_ODDS, LOOKS, sample_style
from dataset_gen.tone import DARKEST, graphite, tilted
from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.mesh import vertex_normals

SMOOTH = Style(graphite=1.0, smudge=1.0, light=-50.0)
HEADS = ((0.0, 0.0, 0.0), (0.45, 0.0, 0.0), (-0.3, 0.2, 0.1))


def face(head=(0.0, 0.0, 0.0)):
    """A rig, a posed face and its camera."""
    rig = load_rig()
    posed = rig.pose(FaceParameters({"smile": 2.0}, head=head))
    return rig, posed, Camera.framing(posed, 256, 256, 0.06)


@pytest.mark.parametrize("head", HEADS)
@pytest.mark.parametrize("light", [-60.0, 40.0])
def test_it_is_dark_where_the_light_does_not_reach(head, light):
    """Against the normals of the mesh itself, of which the depth buffer knows nothing."""
    rig, posed, camera = face(head)
    tone = graphite(rig, posed, camera, replace(SMOOTH, light=light))
    normals = vertex_normals(posed, rig.triangles, rig.corners)
    angle = np.radians(light)
    lamp = np.array([LAMP[0] * np.sin(angle), LAMP[0] * np.cos(angle), LAMP[1]])
    places = camera.project(posed)
    seen = rig.parts["skin"] & (normals[:, 2] > 0.3) & camera_sees(posed, places)
    found = map_coordinates(tone, places[seen, ::-1].T - 0.5, order=1)
    lit = normals[seen] @ lamp
    low, high = np.quantile(lit, [0.15, 0.7])
    assert np.median(found[lit < low]) > np.median(found[lit > high]) + 0.25


def camera_sees(posed, places):
    """(n,) roughly which vertices are the nearest ones where they are seen."""
    cell = np.floor(places / 4).astype(int)
    cell = cell[:, 1] * 1000 + cell[:, 0]
    nearest = np.full(cell.max() + 1, -np.inf)
    np.maximum.at(nearest, cell, posed[:, 2])
    return posed[:, 2] > nearest[cell] - 0.008


@pytest.mark.parametrize("head", HEADS)
def test_shade_ends_at_the_outline(head):
    rig, posed, camera = face(head)
    tone = graphite(rig, posed, camera, SMOOTH)
    u, v = np.floor(camera.project(posed)).astype(int).clip(0, 255).T
    inside = np.zeros((256, 256), bool)
    inside[v, u] = True
    beyond = [tone * ~binary_dilation(inside, iterations=k) for k in (3, 6)]  # a cell is 4 px
    assert (beyond[0] > 0).sum() < 0.005 * inside.sum() and beyond[1].max() == 0
    assert 0.9 * DARKEST < tone.max() < DARKEST + 1e-6 and (tone[inside] < 0.05).mean() > 0.2


def test_a_smudge_takes_the_tooth_of_the_paper_away():
    rig, posed, camera = face()
    smooth, rough = (
        graphite(rig, posed, camera, replace(SMOOTH, smudge=smudge)) for smudge in (1, 0)
    )
    steps = [np.abs(np.diff(tone, axis=1)).mean() for tone in (smooth, rough)]
    assert steps[1] > 1.5 * steps[0]


def test_without_graphite_there_is_none():
    rig, posed, camera = face()
    assert graphite(rig, posed, camera, Style()) is None
    away = Camera(64, 64, (300.0, 300.0), (9000.0, 32.0))
    assert graphite(rig, posed, away, SMOOTH) is None


def test_tone_lies_where_the_page_leans():
    style = Style(tilt=(0.06, -0.04))
    matrix = tilt_matrix(style, 256, 200)
    for place in ((60, 50), (200, 150), (128, 100)):
        spot = np.zeros((200, 256), np.float32)
        spot[place[1] - 2 : place[1] + 3, place[0] - 2 : place[0] + 3] = 1
        moved = tilted(spot, matrix)
        v, u = np.indices(moved.shape) + 0.5
        middle = np.array([(moved * u).sum(), (moved * v).sum()]) / moved.sum()
        np.testing.assert_allclose(middle, through(matrix, np.add(place, 0.5)), atol=0.1)


def test_tone_lies_under_the_lines():
    rig, posed, camera = face()
    style = replace(STYLES["shaded"], width=3.0, tone=1.0, grain=0.0, pale=0.0)
    rng = np.random.default_rng(0)
    shaded = draw_page([], rig, posed, camera, style, rng).picture
    assert 0.1 < (shaded < 200).mean() < 0.6
    under = np.full((20, 20), 0.5, np.float32)
    assert set(np.unique(ink([], 20, 20, Style(), under))) == {128}
    np.testing.assert_array_equal(ink([], 20, 20, Style()), 255)


def test_pencils_shade_most():
    rng = np.random.default_rng(1)
    for look in LOOKS:
        drawn = [sample_style(rng, look=look).graphite > 0 for _ in range(200)]
        assert np.mean(drawn) == pytest.approx(GRAPHITE_ODDS.get(look, 0.0), abs=0.12)


def test_older_schemes_draw_without_shade():
    """What was measured on them is to compare."""
    rig = load_rig()
    shares = {
        scheme: np.mean(
            [sample_face(rig, sample_rng(5, k), 256, scheme).style.graphite > 0 for k in range(60)]
        )
        for scheme in ("people", "sparse", "thesis")
    }
    assert shares["people"] > 0.03 and shares["sparse"] == shares["thesis"] == 0


def test_conventions_have_shade_of_their_own():
    """Graphite by the skull showed through the hair and hats that were drawn."""
    assert Artist().styled(STYLES["shaded"]).graphite == 0
