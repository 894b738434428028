"""The flow of drawn hair: sheets of strands, from a parting over the head and down, or up from the
hairline.

A sheet is a grid (STRANDS, ALONG, 2) of pixels, from strand to strand, s, and along each from root
to tip, t, both 0 to 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .cut import GATHERED, LONG, STEPS, Hair
from .shapes import Points, even, smooth

STRANDS, ALONG = 16, 32  # of a sheet


def on_sheet(sheet: NDArray, s: NDArray | float, t: NDArray | float) -> Points:
    """Points (..., 2) of a sheet, which goes straight on beyond its ends."""
    s, t = np.broadcast_arrays(np.asarray(s, float), np.asarray(t, float))
    y, x = s * (len(sheet) - 1), t * (sheet.shape[1] - 1)
    i = np.clip(y.astype(int), 0, len(sheet) - 2)
    j = np.clip(x.astype(int), 0, sheet.shape[1] - 2)
    f, g = (y - i)[..., None], (x - j)[..., None]
    low = sheet[i, j] * (1 - g) + sheet[i, j + 1] * g
    return low * (1 - f) + (sheet[i + 1, j] * (1 - g) + sheet[i + 1, j + 1] * g) * f


def mix(hair: Hair, k: NDArray, depth: NDArray) -> Points:
    """Points at places k (...) along the hair, a share `depth` (...) from inner to outer line."""
    k = np.clip(k, 0, STEPS - 1)
    low = np.minimum(k.astype(int), STEPS - 2)
    f = (k - low)[..., None]
    inner = hair.inner[low] * (1 - f) + hair.inner[low + 1] * f
    outer = hair.outer[low] * (1 - f) + hair.outer[low + 1] * f
    return inner + depth[..., None] * (outer - inner)


def sheets_of(canvas: Canvas, artist: Artist, hair: Hair) -> list[NDArray]:
    """The flow of a cut: from a parting over the head and down, or up from the hairline."""
    rng, cut = canvas.rng, artist.cut
    combed = cut in LONG or rng.random() < {"tail": 0.5, "bun": 0.4, "fringe": 0.6, "swept": 0.5,
                                            "short": 0.2}.get(cut, 0.0)  # fmt: skip
    sheets = [_parted(canvas, artist, hair, side) for side in (0, 1)] if combed else [
        _risen(canvas, artist, hair)
    ]  # fmt: skip
    s, t = np.linspace(0, 1, STRANDS)[:, None], np.linspace(0, 1, ALONG)
    wavy = rng.choice([0.0, 0.04, 0.08, 0.14] if combed else [0.0, 0.0, 0.015, 0.03])
    cycles, turn = rng.uniform(0.6, 2.2 if combed else 1.1), rng.uniform(0, 2)
    bent = []
    for sheet in sheets:
        swing = np.sin(2 * np.pi * (cycles * t + turn * s + rng.uniform()))
        bent.append(on_sheet(sheet, s + wavy * swing * t, t + 0 * s))
    return bent


def _parted(canvas: Canvas, artist: Artist, hair: Hair, side: int) -> NDArray:
    """The sheet at one side of the parting; s is 0 at the face and 1 at the outline."""
    rng = canvas.rng
    root = float(np.clip(0.5 + 0.42 * artist.parting, 0.1, 0.9)) * (STEPS - 1)
    t = np.linspace(0, 1, 24)
    share = np.linspace(0, 1, STRANDS)[:, None]
    # It rises from the parting before it lies down at the side.
    lift = rng.uniform(0.0, 0.3)
    depth = share + lift * (1 - share) * np.sin(np.pi * t**0.6) * (1 - 0.5 * share)
    k = root + ((STEPS - 1) * side - root) * t**0.85 + 0 * share
    if artist.cut in GATHERED:  # pulled back before it comes down to the ear
        depth = depth + (1 - depth) * rng.uniform(0.3, 0.8) * t**1.5
    lines = mix(hair, k, depth)
    fall = hair.falls[side]
    if fall:
        ends = fall[0][-1] + share * (fall[1][-1] - fall[0][-1])
        tips = hair.tips[side]
        low = smooth(tips, STRANDS)[::-1] - ends[::-1]  # from the inner to the outer line
        hang = fall[1] + share[:, :, None] * (fall[0] - fall[1])
        down = np.linspace(0, 1, hang.shape[1])[None, :, None] ** 2
        hang = hang + down * low[:, None]
        lines = np.concatenate([lines, hang[:, 1:]], axis=1)
    return np.stack([even(line, ALONG) for line in lines])


def _risen(canvas: Canvas, artist: Artist, hair: Hair) -> NDArray:
    """The sheet of hair that rises from the hairline; s runs from the left to the right."""
    rng, cut, last = canvas.rng, artist.cut, STEPS - 1
    k = np.linspace(0, last, STRANDS)[:, None]
    t = np.linspace(0, 1, ALONG)
    out = k / last * 2 - 1  # -1 at the left, 1 at the right
    top = np.clip(1.3 - 1.3 * np.abs(out) ** 2, 0, 1)
    if cut in GATHERED:
        lean = -rng.uniform(0.2, 0.7) * (k - last / 2)
    elif cut in ("swept", "fringe", "short", "receding", "quiff") and rng.random() < 0.75:
        way = -np.sign(artist.parting) or 1.0
        lean = way * rng.uniform(4, 18) * top
    elif cut in ("tufts", "flat"):
        lean = rng.uniform(-2, 4) * out
    else:  # away from where it parts
        lean = rng.uniform(3, 9) * np.tanh(4 * (out - artist.parting)) * top
    # At the sides it lies back and down.
    lean = lean + (1 - top) * out * rng.uniform(1, 6) * (cut not in GATHERED)
    bulge = rng.uniform(0.6, 1.4)
    return mix(hair, k + lean * t ** rng.uniform(1.0, 2.2), t**bulge + 0 * k)
