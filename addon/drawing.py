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

from addon.accepted import FORMATS
from classifiers.tones import FAINTEST_CONTRAST, as_drawing
from facs_rig.common.errors import InputError
from facs_rig.common.files import reason_of

Floats = NDArray[np.float32]

LONGEST_SIDE = 2048  # px: more detail than any line has, and small enough to be quick
SHORTEST_SIDE = 32  # px: a face of fewer pixels has no features left
MOST_PIXELS = 150_000_000  # a whole decoded picture has to fit into memory

PAINTED = "It is rather a painting or a photograph: a line drawing is read better"


@dataclass(frozen=True)
class Drawing:
    """A drawing as the rest of the program wants it.

    image : (h, w) float32, 1 = paper, 0 = ink, at most `LONGEST_SIDE` px on a side.
    size : (width, height) in pixels of the picture as it was handed in, the way up that viewers
        show it (the camera's orientation tag is followed).
    source : the file that it came from, or None.
    inverted : whether light ink on a dark ground was turned over.
    turn : quarter turns anticlockwise, 0..3, that made `image` of the picture as it was handed in.
    painted : whether it is rather a painting or a photograph, of which `image` is the lines;
        PAINTED is what to say of that.
    """

    image: Floats
    size: tuple[int, int]
    source: Path | None = None
    inverted: bool = False
    turn: int = 0
    painted: bool = False

    @classmethod
    def of(cls, array: NDArray[Any], name: str = "The sketch") -> Drawing:
        """The drawing of a picture in memory, normalised as `normalise` does it and reduced to
        `LONGEST_SIDE` where it is larger."""
        values = _checked(array, name)
        image, inverted, painted = as_drawing(_reduced(values, name), name)
        size = values.shape[1], values.shape[0]
        return cls(image=image, size=size, inverted=inverted, painted=painted)

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

    Raises InputError for whatever is missing, unreadable, too small, too large or blank.
    """
    path = Path(path)
    picture = _open(path)
    name = f"'{path}'"
    size = picture.size
    if min(size) < SHORTEST_SIDE:
        raise InputError(_too_small(name, size))
    image, inverted, painted = as_drawing(_reduced(_values(picture), name), name)
    return Drawing(image=image, size=size, source=path, inverted=inverted, painted=painted)


def normalise(array: NDArray[Any], name: str = "The sketch") -> Floats:
    """A picture in memory as a drawing: (h, w) float32, 1 = paper, 0 = ink.

    array : (h, w) grey, (h, w, 3) RGB or (h, w, 4) RGBA; bool, integer (full range of its type) or
        float (0..1).
    name : what the message calls it.

    The paper's tone is estimated and divided out, the ink is stretched so that the darker half of
    it is 0, and light ink on a dark ground is turned over. Of a picture that is shaded more than
    drawn its lines are taken. Normalising twice changes nothing, and a line drawing and its
    negative give the same.

    Raises InputError for a picture that is too small or blank.
    """
    return as_drawing(_checked(array, name), name)[0]


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
    if np.ptp(on_white) >= FAINTEST_CONTRAST:
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
