"""Pen strokes on a page: where they lie, how they look, and that the detector reads them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addon import strokes_page
from addon.drawing import Drawing, load_drawing
from addon.sketches.render import FOLDER as SKETCHES
from addon.strokes_page import FRONT, PenStroke, page_of_strokes, plane_of
from classifiers import load_detector
from facs_rig.common.errors import InputError

RIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
TOP = np.eye(3)
VIEWS = {"front": FRONT, "right": RIGHT, "top": TOP}

seeds = st.integers(0, 10**6)
moves = st.floats(-100, 100)


def scribble(seed: int, count: int = 6) -> list[PenStroke]:
    """Bent lines within a square metre, and a dot."""
    rng = np.random.default_rng(seed)
    strokes = []
    for _ in range(count):
        turn = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, 0.15, 30))
        line = rng.uniform(0, 1, 2) + 0.02 * np.cumsum([np.cos(turn), np.sin(turn)], axis=1).T
        strokes.append(PenStroke(line, rng.uniform(0.002, 0.02, 30), rng.uniform(0.3, 1)))
    return [*strokes, PenStroke(rng.uniform(0, 1, (1, 2)), 0.03)]


def moved(strokes: list[PenStroke], scale: float, by, mirror: bool = False) -> list[PenStroke]:
    factor = scale * np.array([-1 if mirror else 1, 1])
    return [PenStroke(s.points * factor + by, s.widths * scale, s.opacity) for s in strokes]


def ink_centre(page) -> np.ndarray:
    """(2,) mean place of the ink, pixels with centres at .5."""
    v, u = np.indices(page.shape) + 0.5
    ink = 1 - page
    return np.array([(u * ink).sum(), (v * ink).sum()]) / ink.sum()


# --- the page -------------------------------------------------------------------------------------


@given(seeds, st.floats(-6, 6), moves, moves)
def test_moved_and_scaled_strokes_give_the_same_page(seed, power, x, y):
    plain, to_plane = page_of_strokes(scribble(seed), 256)
    scale = 10**power
    other, theirs = page_of_strokes(moved(scribble(seed), scale, scale * np.array([x, y])), 256)
    assert other.shape == plain.shape
    np.testing.assert_allclose(other, plain, atol=1e-3)
    expected = scale * (to_plane + np.array([[0, 0, x], [0, 0, y]]))
    np.testing.assert_allclose(theirs, expected, rtol=1e-6, atol=1e-9 * scale)


@given(seeds)
def test_mirrored_strokes_give_the_mirrored_page(seed):
    plain, _ = page_of_strokes(scribble(seed), 256)
    other, _ = page_of_strokes(moved(scribble(seed), 1.0, 0.0, mirror=True), 256)
    np.testing.assert_allclose(other[:, ::-1], plain, atol=1e-3)


@given(moves, moves, st.floats(0.01, 10))
def test_ink_lies_where_to_plane_says(x, y, size):
    """Four dots frame the page; the centre of a fifth, off the middle, is known."""
    corners = size * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]]) + (x, y)
    place = np.array([x, y]) + size * np.array([0.3, 0.6])
    strokes = [PenStroke(c[None], 0.02 * size) for c in [*corners, place]]
    page, to_plane = page_of_strokes(strokes, 200)
    v, u = np.indices(page.shape) + 0.5
    around = np.stack([u, v, np.ones_like(u)], axis=-1) @ to_plane.T
    page = np.where(np.abs(around - place).max(axis=2) < 0.2 * size, page, 1)
    found = to_plane @ [*ink_centre(page), 1]
    np.testing.assert_allclose(found, place, atol=1e-3 * size)
    assert page.min() < 0.05


@given(seeds)
def test_the_longest_side_and_the_margin_are_as_asked(seed):
    strokes = [PenStroke(s.points, 1e-6) for s in scribble(seed)]  # the thinnest: points are edges
    page, _ = page_of_strokes(strokes, 300, margin=0.1)
    assert max(page.shape) == 300
    for axis, side in enumerate(page.shape):
        inked = np.flatnonzero((page < 1).any(axis=1 - axis))
        assert inked[0] == pytest.approx(30, abs=2)
        assert inked[-1] == pytest.approx(side - 31, abs=2)


def lines_at(heights, widths, **more) -> list[PenStroke]:
    return [
        PenStroke(np.array([[0.0, y], [1.0, y]]), w, **more)
        for y, w in zip(heights, widths, strict=True)
    ]


def test_widths_are_the_pens_within_limits():
    page, to_plane = page_of_strokes(lines_at((0.0, 0.3, 0.6), (0.0, 0.01, 0.5)), 1000)
    thick = (1 - page[:, 500]).astype(float)
    rows = [(0.6, 10.0), (0.3, 0.01 / to_plane[0, 0]), (0.0, 1.5)]
    for y, expected in rows:
        v = int((y - to_plane[1, 2]) / to_plane[1, 1])
        assert thick[v - 40 : v + 40].sum() == pytest.approx(expected, rel=0.02)
    ends = np.array([[0.0, 0.9], [1.0, 0.9]])
    swelling = PenStroke(ends, np.array([0.0017, 0.0095]))
    page, _ = page_of_strokes([swelling, *lines_at((0.0,), (0.002,))], 1000)
    left, right = ((1 - page[:200, u]).sum() for u in (150, 850))
    assert right > 3 * left


def test_opacity_is_tone_and_what_is_transparent_does_not_count():
    faint = lines_at((0.0,), (0.02,), opacity=0.4)
    page, _ = page_of_strokes([*lines_at((0.5,), (0.02,)), *faint], 500)
    assert page.dtype == np.float32
    assert page[:, 250].min() == pytest.approx(0)
    assert page[-100:, 250].min() == pytest.approx(0.6, abs=1e-3)
    far = PenStroke(np.array([[50.0, 50.0]]), 1.0, 0.0)
    same, _ = page_of_strokes([*lines_at((0.5,), (0.02,)), far, *faint], 500)
    np.testing.assert_array_equal(same, page)
    along = PenStroke(np.array([[0.0, 0.0], [1.0, 0.0]]), 0.02, np.array([1.0, 0.0]))
    middle = page_of_strokes([along], 500)[0].min(axis=0)
    assert middle[40] < 0.1 and middle[250] == pytest.approx(0.5, abs=0.02) and middle[460] > 0.9


@pytest.mark.parametrize("width", [0.0, 0.01, 3.0])
def test_a_single_dot_is_a_page(width):
    page, to_plane = page_of_strokes([PenStroke(np.array([[2.0, 3.0]]), width)])
    np.testing.assert_allclose(to_plane @ [*ink_centre(page), 1], (2, 3), atol=1e-6)
    assert page.min() < 0.05 and (1 - page).sum() > 1.5


def test_points_in_one_place_are_a_dot():
    dot = PenStroke(np.full((5, 2), 0.5), np.full(5, 0.05))
    page, _ = page_of_strokes([dot, *lines_at((0.0, 1.0), (0.01, 0.01))], 400)
    h, w = page.shape
    spot = page[h // 2 - 20 : h // 2 + 20, w // 2 - 20 : w // 2 + 20]
    assert (1 - spot).sum() == pytest.approx(np.pi * 2**2, rel=0.05)  # 4 px wide at most


def test_a_straight_line_is_a_page_without_margin_too():
    upright = PenStroke(np.array([[0.0, 0.0], [0.0, 1.0]]), 0.01)
    page, _ = page_of_strokes([upright], 100, margin=0.0)
    assert page.shape == (100, 1) and page.max() < 0.3


@pytest.mark.parametrize(
    "strokes",
    [[], [PenStroke(np.zeros((0, 2)), np.zeros(0))], [PenStroke(np.zeros((3, 2)), 1.0, 0.0)]],
    ids=["none", "empty", "transparent"],
)
def test_nothing_drawn_is_said_in_a_sentence(strokes):
    with pytest.raises(InputError, match="^The Grease Pencil drawing 'Jo' has no strokes .*\\.$"):
        page_of_strokes(strokes, name="The Grease Pencil drawing 'Jo'")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("where", ["points", "widths", "opacity"])
def test_numbers_that_are_none_are_refused(bad, where):
    values = {"points": np.zeros((2, 2)), "widths": np.ones(2), "opacity": np.ones(2)}
    values[where] = values[where].copy()
    values[where].flat[-1] = bad
    with pytest.raises(InputError, match="^'Jo' has points that are nowhere"):
        page_of_strokes([PenStroke(**values)], name="'Jo'")
    with pytest.raises(InputError, match="^'Jo' has points that are nowhere"):
        plane_of(np.array([[0, 0, 0], [1, 0, 0], [0, 0, bad]]), "'Jo'")


def test_a_page_that_cannot_be_is_refused():
    for size, margin in ((0, 0.06), (100, 0.5), (100, -0.1)):
        with pytest.raises(ValueError, match="cannot have a margin"):
            page_of_strokes(scribble(0), size, margin)


# --- the plane ------------------------------------------------------------------------------------


def tilted(view, degrees: float, axis: int) -> np.ndarray:
    """A view (3, 3) turned about one of its own rows."""
    a, b = (k for k in range(3) if k != axis)
    turn = np.eye(3)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn[[a, a, b, b], [a, b, a, b]] = c, -s, s, c
    return turn @ view


def circle(view, at=(0.0, 0.0, 0.0), noise: float = 0.0) -> np.ndarray:
    """(65, 3) a circle, the last point a mark above it, in the plane of a view."""
    angle = np.linspace(0, 2 * np.pi, 64)
    flat = np.c_[np.cos(angle), np.sin(angle)]
    flat = np.concatenate([flat, [[0.2, 1.5]]])
    depth = noise * np.random.default_rng(0).standard_normal(65)
    return np.c_[flat, depth] @ view + at


@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("name", VIEWS)
def test_a_circle_comes_back_upright(name, noise):
    points = circle(VIEWS[name], (3.0, -2.0, 1.0), noise)
    plane = plane_of(points)
    np.testing.assert_array_equal(plane, VIEWS[name])  # exactly, whatever the depth
    flat = points @ plane[:2].T
    page, to_plane = page_of_strokes([PenStroke(flat[:-1], 0.02), PenStroke(flat[-1:], 0.05)], 400)
    mark = to_plane @ [*ink_centre(np.where(np.arange(len(page))[:, None] < 50, page, 1)), 1]
    np.testing.assert_allclose(mark, flat[-1], atol=0.02)
    assert flat[-1, 1] > flat[:-1, 1].max() and flat[-1, 0] > flat[:-1, 0].mean()


@given(st.sampled_from(sorted(VIEWS)), st.floats(-9, 9), st.sampled_from([0, 1]), seeds)
def test_nearly_an_axis_is_the_axis(name, degrees, axis, seed):
    points = circle(tilted(VIEWS[name], degrees, axis))
    rng = np.random.default_rng(seed)
    np.testing.assert_array_equal(plane_of(rng.permutation(points)), VIEWS[name])


@given(st.floats(-180, 180), st.floats(-75, 75), moves)
def test_any_plane_is_a_view_with_up_on_top(yaw, pitch, at):
    view = tilted(tilted(FRONT, pitch, 0) @ FRONT.T, 0, 0) @ tilted(FRONT, yaw, 1)
    plane = plane_of(circle(view, at))
    np.testing.assert_allclose(plane @ plane.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(plane) == pytest.approx(1)  # seen from one side, not mirrored
    assert plane[2] @ strokes_page.SEEN_FROM >= -1e-9
    if plane[2, 2] < 1:
        assert plane[0, 2] == pytest.approx(0) and plane[1, 2] > 0  # level, and up
    near = np.abs(view[2]).max()
    if near < strokes_page.AXIS - 1e-6:
        assert abs(plane[2] @ view[2]) == pytest.approx(1)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.ones((1, 3)),
        np.ones((5, 3)),
        np.array([[0.0, 0, 0], [1, 2, 3]]),
        np.array([[0.0, 0, 0], [1, 2, 3]] * 4),
        np.linspace((0.0, 1.0, 2.0), (5.0, -1.0, 0.5), 20),
        np.linspace((0.0, 1.0, 2.0), (5.0, -1.0, 0.5), 20).astype(np.float32),
    ],
    ids=["none", "one", "one place", "two", "two places", "a line", "a line in float32"],
)
def test_what_has_no_plane_is_seen_from_the_front(points):
    np.testing.assert_array_equal(plane_of(points), FRONT)


# --- read by the detector -------------------------------------------------------------------------


def pen_of(name: str) -> list[PenStroke]:
    """The strokes of a sketch that ships, a metre on its side.

    Most are outlines as a tablet's pen leaves them, there on one side and back on the other: the
    middle of both is where the pen went. Some are curves with a width.
    """
    strokes = []
    for path in re.findall(r"<path[^>]*>", (SKETCHES / f"{name}.svg").read_text()):
        text = re.search(r' d="([^"]*)"', path)[1]
        points = np.array(re.findall(r"-?[\d.]+", text), float).reshape(-1, 2)
        width = re.search(r'stroke-width="([\d.]+)"', path)
        if width:
            assert re.fullmatch("MC+", re.sub(r"[^A-Za-z]", "", text))
            t = np.linspace(0, 1, 20)[:, None]
            curves = [points[k : k + 4] for k in range(0, len(points) - 1, 3)]
            points = np.concatenate(
                [
                    a * (1 - t) ** 3 + 3 * b * t * (1 - t) ** 2 + 3 * c * t**2 * (1 - t) + d * t**3
                    for a, b, c, d in curves
                ]
            )
            widths = np.full(len(points), float(width[1]))
        else:
            there, back = points[: len(points) // 2], points[::-1][: len(points) // 2]
            points, across = (there + back) / 2, there - back
            along = np.gradient(points, axis=0)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            widths = np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
        strokes.append(PenStroke((points - 384) * (1, -1) / 768, widths / 768))
    return strokes


@pytest.mark.parametrize("name", [path.stem for path in sorted(SKETCHES.glob("*.svg"))])
def test_the_strokes_of_a_sketch_are_read_as_its_picture_is(name):
    page, to_plane = page_of_strokes(pen_of(name))
    strokes = load_detector().detect(Drawing.of(page).image)
    picture = load_detector().detect(load_drawing(SKETCHES / f"{name}.png").image)
    assert strokes.face_probability > 0.9
    # Two renderings of one drawing may differ over what is doubtful, and over nothing else.
    for one, other in ((strokes, picture), (picture, strokes)):
        clear = [n for n, on in one.active.items() if on and one.probabilities[n] > 0.6]
        assert all(other.active[action] for action in clear)
        for action in clear:
            expected = pytest.approx(one.intensities[action], abs=0.4)
            assert other.intensities[action] == expected
    assert strokes.active["smile"] is (name == "smiling_woman")
    np.testing.assert_allclose(strokes.head, picture.head, atol=np.radians(2))
    # What is found on the page is where it was drawn.
    for mark in ("pupil_left", "nose_tip", "chin"):
        u, v = picture.landmarks[mark]
        there = to_plane @ [*strokes.landmarks[mark], 1]
        np.testing.assert_allclose(there, ((u - 384) / 768, (384 - v) / 768), atol=0.015)
