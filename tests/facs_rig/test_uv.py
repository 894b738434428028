"""Where the head lies on a texture."""

import numpy as np
import pytest

from facs_rig.anatomy import HAIR_PARTS, PART_NAMES
from facs_rig.subdivide import SQUARE, refine, triangulate
from facs_rig.uv import texture_map

GRID = 1500  # pixels of the texture in which overlaps are counted
GRIDS = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])


@pytest.fixture(scope="module")
def rig():
    from facs_rig import load_rig

    return load_rig()


@pytest.fixture(scope="module")
def texture(rig):
    """The map's triangles (t, 3, 2) and the part (t,) of each."""
    return rig.uv[rig.triangle_corners].astype(float), rig.triangle_part


def areas(triangles):
    (ax, ay), (bx, by) = (triangles[:, k].T - triangles[:, 0].T for k in (1, 2))
    return (ax * by - ay * bx) / 2


def coverage(triangles) -> np.ndarray:
    """(GRID, GRID) how many triangles lie on the middle of each pixel."""
    count = np.zeros((GRID, GRID), int)
    corners = triangles * GRID
    low = np.ceil(corners.min(axis=1) - 0.5).astype(int)
    wide, high = (np.floor(corners.max(axis=1) - 0.5).astype(int) - low + 1).T
    for i in range(wide.max()):
        column = np.flatnonzero(wide > i)
        for j in range(high[column].max()):
            some = column[high[column] > j]
            x, y = (low[some] + (i, j)).T
            inside = np.ones(len(some), bool)
            for k in range(3):
                (ax, ay), (bx, by) = corners[some, k].T, corners[some, k - 2].T
                inside &= (bx - ax) * (y + 0.5 - ay) - (by - ay) * (x + 0.5 - ax) > 0
            np.add.at(count, (y[inside], x[inside]), 1)
    return count


def test_no_triangle_of_the_skin_is_degenerate_or_turned_over(texture):
    triangles, part = texture
    area = areas(triangles[~np.isin(part, [PART_NAMES.index(name) for name in HAIR_PARTS])])
    assert area.min() > 0
    # A sixteenth of a pixel where 8192 are the width: two quads of the source, by the nostrils.
    assert (area < 1e-9).sum() < 40


def test_islands_do_not_overlap(texture):
    """The source's do not, and refinement adds nothing; two hairs may share their place."""
    triangles, part = texture
    every = np.zeros((GRID, GRID), int)
    for k, name in enumerate(PART_NAMES):
        count = coverage(triangles[part == k])
        every += count > 0
        if name not in HAIR_PARTS:
            assert (count > 1).sum() <= 1e-3 * (count > 0).sum()
    assert every.max() == 1  # nor do parts lie on each other
    assert (every > 0).mean() > 0.15


def test_neighbours_are_neighbours_on_the_texture_but_for_seams(rig):
    """Edges of the skin lie along the same line on the texture from both sides, nearly all."""
    corners, starts = rig.texture.corners, rig.polygon_starts
    after = np.arange(1, len(corners) + 1)
    after[np.append(starts[1:], len(corners)) - 1] = starts
    skin = rig.parts["skin"][rig.polygon_vertices]

    def edges(number):
        ends = np.sort(np.stack([number, number[after]], axis=1)[skin], axis=1)
        return np.unique(ends, axis=0)

    inside, whole = edges(corners), edges(rig.polygon_vertices)
    assert len(inside) - len(whole) < 0.02 * len(whole)  # what is cut is there twice
    length = np.linalg.norm(np.diff(rig.texture.points[inside], axis=1)[:, 0], axis=1)
    assert length.max() < 0.05


def test_every_place_belongs_to_a_vertex(rig):
    texture = rig.texture
    np.testing.assert_array_equal(texture.vertices[texture.corners], rig.polygon_vertices)
    np.testing.assert_array_equal(texture.vertices[: rig.n_vertices], np.arange(rig.n_vertices))
    assert rig.uv.shape == (len(rig.polygon_vertices), 2)
    assert rig.uv.min() >= 0 and rig.uv.max() <= 1
    again = texture_map(rig.uv, rig.polygon_vertices, rig.n_vertices)
    np.testing.assert_array_equal(again.uv, rig.uv)
    assert len(again.points) == len(texture.points)


def test_a_coarser_mesh_keeps_to_its_side_of_a_seam(rig):
    texture = rig.texture
    found = texture.nearest(rig.polygon_vertices, rig.uv)
    np.testing.assert_array_equal(found, texture.corners)
    a_little_aside = rig.uv + np.float32(1e-5)
    np.testing.assert_array_equal(texture.nearest(rig.polygon_vertices, a_little_aside), found)


def test_both_halves_of_the_face_are_as_large(rig, texture):
    triangles, part = texture
    area = areas(triangles)
    left = rig.neutral()[rig.triangles].mean(axis=1)[:, 0] > 0
    skin = part == PART_NAMES.index("skin")
    assert area[skin & left].sum() == pytest.approx(area[skin & ~left].sum(), rel=1e-3)


@pytest.mark.parametrize("name", HAIR_PARTS)
def test_a_hair_runs_from_its_root_up_to_its_tip(rig, name):
    from facs_rig.baking.uv import STRIPS

    own = np.flatnonzero(rig.parts[name])
    u, v = (rig.texture.points[own] - STRIPS[PART_NAMES.index(name)][0]).T
    sides = STRIPS[PART_NAMES.index(name)][1]
    assert (u.min(), v.min()) == pytest.approx((0, 0), abs=1e-4)
    assert (u.max(), v.max()) == pytest.approx(sides, abs=1e-4)
    tips = np.abs(v - sides[1]) < 1e-4
    assert 0.05 < tips.mean() < 0.2  # one of each hair's


@pytest.mark.parametrize("levels", [[0, 0, 0, 0], [1, 0, 0, 2], [3, 1, 0, 2]])
def test_corners_lie_in_their_quad_where_refinement_puts_them(levels):
    """Whichever polygon asks: neighbours agree where their common vertices lie on the sheet."""
    x, y = np.meshgrid(np.arange(3.0), np.arange(3.0))
    sheet = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    fine = refine(GRIDS, 9, np.array(levels))
    sizes = np.diff(np.append(fine.polygon_starts, len(fine.polygon_vertices)))
    base = sheet[GRIDS[np.repeat(fine.source, sizes), 0], :2]
    flat = base + fine.places
    assert len(texture_map(flat, fine.polygon_vertices, fine.matrix.shape[0]).points) == len(
        np.unique(fine.polygon_vertices)
    )
    assert {tuple(place) for place in SQUARE} <= {tuple(place) for place in fine.places}
    flat = flat[triangulate(np.arange(len(flat)), fine.polygon_starts)]
    assert areas(flat).min() > 0 and areas(flat).sum() == pytest.approx(4)
