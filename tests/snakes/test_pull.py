"""Lines that settle on a drawing's, and the skin that follows."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from snakes import face_lines
from snakes.fit import skin_smoother
from snakes.lines import Lines
from snakes.parts import eyeballs, keep_lids_on_eyes, unfold
from snakes.pull import _stiffness, line_moves, pull_skin
from snakes.tweakables import Tweakables


def circle(radius, n=240):
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return Lines(
        radius * np.stack([np.cos(t), np.sin(t)], axis=1),
        np.stack([-np.sin(t), np.cos(t)], axis=1),
    )


def straight(n=60, slope=0.0, height=0.0):
    u = np.arange(float(n))
    points = np.column_stack([u, height + slope * u])
    along = np.tile(np.array([1.0, slope]) / np.hypot(1, slope), (n, 1))
    return Lines(points, along)


ONE = np.array([0, 60])


@pytest.mark.parametrize("starts", [[0, 9], [0, 4, 9], [0, 1, 3, 9]])
def test_the_bands_are_those_of_the_differences(starts):
    """α D1ᵀD1 + β D2ᵀD2, written out line by line."""
    alpha, beta = 0.7, 3.0
    wanted = np.zeros((9, 9))
    for a, b in zip(starts[:-1], starts[1:], strict=True):
        for order, weight in ((1, alpha), (2, beta)):
            if b - a > order:
                d = np.diff(np.eye(b - a), n=order, axis=0)
                wanted[a:b, a:b] += weight * d.T @ d
    bands = _stiffness(np.array(starts), alpha, beta)
    for k in range(3):
        np.testing.assert_allclose(bands[k, : 9 - k], np.diag(wanted, -k), atol=1e-12)
    assert np.linalg.eigvalsh(wanted).min() > -1e-12


def test_a_ring_settles_on_a_larger_one():
    moves, sure = line_moves(circle(100), np.array([0, 240]), circle(106), (12.0, 9.0))
    # across (-v, u) of the direction is inwards on this ring
    np.testing.assert_allclose(moves, -6.0, atol=0.3)
    assert sure.min() > 0.5


def test_a_line_turns_onto_a_slanting_one_and_its_ends_are_free():
    drawn = straight(slope=0.1, height=1.0)
    moves, sure = line_moves(straight(), ONE, drawn, (9.0, 9.0))
    np.testing.assert_allclose(moves, drawn.points[:, 1], atol=0.4)


def test_a_stiff_line_keeps_its_form_and_a_soft_one_follows():
    bent = straight()
    wave = Lines(bent.points + [[0, 1]] * np.sin(bent.points[:, :1] / 4), bent.along)
    soft, _ = line_moves(bent, ONE, wave, (6.0, 6.0), alpha=0.0, beta=0.01)
    stiff, _ = line_moves(bent, ONE, wave, (6.0, 6.0), alpha=0.0, beta=1e7)
    assert np.abs(soft - np.sin(bent.points[:, 0] / 4)).max() < 0.2
    assert np.abs(np.diff(stiff, n=2)).max() < 1e-3


def test_what_finds_no_line_follows_its_neighbours_and_is_not_sure():
    drawn = straight(height=3.0)
    half = Lines(drawn.points[:30], drawn.along[:30])
    moves, sure = line_moves(straight(), ONE, half, (8.0, 6.0))
    assert (sure[:28] > 0.3).all() and (sure[40:] == 0).all()
    np.testing.assert_allclose(moves[:28], 3.0, atol=0.2)
    np.testing.assert_allclose(moves[40:], 3.0, atol=0.5)


def test_lines_across_and_lines_far_away_are_no_lines_to_settle_on():
    across = Lines(straight().points[:, ::-1] + (30.0, -30.0), np.tile([0.0, 1.0], (60, 1)))
    for drawn in (across, straight(height=40.0), Lines(np.zeros((0, 2)), np.zeros((0, 2)))):
        moves, sure = line_moves(straight(), ONE, drawn, (6.0, 4.0))
        assert np.abs(moves).max() < 0.1 and sure.max() < 0.35


USUAL = Tweakables(soft_select_distance=1.2)
EACH_SIDE = Tweakables(soft_select_distance=1.2, symmetry=0.0)


@pytest.fixture(scope="module")
def scene_of_a_face():
    """(rig, parameters, camera, its lines, the same lines of a narrower and longer drawing)."""
    rig = load_rig()
    parameters = FaceParameters({"jaw_open": 1.0}, head=(0.2, 0.05, 0.0))
    posed = rig.pose(parameters)
    camera = Camera.framing(posed, 400, 400)
    model = face_lines(rig, posed, camera, kinds=("contour",), step=2.0)
    points = (model.lines.points - 200) * (0.985, 1.012) + 200
    return rig, parameters, camera, model, Lines(points, model.lines.along)


def test_the_skin_follows_and_no_vertex_goes_too_far(scene_of_a_face):
    rig, parameters, camera, model, drawn = scene_of_a_face
    offsets = pull_skin(drawn, model, rig, parameters, camera, 0.02, USUAL)
    after = face_lines(rig, rig.pose(parameters, offsets), camera, kinds=("contour",), step=2.0)
    before, _ = line_moves(model.lines, model.starts, drawn, (6.0, 4.0))
    left, _ = line_moves(after.lines, after.starts, drawn, (6.0, 4.0))
    assert np.abs(left).mean() < 0.6 * np.abs(before).mean()
    assert np.linalg.norm(offsets, axis=1).max() < 0.008
    bound = pull_skin(drawn, model, rig, parameters, camera, 0.0005, USUAL)
    assert np.linalg.norm(bound, axis=1).max() <= 0.0005 + 1e-9
    same = Lines(model.lines.points, model.lines.along)
    still = pull_skin(same, model, rig, parameters, camera, 0.02, USUAL)
    assert np.linalg.norm(still, axis=1).max() < 3e-4  # it lies there already


def test_movements_are_parallel_to_the_picture_but_for_lids_on_their_eyes(scene_of_a_face):
    rig, parameters, camera, model, drawn = scene_of_a_face
    offsets = pull_skin(drawn, model, rig, parameters, camera, 0.02, EACH_SIDE)
    moved = rig.pose(parameters, offsets) - rig.pose(parameters)
    shape = rig.shape(parameters)
    far = rig.parts["skin"] & (rig.weights[:, 0] == 1)  # what turns with the head alone
    for eye in eyeballs(rig):
        centre = shape[eye].mean(axis=0)
        far &= np.linalg.norm(shape - centre, axis=1) > 0.02
    assert np.abs(moved[far, 2]).max() < 2e-5 < np.abs(moved[far, :2]).max()


def test_the_sides_of_a_head_that_is_turned_are_moved_alike(scene_of_a_face):
    rig, parameters, camera, model, drawn = scene_of_a_face
    skin = rig.parts["skin"]

    def unlike(settings):
        offsets = pull_skin(drawn, model, rig, parameters, camera, 0.02, settings)
        apart = offsets - offsets[rig.mirror] * (-1, 1, 1)
        return np.linalg.norm(apart[skin], axis=1).mean()

    alone = unlike(EACH_SIDE)
    assert unlike(USUAL) < 0.5 * alone
    assert unlike(Tweakables(soft_select_distance=1.2, symmetry=1.0)) < 0.1 * alone


def test_no_triangle_turns_over(scene_of_a_face):
    rig, parameters, camera, model, drawn = scene_of_a_face
    offsets = pull_skin(drawn, model, rig, parameters, camera, 0.02, USUAL)
    skin = rig.triangles[rig.parts["skin"][rig.triangles].all(axis=1)]

    def normals(v):
        a, b, c = (v[skin[:, k]].astype(float) for k in range(3))
        return np.cross(b - a, c - a)

    before, after = (normals(rig.pose(parameters, o)) for o in (None, offsets))
    assert (np.einsum("ij,ij->i", before, after) > 0).all()


def test_lids_stay_on_eyeballs_that_move_as_a_whole(rng):
    rig = load_rig()
    shape = rig.neutral()
    offsets = np.tile([0.001, 0.002, 0.0], (len(shape), 1))
    slid = offsets.copy()
    skin = rig.parts["skin"]
    slid[skin] += [0.002, 0.0, 0.0]  # the lids, against the ball under them
    kept = keep_lids_on_eyes(rig, shape, slid)
    for eye in eyeballs(rig):
        middle = (shape[eye].min(axis=0) + shape[eye].max(axis=0)) / 2
        radius = np.linalg.norm(shape[eye] - middle, axis=1).max()
        lids = skin & (np.linalg.norm(shape - middle, axis=1) < 1.12 * radius)
        was = np.linalg.norm(shape[lids] - middle, axis=1)
        now = np.linalg.norm(shape[lids] + kept[lids] - middle - [0.001, 0.002, 0], axis=1)
        np.testing.assert_allclose(now, was, atol=1e-9)
        off = np.linalg.norm(shape[lids] + slid[lids] - middle - [0.001, 0.002, 0], axis=1) - was
        assert off.min() < -5e-4  # without it they would have gone through
    whole = keep_lids_on_eyes(rig, shape, offsets)
    np.testing.assert_allclose(whole, offsets, atol=1e-7)


def test_folds_are_averaged_away_and_all_else_stays(rng):
    rig = load_rig()
    shape = rig.neutral()
    skin = np.flatnonzero(rig.parts["skin"])
    smoother = skin_smoother(rig)
    even = np.tile([0.002, 0.001, 0.0], (len(shape), 1))
    np.testing.assert_array_equal(unfold(rig, smoother, shape, even), even)
    torn = even.copy()
    nose = rig.landmarks[LANDMARKS.index("nose_tip")]
    near = skin[np.linalg.norm(shape[skin] - shape[nose], axis=1) < 0.01]
    torn[near] += rng.normal(0, 2e-3, (len(near), 3))
    mended = unfold(rig, smoother, shape, torn)
    triangles = rig.triangles[rig.parts["skin"][rig.triangles].all(axis=1)]

    def normals(v):
        a, b, c = (v[triangles[:, k]].astype(float) for k in range(3))
        return np.cross(b - a, c - a)

    before = normals(shape)
    for offsets, whole in ((torn, False), (mended, True)):
        upright = np.einsum("ij,ij->i", before, normals(shape + offsets)) > 0
        assert upright.all() == whole
    far = np.linalg.norm(shape - shape[nose], axis=1) > 0.03
    np.testing.assert_array_equal(mended[far], even[far])
    assert np.abs(mended).max() > 1e-3


def test_a_pinned_landmark_goes_to_its_pin_and_its_surroundings_follow(scene_of_a_face):
    rig, parameters, camera, model, drawn = scene_of_a_face
    name = "mouth_corner_left"
    at = rig.landmarks[LANDMARKS.index(name)]
    here = camera.project(rig.pose(parameters)[at][None])[0]
    pin = {name: (here[0] + 6, here[1] - 4)}
    offsets = pull_skin(model.lines, model, rig, parameters, camera, 0.03, USUAL, pins=pin)
    moved = camera.project(rig.pose(parameters, offsets)[at][None])[0]
    np.testing.assert_allclose(moved, pin[name], atol=0.6)
    nose = rig.landmarks[LANDMARKS.index("nose_root")]
    assert np.linalg.norm(offsets[nose]) < 5e-4
    alone = pull_skin(NOTHING, model, rig, parameters, camera, 0.03, USUAL, pins=pin)
    moved = camera.project(rig.pose(parameters, alone)[at][None])[0]
    np.testing.assert_allclose(moved, pin[name], atol=0.6)


NOTHING = Lines(np.zeros((0, 2)), np.zeros((0, 2)))
