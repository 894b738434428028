"""Heads of hair in the data set: who wears which, what it hides, where it is told to lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation, binary_erosion

from dataset_gen.generate import generate, make_sample, read_shards
from dataset_gen.hair_area import Area, area_of, fill
from dataset_gen.hair_lines import EDGE, hair_lines
from dataset_gen.hair_strands import MASS, STRAND
from dataset_gen.hair_worn import wear
from dataset_gen.hairdo import FINISHES, WORN, Hairdo, sample_hairdo
from dataset_gen.linework.hidden import Cover
from dataset_gen.linework.lines import draw_strokes
from dataset_gen.page import draw_page
from dataset_gen.samples import Recipe
from dataset_gen.sampling import sample_face, sample_rng
from dataset_gen.styles import HAIR
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig, rasterise
from facs_rig.common.errors import InputError
from facs_rig.hair.presets import PRESETS, preset

SIZE = 256
LARGE = 512  # where a rim of hair is not all edge
OF_HAIR = (EDGE, STRAND, MASS)
# A preset, how it is drawn, and how far the head is turned to its own left.
HEADS = (
    ("crop", "dense", 0.5), ("fringe", "strands", -0.2), ("long_wavy", "brush", 0.0),
    ("curls", "curls", 0.7), ("braids", "outline", -0.6), ("bob", "black", 0.3),
    ("side_parting", "hatch", -0.4),
)  # fmt: skip


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def head(rig, name, finish, yaw):
    """A face, its camera, and the hair on it."""
    cut = preset(name)
    hairdo = Hairdo(
        name, part=cut.part, wave=cut.wave, curl=cut.curl, colour=cut.colour, finish=finish
    )
    face = FaceParameters(
        {"frontalis": 5.0, "smile": 4.0}, {"gender": 0.6, "age": 0.5}, (yaw, 0.1, -0.1)
    )
    vertices = rig.pose(face)
    return (
        vertices,
        Camera.framing(rig.extent(face), SIZE, SIZE, 0.2),
        wear(rig, vertices, face, hairdo),
    )


def seen(rig, vertices, camera, worn):
    """(h, w) where hair is seen, by the rasteriser and the whole face."""
    triangles = np.concatenate([rig.triangles, worn.shell.triangles + len(vertices)])
    found = rasterise(np.concatenate([vertices, worn.points]), triangles, camera)
    return found.triangle >= len(rig.triangles)


def painted(outlines, size=SIZE):
    """(h, w) what lies within outlines, each painted for itself."""
    image = Image.new("1", (size, size))
    for outline in outlines:
        ImageDraw.Draw(image).polygon((np.asarray(outline) - 0.5).ravel().tolist(), fill=1)
    return np.asarray(image)


def assert_alike(found, mask):
    """Two areas differ by pixels at their edges alone, but for specks."""
    assert (found & mask).sum() / (found | mask).sum() > 0.88
    for one, other in ((found, mask), (mask, found)):
        assert (one & ~binary_dilation(other, iterations=2)).sum() < 0.02 * one.sum() + 8


# --- who wears what -------------------------------------------------------------------------------


def test_every_preset_is_worn_and_every_finish_drawn():
    assert set(WORN) == set(PRESETS)
    people = [{"gender": k % 2, "age": 0.5, "african": 0.3} for k in range(400)]
    drawn = [
        sample_hairdo(np.random.default_rng(k), who, "ink") for k, who in enumerate(people)
    ]  # fmt: skip
    assert {h.preset for h in drawn} == set(PRESETS)
    assert {h.finish for h in drawn} == {*FINISHES, "curls"}


def test_only_grown_men_have_but_a_rim():
    def worn(**who):
        return {sample_hairdo(np.random.default_rng(k), who, "ink").preset for k in range(150)}

    assert "bald_rim" in worn(gender=1.0, age=0.9)
    for who in ({"gender": 0.0, "age": 0.9}, {"gender": 1.0, "age": -0.5}):
        assert "bald_rim" not in worn(**who)


def test_black_hair_is_blackened_and_fair_hair_is_not():
    def blackened(colour):
        who = {"brow_colour": colour, "gender": 0.5}
        finishes = [
            sample_hairdo(np.random.default_rng(k), who, "ink").finish for k in range(200)
        ]  # fmt: skip
        return np.mean([finish in ("black", "brush", "dense") for finish in finishes])

    assert blackened(1.0) > blackened(0.0) + 0.15


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_as_it_is_comes_back_and_its_variants_are_cuts(name):
    cut = preset(name)
    plain = Hairdo(name, part=cut.part, wave=cut.wave, curl=cut.curl, colour=cut.colour).cut()
    np.testing.assert_allclose(plain.edge, cut.edge)
    np.testing.assert_allclose(plain.thick, cut.thick)
    for length, volume in ((0.6, 0.65), (1.6, 1.6)):
        varied = Hairdo(
            name, True, length=length, rise=0.12, aside=-0.1, volume=volume, uneven=0.4, part=0.7
        )
        assert Hairdo.from_json(varied.to_json()) == varied
        assert varied.cut().edge.max() < 1  # a cut's arrays are checked when it is made


# --- what hair hides, and where it is told to lie -------------------------------------------------


@pytest.mark.parametrize(("name", "finish", "yaw"), HEADS)
def test_no_line_of_the_face_goes_on_under_hair(rig, name, finish, yaw):
    vertices, camera, worn = head(rig, name, finish, yaw)
    lines = hair_lines(worn, camera, 1.6, np.random.default_rng(0))
    cover = Cover(worn.points, worn.shell.triangles, lines)
    kinds = ("contour", "suggestive", "valley")
    bare = draw_strokes(rig, vertices, camera, 2, kinds=kinds)
    strokes = draw_strokes(rig, vertices, camera, 2, kinds=kinds, cover=cover)
    mask = seen(rig, vertices, camera, worn)
    within = binary_erosion(mask, iterations=2)
    around = binary_dilation(mask, iterations=6)

    def inside(area, strokes, of_hair):
        points = np.concatenate([
            s.points for s in strokes if (s.kind in OF_HAIR) == of_hair
        ])  # fmt: skip
        column, row = np.clip(points.astype(int), 0, SIZE - 1).T
        return area[row, column]

    assert inside(within, bare, False).sum() > 50  # else nothing would be hidden
    assert inside(within, strokes, False).sum() == 0
    assert inside(around, strokes, True).mean() > 0.98  # hair's own lines are on it, or at it


@pytest.mark.parametrize(("name", "finish", "yaw"), HEADS)
def test_outlines_are_those_of_the_hair_that_is_seen(rig, name, finish, yaw):
    vertices, camera, worn = head(rig, name, finish, yaw)
    area = area_of(worn, rig, vertices, camera)
    mask = seen(rig, vertices, camera, worn)
    for found in (area.mask, painted(area.outlines())):
        assert_alike(found, mask)
    for stroke in fill(area, camera, 1.6, np.random.default_rng(0)):
        column, row = stroke.points.astype(int).T
        assert area.mask[row, column].mean() > 0.9


def test_an_outline_goes_around_holes_and_leaves_specks_out(rig):
    cells = np.full((64, 64), -1, dtype=np.int32)
    cells[10:50, 10:50] = 0
    cells[20:40, 18:30] = -1  # a hole
    cells[24:30, 20:26] = 0  # and an island in it
    cells[2, 2] = 0
    worn = head(rig, "crop", "strands", 0.0)[2]
    outlines = Area(cells, 2, (128, 128), worn).outlines()
    wanted = cells.repeat(2, axis=0).repeat(2, axis=1) >= 0
    wanted[:8, :8] = False
    assert len(outlines) == 2
    found = painted(outlines, 128)
    assert (found & wanted).sum() / (found | wanted).sum() > 0.95


def test_hair_turns_with_the_head_and_no_expression_moves_it(rig):
    cut, who = preset("crop"), {"age": 0.4, "weight": 0.3}
    hairdo = Hairdo("crop", part=cut.part)
    plain = wear(rig, rig.neutral(who), FaceParameters({}, who), hairdo).points
    face = FaceParameters({"frontalis": 5.0, "jaw_open": 5.0}, who, (0.6, -0.2, 0.1), (0.0, 0.1, 0))
    worn = wear(rig, rig.pose(face), face, hairdo).points
    apart = [np.linalg.norm(p[::7, None] - p[None, ::7], axis=2) for p in (plain, worn)]
    np.testing.assert_allclose(*apart, atol=2e-4)
    skull = rig.pose(replace(face, aus={})), rig.neutral(who)
    at = rig.parts["skin"] & (rig.neutral()[:, 1] > 0.12)
    moved, still = (v[at].mean(axis=0) for v in skull)
    assert np.linalg.norm(worn.mean(axis=0) - moved) == pytest.approx(
        np.linalg.norm(plain.mean(axis=0) - still), abs=2e-3
    )


# --- samples --------------------------------------------------------------------------------------


def placed(meta):
    """Landmark -> where it is in units of the camera's scale: alike whatever the page shows."""
    matrix = np.linalg.inv(meta["page"])
    places = np.array([[*meta["landmarks"][name], 1.0] for name in LANDMARKS]) @ matrix.T
    camera = meta["camera"]
    return (places[:, :2] / places[:, 2:] - camera["centre"]) / np.mean(camera["scale"])


def test_hair_changes_no_label(rig):
    haired = 0
    for index in range(12):
        _, bare = make_sample(8, index, hair=0)
        _, meta = make_sample(8, index, hair=1)
        haired += meta["hair"] is not None
        for key in ("aus", "identity", "head", "neck", "gaze", "kinds", "detail", "scheme"):
            assert meta[key] == bare[key]
        np.testing.assert_allclose(placed(meta), placed(bare), atol=2e-4)
        layers = [layer for layer in bare["style"]["layers"] if layer not in HAIR]
        assert {**bare["style"], "layers": layers} == meta["style"]
    assert haired == 12


def test_without_hair_a_drawing_is_what_it_was_before_there_was_any(rig):
    """The steps by which samples were drawn, one after another."""
    for index in range(6):
        picture, meta = make_sample(9, index, hair=0)
        rng = sample_rng(9, index)
        sample = sample_face(rig, rng, SIZE)
        vertices = rig.pose(sample.parameters)
        strokes = draw_strokes(
            rig, vertices, sample.camera, sample.detail, sample.style.layers, sample.kinds
        )
        page = draw_page(strokes, rig, vertices, sample.camera, sample.style, rng)
        np.testing.assert_array_equal(picture, page.picture)
        assert not {"hair", "haired"} & set(meta)
        assert meta["style"] == sample.style.to_json()


def test_a_record_tells_the_hair_and_its_region(rig):
    for index in range(10):
        picture, meta = make_sample(10, index, LARGE)
        again, told = make_sample(10, index, LARGE)
        np.testing.assert_array_equal(picture, again)
        assert meta == told and meta["haired"] == 0.75
        assert not {*HAIR} & {*meta["style"]["layers"]}
        if meta["hair"] is None:
            assert list(meta["regions"]) == ["face"]
            continue
        assert list(meta["regions"]) == ["face", "hair"]
        hairdo = Hairdo.from_json(meta["hair"])
        vertices = rig.pose(FaceParameters.from_json(meta))
        camera = meta["camera"]
        far = np.inf if camera["distance"] is None else camera["distance"]
        camera = Camera(LARGE, LARGE, tuple(camera["scale"]), tuple(camera["centre"]), far)
        worn = wear(rig, vertices, FaceParameters.from_json(meta), hairdo)
        if not any(meta["style"]["tilt"]):
            assert_alike(painted(meta["regions"]["hair"], LARGE), seen(rig, vertices, camera, worn))


def test_the_share_of_haired_heads_is_the_one_that_is_asked_for():
    worn = [make_sample(11, k, size=64, hair=0.4)[1]["hair"] is not None for k in range(60)]
    assert 0.2 < np.mean(worn) < 0.6
    assert Recipe(scheme="sparse").hair == Recipe(engine="conventions").hair == 0
    for scheme, engine in (("sparse", "contours"), ("people", "conventions")):
        assert "hair" not in make_sample(11, 0, size=64, scheme=scheme, engine=engine)[1]
    for share in (-0.1, 1.1, float("nan")):
        with pytest.raises(InputError, match="--hair must be from 0 to 1"):
            make_sample(0, 0, hair=share)


def test_a_run_is_resumed_with_the_same_share(tmp_path):
    generate(1, tmp_path, seed=1, hair=1.0)
    with pytest.raises(InputError, match=r"made with .*hair 1,.*resume with the same"):
        generate(1, tmp_path, seed=1, resume=True)
    generate(1, tmp_path, seed=1, hair=1.0, resume=True)
    ((_, meta),) = read_shards(tmp_path)
    assert meta["haired"] == 1.0 and meta["hair"]["preset"] in PRESETS
