"""Line drawing, against curves that are known in closed form."""

import numpy as np
import pytest
import trimesh

from dataset_gen import draw_strokes, ink
from dataset_gen.curvature import radial_curvature
from dataset_gen.lines import Stroke
from dataset_gen.topology import Topology
from dataset_gen.zero_sets import chains, zero_set
from facs_rig import Camera, FaceParameters, load_rig

MAJOR, MINOR = 1.0, 0.35


@pytest.fixture(scope="module")
def torus():
    """Vertices, exact normals and triangles of a fine torus, tilted toward the viewer."""
    n, m = 240, 120
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    ring = MAJOR + MINOR * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), MINOR * np.sin(v)], axis=-1)
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, ((i + 1) % n) * m + j
    c, d = ((i + 1) % n) * m + (j + 1) % m, i * m + (j + 1) % m
    triangles = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    turn = trimesh.transformations.rotation_matrix(1.0, [1, 0, 0])[:3, :3]
    return vertices.reshape(-1, 3) @ turn.T, normals.reshape(-1, 3) @ turn.T, triangles, turn


def analytic(points, view, turn):
    """n·v, κr and D_w κr of the torus at points near it, by its principal curvatures.

    κ1 = 1/r along the tube, κ2 = cos v / (R + r cos v) around it; κr is their mean weighted with
    the squared share of w (Euler). D_w κr is a central difference of κr along w on the surface.
    """

    def frame(u, v):
        n = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
        tube = np.stack([-np.sin(v) * np.cos(u), -np.sin(v) * np.sin(u), np.cos(v)], axis=-1)
        around = np.stack([-np.sin(u), np.cos(u), np.zeros_like(u)], axis=-1)
        return n, tube, around

    local = points @ turn
    toward = view @ turn
    u = np.arctan2(local[:, 1], local[:, 0])
    v = np.arctan2(local[:, 2], np.hypot(local[:, 0], local[:, 1]) - MAJOR)

    def radial(u, v):
        n, tube, around = frame(u, v)
        a, b = tube @ toward, around @ toward
        k2 = np.cos(v) / (MAJOR + MINOR * np.cos(v))
        return (a**2 / MINOR + b**2 * k2) / np.maximum(a**2 + b**2, 1e-12), a, b, n

    kr, a, b, n = radial(u, v)
    length = np.hypot(a, b)
    h = 1e-5
    dv, du = a / length / MINOR, b / length / (MAJOR + MINOR * np.cos(v))
    ahead, behind = radial(u + h * du, v + h * dv)[0], radial(u - h * du, v - h * dv)[0]
    return n @ toward, kr, (ahead - behind) / (2 * h), length


def test_radial_curvature_of_a_torus(torus):
    vertices, normals, triangles, turn = torus
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), vertices.shape)
    kr, growth = radial_curvature(vertices, triangles, normals, view)
    ndotv, exact, exact_growth, w = analytic(vertices, view[0], turn)
    well = (np.abs(ndotv) < 0.9) & (w > 0.4)
    assert well.sum() > 5000
    assert np.median(np.abs(kr - exact)[well]) < 0.01 / MINOR
    assert np.percentile(np.abs(kr - exact)[well], 99) < 0.08 / MINOR
    scale = np.percentile(np.abs(exact_growth[well]), 90)
    assert np.median(np.abs(growth - exact_growth)[well]) < 0.03 * scale


def test_suggestive_contours_of_a_torus_lie_where_they_should(torus):
    vertices, normals, triangles, turn = torus
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), vertices.shape)
    kr, growth = radial_curvature(vertices, triangles, normals, view)
    found = zero_set(Topology.of(triangles), kr)
    points, strength = found.of(vertices), found.of(growth)
    ndotv, exact, exact_growth, w = analytic(points, view[0], turn)
    chosen = (strength > 0.05 / MINOR**2) & (ndotv > 0.05) & (w > 0.3)
    assert chosen.sum() > 100
    slope = np.maximum(np.abs(exact_growth[chosen]), 1.0)
    distance = np.abs(exact[chosen]) / slope  # first order: how far the true zero is
    assert np.median(distance) < 0.01 * MINOR
    assert (exact_growth[chosen] > 0).mean() > 0.98


def test_the_contour_of_a_sphere_is_its_great_circle():
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=2.0)
    vertices = np.asarray(mesh.vertices)
    facing = vertices[:, 2] / 2.0 + 1e-9
    found = zero_set(Topology.of(mesh.faces), facing)
    points = found.of(vertices)
    assert np.abs(points[:, 2]).max() < 1e-6
    circle, starts = chains(found.segments)
    assert len(starts) == 2  # one closed line
    assert circle[0] == circle[-1]
    length = np.linalg.norm(np.diff(points[circle], axis=0), axis=1).sum()
    assert length == pytest.approx(4 * np.pi, rel=2e-3)


def test_chains_use_each_segment_once():
    segments = np.array([[0, 1], [2, 1], [2, 3], [5, 4], [6, 7], [7, 8], [8, 6]])
    points, starts = chains(segments)
    lines = [points[a:b] for a, b in zip(starts[:-1], starts[1:], strict=True)]
    got = sorted(
        tuple(sorted(pair)) for line in lines for pair in zip(line, line[1:], strict=False)
    )
    assert got == sorted(tuple(sorted(s)) for s in segments.tolist())
    assert sorted(len(line) for line in lines) == [2, 4, 4]


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def frame(rig, size=256):
    return Camera.framing(rig.neutral(), size, size, 0.05)


def kinds(strokes):
    return {stroke.kind for stroke in strokes}


def test_a_face_has_its_outline_eyes_and_brows(rig):
    strokes = draw_strokes(rig, rig.pose(FaceParameters()), frame(rig))
    assert kinds(strokes) == {"contour", "suggestive", "brow", "iris", "pupil", "lip"}
    outline = np.concatenate([s.points for s in strokes if s.kind == "contour"])
    skin = frame(rig).project(rig.neutral()[rig.parts["skin"]])
    assert outline.min(axis=0) == pytest.approx(skin.min(axis=0), abs=1.0)
    assert all(len(s.points) == len(s.strength) >= 2 for s in strokes)


def test_nothing_shines_through_the_head(rig):
    """From behind there is no eye, brow, nose or mouth."""
    posed = rig.pose(FaceParameters(head=(np.pi, 0, 0), neck=(0, 0, 0)))
    camera = frame(rig)
    strokes = draw_strokes(rig, posed, camera, detail=0)
    assert not kinds(strokes) & {"brow", "iris", "pupil", "lip"}
    places = {
        n: camera.project(posed[i]) for n, i in zip(("nose",), rig.landmarks[-5:-4], strict=True)
    }
    nose = places["nose"]
    drawn = np.concatenate([s.points for s in strokes])
    assert np.linalg.norm(drawn - nose, axis=1).min() > 6


def test_closed_eyes_hide_the_iris(rig):
    open_eyes = draw_strokes(rig, rig.pose(FaceParameters()), frame(rig))
    shut = draw_strokes(rig, rig.pose(FaceParameters({"blink": 5})), frame(rig))

    def length(strokes):
        return sum(len(s.points) for s in strokes if s.kind in ("iris", "pupil"))

    assert length(shut) < 0.15 * length(open_eyes)


@pytest.mark.parametrize("name", ["frontalis", "medialis_frontalis", "brow_furrow", "wince"])
def test_expressions_show_in_lines(rig, name):
    """The creases of an active control are drawn: more suggestive contour than on the face at rest."""  # noqa: E501
    camera = frame(rig)

    def length(aus):
        strokes = draw_strokes(rig, rig.pose(FaceParameters(aus)), camera)
        return sum(
            np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum()
            for s in strokes
            if s.kind == "suggestive"
        )

    assert length({name: 5}) > length({}) + 40


def test_more_detail_more_lines(rig):
    posed = rig.pose(FaceParameters({"smile": 4}, {"age": 0.8}))
    lengths = [
        sum(len(s.points) for s in draw_strokes(rig, posed, frame(rig), detail))
        for detail in range(3)
    ]
    assert lengths[0] < lengths[1] < lengths[2]


def test_mirrored_face_mirrored_drawing(rig):
    camera = Camera(257, 257, (900.0, 900.0), (128.5, 150.0))
    left, right = (
        ink(draw_strokes(rig, rig.pose(FaceParameters({f"grimace_{s}": 5})), camera), 257, 257)
        for s in ("left", "right")
    )
    dark = [np.argwhere(p < 128) for p in (left, right[:, ::-1])]
    from scipy.spatial import cKDTree

    for a, b in (dark, dark[::-1]):
        assert np.mean(cKDTree(a).query(b)[0] < 2.0) > 0.97


HAIRS = ("brow_hair", "lash", "lash_lower")


def test_layers_are_drawn_only_when_asked(rig):
    posed = rig.pose(FaceParameters())
    camera = Camera.framing(rig.curves["hair_long"].points(posed), 512, 512, 0.05)
    plain = kinds(draw_strokes(rig, posed, camera))
    assert not plain & set(rig.curves)
    for layer in rig.curves:
        assert layer in kinds(draw_strokes(rig, posed, camera, layers=(layer,)))
        assert kinds(draw_strokes(rig, posed, camera, layers=(layer,))) <= {
            "contour", "suggestive", layer
        }  # fmt: skip


@pytest.mark.parametrize("layer", HAIRS)
def test_hairs_of_small_drawings_are_not_noise(rig, layer):
    """At 256 px hairs are drawn so far apart that they can be told from each other; a large
    drawing has more of them."""
    posed = rig.pose(FaceParameters())
    count = {}
    for size in (256, 2048):
        strokes = draw_strokes(rig, posed, frame(rig, size), layers=(layer,))
        roots = [s.points[0] for s in strokes if s.kind == layer and len(s.points) <= 5]
        count[size] = len(roots)
        if size == 256 and layer == "lash":
            from scipy.spatial import cKDTree

            assert np.median(cKDTree(roots).query(roots, 2)[0][:, 1]) > 1.5
    assert count[256] < 70
    assert count[2048] > 1.5 * count[256]
    dark = [
        (ink(draw_strokes(rig, posed, frame(rig), layers=layers), 256, 256) < 128).sum()
        for layers in ((), (layer,))
    ]
    assert dark[1] - dark[0] < 450  # pixels


def test_hair_hides_what_lies_behind_it(rig):
    """A bob covers ears and the skull's outline; the face inside it stays as it was."""
    posed = rig.pose(FaceParameters())
    camera = Camera.framing(rig.curves["hair_bob"].points(posed), 400, 400, 0.05)

    def drawn(layers):
        return [
            s
            for s in draw_strokes(rig, posed, camera, layers=("iris", *layers))
            if s.kind in ("contour", "iris")
        ]

    bald, haired = (np.concatenate([s.points for s in drawn(layers)])
                    for layers in ((), ("hair_bob",)))  # fmt: skip
    skull = camera.project(posed[rig.parts["skin"]])[:, 1].min()
    assert bald[:, 1].min() == pytest.approx(skull, abs=1)
    assert haired[:, 1].min() > skull + 30
    ear = np.ptp(bald[:, 0]) - np.ptp(haired[:, 0])
    assert ear > 0.01 * camera.scale[0]
    irises = [sum(len(s.points) for s in drawn(layers) if s.kind == "iris")
              for layers in ((), ("hair_bob",))]  # fmt: skip
    assert irises[0] == irises[1]


@pytest.mark.parametrize("yaw", [0, 40, -70, 120, 180])
@pytest.mark.parametrize("style", ["short", "bob", "long", "bun"])
def test_hair_has_an_outline_from_every_side(rig, style, yaw):
    posed = rig.pose(FaceParameters(head=(np.radians(yaw), 0, 0)))
    shell = rig.curves[f"hair_{style}"].points(posed)
    camera = Camera.framing(shell, 300, 300, 0.1)
    strokes = draw_strokes(rig, posed, camera, layers=(f"hair_{style}",))
    drawn = np.concatenate([s.points for s in strokes if s.kind == f"hair_{style}"])
    seen = camera.project(shell)
    assert drawn.min(axis=0) == pytest.approx(seen.min(axis=0), abs=4)
    assert drawn.max(axis=0)[0] == pytest.approx(seen.max(axis=0)[0], abs=4)


def test_an_unknown_layer_is_named(rig):
    with pytest.raises(ValueError, match="no layer 'lashes'; did you mean 'lash'?"):
        draw_strokes(rig, rig.neutral(), frame(rig), layers=("lashes",))


def test_detail_is_checked(rig):
    with pytest.raises(ValueError, match="detail must be 0, 1 or 2, got 3"):
        draw_strokes(rig, rig.neutral(), frame(rig), detail=3)


def test_ink_is_antialiased_and_where_the_stroke_is():
    line = Stroke(np.array([[10.0, 20.5], [50.0, 20.5]]), np.ones(2), "contour")
    picture = ink([line], 64, 40)
    assert picture.shape == (40, 64)
    assert picture.dtype == np.uint8
    row = picture[:, 30].astype(int)
    assert row.argmin() in (19, 20, 21)
    assert (255 - row).sum() / 255 == pytest.approx(1.6, abs=0.5)  # the style's width
    assert (picture[:, :8] == 255).all()
