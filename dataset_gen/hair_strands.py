"""Strands of hair: in locks, brushed, as curls, plaited."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from facs_rig.hair.shell import WAVELENGTH, wave_phase
from facs_rig.hair.tails import PITCH, SLANT

from .hair_worn import Sheet, Worn
from .linework.strokes import LineSet

STRAND, MASS = "hair", "mass"  # kinds of strokes
STEPS = 18  # points of a strand
# Of each finish, pixels between strands, how many lie side by side in a lock, and their widths.
STRANDS = {
    "outline": ((25.0, 80.0), (1, 3), (0.7, 1.0)),
    "strands": ((4.0, 14.0), (1, 5), (0.6, 1.1)),
    "dense": ((2.0, 3.6), (2, 8), (0.6, 1.2)),
    "hatch": ((30.0, 90.0), (1, 3), (0.7, 1.0)),
    "brush": ((14.0, 40.0), (1, 4), (0.6, 1.2)),
}
SPREAD = (0.003, 0.012)  # metres between strands of a lock
LENGTH = (0.05, 0.17)  # metres of a strand
ROOTS, TIPS = 0.35, 0.4  # shares of strands that begin where hair begins, that end where it ends
LANE = (3.2, 1.2)  # pixels between the strokes of a brush: and as many widths of a line
SHINE = 0.75  # share of brushed hair that keeps a band of light


def strands(
    worn: Worn, sheet: Sheet, scale: float, rng: np.random.Generator, on_head: bool
) -> list[LineSet]:
    """Strands in locks: many begin at the parting or end at the edge, where hair is darkest."""
    gap, beside, widths = STRANDS[worn.hairdo.finish]
    low, high = LENGTH
    length = rng.uniform(low, high) * (0.6 if worn.hairdo.curl > 0.5 else 1.0)
    count = int(sheet.area.sum() * scale / (length * rng.uniform(*gap)))
    if count < 1:
        return []
    size = rng.integers(beside[0], beside[1] + 1, count)
    lock = np.repeat(np.arange(count), size)[:count]
    column, row = sheet.seeds(count, rng)
    rows = sheet.points.shape[1] - 1
    kind = rng.random(count)
    row = np.where(kind < ROOTS, rng.exponential(0.05, count) * rows, row)
    column, row, kind = column[lock], row[lock], kind[lock]
    place = np.stack([column, row], axis=-1)
    metres = sheet.at(sheet.metres, place[:, 0], place[:, 1])
    spread = rng.uniform(*SPREAD)
    column = column + rng.normal(0, spread, count) / np.maximum(metres[:, 0], 0.002)
    reach = length * rng.lognormal(0, 0.35, count) / metres[:, 1]
    ends = rows + rng.normal(0.15, 0.25, count)
    row = np.where((kind > 1 - TIPS), ends - reach * rng.uniform(0.3, 1, count), row)
    row = np.clip(row + rng.normal(0, 0.4, count), 0, rows - 1)
    stop = np.minimum(row + reach, ends)
    t = np.linspace(0, 1, STEPS)
    rows_at = row[:, None] + (stop - row)[:, None] * t
    lean = rng.normal(0, 0.25, count) + rng.normal(0, 0.9, count)[lock] / (1 + 2 * on_head)
    bow = rng.normal(0, 0.3, count)[lock][:, None] * np.sin(np.pi * t)
    column = column[:, None] + 0.5 * lean[:, None] * t**1.5 + 0.5 * bow
    column = column + _waved(worn, sheet, column, rows_at, rng)
    kept = (stop - row) * metres[:, 1] > 0.006
    faint = rng.uniform(0.25, 1.0, count)
    strength = 1 + (faint[:, None] - 1) * t
    width = rng.uniform(*widths, count)
    return [sheet.lines(STRAND, column[kept], rows_at[kept], strength[kept], width[kept])]


def _waved(
    worn: Worn, sheet: Sheet, column: NDArray, row: NDArray, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(n, k) columns that waves move strands aside: neighbours wave together."""
    wave = max(worn.cut.wave, 0.5 * worn.cut.curl)
    if not wave:
        return np.zeros(column.shape)
    metres = sheet.at(sheet.metres, column, row)
    down = row * metres[..., 1]
    azimuth = 2 * np.pi * column / len(sheet.points)
    phase = 2 * np.pi * down / WAVELENGTH + wave_phase(azimuth)
    rising = np.clip(down / 0.05, 0, 1)
    return 0.006 * wave * rising * np.sin(phase) / np.maximum(metres[..., 0], 0.004)


def brushed(sheet: Sheet, scale: float, pen: float, rng: np.random.Generator) -> LineSet:
    """Strokes of a full brush side by side along the hair, with a band of light left out."""
    columns, rows = sheet.points.shape[:2]
    gap = LANE[0] + LANE[1] * pen
    around = float(sheet.metres[..., 0].sum(axis=0).max())
    count = max(int(around * scale / gap), 8)
    column = (np.arange(count) + rng.normal(0, 0.15, count)) * columns / count
    t = np.linspace(0, 1, 2 * STEPS)
    row = (rows - 1 + rng.normal(0, 0.2, count)[:, None]) * t
    bend = 0.25 * np.sin(3 * t + rng.uniform(0, 6))
    strength = np.ones((count, len(t)))
    if rng.random() < SHINE:
        angle = 2 * np.pi * column / columns
        wander = np.sin(2 * angle + rng.uniform(0, 6)) + 0.6 * np.sin(5 * angle)
        middle = rng.uniform(0.25, 0.5) + 0.06 * wander + 0.04 * rng.normal(size=count)
        half = np.maximum(rng.uniform(0.03, 0.15) + 0.06 * rng.normal(size=count), 0)
        half = half * (np.sin(angle * rng.integers(1, 3) + rng.uniform(0, 6)) > -0.5)
        strength[np.abs(t - middle[:, None]) < half[:, None]] = 0
    width = np.full(count, 1.5 * gap / pen)
    return sheet.lines(MASS, column[:, None] + bend, row, strength, width)


def curls(sheet: Sheet, rng: np.random.Generator) -> list[LineSet]:
    """Open loops all over the surface."""
    size = rng.uniform(0.0055, 0.0115)
    count = int(sheet.area.sum() / (size**2 * rng.uniform(3.5, 16)))
    if count < 1:
        return []
    column, row = sheet.seeds(count, rng)
    metres = sheet.at(sheet.metres, column, row)
    turns = rng.choice([-1, 1], (count, 1)) * rng.uniform(0.3, 1.0, count)[:, None]
    angle = 2 * np.pi * (turns * np.linspace(0, 1, STEPS) + rng.random((count, 1)))
    shrink = np.linspace(1, 0.35, STEPS) * size * rng.uniform(0.6, 1.3, count)[:, None]
    wide = np.minimum(shrink / np.maximum(metres[:, :1], 0.002), 1.5)
    tall = np.minimum(shrink / metres[:, 1:], 1.5)
    around = column[:, None] + wide * np.cos(angle)
    down = np.clip(row[:, None] + tall * np.sin(angle), 0, sheet.points.shape[1] - 1)
    strength = np.ones(angle.shape) * rng.uniform(0.5, 1, count)[:, None]
    return [sheet.lines(STRAND, around, down, strength, rng.uniform(0.6, 1.0, count))]


def plaits(worn: Worn) -> list[LineSet]:
    """Where the strands of braids cross: see facs_rig.hair.tails."""
    sets = []
    for sheet, ball in zip(worn.sheets[1:], worn.cut.balls, strict=True):
        if not ball.plait:
            continue
        sides, rings = sheet.points.shape[:2]
        length = np.concatenate([[0.0], np.cumsum(sheet.metres[:, :, 1].mean(axis=0))])[:rings]
        turn = np.linspace(-np.pi / 2, np.pi / 2, STEPS)
        for side in (0.0, np.pi):
            aside = np.sin(turn + np.pi / 2 + side) * np.sign(np.cos(side) + 1e-9)
            pitch = PITCH * float(np.mean(ball.radius))
            count = int(length[-1] / pitch) + 1
            shift = 0.5 if side == 0 else 0.0
            begins = (np.arange(count) - shift)[:, None] * pitch
            down = begins + SLANT * pitch / np.pi * np.abs(aside)
            row = np.interp(down, length, np.arange(rings))
            column = np.broadcast_to((turn + np.pi / 2 + side) * sides / (2 * np.pi), row.shape)
            inside = (down > 0) & (down < length[-1])
            sets.append(
                sheet.lines(STRAND, column, row, inside * 1.0, np.full(count, 0.9))
            )  # fmt: skip
    return sets
