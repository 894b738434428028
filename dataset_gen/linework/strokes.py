"""Strokes: what a drawing consists of, and how they are cut out of longer lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

CLOSED = 2.0  # pixels: gaps in a line that are shorter are drawn over
SAME = 1e-6  # pixels between the ends of a closed line
SHORTEST = 3.0  # pixels: strokes that are shorter are left out


@dataclass(frozen=True)
class Stroke:
    """One line of a drawing.

    points : (k, 2) float, pixels (u, v)        strength : (k,) float 0..1, fading toward 0
    kind : one of lines.KINDS or the layer it belongs to        width : share of a line's width
    surface : the point of the face under each vertex, as the index of its triangle (k,) and its
    barycentric weights (k, 3); None for lines that stand off the face
    """

    points: NDArray
    strength: NDArray
    kind: str
    width: float = 1.0
    surface: tuple[NDArray, NDArray] | None = None


@dataclass(frozen=True)
class LineSet:
    """Lines on or above a posed face, whole: what is hidden is still to be cut away.

    points : (m, 3) metres, of one line after another        starts : (lines + 1,) into them
    strength : (m,), drawn where above 0        width : (lines,)
    normals : (m, 3) the way out of the surface under the line, 0 for lines off the face; longer
    than 1 where the line has to be looked for higher above it
    shown : (m,) bool, whether a point can be seen at all, by what is known of the surface there
    """

    kind: str
    points: NDArray
    starts: NDArray
    strength: NDArray
    width: NDArray
    normals: NDArray
    shown: NDArray
    surface: tuple[NDArray, NDArray] | None = None


def cut(sets: Sequence[LineSet], pixels: NDArray, seen: NDArray, nearly: NDArray) -> list[Stroke]:
    """The parts of lines that are seen (m,) and have strength, as strokes.

    pixels : (m, 2), of the points of one set after another
    nearly : (m,) bool, what is seen or almost

    Gaps shorter than CLOSED are no gaps, nor are those that are nearly seen all along; what is
    left and shorter than SHORTEST is no stroke: no line is dotted.
    """
    if len(pixels) < 2:
        return []
    offset = np.cumsum([0, *(len(lines.points) for lines in sets)])
    owner = np.repeat(np.arange(len(sets)), [len(lines.starts) - 1 for lines in sets])
    width = np.concatenate([lines.width for lines in sets])
    strength = np.concatenate([lines.strength for lines in sets])
    begins = [lines.starts[:-1] + k for lines, k in zip(sets, offset[:-1], strict=True)]
    starts = np.concatenate([*begins, offset[-1:]]).astype(np.int64)
    order = _from_a_gap(starts, strength > 0, pixels, seen, nearly)
    if order is not None:
        pixels, strength = pixels[order], strength[order]
        seen, nearly = seen[order], nearly[order]
    step = np.zeros(len(pixels))
    step[1:] = np.sqrt(np.einsum("ij,ij->i", *(np.diff(pixels, axis=0),) * 2))
    way = np.cumsum(step)
    line = np.repeat(np.arange(len(owner)), np.diff(starts))

    first, last = runs(~seen, line)
    inner = (first > starts[line[first]]) & (last < starts[line[first] + 1] - 1)
    first, last = first[inner], last[inner]
    deep = np.cumsum(~nearly)
    short = (way[last + 1] - way[first - 1] < CLOSED) | (deep[last] == deep[first - 1])
    seen = seen.copy()
    for a, b in zip(first[short].tolist(), last[short].tolist(), strict=True):
        seen[a : b + 1] = True
    first, last = runs(seen & (strength > 0), line)
    long = (last > first) & (way[last] - way[first] > SHORTEST)
    out = []
    for a, b in zip(first[long].tolist(), last[long].tolist(), strict=True):
        lines, start = sets[owner[line[a]]], offset[owner[line[a]]]
        part = slice(a - start, b + 1 - start) if order is None else order[a : b + 1] - start
        surface = None
        if lines.surface is not None:
            surface = lines.surface[0][part], lines.surface[1][part]
        out.append(
            Stroke(
                pixels[a : b + 1], strength[a : b + 1], lines.kind, float(width[line[a]]), surface
            )
        )
    return out


def _from_a_gap(
    starts: NDArray, strong: NDArray, pixels: NDArray, seen: NDArray, nearly: NDArray
) -> NDArray | None:
    """An order of the points in which closed lines start where they are well hidden.

    None where no line has to be turned.
    """
    drawn = seen & strong
    a, b = starts[:-1], starts[1:] - 1
    closed = (b - a > 2) & (np.abs(pixels[a] - pixels[b]) < SAME).all(axis=1)
    closed[closed] = nearly[a[closed]]
    order = np.arange(len(pixels))
    for k in np.flatnonzero(closed):
        for gap in (np.flatnonzero(~nearly[a[k] : b[k]]), np.flatnonzero(~drawn[a[k] : b[k]])):
            if len(gap):  # the point that closes the line is the one that it now starts with
                turned = np.roll(np.arange(a[k], b[k]), -gap[0])
                order[a[k] : b[k] + 1] = np.append(turned, turned[0])
                break
    return order if closed.any() else None


def runs(flag: NDArray, line: NDArray) -> tuple[NDArray, NDArray]:
    """First and last places of runs of True that do not go on from one line to the next."""
    cut = np.flatnonzero(np.diff(line))
    begins, ends = flag.copy(), flag.copy()
    begins[1:] &= ~flag[:-1]
    ends[:-1] &= ~flag[1:]
    begins[cut + 1] = flag[cut + 1]
    ends[cut] = flag[cut]
    return np.flatnonzero(begins), np.flatnonzero(ends)
