"""Lines carved into the skin, on a sphere with known answers and on the face."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from facs_rig import Camera, FaceParameters, landmark_points, load_rig
from facs_rig.mesh import triangle_normals, vertex_normals
from snakes import engrave
from snakes.engraving import EYE_REACH, PROFILES, WIDEN
from snakes.mapping import pixels_to_skin

MM = 1e-3
REST = FaceParameters()
TURNED = FaceParameters({"smile": 3.0}, {}, (0.6, 0.1, 0.1))


@pytest.fixture(scope="module")
def fine(scene):
    """A sphere with edges of 1.3 mm."""
    return scene.Ball(rings=240)


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def carved(rig, parameters, camera, lines, *arguments):
    return engrave(rig, parameters, np.zeros((rig.n_vertices, 3)), camera, lines, *arguments)


def framed(rig, parameters, distance=np.inf):
    return Camera.framing(rig.pose(parameters), 600, 600, 0.05, distance)


def heights(rig, parameters, offsets):
    """(n,) metres that the posed vertices moved along their normals."""
    posed = rig.pose(parameters)
    moved = rig.pose(parameters, offsets) - posed
    return np.einsum("ij,ij->i", moved, vertex_normals(posed, rig.triangles))


def skin_under(rig, parameters, camera, line):
    """(k, 3) the places on the skin under the pixels of a line, without what is not skin."""
    at = np.linspace(0, len(line) - 1, 400)
    pixels = np.column_stack([np.interp(at, np.arange(len(line)), column) for column in line.T])
    posed = rig.pose(parameters)
    seen, corners, weights = pixels_to_skin(pixels, rig, posed, camera)
    return np.einsum("kc,kcd->kd", weights, posed[corners])[seen]


def depth_under(rig, parameters, camera, line, offsets):
    """(k,) metres that the skin rose under evenly spaced points of a line."""
    at = np.linspace(0, len(line) - 1, 200)
    pixels = np.column_stack([np.interp(at, np.arange(len(line)), column) for column in line.T])
    _, corners, weights = pixels_to_skin(pixels, rig, rig.pose(parameters), camera)
    return np.einsum("kc,kc->k", weights, heights(rig, parameters, offsets)[corners])


def forehead(rig, parameters, camera):
    """A level line (2, 2) over the forehead, in pixels."""
    place = landmark_points(rig, rig.pose(parameters))["forehead"]
    u, v = camera.project(place)
    reach = 0.025 * camera.scale[0]
    return np.array([[u - reach, v + reach / 2], [u + reach, v + reach / 2]])


LEVEL = np.array([[130.0, 200.0], [270.0, 200.0]])  # over the middle of the sphere


# --- on the sphere --------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
def test_a_line_is_as_deep_as_asked_in_its_middle_and_runs_out(scene, fine, profile):
    offsets = carved(fine, REST, scene.camera(), [LEVEL], 1 * MM, 6 * MM, profile)
    along = depth_under(fine, REST, scene.camera(), LEVEL, offsets)
    assert along[70:130] == pytest.approx(-1 * MM, rel=0.05)
    assert np.abs(along[[0, -1]]).max() < 0.1 * MM
    assert offsets.dtype == np.float32 and offsets.shape == fine.vertices.shape


def test_the_profile_is_symmetrical_with_a_rim_on_either_side(scene, fine):
    offsets = carved(fine, REST, scene.camera(), [LEVEL], 1 * MM, 6 * MM, "scar")
    ring = heights(fine, REST, offsets)[:-2].reshape(239, 480)
    assert np.allclose(ring, ring[::-1], atol=0.01 * MM)
    across = ring[:, 0]  # the front
    assert across[119] == pytest.approx(-1 * MM, rel=0.05)
    assert 0.35 * MM < across.max() < 0.5 * MM
    away = np.abs(fine.vertices[:-2, 1].reshape(239, 480)[:, 0])
    assert not across[away > 6 * MM].any()


def test_profiles_differ_by_their_rims(scene, fine):
    crease, scar = (
        heights(fine, REST, carved(fine, REST, scene.camera(), [LEVEL], 1 * MM, 6 * MM, profile))
        for profile in ("crease", "scar")
    )
    assert crease.min() == pytest.approx(scar.min(), rel=0.02)
    assert scar.max() > 2 * crease.max() > 0.2 * MM


def test_nothing_moves_farther_than_the_width_from_the_line(scene, fine):
    camera, width = scene.camera(), 8 * MM
    zigzag = np.array([[130.0, 150], [190, 260], [230, 140], [280, 230]])
    offsets = carved(fine, REST, camera, [zigzag], 1 * MM, width)
    line = skin_under(fine, REST, camera, zigzag)
    away = cKDTree(line).query(fine.vertices[offsets.any(axis=1)])[0]
    assert away.max() < width + 1 * MM  # the line is smoothed by as much
    assert away.max() > 0.8 * width


def test_embossing_is_the_opposite_of_engraving(scene, fine):
    groove, ridge = (carved(fine, REST, scene.camera(), [LEVEL], d, 6 * MM) for d in (MM, -MM))
    assert np.allclose(groove, -ridge, atol=1e-9) and groove.any()


def test_crossing_lines_are_no_deeper_than_one(scene, fine):
    upright = LEVEL[:, ::-1]
    both = carved(fine, REST, scene.camera(), [LEVEL, upright, LEVEL + 2], 1 * MM, 6 * MM, "scar")
    assert heights(fine, REST, both).min() == pytest.approx(-1 * MM, rel=0.02)


def test_a_ring_has_no_ends(scene, fine):
    turn = np.linspace(0, 2 * np.pi, 60)
    ring = 200 + 50 * np.column_stack([np.cos(turn), np.sin(turn)])
    offsets = carved(fine, REST, scene.camera(), [ring], 1 * MM, 6 * MM)
    assert depth_under(fine, REST, scene.camera(), ring, offsets).max() < -0.8 * MM


def test_on_a_coarse_mesh_a_line_is_wider_and_still_even(scene):
    coarse = scene.Ball(rings=60)  # edges of 5 mm
    slanting = np.array([[140.0, 150], [270, 240]])
    offsets = carved(coarse, REST, scene.camera(), [slanting], 1 * MM, 2 * MM)
    along = depth_under(coarse, REST, scene.camera(), slanting, offsets)[70:130]
    assert along.max() < -0.6 * MM and along.min() > -1.05 * MM
    line = skin_under(coarse, REST, scene.camera(), slanting)
    away = cKDTree(line).query(coarse.vertices[offsets.any(axis=1)])[0]
    assert 5 * MM < away.max() < 1.5 * WIDEN * 7.4 * MM


def test_a_narrow_line_is_less_deep_than_asked(scene, fine):
    offsets = carved(fine, REST, scene.camera(), [LEVEL], 5 * MM, 4 * MM)
    assert np.abs(offsets).max() < 2 * MM


@pytest.mark.parametrize(
    "lines",
    [
        [],
        [np.zeros((0, 2))],
        [np.array([[200.0, 200.0]])],
        [np.full((20, 2), 200.0)],
        [np.array([[5.0, 5.0], [5.0, 100.0]])],  # beside the sphere
        [np.array([[-1e6, 1e6], [-2e6, 3e6]])],
    ],
    ids=["none", "empty", "a point", "a repeated point", "off the face", "off the page"],
)
def test_what_is_no_line_on_the_skin_moves_nothing(scene, ball, lines):
    assert not carved(ball, REST, scene.camera(), lines).any()


def test_the_offsets_that_were_there_stay(scene, ball, rng):
    before = rng.normal(0, 0.2 * MM, (ball.n_vertices, 3)).astype(np.float32)
    kept = before.copy()
    after = engrave(ball, REST, before, scene.camera(), [LEVEL], 1 * MM, 6 * MM)
    assert (before == kept).all()
    back = ball.vertices[:, 2] < 0
    assert (after[back] == before[back]).all() and (after != before).any()
    assert (engrave(ball, REST, before, scene.camera(), [LEVEL], 0.0) == before).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"depth": 0.01}, "at most 5 mm deep or high, not 10 mm"),
        ({"depth": np.nan}, "deep or high, not nan"),
        ({"width": 0.0}, "more than 0 and at most 20 mm wide, not 0 mm"),
        ({"width": -0.001}, "wide, not -1 mm"),
        ({"width": np.inf}, "wide, not inf"),
        ({"profile": "trench"}, "profile of a line is crease or scar, not 'trench'"),
        ({"polylines": [np.zeros((4, 3))]}, r"a polyline must have the shape \(n, 2\)"),
        ({"polylines": [np.full((4, 2), np.nan)]}, "a point that is not a number"),
        ({"offsets": np.zeros((3, 3))}, "offsets must have the shape"),
    ],
)
def test_what_cannot_be_carved_is_refused_with_a_sentence(scene, ball, change, says):
    given = {"offsets": np.zeros((ball.n_vertices, 3)), "polylines": [LEVEL]} | change
    with pytest.raises(ValueError, match=says):
        engrave(ball, REST, given.pop("offsets"), scene.camera(), **given)


def test_offsets_that_are_no_numbers_are_refused(scene, ball):
    with pytest.raises(ValueError, match="offsets have a value that is not a number"):
        engrave(ball, REST, np.full((ball.n_vertices, 3), np.nan), scene.camera(), [LEVEL])


# --- on the face ----------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [np.inf, 0.8], ids=["orthographic", "perspective"])
@pytest.mark.parametrize("parameters", [REST, TURNED], ids=["rest", "turned"])
def test_the_carve_lies_under_the_line(rig, parameters, distance):
    camera = framed(rig, parameters, distance)
    line = forehead(rig, parameters, camera)
    offsets = carved(rig, parameters, camera, [line], 1 * MM, 5 * MM)
    along = depth_under(rig, parameters, camera, line, offsets)
    assert along[70:130].mean() == pytest.approx(-1 * MM, rel=0.15)
    deepest = heights(rig, parameters, offsets) < -0.6 * MM
    seen = camera.project(rig.pose(parameters)[deepest])
    assert np.abs(seen[:, 1] - line[0, 1]).max() < 2 * MM * camera.scale[1]
    assert line[0, 0] < seen[:, 0].min() and seen[:, 0].max() < line[1, 0]


def test_eyes_teeth_and_the_edges_of_lids_and_lips_stay(rig):
    camera = framed(rig, REST)
    place = {k: camera.project(v) for k, v in landmark_points(rig, rig.pose(REST)).items()}
    down = [np.linspace(place[a], place[b], 20) for a, b in (
        ("brow_peak_left", "mouth_corner_left"), ("nose_tip", "chin"))]  # fmt: skip
    moved = carved(rig, REST, camera, down, 2 * MM, 6 * MM).any(axis=1)
    assert moved[rig.parts["skin"]].any()
    for part in ("eyes", "teeth", "tongue", "lashes"):
        assert not moved[rig.parts[part]].any()
    posed = rig.pose(REST)
    near = cKDTree(posed[rig.parts["eyes"]]).query(posed)[0] < EYE_REACH[0]
    assert not moved[near].any()
    names = landmark_points(rig, posed)
    inner = [rig.landmarks[k] for k, name in enumerate(names) if name.startswith("lip_inner")]
    assert not moved[inner].any()


def test_a_line_over_the_nose_leaves_what_lies_behind_it(rig):
    parameters = FaceParameters(head=(0.7, 0.0, 0.0))
    camera = framed(rig, parameters)
    tip = camera.project(landmark_points(rig, rig.pose(parameters))["nose_bridge_lower"])
    line = tip + np.column_stack([np.linspace(-60, 60, 30), np.zeros(30)])
    offsets = carved(rig, parameters, camera, [line], 1 * MM, 4 * MM)
    posed = rig.pose(parameters)
    away = cKDTree(skin_under(rig, parameters, camera, line)).query(posed[offsets.any(axis=1)])[0]
    assert away.max() < 15 * MM and np.median(away) < 4 * MM


def scribbles(rng, number, size=600):
    return [
        rng.uniform(0, size, (1, 2))
        + np.cumsum(rng.normal(0, 15, (rng.integers(1, 25), 2)), axis=0)
        for _ in range(number)
    ]


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 2**20), depth=st.sampled_from([5 * MM, 1 * MM, -1 * MM, -5 * MM]),
       width=st.sampled_from([1 * MM, 4 * MM, 20 * MM]),
       profile=st.sampled_from(sorted(PROFILES)))  # fmt: skip
def test_no_scribble_turns_a_triangle_over(seed, depth, width, profile):
    rig, rng = load_rig(), np.random.default_rng(seed)
    parameters = FaceParameters({"brow_furrow": rng.uniform(0, 5), "smile": rng.uniform(0, 5)},
                                head=(rng.uniform(-0.6, 0.6), 0.0, 0.0))  # fmt: skip
    camera = framed(rig, parameters)
    offsets = carved(rig, parameters, camera, scribbles(rng, 12), depth, width, profile)
    assert np.isfinite(offsets).all()
    before, after = (
        triangle_normals(v.astype(float), rig.triangles)
        for v in (rig.pose(parameters), rig.pose(parameters, offsets))
    )
    moved = offsets.any(axis=1)[rig.triangles].any(axis=1)
    cosine = np.einsum("ij,ij->i", before, after)[moved]
    assert cosine.min(initial=1.0) > 0


def test_a_thousand_lines(rig):
    rng = np.random.default_rng(3)
    camera = framed(rig, REST)
    lines = [line[:6] for line in scribbles(rng, 1000)]
    offsets = carved(rig, REST, camera, lines)
    assert np.isfinite(offsets).all() and offsets.any()
    assert np.abs(offsets).max() < 1.5 * MM
