"""From the networks' cells to boxes on the page."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers.finding import Face, echo, faces_on, squared, widened
from facs_rig.common.box import Box

CELLS = 8
PAGE = Box.at(100, 50, 400, 400)


def taught(boxes: list[tuple[float, float, float]], cells: int = CELLS) -> np.ndarray:
    """What the networks answer when they have learnt perfectly: (c, c, 4) for boxes (u, v, side)
    in crop units."""
    centre = (np.arange(cells) + 0.5) / cells
    bell = np.full((cells, cells), 1e-6)
    found = np.zeros((cells, cells, 4))
    for u, v, side in boxes:
        away = ((centre - u) ** 2 + ((centre - v) ** 2)[:, None]) * cells**2
        bell = np.maximum(bell, np.exp(-away / (2 * 0.6**2)))
        j, i = int(u * cells), int(v * cells)
        found[i, j, 1:] = u * cells - j - 0.5, v * cells - i - 0.5, np.log(side)
    bell = np.clip(bell, 1e-6, 1 - 1e-6)
    found[..., 0] = np.log(bell / (1 - bell))
    return found


def on_page(u, v, side):
    return Box.square(PAGE.to_pixels(np.array([u, v])), side * PAGE.width)


def close_to(box: Box, other: Box) -> bool:
    return np.allclose(
        [box.left, box.top, box.width, box.height],
        [other.left, other.top, other.width, other.height],
        atol=1e-3,
    )


def test_faces_are_found_where_they_were_taught(rng):
    for _ in range(40):
        u, v = rng.uniform(0, 1, 2)
        side = float(rng.uniform(0.15, 1.2))
        (face,) = faces_on(taught([(u, v, side)]), PAGE)
        assert close_to(face.box, on_page(u, v, side))
        assert face.probability > 0.99  # also at the corner of four cells


def test_the_training_teaches_just_that(rng):
    torch = pytest.importorskip("torch")
    from classifiers.training.losses import finder_loss

    boxes = [(0.23, 0.61, 0.4), (0.8, 0.2, 0.2)]
    perfect = torch.tensor(taught(boxes), dtype=torch.float32)[None]
    targets = torch.full((1, 4, 3), torch.nan)
    targets[0, :2] = torch.tensor(boxes)
    assert finder_loss(perfect, targets) < 1e-6
    assert finder_loss(perfect + 0.3, targets) > 1e-3


def test_the_largest_comes_first_and_none_is_seen_twice():
    boxes = [(0.2, 0.2, 0.2), (0.7, 0.7, 0.5), (0.75, 0.15, 0.25)]
    faces = faces_on(taught(boxes), PAGE)
    assert len(faces) == 3
    for face, (u, v, side) in zip(faces, (boxes[1], boxes[2], boxes[0]), strict=True):
        assert close_to(face.box, on_page(u, v, side))
    doubled = taught([(0.5, 0.5, 0.6), (0.5, 0.78, 0.55)])
    doubled[..., 0] -= 1 * (np.arange(CELLS) > 5)[:, None]
    assert len(faces_on(doubled, PAGE)) == 1


def test_cells_that_doubt_are_not_heard():
    found = taught([(0.5 / 8, 0.5 / 8, 0.3)])
    found[..., 0] = -0.1
    assert faces_on(found, PAGE) == []
    assert faces_on(np.full((1, 1, 4), -60.0), PAGE) == []


def test_mirrored_cells_give_the_mirrored_faces(rng):
    found = rng.normal(0, 2, (CELLS, CELLS, 4))
    mirrored = found[:, ::-1] * (1, -1, 1, 1)
    crop = Box.at(0, 0, 64, 64)
    one, other = faces_on(found, crop), faces_on(mirrored, crop)
    assert len(one) > 2
    key = sorted((round(f.box.left, 6), round(f.box.top, 6), round(f.box.width, 6)) for f in one)
    back = [(64 - f.box.left - f.box.width, f.box.top, f.box.width) for f in other]
    assert sorted(tuple(round(x, 6) for x in box) for box in back) == key


def test_wild_answers_give_boxes_that_can_be_looked_at(rng):
    found = rng.normal(0, 80, (CELLS, CELLS, 4)).astype(np.float32)
    for face in faces_on(found, PAGE):
        assert 0.04 * PAGE.width < face.box.width < 1.6 * PAGE.width
        assert 0 <= face.probability <= 1


def test_boxes():
    box = Box.at(10, 20, 30, 40)
    assert Face(box, 1.0).corners == (10, 20, 40, 60)
    assert widened(box, 2) == Box.at(-5, 0, 60, 80)
    assert squared(box) == Box.at(5, 20, 40, 40)
    assert echo(box, Box.at(12, 22, 20, 20))
    assert not echo(box, Box.at(30, 20, 30, 40))
    assert not echo(box, Box.at(400, 20, 30, 40))


def test_the_corners_of_a_turned_face_are_those_of_the_box_around_it():
    left, top, right, bottom = Face(Box.at(10, 20, 30, 30, np.pi / 4), 1.0).corners
    half = 15 * np.sqrt(2)
    assert np.allclose((left, top, right, bottom), (25 - half, 35 - half, 25 + half, 35 + half))
