"""A cut from the hair on a page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

from facs_rig import Camera, load_rig
from facs_rig.common.box import Box
from facs_rig.hair.cut import ANGLES, AZIMUTHS, mirrored
from facs_rig.hair.head import head_of
from facs_rig.hair.presets import preset
from facs_rig.hair.shell import shell
from snakes.hair.cut_fit import fit_cut
from snakes.hair.gathered import gathered
from snakes.hair.region import PageHair
from snakes.hair.sight import Sight
from snakes.hair.steady import steadiest
from snakes.hair.texture import Strokes


def page_of(scene, hair=None, tone=0.5):
    """The page of a scene, whose hair is known to the pixel."""
    hair = scene.hair if hair is None else hair
    height, width = hair.shape
    none = np.zeros(hair.shape, dtype=bool)
    strokes = Strokes(np.zeros((height, width, 2)), np.zeros((height, width)))
    return PageHair(
        Box(0, 0, width, height), hair, none, scene.head, np.zeros((0, 2)), tone, "strands",
        strokes, None,
    )  # fmt: skip


def refitted(scene, hair=None):
    page = page_of(scene, hair)
    return fit_cut(page, load_rig(), scene.parameters, scene.vertices, scene.camera)


@pytest.mark.parametrize("name, yaw", [("crop", 0), ("side_parting", 30), ("bob", -20),
                                       ("fringe", 10), ("long_straight", 35)])  # fmt: skip
def test_a_cut_covers_what_hair_covers(hairy, name, yaw):
    scene = hairy(name, yaw)
    cut = refitted(scene)
    hair, _ = hairy.seen(cut, scene.parameters, scene.camera)
    assert hairy.overlap(hair, scene.hair) > 0.85
    assert cut.hangs == preset(name).hangs
    aside = replace(scene.parameters, head=(float(np.radians(-90 if yaw > 0 else 90)), 0.0, 0.0))
    camera = Camera.framing(load_rig().pose(aside), 200, 240, margin=0.2)
    known, found = (hairy.seen(c, aside, camera)[0] for c in (preset(name), cut))
    assert hairy.overlap(known, found) > 0.65


@pytest.mark.parametrize("yaw, behind", [(0, 0.3), (25, 0.3), (0, -0.2)])
def test_hair_ends_behind_where_it_is_drawn(hairy, yaw, behind, monkeypatch):
    scene, bob = hairy("bob", yaw), preset("bob")
    longer = bob.edge + np.where(np.cos(ANGLES) < 0, -behind * np.cos(ANGLES), 0)
    hair, head = hairy.seen(replace(bob, edge=longer), scene.parameters, scene.camera)
    scene = replace(scene, hair=hair)

    def overlap():
        found, _ = hairy.seen(refitted(scene), scene.parameters, scene.camera)
        below = np.arange(len(hair))[:, None] > scene.camera.project(scene.vertices).mean(axis=0)[1]
        return hairy.overlap(found & below & ~head, hair & below & ~head)

    with_hem = overlap()
    monkeypatch.setattr("snakes.hair.cut_fit.HEMS", 0)
    assert with_hem > max(0.7, overlap() + 0.05)


@pytest.mark.parametrize("yaw", [0, 30])
def test_a_crown_is_bald_above_a_rim(hairy, yaw):
    scene = hairy("bald_rim", yaw)
    cut = refitted(scene)
    assert cut.top is not None and (cut.top <= cut.edge)[[0, 1, 2, -1, -2]].all()
    assert (cut.top > cut.edge)[AZIMUTHS // 4 : 3 * AZIMUTHS // 4].all()
    hair, _ = hairy.seen(cut, scene.parameters, scene.camera)
    assert hairy.overlap(hair, scene.hair) > 0.65
    for name in ("crop", "bob", "bun"):
        assert refitted(hairy(name, yaw)).top is None


def test_a_thin_band_over_the_skull_is_no_rim(hairy, monkeypatch):
    scene = hairy(None)
    rig = load_rig()
    down, across = np.mgrid[: scene.head.shape[0], : scene.head.shape[1]]
    middle, eyes = scene.camera.project(scene.vertices[rig.parts["eyes"]]).mean(axis=0)
    wide = np.where(np.abs(across - middle) < 0.2 * scene.unit, 0, 0.12 * scene.unit)
    inside = ndimage.distance_transform_edt(scene.head)
    band = ndimage.binary_dilation(scene.head, iterations=4) & (inside <= wide) & (down < eyes)
    cut = refitted(scene, band)
    assert cut is not None and cut.top is None
    hair, _ = hairy.seen(cut, scene.parameters, scene.camera)
    top = band & (np.abs(across - middle) < 0.2 * scene.unit)
    assert (hair & top).sum() > 0.6 * top.sum()
    monkeypatch.setattr("snakes.hair.sight.SPANNED", 1.0)
    assert refitted(scene, band).top is not None


def test_falling_hair_parts_over_an_open_forehead(hairy):
    scene = hairy("long_straight", 0)
    assert abs(refitted(scene).part) < np.radians(15)
    assert refitted(hairy("fringe", 0)).part is None


def test_waves_and_curls_are_as_they_are_drawn(hairy):
    scene = hairy("long_straight", 0)
    page = page_of(scene)
    fit = lambda page: fit_cut(  # noqa: E731
        page, load_rig(), scene.parameters, scene.vertices, scene.camera
    )
    assert fit(page).wave == 0 == fit(page).curl
    assert fit(replace(page, wave=1.0)).wave > 0.3
    assert fit(replace(page, texture="curls")).curl > 0.25


def test_a_bald_head_gives_no_cut(hairy):
    scene = hairy(None, 0)
    assert refitted(scene) is None


def test_no_fringe_hides_the_eyes(hairy):
    scene = hairy("fringe", 0)
    over = scene.hair | (scene.head & (np.arange(scene.hair.shape[0])[:, None] < 200))
    cut = refitted(scene, over)
    assert cut.edge[[0, 1, 2, -2, -1]].min() >= 0.0


def test_a_mirrored_page_gives_the_mirrored_cut(hairy):
    scene, other = hairy("bob", 20), hairy("bob", -20)
    ours, theirs = refitted(scene), mirrored(refitted(other))
    assert np.median(np.abs(ours.edge - theirs.edge)) < 0.03
    assert np.median(np.abs(ours.thick - theirs.thick)) < 0.003


def test_a_bun_is_gathered(hairy):
    scene = hairy("crop", 0)
    v, u = np.mgrid[: scene.hair.shape[0], : scene.hair.shape[1]]
    top = np.flatnonzero(scene.hair.any(axis=1))[0]
    middle = np.flatnonzero(scene.hair.any(axis=0)).mean()
    r = 0.13 * scene.unit
    bun = np.hypot(u - middle, v - top + 0.6 * r) < r
    cut, plain = refitted(scene, scene.hair | bun), refitted(scene)
    assert len(cut.balls) == 1 and not plain.balls
    assert cut.thick.max() < plain.thick.max() + 0.02  # no tower
    hair, _ = hairy.seen(cut, scene.parameters, scene.camera)
    assert hairy.overlap(hair, scene.hair | bun) > 0.8


def test_nothing_hangs_from_nothing(hairy):
    """Hair at both sides of the neck, with a gap above it, becomes bunches that the head wears; at
    one side alone it does if it hangs over the neck."""
    scene, rig = hairy("crop", 0), load_rig()
    v, u = np.mgrid[: scene.hair.shape[0], : scene.hair.shape[1]]
    middle = np.flatnonzero(scene.hair.any(axis=0)).mean()
    chin = np.flatnonzero(scene.head.any(axis=1))[-1] - 0.3 * scene.unit
    aside = np.abs(np.abs(u - middle) - 0.45 * scene.unit) < 0.07 * scene.unit
    bunches = aside & (np.abs(v - chin) < 0.2 * scene.unit)
    cut = refitted(scene, scene.hair | bunches)
    assert cut.balls
    left = bunches & (u < middle)
    assert not refitted(scene, scene.hair | left).balls
    over = np.roll(left, round(0.18 * scene.unit), axis=1)
    assert len(refitted(scene, scene.hair | over).balls) == 1
    made = shell(rig, scene.parameters.identity, cut)
    surface = cKDTree(made.points[made.outer.ravel()])
    for tail in made.tails:
        assert surface.query(made.points[tail.ravel()])[0].min() < 0.012


def test_the_side_of_hair_that_spreads_is_no_tail(hairy):
    """Beside a surface that does not reach it, as at a page's edge."""
    scene = hairy("bob", 0)
    head = head_of(load_rig(), scene.parameters.identity)
    v, u = np.mgrid[: scene.hair.shape[0], : scene.hair.shape[1]]
    low = np.flatnonzero(scene.hair.any(axis=1))[-1] - 6
    side = np.flatnonzero(scene.hair[low - 6])[0]
    tall = 0.3 * scene.unit
    wide = 0.15 * scene.unit + 0.4 * (v - low + tall)
    spread = (v <= low) & (v > low - tall) & (u <= side) & (side - u < wide)
    page = page_of(scene, scene.hair | spread)
    sight = Sight.of(page, load_rig(), scene.parameters, scene.vertices, scene.camera, head)
    assert gathered(sight, preset("bob")) == ()


def test_hair_that_leaves_the_page_does_not_end_there(hairy):
    scene = hairy("bob", 0)
    page = page_of(scene)
    top = np.flatnonzero(scene.hair.any(axis=1))[0] + 12
    hair = scene.hair[top:]
    camera = scene.camera.cropped(0, top, 300, 330, 300, 330 - top)
    strokes = Strokes(page.strokes.along[top:], page.strokes.coherence[top:])
    page = replace(page, box=Box(0, 0, 300, 330 - top), hair=hair, head=scene.head[top:],
                   beard=page.beard[top:], strokes=strokes)  # fmt: skip
    cut = fit_cut(page, load_rig(), scene.parameters, scene.vertices, camera)
    above = cut.thick[:, :4]
    assert above.min() > 0.002 and above.max() < 0.06


def cells_at(scene, azimuths, heights):
    """(k, 2) pixels of places on the skin of a scene's head, all azimuths in degrees with all
    heights."""
    page, rig = page_of(scene), load_rig()
    head = head_of(rig, scene.parameters.identity)
    sight = Sight.of(page, rig, scene.parameters, scene.vertices, scene.camera, head)
    azimuth, height = (np.ravel(of) for of in np.meshgrid(np.radians(azimuths), heights))
    far = head.levels(head.axis, azimuth, head.metres(height))
    x, z = np.sin(azimuth) * far + head.eyes[0], np.cos(azimuth) * far + head.middle[2]
    y = head.metres(height) + head.eyes[1]
    return np.round(sight.cells(np.stack([x, y, z], axis=-1))).astype(int)


@pytest.mark.parametrize("yaw", [0, 25])
@pytest.mark.parametrize("bare", [False, True])
def test_a_hairline_has_no_notch_that_a_stray_line_makes(hairy, yaw, bare):
    """Fifteen degrees wide, a third of a forehead high: hair that is none, or skin. What is wider
    and lower is a fringe, and stays."""
    scene = hairy("crop", yaw)
    heights = np.linspace(0.6, 0.85, 60) if bare else np.linspace(0.3, 0.6, 60)
    for wide, stays in (((-4, 11), False), *([] if bare else [((-24, 24), True)])):
        u, v = cells_at(scene, np.linspace(*wide, 80), heights).T
        hair = scene.hair.copy()
        hair[v, u] = not bare
        changed = np.abs(refitted(scene, hair).edge - refitted(scene).edge).max()
        assert changed > 0.15 if stays else changed < 0.08


def test_a_dark_cheek_is_no_lock(hairy):
    scene = hairy("crop", 0)
    u, v = cells_at(scene, np.linspace(48, 80, 60), np.linspace(-0.35, 0.3, 90)).T
    hair = scene.hair.copy()
    hair[v, u] = True
    cheek = (ANGLES > np.radians(45)) & (ANGLES < np.radians(66))
    lower = (preset("crop").edge - refitted(scene, hair).edge)[cheek]
    assert lower.max() < 0.15


def test_a_line_around_goes_where_most_speaks_for_it_but_not_to_and_fro():
    heights = np.linspace(1, -1, 41)
    score = -np.abs(heights - np.where(np.arange(24) < 12, 0.5, -0.5)[:, None]) / 0.05
    line = heights[steadiest(score, heights, np.zeros(24), 8.0)]
    assert np.allclose(line, np.where(np.arange(24) < 12, 0.5, -0.5))  # a step stays one
    score[5] = -np.abs(heights + 0.5) / 0.05
    assert np.allclose(heights[steadiest(score, heights, np.zeros(24), 15.0)], line)
    assert heights[steadiest(score, heights, np.zeros(24), 1.0)][5] < -0.4


@pytest.mark.parametrize("bun", [False, True])
def test_a_strand_beside_the_ear_makes_no_bob(hairy, bun):
    """Short and pinned-up hair lets one fall; as wide as a bob's side it is one."""
    scene = hairy("crop", 0)
    v, u = np.mgrid[: scene.hair.shape[0], : scene.hair.shape[1]]
    hair = scene.hair.copy()
    if bun:
        r, top = 0.13 * scene.unit, np.flatnonzero(hair.any(axis=1))[0]
        hair |= np.hypot(u - np.flatnonzero(hair.any(axis=0)).mean(), v - top + 0.6 * r) < r
    edge = np.flatnonzero(scene.head[cells_at(scene, [0], [0.0])[0, 1]])[-1]
    (_, eyes), (_, low) = cells_at(scene, [0], [0.1, -0.8])
    for wide, falls in ((0.018, False), (0.15, True)):
        side = (v > eyes) & (v < low) & (np.abs(u - edge) < wide * scene.unit)
        cut = refitted(scene, hair | side)
        assert cut.hangs == falls
        assert len(cut.balls) >= bun
        if not falls:
            assert cut.edge[[10, 11, 12, 13, -13, -12, -11, -10]].min() > -0.3  # at the ears


@pytest.mark.parametrize("lean", [0.0, 0.5])
def test_strokes_that_run_out_of_the_outline_stand(hairy, lean):
    """Lying hair runs along its outline; what leans to the picture's right is swept there."""
    scene = hairy("crop", 0)
    page = page_of(scene)
    v, u = np.mgrid[: scene.hair.shape[0], : scene.hair.shape[1]]
    middle = cells_at(scene, [0, 180], [0.31]).mean(axis=0)
    out = np.arctan2(v - middle[1], u - middle[0])
    cuts = {}
    for turned in (lean, np.pi / 2):
        along = np.stack([np.cos(out + turned), np.sin(out + turned)], axis=-1)
        drawn = replace(page, strokes=Strokes(along, 1.0 * scene.hair))
        cuts[turned] = fit_cut(
            drawn, load_rig(), scene.parameters, scene.vertices, scene.camera
        )  # fmt: skip
    assert cuts[np.pi / 2].stand == 0 and cuts[np.pi / 2].sweep is None
    assert cuts[lean].stand > 0.8
    assert abs(cuts[lean].sweep - lean) < 0.15
    fallen = hairy("bob", 0)
    assert refitted(fallen).stand == 0
