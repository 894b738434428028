"""Drawings by convention: what they show is the face's own expression, however it is drawn."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation, binary_erosion

from dataset_gen import STYLES, ink
from dataset_gen import generate as module
from dataset_gen.conventions import (
    CONVENTIONS,
    MANNERS,
    Artist,
    draw_by_convention,
    sample_artist,
    zoomed,
)
from dataset_gen.conventions.artist import BANDS, BEARDS, EXTRAS, JOINED, MOUSTACHES
from dataset_gen.generate import generate, make_sample
from facs_rig import CONTROL_NAMES, LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.anatomy import LANDMARKS_68

SIZE = 400
PLAIN = Artist(cut="bald", clothes="none", neck="none", crease="none", crow="none", lashes="none",
               fold="none", jaw="smooth", cheek="none", room=1.0, finish="outline")  # fmt: skip
EVERY = [(field, way) for field, ways in {**CONVENTIONS, **EXTRAS}.items() for way in ways]
# The strokes by which a convention is known, where it draws any.
KINDS = {"eye": {"lid", "fill"}, "brow": {"brow", "brow_hair", "fill"}, "nose": {"nose", "fill"},
         "mouth": {"mouth"}, "ear": {"ear"}, "jaw": {"jaw"}, "neck": {"neck"},
         "clothes": {"clothes"}, "beard": {"beard", "mass"}, "moustache": {"beard", "fill"},
         "glasses": {"glasses"}, "hat": {"hat"}, "cut": {"hair", "mass"}}  # fmt: skip


@cache
def posed(aus=(), yaw=0.0, person=()):
    parameters = FaceParameters(dict(aus), dict(person), (np.radians(yaw), 0.0, 0.0))
    rig = load_rig()
    return rig.pose(parameters), parameters, Camera.framing(rig.extent(parameters), SIZE, SIZE)


def drawn(artist=PLAIN, aus=None, yaw=0.0, seed=3):
    vertices, parameters, camera = posed(tuple((aus or {}).items()), yaw)
    camera = zoomed(camera, artist.room)
    rng = np.random.default_rng(seed)
    return draw_by_convention(load_rig(), vertices, camera, parameters, artist, 1.6, rng)[:2]


def points_of(strokes, *kinds):
    own = [stroke.points for stroke in strokes if stroke.kind in kinds]
    return np.concatenate(own) if own else np.zeros((0, 2))


def tall(points):
    return float(np.ptp(points[:, 1])) if len(points) else 0.0


# --- every convention ---


@pytest.mark.parametrize("field, way", EVERY)
@pytest.mark.parametrize("yaw", [0, 32])
def test_every_convention_draws_something_inside_the_page(field, way, yaw):
    artist = replace(PLAIN, room=1.3, **{field: way})
    strokes, places = drawn(artist, {"jaw_open": 3} if field == "open" else None, yaw)
    points = np.concatenate([s.points for s in strokes if s.kind != "clothes"])  # they run off it
    assert np.isfinite(points).all()
    assert np.mean((points > 0) & (points < SIZE)) > 0.97
    assert all(len(stroke.points) > 1 for stroke in strokes)
    assert places.shape == (len(LANDMARKS), 2)
    if field in KINDS and way not in ("none", "bald"):
        assert KINDS[field] & {stroke.kind for stroke in strokes}


@pytest.mark.parametrize("field", {**CONVENTIONS, **EXTRAS})
def test_every_convention_is_a_picture_of_its_own(field):
    """No two of a feature give the same strokes: none is a dead entry."""
    aus = {
        "open": {"jaw_open": 1.5},
        "grin": {"jaw_open": 3},
        "teeth": {"jaw_open": 3},
        "iris": {"lid_raise": 3},
        "eye": {"lid_raise": 3},
    }.get(field, {"squint": 4, "outer_squint": 4, "frontalis": 4})
    base = replace(PLAIN, eye="almond", cut="short", crease="all", crow="curves", glasses="none")
    pictures = set()
    table = {**CONVENTIONS, **EXTRAS}[field]
    for way in table:
        reach = 0.9 if way == "bob" else 1.6
        strokes, _ = drawn(replace(base, **{field: way}, reach=reach), aus)
        pictures.add(ink(strokes, SIZE, SIZE, STYLES["ink"]).tobytes())
    assert len(pictures) == len(table)


# --- the expression ---


@pytest.mark.parametrize("way", CONVENTIONS["open"])
@pytest.mark.parametrize("mouth", ["line", "lips"])
def test_the_drawn_mouth_opens_with_the_jaw(way, mouth):
    artist = replace(PLAIN, open=way, mouth=mouth)
    heights = [tall(points_of(drawn(artist, {"jaw_open": f})[0], "mouth")) for f in (0, 2, 4, 6)]
    assert heights[0] < 0.02 * SIZE < heights[1]
    assert (np.diff(heights) > 0.01 * SIZE).all()


def test_an_open_black_mouth_is_black_and_a_row_of_teeth_is_not():
    def middle(way):
        strokes, places = drawn(replace(PLAIN, open=way), {"jaw_open": 5})
        picture = ink(strokes, SIZE, SIZE, STYLES["ink"])
        top, bottom = (places[LANDMARKS.index(f"lip_inner_{e}")] for e in ("top", "bottom"))
        # just below the upper lip, and just above the lower one
        rows = [int(top[1] + share * (bottom[1] - top[1])) for share in (0.15, 0.85)]
        return [picture[row, int(top[0])] for row in rows]

    assert middle("black")[0] < 60 > middle("black")[1]
    assert middle("teeth")[0] > 200 and middle("teeth")[1] < 60
    assert min(middle("outline")) > 200


@pytest.mark.parametrize("way", ["almond", "lids", "dot", "oval", "round"])
def test_the_eye_closes_with_a_blink(way):
    artist = replace(PLAIN, eye=way, brow="none", nose="none", mouth="line")
    openings = []
    for blink in (0, 2.5, 5):
        strokes, places = drawn(artist, {"blink": blink})
        inner, outer = (places[LANDMARKS.index(f"eye_{c}_left")] for c in ("inner", "outer"))
        wide = 0.5 * abs(outer[0] - inner[0])
        points = points_of(strokes, "lid", "fill", "iris")
        openings.append(tall(points[np.abs(points[:, 0] - (inner + outer)[0] / 2) < wide]))
    assert openings[0] > openings[1]
    assert not len(points_of(strokes, "fill", "iris"))  # shut, it is an arc
    if way != "dot":  # which is no taller than such an arc
        assert openings[2] < 0.6 * openings[0]


def test_teeth_are_bared_only_in_actions_that_bare_them():
    def mouth(aus, bares):
        return tall(points_of(drawn(replace(PLAIN, bares=bares, mouth="line"), aus)[0], "mouth"))

    for aus in ({"smile": 5}, {"grimace": 5}):
        assert mouth(aus, True) > mouth(aus, False) + 4
    for aus in ({}, {"frown": 5}):
        assert mouth(aus, True) == mouth(aus, False)


@pytest.mark.parametrize("way", [w for w in CONVENTIONS["open"] if w not in ("outline", "grid")])
def test_what_is_inside_a_mouth_tells_a_shut_jaw_from_an_open_one(way):
    """Nothing is black between clenched teeth."""

    def black(aus):
        strokes, _ = drawn(replace(PLAIN, bares=True, open=way, mouth="line"), aus)
        mouth = points_of(strokes, "mouth")
        left, top, right, bottom = *mouth.min(axis=0), *mouth.max(axis=0)
        picture = ink(strokes, SIZE, SIZE, STYLES["ink"])
        return (picture[int(top) : int(bottom), int(left) : int(right)] < 60).mean()

    assert black({"jaw_open": 5}) > 2 * black({"smile": 5})


def slopes(artist, aus):
    """How much lower than its outer end the inner end of either brow is, per pixel of length."""
    _, places = drawn(artist, aus)
    out = []
    for side in ("left", "right"):
        inner, outer = (places[LANDMARKS.index(f"brow_{e}_{side}")] for e in ("inner", "outer"))
        out.append((inner - outer)[1] / abs((inner - outer)[0]))
    return np.array(out)


@pytest.mark.parametrize("action, way", [("brow_furrow", 1), ("medialis_frontalis", -1)])
def test_what_is_overdone_bends_the_brows_further_and_leaves_a_face_at_rest(action, way):
    plain, much = (replace(PLAIN, overdo=factor) for factor in (1.0, 3.0))
    bent = slopes(plain, {action: 4}) - slopes(plain, {})
    assert (way * bent > 0).all()
    assert (way * (slopes(much, {action: 4}) - slopes(plain, {})) > 2 * way * bent).all()
    assert drawn(much)[1] == pytest.approx(drawn(plain)[1])


def test_an_artist_may_draw_brows_level():
    def lower_edge(level):
        """How much lower the inner end of a brow's lower edge is, per pixel of its length."""
        strokes, _ = drawn(replace(PLAIN, brow="double", brow_size=1.4, level=level))
        brows = [s.points for s in strokes if s.kind == "brow"]
        low = max((p for p in brows if p[:, 0].mean() > SIZE / 2), key=lambda p: p[:, 1].mean())
        low = low[np.argsort(low[:, 0])]  # on the picture's right the inner end is the left one
        return (low[0, 1] - low[-1, 1]) / (low[-1, 0] - low[0, 0])

    assert abs(lower_edge(1.0)) < 0.4 * lower_edge(0.0)


def test_shut_eyes_may_smile():
    """An arc upward in a smile, as comics have it, and never without one."""

    def arches(aus, seed):
        artist = replace(PLAIN, manner="cartoon", eye="dot", brow="none", nose="none", mouth="line")
        strokes, places = drawn(artist, aus, seed=seed)
        ends = [places[LANDMARKS.index(f"eye_{c}_left")] for c in ("inner", "outer")]
        lids = [s.points for s in strokes if s.kind == "lid"]
        line = min(lids, key=lambda p: np.abs(p.mean(axis=0) - np.mean(ends, axis=0)).sum())
        return line[len(line) // 2, 1] < line[[0, -1], 1].mean()

    smiling = [arches({"blink": 5.5, "smile": 4}, seed) for seed in range(20)]
    assert 4 < sum(smiling) < 18
    calm = [arches({"blink": 5.5}, seed) for seed in range(20)]
    assert sum(calm) < 3


def curve_of_mouth(aus):
    """How much lower the middle of the mouth is than its corners, in pixels."""
    points = points_of(drawn(replace(PLAIN, mouth="line"), aus)[0], "mouth")
    order = np.argsort(points[:, 0])
    ends = points[order[[0, 1, -2, -1]], 1].mean()
    middle = points[np.abs(points[:, 0] - np.median(points[:, 0])) < 4, 1].mean()
    return middle - ends


def test_a_smile_bends_the_mouth_up_and_a_frown_down():
    assert curve_of_mouth({"smile": 5}) > curve_of_mouth({}) + 5
    assert curve_of_mouth({"frown": 5}) < curve_of_mouth({}) - 5


def test_puckered_lips_are_narrow():
    def width(aus):
        return np.ptp(points_of(drawn(replace(PLAIN, mouth="line"), aus)[0], "mouth")[:, 0])

    assert width({"purse": 5}) < 0.85 * width({})


@pytest.mark.parametrize("way", [w for w in CONVENTIONS["brow"] if w not in ("none", "shape")])
def test_brows_rise_and_fall_with_the_forehead(way):
    def height(aus):
        return -points_of(drawn(replace(PLAIN, brow=way), aus)[0], "brow", "brow_hair")[:, 1].mean()

    assert height({"frontalis": 5}) > height({}) + 4
    assert height({"brow_furrow": 5}) < height({}) - 2


def test_creases_are_drawn_where_their_control_is_worn():
    artist = replace(PLAIN, crease="two", crow="ticks")
    assert not len(points_of(drawn(artist)[0], "crease"))
    brows = drawn(artist)[1][LANDMARKS.index("brow_peak_left"), 1]
    assert points_of(drawn(artist, {"frontalis": 5})[0], "crease")[:, 1].max() < brows
    one_sided = points_of(drawn(artist, {"smile_left": 5})[0], "crease")
    assert len(one_sided) and one_sided[:, 0].min() > SIZE / 2  # its own left: the picture's right


def test_a_turned_head_shows_its_near_ear_alone_and_its_nose_aside():
    strokes, places = drawn(replace(PLAIN, nose="u"), yaw=30)
    middle = points_of(strokes, "jaw")[:, 0].mean()
    assert points_of(strokes, "ear")[:, 0].max() < middle
    assert points_of(strokes, "nose")[:, 0].mean() > middle + 10
    straight, _ = drawn(PLAIN)
    ears = points_of(straight, "ear")[:, 0]
    assert ears.min() < SIZE * 0.4 and ears.max() > SIZE * 0.6


def test_what_is_in_front_hides_what_is_behind():
    """No hair in the face, no ear in hair, no shoulder in the neck's hair."""
    strokes, _ = drawn(replace(PLAIN, cut="crop", finish="strands"))
    jaw, hair = points_of(strokes, "jaw"), points_of(strokes, "hair")
    low = hair[:, 1] > jaw[:, 1].mean()
    assert not low.any()


@pytest.mark.parametrize("hat", [hat for hat in EXTRAS["hat"] if hat not in ("none", "band")])
@pytest.mark.parametrize("yaw", [0, 32])
def test_a_hat_is_told_where_it_is_drawn_and_hides_what_it_is_worn_on(hat, yaw):
    artist = replace(PLAIN, cut="short", finish="strands", hat=hat, room=1.3)
    vertices, parameters, camera = posed((), yaw)
    for seed in range(4):
        strokes, _, regions = draw_by_convention(
            load_rig(), vertices, zoomed(camera, 1.3), parameters, artist, 1.6,
            np.random.default_rng(seed),
        )  # fmt: skip
        page = Image.new("L", (SIZE, SIZE))
        for outline in regions["hat"]:
            ImageDraw.Draw(page).polygon(outline.ravel().tolist(), fill=1)
        near, inside = (binary_dilation(page, iterations=3), binary_erosion(page, iterations=3))

        def told(area, *kinds, strokes=strokes):
            points = points_of(strokes, *kinds)
            u, v = points[((points >= 0) & (points < SIZE)).all(axis=1)].astype(int).T
            return area[v, u]

        assert inside.mean() > 0.005
        assert told(near, "hat").mean() > 0.7  # the strap of a helmet is not told
        # Some hair is seen over the strap of a cap.
        assert told(inside, "hair", "skull").sum() < 0.05 * len(told(near, "hat"))
        assert hat in BANDS or np.concatenate(regions["hair"])[:, 1].min() < SIZE / 2


def test_a_narrow_ribbon_is_no_hat():
    vertices, parameters, camera = posed((), 0.0)
    artist = replace(PLAIN, cut="short", hat="band")
    rng = np.random.default_rng(0)
    _, _, regions = draw_by_convention(load_rig(), vertices, camera, parameters, artist, 1.6, rng)
    assert "hat" not in regions and regions["hair"]


# --- beards ---

GROWN = [("beard", way) for way in BEARDS] + [("moustache", way) for way in MOUSTACHES]


def marked(artist, yaw=0.0, seed=3):
    """Strokes, where the artist has the landmarks, and (SIZE, SIZE) where a beard was marked."""
    vertices, parameters, camera = posed((), yaw)
    strokes, places, regions = draw_by_convention(
        load_rig(), vertices, camera, parameters, artist, 1.6, np.random.default_rng(seed)
    )
    return strokes, places, area(regions.get("beard", []))


def area(outlines):
    page = Image.new("1", (SIZE, SIZE))
    for outline in outlines:
        ImageDraw.Draw(page).polygon((np.asarray(outline) - 0.5).ravel().tolist(), fill=1)
    return np.asarray(page)


@pytest.mark.parametrize("field, way", GROWN)
@pytest.mark.parametrize("yaw", [0, 32])
def test_a_beard_is_marked_where_it_is_drawn_and_not_on_the_lips(field, way, yaw):
    artist = replace(PLAIN, **{field: way})
    for seed in range(4):
        strokes, places, mark = marked(artist, yaw, seed)
        if way == "none":
            assert not mark.any()
            continue
        hairs = points_of(strokes, "beard", "mass")
        if len(hairs):
            near = binary_dilation(mark, iterations=6)  # tips stand over the edge
            u, v = np.clip(hairs.astype(int), 0, SIZE - 1).T
            assert near[v, u].mean() > 0.93
        lips = area([[places[LANDMARKS.index(name)] for name in LANDMARKS_68[48:60]]])
        assert (mark & lips).sum() < 0.45 * lips.sum()


def test_shade_is_drawn_where_beards_grow_and_is_none():
    grown = [marked(replace(PLAIN, beard="hairs"), seed=seed)[2] for seed in range(8)]
    inked = 0
    for seed in range(8):
        strokes, _, mark = marked(replace(PLAIN, shade="planes"), seed=seed)
        assert not mark.any()
        u, v = np.clip(points_of(strokes, "hatch").astype(int), 0, SIZE - 1).T
        inked += int(grown[seed][v, u].sum())
    assert inked > 400


def test_beards_that_join_a_moustache_mostly_have_one():
    rng = np.random.default_rng(5)
    men = [sample_artist(rng, {"gender": 1.0, "age": 0.3}) for _ in range(600)]
    joined = [man.moustache != "none" for man in men if man.beard in JOINED]
    assert np.mean(joined) > 0.9
    bare = np.mean([(man.beard, man.moustache) == ("none", "none") for man in men])
    assert 0.45 < bare < 0.6


# --- artists ---


def test_artists_are_what_was_stored_of_them(rng):
    for manner in MANNERS:
        artist = sample_artist(rng, {"gender": 0.9, "age": 0.5}, manner)
        assert artist.manner == manner
        assert Artist.from_json(json.loads(json.dumps(artist.to_json()))) == artist


def test_what_no_artist_does_is_refused(rng):
    with pytest.raises(ValueError, match="draws the eye as 'almnd'; did you mean 'almond'"):
        Artist(eye="almnd")
    with pytest.raises(ValueError, match="no manner 'cubist'.*portrait"):
        sample_artist(rng, {}, "cubist")
    with pytest.raises(ValueError, match="an artist has no 'eyebrow'"):
        Artist.from_json({"eyebrow": "stroke"})


def test_what_a_convention_cannot_show_is_told():
    assert PLAIN.hidden
    hidden = replace(PLAIN, eye="dot", nose="l").hidden
    assert set(hidden) <= set(CONTROL_NAMES)
    assert {"squint", "nostril_flare", "nostril_compress"} <= set(hidden)
    assert "squint" not in replace(PLAIN, eye="almond").hidden
    assert {"blink", "blink_left", "blink_right"} <= set(replace(PLAIN, glasses="dark").hidden)


def test_women_wear_no_beards(rng):
    artists = [sample_artist(rng, {"gender": 0.1}) for _ in range(200)]
    assert {artist.beard for artist in artists} == {"none"}


# --- samples ---


def test_the_same_faces_as_by_contours():
    """Parameters and landmarks are those of the other engine, on a page with more room."""
    for index in range(4):
        _, ours = make_sample(6, index, engine="conventions")
        _, theirs = make_sample(6, index)
        for part in ("aus", "identity", "head", "neck", "gaze", "detail"):
            assert ours[part] == theirs[part]
        assert ours["engine"] == "conventions" and ours["artist"]["manner"] in MANNERS
        if ours["style"]["tilt"] == [0.0, 0.0] or ours["style"]["tilt"] == (0.0, 0.0):
            a, b = (
                np.array([meta["landmarks"][name] for name in LANDMARKS]) for meta in (ours, theirs)
            )
            zoom = ours["camera"]["scale"][0] / theirs["camera"]["scale"][0]
            shift = np.array(ours["camera"]["centre"]) - zoom * np.array(theirs["camera"]["centre"])
            np.testing.assert_allclose(a, zoom * b + shift, atol=0.03)
        told, true = (
            np.array([ours[key][name] for name in LANDMARKS])
            for key in ("drawn_landmarks", "landmarks")
        )
        away = np.linalg.norm(told - true, axis=1)
        assert 0 < away.mean() < 0.08 * 256


def test_strokes_and_kinds_are_stored():
    _, meta = make_sample(6, 2, engine="conventions", strokes=True)
    kinds = {stroke["kind"] for stroke in meta["strokes"]}
    assert {"jaw", "nose", "mouth"} <= set(meta["kinds"])
    assert kinds - {"hatch", "construction"} <= set(meta["kinds"])


def test_same_seed_same_bytes_whatever_the_workers_and_after_a_resume(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "SHARD", 2)
    one = generate(4, tmp_path / "one", seed=9, engine="conventions", strokes=True)
    two = generate(4, tmp_path / "two", seed=9, engine="conventions", strokes=True, jobs=2)
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]
    (tmp_path / "three").mkdir()
    (tmp_path / "three" / "shard-000000.tar").write_bytes(one[0].read_bytes())
    three = generate(4, tmp_path / "three", seed=9, engine="conventions", strokes=True, resume=True)
    assert [p.read_bytes() for p in three] == [p.read_bytes() for p in one]
    with pytest.raises(ValueError, match="engine conventions.*resume with the same"):
        generate(4, tmp_path / "three", seed=9, strokes=True, resume=True)
