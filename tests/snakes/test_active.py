"""The snakes: point for point scikit-image's, stable at their ends, and drawn to dark lines."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from skimage.segmentation import active_contour

from snakes import Tweakables
from snakes.active import relax, stiffness
from snakes.tweakables import SNAKE_TYPES


@pytest.fixture
def image(rng):
    noise = gaussian_filter(rng.random((80, 60)), 3)
    return (noise - noise.min()) / np.ptp(noise)


def rings(rng, counts=(7, 25, 25, 60)):
    turns = [np.linspace(0, 2 * np.pi, n, endpoint=False) for n in counts]
    return [
        np.stack([30 + rng.uniform(6, 20) * np.cos(t), 40 + rng.uniform(6, 30) * np.sin(t)], axis=1)
        for t in turns
    ]


def reference(image, snake, settings):
    """The same snake by scikit-image, which wants (row, column) with centres at whole numbers."""
    found = active_contour(
        image,
        snake[:, ::-1] - 0.5,
        alpha=0.01,
        beta=settings.smoothness,
        w_line=settings.brightness_weight,
        w_edge=settings.edge_weight,
        gamma=settings.time_stepping,
        max_px_move=settings.max_step,
        max_num_iter=settings.max_iterations,
        convergence=settings.convergence,
        boundary_condition=settings.snake_type,
    )
    return found[:, ::-1] + 0.5


@pytest.mark.parametrize("snake_type", SNAKE_TYPES)
@pytest.mark.parametrize("changes", [{}, {"max_step": 0.3, "edge_weight": 0.0, "smoothness": 0.2}])
def test_all_snakes_together_are_each_scikit_images_own(image, rng, snake_type, changes):
    settings = Tweakables(snake_type=snake_type, max_iterations=150, **changes)
    snakes = rings(rng)
    together = relax(image, snakes, settings, as_scikit_image=True)
    for ours, snake in zip(together, snakes, strict=True):
        assert np.abs(ours - reference(image, snake, settings)).max() < 1e-6


def test_a_periodic_snake_comes_to_rest_where_scikit_images_does(image, rng):
    settings = Tweakables(snake_type="periodic")
    snakes = rings(rng)
    for ours, snake in zip(relax(image, snakes, settings), snakes, strict=True):
        assert np.abs(ours - reference(image, snake, settings)).max() < 1e-6


def dark_line():
    u = np.arange(60) + 0.5
    return np.tile(1.0 - np.exp(-(((u - 30.0) / 5.0) ** 2)), (80, 1))


def at_different_times(count):
    """Snakes of 12 and 10 points beside the dark line: the farther, the later they rest."""
    height = np.linspace(15, 65, 12)
    lines = [np.stack([np.full(12, 30.0 - away), height], axis=1) for away in range(count)]
    return [line if k % 2 else line[2:] for k, line in enumerate(lines)]


@pytest.mark.parametrize("snake_type", SNAKE_TYPES)
@pytest.mark.parametrize("count", [0, 1, 2, 6])
def test_snakes_that_rest_in_the_last_iteration(snake_type, count):
    """However many iterations there are: some rest before the last one, some in it, some never."""
    snakes = at_different_times(count)

    def settled(iterations):
        settings = Tweakables(
            snake_type=snake_type, max_iterations=iterations, convergence=0.2, smoothness=0.2
        )
        if snake_type == "periodic":  # at the ends of others scikit-image grows what is rounded
            expected = [reference(dark_line(), snake, settings) for snake in snakes]
        else:
            expected = [relax(dark_line(), [snake], settings)[0] for snake in snakes]
        return relax(dark_line(), snakes, settings), expected

    rests = {}
    before, _ = settled(1)
    for iterations in range(2, 61):
        together, expected = settled(iterations)
        assert len(together) == count
        for k, (ours, alone) in enumerate(zip(together, expected, strict=True)):
            assert np.abs(ours - alone).max() < 1e-6
            if np.array_equal(ours, before[k]):
                rests.setdefault(k, iterations - 1)
        before = together
    if count == 6:
        assert len(set(rests.values())) > 1, "all come to rest together, which shows nothing"


def test_all_snakes_rest_at_once():
    line = at_different_times(1)[0]
    for iterations in range(1, 25):
        settings = Tweakables(max_iterations=iterations)
        for after in relax(np.full((80, 60), 0.5), [line] * 3, settings):
            assert np.abs(after - line).max() < 1e-6


@pytest.mark.parametrize("n", [5, 6, 20, 61])
@pytest.mark.parametrize("snake_type", SNAKE_TYPES)
def test_nothing_grows(n, snake_type):
    inertia = 2.0
    system = stiffness(n, 1.0, snake_type).toarray() + inertia * np.eye(n)
    growth = np.abs(np.linalg.eigvals(inertia * np.linalg.inv(system))).max()
    assert growth < 1.0 + 1e-6


def test_scikit_images_free_end_grows():
    """The reason for ends of our own; should this fail, scikit-image has mended its matrix."""
    system = stiffness(40, 1.0, "free", as_scikit_image=True).toarray() + 2.0 * np.eye(40)
    assert np.abs(np.linalg.eigvals(2.0 * np.linalg.inv(system))).max() > 1.1


def test_a_free_snake_does_not_care_which_end_comes_first(image, rng):
    snakes = rings(rng)
    there = relax(image, snakes)
    back = relax(image, [snake[::-1] for snake in snakes])
    for a, b in zip(there, back, strict=True):
        assert np.abs(a - b[::-1]).max() < 1e-6


def test_a_fixed_snake_keeps_its_ends(image, rng):
    snakes = rings(rng)
    for before, after in zip(
        snakes, relax(image, snakes, Tweakables(snake_type="fixed")), strict=True
    ):
        assert np.array_equal(np.round(before[[0, -1]], 9), np.round(after[[0, -1]], 9))
        assert np.abs(after - before).max() > 0.1


def test_a_straight_snake_on_a_flat_image_stays():
    line = np.stack([np.linspace(5, 50, 30), np.linspace(10, 60, 30)], axis=1)
    (after,) = relax(np.full((80, 60), 0.5), [line])
    assert np.abs(after - line).max() < 1e-6


def test_a_snake_slides_onto_a_dark_line():
    line = np.stack([np.full(40, 25.0), np.linspace(15, 65, 40)], axis=1)
    (after,) = relax(dark_line(), [line])
    assert np.abs(after[:, 0] - 30.0).max() < 0.5
    assert np.abs(after[:, 1] - line[:, 1]).max() < 0.5


def test_snakes_too_short_and_pictures_in_colour_are_refused():
    with pytest.raises(ValueError, match="at least 5 points"):
        relax(np.ones((20, 20)), [np.zeros((4, 2))])
    with pytest.raises(ValueError, match="height, width"):
        relax(np.ones((20, 20, 3)), [np.zeros((9, 2))])
    assert relax(np.ones((20, 20)), []) == []
