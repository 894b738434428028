"""What is worn on a head: caps, hats with a brim, helmets, cloths, hoods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .shapes import Points, ellipse, normals, ribbon, smooth, wave
from .sitter import RAYS, Sitter

# Units that each stands off the skull, and how much more at the crown's middle.
STANDS = {"cap": (0.1, 0.06), "brim": (0.12, 0.3), "beanie": (0.08, 0.3), "scarf": (0.08, 0.06),
          "tall": (0.08, 0.0), "wrap": (0.12, 0.3), "hood": (0.12, 0.25), "helmet": (0.14, 0.2),
          "flat": (0.05, 0.12)}  # fmt: skip
SOFT = ("beanie", "scarf", "wrap", "hood")  # whose outline is uneven
ABOVE = (0.38, 0.82)  # units above the eyes where a rim crosses the forehead


@dataclass(frozen=True)
class Crown:
    """dome : (k, 2) from the picture's left over the head to its right;  rim : (31, 2) between its
    ends, over the forehead"""

    dome: Points
    rim: Points

    @property
    def shape(self) -> Points:
        return np.concatenate([self.dome, self.rim[::-1]])

    def at(self, across: float, up: float) -> Points:
        """A place on the crown: a share of the way from left to right, and from rim to dome."""
        ends = [line[round(across * (len(line) - 1))] for line in (self.rim, self.dome)]
        return ends[0] + up * (ends[1] - ends[0])


def draw_hat(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """A cap, a hat, a band or a cloth, which hides hair and skull."""
    if artist.hat == "none":
        return
    if artist.hat == "band":
        _band(canvas, sitter)
        return
    crown = _crown(canvas, sitter, artist)
    canvas.mark("hair", crown.shape)  # what is worn on hair stands for it
    canvas.mark("hat", crown.shape)
    PARTS[artist.hat](canvas, sitter, crown)
    _surface(canvas, sitter, artist, crown)
    canvas.line("hat", np.concatenate([crown.dome, crown.rim[::-1]]), 1.1)
    canvas.cover(crown.shape)


def _crown(canvas: Canvas, sitter: Sitter, artist: Artist) -> Crown:
    """The part of it that holds the skull."""
    rng = canvas.rng
    centre = sitter.face.mean(axis=0)
    reach = np.linspace(-0.27, 0.27, 47) * RAYS
    angle = 2 * np.pi * reach / RAYS
    head = np.concatenate([sitter.head, sitter.head[:1]]) - centre
    skull = np.interp(reach, np.arange(RAYS + 1), np.linalg.norm(head, axis=1), period=RAYS)
    ways = np.sin(angle)[:, None] * sitter.right - np.cos(angle)[:, None] * sitter.down
    stand, more = STANDS[artist.hat]
    high = more * rng.uniform(0, 1) * np.cos(np.clip(angle, -np.pi / 2, np.pi / 2)) ** 2
    off = stand * rng.uniform(0.5, 2.0) + high
    if artist.hat in SOFT:
        off = off + rng.uniform(0, 0.05) * wave(rng, 1, len(off), rng.uniform(1, 3))[0]
    dome = centre + (skull + np.maximum(off, 0.02) * sitter.unit)[:, None] * ways
    if artist.hat == "tall":
        dome = _risen(dome, sitter, rng)
    # The rim: an arc over the forehead between the dome's lower ends, lower or higher in front.
    height, lean = rng.uniform(*ABOVE), rng.normal(0, 0.07)
    if artist.hat == "hood":
        height = rng.uniform(-0.6, 0.2)
    x, y = sitter.local(dome).T
    low = np.abs(y + height - 0.1 - lean * x)
    half = len(dome) // 2
    first, last = int(low[:half].argmin()), half + int(low[half:].argmin())
    dome = dome[first : last + 1]
    t = np.linspace(0, 1, 31)
    dip = rng.uniform(-0.12, 0.18) * np.sin(np.pi * t)
    rim = dome[0] + t[:, None] * (dome[-1] - dome[0]) - dip[:, None] * sitter.unit * sitter.down
    if artist.hat == "hood":
        rim = _opening(sitter, dome, rng)
    return Crown(dome, rim)


def _risen(dome: Points, sitter: Sitter, rng: np.random.Generator) -> Points:
    """A dome as a cylinder that widens or narrows upwards."""
    x, y = sitter.local(dome).T
    top = y.min() - rng.uniform(0.0, 0.7)
    side, flare = np.abs(x).max(), rng.uniform(-0.2, 0.25)
    middle = (x.min() + x.max()) / 2
    n = len(dome)
    k = np.linspace(0, 1, n)
    begin = y[[0, -1]]
    corner = 0.28
    px = np.interp(k, [0, corner, 1 - corner, 1], [-1, -1 - flare, 1 + flare, 1]) * side + middle
    py = np.interp(k, [0, corner, 1 - corner, 1], [begin[0], top, top, begin[1]])
    bow = rng.uniform(-0.02, 0.12) * np.clip(np.sin(np.pi * (k - corner) / (1 - 2 * corner)), 0, 1)
    return sitter.at(px, py - bow)


def _opening(sitter: Sitter, dome: Points, rng: np.random.Generator) -> Points:
    """The inner edge of a hood, around the face from one of its lower ends to the other."""
    ends = sitter.local(dome[[0, -1]])
    middle, high = ends[:, 0].mean(), rng.uniform(0.6, 0.95)
    half = np.ptp(ends[:, 0]) / 2
    t = np.linspace(np.pi, 0, 31)
    x = middle + (half - 0.08) * np.sign(np.cos(t)) * np.abs(np.cos(t)) ** 0.8
    low = np.interp(np.linspace(0, 1, 31), [0, 1], ends[:, 1])
    return sitter.at(x, low - (low + high) * np.abs(np.sin(t)) ** 0.8)


def _band(canvas: Canvas, sitter: Sitter) -> None:
    """A ribbon over the hair."""
    rng = canvas.rng
    centre = sitter.face.mean(axis=0)
    half = 0.92 * np.ptp(sitter.local(sitter.head)[:, 0]) / 2
    height, t = rng.uniform(*ABOVE), np.linspace(-1, 1, 31)
    x = sitter.local(centre[None])[0, 0] + half * t
    rim = sitter.at(x, -height + rng.uniform(-0.1, 0.05) * (1 - t**2))
    wide = rng.uniform(0.12, 0.22) * sitter.unit
    canvas.line("hat", rim, 1.0)
    canvas.line("hat", rim - wide * sitter.down, 1.0)
    canvas.cover(np.concatenate([rim, (rim - wide * sitter.down)[::-1]]))


def _worn(canvas: Canvas, outline: Points, width: float = 1.0) -> None:
    """A part of a hat that hides what is behind it."""
    canvas.mark("hat", outline)
    canvas.line("hat", outline, width)
    canvas.cover(outline)


def _brim(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """All around: seen as a ribbon, or from below or above as a flat ellipse."""
    rng, rim = canvas.rng, crown.rim
    lean = rng.uniform(0.15, 0.55) * sitter.unit
    droop = rng.uniform(-0.12, 0.15) * sitter.unit * sitter.down
    ends = [rim[0] - lean * sitter.right + droop], [rim[-1] + lean * sitter.right + droop]
    line = smooth(np.concatenate([ends[0], rim, ends[1]])[::4], 41)
    thick = rng.uniform(0.03, 0.07) + rng.choice([0.0, 0.16]) * np.sin(np.linspace(0, np.pi, 41))
    _worn(canvas, ribbon(line, thick * sitter.unit))
    if rng.random() < 0.7:
        high = rng.uniform(0.08, 0.22) * sitter.unit
        canvas.line("hat", rim - high * sitter.down, 0.8)
        if rng.random() < 0.4:
            canvas.blacken(np.concatenate([rim, (rim - high * sitter.down)[::-1]]), 0.2)


def _peak(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """In front, turned with the head; a cap that is worn backwards has none."""
    rng, rim = canvas.rng, crown.rim
    if rng.random() < 0.12:
        bow = np.sin(np.linspace(0, np.pi, 15))[:, None]
        canvas.line("hat", rim[8:23] - 0.22 * sitter.unit * bow * sitter.down, 0.9)
        return
    sign = np.sign(sitter.turn) if abs(sitter.turn) > 0.15 else rng.choice([-1, 0, 1])
    out = rng.uniform(0.15, 0.42) * sitter.unit
    begin, end = sorted((int(rng.integers(0, 7)), int(rng.integers(24, 31))))
    tip = (rim[begin] + rim[end]) / 2 + 0.6 * out * sitter.down + 0.9 * sign * out * sitter.right
    wide = 0.3 * (rim[end] - rim[begin])
    outer = smooth(np.stack([rim[begin], tip - wide, tip + wide, rim[end]]), 25)
    _worn(canvas, np.concatenate([outer, rim[begin : end + 1][::-1]]), 1.1)
    if rng.random() < 0.4:
        inner = smooth(np.stack([rim[begin], tip - wide, tip + wide, rim[end]]), 25)
        canvas.line("hat", 0.75 * inner + 0.25 * inner.mean(axis=0) - 0.04 * out * sitter.down, 0.7)


def _fold(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """A beanie's: a turned-up edge in ribs, and perhaps a bobble."""
    rng, rim = canvas.rng, crown.rim
    fold = rng.uniform(0.12, 0.32) * sitter.unit
    if rng.random() < 0.8:
        canvas.line("hat", rim - fold * sitter.down, 0.9)
    for k in range(2, 29, int(rng.integers(1, 5))):
        canvas.line("hat", np.stack([rim[k], rim[k] - fold * sitter.down]), 0.7)
    if rng.random() < 0.25:
        top = crown.dome[len(crown.dome) // 2]
        r = rng.uniform(0.12, 0.24) * sitter.unit
        ball = ellipse(top - 0.7 * r * sitter.down, r, r, 0.0, 33)
        away = (ball - top) / r * 0.03 * sitter.unit
        ball = ball + away * wave(rng, 1, 33, 5)[0][:, None]
        _worn(canvas, ball, 0.9)


def _knot(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """A headscarf's: it falls beside the face to under the chin."""
    rng = canvas.rng
    for k, side in ((0, -1), (-1, 1)):
        begin, inner = crown.dome[k], crown.rim[2 if k == 0 else -3]
        out = rng.uniform(-0.1, 0.3) * sitter.unit * side * sitter.right
        low = sitter.at(side * rng.uniform(0.15, 0.5), rng.uniform(1.05, 1.5))
        outer = smooth(np.stack([begin, (begin + low) / 2 + out, low]), 14)
        cheek = smooth(np.stack([inner, (inner + low) / 2 - 0.12 * side * sitter.unit *
                                 sitter.right * rng.uniform(-1, 1), low]), 14)  # fmt: skip
        shape = np.concatenate([outer, cheek[::-1]])
        canvas.mark("hair", shape)
        canvas.line("hat", cheek, 0.9)
        for _ in range(int(rng.integers(0, 4))):
            share = rng.uniform(0.2, 0.8)
            canvas.line("hat", outer + share * (cheek - outer), 0.6)
        _worn(canvas, shape)


def _tall(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """A top hat's brim, a kepi's peak, a cook's band."""
    rng = canvas.rng
    kind = rng.random()
    if kind < 0.4:
        _brim(canvas, sitter, crown)
    elif kind < 0.75:
        _peak(canvas, sitter, crown)
    if rng.random() < 0.7:
        for high in (0.05, rng.uniform(0.12, 0.3)):
            canvas.line("hat", crown.rim - high * sitter.unit * sitter.down, 0.8)


def _wrapped(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """A turban's or a cloth's folds, which cross over the forehead."""
    rng = canvas.rng
    for _ in range(int(rng.integers(4, 14))):
        a = crown.at(rng.uniform(0, 0.5), rng.uniform(0, 0.9))
        b = crown.at(rng.uniform(0.5, 1), rng.uniform(0, 0.9))
        bow = rng.normal(0, 0.2) * sitter.unit
        canvas.line("hat", smooth(np.stack([a, (a + b) / 2 - bow * sitter.down, b]), 16), 0.9)


def _hood(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """It goes on to the shoulders."""
    rng = canvas.rng
    for k, side in ((0, -1), (-1, 1)):
        begin, inner = crown.dome[k], crown.rim[k]
        foot = sitter.at(side * rng.uniform(0.9, 1.5), rng.uniform(1.2, 1.8))
        chin = sitter.at(side * rng.uniform(0.1, 0.5), rng.uniform(1.15, 1.5))
        outer = smooth(np.stack([begin, begin + 0.4 * sitter.unit * sitter.down, foot]), 14)
        edge = smooth(np.stack([inner, (inner + chin) / 2 + 0.1 * side * sitter.unit *
                                sitter.right, chin]), 14)  # fmt: skip
        shape = np.concatenate([outer, edge[::-1]])
        canvas.mark("hair", shape)
        _worn(canvas, shape)


def _helmet(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """A strap under the chin, a brow guard, a ridge."""
    rng = canvas.rng
    guard = crown.rim + rng.uniform(0.04, 0.12) * sitter.unit * sitter.down
    _worn(canvas, np.concatenate([crown.rim, guard[::-1]]))
    if rng.random() < 0.6:
        for k, side in ((2, -1), (-3, 1)):
            chin = sitter.at(side * 0.2, 1.15)
            bow = 0.12 * side * sitter.unit * sitter.right
            middle = (crown.rim[k] + chin) / 2 + bow
            canvas.line("hat", smooth(np.stack([crown.rim[k], middle, chin]), 14), 0.9)
    for off in rng.uniform(0.3, 0.7, int(rng.integers(0, 3))):
        seam = [crown.at(0.5 + (off - 0.5) * (1 - up) * 2, up) for up in np.linspace(0, 1, 9)]
        canvas.line("hat", np.stack(seam), 0.8)


def _knitted(canvas: Canvas, sitter: Sitter, crown: Crown) -> None:
    """Short strokes in rows along the crown, denser at one side: wool, or cloth in shade."""
    rng = canvas.rng
    lean, size = rng.normal(0, 0.06), rng.uniform(0.06, 0.3)
    dark, aside = rng.uniform(0.3, 1.0), rng.choice([-1.0, 0.0, 1.0])
    width, rows = rng.uniform(0.6, 1.4), np.linspace(0.02, 0.95, int(rng.integers(3, 10)))
    for up in rows:
        for across in np.linspace(0.02, 0.98, int(rng.integers(12, 45))):
            if rng.random() > 0.6 + 0.8 * aside * (across - 0.5):
                continue
            across = float(np.clip(across + 0.01 * rng.normal(), 0, 1))
            end = float(np.clip(across + lean, 0, 1))
            high = min(up + size * rng.uniform(0.5, 1.2), 1.0)
            ends = np.stack([crown.at(across, up), crown.at(end, high)])
            bow = 0.02 * rng.normal() * sitter.unit * sitter.right
            line = smooth(np.stack([ends[0], ends.mean(axis=0) + bow, ends[1]]), 8)
            canvas.line("hat", line, width, dark, loose=0.3)


def _surface(canvas: Canvas, sitter: Sitter, artist: Artist, crown: Crown) -> None:
    """What is seen on a crown: seams, a badge, ribs, hatching, black."""
    rng = canvas.rng
    if rng.random() < 0.35:
        top = crown.at(0.5 + rng.normal(0, 0.06), 1.0)
        for across in rng.uniform(0.1, 0.9, int(rng.integers(1, 4))):
            foot = crown.at(across, 0.0)
            bow = 0.15 * (across - 0.5) * np.linalg.norm(top - foot) * sitter.right
            canvas.line("hat", smooth(np.stack([foot, (foot + top) / 2 + bow, top]), 14), 0.7)
    if rng.random() < 0.3:
        place = crown.at(rng.uniform(0.35, 0.65), rng.uniform(0.25, 0.6))
        count, size = int(rng.integers(3, 7)), rng.uniform(0.06, 0.16) * sitter.unit
        badge = ellipse(place, size, size * rng.uniform(0.6, 1.2), rng.normal(), count + 1)
        canvas.line("hat", badge, 0.9)
        if rng.random() < 0.3:
            canvas.blacken(badge, 0.5)
    chance = rng.random()
    if artist.finish == "black" and chance < 0.4:
        canvas.blacken(crown.shape, float(rng.uniform(-0.5, 0.8)))
    elif chance < 0.3:
        lean, gap = float(rng.uniform(0, np.pi)), float(rng.uniform(1.8, 5))
        canvas.blacken(crown.shape, lean, gap, "hat", float(rng.uniform(0.3, 0.9)))
    elif chance < 0.42:
        for across in np.linspace(0.04, 0.96, int(rng.integers(8, 40))):
            rib = np.stack([crown.at(across, up) for up in (0.0, 0.4, 0.75, rng.uniform(0.8, 1))])
            canvas.line("hat", smooth(rib, 14), 0.7)
    elif chance < 0.6:
        _knitted(canvas, sitter, crown)
    elif chance < 0.72:  # shaded at its edge, as round things are
        away = normals(crown.dome) * sitter.unit * rng.uniform(0.1, 0.25)
        inner = crown.dome + away
        if np.linalg.norm(inner.mean(axis=0) - crown.rim.mean(axis=0)) > np.linalg.norm(
            crown.dome.mean(axis=0) - crown.rim.mean(axis=0)
        ):
            inner = crown.dome - away
        shade = np.concatenate([crown.dome, inner[::-1]])
        canvas.blacken(shade, float(rng.uniform(0, np.pi)), float(rng.uniform(1.5, 3)), "hat", 0.7)


# What of each is drawn besides its crown.
PARTS = {"brim": _brim, "cap": _peak, "beanie": _fold, "scarf": _knot, "tall": _tall,
         "wrap": _wrapped, "hood": _hood, "helmet": _helmet, "flat": _peak}  # fmt: skip
