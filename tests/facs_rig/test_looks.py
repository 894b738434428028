"""The colours of people, and what is painted with them."""

import numpy as np
import pytest

from addon.preview import paint
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from facs_rig.common.errors import InputError
from facs_rig.identity import LOOKS, check_identity, target_weights
from facs_rig.looks import DEFAULTS, PLAIN, colours_of, drawn_looks
from facs_rig.paint import MATERIAL_NAMES, TINTED, linear_light, painted, srgb, vertex_colours

SIDES = ("left", "right")
# The ten tones of the Monk Skin Tone Scale, sRGB.
MONK = ("f6ede4", "f3e7db", "f7ead0", "eadaba", "d7bd96",
        "a07e56", "825c43", "604134", "3a312a", "292420")  # fmt: skip


def colour(name, **looks):
    return np.array(colours_of(looks)[name].colour[:3])


def lightness(linear) -> float:
    """CIELAB's L of linear RGB."""
    y = np.array((0.2126, 0.7152, 0.0722)) @ linear
    return float(116 * np.cbrt(y) - 16)


def test_the_default_person_is_as_before():
    assert colours_of({}) == colours_of(DEFAULTS) == PLAIN
    assert PLAIN["skin"].colour == (0.86, 0.63, 0.52, 1.0)
    assert {f.name: f.default for f in LOOKS} == DEFAULTS
    almost = colours_of({"skin_tone": DEFAULTS["skin_tone"] + 1e-9})
    for name in PLAIN:
        assert almost[name].colour == pytest.approx(PLAIN[name].colour, abs=1e-6)


def test_skin_is_as_light_as_the_ten_tones_of_monks_scale():
    for k, tone in enumerate(MONK):
        code = np.array([int(tone[i : i + 2], 16) for i in (0, 2, 4)]) / 255
        ours = lightness(colour("skin", skin_tone=k / 9))
        assert ours == pytest.approx(lightness(linear_light(code)), abs=6)
    light = [lightness(colour("skin", skin_tone=t)) for t in np.linspace(0, 1, 30)]
    assert (np.diff(light) < 0).all()


@pytest.mark.parametrize("tone", [0.0, 0.35, 0.6, 0.8, 1.0])
def test_any_skin_is_skin(tone):
    """Red before green before blue, whatever else is set; lips stay redder than the skin."""
    for redness in (-1, 0, 1):
        skin = colour("skin", skin_tone=tone, skin_redness=redness)
        assert skin[0] > skin[1] > 0.8 * skin[2]
        lips = colour("lips", skin_tone=tone, skin_redness=redness)
        assert lips[1] / lips[0] < skin[1] / skin[0]
    red, sallow = (colour("skin", skin_tone=tone, skin_redness=r) for r in (1, -1))
    assert red[1] / red[0] < sallow[1] / sallow[0]
    bright = colour("lips", skin_tone=tone, lip_colour=1)
    assert bright[1] / bright[0] < 0.3


def test_irises_run_from_brown_to_grey():
    brown, hazel, green, blue, grey = (
        colour("iris", iris_colour=v) for v in (0.2, 0.42, 0.56, 0.72, 1.0)
    )
    assert brown[0] > 2 * brown[2] and hazel[0] > hazel[1] > 2 * hazel[2]
    assert green[1] == green.max() and blue[2] == blue.max()
    assert np.ptp(grey) < 0.1 < np.ptp(blue)


def test_brows_grow_dark_and_grey_and_shine_through_to_their_skin():
    blond, black = (colour("brows", brow_colour=v) for v in (0, 1))
    assert (blond > 10 * black).all()
    assert np.ptp(colour("brows", brow_grey=1)) < 0.02
    for looks in ({"brow_colour": 0.0}, {"brow_colour": 1.0}, {"brow_colour": 0, "skin_tone": 1}):
        between = colour("brow_skin", **looks)
        ends = np.sort([colour("brows", **looks), colour("skin", **looks)], axis=0)
        assert (ends[0] <= between + 1e-9).all() and (between <= ends[1] + 1e-9).all()


def test_gloss_is_smooth_and_stays_a_roughness():
    dull, plain, oily = (colours_of({"skin_gloss": v})["skin"].roughness for v in (-1, 0, 1))
    assert 1 > dull > plain > oily > 0.1


@pytest.mark.parametrize("feature", LOOKS, ids=lambda f: f.name)
def test_colours_move_nothing_and_stay_colours(feature):
    for value in (feature.minimum, feature.maximum):
        np.testing.assert_array_equal(target_weights({feature.name: value}), target_weights({}))
        for finish in colours_of({feature.name: value}).values():
            assert 0 <= min(finish.colour) and max(finish.colour) <= 1
            assert 0 < finish.roughness < 1
    with pytest.raises(InputError, match=feature.name):
        check_identity({feature.name: 1.5})


def test_drawn_people_are_of_every_colour():
    rng = np.random.default_rng(4)
    for _ in range(100):
        check_identity(drawn_looks(rng))
    drawn = [drawn_looks(rng, {"african": a, "asian": b, "caucasian": c, "age": age})
             for a, b, c in np.eye(3) for age in (0, 1) for _ in range(100)]  # fmt: skip
    tones = np.array([d["skin_tone"] for d in drawn]).reshape(3, -1)
    assert tones.min() < 0.1 and tones.max() > 0.9
    assert tones[0].mean() > tones[1].mean() + 0.2 > tones[2].mean() + 0.2
    irises = np.array([d["iris_colour"] for d in drawn])
    assert (np.histogram(irises, 5, (0, 1))[0] > 5).all()
    grey = np.array([d["brow_grey"] for d in drawn]).reshape(3, 2, -1).mean(axis=(0, 2))
    assert grey[0] < 0.1 < 0.5 < grey[1]
    again = drawn_looks(np.random.default_rng(3))
    assert again == drawn_looks(np.random.default_rng(3))


def test_vertices_have_the_colours_of_their_material():
    rig = load_rig()
    found, who = painted(rig), {"skin_tone": 0.7, "iris_colour": 0.1}
    linear = found.colours(colours_of(who))
    palette = colours_of(who)
    for name in ("eyes", "iris", "pupil", "teeth", "brows"):
        own = found.material == MATERIAL_NAMES.index(name)
        assert own.any()
        np.testing.assert_allclose(linear[own], np.tile(palette[name].colour, (own.sum(), 1)))
    share = found.areas.sum(axis=1)
    assert set(np.unique(share.round(5))) == {0.0, 1.0}
    for k, name in enumerate(TINTED):
        whole = (found.areas[:, k] == 1) & (found.blush == 1).all(axis=1)
        np.testing.assert_allclose(
            linear[whole], np.tile(palette[name].colour, (whole.sum(), 1)), rtol=1e-5
        )
    mixed = (found.areas[:, 1] > 0.1) & (found.areas[:, 1] < 0.9)
    assert mixed.sum() > 50  # a soft rim
    assert (
        vertex_colours(rig, who)[rig.parts["skin"]].mean()
        < 0.7 * vertex_colours(rig)[rig.parts["skin"]].mean()
    )


def test_linear_light_is_the_inverse_of_srgb():
    values = np.linspace(0, 1, 50)
    np.testing.assert_allclose(linear_light(srgb(values)), values, atol=1e-6)


def test_the_lining_of_the_mouth_is_painted_on_no_cheek():
    """Of people whose mouth is wide for their jaw, with the mouth closed: where cheeks are, in the
    picture, there is skin."""
    rig = load_rig()
    for who in (
        {"mouth_width": 0.41, "mouth_height": -0.45, "head_width": -0.37, "weight": -0.39},
        {"mouth_width": 1.0, "head_width": -1.0, "weight": -1.0},
        {"mouth_width": -1.0, "head_width": 1.0, "jaw_width": 1.0},
    ):
        vertices = rig.pose(FaceParameters({}, who))
        camera = Camera.framing(vertices, 500, 500)
        picture = paint(rig, vertices, camera, who).astype(float)
        corners, jaws = (
            camera.project(vertices[rig.landmarks[[LANDMARKS.index(f"{n}_{s}") for s in SIDES]]])
            for n in ("mouth_corner", "jawline_3")
        )
        for corner, jaw in zip(corners, jaws, strict=True):
            (left, right), row = sorted((corner[0], jaw[0])), round(corner[1])
            cheek = picture[row - 40 : row + 25, round(left) + 12 : round(right) - 12]
            assert cheek.size and cheek.min() > 60
