"""The outline of the face, ears, neck, creases and clothes by an artist's conventions."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .shapes import Points, ellipse, part, smooth
from .sitter import RAYS, Sitter

# How creases fold at rest in an old face, at most.
LEAST = 0.22  # of a crease's full depth, from which it is drawn
MEET = 0.03  # units between the halves of a crease that crosses the middle of the face
OLD = {"nasolabial": 0.7, "worry": 0.45, "crow_down": 0.4, "marionette": 0.4, "under_eye": 0.6}


def draw_face(canvas: Canvas, sitter: Sitter, artist: Artist, bald: bool) -> None:
    """The outline from ear to ear by way of the chin; with the skull where there is no hair."""
    begin, end = (sitter_ray(sitter, side) for side in (1, -1))
    low = np.arange(begin, end + 1) % RAYS
    jaw = smooth(sitter.face[low][::2], 60)
    if artist.jaw == "open":
        a, b = sorted(canvas.rng.uniform([0.12, 0.62], [0.38, 0.88]))
        for piece in (part(jaw, 0, a), part(jaw, a + 0.08, b), part(jaw, b + 0.08, 1)):
            canvas.line("jaw", piece, 1.0, 0.9)
    else:
        canvas.line("jaw", jaw, 1.1 if artist.manner != "cartoon" else 1.25)
    if bald:
        high = np.arange(end, begin + RAYS + 1) % RAYS
        canvas.line("skull", smooth(sitter.head[high][::2], 50), 1.1)


def sitter_ray(sitter: Sitter, side: int) -> int:
    """The ray at which the outline leaves the ear, at the picture's right (1) or left (-1)."""
    centre = sitter.face.mean(axis=0)
    x, y = (sitter.face - centre) @ sitter.right, (sitter.face - centre) @ sitter.down
    goal = (sitter.origin - centre) @ sitter.down + 0.12 * sitter.unit
    own = np.flatnonzero(np.sign(x) == side)
    return int(own[np.argmin(np.abs(y[own] - goal))])


def draw_ears(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    if artist.ear == "none":
        return
    face = canvas.area(sitter.face)
    for side, outline in sitter.ears.items():
        middle = outline.mean(axis=0)
        far = side == sitter.far and abs(sitter.turn) > 0.1
        line = part(_from_the_face(sitter, outline), 0.02, 0.98)
        beyond = ~canvas.inside(face, line) if far else None  # the cheek hides the rest
        canvas.line("ear", line, 1.0, seen=beyond)
        if artist.ear in ("inner", "full") and not far:
            inside = middle + 0.62 * (line - middle)
            canvas.line("ear", part(inside, 0.08, 0.6), 0.75, 0.85)
            if artist.ear == "full":
                curl = middle + 0.32 * (line[::-1] - middle)
                canvas.line("ear", part(curl, 0.25, 0.85), 0.7, 0.7)
                canvas.line("ear", part(middle + 0.8 * (line - middle), 0.55, 0.85), 0.5, 0.6)
        if artist.earring:
            drop = outline[np.argmax((outline - middle) @ sitter.down)]
            size = canvas.rng.uniform(0.02, 0.05) * sitter.unit
            canvas.line(
                "jewel", ellipse(drop + size * sitter.down, size, 1.4 * size, count=15), 0.8
            )
        canvas.mark("ear", outline)
        canvas.cover(outline)


def _from_the_face(sitter: Sitter, outline: Points) -> Points:
    """The ear's outline as a C: from its root above, around behind, to its lobe."""
    middle = outline.mean(axis=0)
    centre = sitter.face.mean(axis=0)
    sign = np.sign((middle - centre) @ sitter.right)
    open_ = outline[:-1]
    angle = np.arctan2((open_ - middle) @ sitter.right * sign, -((open_ - middle) @ sitter.down))
    order = np.argsort(angle)
    angle = angle[order]
    keep = (angle > -0.75) & (angle < 2.9)
    return smooth(open_[order][keep], 30)


def draw_neck(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    if artist.neck == "none":
        return
    first = canvas.rng.uniform(0.0, 0.3)
    for side in (0, 1):
        line = smooth(sitter.neck[side], 16)
        canvas.line("neck", part(line, first, 1), 0.9)
    if artist.neck == "muscle":
        for side in (0, 1):
            top, foot = sitter.neck[side][1], sitter.neck[:, -1].mean(axis=0)
            inner = top + 0.25 * (foot - top)
            line = smooth(
                np.stack([inner, inner + 0.5 * (foot - inner), foot * 0.9 + 0.1 * top]), 12
            )
            canvas.line("neck", line, 0.6, 0.5)


def neck_shape(sitter: Sitter) -> Points:
    """The outline of the neck, up into the face."""
    return np.concatenate([sitter.neck[0], sitter.neck[1][::-1]])


def draw_creases(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """Folds of the expression, and some of age, as few or many short lines."""
    deep = dict(sitter.creases)
    age = max(float(sitter.person.get("age", 0.0)) - 0.35, 0)
    for name in sitter.crease_names:
        old = 1.5 * age * OLD.get(name.rsplit("_", 2)[0], 0.0)
        if old:
            deep[name] = max(deep.get(name, 0.0), old)
    deep = {name: depth for name, depth in deep.items() if depth > LEAST}
    most = {"none": 0, "one": 1, "two": 2, "all": 9}[artist.crease]
    for name, depth in deep.items():
        stem, number, side = name.rsplit("_", 2)
        crow = stem.startswith("crow")
        if crow and artist.crow == "none" or not crow and int(number) >= most:
            continue
        if stem == "smile_fold" and number == "1":  # under the eye, where it hardly shows
            continue
        line, seen = sitter.curves[name], sitter.seen[name]
        size = 0.45 + 0.5 * min(depth, 1.2) + canvas.rng.normal(0, 0.08)  # deeper ones are longer
        size = float(np.clip(size, 0.3, 1.0))
        begin = float(canvas.rng.uniform(0, 1 - size))
        other = f"{stem}_{number}_{'left' if side == 'right' else 'right'}"
        # It may come from the middle of the face, and be one line where both sides are folded.
        meets = np.hypot(*(line[0] - sitter.curves[other][0])) < MEET * sitter.unit
        if meets and other in deep and side == "left":
            continue
        picked = part(np.column_stack([line, seen]), begin * (not meets), begin + size)
        if meets and other in deep:
            more = np.column_stack([sitter.curves[other], sitter.seen[other]])
            picked = np.concatenate([picked[::-1], part(more, 0, begin + size)[1:]])
        if crow and artist.crow == "ticks":
            picked = np.linspace(picked[0], picked[-1], 7)
        strength = float(np.clip(0.55 + 0.4 * depth, 0, 1))
        canvas.line("crease", picked[:, :2], 0.9, strength, within=True, seen=picked[:, 2] > 0.5)
    _cheeks(canvas, sitter, artist, deep)
    _chin(canvas, sitter, artist)


def _cheeks(canvas: Canvas, sitter: Sitter, artist: Artist, deep: dict[str, float]) -> None:
    """Lines from the nose to the mouth that many artists draw in any face."""
    if artist.cheek == "none":
        return
    for side in ("left", "right"):
        name = f"nasolabial_0_{side}"
        if name in deep or f"smile_fold_0_{side}" in deep:
            continue
        end = (
            canvas.rng.uniform(0.25, 0.5) if artist.cheek == "short" else canvas.rng.uniform(0.6, 1)
        )
        line = np.column_stack([sitter.curves[name], sitter.seen[name]])
        picked = part(line, 0.05, end)
        canvas.line("crease", picked[:, :2], 0.6, 0.5, within=True, seen=picked[:, 2] > 0.5)


def _chin(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    if artist.chin == "arc":
        line = sitter.curves["chin_fold" if canvas.rng.random() < 0.6 else "chin_arc"]
        canvas.line("chin", part(smooth(line, 16), 0.2, 0.8), 0.7, 0.6, within=True)
    elif artist.chin == "dimple":
        low = sitter.curves["chin_arc"][len(sitter.curves["chin_arc"]) // 2]
        canvas.line(
            "chin", np.stack([low - 0.09 * sitter.unit * sitter.down, low]), 0.8, 0.7, within=True
        )


def draw_freckles(canvas: Canvas, sitter: Sitter) -> None:
    for side in ("left", "right"):
        middle = sitter.curves[f"cheek_{side}"][:6].mean(axis=0)
        for _ in range(int(canvas.rng.integers(4, 12))):
            spot = middle + sitter.unit * canvas.rng.normal(0, (0.12, 0.07))
            canvas.line(
                "freckle", spot + np.array([[-0.4, 0.0], [0.4, 0.2]]), 0.9, 0.8, within=True
            )
