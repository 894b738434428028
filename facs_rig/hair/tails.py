"""Buns, tails and braids: closed tubes beside the shell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .cut import Ball
from .head import Head

PLAITED = 0.45  # share of its radius that a braid loses between two strands
PITCH = 1.7  # length of a crossing in radii
SLANT = 1.0  # radians of a crossing by which its strand is lower in the middle than at the side


def tail(head: Head, ball: Ball, sides: int = 16) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """A ball on a head: points (n, 3), quads (q, 4), uv (n, 2) and points by ring and side.

    sides : even
    """
    rings = (2 if ball.plait else 1) * sides * 4 // 3
    centre, radius, length = _centre_line(head, ball, rings)
    ahead = np.gradient(centre, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    outward = _outward(head, centre, ahead)
    aside = np.cross(outward, ahead)
    turn = 2 * np.pi * np.arange(sides) / sides
    wide = np.ones((rings, sides))
    if ball.plait:
        wide = _plaited(length, float(np.mean(radius)), turn)
    reach = radius[:, None] * wide
    across = np.cos(turn)[:, None] * outward[:, None] + np.sin(turn)[:, None] * aside[:, None]
    points = centre[:, None] + reach[..., None] * across
    ring = np.arange(rings * sides).reshape(rings, sides)
    on = np.roll(ring, -1, axis=1)
    around = np.stack([ring[:-1], ring[1:], on[1:], on[:-1]], axis=-1).reshape(-1, 4)
    # An end is closed by zipping its ring: side k to side -1 - k.
    zipped = np.arange(sides // 2 - 1)
    cap = np.stack([zipped, zipped + 1, sides - 2 - zipped, sides - 1 - zipped], axis=-1)
    quads = np.concatenate([around, ring[0][cap], ring[-1][cap][:, ::-1]])
    u = 1 - np.abs(1 - turn / np.pi)
    uv = np.stack(np.broadcast_arrays(u[None], (length / length[-1])[:, None]), axis=-1)
    return points.reshape(-1, 3), quads, uv.reshape(-1, 2), ring


def _centre_line(head: Head, ball: Ball, rings: int) -> tuple[NDArray, NDArray, NDArray]:
    """(m, 3) places along the middle of a ball, its radius (m,) and length so far (m,), metres.

    The radius shrinks to nothing at both ends, as a ball's does.
    """
    azimuth, height, off = ball.line.T
    metres = head.metres(height)
    crown = metres > 0.97 * head.above
    far = np.where(crown, 0.0, head.levels(head.axis, azimuth, metres)) + off
    knots = np.stack([np.sin(azimuth) * far, metres, np.cos(azimuth) * far], axis=-1)
    knots += [head.eyes[0], head.eyes[1], head.middle[2]]
    t = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    fine = np.linspace(0, 1, 8 * rings)
    line = _through(t / max(t[-1], 1e-9), np.column_stack([knots, ball.radius]), fine)
    walked = np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(walked)])
    ends = (1 - np.cos(np.linspace(0, np.pi, rings))) / 2
    # Rings are closer at the ends, which are round; between them evenly.
    want = length[-1] * (0.6 * np.linspace(0, 1, rings) + 0.4 * ends)
    out = np.stack([np.interp(want, length, column) for column in line.T], axis=-1)
    radius = out[:, 3]
    near = np.minimum(want / (radius[0] + 1e-9), (want[-1] - want) / (radius[-1] + 1e-9))
    round_ = np.sqrt(np.clip(1 - (1 - np.clip(near, 0, 1)) ** 2, 0.004, 1))
    return out[:, :3], radius * round_, want


def _through(t: NDArray, values: NDArray, at: NDArray) -> NDArray[np.float64]:
    """(m, d) a smooth curve through values (k, d) at t (k,): Catmull and Rom 1974."""
    slope = np.gradient(values, t, axis=0)
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    step = t[k + 1] - t[k]
    s = ((at - t[k]) / step)[:, None]
    a, b = values[k], values[k + 1]
    p, q = slope[k] * step[:, None], slope[k + 1] * step[:, None]
    return ((1 + 2 * s) * (1 - s) ** 2 * a + s * (1 - s) ** 2 * p
            + s**2 * (3 - 2 * s) * b + s**2 * (s - 1) * q)  # fmt: skip


def _outward(head: Head, centre: NDArray, ahead: NDArray) -> NDArray[np.float64]:
    """(m, 3) unit vectors away from the head's middle, across the line."""
    away = centre - head.middle
    away = away - np.einsum("mk,mk->m", away, ahead)[:, None] * ahead
    size = np.linalg.norm(away, axis=1, keepdims=True)
    spare = np.cross(ahead, [1.0, 0.0, 0.0])
    away = np.where(size > 1e-4, away, spare)
    return away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)


def _plaited(length: NDArray, radius: float, turn: NDArray) -> NDArray[np.float64]:
    """(m, s) shares of the radius: strands bulge to the left and to the right by turns, and run
    from the sides down to the middle."""
    aside = np.sin(turn)[None]
    phase = np.pi * length[:, None] / (PITCH * radius) - SLANT * np.abs(aside)
    bulge = np.abs(np.sin(phase + np.pi / 2 * (aside > 0))) ** 0.7
    return 1 - PLAITED * (1 - bulge) - 0.15 * np.cos(turn)[None] ** 2
