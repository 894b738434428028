"""Every kind of line, against curves that are known in closed form."""

import numpy as np
import pytest
import trimesh

from dataset_gen.linework.curvature import principal_curvatures, radial_curvature
from dataset_gen.linework.hidden import Scene, visible_strokes
from dataset_gen.linework.lines import KINDS, Surface, shape_lines
from dataset_gen.linework.topology import Topology
from dataset_gen.linework.zero_sets import chains, zero_set
from facs_rig import Camera

MAJOR, MINOR = 0.1, 0.035  # metres, about a head


def torus(tilt):
    """Vertices, exact normals and triangles of a fine torus, tilted toward the viewer."""
    n, m = 240, 120
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, ((i + 1) % n) * m + j
    c, d = ((i + 1) % n) * m + (j + 1) % m, i * m + (j + 1) % m
    triangles = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    turn = trimesh.transformations.rotation_matrix(tilt, [1, 0, 0])[:3, :3]
    places, normals = torus_at(u.ravel(), v.ravel(), turn)
    return places, normals, triangles, turn


def torus_at(u, v, turn):
    ring = MAJOR + MINOR * np.cos(v)
    places = np.stack([ring * np.cos(u), ring * np.sin(u), MINOR * np.sin(v)], axis=-1)
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)
    return places @ turn.T, normals @ turn.T


def angles(points, turn):
    """(u, v) of points near the torus."""
    local = points @ turn
    around = np.arctan2(local[:, 1], local[:, 0])
    return around, np.arctan2(local[:, 2], np.hypot(local[:, 0], local[:, 1]) - MAJOR)


def analytic(points, turn):
    """n·v, κr, D_w κr of the torus at points near it, and the length of w.

    κ1 = 1/r along the tube, κ2 = cos v / (R + r cos v) around it; κr is their mean weighted with
    the squared share of w (Euler). D_w κr is a central difference of κr along w on the surface.
    """
    toward = np.array([0.0, 0.0, 1.0]) @ turn
    u, v = angles(points, turn)

    def radial(u, v):
        tube = np.stack([-np.sin(v) * np.cos(u), -np.sin(v) * np.sin(u), np.cos(v)], axis=-1)
        around = np.stack([-np.sin(u), np.cos(u), np.zeros_like(u)], axis=-1)
        a, b = tube @ toward, around @ toward
        k2 = np.cos(v) / (MAJOR + MINOR * np.cos(v))
        return (a**2 / MINOR + b**2 * k2) / np.maximum(a**2 + b**2, 1e-12), a, b

    kr, a, b = radial(u, v)
    length = np.hypot(a, b)
    h = 1e-6
    dv, du = a / length / MINOR, b / length / (MAJOR + MINOR * np.cos(v))
    ahead, behind = radial(u + h * du, v + h * dv)[0], radial(u - h * du, v - h * dv)[0]
    facing = torus_at(u, v, turn)[1][:, 2]
    return facing, kr, (ahead - behind) / (2 * h), length


@pytest.fixture(scope="module")
def ring():
    return torus(1.0)


def test_radial_curvature_of_a_torus(ring):
    vertices, normals, triangles, turn = ring
    view = np.broadcast_to(np.array([0.0, 0.0, 1.0]), vertices.shape)
    kr, growth = radial_curvature(vertices, triangles, normals, view)
    ndotv, exact, exact_growth, w = analytic(vertices, turn)
    well = (np.abs(ndotv) < 0.9) & (w > 0.4)
    assert well.sum() > 5000
    assert np.median(np.abs(kr - exact)[well]) < 0.01 / MINOR
    assert np.percentile(np.abs(kr - exact)[well], 99) < 0.08 / MINOR
    scale = np.percentile(np.abs(exact_growth[well]), 90)
    assert np.median(np.abs(growth - exact_growth)[well]) < 0.03 * scale


def test_principal_curvatures_of_a_torus(ring):
    vertices, normals, triangles, turn = ring
    found = principal_curvatures(vertices, triangles, normals)
    u, v = angles(vertices, turn)
    assert found.k1 == pytest.approx(np.full(len(u), 1 / MINOR), rel=0.01)
    assert found.k2 == pytest.approx(np.cos(v) / (MAJOR + MINOR * np.cos(v)), abs=0.01 / MINOR)
    tube = np.stack([-np.sin(v) * np.cos(u), -np.sin(v) * np.sin(u), np.cos(v)], axis=-1) @ turn.T
    assert np.abs(np.einsum("ij,ij->i", found.d1, tube)).min() > 0.999
    assert np.abs(np.einsum("ij,ij->i", found.d1, found.d2)).max() < 1e-9


@pytest.mark.parametrize("kind", ["suggestive", "highlight"])
def test_zeros_of_the_radial_curvature_of_a_torus(ring, kind):
    vertices, normals, triangles, turn = ring
    topology = Topology.of(triangles)
    camera = Camera.framing(vertices, 512, 512)
    surface = Surface(vertices, topology, np.ones(len(triangles), bool), camera, normals)
    (line,) = shape_lines(surface, (kind,), {kind: 0.03 / MINOR**2})
    ndotv, exact, growth, w = analytic(line.points, turn)
    chosen = (line.strength > 0) & (ndotv > 0.05) & (w > 0.35)
    assert chosen.sum() > 100
    sign = 1 if kind == "suggestive" else -1
    assert (sign * growth[chosen] > 0).mean() > 0.98
    distance = np.abs(exact[chosen] / growth[chosen])  # first order: how far the true zero is
    assert np.median(distance) < 0.01 * MINOR


def behind(point):
    """Whether the ray from a point toward +z of its own frame, given as (origin, way), is free."""
    origin, way = point
    # |p|² + R² - r² = 2 R |p_xy| with p = origin + t way, squared: a quartic in t
    a, b, c = way @ way, 2 * origin @ way, origin @ origin + MAJOR**2 - MINOR**2
    f, g, h = way[:2] @ way[:2], 2 * origin[:2] @ way[:2], origin[:2] @ origin[:2]
    k = 4 * MAJOR**2
    roots = np.roots(
        [a * a, 2 * a * b, 2 * a * c + b * b - k * f, 2 * b * c - k * g, c * c - k * h]
    )
    real = roots[np.abs(roots.imag) < 1e-6 * MAJOR].real
    return bool((real > 0.05 * MINOR).any())


@pytest.mark.parametrize("tilt", [0.0, 0.6, 1.0, 1.3, 1.5])
def test_hidden_contours_of_a_torus(tilt):
    """The contours that are drawn are as long as the part of them that no ray finds hidden."""
    vertices, normals, triangles, turn = torus(tilt)
    camera = Camera.framing(vertices, 512, 512)
    topology = Topology.of(triangles)
    surface = Surface(vertices, topology, np.ones(len(triangles), bool), camera, normals)
    scene = Scene.of(vertices, triangles, camera, [])
    strokes = visible_strokes(
        list(shape_lines(surface, ("contour",), {})), scene, np.zeros(len(triangles), bool)
    )
    drawn = sum(np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum() for s in strokes)
    # n·v = 0 where tan v = -(n_xy · toward_xy) / toward_z: two angles v for each u
    toward = np.array([0.0, 0.0, 1.0]) @ turn
    u = np.linspace(0, 2 * np.pi, 4001)
    v = np.arctan2(-(np.cos(u) * toward[0] + np.sin(u) * toward[1]), toward[2])
    length = 0.0
    for half in (v, v + np.pi):
        places, out = torus_at(u, half, turn)
        assert np.abs(out[:, 2]).max() < 1e-9
        local = (places @ turn, toward)
        free = np.array([not behind((p + 1e-6 * toward, toward)) for p in local[0][::10]])
        step = np.linalg.norm(np.diff(camera.project(places), axis=0), axis=1)
        length += step.reshape(-1, 10).sum(axis=1)[free[:-1]].sum()
    assert drawn == pytest.approx(length, rel=0.03)
    assert len(strokes) <= 4  # and in few pieces


def wavy(turn, amplitude=0.004, length=0.04, size=0.1, steps=120):
    """A jittered mesh of z = amplitude cos(2 pi x / length) with exact normals, turned about y.

    Returns vertices, normals, triangles and the x of each vertex before turning.
    """
    rng = np.random.default_rng(5)
    grid = np.linspace(-size, size, steps + 1)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    inner = (np.abs(x) < size) & (np.abs(y) < size)
    x = (x + inner * rng.uniform(-0.3, 0.3, x.shape) * (grid[1] - grid[0])).ravel()
    y = (y + inner * rng.uniform(-0.3, 0.3, inner.shape) * (grid[1] - grid[0])).ravel()
    k = 2 * np.pi / length
    slope = -amplitude * k * np.sin(k * x)
    vertices = np.stack([x, y, amplitude * np.cos(k * x)], axis=1)
    normals = np.stack([-slope, np.zeros_like(x), np.ones_like(x)], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    i, j = np.meshgrid(np.arange(steps), np.arange(steps), indexing="ij")
    a = (i * (steps + 1) + j).ravel()
    b, c, d = a + steps + 1, a + steps + 2, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    matrix = trimesh.transformations.rotation_matrix(turn, [0, 1, 0])[:3, :3]
    return vertices @ matrix.T, normals @ matrix.T, triangles, matrix


def lines_of_waves(kind, turn, least=0.0):
    """x, before turning, of all points that a kind of line has on the wavy plane, and strokes."""
    vertices, normals, triangles, matrix = wavy(turn)
    camera = Camera.framing(vertices, 512, 512)
    topology = Topology.of(triangles)
    surface = Surface(vertices, topology, np.ones(len(triangles), bool), camera, normals)
    (line,) = shape_lines(surface, (kind,), {kind: least})
    scene = Scene.of(vertices, triangles, camera, [])
    strokes = visible_strokes([line], scene, np.zeros(len(triangles), bool))
    places = [
        np.einsum("kc,kcd->kd", s.surface[1], vertices[triangles[s.surface[0]]]) @ matrix
        for s in strokes
    ]
    return strokes, np.concatenate(places)


STEP = 0.2 / 120  # metres between the vertices of the wavy plane


@pytest.mark.parametrize(("kind", "first"), [("ridge", 0.0), ("valley", 0.5)])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_ridges_and_valleys_of_waves(kind, first, turn):
    """Straight lines along the tops or in the troughs, wherever they are seen from."""
    strokes, places = lines_of_waves(kind, turn, 60.0)
    inner = places[(np.abs(places) < 0.09).all(axis=1)]
    phase = inner[:, 0] / 0.04 - first
    off = np.abs(phase - np.round(phase)) * 0.04
    assert np.percentile(off, 99) < 0.3 * STEP
    lines = np.unique(np.round(phase))
    assert len(lines) == (5 if kind == "ridge" else 4)
    for line in lines:  # none is dotted: as long as the plane is
        at = np.sort(inner[np.round(phase) == line][:, 1])
        assert np.diff(at).max() < 2 * STEP
        assert np.ptp(at) > 0.17
    assert len(strokes) < 12


@pytest.mark.parametrize(
    ("kind", "turn", "parities"),
    [("suggestive", 0.15, {0, 1}), ("suggestive", 0.7, {0}), ("highlight", 0.95, {1})],
)
def test_inflections_of_waves(kind, turn, parities):
    """κr is zero where the wave is straight. Seen from above, w points up to the nearest top; seen
    from the left, by more than the waves' 32 degrees, it points left everywhere: to a top from
    every even line, away from one on the others."""
    _, places = lines_of_waves(kind, turn, 500.0)
    inner = places[(np.abs(places) < 0.09).all(axis=1)]
    phase = inner[:, 0] / 0.02 - 0.5
    assert np.percentile(np.abs(phase - np.round(phase)) * 0.02, 99) < 0.5 * STEP
    assert set(np.round(phase).astype(int) % 2) == parities


@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_apparent_ridges_of_waves(turn):
    """Bending in the plane of view, q = |κ| / n·v: its maxima along x, which move with the eye."""
    _, places = lines_of_waves("apparent", turn, 70.0)
    inner = places[(np.abs(places) < 0.09).all(axis=1)]
    x = np.linspace(-0.1, 0.1, 200_001)
    k, amplitude = 2 * np.pi / 0.04, 0.004
    slope, bend = -amplitude * k * np.sin(k * x), -amplitude * k * k * np.cos(k * x)
    toward = np.array([-np.sin(turn), np.cos(turn)])  # the eye, in the plane's own x and z
    facing = (-slope * toward[0] + toward[1]) / np.hypot(1, slope)
    q = np.abs(bend) / (1 + slope**2) ** 1.5 / np.maximum(facing, 1e-3)
    top = x[1:-1][(q[1:-1] > q[:-2]) & (q[1:-1] >= q[2:]) & (facing[1:-1] > 0.2)
                  & (q[1:-1] > 80.0)]  # fmt: skip
    assert len(top) >= 4
    off = np.abs(inner[:, 0, None] - top).min(axis=1)
    assert np.percentile(off, 98) < 0.4 * STEP
    seen = top[np.abs(top) < 0.085]
    assert max(np.abs(inner[:, 0] - t).min() for t in seen) < STEP
    if turn:  # they are not where ridges and valleys are
        phase = seen / 0.02
        assert np.abs(phase - np.round(phase)).max() * 0.02 > 0.6 * STEP


def test_the_rim_of_waves_is_their_edge():
    strokes, places = lines_of_waves("boundary", 0.0)
    assert np.abs(places[:, :2]).max(axis=1) == pytest.approx(np.full(len(places), 0.1))
    (stroke,) = strokes
    length = np.linalg.norm(np.diff(stroke.points, axis=0), axis=1).sum()
    camera = Camera.framing(wavy(0.0)[0], 512, 512)
    assert length == pytest.approx(0.8 * camera.scale[0], rel=1e-6)


def test_a_flat_sheet_has_no_lines_but_its_rim():
    vertices, _, triangles, _ = wavy(0.2, amplitude=0.0)
    camera = Camera.framing(vertices, 256, 256)
    surface = Surface(vertices, Topology.of(triangles), np.ones(len(triangles), bool), camera)
    sets = {line.kind: line for line in shape_lines(surface, KINDS, dict.fromkeys(KINDS, 10.0))}
    assert set(sets) == set(KINDS)
    assert [kind for kind, line in sets.items() if (line.strength > 0).any()] == ["boundary"]


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
