"""Shade as artists hatch it: under the chin, beside the nose, on one side of the face.

Also where beards grow, and in strokes as theirs: whoever learns from these drawings has to tell
hair from shade.
"""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .eyes import Eye
from .mouth import Mouth
from .patches import Patch, along, ticks
from .shapes import Points, part, smooth
from .sitter import RAYS, Sitter

NECK_SHADE = 0.36  # units that the chin's shadow reaches down, at most
# Of faces that are shaded in planes, how many have each of them shaded.
PLANES = {"cheekbones": 0.65, "jaw": 0.35, "half": 0.3, "folds": 0.45, "nose": 0.4,
          "upper_lip": 0.4, "red": 0.35, "chin": 0.6, "under": 0.25}  # fmt: skip
CROSSED = 0.3  # how many of them are hatched twice


def draw_shade(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """What is shaded on the face itself; all on the same side of the light."""
    if artist.shade == "none":
        return
    rng = canvas.rng
    side = sitter.far if abs(sitter.turn) > 0.2 else ("left", "right")[int(rng.integers(2))]
    angle = float(rng.choice([0.9, 2.2]) + rng.normal(0, 0.15))
    if artist.shade == "planes":
        _planes(canvas, sitter, side, angle)
        return
    full = artist.shade == "full"
    if full or artist.shade == "side":
        _hatch(canvas, _cheek(sitter, side, rng.uniform(0.6, 0.85)), angle, 2.2, 0.6)
        if rng.random() < 0.4:  # crossed, and deeper at the edge
            _hatch(canvas, _cheek(sitter, side, 0.88), angle + 0.8, 2.4, 0.7)
    if full or artist.shade == "nose":
        edge = part(sitter.curves[f"nose_side_{side}"], 0.25, 1)
        wing = smooth(sitter.curves[f"nose_wing_{side}"], 10)
        out = 0.12 * sitter.unit * (1 if side == "left" else -1) * sitter.right
        _hatch(canvas, np.concatenate([edge, wing[4:5], (edge + out)[::-1]]), angle, 1.8, 0.6)
    if full:
        for own in ("left", "right"):
            eye = Eye(sitter, artist, own)
            if eye.seen and rng.random() < 0.7:
                brow = smooth(sitter.curves[f"brow_lower_{own}"], 12)[:7]
                lid = eye.upper[:12:2] - 0.08 * eye.width * eye.along
                _hatch(canvas, np.concatenate([brow, lid[::-1]]), angle, 1.9, 0.55)
        if rng.random() < 0.6:
            lip = part(smooth(sitter.curves["under_lip"], 12), 0.1, 0.9)
            low = lip + 0.06 * sitter.unit * sitter.down
            _hatch(canvas, np.concatenate([lip, low[::-1]]), 0.1, 1.6, 0.55)


def draw_neck_shade(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """The shadow of the chin on the neck."""
    rng = canvas.rng
    if artist.shade not in ("neck", "full") and not (
        artist.shade == "planes" and rng.random() < 0.8
    ):
        return
    low = smooth(sitter.face[np.arange(0.3 * RAYS, 0.7 * RAYS + 1).astype(int)], 30)
    sag = np.sin(np.linspace(0, np.pi, 30)) * rng.uniform(0.4, 1) * NECK_SHADE
    under = low + (sag * sitter.unit)[:, None] * sitter.down
    neck = np.concatenate([sitter.neck[0], sitter.neck[1][::-1]])
    shape = np.concatenate([low, under[::-1]])
    canvas.blacken(
        shape, float(rng.choice([0.5, 2.6, 1.3])), 1.9, "hatch", 0.8, area=canvas.area(neck)
    )


def _planes(canvas: Canvas, sitter: Sitter, side: str, angle: float) -> None:
    """The planes of the face that are turned from the light, in one kind of strokes."""
    rng = canvas.rng
    how = str(rng.choice(["hatch", "ticks", "along"], p=(0.4, 0.4, 0.2)))
    dark = rng.uniform(0.5, 1.0)
    mouth = Mouth(sitter)
    picked = [name for name, share in PLANES.items() if rng.random() < share]
    sides = ("left", "right") if rng.random() < 0.5 else (side,)
    patches = []
    for own in sides:
        out = (1 if own == "left" else -1) * sitter.right
        if "cheekbones" in picked:
            patches.append(_hollow(sitter, mouth, own, rng))
        if "nose" in picked:
            edge = part(sitter.curves[f"nose_side_{own}"], rng.uniform(0.1, 0.5), 1)
            patches.append(Patch.between(edge, edge + rng.uniform(0.06, 0.16) * sitter.unit * out))
        if "folds" in picked:
            fold = part(sitter.curves[f"nasolabial_0_{own}"], 0.05, rng.uniform(0.5, 1))
            wide = rng.uniform(0.03, 0.1) * sitter.unit * out
            along(canvas, "hatch", Patch.between(fold + wide, fold), int(rng.integers(2, 7)), 0.8,
                  dark, True)  # fmt: skip
    if "jaw" in picked:  # that is on the side of the shade alone
        outer, inner = np.split(_cheek(sitter, side, rng.uniform(0.72, 0.9)), 2)
        third = len(outer) // 3
        low = slice(third, None) if side == "left" else slice(0, -third)
        patches.append(Patch.between(inner[::-1][low], outer[low]))
    if "half" in picked:  # all that lies below the cheekbone
        patches.append(_half(sitter, mouth, side, rng))
    if "under" in picked:  # the ball of the chin
        ball = sitter.face[np.arange(0.43 * RAYS, 0.57 * RAYS).astype(int)]
        rise = np.sin(np.linspace(0, np.pi, len(ball)))[:, None] * rng.uniform(0.04, 0.14)
        below = Patch.between(ball - rise * sitter.unit * sitter.down, ball)
        _hatch(canvas, below.outline, angle, rng.uniform(1.4, 2.4), dark)
    lip, base = mouth.outer_upper, sitter.mark("nose_base")
    if "upper_lip" in picked:  # the nose's shadow, no wider than it
        begin = int(rng.integers(10, 17))
        foot = lip[begin : 41 - begin] + rng.uniform(0.1, 0.4) * (base - lip[20])
        under = foot + rng.uniform(0.4, 0.8) * (base - foot.mean(axis=0))
        patches.append(Patch.between(under, foot))
    if "red" in picked:
        patches.append(Patch.between(lip[2:-2], mouth.upper[2:-2]))
    if "chin" in picked:
        begin = int(rng.integers(6, 14))
        rim = mouth.outer_lower[begin : 41 - begin] + 0.01 * sitter.unit * sitter.down
        sag = np.sin(np.linspace(0, np.pi, len(rim)))[:, None] * rng.uniform(0.05, 0.16)
        patches.append(Patch.between(rim, rim + sag * sitter.unit * sitter.down))
    for patch in patches:
        _shaded(canvas, sitter, patch, how, angle, dark)
        if rng.random() < CROSSED:
            _shaded(canvas, sitter, patch, how, angle + rng.uniform(0.4, 1.0), dark)


def _hollow(sitter: Sitter, mouth: Mouth, side: str, rng: np.random.Generator) -> Patch:
    """Under the cheekbone: from before the ear toward the corner of the mouth."""
    ray, corner = (0.3, mouth.line[-1]) if side == "left" else (0.7, mouth.line[0])
    edge = sitter.face[int(ray * RAYS)]
    goal = edge + rng.uniform(0.45, 0.8) * (corner - edge)
    t = np.linspace(0, 1, 12)[:, None]
    top = edge + t * (goal - edge) + 0.06 * np.sin(np.pi * t) * sitter.unit * sitter.down
    tall = rng.uniform(0.12, 0.4) * sitter.unit * (1 - t) ** rng.uniform(0.3, 1.0)
    return Patch.between(top, top + (tall + 1) * sitter.down)


def _half(sitter: Sitter, mouth: Mouth, side: str, rng: np.random.Generator) -> Patch:
    """The lower face on one side, from before the ear to beside mouth and chin."""
    first, last = (0.26, 0.47) if side == "left" else (0.74, 0.53)
    edge = sitter.face[np.linspace(first * RAYS, last * RAYS, 20).astype(int)]
    goal = mouth.line[-1 if side == "left" else 0]
    depth = rng.uniform(0.35, 0.85) * np.sin(np.linspace(0.3, np.pi - 0.5, 20))[:, None]
    return Patch.between(edge + depth * (goal - edge), edge)


def _shaded(
    canvas: Canvas, sitter: Sitter, patch: Patch, how: str, angle: float, dark: float
) -> None:
    """Strokes side by side, short ones as of hair, or long ones along the patch."""
    rng = canvas.rng
    if how == "hatch":
        _hatch(canvas, patch.outline, angle, rng.uniform(1.4, 2.4), dark)
    elif how == "along":
        along(canvas, "hatch", patch, int(rng.integers(3, 10)), 0.8, dark, within=True)
    else:
        size = rng.uniform(0.04, 0.14) * sitter.unit
        count = patch.covered(canvas, rng.uniform(0.3, 0.9), size, 0.8)
        across, up = patch.scattered(rng, count, rng.uniform(0.6, 1.4))
        roots, long = patch.at(across, up), size * rng.uniform(0.6, 1.3, count)
        slant = angle + rng.normal(0, 0.12, count)
        ways = long[:, None] * np.stack([np.cos(slant), np.sin(slant)], axis=1)
        ticks(canvas, "hatch", roots - ways / 2, ways, 0.8, dark, within=True)


def _cheek(sitter: Sitter, side: str, depth: float) -> Points:
    """The side of the face from the temple to the jaw, in from its outline by 1 - depth."""
    first, last = (0.14, 0.42) if side == "left" else (0.58, 0.86)
    edge = sitter.face[np.arange(first * RAYS, last * RAYS).astype(int)]
    middle = sitter.face.mean(axis=0)
    inner = middle + depth * (edge - middle)
    return np.concatenate([edge, inner[::-1]])


def _hatch(canvas: Canvas, shape: Points, angle: float, sparse: float, strength: float) -> None:
    canvas.blacken(shape, angle, sparse, "hatch", strength, within=True)
