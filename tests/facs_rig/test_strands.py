"""Hairs and the layers for drawing: they stay where they grow, on every face and in every pose."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig import CONTROL_NAMES, IDENTITY, FaceParameters, landmark_points, load_rig
from facs_rig.anatomy import HAIR_PARTS
from facs_rig.baking.brows import COUNT, brow_lines
from facs_rig.baking.lashes import LOWER, UPPER, lash_lines
from facs_rig.baking.strands import closest_on_skin

MM = 1e-3
PEOPLE = (
    {},
    {"age": 1.0, "gender": 1.0},
    {"asian": 1.0, "gender": 0.0, "age": 0.2},
    {"african": 1.0, "weight": 1.0},
)
ACTIONS = ({"blink": 2.5}, {"blink": 5}, {"squint": 5}, {"lid_raise": 5}, {"frontalis": 10},
           {"brow_furrow": 10}, {"medialis_frontalis": 5}, {"smile": 5, "wince": 5})  # fmt: skip


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def off_skin(rig, vertices, points):
    """(k,) metres from points to the nearest skin."""
    skin = rig.triangles[rig.triangle_part == rig.part_names.index("skin")]
    return np.linalg.norm(closest_on_skin(points, vertices, skin)[2] - points, axis=1)


def middles(vertices, lines):
    return [np.einsum("kc,kcd->kd", weight, vertices[index]) for index, weight in lines]


def first(rig, part):
    return int(np.argmax(rig.parts[part]))


def test_there_are_as_many_hairs_as_the_tables_say(rig):
    edges, upper, lower = lash_lines(first(rig, "lashes"))
    assert (len(edges), len(upper), len(lower)) == (2, 2 * UPPER.count, 2 * LOWER.count)
    assert sum(len(np.unique(index)) for index, _ in edges + upper + lower) == (
        rig.parts["lashes"].sum()
    )
    assert len(np.concatenate([np.unique(i) for i, _ in brow_lines(0)])) == rig.parts["brows"].sum()
    assert len(rig.curves["brow_hair"].starts) == 2 * COUNT


@pytest.mark.parametrize("identity", PEOPLE)
def test_hairs_grow_from_the_skin_whatever_the_face_does(rig, identity):
    """Roots of lashes lie on the lids' edge, brows flat on the skin, to some tenths of a mm; an old
    man's are bushy, and their tips stand off a little more."""
    flat = 2.0 if identity.get("age") == identity.get("gender") == 1 else 1.5
    edges, upper, lower = lash_lines(first(rig, "lashes"))
    brows = brow_lines(first(rig, "brows"))
    for aus in ({}, *ACTIONS):
        vertices = rig.pose(FaceParameters(aus, identity))
        roots = np.array([line[0] for line in middles(vertices, upper + lower)])
        assert off_skin(rig, vertices, roots).max() < 0.8 * MM, aus
        hairs = np.concatenate(middles(vertices, brows))
        assert off_skin(rig, vertices, hairs).max() < flat * MM, aus


@pytest.mark.parametrize("name", CONTROL_NAMES)
def test_no_control_stretches_a_hair(rig, name):
    """A lash keeps its length within a third, a brow's hair moves as the skin does."""
    rest, moved = rig.neutral(), rig.pose(FaceParameters({name: 5}))
    _, upper, lower = lash_lines(first(rig, "lashes"))
    for lines, most in ((upper + lower, 1.35), (brow_lines(first(rig, "brows")), 1.6)):
        before, after = (
            np.array([np.linalg.norm(line[-1] - line[0]) for line in middles(v, lines)])
            for v in (rest, moved)
        )
        assert (after / before).max() < most
        assert (after / before).min() > 1 / most


@pytest.mark.parametrize("feature", [f.name for f in IDENTITY if f.low])
def test_no_feature_pulls_hairs_off(rig, feature):
    for value in (-1, 1):
        vertices = rig.neutral({feature: value})
        _, upper, lower = lash_lines(first(rig, "lashes"))
        roots = np.array([line[0] for line in middles(vertices, upper + lower)])
        brows = np.concatenate(middles(vertices, brow_lines(first(rig, "brows"))))
        assert off_skin(rig, vertices, np.concatenate([roots, brows])).max() < 1.5 * MM


def test_lashes_point_down_on_a_closed_eye_and_up_on_an_open_one(rig):
    _, upper, _ = lash_lines(first(rig, "lashes"))

    def rise(aus):
        lines = middles(rig.pose(FaceParameters(aus)), upper)
        return np.median([line[-1, 1] - line[0, 1] for line in lines])

    assert rise({}) > 1.5 * MM
    assert rise({"blink": 5}) < -0.5 * MM


def test_hairs_are_mirror_images(rig):
    vertices = rig.neutral()
    hair = np.any([rig.parts[part] for part in HAIR_PARTS], axis=0)
    assert np.allclose(vertices[rig.mirror][hair] * [-1, 1, 1], vertices[hair], atol=0.5 * MM)
    assert np.array_equal(rig.vertex_part[rig.mirror], rig.vertex_part)


def test_blades_of_lashes_are_solid_from_outside(rig):
    """Their triangles face outwards: the volume that they enclose is positive on both sides."""
    corner = rig.neutral()[rig.triangles[rig.triangle_part == rig.part_names.index("lashes")]]
    corner = corner - corner.mean(axis=(0, 1))
    signed = np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6
    for sign in (1, -1):
        assert signed[sign * corner[:, 0, 0] > 0].sum() > 0


def test_brows_face_the_viewer(rig):
    corner = rig.neutral()[rig.triangles[rig.triangle_part == rig.part_names.index("brows")]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.mean(normal[:, 2] > 0) > 0.99


def test_layers_are_those_that_drawings_may_ask_for(rig):
    assert set(rig.curves) == {
        "brow_hair", "lash", "lash_lower", "lip_line", "hairline",
        "hair_short", "hair_bob", "hair_long", "hair_bun",
    }  # fmt: skip
    for curves in rig.curves.values():
        assert np.allclose(curves.weight.sum(axis=1), 1, atol=1e-5)
        assert curves.places.max() < len(curves.index) == len(curves.lift)
        assert len(curves.lines()) == len(curves.width)
        assert curves.strength.min() > 0
        assert curves.strength.max() <= 1


def test_curves_move_with_the_face(rig):
    """The line of the lips drops with the jaw's lip, the hairline and hair turn with the head."""
    rest = rig.neutral()
    turned = FaceParameters(head=(0.6, 0.1, 0.0))
    moved = rig.pose(turned)
    for name in ("hairline", "hair_long", "hair_bun"):
        curves = rig.curves[name]
        before, after = curves.points(rest), curves.points(moved)
        assert np.allclose(
            np.linalg.norm(np.diff(before, axis=0), axis=1),
            np.linalg.norm(np.diff(after, axis=0), axis=1), atol=0.2 * MM,
        )  # fmt: skip
        assert np.linalg.norm(after - before, axis=1).max() > 20 * MM
    smiling = rig.pose(FaceParameters({"smile": 5}))
    line = rig.curves["lip_line"].points(smiling) - rig.curves["lip_line"].points(rest)
    assert line[0, 1] > 2 * MM < line[-1, 1]


@pytest.mark.parametrize("identity", PEOPLE)
def test_the_lips_line_runs_between_the_lips(rig, identity):
    vertices = rig.neutral(identity)
    line = rig.curves["lip_line"].points(vertices)
    upper, lower = (rig.stroke_points(vertices, f"lip_{edge}") for edge in ("upper", "lower"))
    inner = line[4:-4]
    above = np.interp(inner[:, 0], *upper[np.argsort(upper[:, 0])][:, :2].T)
    below = np.interp(inner[:, 0], *lower[np.argsort(lower[:, 0])][:, :2].T)
    assert (inner[:, 1] < above + 0.5 * MM).all()
    assert (inner[:, 1] > below - 0.5 * MM).all()


@pytest.mark.parametrize("identity", PEOPLE)
@pytest.mark.parametrize("style", ["short", "bob", "long", "bun"])
def test_hair_lies_outside_the_skull(rig, style, identity):
    """Above the ears every point of the skull is under the hair, or in front of the hairline."""
    vertices = rig.neutral(identity)
    points = rig.curves[f"hair_{style}"].points(vertices)
    places = landmark_points(rig, vertices)
    top = vertices[rig.parts["skin"]][:, 1].max()
    middle = np.array([0.0, (places["brow_peak_left"][1] + top) / 2, -0.01])
    skull = vertices[rig.parts["skin"]]
    skull = skull[(skull[:, 1] > middle[1]) & (skull[:, 2] < places["temple_left"][2])]
    away = points - middle
    tree = cKDTree(away / np.linalg.norm(away, axis=1, keepdims=True))
    ways = skull - middle
    length = np.linalg.norm(ways, axis=1)
    angle, near = tree.query(ways / length[:, None], 3)
    under = angle[:, 0] < 0.13
    assert under.mean() > 0.9
    outside = np.linalg.norm(away[near], axis=2).max(axis=1) - length
    assert np.mean(outside[under] > -1 * MM) > 0.99
