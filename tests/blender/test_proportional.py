"""The proportional edit does what Blender's proportional editing does."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import bmesh  # noqa: E402

from snakes.offsets import proportional_edit  # noqa: E402
from snakes.tweakables import CURVES  # noqa: E402

TOLERANCE = 1e-5  # metres, for a move of 12 cm
SIDE = 25  # vertices along a side of the sheets
EDGE = 0.04  # metres
REACH = 0.343
MOVE = (0.02, 0.03, 0.11)
MIDDLE = SIDE * SIDE // 2
SELECTIONS = {
    "one": [MIDDLE],
    "two neighbours": [MIDDLE, MIDDLE + 1],
    "several": [3, MIDDLE, MIDDLE + 1, MIDDLE + 2, MIDDLE + 5, MIDDLE + 12 * SIDE],
}


def sheet() -> tuple[np.ndarray, np.ndarray]:
    """A flat grid of right-angled triangles: vertices (n, 3) as Blender's floats, triangles."""
    across, along = np.meshgrid(np.arange(SIDE) * EDGE, np.arange(SIDE) * EDGE)
    vertices = np.stack([across.ravel(), along.ravel(), np.zeros(SIDE * SIDE)], axis=1)
    index = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    )
    return vertices, triangles


def rolled(vertices: np.ndarray) -> np.ndarray:
    """The sheet bent to most of a tube, edge by edge, so that no edge changes its length.

    Its far edges come near to each other in space, as the lips do.
    """
    turn = 1.8 * np.pi / (SIDE - 1)
    radius = EDGE / (2 * np.sin(turn / 2))
    angle = vertices[:, 0] / EDGE * turn
    return np.stack([radius * np.sin(angle), vertices[:, 1], radius * np.cos(angle)], axis=1)


def crumpled(vertices: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The sheet with triangles of all shapes, many of them obtuse."""
    return vertices + EDGE * rng.uniform(-0.3, 0.3, vertices.shape)


def by_blender(
    vertices: np.ndarray,
    triangles: np.ndarray,
    selected: list[int],
    reach: float,
    curve: str,
    connected: bool,
    move: tuple[float, float, float] = MOVE,
) -> np.ndarray:
    """Offsets (n, 3) by which Blender's Move operator moves the vertices in edit mode."""
    mesh = bpy.data.meshes.new("sheet")
    mesh.from_pydata(vertices.tolist(), [], triangles.tolist())
    sheet = bpy.data.objects.new("sheet", mesh)
    bpy.context.collection.objects.link(sheet)
    bpy.context.view_layer.objects.active = sheet
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(mesh)
    for vertex in edited.verts:
        vertex.select = vertex.index in selected
    edited.select_flush_mode()
    bmesh.update_edit_mesh(mesh)
    done = bpy.ops.transform.translate(
        value=move,
        orient_type="GLOBAL",
        use_proportional_edit=True,
        proportional_edit_falloff=curve.upper(),
        proportional_size=reach,
        use_proportional_connected=connected,
        use_proportional_projected=False,
    )
    assert done == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    moved = np.empty(3 * len(vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", moved)
    # Whatever stays selected would be edited along with the next sheet.
    bpy.data.objects.remove(sheet)
    return moved.reshape(-1, 3) - vertices.astype(np.float32)


def by_us(vertices, triangles, selected, reach, curve, connected, move=MOVE):
    offsets, _ = proportional_edit(
        vertices.astype(np.float32),
        np.array(selected),
        np.tile(move, (len(selected), 1)),
        reach,
        curve,
        triangles=triangles if connected else None,
    )
    return offsets


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("connected", [False, True])
@pytest.mark.parametrize("selection", SELECTIONS)
def test_every_vertex_goes_where_blender_moves_it(curve, connected, selection):
    flat, triangles = sheet()
    for vertices in (flat, rolled(flat)):
        arguments = (vertices, triangles, SELECTIONS[selection], REACH, curve, connected)
        theirs, ours = by_blender(*arguments), by_us(*arguments)
        assert np.abs(theirs).max() == pytest.approx(MOVE[2], abs=1e-6)
        assert np.abs(ours - theirs).max() < TOLERANCE


def test_connected_only_is_what_keeps_the_edges_of_the_tube_apart():
    flat, triangles = sheet()
    edge, opposite = 12 * SIDE, 13 * SIDE - 1
    arguments = (rolled(flat), triangles, [edge], REACH, "linear")
    for move in (by_blender, by_us):
        assert move(*arguments, False)[opposite, 2] > 0.3 * MOVE[2]
        assert not move(*arguments, True)[opposite].any()


@pytest.mark.parametrize("curve", CURVES)
def test_straight_distances_are_blenders_on_any_mesh(curve, rng):
    flat, triangles = sheet()
    arguments = (crumpled(flat, rng), triangles, SELECTIONS["several"], REACH, curve, False)
    assert np.abs(by_us(*arguments) - by_blender(*arguments)).max() < TOLERANCE


def test_distances_over_a_crumpled_sheet_are_nearly_blenders(rng):
    flat, triangles = sheet()
    reach = 10.0  # so that the linear curve tells every distance
    off = []
    for _ in range(20):
        vertices = crumpled(flat, rng)
        selected = rng.choice(SIDE * SIDE, rng.integers(1, 20), replace=False).tolist()
        arguments = (vertices, triangles, selected, reach, "linear", True, (0.0, 0.0, 1.0))
        theirs, ours = (reach * (1 - move(*arguments)[:, 2]) for move in (by_blender, by_us))
        off.append((theirs - ours) / EDGE)
    # Of distances up to some tens of edges; geodesic.py says why.
    assert np.abs(off).max() < 0.6
    assert np.abs(off).mean() < 0.015
