"""Every kind of picture that somebody hands in, good and bad."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageDraw
from scipy import ndimage

from addon import drawing
from addon.drawing import Drawing, load_drawing, normalise
from facs_rig.common.errors import InputError


def sketch(width: int = 240, height: int = 300, line: int = 3) -> np.ndarray:
    """A plain face in black on white, (height, width) uint8."""
    picture = Image.new("L", (width, height), 255)
    pen = ImageDraw.Draw(picture)

    def oval(u, v, wide, high, start=0, end=360):
        box = [(u - wide) * width, (v - high) * height, (u + wide) * width, (v + high) * height]
        pen.arc(box, start, end, fill=0, width=line)

    oval(0.5, 0.5, 0.32, 0.42)
    oval(0.37, 0.48, 0.08, 0.03)
    oval(0.63, 0.48, 0.08, 0.03)
    oval(0.5, 0.62, 0.06, 0.03, 0, 180)
    oval(0.5, 0.72, 0.13, 0.06, 10, 170)
    return np.asarray(picture)


CLEAN = sketch()
INK = CLEAN < 128


def agreement(image: np.ndarray, ink: np.ndarray = INK) -> float:
    """Intersection over union of the ink that was found and the ink that was drawn."""
    found = image < 0.5
    return float((found & ink).sum() / (found | ink).sum())


def save(path, array, mode=None, **options):
    picture = Image.fromarray(array)
    (picture.convert(mode) if mode else picture).save(path, **options)
    return path


def refusal(path) -> str:
    with pytest.raises(InputError) as caught:
        load_drawing(path)
    text = str(caught.value)
    assert "\n" not in text and text.endswith(".")
    return text


# --- what cannot be used -------------------------------------------------------------------------


def test_a_missing_file_is_named(tmp_path):
    assert "There is no file" in refusal(tmp_path / "nobody.png")


def test_a_folder_is_not_a_sketch(tmp_path):
    assert "is a folder" in refusal(tmp_path)


def test_text_named_png(tmp_path):
    path = tmp_path / "letter.png"
    path.write_text("Dear drawing,\n")
    assert "is not a picture that can be read; save the sketch as PNG" in refusal(path)


def test_an_empty_file(tmp_path):
    path = tmp_path / "empty.png"
    path.touch()
    assert "is an empty file" in refusal(path)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_a_file_that_breaks_off(tmp_path, suffix, share):
    path = save(tmp_path / f"whole.{suffix}", CLEAN)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert "save the sketch" in refusal(path)


@pytest.mark.parametrize("tone", [0, 90, 255])
def test_a_blank_page(tmp_path, tone):
    path = save(tmp_path / "blank.png", np.full((200, 200), tone, np.uint8))
    assert "is blank; draw a face on it" in refusal(path)


def test_a_blank_page_with_the_grain_of_a_scanner(tmp_path, rng):
    grain = np.clip(230 + rng.normal(0, 4, (300, 300)), 0, 255).astype(np.uint8)
    assert "is blank" in refusal(save(tmp_path / "scan.png", grain))


def test_a_blank_transparent_page(tmp_path):
    nothing = np.zeros((100, 100, 4), np.uint8)
    assert "is blank" in refusal(save(tmp_path / "layer.png", nothing))


def test_one_pixel(tmp_path):
    path = save(tmp_path / "dot.png", np.zeros((1, 1), np.uint8))
    assert "is only 1×1 pixels" in refusal(path)


def test_a_strip(tmp_path):
    strip = np.full((40, 8000), 255, np.uint8)
    strip[20] = 0
    assert "is a strip of 8000×40 pixels" in refusal(save(tmp_path / "strip.png", strip))


@pytest.mark.parametrize("name", ["astronaut", "camera", "chelsea", "coffee"])
def test_a_photograph_is_read_by_its_lines_and_called_one(tmp_path, name):
    data = pytest.importorskip("skimage.data")
    found = load_drawing(save(tmp_path / "photo.png", getattr(data, name)()))
    assert found.painted
    assert 0.3 < (found.image > 0.9).mean() < 0.95  # lines on paper, no grey field
    assert not Drawing.of(CLEAN).painted


def shaded(clean: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Pencil over half of the page, darker toward one corner, and smudged over the lines."""
    height, width = clean.shape
    v, u = np.mgrid[:height, :width] / height
    tone = 0.25 + 0.55 * np.clip(1.2 * u - 0.3 * v, 0, 1) + rng.normal(0, 0.02, clean.shape)
    tone = np.where(u + v < 0.4, 0.0, ndimage.gaussian_filter(tone, 1.5))
    return np.clip(clean * (1 - tone), 0, 255).astype(np.uint8)


def test_lines_are_found_under_shading(rng):
    picture = np.minimum(shaded(np.full_like(CLEAN, 255), rng), 255)
    picture = (picture * np.where(INK, 0.45, 1.0)).astype(np.uint8)
    found = Drawing.of(picture).image < 0.5
    near = ndimage.binary_dilation(INK, iterations=2)
    assert found[INK].mean() > 0.85 and near[found].mean() > 0.85


def test_a_decompression_bomb_is_refused_before_it_is_decoded(tmp_path, monkeypatch):
    # A file of a few kilobytes that would need gigabytes.
    path = tmp_path / "bomb.png"
    bomb = bytearray(save(path, CLEAN).read_bytes())
    bomb[16:24] = struct.pack(">II", 30_000, 30_000)  # the size in the header
    bomb[29:33] = struct.pack(">I", zlib.crc32(bomb[12:29]))
    path.write_bytes(bomb)
    assert "has more than 150 million pixels; scale it down" in refusal(path)
    small = save(tmp_path / "small.png", CLEAN)
    monkeypatch.setattr(drawing, "MOST_PIXELS", 1000)
    assert "million pixels; scale it down" in refusal(small)


def test_not_a_number(tmp_path):
    values = np.ones((64, 64))
    values[3, 4] = np.nan
    with pytest.raises(InputError, match="not numbers"):
        normalise(values)


@pytest.mark.parametrize("shape", [(64,), (64, 64, 2), (2, 64, 64, 3)])
def test_arrays_of_another_shape(shape):
    with pytest.raises(InputError, match="expected"):
        normalise(np.ones(shape))


# --- what can ------------------------------------------------------------------------------------


def test_a_clean_drawing_stays_as_it_is(tmp_path):
    result = load_drawing(save(tmp_path / "clean.png", CLEAN))
    assert result.image.dtype == np.float32
    assert result.image.shape == CLEAN.shape
    assert result.size == (240, 300)
    assert result.scale == (1.0, 1.0)
    assert not result.inverted
    np.testing.assert_array_equal(result.image, (CLEAN > 127).astype(np.float32))


def test_a_picture_in_memory():
    result = drawing.Drawing.of(CLEAN)
    assert (result.size, result.scale, result.source) == ((240, 300), (1.0, 1.0), None)
    np.testing.assert_array_equal(result.image, normalise(CLEAN))


def test_sixteen_bits(tmp_path):
    wide = CLEAN.astype(np.uint16) * 257
    assert agreement(load_drawing(save(tmp_path / "wide.png", wide)).image) == 1


@pytest.mark.parametrize("invert", [False, True])
def test_twelve_bits_in_a_box_of_sixteen(tmp_path, invert):
    twelve = CLEAN.astype(np.uint16) * 16
    twelve = 4080 - twelve if invert else twelve
    assert agreement(load_drawing(save(tmp_path / "twelve.tif", twelve)).image) == 1


@pytest.mark.parametrize("ink", [0, 255])
def test_a_transparent_ground(tmp_path, ink):
    layer = np.full((*CLEAN.shape, 4), ink, np.uint8)
    layer[..., 3] = 255 - CLEAN
    result = load_drawing(save(tmp_path / "layer.png", layer))
    assert agreement(result.image) == 1
    assert result.inverted == (ink == 255)


@pytest.mark.parametrize("mode", ["1", "P", "CMYK", "RGB", "LA", "YCbCr"])
def test_colour_modes(tmp_path, mode):
    path = save(tmp_path / "mode.tif", CLEAN, mode)
    assert agreement(load_drawing(path).image) == 1


def test_a_palette_with_a_transparent_entry(tmp_path):
    picture = Image.fromarray(np.where(INK, 1, 0).astype(np.uint8), "P")
    picture.putpalette([255, 0, 255, 0, 0, 0])
    picture.save(tmp_path / "palette.png", transparency=0)
    assert agreement(load_drawing(tmp_path / "palette.png").image) == 1


def test_the_orientation_tag_of_a_camera(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held upright: turn by 90° clockwise
    path = tmp_path / "phone.jpg"
    Image.fromarray(np.rot90(CLEAN)).save(path, exif=exif, quality=95)
    result = load_drawing(path)
    assert result.size == (240, 300)
    assert agreement(result.image) > 0.95


def test_chalk_on_a_board(tmp_path):
    result = load_drawing(save(tmp_path / "chalk.png", 255 - CLEAN))
    assert result.inverted
    assert agreement(result.image) == 1


def test_a_huge_picture_is_reduced_and_remembers_its_pixels(tmp_path):
    big = sketch(3600, 4500, 40)
    result = load_drawing(save(tmp_path / "big.png", big))
    assert max(result.image.shape) == drawing.LONGEST_SIDE
    assert result.size == (3600, 4500)
    height, width = result.image.shape
    np.testing.assert_allclose(result.to_input(np.array([[width, height]])), [[3600, 4500]])
    # A dark pixel of the small picture lies on a stroke of the big one.
    v, u = np.argwhere(result.image < 0.1)[::500].T + 0.5
    at = result.to_input(np.stack([u, v], axis=1)).astype(int)
    assert (big[at[:, 1], at[:, 0]] == 0).mean() > 0.95


def test_thin_lines_survive_the_reduction(tmp_path):
    found = load_drawing(save(tmp_path / "thin.png", sketch(5000, 6000, 3))).image < 0.6
    drawn = sketch(*found.shape[::-1], 1) < 128
    assert ndimage.binary_dilation(found, iterations=4)[drawn].mean() > 0.98
    assert ndimage.binary_dilation(drawn, iterations=4)[found].mean() > 0.98


def photographed(clean: np.ndarray, ink: float, rng: np.random.Generator) -> np.ndarray:
    """A page on a table under a lamp, with the shadow of the hand that holds the phone."""
    height, width = clean.shape
    v, u = np.mgrid[:height, :width] / height
    light = 0.85 - 0.4 * u - 0.1 * v**2
    shadow = ndimage.gaussian_filter(np.where(u + 0.6 * v > 1.0, 0.75, 1.0), width / 40)
    page = ink + (1 - ink) * ndimage.gaussian_filter(clean / 255, 0.6)
    photo = light * shadow * page + rng.normal(0, 0.012, clean.shape)
    return np.clip(255 * photo, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("ink", [0.15, 0.5])
def test_paper_photographed_in_uneven_light(tmp_path, rng, ink):
    photo = photographed(CLEAN, ink, rng)
    result = load_drawing(save(tmp_path / "photo.jpg", photo, quality=92))
    assert agreement(result.image) > 0.85
    far = ~ndimage.binary_dilation(INK, iterations=4)
    assert result.image[far].mean() > 0.985  # the shadow is gone


def test_toned_paper(tmp_path, rng):
    toned = np.where(INK, 60, 150) + rng.normal(0, 3, CLEAN.shape)
    path = save(tmp_path / "toned.png", toned.astype(np.uint8))
    assert agreement(load_drawing(path).image) > 0.98


def test_hair_filled_in_black_stays_black(tmp_path):
    filled = CLEAN.copy()
    filled[: CLEAN.shape[0] // 3, 30:210] = 10
    path = save(tmp_path / "filled.png", filled)
    image = load_drawing(path).image
    assert image[10:90, 40:200].max() < 0.1
    assert agreement(image, filled < 128) == 1


# --- laws ----------------------------------------------------------------------------------------


@st.composite
def drawings(draw) -> np.ndarray:
    """Random strokes on paper of any tone, (h, w) uint8, dark ink."""
    width, height = draw(st.integers(64, 200)), draw(st.integers(64, 200))
    paper = draw(st.integers(140, 255))
    ink = draw(st.integers(0, paper - 80))
    picture = Image.new("L", (width, height), paper)
    pen = ImageDraw.Draw(picture)
    pen.line([(8, 8), (width - 8, height - 8)], fill=ink, width=3)
    for _ in range(draw(st.integers(1, 5))):
        points = [
            (draw(st.integers(6, width - 6)), draw(st.integers(6, height - 6)))
            for _ in range(draw(st.integers(2, 4)))
        ]
        pen.line(points, fill=ink, width=draw(st.integers(2, 4)))
    return np.asarray(picture)


@given(drawings())
def test_a_drawing_and_its_negative_are_the_same(array):
    np.testing.assert_allclose(normalise(255 - array), normalise(array), atol=1e-5)


@given(drawings())
def test_normalising_twice_changes_nothing(array):
    once = normalise(array)
    np.testing.assert_allclose(normalise(once), once, atol=1e-5)


@given(drawings())
def test_ink_is_dark_and_paper_light(array):
    once = normalise(array)
    assert once.dtype == np.float32
    assert once.min() == 0 and once.max() == 1
    ink = array < (int(array.max()) + int(array.min())) / 2
    np.testing.assert_array_equal(once < 0.5, ink)


@given(drawings(), st.floats(0.5, 1.0), st.floats(0.0, 0.2))
def test_exposure_does_not_matter(array, gain, offset):
    values = array / 255
    changed = normalise(values * gain * (1 - offset) + offset)
    np.testing.assert_array_equal(changed < 0.5, normalise(values) < 0.5)


def test_normalising_a_photographed_page_twice_changes_next_to_nothing(rng):
    once = normalise(photographed(CLEAN, 0.3, rng))
    assert np.abs(normalise(once) - once).mean() < 0.005


def test_pale_solid_ink_stays_ink():
    """Crossing strokes make a solid patch; however grey the ink, it is no shadow on the paper."""
    picture = Image.new("L", (96, 96), 200)
    pen = ImageDraw.Draw(picture)
    pen.rectangle([30, 30, 62, 62], fill=120)
    pen.line([(6, 6), (90, 80)], fill=120, width=3)
    values = np.asarray(picture)
    np.testing.assert_array_equal(normalise(values) < 0.5, values < 160)
