"""The bust is closed, its cut even; ears have a canal."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig import FaceParameters, load_rig
from facs_rig.baking.bust import cut_ring, foot, levelled
from facs_rig.baking.ears import sculpted_ears
from facs_rig.mesh import triangle_normals

PEOPLE = (
    {},
    {"gender": 1.0, "weight": 1.0, "neck_girth": 1.0},
    {"gender": 0.0, "weight": -1.0, "neck_length": 1.0},
    {"age": 1.0, "african": 1.0, "asian": 0.0, "caucasian": 0.0},
)
TURNED = {"head": (0.4, 0.2, 0.1), "neck": (0.3, 0.2, -0.3)}


@pytest.fixture(scope="module")
def rig():
    return load_rig()


@pytest.fixture(scope="module")
def rims(rig):
    """The edges (e, 2) of the skin's neck and of the bust."""
    out = []
    for name in ("skin", "bust"):
        own = rig.triangles[rig.parts[name][rig.triangles[:, 0]]]
        ends = np.concatenate([own[:, [k, (k + 1) % 3]] for k in range(3)])
        there = {tuple(e) for e in ends.tolist()}
        edge = np.array([e for e in there if e[::-1] not in there])
        out.append(edge[(rig.neutral()[edge, 1] < -0.07).all(axis=1)])
    return out


@pytest.mark.parametrize("who", PEOPLE)
@pytest.mark.parametrize("pose", [{}, TURNED], ids=["upright", "turned"])
def test_the_bust_closes_the_neck_however_it_turns(rig, rims, who, pose):
    skin, bust = rims
    assert len(skin) > 40 and abs(len(skin) - len(bust)) < 5
    points = rig.pose(FaceParameters(identity=who, **pose))
    shares = np.linspace(0, 1, 60)[:, None, None]
    one, other = (
        ((1 - shares) * points[e[:, 0]] + shares * points[e[:, 1]]).reshape(-1, 3)
        for e in (skin, bust)
    )
    assert cKDTree(one).query(other)[0].max() < 3e-4
    assert cKDTree(other).query(one)[0].max() < 3e-4


@pytest.mark.parametrize("who", PEOPLE)
def test_the_cut_is_even(rig, rims, who):
    """Near a plane, without corners, and seen from below alone."""
    bust = np.unique(rims[1])
    points = rig.neutral(who).astype(float)
    rim = points[bust]
    table = np.column_stack([np.ones(len(rim)), rim[:, [0, 2]]])
    plane, *_ = np.linalg.lstsq(table, rim[:, 1], rcond=None)
    off = np.abs(table @ plane - rim[:, 1])
    assert off.max() < (0.001 if not who else 0.011)  # 11 mm over a neck of 120
    widest = np.ptp(rim[:, 0])
    neck = rig.parts["skin"] & (np.abs(points[:, 1] - rim[:, 1].mean() - 0.025) < 0.004)
    assert widest < 1.3 * np.ptp(points[neck, 0])  # no flare toward shoulders
    own = rig.triangles[rig.parts["bust"][rig.triangles[:, 0]]]
    normals = triangle_normals(points, own)
    assert normals[:, 1].sum() < 0
    assert (normals[:, 1] < 0).mean() > 0.9


def test_drawings_do_not_know_of_the_cut(rig):
    from facs_rig.anatomy import HAIR_PARTS, UNDRAWN_PARTS
    from facs_rig.coarse import coarse_rig

    assert set(UNDRAWN_PARTS) == {*HAIR_PARTS, "bust"}
    assert not coarse_rig(rig).parts["bust"].any()
    drawn = {int(v) for index, _ in rig.strokes.values() for v in index.ravel()}
    assert not drawn & set(np.flatnonzero(rig.parts["bust"]).tolist())


def test_a_tube_is_closed():
    """A prism of 12 sides: the foot is quads, turned outward, on its lower edge."""
    turn = np.arange(12) * np.pi / 6
    ring = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    cage = np.concatenate([0.05 * ring, 0.05 * ring + (0, 0.02, 0), 0.05 * ring + (0, 0.04, 0)])
    cage[np.abs(cage) < 1e-12] = 0
    k, after = np.arange(12), (np.arange(12) + 1) % 12
    quads = np.concatenate(
        [np.stack([k, after, after + 12, k + 12], axis=1) + row for row in (0, 12)]
    )
    matrix, found, uv = foot(cage, quads)
    points = np.concatenate([cage, matrix @ cage])
    assert found.min() == len(cage) and found.max() == len(points) - 1
    assert uv.shape == (len(found), 4, 2)
    ends = np.stack([found, np.roll(found, -1, axis=1)], axis=2).reshape(-1, 2)
    there = {tuple(e) for e in ends.tolist()}
    assert len(there) == len(ends)
    assert sum(e[::-1] not in there for e in there) == 12  # open at its rim alone
    corner = points[found]
    normals = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    assert (normals[:, 1] < 0).all()
    flat = uv - uv[:, :1]
    area = np.cross(flat[:, 2], flat[:, 3] - flat[:, 1])
    assert (area > 0).all() or (area < 0).all()
    np.testing.assert_allclose(np.asarray(matrix.sum(axis=1)), 1)
    np.testing.assert_allclose(levelled(cage, cut_ring(cage, quads)), 0, atol=1e-12)


def test_a_crooked_cut_is_levelled_and_what_is_above_stays():
    turn = np.arange(16) * np.pi / 8
    ring = np.stack([0.045 * np.sin(turn), 0.004 * np.cos(2 * turn), 0.04 * np.cos(turn)], axis=1)
    points = np.concatenate([ring, ring + (0, 0.1, 0)])
    moved = points + levelled(points, np.arange(16))
    assert np.ptp(moved[:16, 1]) < 1e-9 < 0.007 < np.ptp(points[:16, 1])
    np.testing.assert_array_equal(moved[16:], points[16:])


def test_ears_alone_are_sculpted_and_both_alike():
    places = np.array([(0.07, 0.0124, 0.0054), (-0.07, 0.0124, 0.0054), (0.05, 0.0124, 0.0054),
                       (0.0, 0.02, 0.09), (0.07, 0.08, 0.0)])  # fmt: skip
    moves = sculpted_ears(places)
    assert moves[0, 0] < -0.002  # the canal goes in
    np.testing.assert_allclose(moves[1], moves[0] * (-1, 1, 1))
    assert np.abs(moves[2:]).max() < 1e-5
