"""Strands: they grow from the scalp, lie in the cut and keep its outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig.common.errors import InputError
from facs_rig.hair.head import head_of
from facs_rig.hair.mesh import hair_mesh
from facs_rig.hair.presets import PRESETS, preset
from facs_rig.hair.shell import shell
from facs_rig.hair.strands import FEWEST, MOST, RADIUS, grow

WHO = {"gender": 0.2, "head_width": 0.3}
SAME = 1e-6  # metres


def grown(rig, name, detail=0.5, who=WHO, seed=0):
    cut = preset(name)
    return grow(rig, who, cut, shell(rig, who, cut), np.random.default_rng(seed), detail)


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_roots_lie_on_the_skin_where_their_places_are(rig, name):
    """Each root is where the skin has its place on the texture."""
    made = grown(rig, name)
    corners, places = rig.triangles, rig.texture.corners[rig.triangle_corners]
    near = cKDTree(rig.neutral(WHO)[corners].mean(axis=1)).query(made.points[:, 0], 24)[1]
    uv, skin = rig.texture.points[places[near]], rig.neutral(WHO)[corners[near]]
    one, two = uv[:, :, 1] - uv[:, :, 0], uv[:, :, 2] - uv[:, :, 0]
    along = made.uv[:, None] - uv[:, :, 0]
    area = np.cross(one, two)
    s, t = np.cross(along, two) / area, np.cross(one, along) / area
    weight = np.stack([1 - s - t, s, t], axis=-1)
    best = weight.min(axis=-1).argmax(axis=1)
    row = np.arange(len(best))
    assert weight.min(axis=-1)[row, best].min() > -0.2  # a coarser triangle's place is a little off
    at = np.einsum("nk,nkd->nd", weight[row, best], skin[row, best])
    assert np.linalg.norm(at - made.points[:, 0], axis=1).max() < 1.5e-3


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_strands_lie_where_locks_lie(rig, name):
    """Their outline is the locks' from the front and from the side."""
    made = grown(rig, name).points.reshape(-1, 3)
    locks = hair_mesh(rig, WHO, preset(name)).points
    away = locks - head_of(rig, WHO).middle
    far = np.linalg.norm(away, axis=1)
    # Around a bald crown what has no hair is under the skin.
    skull = head_of(rig, WHO).rays(head_of(rig, WHO).skull, away / far[:, None])
    locks = locks[(far > skull) | (locks[:, 1] < 0)]
    bare = preset(name).balls and preset(name).balls[0].plait  # a braid has no strands
    for axis in (0, 2):
        for of in (np.min, np.max):
            # Around a bald crown the surface goes on in front, under the skin.
            if axis == 2 and of is np.max and preset(name).top is not None:
                continue
            if axis == 0 or not bare:
                assert abs(of(made[:, axis]) - of(locks[:, axis])) < 0.02
    assert abs(made[:, 1].max() - locks[:, 1].max()) < 0.012
    if not bare:
        assert abs(made[:, 1].min() - locks[:, 1].min()) < 0.03


@pytest.mark.parametrize("name", ["crop", "bob", "long_wavy", "fringe"])
def test_strands_stay_out_of_the_head(rig, name):
    points = grown(rig, name).points[:, 2:].reshape(-1, 3).astype(float)
    head = head_of(rig, WHO)
    away = points - head.middle
    far = np.linalg.norm(away, axis=1)
    above = away[:, 1] > 0
    under = head.rays(head.skull, away / far[:, None])[above] - far[above]
    assert under.max() < 2e-3 and (under > 1e-3).mean() < 0.01


def test_they_thin_out_to_their_tips(rig):
    made = grown(rig, "bob")
    assert (np.diff(made.radius, axis=1) < 0).all()
    assert made.radius.max() < 2 * RADIUS[0] and made.radius.min() > 0
    assert np.abs(made.tone).max() <= 1


def test_more_detail_is_more_strands_of_more_points(rig):
    few, many = grown(rig, "crop", 0.0), grown(rig, "crop", 1.0)
    assert 0.9 * FEWEST < len(few.points) <= FEWEST
    assert 0.9 * MOST < len(many.points) <= MOST
    assert few.points.shape[1] == 6 and many.points.shape[1] == 12
    assert few.radius.mean() > 1.5 * many.radius.mean()


def test_the_same_seed_grows_the_same(rig):
    one, other = grown(rig, "curls", seed=3), grown(rig, "curls", seed=3)
    assert np.array_equal(one.points, other.points) and np.array_equal(one.tone, other.tone)


def test_a_bald_crown_grows_nothing(rig):
    roots = grown(rig, "bald_rim").points[:, 0]
    head = head_of(rig, WHO)
    front = (roots[:, 2] > head.middle[2] + 0.045) & (np.abs(roots[:, 0]) < 0.04)
    assert len(roots) and not front.any()


def test_a_detail_out_of_range_is_said_so(rig):
    with pytest.raises(InputError, match="the detail of hair must be from 0 to 1"):
        grown(rig, "bob", 1.5)


def test_hair_of_strands_lies_under_them(rig):
    """The surface below is inside that of the same cut."""
    thin, whole = (hair_mesh(rig, WHO, preset("bob"), kind) for kind in ("curves", "surface"))
    assert thin.strands is not None and whole.strands is None
    assert np.ptp(thin.points[:, 0]) < np.ptp(whole.points[:, 0]) - 0.003
    assert len(thin.points) == len(whole.points)


def test_strands_stand_as_locks_do(rig):
    cut = replace(preset("crop"), stand=1.0)
    lying, standing = (
        grow(rig, WHO, of, shell(rig, WHO, of), np.random.default_rng(0)).points[:, -1]
        for of in (preset("crop"), cut)
    )
    middle = head_of(rig, WHO).middle
    lying, standing = (np.linalg.norm(tips - middle, axis=1) for tips in (lying, standing))
    assert 0.004 < np.median(standing) - np.median(lying) < 0.03
