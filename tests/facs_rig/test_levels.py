"""Levels of detail: vertices of the full face, moved by the same keys in closed meshes of fewer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig import LANDMARKS, FaceParameters, load_rig
from facs_rig.anatomy import HAIR_PARTS, PART_NAMES
from facs_rig.common.errors import InputError
from facs_rig.levels import FULL, LEVELS, at_level, kept_by
from facs_rig.mesh import vertex_normals

LIGHTER = [level for level in LEVELS if level != FULL]
FACES = (
    FaceParameters(),
    FaceParameters({"smile": 5.0, "blink": 5.0}, {"age": 0.8, "gender": 1.0}),
    FaceParameters(
        {"jaw_open": 6.0, "frontalis": 5.0, "wince": 3.0}, {"nose_length": 0.6},
        head=(0.3, -0.1, 0.1), neck=(0.1, 0.05, 0.0), gaze=(0.2, -0.1),
    ),
)  # fmt: skip


@pytest.fixture(scope="module")
def full():
    return load_rig()


@pytest.fixture(scope="module", params=LIGHTER)
def light(request, full):
    return at_level(full, request.param)


@pytest.mark.parametrize("face", FACES)
def test_vertices_are_where_the_full_face_has_them(full, light, face):
    assert np.abs(light.pose(face) - full.pose(face)[light.of_full]).max() < 1e-6
    offsets = np.random.default_rng(0).normal(0, 1e-3, (full.n_vertices, 3)).astype(np.float32)
    there = light.pose(face, kept_by(light, offsets))
    assert np.abs(there - full.pose(face, offsets)[light.of_full]).max() < 2e-6


def test_keys_and_their_movements_are_the_full_faces(full, light):
    assert light.keys == full.keys
    assert np.abs(light.key_deltas - full.key_deltas[:, light.of_full]).max() < 1e-6
    assert np.abs(light.identity_deltas - full.identity_deltas[:, light.of_full]).max() < 1e-6
    assert np.abs(light.arkit_deltas - full.arkit_deltas[:, light.of_full]).max() < 1e-6


def test_how_large_they_are(full):
    assert at_level(full, FULL) is full
    medium, game = (at_level(full, level) for level in ("medium", "game"))
    assert 12_000 < medium.n_vertices < 17_000
    assert len(game.triangles) < 6000
    for rig in (medium, game):
        assert at_level(rig, rig.level) is rig
        assert len(np.unique(rig.polygon_vertices)) == rig.n_vertices  # none stands about
        assert {int(p) for p in np.unique(rig.vertex_part)} == set(range(len(PART_NAMES)))


def test_polygons_are_quads_but_for_the_ends_of_hairs(light):
    sizes = np.diff(np.append(light.polygon_starts, len(light.polygon_vertices)))
    part = light.vertex_part[light.polygon_vertices[light.polygon_starts]]
    hair = np.isin(part, [PART_NAMES.index(name) for name in HAIR_PARTS])
    assert (sizes[~hair] == 4).all() and np.isin(sizes, (3, 4)).all()
    assert (sizes == 3).sum() < 2000
    for name in PART_NAMES[:4]:
        quads = light.polygon_vertices[light.polygon_starts[part == PART_NAMES.index(name)][:, None]
                                       + np.arange(4)]  # fmt: skip
        corner = light.neutral().astype(float)[quads]
        ahead = np.roll(corner, -1, axis=1) - corner
        normals = np.cross(np.roll(ahead, 1, axis=1), ahead)
        whole = normals.sum(axis=1, keepdims=True)
        sizes_ = np.linalg.norm(normals, axis=2) * np.linalg.norm(whole, axis=2)
        assert ((normals * whole).sum(axis=2) > 0.1 * sizes_).all()  # none is folded


def rim_of(rig):
    """The edges (e, 2) of the skin that have one polygon, by the full face's vertices."""
    flat, starts = rig.polygon_vertices, rig.polygon_starts
    after = np.arange(1, len(flat) + 1)
    after[np.append(starts[1:], len(flat)) - 1] = starts
    skin = rig.parts["skin"][flat]
    ends = np.sort(np.stack([flat, flat[after]], axis=1), axis=1)[skin]
    edges, uses = np.unique(ends, axis=0, return_counts=True)
    assert uses.max() == 2
    out = edges[uses == 1]
    return out if rig.of_full is None else rig.of_full[out]


def test_they_are_as_closed_as_the_full_face(full, light):
    """At most two polygons share an edge, and what is open is the full face's rim, vertices left
    out."""
    whole, few = rim_of(full), rim_of(light)
    assert np.isin(few, whole).all()
    loops = [np.unique(edges, return_counts=True) for edges in (whole, few)]
    assert all((uses == 2).all() for _, uses in loops)  # closed rims
    away = cKDTree(full.neutral()[few].mean(axis=1)).query(full.neutral()[whole].mean(axis=1))[0]
    assert away.max() < 0.012


def test_the_surface_stays_near(full, light):
    """No farther from the full face's skin than its own polygons bend away from it."""
    most = {"medium": (0.0004, 0.003), "game": (0.0015, 0.012)}[light.level]
    rest = light.neutral()
    skin = light.triangles[light.triangle_part == PART_NAMES.index("skin")]
    middles = rest[skin].mean(axis=1)
    away = cKDTree(full.neutral()[full.parts["skin"]]).query(middles)[0]
    spacing = cKDTree(middles).query(full.neutral()[full.parts["skin"]])[0]
    assert np.median(away) < 0.003 and spacing.max() < 0.03
    normals = np.cross(rest[skin[:, 1]] - rest[skin[:, 0]], rest[skin[:, 2]] - rest[skin[:, 0]])
    size = np.linalg.norm(normals, axis=1)
    at = cKDTree(full.neutral()).query(middles)[1]
    smooth = vertex_normals(full.neutral().astype(float), full.triangles)[at]
    off = np.abs(((middles - full.neutral()[at]) * smooth).sum(axis=1))
    assert np.average(off, weights=size) < most[0] and off.max() < most[1]


def test_mirror_images_landmarks_strokes_and_places_on_the_texture(full, light):
    rest, where = light.neutral(), full.neutral()
    assert (light.mirror[light.mirror] == np.arange(light.n_vertices)).all()
    assert np.abs(rest[light.mirror] * [-1, 1, 1] - rest).max() < 5e-4
    assert len(light.landmarks) == len(LANDMARKS)
    off = np.linalg.norm(rest[light.landmarks] - where[full.landmarks], axis=1)
    assert np.median(off) < {"medium": 0.001, "game": 0.003}[light.level] and off.max() < 0.012
    assert set(light.strokes) == set(full.strokes)
    for name in full.strokes:
        index, weights = full.under[name]
        under = np.einsum("kc,kcd->kd", weights, where[index])
        apart = light.stroke_points(rest, name) - under
        most = {"medium": 0.002, "game": 0.004}[light.level]
        assert np.linalg.norm(apart, axis=1).max() < most
    uv = light.uv
    assert uv.shape == (len(light.polygon_vertices), 2) and uv.min() >= 0 and uv.max() <= 1
    known = {
        (int(v), *p) for v, p in zip(full.polygon_vertices, full.uv.round(6).tolist(), strict=True)
    }
    for vertex, place in zip(
        light.of_full[light.polygon_vertices], uv.round(6).tolist(), strict=True
    ):
        assert (int(vertex), *place) in known
    corners = uv[light.triangle_corners].astype(float)
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    assert (area[light.triangle_part < 4] < 0).mean() < 0.003  # nothing is turned over there
    mouth = [PART_NAMES.index(name) for name in ("teeth", "gums", "tongue")]
    assert (area[np.isin(light.triangle_part, mouth)] > 0).all()


def test_a_level_that_there_is_not_is_named(full):
    with pytest.raises(InputError, match="'tiny'.*full, medium, game"):
        at_level(full, "tiny")
