"""Locks are ribbons on the shell: so many, so wide, the way that the hair goes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig import FaceParameters, load_rig
from facs_rig.common.errors import InputError
from facs_rig.hair.follow import bind
from facs_rig.hair.head import head_of
from facs_rig.hair.locks import FEWEST, MOST, hair, locks
from facs_rig.hair.presets import PRESETS, preset
from facs_rig.hair.shell import edge_heights, shell
from facs_rig.rotation import rotation

MM = 1e-3


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def seeded():
    return np.random.default_rng(7)


@pytest.mark.parametrize("name", PRESETS)
def test_detail_says_how_many_triangles(rig, name):
    counts = []
    for detail in (0.0, 0.3, 1.0):
        made, on = hair(rig, {}, preset(name), seeded(), detail)
        counts.append(len(made.triangles) + len(on.triangles))
        want = FEWEST + detail * (MOST - FEWEST)
        assert 0.93 * want < counts[-1] <= want
        assert on.uv.min() >= 0
        assert on.uv.max() <= 1
        assert np.abs(on.tone).max() <= 1
        assert len(on.tone) == len(on.uv) == len(on.points) == on.quads.max() + 1
    assert counts == sorted(counts)


def test_a_detail_that_cannot_be(rig):
    with pytest.raises(InputError, match="from 0 to 1, got 1.2"):
        hair(rig, {}, preset("crop"), seeded(), 1.2)


def test_the_same_generator_makes_the_same_locks(rig):
    made = shell(rig, {}, preset("curls"))
    one, same = (locks(made, preset("curls"), seeded(), 4000) for _ in range(2))
    assert np.array_equal(one.points, same.points)
    other = locks(made, preset("curls"), np.random.default_rng(8), 4000)
    assert not np.array_equal(one.points, other.points)


def test_locks_lie_on_the_shell_and_their_tips_taper(rig):
    cut = preset("crop")
    made = shell(rig, {}, cut, 144, 60)
    on = locks(made, cut, seeded(), 6000)
    away = cKDTree(made.points[made.outer].reshape(-1, 3)).query(on.points)[0]
    assert np.percentile(away, 99) < 6 * MM
    width = np.linalg.norm(on.points[2::3] - on.points[::3], axis=1)
    v = on.uv[::3, 1]
    middle = np.median(width[np.abs(v - 0.5) < 0.1])
    assert 5 * MM < middle < 14 * MM
    assert width[v == 1].max() < 0.15 * middle
    wide = locks(made, cut, seeded(), 6000, width=0.02)
    assert np.allclose(
        np.linalg.norm(wide.points[2::3] - wide.points[::3], axis=1), 2 * width, atol=0.1 * MM
    )


def test_locks_run_from_the_parting_to_the_edge(rig):
    """With a field down the columns; with one across them, around the head."""
    cut = preset("bob")
    made = shell(rig, {}, cut)
    length = {}
    for name, way in (("down", (0.0, 1.0)), ("across", (1.0, 0.0))):
        field = np.broadcast_to(way, (*made.outer.shape, 2))
        on = locks(made, cut, seeded(), 4000, field=field)
        ends = on.points[1::3][on.uv[1::3, 1] == 1] - on.points[1::3][on.uv[1::3, 1] == 0]
        length[name] = np.abs(ends).mean(axis=0)
    assert length["down"][1] > 3 * length["across"][1]
    longer = locks(made, cut, seeded(), 4000, field=np.broadcast_to((3.0, 0), field.shape))
    assert np.allclose(longer.points, on.points, atol=1e-6)


def roots_and_tips(made, cut):
    on = locks(made, cut, seeded(), 8000)
    middle, along = on.points[1::3], on.uv[1::3, 1]
    return middle[along == 0], middle[along == 1]


def from_the_front(points, head):
    return np.degrees(np.abs(np.arctan2(points[:, 0], points[:, 2] - head.middle[2])))


def test_hair_grows_up_from_a_hairline_and_down_to_a_fringe(rig):
    head = head_of(rig, {})
    for name, up in (("crop", True), ("fringe", False)):
        cut = preset(name)
        root, tip = roots_and_tips(shell(rig, {}, cut), cut)
        front = from_the_front(root, head) < 40
        assert (tip[front, 1] > root[front, 1]).mean() > 0.9 if up else (
            tip[front, 1] < root[front, 1]).mean() > 0.9  # fmt: skip


def test_hair_that_stands_has_its_tips_out_of_the_surface_most_on_top(rig):
    away = {}
    for stand in (0.0, 0.5, 1.0):
        cut = replace(preset("crop"), stand=stand)
        made, on = hair(rig, {}, cut, seeded())
        outer = made.points[made.outer].reshape(-1, 3)
        tips = on.points[on.uv[:, 1] == 1]
        far = cKDTree(outer).query(tips)[0]
        top = tips[:, 1] > head_of(rig, {}).middle[1] + 0.06
        away[stand] = np.median(far[top]), np.median(far[~top])
    assert away[0.0][0] < 3 * MM < away[0.5][0] < away[1.0][0] < 30 * MM
    assert away[1.0][1] < away[1.0][0]


@pytest.mark.parametrize("sweep", [-0.8, 0.0, 0.8])
def test_hair_is_swept_from_a_low_hairline(rig, sweep):
    """Back, and to the side that is said."""
    cut = replace(preset("crop"), edge=preset("crop").edge - 0.15, sweep=sweep)
    root, tip = roots_and_tips(shell(rig, {}, cut), cut)
    front = (from_the_front(root, head_of(rig, {})) < 30) & (root[:, 1] > tip[:, 1] - 0.3)
    way = (tip - root)[front]
    assert (way[:, 2] < 0).mean() > 0.8
    assert abs(np.median(way[:, 0])) < 0.01 if not sweep else (way[:, 0] * sweep > 0).mean() > 0.8


def test_hair_runs_along_a_steep_edge(rig):
    """Its locks end farther down there than those that follow the columns over it."""
    cut = preset("long_straight")
    made = shell(rig, {}, cut)
    end = made.points[made.outer[:, -1]]
    fall = (end[:-1, 1] - end[1:, 1]) / np.linalg.norm(end[:-1] - end[1:], axis=1)
    from_, to = (cKDTree(end[1:][steep]) for steep in (np.abs(fall) > 0.8, np.abs(fall) < 0.3))
    field = np.broadcast_to((0.0, 1.0), (*made.outer.shape, 2))
    over = []
    for way in (None, field):
        on = locks(made, cut, seeded(), 8000, field=way)
        tip = on.points[1::3][on.uv[1::3, 1] == 1]
        over.append(((from_.query(tip)[0] < 0.012) & (to.query(tip)[0] > 0.02)).sum())
    assert over[0] < 0.7 * over[1]


@pytest.mark.parametrize("detail", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("name", ["bob", "long_straight", "fringe"])
def test_hair_that_hangs_ends_in_points_that_nearly_meet_a_line(rig, name, detail):
    """Over a surface that ends above them all around."""
    cut, head = preset(name), head_of(rig, {})
    made, on = hair(rig, {}, cut, seeded(), detail)
    behind = np.radians(np.arange(-60, 61, 4)) + np.pi
    edge = head.metres(edge_heights(cut, behind)) + head.eyes[1]

    def lowest(points):
        around = np.arctan2(points[:, 0], points[:, 2] - head.middle[2]) % (2 * np.pi)
        near = np.abs(around[:, None] - behind) < np.radians(3)
        return np.where(near, points[:, 1:2], np.inf).min(axis=0)

    tips, surface = (lowest(p) for p in (on.points, made.points[made.outer].reshape(-1, 3)))
    assert (tips < surface - 1 * MM).mean() > 0.9
    assert (tips < surface + 2 * MM).all()
    assert np.abs(tips - edge).max() < 15 * MM
    assert np.abs(np.median(tips - edge)) < 5 * MM


def test_a_lock_that_comes_to_the_edge_ends_in_a_point_there(rig):
    """None is cut off as wide as it is."""
    cut = preset("bob")
    on = locks(shell(rig, {}, cut), cut, seeded(), 6000)
    step = np.linalg.norm(np.diff(on.points[1::3].reshape(-1, 10, 3), axis=1), axis=-1)
    assert (step.max(axis=1) < 3 * step.min(axis=1) + 1 * MM).mean() > 0.95


def test_a_field_of_another_shape(rig):
    cut = preset("bob")
    with pytest.raises(InputError, match=r"72 x 20 x 2 numbers, got \(3, 2\)"):
        locks(shell(rig, {}, cut), cut, seeded(), field=np.zeros((3, 2)))


def test_hair_turns_with_the_head_and_no_expression_moves_it(rig):
    made, on = hair(rig, {"age": 0.4}, preset("ponytail"), seeded(), 0.2)
    points = np.concatenate([made.points, on.points])
    bound = bind(points, rig, {"age": 0.4})
    face = FaceParameters({"frontalis": 8, "jaw_open": 6, "smile": 5}, {"age": 0.4})
    assert np.abs(bound.points(rig.pose(face)) - points).max() < 0.3 * MM
    turned = FaceParameters({}, {"age": 0.4}, head=(0.5, 0.2, -0.1))
    want = points @ rotation((0.5, 0.2, -0.1)).T
    assert np.abs(bound.points(rig.pose(turned)) - want).max() < 0.6 * MM


def test_hair_comes_along_to_another_person(rig):
    """Near to where that person's own would be."""
    cut = preset("crop")
    made = shell(rig, {}, cut)
    bound = bind(made.points, rig)
    for identity in ({"age": -1.0}, {"gender": 1.0, "weight": 1.0}, {"head_width": 1.0}):
        own = shell(rig, identity, cut).points
        moved = np.linalg.norm(bound.points(rig.neutral(identity)) - own, axis=1)
        assert moved.mean() < 6 * MM
