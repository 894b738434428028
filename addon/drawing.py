"""From what an artist hands in to a clean drawing: ink 0 on paper 1.

Scans, phone photographs of paper, exports of paint programs with a transparent ground, chalk on a
black board: everything after this module sees one kind of picture. What cannot be used is refused
with one sentence that says what is wrong and how to mend it.
"""

from __future__ import annotations

import stat
import struct
import warnings
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageOps, UnidentifiedImageError
from scipy import ndimage

from addon.accepted import FORMATS
from addon.ruled import without_rules
from facs_rig.common.errors import InputError
from facs_rig.common.files import reason_of

Floats = NDArray[np.float32]

LONGEST_SIDE = 2048  # px: more detail than any line has, and small enough to be quick
SHORTEST_SIDE = 32  # px: a face of fewer pixels has no features left
MOST_PIXELS = 150_000_000  # a whole decoded picture has to fit into memory

_PAPER_BLOCKS = 192  # the paper's tone is estimated on a grid of about so many blocks a side
_SOLID_INK = 0.35  # of the way from ink to paper: a broad area below is ink, above it is shadow
_BLACK, _MUCH_BLACK = 0.15, 0.25  # tone relative to the paper; share of the page
_FAINTEST_CONTRAST = 0.04  # of the full range, between paper and ink
_FAINTEST_INK = 0.12  # darkness relative to the paper that can be a stroke
_LEAST_INK = 2e-4  # share of the picture: less than that is dust
# What photographs have much of and line drawings little; shares of the limits add up. Shaded pencil
# under uneven light reaches 0.6 of what is allowed, portraits from 0.9, most photographs 1.5 to 3.
_MOST_GRAIN = 0.16  # spread of the commonest tones, relative to the paper
_MOST_MIDTONES = 0.24  # share of the picture in broad areas neither paper nor ink


@dataclass(frozen=True)
class Drawing:
    """A drawing as the rest of the program wants it.

    image : (h, w) float32, 1 = paper, 0 = ink, at most `LONGEST_SIDE` px on a side.
    size : (width, height) in pixels of the picture as it was handed in, the way up that viewers
        show it (the camera's orientation tag is followed).
    source : the file that it came from, or None.
    inverted : whether light ink on a dark ground was turned over.
    turn : quarter turns anticlockwise, 0..3, that made `image` of the picture as it was handed in.
    """

    image: Floats
    size: tuple[int, int]
    source: Path | None = None
    inverted: bool = False
    turn: int = 0

    @classmethod
    def of(cls, array: NDArray[Any], name: str = "The sketch") -> Drawing:
        """The drawing of a picture in memory, normalised as `normalise` does it and reduced to
        `LONGEST_SIDE` where it is larger."""
        values = _checked(array, name)
        image, inverted = _normalise(_reduced(values, name), name)
        return cls(image=image, size=(values.shape[1], values.shape[0]), inverted=inverted)

    def turned(self, turn: int) -> Drawing:
        """The same drawing, turned by so many quarter turns anticlockwise."""
        image = np.ascontiguousarray(np.rot90(self.image, turn))
        return replace(self, image=image, turn=(self.turn + turn) % 4)

    @property
    def scale(self) -> tuple[float, float]:
        """Input pixels per pixel of `image`, along its u and v (1 unless the picture was huge)."""
        height, width = self.image.shape
        wide, high = self.size if self.turn % 2 == 0 else self.size[::-1]
        return wide / width, high / height

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(3, 3) from pixels (u, v, 1) of `image` to those of the picture that was handed in.

        Pixel centres lie at .5 in both, so that it is a scaling and quarter turns, nothing else.
        """
        wide, high = self.size
        quarter = (
            [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            [[0, -1, wide], [1, 0, 0], [0, 0, 1]],
            [[-1, 0, wide], [0, -1, high], [0, 0, 1]],
            [[0, 1, 0], [-1, 0, high], [0, 0, 1]],
        )[self.turn]
        return np.array(quarter, np.float64) @ np.diag([*self.scale, 1.0])

    def to_input(self, points: ArrayLike) -> NDArray[np.float64]:
        """(…, 2) points (u, v) of `image` as pixels of the picture that was handed in."""
        return _moved(points, self.matrix)

    def to_image(self, points: ArrayLike) -> NDArray[np.float64]:
        """The reverse of `to_input`."""
        return _moved(points, np.linalg.inv(self.matrix))


def _moved(points: ArrayLike, matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(points, np.float64) @ matrix[:2, :2].T + matrix[:2, 2]


def load_drawing(path: str | Path) -> Drawing:
    """Read and normalise a sketch file.

    Turned as the camera's orientation tag says, flattened on white (or on black, for light ink)
    where it is transparent, reduced to `LONGEST_SIDE` and normalised as `normalise` does it.

    Raises InputError for whatever is missing, unreadable, too small, too large, blank or not a
    line drawing.
    """
    path = Path(path)
    picture = _open(path)
    name = f"'{path}'"
    size = picture.size
    if min(size) < SHORTEST_SIDE:
        raise InputError(_too_small(name, size))
    image, inverted = _normalise(_reduced(_values(picture), name), name)
    return Drawing(image=image, size=size, source=path, inverted=inverted)


def normalise(array: NDArray[Any], name: str = "The sketch") -> Floats:
    """A picture in memory as a drawing: (h, w) float32, 1 = paper, 0 = ink.

    array : (h, w) grey, (h, w, 3) RGB or (h, w, 4) RGBA; bool, integer (full range of its type) or
        float (0..1).
    name : what the message calls it.

    The paper's tone is estimated and divided out, the ink is stretched so that the darker half of
    it is 0, and light ink on a dark ground is turned over. Normalising twice changes nothing, and
    a drawing and its negative give the same.

    Raises InputError for a picture that is too small, blank, or not a line drawing.
    """
    return _normalise(_checked(array, name), name)[0]


def _checked(array: NDArray[Any], name: str) -> Floats:
    """A picture in memory as grey 0..1, if it is one and large enough."""
    array = np.asarray(array)
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (3, 4)):
        raise InputError(
            f"{name} has the shape {array.shape}; expected (h, w), (h, w, 3) or (h, w, 4)."
        )
    height, width = array.shape[:2]
    if min(height, width) < SHORTEST_SIDE:
        raise InputError(_too_small(name, (width, height)))
    return _unit(array)


# --- reading -------------------------------------------------------------------------------------


def _open(path: Path) -> Image.Image:
    """The decoded picture, upright."""
    unreadable = (
        f"'{path}' is not a picture that can be read; save the sketch as PNG, JPEG, WebP or TIFF."
    )
    try:
        about = path.stat()
        if stat.S_ISDIR(about.st_mode):
            raise InputError(f"'{path}' is a folder; name one sketch in it.")
        if not stat.S_ISREG(about.st_mode):
            raise InputError(f"'{path}' is a device or a pipe; save the sketch in a file.")
        if about.st_size == 0:
            raise InputError(f"'{path}' is an empty file; save the sketch again.")
        with warnings.catch_warnings():
            # Pillow's complaints (huge pictures, odd metadata) are ours to judge and to word.
            warnings.simplefilter("ignore")
            Image.init()  # registers all of FORMATS
            with Image.open(path, formats=FORMATS) as picture:
                if picture.size[0] * picture.size[1] > MOST_PIXELS:
                    raise InputError(_too_large(path))
                picture.load()
                return ImageOps.exif_transpose(picture)
    except Image.DecompressionBombError:
        raise InputError(_too_large(path)) from None
    except UnidentifiedImageError:
        raise InputError(unreadable) from None
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"There is no file '{path}'; check the name and the folder.") from None
    except PermissionError:
        raise InputError(f"'{path}' may not be read; change its permissions.") from None
    except InputError:
        raise
    except OSError as error:
        if error.errno is None:  # Pillow's own, of files that break off
            raise InputError(_damaged(path)) from None
        raise InputError(f"'{path}' cannot be read: {reason_of(error)}.") from None
    except (SyntaxError, ValueError, EOFError, struct.error, zlib.error):
        # What Pillow's decoders raise for files that begin well and then break off.
        raise InputError(_damaged(path)) from None


def _damaged(path: Path) -> str:
    return f"'{path}' is damaged or cut off; save the sketch again as PNG or JPEG."


def _too_large(path: Path) -> str:
    return (
        f"'{path}' has more than {MOST_PIXELS // 1_000_000} million pixels; "
        f"scale it down, {LONGEST_SIDE} on the longest side is plenty."
    )


def _too_small(name: str, size: tuple[int, int]) -> str:
    return (
        f"{name} is only {size[0]}×{size[1]} pixels; a face needs at least "
        f"{SHORTEST_SIDE}×{SHORTEST_SIDE}, better 256×256."
    )


def _values(picture: Image.Image) -> Floats:
    """Luminance 0..1 of any Pillow picture, transparent ground filled."""
    if picture.has_transparency_data:
        return _unit(np.asarray(picture.convert("RGBA")))
    if picture.mode == "I":  # 16-bit files in a 32-bit box, with no word on the range
        wide = np.asarray(picture, np.float32)
        return wide / np.float32(65535 if wide.max(initial=0) > 255 else 255)
    if picture.mode.startswith("I;16"):
        return _unit(np.asarray(picture).astype(np.uint16))
    if picture.mode == "F":
        return _unit(np.asarray(picture))
    if picture.mode not in ("1", "L"):
        picture = picture.convert("RGB")
    return _unit(np.asarray(picture))


def _unit(array: NDArray[Any]) -> Floats:
    """(h, w) float32 luminance 0..1 of a grey, RGB or RGBA array."""
    if array.dtype == bool:
        values = array.astype(np.float32)
    elif np.issubdtype(array.dtype, np.integer):
        full, most = np.iinfo(array.dtype).max, int(array.max(initial=0))
        # Scanners of 10 or 12 bits save into 16 and leave the upper ones empty.
        full = most if 0 < most < full // 8 and array.itemsize > 1 else full
        values = array.astype(np.float32) / np.float32(full)
    else:
        values = array.astype(np.float32)
    if values.ndim == 2:
        return values
    # Rec. 601 luma: it also weakens the light blue that artists sketch underneath.
    grey = values[..., :3] @ np.array([0.299, 0.587, 0.114], np.float32)
    if values.shape[2] == 3:
        return grey
    alpha = values[..., 3]
    on_white = grey * alpha + (1 - alpha)
    if np.ptp(on_white) >= _FAINTEST_CONTRAST:
        return on_white
    return grey * alpha  # white ink, drawn to stand on a dark page


def _reduced(values: Floats, name: str) -> Floats:
    """(h, w) tones, at most `LONGEST_SIDE` on a side. InputError for a strip."""
    height, width = values.shape
    shrink = max(height, width) / LONGEST_SIDE
    if shrink <= 1:
        return values
    smaller = (max(1, round(width / shrink)), max(1, round(height / shrink)))
    if min(smaller) < SHORTEST_SIDE:
        raise InputError(f"{name} is a strip of {width}×{height} pixels; crop it around the face.")
    return _resize(values, smaller)


def _resize(values: Floats, size: tuple[int, int]) -> Floats:
    picture = Image.fromarray(np.ascontiguousarray(values, np.float32))
    return np.asarray(picture.resize(size, Image.Resampling.BOX, reducing_gap=3.0))


# --- normalising ---------------------------------------------------------------------------------


def _normalise(values: Floats, name: str) -> tuple[Floats, bool]:
    """The drawing, and whether it had to be turned over."""
    if not np.isfinite(values).all():
        raise InputError(f"{name} holds values that are not numbers; save it again.")
    dark, light = _extremes(values)
    if light - dark < _FAINTEST_CONTRAST:
        raise InputError(f"{name} is blank; draw a face on it, or choose another file.")
    inverted = _is_light_on_dark(np.clip((values - dark) / (light - dark), 0, 1))
    if inverted:
        values, dark, light = 1 - values, 1 - light, 1 - dark
    values = np.clip(values / light, 0, 1)

    paper = _paper(values, dark / light)
    if _tonality(1 - values / paper) > 1:
        raise InputError(
            f"{name} looks like a photograph or a painting, not a line drawing; "
            "trace the lines of the face on a blank layer and use that."
        )
    # Most of what is not solid black is paper, so that its median is the paper's own tone.
    there = _not_solid(values / paper)
    paper *= min(1.0, float(np.median((values / paper)[there])))
    noise = 1.4826 * float(np.median(np.abs(values - paper)[there]))  # robust standard deviation
    darkness = np.maximum(1 - values / paper, 0)
    grain = noise / paper  # the same noise is stronger against dimly lit paper
    ink = darkness > np.maximum(_FAINTEST_INK, 4 * grain)
    ruled, darkness = darkness, without_rules(darkness, ink)
    if darkness is not ruled:
        ink &= darkness > 0
    share = float(ink.mean())
    if share < _LEAST_INK:
        raise InputError(f"{name} is blank; draw a face on it, or choose another file.")
    # The darker half of the ink becomes full ink, the grain becomes paper. Both are fixed points
    # of a second pass: the grain is 0 then, and at least half of the ink is at 1.
    full = float(np.quantile(darkness[ink], 0.5, method="lower"))
    floor = np.minimum(3 * grain, full / 2)
    drawing = 1 - np.clip((darkness - floor) / (full - floor), 0, 1)
    return drawing.astype(np.float32), inverted


def _extremes(values: Floats) -> tuple[float, float]:
    """Darkest and lightest tone that more than a few pixels have."""
    few = max(4, int(1e-4 * values.size))
    flat = np.partition(values.ravel(), [few, values.size - 1 - few])
    return float(flat[few]), float(flat[-1 - few])


def _is_light_on_dark(values: Floats) -> bool:
    """Paper is what most of the picture and most of its margin are.

    values : (h, w) 0..1. Where those two disagree or are undecided, the thin strokes decide: they
    stand out of their surroundings on the ink's side. Odd under `1 - values`.
    """
    margin = max(1, min(values.shape) // 32)
    edge = np.concatenate(
        [
            values[:margin].ravel(),
            values[-margin:].ravel(),
            values[:, :margin].ravel(),
            values[:, -margin:].ravel(),
        ]
    )
    lightness = float(np.median(values)) + float(np.median(edge)) - 1
    # Of strokes there is little. Where both tones are broad, as with much black hair, none is paper
    # because there is more of it.
    black = float((values < 0.5).mean())
    if abs(lightness) > 0.2 and not _MUCH_BLACK < black < 1 - _MUCH_BLACK:
        return lightness < 0
    detail = values - ndimage.gaussian_filter(values, min(values.shape) / 40)
    skewness = float((detail**3).mean()) / max(float(detail.std()) ** 3, 1e-12)
    return skewness > 0.5


def _paper(values: Floats, black: float) -> Floats:
    """The paper's tone under each pixel: light that falls unevenly, toned paper.

    values : (h, w) 0..1, dark ink;  black : the darkest tone, of the ink. Returns (h, w) in 0.2..1.

    The light tones of small blocks are fitted with a cubic surface by asymmetric least squares
    (errors below it hardly count: that is ink), after which blocks that are paper by that fit are
    averaged locally. Large solid blacks stay black, as they lie far below the surface; a
    morphological closing would take them for shadow.
    """
    tones = _block_tones(values)
    if (tones[tones > 0.5] > 0.98).mean(dtype=float) > 0.98:
        return np.ones_like(values)  # a clean scan or a digital drawing: nothing to flatten
    surface = _upper_surface(tones)
    # Between dense strokes: the lightest tone within reach, then back to where it was.
    reach = 2 * (max(tones.shape) // 24) + 1
    tones = ndimage.grey_closing(tones, (reach, reach), mode="nearest")
    solid = black + _SOLID_INK * (1 - black)  # pale ink is solid at a paler tone
    weight = (tones > solid * surface).astype(np.float32)
    spread = max(tones.shape) / 64
    near = ndimage.gaussian_filter(weight, spread, mode="nearest")
    local = ndimage.gaussian_filter(weight * tones, spread, mode="nearest")
    # The surface joins in as a little evidence everywhere, and is all there is under solid blacks.
    paper = (local + 0.01 * surface) / (near + 0.01)
    height, width = values.shape
    picture = Image.fromarray(paper.astype(np.float32))
    paper = np.asarray(picture.resize((width, height), Image.Resampling.BICUBIC))
    return np.clip(paper, 0.05, 1)


def _block_tones(values: Floats) -> Floats:
    """Upper-quartile tone of square blocks: the paper between the strokes."""
    height, width = values.shape
    side = max(2, -(-max(height, width) // _PAPER_BLOCKS))
    padded = np.pad(values, ((0, -height % side), (0, -width % side)), mode="edge")
    rows, columns = padded.shape[0] // side, padded.shape[1] // side
    blocks = padded.reshape(rows, side, columns, side).transpose(0, 2, 1, 3)
    blocks = blocks.reshape(rows, columns, side * side)
    rank = (3 * side * side) // 4
    return np.partition(blocks, rank, axis=2)[..., rank]


def _upper_surface(tones: Floats) -> Floats:
    """Cubic surface along the upper side of `tones`, (rows, columns).

    Asymmetric least squares: P. Eilers and H. Boelens, Baseline Correction with Asymmetric Least
    Squares Smoothing, 2005; here with polynomials in place of the smoothness penalty.
    """
    rows, columns = tones.shape
    v, u = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
    terms = np.stack([u**i * v**j for i in range(4) for j in range(4 - i)], axis=-1).reshape(-1, 10)
    target = tones.ravel().astype(np.float64)
    weight: NDArray[Any] = np.ones_like(target)
    ridge = 1e-3 * len(target) * np.diag([0.0] + [1.0] * 9)  # rather flat than wild
    fitted: NDArray[Any] = target
    for _ in range(12):
        weighted = terms * weight[:, None]
        fitted = terms @ np.linalg.solve(terms.T @ weighted + ridge, weighted.T @ target)
        weight = np.where(target > fitted, 0.97, 0.03)
    surface = np.clip(fitted, 0.2 * tones.max(), tones.max())
    return surface.reshape(tones.shape).astype(np.float32)


def _not_solid(lightness: Floats) -> NDArray[np.bool_]:
    """(h, w) what is not black, of a page of which much is; all of any other page."""
    solid = lightness < _BLACK
    return ~solid if solid.mean() > _MUCH_BLACK else np.ones_like(solid)


def _tonality(darkness: Floats) -> float:
    """How far the tones spread beyond ink and paper; a line drawing stays under 1.

    Counts the spread of the commonest tones (nearly none on paper) and the share of the picture
    in mid-toned areas wider than any stroke's soft edge.
    """
    tones = darkness[_not_solid(1 - darkness)]
    spread = 1.4826 * float(np.median(np.abs(tones - np.median(tones))))
    middle = np.logical_and(darkness > 0.15, darkness < 0.85)
    radius = max(1, round(max(darkness.shape) / 256))
    broad = float(ndimage.minimum_filter(middle, 2 * radius + 1).mean())
    return spread / _MOST_GRAIN + broad / _MOST_MIDTONES
