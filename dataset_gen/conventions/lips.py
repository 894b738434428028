"""Lips as portraits have them: shaded, dark, a line alone, amid hair; and mouths that are shut.

A dark shape that could as well be the hole of an open mouth as shut lips is not drawn: where both
lips are dark they keep a light of their own or paper between them, and a line between lips is never
so thick as the least opening. Open mouths stand in `teeth`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .patches import Patch, ticks
from .shapes import Points, part, ribbon
from .sitter import Sitter

if TYPE_CHECKING:
    from .mouth import Mouth

TAPER = np.array([1.0, 0.9, 0.5])  # how strong strokes are that run out
THICKEST = 0.022  # units, of a line between shut lips: less than the least opening
RISES = 0.6  # of its thickness, how far a dark upper lip is at least higher than the corners
FEWEST = 4.0  # pen's widths, the least height of a lip with strokes across
NARROW = 0.34  # units, the least width of a mouth whose lips are dark
LEAST_PENS = {"dark": 6.0, "upper": 6.0, "wedge": 6.0, "shaded": 4.5}  # their least height, in pens
GROWN = 0.65  # of mouths under or over hair, those that it comes up to


# --- shut ---


def draw_shut(canvas: Canvas, sitter: Sitter, artist: Artist, mouth: Mouth) -> None:
    """Lips that meet, by `artist.lips`."""
    rng, how = canvas.rng, _way(canvas, sitter, artist, mouth)
    over, under = overgrown(canvas, artist)
    line = _waved(sitter, mouth, rng)
    upper, lower = Patch(line, mouth.outer_upper), Patch(line, mouth.outer_lower)
    stroke = str(rng.choice(["drag", "slant", "across"], p=(0.25, 0.35, 0.4)))
    angle = float(rng.choice([0.7, 2.3, 1.4]) + rng.normal(0, 0.2))
    if how == "shaded":
        dark = rng.uniform(0.5, 1.0)
        if not over:
            most = 0.75 if _flat(sitter, mouth) else 1.5
            tone(canvas, upper, stroke, angle, rng.uniform(0.5, most), dark)
        if not under:
            light = shine(rng) if rng.random() < 0.8 else None
            tone(canvas, lower, stroke, angle, rng.uniform(0.3, 1.0), 0.8 * dark, light)
    elif how == "dark":
        _dark(canvas, upper, lower, over, under)
    elif how == "upper":
        if not over:
            tone(canvas, upper, stroke, angle, rng.uniform(0.8, 1.3), rng.uniform(0.8, 1.0))
    elif how == "wedge":
        t = np.linspace(0, 1, len(line))
        deep = rng.uniform(0.6, 1.3) * THICKEST * sitter.unit / max(float(lower.tall.max()), 1.0)
        hem = lower.at(t, min(deep, 0.4) * np.sin(np.pi * t) ** rng.uniform(0.5, 1.5))
        tone(canvas, Patch(line, hem), stroke, angle, 0.8, rng.uniform(0.6, 1.0))
    elif how == "contour" and rng.random() < 0.35:
        tone(canvas, lower, stroke, angle, rng.uniform(0.1, 0.3), 0.7, shine(rng))
    bare = how == "line" or how == "wedge" and rng.random() < 0.5
    _between(canvas, sitter, line, artist.grin_bold if artist.grin != "none" else 1.0)
    if not bare:
        borders(canvas, mouth, how, 0.6 if how == "shaded" else 0.9, over, under)
    elif not under and rng.random() < 0.4:
        low = rng.uniform(0.1, 0.3)
        canvas.line("lip", part(mouth.outer_lower, low, 1 - low), 0.7, 0.8, within=True)
    if not under and rng.random() < (0.85 if bare else 0.5):
        below(canvas, sitter, mouth)
    if not over and artist.moustache == "none" and rng.random() < 0.3:
        _philtrum(canvas, sitter, mouth)
    hairs(canvas, sitter, mouth, line, line, over, under)


def _way(canvas: Canvas, sitter: Sitter, artist: Artist, mouth: Mouth) -> str:
    """How its lips are drawn: such that are too small for the pen or seen from the side would be
    one dark spot if they were dark, and a flat upper one, as in a smile, a hole."""
    thick = float(((mouth.outer_lower - mouth.outer_upper) @ sitter.down).max())
    least = LEAST_PENS.get(artist.lips, 0.0)
    if least and (mouth.width < NARROW * sitter.unit or thick < least * canvas.pen):
        return "contour"
    return "shaded" if artist.lips in ("dark", "upper") and _flat(sitter, mouth) else artist.lips


def _flat(sitter: Sitter, mouth: Mouth) -> bool:
    """Whether the upper lip's border hardly rises over the corners of the mouth."""
    middle = len(mouth.line) // 2
    rise = ((mouth.line[0] + mouth.line[-1]) / 2 - mouth.outer_upper[middle]) @ sitter.down
    thick = (mouth.line[middle] - mouth.outer_upper[middle]) @ sitter.down
    return bool(rise < RISES * thick)


def _waved(sitter: Sitter, mouth: Mouth, rng: np.random.Generator) -> Points:
    """The line between the lips with the bead of the upper one in it, past the corners at times."""
    x = np.linspace(-1, 1, len(mouth.line))
    bead = np.exp(-((x / 0.2) ** 2)) - 0.7 * np.exp(-(((np.abs(x) - 0.42) / 0.25) ** 2))
    size = rng.uniform(0, 0.02) * sitter.unit
    return mouth.line + (size * bead)[:, None] * sitter.down


def _between(canvas: Canvas, sitter: Sitter, line: Points, bold: float = 1.0) -> None:
    """The line (k, 2) where lips meet: even, swelling, broken, doubled, pale or in several strokes;
    dark or hooked at its corners by lot. bold : of the pen's width"""
    rng, unit, count = canvas.rng, sitter.unit, len(line)
    x = np.linspace(-1, 1, count)
    way = str(rng.choice(["even", "swells", "broken", "double", "pale", "strokes"],
                         p=(0.2, 0.3, 0.14, 0.12, 0.1, 0.14)))  # fmt: skip
    if way == "even":
        canvas.line("mouth", line, bold * rng.uniform(0.8, 1.5), within=True)
    elif way == "swells":
        canvas.line("mouth", line, 0.9 * bold, 0.6 + 0.4 * (1 - x**2), within=True)
        thick = rng.uniform(0.4, 1.0) * max(THICKEST * unit - canvas.pen, 0.3 * canvas.pen)
        at = (x - rng.uniform(-0.15, 0.15)) / rng.uniform(0.35, 0.95)
        canvas.fill(ribbon(line, 0.5 * thick * np.clip(1 - at**2, 0, 1) + 0.05))
    elif way == "broken":
        cuts = np.sort(rng.uniform(0.2, 0.8, int(rng.integers(1, 3))))
        ends = [0.0, *cuts, 1.0]
        for a, b in zip(ends, ends[1:], strict=False):
            hole = rng.uniform(0.0, 0.05)
            canvas.line("mouth", part(line, a + hole * (a > 0), b - hole * (b < 1)),
                        bold * rng.uniform(0.8, 1.3), within=True)  # fmt: skip
    elif way == "double":
        canvas.line("mouth", line, bold, within=True)
        off = (
            rng.choice([-1, 1])
            * rng.uniform(0.008, 0.014)
            * unit
            * np.sqrt(np.clip(1 - x**2, 0, 1))
        )
        a = rng.uniform(0, 0.3)
        second = part(line + off[:, None] * sitter.down, a, min(1.0, a + rng.uniform(0.4, 0.9)))
        canvas.line("mouth", second, 0.8 * bold, 0.8, within=True)
    elif way == "pale":
        canvas.line("mouth", line, 0.8 * bold, 0.55 + 0.45 * np.abs(x), within=True)
    else:
        for _ in range(int(rng.integers(2, 5))):
            a = rng.uniform(0, 0.5)
            piece = part(line, a, min(1.0, a + rng.uniform(0.4, 0.8)))
            canvas.line("mouth", piece, bold * rng.uniform(0.7, 1.1), within=True)
        canvas.line("mouth", line, 0.7 * bold, within=True)
    if rng.random() < 0.45:
        _corners(canvas, sitter, line)


def _corners(canvas: Canvas, sitter: Sitter, line: Points) -> None:
    """Dark ends of the line (k, 2) between lips, and hooks beyond them."""
    rng, unit = canvas.rng, sitter.unit
    dark, hook = rng.random() < 0.7, rng.random() < 0.6
    for k, inner, way in ((0, 4, -1), (-1, -5, 1)):
        if dark:
            ends = np.stack([line[k], (line[k] + line[inner]) / 2, line[inner]])
            canvas.line("mouth", ends, rng.uniform(1.0, 1.5), TAPER, within=True)
        if hook:
            out, fall = rng.uniform(0.01, 0.04) * unit, rng.normal(0.01, 0.03) * unit
            end = line[k] + way * out * sitter.right + fall * sitter.down
            middle = (line[k] + end) / 2 + 0.15 * out * sitter.down
            canvas.line("mouth", np.stack([line[k], middle, end]), 0.9, TAPER, within=True)


def borders(canvas: Canvas, mouth: Mouth, how: str, share: float, over: bool, under: bool) -> None:
    """The lips' borders, whole, in part or none. share : how often each is drawn, but for the lower
    one under a dark lip, which tells that it is one    over, under : whether hair hides either"""
    rng, soft = canvas.rng, canvas.rng.uniform(0.5, 1.0)
    top, low = mouth.outer_upper, mouth.outer_lower
    if not over and rng.random() < share:
        way = rng.random()
        if way < 0.45:
            canvas.line("lip", top, 0.8, soft, within=True)
        elif way < 0.75:  # open where the bow dips
            gap = rng.uniform(0.01, 0.08)
            for ends in ((rng.uniform(0, 0.2), 0.5 - gap), (0.5 + gap, rng.uniform(0.8, 1))):
                canvas.line("lip", part(top, *ends), 0.8, soft, within=True)
        else:
            a = rng.uniform(0.2, 0.4)
            canvas.line("lip", part(top, a, 1 - a), 0.8, soft, within=True)
    if not under and (how in ("dark", "upper") or rng.random() < share):
        a, b = rng.uniform(0.03, 0.33, 2)
        canvas.line("lip", part(low, a, 1 - b), 0.8, rng.uniform(soft, 1.0), within=True)
        if rng.random() < 0.2:
            canvas.line("lip", part(low, 0.35, 0.65), 1.2, soft, within=True)


def _dark(canvas: Canvas, upper: Patch, lower: Patch, over: bool, under: bool) -> None:
    """Dark lips; the lower one shines, or is lighter, or there is paper between them."""
    rng = canvas.rng
    apart = rng.random() < 0.4
    low = rng.uniform(0.12, 0.25) if apart else 0.0
    if not over:
        shape = upper.strip((low, 1.0), (low, 1.0), 0.0)
        if rng.random() < 0.5:
            canvas.fill(shape.outline)
        else:
            tone(canvas, shape, "slant", rng.uniform(0.4, 2.7), 1.4, 1.0)
    if not under:
        low = rng.uniform(0.1, 0.25) if apart else 0.0
        shape = lower.strip((low, 1.0), (low, 1.0), 0.0)
        stroke = str(rng.choice(["across", "slant", "drag"]))
        tone(canvas, shape, stroke, rng.uniform(0.4, 2.7), rng.uniform(0.6, 1.3),
             rng.uniform(0.6, 1.0), shine(rng))  # fmt: skip


def shine(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """Where the lower lip is left white: middle and half-width across, from where to where on the
    way from line to border, all as shares."""
    return (
        rng.uniform(0.25, 0.75), rng.uniform(0.08, 0.36), rng.uniform(0.0, 0.35),
        rng.uniform(0.6, 1.0),
    )  # fmt: skip


def tone(
    canvas: Canvas,
    patch: Patch,
    stroke: str,
    angle: float,
    cover: float,
    dark: float,
    light: tuple[float, float, float, float] | None = None,
) -> None:
    """Shade on a lip, from the line or rim within to its border, in one kind of strokes: `across`
    it as it is creased, `drag` along it, or `slant` at an angle.

    cover : about how much of the patch they cover        dark : strength        light : see `shine`
    """
    rng = canvas.rng
    wide = float(np.hypot(*(patch.high[-1] - patch.high[0])))
    tall = float(patch.tall.max())
    if tall < 1.2 or wide < 4:
        return
    # Finer than the pen's full line where the lip is thin.
    pen = float(np.clip(tall / 5, 1.0, max(0.75 * canvas.pen, 1.0)))
    width = pen / canvas.pen
    if stroke == "across" and tall < FEWEST * canvas.pen:
        stroke = "drag"  # few strokes upright would be teeth
    if stroke == "slant":
        area = canvas.area(patch.outline)
        if light:
            area = area & ~canvas.area(_ring(patch, light))
        sparse = float(np.clip(1 / max(cover, 0.1), 1.0, 3.2))
        canvas.blacken(patch.outline, angle, max(sparse, 1.05) if cover < 1.2 else 1.0, "hatch",
                       dark, True, area)  # fmt: skip
        return
    if stroke == "drag":
        count = int(np.clip(np.ceil(1.3 * cover * tall / pen), 1, 14))
        for up in (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count:
            a, b = rng.uniform(0.02, 0.18, 2)
            t = np.linspace(a, 1 - b, 20)
            ups = np.clip(up + rng.normal(0, 0.08) * np.linspace(-1, 1, 20), 0, 1)
            _shone(canvas, patch, t, ups, width, dark * rng.uniform(0.6, 1.0), light)
        return
    count = int(np.clip(1.2 * cover * wide / pen, 5, 70))
    lean = rng.normal(0, 0.12)
    fan = rng.uniform(-0.3, 0.6)
    from_line = rng.random() < 0.8
    least = rng.choice([0.3, 0.55, 0.85])
    for t in np.linspace(0.03, 0.97, count) + rng.normal(0, 0.25 / count, count):
        # From the line between the lips, or toward it from the border.
        ups = np.linspace(0, rng.uniform(least, 1.0), 7)
        if not from_line:
            ups = 1 - ups
        aside = (lean + 0.15 * fan * (t - 0.5)) * np.abs(ups - ups[0]) * tall / wide
        where = np.clip(t + aside, 0, 1)
        _shone(canvas, patch, where, ups, width, dark * rng.uniform(0.7, 1.0), light)


def _ring(patch: Patch, light: tuple[float, float, float, float]) -> Points:
    """The outline of what is left white of a patch."""
    middle, half, low, high = light
    t = np.linspace(0, 2 * np.pi, 18)
    return patch.at(middle + half * np.cos(t), (low + high) / 2 + (high - low) / 2 * np.sin(t))


def _shone(
    canvas: Canvas, patch: Patch, t: NDArray, up: NDArray, width: float, dark: float,
    light: tuple[float, float, float, float] | None,
) -> None:  # fmt: skip
    """One stroke on a patch at places (k,), (k,), which leaves out what shines."""
    seen = None
    if light:
        middle, half, low, high = light
        mid, tall = (low + high) / 2, max((high - low) / 2, 1e-3)
        seen = ((t - middle) / half) ** 2 + ((up - mid) / tall) ** 2 > 1
    canvas.line("hatch", patch.at(t, up), width, dark, seen, loose=0.3, within=True)


def below(canvas: Canvas, sitter: Sitter, mouth: Mouth) -> None:
    """The shadow under the lower lip: short strokes on the skin, which are no mouth."""
    rng, unit = canvas.rng, sitter.unit
    middle = mouth.outer_lower[len(mouth.outer_lower) // 2]
    centre = middle + unit * (
        rng.uniform(0.03, 0.09) * sitter.down + rng.normal(0, 0.02) * sitter.right
    )
    half = rng.uniform(0.04, 0.16) * unit
    dark, way = rng.uniform(0.5, 1.0), rng.random()
    if way < 0.5:
        count = int(rng.integers(2, 9))
        slant = rng.choice([0.9, 2.2, 2.6, 0.5]) + rng.normal(0, 0.12, count)
        long = rng.uniform(0.02, 0.06, count) * unit
        roots = centre + np.linspace(-half, half, count)[:, None] * sitter.right
        roots = roots + rng.normal(0, 0.008, (count, 1)) * unit * sitter.down
        ways = np.cos(slant)[:, None] * sitter.right + np.sin(slant)[:, None] * sitter.down
        ticks(canvas, "hatch", roots, long[:, None] * ways, 0.9, dark, rng.normal(0, 0.1), True)
    elif way < 0.8:
        bow = rng.uniform(-0.02, 0.02) * unit
        for k in range(int(rng.integers(1, 4))):
            x = half * rng.uniform(0.5, 1.1) * np.linspace(-1, 1, 7) + rng.normal(0, 0.2) * half
            y = k * 0.022 * unit + bow * (1 - np.linspace(-1, 1, 7) ** 2)
            piece = centre + x[:, None] * sitter.right + y[:, None] * sitter.down
            canvas.line("hatch", piece, 0.9, dark * np.array([0.5, 0.8, 1, 1, 1, 0.8, 0.5]),
                        within=True)  # fmt: skip
    else:
        edge = part(mouth.outer_lower, 0.25, 0.75) + 0.012 * unit * sitter.down
        sag = np.sin(np.linspace(0, np.pi, len(edge)))[:, None] * rng.uniform(0.03, 0.1) * unit
        patch = np.concatenate([edge, (edge + sag * sitter.down)[::-1]])
        canvas.blacken(patch, rng.uniform(0, np.pi), rng.uniform(1.2, 2.2), "hatch", dark, True)


def _philtrum(canvas: Canvas, sitter: Sitter, mouth: Mouth) -> None:
    """One or two strokes between nose and lip."""
    rng = canvas.rng
    lip, nose = mouth.outer_upper[len(mouth.outer_upper) // 2], sitter.mark("nose_base")
    a, b = rng.uniform(0.15, 0.4), rng.uniform(0.5, 0.8)
    for side in (-1, 1) if rng.random() < 0.3 else (rng.choice([-1.0, 0.0, 1.0]),):
        off = side * 0.03 * sitter.unit * sitter.right
        ends = np.stack([lip + s * (nose - lip) + off for s in (a, (a + b) / 2, b)])
        canvas.line("hatch", ends, 0.6, rng.uniform(0.4, 0.8), within=True)


# --- amid hair ---


def overgrown(canvas: Canvas, artist: Artist) -> tuple[bool, bool]:
    """Whether a moustache hides the upper lip, and a beard the lower one."""
    rng = canvas.rng
    over = artist.moustache not in ("none", "pencil", "line") and rng.random() < GROWN
    full = artist.beard in ("hairs", "full", "black", "circle", "goatee", "patch")
    return over, full and rng.random() < 0.5 * GROWN


def hairs(
    canvas: Canvas, sitter: Sitter, mouth: Mouth, upper: Points, lower: Points, over: bool,
    under: bool,
) -> None:  # fmt: skip
    """Hairs over the lips that are hidden, up to their rims upper, lower (k, 2)."""
    rng = canvas.rng
    nose = sitter.mark("nose_base")
    for hidden, rim, border in (
        (over, upper, mouth.outer_upper),
        (under, lower, mouth.outer_lower),
    ):
        if not hidden:
            continue
        up = border is mouth.outer_upper
        far = 0.35 * (nose - border[len(border) // 2]) if up else 0.07 * sitter.unit * sitter.down
        edge = border + far * (1 - 0.7 * np.linspace(-1, 1, len(border))[:, None] ** 2)
        count = int(rng.uniform(0.5, 1.6) * mouth.width / max(canvas.pen, 1.0))
        t = rng.uniform(0.0 if up else 0.12, 1.0 if up else 0.88, count)
        k = (t * (len(rim) - 1)).astype(int)
        reach = rng.uniform(0.45, 0.97, count)[:, None]
        begin = rng.uniform(0.0, 0.4, count)[:, None]
        roots, tips = (edge[k] + share * (rim[k] - edge[k]) for share in (begin, reach))
        ways = tips - roots
        if not up:  # they grow downward
            roots, ways = tips, -ways
        lean = (0.5 * (2 * t - 1) + rng.normal(0, 0.15, count))[:, None] * sitter.right
        ways = ways + np.hypot(*ways.T)[:, None] * lean
        roots = roots - (np.hypot(*ways.T)[:, None] * lean if up else 0.0)
        ticks(canvas, "beard", roots, ways, 0.85, rng.uniform(0.6, 1.0, count), rng.normal(0, 0.08))
