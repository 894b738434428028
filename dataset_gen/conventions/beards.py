"""Beards by an artist's conventions: stubble, shade, hairs in layers, black shapes, outlines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .artist import Artist
from .canvas import Canvas
from .head import sitter_ray
from .mouth import Mouth
from .patches import COLUMNS, Patch, along, scalloped, ticks
from .shapes import Points, even, ribbon, smooth, wave
from .sitter import RAYS, Sitter

Range = tuple[float, float]
# Layers of hairs, the first under the next: how many times their area covers the beard, their
# length in units, how strong they are, and how much more of them grow at the hem (1 evenly).
LAYERS: dict[str, tuple[tuple[Range, Range, Range, Range], ...]] = {
    "stubble": (((0.05, 0.3), (0.012, 0.045), (0.6, 1.0), (0.7, 1.8)),),
    "shadow": (((0.02, 0.15), (0.03, 0.09), (0.5, 0.9), (1.5, 3.0)),),
    "jawline": (((0.03, 0.2), (0.02, 0.06), (0.5, 0.9), (1.0, 2.5)),),
    "hairs": (((0.15, 0.5), (0.07, 0.17), (0.7, 1.0), (0.8, 1.6)),),
    "full": (((0.45, 1.3), (0.07, 0.18), (0.5, 0.9), (0.9, 1.4)),
             ((0.3, 1.3), (0.05, 0.15), (0.8, 1.0), (1.6, 4.0))),
    "goatee": (((0.25, 1.3), (0.06, 0.17), (0.7, 1.0), (0.9, 1.8)),),
    "circle": (((0.3, 1.3), (0.05, 0.14), (0.7, 1.0), (0.9, 1.8)),),
    "strip": (((0.4, 1.4), (0.04, 0.11), (0.7, 1.0), (1.0, 2.0)),),
    "patch": (((0.5, 1.6), (0.05, 0.12), (0.7, 1.0), (0.8, 1.4)),),
}  # fmt: skip
# How far beards may hang below the jaw, in units; others do not.
LONG = {"hairs": 0.25, "black": 0.35, "outline": 0.45, "full": 0.55, "goatee": 0.3, "circle": 0.2}
LEAST = 0.015  # units that what hangs at all covers of the jaw's own line
# How often hair beside the mouth joins beard and moustache.
MEETS = {"circle": 1.0, "full": 0.7, "hairs": 0.4, "goatee": 0.3, "black": 0.3}
SHORN = ("stubble", "shadow")  # go over the upper lip too


def draw_beard(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """A beard between the jaw and a line over cheeks and mouth."""
    kind = artist.beard
    if kind == "none":
        return
    rng, mouth = canvas.rng, Mouth(sitter, artist)
    patches = [GROUNDS.get(kind, _cheeks)(sitter, mouth, kind, rng)]
    if kind in SHORN and artist.moustache == "none" and rng.random() < 0.75:
        patches.append(_upper_lip(sitter, mouth, rng))
    if rng.random() < MEETS.get(kind, 0.0) * (artist.moustache != "none" or kind == "circle"):
        patches += beside_mouth(sitter, mouth, rng, rng.uniform(0.3, 0.75))
    outlines = [patch.outline for patch in patches]
    if kind == "outline":
        hem = _locks(canvas, sitter, patches[0])
        outlines = [np.concatenate([patches[0].high, hem[::-1]])]
    for outline in outlines:
        canvas.mark("beard", outline)
    if kind == "black":
        for patch in patches:
            _black(canvas, sitter, patch)
    elif kind == "outline":
        _white(canvas, patches[0], hem)
    else:
        _hatched(canvas, sitter, kind, patches)
    # Thick hair hides the line of the jaw, and what hangs the neck.
    hangs = float(((patches[0].low - _jaw(sitter)[0]) @ sitter.down).max()) > 0.1 * sitter.unit
    thick = kind in ("full", "black", "outline")
    if thick and (hangs or rng.random() < 0.6) or kind in LONG and rng.random() < 0.4:
        canvas.cover(outlines[0])


# --- where they grow ---


def _chin(sitter: Sitter) -> Points:
    """(2,) the middle of the chin, which in a turned head is not that of the jaw's outline."""
    arc = sitter.curves["chin_arc"]
    return arc[len(arc) // 2] + 0.06 * sitter.unit * sitter.down


def _jaw(sitter: Sitter, share: float = 1.0) -> tuple[Points, Points]:
    """(COLUMNS, 2) the jaw from the picture's right ear to the left one, or such a share of it
    about the chin; and the middle of the mouth, toward which it is thick."""
    begin, end = sitter_ray(sitter, 1), sitter_ray(sitter, -1)
    low = sitter.face[np.arange(begin + 1, end) % RAYS]
    if share < 1:
        half = int(0.5 * share * len(low))
        chin = int(np.argmin(np.hypot(*(low - _chin(sitter)).T)))
        chin = int(np.clip(chin, half, len(low) - 1 - half))
        low = low[chin - half : chin + half + 1]
    jaw = even(smooth(low, 90), COLUMNS)
    return jaw, Mouth(sitter).line.mean(axis=0)


def room(sitter: Sitter, corner: Points, way: int) -> float:
    """Units from a corner of the mouth to the edge of the face at the picture's right (1) or left
    (-1): little on the far side of a turned head."""
    x, y = ((sitter.face - corner) / sitter.unit @ np.stack([sitter.right, sitter.down], axis=1)).T
    return max(float((way * x[np.abs(y) < 0.12]).max(initial=0.0)), 0.02)


def _hung(
    sitter: Sitter, jaw: Points, kind: str, rng: np.random.Generator, broad: Range = (0.7, 3.0)
) -> Points:
    """The hem of a beard, which hangs below the jaw; broad : round, above pointed."""
    most = LONG.get(kind, 0.0)
    long = LEAST + rng.uniform(0, most) if most else 0.0
    t = np.linspace(0, np.pi, COLUMNS)
    sag = np.sin(t) ** (rng.uniform(*broad) if long > 0.15 else 1.5)
    ragged = 0.12 * long * wave(rng, 1, COLUMNS, rng.uniform(1, 5))[0] * np.sin(t)
    return jaw + ((long * sag + ragged) * sitter.unit)[:, None] * sitter.down


def _under_lip(sitter: Sitter, mouth: Mouth, gap: float, wide: float = 0.12) -> Points:
    """(5, 2) from beside the picture's right corner of the mouth, under the lip, to the left."""
    corners = []
    for k, way in ((-1, 1), (0, -1)):
        out = min(wide, 0.6 * room(sitter, mouth.line[k], way))
        corners.append(mouth.line[k] + sitter.unit * (way * out * sitter.right + gap * sitter.down))
    low = mouth.outer_lower[[30, 20, 10]] + gap * sitter.unit * sitter.down
    return np.stack([corners[0], *low, corners[1]])


def _cheeks(sitter: Sitter, mouth: Mouth, kind: str, rng: np.random.Generator) -> Patch:
    """From sideburn to sideburn, over as much of the cheeks as grows; beside the mouth up to the
    moustache."""
    jaw, middle = _jaw(sitter)
    hem = _hung(sitter, jaw, kind, rng)
    burn, cheek = rng.uniform(0.06, 0.2), rng.uniform(0.22, 0.6)
    lip = _under_lip(sitter, mouth, rng.uniform(0.03, 0.1), rng.uniform(0.08, 0.16))
    rise = rng.uniform(0, 0.14) if kind != "outline" else 0.0
    up = rise * sitter.unit * sitter.down

    def inward(k: int, share: float) -> Points:
        return jaw[k] + share * (middle - jaw[k])

    knots = [jaw[0], inward(7, burn), inward(15, cheek), lip[0] - up, *lip,
             lip[-1] - up, inward(-16, cheek), inward(-8, burn), jaw[-1]]  # fmt: skip
    if rise < 0.05:
        del knots[3], knots[-4]
    return Patch.between(smooth(np.stack(knots), 90), hem)


def _goatee(sitter: Sitter, mouth: Mouth, kind: str, rng: np.random.Generator) -> Patch:
    """Hair on the chin alone, up to the corners of the mouth where it meets a moustache."""
    jaw, _ = _jaw(sitter, rng.uniform(0.2, 0.42))
    hem = _hung(sitter, jaw, kind, rng, (1.0, 4.0))
    joined = kind == "circle"
    lip = _under_lip(sitter, mouth, rng.uniform(0.04, 0.12), 0.05 if joined else -0.05)
    high = rng.uniform(0.75, 1.0) if joined else rng.uniform(0.3, 0.8)
    sides = [hem[k] + high * (corner - hem[k]) for k, corner in ((0, lip[0]), (-1, lip[-1]))]
    dip = (1 - high) * 0.3 * (jaw[COLUMNS // 2] - lip[2])
    knots = [hem[0], sides[0], lip[1] + dip, lip[2], lip[3] + dip, sides[1], hem[-1]]
    return Patch.between(smooth(np.stack(knots), 60), hem)


def _strip(sitter: Sitter, mouth: Mouth, kind: str, rng: np.random.Generator) -> Patch:
    """A narrow band along the jaw, of the chin alone or from ear to ear."""
    share = 1.0 if kind == "jawline" else rng.choice([rng.uniform(0.3, 0.6), 1.0])
    jaw, middle = _jaw(sitter, share)
    thick = rng.uniform(0.08, 0.22) * np.sin(np.linspace(0.15, np.pi - 0.15, COLUMNS)) ** 0.4
    return Patch(jaw, jaw + thick[:, None] * (middle - jaw))


def _soul(sitter: Sitter, mouth: Mouth, kind: str, rng: np.random.Generator) -> Patch:
    """A tuft under the lower lip, to a point."""
    lip = even(mouth.outer_lower[14:27][::-1], COLUMNS) + 0.03 * sitter.unit * sitter.down
    chin = _chin(sitter)
    foot = lip.mean(axis=0) + rng.uniform(0.35, 0.85) * (chin - lip.mean(axis=0))
    width = rng.uniform(0.2, 0.7)
    middle = lip.mean(axis=0)
    lip = middle + rng.uniform(0.6, 1.1) * (lip - middle)
    bend = np.abs(np.linspace(-1, 1, COLUMNS))[:, None]
    hem = foot + width * (lip - middle) - 0.2 * bend * (foot - middle)
    return Patch(hem, lip)


def _upper_lip(sitter: Sitter, mouth: Mouth, rng: np.random.Generator) -> Patch:
    lip = mouth.outer_upper[2:-2]
    up = sitter.mark("nose_base") - mouth.outer_upper[20]
    bend = 1 - 0.6 * np.abs(np.linspace(-1, 1, len(lip)))[:, None] ** 2
    return Patch.between(lip + rng.uniform(0.5, 0.85) * bend * up, lip + 0.08 * up)


def beside_mouth(
    sitter: Sitter, mouth: Mouth, rng: np.random.Generator, reach: float
) -> list[Patch]:
    """Two bands from over the corners of the mouth down, `reach` of the way to the jaw."""
    fall = reach * ((_chin(sitter) - mouth.line[20]) @ sitter.down) * sitter.down
    half, out = rng.uniform(0.03, 0.07), rng.uniform(0.05, 0.1)
    lean = rng.uniform(-0.06, 0.08) * sitter.unit * sitter.right
    bands = []
    for k, way in ((-1, 1), (0, -1)):
        corner = mouth.line[k]
        aside = way * min(out, 0.5 * room(sitter, corner, way)) * sitter.unit * sitter.right
        line = smooth(np.stack([
            corner + 0.4 * aside - 0.1 * sitter.unit * sitter.down,
            corner + aside + 0.3 * fall + 0.5 * way * lean,
            corner + aside + fall + way * lean,
        ]), 30)  # fmt: skip
        edges = ribbon(line, half * sitter.unit * np.linspace(1, rng.uniform(0.3, 1), 30))
        bands.append(Patch.between(edges[:30], edges[30:60][::-1]))
    return bands


GROUNDS = {"goatee": _goatee, "circle": _goatee, "strip": _strip, "jawline": _strip,
           "patch": _soul}  # fmt: skip


# --- how they are drawn ---


def growth(
    sitter: Sitter, roots: NDArray, fan: float, forward: float, noise: NDArray
) -> NDArray[np.float64]:
    """(n, 2) ways in which hair grows at roots (n, 2): down, forward on the cheeks, and fanning out
    at the chin. noise : (n,) how far aside each leans of itself."""
    x, y = sitter.local(roots).T
    middle = sitter.local(Mouth(sitter).line.mean(axis=0))[0]
    side = np.clip((x - middle) / 0.6, -1, 1)
    aside = side * (fan * (1 - np.abs(side)) - forward * np.abs(side)) + noise
    ways = sitter.down + aside[:, None] * sitter.right
    return ways / np.hypot(*ways.T)[:, None]


def _hatched(canvas: Canvas, sitter: Sitter, kind: str, patches: list[Patch]) -> None:
    """Hairs in layers, as they grow; shade and strokes along the jaw under them."""
    rng = canvas.rng
    fan, forward = rng.uniform(-0.1, 1.0), rng.uniform(-0.5, 0.7)
    if kind == "patch":
        fan, forward = 0.0, 0.0
    if kind == "shadow":
        angle, sparse = rng.uniform(0.6, 2.5), rng.uniform(1.5, 3.2)
        for patch in patches:
            canvas.blacken(patch.outline, angle, sparse, "beard", rng.uniform(0.4, 0.9), True)
    if kind in ("jawline", "strip") or kind in ("shadow", "stubble") and rng.random() < 0.4:
        jaw = patches[0].strip((0, 0.25), (0, 0.25), 0.0)
        band = patches[0] if kind in ("jawline", "strip") else jaw
        along(canvas, "beard", band, int(rng.integers(4, 14)), 0.8, rng.uniform(0.5, 1), True)
    if kind == "full" and rng.random() < 0.35:  # a tone under the hairs
        canvas.blacken(patches[0].outline, rng.uniform(1.0, 2.1), rng.uniform(1.1, 2.0), "beard",
                       rng.uniform(0.4, 0.9))  # fmt: skip
    for cover, length, strength, low in LAYERS[kind]:
        size = rng.uniform(*length) * sitter.unit
        many, bend = rng.uniform(*cover), rng.uniform(*low)
        for patch in patches:
            shine = rng.uniform(0, 1, int(rng.integers(0, 4))) if kind == "full" else ()
            hairs(canvas, sitter, patch, many, size, rng.uniform(*strength), bend, fan, forward,
                  tuple(shine))  # fmt: skip


def hairs(
    canvas: Canvas, sitter: Sitter, patch: Patch, cover: float, size: float, strength: float,
    low: float, fan: float, forward: float, shine: tuple[float, ...] = (),
) -> None:  # fmt: skip
    """One layer of hairs on a patch, soft at its upper edge.

    cover, low : see LAYERS;  size : px;  shine : shares of the way across where light falls
    """
    rng = canvas.rng
    width = rng.uniform(0.6, 1.0)
    size = min(size, 0.6 * float(patch.tall.max()))
    across, up = patch.scattered(rng, patch.covered(canvas, cover, size, width), low)
    lit = np.exp(-(((across[:, None] - np.array(shine)) / 0.035) ** 2)).sum(axis=1)
    kept = rng.random(len(across)) > 0.9 * lit * (up > 0.15)
    across, up = across[kept], up[kept]
    roots = patch.at(across, up)
    locks = wave(rng, 1, 200, 4.0)[0][(199 * across).astype(int)]
    ways = growth(sitter, roots, fan, forward, 0.2 * locks + 0.14 * rng.normal(size=len(roots)))
    long = size * rng.uniform(0.6, 1.35, len(roots))
    # Hairs stand over the hem by their tips, and little more.
    roots = roots - (0.6 * (1 - up) * long)[:, None] * ways
    soft = strength * (0.6 + 0.4 * np.sqrt(1 - up))
    ticks(canvas, "beard", roots, long[:, None] * ways, width, soft, rng.normal(0, 0.08))


def _black(canvas: Canvas, sitter: Sitter, patch: Patch) -> None:
    """A mass with a ragged hem and, perhaps, light in it; or one of strokes side by side."""
    rng = canvas.rng
    sparse, angle = rng.uniform(0.8, 2.1), rng.uniform(0.9, 2.2)
    area = np.array(canvas.area(patch.outline))
    for _ in range(int(rng.choice([0, 0, 2, 4, 8]))):
        t, up = rng.uniform(0.1, 0.9), rng.uniform(0.5, 0.9)
        ends = patch.at(np.array([t, t + 0.02, t]), np.array([up, up - 0.15, up - 0.35]))
        line = smooth(ends, 9)
        area &= ~canvas.area(
            ribbon(line, (0.4 + rng.uniform(0.5, 1.5) * np.sin(np.linspace(0, np.pi, 9))))
        )
    canvas.blacken(patch.outline, angle, sparse, area=area)
    fan = rng.uniform(0, 1)
    if rng.random() < 0.6:
        edges = [patch.strip((0, 0.1), (0, 0.1), 0.0)]
        edges += [patch.strip((0.85, 1), (0.85, 1), 0.0)] * (rng.random() < 0.5)
        for edge in edges:
            hairs(canvas, sitter, edge, 1.0, 0.09 * sitter.unit, 1.0, 1.0, fan, 0.0)
    else:
        canvas.line("beard", patch.low, 1.0)


def _locks(canvas: Canvas, sitter: Sitter, patch: Patch) -> Points:
    """The hem of an outline, rippled or in arcs."""
    rng = canvas.rng
    if rng.random() < 0.5:
        # The jaw runs from the picture's right to its left: outward is to its left.
        size, count = rng.uniform(0.02, 0.06) * sitter.unit, int(rng.integers(7, 22))
        return scalloped(patch.low, size, count, -1.0)
    ripple = 0.02 * sitter.unit * np.sin(np.linspace(0, rng.uniform(20, 60), 80))
    return smooth(patch.low, 80) + ripple[:, None] * sitter.down


def _white(canvas: Canvas, patch: Patch, hem: Points) -> None:
    """An outline, and perhaps some locks within: old men's beards are white."""
    rng = canvas.rng
    canvas.line("beard", hem, 1.0)
    canvas.line("beard", smooth(patch.high[::3], 40), 0.8)
    bow = 0.03 * np.sin(rng.uniform(0, 6) + np.linspace(0, rng.uniform(1, 5), 8))
    for t in rng.uniform(0.05, 0.95, int(rng.choice([0, 6, 14, 25]))):
        a, b = np.sort(rng.uniform(0.02, 0.9, 2))
        lock = patch.at(np.clip(t + bow, 0, 1), np.linspace(a, b, 8))
        canvas.line("beard", lock, 0.7, rng.uniform(0.5, 1), loose=0.3)
