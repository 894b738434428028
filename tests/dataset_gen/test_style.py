"""Styles: stored and read again, sampled sensibly, and the marks that a hand makes of strokes."""

import json
from collections import Counter
from dataclasses import fields, replace

import numpy as np
import pytest

from dataset_gen import (
    STYLES,
    Stroke,
    Style,
    draw_page,
    draw_strokes,
    loosen,
    sample_style,
    stroke_lists,
    stroke_of,
    style_named,
)
from dataset_gen.linework import ink
from dataset_gen.linework.marks import drift
from dataset_gen.linework.paper import through
from dataset_gen.shading import construction, hatches
from dataset_gen.styles import LOOKS, PAPERS
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.common.polylines import Polylines
from facs_rig.common.settings import settings_of


@pytest.fixture(scope="module")
def face():
    """A rig, a posed face, its camera and its strokes."""
    rig = load_rig()
    parameters = FaceParameters({"smile": 4.0}, head=(np.radians(12), 0.05, 0))
    posed = rig.pose(parameters)
    camera = Camera.framing(rig.turn(rig.neutral(), parameters), 256, 256, 0.06)
    return rig, posed, camera, draw_strokes(rig, posed, camera)


def line(length=200.0, kind="contour", v=50.0):
    u = np.linspace(10, 10 + length, int(length) + 1)
    return Stroke(np.stack([u, np.full_like(u, v)], axis=1), np.ones(len(u)), kind)


def lengths(strokes):
    return np.array([np.hypot(*np.diff(s.points, axis=0).T).sum() for s in strokes])


def test_every_style_is_read_as_it_was_stored():
    rng = np.random.default_rng(0)
    for style in [*STYLES.values(), *(sample_style(rng) for _ in range(200))]:
        assert Style.from_json(json.loads(json.dumps(style.to_json()))) == style


def test_what_an_older_file_does_not_say_is_as_it_was_then():
    stored = {"width": 1.9, "fading": 0.3, "wobble": 0.4, "passes": 2, "dropout": 0.05,
              "layers": ["brow", "lip"]}  # fmt: skip
    style = Style.from_json(stored)
    assert {name: style.to_json()[name] for name in stored} == stored
    assert style == Style(1.9, 0.3, 0.4, 2, 0.05, ("brow", "lip"))


def test_a_field_that_no_style_has_is_named():
    with pytest.raises(ValueError, match="a style has no 'widht'; did you mean 'width'?"):
        Style.from_json({"widht": 2})


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"width": 0}, "a style's width lies between 0.2 and 12, not at 0"),
        ({"width": float("nan")}, "width is a number, not nan"),
        ({"passes": 0}, "passes lies between 1 and 6"),
        ({"paper": 0.2}, "paper lies between 0.75 and 1"),
        ({"grain": -0.1}, "grain lies between 0 and 1"),
        ({"tilt": (0.5, 0.0)}, "tilt must be two numbers of at most 0.08"),
        ({"tilt": (0.0,)}, "tilt must be two numbers"),
    ],
)
def test_impossible_styles_are_refused(change, sentence):
    with pytest.raises(ValueError, match=sentence):
        Style(**change)


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match="no style 'pencill'; did you mean 'pencil'?"):
        style_named("pencill")
    with pytest.raises(ValueError, match="no look 'crayon'"):
        sample_style(np.random.default_rng(0), look="crayon")
    with pytest.raises(ValueError, match="no paper 'tonned'; did you mean 'toned'?"):
        sample_style(np.random.default_rng(0), paper="tonned")


def test_every_number_has_its_range():
    numbers = {f.name for f in fields(Style) if f.name not in ("layers", "look", "tilt", "seed")}
    assert numbers == set(settings_of(Style))


def test_looks_and_papers_come_by_their_odds():
    rng = np.random.default_rng(4)
    styles = [sample_style(rng) for _ in range(2000)]
    counts = Counter(style.look for style in styles)
    total = sum(odds for odds, _ in LOOKS.values())
    for look, (odds, _) in LOOKS.items():
        assert counts[look] / 2000 == pytest.approx(odds / total, abs=0.03)
    white = [s for s in styles if s.paper == 1 and not s.noise and not s.shadow]
    assert len(white) / 2000 == pytest.approx(PAPERS["white"][0], abs=0.04)
    for name in ("hatching", "construction", "breaks", "grain", "shadow", "noise", "blur"):
        share = np.mean([getattr(style, name) > 0 for style in styles])
        assert 0.03 < share < 0.6, name
    assert any(any(style.tilt) for style in styles)
    assert {layer for style in styles for layer in style.layers} >= {"brow", "hair_bob", "lash"}


def test_the_same_generator_gives_the_same_style():
    one, two = (sample_style(np.random.default_rng([3, 7])) for _ in range(2))
    assert one == two
    assert sample_style(np.random.default_rng(0), "marker", "photo").look == "marker"


def test_a_clean_hand_leaves_strokes_as_they_are():
    strokes = [line(), line(20, "lip")]
    assert loosen(strokes, Style(), np.random.default_rng(0)) == strokes
    assert loosen([], STYLES["rough"], np.random.default_rng(0)) == []


@pytest.mark.parametrize("name", STYLES)
def test_the_same_generator_makes_the_same_marks(name, face):
    rig, posed, camera, strokes = face
    one, two = (
        draw_page(strokes, rig, posed, camera, STYLES[name], np.random.default_rng(5))
        for _ in range(2)
    )
    np.testing.assert_array_equal(one.picture, two.picture)
    assert stroke_lists(one.strokes) == stroke_lists(two.strokes)


@pytest.mark.parametrize("name", STYLES)
def test_every_style_draws_a_face_that_can_be_read(name, face):
    """Its lines are clearly darker than the page beside them, and where the clean drawing's are."""
    rig, posed, camera, strokes = face
    style = STYLES[name]
    page = draw_page(strokes, rig, posed, camera, style, np.random.default_rng(1))
    picture = page.picture.astype(float)
    assert page.picture.shape == (256, 256)
    assert page.picture.dtype == np.uint8
    clean = np.concatenate([through(page.matrix, s.points) for s in strokes])
    u, v = np.clip(np.floor(clean).astype(int), 3, 252).T
    near = np.min([picture[v + j, u + i] for i in range(-2, 3) for j in range(-2, 3)], axis=0)
    paper = np.quantile(picture, 0.9)
    assert np.mean(near < 0.75 * paper) > (0.75 if style.breaks else 0.9)
    assert paper >= 255 * 0.75 * (1 - style.shadow)
    if style.paper == 1:
        assert np.median(picture) == 255


def test_left_out_strokes_are_short_ones():
    strokes = [line(20, v=v) for v in range(400)] + [line(200, v=v) for v in range(50)]
    kept = loosen(strokes, Style(dropout=0.3), np.random.default_rng(1))
    assert (lengths(kept) > 100).sum() == 50
    assert (lengths(kept) < 100).sum() == pytest.approx(280, abs=35)


def test_broken_lines_lose_their_share():
    rng = np.random.default_rng(2)
    strokes = [line(200, v=v) for v in range(60)]
    parts = loosen(strokes, Style(breaks=0.25), rng)
    assert lengths(parts).sum() / (60 * 200) == pytest.approx(0.75, abs=0.03)
    assert len(parts) > 200
    at = np.concatenate([s.points for s in parts])
    assert at[:, 0].min() >= 10 - 1e-6
    assert at[:, 0].max() <= 210 + 1e-6
    short = [line(15)] * 20
    assert len(loosen(short, Style(breaks=0.5), rng)) == 20  # gaps would swallow them


def test_pulls_overlap_and_cover_the_line():
    parts = loosen([line(400)], Style(pull=60), np.random.default_rng(3))
    assert len(parts) == 7
    spans = sorted((s.points[0, 0], s.points[-1, 0]) for s in parts)
    assert spans[0][0] == pytest.approx(10)
    assert spans[-1][1] == pytest.approx(410)
    assert all(ahead[0] < behind[1] for behind, ahead in zip(spans, spans[1:], strict=False))


def test_overshoot_goes_straight_on():
    turn = np.linspace(0, np.pi / 2, 90)
    arc = Stroke(100 * np.stack([np.cos(turn), np.sin(turn)], axis=1), np.ones(90), "contour")
    drawn = [loosen([arc], Style(overshoot=12), np.random.default_rng(k))[0] for k in range(40)]
    beyond = np.array([s.points[-1, 0] for s in drawn])  # the arc ends at u = 0, going left
    assert beyond.max() <= 0.1
    assert -12.1 <= beyond.min() < -5
    assert all(abs(s.points[-1, 1] - 100) < 0.5 for s in drawn)


def test_a_hand_wanders_as_far_as_its_wobble_says():
    def off(wobble, length):
        strokes = [line(length) for _ in range(150)]
        drawn = loosen(strokes, Style(wobble=wobble), np.random.default_rng(4))
        return np.std(np.concatenate([s.points[:, 1] for s in drawn]) - 50)

    assert off(1.0, 150) == pytest.approx(np.hypot(0.46, 0.45), rel=0.1)
    assert off(2.0, 150) == pytest.approx(2 * off(1.0, 150), rel=1e-6)
    assert off(1.0, 18) < 0.6 * off(1.0, 150)  # short lines are drawn with care


def test_drift_is_smooth_and_normal():
    n = 4000
    along = np.tile(np.arange(0, 100, 0.5), n // 200)
    number = np.repeat(np.arange(n // 200), 200)
    noise = drift(np.full(n // 200, 99.5), number, along, 10.0, 3, np.random.default_rng(5))
    assert noise.std() == pytest.approx(1, abs=0.15)
    inside = np.diff(noise, axis=0)[number[1:] == number[:-1]]
    assert np.abs(inside).max() < 0.35


def test_pressure_only_lightens():
    drawn = loosen([line(300)], Style(pressure=0.7), np.random.default_rng(6))[0]
    assert 0.3 - 1e-9 <= drawn.strength.min() < 0.8
    assert drawn.strength.max() <= 1


def test_passes_go_over_the_same_line_and_pupils_are_drawn_once():
    strokes = [line(100), line(30, "pupil")]
    drawn = loosen(strokes, Style(passes=3, wobble=0.1), np.random.default_rng(7))
    assert Counter(s.kind for s in drawn) == {"contour": 3, "pupil": 1}
    assert lengths(drawn[:3]).min() > 70
    assert len({len(s.points) for s in drawn[:3]}) > 1


def test_strokes_are_stored_as_lists():
    drawn = loosen([line(60), line(30, "lip")], STYLES["pencil"], np.random.default_rng(8))
    stored = json.loads(json.dumps(stroke_lists(drawn)))
    for kept, original in zip(map(stroke_of, stored), drawn, strict=True):
        assert kept.kind == original.kind
        np.testing.assert_allclose(kept.points, original.points, atol=0.051)
        np.testing.assert_allclose(kept.strength, original.strength, atol=0.0051)
    sparse = stroke_lists(drawn, step=5)
    assert sum(len(s["points"]) for s in sparse) < 0.6 * sum(len(s["points"]) for s in stored)
    assert [s["points"][-1] for s in sparse] == [s["points"][-1] for s in stored]
    assert stroke_lists([], step=2) == []
    with pytest.raises(ValueError, match="no stroke"):
        stroke_of({"points": [[1, 2]]})
    with pytest.raises(ValueError, match="2 points but 1 strengths"):
        stroke_of({"points": [[1, 2], [3, 4]], "strength": [1], "kind": "lip", "width": 1})


def test_any_strokes_in_any_style():
    """Dots, doubled points, loops, lines off the page: nothing is lost, nothing goes wrong."""
    rng = np.random.default_rng(10)
    odd = [np.zeros((0, 2)), [[5, 5]], [[5, 5], [5, 5]], [[9, 9], [9, 9], [12, 9]],
           [[-50, 3], [-9, 4]], [[0, 0], [40, 0], [40, 40], [0, 0]], [[1e4, 0], [1e4, 9]],
           rng.uniform(0, 64, (40, 2)), [[3, 3], [3.001, 3]]]  # fmt: skip
    kinds = ("contour", "pupil", "hatch", "construction", "lash")
    strokes = [
        Stroke(np.array(points, float), rng.random(len(points)), kinds[k % len(kinds)])
        for k, points in enumerate(odd * 3)
    ]
    for _ in range(60):
        style = sample_style(rng)
        drawn = loosen(strokes, style, rng)
        for s in drawn:
            assert len(s.points) == len(s.strength) > 1
            assert np.isfinite(s.points).all()
            assert ((s.strength >= 0) & (s.strength <= 1)).all()
        assert ink(drawn, 64, 48, style).shape == (48, 64)


def test_lengths_along_polylines():
    lines = Polylines.of([np.array([[0, 0], [3, 4], [3, 10]]), np.array([[5, 5]]),
                          np.array([[1, 1], [1, 3]])])  # fmt: skip
    np.testing.assert_allclose(lines.length, [11, 0, 2])
    np.testing.assert_array_equal(lines.line, [0, 0, 0, 1, 2, 2])
    at, value = lines.at(np.array([0, 0, 1, 2, 2]), np.array([2.5, 99, 3, -1, 1]), np.arange(6.0))
    np.testing.assert_allclose(at, [[1.5, 2], [3, 10], [5, 5], [1, 1], [1, 2]], atol=1e-9)
    np.testing.assert_allclose(value, [0.5, 2, 3, 4, 4.5], atol=1e-9)


def shaded(face, **changes):
    rig, posed, camera, _ = face
    style = Style(**{"hatching": 0.6, **changes})
    return hatches(rig, posed, camera, style, np.random.default_rng(9))


def test_hatches_lie_in_the_shade_on_the_skin(face):
    rig, posed, camera, _ = face
    skin = camera.project(posed[rig.parts["skin"]])
    nose = camera.project(posed[rig.landmarks[LANDMARKS.index("nose_tip")]])
    for light_from in (-50, 50):
        points = np.concatenate([s.points for s in shaded(face, light=light_from)])
        assert len(points) > 150
        side = points[:, 0] - nose[0]
        assert np.mean(side * light_from < 0) > 0.8  # away from the light
        assert (points >= skin.min(axis=0) - 2).all()
        assert (points <= skin.max(axis=0) + 2).all()
    little, much = (lengths(shaded(face, hatching=h)).sum() for h in (0.3, 0.9))
    assert much > 1.5 * little
    assert shaded(face, hatching=0) == []


def test_hatches_bend_with_the_form_and_do_not_cross_eyes(face):
    rig, posed, camera, _ = face
    drawn = [s for s in shaded(face, hatching=1.0) if len(s.points) > 15]
    sag = []
    for s in drawn:
        chord = s.points[-1] - s.points[0]
        chord = chord / np.linalg.norm(chord)
        away = (s.points - s.points[0]) @ np.array([-chord[1], chord[0]])
        sag.append(away[np.abs(away).argmax()] / lengths([s])[0])
    assert np.mean(np.abs(sag) > 0.015) > 0.5
    pupils = camera.project(posed[rig.landmarks[[LANDMARKS.index(f"pupil_{s}")
                                                 for s in ("left", "right")]]])  # fmt: skip
    points = np.concatenate([s.points for s in shaded(face, hatching=1.0)])
    assert np.linalg.norm(points[:, None] - pupils, axis=2).min() > 2


def test_hatches_stand_apart(face):
    """They are cuts by planes of one family: next to each other, not through each other."""
    places = np.array([s.points[len(s.points) // 2] for s in shaded(face, hatching=1.0)])
    apart = np.linalg.norm(places[:, None] - places, axis=2) + 1e3 * np.eye(len(places))
    assert np.median(apart.min(axis=1)) > 1.5


def test_hair_keeps_hatches_off(face):
    rig, posed, camera, _ = face
    bald, haired = (
        np.concatenate([s.points for s in shaded(face, hatching=1.0, layers=layers)])
        for layers in ((), ("hair_long",))
    )
    assert haired[:, 1].min() > bald[:, 1].min()
    assert len(haired) < len(bald)


@pytest.mark.parametrize("head", [(0, 0, 0), (35, 0, 0), (-20, 15, 12)])
def test_construction_lines_meet_on_the_face(head):
    rig = load_rig()
    parameters = FaceParameters(head=tuple(np.radians(head)))
    posed = rig.pose(parameters)
    camera = Camera.framing(posed, 256, 256, 0.06)
    at = dict(zip(LANDMARKS, camera.project(posed[rig.landmarks]), strict=True))
    eyes, centre, oval = (s.points for s in construction(rig, posed, camera))

    def distance(points, place):
        return np.linalg.norm(points - place, axis=1).min()

    for side in ("left", "right"):
        assert distance(eyes, at[f"pupil_{side}"]) < 12
    assert distance(centre, at["nose_root"]) < 8
    assert distance(centre, at["chin"]) < 22
    assert distance(oval, at["chin"]) < 25
    assert np.ptp(oval[:, 1]) > 0.55 * np.ptp(camera.project(posed)[:, 1])


def test_hatching_and_construction_only_add(face):
    rig, posed, camera, strokes = face
    style = replace(STYLES["ink"], hatching=0.5, construction=0.3)
    page = draw_page(strokes, rig, posed, camera, style, np.random.default_rng(2))
    kinds = Counter(s.kind for s in page.strokes)
    assert kinds["construction"] == 3
    assert kinds["hatch"] > 10
    assert sum(n for k, n in kinds.items() if k not in ("construction", "hatch")) == len(strokes)
