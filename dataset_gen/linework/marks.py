"""The hand: clean strokes become the marks that a person of this style would make of them.

Lines are pieced together from several pulls, gone over, overshot, broken, left out, and wander off
slowly. All strokes are worked on at once, in flat arrays.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.errors import InputError
from facs_rig.common.polylines import Polylines, spread

from .strokes import Stroke
from .style import Style

STEP = 2.0  # pixels between the points of a mark
SHORT = 40.0  # pixels, shorter strokes may be left out
WOBBLE_KNOTS, PRESSURE_KNOTS, GAP = 14.0, 26.0, 7.0  # pixels
# Of a wobble of 1: pixels that a line wanders along its way, and that it lies off altogether.
WANDERS, LIES_OFF = 0.46, 0.45
OVERLAP = 0.16  # of a pull, by which the next one begins earlier
SHORTER = 0.12  # of a line, most that a second pass leaves out at each end
# Drawn in one go and once: blots, hairs, areas, and the lines that help to draw.
ONCE = ("pupil", "fill", "brow_hair", "lash", "lash_lower", "hair", "beard", "hatch", "mass",
        "construction")  # fmt: skip


def loosen(strokes: Iterable[Stroke], style: Style, rng: np.random.Generator) -> list[Stroke]:
    """The strokes as a hand of this style draws them, in the order in which they were given.

    Strokes of less than two points are nothing to draw.
    """
    strokes = [stroke for stroke in strokes if len(stroke.points) > 1]
    if not strokes:
        return []
    lines = Polylines.of([stroke.points for stroke in strokes])
    once = np.array([stroke.kind in ONCE for stroke in strokes])
    left_out = (lines.length < SHORT) & (rng.random(len(strokes)) < style.dropout)
    chosen = np.flatnonzero(~left_out)
    again = style.passes > 1 or style.pull or style.breaks or style.overshoot
    if not len(chosen) or not (again or style.wobble or style.pressure):
        return [strokes[k] for k in chosen]
    owner, begin, end = _pieces(lines.length, chosen, once, style, rng)

    piece, along, starts = spread(end - begin, STEP)
    along = along + begin[piece]
    strength = np.concatenate([stroke.strength for stroke in strokes])
    points, strength = lines.at(owner[piece], along, strength)
    points += _beyond(lines, owner[piece], along)
    place = Polylines.joined(points, starts)
    if style.wobble:
        # Short lines are drawn with more care: a crease moved off its place is another crease.
        care = np.clip(place.length / SHORT, 0.4, 1.0)[piece, None]
        wander = drift(place.length, piece, place.along, WOBBLE_KNOTS, 2, rng)
        off = rng.normal(size=(len(owner), 2))[piece]
        points = points + style.wobble * care * (WANDERS * wander + LIES_OFF * off)
    if style.pressure:
        press = drift(place.length, piece, place.along, PRESSURE_KNOTS, 1, rng)[:, 0]
        strength = strength * (1 - style.pressure * np.clip(0.5 + 0.5 * press, 0, 1))
    out = []
    for k, (a, b) in enumerate(zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)):
        source = strokes[owner[k]]
        out.append(Stroke(points[a:b], strength[a:b], source.kind, source.width))
    return out


def _pieces(
    length: NDArray, chosen: NDArray, once: NDArray, style: Style, rng: np.random.Generator
) -> tuple[NDArray, NDArray, NDArray]:
    """Which line each mark follows (m,), and from which length along it to which (m,), (m,).

    Beginnings below 0 and ends beyond the line's length overshoot it.
    """
    owner = np.repeat(chosen, np.where(once[chosen], 1, style.passes))
    begin, end = np.zeros(len(owner)), length[owner]
    later = np.concatenate([[False], owner[1:] == owner[:-1]])
    short = later * rng.uniform(0, SHORTER, (2, len(owner))) * end
    begin, end = begin + short[0], end - short[1]
    if style.overshoot:
        most = np.minimum(style.overshoot, 0.2 * length[owner]) * ~once[owner]
        beyond = most * rng.random((2, len(owner))) ** 2
        begin, end = begin - beyond[0], end + beyond[1]
    if style.pull:
        count = np.maximum(np.round((end - begin) / style.pull), 1).astype(np.int64)
        count[once[owner]] = 1
        owner, begin, end, place = _cut(owner, begin, end, count, rng)
        overlap = OVERLAP * style.pull * rng.uniform(0.3, 1.7, (2, len(owner)))
        last = np.concatenate([place[1:] == 0, [True]])
        begin, end = begin - overlap[0] * (place > 0), end + overlap[1] * ~last
    if style.breaks:
        count = np.maximum(np.round((end - begin) / GAP), 1).astype(np.int64)
        whole = once[owner] | (count < 4)
        count[whole] = 1
        kept = np.repeat(whole, count) | (rng.random(count.sum()) >= style.breaks)
        owner, begin, end, place = _cut(owner, begin, end, count, None)
        # Cells that are kept next to each other are one mark again.
        joins = kept & np.concatenate([[False], kept[:-1]]) & (place > 0)
        first = np.flatnonzero(kept & ~joins)
        run = np.cumsum(kept & ~joins) - 1
        final = np.zeros(len(first))
        final[run[kept]] = end[kept]  # the last of each run is written last
        owner, begin, end = owner[first], begin[first], final
    return owner, begin, end


def _cut(
    owner: NDArray, begin: NDArray, end: NDArray, count: NDArray, rng: np.random.Generator | None
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Marks cut into `count` (m,) parts, unevenly if there is an rng; and each part's number."""
    which = np.repeat(np.arange(len(owner)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    jitter = rng.uniform(-0.3, 0.3, len(which)) if rng else np.zeros(len(which))
    low = (place + jitter * (place > 0)) / count[which]
    high = np.concatenate([low[1:], [1.0]])
    high[place == count[which] - 1] = 1.0
    size = (end - begin)[which]
    return owner[which], begin[which] + low * size, begin[which] + high * size, place


def _beyond(lines: Polylines, line: NDArray, along: NDArray) -> NDArray:
    """(m, 2) how far places beyond a line's ends lie from them, straight on in its direction."""
    over = np.maximum(along - lines.length[line], 0)
    under = np.maximum(-along, 0)
    first, last = lines.starts[:-1], lines.starts[1:] - 1
    reach = np.minimum(3, np.diff(lines.starts) - 1)
    ahead = lines.points[last] - lines.points[last - reach]
    behind = lines.points[first] - lines.points[first + reach]
    ahead, behind = (
        d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-9) for d in (ahead, behind)
    )
    return over[:, None] * ahead[line] + under[:, None] * behind[line]


def drift(
    length: NDArray,
    line: NDArray,
    along: NDArray,
    knots: float,
    columns: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Smooth noise along lines, (m, columns), about normal with standard deviation 1.

    length : (n,) of the lines;  line, along : (m,) the places asked for;  knots : pixels between
    the independent values that a quadratic B-spline smooths.
    """  # fmt: skip
    count = np.floor(length / knots).astype(np.int64) + 3
    values = rng.normal(size=(count.sum(), columns)) / 0.74  # the spline averages that much away
    t = along / knots
    cell = np.minimum(np.floor(t), count[line] - 3).astype(np.int64)
    f = np.clip(t - cell, 0, 1)[:, None]
    first = (np.cumsum(count) - count)[line] + cell
    return (
        0.5 * (1 - f) ** 2 * values[first]
        + (0.5 + f - f * f) * values[first + 1]
        + 0.5 * f * f * values[first + 2]
    )


def stroke_lists(
    strokes: Iterable[Stroke], digits: int = 1, step: float | None = None
) -> list[dict]:
    """Strokes as JSON knows them, for those who train on vectors rather than on pictures.

    Each is {"kind", "width": share of a line's width, "points": [[u, v], ...] in pixels,
    "strength": [0..1, ...]}; `stroke_of` makes it a Stroke again. With a `step` their points are
    spread anew, so many pixels apart or less, which keeps files small.
    """
    strokes = list(strokes)
    places = [np.asarray(stroke.points, float) for stroke in strokes]
    strengths = [np.asarray(stroke.strength, float) for stroke in strokes]
    if step and strokes:
        lines = Polylines.of(places)
        line, along, starts = spread(lines.length, step)
        points, strength = lines.at(line, along, np.concatenate(strengths))
        places, strengths = np.split(points, starts[1:-1]), np.split(strength, starts[1:-1])
    return [
        {
            "kind": stroke.kind,
            "width": round(float(stroke.width), 3),
            "points": np.round(points, digits).tolist(),
            "strength": np.round(strength, 2).tolist(),
        }
        for stroke, points, strength in zip(strokes, places, strengths, strict=True)
    ]


def stroke_of(stored: dict) -> Stroke:
    """The Stroke of one entry of `stroke_lists`; InputError if it is none."""
    try:
        points = np.array(stored["points"], float).reshape(-1, 2)
        strength = np.array(stored["strength"], float)
        stroke = Stroke(points, strength, str(stored["kind"]), float(stored["width"]))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"this is no stroke as stroke_lists writes them: {error!r}") from error
    if len(points) != len(strength) or not len(points):
        raise InputError(f"a stroke has {len(points)} points but {len(strength)} strengths")
    return stroke
