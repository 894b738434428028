"""Posing: what every user of the rig relies on."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from facs_rig import (
    CONTROL_NAMES,
    IDENTITY,
    LANDMARKS,
    LANDMARKS_68,
    TWELVE,
    Camera,
    FaceParameters,
    load_rig,
    rasterise,
)
from facs_rig.rotation import rotation

MM = 1e-3


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def points(rig, vertices):
    return dict(zip(LANDMARKS, vertices[rig.landmarks], strict=True))


def test_a_head_of_human_size_that_looks_forward(rig):
    face = points(rig, rig.neutral())
    assert np.ptp(rig.neutral(), axis=0) == pytest.approx([0.16, 0.26, 0.20], abs=0.03)
    assert 0.05 < face["pupil_left"][0] - face["pupil_right"][0] < 0.07
    assert face["nose_tip"][2] == max(p[2] for p in face.values())
    order = ["forehead", "nose_root", "nose_tip", "lip_top", "lip_bottom", "chin"]
    heights = [face[name][1] for name in order]
    assert heights == sorted(heights, reverse=True)
    assert face["eye_outer_left"][0] > 0 > face["eye_outer_right"][0]  # +x is the face's own left


def test_landmarks_lie_on_their_feature(rig):
    face = points(rig, rig.neutral())
    for side, sign in (("left", 1), ("right", -1)):
        corner, wing = face[f"mouth_corner_{side}"], face[f"nose_wing_{side}"]
        assert 0.018 < sign * corner[0] < 0.032
        assert 0.012 < sign * wing[0] < 0.024
        pupil, top, low = (face[f"{n}_{side}"] for n in ("pupil", "eye_top", "eye_bottom"))
        assert low[1] < pupil[1] < top[1]
    assert face["lip_bottom"][1] < face["mouth_corner_left"][1] < face["lip_top"][1]


def test_the_mesh_is_consistent(rig):
    mesh = trimesh.Trimesh(rig.neutral(), rig.triangles, process=False)
    assert mesh.is_winding_consistent
    assert mesh.area_faces.min() > 0
    skin = trimesh.Trimesh(
        rig.neutral(), rig.triangles[rig.parts["skin"][rig.triangles].all(axis=1)], process=False
    )
    # an edge of one triangle only is the rim of the neck: refinement leaves no crack elsewhere
    edges, count = np.unique(skin.edges_sorted, axis=0, return_counts=True)
    rim = rig.neutral()[np.unique(edges[count == 1])]
    assert count.max() == 2
    assert (rim[:, 1] < -0.08).all()


def test_outward_normals(rig):
    mesh = trimesh.Trimesh(rig.neutral(), rig.triangles, process=False)
    normals = mesh.vertex_normals[rig.landmarks]
    assert (normals[:, 2] > -0.2).all()


def test_polygons_and_triangles_are_the_same_surface(rig):
    ends = np.append(rig.polygon_starts[1:], len(rig.polygon_vertices))
    sizes = ends - rig.polygon_starts
    assert set(sizes) == {3, 4}
    assert (sizes - 2).sum() == len(rig.triangles)
    assert set(rig.polygon_vertices) == set(rig.triangles.ravel())


def test_mirror_is_an_involution_on_a_symmetric_face(rig):
    face = rig.neutral({"age": 1.0, "nose_width": 1.0})
    assert (rig.mirror[rig.mirror] == np.arange(rig.n_vertices)).all()
    np.testing.assert_allclose(face[rig.mirror] * [-1, 1, 1], face, atol=2e-4)


SIDED = [n[:-5] for n in CONTROL_NAMES if n.endswith("_left") and n != "jaw_left"]


@pytest.mark.parametrize("name", SIDED)
def test_left_and_right_add_up_to_the_symmetric_control(rig, name):
    for strength in (2.0, 5.0):
        sides = {f"{name}_left": strength, f"{name}_right": strength}
        both, symmetric = (rig.shape(FaceParameters(aus)) for aus in (sides, {name: strength}))
        np.testing.assert_allclose(both, symmetric, atol=3e-5)
    left = rig.control_deltas[CONTROL_NAMES.index(f"{name}_left")]
    far = rig.neutral()[:, 0] < -0.02  # the other half of the face keeps still
    assert np.abs(left[far]).max() < 0.1 * np.abs(left).max()


@pytest.mark.parametrize("name", CONTROL_NAMES)
def test_every_control_moves_the_face_a_natural_way(rig, name):
    delta = rig.control_deltas[CONTROL_NAMES.index(name)]
    most = np.linalg.norm(delta, axis=1).max()
    assert 1 * MM < most < 40 * MM


def moved(rig, name, landmark):
    delta = rig.control_deltas[CONTROL_NAMES.index(name)]
    return delta[rig.landmarks[LANDMARKS.index(landmark)]] / MM


@pytest.mark.parametrize(
    ("name", "landmark", "axis", "least"),
    [
        ("smile", "mouth_corner_left", 1, 3), ("smile", "mouth_corner_left", 0, 2),
        ("frown", "mouth_corner_left", 1, -2), ("frontalis", "brow_peak_left", 1, 2),
        ("medialis_frontalis", "brow_inner_left", 1, 2), ("brow_furrow", "brow_inner_left", 1, -2),
        ("grimace", "mouth_corner_left", 0, 3), ("grimace_left", "mouth_corner_left", 0, 3),
        ("sneer", "lip_top", 1, 2), ("wince", "nose_wing_left", 1, 1),
        ("squint", "eye_bottom_left", 1, 1), ("pucker", "mouth_corner_left", 0, -1),
        ("jaw_open", "chin", 1, -8), ("purse", "lip_top", 2, 2),
        ("lid_raise", "eye_top_left", 1, 0.5), ("blink", "eye_top_left", 1, -2),
    ],
)  # fmt: skip
def test_controls_move_their_feature_the_right_way(rig, name, landmark, axis, least):
    """Signed millimetres at full natural activation."""
    amount = moved(rig, name, landmark)[axis]
    assert amount * np.sign(least) >= abs(least)


@pytest.mark.parametrize("name", TWELVE)
def test_detected_controls_crease_the_skin(rig, name):
    """Sharper folds than the smooth blendshape has: the control without its creases is smoother."""
    key = [k.name for k in rig.keys].index(f"{name}_creases")
    depth = np.linalg.norm(rig.key_deltas[key], axis=1)
    assert depth.max() > 0.6 * MM
    assert not depth[~(rig.parts["skin"] | rig.parts["brows"])].any()  # brows lie on the skin


activations = st.dictionaries(st.sampled_from(CONTROL_NAMES), st.floats(0, 10))
gazes = st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))


@settings(max_examples=15, deadline=None)
@given(activations, gazes)
def test_a_pose_is_the_sum_of_its_keys(aus, gaze):
    """What Blender does with the same keys, deltas and values."""
    rig = load_rig()
    parameters = FaceParameters(aus, {"age": 0.5, "eye_opening": 0.4}, gaze=gaze)
    summed = rig.neutral(parameters.identity) + np.tensordot(
        rig.key_values(parameters), rig.key_deltas, axes=1
    )
    np.testing.assert_allclose(rig.shape(parameters), summed, atol=4e-6)


def test_controls_are_linear(rig):
    """The values of the controls' own keys are the sliders; 5 is value 1."""
    values = rig.key_values(FaceParameters({n: k / 5 for k, n in enumerate(CONTROL_NAMES)}))
    np.testing.assert_allclose(values[:47], np.arange(47) / 25, atol=1e-6)
    assert [key.name for key in rig.keys[:47]] == list(CONTROL_NAMES)
    assert not rig.key_values(FaceParameters()).any()


@settings(max_examples=100, deadline=None)
@given(activations, gazes, st.floats(-1, 1))
def test_lids_never_pass_each_other(aus, gaze, opening):
    rig = load_rig()
    who = {"eye_opening": opening}
    values = rig.key_values(FaceParameters(aus, who, gaze=gaze))
    value = dict(zip((k.name for k in rig.keys), values, strict=True))
    rest = rig.scalars(who)["lid_rest"]
    for side in ("left", "right"):
        assert value[f"lid_upper_{side}"] + value[f"lid_lower_{side}"] + rest <= 1 + 1e-6


@pytest.mark.parametrize("who", [{}, {"eye_opening": 1.0}, {"eye_opening": -1.0}, {"age": 1.0},
                                 {"eye_size": 1.0}, {"asian": 1.0, "african": 0.0}])  # fmt: skip
def test_a_blink_closes_the_eye_of_every_identity(rig, who):
    """From the front no more than a sliver of the eyeballs is left to see."""
    camera = Camera.framing(rig.neutral(), 600, 600)
    solid = np.flatnonzero(~np.isin(rig.triangle_part, [rig.part_names.index("lashes")]))

    def seen(aus):
        vertices = rig.pose(FaceParameters(aus, who))
        owner = rasterise(vertices, rig.triangles[solid], camera).triangle
        return (rig.triangle_part[solid][owner[owner >= 0]] == rig.part_names.index("eyes")).sum()

    assert seen({"blink": 5.0}) < 0.04 * seen({})
    assert seen({"blink": 10.0, "squint": 5.0}) < 0.04 * seen({})
    assert seen({"lid_raise": 5.0}) > 1.1 * seen({})


@pytest.mark.parametrize("aus", [{}, {"blink": 2.5}, {"blink": 5.0}, {"squint": 5.0},
                                 {"lid_raise": 5.0}, {"wince": 5.0, "smile": 5.0}])  # fmt: skip
def test_lids_stay_on_the_eyeball(rig, aus):
    """The rim of no lid dips into the ball or stands off it, wherever the lid is."""
    joints = rig.joints()

    def rim_gap(vertices):
        face = points(rig, vertices)
        return np.array([
            np.linalg.norm(face[f"eye_{edge}_{side}"] - joints[f"eye_{side}"])
            for edge in ("top", "bottom") for side in ("left", "right")
        ])  # fmt: skip

    rest, now = rim_gap(rig.neutral()), rim_gap(rig.pose(FaceParameters(aus)))
    assert np.abs(now - rest).max() < 0.5 * MM


def test_eyes_look_and_lids_follow(rig):
    def eye(gaze):
        return points(rig, rig.pose(FaceParameters(gaze=gaze)))

    rest = eye((0.0, 0.0))
    assert eye((0.4, 0.0))["pupil_left"][0] > rest["pupil_left"][0] + 3 * MM  # to its own left
    down, up = eye((0.0, 0.4)), eye((0.0, -0.4))
    assert down["pupil_left"][1] < rest["pupil_left"][1] - 3 * MM
    assert down["eye_top_left"][1] < rest["eye_top_left"][1] - 2 * MM
    assert up["eye_top_right"][1] > rest["eye_top_right"][1] + 1 * MM


def test_batch_equals_one_by_one(rig):
    batch = [
        FaceParameters({"smile": 5, "squint": 2}, {"age": 1.0}, (0.4, 0.1, -0.1), (0.1, 0, 0)),
        FaceParameters(),
        FaceParameters({"frontalis_left": 3.5}, {"gender": 1.0, "nose_hump": -1}),
    ]
    for one, many in zip(batch, rig.pose_batch(batch), strict=True):
        np.testing.assert_allclose(rig.pose(one), many, atol=2e-6)
    assert rig.pose_batch([]).shape == (0, rig.n_vertices, 3)


def test_head_turns_the_way_the_contract_says(rig):
    def nose(head):
        return points(rig, rig.pose(FaceParameters(head=head)))["nose_tip"]

    rest = nose((0, 0, 0))
    assert nose((0.3, 0, 0))[0] > rest[0]  # to its own left: the image's right
    assert nose((0, 0.3, 0))[1] < rest[1]  # down
    top = points(rig, rig.pose(FaceParameters(head=(0, 0, 0.3))))["forehead"]
    assert top[0] > 0.01  # to the image's right


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-1.2, 1.2)] * 3))
def test_rotations_are_rotations(angles):
    matrix = rotation(angles)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1)


def test_the_skull_turns_rigidly_and_the_neck_blends(rig):
    turned = rig.pose(FaceParameters(head=(0.5, 0.2, -0.1)))
    eyes = rig.parts["eyes"]
    expected = rig.neutral()[eyes] @ rotation((0.5, 0.2, -0.1)).T
    np.testing.assert_allclose(turned[eyes], expected, atol=1e-5)
    rim = rig.neutral()[:, 1] < -0.115
    assert np.linalg.norm((turned - rig.neutral())[rim], axis=1).max() < 0.02


def test_unturning_undoes_turning(rig):
    parameters = FaceParameters(head=(0.6, -0.2, 0.1), neck=(0.1, 0.1, 0))
    vectors = np.random.default_rng(0).normal(size=(rig.n_vertices, 3)) * MM
    back = rig.unturn_vectors(rig.turn_vectors(vectors, parameters), parameters)
    np.testing.assert_allclose(back, vectors, atol=1e-8)
    base = rig.shape(parameters)
    np.testing.assert_allclose(
        rig.turn(base + vectors, parameters) - rig.turn(base, parameters),
        rig.turn_vectors(vectors, parameters),
        atol=2e-7,
    )


@settings(max_examples=20, deadline=None)
@given(st.dictionaries(st.sampled_from(CONTROL_NAMES), st.floats(0, 10)),
       st.tuples(*[st.floats(-1, 1)] * 3))  # fmt: skip
def test_parameters_survive_json(aus, head):
    import json

    parameters = FaceParameters(aus, {"age": 0.5}, head)
    again = FaceParameters.from_json(json.loads(json.dumps(parameters.to_json())))
    assert again.aus == parameters.aus
    assert again.identity == parameters.identity
    assert again.head == pytest.approx(parameters.head)


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        (FaceParameters({"grin": 1}), "there is no control 'grin'"),
        (FaceParameters({"smile": 11}), "smile = 11 is outside 0 to 10"),
        (FaceParameters({"smile": -1}), "smile = -1 is outside 0 to 10"),
        (FaceParameters({"smile": float("nan")}), "smile = nan is outside 0 to 10"),
        (FaceParameters({}, {"beard": 1}), "no identity parameter 'beard'"),
    ],
)
def test_bad_parameters_are_named(rig, parameters, sentence):
    with pytest.raises(ValueError, match=sentence):
        rig.pose(parameters)


def test_offsets_must_fit(rig):
    with pytest.raises(ValueError, match=r"offsets must have the shape"):
        rig.shape(FaceParameters(), np.zeros((3, 3)))


def test_the_extent_holds_every_persons_head(rig):
    rng = np.random.default_rng(3)
    missing = []
    for _ in range(20):
        who = {p.name: rng.uniform(p.minimum, p.maximum) for p in IDENTITY if rng.random() < 0.5}
        turn = tuple(rng.normal(0, 0.4, 3)), tuple(rng.normal(0, 0.1, 3))
        face = FaceParameters({"jaw_open": 5}, who, *turn)
        head = rig.turn(rig.neutral(who), face)
        points = rig.extent(face)
        away = cKDTree(head).query(points)[0]
        assert away.max() < 1e-6  # points of the head itself
        missing += [head.max(axis=0) - points.max(axis=0), points.min(axis=0) - head.min(axis=0)]
    assert np.max(missing) < 0.005
    assert np.median(missing) < 0.001


def test_identity_extremes_keep_the_face_whole(rig):
    """Old and young, heavy and thin, all three ethnicities: no triangle of the face turns over."""
    triangles = rig.triangles[rig.parts["skin"][rig.triangles].all(axis=1)]
    rest = trimesh.Trimesh(rig.neutral(), triangles, process=False).face_normals
    extremes: list[dict[str, float]] = [
        {"age": 1, "gender": 1, "weight": 1},
        {"gender": 0, "weight": -1},
        {"african": 1, "asian": 0, "caucasian": 0},
        {"asian": 1, "african": 0, "caucasian": 0},
    ]
    for identity in extremes:
        normals = trimesh.Trimesh(rig.neutral(identity), triangles, process=False).face_normals
        flipped = (np.einsum("ij,ij->i", rest, normals) < -0.5).mean()
        assert flipped < 0.002


def test_the_68_points_are_where_face_alignment_has_them(rig):
    """Order and sides of the 300-W convention: the jaw first, the face's right on the left."""
    assert len(LANDMARKS_68) == len(set(LANDMARKS_68)) == 68
    assert set(LANDMARKS_68) <= set(LANDMARKS)
    at = points(rig, rig.neutral())
    x, y = np.array([at[name] for name in LANDMARKS_68]).T[:2]
    assert (np.diff(x[:17]) > 0).all()  # jaw, brows and lips run from its right to its left
    assert np.argmin(y) == 8
    assert (np.diff(x[17:27]) > 0).all()
    assert (np.diff(y[27:31]) < 0).all()  # the nose runs down
    assert (np.diff(x[31:36]) > 0).all()
    for eye in (slice(36, 42), slice(42, 48), slice(48, 60), slice(60, 68)):  # rings, clockwise
        ring = np.stack([x[eye], -y[eye]], axis=1)
        (ax, ay), (bx, by) = (np.roll(ring, -k, axis=0).T - ring.T for k in (1, 2))
        assert (ax * by - ay * bx).sum() > 0
    pairs = [(0, 16), (4, 12), (17, 26), (21, 22), (36, 45), (39, 42), (48, 54), (50, 52), (60, 64)]
    for right, left in pairs:
        assert abs(x[right] + x[left]) < MM
        assert abs(y[right] - y[left]) < MM


def test_an_open_mouth_parts_the_inner_lips(rig):
    shut, wide = (points(rig, rig.pose(FaceParameters(aus))) for aus in ({}, {"jaw_open": 5}))
    for name in ("lip_inner_top", "lip_inner_upper_left"):
        below = name.replace("top", "bottom").replace("upper", "lower")
        assert np.linalg.norm(shut[name] - shut[below]) < 5 * MM
        assert wide[name][1] - wide[below][1] > 15 * MM
