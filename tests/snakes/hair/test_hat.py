"""Hats on a page: found to their lines, told from hair, and made again from what is seen."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy import ndimage

from facs_rig import Camera, FaceParameters, load_rig, rasterise
from facs_rig.hair.cut import ANGLES
from facs_rig.hair.hat import Hat, hat_mesh
from facs_rig.hair.presets import preset
from snakes.hair.hat_fit import fit_hat
from snakes.hair.hat_region import page_hat, with_hat, without_hat
from snakes.hair.region import ROWS, page_hair
from snakes.hair.texture import strokes_in

from .conftest import Scene, outline, overlap, seen

RIM = 0.32 + 0.12 * np.cos(ANGLES)
NONE, PEAK = np.zeros(48), 0.07 * np.sqrt(np.clip(np.cos(ANGLES), 0, 1))
HATS = {
    "cap": Hat(RIM, np.full((48, 8), 0.02), PEAK, 0.3),
    "beanie": Hat(RIM - 0.1, 0.015 + 0.03 * np.linspace(1, 0, 8) + np.zeros((48, 1)), NONE),
    "brim": Hat(RIM, np.full((48, 8), 0.025), np.full(48, 0.07), 0.1),
    "tall": Hat(RIM, 0.02 + 0.1 * np.linspace(1, 0, 8) + np.zeros((48, 1)), NONE),
}

# What a view from in front says about the one from the side at least, as overlap.
SIDE = {"cap": 0.7, "beanie": 0.9, "brim": 0.83, "tall": 0.9}


def worn(hat, parameters, camera, vertices):
    """(h, w) bool where a hat is seen on a posed face."""
    rig = load_rig()
    made = hat_mesh(rig, parameters.identity, hat)
    every = np.concatenate([vertices, made.on(vertices)])
    triangles = np.concatenate([rig.triangles, made.triangles + len(vertices)])
    return rasterise(every, triangles, camera).triangle >= len(rig.triangles)


@lru_cache
def hatted(name: str, yaw: float = 0.0) -> Scene:
    rig = load_rig()
    parameters = FaceParameters(identity={"gender": 0.6}, head=(float(np.radians(yaw)), 0.05, 0.0))
    vertices = rig.pose(parameters)
    whole = np.concatenate(
        [vertices, hat_mesh(rig, parameters.identity, HATS["tall"]).on(vertices)]
    )
    camera = Camera.framing(whole, 300, 340, 0.2)
    head = rasterise(vertices, rig.triangles, camera).triangle >= 0
    return Scene(parameters, vertices, camera, worn(HATS[name], parameters, camera, vertices), head)


def found(scene: Scene, sure: float = 0.9):
    """The hat on the scene's page; sure : how the network sees it."""
    soft = ndimage.gaussian_filter(scene.hair.astype(float), 3.0)

    def at(region, points):
        rows = np.clip(points[:, ::-1].T - 0.5, 0, np.array(soft.shape)[:, None] - 1)
        share = ndimage.map_coordinates(soft, rows, order=1)
        return share * {"hair": 0.95, "hat": sure}.get(region, 0.0) + 0.01

    return page_hat(scene.drawn("outline"), at, load_rig(), scene.vertices, scene.camera), at


@pytest.mark.parametrize("yaw", [0.0, 30.0])
@pytest.mark.parametrize("name", HATS)
def test_a_hat_is_found_and_made_again(name, yaw):
    scene = hatted(name, yaw)
    page, _ = found(scene)
    rows, columns = np.indices(scene.hair.shape)
    at = np.round(page.cells(np.stack([columns, rows], axis=-1) + 0.5)).astype(int)
    inside = ((at >= 0) & (at < page.hair.shape[::-1])).all(axis=-1)
    at = np.clip(at, 0, np.array(page.hair.shape[::-1]) - 1)
    assert overlap(page.hair[at[..., 1], at[..., 0]] & inside, scene.hair) > 0.8
    hat = fit_hat(page, load_rig(), scene.parameters, scene.vertices, scene.camera)
    ours = worn(hat, scene.parameters, scene.camera, scene.vertices)
    assert overlap(ours, scene.hair) > 0.8
    assert hat.cloth is None and (hat.brim.max() > 0.03) == (HATS[name].brim.max() > 0)


@pytest.mark.parametrize("name", HATS)
def test_a_hat_looks_the_same_kind_of_hat_from_the_side(name):
    scene = hatted(name)
    page, _ = found(scene)
    hat = fit_hat(page, load_rig(), scene.parameters, scene.vertices, scene.camera)
    aside = replace(scene.parameters, head=(float(np.radians(80)), 0.0, 0.0))
    vertices = load_rig().pose(aside)
    true, ours = (worn(of, aside, scene.camera, vertices) for of in (HATS[name], hat))
    assert overlap(ours, true) > SIDE[name]


def test_a_peak_that_is_seen_aside_points_to_the_front():
    scene = hatted("cap", 35.0)
    page, _ = found(scene)
    hat = fit_hat(page, load_rig(), scene.parameters, scene.vertices, scene.camera)
    assert hat.peaked
    front = np.arctan2(*(hat.brim @ np.stack([np.sin(ANGLES), np.cos(ANGLES)], axis=1)))
    assert abs(front) < np.radians(20)
    assert (hat.brim[np.cos(ANGLES) < 0] == 0).all()


def lined(name: str, crescent: bool):
    """The hat of a page on which a line runs across one in front, and the page."""
    scene = hatted(name)
    page, _ = found(scene)
    row, column = np.indices(page.hair.shape)
    border = len(page.hair) - 1 - page.hair[::-1].argmax(axis=0)
    seen = np.flatnonzero(page.hair.any(axis=0))
    middle, half = seen.mean(), np.ptp(seen) / 2
    share = 1 - ((column - middle) / half) ** 2 if crescent else 1.0
    off = np.abs(border - row - 20 * share)
    ink = np.maximum(page.ink, np.clip(1.5 - off, 0, 1) * page.hair)
    page = replace(page, ink=ink, strokes=strokes_in(ink, page.hair, ROWS))
    return fit_hat(page, load_rig(), scene.parameters, scene.vertices, scene.camera)


def test_a_level_line_is_a_fold_and_a_crescent_a_peak():
    scene = hatted("beanie")
    bare = fit_hat(found(scene)[0], load_rig(), scene.parameters, scene.vertices, scene.camera)
    fold, cap = lined("beanie", False), lined("beanie", True)
    assert not bare.peaked and 0 < bare.band < 0.02 and bare.cuff < 0.002
    assert not fold.peaked and 0.03 < fold.band < 0.06 and fold.cuff > 0.002
    assert cap.peaked and cap.brim.argmax() in (0, 1, 47)


def test_a_rim_leans_no_farther_than_hats_do():
    scene = hatted("beanie")
    page, _ = found(scene)
    row, column = np.indices(page.hair.shape)
    rows, columns = np.nonzero(page.hair)
    low = rows.max() - 0.8 * (columns.max() - column)
    cut = replace(page, hair=page.hair & (row < low))
    hat = fit_hat(cut, load_rig(), scene.parameters, scene.vertices, scene.camera)
    assert abs(hat.edge @ np.sin(ANGLES)) / 24 < 0.16
    assert hat.edge @ np.cos(ANGLES) >= -1e-9


def test_a_face_with_hair_wears_no_hat():
    assert found(hatted("beanie"), sure=0.1)[0] is None


def test_what_hangs_is_made_as_cloth():
    scene = hatted("beanie")
    cut = replace(preset("bob"), part=None)
    hood, _ = seen(cut, scene.parameters, scene.camera, scene.vertices)
    page, _ = found(replace(scene, hair=hood))
    hat = fit_hat(page, load_rig(), scene.parameters, scene.vertices, scene.camera)
    assert hat.cloth is not None and not hat.cloth.balls and hat.cloth.curl == 0


def test_hair_beside_a_hat_stays_hair_and_the_hat_is_none():
    scene = hatted("beanie")
    hair, _ = seen(preset("long_straight"), scene.parameters, scene.camera, scene.vertices)
    both = replace(scene, hair=hair | scene.hair)
    worn_page, _ = found(scene)
    _, at = found(both)
    drawing = both.drawn("outline") * (1 - outline(scene.hair, 2))
    page = page_hair(drawing, at, load_rig(), scene.vertices, scene.camera)
    left = without_hat(page, worn_page, drawing)
    assert 0.1 < left.hair.sum() / page.hair.sum() < 0.9
    row = np.flatnonzero(left.hair.any(axis=1))[0]
    assert page.pixels(np.array([0, row]))[1] > np.flatnonzero(scene.hair.any(axis=1))[0] + 10
    assert overlap(with_hat(left, worn_page).hair, page.hair) > 0.85


def test_nothing_is_made_of_a_hat_that_is_not_on_the_head():
    scene = hatted("beanie")
    page, _ = found(scene)
    away = np.zeros_like(page.hair)
    away[:6, :6] = True
    made = fit_hat(
        replace(page, hair=away), load_rig(), scene.parameters, scene.vertices, scene.camera
    )
    assert made is None
