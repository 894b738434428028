"""The whole road, on drawings that the program did not make and on some that it did."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

import addon
from addon import pipeline
from addon.pipeline import FitOptions, fit, preview, report, write_face
from dataset_gen import Style, draw_strokes
from dataset_gen.linework import ink
from dataset_gen.linework.strokes import Stroke
from facs_rig import CONTROL_NAMES, IDENTITY, Camera, FaceParameters, load_rig
from facs_rig.common.errors import InputError
from snakes import Tweakables
from tests.written import points_of

SKETCHES = sorted((Path(addon.__file__).parent / "sketches").glob("*.png"))


@pytest.fixture(scope="module")
def fits():
    return {path.stem: fit(path) for path in SKETCHES}


@pytest.mark.parametrize("name", [path.stem for path in SKETCHES])
def test_the_lines_come_closer(fits, name):
    error = fits[name].contour_error_px
    assert error["fitted"] < error["expression"] <= error["template"]


@pytest.mark.parametrize("name", [path.stem for path in SKETCHES])
def test_the_fitted_face_is_smooth_and_whole(fits, name):
    """No spike, no fold: few triangles of the skin turn over against the expression alone."""
    face = fits[name]
    assert np.isfinite(face.vertices).all()
    assert np.linalg.norm(face.offsets, axis=1).max() < 0.03
    skin = face.rig.triangles[face.rig.parts["skin"][face.rig.triangles].all(axis=1)]
    before, after = (
        trimesh.Trimesh(v, skin, process=False).face_normals
        for v in (face.rig.pose(face.parameters), face.vertices)
    )
    turned = np.einsum("ij,ij->i", before, after) < 0
    assert turned.mean() < 0.004


def test_drawn_expressions_are_read(fits):
    """What a person who looks at the three sketches would say first."""
    active = {name: {k for k, on in f.detection.active.items() if on} for name, f in fits.items()}
    assert "smile" in active["smiling_woman"]
    assert "brow_furrow" in active["angry_man"]
    assert active["worried_old_man"] & {"frontalis", "medialis_frontalis"}
    assert "smile" not in active["angry_man"] | active["worried_old_man"]
    assert np.degrees(fits["angry_man"].parameters.head[0]) > 8  # he looks to the image's right
    assert abs(np.degrees(fits["worried_old_man"].parameters.head[0])) < 8


def test_the_report_is_what_the_contract_says(fits):
    face = fits["angry_man"]
    said = json.loads(json.dumps(report(face)))
    assert set(said) >= {
        "aus", "head", "identity", "projection", "contour_error_px", "unmatched", "timings_s",
    }  # fmt: skip
    assert set(said["aus"]) == set(CONTROL_NAMES)
    for unit in said["aus"].values():
        assert 0 <= unit["probability"] <= 1
        assert 0 <= unit["intensity"] <= 5
        assert unit["active"] is (unit["intensity"] > 0)
    assert set(said["head"]) == {"yaw", "pitch", "roll"}
    assert set(said["contour_error_px"]) == {"template", "expression", "fitted"}
    assert said["projection"][2] == pytest.approx([0, 0, -1 / face.camera.distance, 1])
    stages = dict(said["timings_s"])
    total = stages.pop("total")
    assert set(stages) == {*pipeline.STAGES, "measure"}
    assert stages["measure"] > 0 and total == pytest.approx(sum(stages.values()))
    for line in said["unmatched"]:
        steps = np.diff(np.array(line["polyline"]), axis=0)
        assert line["length_px"] == pytest.approx(np.linalg.norm(steps, axis=1).sum())


@pytest.mark.parametrize("strokes", ["ignore", "engrave"])
def test_what_is_only_said_of_a_fit_is_worked_out_when_it_is_asked_for(monkeypatch, strokes):
    picture, _ = scarred([((1.8, 0.4), (4.2, -3.4))])
    face = fit(picture, FitOptions(strokes=strokes))
    asked = face.timings_s["measure"]
    assert (asked > 0) == (strokes == "engrave")  # what has no place is carved
    lost = face.unmatched
    assert lost and face.timings_s["measure"] >= asked
    error = face.contour_error_px
    known = face.timings_s
    assert known["measure"] > asked
    monkeypatch.setattr("snakes.model_lines.draw_strokes", None)  # and only once
    assert face.contour_error_px == error and len(face.unmatched) == len(lost)
    assert face.timings_s == known


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_the_projection_lays_the_written_file_on_the_sketch(fits, tmp_path, suffix):
    """Its nose, eyes and mouth appear where the detector saw them in the sketch."""
    face = fits["worried_old_man"]
    path = tmp_path / f"face{suffix}"
    write_face(face, path)
    vertices = points_of(path)
    matrix = np.array(report(face, path)["projection"])
    pixels = np.column_stack([vertices, np.ones(len(vertices))]) @ matrix.T
    pixels = pixels[:, :2] / pixels[:, 2:]
    np.testing.assert_allclose(
        pixels, face.drawing.to_input(face.camera.project(face.vertices)), atol=0.1
    )
    from facs_rig import LANDMARKS

    height = np.ptp(pixels[:, 1])
    for name in ("pupil_left", "pupil_right", "nose_tip", "lip_bottom", "chin"):
        place = pixels[face.rig.landmarks[LANDMARKS.index(name)]]
        seen = face.drawing.to_input(np.array(face.detection.landmarks[name]))
        assert np.linalg.norm(place - seen) < 0.08 * height


def test_the_projection_of_a_blend_file_is_for_blenders_axes(fits):
    face = fits["worried_old_man"]
    x, y, z = face.vertices[face.rig.landmarks].T
    core, blender = (
        np.column_stack([points, np.ones(len(points))])
        for points in (np.column_stack([x, y, z]), np.column_stack([x, -z, y]))
    )
    plain = np.array(report(face)["projection"])
    turned = np.array(report(face, Path("face.blend"))["projection"])
    np.testing.assert_allclose(blender @ turned.T, core @ plain.T, rtol=1e-9)


def drawn(parameters, size=512, style=None):
    rig = load_rig()
    posed = rig.pose(parameters)
    camera = Camera.framing(posed, size, size, 0.1)
    picture = ink(draw_strokes(rig, posed, camera, 1), size, size, style or Style(width=2.0))
    return picture, camera, posed


def test_a_drawing_of_the_face_itself_is_found_again():
    """The rig's own drawing of a known pose: position, scale and yaw come back."""
    truth = FaceParameters({"smile": 5.0}, {}, (0.35, 0.0, 0.0))
    picture, camera, posed = drawn(truth)
    face = fit(picture)
    assert np.degrees(face.parameters.head[0]) == pytest.approx(np.degrees(0.35), abs=8)
    assert face.detection.active["smile"]
    pixels, found = camera.project(posed), face.camera.project(face.vertices)
    off = np.linalg.norm(pixels - found, axis=1)[face.rig.landmarks]
    assert np.median(off) < 0.03 * np.ptp(pixels[:, 1])


def test_colours_and_size_of_the_page_do_not_matter():
    picture, *_ = drawn(FaceParameters({"frontalis": 5.0}))
    plain = fit(picture)
    other = fit(
        np.pad(np.repeat((255 - picture)[:, :, None], 3, axis=2), ((0, 60), (0, 90), (0, 0)))
    )
    assert other.drawing.inverted
    assert other.detection.active == plain.detection.active
    np.testing.assert_allclose(other.camera.scale, plain.camera.scale, rtol=0.04)


def test_huge_pages_report_in_their_own_pixels():
    picture, camera, posed = drawn(FaceParameters({"smile": 5.0}))
    small = fit(picture)
    large = fit(np.repeat(np.repeat(picture, 6, axis=0), 6, axis=1))
    assert large.drawing.size == (3072, 3072)
    m_small, m_large = (np.array(report(f)["projection"]) for f in (small, large))
    np.testing.assert_allclose(m_large[0, 0] / m_small[0, 0], 6, rtol=0.05)
    ratio = large.contour_error_px["template"] / small.contour_error_px["template"]
    assert ratio == pytest.approx(6, rel=0.35)


def test_the_head_placed_by_hand():
    picture, camera, posed = drawn(FaceParameters())
    low, high = camera.project(posed).min(axis=0), camera.project(posed).max(axis=0)
    box = (low[0], low[1], high[0], high[1] - 0.18 * (high[1] - low[1]))
    face = fit(picture, FitOptions(align=",".join(f"{x:.1f}" for x in box)))
    plain = {feature.name: feature.default for feature in IDENTITY}
    off = [abs(v - plain[name]) for name, v in face.parameters.identity.items()]
    assert max(off, default=0) < 0.25  # a plain face was drawn, and is found by its lines
    top = face.camera.project(face.vertices)[:, 1].min()
    assert top == pytest.approx(low[1], abs=0.05 * float(high[1] - low[1]))
    with pytest.raises(ValueError, match="left,top,right,bottom"):
        fit(picture, FitOptions(align="1,2,3"))


def test_tweakables_reach_the_snakes():
    picture, *_ = drawn(FaceParameters({"smile": 5.0}))
    still = fit(picture, FitOptions(tweakables=Tweakables(max_delta=0.1)))
    assert np.abs(still.offsets).max() < 4e-4
    mirrored = fit(SKETCHES[0], FitOptions(tweakables=Tweakables(mirror=True)))
    flipped = mirrored.offsets[mirrored.rig.mirror] * [-1, 1, 1]
    skin = mirrored.rig.parts["skin"]
    np.testing.assert_allclose(flipped[skin], mirrored.offsets[skin], atol=1e-5)


def scarred(places, size=512):
    """The rig's own drawing with a line between each pair of `places` on the face, in cm."""
    rig = load_rig()
    posed = rig.pose(FaceParameters())
    camera = Camera.framing(posed, size, size, 0.1)
    strokes = draw_strokes(rig, posed, camera, 1)
    for ends in places:
        line = np.linspace(*(0.01 * np.array([*end, 0.0]) for end in ends), 40)
        strokes.append(Stroke(camera.project(line), np.ones(40), "scar"))
    return ink(strokes, size, size, Style(width=2.0)), camera


def test_a_scar_is_carved_where_it_was_drawn():
    picture, _ = scarred([((1.8, 0.4), (4.2, -3.4))])
    plain, engraved, embossed = (
        fit(picture, FitOptions(strokes=strokes, stroke_depth=1.0, stroke_profile="scar"))
        for strokes in pipeline.UNMATCHED
    )
    moved = np.linalg.norm(engraved.offsets - plain.offsets, axis=1)
    assert 0.8e-3 < moved.max() < 1.2e-3
    np.testing.assert_allclose(
        engraved.offsets - plain.offsets, plain.offsets - embossed.offsets, atol=1e-4
    )
    places = plain.rig.neutral()[moved > 0.5e-3] * 100
    assert (places[:, 0] > 1.0).all() and (places[:, 0] < 5.5).all()
    assert (places[:, 1] > -4.5).all() and (places[:, 1] < 1.5).all()
    deeper = engraved.vertices[moved > 0.5e-3, 2] - plain.vertices[moved > 0.5e-3, 2]
    assert np.median(deeper) < 0
    assert len(engraved.unmatched) == len(plain.unmatched) > 0


def test_a_drawing_without_scars_is_not_carved():
    picture, _ = scarred([])
    plain, engraved = (fit(picture, FitOptions(strokes=s)) for s in ("ignore", "engrave"))
    assert (plain.offsets != engraved.offsets).any(axis=1).mean() < 0.005


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"strokes": "carve"}, r"\(strokes\) is one of ignore, engrave, emboss, not 'carve'"),
        ({"stroke_profile": "trench"}, "is one of crease, scar, not 'trench'"),
        ({"stroke_depth": 0.0}, "more than 0 and at most 5 mm, not 0"),
        ({"stroke_width": -1.0}, "more than 0 and at most 20 mm, not -1"),
        ({"stroke_width": float("nan")}, "is a number, not nan"),
    ],
)
def test_options_that_cannot_be_used(options, says):
    with pytest.raises(ValueError, match=says):
        FitOptions(**options)


def test_a_page_without_a_face_is_refused():
    page = np.full((300, 300), 255, np.uint8)
    for k in range(20, 280, 20):  # a page of squared paper, heavily ruled
        page[k : k + 2] = 0
        page[:, k : k + 2] = 0
    with pytest.raises(InputError, match="No face was found"):
        fit(page)


def test_progress_counts_the_stages():
    seen = []
    fit(drawn(FaceParameters())[0], progress=lambda done, total: seen.append((done, total)))
    assert seen == [(k, len(pipeline.STAGES)) for k in range(1, len(pipeline.STAGES) + 1)]


def test_the_preview_shows_hair_where_it_is_drawn(fits):
    face = fits["smiling_woman"]
    h, w, _ = (picture := preview(face)).shape
    sketch, fitted, aside, _ = np.split(picture.astype(int), 4, axis=1)
    brown = np.clip(np.array(face.hair.colour), 0, 1)
    for shown in (fitted, aside):
        top = shown[: h // 4]
        dark = (top < 200).all(axis=2) & (top[:, :, 0] > top[:, :, 2])
        assert dark.mean() > 0.15 and brown[0] > brown[2]
    # Beside the face, where only hair is drawn.
    beside = (np.arange(w // 4) < w // 16)[None] & (sketch.min(axis=2) < 100)
    assert (fitted[beside] < 230).all(axis=1).mean() > 0.6


def test_without_hair_what_is_drawn_of_it_is_grey():
    (path,) = (path for path in SKETCHES if path.stem == "smiling_woman")
    face = fit(path, FitOptions(hair="ignore"))
    assert face.cut is None and face.hair is None and report(face)["hair"] is None
    picture = preview(face)
    h, w, _ = picture.shape
    assert picture.dtype == np.uint8
    assert w % 4 == 0
    sketch, fitted, aside, overlay = np.split(picture.astype(int), 4, axis=1)
    assert np.ptp(sketch, axis=2).max() == 0  # grey
    for face in (fitted, aside):
        assert np.ptp(face[h // 2, w // 8]) > 20  # skin
    beside = (aside == 255).all(axis=2) & (np.arange(w // 4) < w // 32)
    hair = (sketch.min(axis=2) < 100) & beside
    assert hair.any() and (fitted[hair] < 215).all() and np.ptp(fitted[hair], axis=1).max() < 30
    red = (overlay[:, :, 0] - overlay[:, :, 2]) > 80
    blue = (overlay[:, :, 2] - overlay[:, :, 0]) > 80  # what has no place: her hair
    assert red.any() and blue.any()
    assert blue[: h // 3].sum() > blue[h // 3 : 2 * h // 3, w // 10 : 3 * w // 20].sum()


def test_an_exaggerated_face_is_farther_from_the_plain_one_and_as_near_to_the_sketch(fits):
    plain = fits["smiling_woman"]
    more = fit(plain.drawing, FitOptions(exaggerate=1.5))
    np.testing.assert_allclose(more.offsets, 1.5 * plain.offsets, atol=1e-7)
    assert more.parameters.aus["smile"] == pytest.approx(1.5 * plain.parameters.aus["smile"])
    assert more.parameters.identity.keys() == plain.parameters.identity.keys()
    assert more.contour_error_px == plain.contour_error_px
    np.testing.assert_allclose(more.vertices, more.rig.pose(more.parameters, more.offsets))
    seen = []
    fit(plain.drawing, FitOptions(exaggerate=0.5), shaped=lambda *face: seen.append(face))
    assert seen[0][0].aus["smile"] == pytest.approx(0.5 * plain.parameters.aus["smile"])
    with pytest.raises(InputError, match="exaggerate"):
        FitOptions(exaggerate=4.0)


def test_pins_override_where_a_landmark_was_found():
    picture, camera, posed = drawn(FaceParameters({"smile": 2.0}))
    plain = fit(picture)
    place = plain.detection.landmarks["nose_tip"]
    pin = place[0] + 7, place[1] - 5
    pinned = fit(picture, FitOptions(pins={"nose_tip": pin}))
    from facs_rig import LANDMARKS

    at = pinned.rig.landmarks[LANDMARKS.index("nose_tip")]
    there = pinned.camera.project(pinned.vertices[at][None])[0]
    np.testing.assert_allclose(there, pin, atol=1.5)
    with pytest.raises(ValueError, match="did you mean 'nose_tip'"):
        FitOptions(pins={"nose_tp": (1.0, 2.0)})
    with pytest.raises(ValueError, match="place u,v in pixels"):
        FitOptions(pins={"nose_tip": (1.0, float("nan"))})
