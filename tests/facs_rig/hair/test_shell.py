"""A shell is closed, lies outside the head, and hides all of the scalp that it says it covers."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from facs_rig import Camera, load_rig, rasterise, stylised
from facs_rig.baking.strands import closest_on_skin
from facs_rig.hair.cut import ANGLES, AZIMUTHS, Cut, mirrored
from facs_rig.hair.head import WIDEST, head_of
from facs_rig.hair.locks import hair
from facs_rig.hair.mesh import hair_mesh
from facs_rig.hair.presets import PRESETS, preset
from facs_rig.hair.shell import edge_heights, shell
from facs_rig.mesh import vertex_normals
from facs_rig.rotation import rotation
from facs_rig.subdivide import triangulate

MM = 1e-3
PEOPLE = {
    "nobody": {},
    "child": {"age": -1.0},
    "heavy": {"gender": 1.0, "weight": 1.0, "age": 0.5},
    "chibi": stylised.preset("chibi"),
    "brute": stylised.preset("brute"),
    "elf": stylised.preset("elf"),
}
VIEWS = ((0, 0), (45, 0), (90, 0), (-90, 0), (180, 0), (0, 80))  # degrees: yaw and pitch


@pytest.fixture(scope="module")
def rig():
    return load_rig()


@pytest.fixture(scope="module")
def skin(rig):
    """Triangles of the skin and of what closes the neck, coarser."""
    corners, starts = rig.lighter["medium"]
    triangles = triangulate(rig.texture.vertices[corners], starts)
    part = rig.vertex_part[triangles[:, 0]]
    return triangles[np.isin(part, [rig.part_names.index(name) for name in ("skin", "bust")])]


def random_people():
    rng = np.random.default_rng(4)
    return [stylised.drawn_style(rng) for _ in range(3)]


@pytest.mark.parametrize("name", PRESETS)
def test_every_edge_has_two_triangles_and_all_face_outwards(rig, name):
    for identity in (*PEOPLE.values(), *random_people()):
        made = shell(rig, identity, preset(name))
        mesh = trimesh.Trimesh(made.points, made.triangles, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert all(part.volume > 0 for part in mesh.split(only_watertight=False))
        assert len(mesh.split(only_watertight=False)) == 1 + len(preset(name).balls)
        assert made.points.dtype == np.float32
        assert np.isfinite(made.points).all()
        assert made.uv.min() >= 0
        assert made.uv.max() <= 1


def winding(points, vertices, triangles):
    """(k,) how often a surface goes around points, 1 inside: Jacobson et al. 2013, "Robust
    Inside-Outside Segmentation using Generalized Winding Numbers"."""
    corner = vertices[triangles].astype(np.float32)
    out = []
    for point in points.astype(np.float32):
        a, b, c = np.moveaxis(corner - point, 1, 0)
        x, y, z = (np.sqrt(np.einsum("tk,tk->t", v, v)) for v in (a, b, c))
        ab, bc, ca = (np.einsum("tk,tk->t", *pair) for pair in ((a, b), (b, c), (c, a)))
        volume = np.einsum("tk,tk->t", a, np.cross(b, c))
        out.append(np.arctan2(volume, x * y * z + ab * z + bc * x + ca * y).sum() / (2 * np.pi))
    return np.array(out)


@pytest.mark.parametrize("who", [who for who in PEOPLE if who != "elf"])
@pytest.mark.parametrize("name", ["crop", "bob", "long_wavy", "ponytail"])
def test_nothing_goes_into_the_head(rig, skin, who, name):
    """But where tails begin, within the hair, and under the ears of an elf."""
    vertices = rig.neutral(PEOPLE[who])
    made, locks = hair(rig, PEOPLE[who], preset(name), np.random.default_rng(1), 0.3)
    rng = np.random.default_rng(2)
    on = np.unique(np.concatenate([made.outer, made.inner]))
    tails = sum(ring.size for ring in made.tails)
    loose = locks.points if not tails else locks.points[: len(locks.points) // 2]
    for points, most in ((made.points[on], 1.0 * MM), (loose, 3.0 * MM)):
        some = points[rng.choice(len(points), 45, replace=False)]
        inside = some[winding(some, vertices, skin) > 0.5]
        if len(inside):
            on_skin = closest_on_skin(inside, vertices, skin)[2]
            assert np.linalg.norm(on_skin - inside, axis=1).max() < most


def seen_skin(rig, vertices, made, yaw, pitch):
    """(k, 3) the places of the skin that the pixels of a picture show, with hair on."""
    turn = rotation((np.radians(yaw), np.radians(pitch), 0.0)).T
    triangles = np.concatenate([rig.triangles, made.triangles + len(vertices)])
    turned = np.concatenate([vertices, made.points]) @ turn
    camera = Camera.framing(turned, 220, 220, 0.02)
    owner = np.unique(rasterise(turned, triangles, camera).triangle)
    owner = owner[(owner >= 0) & (owner < len(rig.triangles))]
    owner = owner[rig.triangle_part[owner] == rig.part_names.index("skin")]
    return vertices[rig.triangles[owner]].mean(axis=1)


@pytest.mark.parametrize("who", ["nobody", "child", "heavy"])
@pytest.mark.parametrize("name", ["crop", "side_parting", "long_straight", "bun"])
def test_no_scalp_shows_through(rig, who, name):
    """Where hair falls the edge lies below the skin that hair hides: there above the widest."""
    identity, cut = PEOPLE[who], preset(name)
    head, vertices = head_of(rig, identity), rig.neutral(identity)
    made = shell(rig, identity, cut)
    count = 0
    for yaw, pitch in VIEWS:
        shown = seen_skin(rig, vertices, made, yaw, pitch)
        azimuth = np.arctan2(shown[:, 0], shown[:, 2] - head.middle[2])
        height = head.height(shown[:, 1] - head.eyes[1])
        beside = np.radians([[-8], [-4], [0], [4], [8]])
        edge = edge_heights(cut, azimuth + beside).max(axis=0)
        above = height > np.maximum(edge, WIDEST if cut.hangs else -9) + 0.07
        ear = (np.abs(np.abs(azimuth) - np.radians(97)) < np.radians(24)) & (height < 0.3)
        count += len(shown)
        above &= height < 0.95  # azimuths meet at the crown
        assert not (above & ~ear).any(), (yaw, pitch, np.degrees(azimuth[above & ~ear]))
    assert count > 1000


def test_hair_leaves_the_face_free(rig):
    """All that a fringe does not cover: from brows to chin, from the outer corner of an eye to the
    other's."""
    vertices = rig.neutral()
    places = vertices[rig.landmarks]
    face = places[(places[:, 2] > 0.07) & (np.abs(places[:, 0]) < 0.045) & (places[:, 1] < 0.045)]
    for name in set(PRESETS) - {"fringe"}:
        made = shell(rig, {}, preset(name))
        facing = trimesh.Trimesh(made.points, made.triangles, process=False)
        flat = face[:, :2]
        front = facing.vertices[facing.faces][:, :, 2].min(axis=1) > 0
        corner = facing.vertices[facing.faces[front]][:, :, :2]
        for point in flat:
            a, b, c = np.moveaxis(corner - point, 1, 0)
            signs = [np.sign(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) for p, q in
                     ((a, b), (b, c), (c, a))]  # fmt: skip
            assert not (np.abs(np.sum(signs, axis=0)) == 3).any(), name


@pytest.mark.parametrize("name", ["crop", "long_wavy", "braids", "curls"])
def test_a_mirrored_cut_makes_a_mirrored_shell(rig, name):
    cut = preset(name)
    one, other = shell(rig, {}, cut), shell(rig, {}, mirrored(cut))
    back = -np.arange(len(one.outer))
    for at in (one.outer, one.inner):
        apart = one.points[at] * [-1, 1, 1] - other.points[at[back]]
        assert np.abs(apart).max() < 1.5 * MM
    assert np.allclose(one.uv[one.outer], one.uv[one.outer[back]])


def test_columns_end_where_the_cut_says(rig, monkeypatch):
    monkeypatch.setattr("facs_rig.hair.shell.LOCKS", 0.0)  # without uneven tips
    cut, head = preset("bob"), head_of(rig, {})
    made = shell(rig, {}, cut)
    end = made.points[made.outer[:, -1]]
    want = head.metres(edge_heights(cut, made.azimuth)) + head.eyes[1]
    away = np.abs(end[:, 1] - want)
    assert away.max() < 4 * MM  # hair that lies stands off the skin slantwise
    around = np.arctan2(end[:, 0], end[:, 2] - head.middle[2]) % (2 * np.pi)
    assert np.allclose(np.unwrap(around), made.azimuth, atol=0.02)


def test_tips_of_falling_hair_are_uneven_around_its_edge(rig):
    cut, head = preset("bob"), head_of(rig, {})
    made = shell(rig, {}, cut)
    edge = edge_heights(cut, made.azimuth)
    falls = edge < WIDEST
    off = made.points[made.outer[:, -1], 1] - head.metres(edge) - head.eyes[1]
    assert np.abs(off[~falls]).max() < 4 * MM
    assert 4 * MM < np.abs(off[falls]).max() < 10 * MM and np.abs(off[falls].mean()) < 2 * MM


def test_a_bald_crown_shows_above_a_rim(rig):
    """And no hair in front, where both edges meet."""
    head, vertices = head_of(rig, {}), rig.neutral({})
    made = shell(rig, {}, preset("bald_rim"))
    top, least = made.points[made.outer[:, 0]], made.points[made.outer[:, -1]]
    behind = np.abs(made.azimuth - np.pi) < np.radians(80)
    assert (top[behind, 1] > least[behind, 1] + 10 * MM).all()
    shown = seen_skin(rig, vertices, made, 180, 0)
    assert (head.height(shown[:, 1] - head.eyes[1]) > 0.75).any()
    front = seen_skin(rig, vertices, made, 0, 0)
    away = np.degrees(np.abs(np.arctan2(front[:, 0], front[:, 2] - head.middle[2])))
    height = head.height(front[:, 1] - head.eyes[1])
    assert ((height > 0.45) & (away < 40)).sum() > 100


@pytest.mark.parametrize("who", ["nobody", "heavy", "elf"])
@pytest.mark.parametrize("kind", ["surface", "locks"])
@pytest.mark.parametrize(("thick", "curl"), [(0.004, 0.0), (0.02, 0.8), (0.05, 0.0)])
def test_between_the_ends_of_a_rim_no_hair_is_seen(rig, who, kind, thick, curl):
    """However thick a cut is where it has none, and wherever its edges meet."""
    rim = preset("bald_rim")
    ends = np.degrees(np.minimum(ANGLES, 2 * np.pi - ANGLES)) < 45
    edge = np.where(ends, np.maximum(rim.edge, 0.45), rim.edge)
    cut = Cut(
        edge, np.full_like(rim.thick, thick), top=np.where(ends, edge - 0.15, rim.top), curl=curl
    )
    identity = PEOPLE[who]
    head, vertices = head_of(rig, identity), rig.neutral(identity)
    made = hair_mesh(rig, identity, cut, kind)
    both = np.concatenate([made.triangles, made.triangles[:, ::-1]])
    triangles = np.concatenate([rig.triangles, both + len(vertices)])
    every = np.concatenate([vertices, made.points])
    bald = cut.top <= cut.edge
    inside = bald & np.roll(bald, 1) & np.roll(bald, -1)
    assert inside.sum() > 8
    for yaw, pitch in [*VIEWS, (-40, 30), (20, -20)]:
        turned = every @ rotation((np.radians(yaw), np.radians(pitch), 0.0)).T
        camera = Camera.framing(turned, 300, 300, 0.02)
        owner = np.unique(rasterise(turned, triangles, camera).triangle)
        shown = every[triangles[owner[owner >= len(rig.triangles)]]].mean(axis=1)
        azimuth = np.arctan2(shown[:, 0], shown[:, 2] - head.middle[2])
        near = np.rint(azimuth / (2 * np.pi) * AZIMUTHS).astype(int) % AZIMUTHS
        assert len(shown) > 30 and not inside[near].any(), (yaw, pitch)


def test_thicker_hair_stands_off_farther(rig):
    edge = np.full(AZIMUTHS, 0.3)
    thin, thick = (
        shell(rig, {}, Cut(edge, np.full((AZIMUTHS, 2), metres))) for metres in (0.01, 0.03)
    )
    apart = np.linalg.norm(thick.points[thick.outer] - thin.points[thin.outer], axis=-1)
    assert np.allclose(apart[:, 1:], 0.02, atol=0.2 * MM)
    assert np.allclose(thick.points[thick.inner], thin.points[thin.inner], atol=1e-6)


@pytest.mark.parametrize("name", ["bob", "long_wavy", "side_parting"])
@pytest.mark.parametrize("more", [0.0, 0.02])
def test_a_parting_is_no_cleft_and_no_step(rig, name, more):
    """However thick hair is, and where one side is thicker: seen from in front and from behind."""
    cut = preset(name)
    side = np.where(np.sin(ANGLES) > 0, more, more / 2)[:, None]
    made = shell(rig, {}, replace(cut, thick=cut.thick + side, wave=0.0))
    for yaw in (0, 180):
        turned = made.points @ rotation((np.radians(yaw), 0.0, 0.0)).T
        camera = Camera.framing(turned, 400, 400, 0.02)
        seen = rasterise(turned, made.triangles, camera).triangle >= 0
        top = seen.argmax(axis=0)[seen.any(axis=0)] / camera.scale[0]
        left, right = (np.minimum.accumulate(top[::way])[::way] for way in (1, -1))
        assert (top - np.maximum(left, right)).max() < 4.5 * MM
        middle = top[len(top) // 5 : -len(top) // 5]
        assert np.abs(np.diff(middle)).max() < 3 * MM


def test_a_smooth_cut_makes_a_smooth_shell(rig):
    """No spikes: neighbours on the outer sheet face about the same way, but for curls."""
    for name in ("crop", "bob", "long_straight", "bun", "ponytail"):
        for identity in PEOPLE.values():
            made = shell(rig, identity, preset(name))
            normals = vertex_normals(made.points, made.triangles)[made.outer[:, 2:-3]]
            turned = np.einsum("crk,crk->cr", normals[:, 1:], normals[:, :-1])
            assert np.degrees(np.arccos(np.clip(turned, -1, 1))).max() < 75, name


def test_a_head_knows_its_heights(rig):
    head = head_of(rig, {"age": -0.5})
    metres = np.array([-0.2, -0.01, 0.0, 0.05, 0.1])
    assert np.allclose(head.metres(head.height(metres)), metres)
    assert np.isclose(head.metres(np.array(1.0)), head.above)
    assert np.isclose(head.metres(np.array(-1.0)), -head.below)
    assert len(ANGLES) == AZIMUTHS
    # The skull's rays and its distances from the axis are of one surface.
    azimuth, height = np.meshgrid([0.3, 1.0, 2.8, -2.2], [0.045, 0.06, 0.075], indexing="ij")
    far = head.levels(head.axis, azimuth, height)
    ways = np.stack([np.sin(azimuth) * far, height - (head.middle - head.eyes)[1],
                     np.cos(azimuth) * far], axis=-1)  # fmt: skip
    length = np.linalg.norm(ways, axis=-1)
    assert np.allclose(head.rays(head.skull, ways / length[..., None]), length, atol=1.0 * MM)
