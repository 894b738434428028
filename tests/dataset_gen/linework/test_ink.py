"""Ink on paper: coverage against areas and shapes that are known otherwise, and what pages do."""

import numpy as np
import pytest
from skimage.draw import disk, polygon

from dataset_gen import Stroke, Style
from dataset_gen.linework import ink
from dataset_gen.linework.ink import coverage
from dataset_gen.linework.paper import _tile, light, on_paper, through, tilt_matrix, tooth

FINER = 16


def stroke(points, strength=1.0, kind="contour", width=1.0):
    points = np.array(points, float)
    return Stroke(points, np.full(len(points), strength), kind, width)


def bar(begin, end, radius, size):
    """A straight line with flat ends, filled at FINER times the size and averaged."""
    begin, end = np.array(begin), np.array(end)
    along = (end - begin) / np.linalg.norm(end - begin)
    side = radius * np.array([-along[1], along[0]])
    corners = np.array([begin + side, end + side, end - side, begin - side]) * FINER - 0.5
    fine = np.zeros((size * FINER, size * FINER), np.float32)
    fine[polygon(corners[:, 1], corners[:, 0], fine.shape)] = 1
    return fine.reshape(size, FINER, size, FINER).mean(axis=(1, 3))


@pytest.mark.parametrize("degrees", [0, 13, 30, 45, 71, 90, 155])
@pytest.mark.parametrize("width", [0.4, 1.0, 1.6, 3.7, 8.0])
def test_a_straight_stroke_covers_its_area(degrees, width):
    """Length times width, and a round end of pi r² for strokes that are wider than a pixel."""
    along = 60 * np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    begin = np.array([64.3, 63.8]) - along / 2
    short, long = (
        coverage([begin, begin + share * along], width / 2, 128, 128).sum() for share in (0.5, 1)
    )
    exact = 0.01 if width > 1.5 else 0.035  # hairlines along a diagonal of pixels
    assert long - short == pytest.approx(30 * width, rel=exact)  # ends cancel
    if width > 1:
        assert long == pytest.approx(60 * width + np.pi * width**2 / 4, rel=0.01, abs=0.6)


@pytest.mark.parametrize("width", [1.0, 2.5, 6.0])
@pytest.mark.parametrize("end", [(50.2, 22.1), (40.7, 55.3), (12.9, 54.0)])
def test_edges_are_as_smooth_as_an_oversampled_bar(width, end):
    begin = (12.4, 15.2)
    drawn, true = coverage([begin, end], width / 2, 64, 64), bar(begin, end, width / 2, 64)
    v, u = np.mgrid[:64, :64] + 0.5
    along = (np.array(end) - begin) / np.hypot(*(np.array(end) - begin))
    place = (u - begin[0]) * along[0] + (v - begin[1]) * along[1]
    middle = (place > width) & (place < np.hypot(*(np.array(end) - begin)) - width)
    error = (drawn - true)[middle]
    assert np.abs(error).max() < 0.15  # a ramp across the edge for a box of one pixel
    assert abs(error.sum()) < 0.01 * true[middle].sum()
    assert drawn[middle].max() == pytest.approx(true[middle].max(), abs=0.12)


def test_a_circle_of_many_pieces_has_no_seams():
    turn = np.linspace(0, 2 * np.pi, 120)
    circle = np.stack([40.3 + 25 * np.cos(turn), 39.6 + 25 * np.sin(turn)], axis=1)
    fine = np.zeros((80 * FINER, 80 * FINER), np.float32)
    fine[disk((39.6 * FINER - 0.5, 40.3 * FINER - 0.5), 26.5 * FINER)] = 1
    fine[disk((39.6 * FINER - 0.5, 40.3 * FINER - 0.5), 23.5 * FINER)] = 0
    true = fine.reshape(80, FINER, 80, FINER).mean(axis=(1, 3))
    drawn = coverage(circle, 1.5, 80, 80)
    assert np.abs(drawn - true).max() < 0.14
    assert drawn.sum() == pytest.approx(true.sum(), rel=0.005)
    assert drawn[true == 1].min() > 0.95


def test_width_may_change_along_a_line():
    line = np.stack([np.linspace(10, 90, 81), np.full(81, 20.0)], axis=1)
    drawn = coverage(line, np.linspace(0.5, 4, 81), 100, 40)
    columns = drawn.sum(axis=0)[15:85]
    expected = 2 * (0.5 + 3.5 * (np.arange(15, 85) + 0.5 - 10) / 80)
    np.testing.assert_allclose(columns, expected, atol=0.15)


def test_moving_by_whole_pixels_moves_the_picture():
    rng = np.random.default_rng(1)
    wild = [stroke(np.cumsum(rng.normal(0, 3, (30, 2)), 0) + 60, rng.random()) for _ in range(8)]
    style = Style(width=1.7, pale=0.5, tone=0.7, taper=0.5, nib=0.4)
    there = [Stroke(s.points + [11, 5], s.strength, s.kind) for s in wild]
    page, moved = (ink(strokes, 160, 140, style) for strokes in (wild, there))
    np.testing.assert_array_equal(page[:-5, :-11], moved[5:, 11:])


def test_what_lies_off_the_page_is_cut_at_its_edge():
    rng = np.random.default_rng(2)
    wild = [stroke(rng.uniform(-80, 200, (6, 2))) for _ in range(20)]
    wild.append(stroke([[-500, -500], [-400, -450]]))
    there = [Stroke(s.points + 100, s.strength, s.kind) for s in wild]
    style = Style(width=5.0)
    cut, whole = ink(wild, 120, 110, style), ink(there, 320, 310, style)
    np.testing.assert_array_equal(cut, whole[100:210, 100:220])


def test_translucent_strokes_darken_each_other_and_ink_does_not():
    cross = [stroke([[10, 30], [50, 30]]), stroke([[30, 10], [30, 50]])]
    for tone, crossing in ((1.0, 1.0), (0.6, 1 - 0.4**2)):
        page = 1 - ink(cross, 60, 60, Style(width=5, tone=tone)) / 255
        assert page[30, 15] == pytest.approx(tone, abs=0.01)
        assert page[30, 30] == pytest.approx(crossing, abs=0.01)


def test_fading_taper_and_nib_are_widths():
    def width_at(strokes, style, column):
        return (1 - ink(strokes, 100, 40, style) / 255)[:, column].sum()

    faint, full = stroke([[10, 20.5], [90, 20.5]], 0.25), stroke([[10, 20.5], [90, 20.5]])
    assert width_at([faint], Style(width=4, fading=0.8), 50) == pytest.approx(1.6, abs=0.05)
    assert width_at([full], Style(width=4, fading=0.8), 50) == pytest.approx(4, abs=0.05)
    assert width_at([full], Style(width=4, taper=1), 50) == pytest.approx(4, abs=0.05)
    assert width_at([full], Style(width=4, taper=1), 12) < 2.5
    turn = np.linspace(0, np.pi, 80)
    half = stroke(np.stack([50 + 30 * np.cos(turn), 5 + 30 * np.sin(turn)], axis=1))
    page = 1 - ink([half], 100, 40, Style(width=4, nib=0.8)) / 255
    assert page[20:, 60:].sum() < 0.8 * page[20:, :40].sum()  # one side of the arc is thinner


def test_a_pupil_is_a_blot_and_other_lines_are_not():
    turn = np.linspace(0, 2 * np.pi, 30)
    ring = np.stack([20.5 + 6 * np.cos(turn), 20.5 + 6 * np.sin(turn)], axis=1)
    assert ink([stroke(ring, kind="pupil")], 41, 41)[20, 20] == 0
    assert ink([stroke(ring, kind="iris")], 41, 41)[20, 20] == 255
    off = stroke(ring - 100, kind="pupil")
    assert (ink([off], 41, 41) == 255).all()


def test_nothing_drawn_is_white_paper():
    assert (ink([], 30, 20) == 255).all()
    assert (ink([stroke([[3, 3]])], 30, 20) == 255).all()


def test_paper_is_as_its_style_says():
    blank = np.zeros((300, 280), np.float32)
    assert (on_paper(blank, Style(paper=0.8)) == round(0.8 * 255)).all()
    speckled = on_paper(blank, Style(paper=0.9, noise=0.02, seed=3)) / 255
    assert speckled.std() == pytest.approx(0.02, rel=0.05)
    assert speckled.mean() == pytest.approx(0.9, abs=0.002)
    lit = light(300, 280, Style(paper=0.9, shadow=0.3, seed=4))
    assert (lit.min(), lit.max()) == pytest.approx((0.63, 0.9), abs=1e-3)
    assert np.abs(np.diff(lit, axis=0)).max() < 0.01  # shadows are soft
    blot = blank.copy()
    blot[100:140, 100:120] = 1
    soft = 1 - on_paper(blot, Style(blur=1.2)) / 255
    assert soft.sum() == pytest.approx(blot.sum(), rel=0.01)


def test_grain_lets_paper_through_light_strokes_more_than_dark_ones():
    band = stroke([[-20, 40], [220, 40]], width=1.0)

    def inked(tone, grain):
        style = Style(width=12, tone=tone, grain=grain, seed=5)
        return (1 - ink([band], 200, 80, style) / 255)[36:44] / tone

    assert inked(0.9, 0).std() < 0.01
    light_kept, dark_kept = inked(0.4, 1), inked(1.0, 1)
    assert light_kept.mean() < 0.75 < dark_kept.mean()
    assert light_kept.std() > 0.2
    assert dark_kept.min() > 0.15  # a line stays a line


def test_the_tooth_is_one_sheet_for_ever():
    first = tooth(60, 300, 9)
    _tile.cache_clear()
    np.testing.assert_array_equal(tooth(60, 300, 9), first)
    assert not np.array_equal(tooth(60, 300, 10), first)
    assert (first.min(), first.max()) == pytest.approx((0, 1), abs=0.001)


def test_a_leaning_page_stays_in_the_picture():
    np.testing.assert_array_equal(tilt_matrix(Style(), 256, 200), np.eye(3))
    corners = np.array([[0, 0], [256, 0], [256, 200], [0, 200], [128, 100]], float)
    for tilt in ((0.05, 0.0), (-0.08, 0.08), (0.02, -0.07)):
        there = through(tilt_matrix(Style(tilt=tilt), 256, 200), corners)
        assert (there >= -1e-9).all()
        assert (there <= np.array([256, 200]) + 1e-9).all()
        np.testing.assert_allclose(there[4], [128, 100])
    leaning = through(tilt_matrix(Style(tilt=(0.0, 0.06)), 256, 200), corners)
    assert np.ptp(leaning[2:4, 0]) < np.ptp(leaning[:2, 0])  # the lower edge is farther
