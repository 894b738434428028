"""Beards: numbers that carry from person to person, and hairs that go with the skin."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig import FaceParameters, load_rig
from facs_rig.beard.beard import Beard, from_json, to_json
from facs_rig.beard.chart import ALONG, COLUMNS, ROWS, UP, chart_of, on_chart, roots_of
from facs_rig.beard.coat import coat
from facs_rig.beard.growth import growth
from facs_rig.beard.lip import RISE, SPREAD, lip_places, rim_of
from facs_rig.beard.mesh import FEWEST, MOST, beard_mesh
from facs_rig.beard.presets import PRESETS, preset
from facs_rig.common.errors import InputError
from facs_rig.levels import at_level
from facs_rig.mesh import vertex_normals
from facs_rig.paint import MATERIAL_NAMES, painted
from facs_rig.rig import landmark_points
from facs_rig.rotation import rotation

MM = 1e-3
MAN = {"gender": 1.0, "age": 0.3}
OPEN = FaceParameters({"jaw_open": 8.0}, MAN)
SMILES = FaceParameters({"smile": 7.0, "jaw_open": 2.0}, MAN)


@pytest.fixture(scope="module")
def rig():
    return load_rig()


@pytest.fixture(scope="module")
def grown(rig):
    return {name: beard_mesh(rig, MAN, preset(name)) for name in PRESETS}


# --- what a beard is ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PRESETS)
def test_a_beard_is_kept_as_text(name):
    beard = preset(name)
    assert to_json(from_json(to_json(beard))) == to_json(beard)


@pytest.mark.parametrize("forged", ["", "null", "[]", "{}", '"cover"', '{"cover": 1}', "{"])
def test_forged_text_is_no_beard(forged):
    with pytest.raises(InputError, match="what is kept of the beard") as caught:
        from_json(forged)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "key",
    ["cover", "length", "moustache", "fall", "curl", "colour", "lean", "spread", "rise"],
)
@pytest.mark.parametrize("value", ["x", [[1]], {"a": 1}, float("nan"), 7e9, -1])
def test_forged_values_are_no_beard(key, value):
    forged = {**json.loads(to_json(preset("goatee"))), key: value}
    with pytest.raises(InputError, match="what is kept of the beard"):
        from_json(json.dumps(forged))


def test_a_beard_that_was_kept_before_hairs_leaned_is_read():
    beard = preset("goatee")
    kept = json.loads(to_json(beard))
    for late in ("lean", "spread", "rise"):
        del kept[late]
    assert to_json(from_json(json.dumps(kept))) == to_json(beard) and not beard.lean.any()


def test_what_is_no_beard_is_one_sentence(rig):
    with pytest.raises(InputError, match="choose one of stubble"):
        preset("beehive")
    with pytest.raises(InputError, match="from 0 to 1, got 1.2"):
        beard_mesh(rig, MAN, preset("goatee"), 1.2)
    bare = Beard(np.zeros((COLUMNS, ROWS)), np.zeros(COLUMNS))
    assert beard_mesh(rig, MAN, bare) is None


# --- where it grows -------------------------------------------------------------------------------


def test_hair_grows_on_the_lower_face_and_not_on_lips_nose_eyes_or_ears(rig):
    rest = rig.neutral()
    mark = landmark_points(rig, rest)
    skin = rest[chart_of(rig).vertices]
    assert skin[:, 1].max() < mark["eye_bottom_left"][1] - 5 * MM
    red = rest[painted(rig).material == MATERIAL_NAMES.index("lips")]
    assert cKDTree(skin).query(red)[0].min() > 2 * MM
    assert np.linalg.norm(skin - mark["nose_tip"], axis=1).min() > 15 * MM
    assert np.linalg.norm(skin - mark["chin"], axis=1).min() < 1 * MM
    lobes = np.abs(skin[:, 0]).max()
    assert lobes < np.abs(rest[:, 0]).max() - 8 * MM  # which the ears are


def test_the_chart_is_alike_on_both_sides_and_rises_from_the_jaw(rig):
    chart = chart_of(rig)
    number = np.full(rig.n_vertices, -1)
    number[chart.vertices] = np.arange(len(chart.vertices))
    other = number[rig.mirror[chart.vertices]]
    both = other >= 0
    assert both.mean() > 0.97
    away = np.abs(chart.place[both] - chart.place[other[both]])
    assert np.percentile(away, 99, axis=0) == pytest.approx([0, 0], abs=0.02)
    mark = landmark_points(rig, rig.neutral())
    near = cKDTree(rig.neutral()[chart.vertices]).query(
        np.stack([mark["chin"], mark["nose_base"], mark["jawline_4_left"]])
    )[1]
    along, up = chart.place[near].T
    assert along[0] < 0.1 and along[1] < 0.1 and 0.5 < along[2] < 0.8
    assert abs(up[0]) < 3 * MM and up[1] > 45 * MM and abs(up[2]) < 6 * MM


def test_every_first_part_of_the_roots_is_spread_evenly(rig):
    roots = roots_of(rig)
    at = np.einsum("kc,kcd->kd", roots.weight, rig.neutral()[roots.index])
    for count in (500, 4000):
        gap = cKDTree(at[:count]).query(at[4000:])[0]
        assert np.percentile(gap, 99) < 3.2 * np.median(gap)
    assert (roots.weight >= 0).all() and np.allclose(roots.weight.sum(axis=1), 1)
    assert np.unique(roots.anchors, axis=0).shape[0] > 1000


def test_values_are_read_off_a_chart(rig):
    table = ALONG[:, None] + 10 * UP
    place = np.array([[0.0, 0.0], [0.31, 0.02], [1.0, 0.07], [2.0, -1.0]])
    wanted = [0.0, 0.51, 1.7, 1 + 10 * UP[0]]
    assert on_chart(table, place) == pytest.approx(wanted)


# --- the mesh -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PRESETS)
def test_it_is_light_and_whole(grown, name):
    mesh = grown[name]
    n = len(mesh.points)
    assert 1000 < len(mesh.triangles) <= (FEWEST + MOST) / 2
    assert np.isfinite(mesh.points).all() and len(np.unique(mesh.quads)) == n
    assert mesh.uv.shape == (n, 2) and mesh.shade.shape == mesh.grain.shape == (n,)
    assert mesh.uv.min() >= 0 and mesh.uv.max() <= 1 and mesh.shade.min() > 0
    corners = mesh.points[mesh.triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert area.max() < 3e-4 and (area > 0).mean() > 0.999


def test_detail_says_how_many_triangles(rig):
    counts = [len(beard_mesh(rig, MAN, preset("full beard"), d).triangles) for d in (0, 0.4, 1)]
    assert counts == sorted(counts) and counts[0] < 1.1 * FEWEST and 0.7 * MOST < counts[2] <= MOST


def test_the_same_beard_makes_the_same_mesh(rig, grown):
    again = beard_mesh(rig, MAN, preset("full beard"))
    assert np.array_equal(again.points, grown["full beard"].points)


@pytest.mark.parametrize("name", PRESETS)
def test_roots_lie_on_the_skin_and_hairs_outside_it(rig, grown, name):
    mesh, skin = grown[name], rig.neutral(MAN)
    inner, depth = below(rig, skin, mesh.points)
    assert depth[inner].max(initial=0) < 2.5 * MM
    tips = mesh.points[mesh.uv[:, 1] == 1]
    inner, depth = below(rig, skin, tips)
    assert (depth[inner] > 0.5 * MM).mean() < 0.02 if inner.any() else True


def below(rig, skin, points):
    """Which points are under the skin of a posed face, and how deep, metres."""
    normals = vertex_normals(skin, rig.triangles, rig.corners)
    own = np.flatnonzero(rig.parts["skin"])
    near = own[cKDTree(skin[own]).query(points)[1]]
    depth = -np.einsum("kc,kc->k", points - skin[near], normals[near])
    return depth > 0, depth


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("posed", [OPEN, SMILES], ids=["open", "smile"])
def test_nothing_hangs_into_an_open_mouth(rig, grown, name, posed):
    face = rig.pose(posed)
    mark = landmark_points(rig, face)
    top, low = mark["lip_inner_top"], mark["lip_inner_bottom"]
    middle = (top + low) / 2
    half = (mark["mouth_inner_corner_left"] - mark["mouth_inner_corner_right"])[0] / 2
    away = (grown[name].on(face) - middle) / (0.8 * half, 0.8 * (top - low)[1] / 2, 1)
    assert not (np.hypot(away[:, 0], away[:, 1]) < 1).any()


@pytest.mark.parametrize("name", PRESETS)
def test_an_open_jaw_takes_it_along_and_no_hair_is_torn(rig, grown, name):
    mesh = grown[name]
    before, after = mesh.on(rig.neutral(MAN)), mesh.on(rig.pose(OPEN))
    a, b = mesh.quads[:, 0], mesh.quads[:, 1]
    hairs = mesh.bound.root[a] == mesh.bound.root[b]
    size = [np.linalg.norm(p[a] - p[b], axis=1)[hairs] for p in (before, after)]
    assert np.abs(size[1] - size[0]).max() < 4 * MM  # each is nearly stiff
    assert np.percentile(np.abs(size[1] - size[0]), 95) < 0.5 * MM
    if name != "moustache":
        assert (before - after)[:, 1].max() > 15 * MM
    chin = landmark_points(rig, rig.neutral(MAN))["chin"]
    rooted = rig.neutral(MAN)[mesh.bound.index[mesh.bound.root, 0]]
    face = (rooted[:, 1] > chin[1] + 4 * MM) & (rooted[:, 2] > 0.05)  # below, hair meets the neck
    _, depth = below(rig, rig.pose(OPEN), after[face])
    assert (depth > 2 * MM).mean() < 0.01


def test_a_long_beard_keeps_hanging_when_the_jaw_turns(rig, grown):
    mesh = grown["long beard"]
    ways = []
    for face in (rig.neutral(MAN), rig.pose(OPEN)):
        points = mesh.on(face)
        low = np.argsort(mesh.points[:, 1])[:200]
        first = np.array([np.flatnonzero(mesh.bound.root == mesh.bound.root[k])[0] for k in low])
        way = points[low] - points[first]
        ways.append(way / np.linalg.norm(way, axis=1, keepdims=True))
    turned = np.degrees(np.arccos(np.clip((ways[0] * ways[1]).sum(axis=1), -1, 1)))
    assert 0.5 < np.median(turned) < 10  # the jaw turns by more than twenty


def test_it_turns_with_the_head(rig, grown):
    mesh, turn = grown["full beard"], (0.5, 0.2, -0.1)
    at_rest = mesh.on(rig.neutral(MAN))
    there = mesh.on(rig.pose(FaceParameters({}, MAN, head=turn)))
    near = there - at_rest @ rotation(turn).T
    rooted = rig.weights[mesh.bound.index[mesh.bound.root]].min(axis=(1, 2)) >= 1
    assert rooted.mean() > 0.4 and np.abs(near[rooted]).max() < 1 * MM


@pytest.mark.parametrize("who", [{"age": 0.9}, {"gender": 1.0, "weight": 1.0}, {"chin_width": 1.0}])
def test_it_comes_along_to_another_person(rig, grown, who):
    own = beard_mesh(rig, who, preset("goatee")).points
    moved = np.linalg.norm(grown["goatee"].on(rig.neutral(who)) - own, axis=1)
    assert np.median(moved) < 4 * MM


@pytest.mark.parametrize("level", ["medium", "game"])
def test_it_grows_on_lighter_faces(rig, level):
    light = at_level(rig, level)
    mesh = beard_mesh(light, MAN, preset("full beard"))
    assert mesh.bound.index.max() < light.n_vertices
    full = beard_mesh(rig, MAN, preset("full beard"))
    away = cKDTree(full.points).query(mesh.points)[0]
    assert np.percentile(away, 95) < 8 * MM


def test_moves_of_a_face_are_moves_of_its_beard(rig, grown):
    mesh, rest = grown["goatee"], rig.neutral(MAN)
    face = {"jaw": rig.pose(OPEN) - rest, "brows": rig.pose(
        FaceParameters({"frontalis": 6.0}, MAN)) - rest}  # fmt: skip
    worn = mesh.worn_on(rest, face)
    assert set(worn.moves) == {"jaw"} and worn.name == "beard"
    assert np.allclose(worn.points + worn.moves["jaw"], mesh.on(rig.pose(OPEN)), atol=1e-5)


def test_a_moustache_alone_grows_over_the_mouth(rig, grown):
    mark = landmark_points(rig, rig.neutral(MAN))
    points = grown["moustache"].points
    assert points[:, 1].min() > mark["lip_bottom"][1]
    assert points[:, 1].max() < mark["nose_base"][1] + 6 * MM
    assert np.abs(points[:, 0]).max() < mark["mouth_corner_left"][0] + 22 * MM


@pytest.mark.parametrize("name", [name for name in PRESETS if PRESETS[name].over])
@pytest.mark.parametrize("who", [MAN, {"gender": 1.0, "mouth_width": 1.5}, {"age": 0.9}])
def test_a_moustache_keeps_off_the_lips_and_the_nose(rig, name, who):
    mesh, skin = beard_mesh(rig, who, preset(name)), rig.neutral(who)
    mark, rim = landmark_points(rig, skin), rim_of(rig, skin)
    over = roots_over(rig, mesh)
    tips = mesh.points[over & (mesh.uv[:, 1] == 1)]
    inside = np.abs(tips[:, 0]) < mark["mouth_corner_left"][0]
    up = tips[:, 1] - np.interp(np.abs(tips[:, 0]), *rim.T)
    assert inside.sum() > 20 and (up[inside] > -0.7 * MM).all()
    assert mesh.points[over, 1].max() < mark["nose_base"][1] + 3 * MM


def roots_over(rig, mesh):
    """(n,) which points of a beard grow over the mouth."""
    rest = rig.neutral()
    at = np.einsum("kc,kcd->kd", mesh.bound.weight, rest[mesh.bound.index])
    lip = lip_places(at, rim_of(rig, rest), landmark_points(rig, rest))
    return ((lip[:, 0] < 1) & (lip[:, 1] > 0))[mesh.bound.root]


def test_a_moustache_comes_to_a_point_past_the_corners(rig, grown):
    mark = landmark_points(rig, rig.neutral(MAN))
    mesh, corner = grown["moustache"], mark["mouth_corner_left"]
    rooted = np.einsum("kc,kcd->kd", mesh.bound.weight, rig.neutral(MAN)[mesh.bound.index])
    across = np.abs(rooted[:, 0]) / corner[0]
    many = [((across > low) & (across < low + 0.2)).sum() for low in (0.6, 0.9, 1.1, 1.3)]
    assert many == sorted(many, reverse=True) and many[-1] < 0.05 * many[0]
    away = np.abs(mesh.points[:, 0]) / corner[0]
    tall = [np.ptp(mesh.points[(away > low) & (away < low + 0.1), 1]) for low in (0.9, 1.4)]
    assert tall[1] < 0.75 * tall[0] and 1.15 < np.percentile(away, 99) < 1.6


def test_hairs_of_a_moustache_lean_outward_and_down(rig, grown):
    mesh = grown["moustache"]
    last = mesh.quads[mesh.quads[:, 2] == mesh.quads[:, 3]]
    way = mesh.points[last[:, 2]] - mesh.points[last[:, :2]].mean(axis=1)
    across = mesh.points[last[:, 2], 0]
    aside = np.abs(across) > 5 * MM
    outward = (way[:, 0] * np.sign(across))[aside]
    assert (outward > 0).mean() > 0.98 and (way[aside, 1] < 0).mean() > 0.9


@pytest.mark.parametrize(("spread", "rise"), [(0.8, 1.0), (1.3, 0.5), (1.7, 1.0)])
def test_a_moustache_is_as_wide_and_as_high_as_it_says(rig, grown, spread, rise):
    usual = grown["moustache"].points
    other = beard_mesh(rig, MAN, replace(preset("moustache"), spread=spread, rise=rise)).points
    wide = [np.percentile(np.abs(points[:, 0]), 98) for points in (usual, other)]
    assert wide[1] / wide[0] == pytest.approx(spread / SPREAD, abs=0.15)
    if rise < RISE:
        assert other[:, 1].max() < usual[:, 1].max() - 2 * MM


@pytest.mark.parametrize("name", ["full beard", "long beard", "goatee"])
def test_hair_grows_shorter_and_thinner_toward_the_edge(rig, name):
    beard, roots = preset(name), roots_of(rig)
    what = growth(beard, roots.place, roots.lip, roots.above)
    edge = (what.cover > 0.2) & (what.cover < 0.5) & ~what.over
    inner = (what.cover > 0.9) & ~what.over & (np.abs(roots.place[:, 1]) < 20 * MM)
    assert edge.sum() > 50 and what.length[edge].mean() < 0.6 * what.length[inner].mean()


def test_a_coat_lies_under_the_skin_at_its_edge(rig):
    made = coat(rig, np.asarray(rig.neutral(MAN), float), preset("long beard"))
    _, depth = below(rig, rig.neutral(MAN), made.points)
    sides = np.sort(np.stack([made.quads, np.roll(made.quads, 1, axis=1)], axis=2), axis=2)
    edges, times = np.unique(sides.reshape(-1, 2), axis=0, return_counts=True)
    rim = np.unique(edges[times == 1])
    assert len(rim) > 20 and np.median(depth[rim]) > 0.3 * MM
    assert np.median(depth) < 0


def test_colour_and_curl_are_its_own(rig):
    dark, pale = (beard_mesh(rig, MAN, preset("goatee", colour)).colour for colour in (1.0, 0.0))
    assert sum(pale) > 5 * sum(dark)
    straight = preset("full beard")
    curled = beard_mesh(rig, MAN, replace(straight, curl=1.0))
    assert not np.allclose(curled.points, beard_mesh(rig, MAN, straight).points, atol=1 * MM)


def test_hairs_lean_as_they_are_told_each_side_away_from_the_middle(rig):
    plain = replace(preset("stubble"), moustache=0.0)
    lean = np.stack([np.full((COLUMNS, ROWS), np.radians(40)), np.zeros((COLUMNS, ROWS))])
    ways = []
    for beard in (plain, replace(plain, lean=lean), replace(plain, lean=lean[::-1])):
        mesh = beard_mesh(rig, MAN, beard)
        base, _, tip = mesh.quads[mesh.quads[:, 2] == mesh.quads[:, 3]][:, :3].T
        ways.append(mesh.points[tip] - mesh.points[base])
    across = mesh.points[base, 0]
    front = rig.neutral(MAN)[:, 2].max() - mesh.points[base, 2] < 30 * MM
    turned = [
        np.degrees(np.arctan2(way[:, 0], -way[:, 1]) - np.arctan2(ways[0][:, 0], -ways[0][:, 1]))
        for way in ways[1:]
    ]
    left, right = (front & (side * across > 10 * MM) for side in (1, -1))
    assert left.sum() > 60 and right.sum() > 60
    assert np.median(turned[0][left]) == pytest.approx(40, abs=8)
    assert np.median(turned[1][right]) == pytest.approx(-40, abs=8)
    assert np.abs(turned[0][right]).max() < 0.5 and np.abs(turned[1][left]).max() < 0.5
