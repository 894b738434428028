"""What is worn on a head and hides it: caps, hats with a brim, helmets, and the cloths."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .cloths import bandana, beanie, hood, raised, scarf, veil, wrap
from .crown import make_crown, worn
from .patches import Patch
from .shapes import ellipse, ribbon, smooth
from .sitter import Sitter
from .textures import CLOTH, FELT, WOOL, Odds, material, texture


def draw_hat(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """A cap, a hat or a cloth, which hides hair and skull."""
    crown = make_crown(canvas, sitter, artist)
    canvas.mark("hair", crown.outline)  # what is worn on hair stands for it
    canvas.mark("hat", crown.outline)
    part, odds = KINDS[artist.hat]
    stuff = material(canvas.rng, artist, odds)
    part(canvas, sitter, artist, crown, stuff)
    if odds is FELT:
        _seams(canvas, sitter, crown)
    if canvas.rng.random() < BADGED.get(artist.hat, 0.05):
        _badge(canvas, sitter, crown)
    texture(canvas, sitter, crown, stuff)
    canvas.line("hat", crown.outline, 1.1)
    canvas.cover(crown.outline)


def _brim(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """All around: seen as a ribbon, or from below or above as a flat ellipse."""
    rng, rim = canvas.rng, crown.low
    lean = rng.uniform(0.15, 0.75) * sitter.unit
    droop = rng.uniform(-0.12, 0.15) * sitter.unit * sitter.down
    ends = [rim[0] - lean * sitter.right + droop], [rim[-1] + lean * sitter.right + droop]
    line = smooth(np.concatenate([ends[0], rim, ends[1]])[::4], 41)
    thick = rng.uniform(0.03, 0.07) + rng.choice([0.0, 0.16]) * np.sin(np.linspace(0, np.pi, 41))
    thick = thick * np.minimum(1, 10 * np.sin(np.linspace(0, np.pi, 41)))  # its ends are round
    worn(canvas, ribbon(line, thick * sitter.unit))
    if rng.random() < 0.7:
        high = rng.uniform(0.08, 0.22) * sitter.unit
        canvas.line("hat", rim - high * sitter.down, 0.8)
        if rng.random() < 0.4:
            canvas.blacken(np.concatenate([rim, (rim - high * sitter.down)[::-1]]), 0.2)


def _peak(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """In front, turned with the head: seen from above or from below, as a thin crescent, turned
    up; a cap that is worn backwards shows its strap."""
    rng, rim = canvas.rng, crown.low
    kind = rng.random()
    if kind < 0.15:
        _strap(canvas, sitter, crown)
        return
    sign = np.sign(sitter.turn) if abs(sitter.turn) > 0.15 else rng.choice([-1, 0, 0, 1])
    out = rng.uniform(0.15, 0.42) * sitter.unit
    if kind < 0.45:
        out = rng.uniform(0.04, 0.14) * sitter.unit
    elif kind < 0.55:
        out = -rng.uniform(0.2, 0.5) * sitter.unit
    begin, end = sorted((int(rng.integers(0, 7)), int(rng.integers(24, 31))))
    beyond = rng.uniform(-0.05, 0.12) * sitter.unit * sitter.right * (sign == 0)
    tip = (
        (rim[begin] + rim[end]) / 2
        + 0.6 * out * sitter.down
        + 0.9 * sign * abs(out) * (sitter.right)
    )
    if out < 0 or kind < 0.45:  # it follows the rim
        tip = tip + rim[(begin + end) // 2] - (rim[begin] + rim[end]) / 2
    wide = 0.3 * (rim[end] - rim[begin])
    knots = [rim[begin], tip - wide - beyond, tip + wide + beyond, rim[end]]
    outer = smooth(np.stack(knots), 25)
    brow = rim[begin : end + 1]
    if rng.random() < 0.4:
        share = rng.uniform(0.1, 0.35)
        inner = outer + share * (smooth(brow[:: max(len(brow) // 5, 1)], 25) - outer)
        canvas.line("hat", inner, 0.7)
    shape = np.concatenate([outer, brow[::-1]])
    shade = rng.random()
    if shade < 0.2:
        canvas.blacken(shape, float(rng.uniform(0, np.pi)), float(rng.uniform(1.6, 4)), "hat", 0.8)
    elif shade < 0.3 and artist.finish == "black":
        canvas.blacken(shape, 0.2)
    worn(canvas, shape, 1.1)


def _strap(canvas: Canvas, sitter: Sitter, crown: Patch) -> None:
    """The gap over the strap of a cap that is worn backwards, with what is seen in it."""
    rng = canvas.rng
    place, half = 0.5 + rng.normal(0, 0.1), rng.uniform(0.1, 0.22)
    foot, high = rng.uniform(0.03, 0.1), rng.uniform(0.12, 0.3)
    t = np.linspace(0, np.pi, 15)
    gap = crown.at(place - half * np.cos(t), foot + high * np.sin(t) ** 0.7)
    for k in rng.integers(1, 14, int(rng.integers(0, 12))):
        low = crown.at(place - half * np.cos(t[k]), foot)
        canvas.line("hair", np.stack([gap[k], (gap[k] + low) / 2, low]), 0.7)
    canvas.line("hat", np.concatenate([gap, gap[:1]]), 0.9)
    canvas.cover(gap)
    if rng.random() < 0.6:
        canvas.line("hat", crown.at(np.linspace(0, 1, 20), foot), 0.8)


def _skullcap(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """Nothing but its crown: a rim in one line or in two, and perhaps one more above."""
    rng = canvas.rng
    high = rng.uniform(0.04, 0.14)
    for k in range(int(rng.integers(0, 3))):
        line = raised(crown.low, high * (1 + 1.5 * k), 0.0, sitter).high
        canvas.line("hat", line[1:-1], 0.9)


def _tall(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """A top hat's brim, a kepi's peak, a cook's band."""
    rng = canvas.rng
    kind = rng.random()
    if kind < 0.4:
        _brim(canvas, sitter, artist, crown, stuff)
    elif kind < 0.75:
        _peak(canvas, sitter, artist, crown, stuff)
    if rng.random() < 0.7:
        for high in (0.05, rng.uniform(0.12, 0.3)):
            canvas.line("hat", crown.low - high * sitter.unit * sitter.down, 0.8)


def _helmet(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Patch, stuff: str) -> None:
    """A strap under the chin, a brim or a brow guard, ridges."""
    rng = canvas.rng
    if rng.random() < 0.4:
        _brim(canvas, sitter, artist, crown, stuff)
    guard = crown.low + rng.uniform(0.04, 0.12) * sitter.unit * sitter.down
    worn(canvas, np.concatenate([crown.low, guard[::-1]]))
    if rng.random() < 0.6:
        for k, side in ((2, -1), (-3, 1)):
            chin = sitter.at(side * 0.2, 1.15)
            bow = 0.12 * side * sitter.unit * sitter.right
            middle = (crown.low[k] + chin) / 2 + bow
            canvas.line("hat", smooth(np.stack([crown.low[k], middle, chin]), 14), 0.9)
    for off in rng.uniform(0.3, 0.7, int(rng.integers(0, 3))):
        up = np.linspace(0, 1, 9)
        canvas.line("hat", crown.at(0.5 + (off - 0.5) * (1 - up) * 2, up), 0.8)


def _seams(canvas: Canvas, sitter: Sitter, crown: Patch) -> None:
    """They run from the rim to the top, where there may be a button."""
    rng = canvas.rng
    if rng.random() > 0.35:
        return
    top = crown.at(0.5 + rng.normal(0, 0.06), 1.0)
    for across in rng.uniform(0.1, 0.9, int(rng.integers(1, 4))):
        foot = crown.at(across, 0.0)
        bow = 0.15 * (across - 0.5) * np.linalg.norm(top - foot) * sitter.right
        canvas.line("hat", smooth(np.stack([foot, (foot + top) / 2 + bow, top]), 14), 0.7)
    if rng.random() < 0.3:
        worn(canvas, ellipse(top, 0.05 * sitter.unit, 0.03 * sitter.unit, 0.0, 15), 0.8)


def _badge(canvas: Canvas, sitter: Sitter, crown: Patch) -> None:
    """A sign or a few letters in front, perhaps in a frame."""
    rng = canvas.rng
    place = crown.at(rng.uniform(0.35, 0.65), rng.uniform(0.2, 0.6))
    size = rng.uniform(0.06, 0.16) * sitter.unit
    if rng.random() < 0.6:
        count = int(rng.integers(3, 9))
        badge = ellipse(place, size, size * rng.uniform(0.6, 1.2), rng.normal(), count + 1)
        canvas.line("hat", badge, 0.9)
        if rng.random() < 0.3:
            canvas.blacken(badge, 0.5)
    for _ in range(int(rng.integers(0, 6))):
        mark = place + size * rng.uniform((-1.2, -0.6), (1.2, 0.6), (int(rng.integers(2, 5)), 2))
        canvas.line("hat", mark, 0.8)


# Of each: what is drawn besides its crown, and what that is made of.
KINDS: dict[str, tuple[Callable[[Canvas, Sitter, Artist, Patch, str], None], Odds]] = {
    "brim": (_brim, FELT), "cap": (_peak, FELT), "skullcap": (_skullcap, FELT),
    "beanie": (beanie, WOOL), "scarf": (scarf, CLOTH), "veil": (veil, CLOTH),
    "bandana": (bandana, CLOTH), "tall": (_tall, FELT), "wrap": (wrap, CLOTH),
    "hood": (hood, CLOTH), "helmet": (_helmet, FELT), "flat": (_peak, FELT),
}  # fmt: skip
BADGED = {"cap": 0.4, "skullcap": 0.4, "helmet": 0.3, "beanie": 0.15, "tall": 0.15}
