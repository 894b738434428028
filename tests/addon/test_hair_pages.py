"""Pages on which hair is not as one would wish: a sensible face, or one clear sentence."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.spatial import ConvexHull

import addon
from addon.pipeline import FaceFit, FitOptions, fit, report
from dataset_gen import Style, ink
from dataset_gen.conventions import Artist, draw_by_convention, zoomed
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig, rasterise
from facs_rig.common.errors import InputError

WOMAN = Path(addon.__file__).parent / "sketches" / "smiling_woman.png"
OPTIONS = FitOptions(strokes="ignore")


@cache
def page() -> np.ndarray:
    """(h, w) uint8 of a woman with long hair."""
    return np.array(Image.open(WOMAN).convert("L"))


@cache
def woman() -> FaceFit:
    return fit(page(), OPTIONS)


def over(face: FaceFit, *names: str) -> float:
    """The share of a part of the face, the hull of landmarks that begin so, that hair hides."""
    rig, hair, camera = face.rig, face.hair, face.camera
    every = np.concatenate([face.vertices, hair.on(face.vertices)])
    triangles = np.concatenate([rig.triangles, hair.triangles + len(face.vertices)])
    hidden = rasterise(every, triangles, camera).triangle >= len(rig.triangles)
    marks = camera.project(face.vertices[rig.landmarks])
    of = marks[[k for k, name in enumerate(LANDMARKS) if name.startswith(names)]]
    place = Image.new("1", hidden.shape[::-1])
    ImageDraw.Draw(place).polygon(of[ConvexHull(of).vertices].ravel().tolist(), fill=1)
    return float(hidden[np.asarray(place)].mean())


def drawn_on(lines, width: int = 5) -> np.ndarray:
    """The woman's page with lines of pixels over it."""
    picture = Image.fromarray(page())
    for line in lines:
        ImageDraw.Draw(picture).line([tuple(p) for p in line], fill=20, width=width)
    return np.array(picture)


def spot(name: str) -> np.ndarray:
    return np.array(woman().detection.landmarks[name]) * woman().drawing.scale


def test_a_stroke_of_hair_across_the_face_is_no_curtain():
    begin, end = spot("temple_left"), spot("jawline_4_right")
    lines = [np.linspace(begin + (0, k), end + (0, 2 * k), 12) for k in (-6, 0, 6)]
    face = fit(drawn_on(lines), OPTIONS)
    assert face.cut is not None
    assert over(face, "lip_", "mouth_") < 0.1 and over(face, "eye_") < 0.25
    # In front the hair ends about where it does without the stroke.
    front = np.r_[0:4, 45:48]
    assert np.median(face.cut.edge[front] - woman().cut.edge[front]) > -0.25


@pytest.mark.parametrize("side", ["above", "beside"])
def test_hair_that_leaves_the_page_goes_on(side):
    v, u = np.nonzero(page() < 128)
    brow = spot("brow_peak_left")
    if side == "above":
        part = page()[int(0.7 * v.min() + 0.3 * brow[1]) :]
    else:
        part = page()[:, int((u.min() + spot("temple_right")[0]) / 2) :]
    face = fit(part, OPTIONS)
    assert face.cut is not None and np.isfinite(face.hair.points).all()
    assert over(face, "eye_") < 0.1
    assert np.abs(face.hair.points).max() < 0.6  # metres


def test_hair_of_two_who_touch_stays_with_each():
    _, u = np.nonzero(page() < 128)
    one = page()[:, u.min() : u.max() + 1]
    face = fit(np.concatenate([one, one[:, ::-1]], axis=1), OPTIONS)
    assert face.cut is not None and len(face.detection.faces) == 2
    # It ends beside its own head: no wider than that of the woman alone, by a hand.
    wide, alone = (np.ptp(f.hair.points[:, 0]) for f in (face, woman()))
    assert wide < alone + 0.1


def test_a_page_that_is_nearly_all_hair_is_a_face_or_one_sentence():
    picture = Image.new("L", page().shape[::-1], 15)
    outline = np.array([spot(name) for name in LANDMARKS
                        if name.startswith(("jawline", "chin", "temple", "forehead"))])  # fmt: skip
    mask = Image.new("1", picture.size)
    hull = outline[ConvexHull(outline).vertices]
    ImageDraw.Draw(mask).polygon([tuple(p) for p in hull], fill=1)
    picture.paste(Image.fromarray(page()), mask=mask)
    rng = np.random.default_rng(0)
    for _ in range(60):  # light between the strands
        x, y = rng.uniform(0, picture.width), rng.uniform(0, picture.height)
        ImageDraw.Draw(picture).line([(x, y), (x + rng.normal(0, 9), y + 80)], fill=90)
    picture.paste(Image.fromarray(page()), mask=mask)
    try:
        face = fit(np.array(picture), OPTIONS)
    except InputError as error:
        assert "\n" not in str(error) and str(error).endswith(".")
        return
    assert np.isfinite(face.vertices).all()
    if face.cut is not None:
        assert np.abs(face.hair.points).max() < 0.6 and over(face, "eye_") < 0.1


# --- hats, and none -------------------------------------------------------------------------------


@cache
def conventional(hat: str, cut: str) -> FaceFit:
    """A face that an artist drew with this hat and this hair."""
    rig, parameters = load_rig(), FaceParameters(head=(0.15, 0.0, 0.0))
    artist = Artist(hat=hat, cut=cut, room=1.6, finish="strands")
    vertices = rig.pose(parameters)
    camera = zoomed(Camera.framing(rig.extent(parameters), 400, 400), artist.room)
    lines, *_ = draw_by_convention(
        rig, vertices, camera, parameters, artist, 1.6, np.random.default_rng(3)
    )
    return fit(ink(lines, 400, 400, Style(width=1.6)), OPTIONS)


@pytest.mark.parametrize("hat", ["brim", "beanie"])
def test_a_hat_becomes_a_hat_and_no_hair(hat):
    face = conventional(hat, "bald")
    assert face.hat is not None and face.cut is None and not face.hat_left_out
    told = report(face)
    assert told["hair"] is None and told["hat"]["left_out"] is None
    rig, made = face.rig, face.hat_mesh
    every = np.concatenate([face.vertices, made.on(face.vertices)])
    triangles = np.concatenate([rig.triangles, made.triangles + len(face.vertices)])
    shown = rasterise(every, triangles, face.camera).triangle
    crown = face.vertices[rig.parts["skin"]]
    top = np.floor(face.camera.project(crown[[crown[:, 1].argmax()]])[0]).astype(int)
    assert shown[top[1] + 2, top[0]] >= len(rig.triangles)  # it sits on the head


@pytest.mark.parametrize("cut", ["short", "long"])
def test_hair_is_no_hat_and_a_bald_head_has_neither(cut):
    face = conventional("none", cut)
    assert face.hat is None and face.cut is not None and report(face)["hat"] is None
    bald = conventional("none", "bald")
    assert bald.hat is None and bald.cut is None


def test_a_hat_of_which_none_can_be_made_is_told(monkeypatch):
    monkeypatch.setattr("addon.hair.fit_hat", lambda *_: None)
    conventional.cache_clear()
    face = conventional("brim", "bald")
    conventional.cache_clear()
    assert face.cut is None and face.hat is None and face.hat_left_out
    assert "left out" in report(face)["hat"]["left_out"]
    assert replace(face, hat_left_out=False).hair is None
