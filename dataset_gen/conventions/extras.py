"""What is worn or grows on a face: beards, moustaches, glasses."""

from __future__ import annotations

import numpy as np

from .artist import Artist
from .canvas import Canvas
from .eyes import Eye
from .head import sitter_ray
from .mouth import Mouth
from .shapes import smooth
from .sitter import RAYS, Sitter


def draw_glasses(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """Rims around both eyes, a bridge, and temples to the ears."""
    if artist.glasses == "none":
        return
    rng = canvas.rng
    power = {"round": 1.0, "square": 0.35, "half": 0.6, "dark": 0.6}[artist.glasses]
    t = np.linspace(0, 2 * np.pi, 41)
    c, s = (np.sign(f) * np.abs(f) ** power for f in (np.cos(t), np.sin(t)))
    wide, tall = rng.uniform(0.72, 0.95), rng.uniform(0.5, 0.8)
    width = float(rng.choice([0.8, 1.0, 1.6]))
    ends = {}
    for side in ("left", "right"):
        eye = Eye(sitter, artist, side)
        span = eye.width * wide / max(artist.eyes, 1)
        middle = eye.middle + 0.03 * sitter.unit * sitter.down
        rim = (
            middle
            + span * c[:, None] * eye.across
            + 0.28 * sitter.unit * tall * s[:, None] * eye.along
        )
        if not eye.seen:
            ends[side] = middle
            continue
        if artist.glasses == "dark":
            canvas.blacken(rim, 0.8)
            canvas.line("glasses", rim, width)
            canvas.cover(rim)
        elif artist.glasses == "half":
            canvas.line("glasses", rim, width, seen=(rim - middle) @ eye.along > -0.1)
        else:
            canvas.line("glasses", rim, width)
        ends[side] = middle - span * eye.across
        if side in sitter.ears:
            outer = middle + span * eye.across
            ear = sitter.ears[side]
            hook = ear[np.argmin(np.linalg.norm(ear - outer, axis=1))]
            hook = hook - 0.1 * sitter.unit * sitter.down
            canvas.line("glasses", np.stack([outer, (outer + hook) / 2, hook]), width)
    a, b = ends["left"], ends["right"]
    bow = (a + b) / 2 - rng.uniform(0.02, 0.08) * sitter.unit * sitter.down
    canvas.line("glasses", smooth(np.stack([a, bow, b]), 9), width)


def draw_moustache(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    if artist.moustache == "none":
        return
    rng = canvas.rng
    lip = Mouth(sitter).outer_upper
    base = sitter.mark("nose_base")
    middle = lip[len(lip) // 2]
    height = 0.45 * (middle - base)
    over = rng.uniform(0.0, 0.12)
    unit, drop = sitter.unit, rng.uniform(-0.03, 0.06, 2)
    ends = [
        lip[k] + unit * (way * over * sitter.right + d * sitter.down)
        for k, way, d in ((0, -1, drop[0]), (-1, 1, drop[1]))
    ]
    top = smooth(
        np.stack(
            [
                ends[0],
                lip[9] - 0.75 * height,
                middle - 0.9 * height,
                lip[-10] - 0.75 * height,
                ends[1],
            ]
        ),
        31,
    )
    hem = smooth(
        np.stack(
            [
                ends[0],
                lip[9] - 0.1 * height,
                middle - 0.25 * height,
                lip[-10] - 0.1 * height,
                ends[1],
            ]
        ),
        31,
    )
    canvas.mark("beard", np.concatenate([top, hem[::-1]]))
    if artist.moustache == "line":
        canvas.line("beard", (top + hem) / 2, 1.8)
    elif artist.moustache == "black":
        canvas.fill(np.concatenate([top, hem[::-1]]))
    else:
        for k in np.linspace(1, 29, int(rng.integers(16, 36))).astype(int):
            way = np.sign(k - 15) * 0.05 * sitter.unit * sitter.right
            tip = hem[k] + way * rng.uniform(0.3, 1.2)
            canvas.line(
                "beard",
                np.stack([top[k], (top[k] + tip) / 2, tip]),
                0.9,
                np.array([0.8, 1, 0.5]),
                within=True,
            )


def draw_beard(canvas: Canvas, sitter: Sitter, artist: Artist) -> None:
    """A beard between the jaw and a line over cheeks and mouth."""
    if artist.beard == "none":
        return
    rng = canvas.rng
    mouth = Mouth(sitter)
    begin, end = sitter_ray(sitter, 1), sitter_ray(sitter, -1)
    low = np.arange(begin + 1, end) % RAYS
    if artist.beard == "goatee":
        cut = len(low) // 3
        low = low[cut:-cut]
    long = rng.uniform(0, 0.25) if artist.beard in ("hairs", "black", "outline", "goatee") else 0.0
    jaw = smooth(sitter.face[low], 40)
    sag = np.sin(np.linspace(0, np.pi, 40))[:, None] ** 1.5
    hem = jaw + long * sag * sitter.unit * sitter.down
    # From the right ear over the cheek, under the lip, to the left one.
    corner = [
        mouth.line[k] + way * 0.1 * sitter.unit * sitter.right for k, way in ((-1, 1), (0, -1))
    ]
    chin = mouth.outer_lower[len(mouth.outer_lower) // 2] + 0.06 * sitter.unit * sitter.down
    knots = [hem[0], 0.55 * hem[0] + 0.45 * corner[0], corner[0], chin, corner[1],
             0.55 * hem[-1] + 0.45 * corner[1], hem[-1]]  # fmt: skip
    top = smooth(np.stack(knots), 40)
    shape = np.concatenate([hem, top[::-1]])
    canvas.mark("beard", shape)
    if artist.beard == "black":
        canvas.blacken(shape, float(rng.uniform(1.0, 2.1)))
        canvas.line("beard", hem, 1.0)
    elif artist.beard == "outline":
        ripple = 0.02 * sitter.unit * np.sin(np.linspace(0, rng.uniform(20, 60), 80))
        canvas.line("beard", smooth(hem, 80) + ripple[:, None] * sitter.down, 1.0)
        canvas.line("beard", smooth(top[::3], 40), 0.8)
    else:
        count = int(rng.integers(60, 150))
        size = 0.03 if artist.beard == "stubble" else rng.uniform(0.07, 0.16)
        middle = sitter.face.mean(axis=0)
        for _ in range(count):
            k, depth = int(rng.integers(0, 40)), rng.uniform(0, 1) ** 0.7
            root = top[k] + depth * (hem[k] - top[k])
            away = (root - middle) / sitter.unit
            aside = 0.35 * (away @ sitter.right) + 0.15 * rng.normal()
            reach = size * sitter.unit * rng.uniform(0.6, 1.3)
            tip = root + reach * (sitter.down + aside * sitter.right)
            canvas.line(
                "beard",
                np.stack([root, (root + tip) / 2, tip]),
                0.8,
                np.array([0.9, 1, 0.5]),
                loose=0.0,
            )
