"""What is hidden, against rays; and the compiled loops against the same functions in numpy."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from dataset_gen import draw_strokes
from dataset_gen.linework import arrays
from dataset_gen.linework import kernels as engine
from dataset_gen.linework.hidden import BIAS, DIP, LIFT, Scene
from dataset_gen.linework.lines import KINDS, LEAST, Surface, shape_lines
from dataset_gen.linework.strokes import CLOSED, SHORTEST, LineSet, cut
from dataset_gen.linework.topology import Topology, face_topology
from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.mesh import vertex_normals

FACES = {
    "rest": FaceParameters(),
    "smile, turned": FaceParameters({"smile": 5}, {"age": 0.7}, (0.7, 0.1, 0.05)),
    "open jaw, from below": FaceParameters({"frontalis": 5}, {"gender": 0.0}, (-0.4, -0.5, 0.1)),
}


@pytest.fixture(scope="module")
def rig():
    return load_rig()


@pytest.fixture(params=FACES)
def posed(rig, request):
    return rig.pose(FACES[request.param]).astype(float)


def ray_depth(vertices, triangles, camera, points):
    """How far (k,), in metres, the last surface that faces the eye lies before points (k, 3).

    One ray after another against every triangle near it, in space (Moller, Trumbore 1997):
    nothing is shared with the code under test.
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    longest = max(np.linalg.norm(p - a, axis=1).max() for p in (b, c))
    out = np.empty(len(points))
    for k, point in enumerate(points):
        way = np.array([0.0, 0.0, 1.0])
        if np.isfinite(camera.distance):
            way = np.array([0.0, 0.0, camera.distance]) - point
            way /= np.linalg.norm(way)
        to = a - point
        off = to - (to @ way)[:, None] * way
        near = np.flatnonzero((off**2).sum(axis=1) <= longest**2)
        one, two, to = (b - a)[near], (c - a)[near], -to[near]
        p = np.cross(way, two)
        det = (one * p).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (to * p).sum(axis=1) / det
            q = np.cross(to, one)
            v = q @ way / det
            t = (two * q).sum(axis=1) / det
        faces = np.cross(one, two) @ way > 1e-15
        hit = faces & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        out[k] = t[hit].max(initial=-np.inf)
    return out


@pytest.mark.parametrize("distance", [np.inf, 0.9])
def test_no_line_shines_through(rig, posed, distance):
    """Every vertex of every stroke, a little above the skin, is seen along a ray, but for what
    may dip: gaps that lips leave, and gaps shorter than CLOSED pixels."""
    camera = Camera.framing(posed, 256, 256, 0.05, distance)
    strokes = draw_strokes(rig, posed, camera, 1, ("brow", "lip"), KINDS)
    triangle, weights = (np.concatenate([s.surface[k] for s in strokes]) for k in range(2))
    corners = rig.triangles[triangle]
    above = posed + LIFT * vertex_normals(posed, rig.triangles)
    places = np.einsum("kc,kcd->kd", weights, above[corners])
    solid = face_topology(rig).solid.triangles
    some = np.random.default_rng(3).choice(len(places), 300, replace=False)
    behind = ray_depth(posed, solid, camera, places[some])
    assert (behind < BIAS + 1e-4).mean() > 0.97
    assert (behind < DIP).mean() > 0.985


def test_no_line_is_dotted(rig, posed):
    """What no ray finds hidden is drawn, but for crumbs shorter than SHORTEST pixels."""
    camera = Camera.framing(posed, 256, 256, 0.05)
    topology = face_topology(rig)
    surface = Surface(posed, topology.solid, topology.skin, camera)
    (line,) = shape_lines(surface, ("contour",), {})
    strokes = draw_strokes(rig, posed, camera, 1, (), ("contour",))
    drawn = np.concatenate([s.points for s in strokes])
    some = np.random.default_rng(4).choice(len(line.points), 400, replace=False)
    some = some[line.shown[some]]
    places = line.points[some] + LIFT * line.normals[some]
    free = ray_depth(posed, topology.solid.triangles, camera, places) < 0.9 * BIAS
    assert free.sum() > 50
    pixels = camera.project(line.points[some][free])
    away = np.linalg.norm(pixels[:, None] - drawn, axis=2).min(axis=1)
    assert (away < 0.5).mean() > 0.9
    assert (away < SHORTEST).mean() > 0.94
    for stroke in strokes:
        assert np.linalg.norm(np.diff(stroke.points, axis=0), axis=1).max() < 1.01


def line_of(pixels, starts=None, strength=None):
    count = len(pixels)
    return LineSet(
        "contour", np.zeros((count, 3)), np.array(starts or [0, count]),
        np.ones(count) if strength is None else strength, np.ones(len(starts or [0, 0]) - 1),
        np.zeros((count, 3)), np.ones(count, bool),
    )  # fmt: skip


def test_short_gaps_are_drawn_over_and_crumbs_left_out():
    pixels = np.stack([np.arange(60) * 0.5, np.zeros(60)], axis=1)
    seen = np.ones(60, dtype=bool)
    seen[20 : 20 + int(CLOSED / 0.5) - 2] = False  # short
    seen[40:50] = False  # long
    seen[52:] = False  # what is left of it is a crumb
    (stroke,) = cut([line_of(pixels)], pixels, seen, seen)
    assert stroke.points[[0, -1], 0].tolist() == [0.0, 19.5]
    nearly = seen.copy()
    nearly[40:50] = True
    (stroke,) = cut([line_of(pixels)], pixels, seen, nearly)
    assert stroke.points[-1, 0] == 25.5
    assert cut([line_of(pixels)], pixels, np.zeros(60, bool), np.ones(60, bool)) == []


def test_lines_do_not_run_into_each_other():
    pixels = np.stack([np.arange(40) * 1.0, np.zeros(40)], axis=1)
    seen = np.ones(40, dtype=bool)
    strokes = cut([line_of(pixels, [0, 15, 40])], pixels, seen, seen)
    assert [len(s.points) for s in strokes] == [15, 25]


def test_sets_are_cut_together_as_each_by_itself():
    """Also when a closed line of one of them is turned, and one has nothing in it."""
    rng = np.random.default_rng(4)
    angle = np.linspace(0, 2 * np.pi, 81)
    ring = 20 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    zigzag = np.cumsum(rng.normal(0, 1, (50, 2)), axis=0)
    nothing = np.zeros((0, 2))
    places = (ring, nothing, zigzag, ring + 7)
    sets = [
        replace(
            line_of(p, [0, 20, 50] if p is zigzag else [0, len(p)] if len(p) else [0]),
            kind=f"{k}", strength=rng.random(len(p)) - 0.1,
            surface=None if k == 2 else (np.arange(len(p)), rng.random((len(p), 3))),
            width=rng.random(2 if p is zigzag else min(len(p), 1)),
        )
        for k, p in enumerate(places)
    ]  # fmt: skip
    seen = [rng.random(len(p)) > 0.1 for p in places]
    nearly = [s | (rng.random(len(s)) > 0.5) for s in seen]
    together = cut(sets, *map(np.concatenate, (places, seen, nearly)))
    alone = [
        s for lines, *rest in zip(sets, places, seen, nearly, strict=True)
        for s in cut([lines], *rest)
    ]  # fmt: skip
    assert len(together) == len(alone) > 5
    for one, two in zip(together, alone, strict=True):
        assert (one.kind, one.width) == (two.kind, two.width)
        np.testing.assert_array_equal(one.points, two.points)
        np.testing.assert_array_equal(one.strength, two.strength)
        if one.kind == "2":
            assert one.surface is two.surface is None
        else:
            np.testing.assert_array_equal(one.surface[0], two.surface[0])
            np.testing.assert_array_equal(one.surface[1], two.surface[1])


def test_a_closed_line_starts_where_it_is_hidden():
    angle = np.linspace(0, 2 * np.pi, 81)
    pixels = 20 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    seen = np.ones(81, dtype=bool)
    (whole,) = cut([line_of(pixels)], pixels, seen, seen)
    assert len(whole.points) == 81
    seen[30:40] = False
    (part,) = cut([line_of(pixels)], pixels, seen, seen)
    assert len(part.points) == 70
    assert np.linalg.norm(np.diff(part.points, axis=0), axis=1).max() < 1.6


def test_the_nearest_triangle_over_a_point():
    vertices = np.array(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 2], [9, 9, 9], [9, 8, 9],
         [8, 9, 9]], dtype=float,
    )  # fmt: skip
    triangles = np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]])  # the last one faces away or not
    camera = Camera(10, 10, (1.0, 1.0), (0.0, 10.0))
    scene = Scene.of(vertices, triangles, camera, [])
    depth, owner = scene.topmost(np.array([[0.2, 0.5, 0.0], [3.0, 3.0, 0.0]]))
    assert owner.tolist() == [1, -1]
    assert depth[0] == pytest.approx(1.5)
    assert depth[1] == -np.inf


def test_topology_of_two_triangles():
    topology = Topology.of(np.array([[0, 1, 2], [2, 1, 3]]))
    assert topology.edges.tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
    assert topology.triangle_edges.tolist() == [[0, 2, 1], [2, 3, 4]]
    assert topology.edge_triangles.tolist() == [[0, -1], [0, -1], [0, 1], [1, -1], [1, -1]]


needs_numba = pytest.mark.skipif(
    importlib.util.find_spec("numba") is None, reason="numba is not installed"
)


@needs_numba
@pytest.mark.parametrize("distance", [np.inf, 0.8])
def test_numpy_draws_what_numba_draws(rig, posed, distance, monkeypatch):
    camera = Camera.framing(posed, 256, 256, 0.05, distance)
    layers = ("brow", "iris", "lip", "lash", "hair_bob")
    results = []
    for loops in (engine.jitted(), arrays):
        for module in ("curvature", "zero_sets", "hidden", "layers", "lines"):
            monkeypatch.setattr(f"dataset_gen.linework.{module}.kernels", lambda loops=loops: loops)
        results.append(draw_strokes(rig, posed, camera, 1, layers, KINDS))
    fast, slow = results
    assert len(fast) == len(slow) > 50
    for one, other in zip(fast, slow, strict=True):
        assert one.kind == other.kind
        assert one.points == pytest.approx(other.points, abs=1e-6)
        assert one.strength == pytest.approx(other.strength, abs=1e-6)
        if one.surface is not None:
            assert (one.surface[0] == other.surface[0]).all()
            assert one.surface[1] == pytest.approx(other.surface[1], abs=1e-6)


def test_numba_can_be_switched_off(monkeypatch):
    monkeypatch.setenv(engine.SWITCH, "0")
    engine.kernels.cache_clear()
    try:
        assert engine.kernels() is arrays
    finally:
        engine.kernels.cache_clear()


def test_levels_are_named_and_ordered():
    for least in LEAST.values():
        assert least[0] > least[1] > least[2] > 0
