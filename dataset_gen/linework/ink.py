"""Drawing marks: polylines whose width and tone change along them become an antialiased picture.

Every piece of a line, about as long as it is wide, looks at the few pixels around it: a pixel's
coverage is 1 inside, 0 outside and falls off evenly across the edge, over as much as a pixel
measures in that direction, so that a straight stroke covers length times width of the page
whatever its direction. Lines thinner than a pixel are one pixel wide and as much paler. Pieces
of one stroke join by the larger coverage; strokes of a translucent medium darken each other
where they cross.

Why no drawing library: plain numpy draws the middle level of a face (about 100 strokes, 3500 px
of line) in 2 to 4 ms. The outlines of the same strokes take celiagg 2.1 and aggdraw 1.4 13 ms,
skia-python 144 18 ms, nearly all of it in one call for each stroke, and Pillow at four times the
size takes 20 ms. They fill an outline with one tone, where pressure changes it along a stroke;
and skia-python wants the system's libGL.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from facs_rig.common.polylines import Polylines, spread

from .paper import grained, on_paper
from .strokes import Stroke
from .style import Style

__all__ = ["coverage", "ink", "lay"]

Floats = NDArray[np.float32]
SHEETS = 4  # translucent strokes are laid on so many sheets, which darken each other
TAPER = 14.0  # pixels over which an end runs out, at most 0.45 of the line
THINNEST = 0.35  # pixels, but for ends that run out
NIB_ANGLE = np.radians(-40.0)  # of a flat pen's edge to the line of the page
FINER = 4  # supersampling of blots
MOST_PIXELS = 4_000_000  # looked at in one go; bounds the memory
# Tone and width of the lines that help to draw, beside the others.
HATCH = (0.75, 0.75)
CONSTRUCTION_WIDTH = 0.7
FILLED = ("pupil", "fill")  # closed strokes that are black within


def ink(
    strokes: Iterable[Stroke],
    width: int,
    height: int,
    style: Style | None = None,
    under: Floats | None = None,
) -> NDArray[np.uint8]:
    """(height, width) uint8 picture of marks in its pixels; 0 is ink, 255 white paper.

    under : (height, width) darkness 0..1 that lies under them, as it is on the paper
    """
    style = style or Style()
    strokes = [stroke for stroke in strokes if len(stroke.points) > 1]
    darkness = np.zeros((height, width), np.float32)
    if strokes:
        lines = Polylines.of([stroke.points for stroke in strokes])
        strength = np.concatenate([stroke.strength for stroke in strokes])
        share, tone = np.array([_kind(stroke, style) for stroke in strokes]).T
        step = np.minimum(np.clip(1.3 * style.width, 2.0, 3.0), 1 + lines.length / 20)
        line, along, starts = spread(lines.length, step)
        points, strength = lines.at(line, along, strength)
        faint = 1 - np.clip(strength, 0, 1)
        thick = np.maximum(style.width * share[line] * (1 - style.fading * faint), THINNEST)
        if style.taper:
            size = lines.length[line]
            near = np.minimum(along, size - along) / np.clip(0.45 * size, 1e-6, TAPER)
            thick = thick * (1 - style.taper * (1 - np.sqrt(np.clip(near, 0, 1))))
        if style.nib:
            ahead = np.minimum(np.arange(len(points)) + 1, starts[1:][line] - 1)
            du, dv = (points[ahead] - points[np.maximum(ahead - 1, 0)]).T
            along_edge = np.cos(2 * (np.arctan2(dv, du) - NIB_ANGLE))
            thick = thick * (1 - style.nib * (0.5 + 0.5 * along_edge))
        tone = tone[line] * (1 - style.pale * faint)
        opaque = style.tone == 1 and not style.pale and tone.min() == 1
        sheets = np.zeros((1 if opaque else SHEETS, height, width), np.float32)
        sheet = np.arange(len(strokes)) % len(sheets)
        lay(sheets, points, thick / 2, tone, starts, sheet)
        for k, stroke in enumerate(strokes):
            if stroke.kind in FILLED and len(stroke.points) > 8:
                _blot(sheets[sheet[k]], stroke.points, style.tone)
        darkness = sheets[0] if opaque else 1 - np.prod(1 - sheets, axis=0)
    drawn = grained(darkness, style)
    if under is not None:
        drawn = drawn + under * (1 - drawn)
    return on_paper(drawn, style)


def _kind(stroke: Stroke, style: Style) -> tuple[float, float]:
    """Width as a share of the style's, and tone, of a stroke by what it is."""
    if stroke.kind == "construction":
        return CONSTRUCTION_WIDTH * stroke.width, style.construction
    if stroke.kind == "hatch":
        return HATCH[0] * stroke.width, HATCH[1] * style.tone
    return stroke.width, style.tone


def lay(
    sheets: Floats, points: NDArray, radius: NDArray, tone: NDArray, starts: NDArray, sheet: NDArray
) -> None:
    """Lay lines of varying radius and tone on sheets (s, h, w), which keep the darker value.

    points : (N, 2) pixels;  radius, tone : (N,);  starts : (n + 1,) of the lines;
    sheet : (n,) where each line goes.
    """
    _, height, width = sheets.shape
    tone = tone * np.minimum(1, 2 * radius)  # thinner than a pixel: paler instead
    radius = np.maximum(radius, 0.5)
    here = np.ones(len(points), bool)
    here[starts[1:] - 1] = False
    here = np.flatnonzero(here)
    page = np.repeat(sheet, np.diff(starts) - 1)

    low = np.minimum(points[here], points[here + 1])
    high = np.maximum(points[here], points[here + 1])
    # A pixel's extent across the line, 1 to 1.41: what its edge falls off over.
    step = points[here + 1] - points[here]
    extent = np.abs(step).sum(axis=1) / np.maximum(np.hypot(*step.T), 1e-9)
    extent = np.maximum(extent, 1.0)
    reach = (np.maximum(radius[here], radius[here + 1]) + 0.5 * extent)[:, None]
    corner = np.floor(low - reach)
    far = np.floor(high + reach)
    seen = (far >= 0).all(axis=1) & (corner < [width, height]).all(axis=1)
    here, page, corner, far = here[seen], page[seen], corner[seen], far[seen]
    step, extent = step[seen].astype(np.float32), extent[seen].astype(np.float32)
    if not len(here):
        return
    side = (far - corner).max(axis=1).astype(np.int64) + 1
    room = int(side.max())  # windows may reach over the page's edge by as much
    wide = width + 2 * room
    canvas = np.zeros((len(sheets), height + 2 * room, wide), np.float32)
    flat = canvas.reshape(-1)
    base = ((page * canvas.shape[1] + corner[:, 1] + room) * wide + corner[:, 0] + room).astype(
        np.int64
    )
    # From here on everything is relative to the corner of a window, where float32 is plenty.
    first = (corner + 0.5 - points[here]).astype(np.float32)
    inverse = step / np.maximum((step * step).sum(axis=1), 1e-9)[:, None]
    radius, tone = radius.astype(np.float32), tone.astype(np.float32)
    r0, r1 = radius[here] / extent, radius[here + 1] / extent
    t0, t1 = (tone[end] * _thin(r) for end, r in ((here, r0), (here + 1, r1)))
    r1, t1 = r1 - r0, t1 - t0
    r0, fall = r0 + np.float32(0.5), 1 / extent
    even = bool((t0 == 1).all() and (t1 == 0).all())
    for size in np.unique(side).tolist():
        same = np.flatnonzero(side == size)
        row, column = np.divmod(np.arange(size * size), size)
        window = row * wide + column
        u, v = column.astype(np.float32), row.astype(np.float32)
        for some in np.array_split(same, 1 + same.size * size * size // MOST_PIXELS):
            du, dv = first[some, :1] + u, first[some, 1:] + v
            t = du * inverse[some, :1]
            t += dv * inverse[some, 1:]
            np.clip(t, 0, 1, out=t)
            du -= t * step[some, :1]
            dv -= t * step[some, 1:]
            du *= du
            dv *= dv
            du += dv
            np.sqrt(du, out=du)
            du *= fall[some, None]
            cover = t * r1[some, None]
            cover += r0[some, None]
            cover -= du
            np.clip(cover, 0, 1, out=cover)
            if not even:
                t *= t1[some, None]
                t += t0[some, None]
                cover *= t
            np.maximum.at(flat, (base[some, None] + window).ravel(), cover.ravel())
    np.maximum(sheets, canvas[:, room:-room, room:-room], out=sheets)


def _thin(radius: Floats) -> Floats:
    """What a line thinner than the fall of its edges must be multiplied with to keep its area."""
    return np.where(radius < 0.5, 2 * radius / (radius + 0.5) ** 2, 1).astype(np.float32)


def coverage(points: NDArray, radius: NDArray, width: int, height: int) -> Floats:
    """(height, width) share of each pixel that one line (k, 2) of radius (k,) px covers."""
    sheets = np.zeros((1, height, width), np.float32)
    points = np.asarray(points, float)
    radius = np.broadcast_to(np.asarray(radius, float), len(points))
    lay(sheets, points, radius, np.ones(len(points)), np.array([0, len(points)]), np.array([0]))
    return sheets[0]


def _blot(sheet: Floats, outline: NDArray, tone: float) -> None:
    """Fill a closed outline (k, 2) on a sheet (h, w)."""
    height, width = sheet.shape
    u0, v0 = np.maximum(np.floor(outline.min(axis=0)).astype(int), 0)
    u1, v1 = np.minimum(np.ceil(outline.max(axis=0)).astype(int), [width, height])
    if u1 <= u0 or v1 <= v0:
        return
    fine = Image.new("L", (int(u1 - u0) * FINER, int(v1 - v0) * FINER))
    # Pillow's pixel k is centred on k, ours on k + 0.5.
    corners = ((outline - [u0, v0]) * FINER - 0.5).ravel().tolist()
    ImageDraw.Draw(fine).polygon(corners, fill=255)
    filled = np.asarray(fine.reduce(FINER), np.float32) * np.float32(tone / 255)
    part = sheet[v0:v1, u0:u1]
    np.maximum(part, filled, out=part)
