"""Line drawings of the face: what must be there, what must not."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from dataset_gen import draw_strokes
from dataset_gen.linework import ink
from dataset_gen.linework.lines import DETAILS, KINDS, LEAST, WAYS, Stroke
from facs_rig import Camera, FaceParameters, load_rig


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
    hull = seen[ConvexHull(seen).vertices]
    away = np.linalg.norm(hull[:, None] - drawn, axis=2).min(axis=1)
    assert (away < 5).mean() > (0.7 if style == "bun" else 0.85)  # the rest is behind the head


@pytest.mark.parametrize("kind", sorted(LEAST))
def test_every_level_of_detail_draws_more_of_every_kind(rig, kind):
    assert DETAILS == ("sparse", "medium", "rich")
    posed = rig.pose(FaceParameters({"smile": 4, "frontalis": 3}, {"age": 0.8}))
    lengths = [
        sum(len(s.points) for s in draw_strokes(rig, posed, frame(rig), detail, (), (kind,)))
        for detail in range(3)
    ]
    assert 0 < lengths[0] < lengths[1] < lengths[2]


def test_only_the_kinds_that_are_asked_for(rig):
    posed = rig.pose(FaceParameters({"smile": 4}))
    assert kinds(draw_strokes(rig, posed, frame(rig), layers=(), kinds=KINDS)) == set(KINDS)
    for kind in KINDS:
        assert kinds(draw_strokes(rig, posed, frame(rig), layers=(), kinds=(kind,))) == {kind}
    assert not draw_strokes(rig, posed, frame(rig), layers=(), kinds=())


def test_the_levels_of_the_thesis_take_in_more_kinds():
    """A level has what the one before has and more; every way knows an outline and every level."""
    for before, after in pairwise(WAYS["levels"]):
        assert set(before) < set(after)
    for ways in WAYS.values():
        assert len(ways) == len(DETAILS)
        for kinds in ways:
            assert "contour" in kinds
            assert set(kinds) <= set(KINDS)


def test_a_contour_is_the_same_whatever_is_drawn_beside_it(rig):
    posed = rig.pose(FaceParameters({"smile": 4}, head=(0.5, 0.1, 0)))
    camera = Camera.framing(posed, 256, 256, 0.05, 1.0)
    alone = draw_strokes(rig, posed, camera, layers=(), kinds=("contour",))
    beside = draw_strokes(rig, posed, camera, layers=(), kinds=KINDS)
    beside = [stroke for stroke in beside if stroke.kind == "contour"]
    assert len(alone) == len(beside) > 5
    for one, two in zip(alone, beside, strict=True):
        np.testing.assert_array_equal(one.points, two.points)


def test_valleys_are_folds_and_ridges_stand_out(rig):
    """The folds of a raised brow are valleys; the bridge of the nose is no valley."""
    camera = frame(rig)

    def length(aus, kind):
        strokes = draw_strokes(rig, rig.pose(FaceParameters(aus)), camera, 1, (), (kind,))
        return sum(np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum() for s in strokes)

    assert length({"frontalis": 5}, "valley") > length({}, "valley") + 100


@pytest.mark.parametrize("distance", [np.inf, 0.8])
def test_strokes_know_the_surface_under_them(rig, distance):
    posed = rig.pose(FaceParameters({"smile": 3}, head=(0.4, 0.1, 0)))
    camera = Camera.framing(posed, 300, 300, 0.05, distance)
    layers = ("brow", "iris", "pupil", "lip", "lip_line", "hairline", "hair_bob")
    for stroke in draw_strokes(rig, posed, camera, 1, layers, KINDS):
        if stroke.kind == "hair_bob":
            assert stroke.surface is None
            continue
        triangle, weights = stroke.surface
        assert weights.min() > -1e-5
        assert weights.sum(axis=1) == pytest.approx(1, abs=1e-5)
        places = np.einsum("kc,kcd->kd", weights, posed[rig.triangles[triangle]])
        off = 0.5 if stroke.kind == "brow" else 1e-2  # pixels; edges of brows lie on hairs
        assert camera.project(places) == pytest.approx(stroke.points, abs=off)


def test_an_unknown_kind_is_named(rig):
    with pytest.raises(ValueError, match="no kind of line 'valey'; did you mean 'valley'?"):
        draw_strokes(rig, rig.neutral(), frame(rig), kinds=("valey",))


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
